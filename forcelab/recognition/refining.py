"""Boundaries to the sample: what was decoded at coarse steps, carried to a demonstration's stamps.

Each boundary goes where the full-rate evidence of its two actions changes sides, within a short
reach and never beyond the middle of a segment. The order of the segments stays.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.labels import UNLABELLED

__all__ = ["nearest_codes", "needed", "refine", "upsampled"]

Real = NDArray[np.float64]
Codes = NDArray[np.int64]


def nearest_codes(
    codes: Codes, times: Real, fine_times: Real, fine_valid: NDArray[np.bool_] | None = None
) -> Codes:
    """The code of the coarse step nearest to each fine sample, shape (m,).

    Parameters
    ----------
    codes, times : ndarray, shape (n,)
        Codes and times in seconds, increasing, of the coarse steps.
    fine_times : ndarray, shape (m,)
        Seconds, increasing.
    fine_valid : ndarray of bool, shape (m,), optional
        False in gaps, which are unlabelled.
    """
    if len(codes) == 0:
        return np.full(len(fine_times), UNLABELLED, dtype=np.int64)
    fine = codes[np.searchsorted(0.5 * (times[1:] + times[:-1]), fine_times, side="right")]
    return fine if fine_valid is None else np.where(fine_valid, fine, UNLABELLED)


def needed(codes: Codes, times: Real, reach: float) -> NDArray[np.bool_]:
    """Which samples :func:`refine` looks at, shape (m,): evidence elsewhere need not be made.

    Parameters
    ----------
    codes, times : ndarray, shape (m,)
        Of the fine samples, as of :func:`nearest_codes`.
    reach : float
        Seconds.
    """
    look = np.zeros(len(codes) + 1, dtype=np.int64)
    for _, first, last in _places(codes, times, reach):
        look[first] += 1
        look[last] -= 1
    return np.asarray(np.cumsum(look[:-1]) > 0)


def upsampled(log_probabilities: Real, times: Real, fine_times: Real) -> Real:
    """Log probabilities of coarse steps drawn straight between them, shape (m, K).

    For where nothing finer is known: a boundary then falls where two actions are equally probable.
    """
    finite = np.maximum(log_probabilities, np.log(1e-12))
    columns = [np.interp(fine_times, times, column) for column in finite.T]
    return np.array(columns).reshape(finite.shape[1], len(fine_times)).T


def refine(codes: Codes, times: Real, log_probabilities: Real, reach: float = 0.04) -> Codes:
    """Move each boundary to where the evidence is best.

    Parameters
    ----------
    codes, times : ndarray, shape (m,)
        Of the fine samples, as of :func:`nearest_codes`.
    log_probabilities : ndarray, shape (m, K)
        At the full rate, only looked at where :func:`needed` says so. Infinite ones count as very
        small; a boundary that sees one that is no number stays.
    reach : float
        Seconds that a boundary may move either way.

    Returns
    -------
    ndarray of int64, shape (m,)
        The same segments in the same order. Edges of unlabelled time stay; of equally good places
        a boundary takes the nearest, the earlier of two.

    Raises
    ------
    InputError
        If the numbers of samples disagree or the reach is not 0 s or more.
    """
    if not (len(codes) == len(times) == len(log_probabilities)):
        raise InputError(
            f"{len(codes)} codes, {len(times)} times and {len(log_probabilities)} rows of "
            "probabilities must belong to the same samples."
        )
    result = codes.copy()
    smallest = np.log(1e-12)
    for cut, first, last in _places(codes, times, reach):
        before, after = codes[cut - 1], codes[cut]
        pair = np.maximum(log_probabilities[first:last][:, [before, after]], smallest)
        if np.isnan(pair).any():
            continue
        # What is gained when the boundary moves from `first` to behind each sample.
        gains = np.concatenate([[0.0], np.cumsum(pair[:, 0] - pair[:, 1])])
        gains = gains[1:-1]
        places = np.arange(first + 1, last)
        best = np.flatnonzero(gains >= gains.max() - 1e-9)
        moved = int(places[best[np.abs(times[places[best]] - times[cut]).argmin()]])
        result[first:moved], result[moved:last] = before, after
    return result


def _places(codes: Codes, times: Real, reach: float) -> list[tuple[int, int, int]]:
    """Each boundary of two actions with the first and last (excluded) sample that it may take."""
    if not reach >= 0:
        raise InputError(f"A boundary's reach must be 0 s or more, not {reach} s.")
    cuts = np.flatnonzero(np.diff(codes)) + 1
    # Half of a segment belongs to the boundary at either end of it.
    edges = np.concatenate([[0], cuts, [len(codes)]])
    middles = (edges[:-1] + edges[1:]) // 2
    firsts = np.maximum(np.searchsorted(times, times[cuts] - reach) - 1, middles[:-1])
    lasts = np.minimum(np.searchsorted(times, times[cuts] + reach, side="right"), middles[1:])
    lasts = np.maximum(lasts, cuts + 1)
    both = (codes[cuts - 1] >= 0) & (codes[cuts] >= 0)
    return [
        (int(cut), int(first), int(last))
        for cut, first, last in zip(
            cuts[both], np.minimum(firsts, cuts - 1)[both], lasts[both], strict=True
        )
    ]
