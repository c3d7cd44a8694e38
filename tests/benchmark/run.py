#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Runs every benchmark and writes RESULTS.md and growth.png beside this script.

usage: run.py [BUILD_FOLDER] [--quick] [--retrieval SITE,SITE...]

Sites come from the environment variable D2S1R_DATA; what needs them is left out where they are absent. Times are CPU
times of one thread: medians over the repetitions, and the spread (max - min) / median. --quick: fewer repetitions,
smaller floors, for a look; its RESULTS.md is not worth keeping. --retrieval: only these sites are searched
exactly, which takes most of the time; RESULTS.md keeps its rows of the others. Needs matplotlib.
"""
import argparse
import csv
import datetime
import importlib.util
import io
import json
import os
import pathlib
import platform
import statistics
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
RETRIEVAL_SITES = ["intel", "fr079", "mit_csail", "mit_killian", "willow_garage_005", "nav2_warehouse_005",
                   "mit_stata_basement"]
GROWTH_CELLS = {"default": 0.05, "paper": 0.1}  # [m]
LARGEST = 1000000  # [m²]
VIEWS = {"default": {"360": "tab:blue", "180": "tab:cyan"}, "paper": {"360": "tab:orange"}}  # [deg], colour of a line


def machine():
    model = platform.processor()
    for line in open("/proc/cpuinfo"):
        if line.startswith("model name"):
            model = line.split(":")[1].strip()
            break
    return f"{model}, {os.cpu_count()} cores, {platform.system()} {platform.release()}"


def commit():
    return run(["git", "-C", HERE, "describe", "--always", "--dirty"]).strip()


def run(command):
    print("+", " ".join(map(str, command)), file=sys.stderr, flush=True)
    return subprocess.run(list(map(str, command)), check=True, stdout=subprocess.PIPE, text=True).stdout


def run_stages(program, repetitions):
    out = run([program, "--benchmark_format=json", f"--benchmark_repetitions={repetitions}"])
    stages = {}
    for row in json.loads(out)["benchmarks"]:
        if row["run_type"] == "iteration" and not row.get("error_occurred"):
            stages.setdefault(row["run_name"].split("/iterations")[0], []).append(row)
    return stages


def median_and_spread(values):
    middle = statistics.median(values)
    return middle, (max(values) - min(values)) / middle if middle else 0


def in_seconds(row):
    return row["cpu_time"] * {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1}[row["time_unit"]]


def readable(seconds):
    for unit, scale in (("s", 1), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= scale:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def stage_median(stages, name, key=None):
    rows = stages.get(name)
    return statistics.median(row[key] if key else in_seconds(row) for row in rows) if rows else None


def stage_table(stages):
    lines = ["| stage | median | spread | per ray | success |", "| --- | --- | --- | --- | --- |"]
    for name, rows in stages.items():
        middle, spread = median_and_spread([in_seconds(row) for row in rows])
        ray = readable(stage_median(stages, name, "s_per_ray")) if "s_per_ray" in rows[0] else ""
        success = f"{100 * stage_median(stages, name, 'success'):.1f} %" if "success" in rows[0] else ""
        lines.append(f"| {name} | {readable(middle)} | {100 * spread:.0f} % | {ray} | {success} |")
    return lines


def ratios(stages):
    lines = []
    swept = stage_median(stages, "sweep_all_free_cells", "s_per_ray")
    simulated = stage_median(stages, "mrpt_laser_scan_simulator", "s_per_ray")
    if swept and simulated:
        lines.append(f"- A swept ray takes {readable(swept)}, {simulated / swept:.0f} times less than one of "
                     f"laserScanSimulator (threshold 0.6, {readable(simulated)}).")
    for site in ("intel", "mit_csail", "mit_killian"):
        ours, literal = stage_median(stages, f"query/{site}"), stage_median(stages, f"literal_query/{site}")
        if ours and literal:
            lines.append(f"- A query of the published method on {site} takes {readable(ours)}, {literal / ours:.0f} times "
                         f"less than its literal transcription ({readable(literal)}).")
    return lines


def retrieval_table(program, sites):
    rows = csv.reader(io.StringIO(run([program, *sites])))
    lines = ["| site | set | queries | index | exact search | success (0.2 m, 5 deg) |",
             "| --- | --- | --- | --- | --- | --- |"]
    for site, name, queries, index, exact, success in rows:
        shares = " | ".join(f"{100 * float(v):.1f} %" for v in (index, exact, success))
        lines.append(f"| {site} | {name} | {queries} | {shares} |")
    return lines + kept_rows([site for site in RETRIEVAL_SITES if site not in sites])


def kept_rows(sites):
    """Of the last RESULTS.md."""
    file = HERE / "RESULTS.md"
    text = file.read_text().partition("## Retrieval")[2].partition("## Growth")[0] if file.exists() else ""
    return [line for line in text.splitlines() if line.startswith(tuple(f"| {site} |" for site in sites))]


def run_growth(program, areas, repetitions):
    """Rows of medians: growth.cpp prints their columns, of which the last five are measured. The largest floor takes
    gigabytes: by the default method, once."""
    floors = [(area, method, cell) for method, cell in GROWTH_CELLS.items() for area in areas]
    floors = [floor for floor in floors if floor[0] < LARGEST or floor[1] == "default"]
    rows = []
    for floor in floors:
        count = 1 if floor[0] == LARGEST else repetitions
        rounds = [list(csv.reader(io.StringIO(run([program, *floor, 1])))) for _ in range(count)]
        for runs in zip(*rounds):
            measured = [statistics.median(map(float, column)) for column in list(zip(*runs))[5:]]
            rows.append(runs[0][:5] + measured)
    return rows


def growth_table(rows):
    lines = ["| method | floor | free | cell | field of view | build | peak memory | query | success (0.2 m, 5 deg) | "
             "ambiguous | localized, wrong |",
             "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"]
    for area, free, method, cell, view, build, memory, query, success, ambiguous, wrong in rows:
        lines.append(f"| {method} | {float(area):,.0f} m² | {float(free):,.0f} m² | {cell} m | {view} deg | {build:.2f} s | "
                     f"{memory:,.0f} MB | {query:.2f} ms | {100 * success:.1f} % | {100 * ambiguous:.1f} % | {100 * wrong:.1f} % |")
    return lines


def growth_plot(rows, file):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(1, 3, figsize=(11, 3.4), constrained_layout=True)
    for axis, column, title in zip(axes, (5, 7, 6), ("build [s]", "query [ms]", "peak memory [MB]")):
        for method, cell in GROWTH_CELLS.items():
            for view, colour in VIEWS[method].items():
                points = [(float(row[0]), float(row[column])) for row in rows if (row[2], row[4]) == (method, view)]
                if points and (view == "360" or title.startswith("query")):
                    label = f"{method}, {cell} m cells, {view} deg"
                    axis.plot(*zip(*points), marker="o", color=colour, label=label)
        axis.set(xscale="log", yscale="log", xlabel="floor [m²]", title=title)
        axis.grid(True, which="both", alpha=0.3)
    axes[1].legend(fontsize="small")
    figure.savefig(file, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", nargs="?", default=HERE.parent.parent / "build" / "release", type=pathlib.Path)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--retrieval", default="intel" if "--quick" in sys.argv else ",".join(RETRIEVAL_SITES))
    options = parser.parse_args()
    if importlib.util.find_spec("matplotlib") is None:  # known before minutes are spent
        sys.exit("run.py: matplotlib is missing; install python3-matplotlib")
    programs = options.build / "tests" / "benchmark"
    for name in ("d2s1r_benchmark", "d2s1r_retrieval", "d2s1r_growth"):
        if not (programs / name).is_file():
            sys.exit(f"run.py: {programs / name}: no such program; build the preset release, or name its folder")
    load, version = os.getloadavg()[0], commit()
    repetitions = 1 if options.quick else 3
    stages = run_stages(programs / "d2s1r_benchmark", repetitions)
    retrieval = retrieval_table(programs / "d2s1r_retrieval", options.retrieval.split(","))
    areas = [1000, 4000] if options.quick else [1000, 4000, 16000, 64000, LARGEST]
    growth = run_growth(programs / "d2s1r_growth", areas, repetitions)
    growth_plot(growth, HERE / "growth.png")
    arguments = "".join(f" {a}" for a in sys.argv[1:] if not pathlib.Path(a).is_dir())
    lines = [
        "# Benchmark results", "",
        f"Machine: {machine()}; load average at the start {load:.1f}.",
        f"Command: `tests/benchmark/run.py{arguments}`, {datetime.date.today()}, commit {version}. One thread, "
        "CPU times, medians over the repetitions; spread is (max - min) / median.", "",
        "## In short", "", *ratios(stages), "",
        "## Stages", "",
        "Rays and index on mit_killian's map.yaml (3,750 m², 5 cm) unless the name says otherwise; a success is within "
        "0.2 m and 5 deg. `coarse` and `refine_and_decide` are stages of the whole search, `localize` has a first look before "
        "it.", "", *stage_table(stages), "",
        "## Retrieval", "",
        "Share of queries whose ten candidates hold a cell within 0.2 m of the truth: the index (swept rays, 8-bit counts, "
        "search by principal axes) against exact search on the full histograms of exactly cast rays. Rows of sites that "
        "`--retrieval` does not name are those of the run before.", "", *retrieval, "",
        "## Growth", "",
        "Generated office floors, 200 scans each with 1 cm of noise; memory is that of the whole program from "
        "the finished map on, build and query are CPU times of one thread. `ambiguous`: wrong, but said to be ambiguous, "
        "and the scan cannot tell: see growth.cpp. The published method, which needs full circles, stores a signature for "
        "every cell, hence its larger cells here.",
        "", *growth_table(growth), "",
        "![growth](growth.png)", ""]
    (HERE / "RESULTS.md").write_text("\n".join(lines))


if __name__ == "__main__":
    main()
