#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Finds the constants of windows and of the particle filter.

Starts from plain numbers and takes halves and doubles of them, or switches them off, where the frames of the development
runs gain more by it than chance explains. A frame that is `localized` or `tracking` at a wrong place counts
ten times as much as one at the right place. Writes to --output: tuned.ini, and tuned.md with what every constant does
if it is off, a half or double. The same data and programs give the same numbers. Those of experiments/results/learned/tuned.ini are
the defaults of frames/window_tuning.h, motion.h and plugins/pf-init/tuning.h.

Runs are those of recorded buildings (D2S1R_DATA) and of drawn floors. mit_csail, mit_killian and fr_campus are none of
them, so that they judge. Results stay in the build folder: a run that was interrupted goes on where it was. Needs what
learn.py needs.
"""
import argparse
import concurrent.futures
import contextlib
import dataclasses
import hashlib
import json
import pathlib
import sys
import threading
import time

sys.dont_write_bytecode = True  # the folder is part of the sources

import needs  # noqa: E402
try:
    from learning import degraded_maps, drives, drawn_sites, sets, tuning
except ImportError as error:
    needs.stop(error, "python3-numpy, python3-scipy and python3-pil")
import runs  # noqa: E402
import sites  # noqa: E402
import tables  # noqa: E402

PROJECT = pathlib.Path(__file__).resolve().parents[1]
AT_A_TIME = 16  # [-] variants in one call of a program: what is lost by an interruption
NEVER = 1e9  # more than any number that is compared with it


def digest_of(map_, scans, truth):
    """Of the data of a run: a map is all files that are named as its .yaml."""
    files = [*sorted(map_.parent.glob(map_.stem + ".*")), scans, truth]
    return hashlib.sha256(b"".join(runs.digest(file) for file in files)).digest()


def constants_of(section, starts, whole=()):
    """\\p starts {name: (start, number that switches it off or None, greatest)}"""
    return [tuning.Constant(f"{section}.{name}", start, off, greatest, name in whole)
            for name, (start, off, greatest) in starts.items()]


MOST, SHARE = float("inf"), 1.0  # greatest numbers
# What the search starts from: 1, 2 or 5 times a power of ten, so that the result does not depend on what was found before.
CONSTANTS = [
    *constants_of("odometry", {
        "least_error": (0.05, None, MOST), "least_turn": (2, None, MOST), "error_share": (0.1, 0, MOST),
        "turn_by_way": (5, 0, MOST), "newest": (0.1, 1, SHARE), "most_disagreement": (10, NEVER, MOST),
        "widest_turn": (50, 180, MOST)}),
    *constants_of("window", {
        "fits": (0.5, 0, SHARE), "least_explained": (0.1, 0, SHARE), "hidden": (-2.5, None, MOST),
        "tails": (5, NEVER, MOST), "lost_frames": (2, NEVER, MOST), "jump": (0.01, 0, SHARE), "usual": (0.5, NEVER, MOST)},
        ("lost_frames",)),
    *constants_of("filter", {
        "farthest": (2, NEVER, MOST), "sure_share": (0.2, SHARE, SHARE), "unlisted": (0.2, NEVER, MOST),
        "unexplained_power": (0.2, SHARE, SHARE), "least_explained": (0.2, 0, SHARE),
        "admitted_probability": (0.0005, 0, SHARE), "takeover_margin": (20, NEVER, MOST)}),
]
SECTIONS = {"window": ("odometry", "window"), "filter": ("odometry", "filter")}  # that a program reads


@dataclasses.dataclass(frozen=True)
class Run:
    """A run that constants are judged on."""
    name: str
    program: str  # "window", "filter"
    site: str  # of D2S1R_DATA, or a drawn floor: kind, m2 and seed
    map: str  # "map", "map_test", or a worse map of sets.MAPS
    scans: str  # "run", "test", or a laser of sets.LASERS that drives through a drawn floor
    words: tuple  # of window_experiment; of fusion_experiment, the first three: experiment, motion, drives

    def constants(self):
        return [c for c in CONSTANTS if c.name.split(".")[0] in SECTIONS[self.program]]


RUNS = (
    Run("reach", "window", "intel", "map", "run", ("reach=3.5", "frames=40")),
    Run("guessed", "window", "fr079", "map_test", "run", ("odometry=0", "reach=5", "apart=0.5", "frames=300")),
    Run("drawn", "window", "corridor 1500 4", "map", "narrow", ("frames=40", "wheels=1")),
    Run("outside", "filter", "intel", "map_test", "run", ("drives", "both", "6")),
    Run("smeared", "filter", "intel", "smeared_behind", "run", ("drives", "both", "4", "frames=300")),
    Run("covered", "filter", "fr079", "map", "run", ("covered", "both", "5", "frames=600")),
    Run("kidnapped", "filter", "fr079", "map", "run", ("kidnapped", "both", "5", "frames=600")),
    Run("pseudo", "filter", "mines_runs", "map_test", "test", ("drives", "pseudo", "5", "frames=300")),
    Run("drawn", "filter", "office 1800 2", "map", "front", ("drives", "both", "3", "wheels=1")),
)
DRIVE_SCANS = 80  # [-] of a drive through a drawn floor


class Runner:
    """Letters of frames stay in a folder, and are found there for the same programs, data and constants."""

    def __init__(self, build, data, jobs):
        self.programs = {name: build / f"experiments/{file}_experiment"
                         for name, file in (("window", "window"), ("filter", "fusion"))}
        for program in self.programs.values():
            if not program.exists():
                raise RuntimeError(f"{program} is missing; build the project, tests included")
        self.maker = sets.Maker(build, build / "learning")
        made_by = b"".join(runs.digest(pathlib.Path(module.__file__)) for module in (drives, degraded_maps, drawn_sites))
        self.folder = build / "learning/tuning" / self.maker.folder.name / hashlib.sha256(made_by).hexdigest()[:16]
        self.digests = {name: runs.digest_of_program(program, build).hex()[:16] for name, program in self.programs.items()}
        self.data, self.jobs = data, jobs
        self.writes_cache = threading.Lock()  # two programs may want the same one

    def evaluate(self, all_runs, points):
        """[[letters by run] by point]"""
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            by_run = list(pool.map(lambda run: self.letters(run, points), all_runs))
        return [list(letters) for letters in zip(*by_run)] if by_run and points else []

    def letters(self, run, points):
        lines = [" ".join(f"{c.name.split('.')[1]}={point[c.name]:g}" for c in run.constants()) for point in points]
        files = self.files(run)
        key = self.key(run, files, run)
        file = self.folder / f"{run.program}-{run.name}-{key}.json"
        known = json.loads(file.read_text()) if file.exists() else {}
        missing = [line for line in dict.fromkeys(lines) if line not in known]
        for first in range(0, len(missing), AT_A_TIME):
            some = missing[first:first + AT_A_TIME]
            known.update(zip(some, self.run(run, files, some)))
            part = file.with_suffix(".part")
            part.write_text(json.dumps(known))
            part.rename(file)
        return [known[line] for line in lines]

    def key(self, run, files, *what):
        return hashlib.sha256(digest_of(*files) + repr((self.digests[run.program], *what)).encode()).hexdigest()[:16]

    def run(self, run, files, lines):
        variants = self.folder / f"{run.program}-{run.name}.variants"
        variants.write_text("\n".join(lines) + "\n")
        settings = [word for word in run.words if "=" in word]
        seen = self.key(run, files, sorted(word for word in settings if not word.startswith("odometry")))
        cache = self.folder / f"scans-{seen}"
        if run.program == "window":
            words = ["-", f"cache={cache}"]
        else:
            words = [cache, *(word for word in run.words if "=" not in word)]
        with contextlib.nullcontext() if cache.exists() else self.writes_cache:
            return sets.run([self.programs[run.program], *files, *words, *settings, f"variants={variants}"]).split()

    def files(self, run):
        """Map, scans and truth; what is drawn is made if it is not there."""
        if run.scans in sets.LASERS:
            kind, area, seed = run.site.split()
            floor = (kind, int(area), int(seed))
            self.maker.draw(floor)
            drawn = self.folder / f"{kind}{area}_{seed}-{run.scans}"
            sets.whole(drawn, lambda part: self.write_drive(floor, run.scans, part))
            return drawn / "map.yaml", drawn / "seen.rawlog", drawn / "scans_gt.txt"
        site = self.data / run.site
        scans, truth = site / f"{run.scans}.rawlog", site / f"{run.scans}_gt.txt"
        if run.map not in sets.MAPS:
            return site / f"{run.map}.yaml", scans, truth
        worse = self.folder / f"{run.site}-{run.map}"
        sets.whole(worse, lambda part: degraded_maps.save_map(
            degraded_maps.degrade(degraded_maps.load_map(site / "map.yaml"), sets.MAPS[run.map], 1), part))
        return worse / "map.yaml", scans, truth

    def write_drive(self, floor, laser, part):
        drives.write_drive(sets.floor_folder(self.maker.folder, floor), part, DRIVE_SCANS, floor[2],
                           self.maker.simulate_floor)
        sets.run([self.maker.alter, part / "scans.rawlog", part / "seen.rawlog", *sets.LASERS[laser], "seed=1"])


def to_ini(point, constants):
    lines = []
    for section in ("odometry", "window", "filter"):
        numbers = [f"{c.name.split('.')[1]} = {point[c.name]:g}" for c in constants if c.name.startswith(section + ".")]
        lines += ([""] if lines else []) + [f"[{section}]", *numbers]
    return "\n".join(lines) + "\n"


def changes(letters, usual, is_counted):
    """Frames that became what is counted and that ceased to be."""
    pairs = [(is_counted(a), is_counted(b)) for run, before in zip(letters, usual) for a, b in zip(run, before)]
    gained, lost = sum(a and not b for a, b in pairs), sum(b and not a for a, b in pairs)
    return f"+{gained} -{lost}" if gained + lost else ""


def report(point, constants, tried, usual, minutes, jobs):
    counts = {letter: sum(run.count(letter) for run in usual) for letter in "Rr-W"}
    rows = [["all as found", "", "", str(counts["R"] + counts["r"]), str(counts["R"]), str(counts["W"]), "", ""]]
    idle = {}
    for constant, what, value, letters in tried:
        total, chance = tuning.gain(letters, usual)
        idle.setdefault(constant.name, []).append(abs(total) <= chance)
        rows.append([constant.name, what, f"{value:g}", changes(letters, usual, lambda letter: letter in "Rr"),
                     changes(letters, usual, lambda letter: letter == "R"),
                     changes(letters, usual, lambda letter: letter == "W"), f"{total:+g}" if total else "",
                     f"{chance:.0f}" if chance else ""])
    nothing = [name for name, flags in idle.items() if all(flags)]
    starts = [[c.name, f"{c.start:g}", f"{point[c.name]:g}"] for c in constants if point[c.name] != c.start]
    listed = "\n".join(f"- {run.program} {run.name}: {run.site}, {run.map}, {run.scans}, {' '.join(run.words)}" for run in RUNS)
    return (f"# Constants of windows and filter\n\n`experiments/tune.py`, {minutes:.0f} minutes, {jobs} programs "
            f"at a time. Judged on {sum(map(len, usual))} frames of these runs (site, map, scans, settings):\n\n{listed}\n\n" +
            tables.table("What changed from the start", "", ["constant", "start", "found"], starts) + "\n" +
            tables.table("Every constant off, at half and at double",
                         "First row: numbers of frames. Right: within 0.3 m and 5 deg (windows), 0.5 m and 10 deg (filter). "
                         "Sure: `localized`, `tracking`. Points: 2 of a frame that is right and sure, 1 of one that is right, "
                         "-20 of one that is wrong and sure; beside them three standard deviations of chance.",
                         ["constant", "", "value", "right", "right and sure", "wrong and sure", "points", "chance"], rows) +
            "\nNo variant of these is beyond chance: " + (", ".join(nothing) or "none") + ".\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=PROJECT / "build/release", help="build folder")
    parser.add_argument("--data", type=pathlib.Path, default=sites.default_folder(PROJECT), help="folder of the sites")
    parser.add_argument("--output", type=pathlib.Path, default=PROJECT / "build/learned", help="folder to write to")
    parser.add_argument("--jobs", type=int, default=2, help="programs that run at a time (default 2)")
    parser.add_argument("--only", default="", help="part of the names of the constants that are varied, e.g. window.")
    parser.add_argument("--runs", default="", help="part of the names of the runs, e.g. drawn")
    arguments = parser.parse_args()
    start = time.monotonic()
    try:
        arguments.output.mkdir(parents=True, exist_ok=True)
        runner = Runner(arguments.build.resolve(), arguments.data.resolve(), arguments.jobs)
        runner.folder.mkdir(parents=True, exist_ok=True)
        constants = [c for c in CONSTANTS if arguments.only in c.name]
        fixed = {c.name: c.start for c in CONSTANTS}
        all_runs = [run for run in RUNS if arguments.runs in f"{run.program} {run.name}"]
        if not all_runs:
            raise ValueError(f"no run has '{arguments.runs}' in its name; leave --runs out for all")
        evaluate = lambda points: runner.evaluate(all_runs, [{**fixed, **point} for point in points])  # noqa: E731
        point = tuning.search(evaluate, constants, lambda text: print(text, file=sys.stderr, flush=True))
        tried = tuning.sweep(evaluate, constants, point)
        usual = evaluate([point])[0]
    except (OSError, RuntimeError, ValueError) as error:
        sys.exit(f"tune.py: {error}")
    (arguments.output / "tuned.ini").write_text(to_ini({**fixed, **point}, CONSTANTS))
    (arguments.output / "tuned.md").write_text(
        report(point, constants, tried, usual, (time.monotonic() - start) / 60, arguments.jobs))
    print(f"{arguments.output / 'tuned.ini'}, table in {arguments.output / 'tuned.md'}")


if __name__ == "__main__":
    main()
