from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from synthetic import synthetic_demonstration

from forcelab.errors import InputError
from forcelab.recognition.features import BLOCK, wavelet_features
from forcelab.signals.channels import channel_map
from forcelab.signals.conditioning import noise_level
from forcelab.signals.cwt import cwt, frequencies, geometric_scales
from forcelab.signals.wavelets import DOG, Haar, Morlet, RealMorlet

SCALES = geometric_scales()
MORLET = Morlet()
RATE = 1000.0


def noise(*shape, seed=0):
    return np.random.default_rng(seed).standard_normal(shape)


def tone(hertz, n=4000, at=0.0):
    return np.cos(2 * np.pi * hertz * (np.arange(n) / RATE - at))


def split(table, q, k):
    """Log magnitudes and phases, each of shape (q, k, n)."""
    columns = table.T.reshape(2, q, k, -1)
    return columns[0], columns[1]


def test_all_log_magnitudes_come_first_then_all_phases_channel_by_channel():
    channels = np.stack(
        [3 * noise(500), 0.1 * np.cumsum(noise(500, seed=1)), noise(500, seed=2) + tone(20, 500)]
    )
    table = wavelet_features(channels, SCALES, MORLET)
    assert table.shape == (500, 2 * 3 * 10)
    for i, channel in enumerate(channels):
        coefficients = cwt(channel, SCALES, MORLET)
        magnitudes = table[:, 10 * i : 10 * (i + 1)].T
        phases = table[:, 30 + 10 * i : 30 + 10 * (i + 1)].T
        np.testing.assert_allclose(magnitudes, np.log(np.abs(coefficients)), atol=1e-9)
        apart = np.angle(np.exp(1j * (phases - np.angle(coefficients))))
        assert np.abs(apart).max() < 1e-9


def test_each_time_step_is_one_contiguous_row():
    table = wavelet_features(noise(2, 300), SCALES, MORLET)
    assert table.flags.c_contiguous
    assert table.dtype == np.float64


def test_phases_can_be_left_out():
    channels = noise(2, 300)
    without = wavelet_features(channels, SCALES, MORLET, phase=False)
    np.testing.assert_array_equal(without, wavelet_features(channels, SCALES, MORLET)[:, :20])


@pytest.mark.parametrize("hertz", [2.0, 12.4, 50.0])
def test_the_phase_of_a_cosine_is_zero_at_its_crest_and_grows_with_time(hertz):
    crest = 2.0173
    scale = RATE / (MORLET.fourier_factor * hertz)
    table = wavelet_features(tone(hertz, at=crest)[np.newaxis], np.array([scale]), MORLET)
    middle = slice(1500, 2500)
    times = np.arange(4000)[middle] / RATE
    expected = 2 * np.pi * hertz * (times - crest)
    apart = np.angle(np.exp(1j * (table[middle, 1] - expected)))
    assert np.abs(apart).max() < 2e-4


def test_the_magnitude_of_a_tone_is_known():
    hertz, amplitude = 20.0, 3.0
    scale = RATE / (MORLET.fourier_factor * hertz)
    # A real tone is half of a rotating one; psi_hat is pi^-1/4 sqrt(2 pi) at its middle.
    u = 2 * np.pi * hertz * scale / RATE
    psi_hat = np.sqrt(2 * np.pi) * np.pi**-0.25 * np.exp(-0.5 * (u - 5) ** 2)
    expected = np.log(0.5 * amplitude * np.sqrt(scale) * psi_hat)
    table = wavelet_features(amplitude * tone(hertz)[np.newaxis], np.array([scale]), MORLET)
    np.testing.assert_allclose(table[1500:2500, 0], expected, atol=1e-6)


# Scaling a channel


@pytest.mark.parametrize("factor", [2.0**-40, 0.25, 8.0, 2.0**60])
def test_a_power_of_two_shifts_log_magnitudes_and_leaves_phases_bit_by_bit(factor):
    channels = noise(1, 400)
    plain = split(wavelet_features(channels, SCALES, MORLET), 1, 10)
    scaled = split(wavelet_features(channels * factor, SCALES, MORLET), 1, 10)
    np.testing.assert_allclose(scaled[0] - plain[0], np.log(factor), rtol=1e-14, atol=1e-14)
    np.testing.assert_array_equal(scaled[1], plain[1])


@settings(max_examples=30, deadline=None)
@given(st.floats(1e-250, 1e250), st.integers(0, 2**32 - 1))
def test_any_factor_shifts_log_magnitudes_by_its_logarithm(factor, seed):
    channels = noise(1, 200, seed=seed)
    plain = split(wavelet_features(channels, SCALES, MORLET), 1, 10)
    scaled = split(wavelet_features(channels * factor, SCALES, MORLET), 1, 10)
    np.testing.assert_allclose(scaled[0] - plain[0], np.log(factor), atol=1e-8)


def test_a_channel_turned_round_has_its_phases_turned_by_half_a_turn():
    plain = split(wavelet_features(noise(1, 400), SCALES, MORLET), 1, 10)
    turned = split(wavelet_features(-noise(1, 400), SCALES, MORLET), 1, 10)
    np.testing.assert_allclose(turned[0], plain[0], atol=1e-12)
    assert np.abs(np.abs(turned[1] - plain[1]) - np.pi).max() < 1e-9


