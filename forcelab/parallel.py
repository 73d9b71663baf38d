"""The same work on many things, shared by several processes."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from functools import cache, partial
from typing import TypeVar

from forcelab.cluster import current_cluster
from forcelab.errors import ForcelabError
from forcelab.jobs import Progress, finish
from forcelab.runtime import quiet_joblib

ItemT = TypeVar("ItemT")
ResultT = TypeVar("ResultT")

#: The sentence on a process that ended before its work did.
ENDED = (
    "{} was ended from outside, as a system does that is short of memory; nothing was changed. "
    "Close other programs and try again."
)


def map_in_processes(
    work: Callable[[ItemT], ResultT], items: Iterable[ItemT], jobs: int
) -> Generator[ResultT, None, None]:
    """Call `work` on each item in `jobs` processes (1: in this one); yields results in order.

    To stop iterating ends the processes. Ctrl+C reaches this process alone; should it be killed,
    the others end. ForcelabError if one of them was killed.
    """
    if jobs <= 1:
        for item in items:
            yield work(item)
        return
    from joblib import Parallel, delayed

    remote = delayed(partial(_call, work, os.getpid()))
    results: Generator[ResultT, None, None] | None = None
    try:
        with _starting_without_interrupts():
            results = Parallel(n_jobs=jobs, return_as="generator")(remote(item) for item in items)
        for result in results:  # noqa: UP028 - "yield from" would close it before what follows
            yield result
    except BrokenProcessPool as error:
        raise ForcelabError(ENDED.format("A process that shared the work")) from error
    finally:
        if results is not None:
            with quiet_joblib():
                results.close()


def share_work(
    work: Callable[[ItemT], ResultT], items: Iterable[ItemT], jobs: int
) -> Generator[ResultT, None, None]:
    """As :func:`map_in_processes`, by the workers of a cluster where one was joined.

    They may be other machines: the work reads and writes no file.
    """
    cluster = current_cluster()
    yield from map_in_processes(work, items, jobs) if cluster is None else cluster.map(work, items)


def run_job(
    job: Callable[..., Generator[Progress, None, ResultT]], *arguments: object
) -> Generator[Progress, None, ResultT]:
    """Run a job on a worker of the cluster that was joined, without progress; else here."""
    cluster = current_cluster()
    if cluster is None:
        return (yield from job(*arguments))
    with closing(cluster.map(partial(_finish, job), [arguments])) as coming:
        return next(coming)


def _finish(
    job: Callable[..., Generator[Progress, None, ResultT]], arguments: Sequence[object]
) -> ResultT:
    return finish(job(*arguments))


def _call(work: Callable[[ItemT], ResultT], parent: int, item: ItemT) -> ResultT:
    _end_with(parent)
    return work(item)


@cache
def _end_with(parent: int) -> None:
    """End this process when its parent has ended, which joblib does not do."""

    def watch() -> None:
        while os.getppid() == parent and (sys.platform != "win32" or _is_alive(parent)):
            time.sleep(1.0)
        os._exit(1)

    if os.getppid() == parent:  # not where another process started it in between
        threading.Thread(target=watch, daemon=True).start()


def _is_alive(process: int) -> bool:
    """Whether a process lives; Windows goes on telling the number of a parent that has ended."""
    import psutil

    return psutil.pid_exists(process)


@contextmanager
def _starting_without_interrupts() -> Iterator[None]:
    """Block Ctrl+C in processes started here, as a terminal sends it to all: this one ends them.

    This process gets a Ctrl+C once they have started. To ignore it meanwhile, which they would
    inherit too, would lose it.
    """
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        yield
        return
    if sys.platform != "win32":
        _start_trackers()
    received: list[int] = []
    handler = signal.signal(signal.SIGINT, lambda number, _: received.append(number))
    if sys.platform != "win32":
        # What a thread has blocked, the processes and threads it starts have blocked as well.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        if sys.platform != "win32":
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        signal.signal(signal.SIGINT, handler)
    for number in received[:1]:
        signal.raise_signal(number)


def _start_trackers() -> None:
    """Start the trackers of shared memory, whose start would unblock Ctrl+C."""
    from multiprocessing import resource_tracker

    from joblib.externals.loky.backend import resource_tracker as of_joblib

    resource_tracker.ensure_running()
    of_joblib.ensure_running()
