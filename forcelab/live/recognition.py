"""Live recognition: segments as they end, their track, snapshots, and the latency budget."""

from __future__ import annotations

import logging
import math
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.recorder import Recorder
from forcelab.capture.save import SavedRecording
from forcelab.capture.stream_merger import StreamMerger
from forcelab.demonstration import GAP_PERIODS, Channel
from forcelab.errors import InputError
from forcelab.labels import UNLABELLED, Segment, model_author
from forcelab.live.label_outlet import LabelOutlet
from forcelab.project import Project
from forcelab.recognition.live_model import needs_live_model
from forcelab.recognition.online import EarlyScale, LiveLabels, OnlineRecogniser
from forcelab.recognition.probabilities import RATE, ProbabilityTrace
from forcelab.recognition.recogniser import Recogniser
from forcelab.text import counted

log = logging.getLogger("forcelab")


@dataclass(frozen=True)
class ClosedSegment:
    """A segment whose end is decided."""

    #: start, end: seconds of the host's monotonic clock
    start: float
    end: float
    action: str
    probability: float  # mean over its samples; NaN of a classifier that has none

    @property
    def segment(self) -> Segment:
        """Without its probability."""
        return Segment(self.start, self.end, self.action)


class SegmentBuilder:
    """Segments of the labels that an online recogniser gives.

    `action` is that of the latest label, empty where that is unlabelled; `probability` its
    probability, NaN where that is not known.
    """

    def __init__(self, online: OnlineRecogniser) -> None:
        self._online = online
        self.action, self.probability = "", math.nan
        self._code = UNLABELLED
        self._start = self._last = math.nan
        self._sum, self._count = 0.0, 0

    @property
    def until(self) -> float:
        """The time up to which labels are decided; NaN while there are none."""
        return self._last + self._period

    @property
    def present(self) -> list[ClosedSegment]:
        """The segment that has not ended, as far as it is decided, if there is one."""
        return self._closed(self.until)

    def take(self, labels: LiveLabels) -> list[ClosedSegment]:
        """Take labels; gives the segments that they end."""
        if not len(labels):
            return []
        times, codes = labels.times, labels.codes
        probabilities = np.full(len(codes), np.nan)
        if labels.probabilities is not None:
            rows = np.arange(len(codes))
            probabilities = np.where(
                codes >= 0, labels.probabilities[rows, np.maximum(codes, 0)], np.nan
            )
        before = np.concatenate([[self._last], times[:-1]])
        parted = times - before > GAP_PERIODS * self._period
        changed = codes != np.concatenate([[self._code], codes[:-1]])
        closed = []
        edges = [0, *np.flatnonzero(parted | changed).tolist(), len(codes)]
        for first, last in pairwise(edges):
            if first == last:
                continue
            if parted[first] or changed[first]:
                gap_end = float(before[first]) + self._period
                closed += self._closed(gap_end if parted[first] else float(times[first]))
                self._code, self._start = int(codes[first]), float(times[first])
                self._sum, self._count = 0.0, 0
            self._sum += float(probabilities[first:last].sum())
            self._count += last - first
        self._last = float(times[-1])
        unlabelled = self._code == UNLABELLED
        self.action = "" if unlabelled else self._online.actions[self._code]
        self.probability = math.nan if unlabelled else float(probabilities[-1])
        return closed

    def finish(self) -> list[ClosedSegment]:
        """The segment that has not ended, which ends with the last label."""
        closed, self._code = self.present, UNLABELLED
        return closed

    @property
    def _period(self) -> float:
        return self._online.step or 1.0 / self._online.recogniser.rate

    def _closed(self, end: float) -> list[ClosedSegment]:
        if self._code == UNLABELLED:
            return []
        action = self._online.actions[self._code]
        return [ClosedSegment(self._start, end, action, self._sum / self._count)]


#: Seconds that are kept for views.
SECONDS = 15.0


