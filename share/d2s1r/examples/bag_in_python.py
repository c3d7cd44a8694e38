# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Localizes the scans of a ROS 2 bag (sqlite3) in a map, without ROS: bag_in_python.py MAP.yaml BAG [X,Y,YAW]

BAG is the folder of a bag, or a .db3 file in it. X,Y,YAW is the pose of the laser on the robot [m, m, rad]. Prints `time status x y phi confidence` of each scan.
"""
import pathlib
import sqlite3
import struct
import sys

import d2s1r
import numpy as np


def laser_scan(message):
    """(ranges [m], first angle [rad], step [rad], greatest range [m]) of a sensor_msgs/msg/LaserScan in CDR."""
    length = struct.unpack_from("<I", message, 12)[0]  # of the frame's name, after 4 bytes of encapsulation and the stamp
    at = 4 + (12 + length + 3) // 4 * 4
    first, _, step, _, _, _, greatest, count = struct.unpack_from("<7fI", message, at)
    return np.frombuffer(message, "<f4", count, at + 32), first, step, greatest


def scans_of(file):
    """Rows (time [ns], message) of a .db3 file."""
    try:
        yield from sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro", uri=True).execute(
            "SELECT timestamp, data FROM messages JOIN topics ON topic_id = topics.id "
            "WHERE type = 'sensor_msgs/msg/LaserScan' ORDER BY timestamp")
    except sqlite3.Error as error:
        raise ValueError(f"{file}: is not the .db3 file of a bag, or damaged ({error}); check the path") from error


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit("usage: bag_in_python.py MAP.yaml BAG [X,Y,YAW]")
    sensor = tuple(float(word) for word in sys.argv[3].split(",")) if len(sys.argv) == 4 else (0, 0, 0)
    localizer = d2s1r.Localizer(d2s1r.Map.load(sys.argv[1]))
    bag = pathlib.Path(sys.argv[2])
    files = sorted(bag.glob("*.db3")) if bag.is_dir() else [bag]
    if not files:
        sys.exit(f"{bag}: holds no .db3 file; rawlog-localize reads bags of MCAP, too")
    for file in files:
        for time, message in scans_of(file):
            result = localizer.localize(*laser_scan(message), sensor_pose=sensor)
            pose = " ".join(f"{value:.3f}" for value in result.pose) if result.pose is not None else "- - -"
            print(f"{time / 1e9:.3f} {result.status} {pose} {result.confidence:.3f}")


if __name__ == "__main__":
    try:
        main()
    except (OSError, RuntimeError, ValueError) as error:
        sys.exit(str(error))
