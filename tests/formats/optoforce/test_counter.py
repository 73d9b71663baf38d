"""Counters: the step is learnt, the turns are undone, and what is missing is counted."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.formats.optoforce_packets import TURN, Unwrapper, modal_step


def counter(values):
    return (np.asarray(values, np.int64) % TURN).astype(np.uint16)


@pytest.mark.parametrize("step", [1, 2, 10, 37])
def test_the_step_is_the_commonest_one(step):
    ticks = np.delete(np.arange(5_000), [3, 4, 100, 2_000])
    found, share = modal_step(counter(65_000 + step * ticks))
    assert found == step
    assert share > 0.99


def test_a_counter_that_stands_still_has_no_step():
    assert modal_step(counter([5, 5, 5])) == (1, 0.0)
    assert modal_step(counter([])) == (1, 0.0)


@given(
    st.sampled_from([1, 2, 10]),
    st.integers(0, TURN - 1),
    st.lists(st.integers(1, 40), min_size=1, max_size=60),
    st.lists(st.integers(1, 20), max_size=8),
)
def test_ticks_are_the_samples_whatever_the_step_the_start_and_the_blocks(step, at, on, sizes):
    truth = np.cumsum([0, *on])
    counts = counter(at + step * truth)
    unwrapper, got, place = Unwrapper(step, 1000.0), [], 0
    for size in [*sizes, len(counts)]:
        got += unwrapper.feed(counts[place : place + size]).ticks.tolist()
        place += size
    assert got == truth.tolist()
    assert unwrapper.missing == truth[-1] + 1 - len(truth)


def test_a_sample_that_came_twice_is_dropped_and_counted():
    unwrapper = Unwrapper(1, 1000.0)
    told = unwrapper.feed(counter([9, 9, 10, 11, 11]), np.full(5, 2.0))
    assert told.is_new.tolist() == [True, False, True, True, False]
    assert told.ticks.tolist() == [0, 1, 2]
    assert unwrapper.feed(counter([11, 12]), np.full(2, 2.0)).ticks.tolist() == [3]
    assert (unwrapper.doubled, unwrapper.missing, unwrapper.jumps) == (3, 0, 0)


@pytest.mark.parametrize("lost", [30_000, 40_000, 65_535, 65_536, 100_000, 200_000])
def test_beyond_half_a_turn_the_hosts_clock_tells_the_turns(lost):
    ticks = np.array([0, 1, 2, 2 + lost, 3 + lost])
    arrived = ticks / 1000 + [0.0, 0.004, 0.001, 0.2, 0.19]
    unwrapper = Unwrapper(1, 1000.0)
    assert unwrapper.feed(counter(500 + ticks), arrived).ticks.tolist() == ticks.tolist()
    assert (unwrapper.missing, unwrapper.jumps) == (lost - 1, 0)


def test_a_counter_that_jumps_back_is_not_believed():
    unwrapper = Unwrapper(2, 500.0)
    arrived = np.array([0.0, 0.002, 0.004, 0.010, 0.012])
    ticks = unwrapper.feed(counter([100, 102, 104, 6, 8]), arrived).ticks
    assert ticks.tolist() == [0, 1, 2, 5, 6]
    assert (unwrapper.jumps, unwrapper.missing) == (1, 2)


def test_a_counter_that_was_started_again_goes_on_by_the_hosts_clock():
    unwrapper = Unwrapper(10, 100.0)
    unwrapper.feed(counter([1000, 1010]), np.array([5.0, 5.01]))
    unwrapper.resume(10, 100.0)
    again = unwrapper.feed(counter([0, 10, 20]), np.array([8.01, 8.02, 8.03]))
    assert again.ticks.tolist() == [301, 302, 303]
    assert (unwrapper.missing, unwrapper.jumps) == (299, 0)
