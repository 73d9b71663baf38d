"""A job run in a process of its own, with its progress and result passed back."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from functools import cache
from multiprocessing.connection import Connection, wait
from pickle import PicklingError
from types import ModuleType
from typing import Any, Final, Literal, TypeVar

from forcelab.errors import ForcelabError
from forcelab.jobs import Progress, finish
from forcelab.parallel import ENDED

#: Priority behind the window, in Unix's levels of niceness; Windows has a class for it.
NICENESS = 10


@contextmanager
def interruptible() -> Iterator[None]:
    """Raise SystemExit in this block when the job is cancelled, so that it can clean up.

    For short work that leaves something half done, such as files: it has a tenth of a second.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # a job in this process
        return
    before = signal.signal(signal.SIGTERM, _exit)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _exit(*_: object) -> None:
    raise SystemExit(1)


def _run(
    work: Callable[..., Generator[Progress, None, object]],
    arguments: tuple[object, ...],
    sender: Connection,
) -> None:
    """The main function of a job's process: run the job and send its progress and outcome."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    if sys.platform == "win32":
        import psutil

        psutil.Process().nice(psutil.BELOW_NORMAL_PRIORITY_CLASS)
    else:
        os.nice(NICENESS)
    _end_with_parent()
    # A receiver that is gone ends the job as well.
    with suppress(BrokenPipeError):
        kind, content = _outcome(work, arguments, sender)
        if kind != "result":
            sender.send((kind, content))
            return
        try:
            _send_result(sender, content)
        except (AttributeError, PicklingError, TypeError) as error:  # it cannot travel
            sender.send(_failure(error))


def _outcome(
    work: Callable[..., Generator[Progress, None, object]],
    arguments: tuple[object, ...],
    sender: Connection,
) -> tuple[Literal["result", "refused", "failed"], object]:
    from threadpoolctl import threadpool_limits

    try:
        with threadpool_limits(1, user_api="blas"):
            result = finish(work(*arguments), lambda progress: sender.send(("progress", progress)))
        return "result", result
    except BrokenPipeError:
        raise
    except ForcelabError as error:
        return "refused", error
    except Exception as error:  # noqa: BLE001 - raised again in the other process
        return _failure(error)


#: Arrays of more bytes travel by themselves, in pieces of so many.
_LARGE: Final = 2**20


def _send_result(sender: Connection, result: object) -> None:
    """Send what a job came to: large arrays behind the rest, of which no copy is made."""
    arrays: list[memoryview] = []

    def stays(buffer: pickle.PickleBuffer) -> bool:
        array = buffer.raw()
        if array.nbytes > _LARGE:
            arrays.append(array)
        return array.nbytes <= _LARGE

    rest = pickle.dumps(result, 5, buffer_callback=stays)
    sender.send(("result", (rest, [array.nbytes for array in arrays])))
    for array in arrays:
        for start in range(0, array.nbytes, _LARGE):
            sender.send_bytes(array[start : start + _LARGE])


def _receive_result(receiver: Connection, rest: bytes, sizes: Sequence[int]) -> Any:
    arrays = [bytearray(size) for size in sizes]
    for array in arrays:
        for start in range(0, len(array), _LARGE):
            receiver.recv_bytes_into(memoryview(array)[start : start + _LARGE])
    return pickle.loads(rest, buffers=arrays)  # noqa: S301 - from a process of this program


def _failure(error: Exception) -> tuple[Literal["failed"], tuple[str, str]]:
    return "failed", (f"{type(error).__name__}: {error}", traceback.format_exc())


def _end_with_parent() -> None:
    """End this process when its parent has ended, even if that was killed."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    sentinel = parent.sentinel

    def watch() -> None:
        wait([sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


ResultT = TypeVar("ResultT")

#: Seconds between two yields of a job in another process, at most.
SLICE = 0.02
#: Seconds that a process gets to end before it is killed.
GRACE = 0.1
#: What takes long to import, loaded once in the fork server.
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


def run_in_process(
    work: Callable[..., Generator[Progress, None, ResultT]], *arguments: object
) -> Generator[Progress, None, ResultT]:
    """Run the job ``work(*arguments)`` in a process of its own; yields and returns what it does.

    It leaves this process's interpreter alone, which a job in a thread would hold up, and its
    memory is gone with it. The process runs at niceness 10, ignores SIGINT and ends with this one.
    Closing the generator ends it at once, even in the middle of what cannot be interrupted; see
    :func:`interruptible`. While there is no new progress the last one is yielded every 20 ms.

    Raises ForcelabError if the job does or its process was killed, and RuntimeError, caused by the
    trace from there, for every other exception.
    """
    context = _context(work.__module__)
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_run, args=(work, arguments, sender), daemon=True)
    # The main program need not be imported, unless the work is part of it.
    alone = _without_program() if work.__module__ != "__main__" else nullcontext()
    start = _ProcessStart(process, sender, alone)
    latest = Progress(0, 1, "starting")
    try:
        yield latest
        while not start.done(SLICE):
            yield latest
        while True:
            if not receiver.poll(SLICE):
                yield latest
                continue
            try:
                kind, content = receiver.recv()
                if kind == "result":
                    content = _receive_result(receiver, *content)
            except (EOFError, OSError) as error:
                raise ForcelabError(ENDED.format("The process that did the work")) from error
            if kind == "progress":
                latest = content
                yield latest
            elif kind == "result":
                process.join(GRACE)
                return content
            elif kind == "refused":
                raise content
            else:
                text, trace = content
                raise RuntimeError(text) from _RemoteTracebackError(trace)
    finally:
        start.end()
        receiver.close()


def warm_up(work: Callable[..., object]) -> None:
    """Start the fork server with what some work imports, so that its process starts at once.

    It takes two seconds in the background. Without a fork server, as on Windows, it does nothing.
    """
    if sys.platform == "win32" or _context(work.__module__).get_start_method() != "forkserver":
        return
    from multiprocessing.forkserver import ensure_running

    with _STARTING:
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            ensure_running()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _RemoteTracebackError(Exception):
    """The trace of an exception in another process, as text."""

    def __str__(self) -> str:
        return f"\n{self.args[0]}"


class _ProcessStart:
    """A process being started in a thread: the first start waits for modules to be loaded.

    Its end of the pipe, `sender`, is closed here once the process has it.
    """

    def __init__(
        self, process: Any, sender: Connection, stands_alone: AbstractContextManager[None]
    ) -> None:
        self._process = process
        self._sender = sender
        self._stands_alone = stands_alone
        self._lock = threading.Lock()
        self._started = False
        self._ended = False
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._start, name="forcelab process", daemon=True)
        self._thread.start()

    def done(self, seconds: float) -> bool:
        """Whether it has started within that time; raises the error if it could not."""
        self._thread.join(seconds)
        if self._thread.is_alive():
            return False
        if self._error is not None:
            raise self._error
        return True

    def end(self) -> None:
        """End the process, however far it is."""
        with self._lock:
            self._ended = True
            if self._started:
                _end(self._process)

    def _start(self) -> None:
        if sys.platform != "win32":
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
            self._started = True
            if self._ended:
                _end(self._process)


#: Only one process at a time is started without the program.
_STARTING = threading.Lock()


@contextmanager
def _without_program() -> Iterator[None]:
    """Keep processes started here from importing the main program.

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
    process.terminate()
    process.join(GRACE)
    if process.is_alive():
        process.kill()
        process.join()
    process.close()


@cache
def _context(module: str) -> Any:
    """The context that starts processes; never a plain fork, which is unsafe with threads.

    The fork server imports what is heavy and `module`, if it is asked for first. macOS has one too,
    but its libraries, NumPy's Accelerate among them, do not bear a fork once they are loaded.
    """
    if sys.platform == "darwin" or "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([*HEAVY, module])
    return context
