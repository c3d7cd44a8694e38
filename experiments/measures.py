# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Numbers out of frames."""
import math

BINS = 10  # [-] of confidence


def mean(values):
    values = list(values)
    return sum(values) / len(values) if values else math.nan


def deviation(values):
    values = list(values)
    middle = mean(values)
    return math.sqrt(mean((value - middle) ** 2 for value in values))


def share(flags):
    """[%]"""
    return 100 * mean(1.0 if flag else 0.0 for flag in flags)


def median(values):
    values = sorted(values)
    return values[len(values) // 2] if values else math.nan


def success(frames):
    return share(frame.right for frame in frames)


def precision(frames):
    """[%] of the frames of status localized that are right."""
    return share(frame.right for frame in frames if frame.status == "localized")


def recall(frames):
    """[%] of all frames that are localized and right."""
    return share(frame.right and frame.status == "localized" for frame in frames)


def mean_time(frames, stage):
    """[ms]"""
    return mean(frame.times[stage] for frame in frames)


def successes(frames):
    return [frame for frame in frames if frame.right]


def confidence_bins(frames):
    """Frames that have a pose, by confidence, BINS bins from 0 to 1."""
    bins = [[] for _ in range(BINS)]
    for frame in frames:
        if math.isfinite(frame.position_error):
            bins[min(int(frame.confidence * BINS), BINS - 1)].append(frame)
    return bins


def calibration_error(frames):
    """Expected calibration error [0, 1]: how far confidence is from the share of right poses, in the mean."""
    bins = [part for part in confidence_bins(frames) if part]
    total = sum(len(part) for part in bins)
    return sum(abs(sum(f.confidence - f.right for f in part)) for part in bins) / total if total else math.nan
