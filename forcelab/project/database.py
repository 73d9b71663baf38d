"""The SQLite file: opened safely, every failure told in one sentence."""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path

from forcelab.errors import InputError
from forcelab.project.schema import APPLICATION_ID, MIGRATIONS, check_version, migrate
from forcelab.project.syncing import Syncing
from forcelab.project.troubles import FILE, sentence_of, told_of_store

__all__ = ["FILE", "Database", "Value"]

#: What a column holds.
Value = str | int | float | None

_SETTINGS = (
    "PRAGMA synchronous = FULL",  # with WAL: one fsync a commit, and a commit survives a power cut
    "PRAGMA foreign_keys = ON",
    "PRAGMA trusted_schema = OFF",
    "PRAGMA cell_size_check = ON",
)


class Database:
    """One connection to a project's SQLite file, for the thread that made it.

    Parameters
    ----------
    folder : Path
        The project's folder.
    timeout : float
        Seconds to wait for another process that is writing.

    Attributes
    ----------
    read_only : bool
        Whether the folder or the file may not be written here.
    on_rollback : callable
        Called after a transaction came to nothing, to drop what was remembered from it.

    Raises
    ------
    InputError
        If the folder holds no project, a damaged one or one of a newer version. Nothing is
        written then.
    """

    def __init__(self, folder: Path, timeout: float) -> None:
        self.folder = folder
        self.on_rollback: Callable[[], None] = lambda: None
        self._timeout = timeout
        self._syncing: Syncing | None = None
        _probe(folder)
        file, journal = folder / FILE, folder / f"{FILE}-wal"
        self.read_only = not (os.access(folder, os.W_OK) and os.access(file, os.W_OK))
        if self.read_only and journal.exists() and journal.stat().st_size:
            raise InputError(
                f"'{folder}' may only be read here and was not closed by whoever wrote it; open it "
                f"once where it may be written."
            )
        # Where nothing may be written, nobody else writes either, and locks cannot be taken.
        self._connection = self._connect("ro&immutable=1" if self.read_only else "rw")
        try:
            if self.read_only:
                self._connection = self._up_to_date_copy()
            with told_of_store(folder, timeout):
                migrate(self._connection, str(folder))
            self._seen = self._data_version()
            self._place = _place(file)
        except BaseException:
            self._connection.close()
            raise

    @staticmethod
    def create(folder: Path) -> None:
        """Make the file in an empty folder, without tables yet."""
        with told_of_store(folder, 0):
            new = sqlite3.connect(folder / FILE, isolation_level=None)
            with contextlib.closing(new):
                new.execute("PRAGMA journal_mode = WAL")
                new.execute(f"PRAGMA application_id = {APPLICATION_ID}")

    def close(self) -> None:
        """Let go of the file."""
        if self._syncing is not None:
            self._syncing.close()
            self._syncing = None
        self._connection.close()

    def sync_behind(self) -> None:
        """Let a commit return when the operating system has it; a thread brings it to the disk.

        A process that is killed at any instant loses nothing, and the store is whole whatever
        happens. A power cut loses what was committed while the disk was at work: the last tens of
        milliseconds.
        """
        if not self.read_only and self._syncing is None:
            self.execute("PRAGMA synchronous = NORMAL")
            self._syncing = Syncing(self.folder / f"{FILE}-wal")

    def execute(self, sql: str, *values: Value) -> sqlite3.Cursor:
        """Carry out one statement."""
        with told_of_store(self.folder, self._timeout):
            return self._connection.execute(sql, values)

    def all(self, sql: str, *values: Value) -> list[sqlite3.Row]:
        """All rows of a query."""
        with told_of_store(self.folder, self._timeout):
            return self._connection.execute(sql, values).fetchall()

    def one(self, sql: str, *values: Value) -> sqlite3.Row | None:
        """The first row of a query, if there is one."""
        rows = self.all(sql, *values)
        return rows[0] if rows else None

    def insert(self, table: str, **values: Value) -> int:
        """Insert a row; gives its number."""
        marks = ", ".join("?" * len(values))
        sql = f"INSERT INTO {table} ({', '.join(values)}) VALUES ({marks})"
        number = self.execute(sql, *values.values()).lastrowid
        assert number is not None
        return number

    def refuse_read_only(self) -> None:
        """Make sure that the project may be written here.

        Raises
        ------
        InputError
            If it may only be read.
        """
        if self.read_only:
            raise InputError(
                f"'{self.folder}' may only be read here; copy it to where you may write."
            )

    def changed_elsewhere(self) -> bool:
        """Whether another connection has written since this was asked last, or since opening."""
        version = self._data_version()
        changed, self._seen = version != self._seen, version
        return changed

    def _data_version(self) -> int:
        """A number that SQLite changes when another connection commits."""
        with told_of_store(self.folder, self._timeout):
            return int(self._connection.execute("PRAGMA data_version").fetchone()[0])

    @contextlib.contextmanager
    def writing(self) -> Iterator[None]:
        """A transaction that alone may write: all of it is committed at the end, or nothing."""
        self.refuse_read_only()
        self._refuse_gone()
        if self._syncing is not None and self._syncing.failed:
            self._syncing = None
            self.execute("PRAGMA synchronous = FULL")  # should the disk refuse again, it is told
        with self._transaction("BEGIN IMMEDIATE"):
            version = int(self.execute("PRAGMA user_version").fetchone()[0])
            check_version(APPLICATION_ID, version, len(MIGRATIONS), str(self.folder))
            yield
        if self._syncing is not None:
            self._syncing.ask()

    def _refuse_gone(self) -> None:
        """Make sure that the open file is the one under its name: what it gets would be lost."""
        if _place(self.folder / FILE) != self._place:
            raise InputError(
                f"'{self.folder}' was removed, moved or replaced while it was open, so nothing was "
                f"changed; put it back or open it where it is now."
            )

    @contextlib.contextmanager
    def reading(self) -> Iterator[None]:
        """A transaction in which the project stands still, whatever others commit."""
        with self._transaction("BEGIN"):
            yield

    @contextlib.contextmanager
    def _transaction(self, begin: str) -> Iterator[None]:
        """Begin, then commit or roll back."""
        if self._under_way():
            raise RuntimeError("A project cannot be changed or held still inside a snapshot().")
        self.execute(begin)
        try:
            yield
            self.execute("COMMIT")
        except BaseException:
            # Where it could not write, SQLite has rolled back by itself.
            if self._under_way():
                self._connection.execute("ROLLBACK")
            self.on_rollback()
            raise

    def _under_way(self) -> bool:
        """Whether there is a transaction now."""
        return self._connection.in_transaction

    def _up_to_date_copy(self) -> sqlite3.Connection:
        """A copy in memory of an older version's file, which cannot be brought up to date itself.

        Of a file that is up to date, the connection as it is.
        """
        with told_of_store(self.folder, self._timeout):
            version = int(self._connection.execute("PRAGMA user_version").fetchone()[0])
            if version == len(MIGRATIONS):
                return self._connection
            copy = sqlite3.connect(":memory:", isolation_level=None)
            copy.row_factory = sqlite3.Row
            try:
                with contextlib.closing(self._connection) as file:
                    file.backup(copy)
            except BaseException:
                copy.close()
                raise
            return copy

    def _connect(self, mode: str) -> sqlite3.Connection:
        """Connect to the file without ever making one."""
        with told_of_store(self.folder, self._timeout):
            uri = (self.folder / FILE).absolute().as_uri()
            connection = sqlite3.connect(
                f"{uri}?mode={mode}", uri=True, timeout=self._timeout, isolation_level=None
            )
            connection.row_factory = sqlite3.Row
            try:
                for setting in _SETTINGS:
                    connection.execute(setting)
            except BaseException:
                connection.close()
                raise
            return connection


