"""Jobs of the window: generators that run in background threads and report to the GUI's thread.

A job yields now and then, its progress or ``None``; between two yields it can be cancelled, and
then its ``close()`` is called in its own thread, so that ``finally`` and ``with`` clean up there.
Of the jobs with one key only the newest counts: it waits until the one before has come to its next
yield, which keeps a hurried coder from piling up threads, and the result of the older is dropped.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Generator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from PySide6.QtCore import QObject, Qt, Signal, SignalInstance, Slot

from forcelab.errors import ForcelabError

#: Seconds that the window waits for its jobs when it closes.
THREAD_TIMEOUT = 1.0


@dataclass(eq=False)
class Job:
    """One job with its result; made by :meth:`Jobs.run`."""

    key: str
    generator: Generator[Any, None, Any]
    done: Callable[[Any], object]
    failed: Callable[[Exception], object] | None
    progress: Callable[[Any], object] | None
    result: object = None
    error: Exception | None = None
    running: bool = True  # it waits or works
    cancelled: bool = False  # its result is to be dropped
    # What was yielded last and not yet been shown; only the newest is worth showing.
    latest: object = None
    unseen: threading.Lock = field(default_factory=threading.Lock)

    def cancel(self) -> None:
        """Ask it to stop at its next yield; nothing of it is delivered from now on."""
        self.cancelled = True

    def work(self, moved: Callable[[], object]) -> None:
        """Run to the end or until cancelled, in the calling thread, and clean up there.

        `moved` is called when there is progress to show and none is under way already.
        """
        try:
            while not self.cancelled:
                try:
                    self.latest = next(self.generator)
                except StopIteration as end:
                    self.result = end.value
                    return
                if self.progress is not None and self.unseen.acquire(blocking=False):
                    moved()
        except Exception as error:  # noqa: BLE001 - carried to the GUI's thread, which reports it
            self.error = error
        finally:
            try:
                self.generator.close()
            except Exception as error:  # noqa: BLE001 - as above: cleaning up may fail, too
                self.error = self.error or error
            self.running = False


@dataclass
class _Lane:
    """The jobs of one key: one that works and at most one that waits for it."""

    current: Job | None = None
    waiting: Job | None = None


class Jobs(QObject):
    """The background jobs of one window; `trouble` has the sentence of a failure nobody handles."""

    trouble = Signal(str)
    _moved = Signal(object)
    _over = Signal(object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._lanes: dict[str, _Lane] = {}
        self._threads: set[threading.Thread] = set()
        self._newest: dict[str, Job] = {}  # whose result is wanted and not delivered yet
        self._lock = threading.Lock()
        self._closing = False
        self._count = 0
        self._moved.connect(self._show_progress, Qt.ConnectionType.QueuedConnection)
        self._over.connect(self._deliver, Qt.ConnectionType.QueuedConnection)

    @property
    def busy(self) -> tuple[str, ...]:
        """The keys of the jobs that work or wait, or whose results are still to be delivered."""
        with self._lock:
            working = [key for key, lane in self._lanes.items() if lane.current is not None]
        return tuple(dict.fromkeys((*working, *self._newest)))

    def awaits(self, key: str) -> bool:
        """Whether the result of a job of this key is still to be delivered."""
        return key in self._newest

    def run(
        self,
        generator: Generator[Any, None, Any],
        done: Callable[[Any], object],
        failed: Callable[[Exception], object] | None = None,
        progress: Callable[[Any], object] | None = None,
        key: str = "",
    ) -> Job:
        """Run a generator in the background; to be called in the GUI's thread.

        It yields progress or ``None`` often enough to be cancelled, and works on a snapshot:
        nothing of the window may be touched in its thread. `done` gets what it returns, `failed`
        its exception and `progress` what it yielded last, all in the GUI's thread. Without `failed`
        the sentence of a :class:`ForcelabError` goes to :attr:`trouble`; any other exception is a
        fault of the program, which is reported besides. A newer job of a key cancels the older one;
        jobs without a key are independent.
        """
        self._count += 1
        job = Job(key or f"job {self._count}", generator, done, failed, progress)
        self.cancel(job.key)
        self._newest[job.key] = job
        with self._lock:
            if self._closing:
                job.cancel()
            lane = self._lanes.setdefault(job.key, _Lane())
            replaced = lane.waiting
            if lane.current is None:
                lane.current = job
                thread = threading.Thread(
                    target=self._work, args=(lane, job), name=f"forcelab {job.key}", daemon=True
                )
                self._threads = {old for old in self._threads if old.is_alive()} | {thread}
                thread.start()
            else:
                lane.waiting = job
        if replaced is not None:
            replaced.work(lambda: None)  # closes a generator that never began, in no time
        return job

    def cancel(self, key: str) -> None:
        """Cancel the job of a key, if there is one; also one that ended and was not delivered."""
        if (job := self._newest.pop(key, None)) is not None:
            job.cancel()

    def close(self, patience: float = THREAD_TIMEOUT) -> bool:
        """Cancel all jobs, wait `patience` s at most, and cancel later ones before they begin.

        Returns whether all have ended. The thread of a job that does not yield in time is left
        behind: it ends with the process at the latest, and its result is dropped.
        """
        with self._lock:
            self._closing = True
            threads = tuple(self._threads)
        for key in tuple(self._newest):
            self.cancel(key)
        deadline = time.monotonic() + patience
        for thread in threads:
            thread.join(max(0.0, deadline - time.monotonic()))
        return not any(thread.is_alive() for thread in threads)

    def _work(self, lane: _Lane, first: Job) -> None:
        """Do a lane's jobs one after the other; runs in the lane's thread."""
        job: Job | None = first
        while job is not None:
            current = job
            current.work(partial(self._send, self._moved, current))
            with self._lock:
                job, lane.waiting = lane.waiting, None
                lane.current = job
                if job is None:
                    del self._lanes[current.key]
            self._send(self._over, current)

    def _send(self, signal: SignalInstance, job: Job) -> None:
        """Send a job to the GUI's thread, unless the window has gone meanwhile."""
        with suppress(RuntimeError):  # what PySide raises when the C++ object was deleted
            signal.emit(job)

    @Slot(object)
    def _show_progress(self, job: Job) -> None:
        job.unseen.release()
        if job.progress is not None and not job.cancelled:
            job.progress(job.latest)

    @Slot(object)
    def _deliver(self, job: Job) -> None:
        """Deliver the result or the error of a job."""
        if self._newest.get(job.key) is job:
            del self._newest[job.key]
        error = job.error
        if error is not None and not isinstance(error, ForcelabError):
            # A fault is worth knowing even where the result is not wanted any more.
            sys.excepthook(type(error), error, error.__traceback__)
        if job.cancelled:
            return
        if error is None:
            job.done(job.result)
        elif job.failed is not None:
            job.failed(error)
        elif isinstance(error, ForcelabError):
            self.trouble.emit(str(error))
