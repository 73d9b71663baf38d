from __future__ import annotations

import sqlite3
from contextlib import closing
from dataclasses import replace
from datetime import datetime, timedelta, timezone

import numpy as np
import pytest
from factories import folder_in_memory
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError, StaleTrackError
from forcelab.labels import Segment, Track, means_unlabelled
from forcelab.project import Project
from forcelab.project.database import Database
from forcelab.segment_edits import erase, paint

GRAB = (Segment(0.0, 0.1, "grab"),)
HOLD = (Segment(0.0, 0.1, "grab"), Segment(0.2, 0.3, "hold"))


def test_an_edit_tells_who_when_and_what_was_there(project, id_):
    project.tracks.edit(id_, "anna", (), HOLD, "hold painted")
    after = (HOLD[0], Segment(0.2, 0.3, "slip"))
    edit = project.tracks.edit(id_, "anna", HOLD, after, "hold is slip")
    assert (edit.demonstration, edit.author, edit.kind) == (id_, "anna", "paint")
    assert (edit.position, edit.removed, edit.inserted) == (1, HOLD[1:], after[1:])
    assert edit.what == "hold is slip"
    assert timedelta() <= datetime.now(timezone.utc) - edit.time < timedelta(minutes=1)
    assert project.tracks.history(id_, "anna")[1] == edit
    assert project.tracks.get(id_, "anna").segments == after


def test_a_track_changed_elsewhere_is_not_overwritten(project, id_, path):
    with Project.open(path) as other:
        before = project.tracks.get(id_, "anna").segments
        other.tracks.edit(id_, "anna", before, GRAB, "first")
        with pytest.raises(StaleTrackError, match="changed elsewhere"):
            project.tracks.edit(id_, "anna", before, HOLD, "second")
        assert project.tracks.get(id_, "anna").segments == GRAB
        assert len(project.tracks.history(id_, "anna")) == 1
        other.tracks.undo(id_, "anna")
        other.tracks.edit(id_, "anna", (), GRAB, "third")
        project.tracks.edit(id_, "anna", GRAB, HOLD, "the same segments are not stale")


@pytest.mark.parametrize("kind", ["paint", "predict", "import"])
@pytest.mark.parametrize("start", [0.0, 30.0])
def test_labels_beyond_the_recording_are_refused_and_nothing_is_written(project, kind, start):
    times = start + np.arange(1000) / 100
    late = Demonstration("late", "LEGO", times, np.zeros((1000, 1)), (Channel("f", "N"),))
    id_ = project.demonstrations.add(late).id
    author = "mlp" if kind == "predict" else "anna"
    for bounds in ((-1.01, 1.0), (1.0, 11.01), (1e5, 1e5 + 1)):
        far = (Segment(*(start + bound for bound in bounds), "grab"),)
        with pytest.raises(InputError, match=f"beyond its recording.*'{author}' on 'late'; shift"):
            project.tracks.edit(id_, author, (), far, "far", kind=kind)
        assert project.tracks.history(id_, author) == ()
    whole = (Segment(late.start, late.end, "grab"),)
    project.tracks.edit(id_, author, (), whole, "to the end", kind=kind)
    slack = (Segment(late.start - 0.9, late.end + 0.9, "grab"),)
    project.tracks.edit(id_, author, whole, slack, "allowed", kind=kind)


def test_labels_that_lie_beyond_the_recording_already_can_be_edited(project, id_, path):
    project.tracks.edit(id_, "anna", (), HOLD, "painted")
    with closing(sqlite3.connect(path / "project.sqlite")) as store, store:  # an older program's
        store.execute("UPDATE segment SET end = 50.0 WHERE start = 0.2")
    with Project.open(path) as again:
        before = again.tracks.get(id_, "anna").segments
        halves = (before[0], Segment(0.2, 40.0, "hold"), Segment(40.0, 50.0, "hold"))
        again.tracks.edit(id_, "anna", before, halves, "split")
        again.tracks.edit(id_, "anna", halves, halves[:2], "deleted")
        with pytest.raises(InputError, match="beyond its recording"):
            again.tracks.edit(id_, "anna", halves[:2], halves, "painted again")


