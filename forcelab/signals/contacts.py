"""Contact events: the instants at which a force sets in, ceases or changes abruptly.

They are what a coder's edges are snapped to. Two things make one: the force crosses a threshold
above its rest (``touch``, ``leave``), or its rate of change has a peak (``jerk``). Both thresholds
come from the channel's own noise.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from itertools import pairwise
from operator import attrgetter
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from forcelab.arrays import Real
from forcelab.demonstration import GAP_PERIODS
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.signals.conditioning import noise_level
from forcelab.signals.grid import readings

Kind = Literal["touch", "leave", "jerk"]

#: Standard deviation of the Gaussian that smooths the force, s: the scale of the derivative.
SCALE = 0.004
#: Samples within this many standard deviations of the noise from the densest place are at rest.
AT_REST = 3.0
#: A force counts from this many standard deviations of its smoothed noise above rest ...
TOUCH = 8.0
#: ... and from this share of its largest deviation, since zeros creep.
TOUCH_SHARE = 0.01
#: What was touched is left again at this share of the threshold.
HYSTERESIS = 0.5
#: A rate of change counts from this many standard deviations of its noise ...
JERK = 8.0
#: ... and from this share of the channel's largest.
JERK_SHARE = 0.01
#: A peak rises by this share of it from the lower ground to either side.
PROMINENT = 0.2
#: A jerk sets in where the rate of change has this share of its peak.
ONSET = 0.25
#: Events closer than this many scales are one.
MERGED = 2.5
#: Samples of a channel that are worked on at once, and that its levels are estimated from.
CHUNK, SAMPLED = 2**18, 2**16


@dataclass(frozen=True, slots=True)
class ContactEvent:
    """An instant at which something began or ended to press, or slipped."""

    time: float  # when it sets in, s on the force clock
    kind: Kind  # the force rose from rest, came back to it, or changed abruptly
    #: How far above the threshold; 1 is just there. Comparable between channels and kinds: of a
    #: jerk by the peak of |dF/dt|, of a touch by the largest deviation from rest within 20 scales
    #: after it, of a leave by that before it.
    clearness: float


@dataclass(frozen=True, slots=True)
class _Levels:
    """What counts in one channel: rest and threshold of the force, threshold of its rate."""

    rest: float
    force: float
    rate: float


def find_contacts(
    times: ArrayLike, signals: ArrayLike
) -> Generator[Progress, None, tuple[ContactEvent, ...]]:
    """Find the contact events of a demonstration.

    `times` (n,): stamps in s, strictly increasing; may be irregular and have gaps; `signals` (n,
    c): NaN or infinity marks a missing sample. They come in order of time, no two closer than
    ``MERGED * SCALE`` (or two sample periods, if that is more); of those that were closer, the
    clearest.

    The force is smoothed with a Gaussian of standard deviation :data:`SCALE` (at least one sample),
    and so are the stamps: their ratio of differences is the rate of change, whatever the sampling.
    A stretch without samples longer than :data:`~forcelab.demonstration.GAP_PERIODS` periods ends
    what came before it; nothing is said about what happened in it. The cost is O(n c).
    """
    stamps = np.asarray(times, dtype=np.float64)
    values = np.asarray(signals)
    if values.ndim != 2 or stamps.shape != (len(values),):
        raise InputError(
            f"Contact events need one time for each row of signals; there are {stamps.size} times "
            f"and signals of shape {values.shape}."
        )
    period = float(np.median(np.diff(stamps[:CHUNK]))) if stamps.size > 1 else 1.0
    contacts: list[ContactEvent] = []
    for column in range(values.shape[1]):
        progress = Progress(column, values.shape[1], "looking for contact events")
        yield progress
        # Without glitches, which would hide all forces beside them.
        finite = np.isfinite(readings(values[:, column]))
        complete = bool(finite.all())
        t = stamps if complete else stamps[finite]
        x = values[:, column] if complete else values[finite, column]
        if t.size < 3:
            continue
        levels = yield from _levels(x, period, progress)
        breaks = np.flatnonzero(np.diff(t) > GAP_PERIODS * period) + 1
        edges = [0, *breaks.tolist(), t.size]
        for first, last in pairwise(edges):
            for events in _in_run(t[first:last], x[first:last], levels, period):
                contacts += events
                yield progress
    return _merge(contacts, max(MERGED * SCALE, 2.0 * period))


def _sigma(period: float) -> float:
    return max(SCALE / period, 1.0)


def _levels(x: Real, period: float, progress: Progress) -> Generator[Progress, None, _Levels]:
    """Rest and thresholds, from at most :data:`SAMPLED` samples spread over the channel.

    White noise of standard deviation s has, smoothed by a Gaussian of S samples, the standard
    deviation s / sqrt(2 sqrt(pi) S), and its derivative s / sqrt(4 sqrt(pi) S^3) a sample.
    """
    sigma = _sigma(period)
    blocks = [x] if x.size <= SAMPLED else np.array_split(x, 16)
    samples = [np.asarray(block[: SAMPLED // len(blocks)], dtype=np.float64) for block in blocks]
    noise = float(np.median([float(noise_level(block)) for block in samples]))
    # The densest half of a half of few samples lies anywhere in the noise: what is within the noise
    # of it tells where the middle is.
    spread = np.concatenate(samples)[:: max(1, len(samples) * samples[0].size // 8192)]
    rest = _densest(spread)
    near = spread[np.abs(spread - rest) <= AT_REST * noise]
    rest = float(np.median(near)) if near.size else rest
    largest, steepest = 0.0, 0.0
    step = max(1, round(sigma))
    for first in range(0, x.size, CHUNK):
        yield progress
        part = np.asarray(x[first : first + CHUNK + step], dtype=np.float64)
        largest = max(largest, float(np.max(np.abs(part - rest))))
        if part.size > step:
            steepest = max(steepest, float(np.max(np.abs(part[step:] - part[:-step]))))
    smoothed = noise / np.sqrt(2.0 * np.sqrt(np.pi) * sigma)
    rate = noise / np.sqrt(4.0 * np.sqrt(np.pi) * sigma**3) / period
    # A constant has no noise, and rounding is no event.
    dust = 1e-9 * max(largest, abs(rest)) + np.finfo(np.float64).tiny
    return _Levels(
        rest=rest,
        force=float(max(TOUCH * smoothed, TOUCH_SHARE * largest, dust)),
        rate=float(max(JERK * rate, JERK_SHARE * steepest / (step * period), dust / period)),
    )


def _densest(values: Real) -> float:
    """The half-sample mode: where values are closest together, as they are at rest."""
    v = np.sort(values)
    while v.size > 3:
        half = (v.size + 1) // 2
        first = int(np.argmin(v[half - 1 :] - v[: v.size - half + 1]))
        v = v[first : first + half]
    return float(np.mean(v))


def _in_run(t: Real, x: Real, levels: _Levels, period: float) -> Iterator[list[ContactEvent]]:
    """The events of one channel in a stretch without gaps, chunk by chunk."""
    from scipy.ndimage import gaussian_filter1d

    if t.size < 3:
        return
    sigma = _sigma(period)
    margin = int(np.ceil(20 * sigma))
    # None: whatever the first sample is, nothing was seen to begin or end there.
    pressed: bool | None = None
    for first in range(0, t.size, CHUNK):
        low, high = max(first - margin, 0), min(first + CHUNK + margin, t.size)
        core = slice(first - low, min(first + CHUNK, t.size) - low)
        origin = float(t[low])
        # At the ends both are flattened alike, so that their ratio is not.
        ts = gaussian_filter1d(t[low:high] - origin, sigma, mode="nearest")
        xs = gaussian_filter1d(
            np.asarray(x[low:high], dtype=np.float64) - levels.rest, sigma, mode="nearest"
        )
        clock = t[low:high]
        events, pressed = _crossings(clock, np.abs(xs), core, levels, margin, pressed)
        yield events + _jerks(clock, ts, xs, core, levels, sigma)


def _crossings(
    t: Real, y: Real, core: slice, levels: _Levels, reach: int, pressed: bool | None
) -> tuple[list[ContactEvent], bool]:
    """Touches and leaves in the core of a chunk, and the state after it."""
    part = y[core]
    state = np.where(part >= levels.force, 1, np.where(part < HYSTERESIS * levels.force, 0, -1))
    if pressed is None:
        pressed = bool(part[0] >= levels.force)
    last = np.maximum.accumulate(np.where(state >= 0, np.arange(state.size), -1))
    filled = np.where(last >= 0, state[np.maximum(last, 0)], int(pressed))
    events: list[ContactEvent] = []
    for change in np.flatnonzero(np.diff(filled, prepend=int(pressed))).tolist():
        place = core.start + change
        moment = _crossing(t, y, place, HYSTERESIS * levels.force)
        touched = bool(filled[change])
        around = y[place : place + reach] if touched else y[max(place - reach, 0) : place]
        clear = float(np.max(around, initial=0.0)) / levels.force
        events.append(ContactEvent(moment, "touch" if touched else "leave", clear))
    return events, bool(filled[-1])


def _crossing(t: Real, y: Real, place: int, level: float) -> float:
    """Where a straight line between samples meets the level, at or before a sample."""
    rising = bool(y[place] >= level)
    k = place
    while k > 0 and (y[k - 1] >= level) == rising:
        k -= 1
        if place - k > 4096:  # a force that creeps over the threshold: its crossing will do
            return float(t[place])
    if k == 0:
        return float(t[place])
    share = (level - y[k - 1]) / (y[k] - y[k - 1])
    return float(t[k - 1] + share * (t[k] - t[k - 1]))


def _jerks(
    t: Real, ts: Real, xs: Real, core: slice, levels: _Levels, sigma: float
) -> list[ContactEvent]:
    """Peaks of |dF/dt| in the core of a chunk, each with its onset."""
    from scipy.ndimage import maximum_filter1d

    rate = np.abs(np.gradient(xs) / np.maximum(np.gradient(ts), np.finfo(np.float64).tiny))
    reach = int(np.ceil(3 * sigma))
    peaks = np.flatnonzero((rate == maximum_filter1d(rate, 2 * reach + 1)) & (rate >= levels.rate))
    events = []
    for peak in peaks[(peaks >= core.start) & (peaks < core.stop)].tolist():
        first = max(peak - 4 * reach, 0)
        lowest = max(rate[first : peak + 1].min(), rate[peak : peak + 4 * reach + 1].min())
        if rate[peak] - lowest < max(PROMINENT * rate[peak], 0.5 * levels.rate):
            continue  # a ripple on a slope
        below = np.flatnonzero(rate[first:peak] < ONSET * rate[peak])
        onset = first + int(below[-1]) + 1 if below.size else first
        events.append(ContactEvent(float(t[onset]), "jerk", float(rate[peak]) / levels.rate))
    return events


def _merge(events: list[ContactEvent], apart: float) -> tuple[ContactEvent, ...]:
    """In order of time, the clearest of those that are closer than `apart`."""
    clearest: list[ContactEvent] = []
    for event in sorted(events, key=attrgetter("time")):
        if clearest and event.time - clearest[-1].time < apart:
            if event.clearness > clearest[-1].clearness:
                clearest[-1] = event
        else:
            clearest.append(event)
    return tuple(clearest)
