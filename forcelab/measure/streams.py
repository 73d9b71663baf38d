"""Made-up forces of known actions, for measuring streams on any machine."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.labels import Segment, Segments

__all__ = ["ACTIONS", "CHANNELS", "forces", "performed"]

Real = NDArray[np.float64]

CHANNELS = tuple(Channel(f"f{axis}{sensor}", "N") for sensor in (1, 2) for axis in "xyz")
ACTIONS = ("still", "grab", "hold", "release")


def performed(seconds: float, rate: float, seed: int) -> tuple[Demonstration, Segments]:
    """Grabs, holds and releases, one after another, with tremor, noise and knocks.

    Parameters
    ----------
    seconds : float
        At least.
    rate : float
        Samples a second.
    seed : int
    """
    random = np.random.default_rng(seed)
    starts: list[float] = []
    codes: list[int] = []
    clock = 0.0
    while clock < seconds:
        starts.append(clock)
        codes.append(len(codes) % 4)
        clock += random.uniform(0.2, 0.5) if codes[-1] % 2 else random.uniform(0.8, 1.6)
    n = int(clock * rate)
    times = np.arange(n) / rate
    edges = [*starts, clock]
    grips = np.array([0.0, 0.0, 1.0, 1.0, 0.0])
    knots = [grips[code] for code in codes] + [grips[(codes[-1] + 1) % 4]]
    grip = np.interp(times, edges, knots)
    tremor = 0.05 * grip * np.sin(2 * np.pi * (9 * times + 0.2 * np.sin(times)))
    columns = []
    for _ in CHANNELS:
        knocks = np.zeros(n)
        knocks[np.searchsorted(times, edges[1:-1])] = random.uniform(0.2, 1.0, len(edges) - 2)
        rung = np.convolve(knocks, np.exp(-np.arange(40) / 8) * np.sin(np.arange(40)))[:n]
        size = random.uniform(2.0, 8.0)
        noise = 0.005 * random.standard_normal(n)
        drift = 0.02 * np.cumsum(random.standard_normal(n)) / np.sqrt(rate)
        columns.append(size * (grip + tremor) + rung + noise + drift)
    segments = tuple(
        Segment(start, end, ACTIONS[code])
        for start, end, code in zip(edges[:-1], edges[1:], codes, strict=True)
        if end <= times[-1]
    )
    name = f"made up {seed}"
    return Demonstration(name, "made up", times, np.stack(columns, axis=1), CHANNELS), segments


def forces(n: int, channels: int) -> Real:
    """The first `n` samples of `channels` such forces at 1 kHz, shape (n, channels)."""
    whole = performed(n / 1000.0 + 1.0, 1000.0, 0)[0].signals
    return whole[:n, np.arange(channels) % whole.shape[1]]
