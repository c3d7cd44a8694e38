#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Finds figures that stand twice with two values, and figures that come from nowhere: figures.py SOURCES [--list]

A page that quotes a figure must give the value of the file that holds the measurement or the default. Each entry of QUOTES
says where a page quotes figures, and what their values are. A quote that is no longer found is an error, too, so that no
entry outlives its figures. A figure of README or doc/ that looks measured (%, s, MB, times, N of M ...) must be a quote, stand in the
table that headline.py writes, or be named in ORIGINS. --list prints all of them with where they come from.
"""
import configparser
import math
import pathlib
import re
import sys


class Sources:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)

    def text(self, file):
        """The text with single blanks, so that a quote may run over the end of a line."""
        return re.sub(r"\s+", " ", (self.folder / file).read_text())

    def row(self, file, heading, *start):
        """The cells of the row that starts with the cells `start`, in the section with this heading."""
        lines = (self.folder / file).read_text().split("\n")
        first = lines.index(heading) + 1
        for line in lines[first:]:
            if re.match(r"#+ ", line) and len(line.split(" ")[0]) <= len(heading.split(" ")[0]):
                break
            cells = [cell.strip() for cell in line.strip("| ").split(" | ")]
            if cells[:len(start)] == list(start):
                return cells
        sys.exit(f"{file}: no row {start} under {heading}")

    def table(self, file, heading):
        """{first two cells: the others} of the first table of a section."""
        lines = (self.folder / file).read_text().split("\n")
        rows = {}
        for line in lines[lines.index(heading) + 1:]:
            if line.startswith("|"):
                cells = [cell.strip() for cell in line.strip("| ").split(" | ")]
                rows[cells[0], cells[1]] = cells[2:]
            elif rows:
                return rows
        sys.exit(f"{file}: no table under {heading}")

    def parameter(self, name):
        """A value of the shipped configuration."""
        ini = configparser.ConfigParser(inline_comment_prefixes=";")
        ini.read(self.folder / "share/d2s1r/config/default.ini")
        section, key = name.split(".")
        return float(ini[section][key])


def number(text):
    return float(re.match(r"-?[\d.,]+", text.replace("**", "")).group().rstrip(".,").replace(",", ""))


def atlas(sources, scans):
    cells = sources.row("experiments/RESULTS.md", "## Atlas", "all", scans)
    return [number(cells[column]) for column in (1, 2, 3, 4, 6, 8)]


def atlas_time(sources):
    cells = sources.row("experiments/RESULTS.md", "## Atlas", "all", "877")
    return [round(number(cells[10]) / number(cells[11]), 1)]


def reach(sources, column):
    """The least and the greatest success indoors of scans that are cut [%]."""
    rows = sources.table("experiments/results/README.md", "## Reach")
    indoors = [number([first, *cells][column]) for (name, first), cells in rows.items() if not name.startswith(("fr_campus", "---", "set"))]
    return [round(min(indoors)), round(max(indoors))]


def other_sites(sources):
    """The share of scans of other sites that are localized [%]: of one site in the map of another, at most, and over all."""
    rows = sources.table("experiments/results/README.md", "## Scans of another site")
    most = [number(cells[1]) for (site, _), cells in rows.items() if site not in ("map", "---")]
    over_all = re.search(r"Over all pairs: .*?, ([\d.]+) \(", sources.text("experiments/results/README.md"))
    return [number(over_all.group(1)), math.ceil(max(most))]


def windows(sources):
    cells = sources.row("experiments/RESULTS.md", "### How far the confidence of windows can be trusted", "all")
    return [number(part) for cell in (cells[1], cells[3], cells[2]) for part in cell.split(" / ")]


def sure_windows(sources):
    """Windows with a confidence above 0.99: how many are wrong, of how many, and how many the confidence tells."""
    rows = [sources.row("experiments/RESULTS.md", "### How far the confidence of windows can be trusted", confidence)
            for confidence in ("0.99 to 0.999", "0.999 to 1")]
    return [sum(number(row[2]) for row in rows), sum(number(row[1]) for row in rows),
            sum(number(row[1]) * number(row[3]) / 100 for row in rows)]


def picture(sources):
    """Scans of README's picture."""
    return [number(re.search(r"(\d+) full circles", sources.text("experiments/RESULTS.md")).group(1))]


def reading_of_logs(sources):
    """The least and the greatest memory [MB] and time [s] a gigabyte of reading a log."""
    rows = list(sources.table("tests/data/RESULTS.md", "## Memory and time").items())[2:]
    memory = [number(cells[1]) for _, cells in rows]
    times = [number(cells[0]) / number(size) for (_, size), cells in rows]
    return [min(memory), max(memory), min(times), max(times)]


