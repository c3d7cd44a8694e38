#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Draws the small office that ships with d2s1r: sample_data.py OUT_FOLDER

Writes office.png and office.yaml (a map of map_server), office_bag (a ROS 2 bag, sqlite3, of a drive: /scan, /odom,
/tf, /tf_static), office_truth.txt (`time x y phi` of the robot in the map frame: s, m, rad) and office_scan.txt (the
ranges of the first scan [m], from -135 to 135 deg). Scans are exact
intersections of beams with walls, with 1 cm of noise; some of them see a person who is not in the map.
office.rawlog holds the same drive for MRPT:
    rawlog-localize -m office.yaml -i office_bag -o out
    rawlog-edit --remove-label D2S1R,D2S1R_ODO -i out/localized.rawlog -o office.rawlog
"""
import math
import pathlib
import sqlite3
import struct
import sys
import zlib

import numpy as np

CELL = 0.05  # [m]
WIDTH, DEPTH = 22.0, 13.0  # [m]
MARGIN = 0.5 + CELL / 2  # [m] of unknown space around the walls, which lie in the middle of their cells
WALLS = [  # x0, y0, x1, y1 [m] from the lower left corner of the office
    (0, 0, 22, 0), (22, 0, 22, 13), (22, 13, 0, 13), (0, 13, 0, 0),
    (0, 5, 3, 5), (4, 5, 9.5, 5), (10.5, 5, 16, 5), (17, 5, 22, 5),  # south of the corridor, with doors
    (0, 7, 6, 7), (7, 7, 12.5, 7), (13.5, 7, 19, 7), (20, 7, 22, 7),  # north of it
    (6, 0, 6, 5), (13.5, 0, 13.5, 2), (13.5, 3, 13.5, 5), (9, 7, 9, 13), (15.5, 7, 15.5, 13),
    (18.5, 9.5, 22, 9.5)]
FURNITURE = [  # boxes, as walls
    (1, 0.6, 2.6, 1.4), (4.2, 2.2, 5.2, 3.4), (7.5, 1.2, 9.1, 2.0), (11.2, 3.2, 12.8, 3.9), (15.2, 0.5, 16.4, 2.1),
    (19.3, 2.4, 20.9, 3.2), (0.5, 11.2, 2.5, 12.0), (4.4, 9.4, 6.2, 10.4), (10.2, 10.8, 11.4, 12.4),
    (13.0, 8.4, 14.0, 9.2), (16.6, 11.4, 18.2, 12.4), (20.4, 10.6, 21.4, 11.8)]
DRIVE = [(2, 3), (3.5, 4), (3.5, 6), (6.5, 6), (6.5, 8.4), (7.6, 8.6), (6.5, 8.2), (6.5, 6.1), (10, 6), (10, 4), (10.2, 2.4),
         (10, 3.6), (10, 5.9), (13, 6), (13, 7.6), (12, 8.4), (13, 7.4), (13, 6), (16.5, 5.9), (16.5, 4), (17.6, 3)]
STEP = 0.6  # [m] from scan to scan
SPEED = 0.5  # [m/s]
START = 1_700_000_000_000_000_000  # [ns]
BEAMS, FIELD_OF_VIEW, MAX_RANGE = 361, math.radians(270), 20.0  # [-], [rad], [m]
LASER = (0.15, 0.0, 0.0)  # on the robot [m, m, rad]
PERSON = [(frame, 0.9, 0.5) for frame in range(8, 14)]  # frame, ahead and to the left of the robot [m]
RADIUS = 0.22  # [m] of the person


def segments():
    boxes = [(a, b, c, b, c, d, a, d) for a, b, c, d in FURNITURE]
    sides = [(*box[2 * i:2 * i + 2], *box[(2 * i + 2) % 8:(2 * i + 2) % 8 + 2]) for box in boxes for i in range(4)]
    return np.array(WALLS + sides, dtype=float)


def path():
    """Poses x, y, phi [m, rad] every STEP along DRIVE, looking ahead."""
    points = np.array(DRIVE)
    lengths = np.hypot(*np.diff(points, axis=0).T)
    along = np.concatenate([[0], np.cumsum(lengths)])
    way = np.arange(0, along[-1], STEP)
    place = np.column_stack([np.interp(way, along, points[:, i]) for i in range(2)])
    ahead = np.column_stack([np.interp(way + 0.3, along, points[:, i]) for i in range(2)]) - place
    return np.column_stack([place, np.arctan2(ahead[:, 1], ahead[:, 0])])


def ranges(walls, person, sensor, random):
    """What the laser sees at `sensor` (x, y, phi) [m]."""
    angles = sensor[2] - FIELD_OF_VIEW / 2 + np.linspace(0, FIELD_OF_VIEW, BEAMS)
    direction = np.column_stack([np.cos(angles), np.sin(angles)])[:, None]
    start, along = walls[None, :, :2] - sensor[:2], (walls[:, 2:] - walls[:, :2])[None]
    cross = direction[..., 0] * along[..., 1] - direction[..., 1] * along[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (start[..., 0] * along[..., 1] - start[..., 1] * along[..., 0]) / cross
        share = (start[..., 0] * direction[..., 1] - start[..., 1] * direction[..., 0]) / cross
    seen = np.where((distance > 0) & (share >= 0) & (share <= 1), distance, np.inf).min(axis=1)
    if person is not None:
        middle = person - sensor[:2]
        towards = direction[:, 0] @ middle
        depth = RADIUS**2 - (middle @ middle - towards**2)
        seen = np.where((towards > 0) & (depth > 0), np.minimum(seen, towards - np.sqrt(np.maximum(depth, 0))), seen)
    return (seen + random.normal(0, 0.01, BEAMS)).astype(np.float32)


def moved(pose, motion):
    """Where `motion`, in the frame of `pose`, leads."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return np.array([pose[0] + c * motion[0] - s * motion[1], pose[1] + s * motion[0] + c * motion[1], pose[2] + motion[2]])


