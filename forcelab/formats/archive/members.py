"""A project archive as a zip of known members: written reproducibly, read with suspicion."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import math
import re
import shutil
import stat
import tokenize
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.formats.archive.values import field

__all__ = [
    "LARGEST",
    "LARGEST_RATIO",
    "MANIFEST",
    "VERSION",
    "Members",
    "Writer",
    "open_members",
]

#: The member that tells a project archive from every other zip; the first one written.
MANIFEST = "forcelab.json"

#: The version of the archive that is written, and the newest that is read.
VERSION = 3

#: Bytes that an archive may always unpack to.
LARGEST = 64 << 20

#: How many times its own size a larger archive may unpack to. Arrays, videos and recognisers are
#: stored as they are, and the text that is compressed shrinks far less than this.
LARGEST_RATIO = 200

#: Bytes of text that are parsed at once, and those of all edits, which are parsed one by one.
LARGEST_TEXT, LARGEST_EDITS = 32 << 20, 128 << 20

_ID = "[0-9a-f]{32}"
_VIDEO = r"video-(?P<digest>[0-9a-f]{16})(\.[a-z0-9]{1,8})?"
_MEMBER = re.compile(
    r"(forcelab|vocabularies|edits|assignments|verdicts|recognisers|runs)\.json"
    rf"|demonstrations/{_ID}/(demonstration\.json|tracks\.json|truth\.json|times\.npy|signals\.npy|{_VIDEO})"
    rf"|recognisers/{_ID}\.skops"
)
_FOLDER = re.compile(rf"demonstrations/({_ID}/)?|recognisers/")


class Writer:
    """Writes members that depend on nothing but their content: no times, no users, no rights."""

    def __init__(self, stream: BinaryIO) -> None:
        self._zip = zipfile.ZipFile(stream, "w")

    def close(self) -> None:
        """Write the table of contents."""
        self._zip.close()

    def json(self, name: str, value: object) -> None:
        """Write a value as text, compressed."""
        text = json.dumps(value, ensure_ascii=False, indent=1) + "\n"
        self._zip.writestr(_info(name, zipfile.ZIP_DEFLATED), text.encode())

    def json_list(self, name: str, values: Iterable[object]) -> None:
        """Write values as a list in text, compressed, holding one of them at a time."""
        info = _info(name, zipfile.ZIP_DEFLATED)
        with self._zip.open(info, "w", force_zip64=True) as member:
            before = "["
            for value in values:
                text = json.dumps(value, ensure_ascii=False, indent=1).replace("\n", "\n ")
                member.write(f"{before}\n {text}".encode())
                before = ","
            member.write(b"[]\n" if before == "[" else b"\n]\n")

    def array(self, name: str, array: NDArray[np.float64]) -> None:
        """Write an array in NumPy's format, as it is."""
        with self._zip.open(_info(name), "w", force_zip64=True) as member:
            np.lib.format.write_array(member, array, version=(1, 0), allow_pickle=False)

    def file(self, name: str, path: Path) -> None:
        """Write a file as it is."""
        with path.open("rb") as read, self._zip.open(_info(name), "w", force_zip64=True) as member:
            shutil.copyfileobj(read, member, 1 << 20)


