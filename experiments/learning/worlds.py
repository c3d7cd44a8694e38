# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""What stands on a floor when it is mapped and when it is scanned, and the file that simulate_floor reads.

A shape is ("wall" | "glass", when, x0, y0, x1, y1) or ("post", when, x, y, radius) [m]; when: "map", "scan" or "both".
"""
import dataclasses
import math

from learning.floor_plans import CORRIDOR, INNER_WALL, OUTER_WALL, OUTSIDE

LEAF = 0.04  # [m] thickness of a door


@dataclasses.dataclass(frozen=True)
class Piece:
    """A kind of furniture; (least, greatest) [m]."""
    width: tuple
    depth: tuple
    form: str  # "box", "legs" at the corners, "desk" with drawers, "round"
    at_wall: bool
    moves: float  # [-] probability that it is elsewhere, gone or new when the floor is scanned


PIECES = {
    "cabinet": Piece((0.6, 2.0), (0.35, 0.6), "box", True, 0.08),
    "desk": Piece((1.2, 1.8), (0.6, 0.8), "desk", True, 0.12),
    "table": Piece((1.0, 2.4), (0.7, 1.0), "legs", False, 0.3),
    "chair": Piece((0.4, 0.5), (0.4, 0.5), "legs", False, 0.9),
    "bin": Piece((0.25, 0.4), (0.25, 0.4), "round", True, 0.5),
    "box": Piece((0.3, 0.8), (0.3, 0.6), "box", False, 0.8),
    "sofa": Piece((1.4, 2.2), (0.8, 0.95), "box", True, 0.15),
    "bed": Piece((1.0, 1.9), (1.95, 2.1), "box", True, 0.05),
    "counter": Piece((1.5, 3.0), (0.6, 0.65), "box", True, 0.0),
    "shelf": Piece((0.8, 3.0), (0.3, 0.5), "box", True, 0.1),
    "pallet": Piece((1.2, 1.25), (0.8, 0.85), "box", False, 0.8),
    "pillar": Piece((0.3, 0.7), (0.3, 0.7), "round", False, 0.0),
}
# [1 / m2] of each piece in a room of the use
FURNITURE = {
    "office": {"desk": 0.09, "chair": 0.12, "cabinet": 0.07, "bin": 0.05, "box": 0.02},
    "meeting": {"table": 0.06, "chair": 0.25, "cabinet": 0.03},
    "store": {"shelf": 0.2, "box": 0.12},
    "hall": {"pillar": 0.012, "chair": 0.06, "table": 0.02, "cabinet": 0.01, "box": 0.01},
    "living": {"sofa": 0.06, "table": 0.05, "chair": 0.15, "cabinet": 0.08, "box": 0.03},
    "bedroom": {"bed": 0.08, "cabinet": 0.1, "chair": 0.04},
    "kitchen": {"counter": 0.12, "table": 0.06, "chair": 0.15},
    "bath": {"counter": 0.1, "bin": 0.1},
    "racks": {"pallet": 0.01, "pillar": 0.002, "box": 0.01},
    CORRIDOR: {"cabinet": 0.01, "bin": 0.01, "box": 0.005},
}


def shapes_of(plan, random):
    """All shapes of a floor, in the frame of the plan."""
    shapes = []
    for wall in plan.walls:
        shapes += shapes_of_wall(wall)
        shapes += pilasters(plan, wall, random)
    for tile in plan.tiles:
        if tile.use == "racks":
            shapes += racks(tile, random)
        if tile.use != OUTSIDE:
            shapes += furniture(tile, random)
    return shapes + outdoors(plan, random)


def box(when, x0, y0, x1, y1):
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return [("wall", when, *a, *b) for a, b in zip(corners, corners[1:] + corners[:1])]


def placed(along_x, at, points):
    """Swaps coordinates of boxes (when, start, low, end, high) along a wall: `start`, `end` along it, `low`, `high`
    across it, from its middle line."""
    shapes = []
    for when, start, low, end, high in points:
        shapes += box(when, start, at + low, end, at + high) if along_x else box(when, at + low, start, at + high, end)
    return shapes


def shapes_of_wall(wall):
    half = wall.thickness / 2
    boxes, begin = [], wall.start - half
    for start, end in wall.openings():
        boxes.append(("both", begin, -half, start, half))
        begin = end
    boxes.append(("both", begin, -half, wall.end + half, half))
    shapes = placed(wall.along_x, wall.at, boxes)
    for start, end in wall.panes:
        ends = (start, wall.at, end, wall.at) if wall.along_x else (wall.at, start, wall.at, end)
        shapes.append(("glass", "both", *ends))
    for door in wall.doors:
        closed = {"both": None, "map": "scan", "scan": "map", "never": "both"}[door.open_when]
        if closed:
            shapes += placed(wall.along_x, wall.at, [(closed, door.start, -LEAF / 2, door.end, LEAF / 2)])
        if door.open_when != "never":
            shapes += open_leaf(wall, door)
    return shapes


def open_leaf(wall, door):
    """At a right angle to the wall, on the side to which it swings."""
    length = min(1.0, door.end - door.start)
    low, high = sorted((door.swings_to * wall.thickness / 2, door.swings_to * (wall.thickness / 2 + length)))
    start = door.hinge if door.hinge == door.start else door.hinge - LEAF
    return placed(wall.along_x, wall.at, [(door.open_when, start, low, start + LEAF, high)])


def pilasters(plan, wall, random):
    """Pillars and radiators that stand out of the walls of corridors and halls."""
    sides = [side for side, i in zip((-1, 1), wall.between) if plan.tiles[i].use in (CORRIDOR, "hall", "racks")]
    if not sides or random.random() > plan.style.pilasters:
        return []
    apart, width, out = random.uniform(2.5, 6), random.uniform(0.25, 0.6), random.uniform(0.1, 0.3)
    side, half = int(random.choice(sides)), wall.thickness / 2
    boxes, start = [], wall.start + random.uniform(0.5, apart)
    while start + width < wall.end - 0.2:
        if all(start + width < a or start > b for a, b in wall.openings()):
            low, high = sorted((side * half, side * (half + out)))
            boxes.append(("both", start, low, start + width, high))
        start += apart
    return placed(wall.along_x, wall.at, boxes)


def racks(tile, random):
    """Rows of posts, with goods between them that are not the same ones later."""
    depth, bay, aisle = random.uniform(0.9, 1.2), random.uniform(1.4, 2.8), random.uniform(2.2, 3.5)
    filled, shapes = random.uniform(0.3, 0.9), []
    y = tile.y0 + OUTER_WALL + random.uniform(1.5, 3)
    while y + 2 * depth < tile.y1 - 2:
        x, last = tile.x0 + random.uniform(2.5, 5), tile.x1 - random.uniform(2.5, 5)
        while x + bay < last:
            for px, py in ((x, y), (x, y + depth), (x + bay, y), (x + bay, y + depth)):
                shapes += box("both", px - 0.05, py - 0.04, px + 0.05, py + 0.04)
            stocked = [random.random() < filled]
            stocked.append(stocked[0] if random.random() < 0.7 else random.random() < filled)
            inset = random.uniform(0.0, 0.25)
            for when in {(True, True): ("both",), (True, False): ("map",), (False, True): ("scan",)}.get(tuple(stocked), ()):
                shapes += box(when, x + 0.15, y + inset, x + bay - 0.15, y + depth - 0.05)
            x += bay
        y += depth + aisle
    return shapes


def furniture(tile, random):
    shapes, taken = [], []
    margin = OUTER_WALL / 2 if tile.area > 100 else INNER_WALL / 2
    room = (tile.x0 + margin, tile.y0 + margin, tile.x1 - margin, tile.y1 - margin)
    for name, density in FURNITURE.get(tile.use, {}).items():
        for _ in range(random.poisson(density * tile.area)):
            piece = PIECES[name]
            first = place(piece, room, taken, random)
            moves = random.random() < piece.moves
            fate = random.choice(("moved", "gone", "new")) if moves else "stays"
            if first and fate != "new":
                shapes += draw_piece(piece, "map" if moves else "both", first, random)
            if fate in ("moved", "new"):
                second = place(piece, room, taken, random)
                shapes += draw_piece(piece, "scan", second, random) if second else []
    return shapes


def place(piece, room, taken, random):
    """(x, y, width, depth, angle) of the middle of a piece, or None where there is no room; `taken` grows by it."""
    x0, y0, x1, y1 = room
    for _ in range(10):
        width, depth = random.uniform(*piece.width), random.uniform(*piece.depth)
        side = int(random.integers(4))
        across, up = (width, depth) if side % 2 == 0 else (depth, width)
        if x1 - x0 < across + 1 or y1 - y0 < up + 1:
            continue
        x, y = random.uniform(x0 + across / 2, x1 - across / 2), random.uniform(y0 + up / 2, y1 - up / 2)
        angle = side * math.pi / 2
        if piece.at_wall:
            gap = 0.02
            x = {1: x0 + across / 2 + gap, 3: x1 - across / 2 - gap}.get(side, x)
            y = {0: y0 + up / 2 + gap, 2: y1 - up / 2 - gap}.get(side, y)
        else:
            angle += random.normal(0, 0.15) if piece.form != "round" else 0
        if all(abs(x - a) > (across + c) / 2 + 0.05 or abs(y - b) > (up + d) / 2 + 0.05 for a, b, c, d in taken):
            taken.append((x, y, across, up))
            return x, y, width, depth, angle
    return None


def draw_piece(piece, when, where, random):
    x, y, width, depth, angle = where
    c, s = math.cos(angle), math.sin(angle)

    def turned(u, v):
        return x + c * u - s * v, y + s * u + c * v

    def turned_box(u0, v0, u1, v1):
        corners = [turned(u0, v0), turned(u1, v0), turned(u1, v1), turned(u0, v1)]
        return [("wall", when, *a, *b) for a, b in zip(corners, corners[1:] + corners[:1])]

    if piece.form == "round":
        return [("post", when, x, y, width / 2)]
    if piece.form == "box":
        return turned_box(-width / 2, -depth / 2, width / 2, depth / 2)
    radius = random.uniform(0.012, 0.03)
    legs = [turned(i * (width / 2 - radius), j * (depth / 2 - radius)) for i in (-1, 1) for j in (-1, 1)]
    shapes = [("post", when, *leg, radius) for leg in legs]
    if piece.form == "desk":
        shapes += turned_box(width / 2 - 0.5, -depth / 2 + 0.05, width / 2 - 0.08, depth / 2 - 0.05)
    return shapes


def outdoors(plan, random):
    """What is seen through windows: cars, trees, other buildings."""
    shapes = []
    for _ in range(random.poisson((plan.width + plan.depth) / 8)):
        side, far = int(random.integers(4)), random.uniform(2, 15)
        x, y = random.uniform(0, plan.width), random.uniform(0, plan.depth)
        x = {0: -far, 1: plan.width + far}.get(side, x)
        y = {2: -far, 3: plan.depth + far}.get(side, y)
        when = str(random.choice(("both", "map", "scan")))
        if random.random() < 0.5:
            shapes.append(("post", when, x, y, random.uniform(0.1, 0.3)))
        else:
            shapes += box(when, x, y, x + random.uniform(1.5, 5), y + random.uniform(1.5, 5))
    return shapes
