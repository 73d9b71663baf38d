"""Notes of coders on demonstrations: who wrote what when, and what it was before."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

import pytest

from forcelab.errors import InputError
from forcelab.labels import Segment
from forcelab.project import NewDemonstration, Note, Project, coding

GRAB = (Segment(0.0, 0.1, "grab"),)
THEN = datetime(2024, 5, 6, tzinfo=timezone.utc)


def texts_of(written: tuple[Note, ...]) -> list[tuple[str, str]]:
    return [(note.author, note.text) for note in written]


def test_the_latest_note_of_a_coder_counts_and_every_one_is_kept(project, id_, path):
    before = datetime.now(timezone.utc)
    project.coding.set_note(id_, "anna", "sensor slipped at 3.2 s")
    project.coding.set_note(id_, "bert", "leave out")
    project.coding.set_note(id_, "anna", "  sensor slipped\nat 3.4 s ")
    with Project.open(path) as again:
        assert texts_of(again.coding.notes()) == [
            ("bert", "leave out"),
            ("anna", "sensor slipped\nat 3.4 s"),
        ]
        times = [note.time for note in again.coding.note_events()]
    assert before <= times[0] < times[1] < times[2] <= datetime.now(timezone.utc)
    project.coding.set_note(id_, "anna", "")
    assert texts_of(project.coding.notes()) == [("bert", "leave out")]
    annas = [n.text for n in project.coding.note_events(id_) if n.author == "anna"]
    assert annas == ["sensor slipped at 3.2 s", "sensor slipped\nat 3.4 s", ""]


def test_what_changes_nothing_is_not_written_down(project, id_):
    project.coding.set_note(id_, "anna", " ")
    assert project.coding.note_events() == ()
    for text in ("leave out", " leave  out "):
        project.coding.set_note(id_, "anna", text)
    assert texts_of(project.coding.note_events()) == [("anna", "leave out")]


def test_a_clock_that_is_set_back_lets_no_older_note_count(project, id_, monkeypatch):
    for hours, text in ((2, "first"), (1, "second"), (0, "first")):
        monkeypatch.setattr(coding, "utc_now", lambda hours=hours: THEN + timedelta(hours=hours))
        project.coding.set_note(id_, "anna", text)
        assert texts_of(project.coding.notes()) == [("anna", text)]
    assert len(project.coding.note_events()) == 3


def test_who_codes_blind_sees_no_note_of_others_until_that_is_done(project, make):
    hidden, plain = (project.demonstrations.add(make(seed, name=str(seed))).id for seed in (1, 2))
    for id_ in (hidden, plain):
        project.coding.set_note(id_, "bert", "leave out")
    project.coding.set_note(hidden, "anna", "mine")
    project.coding.assign(hidden, "anna")
    project.coding.assign(plain, "anna", blind=False)
    assert texts_of(project.coding.notes("anna")) == [("bert", "leave out"), ("anna", "mine")]
    assert [note.demonstration for note in project.coding.notes("anna")] == [plain, hidden]
    assert len(project.coding.notes()) == len(project.coding.notes("bert")) == 3
    project.coding.set_done(hidden, "anna")
    assert project.coding.notes("anna") == project.coding.notes()


def test_only_coders_write_notes_and_only_on_what_is_there(project, make):
    id_ = project.demonstrations.add(make(1, name="01")).id
    project.tracks.edit(id_, "mlp", (), GRAB, "predicted", kind="predict")
    for author in ("mlp", "model x"):
        with pytest.raises(InputError, match=f"'{author}' is a model; only coders write notes"):
            project.coding.set_note(id_, author, "x")
    with pytest.raises(InputError, match="needs an author"):
        project.coding.set_note(id_, " ", "x")
    with pytest.raises(InputError, match="'01' is the name of a demonstration"):
        project.coding.set_note("01", "anna", "x")
    with pytest.raises(InputError, match="not valid Unicode"):
        project.coding.set_note(id_, "anna", "\ud800")
    assert project.coding.note_events() == ()


def test_two_projects_that_take_each_others_notes_come_to_have_the_same(tmp_path, make):
    new = make(1)
    with Project.create(tmp_path / "a") as a, Project.create(tmp_path / "b") as b:
        id_ = a.demonstrations.add(new).id
        b.demonstrations.add(new)
        a.coding.set_note(id_, "anna", "old")
        a.coding.set_note(id_, "bert", "of a")
        b.coding.set_note(id_, "anna", "new")
        b.coding.set_note(id_, "bert", "of b")
        b.coding.set_note(id_, "bert", "")
        statuses = [
            into.demonstrations.add_all([NewDemonstration(new, notes=of.coding.note_events())])[
                0
            ].status
            for into, of in ((a, b), (b, a), (a, b))
        ]
        assert statuses == ["updated", "updated", "unchanged"]
        assert a.coding.note_events() == b.coding.note_events()
        assert texts_of(a.coding.notes()) == [("anna", "new")]
        with pytest.raises(InputError, match="needs an author"):
            a.demonstrations.add_all([NewDemonstration(new, notes=(Note(id_, " ", "x", THEN),))])