def motion_between(pose, other):
    c, s, d = math.cos(pose[2]), math.sin(pose[2]), other - pose
    return np.array([c * d[0] + s * d[1], -s * d[0] + c * d[1], math.remainder(d[2], 2 * math.pi)])


def write_map(folder, walls):
    """0 occupied, 205 unknown, 254 free; the row of greatest y comes first."""
    first = int(MARGIN / CELL)
    rows, columns = (round(size / CELL) + 1 + 2 * first for size in (DEPTH, WIDTH))
    cells = np.full((rows, columns), 205, np.uint8)
    cells[first:rows - first, first:columns - first] = 254
    for a, b, c, d in FURNITURE:  # nothing is known of what is inside
        cells[int((b + MARGIN) / CELL):int((d + MARGIN) / CELL), int((a + MARGIN) / CELL):int((c + MARGIN) / CELL)] = 205
    for x0, y0, x1, y1 in walls:
        points = np.linspace((x0, y0), (x1, y1), round(100 * max(abs(x1 - x0), abs(y1 - y0))) + 1)
        column, row = np.floor((points.T + MARGIN) / CELL + 1e-9).astype(int)
        cells[row, column] = 0

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    lines = b"".join(b"\0" + line.tobytes() for line in cells[::-1])
    header = struct.pack(">IIBBBBB", columns, rows, 8, 0, 0, 0, 0)
    (folder / "office.png").write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) +
                                        chunk(b"IDAT", zlib.compress(lines, 9)) + chunk(b"IEND", b""))
    (folder / "office.yaml").write_text(
        f"image: office.png\nresolution: {CELL}\norigin: [{-MARGIN:.3f}, {-MARGIN:.3f}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n")


class Cdr:
    """A message of ROS 2: little-endian, each number aligned to its size."""

    def __init__(self):
        self.bytes = b""

    def add(self, kinds, *values):
        for kind, value in zip(kinds, values):
            self.bytes += bytes(-len(self.bytes) % struct.calcsize(kind)) + struct.pack("<" + kind, value)
        return self

    def text(self, text):
        self.add("I", len(text) + 1).bytes += text.encode() + b"\0"
        return self

    def header(self, time, frame):
        return self.add("iI", *divmod(time, 10**9)).text(frame)

    def pose(self, pose):
        return self.add("ddd", *pose[:2], 0).add("dddd", 0, 0, math.sin(pose[2] / 2), math.cos(pose[2] / 2))

    def message(self):
        return b"\0\1\0\0" + self.bytes


