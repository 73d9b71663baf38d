"""Error against latency and cost of the streaming wavelet transform."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.measure.rows import Row, Table, with_front
from forcelab.measure.streams import forces
from forcelab.measure.timing import Way, timed_ways
from forcelab.signals.cwt import cwt, geometric_scales
from forcelab.signals.streaming import StreamingCwt

__all__ = ["SHARES", "TOLERANCES", "measuring", "tabulate"]

Real = NDArray[np.float64]
Complex = NDArray[np.complexfloating]

#: Delays over scale of early estimates, and tolerances of complete coefficients.
SHARES = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0)
TOLERANCES = (1.4e-3, 3e-5, 3e-7)
RATE = 1000.0


def tabulate(*, quick: bool = False) -> Generator[Progress, None, Table]:
    """Measure all delays and tolerances, the blocks of random size and those of 20 ms.

    A million samples of one channel, and half a minute of 6 channels with 40 scales, three times;
    with `quick` 50,000 samples and 12 s, once.
    """
    long, live, repetitions = (50_000, 12_000, 1) if quick else (1_000_000, 30_000, 3)
    scales = geometric_scales(4.0, 1024.0)
    rows: list[Row] = []
    made = yield from measuring(forces(long, 1), scales, TOLERANCES, (), 0, repetitions)
    rows += made
    dense = np.geomspace(4.0, 1024.0, 40)
    made = yield from measuring(forces(live, 6), dense, TOLERANCES, SHARES, 20, repetitions)
    return Table(
        "Streaming wavelet transform",
        "error (of largest)",
        "CPU us per sample and channel",
        with_front([*rows, *made]),
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
    square of the difference over that of the coefficients, the median of scales and channels.

    Parameters
    ----------
    x : ndarray, shape (n, c)
    scales : ndarray, shape (k,)
    tolerances : sequence of float
        Of complete coefficients.
    shares : sequence of float
        Delays over scale of early estimates; all scales then wait for the same share.
    block : int
        Samples of a block; 0 for random sizes from 1 to 5000.
    repetitions : int

    Returns
    -------
    tuple of Row
        Of each tolerance, then of each share.
    """
    yield Progress(0, 1, "offline")
    # Half the memory: single precision is far finer than any tolerance here.
    wanted = np.stack([cwt(channel, scales) for channel in x.T]).astype(np.complex64)
    words = f"{block} samples" if block else "1 to 5000 samples"
    size = f"{len(x)} samples x {x.shape[1]} channels x {len(scales)} scales, blocks of {words}"
    ways = [_way(x, scales, block, wanted, tolerance, None) for tolerance in tolerances]
    ways += [_way(x, scales, block, wanted, 3e-7, share) for share in shares]
    timed = yield from timed_ways(ways, repetitions)
    rows = []
    for way, found in zip(ways, timed, strict=True):
        if found.seen is None:
            rows.append(Row("stream", way.name, size, "offline", refusal=found.refusal))
            continue
        error, rms, delay = found.seen
        per_sample = 1e6 / x.size
        rows.append(
            Row(
                "early" if way.name.startswith("after") else "complete",
                way.name,
                size,
                "the offline transform (signals/cwt.py)",
                error=error,
                seconds=found.seconds * per_sample,
                spread=found.spread * per_sample,
                peak_bytes=found.peak_bytes,
                further={"error (rms)": rms, "delay (scales)": delay},
            )
        )
    return tuple(rows)


def _way(
    x: Real, scales: Real, block: int, wanted: Complex, tolerance: float, share: float | None
) -> Way[list[Complex], tuple[float, float, float]]:
    """A stream of one tolerance or delay."""
    # A delay for each scale: a stream each, of all scales of an octave with the same share.
    if share is None:
        streams = [StreamingCwt(scales, x.shape[1], tolerance=tolerance)]
        name = f"tolerance {tolerance:g}"
    else:
        streams = [
            StreamingCwt([a], x.shape[1], tolerance=tolerance, latency=int(np.ceil(share * a)))
            for a in scales
        ]
        name = f"after {share:g} scales"
    return Way(name, partial(_run, streams, x, block), partial(_look, streams, scales, wanted))


def _run(streams: Sequence[StreamingCwt], x: Real, block: int) -> list[Complex]:
    """All coefficients of all streams."""
    from threadpoolctl import threadpool_limits

    sizes = np.random.default_rng(0).integers(1, 5001, len(x)) if not block else None
    with threadpool_limits(1, user_api="blas"):
        found = []
        for stream in streams:
            stream.reset()
            out = np.empty((x.shape[1], len(stream.scales), len(x)), dtype=np.complex64)
            start = turn = 0
            while start < len(x):
                end = min(len(x), start + (block if sizes is None else int(sizes[turn])))
                out[:, :, start:end] = stream.push(x[start:end])
                start, turn = end, turn + 1
            found.append(out)
    return found


def _look(
    streams: Sequence[StreamingCwt], scales: Real, wanted: Complex, found: list[Complex]
) -> tuple[float, float, float]:
    """Largest error, median rms error, and the largest delay over scale."""
    largest, rms = 0.0, []
    delays = np.concatenate([stream.delays for stream in streams])
    rows = np.concatenate(found, axis=1)
    for j, delay in enumerate(delays.tolist()):
        mine, theirs = rows[:, j, delay:], wanted[:, j, : rows.shape[2] - delay]
        wrong = np.abs(mine - theirs)
        largest = max(largest, float((wrong.max(axis=1) / np.abs(theirs).max(axis=1)).max()))
        power = np.sqrt((np.abs(theirs) ** 2).mean(axis=1))
        rms += (np.sqrt((wrong**2).mean(axis=1)) / power).tolist()
    return largest, float(np.median(rms)), float((delays / scales).max())
