"""Samples as the payloads of a journal's records, and put together again.

Little-endian: how many samples and channels, whether there are counters and status words, then
arrivals, counters, values and status words, one array after the other.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

from forcelab.capture.blocks import Block
from forcelab.errors import InputError

__all__ = ["Samples", "block_bytes"]

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
