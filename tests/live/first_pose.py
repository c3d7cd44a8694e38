#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Measures the processor time [s] that programs take to their first pose in the office, with an index that is there:

    first_pose.py BUILD [RUNS]

Of d2s1r-live it is the time to its first seed, beside d2s1r-live-drive, of which it localizes several scans; of the bundle's
rawlog-localize (target bundle) that of a run of one scan of the office's bag. The end of the program counts, too. Prints the
median and the range of RUNS (default 9).
"""
import os
import pathlib
import signal
import statistics
import subprocess
import sys
import tempfile

OFFICE = pathlib.Path(__file__).resolve().parents[2] / "share/d2s1r/data/office"
DOMAIN = os.environ.get("ROS_DOMAIN_ID", "96")


def spent(process):
    """[s] until a process ends"""
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime + usage.ru_stime


def of_live(build, folder):
    drive = subprocess.Popen([build / "apps/d2s1r-live-drive/d2s1r-live-drive", f"{OFFICE}.yaml", "60", "--kidnap", "0"],
                             stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    live = subprocess.Popen([build / "apps/d2s1r-live/d2s1r-live", "-m", f"{OFFICE}.yaml", "--index", folder / "live.index"],
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        if not any(line.startswith("told the tracker:") for line in live.stdout):
            sys.exit("d2s1r-live ended before it found the robot")
        live.send_signal(signal.SIGTERM)
        return spent(live)
    finally:
        drive.kill()
        drive.wait()


def of_log(build, folder):
    log = subprocess.Popen([build / "apps/rawlog-localize/bare/rawlog-localize", "-q", "-m", f"{OFFICE}.yaml", "-i",
                            f"{OFFICE}_bag", "--frames", "0:1", "--index", folder / "log.index", "-o", folder / "out"])
    seconds = spent(log)
    if log.returncode:
        sys.exit("rawlog-localize failed")
    return seconds


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    runs = int(sys.argv[2]) if len(sys.argv) > 2 else 9
    os.environ.update(ROS_DOMAIN_ID=DOMAIN, ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    with tempfile.TemporaryDirectory() as name:
        programs = {"d2s1r-live": of_live, "rawlog-localize of the bundle": of_log}
        times = {title: [] for title in programs}
        for run in range(runs + 1):  # in turns, so that other programs slow both alike
            for title, measure in programs.items():
                seconds = measure(build, pathlib.Path(name))
                if run > 0:  # the first one makes the index
                    times[title].append(seconds)
    for title, of_runs in times.items():
        print(f"{title}: {statistics.median(of_runs):.3f} s of processor time, {min(of_runs):.3f} to {max(of_runs):.3f}")


if __name__ == "__main__":
    main()
