#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Switches every constant of the default method off, to half and to double, one at a time, and reports what it does.

Writes OUTPUT/ablation.md: success, precision and recall over the development sets, false alarms on scans of another
place, and time, each as the difference from the defaults; and which constants change nothing.
Needs what learn.py needs.
"""
import argparse
import dataclasses
import math
import pathlib
import re
import sys
import time

sys.dont_write_bytecode = True  # the folder is part of the sources

try:
    from learning import running, sets
except ImportError as error:
    sys.exit(f"ablate.py: {error}; install Debian's python3-numpy, python3-scipy and python3-pil, and run with "
             "/usr/bin/python3")
import measures  # noqa: E402
import sites  # noqa: E402
import tables  # noqa: E402

PROJECT = pathlib.Path(__file__).resolve().parents[3]
SECTIONS = ("free_cells", "scan", "coarse_search", "refinement", "first_look", "scoring", "beam_model", "presence_model")
WEIGHTS = ("beam_model", "presence_model")  # sections whose keys are off at 0
# What a constant is set to for its heuristic to be off; one that has no such value is only halved and doubled.
OFF = {
    "scan.covered_within": 0, "coarse_search.overview_margin": 1e6, "coarse_search.overview_missing": 1,
    "coarse_search.overview_missing_by_chance": 1e6, "coarse_search.occluder_range": 0, "coarse_search.margin": 1e6,
    "refinement.fit_margin": 100, "refinement.score_margin": 1e6, "refinement.max_restarted": 0,
    "refinement.cost_weight": 0, "refinement.surface_offset": 0.001, "first_look.clear_above": 1,
    "scoring.temperature_by_beam": 0,
}
# (site, set) or drawn floor, and the ending of the name: what constants are judged on
DEVELOPMENT = (
    "intel-test", "fr079-test", "mit_csail-test", "mit_killian-test", "fr_campus-test", "mines_runs-test",
    "intel-sim360_clutter", "mit_killian-sim360_off", "fr079-test-smeared", "mit_csail-test-smeared_behind",
    "intel-test-sketch", "mit_killian-test-smeared_much", "intel-test-reach3.5", "mit_csail-test-view60",
    "fr079-test-cheap", "mit_csail-test-invalid40")
DRAWN_SHARE, STRANGER_SHARE = 10, 12  # [-] one in so many of the drawn sets and of the strangers


@dataclasses.dataclass(frozen=True)
class Constant:
    section: str
    key: str
    value: float
    least: float
    greatest: float
    is_whole: bool

    @property
    def name(self):
        return f"{self.section}.{self.key}"

    def variants(self):
        """{what: value} of those that differ from the default."""
        wanted = {"half": self.value / 2, "double": self.value * 2}
        if self.section in WEIGHTS:
            wanted["off"] = 0.0
        elif self.name in OFF:
            wanted["off"] = OFF[self.name]
        fit = {what: min(max(value, self.least), self.greatest) for what, value in wanted.items()}
        if self.is_whole:
            fit = {what: float(math.ceil(value)) for what, value in fit.items()}
        return {what: fit[what] for what in ("off", "half", "double") if what in fit and fit[what] != self.value}


def read_constants(ini):
    """All numbers of an ini file with their ranges, which its comments end with."""
    section, constants = "", []
    number = r"[-+.\deE]+"
    for line in ini.splitlines():
        head = re.match(r"\[(\w+)\]", line)
        section = head.group(1) if head else section
        entry = re.match(rf"(\w+) = ({number})\s*;.* \(({number}) to ({number})\)$", line)
        if entry and section in SECTIONS:
            key, value, least, greatest = entry.groups()
            is_whole = key.startswith("max_") and "share" not in key or key in (
                "directions", "candidates", "hypotheses", "min_beams", "truncation", "occluder_truncation", "overview_truncation")
            constants.append(Constant(section, key, float(value), float(least), float(greatest), is_whole))
    unknown = set(OFF) - {constant.name for constant in constants}
    if unknown:
        raise ValueError(f"OFF names what is no constant of default.ini: {', '.join(sorted(unknown))}")
    return constants


@dataclasses.dataclass
class Result:
    success: float  # [%]
    precision: float  # [%]
    recall: float  # [%]
    false_alarms: float  # [%] of the scans of another place that are localized
    error: float  # [-] of calibration
    ms: float


def judge(all_sets, folders):
    here, strangers = [], []
    for set_, folder in zip(all_sets, folders):
        (strangers if set_.kind == "stranger" else here).extend(running.read_frames(folder))
    return Result(measures.success(here), measures.precision(here), measures.recall(here),
                  measures.share(f.status == "localized" for f in strangers), measures.calibration_error(here),
                  measures.mean_time(here + strangers, "total"))


def changes_nothing(result, usual):
    return (abs(result.success - usual.success) < 0.1 and abs(result.precision - usual.precision) < 0.1 and
            abs(result.recall - usual.recall) < 0.3 and abs(result.false_alarms - usual.false_alarms) < 0.2 and
            abs(result.error - usual.error) < 0.003 and abs(result.ms / usual.ms - 1) < 0.05)


def difference(value, usual, digits=1):
    return f"{value - usual:+.{digits}f}"


def report(usual, results, count, minutes, arguments):
    """\\p results: [(Constant, what, value, Result)]"""
    rows = [["defaults", "", "", f"{usual.success:.1f}", f"{usual.precision:.1f}", f"{usual.recall:.1f}",
             f"{usual.false_alarms:.1f}", f"{usual.error:.3f}", f"{usual.ms:.1f}"]]
    idle = {}
    for constant, what, value, result in results:
        rows.append([constant.name, what, f"{value:g}", difference(result.success, usual.success),
                     difference(result.precision, usual.precision), difference(result.recall, usual.recall),
                     difference(result.false_alarms, usual.false_alarms), difference(result.error, usual.error, 3),
                     f"{100 * (result.ms / usual.ms - 1):+.0f} %"])
        idle.setdefault(constant.name, []).append(changes_nothing(result, usual))
    nothing = [name for name, flags in idle.items() if all(flags)]
    text = (f"`share/d2s1r/experiments/ablate.py --frames {arguments.frames}`, {minutes:.0f} minutes. {count} sets. First row: "
            "[%], calibration error, ms per scan; the others: differences from it.")
    return (tables.table("Every constant off, at half and at double", text,
                         ["constant", "", "value", "success", "precision", "recall", "false alarms", "calibration", "time"], rows) +
            "\nNo variant of these changes anything (success and precision by 0.1 points, recall by 0.3, time by 5 %): " +
            (", ".join(nothing) or "none") + ".\n")


def development_sets(arguments, folder):
    found = sites.find(arguments.data)
    sets_here = list(sets.of_sites(found, arguments.frames, arguments.frames))
    drawn = list(sets.on_floors(folder))
    strangers = list(sets.strangers(sets_here + drawn, max(1, arguments.frames // 2)))
    chosen = [s for s in sets_here if s.name in DEVELOPMENT]
    if not chosen:
        sys.exit(f"ablate.py: {arguments.data}: has none of the development sets; set D2S1R_DATA or --data")
    return chosen + drawn[::DRAWN_SHARE] + strangers[::STRANGER_SHARE]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=PROJECT / "build/release", help="build folder")
    parser.add_argument("--data", type=pathlib.Path, default=sites.default_folder(PROJECT), help="folder of the sites")
    parser.add_argument("--output", type=pathlib.Path, default=PROJECT / "build/learned", help="folder to write to")
    parser.add_argument("--frames", type=int, default=60, help="scans of each set (default 60)")
    parser.add_argument("--jobs", type=int, default=2, help="programs that run at a time (default 2)")
    parser.add_argument("--only", default="", help="part of the names of the constants to vary, e.g. refinement.")
    arguments = parser.parse_args()
    start = time.monotonic()
    try:
        arguments.output.mkdir(parents=True, exist_ok=True)
        runner = running.Runner(arguments.build.resolve(), arguments.build.resolve() / "learning", arguments.jobs)
        constants = [c for c in read_constants(runner.default_ini()) if arguments.only in c.name]
        all_sets = development_sets(arguments, runner.folder)
        runner.make_all(all_sets)
        usual = judge(all_sets, runner.run_all(all_sets, lambda _: "", False, "defaults"))
        results = []
        for constant in constants:
            for what, value in constant.variants().items():
                ini = f"[{constant.section}]\n{constant.key} = {value:g}\n"
                folders = runner.run_all(all_sets, lambda _, text=ini: text, False, f"{constant.name} {what}")
                results.append((constant, what, value, judge(all_sets, folders)))
    except (OSError, RuntimeError, ValueError) as error:
        sys.exit(f"ablate.py: {error}")
    text = report(usual, results, len(all_sets), (time.monotonic() - start) / 60, arguments)
    (arguments.output / "ablation.md").write_text(text)
    print(f"\n{arguments.output / 'ablation.md'}: {len(results)} variants of {len(constants)} constants")


if __name__ == "__main__":
    main()
