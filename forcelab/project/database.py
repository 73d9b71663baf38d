"""The SQLite file: opened safely, every failure told in one sentence."""

from __future__ import annotations

import contextlib
import os
import re
import sqlite3
import threading
from collections.abc import Callable, Iterator
from datetime import datetime
from pathlib import Path, PurePath
from typing import Final
from urllib.parse import quote

from forcelab.errors import InputError, StoreBusyError
from forcelab.project.files import DEMONSTRATIONS, STORED_ID, STORED_VIDEO, check_file, check_folder
from forcelab.project.records import AuthorKind
from forcelab.project.schema import APPLICATION_ID, MIGRATIONS, check_version, migrate, pragma

#: Name of the SQLite file inside the project's folder.
FILE = "project.sqlite"

#: Kinds of errors: SQLite's numbers of them, and words of its texts.
_ERROR_KINDS: Final = {
    "busy": ((5, 6), ("is locked", "busy")),
    "disk": ((10, 13), ("is full", "disk I/O")),
    "rights": ((3, 8, 14), ("readonly", "unable to open", "permission denied")),
    "damaged": ((11, 26), ("malformed", "not a database", "corrupt")),
    "text": ((), ("not decode to UTF-8",)),  # Python's own, which quotes all of what it is
}


@contextlib.contextmanager
def store_errors(folder: Path, timeout: float) -> Iterator[None]:
    """Turn SQLite's errors about the outside world into one sentence."""
    try:
        yield
    except UnicodeEncodeError as error:
        raise InputError(
            f"The text {error.object!r} holds characters that are not valid Unicode, so it was "
            f"not stored; rename it."
        ) from error
    except UnicodeDecodeError as error:  # a name in the schema, or a sentence that quotes one
        raise InputError(_damaged(folder, "malformed")) from error
    except (sqlite3.IntegrityError, sqlite3.ProgrammingError) as error:
        if "FOREIGN KEY" in str(error):  # rows that refer where the program lets none refer
            raise InputError(_damaged(folder, "malformed")) from error
        raise  # the program's own mistakes
    except sqlite3.DatabaseError as error:
        kind = StoreBusyError if error_kind(error) == "busy" else InputError
        raise kind(error_sentence(folder, error, timeout)) from error


@contextlib.contextmanager
def content_errors(subject: str, cure: str = "") -> Iterator[None]:
    """Turn errors in parsing a stored text into one sentence that begins with `subject`.

    `cure` is what helps besides a copy of the store.
    """
    try:
        yield
    except (InputError, LookupError, RecursionError, TypeError, ValueError) as error:
        cures = f"{cure}, or restore" if cure else "restore"
        raise InputError(
            f"{subject} is damaged in the store; {cures} {FILE} from a copy."
        ) from error


def read_time(row: sqlite3.Row, subject: str) -> datetime:
    """The time stored in a row; `subject` begins the sentence if there is none."""
    with content_errors(subject):
        return datetime.fromisoformat(row["time"])


def error_sentence(folder: Path, error: sqlite3.DatabaseError, timeout: float) -> str:
    """What happened to the file of a project, and the cure."""
    text, kind = str(error), error_kind(error)
    if kind == "busy":
        return (
            f"'{folder}' has been kept busy by another program for more than {timeout:g} s; "
            f"try again when that is done."
        )
    if kind == "disk":
        return (
            f"'{folder}' cannot be written or read ({text}), so nothing was changed; "
            f"make room on the disk or check it."
        )
    if kind == "rights":
        return f"'{folder}' cannot be opened for writing ({text}); check who may write there."
    if kind == "damaged":
        return _damaged(folder, text)
    if kind == "text":
        column = re.search(r"column '(\w+)'", text)
        place = f"a text in column '{column[1]}'" if column else "a text"
        return _damaged(folder, f"{place} is none")
    return f"The store of '{folder}' could not be used; SQLite says '{text}'."


def error_kind(error: sqlite3.DatabaseError) -> str:
    """The kind of an SQLite error; empty for one that users seldom meet."""
    # SQLite's number tells best; Python 3.10 has only the text.
    code = getattr(error, "sqlite_errorcode", None)
    for kind, (codes, words) in _ERROR_KINDS.items():
        if code & 0xFF in codes if code is not None else any(word in str(error) for word in words):
            return kind
    return ""


