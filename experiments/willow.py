#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Draws README's picture: willow.py willow-full-0.05.pgm [--build BUILD]

The map is that of GitHub's ros-planning/navigation_tutorials (navigation_stage/stage_config/maps; BSD). A robot drives along
DRIVE; full circles are simulated every STEP, in which things 0.4 to 2 m from the laser hide a part of the view. Each is
localized by itself in the whole map. Writes doc/willow.png, and says how many are localized, and how many of these right.
"""
import argparse
import csv
import math
import pathlib
import shutil
import subprocess
import tempfile

import needs

try:
    import numpy as np
except ImportError as error:
    needs.stop(error, "python3-numpy")

PROJECT = pathlib.Path(__file__).resolve().parents[1]
YAML = "image: {}\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
DRIVE = [  # x, y [m] in the map
    (2.0, 6.0), (10.0, 6.0), (15.6, 6.0), (15.9, 7.7), (16.4, 9.5), (17.5, 11.0), (17.8, 13.2), (18.6, 15.2), (18.8, 16.7), (19.6, 17.5),
    (35.4, 17.5), (44.1, 17.7), (49.8, 17.7), (50.8, 18.4), (50.8, 20.7), (50.7, 27.6), (50.0, 28.9), (48.3, 31.4), (47.1, 31.9),
    (45.9, 32.3), (46.1, 33.4), (46.6, 35.1), (46.9, 41.1), (46.0, 42.1), (44.8, 42.2), (34.1, 41.6), (23.4, 41.4), (22.2, 40.8),
    (22.2, 39.8), (23.2, 37.8), (25.4, 36.0), (27.3, 34.2), (27.9, 32.6), (27.8, 31.3), (26.7, 30.75), (21.7, 30.6), (20.9, 29.8),
    (20.6, 27.9), (20.7, 25.2), (20.2, 23.9), (18.2, 24.9), (14.2, 25.2), (13.6, 25.0), (13.7, 23.9), (13.9, 18.4)]
FINE = 0.05  # [m] between the points that are smoothed
SMOOTH = 31  # [points] whose mean is taken
STEP = 5  # [points] from scan to scan
HIDDEN = 0.3  # [0, 1] of the view


def poses():
    """x, y, phi [m, m, rad], looking ahead."""
    points = np.array(DRIVE)
    along = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    way = np.arange(0, along[-1], FINE)
    kernel, ends = np.ones(SMOOTH) / SMOOTH, SMOOTH // 2
    x, y = (np.convolve(np.pad(np.interp(way, along, points[:, axis]), ends, "edge"), kernel, "valid") for axis in (0, 1))
    return np.column_stack([x, y, np.arctan2(np.gradient(y), np.gradient(x))])[::STEP]


def is_right(row, pose):
    turn = math.remainder(float(row["phi"]) - pose[2], 2 * math.pi)
    return math.hypot(float(row["x"]) - pose[0], float(row["y"]) - pose[1]) < 0.3 and abs(turn) < math.radians(5)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("map", type=pathlib.Path, metavar="willow-full-0.05.pgm")
    parser.add_argument("--build", type=pathlib.Path, default=PROJECT / "build/release", help="build folder")
    arguments = parser.parse_args()
    drive = poses()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        yaml, truth = folder / "map.yaml", folder / "truth.txt"
        yaml.write_text(YAML.format(arguments.map.resolve()))
        truth.write_text("".join(f"{i} {x:.4f} {y:.4f} {phi:.5f}\n" for i, (x, y, phi) in enumerate(drive)))
        experiments = arguments.build / "experiments"
        for words in ([experiments / "simulate_circles", yaml, truth, folder / "ideal.rawlog"],
                      [experiments / "alter_scans", folder / "ideal.rawlog", folder / "scans.rawlog", f"blocked={HIDDEN}"],
                      [arguments.build / "apps/rawlog-localize/rawlog-localize", "-q", "-m", yaml, "-i", folder / "scans.rawlog",
                       "-o", folder / "out"]):
            subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
        with open(folder / "out/frames.csv", newline="") as stream:
            rows = list(csv.DictReader(stream))
        sure = [is_right(row, pose) for row, pose in zip(rows, drive, strict=True) if row["status"] == "localized"]
        shutil.copy(folder / "out/map.png", PROJECT / "doc/willow.png")
    print(f"{len(rows)} scans, {len(sure)} localized, {sum(sure)} of these right")


if __name__ == "__main__":
    main()
