from __future__ import annotations

import os
import re
import shutil
import sqlite3
import struct
from contextlib import closing
from pathlib import Path

import pytest
from factories import cached_project

from forcelab.clock import ClockMap
from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import Project
from forcelab.project.database import store_errors
from forcelab.project.schema import APPLICATION_ID, MIGRATIONS, migrate


def contents(folder: Path) -> dict[str, bytes | None]:
    """Everything in a folder."""
    paths = folder.rglob("*") if folder.is_dir() else [folder]
    return {str(p): p.read_bytes() if p.is_file() else None for p in paths}


def one_sentence(text: str) -> bool:
    return "\n" not in text and text.endswith(".") and not re.search(r"\. [A-Z]", text)


def test_a_created_project_is_empty_and_opens_again(path):
    with Project.create(path) as project:
        assert project.demonstrations.infos() == project.demonstrations.tasks() == ()
        assert project.coding.authors() == ()
    with Project.open(path) as project:
        assert project.path == path
        assert project.runs.all() == ()
    header = (path / "project.sqlite").read_bytes()[:100]
    assert struct.unpack(">I", header[68:72])[0] == APPLICATION_ID
    assert struct.unpack(">I", header[60:64])[0] == len(MIGRATIONS)


def test_a_project_is_made_in_an_empty_folder_but_never_over_anything(path):
    path.mkdir()
    Project.create(path).close()
    before = contents(path)
    with pytest.raises(InputError, match="not empty") as caught:
        Project.create(path)
    assert one_sentence(str(caught.value))
    assert contents(path) == before
    file = path.with_name("file")
    file.write_text("mine")
    with pytest.raises(InputError, match="is a file"):
        Project.create(file)
    with pytest.raises(InputError, match="there is no folder .*make it first"):
        Project.create(path.with_name("missing") / "deeper")
    assert sorted(p.name for p in path.parent.iterdir()) == ["file", "study.forcelab"]


def test_nothing_is_written_into_a_project_that_a_newer_program_brought_up_to_date(path, make):
    with Project.create(path) as project:
        id_ = project.demonstrations.add(make()).id
        with closing(sqlite3.connect(path / "project.sqlite")) as newer:
            newer.execute(f"PRAGMA user_version = {len(MIGRATIONS) + 1}")
        with pytest.raises(InputError, match="newer forcelab"):
            project.tracks.edit(id_, "Ada", (), (Segment(0.0, 0.1, "grab"),), "painted")
        assert project.coding.authors() == ()


@pytest.mark.parametrize("what", ["removed", "moved", "replaced"])
def test_nothing_is_written_into_a_project_that_is_not_at_its_place_any_more(path, make, what):
    with Project.create(path) as project:
        id_ = project.demonstrations.add(make()).id
    shutil.copytree(path, path.with_name("copy"))
    with Project.open(path) as project:
        grab = (Segment(0.0, 0.1, "grab"),)
        project.tracks.edit(id_, "Ada", (), grab, "painted")
        path.rename(path.with_name("moved"))
        if what == "removed":
            shutil.rmtree(path.with_name("moved"))
        elif what == "replaced":
            path.with_name("copy").rename(path)
        with pytest.raises(InputError, match="removed, moved or replaced") as caught:
            project.tracks.edit(id_, "Ada", grab, (), "erased")
        assert one_sentence(str(caught.value))
        if what == "moved":
            path.with_name("moved").rename(path)
            project.tracks.edit(id_, "Ada", grab, (), "erased")


def test_a_project_that_could_not_be_filled_leaves_nothing(path):
    with pytest.raises(ZeroDivisionError), Project.creating(path):
        raise ZeroDivisionError
    with pytest.raises(InputError, match=f"'x' in '{path}'"), Project.creating(path) as project:
        project.demonstrations.load("x")
    assert list(path.parent.iterdir()) == []


def foreign(path: Path) -> None:
    with closing(sqlite3.connect(path / "project.sqlite")) as other:
        other.execute("CREATE TABLE mine (x)")
        other.commit()


