"""Solvers against closed forms: order, accuracy, independence of the lanes, energy."""

import numpy as np
import pytest
from simulation.mechanisms import Ball, Oscillator, driven, errors

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.simulation.solvers import (
    Explicit,
    Lsoda,
    Radau,
    Rosenbrock,
    integrate,
    integrating,
)

ALL = [Explicit(1e-7), Lsoda(1e-6), Radau(1e-5), Rosenbrock(1e-6)]
NAMES = ["RK45", "LSODA", "Radau", "Rosenbrock"]


@pytest.mark.parametrize("solver", ALL, ids=NAMES)
def test_a_driven_and_damped_oscillator_moves_as_its_closed_form_says(solver):
    system, start = driven()
    assert errors(system, start, np.linspace(0, 0.3, 301), solver).max() < 1e-4


@pytest.mark.parametrize("kind", [Explicit, Lsoda, Radau, Rosenbrock])
def test_the_error_falls_with_the_tolerance_and_stays_near_it(kind):
    system, start = driven()
    found = [
        errors(system, start, np.linspace(0, 0.3, 301), kind(tolerance)).max()
        for tolerance in (1e-2, 1e-4, 1e-6)
    ]
    assert found[0] > 5 * found[1] > 25 * found[2]
    assert found[2] < 1e-4


@pytest.mark.parametrize(("solver", "rounding"), [(ALL[2], 0.0), (ALL[3], 1e-8)])
def test_lanes_do_not_feel_each_other(solver, rounding):
    k = np.array([1e2, 1e3, 1e6, 1e4, 3e5, 1e1, 2e3])
    system = Ball(m=[0.1, 1e-3, 0.02, 10.0, 0.3, 1e-2, 0.05], k=k, c=0.02 * np.sqrt(k))
    start = np.array([[1e-4] * 7, np.linspace(-0.2, 0, 7)])
    times = np.linspace(0, 0.02, 41)
    together = integrate(system, start, times, solver)
    for lane in range(7):
        alone = integrate(system.lane(lane), start[:, [lane]], times, solver)
        scale = np.abs(alone.states).max(axis=0)
        difference = np.abs(together.states[..., [lane]] - alone.states)
        assert (difference <= rounding * scale).all()
        assert together.steps[lane] == pytest.approx(alone.steps[0], rel=0.01)
        assert [event.kind for event in together.events[lane]] == [
            event.kind for event in alone.events[0]
        ]


def test_soft_lanes_take_few_steps_beside_a_stiff_one_and_are_left_out_when_finished():
    sizes = []

    class Counted(Oscillator):
        def rates(self, times, states):
            sizes.append(states.shape[1])
            return super().rates(times, states)

    system = Counted(m=0.01, k=[1e2, 1e2, 1e2, 1e6])
    start = np.array([[1e-3] * 4, [0.0] * 4])
    steps = integrate(system, start, np.linspace(0, 0.05, 11), Rosenbrock()).steps
    assert (steps[:3] < 60).all()
    assert steps[3] > 500
    # A look at the derivatives takes four columns of each lane.
    assert sizes.count(4 * 4) < 130
    assert sizes.count(4 * 1) > 400


@pytest.mark.parametrize("solver", ALL, ids=NAMES)
def test_the_job_tells_how_many_samples_there_are_and_gives_the_same(solver):
    system, start = driven()
    times = np.linspace(0, 0.05, 201)
    seen = []
    result = finish(integrating(system, start, times, solver), seen.append)
    done = [progress.done for progress in seen]
    assert done == sorted(done)
    assert len(done) > 1
    assert {progress.total for progress in seen} == {2 * 201}
    assert np.array_equal(result.states, integrate(system, start, times, solver).states)
    assert np.array_equal(result.states[0], start)


@pytest.mark.parametrize("solver", ALL, ids=NAMES)
def test_time_need_not_start_at_zero(solver):
    system, start = driven()
    system.push *= 0
    times = np.linspace(0, 0.05, 26)
    early, late = (integrate(system, start, times + t, solver) for t in (0.0, 7.0))
    assert np.abs(early.states - late.states)[:, 0].max() < 1e-8


def test_the_settings_and_the_start_are_looked_at():
    with pytest.raises(InputError, match=r"Explicit.tolerance must be finite and above zero"):
        Explicit(0.0)
    with pytest.raises(InputError, match=r"Rosenbrock.longest must be finite and above zero"):
        Rosenbrock(longest=float("inf"))
    system, start = driven()
    times = np.linspace(0, 1, 5)
    with pytest.raises(InputError, match=r"numbers of shape \(2, 2\), not of shape \(2,\)"):
        integrate(system, start[0], times, Explicit())
    start[1, 1] = np.nan
    with pytest.raises(InputError, match="The start of demonstration 2 is not finite"):
        integrate(system, start, times, Explicit())
    for wrong in (np.zeros(1), np.array([0, 1, 3.0]), np.array([1, 0.5, 0]), np.array([0, np.nan])):
        with pytest.raises(InputError, match="two or more, evenly spaced"):
            integrate(system, np.zeros((2, 2)), wrong, Explicit())
