"""Columns in which a device counts its samples: no signal, but a witness of what was lost.

A counter goes on by the same step from row to row. Where it goes on by several steps samples were
lost; where it falls it has begun again at zero.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

__all__ = ["is_counter_name", "ticks"]

#: After how many values counters begin again: whole bytes, and whole decimal places.
_TURNS = (2**8, 10**3, 2**12, 10**4, 2**15, 2**16, 10**5, 10**6, 2**24, 2**31, 2**32)
#: In a column of any name so many rows must count before it is believed to be a counter, and so
#: large a share of all steps must be the same; a name that says so needs less.
_FEWEST, _FEWEST_NAMED = 100, 4
_ALIKE, _ALIKE_NAMED = 0.98, 0.8
_NAME = re.compile(
    r"(?:.*[\W_])?(?:counter|count|cnt|packets?|paket(?:nr|nummer)?|seq|sequence|ticks?|samples?"
    r"|frames?|idx|index|row|nr|no|number|nummer|z(?:ä|ae)hler|lfdnr|compteur|contador)"
    r"(?:[\W_]*(?:nr|no|number|num|id|index|counter|count|#))?",
    re.IGNORECASE,
)


def is_counter_name(name: str) -> bool:
    """Whether a column's name says that it counts, such as ``packet_no`` or ``Paket``."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.strip())
    return _NAME.fullmatch(spaced) is not None


def ticks(values: NDArray[np.float64], named: bool) -> NDArray[np.float64] | None:
    """What a column counts, without its turns and in steps of one.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The column; NaN where a row has none.
    named : bool
        Whether its name says that it counts, so that less of it is proof enough.

    Returns
    -------
    ndarray, shape (n,), or None
        Zero at the first row that has a value; neighbours differ by one where no sample was lost
        between them. None where the column is no counter.
    """
    given = ~np.isnan(values)
    counts = values[given]
    if counts.size < (_FEWEST_NAMED if named else _FEWEST):
        return None
    if (counts < 0).any() or (counts > 2**53).any() or (counts != np.floor(counts)).any():
        return None
    turn = next((turn for turn in _TURNS if turn > counts.max()), None)
    going = np.diff(counts)
    falls = going < 0
    if falls.any():
        if (
            turn is None
            or (counts[:-1][falls] < turn / 2).any()
            or (counts[1:][falls] > turn / 2).any()
        ):
            return None
        going = np.where(falls, going + turn, going)
    usual, number = _commonest(going)
    if usual <= 0 or number < (_ALIKE_NAMED if named else _ALIKE) * going.size:
        return None
    if (going % usual != 0).any():
        return None
    result = np.full(values.size, np.nan)
    result[given] = np.concatenate([[0.0], np.cumsum(going / usual)])
    return result


def _commonest(steps: NDArray[np.float64]) -> tuple[float, int]:
    """The commonest of some steps, and how many of them there are."""
    found, numbers = np.unique(steps, return_counts=True)
    place = int(numbers.argmax())
    return float(found[place]), int(numbers[place])
