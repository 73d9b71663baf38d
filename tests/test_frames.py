"""Tables for scripts: with pandas data frames, without it dictionaries of arrays."""

import sys

import numpy as np
import pytest
from factories import BAYES_SETTINGS, FOAM_SELECTION, make_labelled_project, sine_demonstration

import forcelab
from forcelab.project import Provenance
from forcelab.recognition.metrics import METRICS

GRAB, HOLD = forcelab.Segment(0.0, 2.0, "grab"), forcelab.Segment(2.0, 5.0, "hold")


@pytest.fixture(scope="module")
def evaluated(tmp_path_factory):
    """A project of three labelled demonstrations, evaluated, and that evaluation."""
    path = make_labelled_project(tmp_path_factory.mktemp("frames") / "foam.forcelab")
    with forcelab.Project.open(path) as project:
        job = forcelab.evaluate_tasks_job(project, BAYES_SETTINGS, FOAM_SELECTION)
        yield project, forcelab.finish(job).evaluations[0][1]


@pytest.fixture(params=["pandas", "arrays"])
def kind(request, monkeypatch):
    """What tables are: of pandas, or of arrays as where there is no pandas."""
    if request.param == "arrays":
        monkeypatch.setitem(sys.modules, "pandas", None)
        return dict
    return pytest.importorskip("pandas").DataFrame


@pytest.fixture
def project(tmp_path):
    """Two tasks; Ada and Bo labelled, Ada also by accepting and changing what a model proposed."""
    with forcelab.Project.create(tmp_path / "two.forcelab") as project:
        add = project.demonstrations.add
        first = add(sine_demonstration("01", "foam"), [forcelab.Track("Ada", (GRAB, HOLD))]).id
        add(sine_demonstration("02", "foam", 0.5), [forcelab.Track("Bo", (GRAB,))])
        add(sine_demonstration("01", "pen", 0.7))
        proposed, moved = forcelab.Segment(3.0, 4.0, "hold"), forcelab.Segment(3.0, 4.5, "hold")
        edit = project.tracks.edit
        edit(first, "Ada", (GRAB, HOLD), (GRAB,), "deleted")
        edit(first, "Ada", (GRAB,), (GRAB, proposed), "accepted", proposed_by="model best 3")
        edit(first, "Ada", (GRAB, proposed), (GRAB, moved), "moved")
        yield project


def test_segments_of_a_project_are_rows_with_where_they_come_from(project, kind):
    frame = forcelab.segments_frame(project)
    assert type(frame) is kind
    rows = list(zip(*(frame[name] for name in frame), strict=True))
    assert [row[:6] for row in rows] == [
        ("foam", "01", "Ada", 0.0, 2.0, "grab"),
        ("foam", "01", "Ada", 3.0, 4.5, "hold"),
        ("foam", "02", "Bo", 0.0, 2.0, "grab"),
    ]
    assert [row[6] for row in rows][1] == "model best 3"
    assert [row[7] for row in rows] == [False, True, False]
    assert list(forcelab.segments_frame(project, author="Bo")["demonstration"]) == ["02"]
    empty = forcelab.segments_frame(project, task="pen")
    assert list(empty) == list(frame)
    assert len(empty["start"]) == 0
    with pytest.raises(forcelab.InputError, match="There is no author 'Bob'; did you mean 'Bo'"):
        forcelab.segments_frame(project, author="Bob")
    with pytest.raises(forcelab.InputError, match="There is no task 'foma'"):
        forcelab.segments_frame(project, task="foma")


def test_segments_of_an_evaluation_and_its_run_are_the_same(evaluated, kind):
    project, evaluation = evaluated
    frames = [
        forcelab.segments_frame(evaluation),
        forcelab.segments_frame(forcelab.latest_run(project)),
    ]
    for name in ("demonstration", "start", "end", "action"):
        assert list(frames[0][name]) == list(frames[1][name])
    assert set(frames[0]["author"]) == {"human", "model paper"}
    assert set(frames[1]["author"]) == {"Ada", "model paper 1"}


