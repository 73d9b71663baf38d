"""Foreign formats: a module each, told apart by content; other packages may bring more."""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from typing import Final, Protocol, cast

from forcelab.errors import InputError
from forcelab.formats.recording import ColumnUse, ReadOptions, Recording
from forcelab.formats.signatures import (
    BAG_METADATA,
    LEROBOT_INFO,
    announced_kind,
    is_bag_folder,
    is_lerobot_folder,
    seems_to_be,
)

__all__ = ["HEAD_BYTES", "Format", "all_formats", "format_names", "identify", "preview", "read"]

#: Where other packages say that they read a format: an entry point whose object is a `Format`.
ENTRY_POINTS: Final = "forcelab.formats"
#: Bytes of a file that are looked at to tell its format.
HEAD_BYTES: Final = 64 * 1024


@dataclass(frozen=True, slots=True)
class Format:
    """A format that can be read."""

    name: str  #: unique
    description: str  #: a few words that may follow "can read"
    module: str  #: reads it; imported when it is needed
    #: first bytes that make it worth importing the module; empty: any that do not announce another
    #: kind of file
    starts: tuple[bytes, ...] = ()
    columns: bool = False  #: whether files have columns or the like, which `preview` tells


class _Reader(Protocol):
    """The interface of a format's module; `preview` only where its files have columns."""

    def sniff(self, path: Path, head: bytes) -> bool:
        """Whether the file (or folder), whose first 64 KiB are `head`, is of this format."""

    def read(self, path: Path, options: ReadOptions) -> list[Recording]:
        """Read the whole file; errors are :class:`InputError`."""

    def preview(self, path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
        """What the columns would be read as."""


#: In the order in which they are tried; those of other packages come next, then `_LATE`.
_EARLY: Final = (
    Format(
        name="archive",
        description="archives of forcelab projects",
        module="forcelab.formats.archive",
        starts=(b"PK",),
    ),
    Format(
        name="excel",
        description="Excel workbooks (*.xlsx)",
        module="forcelab.formats.excel",
        starts=(b"PK",),
        columns=True,
    ),
    Format(
        name="pdl",
        description="the paper's databases (*.pdl)",
        module="forcelab.formats.pdl",
        starts=(b"\x80", b"]", b"}", b"(", b"c"),
    ),
    Format(
        name="rosbag",
        description="ROS bags",
        module="forcelab.formats.rosbag",
        starts=(b"#ROSBAG V", b"\x89MCAP", b"SQLite format 3\x00", b"rosbag2_bagfile_information:"),
        columns=True,
    ),
    Format(
        name="xdf",
        description="XDF files (Lab Streaming Layer)",
        module="forcelab.formats.xdf",
        starts=(b"XDF:",),
        columns=True,
    ),
    Format(
        name="c3d",
        description="C3D files of motion capture",
        module="forcelab.formats.c3d",
        # The block of the parameters, and a mark.
        starts=tuple(bytes([block, 0x50]) for block in range(2, 256)),
        columns=True,
    ),
    Format(
        name="tdms",
        description="TDMS files (LabVIEW)",
        module="forcelab.formats.tdms",
        starts=(b"TDSm",),
        columns=True,
    ),
    Format(
        name="parquet",
        description="Parquet and Feather (Arrow) tables",
        module="forcelab.formats.parquet",
        starts=(b"PAR1", b"ARROW1\x00\x00", b"\xff\xff\xff\xff"),
        columns=True,
    ),
    Format(
        name="lerobot",
        description="LeRobot datasets",
        module="forcelab.formats.lerobot",
        starts=(b"{",),
        columns=True,
    ),
)
#: Any text might be a table; what is told by its packets wherever they start is never text.
_LATE: Final = (
    Format(
        name="table",
        description="tables as text (CSV, TSV, columns)",
        module="forcelab.formats.table",
        columns=True,
    ),
    Format(
        name="optoforce",
        description="raw dumps of OptoForce sensors",
        module="forcelab.formats.optoforce",
    ),
)


@cache
def all_formats() -> tuple[Format, ...]:
    """All readable formats, in the order in which they are tried; other packages may add some."""
    formats = {format_.name: format_ for format_ in (*_EARLY, *_LATE)}
    added: list[Format] = []
    for entry in entry_points(group=ENTRY_POINTS):
        try:
            extra = entry.load()
        except (ImportError, AttributeError) as error:
            raise InputError(
                f"The format '{entry.name}' of another package cannot be loaded ({error}); update "
                f"or uninstall that package."
            ) from error
        if not isinstance(extra, Format) or extra.name in formats:
            raise InputError(
                f"'{entry.value}' brings no new format under '{ENTRY_POINTS}'; update or uninstall "
                f"its package."
            )
        formats[extra.name] = extra
        added.append(extra)
    return (*_EARLY, *added, *_LATE)


def format_names() -> tuple[str, ...]:
    return tuple(format_.name for format_ in all_formats())


def identify(path: str | os.PathLike[str]) -> Format:
    """Tell an existing file's format by its content; the error says what the file seems to be."""
    path = Path(path)
    with naming_file(path):
        head = file_head(path)
        announced = announced_kind(head)
        for format_ in all_formats():
            worthwhile = head.startswith(format_.starts) if format_.starts else not announced
            if worthwhile and _module(format_).sniff(path, head):
                return format_
        kind = seems_to_be(head)
        if kind.endswith("video"):
            raise InputError(
                f"'{path}' looks like {kind}, which belongs to a demonstration: import the "
                f"recording first, then attach the video to it (forcelab attach; in the window "
                f"File > Attach video, or a right click in the list)."
            )
        from forcelab.formats.label_files import identify_labels  # which knows this module

        if identify_labels(path, head) is not None:
            raise InputError(
                f"'{path}' holds labels, which belong to a demonstration: import the recording "
                f"first, then its labels (forcelab labels; in the window File > Import labels)."
            )
        readable = "; ".join(format_.description for format_ in all_formats())
        raise InputError(f"'{path}' looks like {kind}; what can be read: {readable}.")


def read(path: str | os.PathLike[str], options: ReadOptions | None = None) -> list[Recording]:
    """Read the recordings in a file of any format.

    Parameters
    ----------
    path : path-like
        The file.
    options : ReadOptions, optional
        How the file is to be understood where it does not say so itself.

    Returns
    -------
    list of Recording
        At least one, in the file's order.

    Raises
    ------
    InputError
        If the file cannot be read. The sentence is one line and names the file.
    """
    path, options = Path(path), options or ReadOptions()
    format_ = identify(path) if options.format is None else _named_format(path, options.format)
    with naming_file(path):
        recordings = _module(format_).read(path, options)
        if not recordings:
            raise InputError(f"'{path}' holds no recording; there is nothing to import.")
        return recordings


def preview(path: str | os.PathLike[str], options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the columns of a file, or what is like them, would be read as, by its first rows.

    Empty where files of its format have none. Errors are those of :func:`read`.
    """
    path = Path(path)
    format_ = identify(path)
    with naming_file(path):
        return _module(format_).preview(path, options) if format_.columns else ()


def _named_format(path: Path, name: str) -> Format:
    """The format of that name, once the file is known to be readable."""
    with naming_file(path):
        file_head(path)
        for format_ in all_formats():
            if format_.name == name:
                return format_
        raise InputError(f"There is no format '{name}'; choose one of {', '.join(format_names())}.")


def file_head(path: Path) -> bytes:
    """The first bytes of a regular file, at least one; of a bag or dataset, of its metadata."""
    if is_bag_folder(path):
        path = path / BAG_METADATA
    elif is_lerobot_folder(path):
        path = path / LEROBOT_INFO
    mode = path.stat().st_mode
    if stat.S_ISDIR(mode):
        raise InputError(f"'{path}' is a folder; name the files in it, such as {path}/*.csv.")
    if not stat.S_ISREG(mode):
        raise InputError(f"'{path}' is a device or pipe; save what it gives as a file first.")
    with path.open("rb") as stream:
        head = stream.read(HEAD_BYTES)
    if not head:
        raise InputError(f"'{path}' is empty (0 bytes); copy it again from where it is from.")
    return head


def _module(format_: Format) -> _Reader:
    return cast(_Reader, import_module(format_.module))


@contextlib.contextmanager
def naming_file(path: Path) -> Iterator[None]:
    """Re-raise errors as one line that names the file."""
    try:
        yield
    except InputError as error:
        sentence = str(error) if path.name in str(error) else f"'{path}': {error}"
        # Who tells it may know a cure of its kind of error.
        raise type(error)(_one_line(sentence)) from error
    except FileNotFoundError as error:
        sentence = f"'{path}' does not exist; check its spelling and folder."
        raise InputError(_one_line(sentence)) from error
    except OSError as error:
        reason = error.strerror or str(error)
        sentence = f"'{path}' cannot be read: {reason}; check its rights and its disk."
        raise InputError(_one_line(sentence)) from error


def _one_line(text: str) -> str:
    """Escape whatever a terminal would not show as a character."""
    return "".join(char if char.isprintable() else ascii(char)[1:-1] for char in text)
