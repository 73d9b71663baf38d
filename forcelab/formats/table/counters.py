"""Columns in which a device counts its samples: no signal, but a witness of what was lost.

A counter goes on by the same step from row to row. Where it goes on by several steps samples were
lost. Where it falls it has begun again at zero: near its largest number by a turn, elsewhere as the
device was restarted, and nobody knows for how long it was off. So may a motor go on that turns at
an even speed: a column that is named after what it measures is never taken for a counter.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

__all__ = ["is_counter_name", "is_measured_name", "restarts", "sub_ticks", "ticks"]

#: After how many values counters begin again: whole bytes, and whole decimal places.
_TURNS = (2**8, 10**3, 2**12, 10**4, 2**15, 2**16, 10**5, 10**6, 2**24, 2**31, 2**32)
#: So near its end, or so near in parts of what it counts to, a counter has turned when it falls.
_NEAR, _NEAR_PART = 1000, 0.05
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
#: Words of quantities that a machine at an even speed raises by whole steps.
_MEASURED = re.compile(
    r"(?:.*[\W\d_])?(?:enc|encoders?|motors?|stepper|wheels?|pulses?|pos|position|distance|weg|disp"
    r"|displacement|travel|stroke|extension|angle|winkel|height|depth)(?:[\W\d_].*)?",
    re.IGNORECASE,
)


def is_counter_name(name: str) -> bool:
    """Whether a column's name says that it counts, such as ``packet_no`` or ``Paket``."""
    return _NAME.fullmatch(_spaced(name)) is not None and not is_measured_name(name)


def is_measured_name(name: str) -> bool:
    """Whether a column's name says that it measures something, such as ``encoder_count``."""
    return _MEASURED.fullmatch(_spaced(name)) is not None


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
        between them, and where the device was restarted. None where the column is no counter.
    """
    given = ~np.isnan(values)
    counts = values[given]
    if counts.size < (_FEWEST_NAMED if named else _FEWEST):
        return None
    if (counts < 0).any() or (counts > 2**53).any() or (counts != np.floor(counts)).any():
        return None
    turn = _turn(counts)
    going = np.diff(counts)
    falls = going < 0
    again = np.zeros_like(falls)
    if falls.any():
        if turn is None or not _begun_again(counts, turn, named)[falls].all():
            return None
        turned = falls & _near(counts[:-1], turn)
        again = falls & ~turned
        going = np.where(turned, going + turn, going)
    usual, number = _commonest(going[~again])
    going = np.where(again, usual, going)
    if not named and (going <= 0).any():
        return None  # what stands still now and then is moved by something else
    fewest = (_ALIKE_NAMED if named else _ALIKE) * going.size
    if usual <= 0 or number < fewest or (going % usual != 0).any():
        return None
    result = np.full(values.size, np.nan)
    result[given] = np.concatenate([[0.0], np.cumsum(going / usual)])
    return result


def sub_ticks(frames: NDArray[np.float64], subs: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """What two columns count together: frames, and from 0 the samples within each.

    Parameters
    ----------
    frames, subs : ndarray, shape (n,)
        NaN where a row has none.

    Returns
    -------
    ndarray, shape (n,), or None
        As of :func:`ticks`; None where they do not count.
    """
    given = ~(np.isnan(frames) | np.isnan(subs))
    if not given.any() or (subs[given] < 0).any():
        return None
    return ticks(frames * (subs[given].max() + 1) + subs, named=True)


def restarts(values: NDArray[np.float64]) -> NDArray[np.intp]:
    """The rows in which a counter has begun again without having come to its end.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A column that :func:`ticks` takes for a counter; NaN where a row has none.

    Returns
    -------
    ndarray of int
        The first row after each restart.
    """
    rows = np.flatnonzero(~np.isnan(values))
    counts = values[rows]
    turn = _turn(counts)
    if turn is None:
        return rows[:0]
    again = (np.diff(counts) < 0) & ~_near(counts[:-1], turn)
    return rows[1:][again]


def _turn(counts: NDArray[np.float64]) -> int | None:
    """After how many values a counter begins again that has come this far."""
    return next((turn for turn in _TURNS if turn > counts.max()), None)


def _begun_again(counts: NDArray[np.float64], turn: int, named: bool) -> NDArray[np.bool_]:
    """Whether a fall from each count to the next may be a turn or a restart, shape (n - 1,).

    A device may be restarted when it has counted little. Then it goes on near zero, and only a
    column whose name says that it counts is believed to have done so; not one that goes round in
    a few numbers.
    """
    before, after = counts[:-1], counts[1:]
    far = (before >= turn / 2) & (after <= turn / 2)
    early = (before >= _FEWEST) & (after <= _NEAR_PART * before)
    return far | early if named else far


def _near(counts: NDArray[np.float64], turn: int) -> NDArray[np.bool_]:
    """Whether counts are so near the end that the next one may be beyond it."""
    return counts >= max(turn - max(_NEAR, _NEAR_PART * turn), turn / 2)


def _spaced(name: str) -> str:
    """A name with its words apart, where capitals part them."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.strip())


def _commonest(steps: NDArray[np.float64]) -> tuple[float, int]:
    """The commonest of some steps, and how many of them there are."""
    found, numbers = np.unique(steps, return_counts=True)
    place = int(numbers.argmax())
    return float(found[place]), int(numbers[place])
