"""Whether live recognition stays as it is for as long as it runs: no drift, no growing memory."""

from __future__ import annotations

import gc
import time
import tracemalloc
from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Demonstration
from forcelab.jobs import Progress
from forcelab.measure.rows import Row
from forcelab.recognition.online import OnlineRecogniser, budget_of
from forcelab.recognition.recogniser import Recogniser

Codes = NDArray[np.int64]

#: Samples of a block: what is asked is the same of any, and long ones take less time.
BLOCK = 512


@dataclass(frozen=True)
class _Round:
    """What one passage through the demonstration gave."""

    codes: Codes | None
    unlike: float
    held: int
    peak: int
    seconds: float


def endless(
    recogniser: Recogniser, demonstration: Demonstration, latency: int, samples: int
) -> Generator[Progress, None, Row]:
    """Stream a demonstration over and over.

    The error is the share of labels of the last round unlike those of the second, before which
    the stream does not know the end of the demonstration; beside it by how much the memory that
    is held has grown between the two. The time includes the counting of memory.

    `demonstration`: of a uniform rate; cut to whole hops, so that each round sees the same;
    `samples`: to stream at least; three rounds at the fewest.
    """
    budget = budget_of(recogniser, latency / 1e3, demonstration.period)
    hop = round(budget.hop / demonstration.period)
    length = len(demonstration.times) // hop * hop
    count = max(3, -(-samples // length))
    rate = 1 / demonstration.period
    online = OnlineRecogniser(recogniser, latency / 1e3, demonstration.channels, rate)
    rounds: list[_Round] = []
    second: Codes = np.empty(0, dtype=np.int64)
    gc.collect()
    tracemalloc.start()
    try:
        for number in range(count):
            yield Progress(number, count, "endless")
            found = _round(online, demonstration.signals[:length], rate, number, second)
            # Kept once: what is held besides is the stream's.
            if found.codes is not None:
                second = found.codes
            rounds.append(replace(found, codes=None))
    finally:
        tracemalloc.stop()
    shares = [round_.seconds * rate / length for round_ in rounds[1:]]
    low, middle, high = np.percentile(shares, [25, 50, 75]).tolist()
    return Row(
        "paper",
        f"latency {latency} ms",
        f"{count * length} samples of {len(demonstration.channels)} channels at {rate:.0f} Hz, "
        f"one stream",
        "the labels of the same forces at the stream's beginning",
        error=rounds[-1].unlike,
        seconds=middle,
        spread=high - low,
        peak_bytes=max(round_.peak for round_ in rounds),
        further={"memory grown (kB)": (rounds[-1].held - rounds[1].held) / 1e3},
    )


def _round(
    online: OnlineRecogniser, signals: NDArray[np.float64], rate: float, number: int, second: Codes
) -> _Round:
    """Stream the demonstration once more; the codes of the second round are given back."""
    codes = []
    tracemalloc.reset_peak()
    began = time.thread_time()
    for start in range(0, len(signals), BLOCK):
        block = signals[start : start + BLOCK]
        stamps = (number * len(signals) + start + np.arange(len(block))) / rate
        codes.append(online.push(stamps, block).codes)
    seconds = time.thread_time() - began
    whole = np.concatenate(codes)
    unlike = float(np.mean(whole != second)) if number > 1 else 0.0
    decoded = whole if number == 1 else None
    del codes, block, stamps, whole
    gc.collect()
    held, peak = tracemalloc.get_traced_memory()
    return _Round(decoded, unlike, held, peak, seconds)
