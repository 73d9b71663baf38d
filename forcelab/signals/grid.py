"""A recording on a uniform grid, which the wavelet transform needs.

A recording whose stamps are uniform already is taken as it is. Otherwise its samples are joined
by straight lines and read off at the grid's times; where the grid is coarser, frequencies that it
cannot hold are filtered out first. Nothing is invented in gaps: the grid runs through them, but
its samples there are marked and take no part in training, scoring or recognition. Values that no
sensor can have read count as missing too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS, LARGEST, Demonstration
from forcelab.errors import InputError
from forcelab.sample_runs import marked_runs
from forcelab.signals.conditioning import bridge, glitches
from forcelab.text import counted

#: Stamps count as uniform when none is further than this share of a period from its place.
UNIFORM = 0.02
#: Rates that differ by less than this share count as the same.
SAME_RATE = 0.01
#: A grid has at most this many samples, a day at 1 kHz; more come from a stray stamp.
MAX_SAMPLES = 86_400_000

Columns = Sequence[NDArray[np.float64]]


@dataclass(frozen=True, slots=True)
class Grid:
    """Signals on a uniform grid."""

    times: NDArray[np.float64]  # (n,), seconds on the demonstration's clock
    signals: NDArray[np.float64]  # (n, c), missing samples bridged by straight lines
    #: (n,), false in gaps of the stamps and in runs of samples that are missing (NaN, infinite,
    #: beyond :data:`~forcelab.demonstration.LARGEST`, or a glitch as of
    #: :func:`~forcelab.signals.conditioning.glitches`), longer than
    #: :data:`~forcelab.demonstration.GAP_PERIODS` periods.
    valid: NDArray[np.bool_]
    rate: float  # samples a second


def measured(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which values a sensor can have read: not NaN, nor beyond `LARGEST`."""
    return np.asarray((values >= -LARGEST) & (values <= LARGEST))


def _measured_or_nan(channel: NDArray[np.float64]) -> NDArray[np.float64]:
    """A channel, NaN where a value cannot have been read."""
    valid = measured(channel)
    return channel if valid.all() else np.where(valid, channel, np.nan)


def readings(channel: NDArray[np.float64]) -> NDArray[np.float64]:
    """The samples of a channel, NaN where a sensor cannot have read them; shape (n,).

    Glitches are found here, as recorded: on another grid each would be spread over more samples.
    """
    values = _measured_or_nan(channel)
    glitching = glitches(values)
    return np.where(glitching, np.nan, values) if glitching.any() else values


def _missing_runs(demonstration: Demonstration, columns: Columns) -> list[tuple[float, float]]:
    """Stretches ``[start, end)`` in which a channel misses more samples than a gap may have."""
    ends = np.append(demonstration.times, demonstration.end)
    runs = []
    for column in columns:
        runs += [
            (float(ends[first]), float(ends[last]))
            for first, last in marked_runs(~np.isfinite(column))
            if last - first > GAP_PERIODS
        ]
    return runs


def interpolate(
    times: NDArray[np.float64],
    stamps: NDArray[np.float64],
    values: NDArray[np.float64],
    *,
    longest: float = np.inf,
    beyond: float = np.inf,
) -> NDArray[np.float64]:
    """Samples at other times: on straight lines between those of increasing stamps.

    `times` (m,), `stamps` (n,) in seconds; `values` (n, c), NaN where missing; gives (m, c). NaN
    between stamps that are more than `longest` seconds apart, and more than `beyond` seconds before
    the first one or after the last one: up to there they hold their values.
    """
    out = np.stack([np.interp(times, stamps, column) for column in values.T], axis=1)
    if np.isfinite(longest):
        after = np.clip(np.searchsorted(stamps, times), 1, len(stamps) - 1)
        left, right = stamps[after - 1], stamps[after]
        out[(right - left > longest) & (left < times) & (times < right)] = np.nan
    out[(times < stamps[0] - beyond) | (times > stamps[-1] + beyond)] = np.nan
    return out


