"""A trained recogniser on what is being captured: segments as they end, and the track of them."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from forcelab.capture.blocks import Device
from forcelab.capture.following import Following
from forcelab.capture.keeping import Kept
from forcelab.capture.recorder import Recorder
from forcelab.labels import Segment, model_author
from forcelab.live.glimpse import Glimpse, Recent
from forcelab.live.segments import Growing, Recognised
from forcelab.project import Project
from forcelab.recognition.online import OnlineRecogniser
from forcelab.recognition.rates import unseen_at
from forcelab.recognition.recogniser import Recogniser

__all__ = ["LATENCY", "LiveRecognition"]

#: Seconds from a sample to its label where nothing else is asked for.
LATENCY = 0.3
#: Blocks whose ages are kept for the figures at the end: half an hour of them.
AGES = 100_000
#: Seconds over which the cost is told.
COSTED = 2.0


class LiveRecognition:
    """Labels of what devices give, for as long as a recording lasts, or until it is finished.

    Made when the devices are open; :meth:`begin` it with the recording, and :meth:`look` every now
    and then. Not for several threads at once but for :attr:`glimpse`.

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

    Attributes
    ----------
    glimpse : Glimpse
        What was recognised last.
    remarks : tuple of str
        What is to be said of the devices: that the recogniser learnt other units, or at a rate at
        which it saw more.

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
        self.author, self.latency, self.recogniser = model_author(name), latency, recogniser
        self._name, self._recorder, self._devices = name, recorder, devices
        self._following = Following(devices, recorder.since)
        rate = self._following.rate if self._following.rate > 0 else None
        self._online = OnlineRecogniser(recogniser, latency, self._following.channels, rate)
        slow = () if rate is None else unseen_at(recogniser, rate, "The samples come", "they have")
        self.remarks = (*recogniser.remarks_on(self._following.channels), *slow)
        self._segments = Growing(self._online)
        self._recent = Recent(self._online.actions)
        self.glimpse = Glimpse()
        self._found: list[Recognised] = []
        self._ages: deque[float] = deque(maxlen=AGES)
        self._keeping = True
        self._begun = self._ended = math.nan
        self._cpu = 0.0
        self._costs: deque[tuple[float, float]] = deque()  # when, and seconds of CPU until then

    def renewed(self) -> LiveRecognition:
        """Another one of the same recogniser that knows nothing yet."""
        return LiveRecognition(
            self.recogniser, self._name, self.latency, self._recorder, self._devices
        )

    def begin(
        self,
        *,
        keeping: bool = True,
        after: LiveRecognition | None = None,
        firsts: Sequence[int] | None = None,
    ) -> None:
        """Recognise from now on.

        Parameters
        ----------
        keeping : bool
            Whether all segments are kept until the end, not only those of the last seconds.
        after : LiveRecognition, optional
            Which ends with this; what it said last stays to be seen, and nothing else of it.
        firsts : sequence of int, optional
            Numbers of the samples to begin with instead, such as the recorder's
            :attr:`~forcelab.capture.recorder.Recorder.firsts` of a recording that just began.
        """
        if after is not None:
            self._recent = after._recent
            self._recent.end(after._segments)
            self.glimpse = self._recent.glimpse(self._segments, 0.0)
        self._keeping = keeping
        if firsts is None:
            self._following.skip(self._recorder.latest(0.0))
            self._begun = time.monotonic()
        else:
            self._following.start(firsts)
            self._begun = self._recorder.begun

    @property
    def now(self) -> str:
        """The action of the latest label and its probability; empty while there is none."""
        growing = self._segments
        if math.isnan(growing.until):
            return ""
        if not growing.action:
            return "-"
        sure = growing.probability
        return growing.action if math.isnan(sure) else f"{growing.action} {sure:.2f}"

    @property
    def begun(self) -> float:
        """When it, or the recording it follows, began, in s of the host's monotonic clock."""
        return self._begun

    @property
    def finished(self) -> bool:
        """Whether it takes nothing more."""
        return not math.isnan(self._ended)

    def look(self) -> list[Recognised]:
        """Take in what came since; gives the segments that have ended, nothing when finished."""
        if self.finished:
            return []
        worked = time.thread_time()
        times, values = self._following.read()
        decided = self._online.push(times, values)
        found = self._segments.take(decided)
        self._recent.take(decided, found)
        if self._keeping:
            self._found += found
        if len(decided):
            self._ages.append(time.monotonic() - float(decided.times[0]))
            self.glimpse = self._recent.glimpse(self._segments, self._cost())
        self._cpu += time.thread_time() - worked
        return found

    def finish(self) -> list[Recognised]:
        """Take in the last samples, of a recording that has ended the last that is in it.

        Gives the segments that were waiting. Once is enough.
        """
        if self.finished:
            return []
        worked = time.thread_time()
        found = []
        for last in (
            self._online.push(*self._following.read(self._recorder.ends)),
            self._online.finish(),
        ):
            ended = self._segments.take(last)
            self._recent.take(last, ended)
            found += ended
        self._recent.end(self._segments)
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

        Raises
        ------
        InputError
            If the project cannot be written.
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

    def _cost(self) -> float:
        """Share of a core that was taken of late."""
        now = time.monotonic()
        self._costs.append((now, self._cpu))
        while self._costs[0][0] < now - COSTED:
            self._costs.popleft()
        since, before = self._costs[0]
        return (self._cpu - before) / (now - since) if now > since else 0.0


def _finite(value: float) -> float | None:
    """JSON has no NaN."""
    return value if math.isfinite(value) else None
