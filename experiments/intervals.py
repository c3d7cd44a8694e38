#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Confidence intervals for scans of drives, which are not independent: intervals.py [--series N]

Scans a quarter of a metre apart succeed and fail together: where one fails, the next one does, too. Failures are of one group
if they are no farther apart than the lag up to which the autocorrelation of failures is above chance. The interval is the wider
one of two at each end, since each is too narrow where the other one is not:

- Groups begin and end as a chain of Markov does whose two probabilities are known as well as the transitions that were seen
  tell (Beta distributions, prior of Jeffreys). This gives the distribution of the share of scans in groups; of the scans in
  groups, as many fail as did. Without any failure the length of groups is not known: half an end of one is taken as seen, by hand.
  Of two methods, each has one more group in which it is better, as long as those of the other one in the mean.
- A drive is cut into blocks, each from the first failure of a group to the next group. A bootstrap that draws whole blocks has a
  variance that can be written down. It gives the number of independent scans that would be worth as much, and this the interval
  of Wilson, with a quantile of Student's t for the number of groups.

Nothing is drawn at random. A difference of two shares of one drive has the interval by those of both (Newcombe 1998, method 10).

The command shows how often such intervals hold the true share: it simulates drives whose failures come in runs.

Needs Debian's python3-numpy and python3-scipy.
"""
import argparse
import math
import random
import sys

import numpy as np
from scipy.special import betainc, betaincinv

RARE = 0.3  # [0, 1] share of failures below which groups come as events of a Poisson process
FEWEST = 3  # [-] groups, below which failures must be closer together to be of one
QUANTILE = 1.959964  # [-] of the normal distribution, for 95 %


def student(freedom):
    """[-] 97.5 % quantile of Student's t; Abramowitz and Stegun 26.7.5, within 0.1 from 3 degrees of freedom on."""
    z, n = QUANTILE, max(3, freedom)
    return (z + (z**3 + z) / (4 * n) + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * n**2) +
            (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * n**3))


