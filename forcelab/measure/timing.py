"""CPU time and memory of several methods, measured so that they compare.

The repetitions are interleaved (A B C, A B C, ...): what else the machine does at the time, and the
clock rate it runs at, then falls on all of them alike. Modules and videos are loaded in processes
of their own: ``python -m forcelab.measure.timing STAGE ...`` loads one stage after the other, a
module or ``video:`` and a path, and prints a JSON list of what each cost.
"""

from __future__ import annotations

import gc
import json
import math
import os
import platform
import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from statistics import median
from typing import Any, Generic, TypeVar

import numpy as np
from psutil import Process

from forcelab.errors import ForcelabError, InputError
from forcelab.jobs import Progress

ResultT = TypeVar("ResultT")
JudgedT = TypeVar("JudgedT")

#: A method is repeated within one measurement until it has taken so long, and so many ticks.
SHORTEST = 1e-3
TICKS = 20
#: Begins a stage that opens a video; its first frame is read.
VIDEO = "video:"
#: Seconds that the modules may take to load.
PATIENCE = 300.0


@dataclass(frozen=True)
class Method(Generic[ResultT, JudgedT]):
    """One way to do something: only `run` is timed; `judge` keeps its error or the like."""

    name: str
    run: Callable[[], ResultT]
    judge: Callable[[ResultT], JudgedT]


@dataclass(frozen=True)
class Timed(Generic[JudgedT]):
    """What one method cost: CPU seconds with their interquartile range, or its refusal.

    `peak_bytes` is the most memory held at once that is told to Python, which all of numpy's is.
    """

    judged: JudgedT | None  # None where the method refused
    seconds: float = 0.0
    spread: float = 0.0
    peak_bytes: int = 0
    refusal: str = ""


def timed_methods(
    methods: Sequence[Method[Any, JudgedT]],
    repetitions: int,
    clock: Callable[[], float] = time.process_time,
    longest: float = math.inf,
) -> Generator[Progress, None, tuple[Timed[JudgedT], ...]]:
    """Measure several methods, their repetitions interleaved.

    Each is run once more, before all others and untimed, for its result and its memory: keeping
    count of memory takes time. What takes long has fewer repetitions, at least one, so that they
    take no more than `longest` seconds. The default clock is the CPU time of all threads.
    """
    if repetitions < 1:
        raise InputError(f"A measurement needs 1 repetition or more, not {repetitions}.")
    total = len(methods) * (1 + repetitions)
    tried: list[Timed[JudgedT]] = []
    times: list[int] = []
    for i, method in enumerate(methods):
        yield Progress(i, total, f"{method.name}, memory")
        tried.append(_try(method, clock))
        taking = max(tried[-1].seconds, SHORTEST)
        times.append(max(1, int(min(repetitions, longest / taking))))
    seconds: list[list[float]] = [[] for _ in methods]
    for repetition in range(repetitions):
        for i, method in enumerate(methods):
            yield Progress(len(methods) * (1 + repetition) + i, total, method.name)
            if not tried[i].refusal and repetition < times[i]:
                seconds[i].append(_seconds(method.run, clock))
    return tuple(_summarise(first, rest) for first, rest in zip(tried, seconds, strict=True))


def measure_seconds(
    make: Callable[[], ResultT], clock: Callable[[], float] = time.process_time
) -> tuple[ResultT, float]:
    """A result, and the CPU seconds that it took."""
    began = clock()
    result = make()
    return result, clock() - began


def measure_peak(make: Callable[[], ResultT]) -> tuple[ResultT, int]:
    """A result, and the most memory in bytes that was held at once."""
    gc.collect()
    tracemalloc.start()
    try:
        return make(), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def _try(method: Method[Any, JudgedT], clock: Callable[[], float]) -> Timed[JudgedT]:
    """Run a method once: for its result, its memory and about how long it takes."""
    try:
        (result, seconds), peak = measure_peak(lambda: measure_seconds(method.run, clock))
        return Timed(method.judge(result), seconds, peak_bytes=peak)
    except InputError as error:
        return Timed(None, refusal=str(error))


