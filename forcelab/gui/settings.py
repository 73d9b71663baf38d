"""What the window remembers: one ini file of plain values, typed when they are read.

Only text, numbers, flags, lists of text and bytes are written. Anything else Qt would store as a
pickle, and a pickle in a settings file is a program that somebody else wrote: a file that holds
one is put aside unread.
"""

from __future__ import annotations

import base64
import binascii
import getpass
import json
import logging
import math
import os
import re
from collections.abc import Callable, Collection, Sequence
from functools import cache
from pathlib import Path
from typing import TypeVar

from PySide6.QtCore import QSettings, QStandardPaths

from forcelab.text import tidy_name

log = logging.getLogger(__name__)

#: How many projects the list of recent ones holds.
RECENT = 10

#: A value that Qt would deserialise; a text that looks like it is stored with a second @.
_VARIANT = re.compile(rb"(?:^[^=\n]*=|,)\s*\"?@Variant\(", re.MULTILINE)

ValueT = TypeVar("ValueT")


def settings() -> QSettings:
    """The settings of this coder on this machine.

    They lie in the platform's folder for configuration; the environment variable
    ``FORCELAB_SETTINGS`` names another file.
    """
    return _opened(_path())


def text(key: str, default: str = "") -> str:
    """A stored text."""
    return _read(key, default, str)


def number(
    key: str, default: float, *, lowest: float = -math.inf, highest: float = math.inf
) -> float:
    """A stored number; one outside of ``lowest`` to ``highest`` counts as broken."""

    def checked(stored: str) -> float:
        value = float(stored)
        if not lowest <= value <= highest:
            raise ValueError(f"{value} is not within {lowest} to {highest}")
        return value

    return _read(key, default, checked)


def flag(key: str, default: bool = False) -> bool:
    """A stored boolean."""
    return _read(key, default, lambda stored: {"true": True, "false": False}[stored.lower()])


def strings(key: str, default: Sequence[str] = ()) -> tuple[str, ...]:
    """A stored list of texts."""

    def checked(stored: str) -> tuple[str, ...]:
        items = json.loads(stored)
        if not isinstance(items, list) or not all(isinstance(item, str) for item in items):
            raise ValueError("it is no list of texts")
        return tuple(items)

    return _read(key, tuple(default), checked)


def data(key: str, default: bytes = b"") -> bytes:
    """Stored bytes, such as the layout of a window."""
    return _read(key, default, lambda stored: base64.b64decode(stored, validate=True))


def store(key: str, value: str | float | bool | bytes | Sequence[str]) -> None:
    """Remember a value, at once also on disk.

    Where the disk refuses it is remembered until the program ends, and the log says so.
    """
    stored = settings()
    if isinstance(value, bool):
        stored.setValue(key, "true" if value else "false")
    elif isinstance(value, (int, float)):
        stored.setValue(key, repr(value))
    elif isinstance(value, str):
        stored.setValue(key, value)
    elif isinstance(value, bytes):
        stored.setValue(key, base64.b64encode(value).decode("ascii"))
    else:
        stored.setValue(key, json.dumps(list(value)))
    _written(stored)


def forget(key: str) -> None:
    """Forget a value, so that its default counts again."""
    stored = settings()
    stored.remove(key)
    _written(stored)


def recent_projects() -> tuple[Path, ...]:
    """The projects opened last, the latest first; some may have been moved or deleted since."""
    return tuple(map(Path, strings("projects/recent")))


def remember_project(path: Path) -> None:
    """Put a project at the head of the recent ones."""
    project = str(Path(path).resolve())
    others = [recent for recent in strings("projects/recent") if recent != project]
    store("projects/recent", [project, *others][:RECENT])


def documents_folder() -> Path:
    """Where this user's documents lie."""
    where = QStandardPaths.writableLocation(QStandardPaths.StandardLocation.DocumentsLocation)
    return Path(where) if where and Path(where).is_dir() else Path.home()


def is_folder(path: Path) -> bool:
    """Whether a folder that was remembered can still be found."""
    try:
        return path.is_dir()
    except OSError:  # it lies where this user may not look any more
        return False


def forget_project(path: Path) -> None:
    """Remove a project from the recent ones."""
    others = [recent for recent in strings("projects/recent") if recent != str(path)]
    store("projects/recent", others)


def coder(project: Path | None = None, known: Collection[str] = ()) -> str:
    """The name under which one labels in a project.

    That is the last one in this project; if there is none, as in a project that was moved, the last
    one anywhere among the coders that the project knows; or else the account's. In a new project
    nobody labels under the name of a coder of another one.
    """
    stored = tidy_name(text(key_of("coders", project))) if project is not None else ""
    used = (tidy_name(name) for name in (text("coder/name"), *strings("coder/names")))
    return stored or next((name for name in used if name in known), "") or account()


def remember_coder(project: Path | None, name: str) -> None:
    """Store who labels in a project, and the last names used in any."""
    if project is not None:
        store(key_of("coders", project), name)
    others = [name_used for name_used in strings("coder/names") if name_used != name]
    store("coder/names", [name, *others][:RECENT])
    store("coder/name", name)


def key_of(section: str, project: Path, *parts: str) -> str:
    """The key of something of a project, such as of a task, which may be called anything."""
    names = str(project.resolve()), *parts
    return "/".join([section, *(re.sub(r"[/\\]", "|", name) for name in names)])


def account() -> str:
    """The name of the account, with a capital."""
    try:
        name = getpass.getuser()
    except (OSError, KeyError, ImportError):  # what it raises depends on Python and platform
        name = ""
    return name[:1].upper() + name[1:] or "Coder"


def _path() -> Path:
    if named := os.environ.get("FORCELAB_SETTINGS"):
        return Path(named)
    # Not AppConfigLocation: that depends on whether the application has got its name yet.
    folder = QStandardPaths.writableLocation(QStandardPaths.StandardLocation.GenericConfigLocation)
    return Path(folder) / "forcelab" / "settings.ini"


@cache
def _opened(path: Path) -> QSettings:
    """The file, which is put aside if Qt would have to unpickle something in it."""
    try:
        suspicious = _VARIANT.search(path.read_bytes()) is not None
    except FileNotFoundError:
        suspicious = False
    except OSError as error:
        log.warning("The settings in %s cannot be read (%s); the defaults are used.", path, error)
        suspicious = False
    if suspicious:
        refused = path.with_name(path.name + ".refused")
        log.warning("%s holds what forcelab never writes; it now lies in %s.", path, refused)
        path.replace(refused)
    return QSettings(str(path), QSettings.Format.IniFormat)


def _written(stored: QSettings) -> None:
    """Write changes to the disk now: a crash must not cost the coder's keys and layout."""
    stored.sync()
    if stored.status() != QSettings.Status.NoError:
        log.warning("The settings cannot be written to %s.", stored.fileName())


def _read(key: str, default: ValueT, checked: Callable[[str], ValueT]) -> ValueT:
    """A value as `checked` parses its text; the default if it is missing or broken."""
    stored = settings()
    if not stored.contains(key):
        return default
    value = stored.value(key)
    try:
        if not isinstance(value, str):
            raise TypeError("it is no text")
        return checked(value)
    except (ValueError, KeyError, TypeError, binascii.Error) as error:
        log.warning(
            "'%s' in %s is broken (%s); its default is used.", key, stored.fileName(), error
        )
        return default