def test_samples_come_back_as_the_demonstration_that_they_were(project, kind):
    demonstration = project.demonstrations.load("02")
    frame = forcelab.samples_frame(demonstration, project.tracks.of(demonstration.id))
    assert list(frame) == ["time", "fx", "fy", "fz", "labels of Bo"]
    again = forcelab.read_frame(frame, "02", forcelab.ReadOptions(task="foam"))
    assert again.tracks == (forcelab.Track("Bo", (GRAB,)),)
    assert again.remarks == ()
    if kind is not dict:  # where there is a place for units
        assert again.demonstration == demonstration
    np.testing.assert_array_equal(again.demonstration.signals, demonstration.signals)


def test_samples_of_a_project_stand_below_one_another(project, kind):
    other = forcelab.Demonstration.from_frame(
        {"time": [0.0, 0.1, 0.3], "torque": [1.0, 2.0, 3.0]}, "03", task="foam"
    )
    project.demonstrations.add(other)
    frame = forcelab.samples_frame(project, task="foam")
    names = ["fx", "fy", "fz", "torque", "labels of Ada", "labels of Bo"]
    assert list(frame) == ["task", "demonstration", "time", *names]
    assert len(frame["time"]) == 2003
    assert np.isnan(np.asarray(frame["torque"])[:2000]).all()
    assert list(frame["torque"])[2000:] == [1.0, 2.0, 3.0]
    assert list(frame["labels of Bo"])[1000] == "grab"
    assert len(forcelab.samples_frame(project, task="pen", demonstration="01")["time"]) == 1000
    with pytest.raises(forcelab.InputError, match="'01' may be any of"):
        forcelab.samples_frame(project, demonstration="01")
    one = forcelab.samples_frame(project, demonstration="03", author="Ada")
    assert list(one["time"]) == [0.0, 0.1, 0.3]
    assert [name for name in one if name.startswith("labels")] == []


def test_scores_have_each_demonstration_the_pool_and_its_interval(evaluated, kind):
    project, evaluation = evaluated
    frame = forcelab.scores_frame(evaluation)
    assert type(frame) is kind
    assert list(frame) == ["stage", "row", "demonstration", *METRICS]
    assert list(frame["row"])[:6] == [*["demonstration"] * 3, "pooled", "lower", "upper"]
    pooled, each = evaluation.scores("filtered")
    at = list(zip(frame["stage"], frame["row"], strict=True)).index(("filtered", "pooled"))
    assert frame["f1.50"][at] == pooled.f1["50"]
    assert frame["accuracy"][at - 1] == each[-1].accuracy
    assert frame["accuracy"][at + 2] == evaluation.intervals("filtered")["accuracy"][1]
    stored = forcelab.scores_frame(forcelab.latest_run(project))
    for name in frame:
        np.testing.assert_array_equal(stored[name], frame[name])


def test_runs_are_rows_with_their_scores(evaluated, kind):
    project, evaluation = evaluated
    frame = forcelab.runs_frame(project)
    assert type(frame) is kind
    row = {name: next(iter(frame[name])) for name in frame}
    pooled, _ = evaluation.scores("filtered")
    assert (row["run"], row["title"], row["author"]) == (1, "foam", "Ada")
    assert (row["preset"], row["classifier"]) == ("paper", "naive-bayes")
    assert (row["tested"], row["accuracy"], row["f1.50"]) == (3, pooled.accuracy, pooled.f1["50"])
    run = forcelab.load_run(project, row["run"])
    assert np.datetime64(run.time.replace(tzinfo=None)) == np.datetime64(row["time"])


def test_a_run_that_tested_nothing_has_a_row_too(tmp_path, kind):
    with forcelab.Project.create(tmp_path / "p.forcelab") as project:
        assert len(forcelab.runs_frame(project)["run"]) == 0
        provenance = Provenance(settings={}, seed=None, labels=(), versions={})
        project.runs.add("old", provenance, result={})
        frame = forcelab.runs_frame(project)
    assert (list(frame["kind"]), list(frame["tested"])) == (["old"], [0])
    assert np.isnan(frame["accuracy"][0])
