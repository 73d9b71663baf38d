"""Error against run time of the solvers of the contact mechanics."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.measure.contact_cases import Case, Problem, contact_cases
from forcelab.measure.rows import Judgement, Row, Table, timed_row, with_front
from forcelab.measure.timing import Method, Timed, timed_methods
from forcelab.simulation.solvers import (
    Explicit,
    Lsoda,
    Radau,
    Rosenbrock,
    Solution,
    Solver,
    integrate,
)
from forcelab.simulation.system import Array
from forcelab.text import counted

__all__ = ["REFERENCES", "SETTINGS", "Setting", "measuring", "tabulate"]


@dataclass(frozen=True)
class Setting:
    """A solver with its step or tolerance in words."""

    name: str
    setting: str
    solver: Solver


def _settings(
    name: str, what: str, unit: str, scale: float, make: Callable[[float], Solver], *values: float
) -> tuple[Setting, ...]:
    """One solver with several steps or tolerances, given in `unit`."""
    return tuple(Setting(name, f"{what} {v:g} {unit}", make(v * scale)) for v in values)


#: What is measured, from the coarsest to the finest of each solver.
SETTINGS: tuple[Setting, ...] = (
    *_settings("RK45", "tolerance", "mN", 1e-3, Explicit, 10, 1, 0.1),
    *_settings("Rosenbrock", "tolerance", "mN", 1e-3, Rosenbrock, 10, 1, 0.3, 0.1),
    *_settings("LSODA", "tolerance", "mN", 1e-3, Lsoda, 10, 1, 0.1),
    *_settings("Radau", "tolerance", "mN", 1e-3, Radau, 10, 1, 0.1),
)
#: Two methods of different kind, two decades tighter than anything that is measured.
REFERENCES: tuple[Setting, Setting] = (
    Setting("Radau", "tolerance 1 uN", Radau(1e-6)),
    Setting("LSODA", "tolerance 1 uN", Lsoda(1e-6)),
)


@dataclass(frozen=True)
class _Reference:
    """The forces of a case as well as they are known, or why they are not.

    `accuracy` is the distance, in N rms, between two independent methods.
    """

    words: str
    forces: Array
    accuracy: float
    refusal: str = ""


def tabulate(*, quick: bool = False) -> Generator[Progress, None, Table]:
    """Measure all solvers on all cases: four lanes, five times; that takes half an hour.

    With `quick` one lane, three times, without the finest setting of each solver: some minutes.
    """
    lanes, repetitions, settings = 4, 5, SETTINGS
    if quick:
        finest = {setting.name: setting for setting in SETTINGS}
        lanes, repetitions = 1, 3
        settings = tuple(s for s in SETTINGS if s != finest[s.name])
    rows = yield from measuring(contact_cases(lanes), settings, repetitions)
    return Table("Contact mechanics", "error (N rms)", "CPU s per simulated s", rows)


def measuring(
    cases: Sequence[Case],
    settings: Sequence[Setting],
    repetitions: int,
    references: tuple[Setting, Setting] = REFERENCES,
) -> Generator[Progress, None, tuple[Row, ...]]:
    """Measure solvers on cases, all in one run with interleaved repetitions.

    The error of a solution is the root of the mean square over time of a force's difference from
    the reference, of whichever force of whichever lane is worst; never less than the accuracy of
    the reference, which is how far two independent methods are apart in the same measure.

    Parameters
    ----------
    cases : sequence of Case
    settings : sequence of Setting
        Solvers with their steps and tolerances.
    repetitions : int
        Of each, at least 1.
    references : tuple of two Setting
        Methods of different kind, much tighter than `settings`; errors are told from the first.

    Returns
    -------
    tuple of Row
        Case by case, in the order of `settings`. A solver that refuses has its sentence instead
        of numbers; where no reference can be had, all solvers of the case have that sentence.
    """
    problems = []
    for i, case in enumerate(cases):
        yield Progress(i, len(cases), f"{case.name}, reference")
        problem = case.make()
        problems.append((case, problem, _reference(problem, references)))
    known = [known for known in problems if not known[2].refusal]
    methods = [
        Method(
            f"{case.name}, {setting.name}, {setting.setting}",
            partial(_solved, problem, setting.solver),
            partial(_judged, problem, reference),
        )
        for case, problem, reference in known
        for setting in settings
    ]
    timed = iter((yield from timed_methods(methods, repetitions)))
    rows = []
    for case, problem, reference in problems:
        for setting in settings:
            found = Timed(None, refusal=reference.refusal) if reference.refusal else next(timed)
            rows.append(_row(case, problem, reference, setting, found))
    return with_front(rows)


def _reference(problem: Problem, references: tuple[Setting, Setting]) -> _Reference:
    """Solve a problem by two tight methods."""
    first, second = (f"{each.name}, {each.setting}" for each in references)
    try:
        one, other = (_forces(problem, _solved(problem, each.solver)) for each in references)
    except InputError as error:
        return _Reference(first, np.zeros(0), 0.0, f"There is no reference: {error}")
    apart = _rms(one - other)
    return _Reference(f"{first}; {second}, differs by {apart:.1e} N rms", one, apart)


def _solved(problem: Problem, solver: Solver) -> Solution:
    """A problem's solution."""
    return integrate(problem.system, problem.start, problem.times, solver)


def _forces(problem: Problem, solution: Solution) -> Array:
    """The forces of a solution; one that has run away is refused.

    Raises
    ------
    InputError
        If a force is not finite.
    """
    forces = problem.forces(problem.times, solution.states)
    if not np.isfinite(forces).all():
        raise InputError("The forces are not finite; a smaller step or tolerance is needed.")
    return forces


def _rms(differences: Array) -> float:
    """The largest root mean square over time of any force of any lane."""
    return float(np.sqrt((differences**2).mean(axis=0)).max())


def _judged(problem: Problem, reference: _Reference, solution: Solution) -> Judgement:
    """The error of a solution, rms and at its largest, N."""
    differences = _forces(problem, solution) - reference.forces
    error = max(_rms(differences), reference.accuracy)
    return error, {"largest (N)": float(np.abs(differences).max())}


def _row(
    case: Case, problem: Problem, reference: _Reference, setting: Setting, timed: Timed[Judgement]
) -> Row:
    """A solver's row."""
    lanes, seconds = problem.system.lanes, problem.simulated
    size = f"{case.name}, {counted(lanes, 'lane')} x {seconds / lanes:g} s"
    return timed_row(setting.name, setting.setting, size, reference.words, timed, 1 / seconds)
