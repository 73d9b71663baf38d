"""The journal: all that is recorded, on the disk while it is recorded.

An append-only file: a line with the version, then records of a head (kind, device, length, and a
CRC-32 over these and the payload) and a payload, little-endian. Whatever ends the program, the file
is whole up to the last record that was forced to the disk, at most :data:`FLUSHED` seconds ago. Its
first record, JSON, says what is recorded. The writer keeps what the disk refuses in memory.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from forcelab.capture.blocks import Block
from forcelab.errors import InputError

__all__ = [
    "FLUSHED",
    "SUFFIX",
    "Contents",
    "Kind",
    "Record",
    "block_bytes",
    "block_of",
    "block_of_all",
    "encoded",
    "header_bytes",
    "json_of",
    "parsed",
    "read",
]

#: Seconds after which what was recorded is on the disk, at most.
FLUSHED = 0.2
#: How the names of journals end.
SUFFIX = ".journal"

_MAGIC = b"forcelab journal "
_VERSION = 1
_HEAD = struct.Struct("<BBI")
_CRC = struct.Struct("<I")
_BLOCK = struct.Struct("<IHBx")
_TICKS, _STATUS = 1, 2


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


@dataclass(frozen=True, slots=True)
class Contents:
    """What is in a journal.

    Parameters
    ----------
    header : dict
        What is recorded.
    records : tuple of Record
        All whole records after the header.
    torn : int
        Bytes at the end that are no whole record.
    """

    header: dict[str, Any]
    records: tuple[Record, ...]
    torn: int


def encoded(kind: Kind, payload: bytes, device: int = 0) -> bytes:
    """A record as bytes."""
    head = _HEAD.pack(kind, device, len(payload))
    return head + _CRC.pack(zlib.crc32(payload, zlib.crc32(head))) + payload


def header_bytes(header: dict[str, Any]) -> bytes:
    """What a journal begins with."""
    return _MAGIC + b"%d\n" % _VERSION + encoded(Kind.HEADER, json.dumps(header).encode())


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


def block_of(payload: bytes) -> Block:
    """The block of samples in the payload of a record.

    Raises
    ------
    InputError
        If its length is not what it says of itself.
    """
    return block_of_all([payload], _columns_of(payload))


def block_of_all(payloads: Sequence[bytes], columns: int) -> Block:
    """One block of all samples in the payloads of one device's records.

    Parameters
    ----------
    payloads : sequence of bytes
        In their order.
    columns : int
        Channels of the device.

    Raises
    ------
    InputError
        If the length of one is not what it says of itself, or it has other channels.
    """
    arrived, ticks, values, status = [], [], [], []
    for payload in payloads:
        if _columns_of(payload) != columns:
            raise InputError("The journal's samples do not fit its channels; record again.")
        rows, _, flags = _BLOCK.unpack_from(payload)
        ticked, told = bool(flags & _TICKS), bool(flags & _STATUS)
        if len(payload) != _BLOCK.size + rows * (8 + 8 * ticked + 8 * columns + 2 * told):
            raise InputError("A block of samples in the journal has a wrong length; record again.")
        # Bytes are cut and joined, and are made numbers once: that is what takes time.
        at = _BLOCK.size + 8 * rows
        arrived.append(payload[_BLOCK.size : at])
        if ticked:
            ticks.append(payload[at : at + 8 * rows])
            at += 8 * rows
        values.append(payload[at : at + 8 * rows * columns])
        if told:
            status.append(payload[at + 8 * rows * columns :])

    def joined(parts: list[bytes], kind: str) -> Any:
        return np.frombuffer(b"".join(parts), kind)

    whole = len(payloads) > 0
    return Block(
        joined(arrived, "<f8"),
        joined(ticks, "<i8") if whole and len(ticks) == len(payloads) else None,
        joined(values, "<f8").reshape(-1, columns),
        joined(status, "<u2") if whole and len(status) == len(payloads) else None,
    )


def _columns_of(payload: bytes) -> int:
    """How many channels a block of samples has, by what it says of itself."""
    if len(payload) < _BLOCK.size:
        raise InputError("A block of samples in the journal is too short; record again.")
    columns: int = _BLOCK.unpack_from(payload)[1]
    return columns


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
    """Read all whole records of a journal.

    Parameters
    ----------
    path : Path
        Of a recording that has ended, however it ended.

    Raises
    ------
    InputError
        If it cannot be read, is no journal or one of another version, or ends before it says what
        was recorded.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(
            f"The journal '{path}' cannot be read ({error.strerror or error}); look whether the "
            f"disk is connected."
        ) from error
    return parsed(data, str(path))


def parsed(data: bytes, name: str) -> Contents:
    """Read all whole records in the bytes of a journal; see :func:`read`.

    Parameters
    ----------
    data : bytes
        All that there is.
    name : str
        What errors call it.
    """
    line, _, _ = data[: len(_MAGIC) + 12].partition(b"\n")
    whole = line.startswith(_MAGIC) and len(line) < len(data) and line[len(_MAGIC) :].isdigit()
    if not whole:
        raise InputError(f"'{name}' is no journal of a recording; choose another file.")
    version = int(line[len(_MAGIC) :])
    if version != _VERSION:
        raise InputError(
            f"The journal '{name}' is of version {version}, which this program does not know; "
            f"open it with a newer forcelab."
        )
    records, torn = _records(memoryview(data)[len(line) + 1 :])
    if not records or records[0].kind != Kind.HEADER:
        raise InputError(
            f"The journal '{name}' ends before it says what was recorded; nothing is in it, "
            f"delete it."
        )
    return Contents(json_of(records[0]), tuple(records[1:]), torn)


def _records(data: memoryview) -> tuple[list[Record], int]:
    """The whole records from the first on, and how many bytes are left."""
    found, at, begin = [], 0, _HEAD.size + _CRC.size
    while len(data) - at >= begin:
        kind, device, length = _HEAD.unpack_from(data, at)
        (crc,) = _CRC.unpack_from(data, at + _HEAD.size)
        payload = bytes(data[at + begin : at + begin + length])
        check = zlib.crc32(payload, zlib.crc32(data[at : at + _HEAD.size]))
        if len(payload) < length or check != crc or kind not in _KINDS:
            break
        found.append(Record(_KINDS[kind], device, payload))
        at += begin + length
    return found, len(data) - at


def _raw(array: Any, kind: str) -> bytes:
    """An array's numbers as little-endian bytes."""
    return np.ascontiguousarray(array, dtype=kind).tobytes()
