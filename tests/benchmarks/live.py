"""What live recognition costs, how late it is, and whether it says what it should."""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Demonstration
from forcelab.jobs import Progress
from forcelab.measure.cwt import made_up_demonstration
from forcelab.measure.rows import Row, Table, with_front
from forcelab.measure.timing import measure_peak
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.online import OnlineRecogniser
from forcelab.recognition.presets import preset
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.training import train
from tests.benchmarks.endless import endless

#: Milliseconds of a block, and of latency.
BLOCKS = (10, 20, 50)
LATENCIES = (50, 200, 500)
RATE = 1000.0


def tabulate(*, quick: bool = False) -> Generator[Progress, None, Table]:
    """Measure presets ``paper`` and ``fast`` at 1 kHz on 6 channels: a minute; with `quick` 10 s.

    Then one stream of a million samples, 30,000 with `quick`: whether it stays as it is.
    """
    yield Progress(0, 1, "training")
    trained = [LabelledDemonstration(*made_up_demonstration(20.0, RATE, seed)) for seed in (1, 2)]
    recogniser = train(trained, preset("paper").replace(stride=10))
    demonstration, _ = made_up_demonstration(10.0 if quick else 60.0, RATE, 3)
    repetitions = 3 if quick else 5
    rows = yield from measuring(recogniser, demonstration, BLOCKS, LATENCIES, repetitions)
    windows = train(trained, preset("fast"))
    fast = yield from measuring(windows, demonstration, (20,), (100,), repetitions)
    last = yield from endless(recogniser, demonstration, 200, 30_000 if quick else 1_000_000)
    return Table(
        "Live recognition",
        "labels unlike offline",
        "CPU s per s (share of a core)",
        (*rows, *fast, *with_front([last])),
    )


@dataclass(frozen=True)
class _Run:
    """One stream: its labels, and CPU and wall seconds of each block."""

    codes: NDArray[np.int64]
    cpu: NDArray[np.float64]
    wall: NDArray[np.float64]


def measuring(
    recogniser: Recogniser,
    demonstration: Demonstration,
    blocks: Sequence[int],
    latencies: Sequence[int],
    repetitions: int,
) -> Generator[Progress, None, tuple[Row, ...]]:
    """Measure a recogniser on a demonstration, as if it came live.

    The error is the share of labels unlike those of the whole demonstration seen at once; beside
    it the CPU time of a block in two ways:

    * p50 and p99 over the blocks of each block's median over repetitions: what the recogniser
      itself takes for its costliest blocks, without what the machine adds now and then;
    * p99 over the blocks of a single run, the median of the runs: what somebody meets who runs it
      once on this machine, never less than the other but for chance.

    Last the time from a force to its label: the latency, the block that it waits in, and the work
    at p99 of a single run, by the clock on the wall.

    `repetitions`: of each, interleaved.
    """
    yield Progress(0, 1, "offline")
    offline = recogniser.predict(demonstration).filtered
    settings = [(latency, block) for latency in latencies for block in blocks]
    # The most memory that a stream of some seconds holds at once.
    peaks = {
        s: measure_peak(partial(_streamed, recogniser, demonstration, *s, 3.0))[1] for s in settings
    }
    runs: dict[tuple[int, int], list[_Run]] = {setting: [] for setting in settings}
    total = repetitions * len(settings)
    for repetition in range(repetitions):
        for i, (latency, block) in enumerate(settings):
            yield Progress(
                repetition * len(settings) + i, total, f"latency {latency} ms, blocks of {block} ms"
            )
            runs[latency, block].append(_streamed(recogniser, demonstration, latency, block))
    name = recogniser.settings.preset
    rows = [
        _row(name, demonstration, setting, runs[setting], peaks[setting], offline)
        for setting in settings
    ]
    return with_front(rows)


def _streamed(
    recogniser: Recogniser,
    demonstration: Demonstration,
    latency: int,
    block: int,
    seconds: float = np.inf,
) -> _Run:
    rate = 1 / demonstration.period
    size = max(1, round(block * rate / 1e3))
    online = OnlineRecogniser(recogniser, latency / 1e3, demonstration.channels, rate)
    codes, cpu, wall = [], [], []
    count = int(min(len(demonstration.times), seconds * rate))
    times, signals = demonstration.times[:count], demonstration.signals[:count]
    for start in range(0, len(times), size):
        began, worked = time.perf_counter(), time.thread_time()
        decided = online.push(times[start : start + size], signals[start : start + size])
        cpu.append(time.thread_time() - worked)
        wall.append(time.perf_counter() - began)
        codes.append(decided.codes)
    codes.append(online.finish().codes)
    return _Run(np.concatenate(codes), np.array(cpu), np.array(wall))


def _row(
    name: str,
    demonstration: Demonstration,
    setting: tuple[int, int],
    runs: Sequence[_Run],
    peak: int,
    offline: NDArray[np.int64],
) -> Row:
    latency, block = setting
    shares = [float(run.cpu.sum()) / demonstration.duration for run in runs]
    low, middle, high = np.percentile(shares, [25, 50, 75]).tolist()
    # What else the machine does falls on one block in a hundred of any run, but hardly ever on the
    # same one of most of them: medians of blocks tell the work from that.
    half, most = np.percentile(np.median([run.cpu for run in runs], axis=0), [50, 99]) * 1e3
    single = float(np.median([np.percentile(run.cpu, 99) for run in runs])) * 1e3
    waited = float(np.median([np.percentile(run.wall, 99) for run in runs])) * 1e3
    return Row(
        name,
        f"latency {latency} ms",
        f"{len(demonstration.channels)} channels at {1 / demonstration.period:.0f} Hz, "
        f"blocks of {block} ms",
        "the labels of the whole demonstration seen at once",
        error=float(np.mean(runs[0].codes != offline)),
        seconds=middle,
        spread=high - low,
        peak_bytes=peak,
        further={
            "p50 of medians (ms)": float(half),
            "p99 of medians (ms)": float(most),
            "p99 of a run (ms)": single,
            "force to label (ms)": latency + block + waited,
        },
    )
