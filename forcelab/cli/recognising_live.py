"""A trained recogniser on what is being recorded: segments as they end, and the track of them."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from forcelab.capture.blocks import Device
from forcelab.capture.following import Following
from forcelab.capture.keeping import Kept
from forcelab.capture.recorder import Recorder
from forcelab.cli.output import counted
from forcelab.demonstration import GAP_PERIODS
from forcelab.labels import UNLABELLED, Segment, model_author
from forcelab.project import Project
from forcelab.recognition.online import Decided, OnlineRecogniser
from forcelab.recognition.recogniser import Recogniser

__all__ = ["LATENCY", "LiveRecognition", "Recognised", "told"]

#: Seconds from a sample to its label where nothing else is asked for.
LATENCY = 0.3


@dataclass(frozen=True)
class Recognised:
    """A segment whose end is decided.

    Parameters
    ----------
    start, end : float
        Seconds of the host's monotonic clock.
    action : str
    probability : float
        Mean over its samples; NaN of a classifier that has none.
    """

    start: float
    end: float
    action: str
    probability: float


class LiveRecognition:
    """Labels of a recording while it lasts.

    Made when the devices are open; :meth:`begin` it with the recording, and :meth:`look` every now
    and then.

    Parameters
    ----------
    recogniser : Recogniser
    name : str
        What it is called.
    latency : float
        Seconds; see :class:`~forcelab.recognition.online.OnlineRecogniser`.
    recorder : Recorder
        It is open.
    devices : sequence of Device
        The recorder's.

    Raises
    ------
    InputError
        If the recogniser looks at a channel that no device has, or the latency is negative.
    """

    def __init__(
        self,
        recogniser: Recogniser,
        name: str,
        latency: float,
        recorder: Recorder,
        devices: Sequence[Device],
    ) -> None:
        self.author, self.latency = model_author(name), latency
        self._recorder = recorder
        self._following = Following(devices, recorder.since)
        rate = self._following.rate if self._following.rate > 0 else None
        self._online = OnlineRecogniser(recogniser, latency, self._following.channels, rate)
        self._segments = _Segments(self._online)
        self._found: list[Recognised] = []
        self._ages: list[float] = []
        self._begun = self._ended = math.nan
        self._cpu = 0.0

    def begin(self) -> None:
        """Recognise from now on."""
        self._following.skip(self._recorder.latest(0.0))
        self._begun = time.monotonic()

    @property
    def now(self) -> str:
        """The action of the latest label and its probability."""
        return self._segments.now

    @property
    def begun(self) -> float:
        """When it was begun, in seconds of the host's monotonic clock."""
        return self._begun

    def look(self) -> list[Recognised]:
        """Take in what came since; gives the segments that have ended."""
        worked = time.thread_time()
        times, values = self._following.read()
        decided = self._online.push(times, values)
        if len(decided):
            self._ages.append(time.monotonic() - float(decided.times[0]))
        found = self._segments.take(decided)
        self._found += found
        self._cpu += time.thread_time() - worked
        return found

    def finish(self) -> list[Recognised]:
        """Take in the last samples; gives the segments that were waiting."""
        worked = time.thread_time()
        last = self._online.push(*self._following.read(ended=True))
        found = self._segments.take(last) + self._segments.take(self._online.finish())
        found += self._segments.finish()
        self._found += found
        self._cpu += time.thread_time() - worked
        self._ended = time.monotonic()
        return found

    def keep(self, path: Path, kept: Kept) -> dict[str, Any]:
        """Keep the track with the demonstration, and tell what became of it as plain values.

        Parameters
        ----------
        path : Path
            The project's folder.
        kept : Kept
            The recording.
        """
        with Project.open(path) as project:
            stamps = project.stamps(kept.added.id)
            start = self._begun if stamps is None else float(stamps["start"])
            segments = self._within(start, kept.seconds)
            before = project.track(kept.added.id, self.author).segments
            if segments != before:
                what = f"recognised live, {self.latency:g} s after the force"
                project.edit(kept.added.id, self.author, before, segments, what, kind="predict")
        ages = np.array(self._ages) if self._ages else np.full(1, np.nan)
        labelled = math.fsum(segment.duration for segment in segments)
        middle, most = (_finite(float(age)) for age in np.percentile(ages, [50, 99]))
        return {
            "author": self.author,
            "segments": len(segments),
            "labelled": labelled / kept.seconds if kept.seconds > 0 else 0.0,
            "latency": self.latency,
            "after": {"median": middle, "p99": most},
            "cpu": self._cpu / max(self._ended - self._begun, 1e-9),
        }

    def _within(self, start: float, seconds: float) -> tuple[Segment, ...]:
        """The segments on the demonstration's clock."""
        ends = [
            (min(max(one.start - start, 0.0), seconds), min(one.end - start, seconds), one.action)
            for one in self._found
        ]
        return tuple(Segment(first, last, action) for first, last, action in ends if last > first)


