"""Features against plain definitions: wavelets, windows, and distances from the extremes."""

from __future__ import annotations

import numpy as np
import pytest
from factories import labelled_set
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from forcelab.errors import InputError
from forcelab.recognition.features import (
    BLOCK,
    PEAKS,
    SPANS,
    own_amplitude,
    peak_features,
    wavelet_features,
    window_features,
    window_moments,
)
from forcelab.recognition.presets import preset
from forcelab.recognition.training import train
from forcelab.signals.conditioning import noise_level
from forcelab.signals.cwt import cwt, geometric_scales
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
    floors = np.array([0.02, 3e-3, 0.5])
    table = wavelet_features(still, np.array([2.0, 4.0]), MORLET, noise=floors)
    magnitude, phase = split(table, 3, 2)
    inner = slice(500, 2500)
    expected = np.log(1e-3 * floors)[:, np.newaxis, np.newaxis]
    np.testing.assert_allclose(magnitude[:, :, inner] - expected, 0, atol=1e-9)
    assert not phase[:, :, inner].any()


@pytest.mark.parametrize("levels", [[0.1], [0.1, -1.0], [0.1, np.nan], [np.inf, 0.1]])
def test_noise_that_cannot_be_is_refused(levels):
    with pytest.raises(InputError, match="noise of 2 channels is 2 finite numbers"):
        wavelet_features(noise(2, 100), SCALES, MORLET, noise=np.array(levels))


@pytest.mark.parametrize("size", [1e-320, 1e-100, 1e100, 1e300])
def test_channels_of_any_size_stay_finite_beside_any_noise(size):
    for level in (0.0, 5e-324, 1.0, 1e308):
        table = wavelet_features(size * noise(1, 100), SCALES, MORLET, noise=np.array([level]))
        assert np.isfinite(table).all()


def test_the_noise_of_the_whole_gives_a_part_the_features_it_has_in_the_whole():
    step = 0.01 * noise(6000) * (np.arange(6000) > 3500) + tone(3, 6000)
    full = step[np.newaxis]
    level = noise_level(full)
    scales = np.array([4.0, 8.0, 16.0])
    np.testing.assert_array_equal(
        wavelet_features(full, scales, MORLET, noise=level),
        wavelet_features(full, scales, MORLET),
    )
    part = wavelet_features(full[:, :3000], scales, MORLET, noise=level)
    inner = slice(200, 2800)
    expected = wavelet_features(full, scales, MORLET)[inner]
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


@settings(max_examples=60, deadline=None)
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


def test_a_long_recording_costs_little_more_than_its_features(peak_memory):
    channels = noise(4, 100_000)
    table, peak = peak_memory(lambda: wavelet_features(channels, SCALES, MORLET))
    assert peak < 1.6 * table.nbytes


def test_the_input_is_left_alone():
    channels = noise(2, 50)
    channels[0, 7] = np.nan
    before = channels.copy()
    channels.flags.writeable = False
    wavelet_features(channels, SCALES, MORLET)
    np.testing.assert_array_equal(channels, before)


WINDOWS = (0.01, 0.04, 0.16)
WINDOWS_RATE = 500.0


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
    found = window_features(channels, WINDOWS_RATE, WINDOWS, places).reshape(4, 3, 2, 3)
    for p, place in enumerate(places):
        for i, channel in enumerate(channels):
            for j, window in enumerate(WINDOWS):
                expected = by_quadrature(channel, WINDOWS_RATE, window, place)
                # A window is cut off after four standard deviations, beyond the ends at least.
                size = np.ptp(channel)
                errors = np.abs(found[p, :, i, j] - expected)
                assert np.all(errors <= size * np.array([3e-4, 3e-3 / window, 3e-3]))


def test_a_sine_has_the_level_slope_and_rms_of_the_closed_form():
    t = np.arange(4000) / WINDOWS_RATE
    omega, s = 2 * np.pi * 3.0, 0.04
    place = np.array([2000])
    level, slope, rms = window_features(3.0 * np.sin(omega * t)[None], WINDOWS_RATE, (s,), place)[0]
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


def test_rare_peaks_leave_the_own_amplitude_alone():
    channels = np.tile(np.linspace(0, 1, 1000), (2, 1))
    channels[1, 500:510] = 1e6
    rest, size = own_amplitude(channels, 100.0)
    assert size[1] == pytest.approx(size[0], rel=0.05)
    assert rest[0] == rest[1]


