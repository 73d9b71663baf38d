"""Training segments that are alike: segments in numbers, the nearest of them, and their previews.

A segment is described by mean and standard deviation of the log magnitudes of each channel and
scale, the mean level of each channel, and the logarithm of its duration. Each is divided by its
standard deviation over all training segments, so that none outweighs the others by its unit; the
distance of two segments is Euclidean.
"""

from __future__ import annotations

from collections.abc import Collection, Generator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Real
from forcelab.demonstration import Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.labels import Interval
from forcelab.project import Project
from forcelab.recognition.examples import Examples
from forcelab.signals.channels import channel_map
from forcelab.signals.grid import measured
from forcelab.signals.minmax import run_extremes

#: How many neighbours of an action are looked for.
NEIGHBOURS = 3


@dataclass(frozen=True)
class Neighbour:
    """A training segment and its distance."""

    place: Interval  # of another demonstration; ``human`` is its action
    distance: float  # in standard deviations of training segments, over all numbers together


@dataclass(frozen=True, eq=False)
class SegmentFeatures:
    """The training segments of one or several demonstrations in numbers."""

    places: tuple[Interval, ...]  # length m; ``human`` is the action
    values: Real  # (m, d); not yet divided by anything

    @classmethod
    def joined(cls, parts: Sequence[SegmentFeatures]) -> SegmentFeatures:
        """The segments of several demonstrations, at least one, together."""
        places = tuple(place for part in parts for place in part.places)
        return cls(places, np.concatenate([part.values for part in parts]))


def summarise(
    examples: Examples, demonstration: Demonstration, scales: int, start: float, end: float
) -> Real | None:
    """The numbers (d,) that describe ``[start, end)`` seconds of a demonstration.

    None where the stretch has no time step, or only some in gaps.
    """
    steps = slice(*np.searchsorted(examples.times, (start, end)))
    rows = examples.features[steps][examples.valid[steps]]
    if not len(rows):
        return None
    channels = channel_map(demonstration.channels, examples.channels)
    # All log magnitudes come first; phases, where there are any, have no mean to speak of.
    magnitudes = rows[:, : scales * len(examples.channels)]
    samples = slice(*np.searchsorted(demonstration.times, (start, end)))
    levels = channels.apply(demonstration.signals[samples][:, channels.recorded])
    known = measured(levels)
    counts = np.maximum(known.sum(axis=1), 1)
    return np.concatenate(
        [
            magnitudes.mean(axis=0),
            magnitudes.std(axis=0),
            np.where(known, levels, 0.0).sum(axis=1) / counts,
            [np.log(end - start)],
        ]
    )


def summarise_segments(
    examples: Examples, demonstration: Demonstration, scales: int
) -> SegmentFeatures:
    """The numbers of all human segments of a demonstration."""
    places, values = [], []
    for segment in examples.segments:
        summary = summarise(examples, demonstration, scales, segment.start, segment.end)
        if summary is not None:
            places.append(Interval(demonstration.id, segment.start, segment.end, segment.action))
            values.append(summary)
    width = (2 * scales + 1) * len(examples.channels) + 1
    return SegmentFeatures(tuple(places), np.array(values).reshape(len(values), width))


def nearest_segments(
    target: Real,
    training: SegmentFeatures,
    action: str,
    count: int = NEIGHBOURS,
    without: Collection[str] = (),
) -> tuple[Neighbour, ...]:
    """The training segments of one action nearest to a stretch (d,), the nearest one first.

    The standard deviations are those of the training segments of all actions. Of equally near ones
    the first in `training` comes first; demonstrations in `without` are left out.
    """
    chosen = [
        i
        for i, place in enumerate(training.places)
        if place.human == action and place.demonstration not in without
    ]
    if not chosen:
        return ()
    spread = training.values.std(axis=0)
    spread[spread == 0] = 1.0  # all training segments are alike in this
    distances = np.linalg.norm((training.values[chosen] - target) / spread, axis=1)
    order = np.argsort(distances, kind="stable")[:count]
    return tuple(Neighbour(training.places[chosen[i]], float(distances[i])) for i in order)


#: Columns that a trace has at most, and the width in pixels of its frame.
COLUMNS, WIDTH = 160, 192


@dataclass(frozen=True, eq=False)
class ForcePreview:
    """Forces and video frame of a stretch, for a thumbnail."""

    name: str  # of the demonstration
    #: low, high: (m, c); least and greatest sample of each column of time and each recorded
    #: channel, in the channel's unit; NaN where there is none
    low: Real
    high: Real
    #: (h, w, 3); the video's frame in the middle, made small; None without a video
    frame: NDArray[np.uint8] | None = None


def force_preview(
    demonstration: Demonstration, start: float, end: float, columns: int = COLUMNS
) -> ForcePreview:
    """The forces of ``[start, end)`` seconds, without the frame."""
    first, last = np.searchsorted(demonstration.times, (start, end)).tolist()
    first = min(first, len(demonstration.times) - 1)  # the last sample lasts on after its stamp
    values = demonstration.signals[first : max(last, first + 1)]
    firsts = np.unique(np.linspace(0, len(values), columns, endpoint=False).astype(np.int64))
    extremes = run_extremes(values, firsts, np.append(firsts[1:], len(values)))
    return ForcePreview(demonstration.name, extremes.low, extremes.high)


def preview_job(
    path: Path, places: Sequence[Interval]
) -> Generator[Progress, None, list[ForcePreview]]:
    """Previews of intervals of a project; a video that cannot be read gives no frame."""
    previews = []
    with Project.open(path) as project:
        for place in places:
            demonstration = project.demonstrations.load(place.demonstration)
            preview = force_preview(demonstration, place.start, place.end)
            if demonstration.video is not None:
                middle = 0.5 * (place.start + place.end)
                frame = yield from _read_frame(demonstration.video, middle)
                preview = ForcePreview(preview.name, preview.low, preview.high, frame)
            previews.append(preview)
            yield Progress(len(previews), len(places), "traces")
    return previews


def _read_frame(
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
    except InputError:  # the Label workspace shows the error
        return None
    step = max(1, frame.shape[1] // WIDTH)
    height, width = (size // step * step for size in frame.shape[:2])
    # Means of squares of pixels: every step-th pixel alone would flicker with texture.
    blocks = frame[:height, :width].reshape(height // step, step, width // step, step, 3)
    return np.ascontiguousarray(blocks.mean(axis=(1, 3)).round().astype(np.uint8))
