"""A stored text that is damaged is told in one sentence: whose it is, and what helps."""

from __future__ import annotations

import sqlite3
from contextlib import closing

import pytest

from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import LabelsUsed, Provenance, Verdict

MADE = {"settings": {"preset": "paper"}, "seed": 7, "versions": {"forcelab": "1"}}
GRAB = (Segment(0.0, 0.1, "grab"),)


@pytest.fixture
def full(project, make):
    """A project with one of everything; gives its demonstration's id."""
    id_ = project.demonstrations.add(make(1), [Track("anna", GRAB)]).id
    used = [LabelsUsed(id_, "anna", project.tracks.head(id_, "anna"))]
    project.runs.add("evaluate", Provenance(labels=used, **MADE), result={"digest": {"f1": 1}})
    project.runs.add_recogniser("one", b"learnt", Provenance(labels=used, **MADE))
    project.tracks.edit(id_, "anna", GRAB, (), "erased", proposed_by="model paper 1")
    project.coding.assign(id_, "anna")
    project.coding.set_note(id_, "anna", "look")
    project.coding.add_verdict(
        Verdict(id_, 0.0, 0.1, "grab", None, author="anna", coder="anna", verdict="human")
    )
    return id_


def spoil(path, table, column, value):
    """Put bytes in the place of a stored text, as a disk would that lost some."""
    with closing(sqlite3.connect(path / "project.sqlite")) as store, store:
        triggers = store.execute("SELECT name FROM sqlite_schema WHERE type = 'trigger'")
        for (name,) in triggers.fetchall():
            store.execute(f"DROP TRIGGER {name}")
        store.execute("PRAGMA ignore_check_constraints = ON")
        store.execute(f"UPDATE {table} SET {column} = CAST(? AS TEXT)", [value])


READ = {
    "run": (lambda p, _: p.runs.get(1), "{}"),
    "recogniser": (
        lambda p, _: p.runs.recognisers(),
        "The recogniser 'one' is .*; remove it with 'forcelab remove --recogniser ",
    ),
    "edit": (lambda p, id_: p.tracks.history(id_, "anna"), r"Edit \d+ is damaged"),
    "vocabulary": (lambda p, _: p.actions.vocabularies(), "The list of actions of LEGO is damaged"),
    "demonstration": (
        lambda p, _: p.demonstrations.infos(),
        "The list of channels of '01' is damaged",
    ),
    "note": (lambda p, _: p.coding.notes(), "A note of anna is damaged"),
    "assignment": (lambda p, _: p.coding.assignments(), "An assignment of anna is damaged"),
    "verdict": (lambda p, _: p.coding.verdicts(), r"Verdict \d+ is damaged"),
}
CASES = [
    *(("run", column, "[") for column in ("settings", "labels", "versions", "time")),
    ("run", "labels", "[7]"),
    *(("recogniser", column, "{") for column in ("settings", "labels", "versions", "time")),
    *(("edit", column, "[[0, 1]]") for column in ("removed", "inserted")),
    ("edit", "inserted", '[[0.2, 0.1, "grab"]]'),
    ("vocabulary", "actions", "[1]"),
    ("vocabulary", "actions", "["),
    ("demonstration", "channels", '[["fx"]]'),
    *((table, "time", "soon") for table in ("edit", "note", "assignment", "verdict")),
]


@pytest.mark.parametrize(("table", "column", "value"), CASES)
def test_what_cannot_be_parsed_is_told_with_what_it_belongs_to(
    project, path, full, table, column, value
):
    spoil(path, table, column, value)
    read, owner = READ[table]
    owner = (
        "Run 1 is damaged .*; remove it with 'forcelab remove --run 1'" if table == "run" else owner
    )
    with pytest.raises(InputError, match=f"^{owner}.* restore project.sqlite from a copy.$"):
        read(project, full)


@pytest.mark.parametrize("table", READ)
def test_bytes_that_are_no_text_are_told_without_quoting_them(project, path, full, table):
    column = {"vocabulary": "actions", "demonstration": "channels"}.get(table, "time")
    spoil(path, table, column, b"[" + b"\xff" * 1000 + b"]")
    read, _ = READ[table]
    with pytest.raises(InputError) as caught:
        read(project, full)
    assert f"is damaged (a text in column '{column}' is none); restore" in str(caught.value)
    assert len(str(caught.value)) < 300


def test_a_run_that_is_no_text_is_listed_told_and_can_be_removed(project, path, full):
    spoil(path, "run", "result", b'{"\xff"' + b"\xff" * 1000 + b"}")
    assert [(run.id, run.digest) for run in project.runs.summaries()] == [(1, {})]
    for read in (lambda: project.runs.get(1), project.runs.all):
        with pytest.raises(InputError, match="What run 1 found is damaged .*; repeat it, or"):
            read()
    assert [use.run for use in project.runs.uses()] == [1]
    project.runs.remove(1)
    assert project.runs.summaries() == ()


def test_where_labels_come_from_is_not_told_past_a_damaged_edit(project, path, full):
    spoil(path, "edit", "inserted", "[")
    for _ in range(2):  # nor when it is asked once more
        with pytest.raises(InputError, match=r"Edit \d+ is damaged"):
            project.tracks.origins(full, "anna")
