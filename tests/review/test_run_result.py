"""Outcomes out of the runs of a project."""

import json
import shutil
import sqlite3
from contextlib import closing
from dataclasses import replace

import pytest
from factories import BAYES_SETTINGS, FOAM_SELECTION, make_labelled_project

from forcelab.errors import InputError
from forcelab.formats.archive import read_archive, write_archive
from forcelab.jobs import finish
from forcelab.project import Project, Provenance
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.recognition.project_runs import evaluate_tasks_job
from forcelab.review.run_result import edits_since, latest_run, load_run
from forcelab.review.training import review_job


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A project with a run of the window (1) and one of the command line (2)."""
    path = make_labelled_project(tmp_path_factory.mktemp("outcome") / "foam.forcelab")
    finish(review_job(path, BAYES_SETTINGS, FOAM_SELECTION, "foam"))
    with Project.open(path) as project:
        finish(evaluate_tasks_job(project, BAYES_SETTINGS.replace(stride=4), FOAM_SELECTION))
    return path


@pytest.fixture
def project(path):
    with Project.open(path) as project:
        yield project


def test_summaries_say_what_a_list_shows_without_the_result(project):
    first, second = project.runs.summaries("evaluate")
    for summary in (first, second):
        run = project.runs.get(summary.id)
        assert (summary.time, summary.settings, summary.labels) == (
            run.time,
            run.settings,
            run.labels,
        )
        assert summary.digest["title"] == "foam"
        assert summary.digest["tested"] == 3
        assert summary.digest["f1"] == run.result["filtered"]["pooled"]["f1"]["50"]
    assert project.runs.summaries("simulate") == ()
    assert project.runs.summaries() == (first, second)


def test_a_run_without_a_digest_has_an_empty_one(tmp_path):
    with Project.create(tmp_path / "p.forcelab") as project:
        for result in ({"accuracy": 0.5}, {"digest": 3}, {"digest": {"text": "x" * 9000}}):
            project.runs.add(
                "old", Provenance(settings={}, seed=None, labels=[], versions={}), result=result
            )
        assert [summary.digest for summary in project.runs.summaries()] == [{}, {}, {}]


def test_the_latest_is_that_of_the_tasks(project):
    assert latest_run(project).number == 2
    assert latest_run(project, ["foam"]).number == 2
    assert latest_run(project, ["foam", "soft"]) is None


def test_the_latest_of_a_task_tells_of_its_own_demonstrations_if_any_does(path):
    """A model of foam that was tried on soft afterwards has nothing to say of foam."""
    with Project.open(path) as project:
        run = project.runs.get(2)

        def add(trained: str, tested: str) -> int:
            choice = {**run.settings["choice"], "tasks": [trained], "test_task": tested}
            return project.runs.add(
                run.kind,
                Provenance(
                    settings={**run.settings, "choice": choice},
                    seed=run.seed,
                    labels=run.labels,
                    versions=run.versions,
                ),
                result=run.result,
            )

        added = [add("foam", "soft"), add("hard", "soft"), add("foam", "wet")]
        try:
            assert latest_run(project).number == added[2]
            assert latest_run(project, ["foam"]).number == 2
            assert latest_run(project, ["soft"]).number == added[1]
            assert latest_run(project, ["hard"]).number == added[1]
        finally:
            for number in added:
                project.runs.remove(number)


def test_a_printed_run_tells_what_it_is_in_a_few_lines(project):
    outcome = latest_run(project)
    assert "title='foam'" in repr(outcome)
    assert len(repr(outcome)) < 2000


def test_a_run_of_the_command_line_can_be_reviewed_too(project):
    outcome = load_run(project, 2)
    assert (outcome.recogniser, outcome.proposals) == ("", ())
    assert outcome.settings == BAYES_SETTINGS.replace(stride=4)
    assert outcome.author == "Ada"
    for item in outcome.tested:
        assert item.probability_trace is None
        assert set(item.stages) == {"raw", "threshold", "median", "filtered"}
        demonstration = project.demonstrations.load(item.id)
        assert (item.start, item.end) == (demonstration.start, demonstration.end)


def test_a_certainty_survives_its_way_through_the_store(project):
    outcome = load_run(project, 1)
    for item, plain in zip(outcome.tested, project.runs.get(1).result["tracks"], strict=True):
        again = ProbabilityTrace.from_json(item.probability_trace.to_json())
        assert (again.values == item.probability_trace.values).all()
        assert plain["certainty"] == item.probability_trace.to_json()
    damaged = item.probability_trace.to_json()
    for change in ({"count": 3}, {"values": "no base64!"}, {"values": "AAAA"}):
        with pytest.raises(ValueError):  # noqa: PT011 - whatever numpy, zlib or base64 call it
            ProbabilityTrace.from_json(damaged | change)


def test_runs_stored_by_earlier_versions_are_read_alike(tmp_path, path):
    """They kept probabilities apart, and where a demonstration ends not always."""
    with Project.open(path) as project:
        expected = [load_run(project, number) for number in (1, 2)]
        records = [dict(project.runs.get(number).result) for number in (1, 2)]
    for record in records:
        record["tracks"] = [dict(plain) for plain in record["tracks"]]
        traces = {p["demonstration"]: p.pop("certainty", None) for p in record["tracks"]}
        record["certainty"] = {id_: trace for id_, trace in traces.items() if trace}
    for plain in records[1]["tracks"]:
        del plain["start"], plain["end"]
    copy = shutil.copytree(path, tmp_path / "copy.forcelab")
    with closing(sqlite3.connect(copy / "project.sqlite")) as connection, connection:
        for number, record in enumerate(records, 1):
            change = json.dumps(record), number
            connection.execute("UPDATE run SET result = ? WHERE id = ?", change)
    with Project.open(copy) as project:
        for run in expected:
            for before, now in zip(run.tested, load_run(project, run.number).tested, strict=True):
                assert now.to_json() == before.to_json()
    assert expected[0].tested[0].probability_trace is not None


DAMAGE = {
    "no JSON": ("""'{"title": "foam", }'""", "found is damaged"),
    "no tracks": ("json_remove(result, '$.tracks')", "cannot be reviewed"),
    "no prediction": ("json_remove(result, '$.tracks[0].filtered')", "cannot be reviewed"),
    "a stranger": (
        "json_set(result, '$.tracks[0].demonstration', 'nobody')",
        "cannot be reviewed",
    ),
    "half a certainty": (
        "json_set(result, '$.certainty', json('{\"x\": 1}'), '$.proposals[0].certainty.count', 7)",
        "cannot be reviewed",
    ),
    "settings": ("json_set(result, '$.settings.stride', 0)", "stride must be"),
    "another kind": (None, "of the kind 'other'"),
}


@pytest.mark.parametrize("kind", DAMAGE)
def test_a_damaged_run_is_refused_in_a_sentence_and_the_others_are_not(tmp_path, path, kind):
    copy = shutil.copytree(path, tmp_path / "copy.forcelab")
    expression, sentence = DAMAGE[kind]
    with closing(sqlite3.connect(copy / "project.sqlite")) as connection, connection:
        change = "kind = 'other'" if expression is None else f"result = {expression}"
        connection.execute(f"UPDATE run SET {change} WHERE id = 1")
    with Project.open(copy) as project:
        with pytest.raises(InputError, match=sentence) as caught:
            load_run(project, 1)
        assert str(caught.value).count(". ") == 0
        assert latest_run(project).number == 2
        assert len(project.runs.summaries()) == 2


def test_edits_are_counted_by_the_track_that_was_used(tmp_path):
    path = make_labelled_project(tmp_path / "p.forcelab", labelled=2, bare=1)
    with Project.open(path) as project:
        finish(evaluate_tasks_job(project, BAYES_SETTINGS, FOAM_SELECTION))
        outcome = latest_run(project)
        first, _, bare = (info.id for info in project.demonstrations.infos())
        segments = project.tracks.get(first, "Ada").segments
        assert edits_since(project, outcome) == 0
        project.tracks.edit(first, "Bob", (), segments, "another coder")
        assert edits_since(project, outcome) == 0
        project.tracks.edit(first, "Ada", segments, segments[:-1], "deleted")
        project.tracks.edit(bare, "Ada", (), segments, "painted")
        assert edits_since(project, outcome) == 2
        assert edits_since(project, replace(outcome, labels=())) == 3  # all are new then


def test_a_run_outlives_a_demonstration_that_it_tested(tmp_path, path):
    copy = shutil.copytree(path, tmp_path / "study.forcelab")
    with Project.open(copy) as project:
        before = latest_run(project)
        gone = before.tested[0].id
        heads = {
            name: project.tracks.head(gone, name)
            for name in project.demonstrations.info(gone).authors
        }
        project.demonstrations.remove_all({gone: heads})
        after = load_run(project, before.number)
        assert [result.id for result in after.tested] == [result.id for result in before.tested[1:]]
        assert after.scores["filtered"]["pooled"] == before.scores["filtered"]["pooled"]
        each = [item.scores for item in before.tested]
        assert [item.scores for item in after.tested] == each[1:]
        assert set(each[0]) == {"raw", "filtered"}
        assert all(each[0][stage] != each[1][stage] for stage in each[0])
        assert after.removed == 1
        assert after.remarks[-1].startswith(f"1 of the {len(before.tested)} demonstrations")
        edits_since(project, after)
        write_archive(project, tmp_path / "study.zip")
        left = {used for used in before.labels if used.demonstration != gone}
    with read_archive(tmp_path / "study.zip", tmp_path / "again.forcelab") as again:
        [*_, run] = [run for run in again.runs.all() if run.id == before.number]
        assert {used.demonstration for used in run.labels} == {u.demonstration for u in left}
