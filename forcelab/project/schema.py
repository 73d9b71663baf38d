"""The tables of a project, and the steps that bring an older one up to date."""

from __future__ import annotations

import contextlib
import functools
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from forcelab.clock import ClockMap
from forcelab.errors import InputError
from forcelab.project import files
from forcelab.project.records import LONGEST_NAME

#: "FLab" in ASCII, in the file's header: tells a project from every other SQLite file.
APPLICATION_ID = 0x464C6162

#: Statements, and what else is done to a project, given its folder.
Step = tuple[str | Callable[[sqlite3.Connection, Path], None], ...]


def _append_only(table: str) -> Step:
    """Triggers that keep every row of a table for ever, whoever asks."""
    refused = f"BEGIN SELECT RAISE(ABORT, '{table}s are kept for ever'); END"
    return (
        f"CREATE TRIGGER {table}_is_not_replaced BEFORE INSERT ON {table} "
        f"WHEN EXISTS (SELECT 1 FROM {table} WHERE id = NEW.id) {refused}",
        f"CREATE TRIGGER {table}_is_not_changed BEFORE UPDATE ON {table} {refused}",
        f"CREATE TRIGGER {table}_is_not_deleted BEFORE DELETE ON {table} {refused}",
    )


_VERSION_1: Step = (
    """
    CREATE TABLE demonstration (
        id           TEXT PRIMARY KEY CHECK (length(id) = 32 AND id NOT GLOB '*[^0-9a-f]*'),
        name         TEXT NOT NULL CHECK (trim(name) <> ''),
        task         TEXT NOT NULL CHECK (typeof(task) = 'text'),
        channels     TEXT NOT NULL CHECK (channels LIKE '[%]'),
        samples      INTEGER NOT NULL CHECK (typeof(samples) = 'integer' AND samples >= 2),
        period       REAL NOT NULL CHECK (typeof(period) = 'real' AND period > 0),
        duration     REAL NOT NULL CHECK (typeof(duration) = 'real' AND duration > 0),
        grid_rate    REAL CHECK (grid_rate > 0),
        video        TEXT CHECK (video NOT GLOB '*[/\\]*'),
        video_offset REAL CHECK ((video_offset IS NULL) = (video IS NULL)),
        video_rate   REAL CHECK ((video_rate IS NULL) = (video IS NULL)),
        source       TEXT NOT NULL,
        UNIQUE (task, name)
    )
    """,
    """
    CREATE TABLE author (
        id   INTEGER PRIMARY KEY,
        name TEXT NOT NULL UNIQUE CHECK (trim(name) <> ''),
        kind TEXT NOT NULL CHECK (kind IN ('coder', 'model'))
    )
    """,
    """
    CREATE TABLE track (
        id            INTEGER PRIMARY KEY,
        demonstration TEXT NOT NULL REFERENCES demonstration,
        author        INTEGER NOT NULL REFERENCES author,
        UNIQUE (demonstration, author)
    )
    """,
    """
    CREATE TABLE segment (
        track  INTEGER NOT NULL REFERENCES track,
        start  REAL NOT NULL CHECK (typeof(start) = 'real'),
        end    REAL NOT NULL CHECK (typeof(end) = 'real' AND end > start),
        action TEXT NOT NULL CHECK (action <> ''),
        PRIMARY KEY (track, start)
    ) WITHOUT ROWID
    """,
    # parent links the edits that can be undone, and those that can be redone, into two stacks:
    # see forcelab.project.tracks.
    """
    CREATE TABLE edit (
        id       INTEGER PRIMARY KEY AUTOINCREMENT,
        track    INTEGER NOT NULL REFERENCES track,
        kind     TEXT NOT NULL CHECK (kind IN ('paint', 'import', 'predict', 'undo', 'redo')),
        time     TEXT NOT NULL,
        what     TEXT NOT NULL,
        position INTEGER NOT NULL CHECK (typeof(position) = 'integer' AND position >= 0),
        removed  TEXT NOT NULL CHECK (removed LIKE '[%]'),
        inserted TEXT NOT NULL CHECK (inserted LIKE '[%]'),
        reverts  INTEGER REFERENCES edit CHECK ((reverts IS NULL) = (kind NOT IN ('undo', 'redo'))),
        parent   INTEGER REFERENCES edit
    )
    """,
    "CREATE INDEX edit_of_track ON edit (track)",
    *_append_only("edit"),
    """
    CREATE TRIGGER author_is_not_changed BEFORE UPDATE ON author
    BEGIN SELECT RAISE(ABORT, 'authors are kept for ever'); END
    """,
    """
    CREATE TABLE vocabulary (
        task    TEXT PRIMARY KEY,
        actions TEXT NOT NULL CHECK (actions LIKE '[%]')
    )
    """,
    """
    CREATE TABLE recogniser (
        id       TEXT PRIMARY KEY CHECK (length(id) = 32 AND id NOT GLOB '*[^0-9a-f]*'),
        name     TEXT NOT NULL CHECK (trim(name) <> ''),
        time     TEXT NOT NULL,
        settings TEXT NOT NULL CHECK (settings LIKE '{%}'),
        seed     INTEGER CHECK (typeof(seed) IN ('integer', 'null')),
        labels   TEXT NOT NULL CHECK (labels LIKE '[%]'),
        versions TEXT NOT NULL CHECK (versions LIKE '{%}')
    )
    """,
    """
    CREATE TABLE run (
        id       INTEGER PRIMARY KEY AUTOINCREMENT,
        kind     TEXT NOT NULL CHECK (trim(kind) <> ''),
        time     TEXT NOT NULL,
        settings TEXT NOT NULL CHECK (settings LIKE '{%}'),
        seed     INTEGER CHECK (typeof(seed) IN ('integer', 'null')),
        labels   TEXT NOT NULL CHECK (labels LIKE '[%]'),
        versions TEXT NOT NULL CHECK (versions LIKE '{%}'),
        result   TEXT NOT NULL CHECK (result LIKE '{%}')
    )
    """,
)

