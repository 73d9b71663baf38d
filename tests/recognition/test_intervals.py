"""Intervals of scores: equal to scoring each resample by itself, and to what scipy finds."""

from functools import reduce
from operator import add

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import bootstrap

from forcelab.recognition.intervals import (
    Intervals,
    difference_intervals,
    draw_resamples,
    score_intervals,
)
from forcelab.recognition.metrics import METRICS, Counts, count, look_up, pool, score_resamples

ACTIONS = ("still", "grab", "hold")


def demonstration(seed: int, n: int = 300, right: float = 0.7) -> Counts:
    """Counts of runs of three actions that are predicted right for a share of the time."""
    random = np.random.default_rng(seed)
    human = np.repeat(random.integers(-1, 3, n // 20), 20)
    noise = np.repeat(random.integers(-1, 3, n // 10), 10)
    right_steps = np.repeat(random.random(n // 10) < right, 10)
    return count(human, np.where(right_steps, human, noise), np.arange(n) / 100, ACTIONS)


def eight() -> list[Counts]:
    return [demonstration(seed, right=0.4 + 0.07 * seed) for seed in range(8)]


@settings(max_examples=40, deadline=None)
@given(st.lists(st.lists(st.integers(0, 3), min_size=3, max_size=3), min_size=1, max_size=4))
def test_a_resample_is_scored_as_the_pool_of_its_demonstrations_is(weights):
    # The second has no label at all: no edit, no segment, no boundary, no sample.
    nothing = np.full(50, -1)
    parts = [
        demonstration(1),
        count(nothing, nothing, np.arange(50) / 100, ACTIONS),
        demonstration(2, 100),
    ]
    found = score_resamples(parts, np.array(weights))
    assert tuple(sorted(found)) == tuple(sorted(METRICS))
    for row, repeats in enumerate(weights):
        drawn = [part for part, n in zip(parts, repeats, strict=True) for _ in range(n)]
        if not drawn:
            assert np.isnan(found["accuracy"][row])
            assert found["events.human.count"][row] == 0
            continue
        record = pool("resample", drawn).to_json()
        for name in METRICS:
            expected = look_up(record, name)
            value = None if np.isnan(found[name][row]) else found[name][row]
            assert value == (None if expected is None else pytest.approx(expected, abs=1e-12)), name


def test_a_draw_takes_as_many_demonstrations_as_there_are_each_equally_often():
    weights = draw_resamples(7, 5000, 3)
    assert (weights.sum(axis=1) == 7).all()
    assert weights.mean(axis=0) == pytest.approx(np.ones(7), abs=0.06)  # 4 standard errors
    assert (weights == draw_resamples(7, 5000, 3)).all()
    assert (weights != draw_resamples(7, 5000, 4)).any()


def test_intervals_are_those_of_scipy():
    # Other scores differ in what a resample scores, which the pools of its demonstrations tell.
    parts, metric = eight(), "boundary_labelled_ms.p90"

    def statistic(which):
        drawn = [parts[i] for i in which.astype(int)]
        return look_up(pool("drawn", drawn).to_json(), metric)

    reference = bootstrap(
        (np.arange(8),),
        statistic,
        n_resamples=2000,
        vectorized=False,
        method="percentile",
        random_state=np.random.default_rng(5),
    ).confidence_interval
    low, high = score_intervals(parts)[metric]
    wide = reference.high - reference.low
    assert low == pytest.approx(reference.low, abs=0.08 * wide)  # another 2,000 resamples
    assert high == pytest.approx(reference.high, abs=0.08 * wide)


def test_the_interval_holds_the_score_and_narrows_with_more_demonstrations():
    few, many = eight(), [*eight(), *eight(), *eight(), *eight()]
    pooled = pool("pooled", few).to_json()
    for name in METRICS:
        low, high = score_intervals(few)[name]
        assert low <= look_up(pooled, name) <= high, name
    wide, narrow = score_intervals(few)["accuracy"], score_intervals(many)["accuracy"]
    assert narrow[1] - narrow[0] == pytest.approx((wide[1] - wide[0]) / 2, rel=0.15)  # root of four


@pytest.mark.parametrize("number", [1, 2])
def test_fewer_than_three_demonstrations_have_none_and_a_reason(number):
    found = score_intervals(eight()[:number])
    assert found["accuracy"] is None
    assert f"needs 3 demonstrations; {number} demonstration" in found.reason
    assert found.to_json()["accuracy"] is None
    assert score_intervals(eight()[:3]).reason == ""


def test_a_metric_that_no_demonstration_has_has_no_interval():
    human = np.zeros(100, dtype=np.int64)
    missed = count(human, np.full(100, -1), np.arange(100) / 100, ACTIONS)
    found = score_intervals([missed] * 3)
    assert found["boundary_ms.median"] is None
    assert found["accuracy"] == (0.0, 0.0)


def test_json_has_the_names_of_the_scores_and_reads_back():
    found = score_intervals(eight(), seed=4)
    record = found.to_json()
    scores = pool("pooled", eight()).to_json()
    assert record["level"] == 0.95
    assert record["seed"] == 4
    for name in METRICS:
        assert isinstance(look_up(scores, name), float | int), name
        assert look_up(record, name) == list(found[name])
    assert Intervals.from_json(record) == found
    assert Intervals.from_json(score_intervals([]).to_json()).reason == score_intervals([]).reason


def test_what_is_hard_for_both_does_not_widen_their_difference():
    first = eight()
    human = np.zeros(100, dtype=np.int64)
    better = count(human, human, np.arange(100) / 100, ACTIONS)
    second = [part + better for part in first]  # a little better everywhere
    paired = difference_intervals(first, second)["accuracy"]
    alone = score_intervals(first)["accuracy"]
    assert 0 < paired[0] < paired[1]
    assert paired[1] - paired[0] < 0.5 * (alone[1] - alone[0])
    assert difference_intervals(first, first)["accuracy"] == (0.0, 0.0)
    back = difference_intervals(second, first)["accuracy"]
    assert back == pytest.approx((-paired[1], -paired[0]))


def test_boundaries_are_resampled_in_parts_alike(monkeypatch):
    parts = eight()
    full = score_intervals(parts)["boundary_ms.p90"]
    assert len(reduce(add, parts).boundaries) > 20
    monkeypatch.setattr("forcelab.recognition.metrics.AT_ONCE", 100)
    assert score_intervals(parts)["boundary_ms.p90"] == full


def test_runs_of_different_demonstrations_are_not_paired():
    with pytest.raises(ValueError, match="8 demonstrations cannot be paired with 7"):
        difference_intervals(eight(), eight()[:7])
