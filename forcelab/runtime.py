"""Settings of the whole process, each with what it was measured to bring.

Elsewhere only: hooks for errors (:mod:`forcelab.gui.exception_hook`), signals, and limits on the
threads of single fits (``threadpool_limits``).
"""

from __future__ import annotations

import ctypes
import gc
import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any

#: A full search for garbage comes after so many of the middle generation; Python's choice is 10.
GC_THRESHOLD = 1000
#: Seconds after which a thread must hand over the interpreter to another one that waits for it.
SWITCH_INTERVAL = 0.0005

_lock = threading.Lock()
_inside = 0
#: Libraries that were found with more than one thread, with how many.
_before: list[tuple[Any, int]] = []


@cache
def _libraries(_scipy: bool) -> list[Any]:
    """What tells each BLAS how many threads to use; looking for them takes milliseconds."""
    from threadpoolctl import ThreadpoolController

    return list(ThreadpoolController().select(user_api="blas").lib_controllers)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep BLAS on one thread until the last of all that run at once has ended.

    The setting is the process's: were each to restore what it found, the last one might restore
    what another had set. Quick enough to be entered a thousand times a second. An epoch of the
    paper's MLP takes 0.77 s with one thread and 5.15 s with two: its matrices are small.
    """
    global _inside  # noqa: PLW0603 - so is the setting
    with _lock:
        # SciPy brings a BLAS of its own, perhaps while others are inside.
        for library in _libraries("scipy.linalg._fblas" in sys.modules):
            if (count := library.get_num_threads()) != 1:
                _before.append((library, count))
                library.set_num_threads(1)
        _inside += 1
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            while _inside == 0 and _before:
                library, count = _before.pop()  # the first found is the last restored
                library.set_num_threads(count)


def switch_threads_often() -> None:
    """Let the window's thread interrupt a job at work after 0.5 ms instead of 5 ms.

    Beside one busy thread the wait for the interpreter falls from 5.7 to 0.6 ms in the median,
    and a paint needs the interpreter several times.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)


def collect_garbage_rarely() -> None:
    """Leave the full search for garbage to :func:`collect_garbage`, which passes over modules.

    By itself it may come in the midst of a stroke. In a window that has opened twelve
    demonstrations it takes 44 ms through all 78,000 objects, and 7 ms through those that are newer
    than this call. What reference counts free at once, which is nearly everything, needs no search.
    """
    gc.collect()
    gc.freeze()
    young, middle, _ = gc.get_threshold()
    gc.set_threshold(young, middle, GC_THRESHOLD)


def collect_garbage() -> None:
    """Search for garbage now."""
    gc.collect()


def return_memory() -> None:
    """Return freed memory to the system: glibc keeps 100 MB and more of arrays and pictures."""
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):  # another C library
            ctypes.CDLL("libc.so.6").malloc_trim(0)


@contextmanager
def quiet_joblib() -> Iterator[None]:
    """Silence what joblib says when a parallel job is stopped early.

    It warns of it; and where work was handed out a moment before, its manager's thread misses the
    item that it just dropped, and ends with a `KeyError`.
    """
    before = threading.excepthook

    def report(end: threading.ExceptHookArgs) -> None:
        late = end.exc_type is KeyError and type(end.thread).__name__ == "_ExecutorManagerThread"
        if not late:
            before(end)

    threading.excepthook = report
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            yield
    finally:
        threading.excepthook = before