class WalSync:
    """A thread that syncs SQLite's write-ahead log to the disk after each commit.

    SQLite's locks lie on the store and its index, never on the log: opening and closing it here
    releases none.
    """

    def __init__(self, journal: Path) -> None:
        self.failed = False  # once the disk has refused, commits wait for it again
        self._journal = journal
        self._requested = threading.Event()
        self._ended = False
        self._thread = threading.Thread(target=self._run, name="forcelab sync", daemon=True)
        self._thread.start()

    def ask(self) -> None:
        """Sync all that is committed by now."""
        self._requested.set()

    def close(self) -> None:
        """Sync the rest and stop."""
        self._ended = True
        self._requested.set()
        self._thread.join()

    def _run(self) -> None:
        """Sync once for all requests that came meanwhile."""
        while self._requested.is_set() or not self._ended:
            self._requested.wait()
            self._requested.clear()
            try:
                with self._journal.open("rb+") as file:
                    os.fsync(file.fileno())
            except FileNotFoundError:
                pass  # all of it was moved into the store, which SQLite syncs itself
            except OSError:
                self.failed = True
                return


_SETTINGS = (
    "PRAGMA synchronous = FULL",  # with WAL: one fsync a commit, and a commit survives a power cut
    "PRAGMA fullfsync = ON",  # macOS alone: else its disk may keep a commit in its cache
    "PRAGMA foreign_keys = ON",
    "PRAGMA trusted_schema = OFF",
    "PRAGMA cell_size_check = ON",
)

#: Bytes up to which a store is checked page by page when it is opened.
_QUICK_CHECK_BYTES = 4 << 20


def probe(folder: Path) -> None:
    """Refuse a folder that holds no project of ours, without touching a byte of it.

    The file is read through SQLite and not with open(): closing an ordinary handle would release
    the locks that this process holds on it through another connection.
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
    for file in (folder / f"{FILE}{end}" for end in ("", "-wal", "-shm", "-journal")):
        check_file(file)
    # "immutable" reads the file as it lies there: no locks, no journal, nothing made beside it.
    file = folder / FILE
    try:
        uri = store_uri(file.absolute(), "ro&immutable=1")
        with contextlib.closing(sqlite3.connect(uri, uri=True)) as connection:
            application_id, version, pages, page_size = (
                pragma(connection, name)
                for name in ("application_id", "user_version", "page_count", "page_size")
            )
        check_version(application_id, version, len(MIGRATIONS), str(folder))
        if file.stat().st_size < pages * page_size:
            raise sqlite3.DatabaseError("the file is malformed: its end is missing")
    except UnicodeDecodeError as error:  # of SQLite's sentence, which quotes a damaged schema
        raise InputError(_damaged(folder, "malformed")) from error
    except sqlite3.DatabaseError as error:
        # With a journal it may be whole once SQLite has taken that into account.
        if not _has_journal(folder):
            raise InputError(error_sentence(folder, error, 0)) from error


def open_store(folder: Path, timeout: float, writable: bool) -> tuple[sqlite3.Connection, str]:
    """Connect to the file, or to a copy of it in memory, with this version's tables.

    The second value says in a sentence why nothing can be written; empty where it can.
    """
    with store_errors(folder, timeout):
        if not writable:
            refusal = f"'{folder}' may only be read here; copy it to where you may write."
            return _prepare(_connect_read_only(folder, timeout), folder), refusal
        try:
            return _prepare(_connect(folder, "rw", timeout), folder), ""
        except sqlite3.OperationalError as error:
            if error_kind(error) not in {"disk", "rights"}:
                raise
            refusal = (
                f"'{folder}' could only be opened to be read ({error}); make room on the disk or "
                f"check it, then open it again."
            )
        return _prepare(_connect_without_room(folder, timeout), folder), refusal


def _connect_read_only(folder: Path, timeout: float) -> sqlite3.Connection:
    """Connect where nothing may be written; an older version's tables are copied into memory."""
    mode = "ro"  # somebody has it open elsewhere, and what is written there is seen here
    if not all((folder / f"{FILE}-{end}").exists() for end in ("wal", "shm")):
        if _has_journal(folder):  # which cannot be read without an index beside it
            raise InputError(
                f"'{folder}' may only be read here and was not closed by whoever wrote it; open it "
                f"once where it may be written."
            )
        mode = "ro&immutable=1"  # nobody does, and locks cannot be taken
    connection = _connect(folder, mode, timeout)
    with _closed_on_error(connection):
        version = pragma(connection, "user_version")
    return connection if version == len(MIGRATIONS) else _copy_in_memory(connection)


