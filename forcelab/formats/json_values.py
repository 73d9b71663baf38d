"""JSON of other programs: each value is checked as it is taken, and named where it is wrong."""

from __future__ import annotations

import gzip
import json
import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from forcelab.errors import InputError

#: How files begin that are compressed.
GZIP: Final = b"\x1f\x8b"
#: Bytes of the longest file that is read; once parsed it takes ten times as much memory.
LARGEST: Final = 1 << 26


@dataclass(frozen=True, slots=True)
class JsonValue:
    """A value of a file, None where there is none."""

    value: Any
    where: str  #: what sentences call it

    def members(self) -> Iterator[tuple[str, JsonValue]]:
        """The names and values of an object."""
        for key, value in self._of(dict, "an object").items():
            yield key, JsonValue(value, f"{self.where}, {key!a:.40}")

    def member(self, key: str) -> JsonValue:
        """A value of an object."""
        return JsonValue(self._of(dict, "an object").get(key), f"{self.where}, '{key}'")

    def items(self) -> list[JsonValue]:
        """The values of a list."""
        values = enumerate(self._of(list, "a list"), start=1)
        return [JsonValue(value, f"{self.where}, {number}") for number, value in values]

    def text(self) -> str:
        """A text; empty where there is none."""
        return str(self._of(str, "a text"))

    def number(self, default: float | None = None) -> float:
        """A finite number."""
        value = default if self.value is None else self.value
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            try:
                if math.isfinite(number := float(value)):
                    return number
            except OverflowError:
                pass
        raise self.unexpected("a number")

    def unexpected(self, expected: str) -> InputError:
        """The error for a value that is something else."""
        shown = "missing" if self.value is None else f"{self.value!a:.40}"
        return InputError(
            f"{self.where} is {shown} where {expected} is expected; save the file again in the "
            f"program that it is from."
        )

    def _of(self, kind: type, expected: str) -> Any:
        """The value, which is of that type; an empty one where there is none."""
        value = kind() if self.value is None else self.value
        if not isinstance(value, kind):
            raise self.unexpected(expected)
        return value


def read_content(path: Path) -> bytes:
    """What a file holds, compressed by gzip or not; refused where it is too long."""
    try:
        with path.open("rb") as stream:
            compressed = stream.read(2) == GZIP
            stream.seek(0)
            with gzip.open(stream) if compressed else stream as plain:
                content = plain.read(LARGEST + 1)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f"'{path}' is not whole ({error}); copy it again.") from error
    if len(content) > LARGEST:
        raise InputError(f"'{path}' is longer than {LARGEST >> 20} MB; export it in parts.")
    return content


def read_json(path: Path) -> JsonValue:
    """Read a JSON file, compressed by gzip or not; the error says where it is none."""
    try:
        return JsonValue(json.loads(read_content(path)), f"'{path}'")
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"'{path}' is not whole JSON ({error}); save it again in the program that it is from."
        ) from error
