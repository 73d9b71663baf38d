"""Edits that return before the disk has them: what is safe from what, and when."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from forcelab.labels import Segment
from forcelab.project import Project

PAINT_AND_STAY = """
import sys, time
from forcelab.labels import Segment
from forcelab.project import Project

project = Project.open(sys.argv[1])
project.sync_behind()
id_ = project.demonstrations.infos()[0].id
for i in range(50):
    before = project.tracks.get(id_, "anna").segments
    new = Segment(i / 100, i / 100 + 0.005, "grab")
    project.tracks.edit(id_, "anna", before, (*before, new), f"edit {i}")
print("done", flush=True)
time.sleep(60)
"""


def paint(project, id_, start):
    before = project.tracks.get(id_, "anna").segments
    return project.tracks.edit(
        id_, "anna", before, (*before, Segment(start / 10, start / 10 + 0.05, "a")), "painted"
    )


def until(holds):
    deadline = time.monotonic() + 20
    while not holds() and time.monotonic() < deadline:
        time.sleep(0.005)
    return holds()


def level(project):
    return project._db.one("PRAGMA synchronous")[0]


@pytest.fixture
def synced(monkeypatch):
    """Which files were brought to the disk since."""
    synced_paths, real = [], os.fsync

    def fsync(number):
        synced_paths.append(str(Path(f"/proc/self/fd/{number}").readlink()))
        real(number)

    monkeypatch.setattr(os, "fsync", fsync)
    return synced_paths


needs_proc = pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="needs Linux")


def test_a_killed_process_loses_nothing_though_its_edits_are_synced_behind(path, make):
    with Project.create(path) as project:
        id_ = project.demonstrations.add(make(1)).id
    process = subprocess.Popen([sys.executable, "-c", PAINT_AND_STAY, path], stdout=subprocess.PIPE)
    with process:
        assert process.stdout.readline() == b"done\n"
        process.send_signal(signal.SIGKILL)
    with Project.open(path) as project:
        assert len(project.tracks.get(id_, "anna").segments) == 50


@needs_proc
def test_each_edit_is_brought_to_the_disk_a_moment_later(path, make, synced):
    with Project.create(path) as project:
        id_ = project.demonstrations.add(make(1)).id
        synced.clear()
        project.sync_behind()
        for start in range(3):
            paint(project, id_, start)
            assert until(lambda: any(name.endswith("project.sqlite-wal") for name in synced))
            synced.clear()


@needs_proc
def test_closing_waits_for_what_is_not_on_the_disk_yet(path, make, synced):
    with Project.create(path) as project, Project.open(path) as other:
        # Another window has it open: the last one to close would move all into the store.
        id_ = project.demonstrations.add(make(1)).id
        other.sync_behind()
        paint(other, id_, 0)
        other.close()
        assert synced[-1].endswith("project.sqlite-wal")


def test_a_disk_that_refuses_is_waited_for_from_then_on(path, make, monkeypatch):
    def refuse(_):
        raise OSError(5, "Input/output error")

    with Project.create(path) as project:
        id_ = project.demonstrations.add(make(1)).id
        project.sync_behind()
        assert level(project) == 1
        monkeypatch.setattr(os, "fsync", refuse)
        paint(project, id_, 0)
        assert until(lambda: project._db._syncing.failed)
        paint(project, id_, 1)
        assert level(project) == 2


def test_without_asking_for_it_every_edit_is_on_the_disk_when_it_returns(path, make):
    with Project.create(path) as project:
        project.demonstrations.add(make(1))
        assert level(project) == 2
