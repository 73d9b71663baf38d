"""From foam to steel and from a grain to a person: right, or refused in one sentence."""

import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from simulation.mechanisms import Ball, Mechanism, Oscillator, Thrown

from forcelab.errors import InputError
from forcelab.simulation.solvers import (
    Explicit,
    Lsoda,
    Radau,
    Rosenbrock,
    SemiImplicit,
    integrate,
)

STIFFNESSES = [1e1, 1e3, 1e5, 1e6, 1e8]
MASSES = [1e-6, 1e-4, 1e-2, 1.0, 1e2]
ADAPTIVE = [Explicit(max_steps=1500), Lsoda(1e-5, max_steps=1500), Radau(max_steps=400)]
EVERY = [*ADAPTIVE, Rosenbrock(max_steps=1500), SemiImplicit()]
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


def test_a_fixed_step_is_right_or_refused_wherever_it_stands():
    times = np.linspace(0, DURATION, 21)
    solver = SemiImplicit(25e-6)
    for k, m in product(STIFFNESSES, MASSES):
        quick = np.sqrt(k / m) * solver.step
        system = Oscillator(m=m, k=k)
        start = np.array([[1 / k], [0.0]])
        if quick > 0.5:
            with pytest.raises(InputError) as refused:
                integrate(system, start, times, solver)
            assert SENTENCE.fullmatch(str(refused.value))
            cure = re.search(r"shorten it below (\S+) s", str(refused.value))
            assert float(cure[1]) == pytest.approx(0.5 / np.sqrt(k / m), rel=0.06)
        else:
            found = integrate(system, start, times, solver).states
            error = k * np.abs(found - system.exactly(times, start))[:, 0].max()
            # First order: half a step late or early.
            assert error < 0.6 * quick + 1e-12


@pytest.mark.parametrize("k", [1e1, 1e4, 1e8])
def test_a_fixed_step_too_long_for_a_contact_is_refused_when_contact_is_made(k):
    # Long at rest in the air: what is too stiff shows only later.
    m = k * (25e-6 / 0.7) ** 2
    system = Ball(m=[1e3 * m, m], k=k, c=0.0)
    start = np.array([[1e-3, 1e-3], [-0.1, -0.1]])
    with pytest.raises(InputError, match="demonstration 2 .* at 0.00") as refused:
        integrate(system, start, np.linspace(0, 0.02, 41), SemiImplicit(25e-6))
    assert "a step of 2.5e-05 s is too long; shorten it below 1.8e-05 s" in str(refused.value)


def test_a_fixed_step_too_long_for_a_damper_is_refused():
    system = Oscillator(m=1e-3, k=10.0, c=50.0)
    with pytest.raises(InputError, match=r"shorten it below 2e-05 s"):
        integrate(system, np.array([[0.0], [1.0]]), np.linspace(0, 0.01, 3), SemiImplicit(25e-6))


def test_a_contact_that_hardens_is_looked_at_again_as_it_hardens():
    class Hertz(Ball):
        def force(self, _times, states):
            depth = np.maximum(-states[0], 0)
            return self.k * depth**1.5

    system = Hertz(m=1e-3, k=3e8)
    start = np.array([[1e-4], [-0.5]])
    right = integrate(system, start, np.linspace(0, 1e-3, 11), SemiImplicit(2e-7)).states
    with pytest.raises(InputError, match="too long"):
        integrate(system, start, np.linspace(0, 1e-3, 11), SemiImplicit(5e-5))
    sharp = integrate(system, start, np.linspace(0, 1e-3, 11), Explicit(1e-6)).states
    assert right == pytest.approx(sharp, abs=2e-3 * 0.5)


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
        integrate(Noise(), np.array([[1.0], [0.0]]), np.linspace(0, 1, 3), Explicit(1e-9))


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


class Stiffening(Mechanism):
    """An oscillator of 1 kg that is stiffer for twenty milliseconds, without any event."""

    def __init__(self, k=1e4, stiff=1e4):
        super().__init__(m=1.0, k=k, stiff=stiff)

    def newton(self):
        return np.stack([1 / self.k, 1 / np.sqrt(self.k)])

    def subset(self, lanes):
        return Stiffening(self.k[lanes], self.stiff[lanes])

    def force(self, times, states):
        return -np.where((times > 0.283) & (times < 0.303), self.stiff, self.k) * states[0]


@pytest.mark.parametrize("stiff", [3e9, 6e9, 7e9])
def test_a_fixed_step_is_refused_where_stiffness_comes_and_goes_without_an_event(stiff):
    # Between two of the looks that come at their time, which would let a wrong answer pass.
    times = np.linspace(0.0, 0.4, 401)
    start = np.array([[1e-3], [0.0]])
    with pytest.raises(InputError, match=r"cannot be resolved at 0\.28\d* s.*too long"):
        integrate(Stiffening(stiff=stiff), start, times, SemiImplicit(25e-6))


def test_a_fixed_step_goes_on_where_stiffness_does_not_change():
    start = np.array([[1e-3], [0.0]])
    integrate(Stiffening(), start, np.linspace(0.0, 0.4, 401), SemiImplicit(25e-6))
