"""Work done by the workers of a running Dask scheduler, on this machine or on others."""

from __future__ import annotations

import logging
import socket
import threading
import time
import warnings
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from queue import Empty, SimpleQueue
from typing import Any, Final, TypeVar

from forcelab.errors import ForcelabError, InputError
from forcelab.extras import load_extra
from forcelab.text import counted
from forcelab.version import __version__

ItemT = TypeVar("ItemT")
ResultT = TypeVar("ResultT")

#: Seconds in which a scheduler has to answer, and its workers to come back; and after how many it
#: is looked for them.
PATIENCE, LOOK_EVERY = 10.0, 1.0
#: A worker does one piece at a time, however many threads it has: the time of each is measured.
_ALONE: Final = threading.Lock()


class Cluster:
    """The workers of a scheduler, while work is shared among them."""

    def __init__(self, address: str, client: Any) -> None:
        self.address = address
        self._client = client
        self._workers = set(self._present())
        self._topic = f"forcelab-{client.id}"
        self._began = time.perf_counter()
        self._pieces = 0

    def map(
        self, work: Callable[[ItemT], ResultT], items: Iterable[ItemT]
    ) -> Generator[ResultT, None, None]:
        """Call `work` on each item; yields results in order. What a lost worker did is redone."""
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Sending large graph", UserWarning)
            # As the result of a task it is sent once, and made again should its worker be lost.
            shared = self._client.submit(_identity, work, pure=False)
            pieces = list(enumerate(items, self._pieces))
            futures = self._client.map(
                _do_piece, pieces, work=shared, topic=self._topic, pure=False
            )
        number_of = {future.key: number for number, future in enumerate(futures)}
        self._pieces += len(pieces)
        results: dict[int, ResultT] = {}
        given = 0
        try:
            for future in self._finished(futures):
                results[number_of[future.key]] = self._result(future)
                # Else what is fetched already would be done again, should its worker be lost.
                future.release()
                while given in results:
                    yield results.pop(given)
                    given += 1
        finally:
            with suppress(OSError, RuntimeError, CancelledError):  # of a scheduler that is gone
                self._client.cancel(futures)

    def _finished(self, futures: Sequence[Any]) -> Iterator[Any]:
        """The futures as they end; refused once no worker was left for a while."""
        ended: SimpleQueue[Any] = SimpleQueue()
        for future in futures:
            future.add_done_callback(ended.put)
        left, seen = len(futures), time.monotonic()  # when there was a worker
        while left:
            with suppress(Empty):
                yield ended.get(timeout=LOOK_EVERY)
                left, seen = left - 1, time.monotonic()
                continue
            try:
                seen = time.monotonic() if self._present() else seen
            except OSError as error:
                raise self._gone() from error
            if time.monotonic() - seen > PATIENCE:  # as long as new ones may take to start
                raise ForcelabError(
                    f"No worker of {self.address} is left; start some by 'dask worker "
                    f"{self.address}' and try again."
                )

    def report(self) -> str:
        """What was done by how many workers in what time, and what lost ones cost."""
        events: Iterable[Any] = ()
        present = self._workers
        with suppress(OSError, RuntimeError, CancelledError):  # of a scheduler that is gone by now
            events = self._client.get_events(self._topic)
            present = set(self._present())
        begun: Counter[int] = Counter()
        seconds: dict[int, float] = {}
        for _, (number, spent) in events:
            if spent is None:
                begun[number] += 1
            else:
                seconds[number] = spent
        sentence = (
            f"{counted(len(self._workers), 'worker')} of {self.address} did "
            f"{counted(self._pieces, 'piece')} of work in "
            f"{time.perf_counter() - self._began:.1f} s."
        )
        again = {number: times - 1 for number, times in begun.items() if times > 1}
        lost = len(self._workers - present)
        if lost or again:
            cost = sum(times * seconds[number] for number, times in again.items())
            sentence += (
                f" {counted(lost, 'worker')} went missing: {counted(len(again), 'piece')} had to "
                f"be done again, {cost:.1f} s of work."
            )
        return sentence

    def _gone(self) -> ForcelabError:
        return ForcelabError(
            f"The scheduler at {self.address} is gone; start it and its workers, and try again."
        )

    def _present(self) -> list[str]:
        return list(self._client.scheduler_info(n_workers=-1)["workers"])

    def _result(self, future: Any) -> Any:
        from distributed import KilledWorker

        try:
            return future.result()
        except KilledWorker as error:
            raise ForcelabError(
                f"Every worker of {self.address} that took on a piece of work was lost with it, as "
                f"machines do that are short of memory; give them more, or less work at once."
            ) from error
        except (CancelledError, OSError) as error:
            if future.status == "error":  # raised by the work itself
                raise
            raise self._gone() from error


_current: ContextVar[Cluster | None] = ContextVar("cluster", default=None)


def current_cluster() -> Cluster | None:
    """The cluster that shares the work now, if one was joined."""
    return _current.get()


@contextmanager
def join_cluster(address: str) -> Iterator[Cluster]:
    """Let the workers of a running Dask scheduler do what is evaluated and trained inside.

    Results are the same as here. Work of a worker that is lost is done again by another one.

    Parameters
    ----------
    address : str
        Where the scheduler is, such as ``"tcp://10.0.0.1:8786"``.

    Yields
    ------
    Cluster
        Its ``report()`` says how much was done, in what time, and what lost workers cost.

    Raises
    ------
    InputError
        If the package distributed is missing, no scheduler answers there, it has no worker, or a
        worker has another version of forcelab.

    Examples
    --------
    >>> with forcelab.join_cluster("tcp://scheduler:8786") as cluster:  # doctest: +SKIP
    ...     forcelab.finish(forcelab.leave_one_out_job(labelled, settings))
    """
    distributed = load_extra("distributed", "cluster", "A cluster")
    with _muted("distributed", "distributed.client"), _connect(address, distributed) as client:
        _check_workers(address, client)
        cluster = Cluster(address, client)
        token = _current.set(cluster)
        try:
            yield cluster
        finally:
            _current.reset(token)


@contextmanager
def _muted(*names: str) -> Iterator[None]:
    """Silence loggers: what is to be said of lost connections is said in sentences."""
    loggers = [logging.getLogger(name) for name in names]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def _connect(address: str, distributed: Any) -> Any:
    """A client of the scheduler at an address."""
    try:
        # A client that finds nobody takes half a minute to give up.
        host = distributed.comm.get_address_host_port(address)
        socket.create_connection(host, PATIENCE).close()
        return distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"No Dask scheduler answers at '{address}'; start one by 'dask scheduler' and give the "
            f"address that it prints."
        ) from error


def _check_workers(address: str, client: Any) -> None:
    """Refuse to begin where no worker could do the work."""
    found = client.get_versions(packages=["forcelab"])["workers"]
    if not found:
        raise InputError(
            f"The scheduler at '{address}' has no worker; start some by 'dask worker {address}'."
        )
    for worker, versions in found.items():
        version = versions["packages"]["forcelab"]
        if version != __version__:
            has = f"forcelab {version}" if version else "no forcelab"
            raise InputError(
                f"The worker at {worker} has {has}, and this is {__version__}; install the same "
                f"version on all machines."
            )


def _identity(work: ResultT) -> ResultT:
    return work


def _do_piece(piece: tuple[int, Any], *, work: Callable[[Any], ResultT], topic: str) -> ResultT:
    from distributed import get_worker

    number, item = piece
    with _ALONE:
        get_worker().log_event(topic, (number, None))
        began = time.perf_counter()
        result = work(item)
        get_worker().log_event(topic, (number, time.perf_counter() - began))
        return result
