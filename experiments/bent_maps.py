#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Counts right and wrong answers in buildings that repeat themselves, in maps as another program would draw them.

    experiments/bent_maps.py --seeds 1 2 3 --drives 6

learning/look_alikes.py makes a building of each kind and seed; the program localizes its drives by single scans and by
windows of 5 and 10 scans. Right is within 1 m and 10 deg. The table goes to standard output."""
import argparse
import pathlib
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True  # the folder is part of the sources

import runs  # noqa: E402
import sites  # noqa: E402
import tables  # noqa: E402
from learning import look_alikes  # noqa: E402

WINDOWS = (1, 5, 10)  # [scans]


class Drive:
    """A job of runs.read_frames()."""
    scans, map_site, position = "drive", None, 1

    def __init__(self, folder, number):
        self.folder, self.log, self.truth_of_drive = folder, folder / f"drive_{number}.log", folder / f"drive_{number}_gt.txt"

    @property
    def site(self):
        return self

    def truth(self, _):
        return sites.Truth.read(self.truth_of_drive)

    def knowledge(self, _):
        return {}

    def localized(self, program, window):
        """[runs.Frame] of those that are."""
        with tempfile.TemporaryDirectory() as out:
            command = [program, "-q", "-m", self.folder / "map.yaml", "-i", self.log, "--window", window, "-o", out, "--no-rawlog", "--as-told"]
            subprocess.run(list(map(str, command)), check=True)
            frames = runs.read_frames(pathlib.Path(out) / "frames.csv", self)
        return [frame for frame in frames if frame.status == "localized"]


def counts_of(program, folder, drives):
    """Texts `right / wrong` by window, and what they count."""
    found = []
    for window in WINDOWS:
        frames = [frame for number in range(drives) for frame in Drive(folder, number).localized(program, window)]
        right = sum(frame.is_within(1, 10) for frame in frames)
        found.append((right, len(frames) - right))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=pathlib.Path, default=runs.HERE.parent / "build/release", help="build folder")
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3])
    parser.add_argument("--drives", type=int, default=6, help="of a building, 30 scans each")
    parser.add_argument("--moved", type=float, default=0.1, help="share of the loose things that were moved, and gone (default 0.1)")
    arguments = parser.parse_args()
    program = arguments.build / "apps/rawlog-localize/rawlog-localize"
    rows = []
    total = [(0, 0)] * len(WINDOWS)
    for kind in sorted(look_alikes.KINDS):
        for seed in arguments.seeds:
            with tempfile.TemporaryDirectory() as folder:
                look_alikes.main([kind, str(seed), folder, "--drives", str(arguments.drives), "--moved", str(arguments.moved)])
                counts = counts_of(program, pathlib.Path(folder), arguments.drives)
            total = [(a + c, b + d) for (a, b), (c, d) in zip(total, counts)]
            rows.append([f"{kind} {seed}", *(f"{right} / {wrong}" for right, wrong in counts)])
            print(rows[-1], file=sys.stderr, flush=True)
    rows.append(["all", *(f"{right} / {wrong}" for right, wrong in total)])
    print(tables.table("Bent maps", "`localized` and right / wrong by 1 m or 10°.",
                       ["building", "single scans", *(f"windows of {window}" for window in WINDOWS[1:])], rows))


if __name__ == "__main__":
    main()
