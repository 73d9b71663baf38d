"""Odd demonstrations are told from typical ones by their features alone."""

import tracemalloc

import numpy as np
import pytest

from forcelab.recognition.examples import Examples
from forcelab.review.active_learning import STEPS, sample_steps, typicality


def steps(level, seed, count=200, spread=1.0):
    """Time steps of a demonstration whose two features lie around a level."""
    return np.random.default_rng(seed).normal(level, spread, (count, 2)).astype(np.float32)


def examples(features, valid=None):
    n = len(features)
    valid = np.ones(n, dtype=bool) if valid is None else valid
    return Examples("01", np.arange(n) / 100, features, valid, (), ("normal 1",), 100.0)


def test_the_odd_one_is_the_least_typical_and_the_others_are_all_alike():
    found = typicality([steps(0, 1), steps(0, 2), steps(8, 3), steps(0, 4, count=900)])
    assert found.argmin() == 2
    assert found[2] < 0.6 * found[[0, 1, 3]].min()
    assert np.ptp(found[[0, 1, 3]]) < 0.05


def test_a_demonstration_of_the_same_level_but_another_spread_is_odd_too():
    found = typicality([steps(0, 1), steps(0, 2), steps(0, 3), steps(0, 4, spread=6.0)])
    assert found.argmin() == 3


def test_against_the_formula_by_hand():
    # One feature of plus and minus 1: mean 0, scale 1, and no spread within a demonstration. Both
    # are 2 asinh 1 apart, which is the median distance: each is like itself and 1/e like the other.
    found = typicality([np.full((5, 1), -1.0, np.float32), np.full((5, 1), 1.0, np.float32)])
    assert found == pytest.approx([(1 + np.exp(-1)) / 2] * 2)


def test_units_of_the_features_do_not_matter():
    several = [steps(0, 1), steps(1, 2), steps(4, 3)]
    scale = np.array([1000, 0.01], dtype=np.float32)
    assert typicality([one * scale for one in several]) == pytest.approx(
        typicality(several), rel=1e-3
    )


@pytest.mark.parametrize("count", [1, 3])
def test_what_is_all_the_same_is_wholly_typical(count):
    assert typicality([steps(0, 1)] * count).tolist() == [1.0] * count


def test_a_demonstration_that_is_one_gap_is_not_typical_of_anything():
    empty = sample_steps(examples(np.ones((50, 2)), np.zeros(50, dtype=bool)))
    assert len(empty) == 0
    assert typicality([steps(0, 1), empty, steps(0, 1)]).tolist() == [1.0, 0.0, 1.0]
    assert typicality([empty]).tolist() == [0.0]
    assert len(typicality([])) == 0


def test_only_some_steps_outside_of_gaps_are_looked_at_and_they_reach_to_the_end():
    n = 10 * STEPS + 7
    features = np.arange(n, dtype=float)[:, np.newaxis]
    valid = np.arange(n) >= n // 2
    found = sample_steps(examples(features, valid))[:, 0]
    assert STEPS / 2 < len(found) <= STEPS
    assert found[0] == n // 2
    assert found[-1] > n - 10
    assert len(np.unique(np.diff(found))) == 1


def test_features_that_no_single_precision_holds_make_the_demonstration_odd_and_nothing_else():
    huge = sample_steps(examples(np.full((50, 2), 1e200)))
    found = typicality([steps(0, 1), huge, steps(0, 2)])
    assert np.isfinite(found).all()
    assert found.argmin() == 1


def test_a_thousand_demonstrations_take_no_more_memory_than_their_distances():
    many = [steps(0, seed, count=2) for seed in range(1000)]
    many = [np.tile(one, 50) for one in many]  # a hundred features
    tracemalloc.start()
    try:
        found = typicality(many)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(found) == 1000
    assert peak < 100e6  # the differences of all pairs would be 1.6 GB
