#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Measures README's table in one run and writes it: headline.py PROGRAM [--write README.md] [--frames N]

Runs rawlog-localize on the sites below D2S1R_DATA, one thread, one set after the other, all scans of each (or N of them).
With --write the table and the line about the machine replace those between the marks in README.
"""
import argparse
import csv
import dataclasses
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import measures
import sites


@dataclasses.dataclass(frozen=True)
class Row:
    """Scans of sites, and the map in which they are searched for."""
    name: str  # in README
    sites: tuple
    other: str = None  # site whose map it is instead of their own


ROWS = [
    Row("intel: offices round a loop", ("intel",)),
    Row("fr079: offices on a corridor", ("fr079",)),
    Row("mit_csail: offices", ("mit_csail",)),
    Row("mit_killian: corridors that look alike", ("mit_killian",)),
    Row("fr_campus: outdoors, cells of 10 cm", ("fr_campus",)),
    Row("eight buildings never learned on", sites.MORE),
    Row("mines_runs: a cluttered classroom, 240°, reach 4 m", ("mines_runs",)),
    Row("intel in the map of mit_csail: fits nowhere", ("intel",), "mit_csail")]
SET = "test"
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


def run(program, folder, site, other, frames, out):
    """(summary, what the run tells of itself, [ms] of each scan)"""
    where = sites.Site(site, folder / site)
    searched = sites.Site(other or site, folder / (other or site)).map(SET)
    command = [program, "-q", "-m", searched, "-i", where.folder / f"{SET}.rawlog", "-o", out, "--no-rawlog"]
    if other is None:
        command += ["--ground-truth", where.truth_file(SET)]
    if frames:
        command += ["--frames", f"::{max(1, len(where.truth(SET)) // frames)}"]
    subprocess.run(list(map(str, command)), check=True)
    return json.loads((out / "summary.json").read_text()), json.loads((out / "run.json").read_text()), times(out / "frames.csv")


def total(summaries):
    """Of several sites: counts, and the mean errors of all successes."""
    added = {name: sum(summary[name] for summary in summaries) for name in ("frames", "successes", "localized",
                                                                           "localized_successes")}
    for name in ("position_error_mean_m", "yaw_error_mean_deg"):
        added[name] = sum(summary["successes"] * (summary[name] or 0) for summary in summaries) / max(1, added["successes"])
    return added


def table_row(row, summaries, milliseconds):
    time = f"{measures.median(milliseconds):.1f} ms, {measures.mean(milliseconds):.1f} ms"
    if row.other:
        frames, localized = (sum(summary[name] for summary in summaries) for name in ("frames", "localized"))
        return f"| {row.name} | {frames} | - | {interval(localized, frames)} | - | - | {time} |"
    right = total([summary[WITHIN] for summary in summaries])
    return (f"| {row.name} | {right['frames']} | {interval(right['successes'], right['frames'])} "
            f"| {100 * right['localized'] / right['frames']:.1f} % | {interval(right['localized_successes'], right['localized'])} "
            f"| {right['position_error_mean_m']:.3f} m, {right['yaw_error_mean_deg']:.2f}° | {time} |")


def main():
    project = pathlib.Path(__file__).resolve().parents[1]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--write", type=pathlib.Path)
    parser.add_argument("--frames", type=int)
    arguments = parser.parse_args()
    if not os.access(arguments.program, os.X_OK):
        sys.exit(f"headline.py: {arguments.program}: is no program; build it, and name rawlog-localize")
    folder = sites.default_folder(project)
    print(f"headline.py: measures on the sites in {folder}", file=sys.stderr)
    load = os.getloadavg()[0]
    lines = ["| building | scans | success | localized | of these, right | mean error | time a scan: median, mean |",
             "| --- | --- | --- | --- | --- | --- | --- |"]
    missing = {name for row in ROWS for name in (*row.sites, row.other) if name and not (folder / name).exists()}
    rows = [row for row in ROWS if not missing & {*row.sites, row.other}]
    if not rows:
        sys.exit(f"headline.py: {folder} lacks {', '.join(sorted(missing))}; set D2S1R_DATA to the folder of the sites")
    for name in sorted(missing):
        print(f"headline.py: {folder} holds no {name}: its row is left out", file=sys.stderr)
    for row in rows:
        summaries, milliseconds = [], []
        for site in row.sites:
            with tempfile.TemporaryDirectory() as out:
                summary, told, spent = run(arguments.program, folder, site, row.other, arguments.frames, pathlib.Path(out))
            summaries.append(summary)
            milliseconds += spent
        lines.append(table_row(row, summaries, milliseconds))
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
