"""Where nothing more can be written, a project can still be read."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from factories import cached_project

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import Project

Make = Callable[..., Demonstration]
HOLD = (Segment(0.0, 0.1, "grab"), Segment(0.2, 0.3, "hold"))
#: Changes a project and dies, so that the change lies in the journal alone.
KILLED = """
import os, sys
from forcelab.project import Project

project = Project.open(sys.argv[1])
project.demonstrations.rename(project.demonstrations.infos()[0].id, "02")
os._exit(0)
"""
#: Reads a project, and tries to change it, while no file may get any longer.
NO_LONGER = """
import resource, sys
from forcelab.errors import InputError
from forcelab.project import Project

resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
with Project.open(sys.argv[1]) as project:
    (info,) = project.demonstrations.infos()
    project.demonstrations.load(info.id)
    print(info.name, info.edited)
    try:
        project.demonstrations.rename(info.id, "other")
    except InputError as error:
        print(error)
"""

#: Makes a project where there is room for its file, but not for all of its tables.
TOO_LONG = """
import resource, sys
from forcelab.errors import InputError
from forcelab.project import Project

resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))
try:
    Project.create(sys.argv[1])
except InputError as error:
    print(error)
"""


@pytest.fixture(params=["bytes", "names"])
def disk(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Path]:
    """A small disk, on which there will be no room for bytes, or for names of files."""
    folder = tmp_path / "disk"
    folder.mkdir()
    room = {"bytes": "size=1m", "names": "size=1m,nr_inodes=24"}[request.param]
    mount = ["mount", "-t", "tmpfs", "-o", room, "tmpfs", str(folder)]
    if shutil.which("mount") is None or subprocess.run(mount, check=False).returncode:
        pytest.skip("no disk may be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def fill(disk: Path) -> None:
    """Use up every byte and every name."""
    with (disk / "large").open("wb", buffering=0) as large, contextlib.suppress(OSError):
        while large.write(bytes(4096)):
            pass
    with contextlib.suppress(OSError):
        for number in range(50):
            (disk / f"{number}").touch()


def lay(path: Path, make: Make, left: str) -> None:
    with Project.create(path) as project:
        project.demonstrations.add(make(1), [Track("anna", HOLD)])
    if left != "closed":
        subprocess.run([sys.executable, "-c", KILLED, str(path)], check=True)
    if left == "copied":  # as backups leave out what is not worth keeping
        (path / "project.sqlite-shm").unlink()


@pytest.fixture
def laid(make) -> Callable[[Path, str], Path]:
    """A project as it was left: closed, or by a process that was killed."""
    return lambda path, left: cached_project(lay, path, make, left)


@pytest.mark.parametrize(("left", "name"), [("closed", "01"), ("killed", "02"), ("copied", "02")])
def test_a_project_on_a_full_disk_is_read(disk, laid, make, left, name):
    path = laid(disk / "study.forcelab", left)
    fill(disk)
    for _ in range(2):  # what the first time left does not stand in the way of the second
        with Project.open(path) as project:
            (info,) = project.demonstrations.infos()
            assert info.name == name
            assert project.tracks.get(info.id, "anna").segments == HOLD
            assert project.demonstrations.load(info.id).id == info.id
    (disk / "large").unlink()
    for file in disk.glob("[0-9]*"):
        file.unlink()
    with Project.open(path) as project:  # nothing was lost, and it can be changed again
        assert not project.read_only
        project.tracks.edit(info.id, "anna", HOLD, (), "erased")
        assert project.demonstrations.info(info.id).name == name


def test_a_change_on_a_full_disk_is_refused_with_the_reason(disk, laid, make):
    path = laid(disk / "study.forcelab", "closed")
    fill(disk)
    with Project.open(path) as project:
        assert project.read_only
        with pytest.raises(InputError, match=r"could only be opened to be read \(.*; make room"):
            project.demonstrations.add(make(2))


@pytest.mark.parametrize("disk", ["bytes"], indirect=True)
@pytest.mark.parametrize(("left", "name"), [("closed", "01"), ("killed", "02")])
def test_a_disk_that_may_only_be_read_is_read_with_what_lies_in_the_journal(disk, laid, left, name):
    path = laid(disk / "study.forcelab", left)
    subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
    with Project.open(path) as project:
        assert project.read_only
        assert project.demonstrations.infos()[0].name == name


@pytest.mark.parametrize("disk", ["bytes"], indirect=True)
def test_a_journal_that_cannot_be_read_there_is_told(disk, laid):
    path = laid(disk / "study.forcelab", "copied")
    subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
    with pytest.raises(InputError, match="was not closed by whoever wrote it; open it once"):
        Project.open(path)


@pytest.mark.skipif(sys.platform == "win32", reason="limits of files are those of POSIX")
@pytest.mark.parametrize(("left", "name"), [("closed", "01"), ("copied", "02")])
def test_where_no_file_may_grow_a_project_is_read(path, laid, left, name):
    laid(path, left)
    run = subprocess.run(
        [sys.executable, "-c", NO_LONGER, str(path)], capture_output=True, text=True, check=True
    )
    listing, refused = run.stdout.splitlines()
    assert listing == f"{name} {{'anna': 1}}"
    assert "could only be opened to be read" in refused


@pytest.mark.skipif(sys.platform == "win32", reason="limits of files are those of POSIX")
def test_no_project_is_made_where_there_is_no_room_for_its_tables(path):
    run = subprocess.run(
        [sys.executable, "-c", TOO_LONG, str(path)], capture_output=True, text=True, check=True
    )
    assert run.stdout.startswith(f"'{path}' cannot become a new project: no more can be written")
    assert not list(path.parent.iterdir())
