from __future__ import annotations

import time
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.labels import from_codes
from forcelab.recognition.filters import drop_short, median, threshold

CODES = st.lists(st.integers(-1, 6), max_size=40).map(lambda c: np.array(c, dtype=np.int64))
ACTIONS = list("abcdefg")

# --- threshold ----------------------------------------------------------------------------------


def test_only_samples_whose_best_probability_reaches_the_threshold_keep_their_code():
    codes = np.array([0, 1, 1, 2])
    best = np.array([[0.8, 0.2, 0.0], [0.1, 0.79, 0.11], [0.0, 1.0, 0.0], [0.3, 0.3, 0.4]])
    assert threshold(codes, best).tolist() == [0, -1, 1, -1]
    assert threshold(codes, best, at=0.3).tolist() == [0, 1, 1, 2]


def test_a_threshold_of_zero_keeps_everything_but_what_has_no_number():
    codes = np.array([0, 1])
    assert threshold(codes, np.array([[0.0, 0.0], [np.nan, 0.5]]), at=0).tolist() == [0, -1]


def test_single_precision_probabilities_at_the_threshold_are_kept():
    assert threshold(np.array([1]), np.array([[0.2, 0.8]], dtype=np.float32)).tolist() == [1]


def test_the_threshold_of_no_sample_is_no_sample():
    assert threshold(np.empty(0, dtype=np.int64), np.empty((0, 0))).shape == (0,)


@pytest.mark.parametrize("at", [-0.1, 1.1, float("nan")])
def test_a_threshold_that_is_no_probability_is_refused(at):
    with pytest.raises(InputError, match="between 0 and 1"):
        threshold(np.array([0]), np.array([[1.0]]), at=at)


# --- median -------------------------------------------------------------------------------------


def median_by_sorting(codes: list[int], width: int) -> list[int]:
    """Sort every window; exact fractions, halves rounded up."""
    result = []
    for i in range(len(codes)):
        places = range(i - width // 2, i + (width - 1) // 2 + 1)
        window = sorted(codes[min(max(j, 0), len(codes) - 1)] for j in places)
        middle = Fraction(window[(width - 1) // 2] + window[width // 2], 2)
        result.append((middle + Fraction(1, 2)).__floor__())
    return result


@settings(max_examples=80, deadline=None)
@given(CODES, st.integers(1, 100))
def test_the_median_is_that_of_sorted_windows_at_any_width(codes, width):
    assert median(codes, width).tolist() == median_by_sorting(codes.tolist(), width)


@pytest.mark.parametrize("width", [10**9, 10**9 + 1, 10**30])
def test_a_window_far_wider_than_the_recording_costs_no_more_and_is_right(width):
    codes = np.array([3, 0, 4, 4, 2, 1, 5, 5, 0])
    same = median_by_sorting(codes.tolist(), 1000 + width % 2)
    assert median(codes, width).tolist() == same != codes.tolist()


def test_an_even_width_invents_a_label_that_neither_neighbour_has():
    codes = np.repeat([1, 5], 20)
    assert set(median(codes, 10).tolist()) == {1, 3, 5}
    assert set(median(codes, 9).tolist()) == {1, 5}


@pytest.mark.parametrize("width", [0, -3])
def test_a_median_without_a_window_is_refused(width):
    with pytest.raises(InputError, match="at least 1 sample"):
        median(np.array([0]), width)


# --- dropping short segments --------------------------------------------------------------------


def test_a_segment_of_exactly_the_share_is_kept_wherever_it_lies():
    codes = np.tile(np.repeat([0, 1], [10, 11]), 5000)
    times = np.arange(len(codes)) / 1000
    assert np.array_equal(drop_short(codes, times, {0: 0.08, 1: 0.088}), codes)


def test_a_share_of_nothing_drops_nothing_and_a_negative_one_is_refused():
    codes = np.array([0, 1, 0])
    assert drop_short(codes, np.arange(3.0), {0: 9.0, 1: 9.0}, share=0).tolist() == [0, 1, 0]
    with pytest.raises(InputError, match="must not be negative"):
        drop_short(codes, np.arange(3.0), {}, share=-0.5)


@settings(max_examples=80, deadline=None)
@given(
    CODES,
    st.lists(st.sampled_from([1.0, 1.0, 1.0, 30.0]), min_size=40, max_size=40),
    st.dictionaries(st.integers(0, 6), st.integers(0, 60).map(float)),
)
def test_dropping_is_what_the_segments_of_from_codes_say(codes, steps, shortest):
    times = np.cumsum(steps)[: len(codes)]
    expected = np.full(len(codes), -1)
    for segment in from_codes(codes, times, ACTIONS):
        code = ACTIONS.index(segment.action)
        if segment.duration >= shortest.get(code, 0.0) / 8:
            inside = (times >= segment.start) & (times < segment.end)
            expected[inside] = code
    assert drop_short(codes, times, shortest).tolist() == expected.tolist()


# --- all of them --------------------------------------------------------------------------------


def test_a_million_samples_are_filtered_in_seconds():
    rng = np.random.default_rng(0)
    codes = rng.integers(-1, 8, 10**6)
    probabilities = rng.random((10**6, 8))
    times = np.arange(10**6) / 1000
    start = time.process_time()
    confident = threshold(codes, probabilities)
    drop_short(median(confident), times, dict.fromkeys(range(8), 0.05))
    assert time.process_time() - start < 4.0
