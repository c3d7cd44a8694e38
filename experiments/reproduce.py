#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Runs the paper's evaluation and more on all sites, with the published method and the default one.

Writes OUTPUT/README.md with the counterparts of the paper's Tables III, IV and V and of its Figs. 2,
3, 4, 7 and 8, the paper's numbers beside ours, reliability, success against field of view and clutter; figures beside it.
compare.py compares with other methods. Needs Debian's
python3-matplotlib and a build with its programs (BUILD_TESTING=ON, the default). The result of each run is kept, so that an interrupted evaluation goes on where it stopped;
it is measured anew if the programs, their settings or the data differ.
"""
import argparse
import json
import os
import pathlib
import sys
import time

sys.dont_write_bytecode = True  # the folder is part of the sources

import needs  # noqa: E402
try:
    import figures
except ImportError as error:
    needs.stop(error, "python3-matplotlib")
import circles  # noqa: E402
import fingerprint  # noqa: E402
import particle_filter  # noqa: E402
import plan  # noqa: E402
import rays  # noqa: E402
import report  # noqa: E402
import runs  # noqa: E402
import sites  # noqa: E402

PROJECT = pathlib.Path(__file__).resolve().parents[1]


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
    parser.add_argument("--store", type=pathlib.Path, default=PROJECT / "build/experiments", help="folder of the results of "
                        "single runs, which a later call goes on from")
    parser.add_argument("--frames", type=whole_number, default=200, help="most scans of a set, evenly spread (default "
                        "200)")
    parser.add_argument("--sweep-frames", type=whole_number, default=60, help="the same for every point of a curve, "
                        "and for every pair of sites (default 60)")
    parser.add_argument("--drives", type=int, default=20, help="drives of the particle filter per site; 0 leaves them out "
                        "(default 20)")
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
    os.environ["D2S1R_DATA"] = str(arguments.data.resolve())  # for the benchmark of rays
    runner = runs.Runner(arguments.build, PROJECT / "share/d2s1r/config", arguments.output / "runs", arguments.store)
    runner.check(["alter", "localize"])

    def field_of_view(site, scans):
        facts = runner.call("alter", site.folder / f"{scans}.rawlog", os.devnull, "frames=1")
        return json.loads(facts)["field_of_view"]

    jobs = (plan.all_jobs(found, arguments.frames, arguments.sweep_frames, field_of_view) + rays.all_jobs(found) +
            circles.all_jobs(found, arguments.sweep_frames, arguments.drives) + particle_filter.all_jobs(found, arguments.drives))
    fingerprint.Programs(arguments.build)  # stops now if it could make no stamp in the end
    results = runner.run_all(jobs, arguments.jobs)
    plain = {job: result.value for job, result in results.items() if isinstance(job, plan.Job)}
    names = figures.draw_all(plain, arguments.output, not arguments.no_maps)
    report.write(results, names, arguments, runner.version(), fingerprint.stamp(arguments.build, "answers", "windows", "filter", "calibration"))
    print(f"{arguments.output / 'README.md'}: {len(results)} runs in {(time.monotonic() - start) / 60:.1f} min")


if __name__ == "__main__":
    main()
