#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Lets d2s1r-live-ros1 find a robot that drives through the office of share/d2s1r/data: test_ros1.py PROGRAM PROJECT

A bag that this writes is played in a loop with simulated time, which so runs back; rostopic reads poses and seeds. Each must be right.
"""
import csv
import math
import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import time

LOOPS, FASTER = 3, 8
WITHIN, TURN = 0.1, math.radians(3)  # [m], [rad] of a right pose


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def write_bag(folder, drawn):
    """Returns the truth: (x, y, phi) [m, rad] by time [ns]."""
    import rosbag
    import rospy
    from geometry_msgs.msg import TransformStamped
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import LaserScan
    from tf2_msgs.msg import TFMessage
    random, odom, truth, poses = drawn.np.random.default_rng(1), drawn.np.zeros(3), {}, drawn.path()
    with rosbag.Bag(str(folder / "drive.bag"), "w") as bag:
        for i, pose in enumerate(poses):
            stamp = drawn.START + round(i * drawn.STEP / drawn.SPEED * 1e9)
            now = rospy.Time(*divmod(stamp, 10**9))
            odom = drawn.moved(odom, drawn.motion_between(poses[i - 1], pose) * random.normal(1.01, 0.02, 3)) if i else odom
            turn = (math.sin(odom[2] / 2), math.cos(odom[2] / 2))
            transform = TransformStamped(child_frame_id="base_link")
            transform.header.stamp, transform.header.frame_id = now, "odom"
            transform.transform.translation.x, transform.transform.translation.y = odom[:2]
            transform.transform.rotation.z, transform.transform.rotation.w = turn
            message = Odometry(header=transform.header, child_frame_id="base_link")
            message.pose.pose.position.x, message.pose.pose.position.y = odom[:2]
            message.pose.pose.orientation.z, message.pose.pose.orientation.w = turn
            half = drawn.FIELD_OF_VIEW / 2
            scan = LaserScan(angle_min=-half, angle_max=half, angle_increment=2 * half / (drawn.BEAMS - 1), range_min=0.05,
                             range_max=drawn.MAX_RANGE)
            scan.header.stamp, scan.header.frame_id = now, "laser"
            scan.ranges = drawn.ranges(drawn.segments(), None, drawn.moved(pose, drawn.LASER), random).tolist()
            for topic, one in (("/tf", TFMessage([transform])), ("/odom", message), ("/scan", scan)):
                bag.write(topic, one, now)
            truth[stamp] = pose
    return truth


def publish_map(folder, drawn):
    """Publishes the office, latched, until this program ends."""
    import rospy
    from nav_msgs.msg import OccupancyGrid
    from PIL import Image
    drawn.write_map(folder, drawn.segments())
    grey = drawn.np.asarray(Image.open(folder / "office.png"))[::-1]
    grid = OccupancyGrid()
    grid.header.frame_id = "map"
    grid.info.resolution, grid.info.height, grid.info.width = drawn.CELL, *grey.shape
    grid.info.origin.position.x = grid.info.origin.position.y = -drawn.MARGIN
    grid.info.origin.orientation.w = 1
    grid.data = drawn.np.where(grey == 0, 100, drawn.np.where(grey == 254, 0, -1)).astype(int).ravel().tolist()
    publisher = rospy.Publisher("/map", OccupancyGrid, latch=True, queue_size=1)
    publisher.publish(grid)
    return publisher


def publish_laser(drawn):
    """Publishes where the laser is on the robot, latched, until this program ends."""
    import rospy
    from geometry_msgs.msg import TransformStamped
    from tf2_msgs.msg import TFMessage
    transform = TransformStamped(child_frame_id="laser")
    transform.header.frame_id = "base_link"
    transform.transform.translation.x, transform.transform.translation.y, yaw = drawn.LASER
    transform.transform.rotation.z, transform.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    publisher = rospy.Publisher("/tf_static", TFMessage, latch=True, queue_size=1)
    publisher.publish(TFMessage([transform]))
    return publisher


def check(file, truth):
    """Returns (right, all, distinct stamps) of the poses that rostopic wrote."""
    right, stamps = [], set()
    with open(file, newline="") as stream:
        for row in csv.DictReader(stream):
            stamp = int(row["field.header.stamp"])
            pose = truth[stamp]
            turn = 2 * math.atan2(*(float(row[f"field.pose.pose.orientation.{axis}"]) for axis in "zw"))
            off = math.hypot(*(float(row[f"field.pose.pose.position.{axis}"]) - pose[i] for i, axis in enumerate("xy")))
            right.append(off < WITHIN and abs(math.remainder(turn - pose[2], 2 * math.pi)) < TURN)
            stamps.add(stamp)
    return sum(right), len(right), len(stamps)


def run(program, project, folder, started):
    sys.path.insert(0, str(project / "experiments"))
    import sample_data as drawn
    port = free_port()
    os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1", ROS_HOME=str(folder),
                      ROS_LOG_DIR=str(folder))

    def start(*command, out="log"):
        with open(folder / out, "a") as stream, open(folder / "log", "a") as errors:
            process = subprocess.Popen(list(map(str, command)), stdout=stream, stderr=errors, start_new_session=True)
        started.append(process)
        return process

    start("roscore", "-p", port)
    import rospy
    while subprocess.run(["rostopic", "list"], capture_output=True, check=False).returncode != 0:
        time.sleep(0.2)
    rospy.set_param("/use_sim_time", True)
    rospy.set_param("/d2s1r_live/seed", "watch")
    truth = write_bag(folder, drawn)
    rospy.init_node("peer", disable_signals=True, log_level=rospy.ERROR)
    _latched = publish_map(folder, drawn)
    _latched_too = publish_laser(drawn)
    live = start(program, out="live.log")
    start("rostopic", "echo", "-p", "/d2s1r/pose", out="poses.csv")
    start("rostopic", "echo", "-p", "/initialpose", out="seeds.csv")
    start("rostopic", "pub", "-r", "0.2", "/d2s1r/localize", "std_msgs/Empty")  # asks for seeds
    time.sleep(3)  # until all know each other
    start("rosbag", "play", "--quiet", "--clock", "-l", "-r", FASTER, folder / "drive.bag")
    loop = len(truth) * drawn.STEP / drawn.SPEED / FASTER  # [s]
    time.sleep((LOOPS + 0.5) * loop)
    live.send_signal(signal.SIGINT)
    live.wait(10)
    time.sleep(1)
    results = {name: check(folder / f"{name}.csv", truth) for name in ("poses", "seeds")}
    for name, (right, count, stamps) in results.items():
        print(f"{name}: {right} of {count} right, at {stamps} of {len(truth)} places of the drive")
    print("d2s1r-live-ros1 said:\n" + (folder / "live.log").read_text())
    assert live.returncode == 0, live.returncode
    right, count, _ = results["poses"]
    assert right == count and count >= 0.9 * LOOPS * len(truth), "a pose is wrong, or too few came"
    right, count, _ = results["seeds"]
    assert right == count >= LOOPS, "a seed is wrong, or none came in a loop"


def main():
    program, project = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    started = []
    with tempfile.TemporaryDirectory() as folder:
        try:
            run(program, project, pathlib.Path(folder), started)
        finally:
            for process in reversed(started):
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGINT)
            time.sleep(1)
            for process in started:
                try:
                    os.killpg(process.pid, signal.SIGKILL)
                except ProcessLookupError:
                    pass


if __name__ == "__main__":
    main()
