#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Runs CBGL's own node with its own launch file: cbgl.py MAP.txt SCANS.txt OUT.csv (see peer.h)

The environment is that of the workspace in which CBGL was built, so that roslaunch finds it; the master is one of its own, on
the loopback. CBGL takes the corner of the map for the origin and the base for the laser, and a scan for one that is symmetric
about its x axis: the driver moves the map, leaves the laser's place on the robot out, and turns the scans. It gives them as a
laser would that hangs upside down, because CBGL has the sign of the yaw wrong for one that does not.
"""
import csv
import dataclasses
import json
import math
import os
import pathlib
import queue
import signal
import socket
import subprocess
import sys
import time
import xmlrpc.client

PORT = socket.create_server(("127.0.0.1", 0))
os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{PORT.getsockname()[1]}", ROS_IP="127.0.0.1")

import geometry_msgs.msg  # noqa: E402
import nav_msgs.msg  # noqa: E402
import PIL.Image  # noqa: E402
import rosgraph  # noqa: E402
import rospy  # noqa: E402
import sensor_msgs.msg  # noqa: E402
import std_srvs.srv  # noqa: E402
import tf2_msgs.msg  # noqa: E402

NODE = "/cbgl_node"
LAUNCH = """<launch>
  <include file="$(find cbgl)/launch/cbgl.launch"/>
  <param name="{node}/map_png_file" value="{picture}"/>
  <param name="{node}/laser_z_orientation" value="downwards"/>
