"""What the labels of a recogniser's part for streams are, stated plainly over a demonstration."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.labels import UNLABELLED
from forcelab.recognition.causal import COARSE, FORGETTING, LARGEST, TRUST, CausalWindows
from forcelab.recognition.decided import Decided
from forcelab.recognition.fixed_lag import FixedLag
from forcelab.recognition.live_part import hop_of
from forcelab.recognition.online_budget import Budget
from forcelab.recognition.online_resampling import Steps
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.windows import REACH, REST

__all__ = ["decided_by_part", "plain_features"]

Real = NDArray[np.float64]


def decided_by_part(
    recogniser: Recogniser, steps: Steps, channels: Real, budget: Budget, period: float
) -> Decided:
    """Label all steps of the grid.

    Parameters
    ----------
    recogniser : Recogniser
        With parts for streams.
    steps : Steps
        Of the whole demonstration, n of them.
    channels : ndarray, shape (q, n)
        Recognition channels there.
    budget : Budget
        What the latency is spent on.
    period : float
        Seconds between two steps.
    """
    n, hop = len(steps), hop_of(recogniser.settings, 1.0 / period)
    none = np.zeros((n, len(recogniser.actions)))
    if not n:
        return Decided(steps.times, np.empty(0, dtype=np.int64), none)
    looks = [round(part.windows.look / period) for part in recogniser.live]
    part = recogniser.live[looks.index(budget.features)]
    features = plain_features(part.windows, channels, 1.0 / period, hop)
    places = np.minimum(np.arange(len(features)) * hop + hop // 2, n - 1)
    valid = steps.valid[places]
    known = none[: len(features)].copy()
    if valid.any():
        known[np.ix_(valid, part.classifier.classes_)] = part.classifier.predict_proba(
            features[valid]
        )
    assert recogniser.choreography is not None
    use = recogniser.settings.choreography
    lag = budget.decoder // hop
    decoder = FixedLag(hop * period, lag, recogniser.choreography, use)  # type: ignore[arg-type]
    with np.errstate(divide="ignore"):
        codes = np.concatenate([decoder.push(np.log(known), valid), decoder.finish()])
    around = np.minimum(np.arange(n) // hop, len(features) - 1)
    return Decided(
        steps.times,
        np.where(steps.valid, codes[around], UNLABELLED),
        np.where(steps.valid[:, None], known[around], 0.0),
    )


def plain_features(what: CausalWindows, channels: Real, rate: float, hop: int) -> Real:
    """Features of all time steps, one after the other and window by window; shape (m, f)."""
    q, n = channels.shape
    ready = np.clip(channels / what.usual[:, None], -LARGEST, LARGEST)
    ahead = round(what.look * rate)
    count = max(1, int(np.ceil((n - hop // 2) / hop)))
    out = np.empty((count, 3, q, len(what.windows)))
    for step in range(count):
        middle = step * hop + hop // 2
        newest = middle + ahead
        for number, spread in enumerate(what.windows):
            width = spread
            if spread >= COARSE * hop / rate:
                cells = int(np.ceil((REACH * spread * rate + ahead) / hop)) + 2
                ends = newest - hop * np.arange(cells)[::-1]
                around = np.clip(ends[:, None] - np.arange(hop), 0, n - 1)
                times = np.array((ends - (hop - 1) / 2 - middle) / rate)
                values, within = ready[:, around].mean(axis=2), ready[:, around].var(axis=2)
            else:
                reach = int(np.ceil(REACH * spread * rate))
                offsets = np.arange(-reach - 1, min(ahead, reach) + 1)
                times, width = offsets / rate, max(spread, 0.5 / rate)
                values = ready[:, np.clip(middle + offsets, 0, n - 1)]
                within = np.zeros_like(values)
            times, values, within = _near(times, values, within, width)
            weights = np.exp(-0.5 * (times / width) ** 2)
            weights /= weights.sum()
            first = values[:, :1]
            level = first[:, 0] + (values - first) @ weights
            off = times - times @ weights
            out[step, 0, :, number] = level
            out[step, 1, :, number] = (values - first) @ (weights * off) / (weights @ off**2)
            variance = ((values - level[:, None]) ** 2 + within) @ weights
            out[step, 2, :, number] = np.sqrt(variance)
    if what.own:
        rest, size = _running(ready, rate, hop, ahead, count)
        out[:, 0] -= rest[:, :, None]
        out /= size[:, None, :, None]
    return out.reshape(count, -1)


def _near(times: Real, values: Real, within: Real, spread: float) -> tuple[Real, Real, Real]:
    """What lies within a window's reach, and the one value before."""
    first = max(0, int(np.searchsorted(times, -REACH * spread, side="right")) - 1)
    return times[first:], values[:, first:], within[:, first:]


def _running(ready: Real, rate: float, hop: int, ahead: int, count: int) -> tuple[Real, Real]:
    """Level at rest and size of the movements so far, each of shape (count, q)."""
    n, limit = ready.shape[1], max(1, round(REST * rate))
    rests, sizes = np.empty((2, count, len(ready)))
    squares, total = np.zeros((2, len(ready)))
    newest = hop // 2 + ahead
    for step in range(-(newest // hop), count):
        last = newest + step * hop
        rest = np.median(ready[:, np.clip(np.arange(min(last + 1, limit)), 0, n - 1)], axis=1)
        cell = ready[:, np.clip(np.arange(last - hop + 1, last + 1), 0, n - 1)]
        away = np.abs(cell - rest[:, None])
        keep = np.exp(-hop / rate / FORGETTING)
        squares = keep * squares + np.square(away).sum(axis=1) / rate
        total = keep * total + away.sum(axis=1) / rate
        if step >= 0:
            rests[step], sizes[step] = rest, (squares + TRUST) / (total + TRUST)
    return rests, sizes
