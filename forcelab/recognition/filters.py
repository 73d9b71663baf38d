"""The paper's three filters on predicted codes: threshold, median, drop.

Each takes codes (n,) and gives new ones, so that any of them can be used alone. Unlabelled is
:data:`forcelab.labels.UNLABELLED`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import rank_filter

from forcelab.arrays import Codes, Real
from forcelab.errors import InputError
from forcelab.labels import UNLABELLED
from forcelab.sample_runs import sample_ends, stretches
from forcelab.segment_edits import SLIVER


def threshold(codes: Codes, probabilities: NDArray[np.floating], at: float = 0.8) -> Codes:
    """Unlabel samples of which no probability (n, k) reaches `at`, in 0..1; NaN reaches nothing."""
    if not 0 <= at <= 1:
        raise InputError(f"The probability threshold must lie between 0 and 1, not at {at}.")
    return np.where(np.max(probabilities, axis=1, initial=0.0) >= at, codes, UNLABELLED)


def median(codes: Codes, width: int = 10) -> Codes:
    """Running median over the label *numbers*, as in the paper.

    The order of the actions has no meaning, so a median over their numbers can give an action that
    no sample near by has: between actions 1 and 5 it may say 3. An even width does so at every
    change, because it takes the mean of the two middle numbers, halves rounded up. Unlabelled
    counts as the number -1. It is kept because the paper did it; use it to repeat the paper, not to
    improve a prediction. The window goes from ``width // 2`` samples before to ``(width - 1) // 2``
    after; beyond its ends the recording goes on with its end values. Stamps, and gaps between them,
    play no part.
    """
    if width < 1:
        raise InputError(f"The median filter must be at least 1 sample wide, not {width}.")
    if len(codes) == 0:
        return codes.copy()
    # So wide a window is mostly end values, the first and the last: one more of each moves the
    # median, which lies between them, no more.
    width = min(width, 2 * len(codes) + 2 + width % 2)
    before, after = width // 2, (width - 1) // 2
    # Extended here, so that scipy never sees a window wider than what it filters.
    extended = np.pad(codes, (before, after), mode="edge")
    low, high = (
        rank_filter(extended, rank=rank, size=width)[before : before + len(codes)]
        for rank in ((width - 1) // 2, width // 2)
    )
    return (low + high + 1) // 2


def drop_short(
    codes: Codes, times: Real, shortest: Mapping[int, float], share: float = 1 / 8
) -> Codes:
    """Unlabel segments shorter than a share of their action's shortest training segment (s).

    `times` (n,) are strictly increasing seconds; segments of a code that `shortest` lacks stay. A
    segment is as long as :func:`forcelab.labels.from_codes` makes it, to within float dust; a gap
    splits it.
    """
    if not share >= 0:
        raise InputError(f"The share of the shortest segment must not be negative, as {share} is.")
    runs = stretches(codes, times, sample_ends(times))
    limits = np.zeros(int(runs.codes.max(initial=UNLABELLED)) + 1)
    for code, seconds in shortest.items():
        if 0 <= code < len(limits):
            limits[code] = share * seconds
    short = runs.seconds < limits[runs.codes] - SLIVER
    dropped = np.zeros(len(codes) + 1, dtype=np.int64)
    dropped[runs.firsts[short]] += 1
    dropped[runs.lasts[short]] -= 1
    return np.where(np.cumsum(dropped[:-1]) > 0, UNLABELLED, codes)
