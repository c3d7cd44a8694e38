#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Runs nav2's own amcl, map_server and lifecycle_manager beside d2s1r-live: nav2.py BUILD PREFIX MAP.yaml FOLDER [RUN]...

PREFIX is where nav2 of ROS 2 is installed, such as /opt/ros/humble; without its amcl a line says so, and nothing runs.
FOLDER gets what each program said, and a row for each scan: where the robot was, and where map -> odom said that it was.
The pose is right within 0.3 m and 10 deg. The robot is simulated by d2s1r-live-drive, the middleware is that of
RMW_IMPLEMENTATION, and all programs keep to this machine. The runs (default: all):

start      ten robots, each with programs that have just been started
kidnap     a robot that is carried away ten times, with amcl and with `d2s1r-live --track`
respawn    amcl is killed ten times and is back after 2 s, and ten times after 6 s, which Humble's lifecycle_manager
           waits for without an end: each amcl of these has a manager of its own
global     /reinitialize_global_localization is called ten times (needs `ros2 service call`)
alone      the same without d2s1r-live
drive      amcl, seeded by d2s1r-live, and `d2s1r-live --track` follow the same way: errors and processor time
"""
import contextlib
import csv
import math
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

RIGHT, RIGHT_TURN = 0.3, 10  # [m], [deg]
DOMAIN = os.environ.get("ROS_DOMAIN_ID", "98")
TIMES = 10  # of each trouble
START_UP = 10  # [s] of a drive that do not count
LASERS = {"10 Hz, 360 beams": (10, 360), "40 Hz, 1,081 beams": (40, 1081)}


def processor_time(process_id):
    """Returns what a process has taken so far [s]."""
    fields = pathlib.Path(f"/proc/{process_id}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def child_of(process_id):
    return int(pathlib.Path(f"/proc/{process_id}/task/{process_id}/children").read_text().split()[0])


class Row:
    """Where the robot was at a scan, and how far off map -> odom was."""

    def __init__(self, row):
        self.time = float(row["time"])
        self.event = (int(row["kidnappings"]), int(row["starts_of_tracker"]))
        self.off = self.turn = math.inf  # [m], [deg]
        if row["told_x"]:
            self.off = math.hypot(float(row["told_x"]) - float(row["x"]), float(row["told_y"]) - float(row["y"]))
            self.turn = abs(math.remainder(float(row["told_yaw_deg"]) - float(row["yaw_deg"]), 360))
        self.is_right = self.off <= RIGHT and self.turn <= RIGHT_TURN


def seconds_until_right(rows, event):
    """Returns the time [s] from an event to the first of ten right scans in a row; infinity if there are none."""
    rows = [row for row in rows if row.time >= event]
    for i in range(len(rows) - 9):
        if all(row.is_right for row in rows[i:i + 10]):
            return max(rows[i].time - event, 0)
    return math.inf


def until_next(rows, times):
    """Returns for each time what seconds_until_right() says of the rows until the next one."""
    ends = list(times[1:]) + [math.inf]
    return [seconds_until_right([row for row in rows if row.time < end], begin) for begin, end in zip(times, ends)]


def told(name, seconds):
    came = sorted(one for one in seconds if one < math.inf)
    text = f"median {came[len(came) // 2]:.1f} s, {came[0]:.1f} to {came[-1]:.1f} s" if came else "-"
    print(f"{name}: right {len(came)} of {len(seconds)} times, {text}", flush=True)


class Robot:
    """A simulated robot, and the programs that run on it."""

    def __init__(self, arguments, name):
        self.build, self.prefix, self.map, self.folder = arguments
        self.name, self.started = name, []
        lib = self.prefix / "lib"
        self.environment = dict(
            os.environ, ROS_DOMAIN_ID=DOMAIN, ROS_LOCALHOST_ONLY="1", AMENT_PREFIX_PATH=str(self.prefix),
            LD_LIBRARY_PATH=f"{lib}:{os.environ.get('LD_LIBRARY_PATH', '')}",
            PATH=f"{self.prefix / 'bin'}:{os.environ['PATH']}")

    def start(self, name, *command):
        with open(self.folder / f"{self.name}.{name}.log", "w", encoding="utf-8") as log:
            process = subprocess.Popen(list(map(str, command)), env=self.environment, stdout=log, stderr=log,
                                       start_new_session=True)
        self.started.append(process)
        return process

    def start_map_server(self, managed):
        self.start("map_server", self.prefix / "lib/nav2_map_server/map_server", "--ros-args", "-p",
                   f"yaml_filename:={self.map}")
        self.start_manager("localization", managed)

    def start_manager(self, name, managed, *options):
        return self.start(f"manager_{name}", self.prefix / "lib/nav2_lifecycle_manager/lifecycle_manager", "--ros-args", "-r",
                          f"__node:=lifecycle_manager_{name}", "-p", "autostart:=true", "-p", f"node_names:=[{managed}]",
                          *options)

    def start_live(self, *options):
        return self.start("live", self.build / "apps/d2s1r-live/d2s1r-live", *options)

    def start_localization(self, is_amcl, seed):
        """Starts a map_server and d2s1r-live, which seeds an amcl that is to come, or tracks. Returns d2s1r-live."""
        self.start_map_server("map_server,amcl" if is_amcl else "map_server")
        return self.start_live(*(("--seed", seed) if is_amcl else ("--track",)))

    def start_drive(self, seconds, *options, with_amcl=True):
        always = ("--no-map", "--log", self.folder / f"{self.name}.csv", *(() if "--kidnap" in options else ("--kidnap", 0)))
        amcl = f"{self.prefix / 'lib/nav2_amcl/amcl'} --ros-args -p base_frame_id:=base_link"
        tracker = amcl if with_amcl else "sleep infinity"
        return self.start("drive", self.build / "apps/d2s1r-live-drive/d2s1r-live-drive", self.map, seconds,
                          "--tracker", tracker, *always, *options)

    def rows(self):
        with open(self.folder / f"{self.name}.csv", newline="", encoding="utf-8") as stream:
            return [Row(row) for row in csv.DictReader(stream)]

    def seeds(self):
        return (self.folder / f"{self.name}.live.log").read_text(encoding="utf-8").count("told the tracker:")

    def amcl_said(self, words):
        """Returns when amcl said so [s since 1970]."""
        log = (self.folder / f"{self.name}.drive.log").read_text(encoding="utf-8")
        return [float(time) for time in re.findall(rf"\[(\d+\.\d+)\] \[amcl\]: {words}", log)]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for sent in (signal.SIGINT, signal.SIGKILL):
            for process in reversed(self.started):
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, sent)
            time.sleep(1)
        for process in self.started:
            process.wait()


def events_of(rows, which):
    """Returns when a count of the rows grew, from its first value on."""
    return [row.time for before, row in zip(rows, rows[1:]) if row.event[which] > before.event[which]]


def run_start(arguments):
    seconds, active = [], []
    for seed in range(1, TIMES + 1):
        with Robot(arguments, f"start{seed}") as robot:
            begin = time.time()
            robot.start_localization(True, "watch")
            robot.start_drive(25, "--seed", seed).wait()
            rows = robot.rows()
            seconds.append(seconds_until_right(rows, begin))
            active.append(seconds_until_right(rows, robot.amcl_said("Activating")[0]))
    told("start, since all programs were started", seconds)
    told("start, since amcl was active", active)


def judge(name, robot, events):
    """Says how long it took from each event until amcl was right, and how often it was."""
    rows = robot.rows()
    told(name, until_next(rows, events(rows)))
    share = sum(row.is_right for row in rows) / len(rows)
    print(f"  {robot.seeds()} seeds; right at {100 * share:.1f} % of {len(rows)} scans", flush=True)


def run_kidnap(arguments, between=25):
    for name, is_amcl in (("kidnap", True), ("kidnap, d2s1r-live --track", False)):
        with Robot(arguments, name) as robot:
            robot.start_localization(is_amcl, "watch")
            robot.start_drive(between * (TIMES + 1) - 1, "--kidnap", between, with_amcl=is_amcl).wait()
            judge(name, robot, lambda rows: events_of(rows, 0))


def manage_anew(robot, drive):
    """Gives each amcl a manager of its own until the drive ends."""
    manager, child = None, None
    while drive.poll() is None:
        with contextlib.suppress(OSError, IndexError):
            if child != child_of(drive.pid):
                child = child_of(drive.pid)
                if manager:
                    manager.kill()
                manager = robot.start_manager("amcl", "amcl", "-p", "bond_timeout:=0.0")
        time.sleep(0.05)


def run_respawn(arguments):
    for back in (2, 6):
        name, between = f"respawn{back}", 25 + back
        with Robot(arguments, name) as robot:
            robot.start_map_server("map_server,amcl" if back == 2 else "map_server")
            robot.start_live("--seed", "watch")
            drive = robot.start_drive(between * (TIMES + 1) - 1, "--crash", between, "--return", back)
            if back == 6:
                manage_anew(robot, drive)
            drive.wait()
            judge(f"{name}, since the process was back", robot, lambda rows: events_of(rows, 1))
            judge(f"{name}, since amcl was active", robot, lambda rows, one=robot: one.amcl_said("Activating")[1:])


def run_global(arguments, name="global", with_live=True):
    with Robot(arguments, name) as robot:
        robot.start_map_server("map_server,amcl")
        if with_live:
            robot.start_live("--seed", "watch")
        drive = robot.start_drive(100_000)
        for _ in range(TIMES):
            time.sleep(20)
            subprocess.run(["ros2", "service", "call", "/reinitialize_global_localization", "std_srvs/srv/Empty"],
                           env=robot.environment, check=True, stdout=subprocess.DEVNULL, timeout=30)
        time.sleep(20)
        drive.send_signal(signal.SIGKILL)
        told(name, until_next(robot.rows(), robot.amcl_said("Initializing with uniform")))


def run_alone(arguments):
    run_global(arguments, "alone", with_live=False)


def follow(arguments, name, laser, is_amcl):
    rate, beams = laser
    seconds = 120
    with Robot(arguments, name) as robot:
        live = robot.start_localization(is_amcl, "once")
        drive = robot.start_drive(seconds, "--scan-rate", rate, "--beams", beams, "--clutter", 10, "--odom-error", 0.05,
                                  with_amcl=is_amcl)
        time.sleep(START_UP)
        judged = child_of(drive.pid) if is_amcl else live.pid
        began, before = time.monotonic(), processor_time(judged)
        time.sleep(seconds - START_UP - 2)
        share = 100 * (processor_time(judged) - before) / (time.monotonic() - began)
        drive.wait()
        rows = robot.rows()
    rows = [row for row in rows if row.time >= rows[0].time + START_UP]
    right = 100 * sum(row.is_right for row in rows) / len(rows)
    off, turn = sorted(row.off for row in rows), sorted(row.turn for row in rows)
    middle, most = len(rows) // 2, len(rows) * 95 // 100
    print(f"{name}: right {right:.1f} % of {len(rows)} scans; median {off[middle]:.3f} m, {turn[middle]:.2f} deg; 95 % "
          f"{off[most]:.3f} m, {turn[most]:.2f} deg; {share:.1f} % of a core", flush=True)


def run_drive(arguments):
    for name, laser in LASERS.items():
        for is_amcl in (True, False):
            follow(arguments, f"{'amcl' if is_amcl else 'd2s1r-live --track'}, {name}", laser, is_amcl)


RUNS = {"start": run_start, "kidnap": run_kidnap, "respawn": run_respawn, "global": run_global, "alone": run_alone,
        "drive": run_drive}


def main():
    if len(sys.argv) < 5 or any(name not in RUNS for name in sys.argv[5:]):
        sys.exit(__doc__)
    build, prefix, site_map, folder = map(lambda word: pathlib.Path(word).resolve(), sys.argv[1:5])
    if not (prefix / "lib/nav2_amcl/amcl").exists():
        print(f"{prefix}: has no lib/nav2_amcl/amcl; nothing was run")
        return
    folder.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[5:] or RUNS:
        RUNS[name]((build, prefix, site_map, folder))


if __name__ == "__main__":
    main()
