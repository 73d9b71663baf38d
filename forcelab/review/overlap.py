"""Whether two coders see the same segments: F1 at an overlap, the same both ways."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forcelab.labels import Segments
from forcelab.recognition.overlay import Overlay
from forcelab.recognition.segmental import OVERLAPS, f1, match
from forcelab.review.coded import Pieces
from forcelab.runs import Runs
from forcelab.segment_edits import SLIVER

__all__ = ["segment_counts", "segment_f1"]

#: Ticks a second: overlaps are compared in whole numbers, so that one half is one half.
TICKS = 1e6


def segment_counts(pieces: Pieces, a: Segments, b: Segments) -> NDArray[np.int64]:
    """Count matched and unmatched segments of one demonstration.

    Each track in turn stands for the truth, by the rule of
    :func:`forcelab.recognition.segmental.match`. Only time that both labelled counts: a segment is
    weighed without the rest of it, and one that the other coder left unlabelled altogether is no
    segment. Durations are rounded to microseconds.

    Parameters
    ----------
    pieces : Pieces
        Of the two tracks.
    a, b : tuple of Segment
        The tracks.

    Returns
    -------
    ndarray of int64, shape (overlaps, 2, 3)
        By overlap and by who stands for the truth: matched, false, missed.
    """
    laid = _compressed(pieces, a, b)
    ways = _overlay(laid, 0, 1), _overlay(laid, 1, 0)
    found = []
    for overlap in OVERLAPS:
        for over in ways:
            true = len(match(over, overlap))
            found.append((true, len(over.predicted) - true, len(over.human) - true))
    return np.array(found, dtype=np.int64).reshape(len(OVERLAPS), 2, 3)


def segment_f1(counts: NDArray[np.int64]) -> dict[int, float | None]:
    """F1 of segments, by the least overlap in percent; None where there is no segment.

    The mean of both ways, which differ only where segments compete for one another. `counts` as of
    :func:`segment_counts`, summed over demonstrations.
    """
    found: dict[int, float | None] = {}
    for overlap, ways in zip(OVERLAPS, counts.tolist(), strict=True):
        values = [value for way in ways if (value := f1(*way)) is not None]
        found[overlap] = sum(values) / len(values) if values else None
    return found


class _Laid(NamedTuple):
    """Pieces that both labelled, on a clock that runs only there."""

    numbers: NDArray[np.int64]  # of each track's segments, shape (2, p)
    codes: NDArray[np.int64]  # of their actions, shape (2, p)
    ticks: NDArray[np.int64]  # where each piece starts, and the end of the last, shape (p + 1,)


def _compressed(pieces: Pieces, a: Segments, b: Segments) -> _Laid:
    """Cut out the time that only one labelled.

    On the remaining clock a segment stays one, even where the other coder left a gap within it.
    """
    ticks = np.rint(pieces.seconds * TICKS).astype(np.int64)
    both = pieces.labelled_by_all & (ticks > 0)
    middles = (pieces.starts + pieces.seconds / 2)[both]
    numbers = [np.searchsorted(_starts(track), middles, side="right") - 1 for track in (a, b)]
    clock = np.concatenate([[0], np.cumsum(ticks[both])])
    return _Laid(np.stack(numbers), pieces.codes[:, both], clock)


def _starts(track: Segments) -> list[float]:
    """Where segments start; touching ones of one action are one."""
    return [
        segment.start
        for before, segment in zip((None, *track), track, strict=False)
        if before is None or before.action != segment.action or segment.start - before.end > SLIVER
    ]


def _overlay(laid: _Laid, human: int, predicted: int) -> Overlay:
    """The overlay of the two tracks, in ticks instead of samples."""
    either = laid.numbers[human] * (int(laid.numbers[predicted].max(initial=0)) + 1)
    pairs = _stretches(laid, either + laid.numbers[predicted], laid.codes[human])
    first = np.searchsorted(laid.ticks, pairs.firsts)
    return Overlay(
        human=_stretches(laid, laid.numbers[human], laid.codes[human]),
        predicted=_stretches(laid, laid.numbers[predicted], laid.codes[predicted]),
        pieces=pairs,
        human_codes=laid.codes[human][first],
        predicted_codes=laid.codes[predicted][first],
        actions=int(laid.codes.max(initial=-1)) + 1,
    )


def _stretches(laid: _Laid, numbers: NDArray[np.int64], codes: NDArray[np.int64]) -> Runs:
    """Neighbouring pieces of one number as one stretch."""
    if not len(numbers):
        none, never = np.empty(0, dtype=np.int64), np.empty(0)
        return Runs(none, none, none, never, never)
    firsts = np.concatenate([[0], np.flatnonzero(np.diff(numbers)) + 1])
    starts = laid.ticks[firsts]
    ends = np.append(starts[1:], laid.ticks[-1])
    return Runs(codes[firsts], starts, ends, starts / TICKS, ends / TICKS)