def test_missing_samples_are_bridged():
    channels = np.linspace(0, 1, 400)[None].copy()
    full = window_features(channels, 100.0, WINDOWS, np.arange(400))
    channels[0, 100:120] = np.nan
    np.testing.assert_allclose(window_features(channels, 100.0, WINDOWS, np.arange(400)), full)


WINDOW = 0.02
PEAKS_RATE = 100.0


def walk(seed, channels=2, n=300):
    return np.random.default_rng(seed).normal(size=(channels, n)).cumsum(axis=1) + 30.0


def test_features_are_those_of_direct_searches():
    channels, places = walk(0), np.array([0, 1, 17, 150, 298, 299])
    found = peak_features(channels, PEAKS_RATE, WINDOW, places).reshape(6, 4, 2, 3)
    for i, channel in enumerate(channels):
        level = window_moments(channel, PEAKS_RATE, (WINDOW,), np.arange(300))[0][0]
        for j, span in enumerate(SPANS):
            reach = round(span * PEAKS_RATE)
            for p, place in enumerate(places):
                before = level[max(place - reach, 0) : place + 1]
                after = level[place : place + reach + 1]
                expected = [before.max(), after.max(), before.min(), after.min()]
                np.testing.assert_allclose(found[p, :, i, j], np.array(expected) - level[place])


def test_a_peak_is_ahead_until_it_is_behind():
    t = np.arange(400) / PEAKS_RATE
    channels = np.exp(-0.5 * ((t - 2.0) / 0.2) ** 2)[None]
    before, after = peak_features(channels, PEAKS_RATE, WINDOW, np.array([180, 220])).T[[1, 4]]
    assert (before[0], after[1]) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert min(after[0], before[1]) > 0.3


@pytest.mark.parametrize("gain", [0.03, 1.0, 40.0, 1e148])
def test_in_own_units_a_gain_and_offsets_do_not_matter(gain):
    channels, places = walk(1, 3), np.arange(0, 300, 7)
    plain = peak_features(channels, PEAKS_RATE, WINDOW, places, own=True)
    offset = gain * np.array([[0.0], [5.0], [-9.0]])
    changed = peak_features(gain * channels + offset, PEAKS_RATE, WINDOW, places, own=True)
    np.testing.assert_allclose(changed, plain, rtol=1e-6, atol=1e-6)


def test_in_own_units_channels_keep_their_proportion():
    channels, places = walk(2), np.arange(300)
    absolute = peak_features(channels, PEAKS_RATE, WINDOW, places)
    own = peak_features(channels, PEAKS_RATE, WINDOW, places, own=True)
    moved = absolute != 0
    assert np.ptp(own[moved] / absolute[moved]) < 1e-9


def test_a_constant_channel_and_a_single_sample_have_no_peaks():
    channels = np.array([np.full(200, -7.3), np.sin(np.arange(200) / 20)])
    found = peak_features(channels, PEAKS_RATE, WINDOW, np.arange(200), own=True)
    assert np.all(found.reshape(200, 4, 2, 3)[:, :, 0] == 0)
    assert np.all(peak_features(channels[:, :1], PEAKS_RATE, WINDOW, np.array([0]), own=True) == 0)


def test_missing_samples_are_bridged_for_peaks():
    channels = np.linspace(0, 1, 400)[None].copy()
    full = peak_features(channels, PEAKS_RATE, WINDOW, np.arange(400))
    channels[0, 100:120] = np.nan
    found = peak_features(channels, PEAKS_RATE, WINDOW, np.arange(400))
    np.testing.assert_allclose(found, full, atol=1e-12)


@pytest.mark.parametrize("amplitude", ["absolute", "both"])
@pytest.mark.usefixtures("small_fits")
def test_a_recogniser_looks_at_peaks_whatever_the_unit(amplitude):
    settings = preset("fast").replace(amplitude=amplitude, peaks=True)
    items = labelled_set(3, rate=100.0)
    recogniser = train(items, settings)
    channels = len(recogniser.channels)
    first = settings.replace(peaks=False).width(channels, 100.0)
    peaks = np.arange(first, settings.width(channels, 100.0))
    assert len(peaks) == len(PEAKS) * len(SPANS) * channels
    assert np.isin(peaks, recogniser.classifier.columns).all()
