#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Runs rawlog-localize on damaged files: mutated_inputs.py PROGRAM SECONDS [--seed N] [--jobs N] [--files FOLDER]

Each run damages one input (a log, a map, a truth, a configuration or an index) and takes some of the options that read.
PROGRAM is that of a build with sanitizers. The files are those of share/d2s1r/data and of tests/fuzz/corpus, and those of
FOLDER. A run is a finding if a sanitizer reports something, the program ends by a signal, needs more than 300 s, has another
exit status than 0 to 3, or says anything but nothing (0) or one line (1 to 3). What a finding needs is kept in
build/mutated/. At the end comes the row for tests/fuzz/RESULTS.md.
"""
import argparse
import collections
import concurrent.futures
import os
import pathlib
import random
import re
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time

PROJECT = pathlib.Path(__file__).resolve().parents[2]
OFFICE = PROJECT / "share/d2s1r/data"
CORPUS = PROJECT / "tests/fuzz/corpus"
KEPT = PROJECT / "build/mutated"
TIME_LIMIT = 300  # [s] of one run, with sanitizers and beside other programs
REPORT = re.compile(r"AddressSanitizer|LeakSanitizer|runtime error|defect")
ENVIRONMENT = dict(os.environ, LSAN_OPTIONS=f"suppressions={PROJECT / 'tests/lsan.supp'}:print_suppressions=0")
NUMBERS = (b"nan", b"inf", b"-1", b"0", b"1e308", b"1e-308", b"99999999999999999999", b"", b"0x10", b"~", b"[", b"{", b"'")
OPTIONS = (
    ["--window", "5"], ["--fuse"], ["--fuse", "--motion", "odometry"], ["--merge-lasers"], ["--diagnose"], ["--stream"],
    ["--cloud-height", "0:2"], ["--sweep-time", "0.1"], ["--beam-angles=-90,90"], ["--range-factor", "0.001"],
    ["--sensor-pose=0.1,0,0,0,0,180"], ["--region=-5,-5,5,5"], ["--time-budget", "1"], ["--max-range", "10"],
    ["--ground-truth", "tf:map"], ["--ground-truth", "topic:/pose"], ["--check", "topic:/amcl_pose"], ["--check", "tf:map"],
    ["--save-map", "OUT/saved.signaturemap"], ["--write-pf-ini", "OUT/pf.ini"], ["--index", "OUT/map.idx"],
    ["--write-config", "OUT/all.ini"], ["--resolution", "0.05"], ["--threads", "2"])


def damaged_bytes(data, chance):
    """Changes one to four places of a file."""
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(min(len(data), chance.choice((64, 400, len(data)))) or 1)
        kind = chance.randrange(6)
        if kind == 0:
            data = data[:at] + bytes([chance.randrange(256)]) + data[at + 1:]
        elif kind == 1:
            data = data[:at] + chance.choice((b"\xff\xff\xff\x7f", b"\xff" * 8, b"\0" * 8, b"\0\0\0\x80")) + data[at + 4:]
        elif kind == 2:
            data = data[:at] + data[at + chance.randint(1, 64):]
        elif kind == 3:
            data = data[:at] + data[at:at + 64] * chance.randint(2, 50) + data[at + 64:]
        elif kind == 4:
            other = chance.randrange(len(data) or 1)
            data = data[:at] + data[other:other + 200] + data[at + 200:]
        elif chance.randrange(3) == 0:
            data = data[:at]
    return data


def damaged_text(data, chance):
    """Replaces numbers and words, and repeats or drops lines."""
    for _ in range(chance.randint(1, 4)):
        words = list(re.finditer(rb"[^\s,:\[\]=]+", data))
        lines = data.split(b"\n")
        if chance.randrange(4) == 0:
            at = chance.randrange(len(lines))
            lines[at:at + 1] = [lines[at]] * chance.choice((0, 2, 1000))
            data = b"\n".join(lines)
        elif words:
            word = chance.choice(words)
            data = data[:word.start()] + chance.choice((*NUMBERS, chance.choice(words).group())) + data[word.end():]
    return data


def damage_messages(file, chance):
    """Damages messages inside a ROS 2 bag of sqlite3."""
    with sqlite3.connect(file) as bag:
        rows = bag.execute("select id, data from messages").fetchall()
        for number, data in chance.sample(rows, min(len(rows), chance.randint(1, 20))):
            bag.execute("update messages set data = ? where id = ?", (damaged_bytes(bytes(data), chance), number))


def damage(path, chance):
    """Damages a file, or one of those in a folder."""
    file = path if path.is_file() else chance.choice(sorted(file for file in path.rglob("*") if file.is_file()))
    data = file.read_bytes()
    is_own = file.name in ("office_bag_0.db3", "db3")  # columns of others may compute for ever
    if data.startswith(b"SQLite format 3") and is_own and chance.randrange(4) > 0:
        try:
            damage_messages(file, chance)
            return
        except sqlite3.Error:
            pass
    is_text = b"\0" not in data[:1000]
    file.write_bytes(damaged_text(data, chance) if is_text and chance.randrange(3) else damaged_bytes(data, chance))


def inputs(folder):
    """{kind: files and folders}"""
    found = {
        "log": [OFFICE / "office.rawlog", OFFICE / "office_bag", *(CORPUS / "log").iterdir(), *(CORPUS / "rawlog").iterdir()],
        "map": [OFFICE / "office.yaml", OFFICE / "office.png", *(CORPUS / "map_file").iterdir(), *(CORPUS / "image").iterdir()],
        "truth": [OFFICE / "office_truth.txt", *(CORPUS / "ground_truth").iterdir()],
        "config": [PROJECT / "share/d2s1r/config" / name for name in ("default.ini", "paper.ini")],
        "index": []}
    if folder:
        found["log"] += [path for path in folder.rglob("*") if path.suffix in (".bag", ".mcap", ".db3", ".rawlog", ".log", ".clf")]
        found["map"] += [path for path in folder.rglob("*") if path.suffix in (".yaml", ".pgm", ".png")]
    return {kind: [path for path in paths if path.exists()] for kind, paths in found.items()}


def copied(path, folder):
    """Copies an input, a map with its image."""
    shutil.copytree(path, folder / path.name) if path.is_dir() else shutil.copy(path, folder / path.name)
    for image in path.parent.glob("*.p[gn][mg]") if path.suffix == ".yaml" else ():
        shutil.copy(image, folder / image.name)
    return folder / path.name


def one_run(program, found, seed):
    """Returns (kind of the damaged input, exit status, finding or None) of a run."""
    chance = random.Random(seed)
    kind = chance.choices(list(found), weights=(6, 4, 1, 1, 1))[0]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "out").mkdir()
        used = {"log": OFFICE / "office.rawlog", "map": OFFICE / "office.yaml"}
        if kind != "index":
            used[kind] = chance.choice(found[kind])
        used = {each: copied(path, folder) for each, path in used.items()}
        words = [str(program), "-q", "-m", str(used["map"]), "-i", str(used["log"]), "--frames", "0:12:3"]
        options = [word.replace("OUT", str(folder / "out")) for option in chance.sample(OPTIONS, chance.randint(0, 3))
                   for word in option]
        if kind == "index":
            options = ["--index", str(folder / "map.idx")]
            subprocess.run([*words, *options, "-o", folder / "out"], capture_output=True, check=False, env=ENVIRONMENT)
            used["index"] = folder / "map.idx"
        options += ["--ground-truth", str(used["truth"])] if kind == "truth" else []
        options += ["-c", str(used["config"])] if kind == "config" else []
        options += [] if {"--stream", "--diagnose"} & set(options) else ["-o", str(folder / "out")]
        if chance.randrange(20):
            damage(used[kind] if kind != "map" or chance.randrange(2) else folder / chance.choice(
                [path.name for path in folder.iterdir() if path.suffix in (".yaml", ".png", ".pgm")] or [used["map"].name]), chance)
        before = time.monotonic()
        try:
            ended = subprocess.run([*words, *options], capture_output=True, timeout=TIME_LIMIT, check=False, env=ENVIRONMENT)
            status, said = ended.returncode, ended.stderr.decode(errors="replace")
        except subprocess.TimeoutExpired:
            status, said = -1, f"took more than {TIME_LIMIT} s"
        lines = said.splitlines()
        is_sound = status in (0, 1, 2, 3) and len(lines) == (status != 0) and not REPORT.search(said)
        if is_sound:
            return kind, status, None
        kept = KEPT / str(seed)
        shutil.rmtree(kept, ignore_errors=True)
        shutil.copytree(folder, kept)
        command = " ".join(word.replace(name, str(kept)) for word in [*words, *options])
        (kept / "finding.txt").write_text(f"{command}\nstatus {status}, {time.monotonic() - before:.1f} s\n{said}")
        return kind, status, f"{kept}: status {status}: {lines[0] if lines else ''}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("seconds", type=float)
    parser.add_argument("--seed", type=int, default=1, help="of the first run; each run has the next")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--files", type=pathlib.Path, help="a folder of further logs and maps")
    arguments = parser.parse_args()
    found = inputs(arguments.files)
    end, seed, counts, findings = time.monotonic() + arguments.seconds, arguments.seed, collections.Counter(), 0
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        running = set()
        while running or time.monotonic() < end:
            while len(running) < arguments.jobs and time.monotonic() < end:
                running.add(pool.submit(one_run, arguments.program.resolve(), found, seed))
                seed += 1
            done, running = concurrent.futures.wait(running, return_when=concurrent.futures.FIRST_COMPLETED)
            for kind, status, finding in (future.result() for future in done):
                counts[kind] += 1
                counts[status] += 1
                if finding:
                    findings += 1
                    print(finding, flush=True)
    print("| seeds | log | map | truth | config | index | status 0 | 1 | 2 | 3 | findings |")
    row = [counts[key] for key in ("log", "map", "truth", "config", "index", 0, 1, 2, 3)]
    print("| " + " | ".join(map(str, (f"{arguments.seed} to {seed - 1}", *row, findings))) + " |")
    sys.exit(findings > 0)


if __name__ == "__main__":
    main()
