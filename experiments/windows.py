#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Measures how far the confidence of windows can be trusted: windows.md in --output.

The drives are those of learn_windows.py (D2S1R_DATA, its folder foreign included). The tables: single scans and windows of
each drive; the errors that windows tell and those seen, by confidence; the greatest jumps of the confidence from frame
to frame, each with its cause; and drives whose odometry is disturbed, with windows and with the filter. Right is within
0.5 m and 10 deg. Single scans stay in the build folder: delete the folder learning/windows there when map, drive or
localizer change.

Needs Debian's python3-numpy and python3-scipy, and a build with its tests' programs.
"""
import argparse
import concurrent.futures
import csv
import dataclasses
import math
import pathlib
import re
import subprocess
import sys

sys.dont_write_bytecode = True  # the folder is part of the sources

import learn_windows  # noqa: E402
import intervals  # noqa: E402
import measures  # noqa: E402
import sites  # noqa: E402
import tables  # noqa: E402

PROJECT = pathlib.Path(__file__).resolve().parents[1]
BINS = ((0.9, 0.99), (0.99, 0.999), (0.999, 1.0001))
BINNED = ("intel", "mit_csail", "mit_killian", "fr079", "fr_campus")
JUMPS = 20  # [-] that are listed
DISTURBED = ("intel", "mit_csail", "mit_killian", "fr079", "mines_runs")
DISTURBANCES = ((1.0, 0), (0.6, 0), (1.7, 0), (1.0, 12), (1.7, 12))  # [-] ways times, [deg] noise of turns
MOST_DISTURBED = 200  # [frames] of a drive whose odometry is disturbed


@dataclasses.dataclass(frozen=True)
class Answer:
    localized: bool
    confidence: float
    pose: tuple  # (x, y, phi) [m, rad]; None if there is none
    right: bool  # within 0.5 m and 10 deg of the truth
    at_place: bool  # within 1.2 m and 20 deg: maps and ground truths of these drives are off by that much in places


@dataclasses.dataclass(frozen=True)
class Frame:
    number: int
    truth: tuple  # (x, y, phi) [m, rad]
    alone: Answer
    window: Answer
    presence: float  # [0, 1] of the window
    frames: int  # of the window
    absence: float  # [nat] of the newest frame
    scale: float  # [-] that scans tell of the odometry
    explained: float  # [0, 1] share of the returns of the scan where the window puts the robot, nan without a place
    explained_there: float  # [0, 1] the same where the ground truth puts it
    apart: float  # [m] these poses are, when both are moved to where the scan fits best nearby
    lead: float  # [-] by how much the scan fits better where the window puts the robot, as log-odds


def difference(pose, other):
    """(m, rad)"""
    turn = (pose[2] - other[2] + math.pi) % (2 * math.pi) - math.pi
    return math.hypot(pose[0] - other[0], pose[1] - other[1]), abs(turn)


def is_near(pose, other, most_way, most_turn):
    """Within so many [m, deg]."""
    way, turn = difference(pose, other)
    return way < most_way and turn < math.radians(most_turn)


def answer_of(row, prefix, truth):
    pose = tuple(float(row[prefix + name]) for name in ("x", "y", "phi")) if row[prefix + "x"] else None
    right, at_place = (pose is not None and is_near(pose, truth, *most) for most in ((0.5, 10), (1.2, 20)))
    return Answer(row[prefix + "status"] == "localized", float(row[prefix + "confidence"]), pose, right, at_place)


def frames_of(file):
    with open(file, newline="", encoding="utf-8") as rows:
        for row in csv.DictReader(rows):
            truth = tuple(float(row[name]) for name in ("true_x", "true_y", "true_phi"))
            yield Frame(int(row["frame"]), truth, answer_of(row, "", truth), answer_of(row, "window_", truth),
                        float(row["window_presence"]), int(row["window_frames"]), float(row["window_absence"]),
                        float(row["odometry_scale"]),
                        *(float(row[name] or "nan") for name in ("window_explained", "true_explained", "fits_apart",
                                                                "window_lead")))


def run(command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())
    return done.stdout


def files_of(drive, data):
    site = data / drive.site
    return [site / drive.map, site / drive.scans, site / drive.truth]


def follow(arguments, drive, words=(), frames=None):
    """Frames of a drive by window_experiment."""
    folder = arguments.build.resolve() / "learning/windows"
    name = "-".join([drive.name, *words]).replace("=", "_")
    cut = [f"frames={frames}"] if frames else []
    cache = folder / (drive.name + (f"-{frames}" if frames else "") + ".cache")
    file = folder / f"{name}.csv"
    run([arguments.build.resolve() / "experiments/window_experiment", *files_of(drive, arguments.data), file,
         f"cache={cache}", *drive.words, *cut, *words])
    return list(frames_of(file))


def fuse(arguments, drive, motion, words, frames):
    """(tracking, of these wrong) by fusion_experiment."""
    folder = arguments.build.resolve() / "learning/windows"
    told = run([arguments.build.resolve() / "experiments/fusion_experiment", *files_of(drive, arguments.data),
                folder / f"{drive.name}-{frames}-whole.cache", "whole", motion, str(frames), *words])
    return tuple(int(number) for number in re.search(r"tracking in (\d+) frames, wrong in (\d+)", told).groups())


def right_and_wrong(answers):
    localized = [answer for answer in answers if answer.localized]
    right = sum(answer.right for answer in localized)
    return f"{right} / {len(localized) - right}"


def drives_table(drives):
    rows = [[name, str(len(frames)), right_and_wrong(f.alone for f in frames), right_and_wrong(f.window for f in frames)]
            for name, frames in drives.items()]
    every = [frame for frames in drives.values() for frame in frames]
    rows.append(["all", str(len(every)), right_and_wrong(f.alone for f in every), right_and_wrong(f.window for f in every)])
    return tables.table("Drives", "`localized` and right / wrong.", ["drive", "frames", "single scans", "windows"], rows)


def is_told(told, seen, low, high):
    """Whether the errors told are within the interval of those seen, or within a factor of 2 of them. [%]"""
    return low <= told <= high or (seen > 0 and 0.5 <= told / seen <= 2)


def bins_table(drives, is_right, meaning):
    rows = []
    for low, high in BINS:
        of_drives = [[frame.window for frame in drives.get(name, ()) if low <= frame.window.confidence < high] for name in BINNED]
        answers = [answer for answers in of_drives for answer in answers]
        wrong = sum(not is_right(answer) for answer in answers)
        if not answers:
            continue
        told = 100 * measures.mean(1 - answer.confidence for answer in answers)
        interval = intervals.share_interval([[not is_right(answer) for answer in answers] for answers in of_drives])
        rows.append([f"{low:g} to {min(1, high):g}", str(len(answers)), str(wrong), f"{told:.3f}",
                     f"{100 * wrong / len(answers):.3f}", f"{interval[0]:.3f} to {interval[1]:.3f}",
                     "yes" if is_told(told, 100 * wrong / len(answers), *interval) else "no"])
    return tables.table(
        "Errors told and seen", f"Windows on {', '.join(BINNED)}. Wrong: {meaning} beside the ground truth. Agreed: told "
        "within the 95 % interval of those seen, or within a factor of 2.",
        ["confidence", "frames", "wrong", "told [%]", "seen [%]", "interval [%]", "agreed"], rows)


def wrong_table(drives):
    rows = []
    for name in BINNED:
        for frame in drives.get(name, ()):
            if not frame.window.localized or frame.window.right:
                continue
            way, turn = difference(frame.window.pose, frame.truth)
            rows.append([name, str(frame.number), f"{way:.2f}", f"{math.degrees(turn):.1f}",
                         f"{frame.window.confidence:.4f}", f"{frame.explained:.2f}", f"{frame.explained_there:.2f}",
                         f"{frame.apart:.2f}", f"{frame.lead:+.1f}"])
    return tables.table(
        "Localized and wrong", "The share of the scan's returns that walls explain where the window puts the robot and where "
        "the ground truth does, each moved to where the scan fits best nearby; how far apart these poses are; the lead of the "
        "former as log-odds.",
        ["drive", "frame", "beside the truth [m]", "[deg]", "confidence", "explained", "at the truth", "apart [m]", "lead"],
        rows)


def moved(frame, before):
    """The answer before, moved as the robot moved."""
    x, y, phi = before.window.pose
    turn = phi - before.truth[2]
    dx, dy = frame.truth[0] - before.truth[0], frame.truth[1] - before.truth[1]
    return (x + math.cos(turn) * dx - math.sin(turn) * dy, y + math.sin(turn) * dx + math.cos(turn) * dy,
            phi + frame.truth[2] - before.truth[2])


def cause_of(before, frame):
    """Why the confidence of a window changed from one frame to the next."""
    if frame.frames == 1:
        return "no motion links the frame: its scan answers alone"
    if not frame.window.pose:
        return f"the scan shows no place (absence {frame.absence:+.1f} nat)"
    if not before.window.pose:
        return f"the scan shows a place again (absence {frame.absence:+.1f} nat)"
    if not is_near(frame.window.pose, moved(frame, before), 0.5, 10):
        return f"another place is the best, {difference(frame.window.pose, moved(frame, before))[0]:.1f} m away"
    change = frame.window.confidence - before.window.confidence
    if (frame.presence - before.presence) / change > 0.5:
        return f"the scan speaks {'against' if change < 0 else 'for'} all places (absence {frame.absence:+.1f} nat)"
    return f"the scan shows the best and others {'more' if change < 0 else 'less'} alike than scans before"


def jumps_table(drives):
    pairs = [(name, before, frame) for name, frames in drives.items() for before, frame in zip(frames, frames[1:])
             if frame.number == before.number + 1]
    pairs.sort(key=lambda pair: -abs(pair[2].window.confidence - pair[1].window.confidence))
    rows = [[name, str(frame.number), f"{before.window.confidence:.3f} to {frame.window.confidence:.3f}",
             f"{before.alone.confidence:.3f} to {frame.alone.confidence:.3f}", cause_of(before, frame)]
            for name, before, frame in pairs[:JUMPS]]
    return tables.table(f"The {JUMPS} greatest jumps", "", ["drive", "frame", "window", "its scans alone", "cause"], rows)


def disturbed_table(arguments, drives):
    def row(scale, noise):
        words = (f"scale={scale:g}", f"yaw_noise={noise:g}")
        alone, window, scales, of_filter = [], [], [], {"both": [], "odometry": []}
        for drive in drives:
            plain = dataclasses.replace(drive, words=())
            frames = follow(arguments, plain, words, MOST_DISTURBED)
            alone += [frame.alone for frame in frames]
            window += [frame.window for frame in frames]
            scales.append(f"{frames[-1].scale:.2f}")
            for motion, counts in of_filter.items():
                counts.append(fuse(arguments, plain, motion, words, MOST_DISTURBED))
        sums = [map(sum, zip(*counts)) for counts in of_filter.values()]
        return [f"{scale:g}", f"{noise:g}", right_and_wrong(alone), right_and_wrong(window),
                *(f"{tracking - misled} / {misled}" for tracking, misled in sums), f"{1 / scale:.2f}",
                ", ".join(scales)]
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        rows = [row(*DISTURBANCES[0])]  # writes the caches
        rows += pool.map(lambda one: row(*one), DISTURBANCES[1:])
    return tables.table(
        "Disturbed odometry", f"The first {MOST_DISTURBED} frames of {', '.join(d.name for d in drives)}: `localized` (filter: "
        "`tracking`, from frame 20 on, by odometry and scans or by odometry) and right / wrong. The noise is the standard "
        "deviation of each turn.",
        ["ways times", "yaw noise [deg]", "single scans", "windows", "filter", "by odometry", "right scale",
         "scales told"], rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=PROJECT / "build/release", help="build folder")
    parser.add_argument("--data", type=pathlib.Path, default=sites.default_folder(PROJECT), help="folder of the sites")
    parser.add_argument("--output", type=pathlib.Path, default=PROJECT / "build/windows", help="folder to write to")
    parser.add_argument("--jobs", type=int, default=2, help="programs that run at a time (default 2)")
    arguments = parser.parse_args()
    drives = [drive for drive in learn_windows.DRIVES if (arguments.data / drive.site / drive.scans).exists()]
    if not drives:
        sys.exit(f"windows.py: {arguments.data} has none of the drives; set D2S1R_DATA or --data")
    (arguments.build.resolve() / "learning/windows").mkdir(parents=True, exist_ok=True)
    arguments.output.mkdir(parents=True, exist_ok=True)
    try:
        with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
            followed = dict(zip([d.name for d in drives], pool.map(lambda drive: follow(arguments, drive), drives)))
        parts = [drives_table(followed), bins_table(followed, lambda answer: answer.right, "0.5 m or 10 deg"),
                 bins_table(followed, lambda answer: answer.at_place, "1.2 m or 20 deg"), wrong_table(followed),
                 jumps_table(followed), disturbed_table(arguments, [drive for drive in drives if drive.name in DISTURBED])]
    except (OSError, RuntimeError) as error:
        sys.exit(f"windows.py: {error}")
    file = arguments.output / "windows.md"
    file.write_text("# Windows\n\n`experiments/windows.py`\n\n" + "\n".join(part for part in parts if part))
    print(f"tables in {file}")


if __name__ == "__main__":
    main()
