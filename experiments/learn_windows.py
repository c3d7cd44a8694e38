#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Learns what the frames of a window tell together: WindowModel of frames/window_tuning.h.

Drives of recorded buildings (D2S1R_DATA, its folder foreign included) and of made ones that repeat themselves
(learning/look_alikes.py) are followed by windows once; then the constants are those with the least log-loss of "the best
place is right" (0.5 m, 10 deg), in the mean over the drives, by Nelder and Mead's search. Windows must not be wrong more
often than single scans: of the recorded and of the made drives, it costs if a greater share of the `localized` is wrong.
Every fourth building is left out in turn, and judges what was learned from the others. Writes to --output:
windows.ini and windows.md, a table of all drives. The defaults of WindowModel are these numbers;
experiments/results/learned holds what it wrote. Single scans and terms stay in the build folder: delete the folder
learning/windows there when map, drive or localizer change.

Needs Debian's python3-numpy and python3-scipy, and a build with its tests' programs.
"""
import argparse
import concurrent.futures
import dataclasses
import math
import pathlib
import subprocess
import sys
import time

sys.dont_write_bytecode = True  # the folder is part of the sources

import needs  # noqa: E402
try:
    import numpy as np
    from scipy import optimize
except ImportError as error:
    needs.stop(error, "python3-numpy and python3-scipy")
import sites  # noqa: E402
import tables  # noqa: E402
from learning import look_alikes  # noqa: E402

PROJECT = pathlib.Path(__file__).resolve().parents[1]
# Start, least and greatest of each constant; the search is over their logarithms.
CONSTANTS = {
    "same_power": (10, 0.2, 100), "least_evidence": (-5, -8, -1),
    "most_absence": (2, 1, 10),  # no drive leaves its map for long, so that these would learn never to say so
    "carried_away": (1e-4, 1e-7, 1e-1), "gone_missing": (1e-3, 1e-7, 1e-1), "found_again": (0.1, 1e-4, 1)}
MORE_WRONG = 0.1  # [nat] a frame, if a share that is wrong is twice that of single scans
PULL = 0.002  # [nat] a frame, of a constant that is e times what it started from
FOLDS = 4  # [-] parts of the buildings, each of which is left out once
DIGITS = 2  # [-] of the numbers written


@dataclasses.dataclass(frozen=True)
class Drive:
    site: str  # folder of D2S1R_DATA
    map: str
    scans: str
    truth: str
    words: tuple = ()  # of window_experiment
    parts: int = 1  # [-] logs of the drive; {} in the names of scans and truth stands for their numbers

    @property
    def name(self):
        return pathlib.Path(self.site).name if pathlib.Path(self.site).is_absolute() else self.site.replace("/", "-")


def foreign(name):
    return Drive(f"foreign/{name}", "map.yaml", "test.bag", "test_gt_checked.txt")


def run_of(name, *words):
    return Drive(name, "map_test.yaml", "run.rawlog", "run_gt.txt", words)


DRIVES = (
    run_of("intel"), run_of("mit_csail"), run_of("mit_killian", "frames=1000"), run_of("fr079", "apart=0.2"),
    run_of("fr_campus", "frames=500"), Drive("mines_runs", "map_test.yaml", "test.rawlog", "test_gt.txt"),
    Drive("foreign/wean2", "map_test.yaml", "test.rawlog", "test_gt.txt"), foreign("smart0310"), foreign("winterhome"),
    foreign("winterlab2_in_winterlab"), foreign("nhk108"), foreign("f1tenth"), foreign("arti_day2_in_day1"),
    foreign("wheeltec0609"))


MADE_SEEDS, MADE_DRIVES = range(101, 106), 6  # bent_maps.py tests on others


def make_buildings(folder):
    """Drives through buildings that repeat themselves, each in a map of another program."""
    drives = []
    for kind in sorted(look_alikes.KINDS):
        for seed in MADE_SEEDS:
            site = folder / f"{kind}_{seed}"
            if not (site / f"drive_{MADE_DRIVES - 1}_gt.txt").exists():
                look_alikes.main([kind, str(seed), str(site), "--drives", str(MADE_DRIVES)])
            drives.append(Drive(str(site), "map.yaml", "drive_{}.log", "drive_{}_gt.txt", parts=MADE_DRIVES))
    return drives


class Judge:
    """window_losses, which has read the terms of all drives."""

    def __init__(self, program, files):
        self.process = subprocess.Popen([program, *files], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __call__(self, point):
        """[drive, (frames, log-loss, localized right, wrong, alone right, wrong)]"""
        self.process.stdin.write(" ".join(f"{name}={value!r}" for name, value in point.items()) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError("window_losses stopped; run it by itself with the files of terms")
        return np.array([[float(word) for word in part.split()] for part in line.strip().strip(";").split(";")])


def point_of(logs):
    return {name: float(np.clip(start * math.exp(value), least, greatest))
            for value, (name, (start, least, greatest)) in zip(logs, CONSTANTS.items())}


def mean_loss(table, chosen):
    """[nat] a frame: long drives count more than short ones, but not in proportion."""
    weights = np.sqrt(table[chosen, 0])
    return float(np.sum(weights * table[chosen, 1] / table[chosen, 0]) / np.sum(weights))


def excess(table):
    """[-] by how much the share of windows that are wrong, of those that are localized, exceeds that of single scans."""
    _, _, right, wrong, alone_right, alone_wrong = table.sum(axis=0)
    if wrong == 0:
        return 0.0
    return max(0.0, wrong / (right + wrong) * (alone_right + alone_wrong) / max(1, alone_wrong) - 1)


def learn(judge, chosen, are_made):
    """The constants with the least loss on the chosen drives [bool by drive].
    \p are_made: [bool by drive] whether it is through a made building"""
    def loss(logs):
        table = judge(point_of(logs))
        more_wrong = sum(excess(table[chosen & kind]) for kind in (are_made, ~are_made))
        return mean_loss(table, chosen) + MORE_WRONG * more_wrong + PULL * float(np.sum(np.abs(logs)))
    start = np.zeros(len(CONSTANTS))
    simplex = np.vstack([start, np.eye(len(CONSTANTS))])
    for _ in range(2):  # Nelder and Mead's simplex collapses; a second one goes on from there
        found = optimize.minimize(loss, simplex[0], method="Nelder-Mead",
                                  options={"initial_simplex": simplex, "maxfev": 100, "xatol": 0.02, "fatol": 1e-5})
        simplex = found.x + 0.5 * np.vstack([start, np.eye(len(CONSTANTS))])
    return point_of(found.x)


def rounded(point):
    return {name: float(f"{value:.{DIGITS}g}") for name, value in point.items()}


def write_terms(program, drive, data, folder):
    """Follows a drive unless its terms are there."""
    file = folder / f"{drive.name}.terms"
    if file.exists():
        return file
    site, part, terms = data / drive.site, file.with_suffix(".part"), b""
    for number in range(drive.parts):
        scans, truth = drive.scans.format(number), drive.truth.format(number)
        done = subprocess.run(
            [program, site / drive.map, site / scans, site / truth, "-", f"terms={part}",
             f"cache={folder / drive.name}_{number}.cache", *drive.words], stderr=subprocess.PIPE, text=True)
        if done.returncode != 0:
            raise RuntimeError(done.stderr.strip())
        terms += part.read_bytes()
    part.write_bytes(terms)
    part.rename(file)
    return file


def report(drives, before, learned, left_out, points, minutes):
    def cells(row):
        return [f"{row[1] / row[0]:.4f}", f"{row[2]:.0f}", f"{row[3]:.0f}"]
    rows = [[drive.name, f"{one[0]:.0f}", f"{one[4]:.0f}", f"{one[5]:.0f}", *cells(start), *cells(one), *cells(out)]
            for drive, start, one, out in zip(drives, before, learned, left_out)]
    columns = ["drive", "frames", "alone: localized right", "wrong"]
    columns += [f"{what}: {column}" for what in ("before", "learned", "left out")
                for column in ("loss [nat]", "localized right", "wrong")]
    constants = [[name, f"{start:g}", *(f"{point[name]:g}" for point in points)]
                 for name, (start, _, _) in CONSTANTS.items()]
    return (f"# Windows\n\n`experiments/learn_windows.py`, {minutes:.0f} minutes.\n\n" +
            tables.table("Windows of ten frames", "Right: within 0.5 m and 10 deg. Alone: single scans. Before: with the "
                         "defaults then. Left out: with the constants learned without the building and a fourth of the others.", columns, rows) + "\n" +
            tables.table("Constants", "", ["constant", "start", "learned",
                         *(f"without part {i + 1}" for i in range(FOLDS))], constants))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=PROJECT / "build/release", help="build folder")
    parser.add_argument("--data", type=pathlib.Path, default=sites.default_folder(PROJECT), help="folder of the sites")
    parser.add_argument("--output", type=pathlib.Path, default=PROJECT / "build/learned", help="folder to write to")
    parser.add_argument("--jobs", type=int, default=2, help="programs that run at a time (default 2)")
    arguments = parser.parse_args()
    start = time.monotonic()
    programs, folder = arguments.build.resolve() / "experiments", arguments.build.resolve() / "learning/windows"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        arguments.output.mkdir(parents=True, exist_ok=True)
        drives = [drive for drive in DRIVES if (arguments.data / drive.site / drive.scans).exists()]
        if not drives:
            raise ValueError(f"{arguments.data}: has none of the drives; set D2S1R_DATA or --data")
        drives += make_buildings(folder)
        with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
            files = list(pool.map(
                lambda drive: write_terms(programs / "window_experiment", drive, arguments.data, folder), drives))
        judge = Judge(programs / "window_losses", files)
        before = judge({})
        everyone = np.ones(len(drives), dtype=bool)
        are_made = np.array([drive not in DRIVES for drive in drives])
        points = [rounded(learn(judge, everyone, are_made))]
        learned, left_out = judge(points[0]), np.zeros_like(before)
        for fold in range(FOLDS):
            out = np.arange(len(drives)) % FOLDS == fold
            points.append(rounded(learn(judge, ~out, are_made)))
            left_out[out] = judge(points[-1])[out]
    except (OSError, RuntimeError, ValueError) as error:
        sys.exit(f"learn_windows.py: {error}")
    ini = "[window]\n" + "".join(f"{name} = {value:g}\n" for name, value in points[0].items())
    (arguments.output / "windows.ini").write_text(ini)
    text = report(drives, before, learned, left_out, points, (time.monotonic() - start) / 60)
    (arguments.output / "windows.md").write_text(text)
    print(f"{arguments.output / 'windows.ini'}, table in {arguments.output / 'windows.md'}")


if __name__ == "__main__":
    main()
