"""CPU time and memory of several ways to do something, measured so that they compare.

The repetitions are interleaved (A B C, A B C, ...): what else the machine does at the time, and the
clock rate it runs at, then falls on all of them alike.
"""

from __future__ import annotations

import gc
import math
import os
import platform
import time
import tracemalloc
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np

from forcelab.errors import InputError
from forcelab.jobs import Progress

__all__ = ["Timed", "Way", "machine", "timed_ways"]

ResultT = TypeVar("ResultT")
SeenT = TypeVar("SeenT")

#: A way is repeated within one measurement until it has taken so long, and so many ticks.
SHORTEST = 1e-3
TICKS = 20


@dataclass(frozen=True)
class Way(Generic[ResultT, SeenT]):
    """One way to do something.

    Parameters
    ----------
    name : str
        Told while it runs.
    run : callable
        Does it; only this is timed.
    look : callable
        Takes what `run` gave and keeps what is worth keeping, such as its error.
    """

    name: str
    run: Callable[[], ResultT]
    look: Callable[[ResultT], SeenT]


@dataclass(frozen=True)
class Timed(Generic[SeenT]):
    """What one way cost.

    Parameters
    ----------
    seen : object or None
        What `look` gave; None where the way refused.
    seconds, spread : float
        Median and interquartile range of the CPU time, s.
    peak_bytes : int
        The most memory that was held at once and is told to Python, which all of numpy's is.
    refusal : str
        The sentence of a way that refused; empty otherwise.
    """

    seen: SeenT | None
    seconds: float = 0.0
    spread: float = 0.0
    peak_bytes: int = 0
    refusal: str = ""


def timed_ways(
    ways: Sequence[Way[Any, SeenT]],
    repetitions: int,
    clock: Callable[[], float] = time.process_time,
    longest: float = math.inf,
) -> Generator[Progress, None, tuple[Timed[SeenT], ...]]:
    """Measure several ways, their repetitions interleaved.

    Each way is run once more, before all others and untimed, for its result and its memory: keeping
    count of memory takes time.

    Parameters
    ----------
    ways : sequence of Way
    repetitions : int
        Of each, at least 1.
    clock : callable
        Gives seconds; the CPU time of all threads of this process by default.
    longest : float
        Seconds that the repetitions of one way may take: what takes long has fewer of them, but
        one at least.

    Returns
    -------
    tuple of Timed, length of `ways`

    Raises
    ------
    InputError
        If there are no repetitions.
    """
    if repetitions < 1:
        raise InputError(f"A measurement needs 1 repetition or more, not {repetitions}.")
    total = len(ways) * (1 + repetitions)
    tried: list[Timed[SeenT]] = []
    times: list[int] = []
    for i, way in enumerate(ways):
        yield Progress(i, total, f"{way.name}, memory")
        tried.append(_tried(way, clock))
        taking = max(tried[-1].seconds, SHORTEST)
        times.append(max(1, int(min(repetitions, longest / taking))))
    taken: list[list[float]] = [[] for _ in ways]
    for repetition in range(repetitions):
        for i, way in enumerate(ways):
            yield Progress(len(ways) * (1 + repetition) + i, total, way.name)
            if not tried[i].refusal and repetition < times[i]:
                taken[i].append(_seconds(way.run, clock))
    return tuple(_summed(one, seconds) for one, seconds in zip(tried, taken, strict=True))


def _tried(way: Way[Any, SeenT], clock: Callable[[], float]) -> Timed[SeenT]:
    """Run a way once, for what it gives, the memory it takes and about how long it takes."""
    gc.collect()
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        start = clock()
        result = way.run()
        seconds = clock() - start
        _, peak = tracemalloc.get_traced_memory()
        return Timed(way.look(result), seconds, peak_bytes=peak - before)
    except InputError as error:
        return Timed(None, refusal=str(error))
    finally:
        tracemalloc.stop()


def _seconds(run: Callable[[], object], clock: Callable[[], float]) -> float:
    """CPU time of one run; the mean of several where one is too short for the clock."""
    shortest = max(SHORTEST, TICKS * time.get_clock_info("process_time").resolution)
    calls, spent, start = 0, 0.0, clock()
    while spent < shortest:
        run()
        calls += 1
        spent = clock() - start
    return spent / calls


def _summed(tried: Timed[SeenT], seconds: Sequence[float]) -> Timed[SeenT]:
    """A way with the median and the spread of its times."""
    if tried.refusal:
        return tried
    low, median, high = np.percentile(seconds, [25, 50, 75]).tolist()
    return Timed(tried.seen, median, high - low, tried.peak_bytes)


def machine() -> dict[str, Any]:
    """What the times were measured on: processor, cores and system."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "system": platform.platform(terse=True),
    }


def _processor() -> str:
    """The processor's name; Linux tells it in a file only."""
    listing = Path("/proc/cpuinfo")
    if listing.is_file():
        for line in listing.read_text("utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