@dataclass(frozen=True, eq=False)
class LiveSnapshot:
    """The latest labels; never changed, so that any thread may read it."""

    #: Of the last seconds, on the host's monotonic clock; the last one may still grow
    segments: tuple[Segment, ...] = ()
    #: Of the same time; None of a classifier without probabilities
    probability_trace: ProbabilityTrace | None = None
    until: float = math.nan  # the time (s) up to which labels are decided; NaN while there are none
    action: str = ""  # of the latest label; empty where that is unlabelled
    #: Of each action the recogniser knows, over the latest labels; empty where they are unknown
    probabilities: tuple[float, ...] = ()
    cost: float = 0.0  # share of one core that recognising has taken of late


class SnapshotBuffer:
    """Gathers what a :class:`LiveSnapshot` shows; memory is taken once."""

    def __init__(self, actions: tuple[str, ...]) -> None:
        self._actions = actions
        self._length = math.ceil(SECONDS * RATE)
        self._sums = np.zeros((self._length, len(actions)))
        self._counts = np.zeros(self._length)
        self._newest: int | None = None  # bin since the clock's zero
        self._segments: deque[Segment] = deque()
        self._latest: tuple[float, ...] = ()

    def take(self, labels: LiveLabels, ended: list[ClosedSegment]) -> None:
        """Take labels and the segments that they ended."""
        self._segments.extend(segment.segment for segment in ended)
        if not len(labels):
            return
        while self._segments and self._segments[0].end < labels.times[-1] - SECONDS:
            self._segments.popleft()
        if labels.probabilities is None:
            return
        times = labels.times
        recent = times > times[-1] - SECONDS + 1.0
        self._latest = tuple(labels.probabilities[-1].tolist())
        self._add(np.floor(times[recent] * RATE).astype(np.int64), labels.probabilities[recent])

    def end(self, builder: SegmentBuilder) -> None:
        """End the open segment: another recogniser goes on."""
        self._segments.extend(segment.segment for segment in builder.present)
        self._latest = ()

    def snapshot(self, builder: SegmentBuilder, cost: float) -> LiveSnapshot:
        """The snapshot of now."""
        segments = (*self._segments, *(segment.segment for segment in builder.present))
        return LiveSnapshot(
            segments, self._certainty(), builder.until, builder.action, self._latest, cost
        )

    def _add(self, bins: NDArray[np.int64], probabilities: NDArray[np.float64]) -> None:
        """Add probabilities to their bins; skipped bins are empty."""
        last = int(bins[-1])
        if self._newest is not None and last > self._newest:
            new_bins = np.arange(max(self._newest + 1, last - self._length + 1), last + 1)
            self._sums[new_bins % self._length] = 0.0
            self._counts[new_bins % self._length] = 0.0
        self._newest = last
        np.add.at(self._sums, bins % self._length, probabilities)
        np.add.at(self._counts, bins % self._length, 1.0)

    def _certainty(self) -> ProbabilityTrace | None:
        """The means, from the oldest bin to the newest."""
        if self._newest is None:
            return None
        bins = np.arange(self._newest - self._length + 1, self._newest + 1)
        rows = bins % self._length
        means = self._sums[rows] / np.maximum(self._counts[rows], 1.0)[:, None]
        values = np.rint(255.0 * np.clip(means, 0.0, 1.0)).astype(np.uint8)
        return ProbabilityTrace(float(bins[0]) / RATE, RATE, self._actions, values)


#: Seconds of latency, and points of accuracy lost against a second: preset ``fast``, leaving one
#: demonstration out, mean of the stylus and the foam (``forcelab evaluate --latency``).
LOSSES = ((0.0, 4.0), (0.05, 2.0), (0.1, 0.5), (0.3, 0.1), (1.0, 0.0))


@dataclass(frozen=True)
class LatencyBudget:
    """The shares of a latency, and which scales it leaves to be estimated."""

    latency: float  # seconds from a sample to its label
    #: ahead, filters: seconds of it that wavelets or windows look ahead, and filters or the decoder
    ahead: float
    filters: float
    scales: int  # of wavelets that are used on a stream; 0 where windows take their place
    early: tuple[EarlyScale, ...]  # those that are estimated before their wavelet has passed
    #: Points of accuracy that the latency takes against one of a second, as far as it was measured:
    #: see :data:`LOSSES`
    loss: float = 0.0


