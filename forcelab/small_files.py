"""Reading files that people write by hand, which are small."""

from __future__ import annotations

from pathlib import Path

from forcelab.errors import InputError

__all__ = ["small_text"]

#: Bytes; some thousand times what anybody would write.
LARGEST = 1 << 24


def small_text(path: Path, encoding: str = "utf-8") -> str:
    """The text of a file, which may be a pipe, but not one that never ends.

    Raises
    ------
    InputError
        If it is longer than :data:`LARGEST`, as what a device such as ``/dev/zero`` gives.
    OSError, UnicodeDecodeError
        If it cannot be read, or is no such text.
    """
    with path.open("rb") as stream:
        content = stream.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise InputError(
            f"'{path}' is longer than {LARGEST >> 20} MB, so it is not what it should be; name "
            "another file."
        )
    return content.decode(encoding)
