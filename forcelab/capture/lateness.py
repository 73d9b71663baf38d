"""What windows tell whose earliest arrivals are behind a clock's line.

They are a backlog, which arrives faster than it was taken and so ends by itself, or samples are
missing which nobody counted, as when a hub was stuck and a board went on printing lines. The latter
keep the device's pace, all equally late.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["LATE", "STEP", "believed_slope", "pace_of_late", "steady_since"]

#: Seconds by which a jump of the counter must contradict the arrivals to begin a new stretch.
STEP = 0.02
#: Seconds behind the line, at least, of windows that say nothing of the device's clock.
LATE = 0.005

_STEADY = 1.0  # s for which windows must be equally late to say that samples are missing
_MISSING = 0.05  # s by which they must have become late at once; a wrong rate takes longer
_SLIGHT = 0.05  # share by which a told rate is wrong without turning most of the first windows
_RECENT = 7  # steps from window to window of which most tell the present pace
_CLEAR = 0.6  # share of the steps that must be alike to say that a told rate is wrong
_PERSISTS = 1.0  # s of arrivals at one pace: what is read at once after a stall is over by then


def steady_since(
    x: NDArray[np.float64], y: NDArray[np.float64], late: NDArray[np.float64], rate: float
) -> int | None:
    """The first of the last windows that show that samples are missing; None where none do.

    Parameters
    ----------
    x, y : ndarray of float64, shape (n,)
        Ticks and arrivals (s) of windows.
    late : ndarray of float64, shape (n,)
        How far (s) they are behind the line.
    rate : float
        Seconds a tick, at which they are to come.
    """
    off = y - rate * x
    others = np.flatnonzero(np.abs(off - off[-1]) > STEP)
    first = int(others[-1]) + 1 if len(others) else 0
    at_once = min(float(np.diff(late, prepend=0.0).max()), float(late[-1])) > _MISSING
    return first if at_once and y[-1] - y[first] >= _STEADY else None


def pace_of_late(x: NDArray[np.float64], y: NDArray[np.float64], told: float) -> float:
    """Seconds a tick by windows that were all late: as told, unless that is why they were.

    Who was told a rate that is wrong by more than a few hundredths would have found out by the
    first windows.
    """
    half = len(x) // 2
    pace = float(np.median((y[half:] - y[:-half]) / (x[half:] - x[:-half])))
    return pace if LATE / np.ptp(x) < abs(pace - told) < _SLIGHT * told else told


def believed_slope(
    x: NDArray[np.float64], y: NDArray[np.float64], promised: float
) -> tuple[float, bool]:
    """Seconds a tick by a device's first windows; and whether they may be a backlog after all.

    Delays turn single windows; only a rate that was told wrong turns most of them, and for longer
    than a backlog does.
    """
    steps = np.diff(y)
    slopes = steps / np.diff(x)
    slope = float(np.median(slopes[-_RECENT:]))
    alike = np.abs(slopes - slope) <= 0.5 * slope
    clear = alike.mean() > _CLEAR  # with a backlog among them, the middle one says nothing
    wrong = abs(slope - promised)
    if wrong > _SLIGHT * promised:
        persists = clear and steps[alike].sum() >= _PERSISTS
        return (slope, False) if persists else (promised, True)
    return (slope if clear and np.ptp(x) * wrong > LATE * len(x) else promised), False
