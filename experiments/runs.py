# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Runs the programs, reads what they found, and keeps it: a run that was interrupted goes on where it stopped."""
import concurrent.futures
import csv
import dataclasses
import hashlib
import math
import os
import pathlib
import pickle
import shutil
import subprocess
import sys
import tempfile
import threading

HERE = pathlib.Path(__file__).resolve().parent


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

    def is_within(self, position, yaw):
        """[m], [deg]"""
        return self.position_error < position and self.yaw_error < yaw


@dataclasses.dataclass
class Result:
    """What came of a job, and where it was measured."""
    value: object  # what the job's run() returns
    seconds: float  # [s] of processor time of all its programs
    commit: str
    machine: str


class Runner:
    def __init__(self, build, configs, folder, store):
        experiments = build / "experiments"
        self.programs = {
            "localize": build / "apps/rawlog-localize/rawlog-localize",
            "plugin": build / "apps/rawlog-localize/libd2s1r-pf-init.so",
            "alter": experiments / "alter_scans",
            "circles": experiments / "simulate_circles",
            "rivals": experiments / "rivals",
            "benchmark": build / "tests/benchmark/d2s1r_benchmark",
        }
        self.build = build
        self.configs = configs
        self.folder = folder
        self.store = store
        self.commit = commit()
        self.spent = threading.local()  # .seconds of the job that a thread is at
        self.digests = {}  # of the programs that jobs use, with their libraries
        self.common = b"".join(digest(file) for file in [*sorted(configs.glob("*.ini")), pathlib.Path(__file__)])

    def look_at_programs(self, jobs):
        for name in sorted({name for job in jobs for name in job.uses}):
            if not self.programs[name].exists():
                sys.exit(f"reproduce.py: {self.programs[name]} is missing; build the project, tests included")
            self.digests[name] = digest_of_program(self.programs[name], self.build)

    def version(self):
        return subprocess.run([self.programs["localize"], "--version"], capture_output=True, text=True, check=True).stdout.strip()

    def run_all(self, jobs, at_a_time):
        """{job: Result}; what programs write is deleted, it would fill gigabytes."""
        self.look_at_programs(jobs)
        results = {}
        pool = concurrent.futures.ThreadPoolExecutor(at_a_time)
        try:
            for job, result in zip(jobs, pool.map(self.run, jobs)):
                results[job] = result
                print(f"{len(results)}/{len(jobs)} {job.name}", file=sys.stderr, flush=True)
        finally:
            pool.shutdown(cancel_futures=True)
        return results

    def run(self, job):
        """Runs a job, unless its result of the same programs and data is there."""
        file = self.store / f"{job.name}-{self.key(job)}.pickle"
        if file.exists():
            return pickle.loads(file.read_bytes())
        folder = self.folder / job.name
        folder.mkdir(parents=True, exist_ok=True)
        self.spent.seconds = 0
        value = job.run(self, folder)
        shutil.rmtree(folder)
        result = Result(value, self.spent.seconds, self.commit, machine())
        self.store.mkdir(parents=True, exist_ok=True)
        unfinished = file.with_suffix(".part")
        unfinished.write_bytes(pickle.dumps(result))
        unfinished.rename(file)
        return result

    def key(self, job):
        """Differs if its programs, scripts or data, a setting or the job do."""
        script = pathlib.Path(sys.modules[type(job).__module__].__file__)
        programs = b"".join(self.digests[name] for name in job.uses)
        key = hashlib.sha256(self.common + digest(script) + programs + repr(job).encode())
        for file in sorted(job.site.folder.iterdir()):
            key.update(f"{file.name} {file.stat().st_size} {file.stat().st_mtime_ns}".encode())
        return key.hexdigest()[:16]

    def call(self, program, *arguments):
        """Runs a program by its name here; what it prints."""
        words = [self.programs[program], *arguments]
        with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as errors:
            process = subprocess.Popen([str(word) for word in words], stdout=out, stderr=errors)
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            self.spent.seconds += usage.ru_utime + usage.ru_stime
            out.seek(0)
            errors.seek(0)
            if process.returncode != 0:
                raise SystemExit(f"reproduce.py: {errors.read().strip() or words[0]}")
            return out.read()


def digest(file):
    return hashlib.sha256(file.read_bytes()).digest()


def digest_of_program(program, build):
    """Of a program or plugin with all libraries that it loads from the build folder."""
    told = subprocess.run(["ldd", program], capture_output=True, text=True).stdout  # of one without libraries: nothing
    loaded = [pathlib.Path(word).resolve() for word in told.split() if word.startswith("/")]
    libraries = sorted({file for file in loaded if build.resolve() in file.parents})
    return hashlib.sha256(b"".join(digest(file) for file in [program, *libraries])).digest()


def commit():
    """Of the sources, with `-dirty` if they were changed since."""
    words = ["git", "-C", str(HERE), "describe", "--always", "--dirty"]
    try:
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def machine():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return f"{line.split(':', 1)[1].strip()}, {os.cpu_count()} cores"
    return "an unknown machine"


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
    right = not job.map_site and position_error < job.position and yaw_error < 5
    times = {name[:-3]: float(value) for name, value in row.items() if name.endswith("_ms") and value}
    return Frame(row["status"], right, float(row.get("confidence") or 0), truth, pose, position_error, yaw_error, times)
