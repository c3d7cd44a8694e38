#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Tells whether today's answers are those of the tables: fingerprint.py [--build BUILD] [--check SOURCES | --outdate PAGE...]

Prints fingerprints of the answers to a fixed set of scans and drives: the office that ships with d2s1r, MRPT's demo, and what is
simulated on floors that are drawn below. There is one for each kind of answers that a table may be about: see KINDS. Commands that
measure tables write those of their kinds beside them, as a comment with the commit:

    <!-- measured at COMMIT: answers FINGERPRINT, windows FINGERPRINT -->

--check fails for each page of SOURCES with a fingerprint that is not today's, unless the page says so in these words, which
README may not:

    <!-- measured at COMMIT: answers FINGERPRINT, windows of another commit -->

Measuring again mends it, by the command that the page names. --outdate puts these words in place of fingerprints that are not
today's.
"""
import argparse
import cmath
import csv
import functools
import hashlib
import math
import pathlib
import re
import subprocess
import sys
import tempfile

import runs

PROJECT = pathlib.Path(__file__).resolve().parents[1]
DEMO = pathlib.Path("/usr/share/mrpt/datasets/localization_demo")
DIGITS = {"x": 3, "y": 3, "phi": 3, "confidence": 4}  # [-] after the point; None: a text
POSES = {"x": 3, "y": 3, "phi": 3, "std_x": 3, "std_y": 3, "std_phi": 3}
STDS = {"std_x": 4, "std_y": 4, "std_phi": 4}
KINDS = {  # what is asked (a method of Programs), file and columns of the answers, else what is printed, and rawlog-localize's options
    "answers": ("sets", "frames.csv", DIGITS, ()),
    "covariances": ("sets", "frames.csv", STDS, ()),
    "atlas": ("atlas", "frames.csv", {"map": None, **DIGITS, **STDS}, ()),
    "sweeps": ("sweeps", "frames.csv", {**DIGITS, **STDS}, ("--as-told", "--sweep-time", 0.1)),
    "windows": ("drives", "frames.csv", DIGITS, ("--as-told", "--window", 10)),
    "filter": ("drives", "fused.csv", POSES, ("--as-told", "--fuse")),
    "tracker": ("drives", "track.csv", {**POSES, "confidence": 4}, ("--as-told", "--track")),
    "calibration": ("calibrations", None, {}, ("--calibrate",))}
CELL = 0.5  # [m] of a sign of the floors
FLOORS = {
    "flat": ("################",
             "#......#.......#",
             "#..............#",
             "#......#....#..#",
             "###.####....#..#",
             "#......#.......#",
             "#..#.......##..#",
             "#......#.......#",
             "################"),
    "twins": ("###################",
              "#.....#.....#.....#",
              "#.....#.....#..#..#",
              "#.....#.....#.....#",
              "###.#####.#####.###",
              "#.................#",
              "###.#####.#####.###",
              "#.....#.....#.....#",
              "#.....#.....#.....#",
              "#.....#.....#.....#",
              "###################")}
LESSER = ("field_of_view=180 noise=0.02", "field_of_view=270 blocked=0.3", "reach=3.5 noise=0.02")  # words of alter_scans
DRIVES = {  # cells of a floor (column, row from below) that a robot passes
    "flat": ((2, 6), (9, 6), (10, 3), (9, 2), (5, 2), (3, 3), (3, 5), (2, 6)),
    "twins": ((4, 8), (3, 7), (3, 5), (15, 5), (15, 7), (17, 7), (17, 9), (13, 9))}
TICK, SCAN = 0.1, 5  # [s] between poses by the odometry, [-] of them from scan to scan
SPEED, SPREAD, AHEAD = 0.5, 0.8, 0.6  # [m/s], [-] by which it varies, [m] of its way that a robot looks ahead
COVERED = range(12, 18)  # scans of a drive that see nothing
WHEELS = 1.1  # [-] by which ways of the odometry are too long
FALSE = {"yaw": 0.5, "x": 0.2, "late": 0.1, "factor": 1.1}  # [rad], [m], [s], [-] what a log has wrong of its laser
OF_CALIBRATION = 4, 16  # words of calibration_experiment; where the least squares start shows in drive 18
OF_DRIVE = "field_of_view=270 blocked=0.2 reach=8 noise=0.02"  # words of alter_scans
OTHER = "of another commit"
LOG_ODDS = re.compile(r"(?<=log-odds )\S+")  # half the square of a change in its deviations, which amplifies last bits
STAMP = re.compile(r"<!-- measured at (\S+): (.*?) -->")
BEGUN = re.compile(r"<!--\s*measured")
PAGES = ("README.md", "experiments/**/*.md", "doc/*.md", "tests/*/RESULTS.md")
MEASURED = ("README.md", "experiments/RESULTS.md", "experiments/results/README.md", "experiments/results/comparison/README.md",
            "experiments/results/comparison/intel/README.md", "experiments/results/comparison/fr079/README.md")
# pages that must have a stamp; tables of times and of what is learned are about other things than today's answers


def world_of(picture, poses=None):
    """What simulate_floor reads, with scans at poses (place as a complex number [m], heading [rad]); None: all over the floor."""
    lines = ["seed 1", "cell 0.05", "mapper 15 0.005 0 0", "scanner 360 20 0 0 0"]
    free = []
    for row, signs in enumerate(reversed(picture)):
        for column, sign in enumerate(signs):
            x, y = column * CELL, row * CELL
            if sign == ".":
                free.append((x + CELL / 2, y + CELL / 2))
                continue
            corners = [(x, y), (x + CELL, y), (x + CELL, y + CELL), (x, y + CELL)]
            lines += [f"wall both {a[0]} {a[1]} {b[0]} {b[1]}" for a, b in zip(corners, corners[1:] + corners[:1])]
    lines += [f"map {x} {y} 0" for x, y in free[::2]]
    if poses is None:
        lines += [f"scan {x + 0.07} {y - 0.11} {i * 137 % 360 / 57.3:.6f}" for i, (x, y) in enumerate(free[::4])]
    else:
        lines += [f"scan {place.real:.6f} {place.imag:.6f} {phi:.6f}" for place, phi in poses]
    return "\n".join(lines) + "\n"


def drive_of(cells, late=0):
    """Poses of a drive (place, heading), TICK apart and `late` [s] back, up to where a robot looks at the last corner."""
    corners = [CELL * complex(column + 0.5, row + 0.5) for column, row in cells]
    legs = [(start, end - start) for start, end in zip(corners, corners[1:])]

    def place(way):
        for start, leg in legs:
            if way < abs(leg):
                break
            way -= abs(leg)
        return start + leg / abs(leg) * way

    def pose(time):
        way = SPEED * (time + SPREAD * math.sin(time))
        return place(way), cmath.phase(place(way + AHEAD) - place(way))

    end = (sum(abs(leg) for _, leg in legs) - AHEAD) / SPEED - SPREAD
    return [pose(i * TICK - late) for i in range(int(end / TICK))]


def carmen(seen, driven, yaw=0, x=0, factor=1):
    """A log in CARMEN's format of scans (lines that alter_scans writes) and poses by the odometry, which tells false things."""
    lines = []
    for i, (place, phi) in enumerate(driven):
        robot, end = WHEELS * place, f"{i * TICK:.3f} host 0"
        lines.append(f"ODOM {robot.real:.6f} {robot.imag:.6f} {phi:.6f} 0 0 0 {end}")
        if i % SCAN == 0:
            _, first, step, reach, _, _, _, *ranges = map(float, seen[i // SCAN].split())
            told = " ".join(f"{0.1 if i // SCAN in COVERED else min(reach, factor * each):.3f}" for each in ranges)
            laser = robot + cmath.rect(x, phi)
            poses = f"{laser.real:.6f} {laser.imag:.6f} {phi + yaw:.6f} {robot.real:.6f} {robot.imag:.6f} {phi:.6f}"
            lines.append(f"ROBOTLASER1 0 {first} {-2 * first} {step} {reach} 0 0 {len(ranges)} {told} 0 {poses} 0 0 0 0 0 {end}")
    return "\n".join(lines) + "\n"


class Programs:
    """Those that answer. It says what is not there when it is made, before anyone measures for hours."""
    def __init__(self, build):
        self.localizer = build / "apps/rawlog-localize/rawlog-localize"
        self.simulate, self.alter, self.calibration = (
            build / "experiments" / name for name in ("simulate_floor", "alter_scans", "calibration_experiment"))
        for needed in (self.localizer, self.simulate, self.alter, self.calibration, DEMO.with_suffix(".rawlog")):
            if not needed.exists():
                sys.exit(f"fingerprint.py: {needed} is not there; build all with the tests, and install mrpt-common, which has MRPT's demo")

    def floor(self, site, name, poses=None):
        """Makes the folder of a floor: map.yaml and scans.rawlog, as world_of() has them."""
        site.mkdir()
        (site / "world.txt").write_text(world_of(FLOORS[name], poses))
        run(self.simulate, site / "world.txt", site)
        return site

    def sets(self, folder):
        """Yields (title, map, log, name of the ini file) of scans."""
        office = PROJECT / "share/d2s1r/data"
        yield "office", office / "office.yaml", office / "office_bag", "default"
        for config in ("default", "paper"):
            yield f"demo {config}", f"{DEMO}.simplemap.gz", f"{DEMO}.rawlog", config
        yield from self.floors(folder)

    def floors(self, folder):
        """Yields scans of the floors, as sets() does."""
        for name in FLOORS:
            site = self.floor(folder / name, name)
            yield name, site / "map.yaml", site / "scans.rawlog", "default"
            for number, words in enumerate(LESSER):
                log = site / f"lesser{number}.rawlog"
                run(self.alter, site / "scans.rawlog", log, *words.split())
                yield f"{name} {words}", site / "map.yaml", log, "default"

    def atlas(self, folder):
        """Yields scans of the floors, in an atlas of all."""
        (folder / "atlas.yaml").write_text("maps:\n" + "".join(f"  {name}: {{file: {name}/map.yaml}}\n" for name in FLOORS))
        yield from [(title, folder / "atlas.yaml", log, config) for title, _, log, config in self.floors(folder)]

    def drive(self, folder, name, late=0, **false):
        """A drive on a floor, as sets() tells it. The log has false things of the laser, such as times that are `late` [s]."""
        site = self.floor(folder / (f"{name} late" if late else name), name, drive_of(DRIVES[name], late)[::SCAN])
        run(self.alter, site / "scans.rawlog", site / "seen.rawlog", f"text={site}/seen.txt", *OF_DRIVE.split())
        (site / "log.clf").write_text(carmen((site / "seen.txt").read_text().splitlines(), drive_of(DRIVES[name]), **false))
        return site.name, site / "map.yaml", site / "log.clf", "default"

    def drives(self, folder):
        """Yields drives with odometry, as sets() does."""
        office = PROJECT / "share/d2s1r/data"
        yield "office", office / "office.yaml", office / "office_bag", "default"
        yield "demo", f"{DEMO}.simplemap.gz", f"{DEMO}.rawlog", "default"
        yield from (self.drive(folder, name) for name in DRIVES)

    def sweeps(self, folder):
        """Yields drives, the last one also without odometry, as sets() does."""
        for title, map_file, log, config in self.drives(folder):
            yield title, map_file, log, config
        yield f"{title} alone", map_file, log.with_name("seen.rawlog"), config

    def calibrations(self, folder):
        """Yields drives, and one with false words of the laser, as sets() does."""
        yield from self.drives(folder)
        yield self.drive(folder, "flat", **FALSE)

    @functools.cache
    def told(self, asked, file, options):
        """[(title, rows of the file, or what is printed if there is none)] of what rawlog-localize finds."""
        with tempfile.TemporaryDirectory() as name:
            folder, found = pathlib.Path(name), []
            for number, (title, map_file, log, config) in enumerate(getattr(self, asked)(folder)):
                ini, out = PROJECT / f"share/d2s1r/config/{config}.ini", folder / f"out{number}"
                printed = run(self.localizer, "-q", "-m", map_file, "-i", log, "-o", out, "-c", ini, "--no-rawlog", *options)
                found.append((title, rows_of(out / file, title) if file else printed))
            return found

    def lines(self, kind):
        """The answers of a kind: a line for each scan, with title, frame, status and numbers, rounded, or what is printed."""
        asked, file, columns, options = KINDS[kind]
        if kind == "calibration":
            yield run(self.calibration, *OF_CALIBRATION)
        for title, found in self.told(asked, file, options):
            if not file:
                yield f"{title}\n" + LOG_ODDS.sub(lambda odds: f"{float(odds[0]):.1e}", found)
                continue
            for row in found:
                yield " ".join([title, row["frame"], row["status"], *(rounded(row[key], digits) for key, digits in columns.items())])


def rounded(text, digits):
    return f"{float(text) + 0:.{digits}f}" if text and digits is not None else text


def rows_of(file, title):
    """The rows that a run wrote, of which there must be some."""
    rows = []
    if file.exists():
        with open(file, newline="") as stream:
            rows = list(csv.DictReader(stream))
    return rows or sys.exit(f"fingerprint.py: {title}: {file.name} has no rows")


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"fingerprint.py: {done.stderr.strip() or words[0]}")
    return done.stdout


def of_build(build, kinds=KINDS):
    """{kind: fingerprint} of the answers of a build."""
    programs = Programs(build)
    return {kind: hashlib.sha256("\n".join(programs.lines(kind)).encode()).hexdigest()[:12] for kind in kinds}


def words_of(prints):
    return ", ".join(f"{kind} {print_}" for kind, print_ in prints.items())


def prints_of(words):
    """{kind: fingerprint or OTHER} of a stamp."""
    return dict(part.partition(" ")[::2] for part in words.split(", "))


def stamp(build, *kinds):
    return f"<!-- measured at {runs.commit()}: {words_of(of_build(build, kinds))} -->"


def outdated(text, today):
    """The text with words in place of fingerprints that are not today's."""
    def replaced(found):
        prints = prints_of(found[2])
        if unknown := prints.keys() - today.keys():
            sys.exit(f"fingerprint.py: {found[0]}: no kind of answers: {', '.join(sorted(unknown))}")
        prints = {kind: print_ if print_ == today[kind] else OTHER for kind, print_ in prints.items()}
        return f"<!-- measured at {found[1]}: {words_of(prints)} -->"
    return STAMP.sub(replaced, text)


def unstamped(text):
    """Headings of the sections of a page that have a table and no stamp before it."""
    for section in re.split(r"^(?=###? )", text, flags=re.M)[1:]:
        before, table, _ = section.partition("\n| ")
        if table and not STAMP.search(before):
            yield before.partition("\n")[0].lstrip("# ")


def faults(folder, today):
    """What is wrong with the stamps of the pages in a folder of sources."""
    pages = sorted({page for pattern in PAGES for page in folder.glob(pattern)})
    for page in pages:
        name = page.relative_to(folder).as_posix()
        text = page.read_text()
        stamps = STAMP.findall(text)
        if len(BEGUN.findall(text)) > len(stamps):
            yield f"{name}: has a stamp that is not <!-- measured at COMMIT: KIND FINGERPRINT, ... -->"
        if name == "experiments/RESULTS.md":
            yield from (f"{name}: `{section}` has a table and no stamp before it" for section in unstamped(text))
        if name in MEASURED and not stamps:
            yield f"{name}: does not say of which commit its tables are: <!-- measured at ...; see fingerprint.py"
        for commit, kind, print_ in ((commit, *part) for commit, words in stamps for part in prints_of(words).items()):
            if print_ == OTHER and name == "README.md":
                yield f"{name}: its table must be of today's answers; measure it: experiments/headline.py --write README.md"
            elif kind not in today or print_ not in (OTHER, today[kind]):
                yield (f"{name}: measured at {commit}: {kind} {print_}, and today's are {today.get(kind, 'none')}; measure again by the "
                       "command that it names")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=PROJECT / "build/release", help="build folder")
    parser.add_argument("--check", type=pathlib.Path, metavar="SOURCES")
    parser.add_argument("--outdate", type=pathlib.Path, nargs="+", metavar="PAGE", default=[])
    parser.add_argument("--answers", choices=KINDS, metavar="KIND", help="print the answers of a kind, not their fingerprint")
    arguments = parser.parse_args()
    if arguments.answers:
        print("\n".join(Programs(arguments.build).lines(arguments.answers)))
        return
    today = of_build(arguments.build)
    print(words_of(today))
    for page in arguments.outdate:
        if page.resolve() == PROJECT / "README.md":
            sys.exit("fingerprint.py: README's table must be of today's answers; measure it: experiments/headline.py --write README.md")
        page.write_text(outdated(page.read_text(), today))
    found = list(faults(arguments.check, today)) if arguments.check else []
    sys.exit("\n".join(found) if found else 0)


if __name__ == "__main__":
    main()
