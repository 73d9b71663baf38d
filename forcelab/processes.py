"""The same work on many things, shared by several processes."""

from __future__ import annotations

import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import cache, partial
from typing import TypeVar

from forcelab.errors import ForcelabError

__all__ = ["ENDED", "shared"]

GivenT = TypeVar("GivenT")
MadeT = TypeVar("MadeT")

#: What is told of a process that ended before its work did.
ENDED = (
    "{} was ended from outside, as a system does that is short of memory; nothing was changed. "
    "Close other programs and try again."
)


def shared(
    work: Callable[[GivenT], MadeT], given: Iterable[GivenT], jobs: int
) -> Generator[MadeT, None, None]:
    """Do the same work on many things, in several processes; gives what was made in their order.

    To stop iterating ends the processes. Ctrl+C reaches this process alone. Should it be killed,
    the others end by themselves.

    Parameters
    ----------
    work : callable
        A function of a module, which every process can import.
    given : iterable
        What `work` is called with.
    jobs : int
        Number of processes; with 1 the work is done here.

    Raises
    ------
    ForcelabError
        If one of the processes was killed, as a system does that is short of memory.
    """
    if jobs <= 1:
        for one in given:
            yield work(one)
        return
    from joblib import Parallel, delayed

    there = delayed(partial(_worked, work, os.getpid()))
    with _deaf_to_interrupts():
        coming = Parallel(n_jobs=jobs, return_as="generator")(there(one) for one in given)
    try:
        for made in coming:  # noqa: UP028 - "yield from" would close it before what follows
            yield made
    except BrokenProcessPool as error:
        raise ForcelabError(ENDED.format("A process that shared the work")) from error
    finally:
        with warnings.catch_warnings():
            # joblib finds it worth a warning that somebody stops early.
            warnings.simplefilter("ignore", UserWarning)
            coming.close()


def _worked(work: Callable[[GivenT], MadeT], parent: int, given: GivenT) -> MadeT:
    """Do a piece of the work in another process."""
    _follow(parent)
    return work(given)


@cache
def _follow(parent: int) -> None:
    """End this process when its parent has ended: nobody else tells it to."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    if os.getppid() == parent:  # not where it was started by somebody in between
        threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Processes started here ignore Ctrl+C, which a terminal sends to all: the parent ends them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
