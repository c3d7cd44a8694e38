# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""The steps of a fleet's workflow, which Snakefile puts in order: the index of a map, a log, all results together.

A step that meets bad input succeeds and says so in its outcome, a file of JSON with the exit status of the program and
the reason; a step that fails in any other way has met a machine in trouble and is worth another try."""
import argparse
import csv
import hashlib
import json
import math
import pathlib
import re
import shlex
import subprocess
import sys

BAD_INPUT = (1, 2)  # exit status of rawlog-localize: wrong use or configuration, an input that cannot be used
OPTIONS_OF_THE_MAP = ("-c", "--config", "--resolution", "--origin", "--plugins")  # what an index depends on
COUNTS = ("frames", "successes", "localized", "localized_successes")  # of an accuracy in summary.json
STATUSES = ("localized", "ambiguous", "rejected", "invalid")
QUANTILES = {"p50": 0.5, "p90": 0.9, "p99": 0.99, "max": 1.0}
ONE_SCAN = "FLASER 3 1 1 1 0 0 0 0 0 0 1 fleet 1\n"  # a log in the format of CARMEN


class Log:
    """A line of the manifest."""

    def __init__(self, line, folder):
        self.log, self.map, self.options = line["log"], line["map"], shlex.split(line.get("options") or "")
        self.name = line.get("name") or re.sub(r"[^A-Za-z0-9._+-]", "_", pathlib.Path(self.log).stem)
        # A missing file is no input that a workflow could wait for; the program will say that it is missing.
        self.inputs, self.map_inputs = [[str(folder / file) for file in files if (folder / file).exists()]
                                        for files in ((self.log, self.map), (self.map,))]
        self.map_arguments = ["-m", self.map]
        options = [word for option in self.options for word in
                   (option.split("=", 1) if option.startswith("--") else [option])]
        for option, value in zip(options, options[1:]):
            if option in OPTIONS_OF_THE_MAP:
                self.map_arguments += [option, value]
        self.index = hashlib.sha256("\0".join(self.map_arguments).encode()).hexdigest()[:16]


def read_manifest(file):
    """Returns the logs of a CSV file with the columns log and map, and if need be options and name."""
    try:
        return read_lines(file)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        sys.exit(f"{file}: cannot be read as a CSV file in UTF-8 ({error}); correct it")


def read_lines(file):
    folder = pathlib.Path(file).resolve().parent
    logs = {}
    with open(file, newline="", encoding="utf-8-sig") as stream:  # programs for tables put a mark before UTF-8
        lines = csv.DictReader(stream)
        for column in "log", "map":
            if column not in (lines.fieldnames or ()):
                sys.exit(f"{file}: its first line names no column {column}; it must be log,map,options or the like")
        for line in lines:
            if not line["log"] or not line["map"]:
                sys.exit(f"{file}:{lines.line_num}: log or map is missing")
            if any("\0" in text for value in line.values() for text in value or ()):
                sys.exit(f"{file}:{lines.line_num}: holds a null byte; correct it")
            try:
                log = Log(line, folder)
            except ValueError as error:
                sys.exit(f"{file}:{lines.line_num}: options cannot be split into words ({error}); correct them")
            if not re.fullmatch(r"[A-Za-z0-9_+-][A-Za-z0-9._+-]*(?<!\.json)", log.name):
                sys.exit(f"{file}:{lines.line_num}: a name has letters, digits and ._+- only, does not begin with a dot "
                         f"and does not end in .json, unlike {log.name!r}")
            if log.name in logs:
                sys.exit(f"{file}:{lines.line_num}: {log.name} is in it twice; tell them apart in a column name")
            logs[log.name] = log
    return logs


def run(program, folder, arguments, outcome):
    """Runs the program in `folder`; bad input is an outcome, anything else that goes wrong ends this process."""
    result = subprocess.run([program, *arguments], cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                            stderr=subprocess.PIPE, text=True, errors="replace")
    if result.returncode != 0 and result.returncode not in BAD_INPUT:
        sys.exit(f"{shlex.join([program, *arguments])}\nended with {result.returncode}; {result.stderr}")
    lines = result.stderr.strip().splitlines()
    why = lines[-1] if result.returncode != 0 and lines else ""
    text = json.dumps({"exit": result.returncode, "why": why}) + "\n"
    part = pathlib.Path(f"{outcome}.part")
    part.write_text(text)
    part.replace(outcome)


def make_index(args, log):
    """Builds the index of a map while a scan is localized that is not in any log."""
    scan = pathlib.Path(f"{args.outcome}.log").resolve()
    scan.write_text(ONE_SCAN)
    index = pathlib.Path(args.outcome).resolve().with_suffix(".index")
    run(args.program, pathlib.Path(args.manifest).resolve().parent,
        [*log.map_arguments, "-i", str(scan), "--stream", "--quiet", "--index", str(index)], args.outcome)
    scan.unlink()


def localize(args, log):
    """Localizes a log; its results are in the folder beside the outcome."""
    outcome = pathlib.Path(args.outcome).resolve()
    run(args.program, pathlib.Path(args.manifest).resolve().parent,
        ["-m", log.map, "-i", log.log, "-o", str(outcome.with_suffix("")), "--threads", str(args.threads), "--quiet",
         "--index", str(pathlib.Path(args.index).resolve().with_suffix(".index")), *log.options], outcome)


def distribution(values):
    """Returns quantiles as rawlog-localize has them: the smallest value that the share of all does not exceed."""
    ordered = sorted(values)
    return {name: ordered[max(0, math.ceil(share * len(ordered)) - 1)] for name, share in QUANTILES.items()}


def summary_of(rows):
    """Returns counts and quantiles of all frames together; quantiles cannot be had from those of the logs."""
    summary = {"frames": len(rows)}
    for status in STATUSES:
        summary[status] = sum(row[0] == status for row in rows)
    for name, column in ("total_ms", 1), ("confidence", 2):
        values = [float(row[column]) for row in rows if row[column]]
        if values:
            summary[name] = distribution(values)
    return summary


def write_table(file, rows):
    with open(file, "w", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows(rows)


def merged_frames(folders):
    """Yields a header and the frames of all logs under it, each after the name of its log."""
    header = []
    for folder in folders:
        with open(folder / "frames.csv", newline="") as stream:
            header += [column for column in next(csv.reader(stream)) if column not in header]
    yield ["log", *header]
    for folder in folders:
        with open(folder / "frames.csv", newline="") as stream:
            for row in csv.DictReader(stream):
                yield [folder.name, *(row.get(column, "") for column in header)]


def merge(args, logs):
    """Writes frames.csv, failed.csv and summary.json of all logs, in the order of the manifest."""
    out = pathlib.Path(args.outcome).parent
    outcomes = {name: json.loads((out / "logs" / f"{name}.json").read_text()) for name in logs}
    good = [name for name in logs if outcomes[name]["exit"] == 0]
    failed = [[name, log.log, log.map, outcomes[name]["exit"], outcomes[name]["why"]]
              for name, log in logs.items() if name not in good]
    write_table(out / "failed.csv", [["name", "log", "map", "exit", "why"], *failed])

    per_map = {}  # what the summary needs of each frame

    def noting_frames():
        rows = merged_frames([out / "logs" / name for name in good])
        header = next(rows)
        yield header
        columns = [header.index(name) for name in ("status", "total_ms", "confidence")] if good else []
        for row in rows:
            per_map.setdefault(logs[row[0]].map, []).append([row[column] for column in columns])
            yield row

    write_table(out / "frames.csv", noting_frames())
    accuracy = {}
    for name in good:
        for key, counts in json.loads((out / "logs" / name / "summary.json").read_text()).items():
            if key.startswith("accuracy_"):
                total = accuracy.setdefault(key, dict.fromkeys(COUNTS, 0))
                for count in COUNTS:
                    total[count] += counts[count]
    summary = {"logs": len(logs), "failed_logs": len(failed), **summary_of(sum(per_map.values(), [])), **accuracy,
               "maps": {name: summary_of(rows) for name, rows in per_map.items()}}
    pathlib.Path(args.outcome).write_text(json.dumps(summary, indent=2) + "\n")
    print(f"{len(good)} of {len(logs)} logs localized, {summary['frames']} frames"
          + (f"; why {len(failed)} failed is in {out / 'failed.csv'}" if failed else ""))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("step", choices=["index", "localize", "merge"])
    parser.add_argument("--manifest", required=True)
    parser.add_argument("--outcome", required=True, help="file that says how it went")
    parser.add_argument("--name", help="of the log to localize, or of a log in the map whose index is made")
    parser.add_argument("--index", help="outcome of the step that made it")
    parser.add_argument("--program", default="rawlog-localize")
    parser.add_argument("--threads", default=1, type=int)
    args = parser.parse_args()
    logs = read_manifest(args.manifest)
    if args.step == "merge":
        merge(args, logs)
    else:
        {"index": make_index, "localize": localize}[args.step](args, logs[args.name])


if __name__ == "__main__":
    main()
