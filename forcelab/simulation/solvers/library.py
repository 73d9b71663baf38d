"""scipy's RK45, LSODA and Radau, stepped lane by lane so that events can be located."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import numpy as np
from scipy.integrate import LSODA, RK45, DenseOutput
from scipy.integrate import Radau as RadauIIA

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.simulation.solvers.locating import Passage, Watch
from forcelab.simulation.solvers.solution import (
    RELATIVE,
    Course,
    Explicit,
    Lsoda,
    Radau,
    unresolved,
)
from forcelab.simulation.system import Array, System

__all__ = ["integrating_with_scipy"]

#: Steps between two reports of progress.
_WINDOW = 256


def integrating_with_scipy(
    system: System, solver: Explicit | Lsoda | Radau, course: Course
) -> Iterator[Progress]:
    """Integrate with scipy, a lane after the other.

    LSODA is Petzold's (SIAM J. Sci. Stat. Comput. 4 (1983) 136-148), Radau IIA of order 5 that of
    Hairer and Wanner (*Solving Ordinary Differential Equations II*, section IV.8), RK45 that of
    Dormand and Prince (J. Comp. Appl. Math. 6 (1980) 19-26).
    """
    for lane in range(system.lanes):
        walk = _Walk(system.lane(lane), lane, course, solver)
        while not walk.finished:
            walk.advance()
            yield course.progress()


class _Walk:
    """One lane on its way through time."""

    def __init__(
        self, system: System, lane: int, course: Course, solver: Explicit | Lsoda | Radau
    ) -> None:
        self.system = system
        self.lane = lane
        self.course = course
        self.solver = solver
        self.watch = Watch(system)
        self.end = float(course.times[-1])
        self.tolerances = solver.tolerance * system.scales[:, 0]
        self.finished = False
        #: Whether all rates have been finite.
        self.sound = True
        state = course.states[0, :, lane].copy()
        self.sides = np.sign(system.watched(course.times[:1], state[:, None])[:, 0])
        self._start(float(course.times[0]), state)

    def advance(self) -> None:
        """Some steps.

        Raises
        ------
        InputError
            If they cannot be resolved.
        """
        with np.errstate(all="ignore"), warnings.catch_warnings():
            # What scipy warns of ends in a failed step, which is refused.
            warnings.simplefilter("ignore")
            for _ in range(_WINDOW):
                self._step()
                if self.finished:
                    return

    def _start(self, time: float, state: Array) -> None:
        """Start the method afresh, unless it is at the end."""
        if self.finished:
            return
        method = {Explicit: RK45, Lsoda: LSODA, Radau: RadauIIA}[type(self.solver)]
        try:
            self.method = method(
                self._rates,
                time,
                state,
                self.end,
                max_step=self.solver.longest,
                rtol=RELATIVE,
                atol=self.tolerances,
                vectorized=True,
            )
        except ValueError:
            if self.sound:
                raise
            raise self._lost(time) from None

    def _rates(self, time: float, state: Array) -> Array:
        """The rates of one state (s,) or several (s, n)."""
        columns = state.reshape(len(state), -1)
        rates = self.system.rates(np.full(columns.shape[1], time), columns)
        self.sound &= bool(np.isfinite(rates).all())
        return rates.reshape(state.shape)

    def _step(self) -> None:
        """One step, ended at the first event in it."""
        method = self.method
        begun = float(method.t)
        self.course.spend(self.lane, begun, 1, self.solver.max_steps)
        try:
            method.step()
        except ValueError:
            # scipy's linear algebra refuses what follows from rates that are not finite.
            if self.sound:
                raise
            raise self._lost(begun) from None
        if method.status == "failed" or not np.isfinite(method.y).all():
            raise self._lost(begun)
        after, within = float(method.t), method.dense_output()
        passage = self._passage(begun, after, within)
        self.sides = passage.sides
        if passage.happened:
            after = begun + passage.share * (after - begun)
        self.finished = bool(self.end - after <= 8 * np.finfo(float).eps * abs(self.end))
        self._sample(after, within)
        if passage.happened:
            self._start(after, self._happened(after, within(after), passage))

    def _passage(self, begun: float, after: float, within: DenseOutput) -> Passage:
        """How the event functions pass through a step."""
        if not len(self.sides):
            return Passage(1.0, self.sides, ())

        def path(shares: Array) -> tuple[Array, Array]:
            times = begun + shares * (after - begun)
            return times, within(times)

        try:
            return self.watch.first(self.system, path, after - begun, self.sides)
        except FloatingPointError:
            raise self._lost(begun) from None

    def _sample(self, after: float, within: DenseOutput) -> None:
        """The states at the sample times that were passed in a step."""
        course, lane = self.course, self.lane
        first = course.filled[lane]
        last = len(course.times)
        if not self.finished:
            last = int(np.searchsorted(course.times, after, "right"))
        if last > first:
            course.states[first:last, :, lane] = within(course.times[first:last]).T
            course.filled[lane] = last

    def _happened(self, time: float, state: Array, passage: Passage) -> Array:
        """The state right after an event."""
        self.course.happen(self.lane, time, self.watch.kinds(passage))
        state, _, self.sides = self.watch.after(self.system, passage, time, state)
        return state

    def _lost(self, time: float) -> InputError:
        """The refusal of a step that did not succeed."""
        return unresolved(
            self.lane,
            time,
            f"{type(self.solver).__name__} finds no step with a finite end",
            "lower the tolerance or the stiffness",
        )
