"""A recording that is discarded is gone as a whole, and never if somebody has worked with it."""

from __future__ import annotations

import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing

import pytest

from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import Project, Provenance
from forcelab.project.runs import LabelsUsed

GRAB = (Segment(0.0, 0.1, "grab"),)


@pytest.fixture
def added(project, make):
    """A recording with live marks beside another demonstration, and the heads it came with."""
    project.demonstrations.add(make(1, name="LEGO 01"), [Track("anna", GRAB)])
    id_ = project.demonstrations.add(make(2, name="LEGO 02"), [Track("bea", GRAB)]).id
    project.media.attach_stamps(id_, {})
    return id_, {"bea": project.tracks.head(id_, "bea")}


def everything(path):
    """All rows of all tables and all files of a project."""
    with closing(sqlite3.connect(path / "project.sqlite")) as store:
        assert store.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert store.execute("PRAGMA foreign_key_check").fetchall() == []
        schema = store.execute("SELECT name, sql FROM sqlite_schema ORDER BY name").fetchall()
        tables = [name for name, sql in schema if sql and sql.lstrip().startswith("CREATE TABLE")]
        rows = {t: store.execute(f"SELECT * FROM {t}").fetchall() for t in sorted(tables)}
    rows.pop("sqlite_sequence", None)
    files = sorted(str(p.relative_to(path)) for p in (path / "demonstrations").rglob("*"))
    return schema, rows, files


def test_it_is_gone_with_all_that_came_with_it_and_nothing_else_is(project, path, make, added):
    before = tuple(info.id for info in project.demonstrations.infos())
    project.demonstrations.discard(*added)
    [left] = project.demonstrations.infos()
    assert before == (left.id, added[0])
    assert [author.name for author in project.coding.authors()] == ["anna"]
    assert project.tracks.get(left.id, "anna").segments == GRAB
    assert [entry.name for entry in (path / "demonstrations").iterdir()] == [left.id]
    fresh = path.with_name("fresh.forcelab")
    with Project.create(fresh) as other:
        other.demonstrations.add(make(1, name="LEGO 01"), [Track("anna", GRAB)])
    schema, rows, files = everything(path)
    assert schema == everything(fresh)[0]
    assert files == everything(fresh)[2]
    assert {table: len(found) for table, found in rows.items()} == {
        table: len(found) for table, found in everything(fresh)[1].items()
    }
    with pytest.raises(InputError, match="no demonstration"):
        project.demonstrations.discard(*added)
    assert project.demonstrations.add(make(2, name="LEGO 02"), [Track("bea", GRAB)]).status == "new"


def delete_segment(project, id_):
    project.tracks.edit(id_, "bea", GRAB, (), "grab deleted")


def paint_as_another(project, id_):
    project.tracks.edit(id_, "cara", (), GRAB, "grab painted")


def painted_and_taken_back(project, id_):
    delete_segment(project, id_)
    project.tracks.undo(id_, "bea")


def use_in_run(project, id_):
    labels = (LabelsUsed(id_, "bea", project.tracks.head(id_, "bea")),)
    project.runs.add(
        "evaluation", Provenance(settings={}, seed=None, labels=labels, versions={}), result={}
    )


@pytest.mark.parametrize(
    "work",
    [
        delete_segment,
        paint_as_another,
        painted_and_taken_back,
        use_in_run,
        lambda project, id_: project.coding.assign(id_, "dora"),
        lambda project, id_: (
            project.coding.assign(id_, "dora"),
            project.coding.unassign(id_, "dora"),
        ),
        lambda project, id_: project.coding.set_note(id_, "dora", "the grip slipped"),
    ],
)
def test_what_somebody_has_worked_with_stays(project, path, added, work):
    work(project, added[0])
    before = everything(path)
    with pytest.raises(InputError, match=r"'LEGO 02' was .* since it was recorded; it stays"):
        project.demonstrations.discard(*added)
    assert everything(path) == before


def test_what_a_model_predicted_since_is_no_reason_to_keep_it(project, added):
    project.tracks.edit(added[0], "model: live", (), GRAB, "predicted", kind="predict")
    project.demonstrations.discard(*added)
    assert [author.name for author in project.coding.authors()] == ["anna"]


def test_a_second_window_sees_that_it_is_gone(project, path, added):
    with Project.open(path) as other:
        assert other.tracks.get(added[0], "bea").segments == GRAB
        project.demonstrations.discard(*added)
        assert other.changed_elsewhere()
        with pytest.raises(InputError, match="no demonstration"):
            other.tracks.get(added[0], "bea")
        # Numbers of tracks are used again: what was remembered of the old one must not show.
        first = other.demonstrations.infos()[0].id
        other.tracks.edit(first, "dora", (), GRAB, "painted")
        assert other.tracks.get(first, "dora").segments == GRAB


