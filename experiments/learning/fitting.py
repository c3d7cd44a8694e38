# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Learns the weights of the beam model, the temperature and the presence model from what write_terms wrote."""
import dataclasses
import gzip

import numpy as np
from scipy import optimize

# Columns before the terms.
SCORE = ("log_likelihood", "explained", "beam", "contradicted", "unknown_metre", "surfaces", "tolerance")
HOPELESS = 0.1  # [-] probability that anything else than the likelihoods decided which place is right
MOST_LEAD = 12.0  # [-] as in decide()
# [beam of 1 deg] Margins are given in nat, so weights are scaled: with so many that contradict a sharp map, the
# difference of two log-likelihoods is the log-odds of the two places.
USUALLY_CONTRADICTED = 10.0
PRESENCE = ("bias", "beam", "unknown_metre", "log_likelihood", "lead", "surfaces")


@dataclasses.dataclass
class Places:
    """The compared places of many frames, those of a frame one after the other."""
    terms: np.ndarray  # [place, term]
    score: dict  # name -> [place], of Score
    right: np.ndarray  # [place] bool
    added: np.ndarray  # [place] bool: at the truth, which the search had not found
    first: np.ndarray  # [frame + 1] index of its first place
    set_of_frame: np.ndarray  # [frame] number of the set
    weight: np.ndarray  # [frame] how much it counts

    @property
    def frame_of(self):
        return np.repeat(np.arange(len(self.first) - 1), np.diff(self.first))


def term_names(file):
    with gzip.open(file, "rt") as stream:
        return stream.readline().strip().split(",")[3 + len(SCORE):]


def load_places(files, weights):
    """Of all sets, in their order: \\p files are those that write_terms wrote, \\p weights how much a frame counts."""
    blocks, firsts, sets, rows = [], [], [], 0
    for number, file in enumerate(files):
        block = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
        if block.size == 0:
            continue
        first = np.flatnonzero(np.diff(block[:, 0], prepend=-1))
        blocks.append(block)
        firsts.append(first + rows)
        sets.append(np.full(len(first), number))
        rows += len(block)
    table = np.concatenate(blocks)
    score = {name: table[:, 3 + i] for i, name in enumerate(SCORE)}
    return Places(table[:, 3 + len(SCORE):], score, table[:, 1] > 0, table[:, 2] > 0,
                  np.append(np.concatenate(firsts), rows), np.concatenate(sets), np.array(weights)[np.concatenate(sets)])


def of_sets(places, wanted):
    """The frames of the sets for which \\p wanted (bool by number of the set) holds."""
    return of_frames_mask(places, wanted[places.set_of_frame])


def of_frames(values, places, operation):
    return operation.reduceat(values, places.first[:-1])


def log_sum(values, places, mask=None):
    """ln of the sum of exp(values) over each frame; of those in \\p mask only."""
    values = values if mask is None else np.where(mask, values, -np.inf)
    most = of_frames(values, places, np.maximum)
    most = np.where(np.isfinite(most), most, 0)
    with np.errstate(divide="ignore"):
        return most + np.log(of_frames(np.exp(values - most[places.frame_of]), places, np.add))


def minimize(loss, start, scale, pull):
    """The minimum of loss(weights) -> (value, gradient), with a pull back to \\p start: `pull` times the squares of
    the differences in units of `scale`."""
    def whole(x):
        weights = start + x / scale
        value, gradient = loss(weights)
        return value + pull * x @ x, gradient / scale + 2 * pull * x

    found = optimize.minimize(whole, np.zeros_like(start), jac=True, method="L-BFGS-B",
                              options={"maxiter": 2000, "ftol": 1e-13, "gtol": 1e-8})
    return start + found.x / scale


def fit_beam_model(places, start, pull):
    """Conditional logit: the weights that make the right place of a frame the most probable of those compared. It is a
    robust one: a frame in which the right place has no chance does not count the more the worse it is."""
    has_both = of_frames(places.right, places, np.logical_or) & ~of_frames(places.right, places, np.logical_and)
    chosen = of_frames_mask(places, has_both)
    frame = chosen.frame_of

    def loss(weights):
        value = chosen.terms @ weights
        all_, right = log_sum(value, chosen), log_sum(value, chosen, chosen.right)
        share = (1 - HOPELESS) * np.exp(right - all_)
        p_all = np.exp(value - all_[frame])
        p_right = np.where(chosen.right, np.exp(value - right[frame]), 0)
        slope = chosen.weight * share / (share + HOPELESS)
        return float(-chosen.weight @ np.log(share + HOPELESS)), chosen.terms.T @ ((p_all - p_right) * slope[frame])

    spread = np.sqrt(np.mean((chosen.terms - (of_frames_sum(chosen.terms, chosen) /
                                               np.diff(chosen.first)[:, None])[frame]) ** 2, axis=0))
    return minimize(loss, start, np.maximum(spread, 1e-6), pull)


