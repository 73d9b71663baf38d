"""Symplectic Euler with a fixed step, for many lanes at once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.simulation.solvers.locating import Watch
from forcelab.simulation.solvers.solution import Course, SemiImplicit, unresolved
from forcelab.simulation.system import Array, System

__all__ = ["integrating_semi_implicitly"]

#: Largest product that passes of the step and how fast a lane can move.
_RESOLVED = 0.5
#: Most steps between two looks at how fast a lane can move.
_PAUSE = 1024
#: Fewest steps between two looks for which the motion itself gives cause.
_ALARM = 16
#: How far a state is moved to look at the stiffness, as a share of its scale: a thousandth of a
#: newton.
_NUDGE = 1e-3


def integrating_semi_implicitly(
    system: System, solver: SemiImplicit, course: Course
) -> Iterator[Progress]:
    """Integrate with symplectic Euler.

    Of first order; an undamped oscillator keeps its energy but for a ripple while the step times
    the angular frequency is below 2 (Hairer, Lubich and Wanner, *Geometric Numerical Integration*,
    section I.1.2). Here it must stay below a half, a dozen steps in a period, and the step times a
    rate of decay below 1: the eigenvalues of the rates' derivative are looked at 1, 2, 4 ... steps
    after the start and after each event, then every 1024 steps, and within 16 steps where the rates
    change faster with the motion than that allows. Stiffness that comes and goes in fewer steps,
    without an event, is not seen. Events are those of the straight line between two steps.
    """
    times = course.times
    gap = float(times[-1] - times[0]) / (len(times) - 1)
    substeps = max(1, int(np.ceil(gap / solver.step * (1 - 1e-9))))
    for lane in range(system.lanes):
        course.spend(lane, times[0], substeps * (len(times) - 1), solver.max_steps)
    march = _March(system, gap / substeps, course)
    for sample in range(1, len(times)):
        for substep in range(substeps):
            march.step(float(times[sample - 1]) + substep * march.length)
        march.refuse_nonsense(float(times[sample]))
        course.states[sample] = march.state
        course.filled += 1
        if sample % 64 == 0:
            yield course.progress()


class _March:
    """The state of all lanes, at one time."""

    def __init__(self, system: System, length: float, course: Course) -> None:
        self.system = system
        self.length = length
        self.course = course
        self.watch = Watch(system)
        self.state = course.states[0].copy()
        self.sides = np.sign(system.watched(np.full(system.lanes, course.times[0]), self.state))
        self.undecided = bool((self.sides == 0).any())
        self.count = 0
        #: At which count the stiffness of each lane is looked at, and the pause after that.
        self.due: NDArray[np.intp] = np.zeros(system.lanes, np.intp)
        self.pause: NDArray[np.intp] = np.ones(system.lanes, np.intp)
        self.next_due = 0
        #: Weights that make states of different units alike, and where and how fast it was before.
        self.weights = 1.0 / system.scales
        self.before: tuple[Array, Array] | None = None
        self.looked: NDArray[np.intp] = np.zeros(system.lanes, np.intp)

    def step(self, time: float) -> None:
        """One step of all lanes from `time`, with whatever happens in it."""
        times = np.full(self.system.lanes, time)
        if self.count >= self.next_due:
            self._look(time)
        self.count += 1
        with np.errstate(over="ignore", invalid="ignore"):
            rates = self.system.rates(times, self.state)
            after = self._moved(self.system, self.state, rates, self.length)
            self._heed(rates)
            if len(self.sides):
                self._watch(times, after)
        self.state = after

    def refuse_nonsense(self, time: float) -> None:
        """Refuse states that are not finite."""
        wrong = ~np.isfinite(self.state).all(axis=0)
        if wrong.any():
            raise unresolved(int(wrong.argmax()), time, "it is not finite", "shorten the step")

    def _heed(self, rates: Array) -> None:
        """Have a lane looked at whose rates change faster with its motion than the step allows."""
        if self.before is not None:
            state, slower = self.before
            moved = (np.abs(self.state - state) * self.weights).max(axis=0)
            changed = (np.abs(rates - slower) * self.weights).max(axis=0)
            alarming = (self.length * changed > _RESOLVED * moved) & (
                self.count >= self.looked + _ALARM
            )
            if alarming.any():
                self.due[alarming] = self.next_due = self.count
        self.before = self.state, rates

    def _moved(self, system: System, state: Array, rates: Array, length: float) -> Array:
        """The state one step later."""
        after = state + length * rates
        after[system.positions] = state[system.positions] + length * after[system.velocities]
        return after

    def _watch(self, times: Array, after: Array) -> None:
        """Let happen what happens in a step; `after` is changed where something does."""
        values = self.system.watched(times + self.length, after)
        calm = (values * self.sides).min(axis=0) >= 0  # not so where a value is not a number
        if not calm.all():
            for lane in np.flatnonzero(~calm):
                self._pass(int(lane), float(times[lane]), after)
        if self.undecided:
            np.copyto(self.sides, np.sign(values), where=(self.sides == 0) & calm)
            self.undecided = bool((self.sides == 0).any())

    def _pass(self, lane: int, time: float, after: Array) -> None:
        """One step of one lane, event by event; its end is put into `after`."""
        alone = self.system.lane(lane)
        end = time + self.length
        state, target = self.state[:, lane], after[:, lane]
        while True:
            now, length = time, end - time

            def path(shares: Array) -> tuple[Array, Array]:
                way = np.multiply.outer(target - state, shares)  # noqa: B023 (called at once)
                return now + shares * length, state[:, None] + way  # noqa: B023

            try:
                passage = self.watch.first(alone, path, length, self.sides[:, lane].copy())
            except FloatingPointError as error:
                raise unresolved(lane, time, str(error), "shorten the step") from None
            self.sides[:, lane] = passage.sides
            if not passage.happened:
                break
            self.due[lane] = self.next_due = self.count
            self.pause[lane] = 1
            time = now + passage.share * length
            state = state + passage.share * (target - state)
            self.course.happen(lane, time, self.watch.kinds(passage))
            state, _, self.sides[:, lane] = self.watch.after(alone, passage, time, state)
            column = state[:, None]
            rates = alone.rates(np.array([time]), column)
            target = self._moved(alone, column, rates, end - time)[:, 0]
        after[:, lane] = target

    def _look(self, time: float) -> None:
        """Look at the stiffness of the lanes whose turn it is.

        Raises
        ------
        InputError
            If the step is too long for one of them.
        """
        for lane in np.flatnonzero(self.due <= self.count):
            fastest = self._fastest(int(lane), time)
            if not self.length * fastest <= _RESOLVED:
                raise unresolved(
                    int(lane),
                    time,
                    f"a step of {self.length:.3g} s is too long",
                    f"shorten it below {_RESOLVED / fastest:.2g} s or let another solver choose it",
                )
            self.looked[lane] = self.count
            self.due[lane] = self.count + self.pause[lane]
            self.pause[lane] = min(2 * self.pause[lane], _PAUSE)
        self.next_due = int(self.due.min())

    def _fastest(self, lane: int, time: float) -> float:
        """The fastest oscillation, or half the fastest decay, of small motions about a state, 1/s.

        From the rates' derivative in the direction in which the states move.
        """
        state = self.state[:, lane, None]
        alone = self.system.lane(lane)
        count = len(state)
        nudges = _NUDGE * alone.scales[:, 0]
        with np.errstate(over="ignore", invalid="ignore"):
            rates = alone.rates(np.array([time]), state)
            nudges = np.where(rates[:, 0] < 0, -nudges, nudges)
            nudged = alone.rates(np.full(count, time), state + np.diag(nudges))
            derivative = (nudged - rates) / nudges
        if not np.isfinite(derivative).all():
            raise unresolved(lane, time, "its rates are not finite", "shorten the step")
        modes = np.linalg.eigvals(derivative)
        return float(np.maximum(np.abs(modes.imag), 0.5 * np.abs(modes.real)).max())
