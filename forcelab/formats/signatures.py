"""What a file is, or seems to be, by its first bytes; sentences on one that cannot be read."""

from __future__ import annotations

import contextlib
import errno
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Final

from forcelab.errors import InputError

#: Bytes of a file that are looked at to tell its format.
HEAD_BYTES: Final = 64 * 1024

#: What the folder of a ROS 2 bag holds besides its data.
BAG_METADATA: Final = "metadata.yaml"
#: What a LeRobot dataset says of itself, in its folder.
LEROBOT_INFO: Final = "meta/info.json"

#: First bytes and what they announce; the first match counts.
_STARTS: Final[tuple[tuple[bytes, str], ...]] = (
    (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"GIF89a", "a GIF picture"),
    (b"%PDF-", "a PDF document"),
    (b"SQLite format 3\x00", "an SQLite database"),
    (b"\x93NUMPY", "a NumPy array"),
    (b"\x89HDF\r\n\x1a\n", "an HDF5 file"),
    (b"MATLAB 5.0 MAT-file", "a MATLAB file"),
    (
        b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1",
        "an old Excel or Word file, whose tables can be saved as .xlsx or CSV",
    ),
    (b"FEA1", "a Feather file of version 1 (pandas writes it again by to_feather or to_parquet)"),
    (b"PathFileType", "a TRC file, which holds markers only (forces are in a MOT, STO or C3D)"),
    (b"\x1aE\xdf\xa3", "a Matroska or WebM video"),
    (b"OggS", "an Ogg recording"),
    (b"fLaC", "a FLAC recording"),
    (b"\x1f\x8b", "a gzip file, which must be unpacked first"),
    (b"BZh9", "a bzip2 file, which must be unpacked first"),
    (b"\xfd7zXZ\x00", "an xz file, which must be unpacked first"),
    (b"7z\xbc\xaf\x27\x1c", "a 7-Zip file, which must be unpacked first"),
    (b"\x28\xb5\x2f\xfd", "a Zstandard file, which must be unpacked first"),
    (b"\x7fELF", "a program"),
    (b"PK\x05\x06", "an empty zip file"),
    (b"version https://git-lfs.", "a pointer of Git LFS (git lfs pull fetches the file)"),
    (b"<?xml", "an XML document"),
    (b"<!DOCTYPE html", "a web page"),
    (b"<html", "a web page"),
)

#: Names that the first entries of a zip file of that kind have.
_ZIPPED: Final[tuple[tuple[bytes, str], ...]] = (
    (b"opendocument.spreadsheet", "a LibreOffice spreadsheet, which can be saved as CSV"),
    (b"xl/", "an Excel workbook, which can be saved as CSV"),
    (b"[Content_Types].xml", "an Office document, which can be saved as CSV"),
    (b".npy", "a NumPy archive"),
)


def is_bag_folder(path: Path) -> bool:
    """Whether a folder is a ROS 2 bag, which is read as a file is."""
    return (path / BAG_METADATA).is_file()


def is_lerobot_folder(path: Path) -> bool:
    """Whether a folder is a LeRobot dataset, which is read as a file is."""
    return (path / LEROBOT_INFO).is_file()


def lerobot_folder(path: Path) -> Path:
    """The dataset's folder, which its ``meta/info.json`` stands for."""
    return path.parent.parent if path.parts[-2:] == ("meta", "info.json") else path


def lerobot_dataset_of(path: Path) -> Path | None:
    """The LeRobot dataset to whose data, videos or metadata a file belongs, if it does."""
    for inner, folder in pairwise(path.absolute().parents):
        if inner.name in ("data", "videos", "meta") and is_lerobot_folder(folder):
            return folder
    return None


def announced_kind(head: bytes) -> str:
    """The kind that a file's first 4 KiB announce, such as ``"a PNG picture"``; empty if none."""
    for start, kind in _STARTS:
        if head.startswith(start):
            return kind
    if head.startswith(b"PK\x03\x04"):
        return next((kind for name, kind in _ZIPPED if name in head[:4096]), "a zip file")
    if head.startswith(b"RIFF"):
        return {b"WAVE": "a WAV recording", b"AVI ": "an AVI video"}.get(head[8:12], "a RIFF file")
    return "an MP4 or QuickTime video" if head[4:8] == b"ftyp" else ""


