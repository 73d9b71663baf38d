from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.clock import ClockMap, fit_clock
from forcelab.errors import InputError

offsets = st.floats(-1e4, 1e4)
rates = st.floats(0.5, 2.0)


@given(offsets, rates, st.floats(0, 1e5))
def test_there_and_back_gives_the_same_time(offset, rate, time):
    clock = ClockMap(offset, rate)
    assert clock.to_device(clock.to_force(time)) == pytest.approx(time, abs=1e-9)
    assert clock.to_force(clock.to_device(time)) == pytest.approx(time, abs=1e-9)


def test_a_clock_carries_whole_arrays_of_any_shape():
    clock = ClockMap(offset=2.0, rate=0.5)
    assert clock.to_force([[0.0, 2.0], [4.0, 6.0]]).tolist() == [[2.0, 3.0], [4.0, 5.0]]
    assert clock.to_device([2.0, 5.0]).tolist() == [0.0, 6.0]


@pytest.mark.parametrize(
    ("offset", "rate"),
    [
        *[(0.0, rate) for rate in (0.0, -1.0, np.inf, np.nan, 1e7, 1e-7)],
        *[(offset, 1.0) for offset in (np.nan, -np.inf, 1e300, -2e12)],
    ],
)
def test_a_clock_that_stands_still_or_has_no_usable_number_is_refused(offset, rate):
    with pytest.raises(InputError, match="finite offset and a positive rate"):
        ClockMap(offset, rate)


def test_one_tap_fixes_the_offset_alone():
    fit = fit_clock([100.25], [3.5])
    assert (fit.clock.offset, fit.clock.rate, fit.residual) == (-96.75, 1.0, 0.0)


@given(offsets, rates, offsets, st.floats(1, 1e3))
def test_two_taps_are_met_exactly(offset, rate, first, apart):
    truth = ClockMap(offset, rate)
    device = [first, first + apart]
    fit = fit_clock(device, list(truth.to_force(device)))
    assert fit.clock.rate == pytest.approx(rate, rel=1e-9)
    assert fit.clock.to_force(device) == pytest.approx(truth.to_force(device), abs=1e-8)
    assert fit.residual < 1e-8


@given(
    st.lists(st.floats(0, 1e4), min_size=3, max_size=20, unique_by=lambda t: round(t, 1)),
    st.integers(0, 2**32 - 1),
)
def test_many_taps_are_fitted_as_by_polyfit(device, seed):
    random = np.random.default_rng(seed)
    force = 0.3 + (1 + 20e-6) * np.array(device) + random.normal(0, 1e-3, len(device))
    rate, offset = np.polyfit(device, force, 1)
    fit = fit_clock(device, list(force))
    expected = offset + rate * np.array(device)
    assert fit.clock.to_force(device) == pytest.approx(expected, abs=1e-6)
    assert fit.residual == pytest.approx(np.sqrt(np.mean((expected - force) ** 2)), abs=1e-6)


def test_taps_on_clocks_that_started_long_ago_lose_no_precision():
    device = 1.7e9 + np.array([0.0, 10.0, 100.0])
    fit = fit_clock(list(device), [1.0, 11.0, 101.0])
    assert fit.clock.rate == pytest.approx(1.0, abs=1e-12)
    assert fit.clock.to_force(device) == pytest.approx([1.0, 11.0, 101.0], abs=1e-6)


@pytest.mark.parametrize(
    ("device", "force", "sentence"),
    [
        ([], [], "at least one; there are 0 and 0"),
        ([1.0, 2.0], [1.0], "same number of taps on both clocks.* 2 and 1"),
        ([5.0, 5.0], [1.0, 2.0], "same device time; mark taps further apart"),
        # The mean of three times 0.1 s is not 0.1 s in float64.
        ([0.1, 0.1, 0.1], [1.0, 2.0, 3.3], "same device time; mark taps further apart"),
        ([1.0, 2.0], [2.0, 1.0], "positive rate"),
        ([1.0, 2.0], [3.0, 3.0], "positive rate"),
        ([1.0, np.nan], [1.0, 2.0], "finite offset"),
        ([1.0], [np.inf], "finite offset"),
    ],
)
def test_taps_that_fix_no_clock_are_refused_with_a_sentence(device, force, sentence):
    with pytest.raises(InputError, match=sentence):
        fit_clock(device, force)
