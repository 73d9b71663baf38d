"""A zero that wanders is told; loads, however they are held, are not."""

import numpy as np
import pytest
from scipy.signal import lfilter

from forcelab.capture.zero_drift import ZeroDrift

RATE = 200
SCALE = 40 / 16037  # newtons a count


def readings(seconds, seed=0, *, per_minute=0.0, loads=(), cutoff=15.0, noise=2.0):
    """Two axes in newtons: quantised, filtered noise, a drift of the first, loads on both."""
    rng = np.random.default_rng(seed)
    times = np.arange(int(seconds * RATE)) / RATE
    share = 1 - np.exp(-2 * np.pi * cutoff / RATE)
    white = rng.normal(size=(len(times), 2))
    # A filter of first order, as the DAQ has one.
    white, _ = lfilter([share], [1, share - 1], white, axis=0, zi=(1 - share) * white[:1])
    counts = noise * white / white.std()
    counts[:, 0] += per_minute / SCALE * times / 60
    for begin, end, newtons, wobble in loads:
        held = (times >= begin) & (times < end)
        counts[held] += (newtons + wobble * np.sin(7 * times[held, None])) / SCALE
    return times, np.round(counts) * SCALE


def drift_of(times, values, restart_at=None, block=8):
    wander = ZeroDrift(values.shape[1])
    for first in range(0, len(times), block):
        if restart_at is not None and times[first] >= restart_at:
            wander.restart()
            restart_at = None
        wander.update(times[first : first + block], values[first : first + block])
    return wander.drift


def handling(seconds):
    """Grabbing for 4 s of every 10 s, with a wobble as hands have it."""
    return tuple((10 * i + 4, 10 * i + 8, 8.0 - i % 3, 0.3) for i in range(int(seconds / 10)))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("noise", [0.0, 2.0, 6.0])
def test_a_zero_that_stays_is_no_alarm_whatever_is_done(seed, noise):
    times, values = readings(120, seed, loads=handling(120), noise=noise)
    assert (drift_of(times, values) == 0).all()


@pytest.mark.parametrize("per_minute", [0.8, -0.8])
def test_a_zero_that_wanders_while_things_are_handled_is_told(per_minute):
    times, values = readings(120, per_minute=per_minute, loads=handling(120))
    first, second = drift_of(times, values)
    assert second == 0
    assert first == pytest.approx(2 * per_minute, rel=0.2)


def test_a_wander_shows_without_any_load():
    times, values = readings(60, per_minute=0.5)
    assert drift_of(times, values)[0] == pytest.approx(0.5, rel=0.2)


def test_a_load_that_is_held_still_is_no_wander():
    """Even clamped, without the wobble of a hand."""
    times, values = readings(90, loads=[(10, 12, 10.0, 0.3), (20, 80, 6.0, 0.0)])
    assert (drift_of(times, values) == 0).all()


def test_a_load_in_the_first_seconds_is_no_part_of_the_zero():
    """A light one, held still between the quiet moments that the zero is taken from."""
    loads = [(1.4 + 5 * i, 3.4 + 5 * i, 0.4, 0.0) for i in range(24)]
    times, values = readings(120, loads=loads)
    assert (drift_of(times, values) == 0).all()


def test_a_zero_that_wanders_is_told_though_something_was_held_when_it_began():
    held = [(0.0, 1.2, 8.0, 0.0)]
    times, values = readings(120, per_minute=0.8, loads=[*held, *handling(120)])
    assert drift_of(times, values)[0] > 0.8


def test_zeroing_ends_it():
    times, values = readings(80, per_minute=0.8)
    values[times > 60] -= np.array([1.0, 0.0]) * 0.8 / 60 * times[times > 60, None]
    assert drift_of(times[times < 60], values[times < 60])[0] > 0
    assert drift_of(times, values, restart_at=60)[0] == 0


def test_constant_and_missing_readings_are_no_alarm():
    times = np.arange(4000) / RATE
    values = np.ones((4000, 2))
    assert (drift_of(times, values) == 0).all()
    values[:, 1] = np.nan
    assert (drift_of(times, values) == 0).all()
    assert (ZeroDrift(2).drift == 0).all()