def told(figures: dict[str, Any]) -> str:
    """What became of it, in a sentence.

    Parameters
    ----------
    figures : dict
        As :meth:`LiveRecognition.keep` gives them.
    """
    after = figures["after"]
    late = (
        "no label in time"
        if after["median"] is None
        else f"labels {after['median']:.2f} s after the force (99 %: {after['p99']:.2f} s)"
    )
    return (
        f"Recognised by '{figures['author']}': {counted(figures['segments'], 'segment')}, "
        f"{100 * figures['labelled']:.0f} % labelled, {late}, "
        f"{100 * figures['cpu']:.1f} % of a core."
    )


class _Segments:
    """Segments of labels that come in their order."""

    def __init__(self, online: OnlineRecogniser) -> None:
        self._online = online
        self.now = ""
        self._code = UNLABELLED
        self._start = self._last = math.nan
        self._sum, self._count = 0.0, 0

    def take(self, decided: Decided) -> list[Recognised]:
        """Take in labels; gives the segments that they end."""
        if not len(decided):
            return []
        period = self._online.step or 1.0 / self._online.recogniser.rate
        times, codes = decided.times, decided.codes
        sure = np.full(len(codes), np.nan)
        if decided.probabilities is not None:
            rows = np.arange(len(codes))
            sure = np.where(codes >= 0, decided.probabilities[rows, np.maximum(codes, 0)], np.nan)
        before = np.concatenate([[self._last], times[:-1]])
        parted = times - before > GAP_PERIODS * period
        changed = codes != np.concatenate([[self._code], codes[:-1]])
        found = []
        edges = [0, *np.flatnonzero(parted | changed).tolist(), len(codes)]
        for first, last in pairwise(edges):
            if first == last:
                continue
            if parted[first] or changed[first]:
                end = float(before[first]) + period if parted[first] else float(times[first])
                found += self._closed(end)
                self._code, self._start = int(codes[first]), float(times[first])
                self._sum, self._count = 0.0, 0
            self._sum += float(sure[first:last].sum())
            self._count += last - first
        self._last = float(times[-1])
        self.now = self._said(float(sure[-1]))
        return found

    def finish(self) -> list[Recognised]:
        """The segment that has not ended."""
        period = self._online.step or 1.0 / self._online.recogniser.rate
        found = self._closed(self._last + period)
        self._code = UNLABELLED
        return found

    def _closed(self, end: float) -> list[Recognised]:
        if self._code == UNLABELLED:
            return []
        action = self._online.actions[self._code]
        return [Recognised(self._start, end, action, self._sum / self._count)]

    def _said(self, probability: float) -> str:
        if self._code == UNLABELLED:
            return "-"
        action = self._online.actions[self._code]
        return action if math.isnan(probability) else f"{action} {probability:.2f}"


def _finite(value: float) -> float | None:
    """JSON has no NaN."""
    return value if math.isfinite(value) else None
