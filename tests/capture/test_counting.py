"""Samples counted by a clock that comes with them, whatever that clock says."""

import numpy as np
import pytest

from forcelab.capture.text_device import SampleCounter


def test_lost_samples_are_counted_by_the_stamps():
    counting = SampleCounter(0.01)
    assert counting.feed(np.array([5.0, 5.01, 5.04, 5.05])).tolist() == [0, 1, 4, 5]
    assert counting.feed(np.array([5.06])).tolist() == [6]


@pytest.mark.parametrize("nonsense", [np.nan, np.inf, -np.inf])
def test_a_stamp_that_is_no_number_costs_no_count(nonsense):
    counting = SampleCounter(0.01)
    found = counting.feed(np.array([0.0, 0.01, nonsense, 0.03, 0.06]))
    assert found.tolist() == [0, 1, 2, 3, 6]
    assert counting.period == pytest.approx(0.01)


@pytest.mark.parametrize("late", [1e9, 1e300])
def test_a_clock_that_was_set_anew_goes_on_counting(late):
    counting = SampleCounter(0.01)
    found = counting.feed(np.array([0.0, 0.01, late, late + 1e-2, 0.0, 0.01]))
    assert found.tolist() == [0, 1, 2, 3, 4, 5]
    assert counting.period == pytest.approx(0.01, rel=1e-3)