# What happened to assignments; the latest event of a demonstration and an author counts.
_VERSION_2: Step = (
    """
    CREATE TABLE assignment (
        id            INTEGER PRIMARY KEY AUTOINCREMENT,
        demonstration TEXT NOT NULL REFERENCES demonstration,
        author        TEXT NOT NULL CHECK (trim(author) <> ''),
        kind          TEXT NOT NULL
                      CHECK (kind IN ('blind', 'open', 'done', 'reopened', 'removed')),
        time          TEXT NOT NULL
    )
    """,
    "CREATE INDEX assignment_of_author ON assignment (author, demonstration)",
    *_append_only("assignment"),
)

# What was said about places where human and model differ: the latest verdict on a place counts.
# An edit may have been proposed by a model; who painted it is a coder all the same.
_VERSION_3: Step = (
    """
    CREATE TABLE verdict (
        id            INTEGER PRIMARY KEY AUTOINCREMENT,
        demonstration TEXT NOT NULL REFERENCES demonstration,
        author        TEXT NOT NULL CHECK (trim(author) <> ''),
        coder         TEXT NOT NULL CHECK (trim(coder) <> ''),
        start         REAL NOT NULL CHECK (typeof(start) = 'real'),
        end           REAL NOT NULL CHECK (typeof(end) = 'real' AND end > start),
        human         TEXT CHECK (human <> ''),
        predicted     TEXT CHECK (predicted <> ''),
        verdict       TEXT NOT NULL
                      CHECK (verdict IN ('human', 'model', 'ambiguous', 'withdrawn')),
        run           INTEGER REFERENCES run,
        time          TEXT NOT NULL
    )
    """,
    "CREATE INDEX verdict_of_demonstration ON verdict (demonstration)",
    *_append_only("verdict"),
    """
    ALTER TABLE edit ADD COLUMN proposed_by TEXT
    CHECK (proposed_by IS NULL OR (kind = 'paint' AND trim(proposed_by) <> ''))
    """,
    # Most tracks hold nothing that was proposed: that must be known without reading their edits.
    "CREATE INDEX edit_proposed ON edit (track) WHERE proposed_by IS NOT NULL",
)

