"""How far labels of one demonstration must be moved to agree best with others of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.formats.track_text import nearest
from forcelab.labels import Segments

#: Seconds between the shifts that are compared, and how many are compared at most.
STEP, MOST_SHIFTS = 0.02, 1 << 17
#: Segments at least; fewer agree somewhere by chance.
FEWEST = 3


@dataclass(frozen=True, slots=True)
class OffsetFit:
    """The shift at which labels agree best with others.

    Agreement is twice the time in which both have the same action, over the labelled time of both.
    """

    offset: float  #: s, to be added to the labels
    agreement: float  #: with that offset
    before: float  #: as they are


def fit_offset(segments: Segments, reference: Segments) -> OffsetFit | None:
    """Find the shift of the first segments at which they agree best with the second.

    All shifts at which the two overlap are compared; the best one is then made exact by the edges
    of segments of one action. None where either has fewer than three segments.
    """
    if min(len(segments), len(reference)) < FEWEST:
        return None
    start = min(segments[0].start, reference[0].start)
    length = max(segments[-1].end, reference[-1].end) - start
    step = max(STEP, 2 * length / MOST_SHIFTS)
    # Twice the length: no shift wraps around; a power of two, as transforms are fast then.
    count = 1 << (2 * round(length / step) + 2).bit_length()
    overlap = np.zeros(count)
    for action in {s.action for s in segments} & {s.action for s in reference}:
        moved, fixed = (
            np.fft.rfft(_covered(each, action, start, step, count))
            for each in (segments, reference)
        )
        overlap += np.fft.irfft(np.conj(moved) * fixed, count)
    labelled = sum(s.duration for s in (*segments, *reference)) / step
    best = int(np.argmax(overlap))
    shift = (best if best < count // 2 else best - count) * step
    return OffsetFit(
        shift + _fine_shift(segments, reference, shift, step),
        *np.clip(2 * overlap[[best, 0]] / labelled, 0.0, 1.0).tolist(),
    )


def _covered(
    segments: Segments, action: str, start: float, step: float, count: int
) -> NDArray[np.float64]:
    """How much of each step an action covers, from 0 to 1."""
    change = np.zeros(count + 2)
    for segment in segments:
        if segment.action == action:
            for edge, sign in ((segment.start, 1.0), (segment.end, -1.0)):
                whole, part = divmod((edge - start) / step, 1.0)
                change[int(whole)] += sign * (1.0 - part)
                change[int(whole) + 1] += sign * part
    return np.cumsum(change)[:count]


def _fine_shift(segments: Segments, reference: Segments, shift: float, step: float) -> float:
    """What is to be added to a shift, by the edges that lie less than ten steps apart."""
    apart = [np.zeros(0)]
    for action in {s.action for s in segments} & {s.action for s in reference}:
        first, second = (
            np.array([(s.start, s.end) for s in each if s.action == action])
            for each in (segments, reference)
        )
        for side in (0, 1):
            moved = first[:, side] + shift
            apart.append(nearest(moved, second[:, side]) - moved)
    away = np.concatenate(apart)
    close = away[abs(away) < 10 * step]
    return float(np.median(close)) if close.size else 0.0
