# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""What a ray costs: all at once, a circle at a time and one by one."""
import dataclasses
import json
import re

import sites
import tables

SITE = "mit_killian"  # that of tests/benchmark/bench_rays.cpp
RAYS = {
    "sweep_all_free_cells": ("range sweep, all free cells at once", "the index"),
    "virtual_scan_360": ("a virtual scan of 360 rays from one place", "the yaw registration"),
    "single_exact_ray": ("one ray, its direction unlike the last one's", "nothing; to compare"),
    "literal_cell_by_cell": ("one ray followed cell by cell, plain loops", "the literal transcription"),
    "mrpt_laser_scan_simulator": ("MRPT's laserScanSimulator, 360 rays", "nothing; to compare"),
}


@dataclasses.dataclass(frozen=True)
class RayJob:
    site: sites.Site

    uses = ("benchmark",)  # programs
    name = "rays"

    def run(self, runner, folder):
        """({benchmark: [s] a ray}, compiler flags)"""
        told = json.loads(runner.call("benchmark", "--benchmark_format=json", f"--benchmark_filter={'|'.join(RAYS)}"))
        rays = {row["run_name"]: row["s_per_ray"] for row in told["benchmarks"] if "s_per_ray" in row}
        return rays, compiler_flags(runner.programs["benchmark"].parents[2] / "CMakeCache.txt")


def all_jobs(found):
    return [RayJob(site) for site in found if site.name == SITE]


def compiler_flags(cache):
    text = cache.read_text()

    def value(name):
        found = re.search(rf"^{name}:\w+=(.*)$", text, re.M)
        return found.group(1).strip() if found else ""
    return " ".join([value("CMAKE_CXX_FLAGS"), value(f"CMAKE_CXX_FLAGS_{value('CMAKE_BUILD_TYPE').upper()}")]).strip()


def costs(results):
    for rays, flags in results.values():
        rows = [[title, used_by, tables.number(1e9 * rays[name], 1)] for name, (title, used_by) in RAYS.items() if name in rays]
        return tables.table(
            "Rays", f"[ns] of processor time a ray, up to 30 m in the map of {SITE} (3,750 m², cells of 5 cm), one thread; "
            f"the library is compiled with `{flags}`. The sweep has no price for a single ray: it is for all cells at once.",
            ["what", "used by", "ns a ray"], rows)
    return ""
