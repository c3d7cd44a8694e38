# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Other methods on the same scans: which, on what, and what came of it."""
import dataclasses
import json
import math
import re
import shutil

import measures
import plan
import runs
import sites
import tables

SITES = ("intel", "fr079", "mit_csail", "mit_killian", "fr_campus")  # real scans, recorded by robots
DRIVE_FRAMES = 40  # [-] of a drive: so many drives that none shares frames with another
CONVERGED = (0.2, 10)  # [m, deg] as in the paper's Section IV-B.1


@dataclasses.dataclass(frozen=True)
class Method:
    """What a rival is, and what it asks for besides map and scans."""
    title: str
    paper: str
    keyframes: bool = False  # needs the scans that built the map, and does not look at the map itself


METHODS = {
    "exhaustive": Method("exhaustive likelihood field", "Thrun, Burgard and Fox 2005: 0.15 m, 5 deg; AMCL's mixture"),
    "branch-and-bound": Method("branch and bound", "Hess et al. 2016; Cartographer's depths and voxels"),
    "bag-of-words": Method("FLIRT, bag of words", "Tipaldi and Arras 2010; Sivic and Zisserman 2003", True),
    "phrases": Method("geometrical FLIRT phrases", "Tipaldi, Spinello and Burgard 2013", True),
    "glare": Method("GLARE", "Himstedt et al. 2014", True),
    "filter": Method("particle filter after one scan", "MRPT's, AMCL's settings: 5,000 particles, uniform start"),
    "paper": Method("published method, our implementation", "Wang et al. 2021: config/paper.ini"),
    "default": Method("d2s1r", "config/default.ini"),
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

    @property
    def scans(self):
        return CONDITIONS[self.condition].scans

    @property
    def position(self):
        """[m] greatest error of a success."""
        return plan.position_limit(self.scans)

    map_site = None

    @property
    def name(self):
        return "-".join(("rival", self.site.name, self.condition, self.method, f"n{self.frames}"))


@dataclasses.dataclass
class RivalResult:
    frames: list
    memory: float  # [MB] peak of the whole program


@dataclasses.dataclass(frozen=True)
class DriveJob:
    """The particle filter along parts of a run, as in the paper's Fig. 7."""
    site: sites.Site
    start: str  # near or anywhere
    drives: int

    position = 0.3  # [m]
    map_site = None
    scans = "run"

    @property
    def name(self):
        return "-".join(("drives", self.site.name, self.start, f"n{self.drives}"))


def all_jobs(found, frames):
    """Jobs of all rivals on those of SITES that are there; none if `frames` is 0."""
    present = [site for site in found if site.name in SITES] if frames else []
    jobs = [RivalJob(site, condition, method, frames)
            for site in present for condition, of in CONDITIONS.items() if site.has(of.scans)
            for method, kind in METHODS.items()
            if not kind.keyframes or (not of.smeared and keyframes_of(site, of.scans))]
    drives = [DriveJob(site, start, min(frames, 20, max(1, len(site.truth("run")) // DRIVE_FRAMES))) for site in present if site.has("run")
              for start in ("near", "anywhere")]
    return jobs + drives


def keyframes_of(site, scans):
    """Words for the program: which scans built the map; none if they are not there."""
    built_by = "run" if scans == "test" else "sim360_on"
    if not site.has(built_by):
        return []
    part = "all" if scans != "test" else "even" if site.name == "fr_campus" else "first_half"
    return [f"keyframes={site.folder / built_by}.rawlog", f"truth={site.truth_file(built_by)}", f"part={part}"]


def run(runner, job):
    """RivalResult, or [[Frame] of a drive] of a DriveJob."""
    folder = runner.folder / job.name
    folder.mkdir(parents=True, exist_ok=True)
    result = run_drives(runner, job, folder) if isinstance(job, DriveJob) else run_queries(runner, job, folder)
    shutil.rmtree(folder)
    return result


def run_queries(runner, job, folder):
    condition = CONDITIONS[job.condition]
    scans = folder / "in.rawlog"
    runs.call([runner.alter, job.site.folder / f"{job.scans}.rawlog", scans, f"frames={job.frames}",
               f"blocked={condition.blocked}"])
    yaml = smear_map(job.site.map(job.scans), folder) if condition.smeared else job.site.map(job.scans)
    if job.method in plan.CONFIGS:
        config = runner.configs / f"{job.method}.ini"
        usage = runs.call([runner.localize, "-q", "-m", yaml, "-i", scans, "-o", folder, "-c", config])
        return RivalResult(runs.read_frames(folder / "frames.csv", job), usage.ru_maxrss / 1024)
    keyframes = keyframes_of(job.site, job.scans) if METHODS[job.method].keyframes else []
    usage = runs.call([runner.rivals, job.method, yaml, scans, folder / "frames.csv", *keyframes])
    return RivalResult(runs.read_frames(folder / "frames.csv", job), usage.ru_maxrss / 1024)


def run_drives(runner, job, folder):
    file = folder / "drives.csv"
    runs.call([runner.rivals, "drives", job.site.folder / "map.yaml", job.site.folder / "run.rawlog", file,
               f"truth={job.site.truth_file('run')}", f"start={job.start}", f"drives={job.drives}"])
    drives = {}
    for row, frame in runs.read_rows(file, job):
        drives.setdefault(row["drive"], []).append(frame)
    return list(drives.values())


def smear_map(yaml, folder):
    """The map in cells of 10 cm, its walls grown by a cell to every side."""
    import matplotlib.image  # here, because learn.py and ablate.py do without
    import numpy
    text = yaml.read_text()
    resolution = float(re.search(r"resolution: *([\d.]+)", text).group(1))
    image = matplotlib.image.imread(sites.map_image(yaml)[0])
    levels = image if image.dtype == numpy.uint8 else numpy.round(255 * image).astype(numpy.uint8)
    levels = levels[..., 0] if levels.ndim == 3 else levels
    factor = 2 if resolution < 0.09 else 1
    rows, columns = (-(-size // factor) * factor for size in levels.shape)
    padded = numpy.full((rows, columns), 205, numpy.uint8)
    padded[rows - levels.shape[0]:, :levels.shape[1]] = levels  # the origin is the lower left corner
    blocks = padded.reshape(rows // factor, factor, columns // factor, factor)
    walls, free = (blocks < 50).any((1, 3)), (blocks > 250).any((1, 3))
    framed = numpy.pad(walls, 1)
    grown = numpy.any([framed[y:y + walls.shape[0], x:x + walls.shape[1]] for y in range(3) for x in range(3)], axis=0)
    out = numpy.where(grown, 0, numpy.where(free, 254, 205)).astype(numpy.uint8)
    (folder / "smeared.pgm").write_bytes(b"P5 %d %d 255\n" % out.shape[::-1] + out.tobytes())
    smeared = re.sub(r"image:.*", "image: smeared.pgm", re.sub(r"resolution:.*", f"resolution: {factor * resolution}", text))
    (folder / "smeared.yaml").write_text(smeared)
    return folder / "smeared.yaml"


def pooled(results, condition, method):
    """Frames of all sites."""
    return sum((r.frames for job, r in results.items() if isinstance(job, RivalJob) and
                (job.condition, job.method) == (condition, method)), [])


def best_marked(cells, better):
    """Texts of [(value, text)]: the best value of them in bold; cells without a value as they are."""
    values = [value for value, _ in cells if value is not None]
    best = better(values) if values else None
    return [f"**{text}**" if value is not None and value == best else text for value, text in cells]


def success_cell(frames):
    return (measures.success(frames), f"{tables.interval(frames)} of {len(frames)}") if frames else (None, "-")


def comparison(results):
    """Success in each condition, all sites together; time and memory."""
    if not any(isinstance(job, RivalJob) for job in results):
        return ""
    columns = {of.title: [success_cell(pooled(results, condition, method)) for method in METHODS]
               for condition, of in CONDITIONS.items()}
    times, memories = [], []
    for method in METHODS:
        frames = pooled(results, "real", method)
        typical = measures.median(f.times["total"] for f in frames)
        times.append((typical, tables.number(typical, 1)) if frames else (None, "-"))
        used = [r.memory for job, r in results.items() if isinstance(job, RivalJob) and
                (job.condition, job.method) == ("real", method)]
        memories.append((max(used), f"{max(used):,.0f}") if used else (None, "-"))
    columns["ms per scan"], columns["MB"] = times, memories
    marked = [best_marked(cells, min if name in ("ms per scan", "MB") else max) for name, cells in columns.items()]
    rows = [[kind.title, kind.paper, *cells] for kind, *cells in zip(METHODS.values(), *marked)]
    return tables.table(
        "Rivals",
        "[%] success, in brackets the 95 % interval of Wilson, and of how many scans, evenly spread over the sets of "
        f"{', '.join(present(results))}; the best of each column is bold. Within 0.2 m and 5 deg (real scans 0.3 m). "
        "Every rival is our implementation of the paper named, with its parameters where we know them, not tuned: "
        "`tests/experiments/rivals`. Those with keypoints compare with the scans that built the map (real: the first "
        "half of the run, fr_campus its even keyframes; simulated: `sim360_on`) and never look at the map, so that "
        "it does not matter to them how it is smeared. Smeared: cells of 10 cm, walls a cell thicker on every side. "
        "Median time (rivals: processor time) and greatest memory on the real scans, one thread.",
        ["method", "after", *columns], rows)


def present(results):
    """Names of the sites on which rivals ran."""
    return [name for name in SITES if any(isinstance(job, RivalJob) and job.site.name == name for job in results)]


def by_site(results):
    """Success on real scans, site by site."""
    names = present(results)
    columns = []
    for name in names:
        cells = [success_cell(sum((r.frames for job, r in results.items() if isinstance(job, RivalJob) and
                                   (job.site.name, job.condition, job.method) == (name, "real", method)), []))
                 for method in METHODS]
        columns.append(best_marked(cells, max))
    rows = [[kind.title, *cells] for kind, *cells in zip(METHODS.values(), *columns)] if names else []
    return tables.table("Rivals on the real scans of each site", "[%] success of `test` in map_test.", ["method", *names], rows)


def is_converged(frame):
    return frame.position_error < CONVERGED[0] and frame.yaw_error < CONVERGED[1]


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
                     f"{len(reached)} of {len(drives)}", f"{sum(last)} of {len(drives)}",
                     tables.number(measures.mean(first + 1 for _, first in reached), 1),
                     tables.number(measures.mean(driven(drive, first) for drive, first in reached), 1)])
    return tables.table(
        "Convergence of the particle filter (Fig. 7, Section IV-B.1)",
        "MRPT's filter with AMCL's settings and odometry on drives of 40 frames of run.rawlog in map.yaml, their starts "
        "evenly spread: how many came within 0.2 m and 10 deg at all, and were there at the end; after how many "
        "scans and how far a drive [m], on average of those. Published, AMCL from such a guess: 20 of 20, in 2.0 to "
        "11.0 s, 4.4 s on average; without a guess it fails (no figure). d2s1r needs one scan and no drive: the rows of "
        "`test` above.", ["site", "start", "reached", "at the end", "scans", "m"], rows)


def checks(results):
    """Every rival beside a figure of its paper or of others who ran it."""
    def ours(site, condition, method):
        frames = [f for job, r in results.items() if isinstance(job, RivalJob) and
                  (job.site.name, job.condition, job.method) == (site, condition, method) for f in r.frames]
        return tables.interval(frames) if frames else "-"

    rows = [
        ["FLIRT, bag of words", "intel off the mapping path (D_I1), Wang et al. Table IV: 82 %",
         ours("intel", "clean", "bag-of-words")],
        ["geometrical FLIRT phrases", "intel off the mapping path (D_I1), Wang et al. Table IV: 87 %; the authors' program, run by us on "
         "clean full circles of several sites: 182 of 300 (61 %)", ours("intel", "clean", "phrases")],
        ["branch and bound", "Cartographer itself, run by us, 60 real scans of intel: 70 %; of fr079: 65 %; of mit_csail: 57 % (Hess "
         "et al. report loop closures, not one-shot localization)",
         ", ".join(f"{site} {ours(site, 'real', 'branch-and-bound')}" for site in ("intel", "fr079", "mit_csail"))],
        ["GLARE", "none: Himstedt et al. report precision and recall of loop closures, not poses", ours("intel", "clean", "glare")],
        ["exhaustive likelihood field", "none that we know for one scan without motion; its test is that it finds robots on a drawn "
         "floor", ours("intel", "clean", "exhaustive")],
        ["particle filter", "stock pf-localization on MRPT's demo with a uniform start: 5 of 20 runs right with 1,000 particles, 12 with "
         "10,000, after 7 scans", ours("intel", "real", "filter")],
        ["published method", "intel off the mapping path (D_I1), Wang et al. Table IV: 93 %", ours("intel", "clean", "paper")],
    ]
    if not any(isinstance(job, RivalJob) for job in results):
        rows = []
    return tables.table("Rivals beside published figures", "[%] success; ours with the 95 % interval of Wilson.",
                        ["rival", "published or measured by its own program", "ours"], rows)
