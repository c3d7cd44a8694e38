# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Finds numbers by trying each at a half, at double and switched off, and tells gains from chance."""
import dataclasses
import math

# What a frame counts: R right and sure, r right, - wrong, W wrong and sure, which is ten times as bad as R is good.
POINTS = {"R": 2, "r": 1, "-": 0, "W": -20}
BLOCK = 10  # [frames] neighbours fare alike, so that chance is in blocks of them
ROUNDS = 4  # [-] of changes, at most
DIGITS = 3  # [-] of the numbers found


@dataclasses.dataclass(frozen=True)
class Constant:
    name: str  # section.key
    start: float
    off: float = None  # with which its heuristic is off, if there is such a number
    greatest: float = math.inf
    is_whole: bool = False

    def fit(self, value):
        value = min(value, self.greatest)
        return float(max(1, round(value))) if self.is_whole else float(f"{value:.{DIGITS}g}")

    def variants(self, value):
        """{what: value} of those that differ from `value`."""
        wanted = {"half": self.fit(value / 2), "double": self.fit(value * 2)}
        if self.off is not None:
            wanted["off"] = float(self.off)
        return {what: wanted[what] for what in ("off", "half", "double") if what in wanted and wanted[what] != value}


def points(runs):
    return sum(POINTS[letter] for run in runs for letter in run)


def gain(runs, usual):
    """Points gained, and three standard deviations of what chance makes of as many changes: two would be exceeded by some
    of a hundred variants that change nothing.
    \\p runs a text of letters by run, \\p usual the same to compare with."""
    total, squares = 0, 0
    for run, before in zip(runs, usual):
        for first in range(0, len(run), BLOCK):
            change = points([run[first:first + BLOCK]]) - points([before[first:first + BLOCK]])
            total += change
            squares += change * change
    return total, 3 * math.sqrt(squares)


def is_gain(runs, usual):
    total, chance = gain(runs, usual)
    return total > chance


def sweep(evaluate, constants, point):
    """[(constant, what, value, letters)] of all variants of a point, one constant at a time."""
    tried = [(constant, what, value) for constant in constants
             for what, value in constant.variants(point[constant.name]).items()]
    found = evaluate([{**point, constant.name: value} for constant, _, value in tried])
    return [(*variant, runs) for variant, runs in zip(tried, found)]


def improved(evaluate, constants, point):
    """The point with the variants that gain, as many of the best of them as gain together; None if none does."""
    usual = evaluate([point])[0]
    best = {}
    for constant, _, value, runs in sweep(evaluate, constants, point):
        total, chance = gain(runs, usual)
        if total > chance and total > best.get(constant.name, (0, 0))[0]:
            best[constant.name] = (total, value)
    steps = sorted(best.items(), key=lambda item: (-item[1][0], item[0]))
    together, reached = [], dict(point)
    for name, (_, value) in steps:
        reached = {**reached, name: value}
        together.append(reached)
    candidates = [(points(runs), candidate) for candidate, runs in zip(together, evaluate(together))
                  if is_gain(runs, usual)] if together else []
    return max(candidates, key=lambda pair: pair[0])[1] if candidates else None


def search(evaluate, constants, say):
    """The best point that halves, doubles and what is switched off lead to from the start."""
    point = {constant.name: constant.start for constant in constants}
    for number in range(1, ROUNDS + 1):
        better = improved(evaluate, constants, point)
        if not better:
            break
        changed = [f"{name} {point[name]:g} -> {value:g}" for name, value in better.items() if value != point[name]]
        say(f"round {number}: " + ", ".join(changed))
        point = better
    return point
