"""A track's segments as arrays, shared from one stroke to the next.

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

#: How many tracks are cached: the coder's, all of it and its visible part, and some others'.
CACHED_TRACKS = 8
#: A track whose length differs by more segments than this is another track.
LARGEST_CHANGE = 1000

_start, _end, _action = attrgetter("start"), attrgetter("end"), attrgetter("action")


@dataclass(frozen=True, slots=True, eq=False)
class TrackSpans:
    """Starts and ends (s), and the action of each segment as an index into `names`; shape (n,)."""

    starts: NDArray[np.float64]
    ends: NDArray[np.float64]
    codes: NDArray[np.int64]
    names: tuple[str, ...]

    @property
    def seconds(self) -> float:
        """How long all segments last together."""
        return float((self.ends - self.starts).sum())

    def totals(self) -> dict[str, tuple[int, float]]:
        """For each action the number of its segments and their total duration (s)."""
        counts = np.bincount(self.codes, minlength=len(self.names)).tolist()
        durations = np.bincount(self.codes, self.ends - self.starts, len(self.names)).tolist()
        return {
            name: (count, seconds)
            for name, count, seconds in zip(self.names, counts, durations, strict=True)
            if count
        }


_cache: list[tuple[Segments, TrackSpans]] = []


def track_spans(segments: Segments) -> TrackSpans:
    """A track's arrays; what it shares with a recently read track is not read again."""
    for place, (cached, spans) in enumerate(_cache):
        if cached is segments:
            _cache.insert(0, _cache.pop(place))
            return spans
    before = next((entry for entry in _cache if _shares_an_end(entry[0], segments)), None)
    spans = _read(segments, ()) if before is None else _spliced(*before, segments)
    _cache.insert(0, (segments, spans))
    del _cache[CACHED_TRACKS:]
    return spans


def _shares_an_end(cached: Segments, segments: Segments) -> bool:
    """Whether two tracks look like one before and after a stroke."""
    if not cached or not segments or abs(len(cached) - len(segments)) > LARGEST_CHANGE:
        return False
    return cached[0] is segments[0] or cached[-1] is segments[-1]


def _read(segments: Segments, names: tuple[str, ...]) -> TrackSpans:
    """The arrays of a track, read segment by segment; `names` keep their codes."""
    count = len(segments)
    names = tuple(dict.fromkeys((*names, *map(_action, segments))))
    codes = {name: code for code, name in enumerate(names)}
    return TrackSpans(
        np.fromiter(map(_start, segments), np.float64, count),
        np.fromiter(map(_end, segments), np.float64, count),
        np.fromiter((codes[segment.action] for segment in segments), np.int64, count),
        names,
    )


def _spliced(cached: Segments, spans: TrackSpans, segments: Segments) -> TrackSpans:
    """The arrays of a track that a stroke made from a cached one."""
    position, removed, inserted = splice(cached, segments)
    new, tail = _read(inserted, spans.names), position + len(removed)
    return TrackSpans(
        np.concatenate([spans.starts[:position], new.starts, spans.starts[tail:]]),
        np.concatenate([spans.ends[:position], new.ends, spans.ends[tail:]]),
        np.concatenate([spans.codes[:position], new.codes, spans.codes[tail:]]),
        new.names,
    )
