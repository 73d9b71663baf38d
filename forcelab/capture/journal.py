"""The journal: all that is recorded, on the disk while it is recorded.

Samples as the payloads of a journal's records, and put together again. Little-endian: how many
samples and channels, whether there are counters and status words, then arrivals, counters, values
and status words, one array after the other.

An append-only file: a line with the version, then records of a head (kind, device, length, and a
CRC-32 over these and the payload) and a payload, little-endian. Whatever ends the program, the file
is whole up to the last record that was forced to the disk, at most :data:`FLUSHED` seconds ago. Its
first record, JSON, says what is recorded. The writer keeps what the disk refuses in memory.
"""

from __future__ import annotations

import itertools
import json
import math
import struct
import zlib
from collections.abc import Callable, Generator, Iterator
from enum import IntEnum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from forcelab.capture.device import Block
from forcelab.errors import InputError

_BLOCK = struct.Struct("<IHBx")
_TICKS, _STATUS = 1, 2


def block_bytes(block: Block) -> bytes:
    """A block of samples as the payload of a record."""
    flags = (_TICKS if block.ticks is not None else 0) | (
        _STATUS if block.status is not None else 0
    )
    rows, columns = block.values.shape
    parts = [_BLOCK.pack(rows, columns, flags), _raw(block.arrived, "<f8")]
    if block.ticks is not None:
        parts.append(_raw(block.ticks, "<i8"))
    parts.append(_raw(block.values, "<f8"))
    if block.status is not None:
        parts.append(_raw(block.status, "<u2"))
    return b"".join(parts)


class Samples:
    """All samples of a device, put together out of its records.

    Parameters
    ----------
    columns : int
        Channels of the device.
    """

    def __init__(self, columns: int) -> None:
        self._columns = columns
        # Bytes are cut and joined, and are made numbers once: that is what takes time.
        self._arrived, self._ticks, self._values = bytearray(), bytearray(), bytearray()
        self._ticked = True

    def __len__(self) -> int:
        return len(self._arrived) // 8

    def add(self, payload: bytes) -> None:
        """Add the samples in the payload of a record.

        Raises
        ------
        InputError
            If its length is not what it says of itself, or it has other channels.
        """
        if _columns_of(payload) != self._columns:
            raise InputError("The journal's samples do not fit its channels; record again.")
        rows, columns, flags = _BLOCK.unpack_from(payload)
        ticked, told = bool(flags & _TICKS), bool(flags & _STATUS)
        if len(payload) != _BLOCK.size + rows * (8 + 8 * ticked + 8 * columns + 2 * told):
            raise InputError("A block of samples in the journal has a wrong length; record again.")
        self._ticked = self._ticked and ticked
        at = _BLOCK.size + 8 * rows
        self._arrived += payload[_BLOCK.size : at]
        if ticked:
            self._ticks += payload[at : at + 8 * rows]
            at += 8 * rows
        self._values += payload[at : at + 8 * rows * columns]

    def block(self) -> Block:
        """The samples so far as one block, with counters where all have them."""
        return Block(
            np.frombuffer(self._arrived, "<f8"),
            np.frombuffer(self._ticks, "<i8") if self._ticked else None,
            np.frombuffer(self._values, "<f8").reshape(-1, self._columns),
        )


def _columns_of(payload: bytes) -> int:
    """How many channels a block of samples has, by what it says of itself."""
    if len(payload) < _BLOCK.size:
        raise InputError("A block of samples in the journal is too short; record again.")
    columns: int = _BLOCK.unpack_from(payload)[1]
    return columns


def _raw(array: Any, kind: str) -> bytes:
    """An array's numbers as little-endian bytes."""
    return np.ascontiguousarray(array, dtype=kind).tobytes()


#: Seconds after which what was recorded is on the disk, at most.
FLUSHED = 0.2
#: How the names of journals end.
SUFFIX = ".journal"
#: Bytes that are read at once.
PIECE = 1 << 20

_MAGIC = b"forcelab journal "
_VERSION = 1
_HEAD = struct.Struct("<BBI")
_CRC = struct.Struct("<I")
_BEGIN = _HEAD.size + _CRC.size
_LINE = len(_MAGIC) + 12  # bytes of the first line, at most


class Kind(IntEnum):
    """What a record holds."""

    HEADER = 1  #: JSON: what is recorded
    BLOCK = 2  #: samples of a device
    EVENT = 3  #: JSON: ``{"at": s, "what": ...}``, such as that a device was unplugged
    MARK = 4  #: JSON: ``{"at": s, "action": ..., "down": bool}``
    MESSAGE = 5  #: JSON: ``{"at": s, "text": ...}``, a sentence for people
    FRAME = 6  #: JSON: stamps of frames that a camera gave


_KINDS = {int(kind): kind for kind in Kind}


class Record(NamedTuple):  # a recording has hundreds of thousands
    """One record.

    Parameters
    ----------
    kind : Kind
    device : int
        Number of the device or camera in the header; 0 where there is none.
    payload : bytes
    """

    kind: Kind
    device: int
    payload: bytes


