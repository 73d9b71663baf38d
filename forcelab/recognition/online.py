"""A trained recogniser on a stream: labels as the samples come, with a chosen latency.

The label of a step rests on the samples up to `latency` seconds after it and on no others. Wavelets
that have not passed by then are known by an early estimate with the end value held, whose expected
error :attr:`OnlineRecogniser.early` tells. The filters take the steps ahead that they need, at most
half of the latency; the wavelets have the rest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.labels import UNLABELLED
from forcelab.recognition.decided import Decided
from forcelab.recognition.live_part import needs_whole
from forcelab.recognition.online_budget import (
    TOLERANCE,
    Budget,
    Early,
    budget_of,
    limits_of,
    longest_gap,
)
from forcelab.recognition.online_classifier import classify, prober
from forcelab.recognition.online_features import StreamingFeatures
from forcelab.recognition.online_filters import CausalDrop, CausalMedian
from forcelab.recognition.online_grid import CausalGrid
from forcelab.recognition.online_resampling import Steps
from forcelab.recognition.online_windows import PartStages
from forcelab.recognition.recogniser import Recogniser
from forcelab.signals.channels import channel_map
from forcelab.signals.cwt import frequencies
from forcelab.signals.cwt_blocks import one_blas_thread
from forcelab.signals.streaming import StreamingCwt, early_error, reaches

__all__ = ["LONGEST", "Decided", "OnlineRecogniser", "check_latency", "with_latency"]

Real = NDArray[np.float64]

#: Samples of a demonstration that are pushed at once.
BLOCK = 4096
#: Greatest latency in seconds: what has been heard by then is kept in memory.
LONGEST = 600.0


def check_latency(latency: float) -> None:
    """Refuse a latency that nobody can have.

    Raises
    ------
    InputError
        If it is no number of seconds from 0 to :data:`LONGEST`.
    """
    if not 0 <= latency <= LONGEST:
        raise InputError(
            f"The latency is a number of seconds from 0 to {LONGEST:g}, not {latency:g}."
        )


class OnlineRecogniser:
    """Labels of a stream.

    Parameters
    ----------
    recogniser : Recogniser
    latency : float
        Seconds from a step to its label, 0 to :data:`LONGEST`. Samples that are waited for because
        some are missing come on top.
    channels : sequence of Channel
        The columns of the samples that will come.
    rate : float, optional
        Samples a second that the device gives; by default the stamps of the first samples tell.

    Raises
    ------
    InputError
        If the recogniser looks at a channel that is not there, or the latency is out of range.

    Notes
    -----
    Memory and time per sample stay the same for ever. Blocks may have any size; labels do not
    depend on it. Not safe to be called from two threads at once.
    """

    def __init__(
        self,
        recogniser: Recogniser,
        latency: float,
        channels: Sequence[Channel],
        rate: float | None = None,
    ) -> None:
        check_latency(latency)
        _check_live(recogniser)
        self._whole = needs_whole(recogniser.settings)
        self.recogniser = recogniser
        self.latency = latency
        self._channels = channel_map(channels, recogniser.channels)
        self._columns = list(self._channels.recorded)
        self._width = len(channels)
        self._grid = CausalGrid(len(self._columns), recogniser.rate, rate, longest_gap(recogniser))
        self._stages = None if rate is None else self._made()

    @property
    def actions(self) -> tuple[str, ...]:
        """The action of each code."""
        return self.recogniser.actions

    @property
    def budget(self) -> Budget | None:
        """What the latency is spent on; None before the device's period is known."""
        return None if self._stages is None else self._stages.budget

    @property
    def step(self) -> float | None:
        """Seconds between two labels; None before the device's period is known."""
        return None if self._stages is None else self._grid.step

    @property
    def early(self) -> tuple[Early, ...]:
        """The scales that are estimated, by the recogniser's rate until the device's is known."""
        recogniser = self.recogniser
        if self._whole:
            return ()
        period = 1 / recogniser.rate
        budget = self.budget or budget_of(recogniser, self.latency, period)
        scales, mother = recogniser.settings.scales, recogniser.settings.mother
        hertz = frequencies(scales, recogniser.rate, mother)
        return tuple(
            Early(float(a), float(hz), need * period, float(early_error(budget.features / a)))
            for a, hz, need in zip(
                scales, hertz, reaches(scales, mother, TOLERANCE).tolist(), strict=True
            )
            if need > budget.features
        )

    def push(self, times: Real, signals: Real) -> Decided:
        """Take samples as they were captured; give the labels that they decide.

        Parameters
        ----------
        times : array_like, shape (n,)
            Seconds, increasing; samples whose stamp is not later than the one before are left out.
        signals : array_like, shape (n, c)
            A column for each channel; NaN where a sample is missing.

        Raises
        ------
        InputError
            If the shapes do not fit.
        """
        stamps = np.atleast_1d(np.asarray(times, dtype=np.float64))
        values = np.asarray(signals, dtype=np.float64)
        if stamps.ndim != 1 or values.shape != (len(stamps), self._width):
            raise InputError(
                f"A block of {self._width} channels has stamps of shape (n,) and values of shape "
                f"(n, {self._width}), not {stamps.shape} and {values.shape}."
            )
        steps = self._grid.push(stamps, values[:, self._columns])
        if self._stages is None and self._grid.period is not None:
            self._stages = self._made()
        return self._through(steps)

    def finish(self) -> Decided:
        """End the stream: the labels that were waiting, with the last values held.

        A finished recogniser takes no further samples; make another one.
        """
        steps = self._grid.finish()
        if self._stages is None:
            self._stages = self._made()
        first = self._through(steps)
        with one_blas_thread():
            last = self._stages.finish()
        return _joined([first, last])

    def _made(self) -> _Stages | PartStages:
        budget = budget_of(self.recogniser, self.latency, self._grid.step, self._grid.lag)
        if self._whole:
            return PartStages(self.recogniser, budget, self._grid.step)
        return _Stages(self.recogniser, budget, self._grid.step)

    def _through(self, steps: Steps) -> Decided:
        if self._stages is None or not len(steps):
            return _nothing(self.recogniser)
        rows = np.ascontiguousarray(self._channels.apply(steps.signals).T)
        with one_blas_thread():
            return self._stages.push(steps.times, rows, steps.valid)


