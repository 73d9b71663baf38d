"""Dormand and Prince's Runge-Kutta pair of orders 5 and 4, for many lanes at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.simulation.solvers.dormand_prince import DENSE, ERROR, NODES, STAGES
from forcelab.simulation.solvers.solution import Course, Explicit
from forcelab.simulation.solvers.stepping import Batch
from forcelab.simulation.system import Array, System

__all__ = ["ExplicitBatch"]


class ExplicitBatch(Batch):
    """Lanes whose every step is a sum of rates.

    The coefficients are in :mod:`~forcelab.simulation.solvers.dormand_prince`.
    """

    DENSE = DENSE
    EXPONENT, MEMORY = 0.17, 0.04
    LANEWISE = (*Batch.LANEWISE, "first")

    def __init__(self, system: System, solver: Explicit, course: Course) -> None:
        super().__init__(system, solver, course)
        #: The rates where the lanes are.
        self.first = system.rates(self.time, self.state)

    def _arrange(self, system: System) -> None:
        """Make room for the lanes of `system`."""
        super()._arrange(system)
        self.stages = np.empty((7, *self.state.shape))
        self.flat = self.stages.reshape(7, -1)

    def _try(self, length: Array, growth: Array) -> tuple[Array, Array]:
        """Try a step in every lane; see `Batch`."""
        trial, flat, state, rates = self.trial, self.flat, self.state, self.system.rates
        row = trial.reshape(-1)
        times = np.multiply.outer(NODES, length)
        times += self.time
        self.stages[0] = self.first
        for stage, weights in enumerate(STAGES):
            np.dot(weights, flat[: stage + 1], out=row)
            np.multiply(trial, length, out=trial)
            np.add(trial, state, out=trial)
            self.stages[stage + 1] = rates(times[stage], trial)
        np.dot(DENSE, flat, out=growth.reshape(len(growth), -1))
        growth *= length
        error = np.dot(ERROR, flat).reshape(trial.shape)
        error *= length
        after: Array = times[-1]
        return after, error

    def _accept(self, good: NDArray[np.bool_]) -> None:
        """The last stage is the first one of the next step."""
        np.copyto(self.first, self.stages[-1], where=good)

    def _restart(self, lane: int, alone: System) -> None:
        """Look at the rates where the lane starts afresh."""
        now, column = self.time[[lane]], self.state[:, [lane]]
        self.first[:, lane] = alone.rates(now, column)[:, 0]