def simd_targets(sources):
    """How often as long as with AVX2 a scan takes: with SSSE3 and with portable loops, the least and the greatest, with AVX-512."""
    rows = list(sources.table("tests/benchmark/RESULTS.md", "## SIMD targets").values())[2:]
    portable, ssse3, avx3 = ([number(cells[column]) / number(cells[2]) for cells in rows] for column in (0, 1, 3))
    return [min(ssse3), max(ssse3), min(portable), max(portable), sum(avx3) / len(avx3)]


def amcl_away(sources):
    """After how long [s] lifecycle_manager notices that amcl is gone."""
    return [number(re.search(r"lifecycle_manager notices (\d+) s after", sources.text("tests/live/RESULTS.md")).group(1))]


def latency(sources):
    """Median from the end of localizing to the receipt of a line of --stream [ms]."""
    return [number(re.search(r"the time of localizing: median ([\d.]+) ms", sources.text("tests/python/RESULTS.md")).group(1))]


def parameters(*names):
    return lambda sources: [sources.parameter(name) for name in names]


def beam_model(sources):
    names = ["log_range", "through_wall", "unknown_metre", "off_wall_run", "depth_edge", "no_return_at_wall", "on_wall", "off_wall"]
    return [abs(sources.parameter("beam_model." + name)) for name in names]


# page, what stands there (each group is a figure), what the figures are
QUOTES = [
    ("README.md", r"(\d+) scans localized one by one", picture),
    ("README.md", r"of a building that the map lacks, ([\d.]+) % are called `localized`, of no building over (\d+) %", other_sites),
    ("doc/formats.md", r"takes (\d+) to (\d+) MB of memory, and ([\d.]+) to ([\d.]+) s of processor time a gigabyte", reading_of_logs),
    ("doc/live.md", r"must be back within (\d+) s", amcl_away),
    ("doc/other_systems.md", r"SSSE3 a scan takes ([\d.]+) to ([\d.]+) times the time of AVX2, with portable loops ([\d.]+) to ([\d.]+) times, "
     r"with AVX-512 ([\d.]+) times", simd_targets),
    ("doc/atlas.md", r"\| (877) recorded \| ([\d.]+) % \| ([\d.]+) % \| ([\d.]+) % \| ([\d.]+) % \| ([\d.]+) % \|",
     lambda sources: atlas(sources, "877")),
    ("doc/atlas.md", r"\| (621) simulated \| ([\d.]+) % \| ([\d.]+) % \| ([\d.]+) % \| ([\d.]+) % \| ([\d.]+) % \|",
     lambda sources: atlas(sources, "621")),
    ("doc/atlas.md", r"recorded scan takes ([\d.]+) times as long", atlas_time),
    ("doc/usage.md", r"(\d+) to (\d+) % of scans cut to 3.5 m", lambda sources: reach(sources, 0)),
    ("doc/usage.md", r"(\d+) to (\d+) % of those cut to 8 m", lambda sources: reach(sources, 2)),
    ("doc/usage.md", r"(\d+) of ([\d,]+) frames are more than 0.5 m or 10° off, where it tells (\d+)", sure_windows),
    ("doc/usage.md", r"both are (\d+) by default", parameters("scoring.hypotheses")),
    ("doc/usage.md", r"is localized \(\[([\d.]+) ms later", latency),
    ("CHANGELOG.md", r"of ([\d,]+) frames of 14 drives ([\d,]+) are localized right and (\d+) wrong \(single scans: ([\d,]+) and (\d+)\)", windows),
    ("doc/how_it_works.md", r"grid.occupied_threshold \(([\d.]+)\).*?grid.free_threshold \(([\d.]+)\)",
     parameters("grid.occupied_threshold", "grid.free_threshold")),
    ("doc/how_it_works.md", r"`margin sqrt\(n\)` \((\d+)\)", parameters("coarse_search.margin")),
    ("doc/how_it_works.md", r"If more than ([\d,]+) pairs remain", parameters("coarse_search.max_pairs")),
    ("doc/how_it_works.md", r"are the candidates: at most ([\d,]+)", parameters("coarse_search.candidates")),
    ("doc/how_it_works.md", r"Of ([\d,]+) scored poses", parameters("refinement.max_scored")),
    ("doc/how_it_works.md", r"more than `fit_margin` \(([\d.]+)\)", parameters("refinement.fit_margin")),
    ("doc/how_it_works.md", r"`rejected_below` \(([\d.]+)\).*?`localized_above` \(([\d.]+)\)",
     parameters("scoring.rejected_below", "scoring.localized_above")),
    ("doc/how_it_works.md", r"on a wall: ([\d.]+) ln.*?- ([\d.]+) walls passed - ([\d.]+) m of unknown.*?- ([\d.]+) for each run.*?"
     r"\+ ([\d.]+) for each depth edge.*?- ([\d.]+) b for each beam.*?beam ends: ([\d.]+) within 6 cm of a wall, -([\d.]+) in free",
     beam_model),
]