def wilson(share, count, z=QUANTILE):
    """Interval of a share [0, 1] of `count` independent trials, Wilson 1927."""
    middle = (share + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    return max(0.0, middle - half), min(1.0, middle + half)


def correlated_lag(values):
    """[scans] the last lag up to which the autocorrelation is above what chance gives, twice its deviation."""
    count = len(values)
    mean = sum(values) / count
    off = [value - mean for value in values]
    power = sum(value * value for value in off)
    chance = 2 * math.sqrt(math.log10(count) / count) if count > 1 else 1
    lag = 0
    while power > 0 and lag + 1 < count // 4:
        if sum(a * b for a, b in zip(off, off[lag + 1:])) / power <= chance:
            break
        lag += 1
    return lag


def groups_of(places, gap):
    """The first of each group of places that are no farther apart than `gap`."""
    return [b for a, b in zip([-math.inf, *places], places) if b - a > gap]


def gap_in(failures):
    """[scans] between two failures of one drive that are of one group, at most."""
    places = [place for place, fails in enumerate(failures) if fails]
    gap = max(1, correlated_lag(failures)) if 0 < len(places) < RARE * len(failures) else 1
    while gap > 1 and len(groups_of(places, gap)) < FEWEST:
        gap //= 2
    return gap


def variance_of_sum(failures):
    """(variance of the number of failures, their groups) of one drive: of a bootstrap that draws whole blocks."""
    places = [place for place, fails in enumerate(failures) if fails]
    if not places:
        return 0.0, 0
    share = len(places) / len(failures)
    starts = groups_of(places, gap_in(failures))
    ends = [*starts[1:], len(failures)]
    sums = [sum(failures[a:b]) for a, b in zip(starts, ends)]
    lengths = [b - a for a, b in zip(starts, ends)]
    lengths[-1] += starts[0]  # the drive is closed to a ring
    blocks = sum((total - share * length) ** 2 for total, length in zip(sums, lengths))
    events = (1 - share) * sum(total * total for total in sums)
    return (max(blocks, events) if share < RARE or len(starts) == 1 else blocks), len(starts)


def groups_in(failures):
    """Flags of the scans of one drive that lie in groups of failures."""
    flags, gap = list(failures), gap_in(failures)
    places = [place for place, fails in enumerate(failures) if fails]
    for a, b in zip(places, places[1:]):
        if b - a <= gap:
            flags[a:b] = [True] * (b - a)
    return flags


def transitions_of(groups):
    """[scans] by whether they lie in a group, and whether the next one does"""
    counts = np.zeros((2, 2))
    for flags in groups:
        np.add.at(counts, (np.array(flags[:-1], int), np.array(flags[1:], int)), 1)
    return counts


def interval_of_groups(drives, likes):
    r"""Interval of the share [0, 1] of failures whose groups begin and end by chance. \p drives: flags of failure for each
    \p likes: flags whose groups are as long as those of failures"""
    groups = [groups_in(drive) for drive in drives]
    transitions = transitions_of(groups)
    failures, inside = sum(map(sum, drives)), sum(map(sum, groups))
    like = transitions_of([groups_in(drive) for drive in likes])[1]
    if like[0]:
        transitions[1] += like / like[0]  # as if the end of one group were seen
    unseen = 0 if transitions[1].any() else 0.5  # ends of a group
    ends = betaincinv(transitions[1, 0] + unseen + 0.5, transitions[1, 1] + 0.5, (np.arange(200) + 0.5) / 200)

    def probability(share):  # that the true share of scans in groups is less
        begins = np.clip(ends * share / (1 - share), 0, 1)
        return betainc(transitions[0, 1] + 0.5, transitions[0, 0] + 0.5, begins).mean()

    def quantile(wanted):
        low, high = 0.0, 1.0
        for _ in range(40):
            middle = (low + high) / 2
            low, high = (middle, high) if probability(middle) < wanted else (low, middle)
        return low

    fail_inside = failures / inside if failures else 1
    return fail_inside * quantile(0.025) if failures else 0.0, fail_inside * quantile(0.975)


def interval_of_blocks(drives):
    r"""Interval of the share [0, 1] of failures if whole blocks are drawn. \p drives: flags of failure for each"""
    count, failures = sum(map(len, drives)), sum(map(sum, drives))
    share = failures / count
    parts = [variance_of_sum(drive) for drive in drives]
    groups = sum(part[1] for part in parts)
    if not groups:
        return wilson(share, count)
    variance = max(sum(part[0] for part in parts) * (1 + 1 / groups), count * share * (1 - share))
    return wilson(share, count * count * share * (1 - share) / variance if variance else count, student(4 * groups))


def share_interval(drives, likes=()):
    r"""95 % interval [%] of the share of true flags. \p drives: a list of flags for each drive, in the order of the scans
    \p likes: see interval_of_groups()"""
    drives = [[bool(flag) for flag in drive] for drive in drives if drive]
    count, right = sum(map(len, drives)), sum(map(sum, drives))
    if not count:
        return math.nan, math.nan
    rare = 2 * right > count  # failures are rarer than successes
    failures = [[flag != rare for flag in drive] for drive in drives]
    (low_a, high_a), (low_b, high_b) = interval_of_groups(failures, likes), interval_of_blocks(failures)
    low, high = min(low_a, low_b), max(high_a, high_b)
    return (100 * (1 - high), 100 * (1 - low)) if rare else (100 * low, 100 * high)


def share_interval_of_places(places):
    r"""The same for buildings of which these are a sample: whole buildings are drawn. \p places: a list of flags for each"""
    places = [place for place in places if place]
    count = sum(map(len, places))
    share = sum(map(sum, places)) / count
    spread = sum((sum(place) - share * len(place)) ** 2 for place in places) * len(places) / max(1, len(places) - 1)
    variance = max(spread, count * share * (1 - share))
    worth = count * count * share * (1 - share) / variance if variance > 0 else count
    low, high = wilson(share, worth, student(len(places) - 1))
    return 100 * low, 100 * high


def difference_interval(drives):
    r"""(mean, low, high) [%] of paired differences. \p drives: a list of -1, 0 and 1 for each drive"""
    drives = [list(drive) for drive in drives if drive]
    count = sum(map(len, drives))
    if not count:
        return (math.nan,) * 3
    more, less = ([[value == sign for value in drive] for drive in drives] for sign in (1, -1))
    (low_more, high_more), (low_less, high_less) = share_interval(more, less), share_interval(less, more)
    of_more, of_less = (100 * sum(map(sum, flags)) / count for flags in (more, less))
    mean = of_more - of_less
    return (mean, max(-100, mean - math.hypot(of_more - low_more, high_less - of_less)),
            min(100, mean + math.hypot(high_more - of_more, of_less - low_less)))


def runs_of_failures(count, share, length, dice):
    """Flags of success: runs of failures and of successes, their lengths geometric; `length`: mean of a run of failures."""
    flags, fails = [], dice.random() < share
    while len(flags) < count:
        mean = length if fails else length * (1 - share) / share
        run = 1 if mean <= 1 else 1 + int(math.log(1 - dice.random()) / math.log(1 - 1 / mean))
        flags += [not fails] * run
        fails = not fails
    return flags[:count]


def below_a_level(count, share, length, dice):
    """Flags of success: failures where a random walk that returns to its mean is below a level."""
    level, low = -8.0, 0.0
    while low < share:
        level += 0.001
        low = 0.5 * math.erfc(-level / math.sqrt(2))
    keep = math.exp(-1 / length)
    state, flags = dice.gauss(0, 1), []
    for _ in range(count):
        state = keep * state + math.sqrt(1 - keep * keep) * dice.gauss(0, 1)
        flags.append(state >= level)
    return flags


def now_and_then(count, share, length, dice):
    """Flags of success: in runs of a mean length six of ten scans fail, and none elsewhere."""
    return [flag or dice.random() > 0.6 for flag in runs_of_failures(count, share / 0.6, length, dice)]


# scans of a drive, share of failures, mean length of a run [scans] or of what is remembered
DRIVES = ((60, 0.1, 5), (96, 0.05, 8), (96, 0.3, 15), (200, 0.3, 20), (300, 0.05, 3), (300, 0.2, 5), (533, 0.4, 58), (1000, 0.05, 1.6),
          (1000, 0.02, 3), (1000, 0.2, 10), (1000, 0.5, 5), (1239, 0.22, 11), (3317, 0.5, 120))
MODELS = {"runs": runs_of_failures, "level": below_a_level, "now and then": now_and_then}


def coverage(model, drive, series, dice):
    """(share, by Wilson for independent scans, difference of two) [%] of the intervals that hold the truth."""
    count, share, length = drive
    ours = independent = differences = 0
    for _ in range(series):
        flags, others = (MODELS[model](count, share, length, dice) for _ in range(2))
        low, high = share_interval([flags])
        ours += low <= 100 * (1 - share) <= high
        low, high = wilson(sum(flags) / count, count)
        independent += low <= 1 - share <= high
        _, low, high = difference_interval([[a - b for a, b in zip(flags, others)]])
        differences += low <= 0 <= high
    return [100 * held / series for held in (ours, independent, differences)]


def coverage_of_places(series, dice):
    """[%] of the intervals that hold the mean of the buildings that eight are a sample of."""
    held = 0
    for _ in range(series):
        shares = [dice.betavariate(3, 1) for _ in range(8)]
        low, high = share_interval_of_places([runs_of_failures(dice.randint(55, 200), 1 - min(0.98, share), 5, dice) for share in shares])
        held += low <= 75 <= high
    return 100 * held / series


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--series", type=int, default=400, help="drives of each kind (default 400)")
    arguments = parser.parse_args()
    print("| failures | scans | share [%] | length | held [%] | difference held [%] | held by Wilson's for independent scans [%] |\n" +
          "| --- " * 7 + "|")
    dice, held = random.Random(1), []
    for model in MODELS:
        for drive in DRIVES:
            ours, independent, differences = coverage(model, drive, arguments.series, dice)
            held.append(ours)
            print(f"| {model} | {drive[0]} | {100 * drive[1]:g} | {drive[2]} | {ours:.1f} | {differences:.1f} | {independent:.1f} |",
                  flush=True)
    print(f"\nOver all: {sum(held) / len(held):.1f} % of nominal 95 %, {min(held):.1f} to {max(held):.1f}; "
          f"of eight buildings {coverage_of_places(arguments.series, dice):.1f} %.")
    sys.exit(not (93 <= sum(held) / len(held) <= 97 and min(held) > 70))


if __name__ == "__main__":
    main()
