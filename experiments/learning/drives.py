# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Drives of a robot through a drawn floor: scans along the shortest ways from one place to another."""
import math

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from learning import degraded_maps, drawn_sites, sets

STEP = 0.2  # [m] of the raster in which ways are found
CLEARANCE = 0.35  # [m] of the robot
APART = 2  # [STEP] between two scans


def free_squares(map_, world):
    """Whether the robot may be in each square of the map, when it is scanned; row 0 is the lowest."""
    free = np.flipud(map_.cells == degraded_maps.FREE)
    for line in world:
        word, *rest = line.split()
        if word not in ("wall", "glass", "post") or rest[0] == "map":
            continue
        x0, y0, x1, y1 = (float(v) for v in rest[1:5]) if word != "post" else 2 * tuple(float(v) for v in rest[1:3])
        steps = np.linspace(0, 1, 2 + int(2 * math.hypot(x1 - x0, y1 - y0) / map_.resolution))
        columns, rows = (np.floor((a + steps * (b - a) - origin) / map_.resolution).astype(int)
                         for a, b, origin in ((x0, x1, map_.origin[0]), (y0, y1, map_.origin[1])))
        inside = (rows >= 0) & (columns >= 0) & (rows < free.shape[0]) & (columns < free.shape[1])
        free[rows[inside], columns[inside]] = False
    clear = map_.resolution * ndimage.distance_transform_edt(free) > CLEARANCE
    every = round(STEP / map_.resolution)
    return clear[every // 2::every, every // 2::every]


def ways(free):
    """Graph of neighbouring free squares, and their rows and columns."""
    parts, count = ndimage.label(free)
    free = parts == 1 + np.argmax(ndimage.sum_labels(free, parts, range(1, count + 1)))
    number = np.where(free, np.cumsum(free).reshape(free.shape) - 1, -1)
    starts, ends, lengths = [], [], []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        there = np.roll(number, (-down, -right), (0, 1))
        there[-1:, :] = -1 if down else there[-1:, :]
        there[:, [-1] if right > 0 else [0]] = -1 if right else there[:, [-1] if right > 0 else [0]]
        both = (number >= 0) & (there >= 0)
        starts.append(number[both])
        ends.append(there[both])
        lengths.append(np.full(both.sum(), math.hypot(down, right)))
    size = int(free.sum())
    graph = sparse.coo_matrix((np.concatenate(lengths), (np.concatenate(starts), np.concatenate(ends))), (size, size))
    return graph.tocsr(), np.argwhere(free)


def drive(map_, world, scans, random):
    """(x, y, phi) of as many poses, in the map."""
    graph, squares = ways(free_squares(map_, world))
    at, path = int(random.integers(len(squares))), []
    while len(path) < APART * (scans + 2):
        _, before = csgraph.dijkstra(graph, directed=False, indices=at, return_predecessors=True)
        goal = int(random.integers(len(squares)))
        way = []
        while goal != at and before[goal] >= 0:
            way.append(goal)
            goal = before[goal]
        path += way[::-1]
        at = path[-1] if path else at
    stops = squares[path[::APART]][:scans + 1]
    positions = np.column_stack([stops[:, 1], stops[:, 0]]) * STEP + STEP / 2 + np.array(map_.origin)
    ahead = np.diff(positions, axis=0)
    return np.column_stack([positions[:-1], np.arctan2(ahead[:, 1], ahead[:, 0])])


def write_drive(site, folder, scans, seed, simulate_floor):
    """map.yaml, scans.rawlog and scans_gt.txt of a drive through a drawn site."""
    random = np.random.default_rng(seed)
    world = (site / "world.txt").read_text().splitlines()
    standing = [line for line in world if not line.startswith(("scan ", "person "))]
    poses = drive(degraded_maps.load_map(site / "map.yaml"), standing, scans, random)
    lines = ["scan {:.4f} {:.4f} {:.5f}".format(*pose) for pose in poses]
    lines += ["person {} {:.4f} {:.4f} {:.3f}".format(*person)
              for person in drawn_sites.people_about(poses, drawn_sites.PEOPLE, random)]
    (folder / "world.txt").write_text("\n".join(standing + lines) + "\n")
    sets.run([simulate_floor, folder / "world.txt", folder])
