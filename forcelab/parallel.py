"""The same work on many things, shared by several processes."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import cache, partial
from typing import TypeVar

from forcelab.errors import ForcelabError
from forcelab.runtime import quiet_joblib

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
    coming: Generator[MadeT, None, None] | None = None
    try:
        with _deaf_to_interrupts():
            coming = Parallel(n_jobs=jobs, return_as="generator")(there(one) for one in given)
        for made in coming:  # noqa: UP028 - "yield from" would close it before what follows
            yield made
    except BrokenProcessPool as error:
        raise ForcelabError(ENDED.format("A process that shared the work")) from error
    finally:
        if coming is not None:
            with quiet_joblib():
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
    """Processes started here never hear Ctrl+C, which a terminal sends to all: this one ends them.

    It hears of it when they have started. To ignore it meanwhile, which they would inherit too,
    would lose it.
    """
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        yield
        return
    masks = hasattr(signal, "pthread_sigmask")
    if masks:
        _start_trackers()
    heard: list[int] = []
    handler = signal.signal(signal.SIGINT, lambda number, _: heard.append(number))
    # What a thread has blocked, the processes and threads it starts have blocked as well.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if masks else set()
    try:
        yield
    finally:
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        signal.signal(signal.SIGINT, handler)
    for number in heard[:1]:
        signal.raise_signal(number)


def _start_trackers() -> None:
    """Start the processes that look after shared memory: their start unblocks Ctrl+C."""
    from multiprocessing import resource_tracker

    from joblib.externals.loky.backend import resource_tracker as of_joblib

    resource_tracker.ensure_running()
    of_joblib.ensure_running()
