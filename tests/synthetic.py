"""Synthetic demonstrations of the foam pick-up: tongs grab a foam block, hold it and let it go.

Nothing here was recorded from a person. The numbers are of the size seen with two 3-axis optical
force sensors in the tips of a pair of tongs: forces of a few newtons, white noise of a few
millinewtons, a tremor that grows with the grip, foam that gives way, a zero that creeps.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.labels import Segment, Segments

__all__ = ["ACTIONS", "CHANNELS", "synthetic_demonstration", "synthetic_set"]

Real = NDArray[np.float64]

#: In the order of the choreography, which ends with `still` as it began.
ACTIONS = ("still", "grab", "hold", "release")
#: Forces of two sensors; the normals are negative in compression.
CHANNELS = tuple(Channel(f"f{axis}{sensor}", "N") for sensor in (1, 2) for axis in "xyz")
#: Newtons a count: lateral, lateral, normal.
RESOLUTION = np.array([1 / 800, 1 / 800, 1 / 160] * 2)


@dataclass(frozen=True)
class _Motion:
    """What one person did: seconds at which the actions change, and forces in newtons."""

    changes: Real
    grip: float
    share: Real
    load: Real
    swing: float
    relaxed: float

    @classmethod
    def drawn(cls, random: np.random.Generator) -> _Motion:
        """A person's durations and forces: no two demonstrations are alike."""
        low = np.array([0.8, 0.2, 0.9, 0.2, 0.8])
        high = np.array([1.9, 0.6, 1.7, 0.5, 1.7])
        angle = random.uniform(-np.pi, np.pi) + np.array([0.0, random.normal(np.pi, 0.4)])
        size = random.uniform(0.8, 3.0) * np.array([1.0, random.uniform(0.4, 0.9)])
        return cls(
            changes=np.concatenate([[0.0], np.cumsum(random.uniform(low, high))]),
            grip=random.uniform(4.0, 12.0),
            share=np.array([1.0, random.uniform(0.75, 1.0)]),
            load=np.stack([size * np.cos(angle), size * np.sin(angle)]),
            swing=random.uniform(0.02, 0.08),
            relaxed=random.uniform(0.08, 0.2),
        )


def _smooth_step(t: Real, start: float, end: float) -> Real:
    """From 0 at `start` to 1 at `end` with the least jerk, as hands move."""
    s = np.clip((t - start) / (end - start), 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


def _forces(t: Real, motion: _Motion, random: np.random.Generator) -> Real:
    """What ideal sensors would read, shape (n, 6), in newtons."""
    _, grab, hold, release, rest, _ = motion.changes
    closing, opening = _smooth_step(t, grab, hold), _smooth_step(t, release, rest)
    gives_way = 1 - motion.relaxed * (1 - np.exp(-np.maximum(t - hold, 0.0) / 0.4))
    grip = motion.grip * closing * gives_way * (1 - opening)
    # The block's weight comes onto the tips late in the grab and leaves them early in the release.
    middle_grab, middle_release = 0.5 * (grab + hold), 0.5 * (release + rest)
    lifted = _smooth_step(t, middle_grab, hold + 0.15) * (
        1 - _smooth_step(t, release, middle_release)
    )
    swing = 1 + motion.swing * np.sin(2 * np.pi * (t - hold) * random.uniform(1.0, 2.0))
    pitch = random.uniform(8.0, 12.0) * t + 0.15 * np.sin(2 * np.pi * random.uniform(0.3, 0.8) * t)
    tremor = 1 + 0.012 * np.sin(2 * np.pi * (pitch + random.uniform()))
    out = np.empty((len(t), 6))
    for sensor in range(2):
        out[:, 3 * sensor : 3 * sensor + 2] = np.outer(lifted * swing, motion.load[:, sensor])
        out[:, 3 * sensor + 2] = -motion.share[sensor] * grip * tremor
    return out


def _sensed(t: Real, forces: Real, random: np.random.Generator) -> Real:
    """The same with creeping zeros, noise of 5 to 15 mN, in whole counts."""
    zero = random.normal(0.0, 0.08, 6)
    creep = random.normal(0.0, 0.03, 6) * (t / t[-1])[:, np.newaxis] ** 0.5
    noise = random.uniform(0.005, 0.015, 6) * random.standard_normal(forces.shape)
    return np.round((forces + zero + creep + noise) / RESOLUTION) * RESOLUTION


def _labels(motion: _Motion, random: np.random.Generator) -> Segments:
    """A coder's segments: edges off by some 15 ms, about 50 ms between two left unlabelled."""
    segments = []
    for number, (start, end) in enumerate(pairwise(motion.changes.tolist())):
        left = start + random.uniform(0.0, 0.05) + abs(random.normal(0.0, 0.015))
        right = end - random.uniform(0.0, 0.05) + min(random.normal(0.0, 0.015), 0.0)
        action = ACTIONS[number % len(ACTIONS)]
        segments.append(Segment(round(left, 3), round(right, 3), action))
    return tuple(segments)


def synthetic_demonstration(
    seed: int, rate: float = 1000.0, task: str = "foam"
) -> tuple[Demonstration, Segments]:
    """Make one demonstration with the segments a coder would give it.

    Parameters
    ----------
    seed : int
        The same seed gives the same demonstration; another rate the same motion.
    rate : float
        Samples a second.
    task : str
        The demonstration's task; it does not change the motion.

    Returns
    -------
    Demonstration
        3.3 to 6.4 s, six channels in newtons.
    tuple of Segment
        still, grab, hold, release, still, with short unlabelled stretches between.
    """
    motions, noises, coders = (np.random.default_rng([seed, part]) for part in range(3))
    motion = _Motion.drawn(motions)
    t = np.arange(int(motion.changes[-1] * rate)) / rate
    signals = _sensed(t, _forces(t, motion, motions), noises)
    demonstration = Demonstration(f"{task} {seed:02d}", task, t, signals, CHANNELS)
    return demonstration, _labels(motion, coders)


def synthetic_set(
    count: int, rate: float = 1000.0, task: str = "foam", seed: int = 1
) -> list[tuple[Demonstration, Segments]]:
    """Make `count` demonstrations, with the seeds from `seed` on."""
    return [synthetic_demonstration(seed + i, rate, task) for i in range(count)]
