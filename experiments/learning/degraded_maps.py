#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Makes a map of the kind that others have out of a good one.

KIND=STRENGTH words, applied in the order given:
  coarse=SIZE            [m] cells of that size; one is occupied if any of its parts is
  smeared=FRONT[,BACK]   [m] walls grow by FRONT to all sides, and by BACK (default FRONT) into what is not free, uneven
                         by 40 % from place to place
  blurred=WIDTH          [m] standard deviation of a blur; walls get a grey rim, thin ones turn grey
  warped=SHIFT           [m] greatest displacement, smooth over some 8 m; the ground truth moves with the map
  moved=SHARE            [-] of the things smaller than 1.5 m are elsewhere
  grey=SHARE             [-] of the known cells are unknown, in patches and one by one
  false_free=WIDTH       [m] a ring of free space behind the walls, with gaps
"""
import argparse
import dataclasses
import pathlib
import re
import sys

import numpy as np
from PIL import Image
from scipy import ndimage

FREE, UNKNOWN, OCCUPIED = 254, 205, 0
OCCUPIED_ABOVE, FREE_BELOW = 0.65, 0.196  # [probability] occupied_thresh and free_thresh of the yaml files


@dataclasses.dataclass
class Map:
    """A map_server map and poses in it."""
    cells: np.ndarray  # uint8, rows from the top
    resolution: float  # [m]
    origin: tuple  # [m] x, y of the lower left corner
    truth: np.ndarray  # a row a scan: time [s], x, y [m], phi [rad]


def load_map(yaml, truth=None):
    text = yaml.read_text()

    def value(name):
        found = re.search(rf"^{name}:\s*(\S.*)$", text, re.M)
        if not found:
            raise ValueError(f"{yaml}: has no {name}")
        return found.group(1).strip()

    cells = np.array(Image.open(yaml.parent / value("image")).convert("L"))
    origin = tuple(float(v) for v in value("origin").strip("[]").split(",")[:2])
    poses = np.loadtxt(truth, comments=("%", "#"), ndmin=2)[:, :4] if truth else np.empty((0, 4))
    return Map(cells, float(value("resolution")), origin, poses)


def save_map(map_, folder, name="map"):
    Image.fromarray(map_.cells).save(folder / f"{name}.png")
    (folder / f"{name}.yaml").write_text(
        f"image: {name}.png\nresolution: {map_.resolution:g}\norigin: [{map_.origin[0]:.6f}, {map_.origin[1]:.6f}, 0.0]\n"
        f"negate: 0\noccupied_thresh: {OCCUPIED_ABOVE}\nfree_thresh: {FREE_BELOW}\n")


def is_occupied(cells):
    return 255 - cells.astype(int) > OCCUPIED_ABOVE * 255


def is_free(cells):
    return 255 - cells.astype(int) < FREE_BELOW * 255


def drawn(occupied, free):
    return np.where(occupied, OCCUPIED, np.where(free, FREE, UNKNOWN)).astype(np.uint8)


def smooth_field(shape, width, random):
    """Normal random numbers of variance 1 that change over some `width` [cells]."""
    field = ndimage.gaussian_filter(random.standard_normal(shape), width, mode="reflect")
    return field / max(field.std(), 1e-12)


def coarse(map_, random, size):
    factor = round(size / map_.resolution)
    if factor <= 1:
        return map_
    rows, columns = (-(-n // factor) * factor for n in map_.cells.shape)
    padded = np.full((rows, columns), UNKNOWN, np.uint8)
    padded[rows - map_.cells.shape[0]:, :map_.cells.shape[1]] = map_.cells
    blocks = padded.reshape(rows // factor, factor, columns // factor, factor)
    occupied, free = is_occupied(blocks).any((1, 3)), is_free(blocks).any((1, 3))
    return dataclasses.replace(map_, cells=drawn(occupied, free), resolution=map_.resolution * factor)


def smeared(map_, random, front, back=None):
    back = front if back is None else back
    occupied, free = is_occupied(map_.cells), is_free(map_.cells)
    uneven = np.clip(1 + 0.4 * smooth_field(occupied.shape, 0.6 / map_.resolution, random), 0, None)
    distance = map_.resolution * ndimage.distance_transform_edt(~occupied)
    grown = distance <= uneven * np.where(free, front, back)
    return dataclasses.replace(map_, cells=drawn(occupied | grown, free))


def blurred(map_, random, width):
    probability = np.where(is_occupied(map_.cells), 1.0, np.where(is_free(map_.cells), 0.0, 0.5))
    known = probability != 0.5
    probability = ndimage.gaussian_filter(probability, width / map_.resolution, mode="nearest")
    probability = np.clip(probability * 1.6, 0, 1)  # a wall of one cell would vanish everywhere
    cells = np.where(known, np.rint(255 - 254 * probability), UNKNOWN)
    return dataclasses.replace(map_, cells=np.clip(cells, 0, FREE).astype(np.uint8))


def warped(map_, random, shift):
    shape = map_.cells.shape
    fields = [smooth_field(shape, 4.0 / map_.resolution, random) for _ in range(2)]
    greatest = max(np.hypot(*fields).max(), 1e-12)
    down, right = (shift / map_.resolution / greatest * field for field in fields)  # [cell] where a cell comes from
    row, column = np.indices(shape)
    from_row = np.clip(np.rint(row + down).astype(int), 0, shape[0] - 1)
    from_column = np.clip(np.rint(column + right).astype(int), 0, shape[1] - 1)
    truth = map_.truth.copy()
    if len(truth):
        truth[:, 1:] = moved_poses(map_, truth[:, 1:], down, right)
    return dataclasses.replace(map_, cells=map_.cells[from_row, from_column], truth=truth)


def moved_poses(map_, poses, down, right):
    """Where a map that takes its cells from (row + down, column + right) shows what was at the poses."""
    def shift_at(x, y):
        at = [map_.cells.shape[0] - 0.5 - (y - map_.origin[1]) / map_.resolution, (x - map_.origin[0]) / map_.resolution - 0.5]
        return tuple(map_.resolution * ndimage.map_coordinates(field, at, order=1, mode="nearest") for field in (right, -down))

    def image_of(x, y):
        new_x, new_y = x, y
        for _ in range(5):  # a fixed point: the field is flat
            dx, dy = shift_at(new_x, new_y)
            new_x, new_y = x - dx, y - dy
        return new_x, new_y

    x, y, phi = poses.T
    ahead = 2.0  # [m] over which the turn is measured
    points = [image_of(x + step * np.cos(phi), y + step * np.sin(phi)) for step in (-ahead, ahead)]
    turned = np.arctan2(points[1][1] - points[0][1], points[1][0] - points[0][0])
    return np.column_stack([*image_of(x, y), turned])


def moved(map_, random, share):
    cells = map_.cells.copy()
    occupied = is_occupied(cells)
    labels, _ = ndimage.label(ndimage.binary_dilation(occupied, iterations=2))
    most = 1.5 / map_.resolution
    for number, (rows, columns) in enumerate(ndimage.find_objects(labels), 1):
        height, width = rows.stop - rows.start, columns.stop - columns.start
        if max(height, width) > most or random.random() >= share:
            continue
        thing = labels[rows, columns] == number
        filled = ndimage.binary_fill_holes(thing & occupied[rows, columns]) | (thing & ~is_free(cells[rows, columns]))
        picture = cells[rows, columns].copy()
        cells[rows, columns][filled] = FREE
        for _ in range(10):
            top = rows.start + int(random.integers(-2 * most, 2 * most + 1))
            left = columns.start + int(random.integers(-2 * most, 2 * most + 1))
            if top < 0 or left < 0:
                continue
            place = cells[top:top + height, left:left + width]
            if place.shape == filled.shape and is_free(place).all():
                place[filled] = picture[filled]
                break
    return dataclasses.replace(map_, cells=cells)


def grey(map_, random, share):
    cells = map_.cells.copy()
    field = smooth_field(cells.shape, 0.3 / map_.resolution, random)
    known = cells != UNKNOWN
    if known.any():
        patches = field > np.quantile(field[known], 1 - share / 2)
        cells[known & (patches | (random.random(cells.shape) < share / 2))] = UNKNOWN
    return dataclasses.replace(map_, cells=cells)


def false_free(map_, random, width):
    cells = map_.cells.copy()
    seen = ndimage.binary_closing(is_free(cells) | is_occupied(cells), iterations=max(1, round(0.2 / map_.resolution)))
    behind = map_.resolution * ndimage.distance_transform_edt(~seen)
    thickness = 0.15  # [m] of wall that is left between
    ring = (behind > thickness) & (behind <= thickness + width) & (smooth_field(cells.shape, 1.0 / map_.resolution, random) > -0.7)
    cells[ring & (cells == UNKNOWN)] = FREE
    return dataclasses.replace(map_, cells=cells)


DEGRADATIONS = {function.__name__: function for function in (coarse, smeared, blurred, warped, moved, grey, false_free)}


def parse(word):
    """("smeared", (0.17, 0.47)) of "smeared=0.17,0.47"."""
    name, _, strengths = word.partition("=")
    try:
        if name not in DEGRADATIONS:
            raise ValueError
        return name, tuple(float(v) for v in strengths.split(","))
    except ValueError:
        raise ValueError(f"'{word}' is not KIND=STRENGTH with a KIND of {', '.join(DEGRADATIONS)}") from None


def degrade(map_, words, seed):
    """The same result for the same seed."""
    random = np.random.default_rng(seed)
    for word in words:
        name, strengths = parse(word)
        map_ = DEGRADATIONS[name](map_, random, *strengths)
    return map_


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("map", type=pathlib.Path, help="yaml file")
    parser.add_argument("folder", type=pathlib.Path, help="to write map.yaml, map.png and gt.txt to")
    parser.add_argument("words", nargs="+", metavar="KIND=STRENGTH")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--ground-truth", type=pathlib.Path, help="`time x y phi` lines, which move with the map")
    a = parser.parse_args()
    try:
        for word in a.words:
            parse(word)
        a.folder.mkdir(parents=True, exist_ok=True)
        result = degrade(load_map(a.map, a.ground_truth), a.words, a.seed)
        save_map(result, a.folder)
        if a.ground_truth:
            np.savetxt(a.folder / "gt.txt", result.truth, fmt="%.6f")
    except (OSError, ValueError, TypeError) as error:
        sys.exit(f"degraded_maps.py: {error}")


if __name__ == "__main__":
    main()