class Contents:
    """What is in a journal, read piece by piece whenever it is gone through.

    An hour of recording is hundreds of megabytes, which need never be in memory at once.

    Parameters
    ----------
    source : callable
        Gives the journal's bytes from the first on, in pieces of any length.
    name : str
        What errors call it.

    Attributes
    ----------
    header : dict
        What is recorded.

    Raises
    ------
    InputError
        If it cannot be read, is no journal or one of another version, or ends before it says what
        was recorded.
    """

    def __init__(self, source: Callable[[], Iterator[bytes]], name: str) -> None:
        self._source, self._name = source, name
        self._torn: int | None = None
        found = self._all()
        first = next(found, None)
        found.close()
        if first is None or first.kind != Kind.HEADER:
            raise InputError(
                f"The journal '{name}' ends before it says what was recorded; nothing is in it, "
                f"delete it."
            )
        self.header = json_of(first)

    def __iter__(self) -> Iterator[Record]:
        """All whole records after the header."""
        found = self._all()
        next(found)
        yield from found

    @property
    def torn(self) -> int:
        """Bytes at the end that are no whole record."""
        while self._torn is None:
            for _ in self:
                pass
        return self._torn

    def _all(self) -> Generator[Record, None, None]:
        """The whole records from the first on."""
        pieces = self._source()
        try:
            parts: list[bytes] = []
            held, wanted = 0, 0.0  # bytes that are not in a record yet, and that the next one needs
            for piece in itertools.chain((_after_version(pieces, self._name),), pieces):
                held += len(piece)
                if wanted == math.inf:
                    continue  # what follows a damaged record is counted, not kept
                parts.append(piece)
                if held < wanted:
                    continue
                data, at = b"".join(parts), 0
                while (found := _record(data, at)) is not None:
                    yield found
                    at += _BEGIN + len(found.payload)
                parts, held = [data[at:]], len(data) - at
                wanted = _wanted(parts[0])
            self._torn = held
        finally:
            if isinstance(pieces, Generator):
                pieces.close()  # and with it the file


def encoded(kind: Kind, payload: bytes, device: int = 0) -> bytes:
    """A record as bytes."""
    head = _HEAD.pack(kind, device, len(payload))
    return head + _CRC.pack(zlib.crc32(payload, zlib.crc32(head))) + payload


def header_bytes(header: dict[str, Any]) -> bytes:
    """What a journal begins with."""
    return _MAGIC + b"%d\n" % _VERSION + encoded(Kind.HEADER, json.dumps(header).encode())


def json_of(record: Record) -> dict[str, Any]:
    """The JSON object in a record.

    Raises
    ------
    InputError
        If it is none.
    """
    try:
        value = json.loads(record.payload)
    except (ValueError, RecursionError) as error:
        raise InputError("A record of the journal is not what it says; record again.") from error
    if not isinstance(value, dict):
        raise InputError("A record of the journal is not what it says; record again.")
    return value


def read(path: Path) -> Contents:
    """The contents of a journal; see :class:`Contents` for what may be wrong with it.

    Parameters
    ----------
    path : Path
        Of a recording that has ended, however it ended.
    """

    def pieces() -> Iterator[bytes]:
        try:
            with path.open("rb") as file:
                while piece := file.read(PIECE):
                    yield piece
        except OSError as error:
            raise InputError(
                f"The journal '{path}' cannot be read ({error.strerror or error}); look whether "
                f"the disk is connected."
            ) from error

    return Contents(pieces, str(path))


def _after_version(pieces: Iterator[bytes], name: str) -> bytes:
    """What was read beyond the line with the version."""
    data = b""
    while b"\n" not in data and len(data) < _LINE and (piece := next(pieces, b"")):
        data += piece
    line, end, rest = data.partition(b"\n")
    if not (
        end and line.startswith(_MAGIC) and len(line) < _LINE and line[len(_MAGIC) :].isdigit()
    ):
        raise InputError(f"'{name}' is no journal of a recording; choose another file.")
    version = int(line[len(_MAGIC) :])
    if version != _VERSION:
        raise InputError(
            f"The journal '{name}' is of version {version}, which this program does not know; "
            f"open it with a newer forcelab."
        )
    return rest


def _record(data: bytes, at: int) -> Record | None:
    """The record that begins at a place; None where there is no whole one."""
    if len(data) - at < _BEGIN:
        return None
    kind, device, length = _HEAD.unpack_from(data, at)
    payload = data[at + _BEGIN : at + _BEGIN + length]
    if len(payload) < length or kind not in _KINDS:
        return None
    (crc,) = _CRC.unpack_from(data, at + _HEAD.size)
    if zlib.crc32(payload, zlib.crc32(data[at : at + _HEAD.size])) != crc:
        return None
    return Record(_KINDS[kind], device, payload)


def _wanted(data: bytes) -> float:
    """How many bytes the record needs that begins here and is not whole; infinity: it is none."""
    if len(data) < _BEGIN:
        return _BEGIN
    kind, _, length = _HEAD.unpack_from(data)
    needed: int = _BEGIN + length
    return needed if kind in _KINDS and len(data) < needed else math.inf
