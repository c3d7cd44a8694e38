# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Draws floor plans: rooms and corridors, the walls between them with doors and panes of glass.

Tiles fill a rectangle without gaps; where two of them meet stands a wall, unless both are corridors. Lengths are in
metres, in the frame of the plan, whose lower left corner is (0, 0).
"""
import dataclasses
import itertools
import math

OUTSIDE, CORRIDOR = "outside", "corridor"
OUTER_WALL, INNER_WALL = 0.3, 0.12  # [m] thickness
BESIDE_DOOR = 0.3  # [m] of wall on either side of a door, at least


@dataclasses.dataclass(frozen=True)
class Style:
    """What the floors of one kind have in common; (least, greatest) of what is drawn at random."""
    uses: tuple  # of the rooms
    block_width: tuple  # [m] of what lies between two corridors that run along y
    block_depth: tuple  # [m] of what lies between two corridors that run along x
    corridor: tuple  # [m] width
    room_area: tuple  # [m2] rooms are split until they are smaller than this
    aspect: float  # [-] longest side of the floor against its shortest, at most
    alike: bool = False  # the rooms of a block are equal
    open_doors: float = 0.7  # [-] share of the doors
    glass: float = 0.1  # [-] share of the inner walls of corridors that have a pane
    windows: float = 0.3  # [-] share of the outer walls that have panes
    courtyards: float = 0.1  # [-] share of the blocks that are not built on
    pilasters: float = 0.3  # [-] share of the walls of corridors and halls that have some


STYLES = {
    "office": Style(("office", "office", "office", "meeting", "store"), (10, 22), (6, 14), (1.6, 2.6), (12, 45), 2.2,
                    glass=0.2),
    "corridor": Style(("office", "store"), (25, 60), (4, 9), (1.8, 3.5), (14, 30), 4, alike=True, open_doors=0.15,
                      windows=0.1, pilasters=0.6),
    "hall": Style(("hall", "hall", "meeting", "store"), (14, 35), (10, 25), (2.5, 5), (120, 500), 2, open_doors=0.8,
                  windows=0.5),
    "apartment": Style(("living", "bedroom", "bedroom", "kitchen", "bath"), (7, 14), (5, 11), (1.2, 1.8), (5, 24), 1.8,
                       glass=0.03, windows=0.4),
    "warehouse": Style(("racks",), (200, 300), (200, 300), (3, 4), (1500, 5000), 2, windows=0.05, courtyards=0,
                       pilasters=0.5),
}


@dataclasses.dataclass(frozen=True)
class Tile:
    x0: float
    y0: float
    x1: float
    y1: float
    use: str

    @property
    def width(self):
        return self.x1 - self.x0

    @property
    def depth(self):
        return self.y1 - self.y0

    @property
    def area(self):
        return self.width * self.depth


@dataclasses.dataclass(frozen=True)
class Door:
    start: float  # [m] along the wall
    end: float
    open_when: str  # "both", "map", "scan" or "never": when the map is made, when it is scanned
    swings_to: int  # 1 or -1: to the side of greater or lesser coordinates
    hinge: float  # [m] along the wall, one of the ends


@dataclasses.dataclass
class Wall:
    """Between two tiles."""
    along_x: bool
    at: float  # [m] the other coordinate of its middle line
    start: float
    end: float
    thickness: float
    between: tuple  # numbers of the tiles, the one of lesser coordinates first
    doors: list = dataclasses.field(default_factory=list)
    panes: list = dataclasses.field(default_factory=list)  # (start, end)

    @property
    def length(self):
        return self.end - self.start

    def openings(self):
        """(start, end) in order."""
        return sorted([(door.start, door.end) for door in self.doors] + self.panes)


@dataclasses.dataclass(frozen=True)
class FloorPlan:
    style: Style
    width: float
    depth: float
    tiles: list
    walls: list


def draw_plan(kind, area, random):
    """A floor of about `area` [m2], always the same one from a numpy generator in the same state."""
    style = STYLES[kind]
    aspect = random.uniform(1, style.aspect)
    width = math.sqrt(area * aspect)
    depth = area / width
    columns = bands(width, style.block_width, style.corridor, random)
    rows = bands(depth, style.block_depth, style.corridor, random)
    tiles = []
    for (x0, x1, is_way_up), (y0, y1, is_way_across) in itertools.product(columns, rows):
        if is_way_up or is_way_across:
            tiles.append(Tile(x0, y0, x1, y1, CORRIDOR))
        elif len(columns) * len(rows) > 3 and random.random() < style.courtyards:
            tiles.append(Tile(x0, y0, x1, y1, OUTSIDE))
        else:
            tiles += rooms_of_block(Tile(x0, y0, x1, y1, "block"), style, random)
    tiles += surroundings(width, depth)
    walls = walls_between(tiles)
    add_doors(tiles, walls, style, random)
    add_panes(tiles, walls, style, random)
    return FloorPlan(style, width, depth, tiles, walls)


def bands(length, block, corridor, random):
    """[(from, to, whether it is a corridor)] that fill `length`."""
    result, start = [], 0.0
    while True:
        end = start + random.uniform(*block)
        way = random.uniform(*corridor)
        if length - end - way < 0.8 * block[0]:
            return result + [(start, length, False)]
        result += [(start, end, False), (end, end + way, True)]
        start = end + way


def rooms_of_block(block, style, random):
    if not style.alike:
        return split(block, style, random)
    along_x = block.width > block.depth
    length = max(block.width, block.depth)
    count = max(1, round(length * min(block.width, block.depth) / random.uniform(*style.room_area)))
    edges = [length * i / count for i in range(count + 1)]
    use = str(random.choice(style.uses))
    return [Tile(block.x0 + a, block.y0, block.x0 + b, block.y1, use) if along_x else
            Tile(block.x0, block.y0 + a, block.x1, block.y0 + b, use) for a, b in zip(edges, edges[1:])]


def split(tile, style, random):
    """Halves the longer side at random until the rooms are small."""
    longest, shortest = max(tile.width, tile.depth), min(tile.width, tile.depth)
    narrow = longest / 2 < 1.8 or (shortest < 2.5 and longest < 5)
    if tile.area < random.uniform(*style.room_area) or narrow:
        return [dataclasses.replace(tile, use=str(random.choice(style.uses)))]
    share = random.uniform(0.36, 0.64)
    if tile.width > tile.depth:
        middle = tile.x0 + share * tile.width
        halves = dataclasses.replace(tile, x1=middle), dataclasses.replace(tile, x0=middle)
    else:
        middle = tile.y0 + share * tile.depth
        halves = dataclasses.replace(tile, y1=middle), dataclasses.replace(tile, y0=middle)
    return [room for half in halves for room in split(half, style, random)]


def surroundings(width, depth):
    far = 30.0  # [m]
    return [Tile(-far, 0, 0, depth, OUTSIDE), Tile(width, 0, width + far, depth, OUTSIDE),
            Tile(-far, -far, width + far, 0, OUTSIDE), Tile(-far, depth, width + far, depth + far, OUTSIDE)]


def walls_between(tiles):
    walls = []
    for (i, a), (j, b) in itertools.permutations(enumerate(tiles), 2):
        if a.use == b.use and a.use in (OUTSIDE, CORRIDOR):
            continue
        thickness = OUTER_WALL if OUTSIDE in (a.use, b.use) else INNER_WALL
        if abs(a.x1 - b.x0) < 1e-6:
            along_x, at, start, end = False, a.x1, max(a.y0, b.y0), min(a.y1, b.y1)
        elif abs(a.y1 - b.y0) < 1e-6:
            along_x, at, start, end = True, a.y1, max(a.x0, b.x0), min(a.x1, b.x1)
        else:
            continue
        if end - start > 1e-6:
            walls.append(Wall(along_x, at, start, end, thickness, (i, j)))
    return walls


def add_doors(tiles, walls, style, random):
    """One at least to every room that has room for it, most of them from a corridor."""
    group = list(range(len(tiles)))

    def find(i):
        while group[i] != i:
            i = group[i]
        return i

    corridors = [i for i, tile in enumerate(tiles) if tile.use == CORRIDOR]
    for i in corridors[1:]:
        group[i] = corridors[0]
    ranked = []
    for wall in walls:
        uses = [tiles[i].use for i in wall.between]
        if OUTSIDE in uses or wall.length < 0.8 + 2 * BESIDE_DOOR:
            continue
        ranked.append((random.random() + (0 if CORRIDOR in uses else 0.7), wall))
    for rank, wall in sorted(ranked, key=lambda pair: pair[0]):
        a, b = (find(i) for i in wall.between)
        if a == b and random.random() > (0.5 if rank < 0.7 else 0.15):
            continue
        group[max(a, b)] = min(a, b)
        wall.doors.append(draw_door(wall, style, a != b, random))


def draw_door(wall, style, is_only_way, random):
    wide = wall.length > 6 and random.random() < 0.2
    width = min(random.uniform(1.5, 2.2) if wide else random.uniform(0.8, 1.0), wall.length - 2 * BESIDE_DOOR)
    start = wall.start + BESIDE_DOOR + random.random() * max(0.0, wall.length - 2 * BESIDE_DOOR - width)
    often = style.open_doors ** 0.5 if is_only_way else style.open_doors  # what the mapper wants to see is opened
    open_to_mapper = random.random() < often
    open_to_scan = open_to_mapper if random.random() < 0.85 else random.random() < often
    state = {(True, True): "both", (True, False): "map", (False, True): "scan", (False, False): "never"}
    return Door(start, start + width, state[open_to_mapper, open_to_scan], int(random.choice((-1, 1))),
                start if random.random() < 0.5 else start + width)


def add_panes(tiles, walls, style, random):
    """Glass down to the floor, for a laser sees nothing else of a window."""
    for wall in walls:
        uses = [tiles[i].use for i in wall.between]
        share = style.windows if OUTSIDE in uses else style.glass if CORRIDOR in uses else 0
        if random.random() >= share:
            continue
        width, gap = random.uniform(0.8, 2.5), random.uniform(0.15, 1.5)
        start = wall.start + random.uniform(0.3, 1)
        while start + width < wall.end - 0.3:
            if all(start + width < door.start - 0.1 or start > door.end + 0.1 for door in wall.doors):
                wall.panes.append((start, start + width))
            start += width + gap
