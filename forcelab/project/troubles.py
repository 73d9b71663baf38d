"""What is wrong with a store, in one sentence with the cure."""

from __future__ import annotations

import contextlib
import re
import sqlite3
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Final

from forcelab.errors import InputError, StoreBusyError

__all__ = ["FILE", "sentence_of", "time_of", "told_of_content", "told_of_store", "trouble_of"]

#: Name of the SQLite file inside the project's folder.
FILE = "project.sqlite"

#: Kinds of trouble: SQLite's numbers of them, and words of its texts.
_TROUBLES: Final = {
    "busy": ((5, 6), ("is locked", "busy")),
    "disk": ((10, 13), ("is full", "disk I/O")),
    "rights": ((3, 8, 14), ("readonly", "unable to open", "permission denied")),
    "damaged": ((11, 26), ("malformed", "not a database", "corrupt")),
    "text": ((), ("not decode to UTF-8",)),  # Python's own, which quotes all of what it is
}


@contextlib.contextmanager
def told_of_store(folder: Path, timeout: float) -> Iterator[None]:
    """Turn what SQLite says about the outside world into one sentence."""
    try:
        yield
    except UnicodeEncodeError as error:
        raise InputError(
            f"The text {error.object!r} holds characters that are not valid Unicode, so it was "
            f"not stored; rename it."
        ) from error
    except (
        UnicodeDecodeError
    ) as error:  # a name in the schema, or SQLite's sentence that quotes one
        raise InputError(sentence_of(folder, sqlite3.DatabaseError("malformed"), 0)) from error
    except (sqlite3.IntegrityError, sqlite3.ProgrammingError):
        raise  # the program's own mistakes
    except sqlite3.DatabaseError as error:
        kind = StoreBusyError if trouble_of(error) == "busy" else InputError
        raise kind(sentence_of(folder, error, timeout)) from error


@contextlib.contextmanager
def told_of_content(what: str, cure: str = "") -> Iterator[None]:
    """Turn what is wrong with a stored text that is being parsed into one sentence.

    Parameters
    ----------
    what : str
        Whose text it is, as a sentence begins.
    cure : str
        What helps besides a copy of the store.
    """
    try:
        yield
    except (InputError, LookupError, RecursionError, TypeError, ValueError) as error:
        cures = f"{cure}, or restore" if cure else "restore"
        raise InputError(f"{what} is damaged in the store; {cures} {FILE} from a copy.") from error


def time_of(row: sqlite3.Row, what: str) -> datetime:
    """When something happened, as stored in a row; `what` begins the sentence where it is none."""
    with told_of_content(what):
        return datetime.fromisoformat(row["time"])


def sentence_of(folder: Path, error: sqlite3.DatabaseError, timeout: float) -> str:
    """What happened to the file of a project, and the cure."""
    text, kind = str(error), trouble_of(error)
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
        return f"The store of '{folder}' is damaged ({text}); restore {FILE} from a copy."
    if kind == "text":
        column = re.search(r"column '(\w+)'", text)
        what = f"a text in column '{column[1]}'" if column else "a text"
        return f"The store of '{folder}' is damaged ({what} is none); restore {FILE} from a copy."
    return f"The store of '{folder}' could not be used; SQLite says '{text}'."


def trouble_of(error: sqlite3.DatabaseError) -> str:
    """Which kind of trouble SQLite is in; empty for one that users seldom meet."""
    # SQLite's number tells best; Python 3.10 has only the text.
    code = getattr(error, "sqlite_errorcode", None)
    for kind, (codes, words) in _TROUBLES.items():
        if code & 0xFF in codes if code is not None else any(word in str(error) for word in words):
            return kind
    return ""
