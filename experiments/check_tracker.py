#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Measures what rawlog-localize --check tells of trackers with planted faults, on the drives of recorded sites.

The tracker is the truth, but for faults that follow one another with good stretches between them: jumps of 0.5 to 20 m in
any direction, turns by 180 deg, and drifts. A jump is told if a frame is "lost" by the fifth localized frame after it;
frames that are not localized on their own cannot tell. A false alarm is a frame that is "lost" while the tracker is right.

  D2S1R_DATA=sites experiments/check_tracker.py build/release/apps/rawlog-localize/rawlog-localize [SITE...]
"""
import argparse
import csv
import math
import os
import pathlib
import random
import subprocess
import sys
import tempfile

STRETCH = 15  # [-] frames of a fault, and of a good stretch
IN_TIME = 5  # [-] localized frames after which a jump must have been told
JUMPS = (0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0)  # [m]
KINDS = [("jump", distance) for distance in JUMPS] + [("turn", 180.0), ("drift", 0.05), ("drift", 0.2)]  # [deg], [m a frame]
AWAY = (0.4, 20.0)  # [m], [deg] the bounds of --watch


def planted(truth, seed):
    """Returns the poses of the tracker, and of each frame the fault: kind, size, frames since it began, or None."""
    rng = random.Random(seed)
    poses, faults = [], []
    for start in range(0, len(truth), 2 * STRETCH):
        kind, size = KINDS[start // (2 * STRETCH) % len(KINDS)]
        direction = rng.uniform(-math.pi, math.pi)
        for i, (time, x, y, phi) in enumerate(truth[start:start + 2 * STRETCH]):
            since = i - STRETCH
            if since < 0:
                poses.append((time, x, y, phi))
                faults.append(None)
                continue
            off = {"jump": size, "turn": 0.0, "drift": size * (since + 1)}[kind]
            turn = math.pi if kind == "turn" else 0.0
            poses.append((time, x + off * math.cos(direction), y + off * math.sin(direction), phi + turn))
            faults.append((kind, size, since))
    return poses, faults


def check(program, site, poses, folder, options):
    tracker = folder / "tracker.txt"
    tracker.write_text("".join(f"{t:.6f} {x:.6f} {y:.6f} {phi:.6f}\n" for t, x, y, phi in poses))
    out = folder / "out"
    subprocess.run(
        [program, "-m", site / "map.yaml", "-i", site / "run.rawlog", "-o", out, "--check", tracker, "--no-rawlog", "-q", *options],
        check=True)
    with open(out / "check.csv", newline="") as checks, open(out / "frames.csv", newline="") as frames:
        return [
            (check["verdict"], frame["status"]) for check, frame in zip(csv.DictReader(checks), csv.DictReader(frames))]


def count(verdicts, faults):
    """Returns [told, all] by kind and size, the false alarms, and the number of frames of each verdict on good stretches."""
    told, alarms, good = {}, 0, {"fits": 0, "cannot tell": 0, "lost": 0}
    pending = None  # the fault that has not been told yet, and its localized frames so far
    for (verdict, status), fault in zip(verdicts, faults):
        if fault is None:
            pending = None
            good[verdict] += 1
            alarms += verdict == "lost"
            continue
        kind, size, since = fault
        if since == 0:
            pending = [fault, 0, False]
        if pending is None:
            continue
        pending[1] += status == "localized"
        pending[2] = pending[2] or verdict == "lost"
        if pending[2] or pending[1] >= (IN_TIME if kind != "drift" else STRETCH):
            of_kind = told.setdefault((kind, size), [0, 0])
            of_kind[0] += pending[2]
            of_kind[1] += 1
            pending = None
    return told, alarms, good


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("sites", nargs="*", default=["intel", "fr079", "mit_csail", "mit_killian", "fr_campus"])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--frames", type=int, default=0, help="of each drive; 0: all")
    parser.add_argument("--window", type=int, default=1, help="scans that are judged together")
    args = parser.parse_args()
    data = pathlib.Path(os.environ.get("D2S1R_DATA", "../shared/data"))
    print("| site | kind | size | told in time |")
    print("| --- | --- | --- | --- |")
    all_alarms = 0
    for name in args.sites:
        site = data / name
        if not (site / "run.rawlog").exists():
            sys.exit(f"{site}: has no run.rawlog; name a site below D2S1R_DATA")
        truth = [
            tuple(map(float, line.split())) for line in (site / "run_gt.txt").read_text().splitlines()
            if line and line[0] not in "%#"]
        truth = truth[:args.frames] if args.frames else truth
        poses, faults = planted(truth, args.seed)
        with tempfile.TemporaryDirectory() as folder:
            options = ["--frames", f"0:{args.frames}"] if args.frames else []
            options += ["--window", str(args.window)] if args.window > 1 else []
            verdicts = check(args.program, site, poses, pathlib.Path(folder), options)
        if len(verdicts) != len(faults):
            sys.exit(f"{site}: has {len(verdicts)} frames and {len(faults)} lines of truth; they must be the same")
        told, alarms, good = count(verdicts, faults)
        all_alarms += alarms
        for (kind, size), (right, total) in sorted(told.items()):
            unit = {"jump": "m", "turn": "deg", "drift": "m a frame"}[kind]
            print(f"| {name} | {kind} | {size:g} {unit} | {right} of {total} |")
        print(f"| {name} | none | | {alarms} false alarms in {sum(good.values())} frames ({good['fits']} fit) |")
    print(f"\n{all_alarms} false alarms in all")


if __name__ == "__main__":
    main()
