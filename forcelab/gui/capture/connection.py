"""The recorder in the hands of jobs: one at a time, and let go of whatever happens."""

from __future__ import annotations

import threading
from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING

from forcelab.errors import InputError

if TYPE_CHECKING:
    from forcelab.capture.keeping import Kept, Recovered
    from forcelab.capture.recorder import Recorder

__all__ = ["Connection", "Left", "recovering"]

#: Seconds that closing the window waits for a recording that is being kept.
PATIENCE = 60.0

#: What became of a recording that ran when its devices were let go: what was kept, or why not.
Left = tuple["Kept | None", str]


class Connection:
    """Opens devices, records and lets go, each as a generator for :class:`~forcelab.gui.jobs.Jobs`.

    Attributes
    ----------
    recorder : Recorder or None
        Open; None while nothing is connected.
    """

    def __init__(self) -> None:
        self.recorder: Recorder | None = None
        self._lock = threading.Lock()  # who has it may use the recorder
        self._gone = False

    def connecting(
        self, path: Path, names: tuple[str, ...], cameras: tuple[str, ...]
    ) -> Generator[None, None, None]:
        """Open devices and cameras for a project."""
        from forcelab.capture.camera import Capture, open_camera
        from forcelab.capture.devices import device_named
        from forcelab.capture.recorder import Recorder

        yield
        with self._lock:
            if self._gone:  # the window was closed meanwhile
                return
            devices = [device_named(name) for name in names]
            captures: list[tuple[str, Capture]] = []
            try:
                for which in cameras:
                    captures.append((f"camera {which}", open_camera(which)))  # noqa: PERF401
            except InputError:
                for _, capture in captures:  # those before it are open
                    capture.release()
                raise
            recorder = Recorder(path, devices, captures)
            recorder.open()
            self.recorder = recorder

    def starting(self, task: str, name: str, author: str) -> Generator[None, None, str]:
        """Record from now on; gives the demonstration's name."""
        yield
        with self._lock:
            return self._open().start(task, name or None, author)

    def stopping(self) -> Generator[None, None, Kept]:
        """Make a demonstration of what was recorded."""
        yield
        with self._lock:
            return self._open().stop()

    def discarding(self) -> Generator[None, None, None]:
        """Keep nothing of what was recorded."""
        yield
        with self._lock:
            self._open().discard()

    def leaving(self) -> Generator[None, None, Left]:
        """Let go of the devices; what is being recorded is kept."""
        yield
        with self._lock:
            recorder, self.recorder = self.recorder, None
            return (None, "") if recorder is None else _keep_and_close(recorder)

    def let_go(self) -> None:
        """Let go at once, and for good: the window closes."""
        self._gone = True
        if not self._lock.acquire(timeout=PATIENCE):
            return  # what is on the disk is offered the next time
        try:
            recorder, self.recorder = self.recorder, None
            if recorder is not None:
                _keep_and_close(recorder)
        finally:
            self._lock.release()

    def _open(self) -> Recorder:
        """The recorder, in a job."""
        if self.recorder is None:
            raise InputError("The devices were let go of; connect them again.")
        return self.recorder


def recovering(path: Path) -> Generator[None, None, tuple[Recovered, ...]]:
    """Make demonstrations of the unfinished recordings of a project."""
    from forcelab.capture.keeping import recover

    yield
    return recover(path)


def _keep_and_close(recorder: Recorder) -> Left:
    """Keep what is being recorded and let go of the devices."""
    kept, trouble = None, ""
    try:
        if recorder.state().recording:
            kept = recorder.stop()
    except InputError as error:  # its journal stays, and is offered the next time
        trouble = str(error)
    finally:
        recorder.close()
    return kept, trouble
