"""A small project, and demonstrations to put into it."""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from factories import folder_in_memory, track_editor_in_memory

from forcelab.demonstration import Channel, Demonstration
from forcelab.project import Project
from forcelab.project.schema import APPLICATION_ID, MIGRATIONS, migrate
from forcelab.project.track_editor import TrackEditor

Make = Callable[..., Demonstration]


@pytest.fixture
def tmp_path() -> Iterator[Path]:
    with folder_in_memory() as folder:
        yield folder


def make_demonstration(
    seed: int = 0, name: str = "01", task: str = "LEGO", **more: object
) -> Demonstration:
    random = np.random.default_rng(seed)
    times = np.cumsum(random.uniform(0.0005, 0.0015, 500))
    signals = random.normal(size=(500, 2))
    signals[7, 1] = np.nan
    channels = (Channel("fx", "N"), Channel("fz", "N"))
    return Demonstration(name, task, times, signals, channels, **more)  # type: ignore[arg-type]


@pytest.fixture
def make() -> Make:
    """Make a demonstration whose content depends on its seed alone."""
    return make_demonstration


@pytest.fixture
def film(tmp_path: Path) -> Path:
    """A demonstration's video; the store does not look inside."""
    file = tmp_path / "Take 1.MP4"
    file.write_bytes(os.urandom(20_000))
    return file


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "study.forcelab"


@pytest.fixture
def project(path: Path) -> Iterator[Project]:
    with Project.create(path) as project:
        yield project


@pytest.fixture
def id_(project: Project, make: Make) -> str:
    """The only demonstration of the project."""
    return project.demonstrations.add(make(1)).id


@pytest.fixture
def labelling() -> Iterator[TrackEditor]:
    """Ada at work on ten seconds."""
    with track_editor_in_memory() as labelling:
        yield labelling


@pytest.fixture
def older(project: Project, path: Path, tmp_path: Path) -> Callable[[int], Path]:
    """Close the project and give it as an older version of the program would have left it."""

    def build(version: int) -> Path:
        project.close()
        old = tmp_path / f"version {version}.forcelab"
        shutil.copytree(path, old)
        (old / "project.sqlite").unlink()
        with closing(sqlite3.connect(old / "project.sqlite", isolation_level=None)) as store:
            store.execute("PRAGMA journal_mode = WAL")
            store.execute(f"PRAGMA application_id = {APPLICATION_ID}")
            migrate(store, "old", MIGRATIONS[:version])
            store.execute("ATTACH ? AS new", [str(path / "project.sqlite")])
            tables = store.execute("SELECT name FROM main.sqlite_schema WHERE type = 'table'")
            names = [name for (name,) in tables if not name.startswith("sqlite_")]
            # Tables that refer to others come after them.
            for table in names:
                rows = store.execute(f"SELECT name FROM pragma_table_info('{table}', 'main')")
                columns = ", ".join(f'"{name}"' for (name,) in rows)
                store.execute(
                    f"INSERT INTO main.{table} ({columns}) SELECT {columns} FROM new.{table}"
                )
            if version < 5:
                store.execute(
                    "UPDATE main.demonstration SET (video, video_offset, video_rate) = (SELECT "
                    "file, offset, rate FROM new.video WHERE demonstration = id AND position = 0)"
                )
        return old

    return build
