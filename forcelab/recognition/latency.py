"""What a stream's labels are, stated plainly over a whole demonstration.

Slow and without state: every coefficient is the weighted sum of the samples that its step may
know, every filter a loop. :mod:`forcelab.recognition.online` must say the same.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from forcelab.demonstration import GAP_PERIODS, Demonstration
from forcelab.labels import UNLABELLED
from forcelab.recognition.decided import Decided
from forcelab.recognition.latency_windows import decided_by_part
from forcelab.recognition.live_part import needs_whole
from forcelab.recognition.online_budget import TOLERANCE, budget_of, limits_of, longest_gap
from forcelab.recognition.online_classifier import classify
from forcelab.recognition.online_features import EVERY, FIRST, SPAN, floors, rows_of
from forcelab.recognition.online_grid import CausalGrid
from forcelab.recognition.recogniser import Recogniser
from forcelab.signals.channels import channel_map
from forcelab.signals.streaming import StreamingCwt
from forcelab.signals.streaming_kernels import Kernel

__all__ = ["with_latency"]

Real = NDArray[np.float64]
Codes = NDArray[np.int64]


def with_latency(recogniser: Recogniser, demonstration: Demonstration, latency: float) -> Decided:
    """Recognise a demonstration as if each step had to be labelled `latency` seconds after it.

    Parameters
    ----------
    recogniser : Recogniser
    demonstration : Demonstration
    latency : float
        Seconds.

    Raises
    ------
    InputError
        If the demonstration lacks a channel that the recogniser looks at.

    Notes
    -----
    The features of the stream agree with these within 1e-8 of the largest coefficients. Only where
    two probabilities, or one and the threshold, lie as close as that leaves them, or a phase as
    close to its jump at pi, may a label differ.
    """
    channels = channel_map(demonstration.channels, recogniser.channels)
    grid = CausalGrid(len(channels.recorded), recogniser.rate, longest=longest_gap(recogniser))
    steps = grid.push(demonstration.times, demonstration.signals[:, list(channels.recorded)])
    steps = steps + grid.finish()
    budget = budget_of(recogniser, latency, grid.step, grid.lag)
    signals = channels.apply(steps.signals)
    if needs_whole(recogniser.settings):
        return decided_by_part(recogniser, steps, signals, budget, grid.step)
    features = _features(recogniser, signals, budget.features)
    from threadpoolctl import threadpool_limits

    probe = getattr(recogniser.classifier, "predict_proba", None)
    with threadpool_limits(1, user_api="blas"):
        codes, probabilities = classify(recogniser, features, steps.valid, probe)
    width = recogniser.settings.median
    if width is not None:
        codes = _median(codes, width, budget.median)
        codes[~steps.valid] = UNLABELLED
    limits = limits_of(recogniser)
    if limits:
        codes = _dropped(codes, steps.times, limits, grid.step, budget.drop)
    return Decided(steps.times, codes, probabilities)


def _features(recogniser: Recogniser, channels: Real, delay: int) -> Real:
    """Features of all steps, each from the samples up to `delay` steps after it."""
    settings = recogniser.settings
    q, n = channels.shape
    k = len(settings.scales)
    coefficients = np.empty((q, k, n), dtype=np.complex128)
    transform = StreamingCwt(settings.scales, 1, settings.mother, TOLERANCE, delay, together=True)
    for j, scale in enumerate(settings.scales.tolist()):
        ahead, past = int(transform.aheads[j]), int(transform.pasts[j])
        weights = Kernel.of(scale, settings.mother).weights(ahead, past)
        for i, channel in enumerate(channels):
            levelled = channel - channel[0]  # before the start the first value holds
            held = np.concatenate([levelled, np.full(ahead, levelled[-1])])
            coefficients[i, j] = fftconvolve(held, weights)[ahead : ahead + n]
    if settings.mother.real:
        coefficients.imag = 0.0
    out = np.empty((n, q * k * (2 if settings.phase else 1)))
    looks = [0, *range(EVERY, n + 1, EVERY)]
    for look, until in zip(looks, [*looks[1:], n + delay], strict=True):
        # The newest sample that a step knows decides which look at the noise it has.
        first, last = max(0, look - delay), min(n, max(0, until - delay))
        seen = channels[:, : min(look or FIRST, n)]
        floor = floors(
            seen[:, -SPAN:].T,
            np.max(np.abs(seen - channels[:, :1]), axis=1),
            settings.scales,
        )
        out[first:last] = rows_of(coefficients[:, :, first:last], floor, settings.phase)
    return out


def _median(codes: Codes, width: int, ahead: int) -> Codes:
    """The running median with at most `ahead` steps to look ahead."""
    before, after = width // 2, (width - 1) // 2
    n = len(codes)
    out = np.empty(n, dtype=np.int64)
    for i in range(n):
        places = np.clip(np.arange(i - before, i + after + 1), 0, min(n - 1, i + ahead))
        window = np.sort(codes[places])
        out[i] = (window[(width - 1) // 2] + window[width // 2] + 1) // 2
    return out


def _dropped(
    codes: Codes, times: Real, limits: dict[int, float], period: float, ahead: int
) -> Codes:
    """The drop heuristic with at most `ahead` steps to look ahead."""
    n = len(codes)

    def parted(i: int) -> bool:
        return codes[i] != codes[i - 1] or times[i] - times[i - 1] > GAP_PERIODS * period

    out = codes.copy()
    start = end = 0
    for i in range(n):
        if i == 0 or parted(i):
            start = i
            end = i + 1
            while end < n and not parted(end):
                end += 1
        newest = i + ahead
        if end <= min(newest, n):
            follows = end < n and times[end] - times[end - 1] <= GAP_PERIODS * period
            seconds = (times[end] if follows else times[end - 1] + period) - times[start]
        else:
            seconds = times[newest] - times[start]
        if codes[i] in limits and seconds < limits[int(codes[i])] - 1e-9:
            out[i] = UNLABELLED
    return out
