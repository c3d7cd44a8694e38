#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Draws a building that repeats itself, maps it as one SLAM program would, and scans it as another one would map it.

Both programs bend the building, each in its own way: it is stretched, curved and wavy, its walls drift apart by
centimetres, some are drawn twice or missing, and small things have been moved in between. The scans see the building
of the second program; the truth says where that is in the map of the first one.

Writes to FOLDER: map.png and map.yaml, and of each drive drive_N.log (CARMEN: scans and odometry) and drive_N_gt.txt
(`time x y phi` [s, m, rad]: robot in map).
"""
import argparse
import dataclasses
import math
import pathlib
import sys

sys.dont_write_bytecode = True  # the folder is part of the sources
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
from learning import degraded_maps  # noqa: E402

CELL = 0.05  # [m] of the map
STEP, TURN = 0.2, math.radians(20)  # [m], [rad] of a robot from scan to scan
CLEARANCE = 0.3  # [m] of the robot


@dataclasses.dataclass
class Building:
    """Straight surfaces (x0, y0, x1, y1) [m]. Those of one thing share a number, and drift together."""
    surfaces: list = dataclasses.field(default_factory=list)
    thing: list = dataclasses.field(default_factory=list)
    is_loose: dict = dataclasses.field(default_factory=dict)  # by thing: whether it may be moved

    def add(self, surfaces, is_loose=False):
        number = len(self.is_loose)
        self.is_loose[number] = is_loose
        self.surfaces += surfaces
        self.thing += [number] * len(surfaces)

    def box(self, x0, y0, x1, y1, is_loose=False):
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        sides = [(*a, *b) for a, b in zip(corners, corners[1:] + corners[:1])]
        if is_loose:
            self.add(sides, True)
        else:  # each side of a thing that is built in is a piece of its own
            for side in sides:
                self.add([side])


def shelves(random):
    """A hall with rows of equal shelves, bay beside bay."""
    building = Building()
    rows, columns = int(random.integers(3, 6)), int(random.integers(2, 4))
    apart, length, depth = random.uniform(3.2, 4.8), random.uniform(2.4, 4.0), random.uniform(0.7, 1.0)
    aisle, margin = random.uniform(1.6, 2.6), random.uniform(1.4, 2.4)
    width, height = 2 * margin + columns * length + (columns - 1) * aisle, 2 * margin + (rows - 1) * apart + depth
    building.box(0, 0, width, height)
    for row in range(rows):
        for column in range(columns):
            x, y = margin + column * (length + aisle), margin + row * apart
            building.box(x, y, x + length, y + depth)
    loose_boxes(building, width, height, random, 0.02)
    return building


def cells(random):
    """Equal rooms with equal beds on both sides of a corridor."""
    building = Building()
    count, width, depth = int(random.integers(4, 8)), random.uniform(2.4, 3.6), random.uniform(3.2, 4.5)
    corridor, door, bed = random.uniform(1.8, 2.6), random.uniform(0.85, 1.1), random.uniform(1.9, 2.1)
    length, high = count * width, 2 * depth + corridor
    building.box(0, 0, length, high)
    for i in range(count + 1):
        for y0, y1 in ((0, depth), (depth + corridor, high)):
            if 0 < i < count:
                building.box(i * width - 0.06, y0, i * width + 0.06, y1)
            if i < count:
                inner = depth if y0 == 0 else depth + corridor
                building.add([(i * width, inner, (i + 1) * width - 0.3 - door, inner)])
                building.add([((i + 1) * width - 0.3, inner, (i + 1) * width, inner)])
                at = y0 + 0.06 if y0 == 0 else y1 - 0.06 - bed
                if random.random() < 0.9:
                    building.box(i * width + 0.07, at, i * width + 0.9, at + bed, random.random() < 0.3)
    loose_boxes(building, length, high, random, 0.015)
    return building


def doors(random):
    """A corridor with equal niches of doors on both sides."""
    building = Building()
    count, apart = int(random.integers(5, 11)), random.uniform(2.6, 6.0)
    wide, niche, deep = random.uniform(1.7, 2.8), random.uniform(0.85, 1.2), random.uniform(0.12, 0.35)
    length = count * apart
    building.add([(0, -deep, 0, wide + deep)])
    building.add([(length, -deep, length, wide + deep)])
    for side, out in ((0, -deep), (wide, wide + deep)):
        for i in range(count):
            x = i * apart
            start = x + (apart - niche) / 2
            building.add([(x, side, start, side), (start + niche, side, x + apart, side)])
            building.add([(start, side, start, out), (start, out, start + niche, out), (start + niche, out, start + niche, side)])
    loose_boxes(building, length, wide, random, 0.03)
    return building


def pillars(random):
    """A hall with equal pillars."""
    building = Building()
    columns, rows = int(random.integers(3, 6)), int(random.integers(2, 5))
    apart_x, apart_y, side = random.uniform(2.6, 5.0), random.uniform(2.6, 5.0), random.uniform(0.3, 0.7)
    width, height = (columns + 1) * apart_x, (rows + 1) * apart_y
    building.box(0, 0, width, height)
    for i in range(columns):
        for j in range(rows):
            x, y = (i + 1) * apart_x, (j + 1) * apart_y
            building.box(x - side / 2, y - side / 2, x + side / 2, y + side / 2)
    loose_boxes(building, width, height, random, 0.015)
    return building


KINDS = {"shelves": shelves, "cells": cells, "doors": doors, "pillars": pillars}


def loose_boxes(building, width, height, random, density):
    """Small things here and there [1 / m2], and some at the walls that stay."""
    for _ in range(2 + random.poisson(0.012 * width * height)):
        w, h = random.uniform(0.3, 1.5), random.uniform(0.25, 0.6)
        side, along = int(random.integers(4)), random.random()
        if side % 2:
            w, h = h, w
        x = {1: 0.01, 3: width - w - 0.01}.get(side, along * (width - w))
        y = {0: 0.01, 2: height - h - 0.01}.get(side, along * (height - h))
        building.box(x, y, x + w, y + h)
    for _ in range(random.poisson(density * width * height)):
        w, h = random.uniform(0.2, 0.8, 2)
        x, y = random.uniform(0, width - w), random.uniform(0, max(0.01, height - h))
        building.box(x, y, x + w, y + h, True)


class Bend:
    """How a SLAM program bends a building: a smooth map of the plane that moves points by decimetres."""

    def __init__(self, random):
        self.scale = 1 + random.normal(0, 0.01, 2)
        self.curve = random.normal(0, math.radians(0.12), 2)  # [rad / m]
        self.waves = []
        for _ in range(4):
            direction, length = random.uniform(0, 2 * math.pi), random.uniform(5, 20)  # [rad], [m]
            wave = 2 * math.pi / length * np.array([math.cos(direction), math.sin(direction)])
            self.waves.append((wave, random.uniform(0, 2 * math.pi), random.normal(0, math.radians(0.5) * length / (2 * math.pi), 2)))
        self.turn, self.shift = random.normal(0, math.radians(3)), random.normal(0, 1.0, 2)

    def __call__(self, points):
        """[n, 2] where points [n, 2] of the building are."""
        bent = points * self.scale
        bent = bent + np.column_stack([0.5 * self.curve[0] * points[:, 1] ** 2, 0.5 * self.curve[1] * points[:, 0] ** 2])
        for wave, phase, amplitude in self.waves:
            bent = bent + np.sin(points @ wave + phase)[:, None] * amplitude
        c, s = math.cos(self.turn), math.sin(self.turn)
        return bent @ np.array([[c, s], [-s, c]]) + self.shift

    def pose(self, x, y, phi):
        ahead = 0.3
        points = self(np.array([[x, y], [x + ahead * math.cos(phi), y + ahead * math.sin(phi)],
                                [x - ahead * math.cos(phi), y - ahead * math.sin(phi)]]))
        direction = points[1] - points[2]
        return points[0, 0], points[0, 1], math.atan2(direction[1], direction[0])


def mapped(building, bend, random, drift, moved):
    """The surfaces [n, 4] that a program draws.
    \\p drift: [m] standard deviation by which walls are apart from where they should be"""
    surfaces = np.array(building.surfaces)
    things = np.array(building.thing)
    drawn = []
    for number, is_loose in building.is_loose.items():
        own = surfaces[things == number].reshape(-1, 2)
        middle = own.mean(0)
        copies = [(random.normal(0, drift, 2), random.normal(0, math.radians(0.5)))]
        if is_loose:
            fate = random.random()
            if fate < moved:
                continue  # it is gone
            if fate < 2 * moved:
                copies = [(random.normal(0, 1.0, 2), random.uniform(-math.pi, math.pi))]
        elif random.random() < 0.02:
            continue  # never seen
        elif random.random() < 0.06:
            copies.append((copies[0][0] + random.normal(0, 0.08, 2), copies[0][1]))  # a loop that was not closed
        for shift, turn in copies:
            c, s = math.cos(turn), math.sin(turn)
            drawn.append(bend((own - middle) @ np.array([[c, s], [-s, c]]) + middle + shift).reshape(-1, 4))
    return np.concatenate(drawn)


def cast(surfaces, x, y, angles):
    """[m] ranges of rays from (x, y); inf where they hit nothing."""
    dx, dy = np.cos(angles)[:, None], np.sin(angles)[:, None]
    ex, ey = surfaces[:, 2] - surfaces[:, 0], surfaces[:, 3] - surfaces[:, 1]
    ax, ay = surfaces[:, 0] - x, surfaces[:, 1] - y
    across = dx * ey - dy * ex
    with np.errstate(divide="ignore", invalid="ignore"):
        along, part = (ax * ey - ay * ex) / across, (ax * dy - ay * dx) / across
    return np.where((along > 1e-6) & (part >= 0) & (part <= 1), along, np.inf).min(1)


def drive(building, frames, random):
    """[(x, y, phi)] of a robot that goes straight on until something is in its way, in the frame of the building."""
    surfaces = np.array(building.surfaces)
    low, high = surfaces[:, :2].min(0), surfaces[:, :2].max(0)
    all_round = np.linspace(-math.pi, math.pi, 72, endpoint=False)
    while True:
        x, y = random.uniform(low, high)
        seen = cast(surfaces, x, y, all_round)
        if seen.min() > CLEARANCE and np.isfinite(seen).all():
            break
    phi, turns, poses = random.uniform(-math.pi, math.pi), 1, []
    for _ in range(frames):
        poses.append((x, y, phi))
        ahead = cast(surfaces, x, y, phi + np.radians(np.arange(-60, 61, 5)))
        across = np.abs(ahead * np.sin(np.radians(np.arange(-60, 61, 5)))) < CLEARANCE
        if (ahead[across] * np.cos(np.radians(np.arange(-60, 61, 5))[across])).min(initial=np.inf) > STEP + CLEARANCE:
            x, y = x + STEP * math.cos(phi), y + STEP * math.sin(phi)
            phi += random.normal(0, 0.05)
            turns = 1 if random.random() < 0.5 else -1
        else:
            phi += turns * TURN
    return poses


def draw_map(surfaces, poses, reach, random):
    """A degraded_maps.Map as a laser at the poses draws it."""
    low, high = surfaces.reshape(-1, 2).min(0) - 0.5, surfaces.reshape(-1, 2).max(0) + 0.5
    columns, rows = np.ceil((high - low) / CELL).astype(int)
    hits, passes = np.zeros((rows, columns)), np.zeros((rows, columns))
    angles = np.linspace(-math.pi, math.pi, 720, endpoint=False)
    along = np.arange(0, reach, CELL / 2)

    def count(cells, x, y):
        i, j = ((y - low[1]) / CELL).astype(int), ((x - low[0]) / CELL).astype(int)
        inside = (i >= 0) & (j >= 0) & (i < rows) & (j < columns)
        np.add.at(cells, (i[inside], j[inside]), 1)

    for x, y, phi in poses:
        x, y = np.array([x, y]) + random.normal(0, 0.015, 2)
        ranges = cast(surfaces, x, y, phi + angles) + random.normal(0, 0.01, len(angles))
        turned = phi + angles + random.normal(0, math.radians(0.2))
        way = along[None, :]
        passed = way < np.minimum(ranges, reach)[:, None] - CELL
        count(passes, (x + way * np.cos(turned)[:, None])[passed], (y + way * np.sin(turned)[:, None])[passed])
        hit = ranges < reach
        count(hits, x + ranges[hit] * np.cos(turned[hit]), y + ranges[hit] * np.sin(turned[hit]))
    cells = degraded_maps.drawn(hits > 0.1 * passes, passes > 0)
    cells[(hits == 0) & (passes == 0)] = degraded_maps.UNKNOWN
    return degraded_maps.Map(cells[::-1], CELL, tuple(low), np.empty((0, 4)))


def robot_laser(ranges, reach, pose, time):
    """A line of a CARMEN log."""
    readings = " ".join(f"{r:.3f}" for r in np.minimum(ranges, reach))
    x, y, phi = pose
    at = f"{x:.6f} {y:.6f} {phi:.6f}"
    spacing = 2 * math.pi / len(ranges)
    return (f"ROBOTLASER1 0 {-math.pi:.8f} {2 * math.pi - spacing:.8f} {spacing:.8f} {reach:g} 0.01 0 {len(ranges)} {readings} "
            f"0 {at} {at} 0 0 0 0 0 {time:.6f} made {time:.6f}")


def odometry_of(poses, random):
    """Poses of wheels that are off by some per cent."""
    x = y = phi = 0.0
    found = [(x, y, phi)]
    for before, after in zip(poses, poses[1:]):
        way = math.hypot(after[0] - before[0], after[1] - before[1])
        turn = math.remainder(after[2] - before[2], 2 * math.pi)
        x, y = x + way * math.cos(phi) * random.normal(1, 0.02), y + way * math.sin(phi) * random.normal(1, 0.02)
        phi += turn * random.normal(1, 0.02)
        found.append((x, y, phi))
    return found


def write_drive(folder, number, building, bends, surfaces, arguments, random):
    poses = drive(building, arguments.frames, random)
    angles = np.linspace(-math.pi, math.pi, arguments.beams, endpoint=False)
    lines, truth = [], []
    wheels = odometry_of([bends[1].pose(*pose) for pose in poses], random)
    for i, pose in enumerate(poses):
        x, y, phi = bends[1].pose(*pose)
        ranges = cast(surfaces, x, y, phi + angles)
        ranges = np.where(ranges < arguments.reach, ranges + random.normal(0, 0.01, len(ranges)), arguments.reach)
        time = 1e9 + 1000 * number + 0.5 * i
        lines.append(robot_laser(ranges, arguments.reach, wheels[i], time))
        truth.append(f"{time:.6f} " + " ".join(f"{v:.6f}" for v in bends[0].pose(*pose)))
    (folder / f"drive_{number}.log").write_text("\n".join(lines) + "\n")
    (folder / f"drive_{number}_gt.txt").write_text("\n".join(truth) + "\n")


def make_pair(folder, arguments):
    """Writes the map and the drives of a building."""
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng([sum(map(ord, arguments.kind)), arguments.seed])
    building = KINDS[arguments.kind](random)
    drift = arguments.drift if arguments.drift is not None else random.uniform(0.01, 0.04)
    bends = [Bend(random), Bend(random)]
    worlds = [mapped(building, bend, random, drift, arguments.moved) for bend in bends]
    everywhere = [pose for _ in range(25) for pose in drive(building, 25, random)]
    poses = [bends[0].pose(*pose) for pose in everywhere[::3]]
    degraded_maps.save_map(draw_map(worlds[0], poses, max(arguments.reach, 6), random), folder)
    for number in range(arguments.drives):
        write_drive(folder, number, building, bends, worlds[1], arguments, random)


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=sorted(KINDS))
    parser.add_argument("seed", type=int)
    parser.add_argument("folder", type=pathlib.Path, help="to write to")
    parser.add_argument("--drives", type=int, default=20)
    parser.add_argument("--frames", type=int, default=30, help="scans of a drive (default 30)")
    parser.add_argument("--beams", type=int, default=360)
    parser.add_argument("--reach", type=float, default=3.5, help="[m] of the laser that scans (default 3.5)")
    parser.add_argument("--drift", type=float, help="[m] standard deviation by which walls are off (default: 0.01 to 0.04 by building)")
    parser.add_argument("--moved", type=float, default=0.1, help="share of the loose things that were moved, and gone (default 0.1)")
    arguments = parser.parse_args(words)
    try:
        make_pair(arguments.folder, arguments)
    except (OSError, ValueError) as error:
        sys.exit(f"look_alikes.py: {error}")


if __name__ == "__main__":
    main()
