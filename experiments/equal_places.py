#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Counts how many scans are called localized where the map holds each place twice.

    PYTHONPATH=build/release/python experiments/equal_places.py --scans 500 --sites intel fr079 ...

The map of each site (map.yaml, D2S1R_DATA) and its copy turned by 180 deg lie side by side in one grid, shifted by a
number of cells that is no multiple of the samples' spacing. Each scan fits two places equally well, so none can be
localized. Scans are simulated in the site's map. The table goes to standard output."""
import argparse
import sys

sys.dont_write_bytecode = True  # the folder is part of the sources

import sites  # noqa: E402
import tables  # noqa: E402
from hostile_scans import VIEWS  # noqa: E402
from simulated_scans import REACH, SimulatedLaser, d2s1r, np  # noqa: E402

APART = 40  # [cells] between the map and its copy
SHIFT = 13  # [cells] of the copy, along both axes
UNKNOWN = 0.5  # [probability]


def with_turned_copy(cells):
    """The cells of a map and, beside it, those of its copy turned by 180 deg: P(occupied), row 0 at the bottom."""
    rows, columns = cells.shape
    both = np.full((rows + SHIFT, 2 * columns + APART + SHIFT), UNKNOWN, np.float32)
    both[:rows, :columns] = cells
    both[SHIFT:, columns + APART + SHIFT:] = cells[::-1, ::-1]
    return both


def count_of(site, scans, seed):
    """(localized, ambiguous, rejected) of `scans` scans."""
    laser = SimulatedLaser(site.folder / "map.yaml")
    localizer = d2s1r.Localizer(d2s1r.Map(with_turned_copy(laser.map.array), laser.cell))
    random = np.random.default_rng(seed)
    statuses = []
    for i, place in enumerate(laser.places(scans, random)):
        beams, view = VIEWS[i % len(VIEWS)]
        angles = np.radians(np.arange(beams) * view / beams - view / 2)
        seen = laser.ranges(np.tile(place, (beams, 1)), angles, random)
        ranges = np.where(np.isfinite(seen), seen, REACH).astype(np.float32)
        statuses.append(localizer.localize(ranges, angles[0], angles[1] - angles[0], REACH).status)
    return [statuses.count(status) for status in ("localized", "ambiguous", "rejected")]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scans", type=int, default=500, help="of each site")
    parser.add_argument("--sites", nargs="+", default=["intel", "fr079", "mit_csail", "mit_killian", "mines_runs"])
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    lines = []
    for site in sites.named(arguments.sites):
        counts = count_of(site, arguments.scans, arguments.seed)
        lines.append([site.name, str(arguments.scans), *map(str, counts), f"{100 * counts[0] / arguments.scans:.1f}"])
    print(tables.table(
        "Equal places", "Scans in maps that hold each place twice; none can be localized.",
        ["site", "scans", "localized", "ambiguous", "rejected", "localized, %"], lines))


if __name__ == "__main__":
    main()
