# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""The workflow of share/d2s1r/fleet on this machine: ten logs, of which one is damaged, one has no map and one is
killed at its first try. RAWLOG_LOCALIZE names the program. Skipped, status 77, if snakemake is missing."""
import csv
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from drawn_world import SENSOR, World

FLEET = pathlib.Path(__file__).resolve().parents[2] / "share/d2s1r/fleet"
OPTIONS = f"--sensor-pose={SENSOR[0]},{SENSOR[1]},0,30,0,0 --no-rawlog"
KILLED_ONCE = """#!/bin/sh
case "$*" in *part3.log*) [ -e tried ] || { : >tried; kill -KILL $$; } ;; esac
exec "$RAWLOG_LOCALIZE" "$@"
"""


def split_drive(folder, prefix):
    """Writes the scans of a drive as ten logs of ten scans each; returns their paths, relative to `folder`."""
    scans = (folder / "drive.log").read_text().splitlines(keepends=True)
    names = [f"{prefix}{i}.log" for i in range(10)]
    for i, name in enumerate(names):
        (folder / name).write_text("".join(scans[10 * i:10 * i + 10]))
    return names


def write_damaged_log(file):
    file.write_bytes(b"\x1f\x8b" + bytes(range(256)))


def write_manifest(folder, rows):
    with open(folder / "logs.csv", "w", newline="") as stream:
        csv.writer(stream).writerows([["log", "map", "options"], *rows])


def write_fleet(folder):
    """Draws a building and a drive through it; its map is in two files. Returns the rows of the manifest."""
    World(folder)
    shutil.copy(folder / "map.yaml", folder / "other.yaml")
    rows = [[log, map_file, OPTIONS] for log, map_file in zip(split_drive(folder, "part"), ["map.yaml", "other.yaml"] * 5)]
    write_damaged_log(folder / "part4.log")
    rows[5][1] = "missing.yaml"
    write_manifest(folder, rows)
    program = folder / "program"
    program.write_text(KILLED_ONCE)
    program.chmod(0o755)
    return rows


def run_fleet(folder):
    """Returns how many jobs were started."""
    result = subprocess.run(
        ["snakemake", "-s", FLEET / "Snakefile", "--cores", "2", "--config", "manifest=logs.csv", "out=all",
         f"program={folder / 'program'}"], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert result.returncode == 0, result.stdout
    return sum(line.startswith(("rule ", "localrule ")) for line in result.stdout.splitlines())


def without_times(rows):
    rows = list(rows)
    kept = [i for i, name in enumerate(rows[0]) if not name.endswith("_ms")]
    return [[row[i] for i in kept] for row in rows]


def rows_one_after_another(folder, rows):
    """The rows of frames.csv if nothing but the program is run on log after log, without an index."""
    joined = []
    for log, map_file, options in rows:
        result = subprocess.run(
            [os.environ["RAWLOG_LOCALIZE"], "-m", map_file, "-i", log, "-o", "alone", "--quiet", *options.split()],
            cwd=folder, stderr=subprocess.DEVNULL)
        if result.returncode == 0:
            with open(folder / "alone/frames.csv", newline="") as stream:
                header, *frames = csv.reader(stream)
            joined = joined or [["log", *header]]
            joined += [[pathlib.Path(log).stem, *frame] for frame in frames]
    return without_times(joined)


def check_refused_manifests(folder):
    """A manifest that cannot be used ends in one line, which names it; marks before UTF-8 do no harm."""
    sys.path.insert(0, str(FLEET))
    sys.dont_write_bytecode = True
    import fleet
    file = folder / "manifest.csv"
    file.write_bytes(b"\xef\xbb\xbflog,map\r\na.log,a.yaml\r\n")
    assert list(fleet.read_manifest(file)) == ["a"]
    first = b"log,map,options,name\n"
    for text, why in (b"log;map\n", "names no column log"), (first + b"a,b,'c,d\n", "cannot be split"), \
            (first + b"a,b,,..\n", "begin with a dot"), (first + b"a,b,,c.json\n", "end in .json"), \
            (first + b"a,b,,c\nd,b,,c\n", "twice"), (first + b"a\0,b,,c\n", "null byte|NUL"), \
            (first + b"\xff,b,,c\n", "UTF-8"), (first + b"a" * 200_000 + b",b,,c\n", "limit"), (None, "No such file"):
        file.unlink() if text is None else file.write_bytes(text)
        try:
            fleet.read_manifest(file)
            raise AssertionError(f"{text[:40]} is accepted")
        except SystemExit as refusal:
            assert str(refusal).startswith(f"{file}:") and "\n" not in str(refusal), refusal
            assert re.search(why, str(refusal)), refusal


def main():
    with tempfile.TemporaryDirectory() as name:
        check_refused_manifests(pathlib.Path(name))
    if not shutil.which("snakemake"):
        print("skipped: snakemake is missing")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        rows = write_fleet(folder)
        assert run_fleet(folder) > 12
        assert (folder / "tried").exists()
        with open(folder / "all/frames.csv", newline="") as stream:
            frames = without_times(csv.reader(stream))
        assert len(frames) == 1 + 8 * 10
        assert frames == rows_one_after_another(folder, rows)
        with open(folder / "all/failed.csv", newline="") as stream:
            failed = list(csv.DictReader(stream))
        assert [(row["name"], row["exit"]) for row in failed] == [("part4", "2"), ("part5", "2")], failed
        assert "part4.log" in failed[0]["why"] and "missing.yaml" in failed[1]["why"], failed
        summary = json.loads((folder / "all/summary.json").read_text())
        assert (summary["logs"], summary["failed_logs"], summary["frames"]) == (10, 2, 80)
        assert summary["localized"] + summary["ambiguous"] == 80 and summary["maps"]["map.yaml"]["frames"] == 40
        times = sorted(float(row["total_ms"]) for row in csv.DictReader(open(folder / "all/frames.csv", newline="")))
        assert (summary["total_ms"]["p50"], summary["total_ms"]["max"]) == (times[39], times[79])

        assert run_fleet(folder) == 0, "a second run has nothing to do"
        shutil.copy(folder / "map.yaml", folder / "missing.yaml")
        assert run_fleet(folder) == 4, "the index of the map that was missing, its log, and all that follows"
        assert json.loads((folder / "all/summary.json").read_text())["failed_logs"] == 1


if __name__ == "__main__":
    main()
