"""The other side of :mod:`forcelab.elsewhere`: what happens in the process that does a job."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import traceback
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, wait
from pickle import PicklingError
from typing import Literal

from forcelab.errors import ForcelabError
from forcelab.jobs import Progress, finish

__all__ = ["interruptible", "working"]

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