def of_frames_mask(places, frames):
    """The frames for which \\p frames (bool by frame) holds."""
    mask = frames[places.frame_of]
    return Places(places.terms[mask], {name: v[mask] for name, v in places.score.items()}, places.right[mask],
                  places.added[mask], np.concatenate([[0], np.cumsum(np.diff(places.first)[frames])]),
                  places.set_of_frame[frames], places.weight[frames])


def of_frames_sum(values, places):
    return np.add.reduceat(values, places.first[:-1], axis=0)


@dataclasses.dataclass
class Ranked:
    """The frames as decide() sees them, with given weights of the beam model."""
    best: np.ndarray  # [frame] index of the best place found
    value: np.ndarray  # [place] log-likelihood, -inf of added ones
    is_right: np.ndarray  # [frame] bool: the best place is
    has_right: np.ndarray  # [frame] bool: one of the places found is


def rank(places, weights):
    value = np.where(places.added, -np.inf, places.terms @ weights)
    most = of_frames(value, places, np.maximum)
    frame = places.frame_of
    found = np.isfinite(most)
    order = np.flatnonzero((value == most[frame]) & found[frame])
    best = np.full(len(most), -1)
    best[frame[order][::-1]] = order[::-1]
    right = places.right & ~places.added
    return Ranked(best, value, found & places.right[best], found & of_frames(right, places, np.logical_or))


def fit_temperature(places, ranked, start, pull):
    """Of frames in which a place found is right, and another one is not; with a pull back to \\p start, where x is
    pulled by `pull` times the square of 2 (x - start) / (x + start), some ln(x / start)."""
    frame = places.frame_of
    right = places.right & ~places.added
    used = ranked.has_right & (of_frames(~right & ~places.added, places, np.add) > 0)

    def loss(x):
        value = ranked.value / np.maximum(tempering(places, ranked, x), 0.05)[frame]
        away = 2 * (x - start) / (x + start)
        unlikely = (log_sum(value, places) - log_sum(value, places, right))[used]
        return float(places.weight[used] @ unlikely + pull * away @ away)

    found = optimize.minimize(loss, start, method="Nelder-Mead", bounds=[(0.1, 10), (0, 0.1), (0, 100)],
                              options={"xatol": 1e-5, "fatol": 1e-4, "maxiter": 2000})
    return found.x


def tempering(places, ranked, temperature):
    """[-] by which the differences of each frame's log-likelihoods are divided, as in decide()."""
    base, by_beam, by_tolerance = temperature
    best = {name: places.score[name][ranked.best] for name in ("contradicted", "tolerance")}
    return (1 + by_tolerance * best["tolerance"]) * (base + by_beam * best["contradicted"])


def presence_features(places, ranked, temperature):
    best = ranked.best
    score = {name: values[best] for name, values in places.score.items()}
    others = ranked.value.copy()
    others[best] = -np.inf
    second = of_frames(others, places, np.maximum)
    lead = np.minimum(MOST_LEAD, (ranked.value[best] - second) / tempering(places, ranked, temperature))
    return np.column_stack([
        np.ones_like(lead), score["beam"], score["unknown_metre"], ranked.value[best], lead,
        np.log1p(score["surfaces"])])


def fit_presence(features, has_right, counts, start, pull):
    """Logistic regression; \\p counts: how much each frame does."""
    def loss(weights):
        odds = features @ weights
        value = counts @ (np.logaddexp(0, odds) - has_right * odds)
        return float(value), features.T @ (counts * (1 / (1 + np.exp(-odds)) - has_right))

    spread = np.maximum(features.std(0), 1e-6)
    spread[0] = 1
    return minimize(loss, start, spread, pull)


def confidences(places, ranked, temperature, presence):
    """[0, 1] of each frame, as decide() gives it."""
    features = presence_features(places, ranked, temperature)
    present = 1 / (1 + np.exp(-features @ presence))
    value = ranked.value / tempering(places, ranked, temperature)[places.frame_of]
    return present * np.exp(value[ranked.best] - log_sum(value, places))


@dataclasses.dataclass
class Weights:
    """All that is learned."""
    beam_model: np.ndarray
    temperature: np.ndarray
    presence: np.ndarray


def learn(places, start, pull):
    """\\p start: Weights that the result is pulled to, by \\p pull frames."""
    beam_model = fit_beam_model(places, start.beam_model, pull)
    ranked = rank(places, beam_model)
    found = of_frames_mask(places, ranked.best >= 0)
    ranked = rank(found, beam_model)
    temperature = fit_temperature(found, ranked, start.temperature, pull)
    scale = temperature[0] + temperature[1] * USUALLY_CONTRADICTED
    beam_model, temperature = beam_model / scale, temperature / [scale, scale, 1]
    ranked = rank(found, beam_model)
    features = presence_features(found, ranked, temperature)
    return Weights(beam_model, temperature, fit_presence(features, ranked.has_right, found.weight, start.presence, pull))