def with_latency(recogniser: Recogniser, demonstration: Demonstration, latency: float) -> Decided:
    """Recognise a demonstration as if it came live.

    Parameters
    ----------
    recogniser : Recogniser
    demonstration : Demonstration
    latency : float
        Seconds from a step to its label.

    Raises
    ------
    InputError
        As of :class:`OnlineRecogniser`.
    """
    online = OnlineRecogniser(recogniser, latency, demonstration.channels)
    times, signals = demonstration.times, demonstration.signals
    blocks = [slice(first, first + BLOCK) for first in range(0, len(times), BLOCK)]
    parts = [online.push(times[block], signals[block]) for block in blocks]
    return _joined([*parts, online.finish()])


def _check_live(recogniser: Recogniser) -> None:
    """Refuse a recogniser that needs all of a demonstration and learnt nothing for streams."""
    settings = recogniser.settings
    if not needs_whole(settings) or recogniser.live:
        return
    if settings.decodes:
        raise InputError(
            f"This recogniser of preset {settings.preset} learnt nothing to follow a stream with; "
            f"train it again."
        )
    raise InputError(
        f"A recogniser of preset {settings.preset} with these settings needs a whole "
        f"demonstration and cannot follow a stream; train one with preset fast, best or paper."
    )


def _nothing(recogniser: Recogniser) -> Decided:
    has = hasattr(recogniser.classifier, "predict_proba")
    probabilities = np.empty((0, len(recogniser.actions))) if has else None
    return Decided(np.empty(0), np.empty(0, dtype=np.int64), probabilities)


def _joined(parts: Sequence[Decided]) -> Decided:
    known = [part.probabilities for part in parts if part.probabilities is not None]
    return Decided(
        np.concatenate([part.times for part in parts]),
        np.concatenate([part.codes for part in parts]),
        np.concatenate(known) if known else None,
    )


class _Stages:
    """Everything behind the grid: features, classifier, filters, and what waits between them."""

    def __init__(self, recogniser: Recogniser, budget: Budget, period: float) -> None:
        settings = recogniser.settings
        self.budget = budget
        self._recogniser = recogniser
        self._probe = prober(recogniser.classifier)
        channels = len(recogniser.channels)
        transform = StreamingCwt(
            settings.scales, channels, settings.mother, TOLERANCE, budget.features, together=True
        )
        self._features = StreamingFeatures(channels, transform, budget.features, settings.phase)
        width = settings.median
        self._median = None if width is None else CausalMedian(width, budget.median)
        limits = limits_of(recogniser)
        self._drop = CausalDrop(limits, period, budget.drop) if limits else None
        # Steps that wait for a label: the first `_coded` of them have features and a code, the
        # first `_smooth` a median.
        self._times, self._valid = np.empty(0), np.empty(0, dtype=bool)
        self._probabilities = _nothing(recogniser).probabilities
        self._coded = self._smooth = 0

    def push(self, times: Real, rows: Real, valid: NDArray[np.bool_]) -> Decided:
        """Take steps of the grid."""
        self._times = np.concatenate([self._times, times])
        self._valid = np.concatenate([self._valid, valid])
        return self._decided(self._features.push(rows), ended=False)

    def finish(self) -> Decided:
        """Give the steps that were waiting."""
        return self._decided(self._features.finish(), ended=True)

    def _decided(self, features: Real, ended: bool) -> Decided:
        first, self._coded = self._coded, self._coded + len(features)
        valid = self._valid[first : self._coded]
        codes, probabilities = classify(self._recogniser, features, valid, self._probe)
        if self._probabilities is not None and probabilities is not None:
            self._probabilities = np.concatenate([self._probabilities, probabilities])
        first = self._coded - len(codes)
        if self._median is not None:
            codes = self._median.push(codes)
            if ended:
                codes = np.concatenate([codes, self._median.finish()])
            first, self._smooth = self._smooth, self._smooth + len(codes)
            codes[~self._valid[first : self._smooth]] = UNLABELLED
        if self._drop is not None:
            codes = self._drop.push(self._times[first : first + len(codes)], codes)
            if ended:
                codes = np.concatenate([codes, self._drop.finish()])
        n = len(codes)
        times, self._times = self._times[:n], self._times[n:]
        self._valid = self._valid[n:]
        self._coded -= n
        self._smooth -= n
        if self._probabilities is None:
            return Decided(times, codes, None)
        known, self._probabilities = self._probabilities[:n], self._probabilities[n:]
        return Decided(times, codes, known)
