"""Solvers of the equations of motion behind one interface: a Rosenbrock method, and SciPy's.

The tasks use RODAS4P2: a Rosenbrock method of order 4 with six stages, L-stable. G. Steinebach,
"Improvement of Rosenbrock-Wanner method RODASP", in: Progress in Differential-Algebraic Equations
II, Springer (2020) 165-184; in the form without products of the Jacobian of E. Hairer and G.
Wanner, *Solving Ordinary Differential Equations II*, section IV.7. Its order does not fall where
stiff parts follow slow forces, and falls to no less than 2 where the Jacobian is wrong.

It integrates many lanes at once, each with its own time and its own step. Steps are accepted or
rejected lane by lane, so that a stiff lane does not slow the others' motion down. numpy is called a
fixed number of times per round, whatever the number of lanes.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.integrate
from numpy.typing import NDArray
from scipy.integrate import DenseOutput

from forcelab.arrays import Real
from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.simulation.mechanics import Mechanics
from forcelab.simulation.scene import Event

#: Width in seconds to which a crossing is bracketed.
_WIDTH = 1e-10
#: A step that ends within this time of an event, in seconds, ends at the event.
CLOSE = 1e-9
_PARTS = 64


@dataclass(frozen=True)
class StepEvents:
    """How event functions passed through a step, as far as the first event."""

    share: float  # of the step, from 0 to 1: just after the first event, or 1 where there is none
    sides: Real  # (e,), the sides on which the event functions are there
    #: Event functions that crossed at that instant, and whether they rose.
    happened: tuple[tuple[int, bool], ...]


class EventLocator:
    """Watches the event functions of a system.

    The *side* of an event function is its last sign that was not zero, and 0 only while it has
    been exactly zero from the start: leaving zero from there, or touching it, crosses nothing.
    To which side it leaves is seen at the end of a step, as a solver's states within a step may
    err to either side.
    """

    def __init__(self, system: Mechanics) -> None:
        self._meanings = system.events
        self._named = np.array(system.events, dtype=str).reshape(-1, 2) != ""

    def kinds(self, passage: StepEvents) -> tuple[str, ...]:
        """What the events of a passage are called."""
        return tuple(self._meanings[event][not rising] for event, rising in passage.happened)

    def first(
        self,
        lane: Mechanics,
        path: Callable[[Real], tuple[Real, Real]],
        length: float,
        sides: Real,
    ) -> StepEvents:
        """The first event in a step of one lane, bracketed to a tenth of a nanosecond.

        All event functions are looked at on a grid of the step, then on a grid of that part of it
        where the first crossing is, and so on: crossings there and back within a step are found
        if they are further apart than a 64th of it.

        `path`: from shares of the step, shape (n,), to times (n,) and states (s, n); `length`: of
        the step, s; `sides` (e,): where the event functions come from. `FloatingPointError` if an
        event function is not finite.
        """
        low, high = 0.0, 1.0
        decided = sides != 0
        happened: tuple[tuple[int, bool], ...] = ()
        while True:
            shares = np.linspace(low, high, _PARTS + 1)
            values = lane.watched(*path(shares))
            if not np.isfinite(values).all():
                raise FloatingPointError("an event function is not finite")
            trace = _sides(sides, values)
            crossed = trace[:, 1:] * trace[:, :-1] < 0
            crossed &= np.where(trace[:, 1:] > 0, self._named[:, :1], self._named[:, 1:])
            crossed &= decided[:, None]
            columns = np.flatnonzero(crossed.any(axis=0))
            if not len(columns):
                # Rounding may hide on the finer grid what the coarser one showed at its edge.
                return StepEvents(high, trace[:, -1], happened)
            part = columns[0]
            happened = tuple(
                (int(event), bool(trace[event, part + 1] > 0))
                for event in np.flatnonzero(crossed[:, part])
            )
            low, high = float(shares[part]), float(shares[part + 1])
            if (high - low) * length <= _WIDTH or high - low < 1e-14:
                return StepEvents(high, np.where(decided, trace[:, part + 1], 0), happened)
            sides = np.where(decided, trace[:, part], 0)

    @staticmethod
    def after(
        lane: Mechanics, passage: StepEvents, time: float, state: Real
    ) -> tuple[Real, Real, Real]:
        """The state (s,) right after the events of a passage, its event functions, and their sides.

        A jump may move an event function to its other side; one that is zero then comes from where
        it was.
        """
        for event, rising in passage.happened:
            state = lane.jump(event, rising, state)
        values = lane.watched(np.array([time]), state[:, None])[:, 0]
        return state, values, np.where(values != 0, np.sign(values), passage.sides)


def _sides(before: Real, values: Real) -> Real:
    """The sides along a row of values (e, n), the first of which is where they come from."""
    signs = np.sign(values)
    signs[:, 0] = before
    number: NDArray[np.intp] = np.where(signs != 0, np.arange(signs.shape[1]), 0)
    return np.take_along_axis(signs, np.maximum.accumulate(number, axis=1), axis=1)


def calm_lanes(traces: Real) -> NDArray[np.bool_]:
    """In which lanes no event function can have changed sides within the step, shape (b,).

    `traces` (e, looks, b): event functions times their sides, evenly spaced over the step: all but
    the first are above zero where nothing happened. No parabola through three of them may dip below
    zero either.
    """
    before, halfway, after = traces[:, :-2], traces[:, 1:-1], traces[:, 2:]
    bend = before + after - 2 * halfway
    climb = after - before
    level = (climb * climb <= 8 * bend * halfway) | (np.abs(climb) >= 2 * bend)
    # Not calm where a value is not a number.
    calm: NDArray[np.bool_] = level.all(axis=(0, 1)) & (traces[:, 1:].min(axis=(0, 1)) >= 0)
    return calm


#: What is allowed of a state's own size besides the tolerance in newtons: its rounding.
RELATIVE = 1e-12


#: RODAS4P2, all lanes at once; and scipy's, a lane after the other: RK45 of Dormand and Prince (J.
#: Comp. Appl. Math. 6 (1980) 19-26); LSODA, Petzold's (SIAM J. Sci. Stat. Comput. 4 (1983)
#: 136-148), which changes between Adams' and Gear's methods; and Radau IIA of order 5 (Hairer and
#: Wanner, section IV.8), for the stiffest contacts.
SolverName = Literal["Rosenbrock", "RK45", "LSODA", "Radau"]


@dataclass(frozen=True)
class Solver:
    """A method that chooses its steps."""

    method: SolverName
    #: Error allowed in one step, newtons: for each state, `tolerance` times the system's scale.
    tolerance: float = 1e-4
    #: Longest step, s. What the hand does for a shorter time cannot be overlooked.
    longest: float = 0.01
    max_steps: int = 1_000_000  # steps one lane may take, rejected ones included


@dataclass(frozen=True)
class Solution:
    #: (n, s, b), at the sample times; where a sample time is that of a jump, the state before it.
    states: Real
    events: tuple[tuple[Event, ...], ...]  # length b, what happened in each lane, in order of time
    steps: NDArray[np.intp]  # (b,), steps tried in each lane, rejected ones included


class SolutionBuilder:
    """The solution while it comes into being.

    `start` (s, b); `times` (n,).
    """

    def __init__(self, start: Real, times: Real) -> None:
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
        events = tuple(tuple(happened) for happened in self.events)
        return Solution(self.states, events, self.steps)

    def add_events(self, lane: int, time: float, kinds: tuple[str, ...]) -> None:
        """Note events of one instant."""
        happened = self.events[lane]
        happened.extend(Event(time, kind) for kind in kinds)
        if len(happened) > 100 and time - happened[-100].time < 1e-6:
            among = " and ".join(f"'{kind}'" for kind in sorted({e.kind for e in happened[-100:]}))
            raise unresolved(
                lane, time, f"{among} follow each other without end", "raise the damping there"
            )

    def count_steps(self, lane: int, time: float, steps: int, budget: int) -> None:
        """Count the steps tried in a lane."""
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


#: Steps between two reports of progress.
_WINDOW = 256


def integrating_with_scipy(
    system: Mechanics, solver: Solver, builder: SolutionBuilder
) -> Iterator[Progress]:
    """Integrate with scipy, a lane after the other."""
    for lane in range(system.lanes):
        integrator = _LaneIntegrator(system.lane(lane), lane, builder, solver)
        while not integrator.finished:
            integrator.advance()
            yield builder.progress()


class _LaneIntegrator:
    """One lane on its way through time."""

    def __init__(
        self, system: Mechanics, lane: int, builder: SolutionBuilder, solver: Solver
    ) -> None:
        self.system = system
        self.lane = lane
        self.builder = builder
        self.solver = solver
        self.watch = EventLocator(system)
        self.end = float(builder.times[-1])
        self.tolerances = solver.tolerance * system.scales[:, 0]
        self.finished = False
        #: Whether all rates have been finite.
        self.sound = True
        state = builder.states[0, :, lane].copy()
        self.sides = np.sign(system.watched(builder.times[:1], state[:, None])[:, 0])
        self._start(float(builder.times[0]), state)

    def advance(self) -> None:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            # What scipy warns of ends in a failed step, which is refused.
            warnings.simplefilter("ignore")
            for _ in range(_WINDOW):
                self._step()
                if self.finished:
                    return

    def _start(self, time: float, state: Real) -> None:
        """Start the method afresh, unless it is at the end."""
        if self.finished:
            return
        try:
            self.method = getattr(scipy.integrate, self.solver.method)(
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
            raise self._failed_step(time) from None

    def _rates(self, time: float, state: Real) -> Real:
        """The rates of one state (s,) or several (s, n)."""
        columns = state.reshape(len(state), -1)
        rates = self.system.rates(np.full(columns.shape[1], time), columns)
        self.sound &= bool(np.isfinite(rates).all())
        return rates.reshape(state.shape)

    def _step(self) -> None:
        """One step, ended at the first event in it."""
        method = self.method
        began = float(method.t)
        self.builder.count_steps(self.lane, began, 1, self.solver.max_steps)
        try:
            method.step()
        except ValueError:
            # scipy's linear algebra refuses what follows from rates that are not finite.
            if self.sound:
                raise
            raise self._failed_step(began) from None
        if method.status == "failed" or not np.isfinite(method.y).all():
            raise self._failed_step(began)
        after, within = float(method.t), method.dense_output()
        passage = self._passage(began, after, within)
        self.sides = passage.sides
        if passage.happened:
            after = began + passage.share * (after - began)
        self.finished = bool(self.end - after <= 8 * np.finfo(float).eps * abs(self.end))
        self._sample(after, within)
        if passage.happened:
            self._start(after, self._state_after(after, within(after), passage))

    def _passage(self, began: float, after: float, within: DenseOutput) -> StepEvents:
        """How the event functions pass through a step."""
        if not len(self.sides):
            return StepEvents(1.0, self.sides, ())

        def path(shares: Real) -> tuple[Real, Real]:
            times = began + shares * (after - began)
            return times, within(times)

        try:
            return self.watch.first(self.system, path, after - began, self.sides)
        except FloatingPointError:
            raise self._failed_step(began) from None

    def _sample(self, after: float, within: DenseOutput) -> None:
        """The states at the sample times that were passed in a step."""
        builder, lane = self.builder, self.lane
        first = builder.filled[lane]
        last = len(builder.times)
        if not self.finished:
            last = int(np.searchsorted(builder.times, after, "right"))
        if last > first:
            builder.states[first:last, :, lane] = within(builder.times[first:last]).T
            builder.filled[lane] = last

    def _state_after(self, time: float, state: Real, passage: StepEvents) -> Real:
        """The state right after an event."""
        self.builder.add_events(self.lane, time, self.watch.kinds(passage))
        state, _, self.sides = self.watch.after(self.system, passage, time, state)
        return state

    def _failed_step(self, time: float) -> InputError:
        """The refusal of a step that did not succeed."""
        return unresolved(
            self.lane,
            time,
            f"{self.solver.method} finds no step with a finite end",
            "lower the tolerance or the stiffness",
        )


#: The one eigenvalue of the stages: the Jacobian is inverted once a step.
GAMMA = 0.25
#: When the stages are, as shares of the step.
NODES = np.array([0, 0.75, 0.321448134013046, 0.519745732277726, 1, 1])
#: How much of the step's length times the rates' derivative by time each of them sees.
SLOPES = np.array([0.25, -0.5, -0.189532918363016, 0.085612108792769, 0, 0])
#: Which mixture of the stages before leads to each of them. The last but one leads to the solution
#: of order 3, and the last stage is what that of order 4 has more.
STAGES = [np.array(row) for row in (
    [],
    [3],
    [0.906377755268814, -0.189707390391685],
    [3.758617027739064, 1.161741776019525, -0.849258085312803],
    [7.089566927282776, 4.573591406461604, -8.423496976860259, -0.959280113459775],
    [7.089566927282776, 4.573591406461604, -8.423496976860259, -0.959280113459775, 1],
)]  # fmt: skip
#: Which mixture of the stages before, over the step's length, is added to the rates.
COUPLING = [np.array(row) for row in (
    [],
    [-12],
    [-6.354581592719008, 0.338972550544623],
    [-8.575016317114033, -7.606483992117508, 12.22499765012482],
    [-5.888975457523102, -8.157396617841821, 24.805546872612922, 12.790401512796979],
    [-4.408651676063871, -6.692003137674639, 24.625568527593117, 16.627521966636085,
     -5.714285714285718],
)]  # fmt: skip
#: At a share u of the step, the state has grown by u times the whole growth, plus u (1 - u) times
#: (first row plus u times second row of this) @ stages, to order 3.
_WITHIN = np.array([
    [-5.323528268423303, -10.042123754867493, 17.175254928256965, -5.079931171878093,
     -0.016185991706112, 0],
    [6.984505741529879, 6.914061169603662, -0.849178943070653, 18.104410789349338,
     -3.516963011559032, 0],
])  # fmt: skip
_GROWTH = np.append(STAGES[-1], 1.0)
#: The same, sorted by powers of u from the first on.
DENSE = np.stack([_GROWTH + _WITHIN[0], _WITHIN[1] - _WITHIN[0], -_WITHIN[1]])


#: Rounds between two looks at which lanes are finished and which samples are passed.
_ROUNDS = 64
_FIRST_STEP = 1e-6
#: Where in a step the event functions are looked at, besides its start, as shares of it.
_LOOKS = np.array([0.25, 0.5, 0.75, 1.0])
#: A step that ends within this share of itself after an event ends at the event: so near to its
#: end, the states within the step are as good as those at the end.
_NEAR = 0.01


def repeat_lanes(system: Mechanics, times: int) -> Mechanics:
    """A system that takes `times` columns for each lane: all lanes, then all lanes again, ..."""
    if system.lanes == 1:
        return system  # takes any number of columns
    return system.subset(np.tile(np.arange(system.lanes), times))


#: How far a state is moved for a derivative, as a share of itself or, where that is more, of its
#: scale: half of the digits are left to the difference.
_NUDGE = float(np.sqrt(np.finfo(float).eps))


class RosenbrockBatch:
    """The lanes that are not finished yet, with the records of one window of rounds.

    Every step solves linear equations, by RODAS4P2. With J the rates' derivative by the states, f_t
    that by time, and h the step, stage i is

        (1 / (gamma h) - J) u_i = f(t + c_i h, y + sum a_ij u_j) + sum c_ij u_j / h + d_i h f_t

    with the coefficients of RODAS4P2. A spring that is stiff against its mass limits the
    accuracy of a step only as far as it moves; it does not limit its length. All differences that
    make up J and f_t, of all lanes, are taken in one call of the system.
    """

    #: A step's error, and that of the step before, to these powers choose the next step.
    EXPONENT, MEMORY = 0.18, 0.08
    #: Names of the arrays that go with the lanes, their last axis.
    LANEWISE = ("lanes", "time", "step", "memory", "eager", "state", "values", "sides", "heading")

    def __init__(self, system: Mechanics, solver: Solver, builder: SolutionBuilder) -> None:
        self.solver = solver
        self.builder = builder
        self.watch = EventLocator(system)
        self.end = float(builder.times[-1])
        #: Below this a step cannot be told from rounding.
        self.floor = max(1e-13, 8 * np.finfo(float).eps * abs(self.end))
        self.powers = np.arange(1, len(DENSE) + 1)
        self.powers_at_looks = _LOOKS[:, None] ** self.powers
        lanes = system.lanes
        self.lanes: NDArray[np.intp] = np.arange(lanes)
        self.time = np.full(lanes, builder.times[0])
        self.state = builder.states[0].copy()
        self.step = np.full(lanes, min(_FIRST_STEP, solver.longest))
        self.memory = np.full(lanes, 1e-4**self.MEMORY)
        self.eager = np.ones(lanes, bool)
        # A copy: an event function may be a state.
        self.values = system.watched(self.time, self.state).copy()
        self.sides = np.sign(self.values)
        #: Where each state went in the last step: a nudge that way meets no contact left behind.
        self.heading = np.ones(self.state.shape)
        self._arrange(system)

    def run(self) -> Iterator[Progress]:
        while self.lanes.size:
            self._advance()
            yield self.builder.progress()
            self._drop_finished()

    def _arrange(self, system: Mechanics) -> None:
        """Make room for the lanes of `system`."""
        shape = count, lanes = self.state.shape
        self.system = system
        self.looking = repeat_lanes(system, len(_LOOKS))
        self.alone: dict[int, Mechanics] = {}
        self.trial = np.empty(shape)
        self.undecided = bool((self.sides == 0).any())
        self.growth = np.empty((_ROUNDS, len(DENSE), *shape))
        self.before = np.empty((_ROUNDS, *shape))
        self.starts = np.empty((_ROUNDS, lanes))
        self.lengths = np.empty((_ROUNDS, lanes))
        self.ended = np.empty((_ROUNDS, lanes))
        self.stages = np.empty((len(NODES), count, lanes))
        self.flat = self.stages.reshape(len(NODES), -1)
        self.varied = repeat_lanes(system, count + 2)
        self.back = np.empty((lanes, count, count))
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
            while rounds < _ROUNDS and self._round(rounds):
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
        self.starts[slot] = self.time
        self.lengths[slot] = length
        self.ended[slot] = np.where(good, after, -np.inf)
        np.copyto(self.heading, self.trial - self.state, where=good)
        np.copyto(self.state, self.trial, where=good)
        np.copyto(self.time, after, where=good)
        for lane, passage in passages.items():
            self._add_events(lane, passage, slot)
        return True

    def _try(self, length: Real, growth: Real) -> tuple[Real, Real]:
        """Try a step of `length` (b,) in every lane.

        Returns the times after it and each state's error (s, b). Fills the trial state, and
        `growth` (p, s, b) with the coefficients of the powers of the share of the step.
        """
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
        after: Real = times[-1]
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
        dof = self.system.dof
        change = (rates[dof:, 2:] - self.first[dof:, None]) / nudges
        self.slope = np.ascontiguousarray(change.transpose(2, 0, 1))

    def _invert(self, reach: Real) -> None:
        """The inverse of ``1 / reach - J``, reach being gamma h.

        A position's rate is a velocity: ``u_q = reach (right_q + u_v)`` is put into the other
        equations, which are about half of all.
        """
        dof, share, back = self.system.dof, reach[:, None, None], self.back
        diagonal = np.arange(len(self.state))
        positions, inner = diagonal[:dof], diagonal[: len(self.state) - dof]
        carry = self.slope[:, :, :dof] * share
        matrix = -self.slope[:, :, dof:]
        matrix[:, :, :dof] -= carry
        matrix[:, inner, inner] += 1 / share[:, 0]
        right = np.zeros((len(reach), len(inner), len(self.state)))
        right[:, inner, inner + dof] = 1.0
        right[:, :, :dof] = carry
        back[:, dof:] = _inverse(matrix) @ right
        back[:, :dof] = back[:, dof : 2 * dof] * share
        back[:, positions, positions] += share[:, 0]

    def _choose_steps(self, error: Real, good: NDArray[np.bool_]) -> None:
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
        self, slot: int, length: Real, after: Real, good: NDArray[np.bool_]
    ) -> dict[int, StepEvents]:
        """The lanes whose step ends at an event; longer steps into an event are to be retried."""
        count, lanes = self.state.shape
        grown = self.powers_at_looks @ self.growth[slot].reshape(len(self.powers), -1)
        states = self.state[:, None] + grown.reshape(-1, count, lanes).transpose(1, 0, 2)
        states[:, -1] = self.trial
        times = self.time + np.multiply.outer(_LOOKS, length)
        times[-1] = after
        watched = self.looking.watched(times.ravel(), states.reshape(count, -1))
        values = watched.reshape(-1, len(_LOOKS), lanes)
        traces = np.concatenate([self.values[:, None], values], axis=1) * self.sides[:, None]
        busy = ~calm_lanes(traces) & (length > 0)
        passages: dict[int, StepEvents] = {}
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

    def _approach(self, lane: int, traces: Real, length: float) -> None:
        """Aim a rejected step to just before the first event function that it took across zero.

        Where the rates jump at an event, no step across it is accepted unless it is very short.
        """
        event, look = np.nonzero((traces[:, 1:] < 0) & (traces[:, :-1] >= 0))
        if len(event):
            before, after = traces[event, look], traces[event, look + 1]
            crossed = (look + before / (before - after)).min() / len(_LOOKS)
            if crossed * length > CLOSE:
                self.step[lane] = (1 - _NEAR) * crossed * length

    def _first(self, lane: int, slot: int, length: float) -> StepEvents:
        """How a lane's event functions pass through its trial step."""
        began, state = self.time[lane], self.state[:, lane, None]
        growth = self.growth[slot, :, :, lane]

        def path(shares: Real) -> tuple[Real, Real]:
            powers = shares ** self.powers[:, None]
            return began + shares * length, state + growth.T @ powers

        try:
            return self.watch.first(self._alone(lane), path, length, self.sides[:, lane].copy())
        except FloatingPointError as error:
            raise unresolved(
                int(self.lanes[lane]), began, str(error), "look at the scene's numbers"
            ) from None

    def _add_events(self, lane: int, passage: StepEvents, slot: int) -> None:
        """End a lane's step at an event and start afresh from there."""
        number = int(self.lanes[lane])
        began, length = self.starts[slot, lane], self.lengths[slot, lane]
        time = float(began + passage.share * length)
        growth = self.growth[slot, :, :, lane]
        state = self.before[slot, :, lane] + passage.share**self.powers @ growth
        self.builder.add_events(number, time, self.watch.kinds(passage))
        alone = self._alone(lane)
        after = self.watch.after(alone, passage, time, state)
        self.state[:, lane], self.values[:, lane], self.sides[:, lane] = after
        self.ended[slot, lane] = self.time[lane] = time

    def _alone(self, lane: int) -> Mechanics:
        """A lane as a system of its own, made once."""
        if lane not in self.alone:
            self.alone[lane] = self.system.lane(lane)
        return self.alone[lane]

    def _sample(self, rounds: int) -> None:
        """The states at the sample times that were passed in a window."""
        builder = self.builder
        for lane, number in enumerate(self.lanes):
            tried = int(np.count_nonzero(self.lengths[:rounds, lane]))
            builder.count_steps(int(number), self.time[lane], tried, self.solver.max_steps)
            done = np.flatnonzero(self.ended[:rounds, lane] > -np.inf)
            if not len(done):
                continue
            ended = self.ended[done, lane]
            first, last = builder.filled[number], len(builder.times)
            if self.end - ended[-1] >= self.floor:
                last = int(np.searchsorted(builder.times, ended[-1], "right"))
            sample_times = builder.times[first:last]
            slot = done[np.minimum(np.searchsorted(ended, sample_times), len(done) - 1)]
            shares = (sample_times - self.starts[slot, lane]) / self.lengths[slot, lane]
            growth = self.growth[slot, :, :, lane]
            builder.states[first:last, :, number] = self.before[slot, :, lane] + np.einsum(
                "nps,np->ns", growth, shares[:, None] ** self.powers
            )
            builder.filled[number] = last

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


def _inverse(matrices: Real) -> Real:
    """Inverses (b, n, n); not numbers where a matrix has none, so that the step is rejected."""
    try:
        return np.asarray(np.linalg.inv(matrices), np.float64)
    except np.linalg.LinAlgError:
        matrices[np.linalg.slogdet(matrices)[0] == 0] = np.nan
        return np.asarray(np.linalg.inv(matrices), np.float64)


def integrate(system: Mechanics, start: Real, times: Real, solver: Solver) -> Solution:
    """Follow the motion of every lane and locate its events.

    `start` (s, b): states at the first sample time; `times` (n,): sample times, evenly spaced, s.
    """
    return finish(integrating(system, start, times, solver))


def integrating(
    system: Mechanics, start: Real, times: Real, solver: Solver
) -> Generator[Progress, None, Solution]:
    """As :func:`integrate`, as a job whose progress counts the samples of all lanes."""
    builder = SolutionBuilder(start, times)
    if solver.method == "Rosenbrock":
        yield from RosenbrockBatch(system, solver, builder).run()
    else:
        yield from integrating_with_scipy(system, solver, builder)
    return builder.solution()
