"""What a stretch of a demonstration looked like: its forces in a few columns, and a frame."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.project import Project
from forcelab.review.places import Place

__all__ = ["Trace", "trace", "tracing"]

#: Columns that a trace has at most, and the width in pixels of its frame.
COLUMNS, WIDTH = 160, 192

Real = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Trace:
    """A stretch in little.

    Parameters
    ----------
    name : str
        Of the demonstration.
    low, high : ndarray, shape (m, c)
        Least and greatest sample of each column of time and each recorded channel, in the
        channel's unit; NaN where there is none.
    frame : ndarray of uint8, shape (h, w, 3), or None
        The video's frame in the middle, made small; None without a video.
    """

    name: str
    low: Real
    high: Real
    frame: NDArray[np.uint8] | None = None


def trace(demonstration: Demonstration, start: float, end: float, columns: int = COLUMNS) -> Trace:
    """The forces of ``[start, end)`` seconds, without the frame."""
    first, last = np.searchsorted(demonstration.times, (start, end)).tolist()
    first = min(first, len(demonstration.times) - 1)  # the last sample lasts on after its stamp
    values = np.array(demonstration.signals[first : max(last, first + 1)])
    values[~np.isfinite(values)] = np.nan
    firsts = np.unique(np.linspace(0, len(values), columns, endpoint=False).astype(np.int64))
    # fmin and fmax pass over what is missing, and give NaN only where there is nothing else.
    low, high = np.fmin.reduceat(values, firsts), np.fmax.reduceat(values, firsts)
    return Trace(demonstration.name, low, high)


def tracing(path: Path, places: Sequence[Place]) -> Generator[Progress, None, list[Trace]]:
    """The traces of some places, in their order; a video that cannot be read has no frame.

    Parameters
    ----------
    path : Path
        Of the project.
    places : sequence of Place

    Yields
    ------
    Progress
    """
    found = []
    with Project.open(path) as project:
        for place in places:
            demonstration = project.load(place.demonstration)
            made = trace(demonstration, place.start, place.end)
            if demonstration.video is not None:
                middle = 0.5 * (place.start + place.end)
                frame = yield from _framing(demonstration.video, middle)
                made = Trace(made.name, made.low, made.high, frame)
            found.append(made)
            yield Progress(len(found), len(places), "traces")
    return found


def _framing(
    video: VideoReference, time: float
) -> Generator[Progress, None, NDArray[np.uint8] | None]:
    """The frame at a time on the force clock (s); None before the first one or if undecodable."""
    from forcelab.video.index import indexing
    from forcelab.video.reader import VideoReader

    try:
        index = yield from indexing(video.path)
        with VideoReader(video.path, index, cache=0) as reader:
            number = reader.index_at(float(video.clock.to_device(time)))
            if number < 0:
                return None
            for _ in reader.reaching(number):
                yield Progress(0, 1, "frame")
            frame = reader.frame(number)  # kept by now
    except InputError:  # the stage shows what is the matter with it
        return None
    step = max(1, frame.shape[1] // WIDTH)
    height, width = (size // step * step for size in frame.shape[:2])
    # Means of squares of pixels: every step-th pixel alone would flicker with texture.
    blocks = frame[:height, :width].reshape(height // step, step, width // step, step, 3)
    return np.ascontiguousarray(blocks.mean(axis=(1, 3)).round().astype(np.uint8))
