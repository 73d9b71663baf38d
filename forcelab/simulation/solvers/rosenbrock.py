"""A Rosenbrock method of order 4, for many stiff lanes at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.simulation.solvers.rodas import COUPLING, DENSE, GAMMA, NODES, SLOPES, STAGES
from forcelab.simulation.solvers.solution import Course, Rosenbrock
from forcelab.simulation.solvers.stepping import Batch, repeated
from forcelab.simulation.system import Array, System

__all__ = ["RosenbrockBatch"]

#: How far a state is moved for a derivative, as a share of itself or, where that is more, of its
#: scale: half of the digits are left to the difference.
_NUDGE = float(np.sqrt(np.finfo(float).eps))


class RosenbrockBatch(Batch):
    """Lanes whose every step solves linear equations, by RODAS4P2.

    With J the rates' derivative by the states, f_t that by time, and h the step, stage i is

        (1 / (gamma h) - J) u_i = f(t + c_i h, y + sum a_ij u_j) + sum c_ij u_j / h + d_i h f_t

    (:mod:`~forcelab.simulation.solvers.rodas`). A spring that is stiff against its mass limits the
    accuracy of a step only as far as it moves; it does not limit its length. All differences that
    make up J and f_t, of all lanes, are taken in one call of the system.
    """

    DENSE = DENSE
    EXPONENT, MEMORY = 0.18, 0.08
    LANEWISE = (*Batch.LANEWISE, "heading")

    def __init__(self, system: System, solver: Rosenbrock, course: Course) -> None:
        #: Where each state went in the last step: a nudge that way meets no contact left behind.
        self.heading = np.ones(course.states[0].shape)
        self.positions, self.velocities = system.positions, system.velocities
        #: All rows but the positions', and which of these are the velocities.
        self.inner = np.setdiff1d(np.arange(len(system.names)), system.positions)
        self.carried = np.searchsorted(self.inner, system.velocities)
        super().__init__(system, solver, course)

    def _arrange(self, system: System) -> None:
        """Make room for the lanes of `system`."""
        super()._arrange(system)
        count, lanes = self.state.shape
        self.stages = np.empty((len(NODES), count, lanes))
        self.flat = self.stages.reshape(len(NODES), -1)
        self.varied = repeated(system, count + 2)
        self.back = np.empty((lanes, count, count))

    def _try(self, length: Array, growth: Array) -> tuple[Array, Array]:
        """Try a step in every lane; see `Batch`."""
        length = np.where(length > 0, length, 1.0)
        self._linearise()
        self._invert(GAMMA * length)
        trial, flat, state, rates = self.trial, self.flat, self.state, self.system.rates
        row, times = trial.reshape(-1), self.time + np.multiply.outer(NODES, length)
        drift, pace = self.drift * length, 1 / length
        right = self.first + SLOPES[0] * drift
        for stage in range(len(NODES)):
            if stage:
                np.dot(STAGES[stage], flat[:stage], out=row)
                np.add(trial, state, out=trial)
                right = rates(times[stage], trial)
                right += np.dot(COUPLING[stage], flat[:stage]).reshape(trial.shape) * pace
                if SLOPES[stage]:
                    right += SLOPES[stage] * drift
            np.einsum("bij,jb->ib", self.back, right, out=self.stages[stage])
        error = self.stages[-1]
        np.add(trial, error, out=trial)
        np.dot(DENSE, flat, out=growth.reshape(len(growth), -1))
        after: Array = times[-1]
        return after, error

    def _linearise(self) -> None:
        """The rates where the lanes are, and their derivatives by time and state."""
        count, lanes = self.state.shape
        nudges = _NUDGE * np.maximum(np.abs(self.state), self.system.scales)
        np.copysign(nudges, self.heading, out=nudges)
        # As they are, then a little later, then with one state after the other nudged.
        times = np.tile(self.time, (count + 2, 1))
        times[1] += _NUDGE * np.maximum(np.abs(self.time), 1.0)
        states = np.repeat(self.state[:, None], count + 2, axis=1)
        each = np.arange(count)
        states[each, each + 2] += nudges
        nudges = states[each, each + 2] - self.state  # as far as they went after rounding
        rates = self.varied.rates(times.ravel(), states.reshape(count, -1))
        rates = rates.reshape(count, count + 2, lanes)
        self.first = rates[:, 0]
        self.drift = (rates[:, 1] - self.first) / (times[1] - times[0])
        change = (rates[self.inner, 2:] - self.first[self.inner, None]) / nudges
        self.slope = np.ascontiguousarray(change.transpose(2, 0, 1))

    def _invert(self, reach: Array) -> None:
        """The inverse of ``1 / reach - J``, reach being gamma h.

        A position's rate is a velocity: ``u_q = reach (right_q + u_v)`` is put into the other
        equations, which are about half of all.
        """
        count, share = len(self.inner), reach[:, None, None]
        carry = self.slope[:, :, self.positions] * share
        matrix = -self.slope[:, :, self.inner]
        matrix[:, :, self.carried] -= carry
        diagonal = np.arange(count)
        matrix[:, diagonal, diagonal] += 1 / share[:, 0]
        right = np.zeros((len(reach), count, len(self.state)))
        right[:, diagonal, self.inner] = 1.0
        right[:, :, self.positions] = carry
        back = self.back
        back[:, self.inner] = _inverse(matrix) @ right
        back[:, self.positions] = back[:, self.velocities] * share
        back[:, self.positions, self.positions] += share[:, 0]

    def _accept(self, good: NDArray[np.bool_]) -> None:
        """Remember where the lanes went."""
        np.copyto(self.heading, self.trial - self.state, where=good)


def _inverse(matrices: Array) -> Array:
    """Inverses (b, n, n); not numbers where a matrix has none, so that the step is rejected."""
    try:
        return np.asarray(np.linalg.inv(matrices), np.float64)
    except np.linalg.LinAlgError:
        matrices[np.linalg.slogdet(matrices)[0] == 0] = np.nan
        return np.asarray(np.linalg.inv(matrices), np.float64)
