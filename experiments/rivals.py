# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Other methods on the same scans: which, and on what."""
import dataclasses
import json

import plan
import runs
import sites
from learning import degraded_maps

SITES = ("intel", "fr079", "mit_csail", "mit_killian", "fr_campus")  # real scans, recorded by robots
DRIVE_FRAMES = 40  # [-] of a drive, as in programs/drives.h
MOST_DRIVES = 20  # [-] of a site
SMEARED = ("coarse=0.1", "smeared=0.15")  # words of learning/degraded_maps.py
SEED = 1


@dataclasses.dataclass(frozen=True)
class Method:
    """What a rival is, and what it asks for besides map and scans."""
    title: str
    paper: str
    settings: str
    keyframes: bool = False  # needs the scans that built the map, and does not look at the map itself
    config: str = ""  # the ini file of that name that it reads
    baseline: bool = False  # plain loops: runs on the clean full circles only, where it takes its time


FLIRT = ("FLIRTlib's defaults: 5 scales from 0.2 m by 1.4, least peak 0.34, beta grids of 4 x 12 cells and 0.5 m, symmetric "
         "chi-squared distance below 0.4, inliers within 0.245 m. All pairs of matches are tried instead of 18 drawn ones. ")
METHODS = {
    "exhaustive": Method(
        "exhaustive likelihood field", "Thrun, Burgard and Fox 2005, 6.4 and 8.2",
        "The book's grid of 0.15 m and 5 deg; AMCL's mixture (0.95 and 0.05, 0.2 m, up to 2 m) and 30 beams."),
    "branch-and-bound": Method(
        "branch and bound", "Hess et al. 2016",
        "Cartographer's defaults: depth 7, voxels of at most 0.9 m, 100 points, 50 m; the window is the whole map; its "
        "least score of 0.6 is left out."),
    "bag-of-words": Method(
        "FLIRT, bag of words", "Tipaldi and Arras 2010; Sivic and Zisserman 2003",
        FLIRT + "tf-idf and cosine; 50 keyframes are aligned, and the words are learned from 1,000 descriptors by 30 rounds of "
        "k-means, as in GFLIP; 100 words are our choice.", keyframes=True),
    "phrases": Method(
        "geometrical FLIRT phrases", "Tipaldi, Spinello and Burgard 2013",
        "The same keypoints and words; phrases of 2 words and 50 keyframes, GFLIP's defaults.", keyframes=True),
    "glare": Method(
        "GLARE", "Himstedt et al. 2014",
        "The same keypoints; 8 directions and 50 distances of 0.2 m, as in the public code of GLAROT's authors; L1 at the "
        "best of 8 rotations; 50 keyframes are aligned.", keyframes=True),
    "filter": Method(
        "particle filter after one scan", "Fox 2003; MRPT's filter",
        "AMCL's defaults: 100 to 5,000 particles, error 0.01, quantile 0.99, 30 beams, odometry 0.2; uniform start."),
    "literal": Method(
        "published method as plain loops", "Wang et al. 2021",
        "Table II; map and scans are read as `config/paper.ini` says; compiled with the same flags as all else. It runs on the "
        "clean full circles only.", config="paper", baseline=True),
    "paper": Method(plan.TITLES["paper"], "Wang et al. 2021", "`config/paper.ini`, Table II.", config="paper"),
    "default": Method(plan.TITLES["default"], "this library", "`config/default.ini`.", config="default"),
}


@dataclasses.dataclass(frozen=True)
class Condition:
    """A column of the table."""
    title: str
    scans: str
    blocked: float = 0.0  # [-] share of the view
    smeared: bool = False  # the map


CONDITIONS = {
    "real": Condition("real 180 deg scans", "test"),
    "clean": Condition("full circles, clean", "sim360_off"),
    "blocked": Condition("full circles, 20 % blocked", "sim360_off", blocked=0.2),
    "270": Condition("270 deg", "sim270_off"),
    "smeared": Condition("real scans, smeared map", "test", smeared=True),
}


@dataclasses.dataclass(frozen=True)
class RivalJob:
    """A method on some scans of a site."""
    site: sites.Site
    condition: str
    method: str
    frames: int

    uses = ("alter", "rivals")  # programs
    map_site = None

    @property
    def scans(self):
        return CONDITIONS[self.condition].scans

    @property
    def position(self):
        """[m] greatest error of a success."""
        return plan.position_limit(self.scans)

    @property
    def name(self):
        return "-".join(("rival", self.site.name, self.condition, self.method, f"n{self.frames}"))

    def run(self, runner, folder):
        """RivalResult"""
        condition = CONDITIONS[self.condition]
        scans, out = folder / "in.rawlog", folder / "frames.csv"
        runner.call("alter", self.site.folder / f"{self.scans}.rawlog", scans, f"frames={self.frames}",
                     f"blocked={condition.blocked}")
        yaml = smear_map(self.site.map(self.scans), folder) if condition.smeared else self.site.map(self.scans)
        method = METHODS[self.method]
        words = ["d2s1r" if self.method in plan.CONFIGS else self.method, yaml, scans, out]
        if method.config:
            words.append(f"config={runner.configs / method.config}.ini")
        if method.keyframes:
            words += keyframes_of(self.site, self.scans)
        told = json.loads(runner.call("rivals", *words))
        return RivalResult(runs.read_frames(out, self), told["memory_mb"], told["preparation_s"])


@dataclasses.dataclass
class RivalResult:
    frames: list
    memory: float  # [MB] peak of the program
    preparation: float  # [s] of processor time before the first scan


@dataclasses.dataclass(frozen=True)
class DriveJob:
    """The particle filter along parts of a run, as in the paper's Fig. 7."""
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


def all_jobs(found, frames):
    """Jobs of all rivals on those of SITES that are there; none if `frames` is 0."""
    present = [site for site in found if site.name in SITES] if frames else []
    jobs = [RivalJob(site, condition, method, frames)
            for site in present for condition, of in CONDITIONS.items() if site.has(of.scans)
            for method, kind in METHODS.items() if can_run(site, of, kind)]
    drives = [DriveJob(site, start, drives_of(site, frames)) for site in present if site.has("run")
              for start in ("near", "anywhere")]
    return jobs + drives


def can_run(site, condition, method):
    if method.keyframes and (condition.smeared or not keyframes_of(site, condition.scans)):
        return False
    return not method.baseline or condition is CONDITIONS["clean"]


def drives_of(site, most):
    """[-] drives of a run that share no frame, at most `most` and MOST_DRIVES; their starts are evenly spread."""
    return min(most, MOST_DRIVES, max(1, (len(site.truth("run")) - DRIVE_FRAMES) // DRIVE_FRAMES))


def keyframes_of(site, scans):
    """Words for the program: which scans built the map; none if they are not there."""
    built_by = "run" if scans == "test" else "sim360_on"
    if not site.has(built_by):
        return []
    part = "all" if scans != "test" else "even" if site.name == "fr_campus" else "first_half"
    return [f"keyframes={site.folder / built_by}.rawlog", f"truth={site.truth_file(built_by)}", f"part={part}"]


def smear_map(yaml, folder):
    degraded_maps.save_map(degraded_maps.degrade(degraded_maps.load_map(yaml), SMEARED, SEED), folder, "smeared")
    return folder / "smeared.yaml"
