"""The SQLite file: opened safely, every failure told in one sentence."""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path

from forcelab.errors import InputError
from forcelab.project.opening import connected, probe
from forcelab.project.schema import APPLICATION_ID, MIGRATIONS, check_version
from forcelab.project.syncing import Syncing
from forcelab.project.troubles import FILE, told_of_store

__all__ = ["FILE", "Database", "Value", "fits"]

#: What a column holds.
Value = str | int | float | None


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
        probe(folder)
        writable = os.access(folder, os.W_OK) and os.access(folder / FILE, os.W_OK)
        self._connection, self._refusal = connected(folder, timeout, writable)
        try:
            self._seen = self._data_version()
            self._place = _place(folder / FILE)
        except BaseException:
            self._connection.close()
            raise

    @property
    def read_only(self) -> bool:
        """Whether the project may not or cannot be written here."""
        return bool(self._refusal)

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
            If it can only be read.
        """
        if self._refusal:
            raise InputError(self._refusal)

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


def fits(number: int) -> bool:
    """Whether SQLite can hold a whole number: larger ones are none of any row."""
    return -(2**63) <= number < 2**63


def _place(file: Path) -> tuple[int, int] | None:
    """What tells a file from every other one; None where there is none, or it cannot be seen."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino
