"""The journal's writer: a thread that brings records to the disk, whatever the disk does."""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
import threading
import time
from collections.abc import Iterable, Iterator
from io import FileIO
from pathlib import Path
from typing import Any

from forcelab.capture.device import Block
from forcelab.capture.journal import (
    FLUSHED,
    PIECE,
    SUFFIX,
    Contents,
    Kind,
    block_bytes,
    encoded,
    header_bytes,
)
from forcelab.capture.messages import MessageQueue
from forcelab.errors import InputError
from forcelab.io import sync_folder

__all__ = ["JournalWriter", "being_written", "other_places"]

_RETRY = 1.0  # s between two tries while the disk refuses


class JournalWriter:
    """Writes one journal.

    Records may come from any thread; one thread of its own writes them.

    Parameters
    ----------
    path : Path
        A file that is not there yet, in a folder that is.
    header : dict
        What is recorded; anything that JSON can hold.

    Attributes
    ----------
    path : Path
    saved : Path or None
        Where all of it is after :meth:`close`, if the disk refused some to the end.

    Raises
    ------
    InputError
        If the file cannot be made.
    """

    def __init__(self, path: Path, header: dict[str, Any]) -> None:
        self.path = path
        self.saved: Path | None = None
        self._lock = threading.Lock()
        self._waiting: list[bytes] = [header_bytes(header)]
        self._unwritten = b""  # what the disk has not confirmed, which begins at this place
        self._place = 0
        self._events = MessageQueue()
        self._refused = False
        self._tried = 0.0
        self._ended = threading.Event()
        try:
            self._file = FileIO(path, "x+")
            _hold(self._file)
        except OSError as error:
            raise InputError(
                f"'{path}' cannot be written ({error.strerror or error}); nothing is recorded."
            ) from error
        self._bring()
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
        """Record samples of a device."""
        self.record(Kind.BLOCK, block_bytes(block), device)

    def note(self, kind: Kind, device: int = 0, **what: Any) -> None:
        """Record what JSON can hold."""
        self.record(kind, json.dumps(what).encode(), device)

    def record(self, kind: Kind, payload: bytes, device: int = 0) -> None:
        """Record anything; it is on the disk :data:`FLUSHED` seconds later at most."""
        whole = encoded(kind, payload, device)
        with self._lock:
            self._waiting.append(whole)

    def remarks(self) -> tuple[str, ...]:
        """What went wrong since the last time this was asked, a sentence each."""
        return self._events.take()

    def finish(self) -> None:
        """Write what there is and let the thread end; the file stays open for :meth:`contents`."""
        self._ended.set()
        self._thread.join()
        self._tried = 0.0
        self._bring()

    def contents(self) -> Contents:
        """All that was recorded, from the disk and from memory; after :meth:`finish`.

        Raises
        ------
        InputError
            If the disk does not give it back.
        """
        return Contents(self._all, str(self.path))

    def close(self, *, delete: bool = False) -> None:
        """Let go of the file; closing twice is fine.

        Parameters
        ----------
        delete : bool
            Whether to remove it: it has become a demonstration, or is not wanted.
        """
        if not self._ended.is_set():
            self.finish()
        if self._unwritten and not delete and not self._file.closed:
            self.saved = self._save()
        self._file.close()
        if delete or self.saved is not None:
            with contextlib.suppress(OSError):  # it is told at the next start then
                self.path.unlink()

    def _run(self) -> None:
        """Write every now and then until told to end."""
        while not self._ended.wait(FLUSHED / 2):
            self._bring()

    def _bring(self) -> None:
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
            if not self._in_place():
                self._put_back()
            self._file.seek(self._place)  # what was written and not confirmed may be lost
            _write(self._file, (self._unwritten,))
        except OSError as error:
            self._refuse(error)
            return
        self._place += len(self._unwritten)
        self._unwritten = b""
        if self._refused:
            self._refused = False
            self._events.say(
                f"'{self.path}' can be written again; all that was kept in memory is there."
            )

    def _save(self) -> Path | None:
        """Write all of it where there is room, as nothing of it may be lost; where that is."""
        for folder in other_places():
            try:
                file, name = tempfile.mkstemp(SUFFIX, f"{self.path.stem} ", folder)
            except OSError:
                continue
            try:
                with os.fdopen(file, "wb") as copy:
                    copy.writelines(self._written())
                    copy.write(self._unwritten)
                    copy.flush()
                    os.fsync(copy.fileno())
            except OSError:
                with contextlib.suppress(OSError):
                    Path(name).unlink()
                continue
            return Path(name)
        return None

    def _in_place(self) -> bool:
        """Whether the open file is still the one under its name."""
        try:
            return os.path.samestat(os.fstat(self._file.fileno()), self.path.stat())
        except FileNotFoundError:
            return False

    def _put_back(self) -> None:
        """Write the whole journal anew: its folder was away, and is there again."""
        anew = FileIO(self.path, "x+")  # fails while the folder is away
        try:
            _hold(anew)
            _write(anew, self._written())
            sync_folder(self.path.parent)
        except OSError:
            anew.close()
            with contextlib.suppress(OSError):
                self.path.unlink()
            raise
        self._file.close()
        self._file = anew

    def _all(self) -> Iterator[bytes]:
        """What is on the disk, and in memory."""
        try:
            yield from self._written()
        except OSError as error:
            raise InputError(
                f"The journal '{self.path}' cannot be read back ({error.strerror or error}); "
                f"connect the disk again."
            ) from error
        yield self._unwritten

    def _written(self) -> Iterator[bytes]:
        """What the disk has confirmed of the open file, which outlives its name, in pieces."""
        at = 0
        while at < self._place:
            self._file.seek(at)
            piece = self._file.read(min(PIECE, self._place - at))
            if not piece:
                break
            yield piece
            at += len(piece)

    def _refuse(self, error: OSError) -> None:
        """Go on in memory, and say so once."""
        if not self._refused:
            self._refused = True
            self._events.say(
                f"'{self.path}' cannot be written ({error.strerror or error}); the recording goes "
                f"on in memory and is written as soon as that is possible."
            )


def _write(file: FileIO, pieces: Iterable[bytes]) -> None:
    """Write all of it where the file stands, and have the disk confirm it."""
    for piece in pieces:
        rest = memoryview(piece)
        while rest:
            rest = rest[file.write(rest) or 0 :]
    os.fsync(file.fileno())


def other_places() -> tuple[Path, ...]:
    """Folders for what a disk refuses: the home folder, and that for temporary files."""
    places = [Path(tempfile.gettempdir())]
    with contextlib.suppress(RuntimeError):  # nobody's home
        places.insert(0, Path.home())
    return tuple(places)


def being_written(path: Path) -> bool:
    """Whether a process that is alive writes this journal; False where that cannot be told."""
    try:
        with FileIO(path, "r") as file:
            return not _hold(file)
    except OSError:
        return False


def _hold(file: FileIO) -> bool:
    """Lock a file until it is closed, or the process ends; False if another one holds it."""
    try:
        import fcntl
    except ImportError:  # Windows, where nobody else can remove an open file anyway
        return True
    try:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True