def _place(file: Path) -> tuple[int, int] | None:
    """What tells a file from every other one; None where there is none, or it cannot be seen."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def _probe(folder: Path) -> None:
    """Refuse what is no project of ours, without touching a byte of it.

    The file is looked at through SQLite and not with open(): closing an ordinary handle would
    release the locks that this process holds on it through another connection.
    """
    try:
        if not folder.exists():
            raise InputError(f"There is no project '{folder}'; create it, or check the name.")
        if not folder.is_dir():
            raise InputError(f"'{folder}' is a file; a project is a folder.")
        if not (folder / FILE).is_file():
            raise InputError(f"'{folder}' is not a forcelab project: it holds no {FILE}.")
    except OSError as error:
        raise InputError(f"'{folder}' cannot be read: {error.strerror}.") from error
    # "immutable" reads the file as it lies there: no locks, no journal, nothing made beside it.
    file, journal = folder / FILE, folder / f"{FILE}-wal"
    try:
        uri = file.absolute().as_uri() + "?mode=ro&immutable=1"
        with contextlib.closing(sqlite3.connect(uri, uri=True)) as probe:
            application_id, version, pages, page_size = (
                int(probe.execute(f"PRAGMA {name}").fetchone()[0])
                for name in ("application_id", "user_version", "page_count", "page_size")
            )
        check_version(application_id, version, len(MIGRATIONS), str(folder))
        if file.stat().st_size < pages * page_size:
            raise sqlite3.DatabaseError("the file is malformed: its end is missing")
    except sqlite3.DatabaseError as error:
        # With a journal it may be whole once SQLite has taken that into account.
        if not (journal.is_file() and journal.stat().st_size):
            raise InputError(sentence_of(folder, error, 0)) from error
