"""Steps of many lanes at once, each lane with its own time and its own step.

Steps are accepted or rejected lane by lane, so that a stiff lane does not slow the others' motion
down. numpy is called a fixed number of times per round, whatever the number of lanes.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.simulation.solvers.locating import CLOSE, Passage, Watch, calm_lanes
from forcelab.simulation.solvers.solution import (
    RELATIVE,
    Course,
    Rosenbrock,
    unresolved,
)
from forcelab.simulation.system import Array, System

__all__ = ["Batch", "repeated"]

#: Rounds between two looks at which lanes are finished and which samples are passed.
_WINDOW = 64
_FIRST_STEP = 1e-6
#: Where in a step the event functions are looked at, besides its start, as shares of it.
_LOOKS = np.array([0.25, 0.5, 0.75, 1.0])
#: A step that ends within this share of itself after an event ends at the event: so near to its
#: end, the states within the step are as good as those at the end.
_NEAR = 0.01


class Batch(ABC):
    """The lanes that are not finished yet, with the records of one window of rounds.

    A method with one step behind it (Runge-Kutta, Rosenbrock) says how it tries a step, and
    inherits everything else.

    Attributes
    ----------
    DENSE : ndarray, shape (p, stages)
        Within the step, the state grows by the sum over k = 1..p of ``share**k`` times (row k - 1
        of this) @ stages, times whatever the method multiplies its stages with.
    EXPONENT, MEMORY : float
        A step's error, and that of the step before, to these powers choose the next step.
    LANEWISE : tuple of str
        Names of the arrays that go with the lanes, their last axis.
    """

    DENSE: ClassVar[Array]
    EXPONENT: ClassVar[float]
    MEMORY: ClassVar[float]
    LANEWISE: ClassVar[tuple[str, ...]] = (
        "lanes",
        "time",
        "step",
        "memory",
        "eager",
        "state",
        "values",
        "sides",
    )

    def __init__(self, system: System, solver: Rosenbrock, course: Course) -> None:
        self.solver = solver
        self.course = course
        self.watch = Watch(system)
        self.end = float(course.times[-1])
        #: Below this a step cannot be told from rounding.
        self.floor = max(1e-13, 8 * np.finfo(float).eps * abs(self.end))
        self.powers = np.arange(1, len(self.DENSE) + 1)
        self.looks = _LOOKS[:, None] ** self.powers
        lanes = system.lanes
        self.lanes: NDArray[np.intp] = np.arange(lanes)
        self.time = np.full(lanes, course.times[0])
        self.state = course.states[0].copy()
        self.step = np.full(lanes, min(_FIRST_STEP, solver.longest))
        self.memory = np.full(lanes, 1e-4**self.MEMORY)
        self.eager = np.ones(lanes, bool)
        # A copy: an event function may be a state.
        self.values = system.watched(self.time, self.state).copy()
        self.sides = np.sign(self.values)
        self._arrange(system)

    @abstractmethod
    def _try(self, length: Array, growth: Array) -> tuple[Array, Array]:
        """Try a step of `length` (b,) in every lane.

        Returns the times after it and each state's error (s, b). Fills the trial state, and
        `growth` (p, s, b) with the coefficients of the powers of the share of the step.
        """

    def _accept(self, good: NDArray[np.bool_]) -> None:  # noqa: B027 (optional)
        """The steps of these lanes are about to be taken: `state` is still that before them."""

    def _restart(self, lane: int, alone: System) -> None:  # noqa: B027 (optional)
        """A lane, `alone` as a system of its own, starts afresh from its time and state."""

    def run(self) -> Iterator[Progress]:
        """Follow all lanes to the end."""
        while self.lanes.size:
            self._advance()
            yield self.course.progress()
            self._drop_finished()

    def _arrange(self, system: System) -> None:
        """Make room for the lanes of `system`."""
        shape = self.state.shape
        self.system = system
        self.looking = repeated(system, len(_LOOKS))
        self.alone: dict[int, System] = {}
        self.trial = np.empty(shape)
        self.undecided = bool((self.sides == 0).any())
        self.growth = np.empty((_WINDOW, len(self.DENSE), *shape))
        self.before = np.empty((_WINDOW, *shape))
        self.begun = np.empty((_WINDOW, shape[1]))
        self.lengths = np.empty((_WINDOW, shape[1]))
        self.ended = np.empty((_WINDOW, shape[1]))
        self._weigh()

    def _weigh(self) -> None:
        """What an error of one is, for each state."""
        allowed = self.solver.tolerance * self.system.scales + RELATIVE * abs(self.state)
        self.weights = 1 / allowed

    def _advance(self) -> None:
        """One window of rounds, and the samples that were passed in it."""
        rounds = 0
        # A trial step may leave the range of numbers; it is then rejected.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            while rounds < _WINDOW and self._round(rounds):
                rounds += 1
        self._sample(rounds)
        self._weigh()

    def _round(self, slot: int) -> bool:
        """Try one step in every lane; False if all lanes are at the end."""
        left = self.end - self.time
        finished = left.min() < self.floor
        if finished:
            left[left < self.floor] = 0.0
            if not left.any():
                return False
        length = np.minimum(self.step, left)
        if self.step.min() < self.floor:
            self._refuse_step()
        after, errors = self._try(length, self.growth[slot])
        error = (np.abs(errors) * self.weights).max(axis=0)
        if finished:
            error[length == 0] = 0.0
        good = (error <= 1) & (length > 0)
        self._choose_steps(error, good)
        passages = self._passages(slot, length, after, good) if len(self.sides) else {}

        self.before[slot] = self.state
        self.begun[slot] = self.time
        self.lengths[slot] = length
        self.ended[slot] = np.where(good, after, -np.inf)
        self._accept(good)
        np.copyto(self.state, self.trial, where=good)
        np.copyto(self.time, after, where=good)
        for lane, passage in passages.items():
            self._happen(lane, passage, slot)
        return True

    def _choose_steps(self, error: Array, good: NDArray[np.bool_]) -> None:
        """The length of each lane's next step; an error that is not a number shrinks it most.

        As in Hairer, Norsett and Wanner, *Solving Ordinary Differential Equations I*, section
        II.4, with the stabilisation of Gustafsson (section IV.2 of volume II).
        """
        factor = 0.9 * self.memory / error**self.EXPONENT
        np.minimum(factor, np.where(good & self.eager, 5.0, 1.0), out=factor)
        np.copyto(self.memory, np.maximum(error, 1e-4) ** self.MEMORY, where=good)
        self.eager = good.copy()
        self.step *= np.where(factor > 0.2, factor, 0.2)
        np.minimum(self.step, self.solver.longest, out=self.step)

    def _passages(
        self, slot: int, length: Array, after: Array, good: NDArray[np.bool_]
    ) -> dict[int, Passage]:
        """The lanes whose step ends at an event; longer steps into an event are to be retried."""
        count, lanes = self.state.shape
        grown = self.looks @ self.growth[slot].reshape(len(self.powers), -1)
        states = self.state[:, None] + grown.reshape(-1, count, lanes).transpose(1, 0, 2)
        states[:, -1] = self.trial
        times = self.time + np.multiply.outer(_LOOKS, length)
        times[-1] = after
        seen = self.looking.watched(times.ravel(), states.reshape(count, -1))
        values = seen.reshape(-1, len(_LOOKS), lanes)
        traces = np.concatenate([self.values[:, None], values], axis=1) * self.sides[:, None]
        busy = ~calm_lanes(traces) & (length > 0)
        passages: dict[int, Passage] = {}
        for lane in np.flatnonzero(busy & ~good).tolist():
            self._approach(lane, traces[:, :, lane], length[lane])
        for lane in np.flatnonzero(busy & good).tolist():
            passage = self._first(lane, slot, length[lane])
            past = passage.share * length[lane]
            if not passage.happened:
                self.sides[:, lane] = passage.sides
            elif past > CLOSE and length[lane] - past > max(CLOSE, _NEAR * length[lane]):
                good[lane] = False
                self.step[lane] = past * (1 + 0.5 * _NEAR)
            else:
                passages[lane] = passage
        np.copyto(self.values, values[:, -1], where=good)
        if self.undecided:
            np.copyto(self.sides, np.sign(self.values), where=(self.sides == 0) & good)
            self.undecided = bool((self.sides == 0).any())
        return passages

    def _approach(self, lane: int, traces: Array, length: float) -> None:
        """Aim a rejected step to just before the first event function that it took across zero.

        Where the rates jump at an event, no step across it is accepted unless it is very short.
        """
        event, look = np.nonzero((traces[:, 1:] < 0) & (traces[:, :-1] >= 0))
        if len(event):
            before, after = traces[event, look], traces[event, look + 1]
            crossed = (look + before / (before - after)).min() / len(_LOOKS)
            if crossed * length > CLOSE:
                self.step[lane] = (1 - _NEAR) * crossed * length

    def _first(self, lane: int, slot: int, length: float) -> Passage:
        """How a lane's event functions pass through its trial step."""
        begun, state = self.time[lane], self.state[:, lane, None]
        growth = self.growth[slot, :, :, lane]

        def path(shares: Array) -> tuple[Array, Array]:
            powers = shares ** self.powers[:, None]
            return begun + shares * length, state + growth.T @ powers

        try:
            return self.watch.first(self._alone(lane), path, length, self.sides[:, lane].copy())
        except FloatingPointError as error:
            raise unresolved(
                int(self.lanes[lane]), begun, str(error), "look at the scene's numbers"
            ) from None

    def _happen(self, lane: int, passage: Passage, slot: int) -> None:
        """End a lane's step at an event and start afresh from there."""
        number = int(self.lanes[lane])
        begun, length = self.begun[slot, lane], self.lengths[slot, lane]
        time = float(begun + passage.share * length)
        growth = self.growth[slot, :, :, lane]
        state = self.before[slot, :, lane] + passage.share**self.powers @ growth
        self.course.happen(number, time, self.watch.kinds(passage))
        alone = self._alone(lane)
        after = self.watch.after(alone, passage, time, state)
        self.state[:, lane], self.values[:, lane], self.sides[:, lane] = after
        self.ended[slot, lane] = self.time[lane] = time
        self._restart(lane, alone)

    def _alone(self, lane: int) -> System:
        """A lane as a system of its own, made once."""
        if lane not in self.alone:
            self.alone[lane] = self.system.lane(lane)
        return self.alone[lane]

    def _sample(self, rounds: int) -> None:
        """The states at the sample times that were passed in a window."""
        course = self.course
        for lane, number in enumerate(self.lanes):
            tried = int(np.count_nonzero(self.lengths[:rounds, lane]))
            course.spend(int(number), self.time[lane], tried, self.solver.max_steps)
            done = np.flatnonzero(self.ended[:rounds, lane] > -np.inf)
            if not len(done):
                continue
            ended = self.ended[done, lane]
            first, last = course.filled[number], len(course.times)
            if self.end - ended[-1] >= self.floor:
                last = int(np.searchsorted(course.times, ended[-1], "right"))
            wanted = course.times[first:last]
            slot = done[np.minimum(np.searchsorted(ended, wanted), len(done) - 1)]
            shares = (wanted - self.begun[slot, lane]) / self.lengths[slot, lane]
            growth = self.growth[slot, :, :, lane]
            course.states[first:last, :, number] = self.before[slot, :, lane] + np.einsum(
                "nps,np->ns", growth, shares[:, None] ** self.powers
            )
            course.filled[number] = last

    def _drop_finished(self) -> None:
        """Go on without the finished lanes once they are half of all."""
        going = np.flatnonzero(self.end - self.time >= self.floor)
        if 2 * len(going) > len(self.lanes):
            return
        for name in self.LANEWISE:
            setattr(self, name, getattr(self, name)[..., going])
        if len(going):
            self._arrange(self.system.subset(going))

    def _refuse_step(self) -> None:
        """Say which lane's step became too short."""
        lane = int(self.step.argmin())
        raise unresolved(
            int(self.lanes[lane]),
            self.time[lane],
            f"the step fell below {self.floor:.0e} s",
            "lower the stiffness or raise the mass",
        )


def repeated(system: System, times: int) -> System:
    """A system that takes `times` columns for each lane: all lanes, then all lanes again, ..."""
    if system.lanes == 1:
        return system  # takes any number of columns
    return system.subset(np.tile(np.arange(system.lanes), times))
