# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Simulated full circles: put together by a robot that turns in place, and along drives in a corridor."""
import dataclasses

import particle_filter
import plan
import runs
import sites
import tables

CORRIDORS = ("mit_killian",)  # sites whose corridors are ambiguous, as in the paper's Fig. 8
TURNED = (180, 90)  # [deg] fields of view of the robot that turns in place
SETTLED = 10  # [-] first frames of a drive, while the filter may still look for the robot
PAPER = (0.2, 5)  # [m, deg] a success


@dataclasses.dataclass(frozen=True)
class TurnedJob:
    """Scans of a narrow laser, put together while the robot turns once at the places of sim360_off."""
    site: sites.Site
    config: str
    field_of_view: int  # [deg]
    frames: int

    uses = ("circles", "localize")  # programs
    scans = "sim360_off"
    position = PAPER[0]  # [m]
    map_site = None

    @property
    def name(self):
        return "-".join(("turned", self.site.name, self.config, f"fov{self.field_of_view}", f"n{self.frames}"))

    def run(self, runner, folder):
        """[Frame]"""
        scans = folder / "in.rawlog"
        yaml = self.site.map(self.scans)
        runner.call("circles", yaml, self.site.truth_file(self.scans), scans, f"frames={self.frames}",
                     f"field_of_view={self.field_of_view}")
        ini = runner.configs / f"{self.config}.ini"
        runner.call("localize", "-q", "-m", yaml, "-i", scans, "-o", folder, "-c", ini, "--index", runner.index_of(yaml, ini))
        return runs.read_frames(folder / "frames.csv", self)


@dataclasses.dataclass(frozen=True)
class FollowedJob:
    """Drives of full circles along a run, each scan alone and fused with a particle filter that has no other motion."""
    site: sites.Site
    config: str
    drives: int

    uses = ("circles", "localize", "plugin")  # programs
    scans = "run"
    position = PAPER[0]  # [m]
    map_site = None

    @property
    def name(self):
        return "-".join(("followed", self.site.name, self.config, f"n{self.drives}"))

    def run(self, runner, folder):
        """[([Frame] of each scan alone, [Frame] of the fusion) of a drive]"""
        scans, yaml, ini = folder / "circles.rawlog", self.site.folder / "map.yaml", runner.configs / f"{self.config}.ini"
        runner.call("circles", yaml, self.site.truth_file("run"), scans)
        length, every = particle_filter.FRAMES, len(self.site.truth("run"))
        drives = []
        for drive in range(self.drives):
            first = drive * max(0, every - length) // self.drives
            out = folder / f"drive{drive}"
            runner.call("localize", "-q", "-m", yaml, "-i", scans, "-o", out, "-c", ini, "--index", runner.index_of(yaml, ini), "--fuse",
                        "--motion", "pseudo", "--frames", f"{first}:{first + length}")
            drives.append((runs.read_frames(out / "frames.csv", self), runs.read_frames(out / "fused.csv", self)))
        return drives


def all_jobs(found, sweep_frames, drives):
    jobs = [TurnedJob(site, config, field_of_view, sweep_frames) for site in found if site.has("sim360_off")
            for config in plan.CONFIGS for field_of_view in TURNED]
    return jobs + [FollowedJob(site, config, particle_filter.drives_of(site, drives)) for site in found
                   if site.name in CORRIDORS and site.has("run") and drives for config in plan.CONFIGS]


def turning(results):
    turned = {(job.site.name, job.field_of_view, job.config): frames for job, frames in results.items() if isinstance(job, TurnedJob)}
    rows = []
    for name in sorted({name for name, _, _ in turned}):
        cells = [tables.best_marked([tables.success_cell(turned[name, field_of_view, config]) for config in plan.CONFIGS], max)
                 for field_of_view in TURNED]
        rows.append([name, *sum(cells, [])])
    columns = [f"{title}, {field_of_view} deg" for field_of_view in TURNED for title in tables.TITLES]
    return tables.table(
        "A narrow sensor that turns in place (Section III-C)",
        "[%] success within 0.2 m and 5 deg at places of `sim360_off`, in brackets the 95 % interval. The paper's "
        "remedy for narrow sensors, which it does not measure: the robot turns once about itself, a scan every 10 deg, and "
        "`ScanAccumulator` puts the scans together by the odometry, which misjudges the turn by 1 % (standard deviation); "
        "the laser is 0.1 m ahead of the middle of the robot, its noise 0.01 m. Single scans at the same places, "
        "of the sites that it has: the table of the field of view.", ["site", *columns], rows)


def following(results):
    """Fig. 8."""
    rows, below = [], []
    for job, drives in results.items():
        if not isinstance(job, FollowedJob):
            continue
        alone = [frame.is_within(*PAPER) for frames, _ in drives for frame in frames]
        fused = [frame.is_within(*PAPER) for _, frames in drives for frame in frames]
        settled = [frame.is_within(*PAPER) for _, frames in drives for frame in frames[SETTLED:]]
        alone_later = [frame.is_within(*PAPER) for frames, _ in drives for frame in frames[SETTLED:]]
        whole = [all(frame.is_within(*PAPER) for frame in frames[SETTLED:]) for _, frames in drives]
        if sum(fused) < sum(alone):
            below.append(plan.TITLES[job.config])
        rows.append([job.site.name, plan.TITLES[job.config], str(len(alone)),
                     *(tables.share_of(flags) for flags in (alone, fused, alone_later, settled)),
                     f"{sum(whole)} of {len(whole)}"])
    return tables.table(
        "Corridors: each scan alone and fused (Fig. 8, Section IV-B.6)",
        "[%] of the frames within the paper's 0.2 m and 5 deg, in brackets the 95 % interval. Full circles simulated "
        "at the recorded poses of `run` in the infinite corridor of MIT, about 1 m apart (noise 0.01 m), in drives of "
        f"{particle_filter.FRAMES} frames that share none. The filter (`--fuse --motion pseudo`) starts from the hypotheses of the first "
        "scan and is moved by the poses of the scans, which is the paper's pseudo-odometry; it has no other motion. "
        f"Settled: from the {SETTLED + 1}th frame of a drive on. Published: all samples of one drive in one corridor, whose "
        "number is not told; D2S1R and AMCL alone fail there, without figures. AMCL alone: the table of its convergence." +
        (f" The fusion is worse than each scan alone: {'; '.join(below)}." if below else ""),
        ["site", "method", "frames", "each scan alone", "fused", "alone, settled", "fused, settled",
         "drives without an error, fused, settled"], rows)