def test_an_edit_in_place_of_the_latest_is_one_undo_and_nothing_is_lost(project, id_, path):
    project.tracks.edit(id_, "anna", (), GRAB, "first")
    moved = project.tracks.edit(id_, "anna", GRAB, HOLD, "moved")
    after = (Segment(0.0, 0.2, "grab"),)
    again = project.tracks.edit(id_, "anna", HOLD, after, "moved farther", replacing=moved.id)
    assert (again.removed, again.inserted) == (GRAB, after)
    kinds = [edit.kind for edit in project.tracks.history(id_, "anna")]
    assert kinds == ["paint", "paint", "undo", "paint"]
    with pytest.raises(StaleTrackError):
        project.tracks.edit(id_, "anna", after, HOLD, "not the latest", replacing=moved.id)
    back = project.tracks.edit(id_, "anna", after, GRAB, "moved back", replacing=again.id)
    assert back.kind == "undo"
    project.tracks.redo(id_, "anna")
    assert project.tracks.get(id_, "anna").segments == after
    project.tracks.undo(id_, "anna")
    assert project.tracks.get(id_, "anna").segments == GRAB
    with Project.open(path) as other:
        assert other.tracks.get(id_, "anna").segments == GRAB


@pytest.mark.parametrize(
    "after",
    [
        (Segment(0.2, 0.3, "hold"), Segment(0.0, 0.1, "grab")),
        (Segment(0.0, 0.3, "hold"), Segment(0.2, 0.4, "grab")),
    ],
)
def test_segments_out_of_order_or_overlapping_are_refused(project, id_, after):
    with pytest.raises(InputError):
        project.tracks.edit(id_, "anna", (), after, "wrong")
    assert project.tracks.history(id_, "anna") == ()
    assert project.coding.authors() == ()


def test_an_edit_may_not_overlap_what_lies_beside_it(project, id_):
    project.tracks.edit(id_, "anna", (), HOLD, "fine")
    wrong = (HOLD[0], Segment(0.05, 0.06, "x"), HOLD[1])
    with pytest.raises(InputError, match="overlap"):
        project.tracks.edit(id_, "anna", HOLD, wrong, "wrong")
    assert project.tracks.get(id_, "anna").segments == HOLD


def test_a_coder_and_a_model_are_never_one_author(project, id_):
    project.tracks.edit(id_, "anna", (), GRAB, "painted")
    project.tracks.edit(id_, "mlp", (), GRAB, "predicted", kind="predict")
    project.tracks.edit(id_, "berta", (), GRAB, "painted")
    kinds = [("anna", "coder"), ("mlp", "model"), ("berta", "coder")]
    assert [(a.name, a.kind) for a in project.coding.authors()] == kinds
    assert project.coding.coders() == ("anna", "berta")
    with pytest.raises(InputError, match="'anna' is a coder"):
        project.tracks.edit(id_, "anna", GRAB, HOLD, "predicted", kind="predict")
    with pytest.raises(InputError, match="'mlp' is a model"):
        project.tracks.edit(id_, "mlp", GRAB, HOLD, "painted")
    assert [t.segments for t in project.tracks.of(id_)] == [GRAB, GRAB, GRAB]
    assert project.tracks.undo(id_, "mlp").inserted == ()


def test_edits_of_what_is_not_there_are_refused(project, id_):
    with pytest.raises(InputError, match="no demonstration 'x'"):
        project.tracks.edit("x", "anna", (), GRAB, "painted")
    with pytest.raises(InputError, match="needs an author"):
        project.tracks.edit(id_, " ", (), GRAB, "painted")
    assert project.tracks.undo(id_, "nobody") is None
    assert project.tracks.redo(id_, "nobody") is None
    assert project.tracks.history(id_, "nobody") == ()
    assert project.coding.authors() == ()


def test_undo_and_redo_are_edits_that_name_what_they_take_back(project, id_):
    first = project.tracks.edit(id_, "anna", (), GRAB, "grab painted")
    undo = project.tracks.undo(id_, "anna")
    redo = project.tracks.redo(id_, "anna")
    assert (first, undo, redo) == project.tracks.history(id_, "anna")
    assert [edit.kind for edit in (first, undo, redo)] == ["paint", "undo", "redo"]
    assert (undo.reverts, redo.reverts) == (first.id, undo.id)
    assert (undo.what, redo.what) == ("undo: grab painted", "redo: grab painted")
    assert (undo.removed, undo.inserted) == (GRAB, ())


def test_the_number_of_the_latest_edit_changes_with_everything_that_changes_the_track(project, id_):
    assert project.tracks.head(id_, "anna") == 0
    heads = [project.tracks.edit(id_, "anna", (), GRAB, "grab painted").id]
    heads.append(project.tracks.undo(id_, "anna").id)
    assert project.tracks.head(id_, "anna") == heads[-1]
    heads.append(project.tracks.redo(id_, "anna").id)
    project.tracks.edit(id_, "bert", (), HOLD, "another track")
    assert project.tracks.head(id_, "anna") == heads[-1]
    assert len(set(heads)) == 3