def transform(time, parent, child, pose):
    return Cdr().add("I", 1).header(time, parent).text(child).pose(pose).message()


def odometry(time, pose, velocity):
    message = Cdr().header(time, "odom").text("base_link").pose(pose).add("d" * 36, *[0.0] * 36)
    return message.add("d" * 6, velocity[0], velocity[1], 0, 0, 0, velocity[2]).add("d" * 36, *[0.0] * 36).message()


def laser_scan(time, seen):
    first, step = -FIELD_OF_VIEW / 2, FIELD_OF_VIEW / (BEAMS - 1)
    scan = Cdr().header(time, "laser").add("fffffff", first, -first, step, 0, 0, 0.05, MAX_RANGE).add("I", BEAMS)
    scan.bytes += seen.tobytes()
    return scan.add("I", 0).message()


def messages(walls):
    """Yields (topic, time [ns], message), and truth and ranges as a last item of topic None."""
    random = np.random.default_rng(1)
    poses = path()
    yield "/tf_static", START, transform(START, "base_link", "laser", LASER)
    odom, truth, seen = np.zeros(3), [], []
    people = {frame: (ahead, left) for frame, ahead, left in PERSON}
    for i, pose in enumerate(poses):
        time = START + round(i * STEP / SPEED * 1e9)
        motion = motion_between(poses[i - 1], pose) if i else np.zeros(3)
        odom = moved(odom, motion * random.normal(1.01, 0.02, 3))
        person = moved(pose, (*people[i], 0))[:2] if i in people else None
        yield "/odom", time, odometry(time, odom, motion * SPEED / STEP)
        yield "/tf", time, transform(time, "odom", "base_link", odom)
        seen.append(ranges(walls, person, moved(pose, LASER), random))
        yield "/scan", time, laser_scan(time, seen[-1])
        truth.append((time / 1e9, *pose))
    yield None, 0, (truth, seen)


TYPES = {"/scan": "sensor_msgs/msg/LaserScan", "/odom": "nav_msgs/msg/Odometry", "/tf": "tf2_msgs/msg/TFMessage",
         "/tf_static": "tf2_msgs/msg/TFMessage"}


def write_bag(folder, recorded):
    folder.mkdir(exist_ok=True)
    file = folder / "office_bag_0.db3"
    file.unlink(missing_ok=True)
    with sqlite3.connect(file) as bag:
        bag.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
                    "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)")
        bag.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
                    "data BLOB NOT NULL)")
        numbers = {name: number for number, name in enumerate(TYPES, 1)}
        bag.executemany("INSERT INTO topics VALUES(?, ?, ?, 'cdr', '')", [(n, t, TYPES[t]) for t, n in numbers.items()])
        bag.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)",
                        [(numbers[topic], time, data) for topic, time, data in recorded])
    times = [time for _, time, _ in recorded]
    duration, first = max(times) - min(times), min(times)
    counts = {name: sum(topic == name for topic, _, _ in recorded) for name in TYPES}
    topics = "".join(
        f"    - topic_metadata:\n        name: {name}\n        type: {kind}\n        serialization_format: cdr\n"
        f"        offered_qos_profiles: \"\"\n      message_count: {counts[name]}\n" for name, kind in TYPES.items())
    (folder / "metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  version: 4\n  storage_identifier: sqlite3\n"
        f"  relative_file_paths:\n    - {file.name}\n  duration:\n    nanoseconds: {duration}\n"
        f"  starting_time:\n    nanoseconds_since_epoch: {first}\n  message_count: {len(recorded)}\n"
        f"  topics_with_message_count:\n{topics}  compression_format: \"\"\n  compression_mode: \"\"\n")


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: sample_data.py OUT_FOLDER")
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    walls = segments()
    write_map(folder, walls)
    *recorded, (_, _, (truth, seen)) = messages(walls)
    write_bag(folder / "office_bag", recorded)
    np.savetxt(folder / "office_truth.txt", truth, "%.6f")
    np.savetxt(folder / "office_scan.txt", seen[0], "%.3f")


if __name__ == "__main__":
    main()