def _connect_without_room(folder: Path, timeout: float) -> sqlite3.Connection:
    """A copy in memory of a file beside which there is no room for what SQLite makes there.

    That is the index of the journal, which those who have the file open share. Whoever has the
    file alone needs none: for as long as copying takes nobody else gets at it.
    """
    if not (folder / f"{FILE}-wal").exists():  # then nobody has it open, and nobody can
        return _copy_in_memory(_connect(folder, "ro&immutable=1", timeout))
    connection = _connect(folder, "rw", timeout)
    connection.execute("PRAGMA locking_mode = EXCLUSIVE")  # before anything is read
    return _copy_in_memory(connection)


def _copy_in_memory(file: sqlite3.Connection) -> sqlite3.Connection:
    """A copy of a store in memory; the file is let go of."""
    copy = sqlite3.connect(":memory:", isolation_level=None)
    with contextlib.closing(file), _closed_on_error(copy):
        file.backup(copy)
    return copy


def _connect(folder: Path, mode: str, timeout: float) -> sqlite3.Connection:
    """Connect to the file without ever making one."""
    uri = store_uri((folder / FILE).absolute(), mode)
    return sqlite3.connect(uri, uri=True, timeout=timeout, isolation_level=None)


def store_uri(file: PurePath, mode: str) -> str:
    """The address of an absolute path for SQLite, which takes no machine's name before the path.

    ``Path.as_uri`` puts one there for a folder that Windows finds in the network.
    """
    path = quote(os.fsencode(file.as_posix()), safe="/:")
    return f"file://{'' if path.startswith('/') else '/'}{path}?mode={mode}"


def _prepare(connection: sqlite3.Connection, folder: Path) -> sqlite3.Connection:
    """The connection as all of the program uses it, an older version brought up to date."""
    connection.row_factory = sqlite3.Row
    with _closed_on_error(connection):
        for setting in _SETTINGS:
            connection.execute(setting)
        migrate(connection, str(folder))
        _check_values(connection, folder)
    return connection


def _check_values(connection: sqlite3.Connection, folder: Path) -> None:
    """Refuse values that no forcelab writes: wrong types, numbers without bounds, file names."""
    if pragma(connection, "page_count") * pragma(connection, "page_size") <= _QUICK_CHECK_BYTES:
        for (message,) in connection.execute("PRAGMA quick_check"):
            if message == "ok" or message in _REMOVABLE:
                continue
            raise InputError(_damaged(folder, str(message).splitlines()[-1].replace(". ", ", ")))
    for table, conditions in _IMPOSSIBLE.items():
        violation = " OR ".join(conditions)
        if connection.execute(f"SELECT 1 FROM {table} WHERE {violation} LIMIT 1").fetchone():
            raise InputError(_damaged(folder, f"the table '{table}' holds what cannot be"))
    for query, pattern, damage in (
        ("SELECT id FROM demonstration", STORED_ID, "a demonstration's id is none"),
        ("SELECT file FROM video", STORED_VIDEO, "a video has a name that forcelab does not give"),
        ("SELECT id FROM recogniser", STORED_ID, "a recogniser's id is none"),
    ):
        if not all(pattern.fullmatch(name) for (name,) in connection.execute(query)):
            raise InputError(_damaged(folder, damage))


def _damaged(folder: Path, damage: str) -> str:
    return f"The store of '{folder}' is damaged ({damage}); restore {FILE} from a copy."


def _not_of_type(kind: str, *columns: str) -> str:
    return " OR ".join(f"typeof({column}) <> '{kind}'" for column in columns)


def _beyond(*columns: str) -> str:
    """SQL that is true where a number is infinite or larger than any time of a recording."""
    return " OR ".join(f"NOT abs({column}) <= 1e12" for column in columns)


