"""Frame time while panning and zooming, and how late the event loop is meanwhile."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np

from forcelab.gui.measuring import recordings
from forcelab.gui.measuring.plain_plots import NAME, plain_plots
from forcelab.gui.measuring.stage import Lateness, Painted, rest, settle, shown, time_panels
from forcelab.gui.window import Window
from forcelab.jobs import Progress
from forcelab.measure.latency import Bound, Latency, refused

__all__ = ["Zoom", "measuring_panning", "zooms"]

FRAME = Bound("p95", 0.033)
LATE = Bound("worst", 0.050)
PAN, LOOP = "pan and zoom", "event loop's lateness"
#: Seconds from the beginning of one frame to that of the next, frames of one gesture, and the
#: pause after it, in which the scalogram is begun: the next gesture meets it at work.
PACE, GESTURE, PAUSE = 1 / 60, 8, 0.08
#: The shortest span that is looked at, in seconds.
CLOSE = 1.0

Span = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Zoom:
    """A range of visible spans, in seconds."""

    name: str
    least: float
    most: float

    def gesture(self, whole: Span, frames: int, random: np.random.Generator) -> list[Span]:
        """Spans of this range, each a little panned and zoomed from the one before.

        Parameters
        ----------
        whole : tuple of float
            The recording.
        frames : int
            How many spans.
        random : Generator
        """
        length = float(np.exp(random.uniform(np.log(self.least), np.log(self.most))))
        start = random.uniform(whole[0], whole[1] - length)
        towards, spans = random.choice([-1.0, 1.0]), []
        for frame in range(frames):
            longer = length * (1.08 if frame % 4 < 2 else 1 / 1.08)
            # Never longer than the range, and never the same span twice: nothing is painted then.
            longer = min(max(longer, self.least), self.most * (0.999 - 0.001 * frame))
            start += (length - longer) / 2 + 0.03 * towards * longer
            start, length = min(max(start, whole[0]), whole[1] - longer), longer
            spans.append((start, start + length))
        return spans


def zooms(seconds: float) -> list[Zoom]:
    """From the whole recording to one second, decade by decade."""
    edges = [seconds]
    while edges[-1] > 1.01 * CLOSE:
        edges.append(max(edges[-1] / 10, CLOSE))
    decades = [
        Zoom(f"{low:.3g} to {high:.3g} s visible", low, high) for high, low in pairwise(edges)
    ]
    return [Zoom("all visible", 0.9 * seconds, seconds), *decades]


def measuring_panning(
    folder: Path, count: int, *, gestures: int, size: tuple[int, int]
) -> Generator[Progress, None, tuple[Latency, ...]]:
    """Pan and zoom a recording of six channels; see :mod:`forcelab.gui.measuring`.

    Parameters
    ----------
    folder : Path
        Where the recording is made, and deleted again.
    count : int
        Samples of each channel.
    gestures : int
        For each range of spans; each has eight frames.
    size : tuple of int
        Of the window, in pixels.
    """
    setting = f"6 x {_power(count)}"
    if sentence := recordings.refusal(folder, count):
        return refused([PAN, LOOP, NAME], setting, sentence)
    yield Progress(0, 1, f"{setting} samples: making the recording")
    path = recordings.long(folder, count)
    rows: list[Latency] = []
    with shown(path, size) as window:
        demonstration = window.document.demonstration
        assert demonstration is not None
        whole = (demonstration.start, demonstration.end)
        ranges = zooms(whole[1] - whole[0])
        panels, box = time_panels(window), window.label.force.size()
        with Painted(panels) as painted:
            for i, zoom in enumerate(ranges):
                yield Progress(i, 2 * len(ranges), f"{setting} samples: {zoom.name}")
                taken = _frames(zoom, whole, gestures, window.document.set_span, painted)
                where = f"{setting}, {zoom.name}"
                rows.append(Latency(PAN, where, taken, FRAME, alternative=NAME))
                late = _lateness(window, zoom, whole, gestures)
                rows.append(Latency(LOOP, where, late, LATE))
        with plain_plots(demonstration, box) as plots, Painted(plots.surfaces) as painted:
            for i, zoom in enumerate(ranges):
                yield Progress(len(ranges) + i, 2 * len(ranges), f"{setting} samples: {NAME}")
                few = max(1, gestures // 4)
                taken = _frames(zoom, whole, few, plots.set_span, painted)
                rows.append(Latency(NAME, f"{setting}, {zoom.name}", taken))
    shutil.rmtree(path)  # half a gigabyte, and there is more to come
    return tuple(sorted(rows, key=lambda row: (PAN, LOOP, NAME).index(row.name)))


def _frames(
    zoom: Zoom,
    whole: Span,
    gestures: int,
    set_span: Callable[[float, float], object],
    painted: Painted,
) -> tuple[float, ...]:
    """Seconds of each frame of some gestures, asked for at most sixty times a second."""
    random = np.random.default_rng(1)
    taken = []
    for _ in range(gestures):
        for start, end in zoom.gesture(whole, GESTURE, random):
            begin = time.perf_counter()
            taken.append(painted.seconds(partial(set_span, start, end)))
            rest(max(0.0, PACE - (time.perf_counter() - begin)))
        rest(PAUSE)
    return tuple(taken)


def _lateness(window: Window, zoom: Zoom, whole: Span, times: int) -> tuple[float, ...]:
    """How late the event loop is while scalograms of some spans are computed."""
    random = np.random.default_rng(2)
    samples: list[float] = []
    for _ in range(times):
        settle(window)
        with Lateness() as lateness:
            window.document.set_span(*zoom.gesture(whole, 1, random)[0])
            settle(window)
        samples += lateness.samples
    return tuple(samples)


def _power(count: int) -> str:
    """A power of ten as ``1e6``, any other number as it is."""
    power = round(np.log10(count))
    return f"1e{power}" if 10**power == count else str(count)
