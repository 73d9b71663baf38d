from __future__ import annotations

import numpy as np
import pytest
from synthetic import synthetic_set

from forcelab.recognition import ensemble
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.features import PEAKS, SPANS, peak_features, window_moments
from forcelab.recognition.presets import preset
from forcelab.recognition.training import train

WINDOW = 0.02
RATE = 100.0


def walk(seed, channels=2, n=300):
    return np.random.default_rng(seed).normal(size=(channels, n)).cumsum(axis=1) + 30.0


def test_features_are_those_of_direct_searches():
    channels, places = walk(0), np.array([0, 1, 17, 150, 298, 299])
    found = peak_features(channels, RATE, WINDOW, places).reshape(6, 4, 2, 3)
    for i, channel in enumerate(channels):
        level = window_moments(channel, RATE, (WINDOW,), np.arange(300))[0][0]
        for j, span in enumerate(SPANS):
            reach = round(span * RATE)
            for p, place in enumerate(places):
                before = level[max(place - reach, 0) : place + 1]
                after = level[place : place + reach + 1]
                expected = [before.max(), after.max(), before.min(), after.min()]
                np.testing.assert_allclose(found[p, :, i, j], np.array(expected) - level[place])


def test_a_peak_is_ahead_until_it_is_behind():
    t = np.arange(400) / RATE
    channels = np.exp(-0.5 * ((t - 2.0) / 0.2) ** 2)[None]
    before, after = peak_features(channels, RATE, WINDOW, np.array([180, 220])).T[[1, 4]]
    assert (before[0], after[1]) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert min(after[0], before[1]) > 0.3


@pytest.mark.parametrize("gain", [0.03, 1.0, 40.0, 1e148])
def test_in_own_units_a_gain_and_offsets_do_not_matter(gain):
    channels, places = walk(1, 3), np.arange(0, 300, 7)
    plain = peak_features(channels, RATE, WINDOW, places, own=True)
    offset = gain * np.array([[0.0], [5.0], [-9.0]])
    changed = peak_features(gain * channels + offset, RATE, WINDOW, places, own=True)
    np.testing.assert_allclose(changed, plain, rtol=1e-6, atol=1e-6)


def test_in_own_units_channels_keep_their_proportion():
    channels, places = walk(2), np.arange(300)
    absolute = peak_features(channels, RATE, WINDOW, places)
    own = peak_features(channels, RATE, WINDOW, places, own=True)
    moved = absolute != 0
    assert np.ptp(own[moved] / absolute[moved]) < 1e-9


def test_a_constant_channel_and_a_single_sample_have_no_peaks():
    channels = np.array([np.full(200, -7.3), np.sin(np.arange(200) / 20)])
    found = peak_features(channels, RATE, WINDOW, np.arange(200), own=True)
    assert np.all(found.reshape(200, 4, 2, 3)[:, :, 0] == 0)
    assert np.all(peak_features(channels[:, :1], RATE, WINDOW, np.array([0]), own=True) == 0)


def test_missing_samples_are_bridged():
    channels = np.linspace(0, 1, 400)[None].copy()
    whole = peak_features(channels, RATE, WINDOW, np.arange(400))
    channels[0, 100:120] = np.nan
    found = peak_features(channels, RATE, WINDOW, np.arange(400))
    np.testing.assert_allclose(found, whole, atol=1e-12)


@pytest.mark.parametrize("amplitude", ["absolute", "both"])
def test_a_recogniser_looks_at_peaks_whatever_the_unit(monkeypatch, amplitude):
    monkeypatch.setattr(ensemble, "TREES", 5)
    settings = preset("fast").replace(amplitude=amplitude, peaks=True)
    items = [LabelledDemonstration(*pair) for pair in synthetic_set(3, rate=100.0)]
    recogniser = train(items, settings)
    channels = len(recogniser.channels)
    first = settings.replace(peaks=False).width(channels)
    peaks = np.arange(first, settings.width(channels))
    assert len(peaks) == len(PEAKS) * len(SPANS) * channels
    assert np.isin(peaks, recogniser.classifier.columns).all()
