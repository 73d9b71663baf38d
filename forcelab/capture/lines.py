"""Lines of text out of bytes that come in any pieces."""

from __future__ import annotations

from typing import Final

__all__ = ["LONGEST", "LineSplitter"]

#: Bytes of the longest line that can mean anything; a wrong baud rate may send no line end at all.
LONGEST: Final = 2048


class LineSplitter:
    """Splits a stream at CR, LF or both; blank lines are left out, unfinished ones are kept.

    A line longer than :data:`LONGEST` comes cut to one byte more than that, however much of it
    there was.
    """

    def __init__(self) -> None:
        self._tail = b""

    def feed(self, data: bytes) -> list[bytes]:
        """The lines that are complete with these bytes, without their ends.

        Parameters
        ----------
        data : bytes
            What follows on what was given before.
        """
        *lines, tail = (self._tail + data.replace(b"\r", b"\n")).split(b"\n")
        self._tail = tail[: LONGEST + 1]
        cut = [line[: LONGEST + 1] for line in lines]
        return [line for line in cut if line.strip()]

    def forget(self) -> None:
        """Drop the unfinished line, as after a cable was unplugged."""
        self._tail = b""
