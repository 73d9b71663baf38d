"""What every solver takes and gives: its settings, its result, and how it refuses."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.simulation.motion import Event
from forcelab.simulation.system import Array

__all__ = [
    "RELATIVE",
    "Course",
    "Explicit",
    "Lsoda",
    "Radau",
    "Rosenbrock",
    "Solution",
    "Solver",
]

#: What is allowed of a state's own size besides the tolerance in newtons: its rounding.
RELATIVE = 1e-12


@dataclass(frozen=True)
class _Settings:
    """Settings of a solver that chooses its steps.

    Parameters
    ----------
    tolerance : float
        Error allowed in one step, newtons: for each state, `tolerance` times the system's scale.
    longest : float
        Longest step, s. What the hand does for a shorter time cannot be overlooked.
    max_steps : int
        Steps one lane may take, rejected ones included.
    """

    tolerance: float = 1e-4
    longest: float = 0.01
    max_steps: int = 1_000_000

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0 < value < float("inf"):
                raise InputError(
                    f"{type(self).__name__}.{field.name} must be finite and above zero, "
                    f"not {value}."
                )


@dataclass(frozen=True)
class Explicit(_Settings):
    """scipy's RK45, lane by lane: Dormand and Prince's pair of orders 5 and 4."""


@dataclass(frozen=True)
class Rosenbrock(_Settings):
    """A linearly implicit method of order 4, each lane with steps of its own: for stiff batches."""


@dataclass(frozen=True)
class Lsoda(_Settings):
    """scipy's LSODA, lane by lane: Adams' and Gear's methods, changed over when it gets stiff."""


@dataclass(frozen=True)
class Radau(_Settings):
    """scipy's Radau IIA of order 5, lane by lane: implicit, for the stiffest contacts."""


Solver = Rosenbrock | Explicit | Lsoda | Radau


@dataclass(frozen=True)
class Solution:
    """What a solver found.

    Parameters
    ----------
    states : ndarray, shape (n, s, b)
        At the sample times; where a sample time is that of a jump, the state before it.
    events : tuple of tuple of Event, length b
        What happened in each lane, in order of time.
    steps : ndarray of int, shape (b,)
        Steps tried in each lane, rejected ones included.
    """

    states: Array
    events: tuple[tuple[Event, ...], ...]
    steps: NDArray[np.intp]


class Course:
    """The solution while it comes into being.

    Parameters
    ----------
    start : ndarray, shape (s, b)
    times : ndarray, shape (n,)
    """

    def __init__(self, start: Array, times: Array) -> None:
        lanes = start.shape[1]
        self.times = times
        self.states = np.empty((len(times), *start.shape))
        self.states[0] = start
        self.filled = np.ones(lanes, np.intp)
        self.events: list[list[Event]] = [[] for _ in range(lanes)]
        self.steps = np.zeros(lanes, np.intp)

    def progress(self) -> Progress:
        """How many samples there are, of how many."""
        return Progress(int(self.filled.sum()), self.states.shape[0] * len(self.filled), "moving")

    def solution(self) -> Solution:
        """The result."""
        events = tuple(tuple(happened) for happened in self.events)
        return Solution(self.states, events, self.steps)

    def happen(self, lane: int, time: float, kinds: tuple[str, ...]) -> None:
        """Note events of one instant.

        Raises
        ------
        InputError
            If events follow each other without end.
        """
        happened = self.events[lane]
        happened.extend(Event(time, kind) for kind in kinds)
        if len(happened) > 100 and time - happened[-100].time < 1e-6:
            among = " and ".join(f"'{kind}'" for kind in sorted({e.kind for e in happened[-100:]}))
            raise unresolved(
                lane, time, f"{among} follow each other without end", "raise the damping there"
            )

    def spend(self, lane: int, time: float, steps: int, budget: int) -> None:
        """Count the steps tried in a lane.

        Raises
        ------
        InputError
            If there are more than the budget allows.
        """
        self.steps[lane] += steps
        if self.steps[lane] > budget:
            raise unresolved(
                lane,
                time,
                f"it took more than {budget} steps",
                "lower the stiffness, raise the mass or allow more steps",
            )


def unresolved(lane: int, time: float, reason: str, cure: str) -> InputError:
    """A refusal: which lane, when, why and what helps."""
    return InputError(
        f"The motion of demonstration {lane + 1} cannot be resolved at {time:.6g} s: "
        f"{reason}; {cure}."
    )
