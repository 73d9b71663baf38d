import re
from collections import Counter
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.measure import contact
from forcelab.measure.contact import (
    REFERENCES,
    SETTINGS,
    Case,
    Problem,
    Setting,
    contact_cases,
    measure_solvers,
)
from forcelab.measure.rows import Row
from forcelab.measure.timing import Timed
from forcelab.simulation.solvers import SolverName, integrate
from forcelab.simulation.tasks import SOLVER
from tests.simulation.mechanisms import Oscillator, lsoda, radau, rk45, rosenbrock

TIMES = np.linspace(0.0, 0.1, 51)
SPRINGS = (400.0, 2500.0)


class Broken(Oscillator):
    """Asks for more than any solver can follow."""

    def rates(self, _times, states):
        return states**2 * 1e9 + 1e9


def problem(*springs, system=Oscillator):
    springs_system = system(k=springs)
    start = np.tile([[1.0], [0.0]], springs_system.lanes)

    def forces(times, states):
        return springs_system.k * states[:, :1]

    return Problem(springs_system, start, TIMES, forces)


def case(name="springs", springs=SPRINGS, system=Oscillator):
    return Case(name, lambda: problem(*springs, system=system))


def setting(solver, words="as given"):
    return Setting(words, solver)


FINE = (setting(rk45(1e-6), "tolerance 1 uN"), setting(lsoda(1e-5), "tolerance 10 uN"))
#: Errs by some newtons.
COARSE = rosenbrock(1e3, longest=0.1)


def measured(solvers, *cases, repetitions=1, references=FINE):
    settings = [setting(solver, str(i)) for i, solver in enumerate(solvers)]
    return finish(measure_solvers(cases or (case(),), settings, repetitions, references))


def references_apart(row):
    """How far apart the two references are, as the row says."""
    return float(re.search(r"differs by (\S+) N rms", row.reference)[1])


def closed_form():
    return (np.array(SPRINGS) * np.cos(np.sqrt(SPRINGS) * TIMES[:, None]))[:, None]


@pytest.mark.parametrize(
    "solver", [rk45(1e-2), rosenbrock(1e-2), lsoda(1e-2), radau(1e-2)], ids=repr
)
def test_the_error_is_the_distance_from_the_truth(solver):
    (row,) = measured([solver])
    states = integrate(Oscillator(k=SPRINGS), np.tile([[1.0], [0.0]], 2), TIMES, solver).states
    differences = np.array(SPRINGS) * states[:, :1] - closed_form()
    rms = np.sqrt((differences**2).mean(axis=0)).ravel()
    # Of the two lanes, the worse one counts.
    assert row.error == pytest.approx(rms.max(), rel=1e-3)
    assert rms.min() < 0.8 * rms.max()
    assert row.further == {"largest (N)": pytest.approx(np.abs(differences).max(), rel=1e-3)}


def test_the_reference_says_how_well_it_is_known_itself():
    (row,) = measured([rosenbrock(1e-3)])
    assert row.reference.startswith("RK45, tolerance 1 uN; LSODA, tolerance 10 uN, differs")
    first, second = (
        integrate(Oscillator(k=SPRINGS), np.tile([[1.0], [0.0]], 2), TIMES, s.solver).states
        for s in FINE
    )
    apart = np.sqrt(((np.array(SPRINGS) * (first - second)[:, :1]) ** 2).mean(axis=0)).max()
    assert references_apart(row) == pytest.approx(apart, rel=0.06)
    assert np.abs(np.array(SPRINGS) * first[:, :1] - closed_form()).max() < 1e-4


def test_no_error_is_told_below_what_the_reference_can_see():
    coarse = (setting(radau(1e-3), "coarse"), setting(COARSE, "coarser"))
    (row,) = measured([radau(1e-3)], references=coarse)
    # The very same solution as the reference; but that is off itself.
    assert row.error == pytest.approx(references_apart(row), rel=0.06)
    assert row.error > 1.0
    assert row.further == {"largest (N)": 0.0}


@pytest.mark.parametrize("lanes", [1, 4])
def test_seconds_are_told_per_simulated_second_of_a_lane(monkeypatch, lanes):
    def timed(ways, repetitions):
        yield Progress(0, 1, "")
        return tuple(Timed((0.1, {}), 12.0, 0.4, 1) for _ in ways)

    monkeypatch.setattr(contact, "timed_methods", timed)
    (row,) = measured([rosenbrock(1e-3)], case(springs=(400.0,) * lanes))
    assert row.size == f"springs, {lanes} {'lane' if lanes == 1 else 'lanes'} x 0.1 s"
    assert row.seconds == pytest.approx(12.0 / (0.1 * lanes))
    assert row.spread == pytest.approx(0.4 / (0.1 * lanes))


def test_memory_is_at_least_what_the_result_takes():
    (row,) = measured([rosenbrock(1e-3)])
    assert row.peak_bytes >= TIMES.size * 2 * 2 * 8


def test_a_solver_that_refuses_is_a_row_with_its_sentence():
    stopped = replace(rk45(1e-3), max_steps=3)
    first, refusing, last = measured([rosenbrock(1e-3), stopped, COARSE])
    assert "steps" in refusing.refusal
    assert refusing.refusal.endswith(".")
    assert refusing.point is None
    assert refusing.reference == first.reference
    assert (first.pareto, refusing.pareto, last.pareto) == (True, False, True)


