"""What is decided of a stream."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Decided"]

Real = NDArray[np.float64]
Codes = NDArray[np.int64]


@dataclass(frozen=True)
class Decided:
    """Steps whose labels are decided, in their order and without a break.

    Parameters
    ----------
    times : ndarray of float64, shape (n,)
        Seconds on the clock of the samples.
    codes : ndarray of int64, shape (n,)
        After the filters; the action with code ``i`` is ``actions[i]``.
    probabilities : ndarray of float64, shape (n, K), or None
        None of a classifier that has none; zero in gaps.
    """

    times: Real
    codes: Codes
    probabilities: Real | None

    def __len__(self) -> int:
        return len(self.times)