# Quiet channels


@pytest.mark.parametrize("value", [0.0, 1e-300, -3.7, 1e9, 1e300])
def test_a_constant_channel_is_at_its_floor_with_phase_zero(value):
    magnitude, phase = split(wavelet_features(np.full((1, 300), value), SCALES, MORLET), 1, 10)
    assert not phase.any()
    np.testing.assert_allclose(np.ptp(magnitude, axis=2), 0)
    assert magnitude.max() < np.log(1e-10)


def test_silence_before_a_contact_has_phase_zero_and_the_contact_has_not():
    x = np.zeros((1, 4000))
    x[0, 3000:] = tone(40, 1000)
    magnitude, phase = split(wavelet_features(x, SCALES[:5], MORLET), 1, 5)
    assert not phase[0, 1:, :2000].any()
    assert np.all(magnitude[0, 1:, 3100:3900].mean(axis=1) > magnitude[0, 1:, :2000].max() + 3)
    assert np.mean(phase[0, :, 3100:3900] != 0) > 0.99


def test_the_floor_lies_far_below_white_noise_which_keeps_its_size_at_every_scale():
    x = 0.01 * noise(1, 20_000)
    magnitude, phase = split(wavelet_features(x, SCALES, MORLET), 1, 10)
    assert np.mean(phase == 0) < 1e-4
    # Unit energy: the magnitudes of white noise are its standard deviation, at every scale whose
    # wavelet is not cut.
    power = np.mean(np.exp(2 * magnitude[0, 1:7]), axis=1)
    np.testing.assert_allclose(np.sqrt(power), 0.01, rtol=0.1)


def test_what_is_not_there_beside_the_noise_stops_a_thousandth_below_it():
    x = 0.01 * (-1.0) ** np.arange(3000)  # nothing but the Nyquist frequency
    magnitude, phase = split(wavelet_features(x[np.newaxis], np.array([64.0]), MORLET), 1, 1)
    inner = slice(1000, 2000)
    level = float(noise_level(x))
    np.testing.assert_allclose(magnitude[0, 0, inner], np.log(1e-3 * level), rtol=1e-12)
    assert not phase[0, 0, inner].any()


def test_counts_that_mostly_repeat_stop_a_thousandth_below_the_noise_of_rounding():
    counts = np.round(20 * np.sin(2 * np.pi * 0.5 * np.arange(4000) / RATE))
    magnitude, phase = split(wavelet_features(counts[np.newaxis], SCALES, MORLET), 1, 10)
    floor = np.log(1e-3 / np.sqrt(12))
    assert magnitude.min() == pytest.approx(floor, rel=1e-12)
    assert not phase[magnitude < floor + 1e-9].any()
    unit = split(wavelet_features(0.0125 * counts[np.newaxis], SCALES, MORLET), 1, 10)
    assert unit[0].min() == pytest.approx(floor + np.log(0.0125), rel=1e-12)


def test_a_smooth_force_keeps_all_its_digits():
    smooth = np.sin(2 * np.pi * 0.05 * np.arange(20_000) / RATE)
    magnitude, _ = split(wavelet_features(smooth[np.newaxis], SCALES, MORLET), 1, 10)
    assert magnitude.min() < np.log(1e-9)


def test_noise_that_is_given_sets_the_floor_of_every_channel_in_its_own_unit():
    still = np.stack([np.full(3000, 5.0), 8 * np.sin(np.arange(3000) / 1e3), np.zeros(3000)])
    given_noise = np.array([0.02, 3e-3, 0.5])
    table = wavelet_features(still, np.array([2.0, 4.0]), MORLET, noise=given_noise)
    magnitude, phase = split(table, 3, 2)
    inner = slice(500, 2500)
    expected = np.log(1e-3 * given_noise)[:, np.newaxis, np.newaxis]
    np.testing.assert_allclose(magnitude[:, :, inner] - expected, 0, atol=1e-9)
    assert not phase[:, :, inner].any()


@pytest.mark.parametrize("given_noise", [[0.1], [0.1, -1.0], [0.1, np.nan], [np.inf, 0.1]])
def test_noise_that_cannot_be_is_refused(given_noise):
    with pytest.raises(InputError, match="noise of 2 channels is 2 finite numbers"):
        wavelet_features(noise(2, 100), SCALES, MORLET, noise=np.array(given_noise))


@pytest.mark.parametrize("size", [1e-320, 1e-100, 1e100, 1e300])
def test_channels_of_any_size_stay_finite_beside_any_noise(size):
    for level in (0.0, 5e-324, 1.0, 1e308):
        table = wavelet_features(size * noise(1, 100), SCALES, MORLET, noise=np.array([level]))
        assert np.isfinite(table).all()


