"""The bytes of pickles: arguments read one after another, and the one way to refuse.

Every method takes what belongs to an opcode from the current position on. Bytes that are missing
and arguments that are none are refused with the byte at which their opcode stands.
"""

from __future__ import annotations

import re
import struct
from typing import Final, NoReturn

from forcelab.errors import InputError

__all__ = ["PickleBytes", "shown"]

_INTEGER: Final = re.compile(rb"-?[0-9]{1,19}")
_FLOAT: Final = re.compile(rb"-?(?:[0-9]{1,30}(?:\.[0-9]{0,30})?(?:e[-+]?[0-9]{1,4})?|inf|nan)")
_ESCAPE: Final = re.compile(rb"\\(x[0-9a-fA-F]{2}|[\\'\"nrt]|)")


def shown(raw: bytes) -> str:
    """Foreign bytes as they may stand in a sentence: quoted, printable, short."""
    text = ascii(raw[:60].decode("latin-1"))
    return text if len(raw) <= 60 else text + "..."


class PickleBytes:
    """Bytes and a position in them.

    Parameters
    ----------
    data : bytes
        Pickles of protocols 0 to 2, one after another.
    name : str
        What the errors call the data.

    Attributes
    ----------
    position : int
        The next byte to read.
    opcode_at : int
        Where the current opcode stands; the errors name it.
    """

    def __init__(self, data: bytes, name: str) -> None:
        self.data = data
        self.name = name
        self.position = 0
        self.opcode_at = 0

    def refuse(self, what: str) -> NoReturn:
        """Raise the one sentence; `what` follows the place."""
        raise InputError(f"'{self.name}', byte {self.opcode_at}: {what}.")

    def take(self, count: int) -> bytes:
        """The next `count` bytes."""
        end = self.position + count
        if count < 0 or end > len(self.data):
            self.refuse(
                f"announces {count:,} bytes where {len(self.data) - self.position:,} are left; "
                f"the file is cut short or damaged"
            )
        taken = self.data[self.position : end]
        self.position = end
        return taken

    def number(self, layout: str) -> int:
        """The next integer of a ``struct`` layout."""
        return int(struct.unpack(layout, self.take(struct.calcsize(layout)))[0])

    def double(self) -> float:
        """The next eight bytes as a big-endian float."""
        return float(struct.unpack(">d", self.take(8))[0])

    def long(self, count: int) -> int:
        """An integer of `count` bytes, at most 64 bits: long ones could collide as keys."""
        if not 0 <= count <= 8:
            self.refuse(f"an integer of {count:,} bytes is longer than 64 bits")
        return int.from_bytes(self.take(count), "little", signed=True)

    def latin(self, count: int) -> str:
        """A Python 2 byte string of `count` bytes."""
        return self.take(count).decode("latin-1")

    def text(self, raw: bytes, encoding: str) -> str:
        """Text, which must be writable as UTF-8."""
        try:
            text = raw.decode(encoding)
            text.encode()
        except UnicodeError:
            self.refuse(f"{shown(raw)} is no valid text")
        return text

    def line(self) -> bytes:
        """The bytes up to the next line feed, without it."""
        end = self.data.find(b"\n", self.position)
        if end < 0:
            self.refuse("a line does not end; the file is cut short or damaged")
        taken = self.data[self.position : end]
        self.position = end + 1
        return taken

    def integer_line(self) -> int:
        """A decimal integer on a line, perhaps with Python 2's ``L``."""
        text = self.line().removesuffix(b"L")
        if not _INTEGER.fullmatch(text):
            self.refuse(f"{shown(text)} is no integer of up to 64 bits")
        return int(text)

    def boolean_or_integer_line(self) -> bool | int:
        """An integer on a line, where 00 and 01 are False and True."""
        start = self.position
        value = self.integer_line()
        return {b"00\n": False, b"01\n": True}.get(self.data[start : self.position], value)

    def float_line(self) -> float:
        """A decimal number on a line."""
        text = self.line()
        if not _FLOAT.fullmatch(text):
            self.refuse(f"{shown(text)} is no number")
        return float(text)

    def quoted_line(self) -> str:
        """A Python 2 byte string on a line, as its ``repr``."""
        text = self.line()
        if len(text) < 2 or text[:1] not in (b"'", b'"') or text[-1:] != text[:1]:
            self.refuse(f"{shown(text)} is no quoted string")
        return _ESCAPE.sub(self._unescape, text[1:-1]).decode("latin-1")

    def _unescape(self, escape: re.Match[bytes]) -> bytes:
        """The byte that an escape sequence of Python 2's ``repr`` stands for."""
        letter = escape[1]
        if not letter:
            self.refuse("a string holds a backslash that escapes nothing; the file is damaged")
        if letter[:1] == b"x":
            return bytes([int(letter[1:], 16)])
        return {b"n": b"\n", b"r": b"\r", b"t": b"\t"}.get(letter, letter)