def seems_to_be(head: bytes) -> str:
    """What a file is, as far as its first bytes tell; never empty."""
    if kind := announced_kind(head):
        return kind
    if not head.strip(b"\x00"):
        return "a file of zeros, as a failed copy leaves it"
    printable = sum(byte >= 32 or byte in b"\t\n\r\f" for byte in head[:4096])
    return "text" if printable == len(head[:4096]) else "unknown binary data"


@dataclass(frozen=True, slots=True)
class Format:
    """A format that recordings, or labels, can be read from."""

    name: str  #: unique
    description: str  #: a few words that may follow "can read"
    module: str  #: reads it; imported when it is needed
    #: first bytes that make it worth importing the module; empty: any that do not announce another
    #: kind of file
    starts: tuple[bytes, ...] = ()
    columns: bool = False  #: whether files have columns or the like, which `preview` tells


def find_format(formats: Sequence[Format], sniff: str, path: Path, head: bytes) -> Format | None:
    """The first format whose module says, by its function `sniff`, that a file is of it."""
    announced = announced_kind(head)
    for format_ in formats:
        worthwhile = head.startswith(format_.starts) if format_.starts else not announced
        if worthwhile and getattr(import_module(format_.module), sniff)(path, head):
            return format_
    return None


def file_head(path: Path) -> bytes:
    """The first bytes of a regular file, at least one; of a bag or dataset, of its metadata."""
    if is_bag_folder(path):
        path = path / BAG_METADATA
    elif is_lerobot_folder(path):
        path = path / LEROBOT_INFO
    mode = path.stat().st_mode
    if stat.S_ISDIR(mode):
        from forcelab.project.database import FILE  # which nothing else here needs

        if (path / FILE).is_file():
            raise InputError(
                f"'{path}' is a project; export it as an archive (forcelab export {path} --out "
                f"FOLDER --format archive) and import that."
            )
        raise InputError(f"'{path}' is a folder; name the files in it, such as {path}/*.csv.")
    if not stat.S_ISREG(mode):
        raise InputError(f"'{path}' is a device or pipe; save what it gives as a file first.")
    with path.open("rb") as stream:
        head = stream.read(HEAD_BYTES)
    if not head:
        raise InputError(f"'{path}' is empty (0 bytes); copy it again from where it is from.")
    return head


def names_in_zip(path: Path) -> list[str]:
    """The names of what is in a zip file; none of what is no whole one."""
    try:
        with zipfile.ZipFile(path) as archive:
            return archive.namelist()
    except (zipfile.BadZipFile, NotImplementedError, ValueError, OSError):
        return []


@contextlib.contextmanager
def naming_file(path: Path) -> Iterator[None]:
    """Re-raise errors as one line that names the file."""
    try:
        yield
    except InputError as error:
        sentence = str(error) if path.name in str(error) else f"'{path}': {error}"
        # Who tells it may know a cure of its kind of error.
        raise type(error)(_one_line(sentence)) from error
    except OSError as error:
        problem = f"cannot be read: {error.strerror or error}; check its rights and its disk."
        if isinstance(error, FileNotFoundError):
            problem = "does not exist; check its spelling and folder."
        raise InputError(_one_line(f"'{path}' {problem}")) from error


#: What libraries raise over damaged files; of XML and of headers it is a SyntaxError.
_DAMAGE: Final = (
    *(ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RuntimeError),
    *(AssertionError, EOFError, OSError, SyntaxError, struct.error, zlib.error, zipfile.BadZipFile),
)


@contextlib.contextmanager
def naming_damage(path: Path, kind: str, cure: str, *raised: type[BaseException]) -> Iterator[None]:
    """Re-raise what a library says of a damaged file as one sentence.

    `raised` are errors that only this library has.
    """
    damage: tuple[type[BaseException], ...] = (*_DAMAGE, *raised)
    try:
        yield
    except MemoryError as error:
        raise InputError(f"'{path}' holds more than there is memory for; save a part.") from error
    except RecursionError as error:
        raise InputError(f"'{path}' is nested too deep to be read; save a part.") from error
    except damage as error:
        # A place far outside of the file is its own fault; others are the disk's.
        if isinstance(error, OSError) and error.errno not in (None, errno.EINVAL):
            raise
        text = " ".join(str(error).split()).rstrip(".") or type(error).__name__
        reason = text if len(text) <= 160 else f"{text[:160]}…"
        raise InputError(f"'{path}' is not a whole {kind} ({reason}); {cure}.") from error


def _one_line(text: str) -> str:
    """Escape whatever a terminal would not show as a character."""
    return "".join(char if char.isprintable() else ascii(char)[1:-1] for char in text)