def test_the_noise_of_the_whole_gives_a_part_the_features_it_has_in_the_whole():
    step = 0.01 * noise(6000) * (np.arange(6000) > 3500) + tone(3, 6000)
    whole = step[np.newaxis]
    level = noise_level(whole)
    scales = np.array([4.0, 8.0, 16.0])
    np.testing.assert_array_equal(
        wavelet_features(whole, scales, MORLET, noise=level),
        wavelet_features(whole, scales, MORLET),
    )
    part = wavelet_features(whole[:, :3000], scales, MORLET, noise=level)
    inner = slice(200, 2800)
    expected = wavelet_features(whole, scales, MORLET)[inner]
    np.testing.assert_allclose(part[inner, :3], expected[:, :3], atol=1e-6)


def test_blocks_leave_no_seams():
    channels = noise(2, 2 * BLOCK + 3)
    table = wavelet_features(channels, SCALES[:3], MORLET)
    for i, channel in enumerate(channels):
        coefficients = cwt(channel, SCALES[:3], MORLET).T
        expected = np.log(np.abs(coefficients))
        np.testing.assert_allclose(table[:, 3 * i : 3 * i + 3], expected, atol=1e-9)
        angles = table[:, 6 + 3 * i : 9 + 3 * i]
        np.testing.assert_allclose(angles, np.angle(coefficients), atol=1e-9)


def test_a_silent_channel_among_loud_ones_stays_silent_and_changes_nothing():
    loud = 1e6 * noise(2, 500)
    channels = np.stack([loud[0], np.full(500, 4.2), loud[1]])
    magnitude, phase = split(wavelet_features(channels, SCALES, MORLET), 3, 10)
    alone = split(wavelet_features(loud, SCALES, MORLET), 2, 10)
    np.testing.assert_array_equal(magnitude[[0, 2]], alone[0])
    np.testing.assert_array_equal(phase[[0, 2]], alone[1])
    assert not phase[1].any()
    np.testing.assert_array_equal(
        magnitude[1], split(wavelet_features(np.zeros((1, 500)), SCALES, MORLET), 1, 10)[0][0]
    )


def test_the_phase_of_a_real_wavelet_is_its_sign_and_nothing_else():
    x = noise(1, 600)
    for wavelet in (RealMorlet(), DOG(1), DOG(2), Haar()):
        _, phase = split(wavelet_features(x, SCALES, wavelet), 1, 10)
        negative = cwt(x[0], SCALES, wavelet).real < 0
        assert set(np.unique(phase)) == {0.0, np.pi}
        assert np.mean((phase[0] == np.pi) == negative) > 0.999


# Any input

anything = hnp.arrays(
    np.float64,
    st.tuples(st.integers(1, 3), st.integers(1, 50)),
    elements=st.floats(allow_nan=True, allow_infinity=True),
)


@settings(max_examples=150, deadline=None)
@given(anything, st.sampled_from([Morlet(), Morlet(0.5), RealMorlet(), DOG(1), DOG(40), Haar()]))
def test_features_are_finite_whatever_goes_in(channels, wavelet):
    scales = np.array([0.5, 2.0, 1024.0])
    table = wavelet_features(channels, scales, wavelet)
    q, n = channels.shape
    assert table.shape == (n, 2 * q * 3)
    assert np.isfinite(table).all()
    assert np.abs(split(table, q, 3)[1]).max() <= np.pi


@pytest.mark.parametrize(
    "channel",
    [
        np.zeros(100),
        np.full(100, np.nan),
        np.where(np.arange(100) == 50, np.inf, 0.0),
        np.where(np.arange(100) == 50, 1e308, -1e308),
        np.where(np.arange(100) == 50, 5e-324, 0.0),
        1e300 * np.sin(np.arange(100)),
        1e9 + 1e-6 * np.sin(np.arange(100)),
        np.arange(100) % 2 * 1.0,
        np.round(8 + 0.01 * noise(100)),
    ],
    ids=["zero", "nan", "inf", "top", "least", "huge", "offset", "nyquist", "rounded"],
)
@pytest.mark.parametrize("n", [1, 2, 3, 100])
def test_broken_channels_give_finite_features(channel, n):
    assert np.isfinite(wavelet_features(channel[np.newaxis, :n], SCALES, MORLET)).all()


def test_a_long_recording_costs_little_more_than_its_features():
    channels = noise(4, 100_000)
    tracemalloc.start()
    table = wavelet_features(channels, SCALES, MORLET)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1.6 * table.nbytes


def test_the_input_is_left_alone():
    channels = noise(2, 50)
    channels[0, 7] = np.nan
    before = channels.copy()
    channels.flags.writeable = False
    wavelet_features(channels, SCALES, MORLET)
    np.testing.assert_array_equal(channels, before)


def test_a_grab_stands_out_in_the_features_of_the_normal_force():
    demonstration, segments = synthetic_demonstration(3)
    four = channel_map(demonstration.channels)
    table = wavelet_features(four.apply(demonstration.signals), SCALES, MORLET)
    first = four.names.index("normal 1") * len(SCALES)
    slow = np.abs(frequencies(SCALES, demonstration.rate, MORLET) - 3.169).argmin()
    times, column = demonstration.times, table[:, first + slow]
    means = {
        segment.action: column[(times >= segment.start) & (times < segment.end)].mean()
        for segment in segments[:2]
    }
    assert means["grab"] > means["still"] + 3
