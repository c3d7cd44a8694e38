# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Runs write_terms on sets and reads what it wrote."""
import concurrent.futures
import csv
import hashlib
import math
import sys

import runs
from learning import sets


class Runner:
    """Results stay in a folder, and are found there for the same programs, scripts, parameters and set."""

    def __init__(self, build, folder, jobs):
        self.program = build / "experiments/write_terms"
        self.localize = build / "apps/rawlog-localize/rawlog-localize"
        for program in (self.program, self.localize):
            if not program.exists():
                raise RuntimeError(f"{program} is missing; build the project, tests included")
        self.maker = sets.Maker(build, folder)
        self.folder = self.maker.folder
        self.jobs = jobs
        self.digest = runs.digest_of_program(self.program, build).hex()

    def default_ini(self):
        """The text of the ini with all defaults."""
        file = self.folder / "default.ini"
        file.parent.mkdir(parents=True, exist_ok=True)
        sets.run([self.localize, "--write-config", file])
        return file.read_text()

    def make_all(self, all_sets):
        """Draws floors and makes the files of all sets."""
        with concurrent.futures.ProcessPoolExecutor(self.jobs) as pool:
            floors = sorted({floor for set_ in all_sets for floor in set_.floors})
            for number, _ in enumerate(pool.map(self.maker.draw, floors), 1):
                progress(f"floor {number} of {len(floors)}")
            for number, _ in enumerate(pool.map(self.maker.make, all_sets), 1):
                progress(f"set {number} of {len(all_sets)}")

    def run_all(self, all_sets, ini_of, with_terms, what):
        """[results folder by set]; \\p ini_of: the text of the ini file for a set."""
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            folders = []
            for number, folder in enumerate(pool.map(lambda s: self.run(s, ini_of(s), with_terms), all_sets), 1):
                folders.append(folder)
                progress(f"{what}: set {number} of {len(all_sets)}")
        return folders

    def run(self, set_, ini, with_terms):
        key = hashlib.sha256((self.digest + ini + str(with_terms) + repr(set_)).encode()).hexdigest()[:16]
        folder = self.folder / "runs" / f"{set_.name}-{key}"

        def write(part):
            (part / "config.ini").write_text(ini)
            files = self.maker.make(set_)
            terms = [part / "terms.csv.gz"] if with_terms else []
            sets.run([self.program, files.map, files.scans, files.truth or "none", part / "config.ini",
                      part / "frames.csv", *terms])

        sets.whole(folder, write)
        return folder


def progress(text):
    """One line of a terminal; elsewhere nothing."""
    if sys.stderr.isatty():
        print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)


def read_frames(folder):
    """[runs.Frame]"""
    with open(folder / "frames.csv", newline="") as stream:
        return [runs.Frame(row["status"], row["right"] == "1", float(row["confidence"]), None, None,
                           float(row["position_error"]), float(row["yaw_error"]), {"total": float(row["total_ms"])})
                for row in csv.DictReader(stream)]


def read_stages(folder):
    """{stage: share of the frames [%] in which the truth is among its poses}"""
    with open(folder / "frames.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    names = [name for name in (rows[0] if rows else ()) if name.startswith("in_")]
    return {name: 100 * sum(row[name] == "1" for row in rows) / len(rows) for name in names} if rows else {}


def percent(value):
    return "-" if math.isnan(value) else f"{value:.1f}"
