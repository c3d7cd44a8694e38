#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Measures how well the tracker follows robots, and MRPT's particle filter, as --fuse runs it, on the same drives.

    D2S1R_DATA=sites experiments/track.py build/release/experiments/track_experiment --foreign FOLDER --drives 20
    D2S1R_DATA=sites experiments/track.py build/release/experiments/track_experiment --hours 10 --sites intel fr079

The drives are run.rawlog of the sites, the bags of FOLDER (each a folder with map.yaml, test.bag and test_gt.txt), and
simulated drives with people, 20 % of error of the odometry and kidnappings. MRPT's filter stands for amcl, which needs a
ROS installation. --hours lets the tracker alone drive for so long, by turns in the maps of the sites and on generated floors.
The table goes to standard output."""
import argparse
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys

sys.dont_write_bytecode = True  # the folder is part of the sources

import sites  # noqa: E402
import tables  # noqa: E402

SITES = ("intel", "fr079", "mit_csail", "mit_killian", "fr_campus")
VIEWS = ((360, 360), (270, 270), (220, 220), (180, 181))  # [deg] and beams
REACHES = (3.5, 5, 8, 15, 30)  # [m]
LINE = re.compile(
    r"(tracker|filter) +off (\S+) m \(95 % (\S+)\), (\S+) deg \((\S+)\); right (\S+) % of the time; start (\S+) s, "
    r"kidnapped (\d+): median (\S+), longest (\S+) s; sure (\d+) of (\d+), wrong (\d+); outside 3 std for (\S+) s, "
    r"sure (\S+) s, (\d+) times more than 3 s; cpu (\S+) ms \(mean (\S+)\)")


def simulated(count):
    """The settings of `count` drives, each with its name."""
    drives = []
    for i in range(count):
        view, beams = VIEWS[i % len(VIEWS)]
        reach, scale = REACHES[i % len(REACHES)], (1.2, 0.8)[i % 2]
        drives.append((f"simulated {i + 1}: {view} deg, {reach:g} m", [
            "simulated", f"seed={i + 1}", f"view={view}", f"beams={beams}", f"reach={reach}", f"scale={scale}", "seconds=300",
            "kidnap=60", f"stand={5 * (i % 3 == 0):d}", f"area={(400, 1200)[i % 2]}"]))
    return drives


def recorded(folders, frames):
    """The drives of folders with a map and either run.rawlog or test.bag, with their truth, or their first `frames` (0: all)."""
    few = [f"frames={frames}"] if frames else []
    drives = []
    for folder in folders:
        for log in (folder / "run.rawlog", folder / "test.bag"):
            truth = folder / f"{log.stem}_gt.txt"
            if log.exists() and truth.exists():
                drives.append((folder.name, ["recorded", str(folder / "map.yaml"), str(log), str(truth), *few]))
    return drives


def long_drives(program, hours, folders):
    """A row for each of 20 drives of the tracker, which take `hours` together."""
    count, rate = 20, 5  # [-], [Hz]
    maps = [str(folder / "map.yaml") for folder in folders]

    def row(drive):
        i, (name, words) = drive
        site = maps[i // 2 % len(maps)] if i % 2 == 0 else None
        words = words[:1] + [site] * bool(site) + words[1:] + ["filter=0", f"rate={rate}", f"seconds={3600 * hours / count}"]
        found = LINE.search(subprocess.run([program, *words], check=True, capture_output=True, text=True).stdout)
        name = name.split(": ")[1] + (", " + folders[i // 2 % len(maps)].name if site else ", generated floor")
        cells = [name, *found.group(6, 8, 9, 10), f"{found[13]} of {found[11]}", *found.group(15, 16)]
        print(cells, file=sys.stderr, flush=True)
        return cells

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(row, enumerate(simulated(count))))


def rows_of(program, name, words):
    """A row for the tracker and one for the filter."""
    output = subprocess.run([program, *words], check=True, capture_output=True, text=True).stdout
    rows = [[name, who, off, off95, turn, turn95, right, start, kidnappings, again, longest, f"{wrong} of {sure}", outside,
             outside_sure, cpu, mean]
            for (who, off, off95, turn, turn95, right, start, kidnappings, again, longest, sure, _, wrong, outside, outside_sure, _, cpu,
                 mean)
            in LINE.findall(output)]
    return [["-" if cell == "nan" else cell for cell in row] for row in rows]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("program", help="track_experiment")
    parser.add_argument("--sites", nargs="*", default=SITES)
    parser.add_argument("--foreign", type=pathlib.Path, help="folder of other drives")
    parser.add_argument("--drives", type=int, default=20, help="simulated ones")
    parser.add_argument("--frames", type=int, default=0, help="of each recorded drive; 0: all")
    parser.add_argument("--hours", type=float, help="of the tracker alone, in maps of the sites and on generated floors")
    arguments = parser.parse_args()
    folders = [site.folder for site in sites.named(arguments.sites)] if arguments.sites else []
    if arguments.hours:
        if not folders:
            parser.error("--hours needs the maps of --sites")
        print(tables.table(
            f"{arguments.hours:g} hours", "Simulated drives that the tracker follows.",
            ["drive", "right, % of the time", "kidnapped", "found after, s", "longest, s", "wrong of sure", "outside 3 std, sure, s",
             "times more than 3 s"], long_drives(arguments.program, arguments.hours, folders)))
        return
    if arguments.foreign:
        folders += sorted(path for path in arguments.foreign.iterdir() if path.is_dir())
    rows = []
    for name, words in recorded(folders, arguments.frames) + simulated(arguments.drives):
        rows += rows_of(arguments.program, name, words)
    print(tables.table(
        "Tracking", "The tracker, and MRPT's filter as --fuse runs it, which stands for amcl.",
        ["drive", "who", "off, m", "95 %", "off, deg", "95 %", "right, % of the time", "start, s", "kidnapped", "found after, s",
         "longest, s", "wrong of sure", "outside 3 std, s", "of sure, s", "processor, ms a scan", "mean"], rows))


if __name__ == "__main__":
    main()
