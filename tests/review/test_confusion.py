"""Cells of a confusion matrix: seconds, segments, and the places that they are counted from."""

import numpy as np
import pytest
from factories import synthetic_set, unscored_run_result
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.jobs import finish
from forcelab.labels import Segment, Track, from_codes
from forcelab.project import NewDemonstration, Project
from forcelab.recognition.dataset import DataSelection
from forcelab.recognition.metrics import count
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.recognition.project_runs import evaluate_tasks_job
from forcelab.recognition.results import DemonstrationResult
from forcelab.recognition.settings import Settings
from forcelab.review.confusion import count_confusion, normalise
from forcelab.review.run_result import load_run

ACTIONS = ("grab", "hold", "pull")


def reviewed(id_, human, predicted, raw=None, probability_trace=None):
    stages = {"filtered": tuple(predicted)} | ({} if raw is None else {"raw": tuple(raw)})
    return DemonstrationResult(
        id_, f"pen {id_}", "pen", 0.0, 10.0, tuple(human), stages, probability_trace
    )


def run(*tested):
    return unscored_run_result(tested, ACTIONS, title="pen", tasks=("pen",))


def certain(**probabilities):
    """Constant probabilities over ten seconds."""
    values = np.tile([round(255 * probabilities.get(a, 0.0)) for a in ACTIONS], (500, 1))
    return ProbabilityTrace(0.0, 50.0, ACTIONS, values.astype(np.uint8))


def make_run():
    return run(
        reviewed(
            "1",
            [Segment(0, 4, "grab"), Segment(4, 6, "hold"), Segment(7, 8, "grab")],
            [Segment(0, 2.5, "grab"), Segment(2.5, 5, "hold"), Segment(6, 7.25, "pull")],
            raw=[Segment(0, 8, "grab")],
            probability_trace=certain(grab=0.2, hold=0.6, pull=0.9),
        ),
        reviewed(
            "2", [Segment(0, 2, "grab")], [Segment(0, 2, "hold")], probability_trace=certain(hold=1)
        ),
    )


def test_time_is_summed_where_the_human_labelled_and_missed_time_stands_last():
    matrix = finish(count_confusion(make_run())).matrix("time")
    expected = [[2.5, 1.5 + 2, 0.25, 0.75], [0, 1, 0, 1], [0, 0, 0, 0]]
    assert matrix == pytest.approx(np.array(expected))


def test_a_segment_counts_for_what_covers_most_of_it():
    matrix = finish(count_confusion(make_run())).matrix("segments")
    # Half of the hold is seen as hold, half missed: of two that cover as much, the action.
    assert matrix.tolist() == [[1, 1, 0, 1], [0, 1, 0, 0], [0, 0, 0, 0]]


def test_raw_is_counted_where_it_was_kept():
    cells = finish(count_confusion(make_run(), "raw"))
    assert [d.id for d in cells.demonstrations] == ["1"]
    assert cells.matrix().tolist() == [[5, 0, 0, 0], [2, 0, 0, 0], [0, 0, 0, 0]]


def places(run, *cell):
    return finish(count_confusion(run)).places(*cell)


def test_places_come_by_duration_times_confidence():
    found = places(make_run(), "grab", "hold")
    assert [(p.demonstration, p.start, p.end) for p in found] == [("2", 0, 2), ("1", 2.5, 4)]
    assert [p.confidence for p in found] == pytest.approx([1.0, 0.6])
    assert {(p.human, p.predicted) for p in found} == {("grab", "hold")}
    # Half as confident, one and a half times as long: second.
    swapped = run(
        reviewed(
            "long", [Segment(0, 3, "grab")], [Segment(0, 3, "hold")], probability_trace=certain()
        ),
        reviewed(
            "sure",
            [Segment(0, 2, "grab")],
            [Segment(0, 2, "hold")],
            probability_trace=certain(hold=1),
        ),
    )
    assert [p.demonstration for p in places(swapped, "grab", "hold")] == ["sure", "long"]


