from __future__ import annotations

import sqlite3
from contextlib import closing
from dataclasses import replace
from datetime import datetime, timedelta, timezone

import pytest

from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import Project, Provenance, StoredVerdict, Verdict
from forcelab.project.schema import MIGRATIONS

HOLD = (Segment(0.0, 0.1, "grab"), Segment(0.2, 0.3, "hold"))


@pytest.fixture
def id_(project, make):
    return project.demonstrations.add(make(1), [Track("anna", HOLD)]).id


@pytest.fixture
def verdict(id_):
    """Bert says that the model is right about a stretch of Anna's."""
    return Verdict(id_, 0.2, 0.3, "hold", "slip", author="bert", coder="anna", verdict="model")


def test_a_verdict_is_kept_with_its_time(project, verdict, path):
    before = datetime.now(timezone.utc)
    stored = project.coding.add_verdict(verdict)
    assert stored.id == 1
    assert before <= stored.time <= datetime.now(timezone.utc)
    people = {"author": "bert", "coder": "anna", "verdict": "model"}
    place = (verdict.demonstration, 0.2, 0.3, "hold", "slip")
    assert stored == StoredVerdict(*place, **people, time=stored.time, id=1)
    then = datetime(2024, 5, 6, tzinfo=timezone.utc)
    unlabelled = replace(verdict, start=0.1, end=0.2, human=None, predicted=None, time=then)
    assert project.coding.add_verdict(unlabelled).time == then
    with Project.open(path) as again:
        assert again.coding.verdicts() == project.coding.verdicts()
        assert again.coding.verdicts()[0] == stored


def test_the_latest_verdict_on_a_place_counts_whoever_gave_it(project, make, verdict):
    other = project.demonstrations.add(make(2, name="02")).id
    first = project.coding.add_verdict(verdict)
    elsewhere = [
        project.coding.add_verdict(replace(verdict, **change))
        for change in (
            {"demonstration": other},
            {"coder": "cleo"},
            {"start": 0.25},
            {"end": 0.31},
            {"human": None},
            {"predicted": "pull"},
        )
    ]
    assert project.coding.verdicts() == (first, *elsewhere)
    assert project.coding.verdicts(other) == (elsewhere[0],)
    second = project.coding.add_verdict(replace(verdict, author="anna", verdict="ambiguous"))
    assert project.coding.verdicts() == (*elsewhere, second)
    taken_back = project.coding.add_verdict(replace(verdict, verdict="withdrawn"))
    assert project.coding.verdicts() == tuple(elsewhere)
    assert project.coding.verdicts("f" * 32) == ()
    again = project.coding.add_verdict(replace(verdict, verdict="human"))
    assert project.coding.verdicts()[-1] == again
    assert project.coding.verdict_events() == (first, *elsewhere, second, taken_back, again)
    assert project.tracks.get(verdict.demonstration, "anna").segments == HOLD


def test_a_verdict_names_the_run_that_predicted(project, verdict):
    provenance = Provenance(settings={}, seed=None, labels=[], versions={})
    number = project.runs.add("evaluate", provenance, result={})
    assert project.coding.add_verdict(replace(verdict, run=number)).run == number
    for missing in (number + 1, 2**70):
        with pytest.raises(InputError, match=f"There is no run {missing} in"):
            project.coding.add_verdict(replace(verdict, run=missing))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"demonstration": "f00"}, "no demonstration 'f00'"),
        ({"author": " "}, "needs an author"),
        ({"coder": ""}, "needs an author"),
        ({"start": 0.3}, "verdict on '01' must last some time, not go from 0.3 s to 0.3 s"),
        ({"end": float("inf")}, "must last some time"),
        ({"start": float("nan")}, "must last some time"),
        ({"human": ""}, "use None for unlabelled"),
        ({"predicted": ""}, "use None for unlabelled"),
        ({"verdict": "maybe"}, "'maybe' is no verdict; use one of human, model"),
    ],
)
def test_a_verdict_on_what_is_not_there_is_refused(project, verdict, change, sentence):
    with pytest.raises(InputError, match=sentence):
        project.coding.add_verdicts([verdict, replace(verdict, **change)])
    assert project.coding.verdict_events() == ()


