from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.recognition.features import own_amplitude, window_features

WINDOWS = (0.01, 0.04, 0.16)
RATE = 500.0


def by_quadrature(channel, rate, window, place):
    """Level, slope and rms as sums over the samples, those beyond the ends held."""
    reach = int(10 * window * rate)
    u = np.arange(-reach, reach + 1) / rate
    weights = np.exp(-0.5 * (u / window) ** 2)
    weights /= weights.sum()
    held = channel[np.clip(place + np.arange(-reach, reach + 1), 0, len(channel) - 1)]
    level = weights @ held
    slope = (weights * u / window**2) @ held
    return level, slope, np.sqrt(weights @ (held - level) ** 2)


def test_features_are_those_of_direct_sums():
    random = np.random.default_rng(0)
    channels = np.cumsum(random.normal(size=(2, 600)), axis=1) + 40.0
    places = np.array([0, 3, 250, 599])
    found = window_features(channels, RATE, WINDOWS, places).reshape(4, 3, 2, 3)
    for p, place in enumerate(places):
        for i, channel in enumerate(channels):
            for j, window in enumerate(WINDOWS):
                expected = by_quadrature(channel, RATE, window, place)
                # A window is cut off after four standard deviations, beyond the ends at least.
                size = np.ptp(channel)
                errors = np.abs(found[p, :, i, j] - expected)
                assert np.all(errors <= size * np.array([3e-4, 3e-3 / window, 3e-3]))


def test_a_sine_has_the_level_slope_and_rms_of_the_closed_form():
    t = np.arange(4000) / RATE
    omega, s = 2 * np.pi * 3.0, 0.04
    place = np.array([2000])
    level, slope, rms = window_features(3.0 * np.sin(omega * t)[None], RATE, (s,), place)[0]
    fade, now = np.exp(-0.5 * (omega * s) ** 2), omega * t[2000]
    assert level == pytest.approx(3 * fade * np.sin(now), abs=1e-9)
    assert slope == pytest.approx(3 * omega * fade * np.cos(now), abs=1e-7)
    power = 4.5 * (1 - np.exp(-2 * (omega * s) ** 2) * np.cos(2 * now))
    assert rms == pytest.approx(np.sqrt(power - level**2), abs=1e-7)


def test_a_constant_channel_has_its_level_and_nothing_else():
    channels = np.array([np.full(300, -7.25), np.sin(np.arange(300) / 20)])
    found = window_features(channels, 100.0, WINDOWS, np.arange(300), "both")
    found = found.reshape(300, 2, 3, 2, 3)
    np.testing.assert_allclose(found[:, 0, 0, 0], -7.25)
    assert np.all(found[:, :, 1:, 0] == 0)  # slope and rms
    assert np.all(found[:, 1, 0, 0] == 0)  # from its rest, in its own unit
    assert np.isfinite(found).all()


@settings(max_examples=25, deadline=None)
@given(st.floats(0.01, 100.0), st.floats(-50.0, 50.0))
def test_the_own_amplitude_takes_out_gain_and_offset(gain, offset):
    channels = np.random.default_rng(1).normal(size=(2, 200)).cumsum(axis=1)
    places = np.arange(0, 200, 7)
    plain = window_features(channels, 100.0, WINDOWS, places, "own")
    changed = window_features(gain * channels + offset, 100.0, WINDOWS, places, "own")
    np.testing.assert_allclose(changed, plain, rtol=1e-6, atol=1e-6)


def test_both_are_the_absolute_features_beside_the_own_ones():
    channels = np.random.default_rng(2).normal(size=(3, 200)).cumsum(axis=1)
    places = np.arange(5, 200, 10)
    both = window_features(channels, 100.0, WINDOWS, places, "both")
    parts = [window_features(channels, 100.0, WINDOWS, places, a) for a in ("absolute", "own")]
    np.testing.assert_array_equal(both, np.concatenate(parts, axis=1))


def test_rare_peaks_leave_the_own_amplitude_alone():
    channels = np.tile(np.linspace(0, 1, 1000), (2, 1))
    channels[1, 500:510] = 1e6
    rest, size = own_amplitude(channels, 100.0)
    assert size[1] == pytest.approx(size[0], rel=0.05)
    assert rest[0] == rest[1]


def test_missing_samples_are_bridged():
    channels = np.linspace(0, 1, 400)[None].copy()
    whole = window_features(channels, 100.0, WINDOWS, np.arange(400))
    channels[0, 100:120] = np.nan
    np.testing.assert_allclose(window_features(channels, 100.0, WINDOWS, np.arange(400)), whole)