class Members:
    """The members of an archive whose names and sizes were found harmless."""

    def __init__(self, path: Path, archive: zipfile.ZipFile) -> None:
        self.path = path
        self.unread = _checked(path, archive)
        self._names = frozenset(self.unread)
        self._zip = archive
        self.version = VERSION

    def __contains__(self, name: str) -> bool:
        return name in self._names

    def ids(self) -> list[str]:
        """The ids of all demonstrations, sorted."""
        return sorted({n.split("/")[1] for n in self._names if n.startswith("demonstrations/")})

    def content(self, name: str) -> bytes:
        """The content of a member."""
        with self._opened(name) as member:
            return member.read()

    def json(self, name: str) -> Any:
        """The value of a member of JSON."""
        try:
            return json.loads(self.content(name))
        except (ValueError, RecursionError) as error:
            raise InputError(f"{self.where(name)} is no valid JSON.") from error

    def objects(self, name: str) -> Iterator[Any]:
        """The objects of a member that is a list of JSON, held one at a time.

        So where each ends on a line of its own, as :class:`Writer` has it; else all at once.
        """
        part, more, several = "", True, False
        try:
            with self._opened(name) as member, io.TextIOWrapper(member, "utf-8") as lines:
                for line in lines:
                    part += line
                    if len(part) > LARGEST_TEXT:
                        raise InputError(
                            f"{self.where(name)} holds an entry of more than "
                            f"{LARGEST_TEXT >> 20} MiB, which forcelab writes nowhere."
                        )
                    if line.rstrip() not in (" }", " },"):
                        continue
                    if not more or not (several or part.startswith("[")):
                        raise ValueError("no list")
                    yield json.loads(part.strip().removeprefix("[").removesuffix(","))
                    part, more, several = "", line.rstrip() == " },", True
            rest = json.loads(part) if not several else []
            if (several and (more or part.strip() != "]")) or not isinstance(rest, list):
                raise ValueError("no list")
            yield from rest
        except (ValueError, RecursionError) as error:
            raise InputError(f"{self.where(name)} is no valid JSON list.") from error

    def array(self, name: str) -> NDArray[np.float64]:
        """An array of 64-bit numbers, read-only."""
        data = self.content(name)
        stream = io.BytesIO(data)
        try:
            if np.lib.format.read_magic(stream) != (1, 0):
                raise ValueError("another version of the format")
            shape, by_columns, dtype = np.lib.format.read_array_header_1_0(stream)
            if by_columns or dtype != np.dtype("<f8"):
                raise ValueError("not rows of 64-bit numbers")
            # A view of the bytes: the shape that the header claims reserves no memory.
            array: NDArray[np.float64] = np.frombuffer(data, "<f8", offset=stream.tell())
            return array.reshape(shape)
        except (ValueError, tokenize.TokenError) as error:
            raise InputError(f"{self.where(name)} is no array of 64-bit numbers.") from error

    def extract(self, name: str, folder: Path) -> Path:
        """Write a video into a folder, under the name of its content."""
        target = folder / name.rpartition("/")[2]
        digest = hashlib.sha256()
        with self._opened(name) as member, target.open("xb") as write:
            while block := member.read(1 << 20):
                digest.update(block)
                write.write(block)
        expected = _MEMBER.fullmatch(name)
        if expected is None or digest.hexdigest()[:16] != expected["digest"]:
            raise InputError(f"The content of {self.where(name)} does not match its name.")
        return target

    def where(self, name: str) -> str:
        """A member's name for messages."""
        return f"'{name}' in the archive '{self.path}'"

    @contextlib.contextmanager
    def _opened(self, name: str) -> Iterator[IO[bytes]]:
        """A member open for reading; whatever is wrong with it is one sentence."""
        if name not in self._names:
            raise InputError(f"The archive '{self.path}' lacks '{name}'; it is not complete.")
        self.unread.discard(name)
        with _told(self.path), self._zip.open(name) as member:
            yield member


@contextlib.contextmanager
def open_members(path: Path) -> Iterator[Members]:
    """Open an archive, and refuse it before anything is read if it is none of ours or unsafe."""
    with contextlib.ExitStack() as stack:
        with _told(path):
            archive = stack.enter_context(zipfile.ZipFile(path))
        members = Members(path, archive)
        if MANIFEST not in members:
            raise InputError(f"'{path}' is not a forcelab archive: it holds no {MANIFEST}.")
        manifest = members.json(MANIFEST)
        version = field(manifest, "version", int, members.where(MANIFEST))
        if version > VERSION:
            raise InputError(
                f"The archive '{path}' was written by a newer forcelab (version {version}, this "
                f"program knows {VERSION}); update forcelab to read it."
            )
        members.version = version
        yield members


def _info(name: str, compression: int = zipfile.ZIP_STORED) -> zipfile.ZipInfo:
    """The header of a member to write."""
    info = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
    info.compress_type = compression
    info.create_system = 3
    info.external_attr = 0o644 << 16
    return info


def _checked(path: Path, archive: zipfile.ZipFile) -> set[str]:
    """The names of all members, after a look at every one of them."""
    names: set[str] = set()
    for info in archive.infolist():
        name = info.orig_filename
        if _FOLDER.fullmatch(name):
            continue
        if not _MEMBER.fullmatch(name):
            wrong = "is no part of a project"
        elif name in names:
            wrong = "is there twice"
        elif stat.S_ISLNK(info.external_attr >> 16):
            wrong = "is a link"
        elif info.flag_bits & 1:
            wrong = "is encrypted"
        elif info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            wrong = "is compressed in an unknown way"
        elif info.file_size > _largest(name):
            wrong = (
                f"unpacks to {info.file_size:,} bytes of text, and {_largest(name):,} is the most"
            )
        else:
            names.add(name)
            continue
        raise InputError(f"The archive '{path}' was refused: its member {name!r} {wrong}.")
    size = path.stat().st_size
    declared = sum(info.file_size for info in archive.infolist())
    limit = max(LARGEST, LARGEST_RATIO * size)
    if declared > limit or sum(info.compress_size for info in archive.infolist()) > size:
        raise InputError(
            f"The archive '{path}' was refused: {size} bytes claim to unpack to {declared}, and "
            f"{limit} would be the most."
        )
    return names


def _largest(name: str) -> float:
    """How many bytes a member may have by itself: text takes many times its length when parsed."""
    if name == "runs.json" or not name.endswith(".json"):
        return math.inf
    return LARGEST_EDITS if name == "edits.json" else LARGEST_TEXT


@contextlib.contextmanager
def _told(path: Path) -> Iterator[None]:
    """Turn a failure to read a zip into one sentence."""
    try:
        yield
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise InputError(f"The archive '{path}' is damaged ({error}); get it once more.") from error
    except OSError as error:
        raise InputError(f"The archive '{path}' cannot be read: {error.strerror}.") from error
