"""Which demonstration to label next, against counts made by hand."""

from functools import partial

import numpy as np
import pytest
from factories import grab_probabilities, unscored_run_result
from hypothesis import given
from hypothesis import strategies as st

from forcelab.labels import Segment
from forcelab.recognition.results import DemonstrationResult
from forcelab.review.active_learning import (
    BINS,
    ConfidenceCalibration,
    acceptable_segments,
    calibrate_confidence,
    rank_proposals,
)

ACTIONS = ("grab", "hold")
trace_of = partial(grab_probabilities, rate=10.0)


def reviewed(name, probability_trace, human=(), predicted=()):
    end = len(probability_trace.values) / probability_trace.rate if probability_trace else 10.0
    stages = {"filtered": predicted}
    return DemonstrationResult(name, name, "foam", 0.0, end, human, stages, probability_trace)


def run(tested=(), proposed=()):
    return unscored_run_result(tested, ACTIONS, proposals=tuple(proposed))


def test_the_calibration_counts_how_often_it_was_right_when_so_sure():
    # 4 s at 0.75 for grab of which the human says grab in 3 s, and 2 s at 0.95, all right.
    trace = trace_of((4, 0.75), (2, 0.95))
    human = (Segment(0, 3, "grab"), Segment(3, 4, "hold"), Segment(4, 6, "grab"))
    known = calibrate_confidence(run([reviewed("01", trace, human)]))
    assert known.seconds == pytest.approx(6.0)
    assert known.accuracy[7] == pytest.approx(0.75)
    assert known.accuracy[9] == pytest.approx(1.0)
    assert known.accuracy[8] == pytest.approx(0.875)  # never met: between its neighbours
    assert known.accuracy[5] == pytest.approx(0.75)  # below all that was met: like the lowest


def test_what_is_unlabelled_or_in_a_gap_counts_for_nothing():
    trace = trace_of((2, 0.75), (2, 0.75))
    trace.values[25:] = 0
    known = calibrate_confidence(run([reviewed("01", trace, (Segment(0, 1, "grab"),))]))
    assert known.seconds == pytest.approx(1.0)


def test_an_action_that_the_recogniser_never_met_was_predicted_wrong():
    human = (Segment(0, 2, "slip"),)
    known = calibrate_confidence(run([reviewed("01", trace_of((2, 0.95)), human)]))
    assert known.accuracy[9] == 0.0


def test_the_most_uncertain_demonstration_comes_first_with_what_it_would_bring():
    tested = [reviewed("01", trace_of((4, 0.75)), (Segment(0, 3, "grab"), Segment(3, 4, "hold")))]
    unsure = reviewed("02", trace_of((8, 0.75)))
    certain = reviewed("03", trace_of((20, 0.95)))
    found = rank_proposals(run(tested, [certain, unsure]))
    assert [suggestion.name for suggestion in found] == ["02", "03"]
    assert found[0].uncertainty == pytest.approx(0.25, abs=0.01)
    assert found[0].wrong == pytest.approx(8 * 0.25, abs=0.01)  # a quarter was wrong when tested


def test_without_anything_tested_the_probabilities_are_taken_at_their_word():
    found = rank_proposals(run([], [reviewed("02", trace_of((8, 0.75)))]))
    assert found[0].wrong == pytest.approx(8 * 0.25, abs=0.05)


def test_the_place_is_where_it_knows_least():
    place = rank_proposals(run([], [reviewed("02", trace_of((3, 0.95), (1, 0.55), (4, 0.9)))]))[
        0
    ].place
    assert (place.start, place.end) == pytest.approx((3.0, 4.0))
    assert place.demonstration == "02"
    assert place.predicted == "grab"
    assert place.confidence == pytest.approx(0.55, abs=0.01)
    assert place.human is None


def test_a_gap_is_no_place_to_label():
    trace = trace_of((3, 0.95), (3, 0.55), (3, 0.9))
    trace.values[30:60] = 0
    (found,) = rank_proposals(run([], [reviewed("02", trace)]))
    assert found.place.start >= 6.0 - 0.05
    assert found.uncertainty < 0.1


def test_a_recording_shorter_than_a_stretch_is_one_place():
    (found,) = rank_proposals(run([], [reviewed("02", trace_of((0.4, 0.6)))]))
    assert (found.place.start, found.place.end) == pytest.approx((0.0, 0.4))


def test_what_has_no_probabilities_cannot_be_ranked():
    assert rank_proposals(run([], [reviewed("02", None)])) == ()


def test_only_what_is_probable_enough_is_acceptable():
    predicted = (Segment(0, 2, "grab"), Segment(2, 4, "hold"), Segment(4, 6, "grab"))
    proposal = reviewed("02", trace_of((2, 0.95), (2, 0.3), (2, 0.6)), predicted=predicted)
    assert acceptable_segments(proposal, 0, 6) == predicted
    assert acceptable_segments(proposal, 0, 6, 0.9) == predicted[:1]
    assert acceptable_segments(proposal, 0, 6, 0.65) == predicted[:2]
    assert (
        acceptable_segments(proposal, 2, 4) == predicted[1:2]
    )  # those that only touch it are not meant
    assert acceptable_segments(reviewed("03", None, predicted=predicted), 0, 6, 0.9) == ()


@given(
    accuracy=st.lists(st.floats(0, 1), min_size=BINS, max_size=BINS),
    confidence=st.lists(st.floats(0, 1), min_size=1, max_size=20),
)
def test_what_is_wrong_is_always_a_share(accuracy, confidence):
    wrong = ConfidenceCalibration(np.array(accuracy), 1.0).wrong(np.array(confidence))
    assert np.all((wrong >= 0) & (wrong <= 1))


def test_of_values_farther_apart_than_a_second_the_least_certain_one_is_looked_at_first():
    slow = trace_of((5, 0.9), (5, 0.5), (10, 0.9), rate=0.2)
    (proposal,) = rank_proposals(run(proposed=[reviewed("slow", slow)]))
    assert (proposal.place.start, proposal.place.end) == (5.0, 10.0)
