"""From foam to steel and from a grain to a person: right, or refused in one sentence."""

import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from simulation.mechanisms import Ball, Oscillator, Thrown

from forcelab.errors import InputError
from forcelab.simulation.solvers import (
    Explicit,
    Lsoda,
    Radau,
    Rosenbrock,
    integrate,
)

STIFFNESSES = [1e1, 1e3, 1e5, 1e6, 1e8]
MASSES = [1e-6, 1e-4, 1e-2, 1.0, 1e2]
ADAPTIVE = [Explicit(max_steps=1500), Lsoda(1e-5, max_steps=1500), Radau(max_steps=400)]
EVERY = [*ADAPTIVE, Rosenbrock(max_steps=1500)]
DURATION = 1e-3
SENTENCE = re.compile(
    r"The motion of demonstration \d+ cannot be resolved at \S+ s: [^;]+; [^;]+\."
)


def name(solver):
    return type(solver).__name__


@pytest.mark.parametrize("solver", ADAPTIVE, ids=name)
def test_any_stiffness_with_any_mass_is_right_or_refused(solver):
    times = np.linspace(0, DURATION, 21)
    refused = 0
    for number, (k, m) in enumerate(product(STIFFNESSES, MASSES)):
        radians = np.sqrt(k / m) * DURATION
        # Every other one is damped.
        system = Oscillator(m=m, k=k, c=0.2 * (number % 2) * np.sqrt(k * m))
        start = np.array([[1 / k], [0.0]])  # one newton
        try:
            found = integrate(system, start, times, solver).states
        except InputError as error:
            assert SENTENCE.fullmatch(str(error))
            assert radians > 90
            refused += 1
        else:
            error = k * np.abs(found - system.exactly(times, start))[:, 0]
            # Errors of single steps add up over the radians of the motion.
            assert error.max() < 0.01 * (1 + 0.1 * radians)
    assert refused <= 5


class Explosion(Oscillator):
    """x'' = x**2 * k: infinite after a finite time."""

    def force(self, _times, states):
        return self.k * states[0] ** 2


@pytest.mark.parametrize("solver", EVERY, ids=name)
def test_a_motion_that_runs_away_is_refused_where_it_does(solver):
    # x = 6 / (k * (0.1 - t)**2) in the second lane.
    system = Explosion(m=1.0, k=[1e-9, 100.0])
    start = np.array([[6.0, 6.0], [120.0, 120.0]])
    with pytest.raises(InputError) as refused:
        integrate(system, start, np.linspace(0, 0.2, 201), solver)
    assert SENTENCE.fullmatch(str(refused.value))
    time = float(re.search(r"at (\S+) s", str(refused.value))[1])
    assert str(refused.value).startswith("The motion of demonstration 2 ")
    assert time == pytest.approx(0.1, abs=0.015)


@pytest.mark.parametrize("solver", EVERY, ids=name)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_rates_that_are_not_finite_are_refused(solver, value):
    class Broken(Oscillator):
        def force(self, times, states):
            return np.where(times > self.w, value, -self.k * states[0])

    system = Broken(m=1.0, k=10.0, w=[9.0, 0.0101])
    with pytest.raises(InputError) as refused:
        integrate(system, np.ones((2, 2)) * 1e-3, np.linspace(0, 0.02, 21), solver)
    found = re.match(r"The motion of demonstration 2 .* at (\S+) s: ", str(refused.value))
    assert float(found[1]) == pytest.approx(0.0101, abs=2e-3)


@pytest.mark.parametrize("solver", EVERY, ids=name)
def test_a_mistake_in_a_system_is_not_taken_for_a_hard_motion(solver):
    class Wrong(Oscillator):
        def force(self, times, states):
            if times[0] > 0.003:
                raise ValueError("a mistake")
            return super().force(times, states)

    with pytest.raises(ValueError, match="a mistake"):
        integrate(Wrong(), np.ones((2, 1)), np.linspace(0, 0.01, 3), solver)


@pytest.mark.parametrize("solver", EVERY, ids=name)
def test_more_steps_than_allowed_are_refused(solver):
    system = Oscillator(m=1.0, k=[1.0, 1e6])
    with pytest.raises(InputError, match="it took more than 50 steps; .* or allow more steps"):
        integrate(
            system, np.full((2, 2), 0.1), np.linspace(0, 0.1, 3), replace(solver, max_steps=50)
        )


def test_a_motion_faster_than_time_resolves_is_refused():
    # An acceleration that turns round at every instant: no step is short enough.
    class Noise(Thrown):
        def rates(self, times, states):
            return np.stack([states[1], 1e9 * np.sin(1e20 * times)])

    with pytest.raises(InputError, match=r"at \S+ s: the step fell below 1e-13 s"):
        integrate(Noise(), np.array([[1.0], [0.0]]), np.linspace(0, 1, 3), Rosenbrock(1e-9))


@pytest.mark.parametrize("tolerance", [1e-1, 1.0, 10.0])
def test_loose_tolerances_give_numbers_or_refusals_on_a_stiff_drop(tolerance):
    system = Ball(m=[1e-4, 0.05], k=[1e7, 1e5], c=[1.0, 0.1])
    start = np.array([[1e-3, 1e-3], [-1.0, -0.3]])
    for kind in (Explicit, Lsoda, Radau, Rosenbrock):
        try:
            found = integrate(system, start, np.linspace(0, 0.02, 81), kind(tolerance))
        except InputError as error:
            assert SENTENCE.fullmatch(str(error))
        else:
            assert np.isfinite(found.states).all()