# What coders hand on about demonstrations; of each one's and each author's the latest counts.
_VERSION_4: Step = (
    """
    CREATE TABLE note (
        id            INTEGER PRIMARY KEY AUTOINCREMENT,
        demonstration TEXT NOT NULL REFERENCES demonstration,
        author        TEXT NOT NULL CHECK (trim(author) <> ''),
        text          TEXT NOT NULL CHECK (typeof(text) = 'text'),
        time          TEXT NOT NULL
    )
    """,
    "CREATE INDEX note_of_demonstration ON note (demonstration)",
    *_append_only("note"),
)


def _add_cameras(connection: sqlite3.Connection, folder: Path) -> None:
    """Make videos of what further cameras filmed, which only the stamps of a recording told."""
    query = "SELECT id, samples FROM demonstration WHERE id IN (SELECT demonstration FROM video)"
    for id_, samples in connection.execute(query).fetchall():
        if not files.STORED_ID.fullmatch(str(id_)):
            continue
        # What cannot be read stays in the folder as it is; what went wrong is told with the stamps.
        with contextlib.suppress(InputError, LookupError, OSError, TypeError, ValueError):
            for name, file, clock in _cameras_before(folder, id_, samples):
                if file:
                    connection.execute(
                        "INSERT OR IGNORE INTO video SELECT demonstration, max(position) + 1, ?, "
                        "?, ?, ? FROM video WHERE demonstration = ?",
                        (name, file, clock.offset, clock.rate, id_),
                    )
                else:
                    connection.execute(
                        "UPDATE OR IGNORE video SET name = ? WHERE demonstration = ?", (name, id_)
                    )


def _cameras_before(folder: Path, id_: str, samples: int) -> Iterator[tuple[str, str, ClockMap]]:
    """Name, file and clock of all cameras where there are several; the first one has no file.

    Before names were stored, of two cameras the second one's time 0 is when its first frame came;
    of more cameras nothing tells which video is whose.
    """
    home = folder / files.DEMONSTRATIONS / id_
    for path in (home.parent, home):
        files.check_folder(path)
    beside = [
        path.name
        for path in home.glob("beside-*")
        if files.STORED_VIDEO.fullmatch(path.name) and path.is_file() and not path.is_symlink()
    ]
    if not beside:
        return
    frames = [f"frames_{number}" for number in range(8)]  # of so many cameras at most
    columns = ("video_names", "video_files", "video_clocks")
    stamps = files.read_stamps(home, samples, {"start", *frames, *columns}) or {}
    if "video_names" in stamps:
        for name, file, clock in zip(*(stamps.get(key, ()) for key in columns), strict=True):
            if len(name) <= LONGEST_NAME and (not file or str(file) in beside):
                yield str(name), str(file), ClockMap(float(clock[0]), float(clock[1]))
        return
    filmed = [stamps.get(name, np.empty((0, 2))) for name in frames]
    arrived = [each[:, 0] for each in filmed if each.ndim == 2 and len(each)]
    if len(beside) == 1 and len(arrived) == 2 and "start" in stamps:
        yield "first camera", "", ClockMap()
        yield "second camera", beside[0], ClockMap(float(arrived[1][0] - stamps["start"]))


# Any number of videos; the columns of the one that there was before stay empty.
_VERSION_5: Step = (
    """
    CREATE TABLE video (
        demonstration TEXT NOT NULL REFERENCES demonstration,
        position      INTEGER NOT NULL CHECK (typeof(position) = 'integer' AND position >= 0),
        name          TEXT NOT NULL CHECK (trim(name) <> ''),
        file          TEXT NOT NULL CHECK (file NOT GLOB '*[/\\]*'),
        offset        REAL NOT NULL CHECK (typeof(offset) = 'real'),
        rate          REAL NOT NULL CHECK (typeof(rate) = 'real' AND rate > 0),
        PRIMARY KEY (demonstration, name),
        UNIQUE (demonstration, position)
    ) WITHOUT ROWID
    """,
    """
    INSERT INTO video SELECT id, 0, 'video 1', video, video_offset, video_rate
    FROM demonstration WHERE video IS NOT NULL
    """,
    "UPDATE demonstration SET video = NULL, video_offset = NULL, video_rate = NULL "
    "WHERE video IS NOT NULL",
    _add_cameras,
)

