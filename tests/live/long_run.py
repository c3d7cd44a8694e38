#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Lets d2s1r-live watch a simulated robot for hours: long_run.py BUILD MAP.yaml SECONDS OUT.csv

The robot publishes ten scans a second and is carried away once a minute; d2s1r-live runs with --seed watch. A row a minute
tells memory [MB] and processor time [s] of d2s1r-live so far. At the end come what the drive said, the growth of memory after
the first ten minutes, and the share of a core.
"""
import os
import pathlib
import signal
import subprocess
import sys
import time

DOMAIN = "97"
START_UP = 600  # [s] in which memory may still grow: the index, and histories that fill


def usage(process):
    """Returns (resident memory [MB], processor time [s]) of a process."""
    folder = pathlib.Path(f"/proc/{process.pid}")
    status = dict(line.split(":", 1) for line in (folder / "status").read_text().splitlines() if ":" in line)
    fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
    return int(status["VmRSS"].split()[0]) / 1024, (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def watch(live, drive, table):
    """Returns a row (time [s], memory [MB], processor time [s]) for each minute until the drive ends."""
    rows, start = [], time.monotonic()
    while drive.poll() is None:
        rows.append((time.monotonic() - start, *usage(live)))
        table.write("{:.0f},{:.1f},{:.1f}\n".format(*rows[-1]))
        table.flush()
        try:
            drive.wait(60)
        except subprocess.TimeoutExpired:
            pass
    return rows


def main():
    build, site_map, seconds, out = pathlib.Path(sys.argv[1]), *sys.argv[2:]
    command = [build / "apps/d2s1r-live/d2s1r-live", "--seed", "watch", "--domain", DOMAIN, "--quiet"]
    with subprocess.Popen(command) as live, open(out, "w", encoding="utf-8") as table:
        table.write("seconds,memory_mb,processor_s\n")
        with subprocess.Popen([build / "apps/d2s1r-live-drive/d2s1r-live-drive", site_map, seconds],
                              env=dict(os.environ, ROS_DOMAIN_ID=DOMAIN)) as drive:
            rows = watch(live, drive, table)
        before = time.monotonic()
        live.send_signal(signal.SIGTERM)
        live.wait()
    print(f"ended {time.monotonic() - before:.2f} s after SIGTERM, exit status {live.returncode}")
    later = [row for row in rows if row[0] >= START_UP]
    if len(later) > 1:
        (begin, memory, spent), (end, last_memory, all_spent) = later[0], later[-1]
        print(f"memory {memory:.1f} MB after {begin / 60:.0f} min, {last_memory:.1f} MB after {end / 60:.0f} min; "
              f"{100 * (all_spent - spent) / (end - begin):.1f} % of a core")


if __name__ == "__main__":
    main()