def latency_budget(recogniser: Recogniser, latency: float) -> LatencyBudget:
    """The shares of a latency in seconds, at the rate that the recogniser was trained at."""
    channels = [Channel(name, "N") for name in recogniser.channels]
    online = OnlineRecogniser(recogniser, latency, channels, recogniser.rate)
    budget = online.budget
    assert budget is not None
    scales = 0 if needs_live_model(recogniser.settings) else len(recogniser.settings.scales)
    # Of wavelets the errors of the early ones say it.
    loss = 0.0 if scales else float(np.interp(latency, *np.transpose(LOSSES)))
    filters = budget.lag * budget.hop
    return LatencyBudget(latency, budget.ahead, filters, scales, online.early, loss)


#: Seconds from a sample to its label where nothing else is asked for.
LATENCY = 0.3
#: Blocks whose ages are kept for the figures at the end: half an hour of them.
AGES = 100_000
#: Seconds over which the cost is averaged.
COSTED = 2.0


class LiveRecognition:
    """Labels of what devices give, for as long as a recording lasts, or until it is finished.

    Made when the devices are open; :meth:`begin` it with the recording, and :meth:`look` every now
    and then. Not thread-safe but for :attr:`snapshot`, the latest labels. `remarks` say that the
    recogniser learnt other units, or at a rate at which it saw more. An InputError says that the
    recogniser looks at a channel that no device has, or the latency is negative. All labels go to
    the `outlet` as well, if there is one.
    """

    def __init__(
        self,
        recogniser: Recogniser,
        name: str,
        latency: float,
        recorder: Recorder,
        outlet: LabelOutlet | None = None,
    ) -> None:
        self.author, self.latency, self.recogniser = model_author(name), latency, recogniser
        self._name, self._recorder, self._outlet = name, recorder, outlet
        self._merger = StreamMerger(recorder.devices, recorder.since)
        rate = self._merger.rate if self._merger.rate > 0 else None
        self._online = OnlineRecogniser(recogniser, latency, self._merger.channels, rate)
        self.remarks = recogniser.unit_remarks(self._merger.channels)
        if rate is not None:
            self.remarks += recogniser.rate_remarks(rate, "The samples come", "they have")
        self._segments = SegmentBuilder(self._online)
        self._recent = SnapshotBuffer(self._online.actions)
        self.snapshot = LiveSnapshot()
        self._closed_segments: list[ClosedSegment] = []
        self._ages: deque[float] = deque(maxlen=AGES)
        self._keeping = True
        self._begun = self._ended = math.nan
        self._cpu = 0.0
        self._costs: deque[tuple[float, float]] = deque()  # when, and seconds of CPU until then

    def renewed(self) -> LiveRecognition:
        """A new one of the same recogniser, in its initial state."""
        return LiveRecognition(
            self.recogniser, self._name, self.latency, self._recorder, self._outlet
        )

    def begin(
        self,
        *,
        keeping: bool = True,
        after: LiveRecognition | None = None,
        firsts: Sequence[int] | None = None,
    ) -> None:
        """Recognise from now on.

        With `keeping` all segments are kept until the end, not only those of the last seconds.
        `after` ends with this; its last labels stay to be seen. `firsts` are numbers of the samples
        to begin with instead, such as the recorder's
        :attr:`~forcelab.capture.recorder.Recorder.firsts` of a recording that just began.
        """
        if after is not None:
            self._recent = after._recent
            self._recent.end(after._segments)
            self.snapshot = self._recent.snapshot(self._segments, 0.0)
        self._keeping = keeping
        if firsts is None:
            self._merger.skip(self._recorder.latest(0.0))
            self._begun = time.monotonic()
        else:
            self._merger.start(firsts)
            self._begun = self._recorder.begun

    @property
    def now(self) -> str:
        """The action of the latest label and its probability; empty while there is none."""
        action, probability = self._segments.action, self._segments.probability
        if math.isnan(self._segments.until):
            return ""
        sure = "" if math.isnan(probability) else f" {probability:.2f}"
        return f"{action}{sure}" if action else "-"

    @property
    def begun(self) -> float:
        """When it or its recording began, in seconds of the host's monotonic clock."""
        return self._begun

    @property
    def finished(self) -> bool:
        """Whether it takes nothing more."""
        return not math.isnan(self._ended)

    def look(self) -> list[ClosedSegment]:
        """Take the new samples; gives the segments that have ended, nothing when finished."""
        if self.finished:
            return []
        worked = time.thread_time()
        times, values = self._merger.read()
        labels = self._online.push(times, values)
        closed = self._take(labels)
        if self._keeping:
            self._closed_segments += closed
        if len(labels):
            self._ages.append(time.monotonic() - float(labels.times[0]))
            self.snapshot = self._recent.snapshot(self._segments, self._cost())
        self._cpu += time.thread_time() - worked
        return closed

    def finish(self) -> list[ClosedSegment]:
        """Take the last samples, of a recording that has ended its last ones.

        Gives the segments that were waiting. Once is enough.
        """
        if self.finished:
            return []
        worked = time.thread_time()
        closed = self._take(self._online.push(*self._merger.read(self._recorder.ends)))
        closed += self._take(self._online.finish())
        self._recent.end(self._segments)
        closed += self._segments.finish()
        self._closed_segments += closed
        self._cpu += time.thread_time() - worked
        self._ended = time.monotonic()
        return closed

    def _take(self, labels: LiveLabels) -> list[ClosedSegment]:
        """Take labels that are decided; gives the segments that they end."""
        closed = self._segments.take(labels)
        self._recent.take(labels, closed)
        if self._outlet is not None:
            self._outlet.push(labels)
        return closed

    def keep(self, path: Path, saved: SavedRecording) -> dict[str, Any]:
        """Store the track with the demonstration; returns figures of it as plain values."""
        with Project.open(path) as project:
            stamps = project.media.stamps(saved.added.id)
            start = self._begun if stamps is None else float(stamps["start"])
            segments = self._within(start, saved.seconds)
            before = project.tracks.get(saved.added.id, self.author).segments
            if segments != before:
                description = f"recognised live, {self.latency:g} s after the force"
                project.tracks.edit(
                    saved.added.id, self.author, before, segments, description, kind="predict"
                )
        labelled = math.fsum(segment.duration for segment in segments)
        middle, most = np.percentile(self._ages, [50, 99]).tolist() if self._ages else (None, None)
        return {
            "author": self.author,
            "segments": len(segments),
            "labelled": labelled / saved.seconds if saved.seconds > 0 else 0.0,
            "latency": self.latency,
            "after": {"median": middle, "p99": most},
            "cpu": self._cpu / max(self._ended - self._begun, 1e-9),
        }

    def _within(self, start: float, seconds: float) -> tuple[Segment, ...]:
        """The segments on the demonstration's clock."""
        within = []
        for closed in self._closed_segments:
            begin, end = max(closed.start - start, 0.0), min(closed.end - start, seconds)
            if end > begin:
                within.append(Segment(begin, end, closed.action))
        return tuple(within)

    def _cost(self) -> float:
        """Share of a core that was taken of late."""
        now = time.monotonic()
        self._costs.append((now, self._cpu))
        while self._costs[0][0] < now - COSTED:
            self._costs.popleft()
        since, before = self._costs[0]
        return (self._cpu - before) / (now - since) if now > since else 0.0


def track_summary(figures: dict[str, Any]) -> str:
    """What became of a track, by the figures that :meth:`LiveRecognition.keep` gives."""
    segments = counted(figures["segments"], "segment")
    labelled = 100 * figures["labelled"]
    return f"Recognised by '{figures['author']}': {segments}, {labelled:.0f} % labelled"


def lost_track_sentence(error: Exception) -> str:
    """Why a recording has no track; a fault of the program is in the log besides."""
    if isinstance(error, InputError):
        return str(error)
    log.error("A live track is lost.", exc_info=error)
    fault = f"{type(error).__name__}: {error}"
    return f"The recogniser failed ({fault}): the recording is kept without its track."