def test_changing_a_project_inside_a_snapshot_is_a_mistake_of_the_program(project, id_):
    with project.snapshot(), pytest.raises(RuntimeError, match="inside a snapshot"):
        project.tracks.edit(id_, "anna", (), GRAB, "grab painted")
    assert project.tracks.get(id_, "anna").segments == ()
    project.tracks.edit(id_, "anna", (), GRAB, "grab painted")


def test_a_track_is_found_by_the_id_of_its_demonstration_alone(project, id_):
    for key, sentence in (("01", "is the name of a demonstration"), (id_[:12], "no demonstration")):
        assert project.demonstrations.load(key).id == id_
        with pytest.raises(InputError, match=sentence):
            project.tracks.get(key, "anna")


@pytest.mark.parametrize(
    "change",
    [{"reverts": 1}, {"position": 0}, {"inserted": GRAB}, {"kind": "redo"}, {"reverts": None}],
)
def test_an_undo_is_made_again_only_where_it_takes_back_what_stands(project, id_, make, change):
    project.tracks.edit(id_, "anna", (), GRAB, "grab painted")
    project.tracks.edit(id_, "anna", GRAB, HOLD, "hold painted")
    project.tracks.undo(id_, "anna")
    other = project.demonstrations.add(make(2)).id
    *edits, undo = (replace(e, demonstration=other) for e in project.tracks.history(id_, "anna"))
    with pytest.raises(InputError, match="of 'anna' takes back what was not there"):
        project.tracks.replay([*edits, replace(undo, **change)])
    assert project.tracks.history(other, "anna") == ()
    project.tracks.replay([*edits, undo])
    assert project.tracks.get(other, "anna").segments == GRAB


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("paint"), st.integers(0, 30), st.integers(1, 12), st.sampled_from("abc")),
        st.tuples(st.just("erase"), st.integers(0, 30), st.integers(1, 12)),
        st.sampled_from([("undo",), ("undo",), ("redo",), ("reopen",), ("other window",)]),
    ),
    max_size=40,
)


@given(STEPS)
@settings(max_examples=25, deadline=None)
def test_undo_and_redo_behave_like_two_stacks_whatever_happens(steps):
    # The reference keeps whole tracks in two lists, and every state there ever was in a third.
    undone: list = []
    states: list = [()]
    stored = []
    with folder_in_memory() as folder:
        path = folder / "p.forcelab"
        project = Project.create(path)
        id_ = _add_one(project)
        for step in steps:
            track = project.tracks.get(id_, "anna").segments
            assert track == states[-1]
            if step[0] in ("paint", "erase"):
                start, end = step[1] / 7, (step[1] + step[2]) / 7
                verb = paint if step[0] == "paint" else erase
                after = verb(track, start, end, *step[3:])
                project.tracks.edit(id_, "anna", track, after, step[0])
                states.append(after)
                undone.clear()
                stored.append(after)
            elif step[0] == "undo":
                assert (project.tracks.undo(id_, "anna") is None) == (len(states) == 1)
                if len(states) > 1:
                    undone.append(states.pop())
                    stored.append(states[-1])
            elif step[0] == "redo":
                assert (project.tracks.redo(id_, "anna") is None) == (not undone)
                if undone:
                    states.append(undone.pop())
                    stored.append(states[-1])
            elif step[0] == "reopen":
                project.close()
                project = Project.open(path)
            else:
                with Project.open(path) as other:
                    edit = other.tracks.edit(id_, "anna", track, (), "cleared")
                    assert edit.inserted == ()
                states.append(())
                undone.clear()
                stored.append(())
        # The history alone gives every state that there ever was.
        replayed: tuple = ()
        history = project.tracks.history(id_, "anna")
        assert len(history) == len(stored)
        for edit, state in zip(history, stored, strict=True):
            end = edit.position + len(edit.removed)
            assert replayed[edit.position : end] == edit.removed
            replayed = replayed[: edit.position] + edit.inserted + replayed[end:]
            assert replayed == state
        project.close()


def _add_one(project: Project) -> str:
    """Add a recording from -1e9 to 1e9 s."""
    return project.demonstrations.add(
        Demonstration("01", "", [-1e9, 0], [[1], [2]], (Channel("fx"),))
    ).id