#: What is told where such a thing is read, and can be removed.
_REMOVABLE = tuple(f"CHECK constraint failed in {table}" for table in ("recogniser", "run"))
#: By table, each of what is true of rows that no forcelab writes.
_IMPOSSIBLE = {
    "demonstration": (
        _not_of_type("text", "id", "name", "task", "channels", "source"),
        _not_of_type("integer", "samples"),
        _not_of_type("real", "period", "duration"),
        _beyond("samples", "period", "duration", "grid_rate"),
        "period < 1e-12 OR duration <= 0 OR grid_rate <= 1e-12",
        "samples < 2",
        "typeof(grid_rate) NOT IN ('real', 'null')",
        "coalesce(video, video_offset, video_rate) IS NOT NULL",
    ),
    "video": (
        _not_of_type("text", "demonstration", "name", "file"),
        _not_of_type("integer", "position"),
        _not_of_type("real", "offset", "rate"),
        _beyond("position", "offset", "rate"),
        "position < 0 OR rate <= 1e-12",
        "demonstration NOT IN (SELECT id FROM demonstration)",
    ),
    "author": (_not_of_type("text", "name", "kind"), "kind NOT IN ('coder', 'model')"),
    "track": (
        _not_of_type("text", "demonstration"),
        "demonstration NOT IN (SELECT id FROM demonstration)",
        "author NOT IN (SELECT id FROM author)",
    ),
    "segment": (
        _not_of_type("real", "start", "end"),
        _not_of_type("text", "action"),
        _beyond("start", "end"),
        "end <= start",
    ),
    "edit": (
        _not_of_type("text", "kind", "time", "what", "removed", "inserted"),
        _not_of_type("integer", "track", "position"),
    ),
    "vocabulary": (_not_of_type("text", "task", "actions"),),
    "recogniser": (_not_of_type("text", "id", "name"),),
    "assignment": (_not_of_type("text", "demonstration", "author", "kind", "time"),),
    "verdict": (
        _not_of_type("text", "demonstration", "author", "coder", "verdict", "time"),
        _beyond("start", "end"),
    ),
    "note": (_not_of_type("text", "demonstration", "author", "text", "time"),),
}


@contextlib.contextmanager
def _closed_on_error(connection: sqlite3.Connection) -> Iterator[None]:
    """Let go of a file that turns out not to be usable."""
    try:
        yield
    except BaseException:
        connection.close()
        raise


def _has_journal(folder: Path) -> bool:
    """Whether something lies in the journal that the file has not got yet."""
    journal = folder / f"{FILE}-wal"
    return journal.is_file() and journal.stat().st_size > 0


#: Free pages of the store that are given back to the disk: so many bytes, and this share of it.
VACUUM_BYTES, VACUUM_SHARE = 1 << 20, 0.25
#: What a column holds.
Value = str | int | float | None


