#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Compares d2s1r with other methods on your own data, or on the recorded sites.

A SITE is a folder with a map, a log and the true poses, in the formats that rawlog-localize reads (truth: `time x y phi`,
MRPT's or TUM's lines), or the name of a folder below D2S1R_DATA. Of several files test.*, test_gt*.txt and map_test.* are
taken; --map, --log and --truth name others. As with rawlog-localize, the truth may be in the log: --truth topic:/TOPIC or
--truth tf:FRAME.

Writes to --output: README.md with tables and pictures, table.csv, frames.csv (each answer of each method), table.tex,
references.bib with an entry for all that was run, and what each run printed in logs. The published method is run with the
range of Table II, of the laser and of its returns, with both readings of lost beams, and with k = 10 and 200; the best
counts. Every method is run with one thread on the same scans, as they are recorded: beams of a spinning laser are not moved
to one time. Results of single runs are kept in --store, so that an interrupted comparison goes on where it stopped.

Needs Debian's python3-matplotlib and a build with its tests' programs.
"""
import argparse
import dataclasses
import json
import os
import pathlib
import shutil
import sys
import tempfile

sys.dont_write_bytecode = True  # the folder is part of the sources

import needs  # noqa: E402
try:
    import comparison_page
except ImportError as error:
    needs.stop(error, "python3-matplotlib")
import fingerprint  # noqa: E402
import methods  # noqa: E402
import runs  # noqa: E402
import sites  # noqa: E402

PROJECT = pathlib.Path(__file__).resolve().parents[1]
MOST, WITHIN = 100000, 0.3  # [scans], [m]: all, and the greatest error of a success
TRIED = 100  # [scans] on which the readings of the published method are tried out


@dataclasses.dataclass(frozen=True)
class Job:
    """A method on the scans of a site."""
    site: sites.Case
    method: str
    most: int  # [scans], evenly spread
    position: float  # [m] greatest error of a success
    reading: methods.Reading = None  # of the published method
    peer: pathlib.Path = None  # the program of a peer

    map_site = None
    scans = ""

    @property
    def uses(self):
        return "alter", str(self.peer or "rivals")

    @property
    def name(self):
        words = [self.site.name, self.method, f"n{self.most}"]
        words += [f"r{self.reading.max_range:g}-{self.reading.no_return}"] if self.reading else []
        words += ["in", self.site.map_file.parent.name] if self.site.map_file.parent != self.site.folder else []
        return "-".join(words)

    def run(self, runner, folder):
        """runs.Answers"""
        truth = folder / "truth.txt"
        truth.write_text("".join(f"{stamp / 1000:.6f} {x} {y} {phi}\n" for stamp, (x, y, phi) in self.site.truth("").poses.items()))
        known = [] if self.site.between else [f"truth={truth}"]
        words = [self.site.log, folder / "in.rawlog", f"text={folder / 'scans.txt'}", f"frames={self.most}"]
        facts = json.loads(runner.call("alter", *words, *known))
        if not facts["scans"]:  # the truth has a clock of its own, and is interpolated
            facts = json.loads(runner.call("alter", *words))
        if not facts["scans"]:
            raise SystemExit(f"compare.py: {self.site.log}: holds no scan that can be read")
        out = folder / "frames.csv"
        if self.peer:
            map_of(self.site.map_file, folder)
            told = runner.call(str(self.peer), folder / "map.txt", folder / "scans.txt", out)
        else:
            told = runner.call("rivals", *self.words(runner, folder, out))
        told = json.loads(told.strip().splitlines()[-1])
        frames = runs.read_frames(out, self)
        if not frames:
            raise SystemExit(f"compare.py: {self.site.truth_of}: tells the pose of no scan of {self.site.log.name}; the times of both must be "
                             "of one clock")
        return runs.Answers(frames, told["memory_mb"], told["preparation_s"], facts, runner.spent.log)

    def words(self, runner, folder, out):
        method = methods.METHODS[self.method]
        words = [method.word, self.site.map_file, folder / "in.rawlog", out]
        if method.config:
            text = (runner.configs / f"{method.config}.ini").read_text()
            config = folder / "config.ini"
            config.write_text(methods.published_config(text, method.candidates, self.reading) if self.reading else text)
            words.append(f"config={config}")
        if method.keyframes:
            log, truth = self.site.keyframes
            part = "even" if self.site.name in sites.BY_TURNS else "first_half" if "map_test" in self.site.map_file.name else "all"
            words += [f"keyframes={log}", f"truth={truth}", f"part={part}"]
        return words


def map_of(yaml, folder):
    """Writes map.pgm, rows from the top: 0 occupied, 205 unknown, 254 free, and map.txt: its name, resolution and origin."""
    picture, extent_of, _ = sites.map_image(yaml)
    cells = comparison_page.grey(picture, yaml)
    left, right, bottom, _ = extent_of(*cells.shape)
    with open(folder / "map.pgm", "wb") as stream:
        stream.write(b"P5 %d %d 255\n" % (cells.shape[1], cells.shape[0]) + cells.tobytes())
    (folder / "map.txt").write_text(f"map.pgm {(right - left) / cells.shape[1]:.9g} {left:.9g} {bottom:.9g}\n")


def positive(kind):
    def read(text):
        value = kind(text)
        if not value > 0:
            raise ValueError
        return value
    read.__name__ = f"positive {kind.__name__}"  # which argparse prints
    return read


def read_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sites", nargs="+", metavar="SITE")
    parser.add_argument("--map", type=pathlib.Path, help="the map in place of the one in the folder")
    parser.add_argument("--log", type=pathlib.Path, help="the log in place of the one in the folder")
    parser.add_argument("--truth", help="the true poses in place of those in the folder: a file, topic:/TOPIC or tf:FRAME of the log")
    parser.add_argument("--scans", default="test", help="name of the log in the folder (default test)")
    parser.add_argument("--most", type=positive(int), default=MOST, help="scans that d2s1r and the published method get, evenly spread")
    parser.add_argument("--most-others", type=positive(int), default=60, help="the same for the slower others (default 60)")
    parser.add_argument("--only", help="methods to run, with commas between: " + ", ".join([*methods.METHODS, *methods.PEERS]))
    parser.add_argument("--peers", type=pathlib.Path, default=os.environ.get("D2S1R_PEERS"),
                        help="folder of the drivers of other programs, see peers/README.md (default: D2S1R_PEERS)")
    parser.add_argument("--within", type=positive(float), default=WITHIN, help="greatest error of a success [m] (default 0.3; the yaw: 5 deg)")
    parser.add_argument("--build", type=pathlib.Path, default=PROJECT / "build/release", help="build folder")
    parser.add_argument("--output", type=pathlib.Path, default=PROJECT / "build/comparison", help="folder to write to")
    parser.add_argument("--store", type=pathlib.Path, default=PROJECT / "build/experiments", help="folder of results of single runs")
    parser.add_argument("--no-times", action="store_true", help="leave out times, because other programs use the machine, too")
    parser.add_argument("--no-maps", action="store_true", help="draw no maps, because their licence does not allow to pass them on")
    parser.add_argument("--jobs", type=positive(int), default=2, help="programs that run at a time, one thread each (default 2)")
    return parser.parse_args()


def cases(arguments, runner):
    """The cases that were asked for; ends the program if one cannot be used."""
    found = []
    in_log = arguments.truth and arguments.truth.startswith(("topic:", "tf:"))
    for name in arguments.sites:
        folder = pathlib.Path(name)
        if not folder.is_dir():
            folder = sites.default_folder(PROJECT) / name
        told = arguments.output / f"{sites.name_of(folder)}_truth.txt"
        given = {"map_file": arguments.map, "log": arguments.log, "between": in_log,
                 "truth_of": told if in_log else arguments.truth and pathlib.Path(arguments.truth)}
        try:
            case = sites.case(folder, arguments.scans, **{field: file for field, file in given.items() if file})
            if in_log:
                read_told(runner, case, arguments.truth)
            for file in (case.map_file, case.log):
                if not file.exists():
                    raise ValueError(f"{file}: is not there")
            if not case.truth(""):
                raise ValueError(f"{case.truth_of}: holds no pose")
            if case.name in (other.name for other in found):
                raise ValueError(f"{folder}: is called {case.name}, as another site is")
        except (ValueError, OSError) as problem:
            sys.exit(f"compare.py: {problem}; a SITE is a folder with a map, a log and true poses, or name them by --map, --log, --truth")
        found.append(case)
    return found


def read_told(runner, case, truth):
    """Writes the poses that the log tells; a file that holds them already stays as it is, and so do results of earlier runs."""
    runner.check(["alter"])
    with tempfile.TemporaryDirectory() as folder:
        poses = pathlib.Path(folder) / "poses.txt"
        runner.call("alter", case.log, pathlib.Path(folder) / "out.rawlog", "frames=0", f"of={truth}", f"poses={poses}")
        if not case.truth_of.exists() or case.truth_of.read_text() != poses.read_text():
            shutil.copy(poses, case.truth_of)


def choose(runner, case, asked, arguments):
    """{method: the best reading of the published method on some of the scans}"""
    wanted = [method for method in asked if method in methods.PUBLISHED]
    if not wanted:
        return {}
    most = min(TRIED, arguments.most)
    any_run = runner.run_all([Job(case, methods.DEFAULT, most, arguments.within)], 1)
    facts = next(iter(any_run.values())).value.facts
    jobs = [Job(case, method, most, arguments.within, reading) for method in wanted for reading in methods.readings(facts)]
    results = runner.run_all(jobs, arguments.jobs)
    return {method: max((job for job in jobs if job.method == method),
                        key=lambda job: sum(frame.right for frame in results[job].value.frames)).reading for method in wanted}


def plan(case, asked, chosen, arguments):
    """(jobs, {method: why it is left out})"""
    jobs, left_out = [], {}
    for name in asked:
        if name in methods.PEERS:
            program = arguments.peers and arguments.peers / name
            if not (program and os.access(program, os.X_OK)):
                left_out[name] = "no driver in --peers"
            elif case.map_file.suffix != ".yaml" or sites.map_image(case.map_file)[2]:
                left_out[name] = "its map must be a yaml of map_server that is not turned"
            else:
                jobs.append(Job(case, name, arguments.most_others, arguments.within, peer=program.resolve()))
        elif methods.METHODS[name].keyframes and not case.keyframes:
            left_out[name] = methods.KEYFRAMES
        else:
            fast = name == methods.DEFAULT or name in methods.PUBLISHED
            jobs.append(Job(case, name, arguments.most if fast else arguments.most_others, arguments.within, chosen.get(name)))
    return jobs, left_out


def main():
    arguments = read_arguments()
    asked = arguments.only.split(",") if arguments.only else [*methods.METHODS, *methods.PEERS]
    unknown = set(asked) - {*methods.METHODS, *methods.PEERS}
    if unknown:
        sys.exit(f"compare.py: --only: no method {', '.join(sorted(unknown))}; see --help")
    asked = list(dict.fromkeys([methods.DEFAULT, *asked]))
    arguments.output.mkdir(parents=True, exist_ok=True)
    runner = runs.Runner(arguments.build, PROJECT / "share/d2s1r/config", arguments.output / "runs", arguments.store)
    fingerprint.Programs(arguments.build)  # stops now if it could make no stamp in the end
    results, left_out = {}, {}
    for case in cases(arguments, runner):
        jobs, missing = plan(case, asked, choose(runner, case, asked, arguments), arguments)
        results.update(runner.run_all(jobs, arguments.jobs))
        left_out.update({(case.name, name): why for name, why in missing.items()})
    if runner.folder.exists() and not any(runner.folder.iterdir()):
        runner.folder.rmdir()
    comparison_page.write(results, left_out, arguments.output, runner, " ".join(["experiments/compare.py", *sys.argv[1:]]), arguments)
    print(arguments.output / "README.md")


if __name__ == "__main__":
    main()
