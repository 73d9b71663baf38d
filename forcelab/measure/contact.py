"""Error against run time of the solvers of the contact mechanics.

Solvers are measured on four contacts: soft, hard, sticking and slipping, snapping. Each is a second
of several lanes whose stiffness, mass and timing differ, and has the events that make its forces
hard to follow. They are scenes of their own, apart from the tasks' choreographies, so that the
table stays the same when those change.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from forcelab.arrays import Real
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.measure.rows import Judgement, Row, Table, timed_row, with_front
from forcelab.measure.timing import Method, Timed, timed_methods
from forcelab.simulation.hand import KNOT_STEP, Trajectory, minimum_jerk, tremor
from forcelab.simulation.mechanics import Layout, Mechanics
from forcelab.simulation.scene import Arm, Body, Ground, Holder, Jaws, Scene, Socket
from forcelab.simulation.solvers import Solution, Solver, SolverName, integrate
from forcelab.text import counted

DURATION = 1.0
#: Samples a second at which forces are compared.
RATE = 4000.0
#: How far jaws stand off the body at first, and the amplitude of the hand's tremor, m.
OPEN = 3e-3
TREMOR = 5e-5


@dataclass(frozen=True)
class Problem:
    system: Mechanics
    start: Real  # (s, b), states at the first time
    times: Real  # (n,), at which the forces are compared, s, evenly spaced, n >= 2
    #: From `times` and states of shape (n, s, b) to forces of shape (n, c, b), N.
    forces: Callable[[Real, Real], Real]

    @property
    def simulated(self) -> float:
        """Simulated seconds, all lanes together."""
        return float(self.times[-1] - self.times[0]) * self.system.lanes


@dataclass(frozen=True)
class Case:
    """A problem with a name; it is made when it is measured."""

    name: str  # such as ``"foam"``
    make: Callable[[], Problem]  # gives the :class:`Problem`


#: Reaches of the hand, each with its start and duration in seconds and how far it goes in m.
Reaches = tuple[tuple[float, float, float], ...]


def contact_cases(lanes: int) -> tuple[Case, ...]:
    """The four cases, each with so many lanes."""
    cases = (("foam", _foam), ("cartridge", _cartridge), ("stick-slip", _tugs), ("snap", _snap))
    return tuple(Case(name, partial(make, lanes)) for name, make in cases)


def _problem(
    lanes: int,
    scene: Scene,
    reaches: Mapping[str, Reaches],
    start: Mapping[str, float] | None = None,
) -> Problem:
    """Lanes of a scene, moved by minimum-jerk reaches and tremor.

    `scene`: stiffness and mass of the body vary from lane to lane, and so does the timing;
    `reaches`: of what the hand drives: ``"jaw"`` (both, how far they close), ``"tongs z"`` and so
    on; `start`: states other than zero at the start. What the hand drives starts where it is
    commanded.
    """
    rng = np.random.default_rng(1)
    factors = np.geomspace(0.8, 1.25, lanes)
    delays = rng.permutation(np.linspace(0.0, 0.02, lanes))
    scenes, values = [], []
    layout = Layout.of(scene)
    for factor, late in zip(factors, delays, strict=True):
        stiffness, mass = scene.body.stiffness * factor, scene.body.mass / factor
        scenes.append(replace(scene, body=replace(scene.body, stiffness=stiffness, mass=mass)))
        values.append(_hand(layout, scene.body.half_width, reaches, late, rng))
    system = Mechanics(scenes, Trajectory.through(values))
    initial = np.zeros((len(system.names), lanes))
    for row in range(len(layout.driven)):
        initial[row] = [value[0, row] for value in values]
    for name, value in (start or {}).items():
        initial[system.names.index(name)] = value
    alone = [system.lane(lane) for lane in range(lanes)]

    def forces(times: Real, states: Real) -> Real:
        return np.stack(
            [lane.sensor_forces(times, states[:, :, i].T).T for i, lane in enumerate(alone)], axis=2
        )

    times = np.arange(round(DURATION * RATE) + 1) / RATE
    return Problem(system, initial, times, forces)


def _hand(
    layout: Layout,
    half_width: float,
    reaches: Mapping[str, Reaches],
    late: float,
    rng: np.random.Generator,
) -> Real:
    """What the hand commands at the knots, everything `late` seconds later, without any tap."""
    knots = np.arange(0.0, DURATION + KNOT_STEP / 2, KNOT_STEP)
    columns = []
    for name in layout.driven:
        jaw = name.endswith("jaw")
        column = TREMOR * tremor(knots, rng) + (half_width + OPEN if jaw else 0.0)
        for begin, duration, far in reaches.get("jaw" if jaw else name, ()):
            # Jaws are told by their distance from the middle: to close is to come nearer.
            column += (-far if jaw else far) * minimum_jerk(knots, begin + late, duration)
        columns.append(column)
    return np.stack([*columns, np.zeros_like(knots)], axis=1)


def _foam(lanes: int) -> Problem:
    """A soft block is gripped, lifted, set down and let go."""
    body = Body("block", mass=0.012, half_width=0.02, stiffness=500.0)
    scene = Scene("foam", Jaws(), body, arm=Arm(), ground=Ground())
    jaw = ((0.03, 0.27, OPEN + 0.014), (0.78, 0.2, -OPEN - 0.014))
    return _problem(
        lanes, scene, {"jaw": jaw, "tongs z": ((0.3, 0.25, 0.03), (0.55, 0.23, -0.031))}
    )


def _cartridge(lanes: int) -> Problem:
    """A hard and heavy cartridge is gripped, lifted and set down hard; the grip stays."""
    body = Body("cartridge", mass=0.06, half_width=0.009, stiffness=1e5)
    scene = Scene("cartridge", Jaws(), body, arm=Arm(), ground=Ground())
    jaw = ((0.03, 0.2, OPEN + 0.01),)
    return _problem(lanes, scene, {"jaw": jaw, "tongs z": ((0.25, 0.25, 0.03), (0.6, 0.2, -0.034))})


def _tugs(lanes: int) -> Problem:
    """Jaws are pulled along a body that is held fast, in tugs between which they stick."""
    body = Body("stylus", mass=0.015, half_width=0.006, stiffness=3e4)
    scene = Scene("stylus", Jaws(), body, arm=Arm(stiffness=2500.0), holder=Holder())
    tugs = tuple((begin, 0.1, 0.006) for begin in (0.25, 0.42, 0.59, 0.76))
    return _problem(lanes, scene, {"jaw": ((0.03, 0.2, OPEN + 0.004),), "tongs z": tugs})


def _snap(lanes: int) -> Problem:
    """A brick is pulled out of its socket and pushed in again until it clicks."""
    body = Body("brick", mass=0.012, half_width=0.008, stiffness=6e4)
    socket = Socket(
        place=0.0, depth=2e-3, friction=3.0, snap=5.0, snap_depth=1.2e-3, snap_width=4e-4
    )
    arm = Arm(axes=("y", "z"))
    scene = Scene("LEGO", Jaws(), body, arm=arm, ground=Ground(), socket=socket)
    reaches = {
        "jaw": ((0.03, 0.17, OPEN + 0.012),),
        "tongs z": ((0.2, 0.25, 0.02), (0.5, 0.35, -0.045)),
    }
    return _problem(lanes, scene, reaches, {"body z": -socket.depth, "in the socket": 1.0})


@dataclass(frozen=True)
class Setting:
    """A solver with its tolerance in words."""

    words: str
    solver: Solver


def _settings(method: SolverName, *tolerances: float) -> tuple[Setting, ...]:
    """One solver with several tolerances, mN."""
    return tuple(Setting(f"tolerance {t:g} mN", Solver(method, t * 1e-3)) for t in tolerances)


#: What is measured, from the coarsest to the finest of each solver.
SETTINGS: tuple[Setting, ...] = (
    *_settings("RK45", 10, 1, 0.1),
    *_settings("Rosenbrock", 10, 1, 0.3, 0.1),
    *_settings("LSODA", 10, 1, 0.1),
    *_settings("Radau", 10, 1, 0.1),
)
#: Two methods of different kind, two decades tighter than anything that is measured.
REFERENCES: tuple[Setting, Setting] = (
    Setting("tolerance 1 uN", Solver("Radau", 1e-6)),
    Setting("tolerance 1 uN", Solver("LSODA", 1e-6)),
)


@dataclass(frozen=True)
class _Reference:
    """The forces of a case as well as they are known, or why they are not."""

    words: str
    forces: Real
    accuracy: float  # the distance of two independent methods, N rms
    refusal: str = ""


def tabulate(*, quick: bool = False) -> Generator[Progress, None, Table]:
    """Measure all solvers on all cases: four lanes, five times; that takes half an hour.

    With `quick` one lane, three times, without the finest setting of each solver: some minutes.
    """
    lanes, repetitions, settings = 4, 5, SETTINGS
    if quick:
        finest = {setting.solver.method: setting for setting in SETTINGS}
        lanes, repetitions = 1, 3
        settings = tuple(s for s in SETTINGS if s != finest[s.solver.method])
    rows = yield from measure_solvers(contact_cases(lanes), settings, repetitions)
    return Table("Contact mechanics", "error (N rms)", "CPU s per simulated s", rows)


def measure_solvers(
    cases: Sequence[Case],
    settings: Sequence[Setting],
    repetitions: int,
    references: tuple[Setting, Setting] = REFERENCES,
) -> Generator[Progress, None, tuple[Row, ...]]:
    """Measure solvers on cases, all in one run with interleaved repetitions; rows case by case.

    The error of a solution is the root of the mean square over time of a force's difference from
    the first of two `references` (methods of different kind, much tighter than `settings`), of
    whichever force of whichever lane is worst; never less than how far the two references are
    apart in the same measure. A solver that refuses has its sentence instead of numbers; where no
    reference can be had, all solvers of the case have that sentence.
    """
    problems = []
    for i, case in enumerate(cases):
        yield Progress(i, len(cases), f"{case.name}, reference")
        problem = case.make()
        problems.append((case, problem, _reference(problem, references)))
    solvable = [entry for entry in problems if not entry[2].refusal]
    methods = [
        Method(
            f"{case.name}, {setting.solver.method}, {setting.words}",
            partial(_solve, problem, setting.solver),
            partial(_judge, problem, reference),
        )
        for case, problem, reference in solvable
        for setting in settings
    ]
    results = iter((yield from timed_methods(methods, repetitions)))
    rows = []
    for case, problem, reference in problems:
        for setting in settings:
            refused = Timed[Judgement](None, refusal=reference.refusal)
            timed = refused if reference.refusal else next(results)
            rows.append(_row(case, problem, reference, setting, timed))
    return with_front(rows)


def _reference(problem: Problem, references: tuple[Setting, Setting]) -> _Reference:
    """Solve a problem by two tight methods."""
    first, second = (f"{each.solver.method}, {each.words}" for each in references)
    try:
        forces, check = (_forces(problem, _solve(problem, each.solver)) for each in references)
    except InputError as error:
        return _Reference(first, np.zeros(0), 0.0, f"There is no reference: {error}")
    apart = _rms(forces - check)
    return _Reference(f"{first}; {second}, differs by {apart:.1e} N rms", forces, apart)


def _solve(problem: Problem, solver: Solver) -> Solution:
    return integrate(problem.system, problem.start, problem.times, solver)


def _forces(problem: Problem, solution: Solution) -> Real:
    """The forces of a solution; one that has run away is refused."""
    forces = problem.forces(problem.times, solution.states)
    if not np.isfinite(forces).all():
        raise InputError("The forces are not finite; a smaller step or tolerance is needed.")
    return forces


def _rms(differences: Real) -> float:
    """The largest root mean square over time of any force of any lane."""
    return float(np.sqrt((differences**2).mean(axis=0)).max())


def _judge(problem: Problem, reference: _Reference, solution: Solution) -> Judgement:
    """The error of a solution, rms and at its largest, N."""
    differences = _forces(problem, solution) - reference.forces
    error = max(_rms(differences), reference.accuracy)
    return error, {"largest (N)": float(np.abs(differences).max())}


def _row(
    case: Case, problem: Problem, reference: _Reference, setting: Setting, timed: Timed[Judgement]
) -> Row:
    lanes, seconds = problem.system.lanes, problem.simulated
    size = f"{case.name}, {counted(lanes, 'lane')} x {seconds / lanes:g} s"
    return timed_row(
        setting.solver.method, setting.words, size, reference.words, timed, 1 / seconds
    )
