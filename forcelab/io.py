"""Reading small files that people write by hand; writing files whole or not at all.

The bytes go to a temporary file in the same folder, are forced to the disk and only then take the
name. Whatever had the name before is untouched until then, and for ever if anything fails.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from forcelab.errors import InputError


def write_atomically(path: str | os.PathLike[str], data: bytes) -> None:
    """Give a file its whole content, or none of it; a symbolic link is followed."""
    with atomic_file(path) as stream:
        stream.write(data)


@contextlib.contextmanager
def atomic_file(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a file for reading and writing that appears under `path` only once it is complete.

    When the block ends it is forced to the disk and takes the name; when the block raises it is
    removed. A symbolic link is followed. `InputError` if it cannot be written.
    """
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".forcelab-{secrets.token_hex(8)}.part")
    if target.exists() and not target.is_file():
        kind = "a folder" if target.is_dir() else "a device"
        raise InputError(f"'{path}' is {kind}; name a file to write.")
    try:
        # Unlike a file of mkstemp, one opened with "x" gets the rights the user's umask gives.
        with temporary.open("x+b") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        if target.exists():
            temporary.chmod(stat.S_IMODE(target.stat().st_mode))
        temporary.replace(target)
        sync_folder(target.parent)
    except OSError as error:
        if error.filename is not None and Path(error.filename) not in (temporary, target):
            raise  # another file's trouble, met by the caller inside the block
        cure = f"; {CLOSE_IT}" if is_open_elsewhere(error) else ""
        raise InputError(
            f"'{path}' cannot be written ({error.strerror or error}); what was there before is "
            f"untouched{cure}."
        ) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()


#: The cure where a file is open, which keeps Windows from replacing it.
CLOSE_IT = "close it in other programs, or check who may write there"


def is_open_elsewhere(error: OSError) -> bool:
    """Whether Windows refuses what it does where a program has the file open, or maps it."""
    return getattr(error, "winerror", None) in {5, 32, 33, 1224}


def sync_folder(folder: Path) -> None:
    """Force a folder's entries to the disk, where the system allows opening folders."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


#: Bytes; some thousand times what anybody would write.
LARGEST = 1 << 24


def small_text(path: Path, encoding: str = "utf-8") -> str:
    """The text of a file, which may be a pipe, but not one that never ends.

    `InputError` if it is longer than :data:`LARGEST`, as what a device such as ``/dev/zero`` gives.
    """
    with path.open("rb") as stream:
        content = stream.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise InputError(
            f"'{path}' is longer than {LARGEST >> 20} MB, so it is not what it should be; name "
            "another file."
        )
    return content.decode(encoding)