LOOKS_MEASURED = re.compile(r"\d[\d.,]* ?(?:%|[mu]?s\b|[kMG]B\b|frames/s|times\b)|\b\d[\d,]* of \d[\d,]*\d\b")
# page, what stands there (`.*` for the whole page), where its figures come from
ORIGINS = [
    ("README.md", r"<!-- headline\.py writes what follows -->.*?<!-- until here.*?-->", "headline.py"),
    ("README.md", r"```console \$ git clone.*?```", "what ./demo.sh prints; times differ"),
    ("README.md", r"95 % intervals", "nominal"),
    ("doc/fleet.md", r"programs/fleet_on_slurm.py` starts a Slurm .*", "the table that this program leads to; date and versions above it"),
    ("doc/formats.md", r"recorded up to 1 s later", "a limit: test RosLog"),
    ("doc/formats.md", r"less than 1 ms or more than 0.5 s", "limits of a sweep: test RosLog"),
    ("doc/formats.md", r"more than 256 MB of messages", "a limit, in promises.md with its test"),
    ("doc/formats.md", r"no wall along more than 95 % of its border", "a threshold of a warning"),
    ("doc/how_it_works.md", r"99 % of the swept ranges are within a cell", "test RangeSweep, its bound"),
    ("doc/how_it_works.md", r"\*Scan 30: .*?\*", "test WorkedExample, which reads the page"),
    ("doc/how_it_works.md", r"less 0.067 times the coarse cost", "a constant of refinement.cpp"),
    ("doc/how_it_works.md", r"exp\(-time / 1 s\)|\b60 %|points and 1 s were chosen|w_j is 0.3 times", "constants of the tracker"),
    ("doc/how_it_works.md", r"clocks within 5 s|more than 0.25 s late", "limits of the calibration"),
    ("doc/live.md", r"the odometry plus 1 s|scans of the last 2 s", "settings of d2s1r-live"),
    ("doc/live.md", r"the 0.1 to 0.2 s of a scan", "what lasers take for a turn"),
    ("doc/other_systems.md", r"\| system \| what was tried .*?(?=On Ubuntu)", "trials, with the commit beside each"),
    ("doc/promises.md", r"## Memory and time .*?(?=## Loops)", "limits, with the test of each beside it"),
    ("doc/promises.md", r"## Loops over input .*", "limits and pauses in the code"),
    ("doc/usage.md", r"up to 0.5 s apart|a constant of up to 5 s", "limits of the ground truth"),
    ("doc/usage.md", r"diagnosis 0 of 20.*?--range-factor", "an example of what is printed"),
]


def unaccounted(sources):
    """Figures of README and doc/ that no entry explains; and all others, with where they come from."""
    unknown, known = [], []
    for page in ["README.md", *(f"doc/{file.name}" for file in sorted((sources.folder / "doc").glob("*.md")))]:
        text = sources.text(page)
        entries = [(pattern, "a quote, compared above") for name, pattern, _ in QUOTES if name == page]
        entries += [(pattern, origin) for name, pattern, origin in ORIGINS if name == page]
        spans = [(*found.span(), origin) for pattern, origin in entries for found in re.finditer(pattern, text)]
        for found in LOOKS_MEASURED.finditer(text):
            origin = next((origin for first, last, origin in spans if first <= found.start() and found.end() <= last), None)
            here = text[max(0, found.start() - 30):found.end() + 20]
            (known if origin else unknown).append(f"{page}: {found.group()} ({origin or here})")
    return unknown, known


def wrong_quotes(sources):
    wrong = []
    for page, pattern, values in QUOTES:
        found = re.search(pattern, sources.text(page))
        if not found:
            wrong.append(f"{page}: does not quote {pattern} any more; correct the entry")
            continue
        for quoted, value in zip(found.groups(), values(sources), strict=True):
            places = len(quoted.partition(".")[2])
            if number(quoted) != round(value, places):
                wrong.append(f"{page}: {found.group()} ... {quoted} is {value:g} where it comes from")
    return wrong


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    SOURCES = Sources(sys.argv[1])
    UNKNOWN, KNOWN = unaccounted(SOURCES)
    if sys.argv[2:] == ["--list"]:
        print("\n".join(KNOWN))
    WRONG = wrong_quotes(SOURCES)
    print(f"{len(QUOTES)} quotes were compared, {len(KNOWN)} figures have an origin")
    sys.exit("\n".join(["figures with two values:", *WRONG] * bool(WRONG) + ["figures that come from nowhere:", *UNKNOWN] * bool(UNKNOWN)) or 0)