def on_grid(
    demonstration: Demonstration,
    rate: float | None = None,
    columns: Sequence[int] | None = None,
    start: float | None = None,
) -> Grid:
    """Bring a demonstration onto a uniform grid.

    `rate`: samples a second; the demonstration's own rate by default, and also where the two differ
    by less than 1 %, as measured rates of one device do; `columns` length c: recorded columns to
    take; all by default. What the others miss makes nothing invalid. The grid's rate is the
    demonstration's own where the one asked for differs from it by less than 1 %, since resampling
    would cost more than so small a stretch of the scales; else the one asked for to within 0.1 %,
    as a ratio of whole numbers to the demonstration's own. A grid that is not the recording's own
    begins at its first stamp, or at `start` (s), so that those of parts of it can be one.
    """
    recorded = demonstration.signals
    columns_read = range(recorded.shape[1]) if columns is None else columns
    chosen = [readings(recorded[:, column]) for column in columns_read]
    recorded_rate = 1.0 / demonstration.period
    target = rate or demonstration.rate
    start = demonstration.start if start is None else start
    if abs(target / recorded_rate - 1) < SAME_RATE:
        target = recorded_rate
    # Places from both ends: the median period's rounding would add up over a long recording.
    places = np.linspace(demonstration.times[0], demonstration.times[-1], len(demonstration.times))
    uniform = bool(np.max(np.abs(demonstration.times - places)) <= UNIFORM / recorded_rate)
    bridged = np.stack([bridge(column) for column in chosen], axis=1)
    if uniform and target == recorded_rate:
        times, signals = demonstration.times, bridged
    elif target >= recorded_rate:
        times = start + np.arange(_count(demonstration, target, start)) / target
        signals = interpolate(times, demonstration.times, bridged)
    else:
        count = _count(demonstration, recorded_rate, start)
        fine = start + np.arange(count) / recorded_rate
        # Fine samples a grid sample, as a fraction whose filter stays short for any rate.
        ratio = Fraction(recorded_rate / target).limit_denominator(
            max(1, int(1000 * target / recorded_rate))
        )
        up, down = ratio.denominator, ratio.numerator
        target = recorded_rate * up / down
        # With the usual beta of 5 a constant force would come out with a ripple of 1e-3.
        from scipy.signal import resample_poly  # takes a second to load

        signals = resample_poly(
            interpolate(fine, demonstration.times, bridged),
            up,
            down,
            padtype="edge",
            window=("kaiser", 8.0),
        )
        times = start + np.arange(len(signals)) / target
    valid = np.ones(len(times), dtype=bool)
    for begin, end in (*demonstration.gaps, *_missing_runs(demonstration, chosen)):
        # A stamp that lies on the edge but for rounding is on its far side.
        first, last = np.searchsorted(times, (begin - 1e-6 / target, end - 1e-6 / target))
        valid[first:last] = False
    return Grid(times, signals, valid, target)


def _count(demonstration: Demonstration, rate: float, start: float) -> int:
    """How many samples at `rate` lie from `start` to the last stamp, both included."""
    count = int(np.floor((demonstration.times[-1] - start) * rate + 1e-6)) + 1
    if count > MAX_SAMPLES:
        raise InputError(
            f"Demonstration '{demonstration.name}' spans {demonstration.duration:.6g} s, "
            f"{count:.3g} samples at {rate:.6g} Hz; remove stray stamps or ask for a lower rate."
        )
    return count


def glitch_remarks(demonstration: Demonstration) -> list[str]:
    """A remark on samples that :func:`~forcelab.signals.conditioning.glitches` finds, if any."""
    counts = {}
    for channel, values in zip(demonstration.channels, demonstration.signals.T, strict=True):
        if number := int(glitches(_measured_or_nan(values)).sum()):
            counts[channel.name] = number
    if not counts:
        return []
    total = sum(counts.values())
    each = ", ".join(f"{name} {number:,}" for name, number in counts.items())
    are = "is a glitch, no force, and counts" if total == 1 else "are glitches, no force, and count"
    return [f"{counted(total, 'sample')} {are} as missing ({each})."]
