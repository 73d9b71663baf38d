"""Samples as a table: a row each, which other programs and our own reader read."""

from __future__ import annotations

import numpy as np
import pytest
from factories import (
    BAYES_SETTINGS,
    FOAM_SELECTION,
    cached_project,
    make_labelled_project,
    read_single,
)

from forcelab.cli import main
from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.formats import samples
from forcelab.formats.export import exporting
from forcelab.formats.samples import Prediction, SampleTable
from forcelab.jobs import finish
from forcelab.labels import Segment, Track
from forcelab.project import Project
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.recognition.project_runs import evaluate_tasks_job
from forcelab.review.run_result import latest_predictions, latest_run

TIMES = np.arange(400) / 100 * (1 + np.arange(400) / 1e5)
SIGNALS = np.random.default_rng(0).normal(size=(400, 2)) / 3
PULL = Demonstration("pull", "foam", TIMES, SIGNALS, (Channel("fz", "N"), Channel("grip, left")))


def at(first, last, action):
    return Segment(float(TIMES[first]), float(TIMES[last]), action)


ANN = Track("Ann", (at(40, 90, "grab"), at(90, 200, "hold, firmly"), at(310, 399, "3")))
ODD = Track('=Zoë "2"', (at(0, 40, "=1+1"), at(200, 310, "none"), at(310, 350, "-1")))
MODEL = "model mlp 1"


def prediction(trace=None):
    segments = (at(0, 120, "grab"), at(150, 399, "slip"))
    return Prediction(MODEL, segments, None if trace is None else trace.at)


def write(table, path, kind="csv"):
    with path.open("wb") as stream:
        getattr(table, f"write_{kind}")(stream)
    return path


def test_times_channels_and_labels_come_back(tmp_path, monkeypatch):
    monkeypatch.setattr(samples, "BLOCK", 7)
    tracks = [ANN, ODD, Track(MODEL, (at(1, 2, "old"),))]
    trace = ProbabilityTrace.from_probabilities(TIMES, np.tile([0.2, 0.8], (400, 1)), ("a", "slip"))
    table = SampleTable(PULL, tracks, prediction(trace))
    read = read_single(write(table, tmp_path / "pull.csv"))
    assert np.array_equal(read.demonstration.times, TIMES)
    assert np.array_equal(read.demonstration.signals, SIGNALS)
    assert read.demonstration.channels == PULL.channels
    # The track of a model that a run predicts anew is the run's.
    assert read.tracks == (ANN, ODD, Track(MODEL, prediction().segments))
    assert read.remarks == (
        f"Column probability of {MODEL} was left out: a model's probabilities.",
    )


def test_what_is_missing_is_an_empty_cell(tmp_path):
    signals = SIGNALS.copy()
    signals[[3, 200], [0, 1]] = np.nan, np.inf
    pull = Demonstration("pull", "", TIMES, signals, PULL.channels)
    path = write(SampleTable(pull, [ANN], None), tmp_path / "pull.csv")
    assert path.read_text().splitlines()[4].split(",")[1] == ""
    read = read_single(path)
    assert np.isnan(read.demonstration.signals[[3, 200], [0, 1]]).all()
    assert np.isnan(read.demonstration.signals).sum() == 2
    assert read.tracks == (ANN,)


def test_parquet_holds_the_same_with_null_while_unlabelled(tmp_path, monkeypatch):
    parquet = pytest.importorskip("pyarrow.parquet")
    monkeypatch.setattr(samples, "BLOCK", 150)
    probabilities = np.column_stack([np.linspace(1, 0, 400), np.linspace(0, 1, 400)])
    trace = ProbabilityTrace.from_probabilities(TIMES, probabilities, ("grab", "slip"))
    table = SampleTable(PULL, [ANN, ODD], prediction(trace))
    read = parquet.read_table(write(table, tmp_path / "pull.parquet", "parquet"))
    assert tuple(read.column_names) == table.columns
    assert np.array_equal(read["time (s)"].to_numpy(), TIMES)
    assert np.array_equal(read["fz (N)"].to_numpy(), SIGNALS[:, 0])
    labels = read["labels of Ann"].to_pylist()
    assert [labels[i] for i in (39, 40, 90, 200, 310, 399)] == [
        *(None, "grab", "hold, firmly", None, "3", None)
    ]
    predicted = read[f"labels of {MODEL}"].to_pylist()
    certain = read[f"probability of {MODEL}"].to_pylist()
    assert [predicted[i] for i in (119, 130, 398)] == ["grab", None, "slip"]
    assert certain[130] is None
    assert certain[119] == pytest.approx(1 - 119 / 399, abs=0.01)
    assert certain[398] == pytest.approx(398 / 399, abs=0.01)


