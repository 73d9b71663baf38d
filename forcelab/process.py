"""A job done by a process of its own, with progress as it comes back."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from functools import cache
from multiprocessing.connection import Connection, wait
from pickle import PicklingError
from types import ModuleType
from typing import Any, Literal, TypeVar

from forcelab.errors import ForcelabError
from forcelab.jobs import Progress, finish
from forcelab.parallel import ENDED

#: How much it stands back behind the window, in Unix's levels of niceness.
NICENESS = 10


@contextmanager
def interruptible() -> Iterator[None]:
    """What a job does in here is cleaned up as after an exception when it is cancelled.

    For short work that leaves something half done, such as files: it has a tenth of a second.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # no job of elsewhere
        return
    before = signal.signal(signal.SIGTERM, _leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _leave(*_: object) -> None:
    """End by an exception."""
    raise SystemExit(1)


def working(
    work: Callable[..., Generator[Progress, None, object]],
    given: tuple[object, ...],
    sender: Connection,
) -> None:
    """Do a job in the process made for it, and send what comes of it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    _end_with_parent()
    # Nobody is there any more to send it to: then it is over as well.
    with suppress(BrokenPipeError):
        outcome = _outcome(work, given, sender)
        try:
            sender.send(outcome)
        except (AttributeError, PicklingError, TypeError) as error:  # it cannot travel
            sender.send(_failure(error))


def _outcome(
    work: Callable[..., Generator[Progress, None, object]],
    given: tuple[object, ...],
    sender: Connection,
) -> tuple[Literal["made", "refused", "failed"], object]:
    """What comes of a job, whose progress is sent."""
    from threadpoolctl import threadpool_limits

    try:
        with threadpool_limits(1, user_api="blas"):
            made = finish(work(*given), lambda progress: sender.send(("progress", progress)))
        return "made", made
    except BrokenPipeError:
        raise
    except ForcelabError as error:
        return "refused", error
    except Exception as error:  # noqa: BLE001 - told where somebody sees it
        return _failure(error)


def _failure(error: Exception) -> tuple[Literal["failed"], tuple[str, str]]:
    """An exception that is being handled, as it is told."""
    return "failed", (f"{type(error).__name__}: {error}", traceback.format_exc())


def _end_with_parent() -> None:
    """End this process when the one that asked for it has ended, even if that was killed."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    sentinel = parent.sentinel

    def watch() -> None:
        wait([sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


MadeT = TypeVar("MadeT")

#: Seconds between two yields of a job that is done elsewhere, at most.
SLICE = 0.02
#: Seconds that a process gets to end by itself before it is made to.
GRACE = 0.1
#: What takes long to import, loaded once where processes come from.
HEAVY = (
    "numpy",
    "scipy.fft",
    "scipy.ndimage",
    "sklearn.calibration",
    "sklearn.naive_bayes",
    "sklearn.neighbors",
    "sklearn.neural_network",
    "sklearn.svm",
    "sklearn.tree",
    "skops.io",
    "joblib",
    "threadpoolctl",
)


def elsewhere(
    work: Callable[..., Generator[Progress, None, MadeT]], *given: object
) -> Generator[Progress, None, MadeT]:
    """Run a job in a process of its own, and tell its progress here.

    It leaves this process's interpreter alone, which a job in a thread would hold up, and its
    memory is gone with it. To close the generator ends the process at once, even in the middle of
    what cannot be interrupted; see :func:`interruptible` for what must not be broken off. The
    process ends with this one, is nice to it, and hears no Ctrl+C.

    Parameters
    ----------
    work : callable
        A function of a module, which gives the job: a generator of progress.
    *given : object
        What it is called with; travels to the process, as progress and result travel back.

    Yields
    ------
    Progress
        Everything that the job yields, once; while there is nothing new, the same object again
        every 20 ms, so that closing is never far.

    Returns
    -------
    object
        What the job returns.

    Raises
    ------
    ForcelabError
        What the job raises; or if its process was ended from outside.
    RuntimeError
        For every other exception of the job, caused by one whose text is the trace from there.
    """
    context = _context(work.__module__)
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=working, args=(work, given, sender), daemon=True)
    # What is run as a program need not be there, unless the work is part of it.
    alone = _without_program() if work.__module__ != "__main__" else nullcontext()
    beginning = _Beginning(process, sender, alone)
    latest = Progress(0, 1, "starting")
    try:
        yield latest
        while not beginning.done(SLICE):
            yield latest
        while True:
            if not receiver.poll(SLICE):
                yield latest
                continue
            try:
                kind, what = receiver.recv()
            except (EOFError, OSError) as error:
                raise ForcelabError(ENDED.format("The process that did the work")) from error
            if kind == "progress":
                latest = what
                yield latest
            elif kind == "made":
                process.join(GRACE)
                return what
            elif kind == "refused":
                raise what
            else:
                text, trace = what
                raise RuntimeError(text) from _ThereError(trace)
    finally:
        beginning.end()
        receiver.close()


def warm_up(work: Callable[..., object]) -> None:
    """Load what :func:`elsewhere` needs for some work, so that it begins at once.

    It takes no time here and two seconds elsewhere. Where processes come from nowhere but
    themselves, as on Windows, there is nothing to load before.
    """
    if _context(work.__module__).get_start_method() != "forkserver":
        return
    from multiprocessing.forkserver import ensure_running

    with _STARTING:
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            ensure_running()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _ThereError(Exception):
    """The trace of an exception in another process, as text."""

    def __str__(self) -> str:
        return f"\n{self.args[0]}"


class _Beginning:
    """A process that is being started, which waits for modules to be loaded the first time.

    Parameters
    ----------
    process : Process
    sender : Connection
        Its end of the pipe; closed here once it has it.
    stands_alone : context manager
        Around its start.
    """

    def __init__(
        self, process: Any, sender: Connection, stands_alone: AbstractContextManager[None]
    ) -> None:
        self._process = process
        self._sender = sender
        self._stands_alone = stands_alone
        self._lock = threading.Lock()
        self._begun = False
        self._unwanted = False
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._begin, name="forcelab process", daemon=True)
        self._thread.start()

    def done(self, seconds: float) -> bool:
        """Whether it has been started within that time; raises why it could not be."""
        self._thread.join(seconds)
        if self._thread.is_alive():
            return False
        if self._error is not None:
            raise self._error
        return True

    def end(self) -> None:
        """End the process, however far it is."""
        with self._lock:
            self._unwanted = True
            if self._begun:
                _end(self._process)

    def _begin(self) -> None:
        """Start it. Runs in a thread: the first one waits, and what waits cannot be cancelled."""
        if hasattr(signal, "pthread_sigmask"):
            # Whatever is started from here inherits it: Ctrl+C is for this process alone.
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            with self._stands_alone:
                self._process.start()
        except Exception as error:  # noqa: BLE001 - raised by done()
            self._error = error
            return
        finally:
            self._sender.close()
        with self._lock:
            self._begun = True
            if self._unwanted:
                _end(self._process)


#: Only one process at a time is started without the program.
_STARTING = threading.Lock()


@contextmanager
def _without_program() -> Iterator[None]:
    """Processes started here do not import what was run as a program.

    multiprocessing lets them do that by default, in case that work is defined there. It takes its
    time, ends badly where a script has no ``if __name__ == "__main__"``, and is impossible where
    the program came from the standard input.
    """
    with _STARTING:
        program = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = program


def _end(process: Any) -> None:
    """End a process and leave nothing of it."""
    process.terminate()
    process.join(GRACE)
    if process.is_alive():
        process.kill()
        process.join()
    process.close()


@cache
def _context(module: str) -> Any:
    """Where processes come from; never a plain fork, which a program with threads must not do.

    Parameters
    ----------
    module : str
        Loaded there besides what is heavy, if it is asked for first.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([*HEAVY, module])
    return context
