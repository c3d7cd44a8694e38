# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""The particle filter along parts of a run, as in the paper's Fig. 7."""
import dataclasses
import math

import measures
import runs
import sites
import tables

SITES = ("intel", "fr079", "mit_csail", "mit_killian", "fr_campus")
FRAMES = 40  # [-] of a drive, as in programs/drives.h
MOST_DRIVES = 20  # [-] of a site
CONVERGED = (0.2, 10)  # [m, deg] as in the paper's Section IV-B.1


@dataclasses.dataclass(frozen=True)
class DriveJob:
    """Drives of a site from one kind of start."""
    site: sites.Site
    start: str  # near or anywhere
    drives: int

    uses = ("rivals",)  # programs
    position = 0.3  # [m]
    map_site = None
    scans = "run"

    @property
    def name(self):
        return "-".join(("drives", self.site.name, self.start, f"n{self.drives}"))

    def run(self, runner, folder):
        """[[Frame] of a drive]"""
        file = folder / "drives.csv"
        runner.call("rivals", "drives", self.site.folder / "map.yaml", self.site.folder / "run.rawlog", file,
                    f"truth={self.site.truth_file('run')}", f"start={self.start}", f"drives={self.drives}")
        drives = {}
        for row, frame in runs.read_rows(file, self):
            drives.setdefault(row["drive"], []).append(frame)
        return list(drives.values())


def all_jobs(found, drives):
    """Jobs of those of SITES that are there; none if `drives` is 0."""
    return [DriveJob(site, start, drives_of(site, drives)) for site in found if site.name in SITES and site.has("run") and drives
            for start in ("near", "anywhere")]


def drives_of(site, most):
    """[-] drives of a run that share no frame, at most `most` and MOST_DRIVES; their starts are evenly spread."""
    return min(most, MOST_DRIVES, max(1, (len(site.truth("run")) - FRAMES) // FRAMES))


def is_converged(frame):
    return frame.is_within(*CONVERGED)


def driven(drive, until):
    """[m] along the truth."""
    places = [frame.truth for frame in drive[:until + 1]]
    return sum(math.dist(a[:2], b[:2]) for a, b in zip(places, places[1:]))


def convergence(results):
    """Fig. 7."""
    rows = []
    for job, drives in results.items():
        if not isinstance(job, DriveJob):
            continue
        firsts = [next((i for i, frame in enumerate(drive) if is_converged(frame)), None) for drive in drives]
        reached = [(drive, first) for drive, first in zip(drives, firsts) if first is not None]
        last = [is_converged(drive[-1]) for drive in drives]
        rows.append([job.site.name, {"near": "0.3 m, 0.3 m, 30 deg off", "anywhere": "uniform"}[job.start],
                     f"{tables.share_of(first is not None for first in firsts)} of {len(drives)}", tables.share_of(last),
                     tables.number(measures.mean(first + 1 for _, first in reached), 1),
                     tables.number(measures.mean(driven(drive, first) for drive, first in reached), 1)])
    return tables.table(
        "Convergence of the particle filter (Fig. 7, Section IV-B.1)",
        "MRPT's filter with AMCL's settings and odometry on drives of 40 frames of run.rawlog in map.yaml, their starts "
        "evenly spread; no two drives share a frame. How many [%] came within 0.2 m and 10 deg at all, and were there at the "
        "end, in brackets the 95 % interval; after how many scans and how far a drive [m], on average of those. "
        "Published, AMCL from such a guess: 20 of 20, in 2.0 to 11.0 s, 4.4 s on average; without a guess it fails (no "
        "figure). d2s1r needs one scan and no drive: the rows of `test` in the table of all sets.",
        ["site", "start", "reached", "at the end", "scans", "m"], rows)
