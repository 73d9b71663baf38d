"""Differences tile exactly the time over which two tracks differ, and know their kind."""

import math
from itertools import pairwise

import numpy as np
import pytest
from factories import action_at, make_track, unscored_run_result
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.label_map import MergeMap
from forcelab.labels import Segment
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.recognition.results import DemonstrationResult
from forcelab.recognition.settings import Settings
from forcelab.review.differences import action_as_coded, as_trained, find_differences


@st.composite
def tracks(draw):
    """In quarters of a second, so that times and their sums are exact."""
    cuts = draw(st.lists(st.integers(0, 60), unique=True, max_size=12).map(sorted))
    actions = draw(st.lists(st.sampled_from("ABC-"), min_size=12, max_size=12))
    return tuple(
        Segment(a / 4, b / 4, action)
        for a, b, action in zip(cuts, cuts[1:], actions)  # noqa: B905
        if action != "-"
    )


@settings(max_examples=40, deadline=None)
@given(tracks(), tracks())
def test_they_tile_exactly_the_time_that_differs(human, predicted):
    found = find_differences("d", human, predicted)
    for left, right in pairwise(found):
        assert left.end <= right.start
    for quarter in range(61):
        time = quarter / 4 + 0.125
        here = [d for d in found if d.start <= time < d.end]
        human_action, predicted_action = action_at(human, time), action_at(predicted, time)
        assert [(d.human, d.predicted) for d in here] == (
            [(human_action, predicted_action)] if human_action != predicted_action else []
        )
        assert all(
            d.kind == "missed" for d in here if d.kind != "boundary" and predicted_action is None
        )
        assert all(
            d.kind == "invented" for d in here if d.kind != "boundary" and human_action is None
        )


@settings(max_examples=40, deadline=None)
@given(tracks(), tracks())
def test_exchanging_the_sides_exchanges_the_kinds(human, predicted):
    other = {"missed": "invented", "invented": "missed"}
    spans = [(d.start, d.end, d.kind) for d in find_differences("d", human, predicted)]
    back = find_differences("d", predicted, human)
    assert spans == [(d.start, d.end, other.get(d.kind, d.kind)) for d in back]


@given(tracks())
def test_a_track_does_not_differ_from_itself_however_it_is_cut(human):
    halves = tuple(
        part
        for s in human
        for part in (
            Segment(s.start, (s.start + s.end) / 2, s.action),
            Segment((s.start + s.end) / 2, s.end, s.action),
        )
    )
    assert find_differences("d", human, halves) == ()


@pytest.mark.parametrize(
    ("human", "predicted", "kinds"),
    [
        # One edge between two segments that both see.
        ([(0, 2, "A"), (2, 4, "B")], [(0, 2.2, "A"), (2.2, 4, "B")], ["boundary"]),
        # The human leaves a hole in between, as coders do; the model none.
        (
            [(0, 2, "A"), (2.1, 4, "B")],
            [(0, 2.05, "A"), (2.05, 4, "B")],
            ["boundary", "boundary"],
        ),
        # The model begins late where nothing was before.
        ([(1, 4, "A")], [(1.2, 4, "A")], ["boundary"]),
        # Too long to be an edge, compared with the segments beside it.
        ([(0, 2, "A"), (2, 4, "B")], [(0, 3.2, "A"), (3.2, 4, "B")], ["action"]),
        # A third action in between is no edge, however short.
        ([(0, 2, "A"), (2, 2.1, "C"), (2.1, 4, "B")], [(0, 2, "A"), (2, 4, "B")], ["action"]),
        # A hole inside one action is no edge either.
        ([(0, 4, "A")], [(0, 2, "A"), (2.1, 4, "A")], ["missed"]),
        ([(0, 2, "A"), (2.1, 4, "A")], [(0, 4, "A")], ["invented"]),
        # Turning back is no edge.
        (
            [(0, 2, "A"), (2, 4, "B")],
            [(0, 1.7, "A"), (1.7, 1.8, "B"), (1.8, 2, "A"), (2, 4, "B")],
            ["action"],
        ),
    ],
)
def test_an_edge_is_distinguished_from_a_wrong_action(human, predicted, kinds):
    found = find_differences("d", make_track(*human), make_track(*predicted))
    assert [d.kind for d in found] == kinds


def test_confidence_is_that_of_what_is_predicted_and_score_weighs_it_by_time():
    times = np.arange(400) / 100
    probabilities = np.tile([0.2, 0.8], (400, 1))
    trace = ProbabilityTrace.from_probabilities(times, probabilities, ("A", "B"))
    human, predicted = make_track((0, 3, "A")), make_track((0, 2, "B"))
    action, missed = find_differences("d", human, predicted, trace)
    assert action.confidence == pytest.approx(0.8, abs=0.003)
    assert action.score == pytest.approx(1.6, abs=0.006)
    assert missed.confidence == pytest.approx(0.8, abs=0.003)  # how improbable it finds A
    assert find_differences("d", human, predicted)[0].score == 2.0


def test_tracks_are_spelt_as_they_were_trained():
    result = DemonstrationResult("1", "one", "pen", 0, 4, (), {"filtered": ()})
    merged = unscored_run_result([result], settings=Settings(merge=MergeMap({"grap": "grab"})))
    assert as_trained(make_track((0, 1, "grap")), merged, result) == make_track((0, 1, "grab"))
    apart = unscored_run_result([result], tasks=("pen",), apart=True)
    assert as_trained(make_track((0, 1, "grab")), apart, result) == make_track((0, 1, "grab_pen"))
    assert action_as_coded("grab_pen", apart, result) == "grab"
    assert math.isclose(as_trained(make_track((0, 1, "x")), apart, result)[0].duration, 1)


def test_an_action_of_another_task_is_spelt_as_its_coder_does():
    result = DemonstrationResult("1", "one", "pen", 0, 4, (), {"filtered": ()})
    apart = unscored_run_result([result], apart=True, tasks=("pen", "foam", "soft foam"))
    assert action_as_coded("grab_soft foam", apart, result) == "grab"
    assert action_as_coded("grab_hard_foam", apart, result) == "grab_hard"
    assert (
        action_as_coded("grab_pen", unscored_run_result([result], tasks=("pen",)), result)
        == "grab_pen"
    )


def test_float_dust_is_no_difference():
    human = make_track((0, 1, "A"), (1 + 1e-10, 2, "A"), (2, 3, "B"))
    assert find_differences("d", human, make_track((0, 2 + 1e-10, "A"), (2 + 1e-10, 3, "B"))) == ()
    (one,) = find_differences("d", human, make_track((2, 3, "B")))
    assert (one.start, one.end, one.human) == (0, 2, "A")
