"""Killed processes, full disks, two writers at once.

The killing is repeated twice; ``FORCELAB_KILLS=50 pytest tests/project/test_crashes.py`` repeats
it as often as one likes.
"""

from __future__ import annotations

import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from forcelab.labels import Segment, Track
from forcelab.project import Project
from forcelab.segment_edits import paint

KILLS = int(os.environ.get("FORCELAB_KILLS", "2"))

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs signals and limits of POSIX")

PROLOGUE = """
import os, sys
import numpy as np
from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import ForcelabError, StaleTrackError
from forcelab.labels import Segment, Track
from forcelab.segment_edits import paint
from forcelab.project import NewDemonstration, Project

def say(text):
    os.write(1, f"{text}\\n".encode())

def large(seed, n=200_000):
    values = np.random.default_rng(seed).normal(size=(n, 3))
    channels = tuple(Channel(name, "N") for name in ("fx", "fy", "fz"))
    return Demonstration(str(seed), "LEGO", np.arange(n) / 1000, values, channels)

project = Project.open(sys.argv[1])
say("ready")
"""

EDIT_1000_TIMES = """
id_ = project.demonstrations.infos()[0].id
for i in range(1000):
    before = project.tracks.get(id_, "anna").segments
    at = i * 0.009 % 0.48
    after = paint(before, at, at + 0.012, "abc"[i % 3])
    project.tracks.edit(id_, "anna", before, after, f"edit {i}")
    say(i)
"""


@pytest.fixture
def tmp_path(tmp_path_factory):
    """A folder on a real disk."""
    return tmp_path_factory.mktemp("disk")


def start(code: str, path: Path) -> subprocess.Popen[bytes]:
    """Run code on a project in another process, and wait until it has it open."""
    process = subprocess.Popen(
        [sys.executable, "-c", PROLOGUE + code, path], stdout=subprocess.PIPE
    )
    assert process.stdout is not None
    assert process.stdout.readline() == b"ready\n"
    return process


def read_lines(process: subprocess.Popen[bytes]) -> list[str]:
    """All whole lines that a process said before its end."""
    assert process.stdout is not None
    with process:
        return process.stdout.read().decode().split("\n")[:-1]


@pytest.fixture
def id_(path, make):
    """The only demonstration of a project that is closed."""
    with Project.create(path) as project:
        return project.demonstrations.add(make(1)).id


def check_integrity(path: Path) -> None:
    with closing(sqlite3.connect(path / "project.sqlite")) as store:
        assert store.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert store.execute("PRAGMA foreign_key_check").fetchall() == []


def track_after(edits: int) -> tuple[Segment, ...]:
    """What the track is after so many of the thousand edits."""
    track: tuple[Segment, ...] = ()
    for i in range(edits):
        at = i * 0.009 % 0.48
        track = paint(track, at, at + 0.012, "abc"[i % 3])
    return track


@pytest.mark.parametrize("kill", range(KILLS))
def test_every_acknowledged_edit_survives_kill_9(path, id_, make, kill):
    process = start(EDIT_1000_TIMES, path)
    time.sleep(random.Random(kill).uniform(0, 0.4))
    process.send_signal(signal.SIGKILL)
    acknowledged = len(read_lines(process))
    with Project.open(path) as project:
        history = project.tracks.history(id_, "anna")
        assert acknowledged <= len(history) <= acknowledged + 1
        assert [edit.what for edit in history] == [f"edit {i}" for i in range(len(history))]
        assert project.tracks.get(id_, "anna").segments == track_after(len(history))
        project.tracks.undo(id_, "anna")
        project.demonstrations.add(make(2, name="02"))
    check_integrity(path)


