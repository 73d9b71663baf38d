"""The paper's three filters on predicted codes: threshold, median, drop.

Each takes codes and gives new ones, so that any of them can be used alone. Unlabelled is
:data:`forcelab.labels.UNLABELLED` throughout.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import rank_filter

from forcelab.errors import InputError
from forcelab.labels import UNLABELLED
from forcelab.runs import sample_ends, stretches

#: Seconds by which a segment may fall short of a limit and still count as reaching it: far below
#: any sample period, far above the rounding of the stamps that its length is the difference of.
ROUNDING = 1e-9


def threshold(
    codes: NDArray[np.int64], probabilities: NDArray[np.floating], at: float = 0.8
) -> NDArray[np.int64]:
    """Leave unlabelled what the classifier is not sure of.

    Parameters
    ----------
    codes : ndarray of int64, shape (n,)
        Predicted codes.
    probabilities : ndarray, shape (n, k)
        Probability of each action at each sample.
    at : float
        The least best probability that is kept, in 0..1.

    Returns
    -------
    ndarray of int64, shape (n,)
        `codes`, unlabelled where no probability reaches `at`; NaN reaches nothing.

    Raises
    ------
    InputError
        If `at` is not in 0..1.
    """
    if not 0 <= at <= 1:
        raise InputError(f"The probability threshold must lie between 0 and 1, not at {at}.")
    return np.where(np.max(probabilities, axis=1, initial=0.0) >= at, codes, UNLABELLED)


def median(codes: NDArray[np.int64], width: int = 10) -> NDArray[np.int64]:
    """Running median over the label *numbers*, as in the paper.

    The order of the actions has no meaning, so a median over their numbers can give an action
    that no sample near by has: between actions 1 and 5 it may say 3. An even width does so at
    every change, because it takes the mean of the two middle numbers. Unlabelled counts as the
    number -1. It is kept because the paper did it; use it to repeat the paper, not to improve
    a prediction. Stamps, and gaps between them, play no part.

    Parameters
    ----------
    codes : ndarray of int64, shape (n,)
        Predicted codes.
    width : int
        Samples in the window, at least 1, from ``width // 2`` before the sample to
        ``(width - 1) // 2`` after it. Beyond its ends the recording goes on with its end values.

    Returns
    -------
    ndarray of int64, shape (n,)
        The medians; of an even width the mean of the two middle numbers, halves rounded up.

    Raises
    ------
    InputError
        If the width is less than 1.
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
    codes: NDArray[np.int64],
    times: NDArray[np.float64],
    shortest: Mapping[int, float],
    share: float = 1 / 8,
) -> NDArray[np.int64]:
    """Leave unlabelled what is too short to be the action.

    Parameters
    ----------
    codes : ndarray of int64, shape (n,)
        Predicted codes.
    times : ndarray, shape (n,)
        Times of the samples in seconds, strictly increasing.
    shortest : mapping of int to float
        Length in seconds of the shortest training segment of each code; segments of a code that
        is not in it are kept.
    share : float
        A segment is dropped if it is shorter than this share of the shortest training segment of
        its action. At least 0.

    Returns
    -------
    ndarray of int64, shape (n,)
        `codes`, unlabelled in dropped segments. A segment is as long as
        :func:`forcelab.labels.from_codes` makes it; a gap splits it.

    Raises
    ------
    InputError
        If the share is negative or not a number.
    """
    if not share >= 0:
        raise InputError(f"The share of the shortest segment must not be negative, as {share} is.")
    found = stretches(codes, times, sample_ends(times))
    limits = np.zeros(int(found.codes.max(initial=UNLABELLED)) + 1)
    for code, seconds in shortest.items():
        if 0 <= code < len(limits):
            limits[code] = share * seconds
    short = found.seconds < limits[found.codes] - ROUNDING
    dropped = np.zeros(len(codes) + 1, dtype=np.int64)
    dropped[found.firsts[short]] += 1
    dropped[found.lasts[short]] -= 1
    return np.where(np.cumsum(dropped[:-1]) > 0, UNLABELLED, codes)
