"""Foreign formats: a module each, told apart by content; other packages may bring more."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Generator, Iterator
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from typing import Final, Protocol, cast

from forcelab.errors import InputError
from forcelab.formats.recording import ColumnUse, ReadOptions, Recording, give_units
from forcelab.formats.signatures import (
    Format,
    file_head,
    find_format,
    lerobot_dataset_of,
    names_in_zip,
    naming_file,
    seems_to_be,
)
from forcelab.jobs import Progress, finish, run_through
from forcelab.text import unknown_word

#: Where other packages say that they read a format: an entry point whose object is a `Format`.
ENTRY_POINTS: Final = "forcelab.formats"


class _Reader(Protocol):
    """The interface of a format's module; `preview` only where its files have columns."""

    def sniff(self, path: Path, head: bytes) -> bool:
        """Whether the file (or folder), whose first 64 KiB are `head`, is of this format."""

    def read(
        self, path: Path, options: ReadOptions
    ) -> list[Recording] | Generator[Progress, None, list[Recording]]:
        """Read the whole file, as a job where that may take long; errors are InputError."""

    def preview(self, path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
        """What the columns would be read as."""


_BAG: Final = (b"#ROSBAG V", b"\x89MCAP", b"SQLite format 3\x00", b"rosbag2_bagfile_information:")
#: The block of the parameters, and a mark.
_C3D: Final = tuple(bytes([block, 0x50]) for block in range(2, 256))
_ARROW: Final = (b"PAR1", b"ARROW1\x00\x00", b"\xff\xff\xff\xff")
_NUMPY: Final = (b"\x93NUMPY", b"PK")
#: Files of version 4 have no mark; they begin with the type of a variable.
_MATLAB: Final = (b"MATLAB ", b"\0\0", *(bytes([kind, 0, 0, 0]) for kind in (10, 20, 30, 40, 50)))
#: In the order in which they are tried; those of other packages come next, then `_LATE`.
_EARLY: Final = (
    Format("archive", "archives of projects", "forcelab.formats.archive", (b"PK",)),
    Format("excel", "Excel", "forcelab.formats.excel", (b"PK",), columns=True),
    Format("pdl", "*.pdl", "forcelab.formats.pdl", (b"\x80", b"]", b"}", b"(", b"c")),
    Format("rosbag", "ROS bags", "forcelab.formats.rosbag", _BAG, columns=True),
    Format("xdf", "XDF", "forcelab.formats.xdf", (b"XDF:",), columns=True),
    Format("c3d", "C3D", "forcelab.formats.c3d", _C3D, columns=True),
    Format("tdms", "TDMS", "forcelab.formats.tdms", (b"TDSm",), columns=True),
    Format("parquet", "Parquet and Feather", "forcelab.formats.parquet", _ARROW, columns=True),
    Format("lerobot", "LeRobot datasets", "forcelab.formats.lerobot", (b"{",), columns=True),
    Format("numpy", "NumPy arrays", "forcelab.formats.numpy_arrays", _NUMPY, columns=True),
    Format("hdf5", "HDF5", "forcelab.formats.hdf5", (b"\x89HDF\r\n\x1a\n",), columns=True),
    Format("matlab", "MATLAB", "forcelab.formats.matlab", _MATLAB, columns=True),
)
#: Any text might be a table; what is told by its packets wherever they start is never text.
_LATE: Final = (
    Format("table", "tables as text (CSV, TSV, columns)", "forcelab.formats.table", columns=True),
    Format("optoforce", "OptoForce dumps", "forcelab.formats.optoforce"),
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
        if format_ := find_format(all_formats(), "sniff", path, head):
            return format_
        if dataset := lerobot_dataset_of(path):
            raise InputError(
                f"'{path}' belongs to the LeRobot dataset '{dataset}'; import that folder, or some "
                f"of its episodes (--episodes 0-99)."
            )
        kind = seems_to_be(head)
        if kind.endswith("video"):
            raise InputError(
                f"'{path}' looks like {kind}, which belongs to a demonstration: import the "
                f"recording first, then attach the video to it (forcelab attach; in the window "
                f"Demonstration > Attach video, or a right click in the list)."
            )
        from forcelab.formats.label_files import LABEL_FORMATS  # what is labels only is met last

        if find_format(LABEL_FORMATS, "sniff_labels", path, head) is not None:
            raise InputError(
                f"'{path}' holds labels, which belong to a demonstration: import the recording "
                f"first, then its labels (forcelab labels; in the window File > Import labels)."
            )
        if head.startswith(b"PK\x03\x04") and not names_in_zip(path):
            raise InputError(
                f"'{path}' looks like {kind.partition(',')[0]} that is cut short or damaged; copy "
                f"it again from where it is from."
            )
        readable = ", ".join(format_.description for format_ in all_formats())
        raise InputError(f"'{path}' looks like {kind}; what can be read: {readable}.")


@contextlib.contextmanager
def naming_recording(path: Path) -> Iterator[None]:
    """Say of a file that is refused as a video that it is a recording, if it is one."""
    try:
        yield
    except InputError as error:
        try:
            format_ = identify(path)
        except InputError:
            raise error from None
        raise InputError(
            f"'{path}' is no video, but is read as a recording ({format_.description}); import it "
            f"as a demonstration (forcelab import; in the window File > Import demonstrations)."
        ) from error


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

    Examples
    --------
    >>> (recording,) = forcelab.read("pull.csv")
    >>> recording.demonstration.name, recording.tracks[0].actions
    ('pull', ('grab',))
    """
    return finish(reading(Path(path), options or ReadOptions()))


def reading(path: Path, options: ReadOptions) -> Generator[Progress, None, list[Recording]]:
    """As :func:`read`, as a job."""
    with naming_file(path):
        format_ = identify(path) if options.format is None else _named_format(path, options.format)
        recordings = yield from run_through(_module(format_).read(path, options))
        if not recordings:
            raise InputError(f"'{path}' holds no recording; there is nothing to import.")
        if options.units:
            recordings = [give_units(each, dict(options.units)) for each in recordings]
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
    file_head(path)
    formats = {format_.name: format_ for format_ in all_formats()}
    if name not in formats:
        raise InputError(unknown_word("format", name, formats))
    return formats[name]


def _module(format_: Format) -> _Reader:
    return cast(_Reader, import_module(format_.module))
