"""Probabilities over time, kept coarsely; Brier score and calibration error as defined."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.recognition.probabilities import RATE, ProbabilityTrace, Reliability

ACTIONS = ("grab", "hold")


def trace_of(times, grab=0.8):
    """Of one action so probable throughout."""
    values = np.full(len(times), grab)
    return ProbabilityTrace.from_probabilities(
        times, np.stack([values, 1 - values], axis=1), ACTIONS
    )


@given(st.floats(2.0, 2000.0), st.floats(0.0, 1e5), st.integers(2, 3000))
def test_at_any_rate_of_samples_no_bin_is_empty_and_means_are_as_given(rate, start, count):
    trace = trace_of(start + np.arange(count) / rate)
    assert trace.known.all()
    assert trace.rate <= RATE
    assert trace.mean(start, start + count / rate) == pytest.approx([0.8, 0.2], abs=1e-9)


def test_bins_are_as_many_as_samples_where_these_are_as_far_apart():
    for rate in (20.0, 30.0, 50.0):
        assert len(trace_of(np.arange(1000) / rate).values) == 1000


def test_a_stretch_across_a_gap_is_as_sure_as_what_is_known_of_it():
    times = np.arange(400) / 100
    trace = trace_of(times[(times < 1) | (times >= 2)])
    assert not trace.known[50:100].any()
    assert trace.of_action("grab", 0.5, 3.0) == pytest.approx(0.8)
    assert trace.mean(1.2, 1.8).tolist() == [0.0, 0.0]


def test_a_mean_takes_no_bin_beyond_its_edges():
    times = np.arange(1000) / 100
    values = np.stack([times >= 0.28, times < 0.28], axis=1).astype(float)
    trace = ProbabilityTrace.from_probabilities(times, values, ACTIONS)
    assert trace.mean(0.0, 0.28).tolist() == [0.0, 1.0]  # 0.28 * 50 is 14.000000000000002
    assert trace.mean(0.28, 0.58).tolist() == [1.0, 0.0]


def test_it_is_kept_to_the_last_bit_and_damage_is_refused():
    trace = trace_of(np.arange(345) / 100, 0.123)
    plain = trace.to_json()
    again = ProbabilityTrace.from_json(plain)
    np.testing.assert_array_equal(again.values, trace.values)
    assert (again.start, again.rate, again.actions) == (0.0, RATE, ACTIONS)
    for damage in ({"count": 7}, {"values": "!"}, {"values": plain["values"][:-8]}):
        with pytest.raises(ValueError, match=r".+"):
            ProbabilityTrace.from_json(plain | damage)


THREE = ("grab", "hold", "pull")


@pytest.fixture
def drawn():
    random = np.random.default_rng(0)
    return random.dirichlet(np.ones(3), 400), random.integers(-1, 3, 400)


def test_figures_are_their_definitions(drawn):
    P, human = drawn
    found = Reliability.from_predictions(P, THREE, human, THREE)
    squares, gaps = [], {}
    for p, h in zip(P, human, strict=True):
        if h < 0:
            continue
        squares.append(sum((p[k] - (k == h)) ** 2 for k in range(3)))
        gaps.setdefault(min(int(10 * p.max()), 9), []).append(p.max() - (p.argmax() == h))
    assert found.brier == pytest.approx(np.mean(squares))
    assert found.ece == pytest.approx(sum(abs(sum(g)) for g in gaps.values()) / len(squares))


def test_parts_add_up_to_the_whole(drawn):
    P, human = drawn
    full = Reliability.from_predictions(P, THREE, human, THREE).to_json()
    parts = [
        Reliability.from_predictions(P[s], THREE, human[s], THREE) for s in (np.s_[:90], np.s_[90:])
    ]
    added = (parts[0] + parts[1]).to_json()
    assert added["brier"] == pytest.approx(full["brier"])
    np.testing.assert_allclose(added["bins"], full["bins"])


def test_an_action_that_is_not_known_is_wrong_however_sure():
    found = Reliability.from_predictions(
        np.array([[1.0, 0.0]]), ("grab", "hold"), np.array([2]), THREE
    )
    assert (found.brier, found.ece) == (2.0, 1.0)


def test_nothing_labelled_has_no_figures():
    found = Reliability.from_predictions(np.full((4, 3), 1 / 3), THREE, np.full(4, -1), THREE)
    assert found.to_json() == {"brier": None, "ece": None, "bins": []}
