"""The running median's honest sibling: each sample gets the action of most samples around it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.labels import UNLABELLED

__all__ = ["majority"]


def majority(codes: NDArray[np.int64], actions: int, width: int) -> NDArray[np.int64]:
    """Running majority vote.

    Unlike a median over label numbers it never invents an action, and gives the same however the
    actions are numbered. Stamps, and gaps between them, play no part.

    Parameters
    ----------
    codes : ndarray of int64, shape (n,)
        Predicted codes below `actions`; unlabelled has a vote like any action.
    actions : int
        How many there are.
    width : int
        Samples in the window, at least 1, from ``width // 2`` before the sample to
        ``(width - 1) // 2`` after it; beyond the ends nobody votes.

    Returns
    -------
    ndarray of int64, shape (n,)
        Of several codes with most votes the sample's own, else the lowest.

    Raises
    ------
    InputError
        If the width is less than 1.
    """
    if width < 1:
        raise InputError(f"The majority filter must be at least 1 sample wide, not {width}.")
    n = len(codes)
    width = min(width, 2 * n + 1)
    places = np.arange(n)
    first = np.maximum(places - width // 2, 0)
    last = np.minimum(places + (width - 1) // 2 + 1, n)
    winners = np.full(n, UNLABELLED, dtype=np.int64)
    most = np.zeros(n, dtype=np.int64)
    seen = np.zeros(n + 1, dtype=np.int64)
    for code in range(UNLABELLED, actions):
        np.cumsum(codes == code, out=seen[1:])
        votes = 2 * (seen[last] - seen[first]) + (codes == code)  # its own decides a tie
        better = votes > most
        winners[better], most[better] = code, votes[better]
    return winners
