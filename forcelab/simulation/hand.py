"""What the hand wants: smooth commands for jaws, arm and wrist, as cubic splines of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from forcelab.arrays import Real

#: Distance of the splines' knots, s: a sixteenth of the period of the fastest tremor and less than
#: a quarter of the fastest tap.
KNOT_STEP = 5e-3


def minimum_jerk(times: Real, start: float, duration: float | Real) -> Real:
    """How far a reach is after `times`, from 0 to 1: ``10 u^3 - 15 u^4 + 6 u^5``.

    T. Flash, N. Hogan, "The coordination of arm movements: an experimentally confirmed
    mathematical model", Journal of Neuroscience 5 (1985) 1688-1703.
    """
    return reach(np.clip((times - start) / duration, 0.0, 1.0))


def reach(share: Real) -> Real:
    """How far a reach is after a share of its time, both from 0 to 1."""
    u = share
    return u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)


def tremor(times: Real, rng: np.random.Generator) -> Real:
    """Physiological tremor of unit variance between 8 and 12 Hz: a few beating tones."""
    tones = 6
    frequencies = rng.uniform(8.0, 12.0, tones)
    phases = rng.uniform(0.0, 2.0 * np.pi, tones)
    sum_ = np.sin(2.0 * np.pi * frequencies[:, None] * times + phases[:, None]).sum(axis=0)
    return np.asarray(sum_ * np.sqrt(2.0 / tones))


def wander(times: Real, rng: np.random.Generator) -> Real:
    """Slow wandering of unit variance with a spectrum that falls off beyond 1 Hz."""
    tones = 24
    frequencies = np.geomspace(0.05, 3.0, tones)
    weights = np.sqrt(np.gradient(frequencies)) / (1.0 + frequencies**2)
    phases = rng.uniform(0.0, 2.0 * np.pi, tones)
    waves = np.sin(2.0 * np.pi * frequencies[:, None] * times + phases[:, None])
    return np.asarray(weights @ waves * np.sqrt(2.0 / (weights @ weights)))


@dataclass(frozen=True)
class Trajectory:
    """Commands of a batch of demonstrations, twice continuously differentiable in time."""

    #: (k, m, 4, c), of the cubics of k splines between their knots, highest power first, one for
    #: each of c commands. After the last knot the last cubic goes on.
    coefficients: Real
    #: (b,), which spline each lane follows: lanes may share one, which is not copied then.
    lanes: NDArray[np.intp]

    @classmethod
    def through(cls, values: Sequence[Real]) -> Trajectory:
        """Commands through values at the knots.

        `values` (m_i + 1, c): one for each lane; the shorter ones hold their last value, from where
        on they are only once continuously differentiable.
        """
        longest = max(len(value) for value in values)
        cubics = []
        for value in values:
            # Each lane's spline is its own: it must not depend on how long its neighbours are.
            cubic = CubicSpline(KNOT_STEP * np.arange(len(value)), value, bc_type="clamped").c
            held = np.zeros((4, longest - len(value), value.shape[1]))
            held[3] = value[-1]
            cubics.append(np.concatenate([cubic, held], axis=1))
        stacked = np.ascontiguousarray(np.stack(cubics).transpose(0, 2, 1, 3))
        return cls(stacked, np.arange(len(stacked)))

    def subset(self, lanes: NDArray[np.intp]) -> Trajectory:
        """The commands of some lanes; one may be taken more than once."""
        return Trajectory(self.coefficients, self.lanes[lanes])

    def driving(self, stiffness: Real, damping: Real) -> Trajectory:
        """The commands as the forces ``k c + b c'`` with which springs and dampers drive.

        `stiffness`, `damping` (c, b): k and b of each command and lane.
        """
        cubic = self.coefficients[self.lanes]
        slope = np.zeros_like(cubic)
        slope[:, :, 1:] = cubic[:, :, :3] * np.array([3.0, 2.0, 1.0])[:, None]
        k, b = stiffness.T[:, None, None], damping.T[:, None, None]
        return Trajectory(k * cubic + b * slope, np.arange(len(self.lanes)))

    def at(self, times: Real) -> Real:
        """The commands at some instants, shape (c, b).

        `times` (b,): one for each lane, from 0 on; any number of times where there is one lane
        only.
        """
        splines, pieces, powers, commands = self.coefficients.shape
        interval = (times * (1.0 / KNOT_STEP)).astype(np.intp)
        np.minimum(interval, pieces - 1, out=interval)
        # Much faster than an index for each of the two axes.
        cubics = self.coefficients.reshape(splines * pieces, powers, commands)
        a, b, c, d = cubics.take(self.lanes * pieces + interval, axis=0).transpose(1, 2, 0)
        u = times - KNOT_STEP * interval
        return ((a * u + b) * u + c) * u + d
