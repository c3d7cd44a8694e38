#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Tells whether today's answers are those of the tables: fingerprint.py [--build BUILD] [--check SOURCES | --outdate PAGE...]

Prints the fingerprint of the answers (poses, statuses and confidences) to a fixed set of scans: the office that ships with
d2s1r, MRPT's demo, and scans simulated on floors that are drawn below, as they are, cut short and with people. Commands that
measure tables write it beside them, as a comment with the commit:

    <!-- measured at COMMIT: answers FINGERPRINT -->

--check fails for each page of SOURCES whose answers are others than today's, unless the page says so in these words, which
README may not:

    <!-- measured at COMMIT: answers of another commit -->

Measuring again mends it, by the command that the page names. --outdate puts these words in place of a fingerprint that is not
today's.
"""
import argparse
import csv
import hashlib
import pathlib
import re
import subprocess
import sys
import tempfile

import runs

PROJECT = pathlib.Path(__file__).resolve().parents[1]
DEMO = pathlib.Path("/usr/share/mrpt/datasets/localization_demo")
DIGITS = {"x": 3, "y": 3, "phi": 3, "confidence": 4}  # [-] after the point
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
STAMP = re.compile(r"<!-- measured at (\S+): answers (of another commit|[0-9a-f]{12}) -->")
PAGES = ("README.md", "experiments/**/*.md", "doc/*.md", "tests/*/RESULTS.md")
MEASURED = ("README.md", "experiments/RESULTS.md", "experiments/results/README.md", "experiments/results/comparison/README.md",
            "experiments/results/comparison/intel/README.md", "experiments/results/comparison/fr079/README.md")
# pages that must have a stamp; tables of times and of what is learned are about other things than today's answers


def world_of(picture):
    """What simulate_floor reads."""
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
    lines += [f"scan {x + 0.07} {y - 0.11} {i * 137 % 360 / 57.3:.6f}" for i, (x, y) in enumerate(free[::4])]
    return "\n".join(lines) + "\n"


class Programs:
    def __init__(self, build):
        self.localizer = build / "apps/rawlog-localize/rawlog-localize"
        self.simulate, self.alter = build / "experiments/simulate_floor", build / "experiments/alter_scans"

    def sets(self, folder):
        """Yields (name, map, log, ini file) of all sets."""
        office = PROJECT / "share/d2s1r/data"
        yield "office", office / "office.yaml", office / "office_bag", "default"
        for config in ("default", "paper"):
            yield f"demo {config}", f"{DEMO}.simplemap.gz", f"{DEMO}.rawlog", config
        for name, picture in FLOORS.items():
            site = folder / name
            site.mkdir()
            (site / "world.txt").write_text(world_of(picture))
            run(self.simulate, site / "world.txt", site)
            yield name, site / "map.yaml", site / "scans.rawlog", "default"
            for number, words in enumerate(LESSER):
                log = site / f"lesser{number}.rawlog"
                run(self.alter, site / "scans.rawlog", log, *words.split())
                yield f"{name} {words}", site / "map.yaml", log, "default"

    def answers(self):
        """A line for each scan: set, frame, status, pose and confidence, rounded."""
        lines = []
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for title, map_file, log, config in self.sets(folder):
                ini = PROJECT / f"share/d2s1r/config/{config}.ini"
                run(self.localizer, "-q", "-m", map_file, "-i", log, "-o", folder / "out", "-c", ini, "--no-rawlog")
                with open(folder / "out/frames.csv", newline="") as stream:
                    for row in csv.DictReader(stream):
                        numbers = [f"{float(row[key]) + 0:.{digits}f}" if row[key] else "" for key, digits in DIGITS.items()]
                        lines.append(" ".join([title, row["frame"], row["status"], *numbers]))
        return lines


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"fingerprint.py: {done.stderr.strip() or words[0]}")


def of_build(build):
    """The fingerprint of the answers of a build."""
    return hashlib.sha256("\n".join(Programs(build).answers()).encode()).hexdigest()[:12]


def stamp(build):
    return f"<!-- measured at {runs.commit()}: answers {of_build(build)} -->"


def outdated(text, today):
    """The text with words in place of fingerprints that are not today's."""
    return STAMP.sub(lambda found: found.group() if found.group(2) == today else
                     f"<!-- measured at {found.group(1)}: answers of another commit -->", text)


def faults(folder, today):
    """What is wrong with the stamps of the pages in a folder of sources."""
    pages = sorted({page for pattern in PAGES for page in folder.glob(pattern)})
    for page in pages:
        name = page.relative_to(folder).as_posix()
        stamps = STAMP.findall(page.read_text())
        if name in MEASURED and not stamps:
            yield f"{name}: does not say of which commit its tables are: <!-- measured at ...; see fingerprint.py"
        for commit, answers in stamps:
            if answers == "of another commit" and name == "README.md":
                yield f"{name}: its table must be of today's answers; measure it: experiments/headline.py --write README.md"
            elif answers not in ("of another commit", today):
                yield f"{name}: measured at {commit}, and today's answers are others ({today}); measure again by the command that it names"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=PROJECT / "build/release", help="build folder")
    parser.add_argument("--check", type=pathlib.Path, metavar="SOURCES")
    parser.add_argument("--outdate", type=pathlib.Path, nargs="+", metavar="PAGE", default=[])
    parser.add_argument("--answers", action="store_true", help="print the answers, not their fingerprint")
    arguments = parser.parse_args()
    if arguments.answers:
        print("\n".join(Programs(arguments.build).answers()))
        return
    today = of_build(arguments.build)
    print(today)
    for page in arguments.outdate:
        if page.resolve() == PROJECT / "README.md":
            sys.exit("fingerprint.py: README's table must be of today's answers; measure it: experiments/headline.py --write README.md")
        page.write_text(outdated(page.read_text(), today))
    found = list(faults(arguments.check, today)) if arguments.check else []
    sys.exit("\n".join(found) if found else 0)


if __name__ == "__main__":
    main()