@pytest.mark.parametrize("table", ["edit", "assignment", "verdict", "note"])
def test_what_people_did_cannot_be_changed_replaced_or_deleted(project, id_, verdict, path, table):
    project.coding.assign(id_, "anna")
    project.coding.add_verdict(verdict)
    project.coding.set_note(id_, "anna", "leave out")
    project.close()
    with closing(sqlite3.connect(path / "project.sqlite")) as store:
        before = store.execute(f"SELECT * FROM {table}").fetchall()
        assert len(before) == 1
        for wrong in (
            f"DELETE FROM {table}",
            f"UPDATE {table} SET time = 'never'",
            f"INSERT OR REPLACE INTO {table} SELECT * FROM {table}",
        ):
            with pytest.raises(sqlite3.IntegrityError, match="kept for ever"):
                store.execute(wrong)
        assert store.execute(f"SELECT * FROM {table}").fetchall() == before


@pytest.fixture(params=range(1, len(MIGRATIONS)))
def old(request, project, id_, older):
    """A project of an older version in which Anna painted, undid, redid and undid."""
    project.tracks.edit(id_, "anna", HOLD, HOLD[:1], "hold deleted")
    project.tracks.undo(id_, "anna")
    project.tracks.redo(id_, "anna")
    project.tracks.undo(id_, "anna")
    if request.param > 1:
        project.coding.assign(id_, "cleo")
    history = project.tracks.history(id_, "anna")
    return older(request.param), history, request.param


def test_an_older_project_is_brought_up_to_date_with_all_its_edits(old, verdict):
    path, history, version = old
    id_ = verdict.demonstration
    with Project.open(path) as project:
        assert project.tracks.history(id_, "anna") == history
        assert {edit.proposed_by for edit in history} == {None}
        assert project.tracks.get(id_, "anna").segments == HOLD
        assert project.coding.is_blind(id_, "cleo") == (version > 1)
        assert project.coding.verdicts() == project.coding.notes() == ()
        assert project.tracks.origins(id_, "anna") == {}
        assert project.tracks.redo(id_, "anna") is not None
        project.tracks.edit(id_, "anna", HOLD[:1], HOLD, "accepted", proposed_by="model x")
        assert list(project.tracks.origins(id_, "anna")) == [HOLD[1]]
        project.coding.add_verdict(verdict)
        project.coding.assign(id_, "bert")
        project.coding.set_note(id_, "anna", "from before")
    with Project.open(path) as project:
        assert [note.text for note in project.coding.notes()] == ["from before"]
        assert project.coding.is_blind(id_, "bert")
        assert len(project.coding.verdicts()) == 1
        assert project.tracks.history(id_, "anna")[-1].proposed_by == "model x"


def test_an_older_project_that_may_only_be_read_is_read(old, verdict, monkeypatch):
    path, history, _ = old
    before = {file: file.read_bytes() for file in path.rglob("*") if file.is_file()}
    monkeypatch.setattr("forcelab.project.database.os.access", lambda *_: False)
    with Project.open(path) as project:
        assert project.tracks.history(verdict.demonstration, "anna") == history
        assert project.demonstrations.load(verdict.demonstration).id == verdict.demonstration
        assert project.coding.verdicts() == project.coding.verdict_events() == ()
        assert project.coding.notes() == ()
        assert project.tracks.origins(verdict.demonstration, "anna") == {}
        with pytest.raises(InputError, match="may only be read here"):
            project.coding.add_verdict(verdict)
    assert {file: file.read_bytes() for file in path.rglob("*") if file.is_file()} == before


def test_an_older_program_that_has_it_open_goes_on(old, verdict):
    path, history, _ = old
    with closing(sqlite3.connect(path / "project.sqlite", isolation_level=None)) as older:
        assert older.execute("SELECT count(*) FROM segment").fetchone() == (2,)
        with Project.open(path) as project:
            project.coding.add_verdict(verdict)
            older.execute("INSERT INTO author (name, kind) VALUES ('dora', 'coder')")
            assert project.changed_elsewhere()
            assert "dora" in project.coding.coders()
            older.execute(
                "INSERT INTO edit (track, kind, time, what, position, removed, inserted, reverts, "
                "parent) SELECT track, 'paint', time, what, position, '[]', '[]', NULL, NULL "
                "FROM edit LIMIT 1"
            )
            assert len(project.tracks.history(verdict.demonstration, "anna")) == len(history) + 1
            assert verdict.verdict == project.coding.verdicts()[0].verdict


def test_verdicts_are_sorted_by_when_they_were_given_not_by_their_clock(project, verdict):
    now = datetime.now(timezone.utc)
    project.coding.add_verdict(replace(verdict, time=now))
    late = project.coding.add_verdict(
        replace(verdict, verdict="human", time=now - timedelta(days=1))
    )
    assert project.coding.verdicts() == (late,)
