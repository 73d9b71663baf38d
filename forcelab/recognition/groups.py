"""Which demonstrations are left out together."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from itertools import chain, combinations

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.signals.conditioning import bridge

#: More labelled demonstrations than `MANY` are left out in so many groups by default: half
#: an hour of training for each by itself is minutes then, and each is still recognised by a
#: recogniser that has not seen it.
MANY, GROUPS = 20, 10


def default_fold_count(labelled: int) -> int:
    """The default number of groups to leave out; 0: each demonstration by itself."""
    return GROUPS if labelled > MANY else 0


def check_folds(folds: int | None) -> None:
    """Refuse a negative number of groups, or a single one."""
    if folds is not None and (folds < 0 or folds == 1):
        raise InputError(f"Demonstrations are left out in two groups or more, not in {folds}.")


def find_duplicates(demonstrations: Sequence[Demonstration]) -> list[list[int]]:
    """Indices of the demonstrations of each recording, usually one, in order.

    Ids differ as soon as a stamp does; equal signals are still the same recording, and so are those
    that are alike but for rounding, scale, sampling or a little less at the ends.
    """
    places: dict[bytes, list[int]] = {}
    for i, demonstration in enumerate(demonstrations):
        signals = np.ascontiguousarray(demonstration.signals, dtype=np.float64)
        places.setdefault(hashlib.sha256(signals.tobytes()).digest(), []).append(i)
    recordings = list(places.values())
    movements = [_movement(demonstrations[same[0]]) for same in recordings]
    copy_of = list(range(len(recordings)))  # the first one that each is a copy of
    for first, second in combinations(range(len(recordings)), 2):
        if copy_of[second] == second and _are_copies(movements[first], movements[second]):
            copy_of[second] = copy_of[first]
    groups: dict[int, list[int]] = {}
    for i, same in zip(copy_of, recordings, strict=True):
        groups.setdefault(i, []).extend(same)
    return [sorted(group) for group in groups.values()]


#: Movements are compared on a grid (Hz), smoothed (s), over so many common seconds at least, and
#: where the shorter one is at least this share of the longer.
GRID, SMOOTHING, COMMON, SHARE = 50.0, 0.05, 1.0, 0.8
#: Correlation from which two recordings are one. Of the paper's twenty, no two reach 0.91; copies
#: that are rounded to 0.1 N, cropped by 0.1 to 0.5 s, scaled, or thinned to 100 Hz reach 0.995.
ALIKE = 0.98


def _movement(demonstration: Demonstration) -> NDArray[np.float64]:
    """How the smoothed channels change from step to step of a coarse grid, (c, m)."""
    from scipy.ndimage import gaussian_filter1d  # takes long to load

    signals = np.stack([bridge(np.asarray(s, dtype=np.float64)) for s in demonstration.signals.T])
    signals /= float(np.abs(signals).max(initial=0.0)) or 1.0  # squares must not overflow
    # A long gap is no movement.
    times = np.cumsum(
        np.minimum(np.diff(demonstration.times, prepend=demonstration.times[:1]), 1.0)
    )
    bins = np.rint(times * GRID).astype(np.int64)
    counts = np.bincount(bins)
    seen, every = np.flatnonzero(counts), np.arange(len(counts))
    means = [np.bincount(bins, signal)[seen] / counts[seen] for signal in signals]
    rows = np.stack([np.interp(every, seen, mean) for mean in means])
    return np.asarray(np.diff(gaussian_filter1d(rows, SMOOTHING * GRID, axis=1), axis=1))


def _are_copies(first: NDArray[np.float64], second: NDArray[np.float64]) -> bool:
    """Whether two movements (c, m) are one, perhaps shifted against each other."""
    from scipy.fft import irfft, next_fast_len, rfft  # takes long to load

    shorter, longer = sorted((first, second), key=lambda movement: movement.shape[1])
    n, m = shorter.shape[1], longer.shape[1]
    if len(first) != len(second) or n < max(SHARE * m, COMMON * GRID):
        return False
    size = next_fast_len(n + m, real=True)
    products = irfft((rfft(longer, size) * rfft(shorter, size).conj()).sum(axis=0), size)
    shift = int(np.argmax(products))
    shift -= size if shift >= m else 0
    common = slice(max(shift, 0), min(m, n + shift))
    a, b = longer[:, common], shorter[:, common.start - shift : common.stop - shift]
    energy = math.sqrt(float(np.square(a).sum()) * float(np.square(b).sum()))
    return a.shape[1] >= SHARE * n and energy > 0 and float((a * b).sum()) >= ALIKE * energy


def fold_groups(demonstrations: Sequence[Demonstration], folds: int | None) -> list[list[int]]:
    """Indices of the demonstrations that are left out together, one group after the other.

    Neighbours in the order are in different groups, so that each group has some of every task;
    those that hold the same recording are left out together. With 0 or None folds each recording is
    a group.
    """
    check_folds(folds)
    recordings = find_duplicates(demonstrations)
    parts = min(folds or len(recordings), len(recordings))
    return [sorted(chain(*recordings[first::parts])) for first in range(parts)]