def _seconds(run: Callable[[], object], clock: Callable[[], float]) -> float:
    """CPU time of one run; the mean of several where one is too short for the clock."""
    shortest = max(SHORTEST, TICKS * time.get_clock_info("process_time").resolution)
    calls, elapsed, start = 0, 0.0, clock()
    while elapsed < shortest:
        run()
        calls += 1
        elapsed = clock() - start
    return elapsed / calls


def _summarise(tried: Timed[JudgedT], seconds: Sequence[float]) -> Timed[JudgedT]:
    """A method with the median and the spread of its times."""
    if tried.refusal:
        return tried
    low, middle, high = np.percentile(seconds, [25, 50, 75]).tolist()
    return Timed(tried.judged, middle, high - low, tried.peak_bytes)


@dataclass(frozen=True, slots=True)
class Cost:
    """CPU seconds and bytes of memory; None with a refusal where they could not be measured."""

    seconds: float | None = None
    bytes: int | None = None
    refusal: str = ""

    def without(self, part: Cost) -> Cost:
        """What is left where `part` was measured in it; the same where one of them is unknown."""
        if self.seconds is None or part.seconds is None or self.bytes is None or part.bytes is None:
            return self
        return Cost(max(0.0, self.seconds - part.seconds), max(0, self.bytes - part.bytes))


#: A stage to load (a module, or ``video:`` and a path), or something to call.
Work = str | Callable[[], object]


def measure_works(
    works: Mapping[str, Work], repetitions: int = 3
) -> Generator[Progress, None, dict[str, Cost]]:
    """Measure stages, each on top of those before it, and calls, by name; medians are given.

    Of a stage the memory is what the process holds more than before it. `InputError` if the
    processes that load stages end badly or take more than `PATIENCE`.
    """
    stages = {name: work for name, work in works.items() if isinstance(work, str)}
    processes = []
    for repetition in range(repetitions):
        yield Progress(repetition, repetitions, "modules")
        processes.append(load_in_process([*stages.values()]))
    costs = {name: _median_cost(runs) for name, *runs in zip(stages, *processes, strict=True)}
    methods = [Method(name, work, lambda _: None) for name, work in works.items() if callable(work)]
    timed = yield from timed_methods(methods, repetitions)
    for method, timing in zip(methods, timed, strict=True):
        cost = Cost(timing.seconds, timing.peak_bytes)
        costs[method.name] = Cost(refusal=timing.refusal) if timing.refusal else cost
    return costs


def load_in_process(stages: Sequence[str]) -> list[Cost]:
    """Load the stages in one fresh process."""
    try:
        process = subprocess.run(
            [sys.executable, "-m", __name__, *stages],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise InputError(
            f"Loading modules takes more than {PATIENCE:g} s; measure when the machine does less."
        ) from error
    if process.returncode:
        raise InputError(
            f"The process that loaded modules for the measurement ended with {process.returncode}: "
            f"{process.stderr.strip()[-300:]}"
        )
    # What a library prints when it is loaded comes before.
    return [Cost(*values) for values in json.loads(process.stdout.splitlines()[-1])]


def _median_cost(costs: Sequence[Cost]) -> Cost:
    """The median of one stage in several processes; its refusal where one refused."""
    seconds = [cost.seconds for cost in costs if cost.seconds is not None]
    memory = [cost.bytes for cost in costs if cost.bytes is not None]
    if len(seconds) < len(costs) or not memory:
        return next(cost for cost in costs if cost.seconds is None)
    return Cost(median(seconds), int(median(memory)))


def _load(stage: str) -> Cost:
    """Load one stage. Python, numpy and this module are loaded before and paid for by none."""
    process = Process()
    before, began = process.memory_info().rss, time.process_time()
    try:
        if stage.startswith(VIDEO):
            from forcelab.video.reader import VideoReader  # is part of what is measured

            with VideoReader(Path(stage.removeprefix(VIDEO))) as video:
                video.frame(0)
        else:
            import_module(stage)
    except (ImportError, ForcelabError) as error:
        return Cost(refusal=str(error))
    seconds = time.process_time() - began
    return Cost(seconds, max(0, process.memory_info().rss - before))


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


if __name__ == "__main__":
    measured_costs = [_load(stage) for stage in sys.argv[1:]]
    print(json.dumps([(cost.seconds, cost.bytes, cost.refusal) for cost in measured_costs]))
