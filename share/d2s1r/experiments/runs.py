# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Runs rawlog-localize and reads what it found."""
import concurrent.futures
import csv
import dataclasses
import math
import os
import shutil
import subprocess
import sys
import tempfile

import plan
import rivals


@dataclasses.dataclass
class Frame:
    """A localized scan beside the truth."""
    status: str
    right: bool
    confidence: float  # [0, 1], 0 if there is no pose
    truth: tuple  # x, y, phi: m and rad, robot in map
    pose: tuple  # the answer, the same; None if there is none
    position_error: float  # [m], inf if there is no pose
    yaw_error: float  # [deg]
    times: dict  # [ms] by stage


class Runner:
    def __init__(self, build, configs, folder):
        self.localize = build / "apps/rawlog-localize/rawlog-localize"
        self.alter = build / "tests/experiments/alter_scans"
        self.rivals = build / "tests/experiments/rivals"
        self.configs = configs
        self.folder = folder
        for program in (self.localize, self.alter, self.rivals):
            if not program.exists():
                sys.exit(f"reproduce.py: {program} is missing; build the project, tests included")

    def version(self):
        return subprocess.run([self.localize, "--version"], capture_output=True, text=True, check=True).stdout.strip()

    def run_all(self, jobs, at_a_time):
        """{job: frames}; what a run writes is deleted, it would fill gigabytes."""
        results = {}
        with concurrent.futures.ThreadPoolExecutor(at_a_time) as pool:
            for job, frames in zip(jobs, pool.map(self.run, jobs)):
                results[job] = frames
                print(f"{len(results)}/{len(jobs)} {job.name}", file=sys.stderr)
        return results

    def run(self, job):
        """[Frame] of a plan.Job; what rivals.run() returns of the others."""
        if not isinstance(job, plan.Job):
            return rivals.run(self, job)
        folder = self.folder / job.name
        folder.mkdir(parents=True, exist_ok=True)
        rawlog = job.site.folder / f"{job.scans}.rawlog"
        more = ["--frames", f":{job.frames}", "--window", str(job.window)]
        if not job.window:
            altered = folder / "in.rawlog"
            reach = job.reach if job.reach < plan.USUAL["reach"] else math.inf
            call([self.alter, rawlog, altered, f"frames={job.frames}", f"field_of_view={job.field_of_view}",
                  f"blocked={job.blocked}", f"reach={reach}"])
            rawlog, more = altered, []
        call([self.localize, "-q", "-m", job.map, "-i", rawlog, "-o", folder, "-c", self.configs / f"{job.config}.ini",
              *more])
        frames = read_frames(folder / "frames.csv", job)
        shutil.rmtree(folder)
        return frames


def call(words):
    """Runs a program; its resources, of which ru_maxrss is the peak of memory [kB]."""
    with tempfile.TemporaryFile("w+") as errors:
        process = subprocess.Popen([str(word) for word in words], stdout=subprocess.DEVNULL, stderr=errors)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        errors.seek(0)
        if process.returncode != 0:
            sys.exit(f"reproduce.py: {errors.read().strip() or words[0]}")
    return usage


def read_frames(file, job):
    return [frame for _, frame in read_rows(file, job)]


def read_rows(file, job):
    """[(row, Frame)]"""
    truth = job.site.truth(job.scans)
    with open(file, newline="") as stream:
        return [(row, read_frame(row, truth_at(truth, float(row["timestamp"])), job)) for row in csv.DictReader(stream)]


def truth_at(truth, stamp):
    key = round(stamp * 1000)
    return next(truth[near] for near in (key, key - 1, key + 1) if near in truth)


def read_frame(row, truth, job):
    position_error = yaw_error = math.inf
    pose = None
    if row["x"]:
        pose = x, y, phi = tuple(float(row[name]) for name in ("x", "y", "phi"))
        position_error = math.hypot(x - truth[0], y - truth[1])
        yaw_error = math.degrees(abs((phi - truth[2] + math.pi) % (2 * math.pi) - math.pi))
    right = job.map_site is None and position_error < job.position and yaw_error < 5
    times = {name[:-3]: float(value) for name, value in row.items() if name.endswith("_ms")}
    return Frame(row["status"], right, float(row["confidence"] or 0), truth, pose, position_error, yaw_error, times)