@given(
    st.lists(st.floats(-1e9, 1e9, allow_nan=False), min_size=2, max_size=2, unique=True),
    st.text(st.characters(exclude_categories=["Cs"]), min_size=1).filter(
        lambda name: not means_unlabelled(name)
    ),
)
@settings(max_examples=15, deadline=None)
def test_times_and_names_come_back_exactly(times, action):
    segments = (Segment(min(times), max(times), action),)
    with folder_in_memory() as folder:
        path = folder / "p.forcelab"
        with Project.create(path) as project:
            id_ = _add_one(project)
            project.tracks.edit(id_, "anna", (), segments, action)
        with Project.open(path) as project:
            assert project.tracks.get(id_, "anna").segments == segments
            (edit,) = project.tracks.history(id_, "anna")
            assert (edit.inserted, edit.what) == (segments, action)


def test_an_edit_of_a_long_track_writes_a_few_pages(project, path):
    id_ = _add_one(project)
    long = tuple(Segment(i / 10, i / 10 + 0.05, "grab" if i % 2 else "hold") for i in range(10_000))
    project.tracks.edit(id_, "anna", (), long, "many")
    project.close()
    with Project.open(path) as again:
        after = paint(long, 500.02, 500.11, "slip")
        again.tracks.edit(id_, "anna", long, after, "slip painted")
        assert (path / "project.sqlite-wal").stat().st_size < 100_000
        again.tracks.undo(id_, "anna")
        assert again.tracks.get(id_, "anna").segments == long
        assert (path / "project.sqlite-wal").stat().st_size < 200_000


def test_an_edit_that_came_to_nothing_is_not_remembered(project, id_, path, monkeypatch):
    project.tracks.edit(id_, "anna", (), GRAB, "painted")
    with monkeypatch.context() as broken:
        broken.setattr(Database, "execute", _failing_to_commit(Database.execute))
        with pytest.raises(InputError, match="disk"):
            project.tracks.edit(id_, "anna", GRAB, HOLD, "hold painted")
    with Project.open(path) as other:  # gets the number that was given out before
        other.tracks.edit(id_, "anna", GRAB, (), "erased")
    assert project.tracks.get(id_, "anna").segments == ()


def _failing_to_commit(execute):
    def fails(self, sql, *values):
        if sql == "COMMIT":
            raise InputError("The disk is full.")
        return execute(self, sql, *values)

    return fails


def test_a_history_made_again_is_the_same(project, id_, path, make):
    project.tracks.edit(id_, "anna", (), GRAB, "a")
    project.tracks.edit(id_, "mlp", (), HOLD, "b", kind="predict")
    project.tracks.edit(id_, "anna", GRAB, HOLD, "c")
    project.tracks.undo(id_, "anna")
    project.tracks.redo(id_, "anna")
    project.tracks.undo(id_, "mlp")
    edits = project.tracks.history(id_, "anna") + project.tracks.history(id_, "mlp")
    edits = tuple(sorted(edits, key=lambda edit: edit.id))
    with Project.create(path.with_name("again")) as again:
        again.demonstrations.add(make(1))
        again.tracks.replay(edits)
        assert again.tracks.history(id_, "anna") + again.tracks.history(id_, "mlp") == (
            project.tracks.history(id_, "anna") + project.tracks.history(id_, "mlp")
        )
        assert again.tracks.of(id_) == project.tracks.of(id_)
        assert again.coding.authors() == project.coding.authors()
        assert again.tracks.redo(id_, "anna") is None
        assert again.tracks.undo(id_, "anna").reverts == edits[2].id


def test_a_history_that_does_not_fit_is_refused_as_a_whole(project, id_, path, make):
    project.tracks.edit(id_, "anna", (), GRAB, "a")
    project.tracks.edit(id_, "anna", GRAB, HOLD, "b")
    project.tracks.undo(id_, "anna")
    edits = project.tracks.history(id_, "anna")
    with Project.create(path.with_name("again")) as again:
        with pytest.raises(InputError, match="no demonstration"):
            again.tracks.replay(edits)
        again.demonstrations.add(make(1))
        for wrong in (edits[1:], (edits[0], edits[2]), (*edits, edits[2])):
            with pytest.raises((InputError, StaleTrackError)):
                again.tracks.replay(wrong)
            assert again.tracks.of(id_) == ()


def test_nobody_paints_under_a_models_name(project, id_):
    with pytest.raises(InputError, match="model's name"):
        project.tracks.edit(id_, "model foam", (), GRAB, "painted")
    assert project.coding.authors() == ()


def test_a_models_track_from_a_file_is_a_models_track_and_is_renewed(project, make):
    id_ = project.demonstrations.add(make(1), [Track("model foam", GRAB)]).id
    (author,) = project.coding.authors()
    assert (author.name, author.kind) == ("model foam", "model")
    project.demonstrations.add(make(1), [Track("model foam", HOLD)])
    assert project.tracks.get(id_, "model foam").segments == HOLD
