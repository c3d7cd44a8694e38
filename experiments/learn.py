#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Learns the weights of the beam model, the temperature and the presence model.

Without --rawlog: from the sites of D2S1R_DATA and from drawn floors, as they are and with worse maps and lesser
sensors. Writes to --output: learned.ini, README.md with a table of all kinds of data and one in which every site is left
out in turn, reliability.png. The weights that it starts from are fixed, so that the same data and programs give the same
numbers. The defaults of parameters.h are these numbers; experiments/results/learned holds what it wrote.

With --map, --rawlog and --ground-truth: from your own scans, in your map and, as scans of somewhere else, in drawn
floors; the result stays near the defaults where the scans tell little. Writes learned.ini, for rawlog-localize -c.

Needs Debian's python3-numpy, python3-scipy, python3-pil, python3-matplotlib, and a build with its tests' programs.
"""
import argparse
import pathlib
import re
import sys
import time

sys.dont_write_bytecode = True  # the folder is part of the sources

import needs  # noqa: E402
try:
    import numpy as np
    import figures
    from learning import fitting, running, sets
except ImportError as error:
    needs.stop(error, "python3-numpy, python3-scipy, python3-pil and python3-matplotlib")
import measures  # noqa: E402
import sites  # noqa: E402
import tables  # noqa: E402

PROJECT = pathlib.Path(__file__).resolve().parents[1]
# What learning starts from: plain numbers, so that the result does not depend on what was learned before.
START_BEAM_MODEL = {"on_wall": 0.2, "off_wall": -0.2, "through_wall": -0.2, "log_range": 0.1, "off_wall_run": -0.2, "depth_edge": 1.0}
START_TEMPERATURE = {"temperature": 1.0, "temperature_by_beam": 0.01, "temperature_by_tolerance": 10.0}
START_PRESENCE = {"bias": -5.0, "log_likelihood": 0.1, "lead": 0.5, "surfaces": 2.0}
ROUNDS = 2  # [-] of searching with weights and learning from what was found
# How much a frame of each kind counts. Recorded scans count most, drawn floors least, for they are drawn after what we
# think of buildings; scans of somewhere else more than others, for a wrong pose is worse than none.
COUNTS = {"real": 4.0, "simulated": 1.0, "map": 1.0, "sensor": 1.0, "drawn": 0.2, "stranger": 2.0}
PULL = 20.0  # [frame] strength with which weights stay where they started
DIGITS = 3  # [-] of the numbers written


def read_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=PROJECT / "build/release", help="build folder")
    parser.add_argument("--data", type=pathlib.Path, default=sites.default_folder(PROJECT), help="folder of the sites")
    parser.add_argument("--output", type=pathlib.Path, default=PROJECT / "build/learned", help="folder to write to; "
                        "scans, maps and results of programs are kept in the folder learning of the build")
    parser.add_argument("--frames", type=int, default=40, help="scans of each set (default 40); five times as many of a "
                        "site's recorded scans in its own map")
    parser.add_argument("--jobs", type=int, default=2, help="programs that run at a time (default 2)")
    parser.add_argument("--map", type=pathlib.Path, help="your map, a yaml file of map_server")
    parser.add_argument("--rawlog", type=pathlib.Path, help="your scans")
    parser.add_argument("--ground-truth", type=pathlib.Path, help="`time x y phi` of each scan [s, m, rad]")
    parser.add_argument("--floors", type=int, default=len(sets.FLOORS), help="of the drawn floors, how many are used "
                        f"(default {len(sets.FLOORS)}: all)")
    arguments = parser.parse_args()
    own = (arguments.map, arguments.rawlog, arguments.ground_truth)
    if any(own) and not all(own):
        parser.error("--map, --rawlog and --ground-truth go together")
    return arguments


def section(ini, name):
    """{key: value} of the numbers in a section of an ini file."""
    body = re.search(rf"^\[{name}\]$(.*?)(?=^\[|\Z)", ini, re.M | re.S).group(1)
    return {key: float(value) for key, value in re.findall(r"^(\w+)\s*=\s*([-+.\deE]+)", body, re.M)}


def start_weights(keys, start):
    return np.array([start.get(key, 0.0) for key in keys])


def rounded(number):
    return float(f"{number:.{DIGITS}g}")


def to_ini(weights, keys):
    """An ini file of what is learned, rounded."""
    lines = ["[scoring]"] + [f"{key} = {rounded(v):g}" for key, v in zip(START_TEMPERATURE, weights.temperature)]
    for name, values, names in (("beam_model", weights.beam_model, keys), ("presence_model", weights.presence, fitting.PRESENCE)):
        lines += ["", f"[{name}]"] + [f"{key} = {rounded(v):g}" for key, v in zip(names, values)]
    return "\n".join(lines) + "\n"


def learn_in_rounds(runner, all_sets, start, keys, pull):
    """Weights, and the places of the last round."""
    weights = start
    for number in range(1, ROUNDS + 1):
        ini = to_ini(weights, keys)
        folders = runner.run_all(all_sets, lambda _: ini, True, f"round {number}")
        places = fitting.load_places([folder / "terms.csv.gz" for folder in folders], [COUNTS[s.kind] for s in all_sets])
        weights = fitting.learn(of_other_sites(places, all_sets, sites.LOOKED_AT), start, pull)
    return weights, places


def of_other_sites(places, all_sets, sites_left_out):
    """The places of the sets that are of none of the sites."""
    return fitting.of_sets(places, np.array([not set(set_.groups) & set(sites_left_out) for set_ in all_sets]))


def summary(frames):
    return [str(len(frames)), running.percent(measures.success(frames)),
            running.percent(measures.share(f.status == "localized" for f in frames) if frames else float("nan")),
            running.percent(measures.precision(frames)), running.percent(measures.recall(frames)),
            tables.number(measures.calibration_error(frames), 3), tables.number(measures.mean_time(frames, "total"), 1)]


COLUMNS = ["frames", "success", "localized", "of these right", "recall", "calibration error", "ms"]


def joined(parts):
    return [frame for part in parts for frame in part]


def kinds_table(all_sets, frames):
    def name(set_):
        ending = set_.name.rsplit("-", 1)[-1]
        return f"{set_.kind} {ending}" if set_.kind in ("map", "sensor") else set_.kind

    names = sorted({name(set_) for set_ in all_sets})
    rows = [[kind] + summary(joined(f for s, f in zip(all_sets, frames) if name(s) == kind)) for kind in names]
    return tables.table("Kinds of data", "[%] with the learned weights. Success: the best pose is within 0.3 m and 5 deg "
                        "of the truth. Strangers are scans in the map of another place: no pose is right.",
                        ["kind", *COLUMNS], rows)


def sites_table(all_sets, frames, frames_left_out):
    rows = []
    for site in sorted({s.groups[0] for s in all_sets if s.kind == "real"} | {s.groups[0] for s in all_sets if s.kind == "simulated"}):
        for title, kinds in (("as recorded", ("real", "simulated")), ("degraded", ("map", "sensor"))):
            chosen = [i for i, s in enumerate(all_sets) if s.groups == (site,) and s.kind in kinds]
            both = [joined(of[i] for i in chosen) for of in (frames, frames_left_out)]
            if both[0]:
                rows.append([site, title, str(len(both[0]))] + [
                    running.percent(measure(part)) for measure in (measures.success, measures.precision) for part in both])
    return tables.table("Every site left out in turn", "[%] Success and precision of `localized` with the weights learned from "
                        "all other data than the test sites " + ", ".join(sites.LOOKED_AT) + ", and with those learned without the "
                        "site, too.",
                        ["site", "scans and maps", "frames", "success", "left out", "precision", "left out"], rows)


def learn_from_all(arguments, runner):
    found = sites.find(arguments.data)
    if not found:
        sys.exit(f"learn.py: {arguments.data}: no site with a map.yaml; set D2S1R_DATA or --data")
    keys = list(section(runner.default_ini(), "beam_model"))
    all_sets = list(sets.of_sites(found, 5 * arguments.frames, arguments.frames))
    all_sets += list(sets.on_floors(runner.folder, arguments.frames, arguments.floors))
    all_sets += list(sets.strangers(all_sets, max(1, arguments.frames // 2)))
    runner.make_all(all_sets)
    start = fitting.Weights(start_weights(keys, START_BEAM_MODEL), np.array(list(START_TEMPERATURE.values())),
                            start_weights(fitting.PRESENCE, START_PRESENCE))
    weights, places = learn_in_rounds(runner, all_sets, start, keys, PULL)
    ini = to_ini(weights, keys)
    (arguments.output / "learned.ini").write_text(ini)
    frames = [running.read_frames(f) for f in runner.run_all(all_sets, lambda _: ini, False, "learned")]
    without = {site.name: to_ini(fitting.learn(of_other_sites(places, all_sets, (*sites.LOOKED_AT, site.name)), start, PULL), keys)
               for site in found if site.name not in sites.LOOKED_AT}
    frames_left_out = [running.read_frames(f) for f in runner.run_all(
        all_sets, lambda s: without.get(s.groups[0], ini), False, "left out")]
    kinds = {"recorded scans": ("real",), "simulated and drawn": ("simulated", "drawn"), "worse maps": ("map",),
             "lesser sensors": ("sensor",)}
    picture = figures.draw_reliability_of(
        {name: joined(f for s, f in zip(all_sets, frames) if s.kind in of) for name, of in kinds.items()},
        arguments.output / "reliability.png")
    return "\n".join([
        kinds_table(all_sets, frames), sites_table(all_sets, frames, frames_left_out),
        tables.picture("Reliability: the share of right poses in each tenth of the confidence, and the number of frames", picture),
        f"## Weights\n\n```\n{ini}```\n"])


def learn_from_own(arguments, runner):
    defaults = runner.default_ini()
    beam_model, presence, scoring = (section(defaults, name) for name in ("beam_model", "presence_model", "scoring"))
    start = fitting.Weights(np.array(list(beam_model.values())),
                            np.array([scoring[key] for key in START_TEMPERATURE]),
                            np.array([presence[key] for key in fitting.PRESENCE]))
    own = sets.Set("own", "real", ("own",), arguments.map.resolve(), arguments.rawlog.resolve(),
                   arguments.ground_truth.resolve(), (), (f"frames={10 * arguments.frames}",))
    all_sets = [own] + list(sets.in_floors(own, runner.folder, arguments.frames, arguments.floors))
    runner.make_all(all_sets)
    weights, _ = learn_in_rounds(runner, all_sets, start, list(beam_model), PULL)
    ini = to_ini(weights, list(beam_model))
    (arguments.output / "learned.ini").write_text(ini)
    rows = []
    for name, text in (("defaults", ""), ("learned", ini)):
        frames = [running.read_frames(f) for f in runner.run_all(all_sets, lambda _: text, False, name)]
        rows += [[name, "your map"] + summary(frames[0]), [name, "drawn floors"] + summary(joined(frames[1:]))]
    return tables.table("Your scans", "[%] Success: the best pose is within 0.3 m and 5 deg of the truth.",
                        ["weights", "map", *COLUMNS], rows)


def main():
    arguments = read_arguments()
    start = time.monotonic()
    try:
        arguments.output.mkdir(parents=True, exist_ok=True)
        runner = running.Runner(arguments.build.resolve(), arguments.build.resolve() / "learning", arguments.jobs)
        learn = learn_from_own if arguments.rawlog else learn_from_all
        text = learn(arguments, runner)
    except (OSError, RuntimeError, ValueError) as error:
        sys.exit(f"learn.py: {error}")
    minutes = (time.monotonic() - start) / 60
    (arguments.output / "README.md").write_text(
        f"# Learned weights\n\n`experiments/learn.py`, {minutes:.0f} minutes, {arguments.jobs} programs at a "
        f"time.\n\n{text}")
    print(f"\n{arguments.output / 'learned.ini'} in {minutes:.1f} min, tables in {arguments.output / 'README.md'}")


if __name__ == "__main__":
    main()