@pytest.mark.parametrize("kill", range(max(KILLS // 2, 1)))
def test_an_import_killed_at_any_instant_is_there_as_a_whole_or_not_at_all(path, make, kill):
    with Project.create(path) as project:
        project.demonstrations.add(make(1), [Track("anna", (Segment(0, 0.1, "grab"),))])
    code = """
for seed in range(100):
    say(project.demonstrations.add(large(seed), [Track("anna", (Segment(0, 1, "grab"),))]).id)
"""
    process = start(code, path)
    time.sleep(random.Random(kill).uniform(0, 0.3))
    process.send_signal(signal.SIGKILL)
    acknowledged = read_lines(process)
    folder = path / "demonstrations"
    for leftover in folder.glob(".incoming-*"):
        for entry in (*leftover.rglob("*"), leftover):
            os.utime(entry, (0, 0))  # as if an hour had gone by
    with Project.open(path) as project:
        stored = {info.id: info.authors for info in project.demonstrations.infos()}
        assert set(acknowledged) < set(stored)
        assert len(stored) <= len(acknowledged) + 2
        for id_, authors in stored.items():
            assert project.demonstrations.load(id_).id == id_
            assert authors == ("anna",)
        assert {entry.name for entry in folder.iterdir()} == set(stored)
    check_integrity(path)


def test_half_an_import_is_cleared_away_and_an_import_at_work_is_not(path, id_):
    folder = path / "demonstrations"
    for name in ("f" * 32, ".incoming-old", ".incoming-now", "e" * 32):
        (folder / name).mkdir()
        (folder / name / "times.npy").write_bytes(b"half")
    (folder / ("f" * 32) / "uncommitted").touch()  # e... was not: an older store was put back
    for entry in (folder / ".incoming-old" / "times.npy", folder / ".incoming-old"):
        os.utime(entry, (0, 0))
    with Project.open(path) as project:
        assert {p.name for p in folder.iterdir()} == {id_, ".incoming-now", "e" * 32}
        assert project.demonstrations.load(id_).id == id_


def test_two_processes_that_edit_one_track_never_lose_an_edit(path, id_):
    code = """
id_, who = project.demonstrations.infos()[0].id, sys.argv[2]
made = stale = 0
while made < 150:
    before = project.tracks.get(id_, "anna").segments
    start = (made * 7 + len(who)) % 60 / 120
    try:
        after = paint(before, start, start + 2 / 120, who)
        project.tracks.edit(id_, "anna", before, after, f"{who} {made}")
        made += 1
    except StaleTrackError:
        stale += 1
say(stale)
"""
    arguments = [sys.executable, "-c", PROLOGUE + code, path]
    both = [
        subprocess.Popen([*arguments, who], stdout=subprocess.PIPE) for who in ("grab", "release")
    ]
    assert [len(read_lines(process)) for process in both] == [2, 2]
    with Project.open(path) as project:
        history = project.tracks.history(id_, "anna")
        for who in ("grab", "release"):
            edits = [edit.what for edit in history if edit.what.startswith(who)]
            assert edits == [f"{who} {i}" for i in range(150)]
        replayed: tuple[Segment, ...] = ()
        for edit in history:
            end = edit.position + len(edit.removed)
            assert replayed[edit.position : end] == edit.removed
            replayed = replayed[: edit.position] + edit.inserted + replayed[end:]
        assert project.tracks.get(id_, "anna").segments == replayed
    check_integrity(path)


def test_looking_at_a_project_leaves_the_locks_on_it_alone(project, path):
    # SQLite's locks belong to the process: closing any other handle of the file drops them, and
    # then the next process to close the project takes the journal away under this one.
    project.actions.set_vocabulary("LEGO", project.actions.vocabulary("LEGO").with_actions("grab"))
    Project.open(path).close()
    read_lines(start("project.close()", path))
    assert (path / "project.sqlite-wal").exists()


FULL = """
import resource
def fill(size):
    # Files may not grow beyond this: writing fails as on a full disk.
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
"""


def test_a_full_disk_during_an_import_leaves_the_project_as_it_was(path, id_, make):
    code = """
fill(1_000_000)
try:
    project.demonstrations.add(large(5))
except ForcelabError as error:
    say(error)
say(len(project.demonstrations.infos()))
project.close()
"""
    sentence, count = read_lines(start(FULL + code, path))
    assert "'5' was not added" in sentence
    assert "\n" not in sentence
    assert sentence.endswith(".")
    assert count == "1"
    assert [p.name for p in (path / "demonstrations").iterdir()] == [id_]
    with Project.open(path) as project:
        project.demonstrations.add(make(2, name="02"))
    check_integrity(path)


def test_a_full_disk_during_edits_loses_none_that_was_acknowledged(path, id_):
    code = """
fill(300_000)
id_ = project.demonstrations.infos()[0].id
for i in range(1000):
    before = project.tracks.get(id_, "anna").segments
    try:
        after = paint(before, i / 1e3, (i + 0.5) / 1e3, "a")
        project.tracks.edit(id_, "anna", before, after, str(i))
    except ForcelabError as error:
        say(error)
        break
    say(i)
assert project.tracks.get(id_, "anna").segments == before
os._exit(0)
"""
    *acknowledged, sentence = read_lines(start(FULL + code, path))
    assert "nothing was changed; make room on the disk" in sentence
    with Project.open(path) as project:
        history = project.tracks.history(id_, "anna")
        assert [edit.what for edit in history] == acknowledged
        assert len(project.tracks.get(id_, "anna").segments) == len(history) > 10
        project.tracks.undo(id_, "anna")
    check_integrity(path)
