"""The files beside the store: arrays, videos, recognisers.

A file is written into a staging folder and forced to the disk there. Only when it is complete, and
while the store is locked for writing, is it moved to its place.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import hashlib
import json
import math
import os
import re
import secrets
import shutil
import stat
import time
import zipfile
import zlib
from collections.abc import Callable, Collection, Container, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.io import CLOSE_IT, is_open_elsewhere, sync_folder

#: Folders of a project: one folder a demonstration, one file a recogniser.
DEMONSTRATIONS, RECOGNISERS = "demonstrations", "recognisers"
#: Lies in a demonstration's folder until the store knows the demonstration.
UNCOMMITTED = "uncommitted"

_CURES = (
    ((errno.ENOSPC, errno.EDQUOT), "make room on the disk"),
    ((errno.EACCES, errno.EPERM), "look who may read and write there"),
    ((errno.EROFS,), "copy it to where you may write"),
    ((errno.EIO,), "look whether the disk is connected, and check it"),
    ((errno.ENAMETOOLONG,), "choose a shorter name"),
)
#: What the store may call a demonstration or a recogniser, and a video: no separators, no leading
#: dots. Until a demonstration could have several videos, those of further cameras were "beside".
STORED_ID = re.compile(r"[0-9a-f]{32}")
STORED_VIDEO = re.compile(r"(video|beside)-(?P<digest>[0-9a-f]{16})(\.[a-z0-9]{1,8})?")

#: Name of the file of raw stamps in a demonstration's folder.
STAMPS = "stamps.npz"
#: Bytes of stamps, unpacked, that are always read, and those for each sample of a demonstration.
_STAMPS_BYTES, _STAMPS_BYTES_EACH = 1 << 30, 1 << 10

_STAGING = ".incoming-"
_STAGED = re.compile(r"\.incoming-[0-9a-z]{1,32}")
_PART = re.compile(r"\.forcelab-[0-9a-f]{16}\.part")
#: As the C library calls the working folder and the exchange of two names.
_AT_FDCWD, _RENAME_EXCHANGE = -100, 2
_ABANDONED = 3600.0  # seconds without a byte written, after which nobody is at work any more


@contextlib.contextmanager
def file_errors(sentence: str) -> Iterator[None]:
    """Turn an error of the file system into one sentence that begins with `sentence`."""
    try:
        yield
    except OSError as error:
        file = f" ('{error.filename}')" if error.filename else ""
        cure = next((f"; {cure}" for numbers, cure in _CURES if error.errno in numbers), "")
        cure = f"; {CLOSE_IT}" if is_open_elsewhere(error) else cure
        raise InputError(f"{sentence}: {error.strerror or error}{file}{cure}.") from error


def check_folder(path: Path) -> None:
    """Refuse a folder of a project that is a link or no folder; a missing one may be made.

    What is done in it would happen outside the project.
    """
    _check_kind(path, stat.S_ISDIR, "a folder")


def check_file(path: Path) -> None:
    """Refuse a file of a project that is a link, a pipe or a folder; a missing one is no fault."""
    _check_kind(path, stat.S_ISREG, "a file")


def _check_kind(path: Path, is_kind: Callable[[int], bool], kind: str) -> None:
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    except OSError as error:
        raise InputError(f"'{path}' cannot be read: {error.strerror}.") from error
    if stat.S_ISLNK(mode):
        raise InputError(
            f"'{path}' is a link, and a project holds its own files; put {kind} in its place."
        )
    if not is_kind(mode):
        raise InputError(f"'{path}' is not {kind}; restore it from a copy of the project.")


@contextlib.contextmanager
def staging(parent: Path) -> Iterator[Path]:
    """A folder for half-written files, gone at the end."""
    folder = parent / f"{_STAGING}{secrets.token_hex(8)}"
    folder.mkdir()
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def write_array(path: Path, array: NDArray[np.float64]) -> None:
    """Write an array in NumPy's format, forced to the disk."""
    plain = np.ascontiguousarray(array, dtype="<f8")
    form = np.lib.format
    with path.open("xb") as stream:
        # As numpy.save writes it, which does not say why when the disk takes only a part.
        form.write_array_header_1_0(stream, form.header_data_from_array_1_0(plain))
        stream.write(plain.data)
        stream.flush()
        os.fsync(stream.fileno())


