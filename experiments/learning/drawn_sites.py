#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Draws a floor, maps it and scans it: map.yaml, map.png, scans.rawlog (ideal scans of 360 deg) and scans_gt.txt.

The map is made from scans, as SLAM makes it: what no beam reached is unknown. The scans show furniture and people that
the map lacks, and doors that were open or closed when it was made.
"""
import argparse
import math
import pathlib
import subprocess
import sys

import numpy as np
from scipy import ndimage

if __name__ == "__main__":
    sys.dont_write_bytecode = True  # the folder is part of the sources
    sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from learning import floor_plans, worlds  # noqa: E402

RASTER = 0.1  # [m] of the picture in which poses are chosen
MAPPER_CLEARANCE, SCANNER_CLEARANCE = 0.3, 0.25  # [m]
MAPPED_EVERY = 1.2  # [m] between the poses of the mapper
PEOPLE = 1.0  # [-] about a scan, in the mean


def rasterize(plan, shapes, when):
    """[m] from each cell of the floor to what stands there; 0 outside. Index: column, row."""
    columns, rows = math.ceil(plan.width / RASTER), math.ceil(plan.depth / RASTER)
    free = np.ones((columns + 2, rows + 2), bool)
    free[[0, -1]] = free[:, [0, -1]] = False

    def mark(x, y):
        i, j = np.floor(np.asarray(x) / RASTER).astype(int) + 1, np.floor(np.asarray(y) / RASTER).astype(int) + 1
        inside = (i >= 0) & (j >= 0) & (i < columns + 2) & (j < rows + 2)
        free[i[inside], j[inside]] = False

    for kind, shape_when, *numbers in shapes:
        if shape_when not in (when, "both"):
            continue
        if kind == "post":
            x, y, radius = numbers
            steps = np.linspace(0, 2 * math.pi, 13)
            mark(x + radius * np.cos(steps), y + radius * np.sin(steps))
        else:
            x0, y0, x1, y1 = numbers
            steps = np.linspace(0, 1, 2 + int(2 * math.hypot(x1 - x0, y1 - y0) / RASTER))
            mark(x0 + steps * (x1 - x0), y0 + steps * (y1 - y0))
    for tile in plan.tiles:
        if tile.use == floor_plans.OUTSIDE:
            i0, j0, i1, j1 = (int(round(v / RASTER)) + 1 for v in (tile.x0, tile.y0, tile.x1, tile.y1))
            free[max(i0, 0):max(i1, 0), max(j0, 0):max(j1, 0)] = False
    return RASTER * ndimage.distance_transform_edt(free)


def in_cells(cells, random):
    """A point at random in each of the raster's cells [m]."""
    return RASTER * (cells - 1 + random.random(cells.shape))


def choose_poses(plan, shapes, scans, random):
    """Poses (x, y, phi) of the mapper and of the robot that scans, where the mapper came along."""
    clear = rasterize(plan, shapes, "map") > MAPPER_CLEARANCE
    parts, count = ndimage.label(clear)
    if count == 0:
        raise ValueError("there is no room for the mapper")
    reached = parts == 1 + np.argmax(ndimage.sum_labels(clear, parts, range(1, count + 1)))
    cells = random.permutation(np.argwhere(reached))
    squares = np.floor(cells * RASTER / MAPPED_EVERY).astype(int)
    first = np.sort(np.unique(squares, axis=0, return_index=True)[1])
    scanned = np.argwhere(reached & (rasterize(plan, shapes, "scan") > SCANNER_CLEARANCE))
    if not len(scanned):
        raise ValueError("there is no room for the robot")
    chosen = scanned[random.integers(len(scanned), size=scans)]
    return [np.column_stack([in_cells(part, random), random.uniform(-math.pi, math.pi, len(part))])
            for part in (cells[first], chosen)]


def people_about(poses, density, random):
    """[(scan, x, y, radius)]: pairs of legs, and round bodies."""
    people = []
    for scan, (x, y, _) in enumerate(poses):
        for _ in range(random.poisson(density)):
            direction, distance = random.uniform(-math.pi, math.pi), random.uniform(0.5, 5)
            px, py = x + distance * math.cos(direction), y + distance * math.sin(direction)
            if random.random() < 0.3:
                people.append((scan, px, py, random.uniform(0.15, 0.25)))
                continue
            stride, turn = random.uniform(0.1, 0.3), random.uniform(-math.pi, math.pi)
            for sign in (-1, 1):
                people.append((scan, px + sign * stride * math.cos(turn), py + sign * stride * math.sin(turn), 0.07))
    return people


def write_world(file, plan, shapes, scans, seed, random):
    angle = random.uniform(-math.pi, math.pi) if random.random() < 0.5 else 0.0
    c, s = math.cos(angle), math.sin(angle)
    shift = random.uniform(-20, 20, 2)

    def in_map(x, y):
        return c * x - s * y + shift[0], s * x + c * y + shift[1]

    mapper, scanner = choose_poses(plan, shapes, scans, random)
    sensor = (random.choice((0.0, 0.1, 0.25)), 0.0, random.choice((0.0, 0.0, math.pi / 2)))
    lines = [f"seed {seed}", "cell 0.05", f"mapper 25 {random.uniform(0.005, 0.02):.4f} {random.uniform(0.005, 0.02):.4f} 0.002",
             "scanner 1440 80 {:.3f} {:.3f} {:.6f}".format(*sensor)]
    for kind, when, *numbers in shapes:
        points = [v for k in range(0, len(numbers) // 2 * 2, 2) for v in in_map(*numbers[k:k + 2])]
        lines.append(" ".join([kind, when] + [f"{v:.4f}" for v in points + numbers[len(points):]]))
    for word, poses in (("map", mapper), ("scan", scanner)):
        lines += ["{} {:.4f} {:.4f} {:.5f}".format(word, *in_map(x, y), phi) for x, y, phi in poses]
    lines += ["person {} {:.4f} {:.4f} {:.3f}".format(scan, *in_map(x, y), radius)
              for scan, x, y, radius in people_about(scanner, PEOPLE, random)]
    file.write_text("\n".join(lines) + "\n")


def draw_site(folder, kind, area, scans, seed, simulate_floor):
    """Writes the site; \\p simulate_floor is the program."""
    random = np.random.default_rng(seed)
    plan = floor_plans.draw_plan(kind, area, random)
    shapes = worlds.shapes_of(plan, random)
    folder.mkdir(parents=True, exist_ok=True)
    write_world(folder / "world.txt", plan, shapes, scans, seed, random)
    done = subprocess.run([simulate_floor, folder / "world.txt", folder], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=sorted(floor_plans.STYLES))
    parser.add_argument("area", type=float, help="[m2] of the floor, 200 to 4000")
    parser.add_argument("seed", type=int)
    parser.add_argument("folder", type=pathlib.Path, help="to write to")
    parser.add_argument("--scans", type=int, default=200)
    parser.add_argument("--simulate-floor", required=True, type=pathlib.Path, help="the program, in experiments/ of the build")
    a = parser.parse_args()
    try:
        draw_site(a.folder, a.kind, a.area, a.scans, a.seed, a.simulate_floor)
    except (OSError, RuntimeError, ValueError) as error:
        sys.exit(f"drawn_sites.py: {error}")


if __name__ == "__main__":
    main()
