#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Measures README's table in one run and writes it: headline.py PROGRAM [--write README.md] [--frames N]

Runs rawlog-localize on the sites below D2S1R_DATA, one thread, one set after the other, all scans of each (or N of them).
With --write the table and the line about the machine replace those between the marks in README.
"""
import argparse
import csv
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import measures
import sites

ROWS = [  # site, set, map of another site, what README calls it
    ("intel", "test", None, "offices round a loop"),
    ("fr079", "test", None, "offices on a corridor"),
    ("mit_csail", "test", None, "offices"),
    ("mit_killian", "test", None, "corridors that look alike"),
    ("fr_campus", "test", None, "outdoors, 180° at 10 cm"),
    ("mines_runs", "test", None, "a cluttered classroom, 240°, reach 4 m"),
    ("intel", "test", "mit_csail", "scans of intel in the map of mit_csail: what nothing explains")]
WITHIN = "accuracy_0.3m_5deg"
BEGIN, END = "<!-- headline.py writes what follows -->", "<!-- until here -->"


def machine():
    """(processor, last-level cache)"""
    text = subprocess.run(["lscpu"], capture_output=True, text=True, check=True, env={**os.environ, "LC_ALL": "C"}).stdout
    found = {name: re.search(rf"^{name}.*?:\s*(.*)$", text, re.M) for name in ("Model name", "L3 cache")}
    return tuple(match.group(1).split("(")[0].strip() if match else "unknown" for match in found.values())


def interval(right, count):
    low, high = measures.wilson(right, count)
    return f"{100 * right / count:.1f} % ({low:.1f}-{high:.1f})" if count else "-"


def times(frames_csv):
    with open(frames_csv, newline="") as stream:
        return [float(row["total_ms"]) for row in csv.DictReader(stream)]


def run(program, folder, row, frames, out):
    site, scans, other, _ = row
    where = sites.Site(site, folder / site)
    searched = where.map(scans) if other is None else sites.Site(other, folder / other).map(scans)
    command = [program, "-q", "-m", searched, "-i", where.folder / f"{scans}.rawlog", "-o", out, "--no-rawlog"]
    if other is None:
        command += ["--ground-truth", where.truth_file(scans)]
    if frames:
        count = sum(1 for _ in where.truth(scans))
        command += ["--frames", f"::{max(1, count // frames)}"]
    subprocess.run(list(map(str, command)), check=True)
    return json.loads((out / "summary.json").read_text()), json.loads((out / "run.json").read_text())


def table_row(row, summary, milliseconds):
    site, _, other, what = row
    time = f"{measures.median(milliseconds):.1f} ms, {measures.mean(milliseconds):.1f} ms"
    if other:
        return f"| {what} | {summary['frames']} | - | {interval(summary['localized'], summary['frames'])} | - | - | {time} |"
    right = summary[WITHIN]
    return (f"| {site}: {what} | {right['frames']} | {interval(right['successes'], right['frames'])} "
            f"| {100 * right['localized'] / right['frames']:.1f} % | {interval(right['localized_successes'], right['localized'])} "
            f"| {right['position_error_mean_m']:.3f} m, {right['yaw_error_mean_deg']:.2f}° | {time} |")


def main():
    project = pathlib.Path(__file__).resolve().parents[1]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--write", type=pathlib.Path)
    parser.add_argument("--frames", type=int)
    arguments = parser.parse_args()
    folder = sites.default_folder(project)
    load = os.getloadavg()[0]
    lines = ["| building | scans | success | localized | of these, right | mean error | time a scan: median, mean |",
             "| --- | --- | --- | --- | --- | --- | --- |"]
    rows = [row for row in ROWS if (folder / row[0]).exists()]
    if not rows:
        sys.exit(f"headline.py: {folder} holds none of {', '.join(sorted({row[0] for row in ROWS}))}; set D2S1R_DATA to "
                 "the folder of the sites")
    for row in ROWS:
        if row not in rows:
            print(f"headline.py: {folder} holds no {row[0]}: a row is left out", file=sys.stderr)
    for row in rows:
        with tempfile.TemporaryDirectory() as out:
            summary, told = run(arguments.program, folder, row, arguments.frames, pathlib.Path(out))
            lines.append(table_row(row, summary, times(pathlib.Path(out) / "frames.csv")))
            print(lines[-1], flush=True)
    commit = subprocess.run(["git", "-C", project, "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False).stdout.strip()
    processor, cache = machine()
    lines += ["", f"Measured by `experiments/headline.py` at commit {commit}: one thread of {processor}, SIMD target "
              f"{told.get('simd', 'unknown')}, {cache} of last-level cache, load {load:.1f} before the run."]
    print("\n".join(lines))
    if arguments.write:
        text = arguments.write.read_text()
        before, after = text[:text.index(BEGIN) + len(BEGIN)], text[text.index(END):]
        arguments.write.write_text(f"{before}\n\n" + "\n".join(lines) + f"\n\n{after}")


if __name__ == "__main__":
    main()
