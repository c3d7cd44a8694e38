#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Lets d2s1r-live watch a simulated robot for hours:

    long_run.py BUILD MAP.yaml SECONDS OUT.csv [--track] [OPTION of d2s1r-live-drive]...

The robot publishes ten scans a second and is carried away once a minute; d2s1r-live runs with --seed watch, or with --track. A
row a minute tells memory [MB] and processor time [s] of d2s1r-live so far. At the end come what the drive said, the growth of
memory after the first ten minutes, and the share of a core. With --track, OUT_log.csv gets the pose at each scan, true and told,
and a line says how often it was right.
"""
import csv
import math
import os
import pathlib
import signal
import subprocess
import sys
import time

DOMAIN = os.environ.get("ROS_DOMAIN_ID", "97")
START_UP = 600  # [s] in which memory may still grow: the index, and histories that fill
RIGHT = (0.3, 10.0)  # [m], [deg] at most


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


def judge(scans):
    """Prints how often the pose was right at the scans of a log, and after how long it was after each kidnapping."""
    count, right, kidnappings, carried_at, found_after = 0, 0, 0, None, []
    for row in scans:
        now, x, y, yaw = (float(row[name]) for name in ("time", "x", "y", "yaw_deg"))
        if int(row["kidnappings"]) > kidnappings:
            kidnappings, carried_at = int(row["kidnappings"]), now
        count += 1
        if not row["told_x"]:
            continue
        off = math.dist((x, y), (float(row["told_x"]), float(row["told_y"])))
        turn = abs(math.remainder(float(row["told_yaw_deg"]) - yaw, 360))
        if off > RIGHT[0] or turn > RIGHT[1]:
            continue
        right += 1
        if carried_at is not None:
            found_after.append(now - carried_at)
            carried_at = None
    print(f"the pose was right (0.3 m, 10 deg) at {right} of {count} scans, {100 * right / max(1, count):.2f} %")
    if found_after:
        found_after.sort()
        print(f"right again after {len(found_after)} of {kidnappings} kidnappings, in the median after "
              f"{found_after[len(found_after) // 2]:.2f} s, at most after {found_after[-1]:.2f} s")


def main():
    build, site_map, seconds, out = pathlib.Path(sys.argv[1]), *sys.argv[2:5]
    options = sys.argv[5:]
    tracks = "--track" in options
    log = pathlib.Path(out).with_name(pathlib.Path(out).stem + "_log.csv")
    if tracks:
        options.remove("--track")
        options += ["--log", log]
    command = [build / "apps/d2s1r-live/d2s1r-live", *(["--track"] if tracks else ["--seed", "watch"]), "--domain", DOMAIN,
               "--quiet"]
    with subprocess.Popen(command) as live, open(out, "w", encoding="utf-8") as table:
        table.write("seconds,memory_mb,processor_s\n")
        with subprocess.Popen([build / "apps/d2s1r-live-drive/d2s1r-live-drive", site_map, seconds, *options],
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
    if tracks:
        with open(log, newline="", encoding="utf-8") as table:
            judge(csv.DictReader(table))


if __name__ == "__main__":
    main()