</launch>
"""
PATIENCE = 900  # [s] for an answer


@dataclasses.dataclass
class Scan:
    time: float  # [s]
    first: float  # [rad] of the first beam
    step: float  # [rad]
    max_range: float  # [m]
    laser: tuple  # on the robot: m, m, rad
    ranges: list  # [m]


def read_map(file, picture_file):
    """(message with its corner at the origin, x and y of the corner [m]); writes the picture that the node reads itself"""
    picture, cell, x, y = pathlib.Path(file).read_text().split()
    image = PIL.Image.open(pathlib.Path(file).parent / picture)
    image.convert("RGBA").save(picture_file)
    state = {0: 100, 205: -1, 254: 0}
    message = nav_msgs.msg.OccupancyGrid()
    message.header.frame_id = "map"
    message.info.resolution, message.info.width, message.info.height = float(cell), *image.size
    message.info.origin.orientation.w = 1
    message.data = [state[grey] for grey in image.transpose(PIL.Image.Transpose.FLIP_TOP_BOTTOM).tobytes()]
    return message, float(x), float(y)


def read_scans(file):
    for line in pathlib.Path(file).read_text().splitlines():
        time_of, first, step, reach, *laser_and_ranges = map(float, line.split())
        yield Scan(time_of, first, step, reach, tuple(laser_and_ranges[:3]), laser_and_ranges[3:])


def message_of(scan):
    """(LaserScan of a laser that hangs upside down, where the first beam of a full circle is that of -pi; yaw of such a laser on
    the robot [rad])"""
    beams = len(scan.ranges)
    circle = 2 * math.ceil(math.pi / scan.step - 1e-3)  # [-] beams, as CBGL counts them
    first = -math.pi + round((circle - beams) / 2) * scan.step
    message = sensor_msgs.msg.LaserScan()
    message.header.frame_id = "laser"
    message.angle_min, message.angle_max, message.angle_increment = first, first + beams * scan.step, scan.step
    message.range_min, message.range_max = 0, scan.max_range
    message.ranges = [0 if math.isnan(reading) else min(reading, scan.max_range) for reading in reversed(scan.ranges)]  # 0: no data
    return message, scan.laser[2] + scan.first + (beams - 1) * scan.step + first


def still(parent, child, **rotation):
    transform = geometry_msgs.msg.TransformStamped()
    transform.header.frame_id, transform.child_frame_id = parent, child
    transform.transform.rotation = geometry_msgs.msg.Quaternion(**{"x": 0, "y": 0, "z": 0, "w": 0, **rotation})
    return transform


class Node:
    def __init__(self, map_message, launch_file):
        port = str(PORT.getsockname()[1])
        PORT.close()
        self.launched = subprocess.Popen(["roslaunch", "-p", port, launch_file], stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        subprocess.Popen(["grep", "-aE", "Pose found|No valid|particles|ERROR|died"], stdin=self.launched.stdout, stdout=sys.stderr)
        try:
            self.connect(map_message)
        except BaseException:
            self.end()
            raise

    def connect(self, map_message):
        master = rosgraph.Master("/driver")
        until(master.is_online)
        rospy.init_node("driver", disable_signals=True)
        self.answers = queue.Queue()
        self.latched = [rospy.Publisher("/map", nav_msgs.msg.OccupancyGrid, latch=True, queue_size=1),
                        rospy.Publisher("/tf_static", tf2_msgs.msg.TFMessage, latch=True, queue_size=1)]
        self.scans = rospy.Publisher("/scan", sensor_msgs.msg.LaserScan, queue_size=1)
        self.listener = rospy.Subscriber("/initialpose", geometry_msgs.msg.PoseWithCovarianceStamped, self.answers.put)
        self.latched[0].publish(map_message)
        self.latched[1].publish(tf2_msgs.msg.TFMessage([still("odom", "base_footprint", w=1), still("base_footprint", "laser", x=1)]))
        rospy.wait_for_service("/global_localization", PATIENCE)
        self.start = rospy.ServiceProxy("/global_localization", std_srvs.srv.Empty)
        until(lambda: self.scans.get_num_connections() and self.listener.get_num_connections())
        self.pid = xmlrpc.client.ServerProxy(master.lookupNode(NODE)).getPid("/driver")[2]

    def localize(self, message):
        self.start()
        self.scans.publish(message)
        until(lambda: self.processor_time() and not self.answers.empty())  # the former fails if the node has died
        return self.answers.get().pose.pose

    def processor_time(self):
        """[s]"""
        fields = pathlib.Path(f"/proc/{self.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def memory(self):
        """[MB] at its peak"""
        lines = pathlib.Path(f"/proc/{self.pid}/status").read_text().splitlines()
        return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))

    def end(self):
        self.launched.send_signal(signal.SIGINT)
        self.launched.wait(60)


def until(holds):
    end = time.monotonic() + PATIENCE
    while not holds():
        if time.monotonic() > end:
            raise SystemExit("cbgl: the node does not answer")
        time.sleep(0.05)


def robot_of(pose, scan, yaw_on_robot, x, y):
    """x, y, phi: m and rad"""
    q = pose.orientation
    phi = 2 * math.atan2(q.z, q.w) - yaw_on_robot
    shift = complex(*scan.laser[:2]) * complex(math.cos(phi), math.sin(phi))
    return pose.position.x + x - shift.real, pose.position.y + y - shift.imag, math.remainder(phi, 2 * math.pi)


def main():
    _, map_file, scan_file, out = sys.argv
    picture, launch = (pathlib.Path(out).resolve().with_suffix(end) for end in (".png", ".launch"))
    map_message, x, y = read_map(map_file, picture)
    launch.write_text(LAUNCH.format(node=NODE, picture=picture))
    scans = list(read_scans(scan_file))
    node = Node(map_message, launch)
    try:
        node.scans.publish(message_of(scans[0])[0])  # so that it learns where the laser is
        time.sleep(5)  # it has no other way to say that it has read the map
        preparation = node.processor_time()
        with open(out, "w", newline="") as stream:
            rows = csv.writer(stream)
            rows.writerow("timestamp,status,x,y,phi,confidence,total_ms".split(","))
            for scan in scans:
                message, yaw_on_robot = message_of(scan)
                before = node.processor_time()
                pose = robot_of(node.localize(message), scan, yaw_on_robot, x, y)
                spent = 1e3 * (node.processor_time() - before)
                rows.writerow([f"{scan.time:.6f}", "localized", *(f"{value:.6f}" for value in pose), 1, f"{spent:.3f}"])
        print(json.dumps({"preparation_s": preparation, "memory_mb": round(node.memory(), 1)}))
    finally:
        node.end()


if __name__ == "__main__":
    main()
