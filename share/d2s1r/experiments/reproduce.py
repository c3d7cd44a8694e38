#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Runs the paper's evaluation and more on all sites, with the published method, the default one and other methods.

Writes OUTPUT/README.md with a table of rivals, the counterparts of the paper's Tables III, IV and V and of its Figs. 2,
3, 4 and 7, the paper's numbers beside ours, reliability, success against field of view and clutter; figures beside it. Needs Debian's
python3-matplotlib and a build with its programs (BUILD_TESTING=ON, the default).
"""
import argparse
import pathlib
import sys
import time

sys.dont_write_bytecode = True  # the folder is part of the sources

try:
    import figures
except ImportError as error:
    sys.exit(f"reproduce.py: {error}; install Debian's python3-matplotlib and run with /usr/bin/python3")
import plan  # noqa: E402
import report  # noqa: E402
import rivals  # noqa: E402
import runs  # noqa: E402
import sites  # noqa: E402

PROJECT = pathlib.Path(__file__).resolve().parents[3]


def whole_number(text):
    """1 or more."""
    number = int(text)
    if number < 1:
        raise ValueError
    return number


def read_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=PROJECT / "build/release", help="build folder")
    parser.add_argument("--data", type=pathlib.Path, default=sites.default_folder(PROJECT), help="folder of the sites")
    parser.add_argument("--output", type=pathlib.Path, default=PROJECT / "build/results", help="folder to write to")
    parser.add_argument("--frames", type=whole_number, default=500, help="most scans of a set, evenly spread (default "
                        "500)")
    parser.add_argument("--sweep-frames", type=whole_number, default=150, help="the same for every point of a curve and "
                        "every pair of sites (default 150)")
    parser.add_argument("--rival-frames", type=int, default=20, help="the same for every set and rival; 0 leaves the "
                        "rivals out (default 20)")
    parser.add_argument("--only-rivals", action="store_true", help="leave out all but the rivals")
    parser.add_argument("--jobs", type=whole_number, default=2, help="programs that run at a time, one thread each "
                        "(default 2)")
    parser.add_argument("--no-maps", action="store_true", help="show in success_maps.png only maps that anyone may "
                        "pass on")
    return parser.parse_args()


def main():
    arguments = read_arguments()
    found = sites.find(arguments.data)
    if not found:
        sys.exit(f"reproduce.py: {arguments.data}: no site with a map.yaml; set D2S1R_DATA or --data")
    arguments.output.mkdir(parents=True, exist_ok=True)
    start = time.monotonic()
    runner = runs.Runner(arguments.build, PROJECT / "share/d2s1r/config", arguments.output / "runs")
    jobs = [] if arguments.only_rivals else plan.all_jobs(found, arguments.frames, arguments.sweep_frames)
    jobs += rivals.all_jobs(found, arguments.rival_frames)
    every = runner.run_all(jobs, arguments.jobs)
    results = {job: result for job, result in every.items() if isinstance(job, plan.Job)}
    others = {job: result for job, result in every.items() if not isinstance(job, plan.Job)}
    names = figures.draw_all(results, arguments.output, not arguments.no_maps)
    report.write(results, others, names, arguments, runner.version(), time.monotonic() - start)
    print(f"{arguments.output / 'README.md'}: {len(jobs)} runs in {(time.monotonic() - start) / 60:.1f} min")


if __name__ == "__main__":
    main()