def test_missed_time_has_no_confidence_and_the_longest_comes_first():
    found = places(make_run(), "hold", None)
    assert [(p.start, p.end, p.predicted, p.confidence) for p in found] == [(5, 6, None, None)]
    segment = places(make_run(), "grab", None, "segments")
    assert [(p.start, p.end) for p in segment] == [(7, 8)]  # whole, though a quarter is seen


def test_no_more_places_are_listed_than_asked_for_the_longest():
    human = [Segment(i, i + 0.1 * (i + 1), "grab") for i in range(5)]
    predicted = [Segment(s.start, s.end, "hold") for s in human]
    cells = finish(count_confusion(run(reviewed("1", human, predicted))))
    assert [p.start for p in cells.places("grab", "hold", most=2)] == [4, 3]
    assert cells.numbers("time")[0, 1] == 5


def test_nothing_tested_is_an_empty_matrix():
    cells = finish(count_confusion(run()))
    assert cells.matrix("time").tolist() == [[0] * 4] * 3
    assert cells.places("grab", "hold") == ()


@st.composite
def coded(draw):
    n = draw(st.integers(2, 80))
    codes = st.lists(st.integers(-1, 2), min_size=n, max_size=n)
    return np.array(draw(codes)), np.array(draw(codes))


@settings(max_examples=40, deadline=None)
@given(st.lists(coded(), min_size=1, max_size=3))
def test_time_is_that_of_the_counted_samples_and_places_add_up_to_their_cell(drawn):
    period, samples, tested = 0.008, np.zeros((3, 4)), []
    for number, (human, predicted) in enumerate(drawn):
        times = np.arange(len(human)) * period
        samples += count(human, predicted, times, ACTIONS).confusion
        segments = (from_codes(codes, times, ACTIONS) for codes in (human, predicted))
        tested.append(reviewed(str(number), *segments))
    cells = finish(count_confusion(run(*tested)))
    assert cells.matrix("time") == pytest.approx(samples * period, abs=1e-4)
    humans = sum(len(item.human) for item in tested)
    assert cells.matrix("segments").sum() == humans
    for row, human_action in enumerate(ACTIONS):
        for column, predicted_action in enumerate((*ACTIONS, None)):
            found = cells.places(human_action, predicted_action)
            total = sum(place.duration for place in found)
            assert total == pytest.approx(cells.matrix("time")[row, column], abs=1e-4)
            assert len(found) == cells.numbers("time")[row, column]


def test_shares_of_rows_and_columns_sum_to_one_and_of_nothing_to_nothing():
    matrix = np.array([[3.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    assert normalise(matrix, "row").tolist() == [[0.75, 0.25, 0], [0, 0, 0]]
    assert normalise(matrix, "column").tolist() == [[1, 1, 0], [0, 0, 0]]
    assert normalise(matrix, "counts").tolist() == [[1, 1 / 3, 0], [0, 0, 0]]
    assert normalise(np.zeros((0, 1)), "counts").shape == (0, 1)


def test_the_matrix_of_a_stored_run_is_the_confusion_that_evaluate_counted(tmp_path):
    with Project.create(tmp_path / "p.forcelab") as project:
        pairs = synthetic_set(3, rate=100.0)
        project.demonstrations.add_all(
            [NewDemonstration(d, (Track("Ada", segments),)) for d, segments in pairs]
        )
        settings_ = Settings(classifier="naive-bayes", max_scale=32)
        finish(evaluate_tasks_job(project, settings_, DataSelection(("foam",))))
        number = project.runs.summaries("evaluate")[-1].id
        found = load_run(project, number)
        stored = project.runs.get(number).result
    for stage in ("raw", "filtered"):
        cells = finish(count_confusion(found, stage))
        counted = np.array(stored[stage]["pooled"]["confusion"])
        assert counted.sum() > 1000
        assert cells.matrix("time") == pytest.approx(counted / 100.0, abs=0.01)
        # And its segments are those of the tracks, which the pairs show.
        humans = [segment for plain in stored["tracks"] for segment in plain["human"]]
        assert cells.matrix("segments").sum() == len(humans)
    assert found.scores["filtered"]["intervals"]["accuracy"] is not None
