"""Connecting to a project's SQLite file in whichever way it can be read just now."""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterator
from pathlib import Path

from forcelab.errors import InputError
from forcelab.project.files import STORED_ID, STORED_VIDEO, check_file
from forcelab.project.schema import MIGRATIONS, check_version, migrate
from forcelab.project.troubles import FILE, sentence_of, told_of_store, trouble_of

__all__ = ["connected", "probe"]

_SETTINGS = (
    "PRAGMA synchronous = FULL",  # with WAL: one fsync a commit, and a commit survives a power cut
    "PRAGMA foreign_keys = ON",
    "PRAGMA trusted_schema = OFF",
    "PRAGMA cell_size_check = ON",
)

#: Bytes up to which a store is checked page by page when it is opened.
_QUICK = 4 << 20


def probe(folder: Path) -> None:
    """Refuse what is no project of ours, without touching a byte of it.

    The file is looked at through SQLite and not with open(): closing an ordinary handle would
    release the locks that this process holds on it through another connection.

    Raises
    ------
    InputError
        If it is none, a damaged one or one of a newer version.
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
        uri = file.absolute().as_uri() + "?mode=ro&immutable=1"
        with contextlib.closing(sqlite3.connect(uri, uri=True)) as connection:
            application_id, version, pages, page_size = (
                int(connection.execute(f"PRAGMA {name}").fetchone()[0])
                for name in ("application_id", "user_version", "page_count", "page_size")
            )
        check_version(application_id, version, len(MIGRATIONS), str(folder))
        if file.stat().st_size < pages * page_size:
            raise sqlite3.DatabaseError("the file is malformed: its end is missing")
    except UnicodeDecodeError as error:  # of SQLite's sentence, which quotes a damaged schema
        raise InputError(sentence_of(folder, sqlite3.DatabaseError("malformed"), 0)) from error
    except sqlite3.DatabaseError as error:
        # With a journal it may be whole once SQLite has taken that into account.
        if not _in_journal(folder):
            raise InputError(sentence_of(folder, error, 0)) from error


def connected(folder: Path, timeout: float, writable: bool) -> tuple[sqlite3.Connection, str]:
    """Connect to the file, whose tables are those of this version then.

    Parameters
    ----------
    folder : Path
        The project's folder, as :func:`probe` let it pass.
    timeout : float
        Seconds to wait for another process that is writing.
    writable : bool
        Whether this user may write there.

    Returns
    -------
    connection : sqlite3.Connection
        To the file, or to a copy of it in memory.
    refusal : str
        Why nothing can be written, in a sentence; empty where it can.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    with told_of_store(folder, timeout):
        if not writable:
            refusal = f"'{folder}' may only be read here; copy it to where you may write."
            return _ready(_unwritten(folder, timeout), folder), refusal
        try:
            return _ready(_connect(folder, "rw", timeout), folder), ""
        except sqlite3.OperationalError as error:
            if trouble_of(error) not in {"disk", "rights"}:
                raise
            refusal = (
                f"'{folder}' could only be opened to be read ({error}); make room on the disk or "
                f"check it, then open it again."
            )
        return _ready(_without_room(folder, timeout), folder), refusal


def _unwritten(folder: Path, timeout: float) -> sqlite3.Connection:
    """Connect where nothing may be written; an older version's tables are copied into memory."""
    mode = "ro"  # somebody has it open elsewhere, and what is written there is seen here
    if not all((folder / f"{FILE}-{end}").exists() for end in ("wal", "shm")):
        if _in_journal(folder):  # which cannot be read without an index beside it
            raise InputError(
                f"'{folder}' may only be read here and was not closed by whoever wrote it; open it "
                f"once where it may be written."
            )
        mode = "ro&immutable=1"  # nobody does, and locks cannot be taken
    connection = _connect(folder, mode, timeout)
    with _closed_on_error(connection):
        (version,) = connection.execute("PRAGMA user_version").fetchone()
    return connection if version == len(MIGRATIONS) else _copied(connection)


def _without_room(folder: Path, timeout: float) -> sqlite3.Connection:
    """A copy in memory of a file beside which there is no room for what SQLite makes there.

    That is the index of the journal, which those who have the file open share. Whoever has the
    file alone needs none: for as long as copying takes nobody else gets at it.
    """
    if not (folder / f"{FILE}-wal").exists():  # then nobody has it open, and nobody can
        return _copied(_connect(folder, "ro&immutable=1", timeout))
    connection = _connect(folder, "rw", timeout)
    connection.execute("PRAGMA locking_mode = EXCLUSIVE")  # before anything is read
    return _copied(connection)


def _copied(file: sqlite3.Connection) -> sqlite3.Connection:
    """A copy of a store in memory; the file is let go of."""
    copy = sqlite3.connect(":memory:", isolation_level=None)
    with contextlib.closing(file), _closed_on_error(copy):
        file.backup(copy)
    return copy