@pytest.mark.parametrize(
    ("tracks", "complaint"),
    [
        ([Track("Ann", (at(0, 9, "gr\0ab"),))], "holds a character"),
        ([Track("A\nnn", ())], "holds a character"),
        ([Track("Ann", ()), Track("Ann", ())], None),
    ],
)
def test_what_a_table_cannot_hold_is_refused(tracks, complaint):
    if complaint is None:
        both = (Channel("labels of Ann"), Channel("fz"))
        clash = Demonstration("pull", "", TIMES, SIGNALS, both)
        with pytest.raises(InputError, match="Two columns would be called 'labels of Ann'"):
            SampleTable(clash, tracks, None)
    else:
        with pytest.raises(InputError, match=complaint):
            SampleTable(PULL, tracks, None)


def test_probabilities_are_those_of_the_time_and_unknown_in_gaps():
    times = np.array([0.0, 0.02, 0.04, 0.5, 0.52])
    values = np.array([[0.2], [0.4], [0.6], [0.8], [1.0]])
    trace = ProbabilityTrace.from_probabilities(times, values, ("grab",))
    assert trace.at("grab", times) == pytest.approx(values[:, 0], abs=1 / 255)
    assert np.isnan(trace.at("grab", np.array([0.3]))).all()
    assert trace.at("slip", times).tolist() == [0.0] * 5


def make_evaluated(path):
    make_labelled_project(path)
    with Project.open(path) as project:
        finish(evaluate_tasks_job(project, BAYES_SETTINGS.replace(stride=10), FOAM_SELECTION))


@pytest.fixture
def evaluated(tmp_path):
    """A labelled project with a run."""
    return cached_project(make_evaluated, tmp_path / "study.forcelab")


def test_the_latest_run_of_a_task_is_exported_beside_the_labels(evaluated, tmp_path):
    out = tmp_path / "out"
    assert main(["export", str(evaluated), "--out", str(out), "--format", "samples"]) == 0
    with Project.open(evaluated) as project:
        run = latest_run(project)
        predictions = latest_predictions(project)
        assert predictions.keys() == {result.id for result in (*run.tested, *run.proposals)}
        for result in run.tested:
            recording = read_single(out / f"{result.name}.samples.csv")
            assert recording.demonstration.name == result.name
            tracks = {track.author: track for track in recording.tracks}
            stored = project.tracks.of(result.id)
            assert tracks.keys() == {run.proposer, *(track.author for track in stored)}
            read = tracks[run.proposer].segments
            assert [s.action for s in read] == [s.action for s in result.predicted]
            edges = [
                (s.start - r.start, s.end - r.end)
                for s, r in zip(read, result.predicted, strict=True)
            ]
            assert np.abs(edges).max() <= project.demonstrations.load(result.id).period


def test_predictions_are_left_out_where_labels_are_hidden_or_authors_chosen(evaluated, tmp_path):
    with Project.open(evaluated) as project:
        info = project.demonstrations.infos()[0]
        author = project.tracks.of(info.id)[0].author
        project.coding.assign(info.id, "Zoe", blind=True)
        project.tracks.edit(info.id, "Zoe", (), (Segment(0.1, 0.2, "grab"),), "painted")
    for options, expected in (
        ({"authors": [author]}, f"labels of {author}"),
        ({"viewer": "Zoe"}, "labels of Zoe"),
    ):
        job = exporting(
            evaluated,
            tmp_path / "out",
            "samples",
            [info.id],
            predictions=latest_predictions,
            **options,
        )
        (file,) = finish(job)
        header = file.read_text("utf-8").splitlines()[0].split(",")
        assert [name for name in header if " of " in name] == [expected]
