"""Work shared by several processes, with progress as it comes back."""

from __future__ import annotations

import signal
import threading
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

__all__ = ["shared"]

GivenT = TypeVar("GivenT")
MadeT = TypeVar("MadeT")


def shared(
    work: Callable[[GivenT], MadeT], given: Iterable[GivenT], jobs: int
) -> Generator[MadeT, None, None]:
    """Do the same work on many things, in several processes; gives what was made in their order.

    To stop iterating ends the processes. Ctrl+C reaches this process alone.

    Parameters
    ----------
    work : callable
        A function of a module, which every process can import.
    given : iterable
        What `work` is called with.
    jobs : int
        Number of processes; with 1 the work is done here.
    """
    if jobs <= 1:
        for one in given:
            yield work(one)
        return
    from joblib import Parallel, delayed

    with _deaf_to_interrupts():
        coming = Parallel(n_jobs=jobs, return_as="generator")(delayed(work)(one) for one in given)
    try:
        for made in coming:  # noqa: UP028 - "yield from" would close it before what follows
            yield made
    finally:
        with warnings.catch_warnings():
            # joblib finds it worth a warning that somebody stops early.
            warnings.simplefilter("ignore", UserWarning)
            coming.close()


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