def test_forces_that_are_not_finite_are_refused():
    def forces(times, states):
        # Only the coarse solution is that far off.
        off = np.abs(states[:, :1] - np.cos(20.0 * times)[:, None, None])
        return np.where(off > 5e-4, np.nan, 400.0 * states[:, :1])

    springs_system = problem(400.0)
    away = Case(
        "springs",
        lambda: Problem(springs_system.system, springs_system.start, springs_system.times, forces),
    )
    coarse, fine = measured([COARSE, rosenbrock(1e-3)], away)
    assert "not finite" in coarse.refusal
    assert fine.refusal == ""


def test_a_case_without_a_reference_refuses_all_its_rows_and_no_others():
    bad = case("wild", system=Broken)
    rows = measured([rosenbrock(1e-3), radau(1e-3)], bad, case("tame"))
    assert [row.size.split(",")[0] for row in rows] == ["wild", "wild", "tame", "tame"]
    assert all(row.refusal.startswith("There is no reference: ") for row in rows[:2])
    assert all(row.point for row in rows[2:])


def test_a_measurement_can_be_stopped_at_any_progress():
    job = measure_solvers((case(),), [setting(rosenbrock(1e-3))], 5, FINE)
    texts = [next(job).text for _ in range(3)]
    job.close()
    assert texts == [
        "springs, reference",
        "springs, Rosenbrock, as given, memory",
        "springs, Rosenbrock, as given",
    ]


def test_no_repetition_is_refused():
    with pytest.raises(InputError, match="not 0"):
        measured([rosenbrock(1e-3)], repetitions=0)


@pytest.mark.parametrize(("quick", "lanes", "repetitions"), [(False, 4, 5), (True, 1, 3)])
def test_quick_is_less_of_the_same(monkeypatch, quick, lanes, repetitions):
    request = {}

    def noted(cases, settings, times):
        request.update(lanes={c.make().system.lanes for c in cases}, times=times, settings=settings)
        yield Progress(0, 1, "")
        return (Row("a", "b", "c", "d", refusal="No."),)

    monkeypatch.setattr(contact, "measure_solvers", noted)
    table = finish(contact.tabulate(quick=quick))
    assert (request["lanes"], request["times"]) == ({lanes}, repetitions)
    left_out = [s for s in SETTINGS if s not in request["settings"]]
    finest = {setting.solver.method: setting for setting in SETTINGS}  # the last of each solver
    assert left_out == (list(finest.values()) if quick else [])
    assert "N" in table.error
    assert "CPU s" in table.seconds


def test_every_solver_there_is_is_measured_and_the_tasks_own_setting_too():
    for method in get_args(SolverName):
        assert sum(s.solver.method == method for s in SETTINGS) >= 2
    assert SOLVER in [s.solver for s in SETTINGS]


def test_the_references_are_of_two_kinds_and_two_decades_tighter_than_all_else():
    assert len({r.solver.method for r in REFERENCES}) == 2
    tightest = min(s.solver.tolerance for s in SETTINGS)
    assert all(r.solver.tolerance <= tightest / 99 for r in REFERENCES)


BOTH = ("left jaw", "right jaw")
#: What must happen in each case, and how often at least.
HAPPENINGS = {
    "foam": {
        "body lifted": 1,
        "body set down": 1,
        **{f"{jaw}: contact made": 1 for jaw in BOTH},
        **{f"{jaw}: contact lost": 1 for jaw in BOTH},
    },
    "cartridge": {"body lifted": 1, "body set down": 1},
    "stick-slip": {f"{jaw}: slip {what}": 4 for jaw in BOTH for what in ("begins", "ends")},
    "snap": {"snap out": 1, "out of the socket": 1, "into the socket": 1, "snap in": 1},
}


@pytest.fixture(scope="module")
def cases():
    return {case.name: case.make() for case in contact_cases(1)}


@pytest.mark.parametrize("name", HAPPENINGS)
def test_every_case_has_the_events_that_make_it_hard(cases, name):
    problem = cases[name]
    solution = integrate(problem.system, problem.start, problem.times, lsoda(0.1))
    happened = Counter(event.kind for event in solution.events[0])
    assert all(happened[kind] >= number for kind, number in HAPPENINGS[name].items()), happened
    forces = problem.forces(problem.times, solution.states)
    assert forces.shape == (len(problem.times), 6, 1)
    # The jaws press like fingers do: some newtons, and never pull.
    pressing = -forces[:, [2, 5]]
    assert 3 < pressing.max() < 20
    assert pressing.min() > -0.5


def test_lanes_differ_and_are_the_same_each_time():
    for case, again in zip(contact_cases(3), contact_cases(3), strict=True):
        first, second = case.make(), again.make()
        assert first.system.lanes == 3
        assert first.simulated == pytest.approx(3.0)
        assert (first.start == second.start).all()
        times = np.full(3, 0.4)
        moved = first.system.rates(times, first.start)
        assert (moved == second.system.rates(times, second.start)).all()
        assert len(np.unique(moved, axis=1).T) == 3
