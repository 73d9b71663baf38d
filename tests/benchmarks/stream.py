"""Error against latency and cost of the streaming wavelet transform."""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.measure.cwt import made_up_forces
from forcelab.measure.rows import Judgement, Row, Table, timed_row, with_front
from forcelab.measure.timing import Method, timed_methods
from forcelab.runtime import one_blas_thread
from forcelab.signals.cwt import cwt, geometric_scales
from forcelab.signals.streaming import StreamingCwt
from forcelab.text import counted

Real = NDArray[np.float64]
Complex = NDArray[np.complexfloating]

#: Delays over scale of early estimates, and tolerances of complete coefficients.
SHARES = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0)
TOLERANCES = (1.4e-3, 3e-5, 3e-7)


def tabulate(*, quick: bool = False) -> Generator[Progress, None, Table]:
    """Measure all delays and tolerances, the blocks of random size and those of 20 ms.

    A million samples of one channel, and half a minute of 6 channels with 40 scales, three times;
    with `quick` 50,000 samples and 12 s, once.
    """
    long, live, repetitions = (50_000, 12_000, 1) if quick else (1_000_000, 30_000, 3)
    scales = geometric_scales(4.0, 1024.0)
    rows: list[Row] = []
    new = yield from measuring(made_up_forces(long, 1), scales, TOLERANCES, (), 0, repetitions)
    rows += new
    dense = np.geomspace(4.0, 1024.0, 40)
    new = yield from measuring(made_up_forces(live, 6), dense, TOLERANCES, SHARES, 20, repetitions)
    return Table(
        "Streaming wavelet transform",
        "error (of largest)",
        "CPU us per sample and channel",
        with_front([*rows, *new]),
    )


def measuring(
    x: Real,
    scales: Real,
    tolerances: Sequence[float],
    shares: Sequence[float],
    block: int,
    repetitions: int,
) -> Generator[Progress, None, tuple[Row, ...]]:
    """Measure streams of one signal.

    The error is the largest difference from the offline transform, over channels and samples,
    relative to the largest coefficient of the scale, of the worst scale; beside it the root mean
    square of the difference over that of the coefficients, the median of scales and channels, the
    delay, and of blocks of one size the CPU time that one takes.

    `x` (n, c); `scales` (k,); `shares`: delays over scale of early estimates; all scales then wait
    for the same share; `block`: samples of a block; 0 for random sizes from 1 to 5000. Gives of
    each tolerance, then of each share.
    """
    yield Progress(0, 1, "offline")
    # Half the memory: single precision is far finer than any tolerance here.
    exact = np.stack([cwt(channel, scales) for channel in x.T]).astype(np.complex64)
    words = f"{block} samples" if block else "1 to 5000 samples"
    channels = counted(x.shape[1], "channel")
    size = f"{len(x)} samples x {channels} x {len(scales)} scales, blocks of {words}"
    out = np.empty_like(exact)
    runs = [
        *(_Run.of(x, scales, tolerance, None, block, out) for tolerance in tolerances),
        *(_Run.of(x, scales, 3e-7, share, block, out) for share in shares),
    ]
    ways = [Method(run.name, run.stream, partial(run.judge, exact)) for run in runs]
    timed = yield from timed_methods(ways, repetitions)
    rows = []
    for run, found in zip(runs, timed, strict=True):
        name = "early" if run.name.startswith("after") else "complete"
        reference = "the offline transform (signals/cwt.py)"
        row = timed_row(name, run.name, size, reference, found, 1e6 / x.size)
        if block and not row.refusal:
            row = replace(row, further={**row.further, **run.block_times()})
        rows.append(row)
    return tuple(rows)


@dataclass(frozen=True)
class _Run:
    """A signal streamed with one tolerance or delay."""

    name: str
    transform: StreamingCwt
    x: Real  # (n, c)
    sizes: NDArray[np.int64]  # of the blocks
    #: (c, k, n), overwritten with the coefficients; apart from the run, whose memory is what it
    #: takes besides.
    out: Complex
    #: Of each run so far the CPU seconds of its blocks.
    taken: list[Real] = field(default_factory=list)

    @classmethod
    def of(
        cls, x: Real, scales: Real, tolerance: float, share: float | None, block: int, out: Complex
    ) -> _Run:
        """With blocks of one size, or of random sizes from 1 to 5000."""
        name = f"tolerance {tolerance:g}" if share is None else f"after {share:g} scales"
        latency = None if share is None else np.ceil(share * scales).astype(np.int64)
        transform = StreamingCwt(scales, x.shape[1], tolerance=tolerance, latency=latency)
        n = len(x)
        if block:
            sizes = np.full(-(-n // block), block)
        else:
            sizes = np.random.default_rng(0).integers(1, 5001, n)
            sizes = sizes[: int(np.searchsorted(np.cumsum(sizes), n)) + 1]
        return cls(name, transform, x, sizes, out)

    def stream(self) -> Complex:
        """All coefficients."""
        taken = np.empty(len(self.sizes))
        self.transform.reset()
        start = 0
        with one_blas_thread():
            for i, end in enumerate(np.minimum(np.cumsum(self.sizes), len(self.x)).tolist()):
                began = time.thread_time()
                found = self.transform.push(self.x[start:end])
                taken[i] = time.thread_time() - began
                self.out[:, :, start:end] = found
                start = end
        self.taken.append(taken)
        return self.out

    def judge(self, exact: Complex, found: Complex) -> Judgement:
        """Largest error; median rms error, and the largest delay over scale."""
        largest, rms = 0.0, []
        for j, delay in enumerate(self.transform.delays.tolist()):
            mine, theirs = found[:, j, delay:], exact[:, j, : exact.shape[2] - delay]
            wrong = np.abs(mine - theirs)
            largest = max(largest, float((wrong.max(axis=1) / np.abs(theirs).max(axis=1)).max()))
            power = np.sqrt((np.abs(theirs) ** 2).mean(axis=1))
            rms += (np.sqrt((wrong**2).mean(axis=1)) / power).tolist()
        delay = float((self.transform.delays / self.transform.scales).max())
        return largest, {"error (rms)": float(np.median(rms)), "delay (scales)": delay}

    def block_times(self) -> dict[str, float]:
        """CPU time of a block; the first run counted memory, which takes time."""
        each = [np.percentile(taken, [50, 99]) for taken in self.taken[1:]]
        half, most = (np.median(each, axis=0) * 1e3).tolist()
        return {"block p50 (ms)": half, "block p99 (ms)": most}