BROKEN = {
    "missing": (lambda path: path.rmdir(), "There is no project"),
    "a file": (lambda path: (path.rmdir(), path.write_text("x")), "is a file"),
    "an empty folder": (Path.exists, "holds no project.sqlite"),
    "another program's store": (foreign, "not written by forcelab"),
    "an empty store": (lambda path: (path / "project.sqlite").touch(), "not written by forcelab"),
    "a text": (lambda path: (path / "project.sqlite").write_text("no\n" * 500), "not a database"),
    "a folder for a store": (lambda path: (path / "project.sqlite").mkdir(), "holds no"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_what_is_no_project_is_refused_and_untouched(path, case):
    path.mkdir()
    spoil, message = BROKEN[case]
    spoil(path)
    before = contents(path.parent)
    with pytest.raises(InputError, match=message) as caught:
        Project.open(path)
    assert one_sentence(str(caught.value))
    assert contents(path.parent) == before


def make_filled_project(path, make):
    with Project.create(path) as project:
        for seed in range(20):
            project.demonstrations.add(make(seed, name=str(seed)))


def filled_store(path, make):
    """The database of a project of twenty demonstrations, and its content."""
    store = cached_project(make_filled_project, path, make) / "project.sqlite"
    return store, store.read_bytes()


@pytest.mark.parametrize("share", [0.001, 0.01, 0.3, 0.7, 0.99])
def test_a_truncated_store_is_refused_and_untouched(path, make, share):
    store, whole = filled_store(path, make)
    store.write_bytes(whole[: int(len(whole) * share)])
    before = contents(path)
    with pytest.raises(InputError, match=r"damaged|not written by forcelab") as caught:
        Project.open(path)
    assert one_sentence(str(caught.value))
    assert contents(path) == before


@pytest.mark.parametrize("offset", range(100, 30_000, 3_000))
def test_garbage_in_the_store_is_one_sentence_whenever_it_is_met(path, make, offset):
    store, whole = filled_store(path, make)
    store.write_bytes(whole[:offset] + b"\xa5" * 3_000 + whole[offset + 3_000 :])
    sentence = ""
    try:
        with Project.open(path) as project:
            project.demonstrations.infos()
            project.demonstrations.add(make(99, name="new"))
    except InputError as error:
        sentence = str(error)
    assert sentence == "" or ("damaged" in sentence and one_sentence(sentence))


def test_a_newer_project_is_refused_byte_for_byte_untouched(path, make):
    with Project.create(path) as project:
        project.demonstrations.add(make())
    with closing(sqlite3.connect(path / "project.sqlite")) as newer:
        newer.execute(f"PRAGMA user_version = {len(MIGRATIONS) + 1}")
        newer.execute("CREATE TABLE invention (x)")
    before = contents(path)
    with pytest.raises(InputError, match="newer forcelab .*update forcelab to open it") as caught:
        Project.open(path)
    assert one_sentence(str(caught.value))
    assert contents(path) == before


def test_a_newer_version_that_still_stands_in_the_journal_is_refused_too(path):
    Project.create(path).close()
    with closing(sqlite3.connect(path / "project.sqlite")) as newer:
        newer.execute(f"PRAGMA user_version = {len(MIGRATIONS) + 1}")
        with pytest.raises(InputError, match="newer forcelab"):
            Project.open(path)


def test_a_step_of_bringing_up_to_date_that_fails_leaves_the_step_before_it():
    steps = (
        ("CREATE TABLE song (title TEXT)", "INSERT INTO song VALUES ('one')"),
        ("ALTER TABLE song ADD COLUMN year INTEGER", "UPDATE song SET year = 1999"),
        ("INSERT INTO song VALUES ('lost', 1)", "INSERT INTO nowhere VALUES (1)"),
    )
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as old:
        old.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        with pytest.raises(sqlite3.OperationalError):
            migrate(old, "old", steps)
        assert old.execute("PRAGMA user_version").fetchone() == (2,)
        assert old.execute("SELECT * FROM song").fetchall() == [("one", 1999)]
        assert not old.in_transaction


def test_a_store_that_another_program_keeps_busy_is_one_sentence(path, make):
    with Project.create(path) as project:
        added = project.demonstrations.add(make())
    with closing(sqlite3.connect(path / "project.sqlite", isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        with Project.open(path, timeout=0.05) as project:
            assert project.tracks.get(added.id, "anna").segments == ()  # reading goes on
            with pytest.raises(InputError, match=r"busy .* 0\.05 s") as caught:
                project.tracks.edit(added.id, "anna", (), (Segment(0, 1, "grab"),), "painted")
            assert one_sentence(str(caught.value))
            other.execute("ROLLBACK")
            project.tracks.edit(added.id, "anna", (), (Segment(0, 1, "grab"),), "painted")


@pytest.mark.parametrize(
    ("code", "text", "sentence"),
    [
        (11, "database disk image is malformed", "is damaged"),
        (26, "file is not a database", "is damaged"),
        (1, "no such column: x", "SQLite says 'no such column: x'"),
        (7, "out of memory", "SQLite says 'out of memory'"),
        (5, "database is locked", "kept busy"),
        (6, "database table is locked", "kept busy"),
        (13, "database or disk is full", "make room"),
        (10 | 3 << 8, "disk I/O error", "make room"),
        (8 | 1 << 8, "attempt to write a readonly database", "check who may write"),
    ],
)
@pytest.mark.parametrize("numbered", [True, False])
def test_only_a_damaged_store_is_called_damaged(path, code, text, sentence, numbered):
    error = sqlite3.OperationalError(text)
    if numbered:  # as from Python 3.11 on
        error.sqlite_errorcode = code
    with pytest.raises(InputError, match=sentence) as caught, store_errors(path, 5):
        raise error
    assert one_sentence(str(caught.value))
    assert ("damaged" in str(caught.value)) == (code in (11, 26))


def test_what_a_killed_creation_left_is_cleared_away_when_it_is_old(path):
    parent = path.parent
    old = parent / f".forcelab-{'0' * 16}.part"
    now = parent / f".forcelab-{'1' * 16}.part"
    mine = parent / ".forcelab-mine.part"
    for folder in (old, now, mine):
        (folder / "demonstrations").mkdir(parents=True)
    for folder in (old, mine):
        for entry in (folder / "demonstrations", folder):
            os.utime(entry, (0, 0))
    Project.create(path).close()
    assert sorted(parent.iterdir()) == sorted([now, mine, path])


HOLD = (Segment(0.0, 0.1, "grab"), Segment(0.2, 0.3, "hold"))


@pytest.fixture
def read_only(monkeypatch):
    """As if nothing might be written; root, who runs some of these tests, may write anywhere."""
    monkeypatch.setattr("forcelab.project.database.os.access", lambda *_: False)


def test_a_project_that_may_only_be_read_is_read_and_left_as_it_is(path, make, film, read_only):
    with pytest.MonkeyPatch.context() as writable:
        writable.setattr("forcelab.project.database.os.access", lambda *_: True)
        with Project.create(path) as project:
            id_ = project.demonstrations.add(make(1), [Track("anna", HOLD)]).id
    before = {file: file.stat().st_mtime_ns for file in path.rglob("*")}
    with Project.open(path) as project:
        assert project.read_only
        assert project.demonstrations.load(id_).id == id_
        assert project.tracks.get(id_, "anna").segments == HOLD
        for verb in (
            lambda: project.tracks.edit(id_, "anna", HOLD, (), "erased"),
            lambda: project.demonstrations.add(make(2)),
            lambda: project.demonstrations.rename(id_, "x"),
            lambda: project.media.attach_video(id_, film),
            lambda: project.media.set_video_clock(id_, ClockMap()),
            lambda: project.coding.assign(id_, "anna"),
        ):
            with pytest.raises(InputError, match="may only be read here"):
                verb()
        assert not project.changed_elsewhere()
    assert {file: file.stat().st_mtime_ns for file in path.rglob("*")} == before


@pytest.mark.parametrize("written", ["before", "after"])
def test_what_somebody_else_writes_is_seen_where_nothing_may_be_written(
    path, make, read_only, written
):
    with pytest.MonkeyPatch.context() as writable:
        writable.setattr("forcelab.project.database.os.access", lambda *_: True)
        with Project.create(path) as writer:
            id_ = writer.demonstrations.add(make(1)).id
        writer = Project.open(path)
    with writer:
        if written == "before":  # otherwise the journal is empty
            writer.demonstrations.rename(id_, "02")
        with Project.open(path) as project:  # as on the share of whoever has it open
            assert project.read_only
            writer.demonstrations.rename(id_, "new")
            assert project.changed_elsewhere()
            assert project.demonstrations.info(id_).name == "new"
