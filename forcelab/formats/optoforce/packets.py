"""Packets of OptoForce DAQs: bytes in, packets out, however the bytes are cut into pieces.

Everything is big-endian. Byte 3 of a header is the length of the payload, and a checksum is the
sum of all bytes before it, header included, modulo 65,536:

============ =========== ===== ==========================================================
kind         header      bytes body
============ =========== ===== ==========================================================
3-axis       170 7 8 10  16    count u16, status u16, Fx Fy Fz i16, checksum u16
3-axis x 4   170 7 8 28  34    count, status, four times Fx Fy Fz, checksum
6-axis       170 7 8 16  22    count, status, Fx Fy Fz Tx Ty Tz, checksum
configured   170 0 80 1  7     code u8 (0 is well), checksum
serial       170 0 18 8  14    eight characters, checksum
============ =========== ===== ==========================================================

How packets are told from what lies between them is in :mod:`forcelab.formats.optoforce.framing`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from forcelab.formats.optoforce.framing import (
    Frames,
    FrameType,
    clean_run,
    find_frames,
    is_start,
)

__all__ = ["KINDS", "Kind", "Packets", "Parser", "Reply", "Statistics", "parse_all"]


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of data packet.

    Parameters
    ----------
    name : str
        Such as ``"3-axis"``.
    axes : tuple of str
        Of one sensor, such as ``("fx", "fy", "fz")``.
    sensors : int
        How many sensors are in a packet.
    """

    name: str
    axes: tuple[str, ...]
    sensors: int = 1

    @property
    def columns(self) -> int:
        """Readings in a packet."""
        return len(self.axes) * self.sensors

    @property
    def frame(self) -> FrameType:
        """Header and length of its packets."""
        return FrameType(bytes([170, 7, 8, 4 + 2 * self.columns]), 10 + 2 * self.columns)

    def names(self, first: int = 1) -> tuple[str, ...]:
        """Names of its columns, such as ``fx1 fy1 fz1``, with its first sensor called `first`."""
        return tuple(f"{axis}{first + i}" for i in range(self.sensors) for axis in self.axes)


KINDS: Final = (
    Kind("3-axis", ("fx", "fy", "fz")),
    Kind("3-axis x 4", ("fx", "fy", "fz"), sensors=4),
    Kind("6-axis", ("fx", "fy", "fz", "tx", "ty", "tz")),
)
#: What a DAQ answers: how it took a configuration, and its serial number.
_REPLIES: Final = (FrameType(bytes([170, 0, 80, 1]), 7), FrameType(bytes([170, 0, 18, 8]), 14))
#: Bytes that are looked at together, so that a large file needs no multiple of its size.
_STRETCH = 1 << 20
#: Bytes up to which a loop over packets beats numpy.
_SHORT = 2048


@dataclass(frozen=True, slots=True)
class Reply:
    """What a DAQ answered.

    Parameters
    ----------
    code : int, optional
        Of a configuration: 0 if it was taken.
    serial : str, optional
        Its serial number, if that was asked for.
    """

    code: int | None = None
    serial: str | None = None


@dataclass(frozen=True, slots=True)
class Statistics:
    """What became of the bytes of a stream; every byte that was used up is in one of them.

    Parameters
    ----------
    packets : int
        Valid packets of data.
    replies : int
        Valid replies.
    bad_checksums : int
        Headers that the parser stood at and whose packet had a wrong checksum.
    skipped_bytes : int
        Bytes that are in no valid packet and in no reply.
    """

    packets: int = 0
    replies: int = 0
    bad_checksums: int = 0
    skipped_bytes: int = 0


@dataclass(frozen=True)
class Packets:
    """Valid packets in their order.

    Parameters
    ----------
    counts : ndarray of uint16, shape (n,)
        The device's counter.
    status : ndarray of uint16, shape (n,)
        See :mod:`forcelab.formats.optoforce.status`.
    values : ndarray of int16, shape (n, c)
        Readings in counts, one column a reading.
    offsets : ndarray of int64, shape (n,)
        Where in the stream each starts, in bytes since the parser was made.
    """

    counts: NDArray[np.uint16]
    status: NDArray[np.uint16]
    values: NDArray[np.int16]
    offsets: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.counts)


