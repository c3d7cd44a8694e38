# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Sends the scans of a rawlog into rawlog-localize --stream, one every 25 ms, and says how long after each its line came,
less the time that localizing it took. What it prints is in RESULTS.md.

Usage: measure_stream.py MAP RAWLOG [OPTION]..., where RAWLOG holds nothing but scans, each an object of its own, and
RAWLOG_LOCALIZE names the program."""
import gzip
import json
import os
import subprocess
import sys
import time

PERIOD = 0.025  # [s]
START_OF_SCAN = b"\xa2mrpt::obs::CObservation2DRangeScan"  # the length of the name, with MRPT's mark, and the name


def read_lines():
    """In a process of its own, whose clock is the same: prints when each line came and what it said."""
    for line in sys.stdin.buffer:
        came = time.monotonic()
        told = json.loads(line)
        print(told["frame"], came, told["total_ms"])


def main(building, log, *options):
    scans = [START_OF_SCAN + scan for scan in gzip.open(log).read().split(START_OF_SCAN)[1:]]
    program = subprocess.Popen([os.environ["RAWLOG_LOCALIZE"], "-m", building, "-i", "-", "--stream", *options],
                               stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
    reader = subprocess.Popen([sys.executable, __file__], stdin=program.stdout, stdout=subprocess.PIPE, text=True)
    time.sleep(2)  # for the map
    sent, start = [], time.monotonic()
    for i, scan in enumerate(scans):
        time.sleep(max(0, start + i * PERIOD - time.monotonic()))
        sent.append(time.monotonic())
        program.stdin.write(scan)
    program.stdin.close()
    waits = []  # [ms]
    for line in reader.communicate()[0].splitlines():
        frame, came, total_ms = line.split()
        waits.append(1000 * (float(came) - sent[int(frame)]) - float(total_ms))
    waits.sort()
    assert program.wait() == 0 and len(waits) == len(scans), (program.returncode, len(waits), len(scans))
    print(f"{len(waits)} lines; from a scan to its line, less the time of localizing: median {waits[len(waits) // 2]:.2f} ms, "
          f"99 of 100 within {waits[len(waits) * 99 // 100]:.2f} ms, greatest {waits[-1]:.2f} ms, "
          f"{sum(wait > 5 for wait in waits)} of more than 5 ms")


if __name__ == "__main__":
    main(*sys.argv[1:]) if len(sys.argv) > 2 else read_lines()
