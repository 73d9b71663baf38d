"""A video's clock found by itself: where its motion and the force change abruptly together.

Which shift fits best is told by :mod:`~forcelab.signals.likeness`; here it is made exact by the
taps, and it is decided how far it may be believed.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.clock import ClockMap, fit_clock
from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.project.films import said_of_film
from forcelab.signals.grid import readings
from forcelab.signals.likeness import (
    DRIFT,
    Match,
    best_shift,
    force_track,
    motion_track,
    rates_to_try,
)
from forcelab.signals.tapping import Tap, find_taps
from forcelab.video.motion import measuring_motion

__all__ = ["Proposal", "proposing", "proposing_for"]

Array = NDArray[np.float64]

#: Samples a second of the common grid, and of that for recordings longer than :data:`LONG` s.
RATE, COARSE_RATE, LONG = 200.0, 50.0, 900.0
#: Frames or samples needed.
SHORTEST = 16
#: The share of the highest peak that the next one has: nothing is sure from the first on, all is
#: at the second. Measured on simulated demonstrations, with and without their taps.
DOUBTFUL, SURE = 0.9, 0.55
#: The same for the correlation alone: taps may meet anything in a video that shows nothing.
UNLIKE, ALIKE = 0.08, 0.2
#: Without two taps that agree nothing is proposed with more confidence.
UNTAPPED = 0.45
#: How far from the coarse shift a tap's frame is looked for, s.
SOUGHT = 0.08
#: How far the coarse comparison is trusted, s; how far from the shift that fits all taps one of
#: them may lie, in frames, and how much motion must grow there, in usual growths.
DOUBTED, NEXT, GROWN = 0.05, 1.0, 0.5
#: By how much the motion grows at the taps on average, in usual growths: nothing is sure below the
#: first, as another motion may be meant; all is from the second on.
FAINT, PLAIN = 0.5, 1.0
#: A proposal with less confidence is one to look at twice.
TRUSTED = 0.5
#: Taps further from the fitted clock than this share of a frame's time do not agree.
AGREEING = 1.0


@dataclass(frozen=True, eq=False)
class Proposal:
    """A clock that was found, and how far it may be believed.

    Parameters
    ----------
    clock : ClockMap
        From the video's own time to force time.
    confidence : float
        0..1. Of the 30 demonstrations of the sample project 22 were above 0.5, all of them right to
        within 19 ms, and all 30 to within 50 ms; of 20 made after the bounds were set 15, to within
        18 ms. Above 0.5 were also 15 of 309 videos put to the force of another demonstration, whose
        taps happened to fit: of the same task one in nine.
    residual : float
        Root mean square distance of the taps from the clock, s; 0 without taps.
    taps : tuple of (float, float)
        Pairs of video and force time (s) at which a tap was found in both.
    motion, force : ndarray, shape (2, m)
        What was compared, for looking at: rows of own times (s) and values of 0..1.
    """

    clock: ClockMap
    confidence: float
    residual: float
    taps: tuple[tuple[float, float], ...]
    motion: Array
    force: Array

    @property
    def doubtful(self) -> bool:
        """Whether it is to be looked at before it is believed."""
        return self.confidence < TRUSTED


def proposing_for(demonstration: Demonstration) -> Generator[Progress, None, Proposal]:
    """Propose the clock of a demonstration's video; see :func:`proposing`.

    Channels in newtons are looked at; where there is none, all channels in equal parts.

    Raises
    ------
    InputError
        If there is no video, it cannot be read, or it or the force is too short.
    """
    if demonstration.video is None:
        raise InputError(f"Demonstration '{demonstration.name}' has no video to synchronise.")
    path = demonstration.video.path
    try:
        motion = yield from measuring_motion(path)
    except InputError as error:
        raise InputError(said_of_film(str(error), path, demonstration.name)) from error
    force = demonstration.signals
    newtons = [channel.unit == "N" for channel in demonstration.channels]
    if any(newtons):
        force = force[:, newtons]
    else:
        force = _known(force)  # as recorded: divided, a glitch would be none
        spread = np.nanstd(force, axis=0)
        force = force / np.where(spread > 0, spread, 1.0)
    return (yield from proposing(motion.times, motion.energy, demonstration.times, force))


def proposing(
    frame_times: ArrayLike, energy: ArrayLike, force_times: ArrayLike, force: ArrayLike
) -> Generator[Progress, None, Proposal]:
    """Propose a video's clock from its motion and the force.

    Parameters
    ----------
    frame_times : array_like, shape (n,)
        Timestamps of the frames on the video's clock, s, strictly increasing.
    energy : array_like, shape (n,)
        Motion between the frame before and each frame, such as of
        :func:`~forcelab.video.motion.measuring_motion`.
    force_times : array_like, shape (m,)
        Stamps of the force's samples, s, strictly increasing.
    force : array_like, shape (m,) or (m, c)
        Force channels; NaN or infinity marks missing samples.

    Yields
    ------
    Progress

    Returns
    -------
    Proposal

    Raises
    ------
    InputError
        If shapes do not fit, or there is less than a second of either.

    Notes
    -----
    The offset has no bounds but that video and force overlap by half of the shorter one. The rate
    stays 1 unless the recording is long enough to tell: clocks differ by some 50e-6, a tap is seen
    to half a frame's time, so that a rate from taps ten seconds apart would be worse than none.
    """
    t, e = _checked(frame_times, energy, "video")
    ft, f = _checked(force_times, force, "force")
    f = _known(f)  # beside a glitch no tap would be clear
    yield Progress(0, 1, "looking for taps in the force")
    taps = find_taps(ft, f)
    grid = RATE if max(t[-1] - t[0], ft[-1] - ft[0]) <= LONG else COARSE_RATE
    motion = motion_track(t, e[:, 0], grid)
    rate = force_track(ft, f, grid)
    rates = rates_to_try(min(float(t[-1] - t[0]), float(ft[-1] - ft[0])))
    best: Match | None = None
    for done, drift in enumerate(rates):
        yield Progress(done, len(rates), "comparing motion and force")
        found = best_shift(motion, rate, taps, drift)
        if best is None or found.score > best.score:
            best = found
    assert best is not None
    clock, residual, pairs, clear = _refined(best.clock, t, e[:, 0], taps)
    confidence = _share(best.ratio, DOUBTFUL, SURE) * _share(best.alike, UNLIKE, ALIKE)
    confidence = min(UNTAPPED, confidence) if clear is None else confidence * clear
    return Proposal(clock, confidence, residual, pairs, motion.shown(), rate.shown())


def _known(force: Array) -> Array:
    """Force channels (m, c) with NaN for what no sensor can have read."""
    return np.stack([readings(channel) for channel in force.T], axis=1)


def _share(value: float, nothing: float, everything: float) -> float:
    """Where a value lies between two, 0..1."""
    return float(np.clip((value - nothing) / (everything - nothing), 0.0, 1.0))


def _checked(times: ArrayLike, values: ArrayLike, what: str) -> tuple[Array, Array]:
    """Times (n,) and values (n, c) as floats.

    Raises
    ------
    InputError
        If they do not fit or are shorter than a second.
    """
    t = np.asarray(times, dtype=np.float64)
    v = np.asarray(values, dtype=np.float64)
    v = v[:, np.newaxis] if v.ndim == 1 else v
    if t.ndim != 1 or v.ndim != 2 or len(v) != t.size:
        raise InputError(
            f"Synchronising needs one time for each value of the {what}; there are {t.size} times "
            f"and values of shape {v.shape}."
        )
    if t.size < SHORTEST or t[-1] - t[0] < 1.0:
        raise InputError(
            f"The {what} is too short to find the video's clock by; mark a tap by hand instead."
        )
    return t, v


def _refined(
    coarse: ClockMap, times: Array, energy: Array, taps: tuple[Tap, ...]
) -> tuple[ClockMap, float, tuple[tuple[float, float], ...], float | None]:
    """The clock through the taps, its residual (s), the taps, and how clearly they are seen, 0..1.

    The last is None unless two or more are seen, and agree.

    A tap lies between the frame that first shows it and the one before, where the motion grows.
    One tap alone may be mistaken for another motion near it; so the shift is taken for which the
    motion grows most at all of them together. The rate is changed only where the taps tell it
    beyond three times their uncertainty.
    """
    frame = float(np.median(np.diff(times)))
    middle = 0.5 * (times[1:] + times[:-1])
    growth = _growth(energy)
    places = coarse.to_device([tap.time for tap in taps])
    filmed = (places > middle[0]) & (places < middle[-1])
    felt = np.array([tap.time for tap in taps])[filmed]
    places = places[filmed]
    if felt.size == 0:
        return coarse, 0.0, (), None
    shifts = np.arange(-SOUGHT, SOUGHT + 5e-4, 1e-3)
    between = np.searchsorted(times, places[:, np.newaxis] + shifts) - 1
    grown = growth[np.clip(between, 0, growth.size - 1)]
    votes = grown.sum(axis=0)
    top = int(np.argmax(votes * np.exp(-0.5 * (shifts / DOUBTED) ** 2)))
    # The taps stay between the same frames for a while: the middle of it is the likeliest.
    same = np.flatnonzero((between == between[:, top : top + 1]).all(axis=0))
    shift = float(0.5 * (shifts[same[0]] + shifts[same[-1]]))
    pairs = []
    for place, time in zip((places + shift).tolist(), felt.tolist(), strict=True):
        near = np.flatnonzero(np.abs(middle - place) <= NEXT * frame)
        if near.size and growth[near].max() > GROWN:
            pairs.append((float(middle[near[np.argmax(growth[near])]]), time))
    if not pairs:
        return coarse, 0.0, (), None
    clock = ClockMap(coarse.offset - coarse.rate * shift, coarse.rate)
    seen, felt = np.array(pairs).T
    spread = float(np.sqrt(np.sum((seen - seen.mean()) ** 2)))
    if len(pairs) > 1 and spread > 0:
        fitted = fit_clock(seen.tolist(), felt.tolist()).clock
        # A tap is uncertain by a frame's time, evenly.
        unsure = frame / np.sqrt(12.0) / spread
        if 3.0 * unsure < abs(fitted.rate - coarse.rate) and abs(fitted.rate - 1.0) < DRIFT:
            clock = fitted
    away = np.abs(clock.to_force(seen) - felt)
    agree = len(pairs) > 1 and bool(np.all(away <= AGREEING * frame))
    clear = _share(float(votes[top]) / felt.size, FAINT, PLAIN) if agree else None
    return clock, float(np.sqrt(np.mean(away**2))), tuple(pairs), clear


def _growth(energy: Array) -> Array:
    """By how much more moves in a frame and the next than in the two before, in usual amounts.

    Two, since what touches slows down before and is seen for more than one frame.
    """
    root = np.sqrt(np.maximum(energy[1:], 0.0))
    x = np.concatenate([np.repeat(root[:1], 2), root, root[-1:]])
    growth = x[2:-1] + x[3:] - x[1:-2] - x[:-3]
    usual = float(np.quantile(np.abs(growth), 0.8)) or 1.0
    return np.minimum(growth / usual, 4.0)
