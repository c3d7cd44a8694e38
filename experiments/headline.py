#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Measures README's table and writes it: headline.py [--write README.md] [--times]

Its rows are what compare.py finds of d2s1r on all recorded scans of the sites below D2S1R_DATA. With --write the table, and the
fingerprint of the answers that it is about, replace those between the marks in README; with --times the table of times, too,
which asks for a machine that does nothing else. Scans whose truth the log itself contradicts are left out. Needs what compare.py
needs: Debian's python3-matplotlib and a build with its tests' programs.
"""
import argparse
import dataclasses
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import compare
import fingerprint
import intervals
import measures
import methods
import runs
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
    Row("mines_other_day: the same on another day", ("mines_other_day",)),
    Row("intel in the map of mit_csail: fits nowhere", ("intel",), "mit_csail")]
BEGIN, END = "<!-- headline.py writes what follows -->", "<!-- until here -->"
TIMES_PAGE = pathlib.Path(__file__).parent / "README.md"
BEGIN_TIMES, END_TIMES = "<!-- headline.py --times writes what follows -->", "<!-- until here, times -->"
COLUMNS = ["building", "scans", "success", "localized", "of these, right", "scans in the map", "success there", "of the localized, right",
           "mean error"]


def jobs_of(row, folder, most):
    """compare.Job of each site"""
    other = {"map_file": sites.case(folder / row.other).map_file} if row.other else {}
    return [compare.Job(sites.case(folder / site, **other), methods.DEFAULT, most, compare.WITHIN) for site in row.sites]


def share(drives):
    """Of flags of each drive that are true, with the interval; drives of several buildings are a sample of buildings."""
    count = sum(map(len, drives))
    if not count:
        return "-"
    low, high = intervals.share_interval_of_places(drives) if len(drives) > 2 else intervals.share_interval(drives)
    return f"{100 * sum(map(sum, drives)) / count:.1f} % ({low:.1f}-{high:.1f})"


def right(drives):
    return share([[frame.right for frame in frames] for frames in drives])


def localized_right(drives):
    return right([[frame for frame in frames if frame.status == "localized"] for frames in drives])


def table_row(row, drives):
    frames = [frame for drive in drives for frame in drive]
    localized = [[frame.status == "localized" for frame in drive] for drive in drives]
    if row.other:
        return [row.name, str(len(frames)), "-", share(localized), "-", "-", "-", "-", "-"]
    knows = any(not frame.in_map for frame in frames)
    here = [[frame for frame in drive if frame.in_map] for drive in drives]
    successes = measures.successes(frames)
    there = [str(sum(map(len, here))), right(here), localized_right(here)] if knows else ["-", "-", "-"]
    return [row.name, str(len(frames)), right(drives), f"{100 * measures.mean(map(float, sum(localized, []))):.1f} %",
            localized_right(drives), *there,
            f"{measures.mean(frame.position_error for frame in successes):.3f} m, {measures.mean(frame.yaw_error for frame in successes):.2f}°"]


def worst(results):
    """A sentence on the site with the least success, and on that with the fewest right among the localized."""
    found = {}
    for row, drives in results.items():
        for site, frames in zip(row.sites, drives) if not row.other else ():
            found[site] = frames
    least = min(found, key=lambda site: measures.success(found[site]))
    doubtful = min(found, key=lambda site: measures.precision(found[site]))
    sure = [frame.right for frame in found[doubtful] if frame.status == "localized"]
    return (f"The worst site by success is {least} ({measures.success(found[least]):.1f} %), by right ones among the localized "
            f"{doubtful} ({sum(sure)} of {len(sure)}).")


def left_out(jobs):
    """A sentence on the scans whose truth the log itself contradicts; the argument: {row: [compare.Job]}"""
    doubtful = {job.site.name: job.site.contradicted for row, of_row in jobs.items() if not row.other for job in of_row}
    named = [name for name in sorted(doubtful, key=doubtful.get, reverse=True)[:3] if doubtful[name]]
    rest = sum(doubtful.values()) - sum(doubtful[name] for name in named)
    if not named:
        return "The log contradicts the truth of no scan."
    words = [f"{doubtful[name]} of {name}" for name in named] + ([f"{rest} of others"] if rest else [])
    return f"Left out are {sum(doubtful.values())} scans whose truth the log contradicts: {', '.join(words)}."


def machine():
    """(processor, last-level cache)"""
    text = subprocess.run(["lscpu"], capture_output=True, text=True, check=True, env={**os.environ, "LC_ALL": "C"}).stdout
    found = {name: re.search(rf"^{name}.*?:\s*(.*)$", text, re.M) for name in ("Model name", "L3 cache")}
    return tuple(match.group(1).split("(")[0].strip() if match else "unknown" for match in found.values())


def table(columns, rows):
    return ["| " + " | ".join(columns) + " |", "| --- " * len(columns) + "|", *("| " + " | ".join(row) + " |" for row in rows)]


def times_table(results, program, load):
    rows = []
    for row, drives in results.items():
        times = [frame.times["total"] for frames in drives for frame in frames]
        rows.append([row.name.split(":")[0], f"{measures.median(times):.1f} ms", f"{measures.mean(times):.1f} ms"])
    processor, cache = machine()
    simd = re.search(r"computes with (\w+)", subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout)
    return [*table(["time a scan", "median", "mean"], rows), "",
            f"Measured by `experiments/headline.py --times` at commit {runs.commit()}: one thread of {processor}, SIMD target "
            f"{simd.group(1) if simd else 'unknown'}, {cache} of last-level cache, load {load:.1f} before the run."]


def replaced(text, begin, end, lines):
    return text[:text.index(begin) + len(begin)] + "\n\n" + "\n".join(lines) + "\n\n" + text[text.index(end):]


def measured(jobs, arguments):
    """{job: frames}; times are those of now, of one program at a time"""
    with tempfile.TemporaryDirectory() as folder:
        store = pathlib.Path(folder) / "store" if arguments.times else arguments.store
        runner = runs.Runner(arguments.build, fingerprint.PROJECT / "share/d2s1r/config", pathlib.Path(folder), store)
        return {job: result.value.frames for job, result in runner.run_all(jobs, 1 if arguments.times else 2).items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=fingerprint.PROJECT / "build/release", help="build folder")
    parser.add_argument("--store", type=pathlib.Path, default=fingerprint.PROJECT / "build/experiments",
                        help="folder of results of single runs, which compare.py has, too")
    parser.add_argument("--write", type=pathlib.Path)
    parser.add_argument("--times", action="store_true", help="write the table of times, too")
    parser.add_argument("--frames", type=int, help="scans of a site, at most, evenly spread: for a try, which is not written")
    arguments = parser.parse_args()
    if arguments.frames and arguments.write:
        sys.exit("headline.py: --frames is for a try; README's table is of all scans")
    folder = sites.default_folder(fingerprint.PROJECT)
    print(f"headline.py: measures on the sites in {folder}", file=sys.stderr)
    load = os.getloadavg()[0]
    missing = {name for row in ROWS for name in (*row.sites, row.other) if name and not (folder / name).exists()}
    rows = [row for row in ROWS if not missing & {*row.sites, row.other}]
    if not rows:
        sys.exit(f"headline.py: {folder} lacks {', '.join(sorted(missing))}; set D2S1R_DATA to the folder of the sites")
    for name in sorted(missing):
        print(f"headline.py: {folder} holds no {name}: its row is left out", file=sys.stderr)
    try:
        jobs = {row: jobs_of(row, folder, arguments.frames or compare.MOST) for row in rows}
    except ValueError as problem:
        sys.exit(f"headline.py: {problem}")
    fingerprint.Programs(arguments.build)  # stops now if it could make no stamp in the end
    frames = measured([job for of_row in jobs.values() for job in of_row], arguments)
    results = {row: [frames[job] for job in of_row] for row, of_row in jobs.items()}
    lines = [*table(COLUMNS, [table_row(row, drives) for row, drives in results.items()]), "", worst(results), left_out(jobs), "",
             f"Measured by `experiments/headline.py` at commit {runs.commit()}.", "", fingerprint.stamp(arguments.build, "answers")]
    times = times_table(results, arguments.build / "apps/rawlog-localize/rawlog-localize", load) if arguments.times else []
    print("\n".join([*lines, "", *times]))
    if arguments.write:
        arguments.write.write_text(replaced(arguments.write.read_text(), BEGIN, END, lines))
        if times:
            TIMES_PAGE.write_text(replaced(TIMES_PAGE.read_text(), BEGIN_TIMES, END_TIMES, times))


if __name__ == "__main__":
    main()
