# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Which runs the report is made of."""
import dataclasses
import math

import runs
import sites

CONFIGS = ("paper", "default")
FIELDS_OF_VIEW = (360, 270, 180, 120, 90)  # [deg]
BLOCKED = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)  # [-] share of the view
REACHES = (3.5, 5, 8, 12, 30)  # [m] of the sensor
USUAL = {"field_of_view": 360, "blocked": 0.0, "reach": 30}  # unaltered scans; 30 m stands for all that were recorded
WINDOW = 10  # [-] frames


TITLES = {"paper": "published method, our implementation", "default": "d2s1r"}


def position_limit(scans):
    """[m] greatest error of a success: as in the paper, but real truth is not that exact."""
    return 0.2 if scans in sites.SIMULATED else 0.3


@dataclasses.dataclass(frozen=True)
class Job:
    """One run of rawlog-localize."""
    site: sites.Site
    scans: str
    config: str
    frames: int
    field_of_view: int = USUAL["field_of_view"]  # [deg] to which scans are cropped
    blocked: float = USUAL["blocked"]  # [-]
    reach: float = USUAL["reach"]  # [m] beyond which nothing is seen
    window: int = 0  # [-] frames that are judged together; 0: each alone
    map_site: sites.Site = None  # whose map; None: of the scans' own site

    uses = ("alter", "localize")  # programs

    @property
    def map(self):
        return (self.map_site or self.site).map(self.scans)

    @property
    def position(self):
        return position_limit(self.scans)

    @property
    def name(self):
        words = [self.site.name, self.scans, self.config]
        words += [f"fov{self.field_of_view}"] if self.field_of_view != USUAL["field_of_view"] else []
        words += [f"reach{self.reach}"] if self.reach != USUAL["reach"] else []
        words += [f"blocked{round(100 * self.blocked)}"] if self.blocked else []
        words += [f"window{self.window}"] if self.window else []
        words += [f"n{self.frames}"]
        words += ["in", self.map_site.name] if self.map_site else []
        return "-".join(words)

    def run(self, runner, folder):
        """[Frame]"""
        rawlog = self.site.folder / f"{self.scans}.rawlog"
        more = ["--frames", f":{self.frames}", "--window", str(self.window)]
        if not self.window:
            altered = folder / "in.rawlog"
            reach = self.reach if self.reach < USUAL["reach"] else math.inf
            runner.call("alter", rawlog, altered, f"frames={self.frames}", f"field_of_view={self.field_of_view}",
                         f"blocked={self.blocked}", f"reach={reach}")
            rawlog, more = altered, []
        runner.call("localize", "-q", "-m", self.map, "-i", rawlog, "-o", folder, "-c",
                     runner.configs / f"{self.config}.ini", *more)
        return runs.read_frames(folder / "frames.csv", self)


def widest(site, scans):
    """[deg] field of view of a set."""
    return 360 if scans in sites.SIMULATED or site.name in sites.FULL_CIRCLES else 180


def swept(site, frames):
    """Jobs of the curves: narrower and narrower, more and more blocked, of shorter and shorter reach."""
    for config in CONFIGS:
        for scans in ("sim360_off", "test"):
            if not site.has(scans):
                continue
            for field_of_view in FIELDS_OF_VIEW:
                if field_of_view <= widest(site, scans):
                    yield Job(site, scans, config, frames, field_of_view=field_of_view)
        if site.has("sim360_off"):
            for blocked in BLOCKED:
                yield Job(site, "sim360_off", config, frames, blocked=blocked)
    for scans in ("sim360_off", "test"):
        if site.has(scans):
            for reach in REACHES:
                yield Job(site, scans, "default", frames, reach=reach)


def all_jobs(found, frames, sweep_frames):
    jobs = []
    real = [site for site in found if site.has("test") and site.name not in sites.AGAIN]
    for site in found:
        for scans in ("test",) if site.name in sites.MORE else sites.SIMULATED + ("test",):
            if site.has(scans):
                jobs += [Job(site, scans, config, frames) for config in CONFIGS]
        if site.name not in sites.AGAIN + sites.MORE:
            jobs += swept(site, sweep_frames)
        if site.has("run"):
            jobs.append(Job(site, "run", "default", frames, window=WINDOW))
    for site in real:
        jobs += [Job(site, "test", "default", frames, map_site=other) for other in real if other != site]
    return list(dict.fromkeys(jobs))