def worked_with(project, id_):
    """Everything that people and runs can do with a demonstration."""
    painted_and_taken_back(project, id_)
    paint_as_another(project, id_)
    project.tracks.edit(id_, "model: net", (), GRAB, "predicted", kind="predict")
    use_in_run(project, id_)
    project.coding.assign(id_, "dora")
    project.coding.set_done(id_, "dora")
    project.coding.set_note(id_, "dora", "leave out")
    return {name: project.tracks.head(id_, name) for name in ("bea", "cara")}


def test_what_was_imported_by_mistake_goes_with_all_its_labels(project, path, added):
    id_, _ = added
    left = next(info.id for info in project.demonstrations.infos() if info.id != id_)
    project.coding.assign(left, "dora")
    project.coding.set_note(left, "dora", "stays")
    heads = worked_with(project, id_)
    schema = everything(path)[0]
    project.demonstrations.remove_all({id_: heads})
    assert [info.id for info in project.demonstrations.infos()] == [left]
    assert [author.name for author in project.coding.authors()] == ["anna"]
    assert [assignment.demonstration for assignment in project.coding.assignments()] == [left]
    assert [note.text for note in project.coding.note_events()] == ["stays"]
    assert [entry.name for entry in (path / "demonstrations").iterdir()] == [left]
    assert everything(path)[0] == schema
    [run] = project.runs.all()
    assert project.runs.get(run.id).labels[0].demonstration == id_
    with closing(sqlite3.connect(path / "project.sqlite")) as store:
        for table in ("edit", "assignment", "note"):
            with pytest.raises(sqlite3.IntegrityError, match="kept for ever"):
                store.execute(f"DELETE FROM {table}")


def test_labels_that_nobody_was_told_of_keep_it(project, path, added):
    id_, _ = added
    heads = worked_with(project, id_)
    delete_segment(project, id_)
    before = everything(path)
    for known_heads in (heads, {}, {"cara": heads["cara"]}):
        with pytest.raises(InputError, match="'LEGO 02' was labelled meanwhile; it stays"):
            project.demonstrations.remove_all({id_: known_heads})
    assert everything(path) == before
    with pytest.raises(InputError, match="no demonstration"):
        project.demonstrations.remove_all({"0" * 64: {}})


KILLED = """
import os, signal, sys
from pathlib import Path
from forcelab.project import Project, demonstrations, files
from forcelab.project.database import Database

folder, verb, id_, author, head = sys.argv[1:]

def counted(call):
    def step(*given, **named):
        global left
        left -= 1
        if left == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        return call(*given, **named)
    return step

def discard(path, number):
    global left
    project = Project.open(path)
    left = number
    Database.execute = counted(Database.execute)
    demonstrations.sync_folder = counted(demonstrations.sync_folder)
    os.unlink, os.rmdir = counted(os.unlink), counted(os.rmdir)  # of shutil.rmtree
    Path.rename = counted(Path.rename)
    heads = {author: int(head)}
    if verb == "discard":
        project.demonstrations.discard(id_, heads)
    else:
        project.demonstrations.remove_all({id_: heads})
    os._exit(0)

for number in range(1, 99):
    path = Path(folder) / f"{number}.forcelab"
    import shutil
    shutil.copytree(Path(folder) / "study.forcelab", path)
    child = os.fork()
    if not child:
        discard(path, number)
    if os.waitpid(child, 0)[1] == 0:
        break
print(number)
"""


@pytest.mark.skipif(not hasattr(sys, "setdlopenflags"), reason="needs fork of POSIX")
@pytest.mark.parametrize("verb", ["discard", "remove"])
def test_killed_at_any_step_it_is_there_as_a_whole_or_gone(project, path, added, verb):
    id_, heads = added
    [(author, head)] = heads.items()
    whole = everything(path)
    project.close()
    arguments = [sys.executable, "-c", KILLED, str(path.parent), verb, id_, author, str(head)]
    done = subprocess.run(arguments, capture_output=True, text=True, check=True)
    steps = int(done.stdout)
    assert steps > 12
    outcomes = []
    for number in range(1, steps + 1):
        copy = path.with_name(f"{number}.forcelab")
        for leftover in (copy / "demonstrations").glob(".incoming-*"):
            shutil.rmtree(leftover)  # as happens when it is an hour old
        with Project.open(copy) as opened:
            ids = {info.id for info in opened.demonstrations.infos()}
            outcomes.append(id_ in ids)
            assert opened.demonstrations.load(id_).id == id_ if id_ in ids else True
            if id_ in ids:
                assert opened.tracks.get(id_, author).segments == GRAB
                if verb == "discard":  # once more
                    opened.demonstrations.discard(id_, heads)
                else:
                    opened.demonstrations.remove_all({id_: heads})
            assert [e.name for e in (copy / "demonstrations").iterdir()] == [
                info.id for info in opened.demonstrations.infos()
            ]
        assert everything(copy)[0] == whole[0]
    assert outcomes == sorted(outcomes, reverse=True)
    assert outcomes[0]
    assert not outcomes[-1]
