#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Measures what would let the presence model tell scans of nowhere from those of the map.

    /usr/bin/python3 experiments/presence.py --frames 20

It is learned (a logistic regression, see learn.py) from recorded scans in their maps, scans in maps of other places, and
mirrored scans, whose beams are in the wrong order. Each row of the table has other features, or counts mirrored scans
otherwise. Each quarter of the sites is judged by what was learned from the others. The bias is then such that as many
recorded scans are localized, and right, as with the defaults, but for --loss. The table goes to standard output; scans
and results of programs are kept in the folder learning of the build.

Needs what learn.py needs, and a build with its tests' programs.
"""
import argparse
import pathlib
import sys

sys.dont_write_bytecode = True  # the folder is part of the sources

import learn  # noqa: E402 first: it says what is missing
import numpy as np  # noqa: E402
import sites  # noqa: E402
import tables  # noqa: E402
from learning import fitting, running, sets  # noqa: E402

KINDS = ("real", "stranger", "mirrored")
MORE = {  # features that the presence model does not have
    "contradicted share": lambda score, value: score["contradicted"] / np.maximum(score["beam"], 1),
    "explained share": lambda score, value: score["explained"],
    "log-likelihood a beam": lambda score, value: value / np.maximum(score["beam"], 1)}
VARIANTS = [((), 0.0), ((), 0.1), ((), 0.5), ((), 2.0)] + [((name,), 0.5) for name in MORE] + [(tuple(MORE), 0.5)]
FOLDS = 4  # [-] parts of the sites
PULL = 5.0  # [frame] strength with which weights stay at zero


def sets_of(found, runner, frames):
    every = list(sets.of_sites(found, 5 * frames, frames))
    every += list(sets.on_floors(runner.folder, frames))
    every += list(sets.strangers(every, max(1, frames // 2))) + list(sets.mirrored(every, max(1, frames // 2)))
    return [set_ for kind in KINDS for set_ in every if set_.kind == kind]


class Frames:
    """What the defaults say of each scan."""

    def __init__(self, places, chosen, ini):
        beam_model, presence, scoring = (learn.section(ini, name) for name in ("beam_model", "presence_model", "scoring"))
        weights = np.array(list(beam_model.values()))
        temperature = np.array([scoring[key] for key in learn.START_TEMPERATURE])
        places = fitting.of_frames_mask(places, fitting.rank(places, weights).best >= 0)
        ranked = fitting.rank(places, weights)
        self.features = fitting.presence_features(places, ranked, temperature)
        self.has_right, self.is_right = ranked.has_right, ranked.is_right
        score = {name: values[ranked.best] for name, values in places.score.items()}
        self.more = {name: function(score, ranked.value[ranked.best]) for name, function in MORE.items()}
        self.kind = np.array([set_.kind for set_ in chosen])[places.set_of_frame]
        self.fold = np.unique([set_.groups[0] for set_ in chosen], return_inverse=True)[1][places.set_of_frame] % FOLDS
        now = np.array([presence[key] for key in fitting.PRESENCE])
        self.odds = self.features @ now
        self.share = fitting.confidences(places, ranked, temperature, now) * (1 + np.exp(-self.odds))  # of the best place
        self.localized_above = scoring["localized_above"]

    def localized(self, odds):
        return self.share / (1 + np.exp(-odds)) > self.localized_above

    def learned_odds(self, names, count):
        """Log-odds of presence [frame] with more features, each learned from the other sites."""
        features = np.column_stack([self.features, *(self.more[name] for name in names)])
        counts = np.array([learn.COUNTS.get(kind, count) for kind in self.kind])
        odds = np.zeros(len(features))
        for fold in range(FOLDS):
            out = self.fold == fold
            weights = fitting.fit_presence(features[~out], self.has_right[~out].astype(float), counts[~out],
                                           np.zeros(features.shape[1]), PULL)
            odds[out] = features[out] @ weights
        return odds

    def recall(self, odds):
        real = self.kind == "real"
        return 100 * np.mean((self.localized(odds) & self.is_right)[real])

    def shifted(self, odds, least):
        """The odds with the smallest bias that keeps so much recall [%]."""
        for bias in np.arange(-15, 15, 0.02):
            if self.recall(odds + bias) >= least:
                return odds + bias
        return odds + bias

    def row(self, name, count, odds):
        wrong = self.localized(odds) & ~self.is_right
        return [name, count, f"{self.recall(odds):.1f}", *(f"{100 * np.mean(wrong[self.kind == kind]):.2f}" for kind in KINDS)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=learn.PROJECT / "build/release", help="build folder")
    parser.add_argument("--data", type=pathlib.Path, default=sites.default_folder(learn.PROJECT), help="folder of the sites")
    parser.add_argument("--frames", type=int, default=40, help="as of learn.py (default 40)")
    parser.add_argument("--loss", type=float, default=0.3, help="of recorded scans localized [points] (default 0.3)")
    parser.add_argument("--jobs", type=int, default=2, help="programs that run at a time (default 2)")
    arguments = parser.parse_args()
    build = arguments.build.resolve()
    try:
        found = sites.find(arguments.data)
        if not found:
            raise ValueError(f"{arguments.data}: no site with a map.yaml; set D2S1R_DATA or --data")
        runner = running.Runner(build, build / "learning", arguments.jobs)
        chosen = sets_of(found, runner, arguments.frames)
        runner.make_all(chosen)
        folders = runner.run_all(chosen, lambda _: "", True, "terms")
        places = fitting.load_places([folder / "terms.csv.gz" for folder in folders], [1.0] * len(chosen))
    except (OSError, RuntimeError, ValueError) as error:
        sys.exit(f"presence.py: {error}")
    frames = Frames(places, chosen, runner.default_ini())
    rows = [frames.row("the defaults", "-", frames.odds)]
    for names, count in VARIANTS:
        odds = frames.shifted(frames.learned_odds(names, count), frames.recall(frames.odds) - arguments.loss)
        rows.append(frames.row(", ".join(names) or "none", f"{count:g}", odds))
    counts = ", ".join(f"{np.sum(frames.kind == kind)} {kind}" for kind in KINDS)
    print(tables.table(
        "What tells scans of nowhere", f"Frames: {counts}. Localized, [%] of the frames of each kind; a mirrored one counts as "
        "much as the second column says, a recorded one 4.",
        ["more features", "mirrored", "recorded: right", *(f"{kind}: wrong" for kind in ("recorded", "of elsewhere", "mirrored"))],
        rows))


if __name__ == "__main__":
    main()
