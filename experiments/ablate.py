#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Switches every constant of the default method off, to half and to double, one at a time, and reports what it does.

Writes OUTPUT/ablation.md: of the scans of the development sets, how many become right and how many cease to be, the
same of those that are localized; how many are localized at a wrong pose, scans of another place included; and time.
Each is against the defaults, scan by scan; at the end stands which constants change nothing. Learned weights are only
switched off: learn.py finds their values. What a user asks for, such as localized_above, is not varied.
With --ini FILE it compares these parameters with the defaults instead.
Results stay in the build folder: a run that was interrupted goes on where it was. Needs what learn.py needs.
"""
import argparse
import dataclasses
import math
import pathlib
import re
import resource
import sys

sys.dont_write_bytecode = True  # the folder is part of the sources

import needs  # noqa: E402
try:
    from learning import running, sets
except ImportError as error:
    needs.stop(error, "python3-numpy, python3-scipy and python3-pil")
import measures  # noqa: E402
import sites  # noqa: E402
import tables  # noqa: E402

PROJECT = pathlib.Path(__file__).resolve().parents[1]
TIME_NOISE = 0.1  # [-] by which processor times differ on a machine that does other things
SECTIONS = ("coarse_search", "refinement", "first_look", "scoring", "beam_model", "presence_model")
LEARNED = ("beam_model", "presence_model")  # sections whose keys are off at 0, and neither halved nor doubled
WISHES = ("scoring.hypotheses", "scoring.localized_above", "scoring.rejected_below")  # of a user
# What a constant is set to for its heuristic to be off; one that has no such value is only halved and doubled.
OFF = {
    "coarse_search.overview_missing_by_chance": 1e6, "coarse_search.margin": 1e6,
    "refinement.fit_margin": 100, "first_look.effort": 1, "scoring.temperature_by_beam": 0,
    "scoring.temperature_by_tolerance": 0,
}
# names of sets, of which many scans are near the limits of what is found
DEVELOPMENT = (
    "intel-test-reach3.5", "fr079-test-cheap", "mit_csail-test-view60", "mit_killian-test", "mines_runs-test",
    "fr079-test-smeared", "mit_csail-test-smeared_behind", "intel-test-sketch",
    "corridor1500_4-front", "hall2500_7-small", "warehouse800_11-narrow", "apartment200_8-cheap-smeared_much")
# (scans, map)
STRANGERS = (
    ("fr079-test", "intel-test-reach3.5"), ("mit_killian-test", "intel-test-sketch"),
    ("intel-test-reach3.5", "fr079-test"),
    ("mit_csail-test-view60", "corridor1500_4-front"), ("corridor1500_4-front", "mit_csail-test-smeared_behind"))


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
        wanted = {"off": 0.0} if self.section in LEARNED else {"half": self.value / 2, "double": self.value * 2}
        if self.name in OFF:
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
        if entry and section in SECTIONS and f"{section}.{entry.group(1)}" not in WISHES:
            key, value, least, greatest = entry.groups()
            is_whole = key.startswith("max_") and "share" not in key or key in (
                "candidates", "truncation")
            constants.append(Constant(section, key, float(value), float(least), float(greatest), is_whole))
    unknown = set(OFF) - {constant.name for constant in constants}
    if unknown:
        raise ValueError(f"OFF names what is no constant of default.ini: {', '.join(sorted(unknown))}")
    return constants


@dataclasses.dataclass
class Result:
    right: list  # by scan: whether its best pose is right
    found: list  # by scan: whether it is localized and right
    wrong: list  # by scan, those of another place included: whether it is localized at a wrong pose
    error: float  # [-] of calibration
    ms: float  # [ms] of processor time in the mean


def judge(all_sets, folders):
    here, everywhere = [], []
    for set_, folder in zip(all_sets, folders):
        frames = running.read_frames(folder)
        everywhere.extend(frames)
        here.extend(frames if set_.kind != "stranger" else [])
    is_found = [frame.status == "localized" for frame in here]
    return Result([frame.right for frame in here], [frame.right and found for frame, found in zip(here, is_found)],
                  [frame.status == "localized" and not frame.right for frame in everywhere],
                  measures.calibration_error(here), measures.mean_time(everywhere, "total"))


def gained_and_lost(flags, usual):
    return (sum(flag and not before for flag, before in zip(flags, usual)),
            sum(before and not flag for flag, before in zip(flags, usual)))


def is_noise(flags, usual):
    """Whether as many are lost as gained, but for two standard deviations of chance (McNemar 1947)."""
    gained, lost = gained_and_lost(flags, usual)
    return abs(gained - lost) <= 2 * math.sqrt(gained + lost)


def changes_nothing(result, usual):
    return (is_noise(result.right, usual.right) and is_noise(result.found, usual.found) and
            is_noise(result.wrong, usual.wrong) and abs(result.error - usual.error) < 0.01 and
            abs(result.ms / usual.ms - 1) < TIME_NOISE)


def row(name, what, value, result, usual):
    cells = [f"+{gained} -{lost}" if gained + lost else "" for gained, lost in (
        gained_and_lost(result.right, usual.right), gained_and_lost(result.found, usual.found),
        gained_and_lost(result.wrong, usual.wrong))]
    return [name, what, value, *cells, f"{result.error - usual.error:+.3f}",
            f"{100 * (result.ms / usual.ms - 1):+.0f} %"]


def report(usual, results, count, minutes, arguments):
    """\\p results: [(name, what, value, Result)]"""
    rows = [["defaults", "", "", str(sum(usual.right)), str(sum(usual.found)), str(sum(usual.wrong)),
             f"{usual.error:.3f}", f"{usual.ms:.1f} ms"]]
    idle = {}
    for name, what, value, result in results:
        rows.append(row(name, what, value, result, usual))
        idle.setdefault(name, []).append(changes_nothing(result, usual))
    nothing = [name for name, flags in idle.items() if all(flags)]
    here, everywhere = len(usual.right), len(usual.wrong)
    text = (f"`experiments/ablate.py --frames {arguments.frames}`, {minutes:.0f} minutes of processor time. "
            f"{count} sets, {here} scans of the place of the map and {everywhere - here} of another place. First row: "
            "numbers of scans, calibration error, mean of processor time; the others: scans gained and lost against it, "
            "and differences. Wrong: localized at a wrong pose, or in the map of another place.")
    columns = ["constant", "", "value", "right", "localized and right", "wrong", "calibration", "time"]
    return (tables.table("Every constant off, at half and at double", text, columns, rows) +
            "\nNo variant of these changes anything (all counts within two standard deviations of chance, calibration "
            f"by 0.01, time by {100 * TIME_NOISE:.0f} %): " + (", ".join(nothing) or "none") + ".\n")


def development_sets(arguments, folder):
    found = sites.find(arguments.data)
    everything = {set_.name: set_ for set_ in (*sets.of_sites(found, arguments.frames, arguments.frames),
                                               *sets.on_floors(folder, arguments.frames))}
    missing = [name for name in DEVELOPMENT if name not in everything]
    if missing:
        sys.exit(f"ablate.py: {arguments.data}: lacks the sets {', '.join(missing)}; set D2S1R_DATA or --data")
    strangers = [sets.in_map_of(everything[scans], everything[other], max(1, arguments.frames // 3))
                 for scans, other in STRANGERS]
    return [everything[name] for name in DEVELOPMENT] + strangers


def variants(arguments, runner):
    """[(name, what, value, text of the ini)]"""
    if arguments.ini:
        return [(file.name, "", "", file.read_text()) for file in arguments.ini]
    constants = [c for c in read_constants(runner.default_ini()) if arguments.only in c.name]
    return [(c.name, what, f"{value:g}", f"[{c.section}]\n{c.key} = {value:g}\n")
            for c in constants for what, value in c.variants().items()]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=PROJECT / "build/release", help="build folder")
    parser.add_argument("--data", type=pathlib.Path, default=sites.default_folder(PROJECT), help="folder of the sites")
    parser.add_argument("--output", type=pathlib.Path, default=PROJECT / "build/learned", help="folder to write to")
    parser.add_argument("--frames", type=int, default=30, help="scans of each set (default 30)")
    parser.add_argument("--jobs", type=int, default=2, help="programs that run at a time (default 2)")
    parser.add_argument("--only", default="", help="part of the names of the constants to vary, e.g. refinement.")
    parser.add_argument("--ini", type=pathlib.Path, nargs="+", help="files of parameters to compare with the defaults")
    arguments = parser.parse_args()
    try:
        arguments.output.mkdir(parents=True, exist_ok=True)
        runner = running.Runner(arguments.build.resolve(), arguments.build.resolve() / "learning", arguments.jobs)
        all_sets = development_sets(arguments, runner.folder)
        runner.make_all(all_sets)
        usual = judge(all_sets, runner.run_all(all_sets, lambda _: "", False, "defaults"))
        results = []
        for name, what, value, ini in variants(arguments, runner):
            folders = runner.run_all(all_sets, lambda _, text=ini: text, False, f"{name} {what}")
            results.append((name, what, value, judge(all_sets, folders)))
            print(*row(*results[-1], usual), sep="\t", flush=True)
    except (OSError, RuntimeError, ValueError) as error:
        sys.exit(f"ablate.py: {error}")
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    text = report(usual, results, len(all_sets), (used.ru_utime + used.ru_stime) / 60, arguments)
    (arguments.output / "ablation.md").write_text(text)
    print(f"{arguments.output / 'ablation.md'}: {len(results)} variants")


if __name__ == "__main__":
    main()
