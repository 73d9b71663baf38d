"""Wavelets cut at the Nyquist frequency, in rings too long to be transformed as a whole."""

from __future__ import annotations

import numpy as np
import pytest

from forcelab.signals.conditioning import condition
from forcelab.signals.cwt import transform_channels
from forcelab.signals.cwt_blocks import TOLERANCES
from forcelab.signals.cwt_engine import Cut, Plan
from forcelab.signals.wavelets import Morlet

N = 9001


@pytest.fixture
def _short_rings_are_long(monkeypatch):
    monkeypatch.setattr("forcelab.signals.cwt_engine.RING_KEPT", 1 << 12)


def channels():
    """Rough, slow, a jump, and an impact with both ends far from each other."""
    random = np.random.default_rng(3)
    n = np.arange(N)
    x = [
        random.standard_normal(N),
        np.cumsum(random.standard_normal(N)),
        np.where(n < N // 3, -1.0, 2.0),
        1e-3 * n / N + (n == N // 2),
        np.where(n % 2, 1.0, -1.0) * (n > 4000),  # all of it at the Nyquist frequency
    ]
    return condition(np.stack(x)).values


def worst(found, expected):
    sizes = np.abs(expected).max(axis=-1)
    return float((np.abs(found - expected).max(axis=-1) / sizes).max())


@pytest.mark.usefixtures("_short_rings_are_long")
@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize(
    ("p", "scales"), [(5.0, [0.5, 1.0, 2.0, 2.6, 3.4]), (0.5, [0.7, 1.5]), (12.0, [2.0, 5.0])]
)
def test_a_cut_wavelet_in_a_long_ring_is_the_plain_one_everywhere(tolerance, p, scales):
    x = channels()
    plan = Plan(N, scales, Morlet(p), tolerance, tolerance >= 1e-7)
    assert isinstance(plan._paths[0], Cut)
    expected = transform_channels(x, np.array(scales), Morlet(p))
    allowed = tolerance + (2e-7 if tolerance >= 1e-7 else 1e-13)
    assert worst(plan.coefficients(x), expected) < allowed


@pytest.mark.parametrize("tolerance", [1e-10, 1e-14])
def test_a_band_that_ends_on_a_bin_exactly_is_had_as_a_whole(tolerance):
    n = 271_173  # in a ring of 7 * 5 * 2**13 samples
    x = condition(np.random.default_rng(2).standard_normal((1, n))).values
    plan = Plan(n, [2.0], Morlet(), tolerance, False)
    assert isinstance(plan._paths[0], Cut)
    expected = transform_channels(x, np.array([2.0]), Morlet())
    assert worst(plan.coefficients(x), expected) < tolerance + 1e-13


@pytest.mark.usefixtures("_short_rings_are_long")
def test_in_few_points_at_a_time_it_is_the_same(monkeypatch):
    x, scales = channels(), [1.0, 2.0, 3.0]
    found = Plan(N, scales, Morlet(), 1e-7, True).coefficients(x)
    monkeypatch.setattr("forcelab.signals.cwt_engine.GRID_POINTS", 1)
    monkeypatch.setattr("forcelab.signals.cwt_engine.TOGETHER", 1)
    monkeypatch.setattr("forcelab.signals.cwt_engine.KEPT", 1)
    monkeypatch.setattr("forcelab.signals.cwt_engine.STRETCH", 100)
    alone = Plan(N, scales, Morlet(), 1e-7, True).coefficients(x)
    assert worst(alone, found) < 2e-7


def test_log_magnitude_and_phase_of_a_long_recording_take_little_memory_beside_them(peak_memory):
    n = 1 << 20
    x = condition(np.cumsum(np.random.default_rng(1).standard_normal((1, n)), axis=1)).values
    plan = Plan(n, [2.0, 2.5, 3.0], Morlet(), 1e-7, True)
    assert isinstance(plan._paths[0], Cut)
    (magnitudes, phases), peak = peak_memory(lambda: plan.log_polar(x))
    assert peak < magnitudes.nbytes + phases.nbytes + 12 * n  # 200 MB at 2^24
