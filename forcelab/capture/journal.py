"""The journal: all that is recorded, on the disk while it is recorded.

An append-only file: a line with the version, then records of a head (kind, device, length, and a
CRC-32 over these and the payload) and a payload, little-endian. Whatever ends the program, the file
is whole up to the last record that was forced to the disk, at most :data:`FLUSH_SECONDS` ago. Its
first record, JSON, says what is recorded. The writer, a thread, keeps what the disk refuses in
memory.

Samples are payloads of how many samples and channels there are, whether there are counters and
status words, then arrivals, counters, values and status words, one array after the other.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import os
import struct
import sys
import tempfile
import threading
import time
import zlib
from collections.abc import Callable, Generator, Iterable, Iterator
from enum import IntEnum
from io import FileIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from forcelab.capture.device import Block, MessageQueue
from forcelab.errors import InputError
from forcelab.io import sync_folder

_BLOCK = struct.Struct("<IHBx")
_TICKS, _STATUS = 1, 2


def encode_block(block: Block) -> bytes:
    """A block of samples as the payload of a record."""
    has_ticks, has_status = block.ticks is not None, block.status is not None
    arrays = (
        (block.arrived, "<f8"),
        (block.ticks, "<i8"),
        (block.values, "<f8"),
        (block.status, "<u2"),
    )
    head = _BLOCK.pack(*block.values.shape, _TICKS * has_ticks | _STATUS * has_status)
    parts = (np.asarray(array, kind).tobytes() for array, kind in arrays if array is not None)
    return b"".join((head, *parts))


class SampleBuffer:
    """All samples of a device, put together out of its records."""

    def __init__(self, columns: int) -> None:
        self._columns = columns
        # Bytes are cut and joined, and are made numbers once: that is what takes time.
        self._arrived, self._ticks, self._values = bytearray(), bytearray(), bytearray()
        self._has_ticks = True

    def __len__(self) -> int:
        return len(self._arrived) // 8

    def add(self, payload: bytes) -> None:
        """Add the samples in the payload of a record.

        InputError if its length is not what it says of itself, or it has other channels.
        """
        if len(payload) < _BLOCK.size:
            raise InputError("A block of samples in the journal is too short; record again.")
        rows, columns, flags = _BLOCK.unpack_from(payload)
        if columns != self._columns:
            raise InputError("The journal's samples do not fit its channels; record again.")
        has_ticks, has_status = bool(flags & _TICKS), bool(flags & _STATUS)
        if len(payload) != _BLOCK.size + rows * (8 + 8 * has_ticks + 8 * columns + 2 * has_status):
            raise InputError("A block of samples in the journal has a wrong length; record again.")
        self._has_ticks = self._has_ticks and has_ticks
        at = _BLOCK.size + 8 * rows
        self._arrived += payload[_BLOCK.size : at]
        if has_ticks:
            self._ticks += payload[at : at + 8 * rows]
            at += 8 * rows
        self._values += payload[at : at + 8 * rows * columns]

    def block(self) -> Block:
        """The samples so far as one block, with counters where all have them."""
        return Block(
            np.frombuffer(self._arrived, "<f8"),
            np.frombuffer(self._ticks, "<i8") if self._has_ticks else None,
            np.frombuffer(self._values, "<f8").reshape(len(self), self._columns),
        )


#: Events of a device.
UNPLUGGED, PLUGGED = "unplugged", "plugged in again"
ENDED = "ended"  # the recording, while the device was unplugged
#: Seconds after which what was recorded is on the disk, at most.
FLUSH_SECONDS = 0.2
#: How the names of journals end.
SUFFIX = ".journal"
#: Bytes that are read at once.
READ_BYTES = 1 << 20

_MAGIC = b"forcelab journal "
_VERSION = 1
_HEAD = struct.Struct("<BBI")
_CRC = struct.Struct("<I")
_BEGIN = _HEAD.size + _CRC.size
_LINE = len(_MAGIC) + 12  # bytes of the first line, at most


class RecordKind(IntEnum):
    HEADER = 1  #: JSON: what is recorded
    BLOCK = 2  #: samples of a device
    EVENT = 3  #: JSON: ``{"at": s, "what": ...}``, such as that a device was unplugged
    #: JSON: ``{"at": s, "action": ..., "down": bool}`` of a key, ``{"at": s, "marker": ...}`` of a
    #: stream of markers
    MARK = 4
    MESSAGE = 5  #: JSON: ``{"at": s, "text": ...}``, a sentence for people
    FRAME = 6  #: JSON: stamps of frames that a camera gave


_KINDS = {int(kind): kind for kind in RecordKind}


class Record(NamedTuple):  # a recording has hundreds of thousands
    """`device` is the number of its device or camera in the header; 0 where there is none."""

    kind: RecordKind
    device: int
    payload: bytes


class JournalReader:
    """What is in a journal, read piece by piece whenever it is gone through.

    An hour of recording is hundreds of megabytes, which need never be in memory at once.
    """

    def __init__(self, source: Callable[[], Iterator[bytes]], name: str) -> None:
        """`source` gives the journal's bytes from the first on, in pieces of any length.

        InputError if it is no journal or one of another version, or ends before it says what was
        recorded.
        """
        self._source, self._name = source, name
        self._torn: int | None = None
        records = self._records()
        first = next(records, None)
        records.close()
        if first is None or first.kind != RecordKind.HEADER:
            raise InputError(
                f"The journal '{name}' ends before it says what was recorded; nothing is in it, "
                f"delete it."
            )
        self.header = decode_json(first)

    def __iter__(self) -> Iterator[Record]:
        """All whole records after the header."""
        records = self._records()
        next(records)
        yield from records

    @property
    def torn(self) -> int:
        """Bytes at the end that are no whole record."""
        while self._torn is None:
            for _ in self:
                pass
        return self._torn

    def _records(self) -> Generator[Record, None, None]:
        """The whole records from the first on."""
        pieces = self._source()
        try:
            parts: list[bytes] = []
            # Bytes that are not in a record yet, and that the next one needs.
            buffered, needed = 0, 0.0
            for piece in itertools.chain((_after_version(pieces, self._name),), pieces):
                buffered += len(piece)
                if needed == math.inf:
                    continue  # what follows a damaged record is counted, not kept
                parts.append(piece)
                if buffered < needed:
                    continue
                data, at = b"".join(parts), 0
                while (record := _parse_record(data, at)) is not None:
                    yield record
                    at += _BEGIN + len(record.payload)
                parts, buffered = [data[at:]], len(data) - at
                needed = _bytes_needed(parts[0])
            self._torn = buffered
        finally:
            if isinstance(pieces, Generator):
                pieces.close()  # and with it the file


def encode_record(kind: RecordKind, payload: bytes, device: int = 0) -> bytes:
    head = _HEAD.pack(kind, device, len(payload))
    return head + _CRC.pack(zlib.crc32(payload, zlib.crc32(head))) + payload


def encode_header(header: dict[str, Any]) -> bytes:
    """The beginning of a journal."""
    return (
        _MAGIC + b"%d\n" % _VERSION + encode_record(RecordKind.HEADER, json.dumps(header).encode())
    )


def decode_json(record: Record) -> dict[str, Any]:
    """The JSON object in a record; InputError if it is none."""
    value = None
    with contextlib.suppress(ValueError, RecursionError):
        value = json.loads(record.payload)
    if not isinstance(value, dict):
        raise InputError("A record of the journal is not what it says; record again.")
    return value


def read_journal(path: Path) -> JournalReader:
    """The contents of the journal of a recording that has ended, however it ended."""

    def pieces() -> Iterator[bytes]:
        try:
            with path.open("rb") as file:
                while piece := file.read(READ_BYTES):
                    yield piece
        except OSError as error:
            raise InputError(
                f"The journal '{path}' cannot be read ({error.strerror or error}); look whether "
                f"the disk is connected."
            ) from error

    return JournalReader(pieces, str(path))


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


def _parse_record(data: bytes, at: int) -> Record | None:
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


def _bytes_needed(data: bytes) -> float:
    """How many bytes the record needs that begins here and is not whole; infinity: it is none."""
    if len(data) < _BEGIN:
        return _BEGIN
    kind, _, length = _HEAD.unpack_from(data)
    needed: int = _BEGIN + length
    return needed if kind in _KINDS and len(data) < needed else math.inf


_RETRY = 1.0  # s between two tries while the disk refuses


class JournalWriter:
    """Writes one journal: records from any thread, in a thread of its own."""

    def __init__(self, path: Path, header: dict[str, Any]) -> None:
        """Begin a new file in a folder that exists; the header is what JSON can hold.

        InputError if the file cannot be made.
        """
        self.path = path
        #: Where all of it is after `close`, if the disk refused some to the end.
        self.saved: Path | None = None
        self._lock = threading.Lock()
        self._waiting: list[bytes] = [encode_header(header)]
        self._unwritten = b""  # what the disk has not confirmed, which begins at this place
        self._place = 0
        self._messages = MessageQueue()
        self._refused = False
        self._tried = 0.0
        self._ended = threading.Event()
        try:
            self._file = FileIO(path, "x+")
            _lock(self._file)
        except OSError as error:
            raise InputError(
                f"'{path}' cannot be written ({error.strerror or error}); nothing is recorded."
            ) from error
        self._flush()
        if self._refused:
            self._file.close()
            with contextlib.suppress(OSError):
                path.unlink()
            raise InputError(f"{self.remarks()[0].rpartition(';')[0]}; nothing is recorded.")
        self._thread = threading.Thread(target=self._run, name="forcelab journal")
        self._thread.start()

    @property
    def in_memory(self) -> int:
        """Bytes that the disk has refused so far and that are kept in memory; 0 if it works."""
        with self._lock:
            return len(self._unwritten) + sum(map(len, self._waiting)) if self._refused else 0

    def block(self, device: int, block: Block) -> None:
        self.record(RecordKind.BLOCK, encode_block(block), device)

    def note(self, kind: RecordKind, device: int = 0, **what: Any) -> None:
        """Record what JSON can hold."""
        self.record(kind, json.dumps(what).encode(), device)

    def record(self, kind: RecordKind, payload: bytes, device: int = 0) -> None:
        """Record anything; it is on the disk :data:`FLUSH_SECONDS` later at most."""
        data = encode_record(kind, payload, device)
        with self._lock:
            self._waiting.append(data)

    def remarks(self) -> tuple[str, ...]:
        """What went wrong since the last call, a sentence each."""
        return self._messages.take()

    def finish(self) -> None:
        """Write what there is and let the thread end; the file stays open for :meth:`contents`."""
        self._ended.set()
        self._thread.join()
        self._tried = 0.0
        self._flush()

    def contents(self) -> JournalReader:
        """All that was recorded, from the disk and from memory; after :meth:`finish`."""
        return JournalReader(self._pieces, str(self.path))

    def close(self, *, delete: bool = False) -> None:
        """Release the file, and remove it if it is not needed any more; closing twice is fine."""
        if not self._ended.is_set():
            self.finish()
        if self._unwritten and not delete and not self._file.closed:
            self.saved = self._save_elsewhere()
        self._file.close()
        if delete or self.saved is not None:
            with contextlib.suppress(OSError):  # it is offered at the next start then
                self.path.unlink()

    def _run(self) -> None:
        while not self._ended.wait(FLUSH_SECONDS / 2):
            self._flush()

    def _flush(self) -> None:
        """Bring what waits to the disk, or keep it and say so once."""
        if self._refused and time.monotonic() - self._tried < _RETRY:
            return
        with self._lock:
            self._unwritten += b"".join(self._waiting)
            self._waiting.clear()
        if not self._unwritten:
            return
        self._tried = time.monotonic()
        try:
            if not self._is_in_place():
                self._rewrite()
            self._file.seek(self._place)  # what was written and not confirmed may be lost
            _write(self._file, (self._unwritten,))
        except OSError as error:
            if not self._refused:
                self._refused = True
                self._messages.put(
                    f"'{self.path}' cannot be written ({error.strerror or error}); the recording "
                    f"goes on in memory and is written as soon as that is possible."
                )
            return
        self._place += len(self._unwritten)
        self._unwritten = b""
        if self._refused:
            self._refused = False
            self._messages.put(
                f"'{self.path}' can be written again; all that was kept in memory is there."
            )

    def _save_elsewhere(self) -> Path | None:
        """Write all of it where there is room, as nothing of it may be lost; where that is."""
        for folder in fallback_folders():
            try:
                file, name = tempfile.mkstemp(SUFFIX, f"{self.path.stem} ", folder)
            except OSError:
                continue
            try:
                with os.fdopen(file, "wb") as copy:
                    copy.writelines(self._confirmed())
                    copy.write(self._unwritten)
                    copy.flush()
                    os.fsync(copy.fileno())
            except OSError:
                with contextlib.suppress(OSError):
                    Path(name).unlink()
                continue
            return Path(name)
        return None

    def _is_in_place(self) -> bool:
        """Whether the open file is still the one under its name."""
        try:
            return os.path.samestat(os.fstat(self._file.fileno()), self.path.stat())
        except FileNotFoundError:
            return False

    def _rewrite(self) -> None:
        """Write the whole journal anew: its folder was away, and is back."""
        file = FileIO(self.path, "x+")  # fails while the folder is away
        try:
            _lock(file)
            _write(file, self._confirmed())
            sync_folder(self.path.parent)
        except OSError:
            file.close()
            with contextlib.suppress(OSError):
                self.path.unlink()
            raise
        self._file.close()
        self._file = file

    def _pieces(self) -> Iterator[bytes]:
        """What is on the disk, and in memory."""
        try:
            yield from self._confirmed()
        except OSError as error:
            raise InputError(
                f"The journal '{self.path}' cannot be read back ({error.strerror or error}); "
                f"connect the disk again."
            ) from error
        yield self._unwritten

    def _confirmed(self) -> Iterator[bytes]:
        """What the disk has confirmed of the open file, which outlives its name, in pieces."""
        at = 0
        while at < self._place:
            self._file.seek(at)
            piece = self._file.read(min(READ_BYTES, self._place - at))
            if not piece:
                break
            yield piece
            at += len(piece)


def _write(file: FileIO, pieces: Iterable[bytes]) -> None:
    """Write all of it where the file stands, and have the disk confirm it."""
    for piece in pieces:
        rest = memoryview(piece)
        while rest:
            rest = rest[file.write(rest) or 0 :]
    os.fsync(file.fileno())


def fallback_folders() -> tuple[Path, ...]:
    """Folders for what a disk refuses: the home folder, and that for temporary files."""
    places = [Path(tempfile.gettempdir())]
    with contextlib.suppress(RuntimeError):  # this user has no home
        places.insert(0, Path.home())
    return tuple(places)


def is_being_written(path: Path) -> bool:
    """Whether a process that is alive writes this journal; False where that is unknown."""
    try:
        with FileIO(path, "r") as file:
            return not _lock(file)
    except OSError:
        return False


#: The byte that is locked in place of a whole file under Windows, which keeps others from reading
#: what is locked; few journals get as long.
_LOCKED_BYTE = 2**31 - 2


def _lock(file: FileIO) -> bool:
    """Lock a file until it is closed, or the process ends; False if another process holds it."""
    if sys.platform == "win32":
        import msvcrt

        place = file.tell()
        file.seek(_LOCKED_BYTE)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except PermissionError:
            return False
        except OSError:  # a file system without locks
            return True
        finally:
            file.seek(place)
        return True
    import fcntl

    try:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True
