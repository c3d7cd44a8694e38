# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Scans of a laser that is simulated in a map, for experiments that need the Python module d2s1r."""
import needs

try:
    import d2s1r
    import numpy as np
except ImportError as error:
    needs.stop(error, "python3-numpy", "name the folder of the built module by PYTHONPATH")

NOISE = 0.01  # [m] standard deviation of a range
REACH = 30.0  # [m]


class SimulatedLaser:
    """A laser in a map: rays end in the first cell that is not free."""

    def __init__(self, path):
        self.map = d2s1r.Map.load(str(path))
        cells = self.map.array
        self.cell = self.map.resolution
        self.left, _, self.bottom, _ = self.map.extent
        self.occupied = cells > 0.65
        self.free = cells < 0.4
        self.blocked = np.pad(~self.free, 1, constant_values=True)

    def places(self, count, random, clearance=0.3):
        """Poses (x, y, phi) of `count` sensors in free space, with `clearance` [m] along x and y: count x 3."""
        reach, clear = round(clearance / self.cell), self.free.copy()
        for axis in (0, 1):
            for step in range(-reach, reach + 1):
                clear &= np.roll(self.free, step, axis)
        clear[:reach + 1] = clear[-reach - 1:] = clear[:, :reach + 1] = clear[:, -reach - 1:] = False
        rows, columns = np.nonzero(clear)
        chosen = random.integers(len(rows), size=count)
        where = np.column_stack([columns[chosen], rows[chosen]]) + random.uniform(size=(count, 2))
        return np.column_stack([where * self.cell + (self.left, self.bottom), random.uniform(-np.pi, np.pi, count)])

    def ranges(self, sensors, angles, random, extra=()):
        """Ranges [m] of beams at `angles` [rad] from `sensors`, a pose for each beam: inf where nothing is in reach.

        extra: segments (x0, y0, x1, y1) [m] that stop a beam, too."""
        heading = sensors[:, 2] + angles
        dx, dy = np.cos(heading), np.sin(heading)
        seen = np.full(len(angles), np.inf)
        open_beams = np.arange(len(angles))
        step = self.cell / 4
        for first in np.arange(0, REACH, 64 * step):
            way = first + step * np.arange(1, 65)
            x = sensors[open_beams, 0, None] + way * dx[open_beams, None]
            y = sensors[open_beams, 1, None] + way * dy[open_beams, None]
            column = np.clip(((x - self.left) / self.cell).astype(int) + 1, 0, self.blocked.shape[1] - 1)
            row = np.clip(((y - self.bottom) / self.cell).astype(int) + 1, 0, self.blocked.shape[0] - 1)
            hit = self.blocked[row, column]
            ended = hit.any(axis=1)
            at = hit[ended].argmax(axis=1)
            inside = np.zeros(ended.sum(), dtype=bool)
            r, c = row[ended, :][np.arange(len(at)), at] - 1, column[ended, :][np.arange(len(at)), at] - 1
            known = (r >= 0) & (c >= 0) & (r < self.occupied.shape[0]) & (c < self.occupied.shape[1])
            inside[known] = self.occupied[r[known], c[known]]
            seen[open_beams[ended]] = np.where(inside, way[at], np.inf)  # what is unknown returns nothing
            open_beams = open_beams[~ended]
            if len(open_beams) == 0:
                break
        for segment in extra:
            seen = np.minimum(seen, to_segment(sensors, dx, dy, segment))
        seen[seen >= REACH] = np.inf
        return seen + random.normal(0, NOISE, len(seen))


def to_segment(sensors, dx, dy, segment):
    """Distance [m] from sensors along (dx, dy) to a segment; inf where they miss it."""
    x0, y0, x1, y1 = segment
    ex, ey = x1 - x0, y1 - y0
    across = dx * ey - dy * ex
    with np.errstate(divide="ignore", invalid="ignore"):
        way = ((x0 - sensors[:, 0]) * ey - (y0 - sensors[:, 1]) * ex) / across
        share = ((x0 - sensors[:, 0]) * dy - (y0 - sensors[:, 1]) * dx) / across
        return np.where((way > 0) & (share >= 0) & (share <= 1), way, np.inf)


def difference(pose, other):
    """(m, rad) between two poses (x, y, phi)."""
    turn = (pose[2] - other[2] + np.pi) % (2 * np.pi) - np.pi
    return float(np.hypot(pose[0] - other[0], pose[1] - other[1])), abs(float(turn))
