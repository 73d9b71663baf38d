"""The sensors: what is stored of a force, against closed forms and scipy."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import welch

from forcelab.simulation.sensor import CHANNELS, Sensor, record

RATE = 4000.0
SIX = np.ones(6)
#: Rounds to a hundred-thousandth of a newton and does nothing else but filter.
QUIET = Sensor(counts=1e5 * SIX, noise=0 * SIX, drift=0 * SIX, hum=0 * SIX, creep=0.0, losses=0.0)


def recorded(forces, sensor=QUIET, rate=RATE, at=1000.0, seed=1):
    return record(forces, rate, at, sensor, np.random.default_rng(seed))


def times(seconds, rate=RATE):
    return np.arange(round(seconds * rate)) / rate


def tone(hertz, newton, seconds=2.0, rate=RATE):
    """The same sine on all channels."""
    return np.outer(newton * np.sin(2 * np.pi * hertz * times(seconds, rate)), SIX)


def test_a_steady_force_is_read_as_it_is_from_the_first_sample_on():
    force = np.array([1.0, -2.0, -8.0, 0.5, 3.0, -7.0])
    result = recorded(np.tile(force, (4000, 1)), replace(QUIET, creep=0.05))
    np.testing.assert_allclose(result.signals, np.tile(force, (1000, 1)), atol=5.1e-6)
    np.testing.assert_array_equal(result.times, np.arange(1000) / 1000)
    assert not result.saturated.any()
    assert result.signals.shape[1] == len(CHANNELS)


def test_gains_and_cross_talk_are_found_again_by_regression():
    sensor = Sensor.drawn(np.random.default_rng(5))
    slow = np.stack([np.sin(2 * np.pi * f * times(20.0)) for f in np.arange(1, 7) / 10], axis=1)
    sensor = replace(sensor, creep=0.0, drift=0 * SIX, losses=0.0)
    result = recorded(3 * slow, sensor)
    known = np.column_stack([3 * slow[::4], np.ones(20_000)])
    found = np.linalg.lstsq(known, result.signals, rcond=None)[0]
    np.testing.assert_allclose(found[:6].T, sensor.response, atol=5e-4)
    np.testing.assert_allclose(found[6], sensor.offset, atol=5e-4)
    assert np.abs(sensor.response - np.eye(6)).max() > 0.01


def test_the_sensors_do_not_disturb_each_other_and_gains_are_within_a_few_percent():
    for seed in range(20):
        response = Sensor.drawn(np.random.default_rng(seed)).response
        assert not response[:3, 3:].any()
        assert not response[3:, :3].any()
        assert np.abs(response - np.eye(6)).max() <= 0.05


def test_without_force_there_is_the_offset_and_white_noise_of_the_stated_strength():
    offset = np.array([0.1, -0.2, 0.3, 0.0, -0.4, 0.05])
    noise = np.array([3.0, 5.0, 7.5, 4.0, 10.0, 17.0]) * 1e-3
    sensor = replace(QUIET, counts=Sensor().counts, noise=noise, offset=offset)
    signals = recorded(np.zeros((80_000, 6)), sensor).signals
    rounding = 1 / (12 * sensor.counts**2)  # of a uniform error
    np.testing.assert_allclose(signals.std(axis=0), np.sqrt(noise**2 + rounding), rtol=0.02)
    np.testing.assert_allclose(signals.mean(axis=0), offset, atol=4e-4)
    frequency, density = welch(signals, 1000.0, nperseg=500, axis=0)
    low = density[(frequency > 5) & (frequency < 100)].mean(axis=0)
    high = density[frequency > 400].mean(axis=0)
    np.testing.assert_allclose(low / high, 1.0, atol=0.1)
    correlation = np.corrcoef(signals.T) - np.eye(6)
    assert np.abs(correlation).max() < 0.03


def test_what_is_stored_are_whole_counts_and_every_count_occurs():
    sensor = replace(QUIET, counts=np.array([767.5, 812.5, 158.61, 429.8, 467.8, 165.95]))
    ramp = np.outer(np.linspace(-2, 2, 40_000), SIX)
    signals = recorded(ramp, sensor).signals
    for column, counts in zip(signals.T, sensor.counts, strict=True):
        steps = np.unique(np.rint(column * counts))
        np.testing.assert_allclose(column * counts, np.rint(column * counts), atol=1e-9)
        np.testing.assert_array_equal(np.diff(steps), 1)
        assert len(steps) == pytest.approx(4 * counts, rel=0.01)


# --- time ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("hertz", [1900.0, 1100.0, 850.0])
def test_a_tone_above_half_the_rate_vanishes_instead_of_folding_down(hertz):
    signals = recorded(tone(hertz, 5.0), replace(QUIET, bandwidth=300.0)).signals[200:]
    expected = 5.0 * (1 + (hertz / 300.0) ** 12) ** -0.5  # Butterworth's, before any warping
    assert np.abs(signals).max() <= expected + 1e-5
    assert np.abs(signals).max() < 0.01


@pytest.mark.parametrize("hertz", [5.0, 100.0, 300.0])
@pytest.mark.parametrize("rate", [4000.0, 4800.0, 6173.0])
def test_a_slower_tone_passes_as_butterworths_formula_says_at_any_ratio_of_rates(hertz, rate):
    signals = recorded(tone(hertz, 5.0, rate=rate), replace(QUIET, bandwidth=300.0), rate).signals
    expected = 5.0 / np.sqrt(2) * (1 + (hertz / 300.0) ** 12) ** -0.5
    np.testing.assert_allclose(signals[400:1900].std(axis=0), expected, rtol=0.02)


def test_nothing_is_felt_before_it_happens():
    forces = np.zeros((4000, 6))
    forces[2000:] = -5.0
    signals = recorded(forces).signals
    assert not signals[:500].any()
    assert (signals[510:] < -4.0).all()


def test_a_force_that_was_held_leaves_the_zero_off_for_a_while():
    sensor = replace(QUIET, creep=0.04, creep_time=0.5)
    forces = np.zeros((16_000, 6))
    forces[2000:8000] = -3.0  # from 0.5 s to 2 s
    signals = recorded(forces, sensor).signals
    left = -3.0 * 0.04 * (1 - np.exp(-1.5 / 0.5))
    for after in (0.1, 0.5, 1.5):
        here = signals[round(1000 * (2 + after))]
        np.testing.assert_allclose(here, left * np.exp(-after / 0.5), rtol=0.02)
    np.testing.assert_allclose(signals[1990], -3.0 * (1 - 0.04 * np.exp(-1.49 / 0.5)), rtol=1e-4)


def test_the_zero_walks_as_far_as_the_square_root_of_time():
    sensor = replace(QUIET, drift=0.01 * SIX)
    ends = [recorded(np.zeros((800, 6)), sensor, 40.0, 40.0, seed).signals for seed in range(200)]
    start, end = np.array(ends)[:, 0], np.array(ends)[:, -1]
    assert start.std() == pytest.approx(0.01 * np.sqrt(10.0), rel=0.1)
    assert (end - start).std() == pytest.approx(0.01 * np.sqrt(20.0), rel=0.1)


def test_mains_hum_stands_in_the_spectrum_where_the_mains_are():
    sensor = replace(QUIET, hum=0.002 * SIX, mains=60.0)
    signals = recorded(np.zeros((40_000, 6)), sensor).signals
    spectrum = np.abs(np.fft.rfft(signals, axis=0)) * 2 / len(signals)
    np.testing.assert_array_equal(spectrum[1:].argmax(axis=0) + 1, 600)  # bins of 0.1 Hz
    np.testing.assert_allclose(spectrum[600], 0.002, rtol=0.01)


# --- what goes wrong in a device ----------------------------------------------------------------


def test_a_force_beyond_the_range_is_clipped_and_said_to_be():
    forces = np.zeros((8000, 6))
    forces[:, 2] = -30 * np.sin(np.pi * times(2.0) / 2)
    sensor = replace(QUIET, limits=np.array([20, 20, 25, 20, 20, 25.0]))
    result = recorded(forces, sensor)
    free = recorded(forces, replace(sensor, limits=100 * SIX))
    assert result.signals.min() == -25.0
    np.testing.assert_array_equal(result.saturated, free.signals < -25.0)
    assert result.saturated[:, 2].sum() > 500
    assert not result.saturated[:, [0, 1, 3, 4, 5]].any()
    assert not free.saturated.any()
    np.testing.assert_array_equal(
        result.signals[~result.saturated], free.signals[~result.saturated]
    )


@given(st.integers(0, 1000), st.floats(0.1, 20.0), st.floats(1.0, 5.0))
@settings(max_examples=25, deadline=None)
def test_lost_samples_leave_gaps_in_the_stamps_and_the_rest_as_it_is(seed, losses, length):
    forces = tone(3.0, 4.0)
    sensor = replace(Sensor(), losses=losses, loss_length=length)
    some = recorded(forces, sensor, seed=seed)
    every = recorded(forces, replace(sensor, losses=0.0), seed=seed)
    stored = np.isin(every.times, some.times)
    np.testing.assert_array_equal(some.times, every.times[stored])
    np.testing.assert_array_equal(some.signals, every.signals[stored])
    assert len(some.saturated) == len(some.times)
    assert stored[0]
    assert stored[-1]


def test_a_recording_begins_and_ends_with_a_sample_however_many_are_lost():
    sensor = replace(QUIET, losses=300.0, loss_length=4.0)
    for seed in range(20):
        result = recorded(np.zeros((161, 6)), sensor, seed=seed)
        assert (result.times[0], result.times[-1]) == (0.0, 0.04)
        assert len(result.times) < 40


def test_as_many_samples_are_lost_as_the_device_loses():
    sensor = replace(QUIET, losses=2.0, loss_length=3.0)
    forces = np.zeros((60_000, 6))
    lost = 60_000 - len(recorded(forces, sensor, 1000.0, 1000.0).times)
    assert lost == pytest.approx(60 * 2.0 * 3.0, rel=0.2)


def test_drawn_devices_lie_where_real_ones_were_measured_and_differ():
    devices = [Sensor.drawn(np.random.default_rng(seed)) for seed in range(60)]
    counts = np.array([device.counts for device in devices])
    noise = np.array([device.noise for device in devices])
    offset = np.array([device.offset for device in devices])
    lateral, normal = [0, 1, 3, 4], [2, 5]
    assert counts[:, lateral].min() > 400
    assert counts[:, lateral].max() < 830
    assert counts[:, normal].min() > 150
    assert counts[:, normal].max() < 175
    assert noise.min() >= 0.003
    assert noise.max() <= 0.017
    # Medians of the two real devices: 4.0 mN laterally, 7.4 mN normally.
    assert np.median(noise[:, lateral]) == pytest.approx(0.004, rel=0.3)
    assert np.median(noise[:, normal]) == pytest.approx(0.0074, rel=0.3)
    assert 0.3 < np.abs(offset).max() <= 0.4
    assert len({device.bandwidth for device in devices}) == 60
