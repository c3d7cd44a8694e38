# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Runs the programs, reads what they found, and keeps it: a run that was interrupted goes on where it stopped."""
import concurrent.futures
import csv
import dataclasses
import hashlib
import json
import math
import os
import pathlib
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
    stamp: int = 0  # [ms] of the scan
    in_map: bool = True  # whether its place is in the map, as far as the site says so
    doubtful: bool = False  # whether the log contradicts the truth

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


@dataclasses.dataclass
class Answers:
    """Of a method to the scans of a set, and what the program took."""
    frames: list
    memory: float  # [MB] peak of the program
    preparation: float  # [s] of processor time before the first scan
    facts: dict  # of the scans, as alter_scans prints them
    log: str = ""  # what was run, and what it printed


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
        self.spent = threading.local()  # .seconds and .log of the job that a thread is at
        self.spent.seconds, self.spent.log = 0, ""
        self.digests = {}  # of the programs that jobs use, with their libraries
        self.common = b"".join(digest(file) for file in [*sorted(configs.glob("*.ini")), pathlib.Path(__file__)])

    def look_at_programs(self, jobs):
        self.check({name for job in jobs for name in job.uses})

    def check(self, names):
        """Ends the program if one of these is not built."""
        for name in sorted(names):
            program = pathlib.Path(self.programs.get(name, name))
            if not program.exists():
                sys.exit(f"{pathlib.Path(sys.argv[0]).name}: {program} is missing; build the project, tests included")
            self.digests[name] = digest_of_program(program, self.build)

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
            shutil.rmtree(self.folder / "indexes", ignore_errors=True)
        return results

    def run(self, job):
        """Runs a job, unless its result of the same programs and data is there."""
        file = self.store / f"{job.name}-{self.key(job)}.json"
        if file.exists():
            return from_plain(json.loads(file.read_text()))
        folder = self.folder / job.name
        folder.mkdir(parents=True, exist_ok=True)
        self.spent.seconds, self.spent.log = 0, ""
        value = job.run(self, folder)
        shutil.rmtree(folder)
        result = Result(value, self.spent.seconds, self.commit, machine())
        self.store.mkdir(parents=True, exist_ok=True)
        unfinished = file.with_suffix(".part")
        unfinished.write_text(json.dumps(to_plain(result)))
        unfinished.rename(file)
        return result

    def index_of(self, map_file, ini):
        """The file that keeps the index of a map for all runs with the same parameters."""
        folder = self.folder / "indexes"
        folder.mkdir(parents=True, exist_ok=True)
        return folder / hashlib.sha256(str(map_file.resolve()).encode() + digest(ini)).hexdigest()[:16]

    def key(self, job):
        """Differs if its programs, scripts or data, a setting or the job do."""
        script = pathlib.Path(sys.modules[type(job).__module__].__file__)
        programs = b"".join(self.digests[name] for name in job.uses)
        key = hashlib.sha256(self.common + digest(script) + programs + repr(job).encode())
        for file in job.site.files:
            key.update(f"{file.name} {file.stat().st_size} {file.stat().st_mtime_ns}".encode())
        return key.hexdigest()[:16]

    def call(self, program, *arguments):
        """Runs a program by its name here; what it prints."""
        words = [self.programs.get(program, program), *arguments]
        with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as errors:
            process = subprocess.Popen([str(word) for word in words], stdout=out, stderr=errors)
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            self.spent.seconds += usage.ru_utime + usage.ru_stime
            out.seek(0)
            errors.seek(0)
            self.spent.log += f"$ {' '.join(map(str, words))}\n{errors.read()}{out.read()}"
            out.seek(0)
            errors.seek(0)
            if process.returncode != 0:
                raise SystemExit(f"{pathlib.Path(sys.argv[0]).name}: {errors.read().strip() or words[0]}")
            return out.read()


def to_plain(value):
    """What JSON can hold: lists, numbers and texts; a list of the class's name and its fields for a dataclass."""
    if dataclasses.is_dataclass(value):
        return [type(value).__name__, *(to_plain(getattr(value, field.name)) for field in dataclasses.fields(value))]
    if isinstance(value, (list, tuple)):
        return ["list", *map(to_plain, value)]
    return value


def from_plain(value):
    """The inverse; tuples come back as lists. Nothing but results of this file is made of what lies on disk."""
    if not isinstance(value, list):
        return value
    kind, *fields = value[0], *map(from_plain, value[1:])
    return fields if kind == "list" else {"Frame": Frame, "Result": Result, "Answers": Answers}[kind](*fields)


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
    """Of the scans whose truth is known, and not contradicted by the log."""
    return [frame for _, frame in read_rows(file, job) if not frame.doubtful]


def read_rows(file, job):
    """[(row, Frame)] of the scans whose truth is known"""
    truth, knowledge = job.site.truth(job.scans), job.site.knowledge(job.scans)
    with open(file, newline="") as stream:
        rows = [(row, truth.at(float(row["timestamp"]))) for row in csv.DictReader(stream)]
    return [(row, read_frame(row, pose, job, knowledge)) for row, pose in rows if pose]


def read_frame(row, truth, job, knowledge):
    position_error = yaw_error = math.inf
    pose = None
    if row["x"]:
        pose = x, y, phi = tuple(float(row[name]) for name in ("x", "y", "phi"))
        position_error = math.hypot(x - truth[0], y - truth[1])
        yaw_error = math.degrees(abs((phi - truth[2] + math.pi) % (2 * math.pi) - math.pi))
    right = not job.map_site and position_error < job.position and yaw_error < 5
    times = {name[:-3]: float(value) for name, value in row.items() if name.endswith("_ms") and value}
    stamp = round(float(row["timestamp"]) * 1000)
    in_map, doubtful = next((knowledge[near] for near in (stamp, stamp - 1, stamp + 1) if near in knowledge), (True, False))
    return Frame(row["status"], right, float(row.get("confidence") or 0), truth, pose, position_error, yaw_error, times, stamp,
                 in_map, doubtful)
