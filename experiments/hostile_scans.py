#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Counts how many scans that are spoiled on purpose are called localized, and how many of these wrongly.

    PYTHONPATH=build/release/python experiments/hostile_scans.py --scans 5000

Scans are simulated in map.yaml of each site (D2S1R_DATA) and spoiled: see KINDS. A pose is wrong if it is off by more
than 0.5 m or 10 deg, from each of both places for a scan that shows two. The table goes to standard output; --rows
names a CSV file for a row of each scan. It needs the Python module d2s1r."""
import argparse
import collections
import csv
import sys

sys.dont_write_bytecode = True  # the folder is part of the sources

import sites  # noqa: E402
import tables  # noqa: E402
from simulated_scans import REACH, SimulatedLaser, d2s1r, difference, np  # noqa: E402

VIEWS = ((360, 360), (270, 270), (180, 180))  # (beams, field of view [deg])


def constant(seen, random, _):
    return np.where(random.random(len(seen)) < 0.5, random.uniform(0.3, 1.0), seen)


def random_short(seen, random, _):
    short = random.uniform(0.2, np.clip(seen, 0.3, 10.0))
    return np.where(random.random(len(seen)) < 0.5, short, seen)


def halves(seen, _, other):
    return np.where(np.arange(len(seen)) < len(seen) // 2, seen, other)


def mirrored(seen, _, __):
    return seen[::-1]


def scaled(seen, random, _):
    return seen * random.choice([0.9, 0.95, 1.05, 1.1])


def clean(seen, _, __):
    return seen


KINDS = {
    "clean": (clean, "as they are"),
    "constant": (constant, "half of the beams, at random, hold one short range"),
    "random short": (random_short, "half of the beams, at random, end anywhere before the wall"),
    "half A, half B": (halves, "half of the beams are from another place"),
    "mirrored": (mirrored, "the beams in the wrong order"),
    "scaled": (scaled, "all ranges 5 or 10 % too short or too long"),
    "panes": (clean, "three to six straight panes of 1 to 3 m around the robot are not in the map"),
}


def panes_around(place, random):
    """Segments (x0, y0, x1, y1) [m] 1 to 5 m from a place."""
    panes = []
    for _ in range(random.integers(3, 7)):
        direction, way, turn, half = random.uniform(-np.pi, np.pi), random.uniform(1, 5), random.uniform(0, np.pi), random.uniform(0.5, 1.5)
        x, y = place[0] + way * np.cos(direction), place[1] + way * np.sin(direction)
        panes.append((x - half * np.cos(turn), y - half * np.sin(turn), x + half * np.cos(turn), y + half * np.sin(turn)))
    return panes


def scans_of(laser, kind, count, random):
    """Yields (ranges, angles, true places)."""
    spoil = KINDS[kind][0]
    for i, place in enumerate(laser.places(count, random)):
        beams, view = VIEWS[i % len(VIEWS)]
        angles = np.radians(np.arange(beams) * view / beams - view / 2)
        extra = panes_around(place, random) if kind == "panes" else ()
        seen = laser.ranges(np.tile(place, (beams, 1)), angles, random, extra)
        places = [place]
        other = None
        if spoil is halves:
            places.append(laser.places(1, random)[0])
            other = laser.ranges(np.tile(places[1], (beams, 1)), angles, random)
        yield spoil(seen, random, other).astype(np.float32), angles, places


def judge(localizer, ranges, angles, places):
    """(status, wrong or not, confidence, share of explained beams)"""
    result = localizer.localize(ranges, angles[0], angles[1] - angles[0], REACH)
    if result.status != "localized":
        return result.status, False, result.confidence, np.nan
    off = [difference(result.pose, place) for place in places]
    wrong = all(way > 0.5 or turn > np.radians(10) for way, turn in off)
    return result.status, wrong, result.confidence, result.explained[0]


def run(site, kinds, count, seed, parameters=None):
    """Yields rows (site, kind, status, wrong, confidence, explained). `parameters` names an ini file."""
    laser = SimulatedLaser(site.folder / "map.yaml")
    localizer = d2s1r.Localizer(laser.map, parameters or {})
    for kind in kinds:
        random = np.random.default_rng([seed, list(KINDS).index(kind)])
        for ranges, angles, places in scans_of(laser, kind, count, random):
            yield (site.name, kind, *judge(localizer, ranges, angles, places))


def table_of(rows):
    lines = []
    for kind, (_, meaning) in KINDS.items():
        mine = [row for row in rows if row[1] == kind]
        if not mine:
            continue
        counts = collections.Counter(row[2] for row in mine)
        wrong = sum(row[3] for row in mine)
        lines.append([kind, meaning, str(len(mine)), str(counts["localized"]), str(wrong), f"{100 * wrong / len(mine):.2f}"])
    return tables.table(
        "Hostile scans", "Scans that are spoiled on purpose, all sites together; wrong is localized and off by more than 0.5 m or 10 deg.",
        ["kind", "what is wrong with it", "scans", "localized", "of these wrong", "wrong, % of scans"], lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scans", type=int, default=5000, help="over all kinds and sites")
    parser.add_argument("--sites", nargs="+", default=["intel", "fr079", "mit_csail", "mit_killian", "mines_runs"])
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=list(KINDS))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--parameters", metavar="FILE", help="an ini file; without it, the defaults")
    parser.add_argument("--rows", help="CSV file with a row of each scan")
    arguments = parser.parse_args()
    count = max(1, arguments.scans // (len(arguments.sites) * len(arguments.kinds)))
    rows = [row for site in sites.named(arguments.sites) for row in run(
        site, arguments.kinds, count, arguments.seed, arguments.parameters)]
    if arguments.rows:
        with open(arguments.rows, "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([("site", "kind", "status", "wrong", "confidence", "explained"), *rows])
    print(table_of(rows))


if __name__ == "__main__":
    main()