def _connect(folder: Path, mode: str, timeout: float) -> sqlite3.Connection:
    """Connect to the file without ever making one."""
    uri = f"{(folder / FILE).absolute().as_uri()}?mode={mode}"
    return sqlite3.connect(uri, uri=True, timeout=timeout, isolation_level=None)


def _ready(connection: sqlite3.Connection, folder: Path) -> sqlite3.Connection:
    """The connection as all of the program uses it, an older version brought up to date."""
    connection.row_factory = sqlite3.Row
    with _closed_on_error(connection):
        for setting in _SETTINGS:
            connection.execute(setting)
        migrate(connection, str(folder))
        _check_values(connection, folder)
    return connection


def _check_values(connection: sqlite3.Connection, folder: Path) -> None:
    """Refuse values that no forcelab writes: wrong kinds, numbers without bounds, names of files.

    Raises
    ------
    InputError
        If there are such; the sentence names the table.
    """
    if _pragma_of(connection, "page_count") * _pragma_of(connection, "page_size") <= _QUICK:
        for (found,) in connection.execute("PRAGMA quick_check"):
            if found == "ok" or found in _REMOVABLE:
                continue
            raise InputError(_damaged(folder, str(found).splitlines()[-1].replace(". ", ", ")))
    for table, wrong in _WRONG.items():
        if connection.execute(f"SELECT 1 FROM {table} WHERE {wrong} LIMIT 1").fetchone():
            raise InputError(_damaged(folder, f"the table '{table}' holds what cannot be"))
    for row in connection.execute("SELECT id, video FROM demonstration"):
        if not STORED_ID.fullmatch(row["id"]):
            raise InputError(_damaged(folder, "a demonstration's id is none"))
        if row["video"] is not None and not STORED_VIDEO.fullmatch(row["video"]):
            raise InputError(_damaged(folder, "a video has a name that forcelab does not give"))
    for row in connection.execute("SELECT id FROM recogniser"):
        if not STORED_ID.fullmatch(row["id"]):
            raise InputError(_damaged(folder, "a recogniser's id is none"))


def _damaged(folder: Path, what: str) -> str:
    return f"The store of '{folder}' is damaged ({what}); restore {FILE} from a copy."


def _pragma_of(connection: sqlite3.Connection, name: str) -> int:
    return int(connection.execute(f"PRAGMA {name}").fetchone()[0])


def _of_other_kind(kind: str, *columns: str) -> str:
    return " OR ".join(f"typeof({column}) <> '{kind}'" for column in columns)


def _beyond(*columns: str) -> str:
    """SQL that is true where a number is infinite or larger than any time of a recording."""
    return " OR ".join(f"NOT abs({column}) <= 1e12" for column in columns)


#: What is told where such a thing is read, and can be removed.
_REMOVABLE = tuple(f"CHECK constraint failed in {table}" for table in ("recogniser", "run"))
_WRONG = {
    "demonstration": " OR ".join(
        (
            _of_other_kind("text", "id", "name", "task", "channels", "source"),
            _of_other_kind("integer", "samples"),
            _of_other_kind("real", "period", "duration"),
            _beyond("samples", "period", "duration", "grid_rate", "video_offset", "video_rate"),
            "period < 1e-12 OR duration <= 0 OR grid_rate <= 1e-12 OR video_rate <= 1e-12",
            "samples < 2",
            "typeof(grid_rate) NOT IN ('real', 'null')",
            "video IS NOT NULL AND (typeof(video) <> 'text' OR typeof(video_offset) <> 'real' "
            "OR typeof(video_rate) <> 'real')",
        )
    ),
    "author": _of_other_kind("text", "name", "kind") + " OR kind NOT IN ('coder', 'model')",
    "track": _of_other_kind("text", "demonstration")
    + " OR demonstration NOT IN (SELECT id FROM demonstration)"
    + " OR author NOT IN (SELECT id FROM author)",
    "segment": " OR ".join(
        (
            _of_other_kind("real", "start", "end"),
            _of_other_kind("text", "action"),
            _beyond("start", "end"),
            "end <= start",
        )
    ),
    "edit": _of_other_kind("text", "kind", "time", "what", "removed", "inserted")
    + " OR "
    + _of_other_kind("integer", "track", "position"),
    "vocabulary": _of_other_kind("text", "task", "actions"),
    "recogniser": _of_other_kind("text", "id", "name"),
    "assignment": _of_other_kind("text", "demonstration", "author", "kind", "time"),
    "verdict": _of_other_kind("text", "demonstration", "author", "coder", "verdict", "time")
    + f" OR {_beyond('start', 'end')}",
    "note": _of_other_kind("text", "demonstration", "author", "text", "time"),
}
"""By table, what is true of rows that no forcelab writes."""


@contextlib.contextmanager
def _closed_on_error(connection: sqlite3.Connection) -> Iterator[None]:
    """Let go of a file that turns out not to be usable."""
    try:
        yield
    except BaseException:
        connection.close()
        raise


def _in_journal(folder: Path) -> bool:
    """Whether something lies in the journal that the file has not got yet."""
    journal = folder / f"{FILE}-wal"
    return journal.is_file() and journal.stat().st_size > 0
