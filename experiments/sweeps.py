#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Measures the poses of scans that a spinning laser takes from a robot that turns and drives meanwhile.

    PYTHONPATH=build/release/python experiments/sweeps.py --scans 15

Scans are simulated in map.yaml of each site (D2S1R_DATA), each beam from where the robot is at its time. The pose is that of
the first beam, the stamp of a scan in ROS. Odometry has an error of 2 % of the turn and the way; readings are linear in
between, and the robot speeds up and slows down by up to 0.5 rad/s^2. The tables go to standard output."""
import argparse
import collections
import sys

sys.dont_write_bytecode = True  # the folder is part of the sources

import sites  # noqa: E402
import tables  # noqa: E402
from simulated_scans import REACH, SimulatedLaser, d2s1r, difference, np  # noqa: E402

LASERS = ((360, 360), (1081, 270))  # (beams, field of view [deg])
TURNS = (0.1, 0.2)  # [s] of the laser for a full circle
RATES = (0.0, 0.25, 0.5, 1.0, 2.0)  # [rad/s] of the robot
ODOMETRY = {"50 Hz": 0.02, "10 Hz": 0.1, "none": None, "not moved": 0}  # [s] between readings


def motion(times, speed, rate, change):
    """Poses (x, y, phi) of a robot that is at the origin at time 0: n x 3. change: of the rate [rad/s^2]"""
    fine = np.linspace(min(times.min(), 0), max(times.max(), 0), 400)
    heading = rate * fine + 0.5 * change * fine ** 2
    step = np.diff(fine, prepend=fine[0])
    x, y = np.cumsum(speed * np.cos(heading) * step), np.cumsum(speed * np.sin(heading) * step)
    x, y = x - np.interp(0, fine, x), y - np.interp(0, fine, y)
    return np.column_stack([np.interp(times, fine, column) for column in (x, y, heading)])


def placed(place, poses):
    """Poses of the robot in the map that are `poses` in its frame at `place`."""
    c, s = np.cos(place[2]), np.sin(place[2])
    return np.column_stack([
        place[0] + c * poses[:, 0] - s * poses[:, 1], place[1] + s * poses[:, 0] + c * poses[:, 1], place[2] + poses[:, 2]])


def sweep_of(beam_step, period, phase, how, random):
    """What odometry tells: readings every `period` [s], the first of them `phase` [s] before the scan and more."""
    if period is None:
        return d2s1r.Sweep(beam_step)
    times = np.arange(-period - phase, 0.35 + period, period)
    poses = motion(times, *how) * (1 + random.normal(0, 0.02))
    return d2s1r.Sweep(beam_step, times=times, poses=poses)


def errors_of(localizer, laser, case, count, random):
    """Lists (error of yaw [deg], within two standard deviations, localized) of scans of one case."""
    (beams, view), turn, rate, odometry = case
    beam_step = turn * view / 360 / beams
    errors = []
    for place in laser.places(count, random):
        angles = np.radians(np.arange(beams) * view / beams - view / 2)
        how = (random.uniform(0, 1), rate * random.choice([-1, 1]), random.uniform(-0.5, 0.5) if rate else 0.0)
        robots = placed(place, motion(beam_step * np.arange(beams), *how))
        ranges = laser.ranges(robots, angles, random).astype(np.float32)
        period = ODOMETRY[odometry]
        sweep = None if period == 0 else sweep_of(beam_step, period, random.uniform(0, period or 0), how, random)
        result = localizer.localize(ranges, angles[0], angles[1] - angles[0], REACH, sweep=sweep)
        if result.status == "localized" and difference(result.pose, place)[0] < 1:
            off = difference(result.pose, place)[1]
            errors.append((np.degrees(off), off < 2 * np.sqrt(result.covariances[0][2, 2]), True))
        else:
            errors.append((np.nan, False, False))
    return errors


def table_of(results):
    rows = []
    for odometry in ODOMETRY:
        for rate in RATES:
            mine = np.array([error for key, errors in results.items() if key[2:] == (rate, odometry) for error in errors])
            known = mine[mine[:, 2] > 0]
            if len(known) == 0:
                continue
            rows.append([odometry, str(rate), str(len(mine)), str(len(known)), f"{known[:, 0].mean():.2f}",
                         f"{np.percentile(known[:, 0], 95):.2f}", f"{100 * known[:, 1].mean():.0f}"])
    return tables.table(
        "Sweeps", "Errors of the heading at the stamp, over sites, lasers and times of a turn; of localized scans.",
        ["odometry", "robot turns, rad/s", "scans", "localized", "mean, deg", "95 %, deg", "within 2 std, %"], rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scans", type=int, default=10, help="of each case")
    parser.add_argument("--sites", nargs="+", default=["intel", "mit_killian"])
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    results = collections.defaultdict(list)
    for site in sites.named(arguments.sites):
        laser = SimulatedLaser(site.folder / "map.yaml")
        localizer = d2s1r.Localizer(laser.map)
        random = np.random.default_rng(arguments.seed)
        for case in ((a, t, r, o) for a in LASERS for t in TURNS for r in RATES for o in ODOMETRY):
            results[case] += errors_of(localizer, laser, case, arguments.scans, random)
    print(table_of(results))


if __name__ == "__main__":
    main()