#: Step ``i`` brings a project of version ``i`` to version ``i + 1``. Only ever append to this.
MIGRATIONS: tuple[Step, ...] = (_VERSION_1, _VERSION_2, _VERSION_3, _VERSION_4, _VERSION_5)


def check_version(application_id: int, version: int, newest: int, where: str) -> None:
    """Refuse another program's file, and a newer forcelab's."""
    if application_id != APPLICATION_ID:
        raise InputError(
            f"'{where}' was not written by forcelab; choose a folder that holds a project."
        )
    if version < 0:
        raise InputError(
            f"The store of '{where}' is damaged (version {version} of its tables); restore it from "
            f"a copy."
        )
    if version > newest:
        raise InputError(
            f"'{where}' was written by a newer forcelab (version {version} of its tables, this "
            f"program knows {newest}); update forcelab to open it."
        )


def migrate(connection: sqlite3.Connection, where: str, steps: Sequence[Step] = MIGRATIONS) -> None:
    """Carry out the steps that a project has not seen, each in a transaction of its own.

    The connection is in autocommit mode; `where` is the project's folder.
    """
    migrated = False
    while True:
        version = pragma(connection, "user_version")
        if version == len(steps):
            _check_content(connection, tuple(steps), where)
            break
        connection.execute("BEGIN IMMEDIATE")
        try:
            # Another process may have done the step while this one waited for the lock.
            version = pragma(connection, "user_version")
            check_version(pragma(connection, "application_id"), version, len(steps), where)
            if version < len(steps):
                _check_content(connection, tuple(steps[:version]), where)
                for part in steps[version]:
                    if isinstance(part, str):
                        connection.execute(part)
                    else:
                        part(connection, Path(where))
                connection.execute(f"PRAGMA user_version = {version + 1}")
                migrated = True
            connection.execute("COMMIT")
        except sqlite3.IntegrityError as error:  # of rows that no forcelab has written
            raise InputError(
                f"The store of '{where}' is damaged ({error}); restore it from a copy."
            ) from error
        finally:
            if connection.in_transaction:
                connection.execute("ROLLBACK")
    if migrated:
        # So that the version stands in the file's header, where older programs look first.
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")


Content = frozenset[tuple[str, ...]]


def _content_of(connection: sqlite3.Connection) -> Content:
    """Type, name, table and SQL text of all that a store has: tables, indexes, triggers, views."""
    rows = connection.execute("SELECT type, name, tbl_name, sql FROM sqlite_schema")
    # Spaces and line ends do not count: the first versions broke their lines elsewhere.
    return frozenset((*row[:3], " ".join(str(row[3]).split())) for row in rows)


@functools.lru_cache(maxsize=len(MIGRATIONS) + 1)
def _content_after(steps: tuple[Step, ...]) -> Content:
    """What a store has after these steps and no others."""
    with contextlib.closing(sqlite3.connect(":memory:", isolation_level=None)) as connection:
        for statement in (part for step in steps for part in step if isinstance(part, str)):
            connection.execute(statement)
        return _content_of(connection)


def _check_content(connection: sqlite3.Connection, steps: tuple[Step, ...], where: str) -> None:
    """Refuse a store with other tables, indexes, triggers or views than those steps make.

    A trigger of another's could undo edits that are told as made, a view could never end.
    """
    content, expected = _content_of(connection), _content_after(steps)
    if content == expected:
        return
    foreign, missing = (
        {str(part[1]) for part in parts} for parts in (content - expected, expected - content)
    )
    names = ", ".join(sorted(f"'{name[:40]}'" for name in foreign | missing)[:5])
    raise InputError(
        f"The store of '{where}' has other tables, views or triggers than forcelab makes "
        f"({names}); restore it from a copy."
    )


def pragma(connection: sqlite3.Connection, name: str) -> int:
    """The value of a whole-number pragma."""
    return int(connection.execute(f"PRAGMA {name}").fetchone()[0])
