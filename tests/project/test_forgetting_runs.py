"""Runs that another one has taken the place of."""

import sqlite3
from contextlib import closing
from dataclasses import replace

import pytest

from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import LabelsUsed, Project, Provenance, Verdict
from forcelab.project.track_editor import TrackEditor

MADE = {"settings": {}, "seed": None, "versions": {}}
PROPOSER = "model paper 1"


@pytest.fixture
def id_(project, make):
    return project.demonstrations.add(make(1), [Track("anna", (Segment(0.0, 0.1, "grab"),))]).id


@pytest.fixture
def train(project, id_):
    """Keep a run with its recogniser; gives its number and the file."""

    def train(content=b"learnt"):
        used = [LabelsUsed(id_, "anna", project.tracks.head(id_, "anna"))]
        number = project.runs.add_training(
            "evaluate", "one", content, Provenance(labels=used, **MADE), trained_on=used, result={}
        )
        return number, project.runs.recogniser_path(project.runs.get(number).result["recogniser"])

    return train


@pytest.fixture
def verdict(id_):
    return Verdict(id_, 0.0, 0.1, "grab", "slip", author="bert", coder="anna", verdict="model")


def test_a_run_that_nobody_used_goes_with_its_recogniser(project, train):
    number, file = train()
    assert project.runs.forget(number, PROPOSER)
    assert (project.runs.all(), project.runs.recognisers()) == ((), ())
    assert not file.exists()
    assert not project.runs.forget(number, PROPOSER)
    assert train()[0] > number, "numbers are never given twice"


def test_a_recogniser_that_another_run_has_too_stays(project, train):
    first, file = train()
    second, _ = train()
    assert project.runs.forget(first, PROPOSER)
    assert file.exists()
    assert len(project.runs.recognisers()) == 1
    assert project.runs.forget(second, PROPOSER)
    assert not file.exists()


def test_a_run_that_was_judged_stays(project, train, verdict):
    number, file = train()
    project.coding.add_verdict(replace(verdict, run=number))
    project.coding.add_verdict(replace(verdict, run=number, verdict="withdrawn"))
    assert not project.runs.forget(number, PROPOSER)
    assert file.exists()
    assert [verdict.run for verdict in project.coding.verdict_events()] == [number, number]


def test_a_run_that_labels_were_accepted_from_stays_even_when_they_were_undone(project, train, id_):
    number, _ = train()
    labelling = TrackEditor(project, id_, "anna")
    labelling.accept((Segment(0.2, 0.3, "slip"),), PROPOSER)
    labelling.undo()
    assert not project.runs.forget(number, PROPOSER)
    assert project.runs.forget(number, "model paper 11")


def test_what_a_recogniser_that_is_named_with_a_number_proposed_is_no_runs(project, train, id_):
    number, _ = train()
    labelling = TrackEditor(project, id_, "anna")
    labelling.accept((Segment(0.2, 0.3, "slip"),), f"model trial {number}")
    assert project.runs.uses(number)[0].accepted == 0
    labelling.accept((Segment(0.3, 0.4, "slip"),), PROPOSER)
    assert project.runs.uses(number)[0].accepted == 1


def test_a_run_that_cannot_be_read_any_more_can_be_removed(project, path, train):
    number, _ = train()
    with closing(sqlite3.connect(path / "project.sqlite")) as store, store:
        store.execute("UPDATE run SET result = '{' || CAST(x'fffe' AS TEXT) || '}'")
    with pytest.raises(InputError):
        project.runs.get(number)
    project.runs.remove(number)
    assert project.runs.all() == ()
    with pytest.raises(InputError, match=f"There is no run {number} in"):
        project.runs.remove(number)


def test_a_verdict_on_a_run_that_has_gone_meanwhile_is_kept(project, path, train, verdict):
    number, _ = train()
    with Project.open(path) as elsewhere:
        elsewhere.runs.forget(number, PROPOSER)
    stored = project.coding.add_verdict(replace(verdict, run=number))
    assert (stored.run, stored.verdict, stored.predicted) == (None, "model", "slip")
    assert project.coding.verdicts() == (stored,)
    with pytest.raises(InputError, match="no run"):
        project.coding.add_verdict(replace(verdict, run=number + 1))