def read_array(path: Path, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Map an array of known shape into memory, read-only."""
    cure = "import the recording again to put it back"
    check_file(path)
    try:
        with path.open("rb") as stream:
            start = stream.read(10)
            length = int.from_bytes(start[8:], "little")
            header = stream.read(length).decode("latin-1").rstrip()
            size = os.fstat(stream.fileno()).st_size
    except FileNotFoundError as error:
        raise InputError(f"The file '{path}' is missing; {cure}.") from error
    except OSError as error:
        raise InputError(f"The file '{path}' is damaged; {cure}.") from error
    # Compared and not parsed: NumPy's parser fails in many ways on a header that is none.
    if start[:8] != b"\x93NUMPY\x01\x00" or not header.startswith("{'descr': "):
        raise InputError(f"The file '{path}' is damaged; {cure}.")
    if header != f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}":
        raise InputError(f"The file '{path}' does not hold {shape} numbers; {cure}.")
    if size != 10 + length + 8 * math.prod(shape):
        raise InputError(f"The file '{path}' is damaged; {cure}.")
    if not math.prod(shape):
        return np.empty(shape)
    try:
        return np.memmap(path, "<f8", "r", 10 + length, shape)
    except (OSError, ValueError) as error:
        raise InputError(f"The file '{path}' is damaged; {cure}.") from error


def write_json(path: Path, value: Mapping[str, Any]) -> None:
    """Write a JSON object, forced to the disk."""
    try:
        content = (json.dumps(dict(value), ensure_ascii=False) + "\n").encode()
    except UnicodeEncodeError as error:
        raise InputError(f"The text {error.object!a} is not valid Unicode; rename it.") from error
    write_bytes(path, content)


def write_bytes(path: Path, content: bytes) -> None:
    """Write a new file, forced to the disk."""
    with path.open("xb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())


def read_json(path: Path) -> dict[str, Any] | None:
    """Read a JSON object; None where there is no file."""
    check_file(path)
    try:
        value = json.loads(path.read_bytes())
    except FileNotFoundError:
        return None
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"The file '{path}' is damaged; import it again from a copy.") from error
    if not isinstance(value, dict):
        raise InputError(f"The file '{path}' holds no JSON object; import it again from a copy.")
    return value


def read_stamps(
    home: Path, samples: int, names: Container[str] | None = None
) -> dict[str, NDArray[Any]] | None:
    """The raw stamps, or those of some names, of a recording of so many samples, if it has any."""
    path = home / STAMPS
    check_file(path)
    try:
        # Given a path, NumPy leaves a file open that is no archive.
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
            if sum(member.file_size for member in archive.zip.infolist()) > max(
                _STAMPS_BYTES, _STAMPS_BYTES_EACH * samples
            ):
                raise ValueError("too large")
            requested = (name for name in archive.files if names is None or name in names)
            return {name: archive[name] for name in requested}
    except FileNotFoundError:
        return None
    except (
        OSError,
        ValueError,
        EOFError,
        KeyError,
        AttributeError,
        TypeError,
        MemoryError,
        RuntimeError,  # an unknown compression, or a password
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        raise InputError(
            f"The file '{path}' is damaged; delete it, the demonstration itself is whole."
        ) from error


def same_content(new: Path, stored: Path) -> bool:
    """Whether two small files have the same content; a missing one has none."""
    check_file(stored)
    return stored.exists() and new.read_bytes() == stored.read_bytes()


def copy_named(source: Path, folder: Path, prefix: str) -> Path:
    """Copy a file under the name of its content: ``<prefix><16 hex digits><suffix>``."""
    digest = hashlib.sha256()
    part = folder / "part"
    with source.open("rb") as read, part.open("xb") as write:
        while block := read.read(1 << 20):
            digest.update(block)
            write.write(block)
        write.flush()
        os.fsync(write.fileno())
    suffix = source.suffix.lower()
    if not re.fullmatch(r"\.[a-z0-9]{1,8}", suffix):
        suffix = ""
    return part.replace(folder / f"{prefix}{digest.hexdigest()[:16]}{suffix}")


def move_into(home: Path, staged: Path) -> None:
    """Move every file of a staging folder to its place and make that last."""
    for file in staged.iterdir():
        file.replace(home / file.name)
    sync_folder(home)


def mark_uncommitted(mark: Path) -> None:
    """Put an empty file there in place of what has its name, which may be a link to elsewhere."""
    mark.unlink(missing_ok=True)
    mark.touch(exist_ok=False)


def remove_video(home: Path, name: str) -> None:
    """Delete a video of a demonstration that its row does not name any more."""
    check_folder(home)
    if STORED_VIDEO.fullmatch(name):
        with contextlib.suppress(OSError):  # it only takes up room, and is perhaps in use
            (home / name).unlink(missing_ok=True)


def remove(folder: Path) -> None:
    """Delete a folder of a demonstration that the store does not know any more.

    A process that is killed meanwhile leaves what is known for a leftover, however far it got.
    """
    if not (STORED_ID.fullmatch(folder.name) or _STAGED.fullmatch(folder.name)):
        raise InputError(f"'{folder}' is no folder of a demonstration, so it was not deleted.")
    check_folder(folder.parent)
    if folder.is_symlink():
        return
    renamed = folder.with_name(f"{_STAGING}{secrets.token_hex(8)}")
    with contextlib.suppress(OSError):  # in use, or away: the next start tries again
        folder.rename(renamed)
        shutil.rmtree(renamed, ignore_errors=True)


def leftovers(parent: Path, known: Collection[str]) -> list[Path]:
    """What killed processes left in a folder.

    That is staging folders in which nothing was written for an hour, and folders of demonstrations
    that are not `known` because they did not get as far as the store. Whether another process is
    just finishing one of the latter is only certain while the store is locked for writing.
    """
    folders = []
    for entry in parent.iterdir():
        if entry.name in known or entry.is_symlink() or not entry.is_dir():
            continue
        if not _STAGED.fullmatch(entry.name):
            if STORED_ID.fullmatch(entry.name) and os.path.lexists(entry / UNCOMMITTED):
                folders.append(entry)
            continue
        with contextlib.suppress(FileNotFoundError):  # its process is alive and has just ended it
            if _abandoned(entry):
                folders.append(entry)
    return folders


@contextlib.contextmanager
def appearing(path: Path) -> Iterator[Path]:
    """A folder to fill, which takes the name `path` at the end; nothing is left if that fails."""
    part = _part_beside(path)
    try:
        part.mkdir()
    except OSError as error:  # in the name that the user knows
        raise OSError(error.errno, error.strerror, str(path)) from error
    try:
        yield part
        sync_folder(part)
        if path.exists():
            _clear(path)
        part.rename(path)
        sync_folder(path.parent)
    finally:
        shutil.rmtree(part, ignore_errors=True)


@contextlib.contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """A copy of a folder, which takes its place at the end; nothing is left if that fails.

    Killed at any moment, the old or the new folder has the name; where the system cannot exchange
    two names in one step, the old one may be left as "NAME (old)". The files in the copy are the
    old ones under a second name: remove one and write it anew, but never write into it.
    """
    part = _part_beside(path)
    try:
        shutil.copytree(path, part, symlinks=True, copy_function=_link)
        os.utime(part)  # its folder's old time would make it look abandoned
        yield part
        for folder, _, _ in os.walk(part):
            sync_folder(Path(folder))
        _swap(part, path)
        sync_folder(path.parent)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _part_beside(path: Path) -> Path:
    """A free name beside a folder for what will replace it; what killed processes left goes."""
    for old in path.parent.glob(".forcelab-*.part"):
        with contextlib.suppress(OSError):  # another's, who may be just ending it
            if _PART.fullmatch(old.name) and old.is_dir() and _abandoned(old):
                shutil.rmtree(old, ignore_errors=True)
    return path.with_name(f".forcelab-{secrets.token_hex(8)}.part")


def _link(source: str, target: str) -> None:
    """Give a file a second name; copy it where the file system has none or it is a link itself."""
    try:
        os.link(source, target, follow_symlinks=False)
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise
        shutil.copy2(source, target, follow_symlinks=False)


def _swap(first: Path, second: Path) -> None:
    """Exchange the names of two folders, in one step where the system can."""
    if os.name == "posix":
        libc = ctypes.CDLL(None, use_errno=True)
        names = os.fsencode(first), os.fsencode(second)
        if hasattr(libc, "renameat2"):  # Linux
            done = libc.renameat2(_AT_FDCWD, names[0], _AT_FDCWD, names[1], _RENAME_EXCHANGE)
        elif hasattr(libc, "renamex_np"):  # macOS
            done = libc.renamex_np(*names, _RENAME_EXCHANGE)
        else:
            done = -1
        if done == 0:
            return
    aside = second.with_name(f"{second.name} (old)")
    second.rename(aside)
    try:
        first.rename(second)
    except BaseException:
        aside.rename(second)
        raise
    aside.rename(first)


def _clear(path: Path) -> None:
    """Remove an empty folder; somebody else may have been quicker and filled it."""
    try:
        path.rmdir()
    except OSError as error:
        raise InputError(
            f"'{path}' was made by somebody else meanwhile; look at it, or choose another name."
        ) from error


def _abandoned(folder: Path) -> bool:
    """Whether nobody has written into a half-filled folder for an hour."""
    latest = max(path.lstat().st_mtime for path in (folder, *folder.rglob("*")))
    return time.time() - latest > _ABANDONED