class Database:
    """One connection to a project's SQLite file, for the thread that made it."""

    def __init__(self, folder: Path, timeout: float) -> None:
        self.folder = folder
        self.on_rollback: Callable[[], None] = lambda: None  # drops what was cached meanwhile
        self._timeout = timeout  # seconds to wait for another process that is writing
        self._writing = False
        self._syncing: WalSync | None = None
        probe(folder)
        writable = os.access(folder, os.W_OK) and os.access(folder / FILE, os.W_OK)
        self._connection, self._refusal = open_store(folder, timeout, writable)
        with _closed_on_error(self._connection):
            self._seen_version = self.pragma("data_version")
            self._identity = _file_identity(folder / FILE)

    @property
    def read_only(self) -> bool:
        """Whether the project may not or cannot be written here."""
        return bool(self._refusal)

    @staticmethod
    def create(folder: Path) -> None:
        """Make the file in an empty folder, without tables yet."""
        with store_errors(folder, 0):
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
            self._syncing = WalSync(self.folder / f"{FILE}-wal")

    def execute(self, sql: str, *values: Value) -> sqlite3.Cursor:
        """Carry out one statement."""
        with store_errors(self.folder, self._timeout):
            return self._connection.execute(sql, values)

    def all(self, sql: str, *values: Value) -> list[sqlite3.Row]:
        """All rows of a query."""
        with store_errors(self.folder, self._timeout):
            return self._connection.execute(sql, values).fetchall()

    def one(self, sql: str, *values: Value) -> sqlite3.Row | None:
        """The first row of a query, if there is one."""
        rows = self.all(sql, *values)
        return rows[0] if rows else None

    def pragma(self, name: str) -> int:
        """The value of a whole-number pragma."""
        with store_errors(self.folder, self._timeout):
            return pragma(self._connection, name)

    def insert(self, table: str, **values: Value) -> int:
        """Insert a row; gives its number."""
        marks = ", ".join("?" * len(values))
        sql = f"INSERT INTO {table} ({', '.join(values)}) VALUES ({marks})"
        number = self.execute(sql, *values.values()).lastrowid
        assert number is not None
        return number

    def demonstration(self, id_: str) -> sqlite3.Row:
        """The row of a demonstration; InputError if there is none of this id."""
        row = self.one("SELECT * FROM demonstration WHERE id = ?", id_)
        if row is None:
            if self.one("SELECT id FROM demonstration WHERE name = ?", id_) is not None:
                raise InputError(
                    f"'{id_}' is the name of a demonstration in '{self.folder}', not its id; "
                    f"demonstrations.id_of('{id_}') gives that."
                )
            raise InputError(f"There is no demonstration '{id_}' in '{self.folder}'.")
        return row

    def demonstration_ids(self) -> set[str]:
        return {row["id"] for row in self.all("SELECT id FROM demonstration")}

    def demonstration_folder(self, id_: str) -> Path:
        """The folder of a demonstration, which need not exist; InputError if it is a link."""
        if not STORED_ID.fullmatch(id_):
            raise InputError(f"There is no demonstration '{id_}' in '{self.folder}'.")
        home = self.folder / DEMONSTRATIONS / id_
        check_folder(home.parent)
        check_folder(home)
        return home

    def author_kind(self, author: str) -> AuthorKind | None:
        """Whether an author is a coder or a model; None for an unknown one."""
        row = self.one("SELECT kind FROM author WHERE name = ?", author)
        return row["kind"] if row else None

    def refuse_read_only(self) -> None:
        """Raise InputError if the project can only be read here."""
        if self._refusal:
            raise InputError(self._refusal)

    def changed_elsewhere(self) -> bool:
        """Whether another connection has written since this was asked last, or since opening."""
        version = self.pragma("data_version")  # one that SQLite changes when another commits
        changed, self._seen_version = version != self._seen_version, version
        return changed

    @contextlib.contextmanager
    def writing(self) -> Iterator[None]:
        """A transaction that alone may write: all of it is committed at the end, or nothing.

        Inside another one it is part of that.
        """
        if self._writing:
            yield
            return
        self.refuse_read_only()
        self._refuse_gone()
        if self._syncing is not None and self._syncing.failed:
            self._syncing = None
            self.execute("PRAGMA synchronous = FULL")  # should the disk refuse again, it is told
        with self._transaction("BEGIN IMMEDIATE"):
            version = self.pragma("user_version")
            check_version(APPLICATION_ID, version, len(MIGRATIONS), str(self.folder))
            self._writing = True
            try:
                yield
            finally:
                self._writing = False
        if self._syncing is not None:
            self._syncing.ask()

    def _refuse_gone(self) -> None:
        """Make sure that the open file is the one under its name: what it gets would be lost."""
        if _file_identity(self.folder / FILE) != self._identity:
            raise InputError(
                f"'{self.folder}' was removed, moved or replaced while it was open, so nothing was "
                f"changed; put it back or open it where it is now."
            )

    def reading(self) -> contextlib.AbstractContextManager[None]:
        """A transaction in which the project stands still, whatever others commit."""
        return self._transaction("BEGIN")

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

    @contextlib.contextmanager
    def without_trigger(self, trigger: str) -> Iterator[None]:
        """Lift one of the triggers by which the store refuses to change what people did.

        Only inside a transaction, in which no other process can write: it is back at its end,
        whatever happens.
        """
        (keeper,) = self.all("SELECT sql FROM sqlite_schema WHERE name = ?", trigger)
        self.execute(f"DROP TRIGGER {trigger}")
        yield
        self.execute(keeper["sql"])

    def give_back(self) -> None:
        """Make the file smaller where much of it is free; otherwise the next run fills that.

        SQLite writes it anew, whole or not at all. Where it cannot, as the disk is full or another
        program is at work, the file stays as large as it was.
        """
        pages, free, size = map(self.pragma, ("page_count", "freelist_count", "page_size"))
        if free * size < VACUUM_BYTES or free < VACUUM_SHARE * pages:
            return
        with contextlib.suppress(InputError):
            self.execute("VACUUM")
            self.execute("PRAGMA wal_checkpoint(TRUNCATE)")


def fits(number: int) -> bool:
    """Whether SQLite can hold a whole number: larger ones are none of any row."""
    return -(2**63) <= number < 2**63


def _file_identity(file: Path) -> tuple[int, int] | None:
    """What tells a file from every other one; None where there is none, or it cannot be seen."""
    try:
        status = file.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino
