"""Where a simulated demonstration comes from: enough to make it again."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import cast

import numpy as np

from forcelab.errors import InputError
from forcelab.simulation.scene import TASKS, Task

#: Slowest and fastest recording, Hz; the fastest is as fast as the motion itself is sampled.
RATES = (50.0, 4000.0)
#: Demonstrations that are made at one go.
MOST = 1000

_SOURCE = re.compile(r"simulated: task (\w+), seed (\d+), number (\d+), (\d+(?:\.\d+)?) Hz")


def task_named(name: str) -> Task:
    """The task of a name, whatever its case."""
    for task in TASKS:
        if task.casefold() == name.casefold():
            return task
    raise InputError(f"There is no task '{name}' to simulate; there are {', '.join(TASKS)}.")


@dataclass(frozen=True, slots=True, order=True)
class Origin:
    """What a simulated demonstration is made from.

    ``str(origin)`` is the demonstration's source in a project, and :meth:`parsed` its inverse.
    """

    task: Task  # one of :data:`~forcelab.simulation.scene.TASKS`
    seed: int  # of everything random, together with task and number
    number: int  # of the demonstration among those of the task and seed, from 1
    #: Samples a second of the recording. It changes no motion.
    rate: float = 1000.0

    def __post_init__(self) -> None:
        if not 0 <= self.seed < 2**32:
            raise InputError(f"The seed is a whole number from 0 to 2^32 - 1, not {self.seed}.")
        if self.number < 1:
            raise InputError(f"Demonstrations are numbered from 1, not {self.number}.")
        low, high = RATES
        if not low <= self.rate <= high:
            raise InputError(
                f"The tongs are simulated at {low:g} to {high:g} Hz, not at {self.rate:g} Hz."
            )

    def __str__(self) -> str:
        return (
            f"simulated: task {self.task}, seed {self.seed}, number {self.number}, "
            f"{repr(float(self.rate)).removesuffix('.0')} Hz"
        )

    @property
    def name(self) -> str:
        """What the demonstration is called, such as ``"foam-7-02"`` of seed 7."""
        return f"{self.task}-{self.seed}-{self.number:02d}"

    @classmethod
    def parsed(cls, source: str) -> Origin | None:
        """The origin that a demonstration's source tells; None where it tells anything else."""
        match = _SOURCE.fullmatch(source)
        if match is None or match[1] not in TASKS:
            return None
        try:
            origin = cls(cast(Task, match[1]), int(match[2]), int(match[3]), float(match[4]))
        except InputError:
            return None
        return origin if str(origin) == source else None

    def stream(self, *purpose: int) -> np.random.Generator:
        """A random stream of its own for each purpose, so that none of them moves another.

        The rate plays no part, so that a recording at another rate has the same sensors.
        """
        key = (TASKS.index(self.task), self.number, *purpose)
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=key))


def origins(task: Task, count: int, seed: int, rate: float = 1000.0) -> tuple[Origin, ...]:
    """The first `count` demonstrations of a task and seed."""
    if not 1 <= count <= MOST:
        raise InputError(f"From 1 to {MOST} demonstrations can be made at one go, not {count}.")
    return tuple(Origin(task, seed, number, rate) for number in range(1, count + 1))
