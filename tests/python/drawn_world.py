# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""A drawn building and a drive through it, as arrays and as the files that the program reads."""
import csv
import math
import os
import subprocess

import numpy as np

CELL = 0.05  # [m]
ORIGIN = (-1.0, 2.0)  # [m] map frame
MAX_RANGE = 20.0  # [m]
BEAMS = 181
FIRST_ANGLE, STEP = -math.radians(90), math.radians(1)
SENSOR = (0.2, -0.1, math.radians(30))  # laser on the robot [m, rad]
WALLS = [(0, 0, 12, 0.2), (0, 8.8, 12, 9), (0, 0, 0.2, 9), (11.8, 0, 12, 9), (4, 0, 4.2, 5.5), (4, 6.7, 4.2, 9),
         (4, 5.5, 7, 5.7), (8.3, 5.5, 12, 5.7), (8, 0, 8.2, 3), (1, 2, 1.8, 2.6), (5.5, 1, 6.1, 1.5), (9.4, 7, 10.6, 7.6),
         (2.4, 7.9, 3.1, 8.4), (10.2, 1.1, 10.9, 2.9)]  # x0, y0, x1, y1 [m] from the lower left corner


def occupied_cells(boxes=()):
    """The walls, and more boxes: x0, y0, x1, y1 [m] from the lower left corner."""
    cells = np.zeros((round(9 / CELL), round(12 / CELL)), dtype=bool)
    for x0, y0, x1, y1 in (*WALLS, *boxes):
        cells[round(y0 / CELL):round(y1 / CELL), round(x0 / CELL):round(x1 / CELL)] = True
    return cells


def ranges_at(occupied, robot):
    """What the laser sees of a robot at (x, y, phi), map frame, with 1 cm of noise."""
    x, y, phi = robot
    sx = x + SENSOR[0] * math.cos(phi) - SENSOR[1] * math.sin(phi)
    sy = y + SENSOR[0] * math.sin(phi) + SENSOR[1] * math.cos(phi)
    angles = phi + SENSOR[2] + FIRST_ANGLE + STEP * np.arange(BEAMS)
    way = np.arange(0, MAX_RANGE, 0.01)[:, None]
    column = ((sx + way * np.cos(angles) - ORIGIN[0]) / CELL).astype(int).clip(0, occupied.shape[1] - 1)
    row = ((sy + way * np.sin(angles) - ORIGIN[1]) / CELL).astype(int).clip(0, occupied.shape[0] - 1)
    seen = occupied[row, column].argmax(axis=0) * 0.01
    noise = np.random.default_rng(round(1000 * x)).normal(0, 0.01, BEAMS)
    return (seen + noise).astype(np.float32)


class World:
    """A map and a drive of 100 frames through it, as arrays and as the files that the program reads."""

    def __init__(self, folder, spoiled=False, boxes=()):
        """In a spoiled drive every tenth scan is of another place or sees only what is near."""
        self.folder = folder
        self.occupied = occupied_cells(boxes)
        turn = np.linspace(0, 2 * math.pi, 100)
        self.robots = np.stack([5 + 1.2 * np.cos(turn), 5.4 + 1.2 * np.sin(turn), turn + math.pi / 2 - 2 * math.pi], 1)
        self.scans = [ranges_at(self.occupied, robot) for robot in self.robots]
        for i in range(5, 100, 20) if spoiled else ():
            self.scans[i] = np.random.default_rng(i).uniform(0.5, 6, BEAMS).astype(np.float32)
            self.scans[i + 10][self.scans[i + 10] > 2] = MAX_RANGE
        np.savetxt(folder / "truth.txt", np.column_stack([100 + np.arange(100), self.robots]), "%.6f")
        with open(folder / "map.pgm", "wb") as image:
            image.write(b"P5\n%d %d\n255\n" % self.occupied.shape[::-1])
            image.write(np.where(self.occupied, 0, 254).astype(np.uint8)[::-1].tobytes())
        (folder / "map.yaml").write_text(
            f"image: map.pgm\nresolution: {CELL}\norigin: [{ORIGIN[0]}, {ORIGIN[1]}, 0]\n"
            "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n")
        with open(folder / "drive.log", "w") as log:
            for i, (robot, scan) in enumerate(zip(self.robots, self.scans)):
                pose = " ".join(repr(float(value)) for value in robot)
                numbers = " ".join(repr(float(value)) for value in scan)
                log.write(f"ROBOTLASER1 0 {FIRST_ANGLE!r} {math.pi!r} {STEP!r} {MAX_RANGE} 0.01 0 {BEAMS} {numbers} 0 "
                          f"{pose} {pose} 0 0 0 0 0 {100 + i} host {100 + i}\n")

    def rows_of_program(self, *options):
        """The rows of frames.csv and of hypotheses.csv."""
        pose = f"{SENSOR[0]},{SENSOR[1]},0,30,0,0"
        subprocess.run(
            [os.environ["RAWLOG_LOCALIZE"], "-m", self.folder / "map.yaml", "-i", self.folder / "drive.log", "-o",
             self.folder / "out", f"--sensor-pose={pose}", "--quiet", *options], check=True)
        rows = []
        for name in "frames.csv", "hypotheses.csv":
            with open(self.folder / "out" / name, newline="") as stream:
                rows.append(list(csv.DictReader(stream)))
        return rows

    def arguments(self, i):
        return self.scans[i], FIRST_ANGLE, STEP, MAX_RANGE, SENSOR
