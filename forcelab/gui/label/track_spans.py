"""A track as arrays, kept from one stroke to the next.

A stroke changes a few of ten thousand segments. To read all of them into arrays again, for each
view that draws or counts them, would take longer than everything else that a stroke does.
"""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from forcelab.labels import Segments
from forcelab.segment_edits import splice

__all__ = ["Spans", "spans_of"]

#: How many tracks are kept: the coder's, whole and as far as it is seen, and some others'.
KEPT = 8
#: A track whose length differs by more than this is another track.
ALIKE = 1000

_start, _end, _action = attrgetter("start"), attrgetter("end"), attrgetter("action")


@dataclass(frozen=True, slots=True, eq=False)
class Spans:
    """Segments as arrays.

    Parameters
    ----------
    starts, ends : ndarray of float64, shape (n,)
        In seconds.
    codes : ndarray of int64, shape (n,)
        The action of each, as an index into `names`.
    names : tuple of str
        All actions of the segments, and maybe others.
    """

    starts: NDArray[np.float64]
    ends: NDArray[np.float64]
    codes: NDArray[np.int64]
    names: tuple[str, ...]

    @property
    def seconds(self) -> float:
        """How long all segments last together."""
        return float((self.ends - self.starts).sum())

    def totals(self) -> dict[str, tuple[int, float]]:
        """How many segments each action has, and how many seconds they last together."""
        counts = np.bincount(self.codes, minlength=len(self.names)).tolist()
        lasting = np.bincount(self.codes, self.ends - self.starts, len(self.names)).tolist()
        return {
            name: (count, seconds)
            for name, count, seconds in zip(self.names, counts, lasting, strict=True)
            if count
        }


_kept: list[tuple[Segments, Spans]] = []


def spans_of(segments: Segments) -> Spans:
    """A track's arrays; what it shares with a track that was asked for lately is not read again."""
    for place, (known, spans) in enumerate(_kept):
        if known is segments:
            _kept.insert(0, _kept.pop(place))
            return spans
    before = next((kept for kept in _kept if _related(kept[0], segments)), None)
    spans = _read(segments, ()) if before is None else _followed(*before, segments)
    _kept.insert(0, (segments, spans))
    del _kept[KEPT:]
    return spans


def _related(known: Segments, segments: Segments) -> bool:
    """Whether two tracks look like one before and after a stroke: they share an end."""
    if not known or not segments or abs(len(known) - len(segments)) > ALIKE:
        return False
    return known[0] is segments[0] or known[-1] is segments[-1]


def _read(segments: Segments, names: tuple[str, ...]) -> Spans:
    """The arrays of a track, read segment by segment; `names` keep their codes."""
    count = len(segments)
    names = tuple(dict.fromkeys((*names, *map(_action, segments))))
    codes = {name: code for code, name in enumerate(names)}
    return Spans(
        np.fromiter(map(_start, segments), np.float64, count),
        np.fromiter(map(_end, segments), np.float64, count),
        np.fromiter((codes[segment.action] for segment in segments), np.int64, count),
        names,
    )


def _followed(known: Segments, spans: Spans, segments: Segments) -> Spans:
    """The arrays of a track that came of another one by a stroke."""
    position, removed, inserted = splice(known, segments)
    new, tail = _read(inserted, spans.names), position + len(removed)
    return Spans(
        np.concatenate([spans.starts[:position], new.starts, spans.starts[tail:]]),
        np.concatenate([spans.ends[:position], new.ends, spans.ends[tail:]]),
        np.concatenate([spans.codes[:position], new.codes, spans.codes[tail:]]),
        new.names,
    )