class Parser:
    """Finds the packets in a stream.

    A connection has packets of one kind: that of the first valid packet, or the one given. Headers
    of the other kinds are not looked at after that.

    Parameters
    ----------
    kind : Kind, optional
        The kind of its packets where that is known.

    Attributes
    ----------
    kind : Kind or None
        None until the first valid packet, unless it was given.
    statistics : Statistics
        Up to the last byte that was used up.
    """

    def __init__(self, kind: Kind | None = None) -> None:
        self.kind = kind
        self.statistics = Statistics()
        self._tail = b""
        self._offset = 0  # of the tail's first byte in the stream
        self._replies: list[Reply] = []

    @property
    def pending(self) -> int:
        """Bytes at the end that may be the start of a packet; never more than 33."""
        return len(self._tail)

    def feed(self, data: bytes) -> Packets:
        """The packets that are complete with these bytes.

        Parameters
        ----------
        data : bytes
            What follows on what was given before; an unfinished end is kept.
        """
        pieces = []
        for start in range(0, len(data), _STRETCH):
            pieces += self._scan(self._tail + data[start : start + _STRETCH], final=False)
        return _joined(pieces, self.kind)

    def finish(self) -> Packets:
        """The packets in what was kept, as no bytes will come that complete what it started.

        What is in no packet counts as skipped; the parser may be fed again, as after a cable was
        plugged in once more.
        """
        return _joined(self._scan(self._tail, final=True), self.kind)

    def take_replies(self) -> list[Reply]:
        """The replies since this was asked last."""
        taken, self._replies = self._replies, []
        return taken

    def _scan(self, data: bytes, *, final: bool) -> list[Packets]:
        """Take whole packets from the left and keep the rest, unless nothing follows."""
        pieces: list[Packets] = []
        if self.kind is None:
            data = self._first(data, final)
        elif len(data) < _SHORT and (run := clean_run(data, self.kind.frame)):
            rows = np.frombuffer(data, np.uint8, run * self.kind.frame.size)
            starts = np.arange(run) * self.kind.frame.size
            pieces.append(self._packets(rows.reshape(run, -1), starts))
            so_far, data = self.statistics, data[len(rows) :]
            self.statistics = replace(so_far, packets=so_far.packets + run)
            self._offset += len(rows)
        if self.kind is not None and (final or not is_start(data, self.kind.frame)):
            array = np.frombuffer(data, np.uint8)
            frames = _find(array, (self.kind,), final)
            starts, size = frames.starts[frames.types == 0], self.kind.frame.size
            if starts.size:
                rows = np.lib.stride_tricks.sliding_window_view(array, size)[starts]
                pieces.append(self._packets(rows, starts))
            self._note(data, frames, 1)
            data = data[frames.used :]
        self._tail = data
        return pieces

    def _first(self, data: bytes, final: bool) -> bytes:
        """Look for the first packet of any kind; what stands from there on."""
        frames = _find(np.frombuffer(data, np.uint8), KINDS, final)
        of_data = np.flatnonzero(frames.types < len(KINDS))
        if of_data.size:
            self.kind = KINDS[int(frames.types[of_data[0]])]
            # From the first packet on, headers of other kinds mean nothing.
            frames = frames.before(int(frames.starts[of_data[0]]))
        self._note(data, frames, len(KINDS))
        return data[frames.used :]

    def _packets(self, rows: NDArray[np.uint8], starts: NDArray[np.int64]) -> Packets:
        """Packets out of their bytes, one packet a row."""
        words = np.ascontiguousarray(rows[:, 4:-2]).view(">u2").astype(np.uint16)
        values = words[:, 2:].view(np.int16)
        return Packets(words[:, 0], words[:, 1], values, starts + self._offset)

    def _note(self, data: bytes, frames: Frames, kinds: int) -> None:
        """Count what was found, keep the replies, and go on in the stream."""
        replies = np.flatnonzero(frames.types >= kinds)
        for start, size in zip(frames.starts[replies], frames.sizes[replies], strict=True):
            self._replies.append(_reply(data[start : start + size]))
        so_far = self.statistics
        self.statistics = Statistics(
            so_far.packets + len(frames.starts) - len(replies),
            so_far.replies + len(replies),
            so_far.bad_checksums + len(frames.bad),
            so_far.skipped_bytes + frames.skipped,
        )
        self._offset += frames.used


def parse_all(data: bytes) -> tuple[Parser, Packets]:
    """The packets of a whole stream, and the parser that knows what else was in it."""
    parser = Parser()
    packets = _joined([parser.feed(data), parser.finish()], parser.kind)
    return parser, packets


def _joined(pieces: list[Packets], kind: Kind | None) -> Packets:
    """One piece out of several."""
    pieces = [piece for piece in pieces if len(piece)]
    if not pieces:
        return _none(kind.columns if kind else 0)
    if len(pieces) == 1:
        return pieces[0]
    return Packets(
        np.concatenate([piece.counts for piece in pieces]),
        np.concatenate([piece.status for piece in pieces]),
        np.concatenate([piece.values for piece in pieces]),
        np.concatenate([piece.offsets for piece in pieces]),
    )


def _find(array: NDArray[np.uint8], kinds: tuple[Kind, ...], final: bool) -> Frames:
    """The packets of some kinds, and the replies, whose types are counted on behind them."""
    return find_frames(array, [*(kind.frame for kind in kinds), *_REPLIES], final=final)


def _none(columns: int) -> Packets:
    """No packet at all."""
    empty = np.empty(0, np.uint16)
    return Packets(empty, empty, np.empty((0, columns), np.int16), np.empty(0, np.int64))


def _reply(frame: bytes) -> Reply:
    """What a valid frame that holds no data says."""
    if len(frame) == _REPLIES[0].size:
        return Reply(code=frame[4])
    return Reply(serial=frame[4:-2].decode("latin-1").strip(" \0"))
