"""The Rosenbrock solver: its coefficients, and stiff motion in few steps, right or refused."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from simulation.mechanisms import Ball, Mechanism, Oscillator, Thrown, driven, order

from forcelab.errors import InputError
from forcelab.simulation import solvers as rodas
from forcelab.simulation.solvers import Explicit, Rosenbrock, integrate

STAGES = len(rodas.NODES)
SENTENCE = re.compile(
    r"The motion of demonstration \d+ cannot be resolved at \S+ s: [^;]+; [^;]+\."
)


def lower(rows):
    """A lower triangle as a square matrix."""
    return np.array([np.append(row, np.zeros(STAGES - len(row))) for row in rows])


# The coefficients as Hairer and Wanner write a Rosenbrock method (IV.7.4): alpha, Gamma, beta.
GAMMA = np.linalg.inv(np.eye(STAGES) / rodas.GAMMA - lower(rodas.COUPLING))
ALPHA = lower(rodas.STAGES) @ GAMMA
BETA = ALPHA + GAMMA
NODES, SUMS = ALPHA.sum(axis=1), BETA.sum(axis=1)


def conditions(weights, share, order):
    """What is left of the order conditions (IV.7.15) of the state at a share of the step."""
    b = weights @ GAMMA
    left = [
        [b.sum() - share],
        [b @ SUMS - share**2 / 2],
        [b @ NODES**2 - share**3 / 3, b @ BETA @ SUMS - share**3 / 6],
        [
            b @ NODES**3 - share**4 / 4,
            b @ (NODES * (ALPHA @ SUMS)) - share**4 / 8,
            b @ BETA @ NODES**2 - share**4 / 12,
            b @ BETA @ BETA @ SUMS - share**4 / 24,
        ],
    ]
    return np.concatenate(left[:order])


WHOLE = np.append(rodas.STAGES[-1], 1.0)


def test_the_coefficients_fulfil_all_conditions_of_order_four():
    assert np.abs(conditions(WHOLE, 1.0, 4)).max() < 1e-12
    assert np.abs(NODES - rodas.NODES).max() < 1e-13
    assert np.abs(GAMMA.sum(axis=1) - rodas.SLOPES).max() < 1e-13


def test_a_wrong_jacobian_leaves_order_two():
    # Then alpha and Gamma count by themselves, not only their sum.
    b = WHOLE @ GAMMA
    assert b @ NODES == pytest.approx(0.5, abs=1e-12)
    assert b @ GAMMA.sum(axis=1) == pytest.approx(0.0, abs=1e-12)


def test_the_error_is_the_difference_to_a_solution_of_order_three_and_not_four():
    assert np.abs(conditions(WHOLE - np.eye(STAGES)[-1], 1.0, 3)).max() < 1e-12
    assert np.abs(conditions(WHOLE - np.eye(STAGES)[-1], 1.0, 4)).max() > 1e-3


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_the_states_within_a_step_are_of_order_three(share):
    weights = share ** np.arange(1, 4) @ rodas.DENSE
    assert np.abs(conditions(weights, share, 3)).max() < 1e-12
    assert np.ones(3) @ rodas.DENSE == pytest.approx(WHOLE, abs=1e-13)


def test_stiff_parts_are_damped_at_every_frequency_and_wholly_at_infinity():
    def grows(z):
        one = np.ones(STAGES)
        return 1 + z * (WHOLE @ GAMMA) @ np.linalg.solve(np.eye(STAGES) - z * BETA, one)

    edge = 1j * np.geomspace(1e-2, 1e6, 400)
    assert max(abs(grows(z)) for z in edge) <= 1 + 1e-12
    assert abs(grows(-1e9)) < 1e-7


def test_the_error_falls_with_the_fourth_power_of_the_step():
    system, start = driven()
    # With a tolerance that nothing exceeds, all steps but the first few are the longest ones.
    solvers = [Rosenbrock(1e9, longest=4e-3 / 2**n) for n in range(4)]
    assert order(system, start, np.array([0.0, 0.25]), solvers)[1:] == pytest.approx(4, abs=0.3)
    assert (order(system, start, np.linspace(0, 0.25, 501), solvers)[1:] > 3.7).all()


def test_a_stiff_contact_follows_a_slow_force_in_few_steps_with_little_error():
    # Jaws of 10 g on a cartridge, squeezed with the tremor of a hand.
    system = Oscillator(m=0.01, k=1e5, c=20.0, push=5.0, w=2 * np.pi * 10)
    start = system.exactly([0.0], np.zeros((2, 1)))[0]
    start += [[1e-5], [0.0]]  # a newton out of balance: what rings fades
    times = np.linspace(0, 1, 4001)
    found = integrate(system, start, times, Rosenbrock(1e-3))
    error = 1e5 * (found.states - system.exactly(times, start))[:, 0]
    assert np.sqrt((error**2).mean()) < 1e-3
    assert np.abs(error).max() < 1e-2
    assert found.steps[0] < 300
    assert integrate(system, start, times, Explicit(1e-3)).steps[0] > 4 * found.steps[0]


class Decay(Mechanism):
    """``y' = -r (y - cos(w t)) - w sin(w t)``, a first-order lag without any position."""

    names = ("y",)
    positions = velocities = np.array([], int)

    def __init__(self, r, w=5.0):
        super().__init__(r=r, w=w)

    def newton(self):
        return np.ones((1, self.lanes))

    def rates(self, times, states):
        way = self.w * times
        return -self.r * (states - np.cos(way)) - self.w * np.sin(way)


@pytest.mark.parametrize("rate", [1e2, 1e5, 1e8])
def test_a_decay_of_any_rate_is_followed_by_long_steps(rate):
    times = np.linspace(0, 1, 201)
    found = integrate(Decay(rate), np.array([[2.0]]), times, Rosenbrock(1e-4, longest=0.05))
    exact = np.cos(5 * times) + np.exp(-rate * times)
    assert np.abs(found.states[:, 0, 0] - exact).max() < 1e-3
    assert found.steps[0] < 150


@settings(max_examples=20, deadline=None)
@given(
    st.floats(1, 8), st.floats(-6, 2), st.one_of(st.floats(0, 1.5), st.just(0.0)), st.integers(0, 9)
)
def test_any_stiffness_with_any_mass_is_right_or_refused(stiffness, mass, damping, phase):
    k, m = 10.0**stiffness, 10.0**mass
    quick = np.sqrt(k / m)
    system = Oscillator(m=m, k=k, c=damping * np.sqrt(k * m), w=0.0)
    start = np.array([[np.cos(phase) / k], [np.sin(phase) * quick / k]])  # one newton
    duration = 1e-3
    times = np.linspace(0, duration, 21)
    try:
        found = integrate(system, start, times, Rosenbrock(1e-3, max_steps=400)).states
    except InputError as error:
        assert SENTENCE.fullmatch(str(error))
        assert "more than 400 steps" in str(error)
        # Only what rings on for dozens of radians is refused.
        assert quick * duration > 30
        assert damping < 0.5
    else:
        error = k * np.abs(found - system.exactly(times, start))[:, 0]
        assert error.max() < 0.03 * (1 + 0.1 * quick * duration)


@pytest.mark.parametrize("k", [1e1, 1e3, 1e5, 1e8])
@pytest.mark.parametrize("m", [1e-6, 1e-2, 1e2])
def test_any_contact_is_made_and_lost_when_the_closed_form_says(k, m):
    speed, half = 0.2, np.pi * np.sqrt(m / k)
    ball = Ball(m=m, k=k, c=0.1 * np.sqrt(k * m), g=0.0)
    touching = ball.touching(speed)
    leaves = brentq(lambda t: touching(t)[0], 0.5 * half, 1.9 * half, xtol=1e-12 * half)
    start = np.array([[0.0], [-speed]])
    times = np.linspace(0, 1.2 * leaves, 121)
    peak = np.sqrt(k * m) * speed
    found = integrate(ball, start, times, Rosenbrock(1e-6 * peak, longest=leaves))
    lost = found.events[0][-1]
    assert lost.kind == "contact lost"
    assert lost.time == pytest.approx(leaves, abs=max(1e-10, 1e-4 * leaves))
    within = times < leaves
    assert k * np.abs(found.states[within, 0, 0] - touching(times[within])).max() < 1e-4 * peak


def test_a_visit_across_within_one_long_step_is_seen():
    # Thrown up to just above the line, and down again between two looks at it.
    class Line(Thrown):
        def watched(self, _times, states):
            return states[:1] - (0.5 - 1e-3)

    found = integrate(
        Line(-1.0), np.array([[0.0], [1.0]]), np.linspace(0, 2, 5), Rosenbrock(1.0, longest=2.0)
    )
    assert [event.kind for event in found.events[0]] == ["up", "down"]
    way = np.sqrt(2e-3)
    times = [event.time for event in found.events[0]]
    assert times == pytest.approx([1 - way, 1 + way], abs=1e-7)


def test_lanes_do_not_feel_each_other():
    k = np.array([1e2, 1e3, 1e6, 1e4, 3e5, 1e1, 2e3])
    m = np.array([0.1, 1e-3, 0.02, 10.0, 0.3, 1e-2, 0.05])
    start = np.array([[1e-4] * 7, np.linspace(-0.2, 0, 7)])
    times = np.linspace(0, 0.02, 41)
    # Rounding differs with the number of lanes, and is raised by the differences of which the
    # derivatives are made.
    for kind, newtons in ((Oscillator, 1e-7), (Ball, 1e-6)):
        system = kind(m=m, k=k, c=0.02 * np.sqrt(k))
        together = integrate(system, start, times, Rosenbrock(1e-4))
        for lane in range(7):
            alone = integrate(system.lane(lane), start[:, [lane]], times, Rosenbrock(1e-4))
            difference = np.abs(together.states[..., [lane]] - alone.states)
            assert (difference / system.scales[:, [lane]]).max() < newtons
            assert together.steps[lane] == pytest.approx(alone.steps[0], rel=0.02)
            assert [event.kind for event in together.events[lane]] == [
                event.kind for event in alone.events[0]
            ]


def test_a_step_whose_equations_have_no_solution_is_tried_shorter():
    # The first step, 2**-20 s, times gamma times the first lane's rate is one, without rounding.
    class Growth(Decay):
        def rates(self, _times, states):
            return self.r * states

    system, times = Growth([2.0**22, -1.0]), np.linspace(0, 2.0**-20, 3)
    solver = Rosenbrock(1e-6, longest=2.0**-20)
    found = integrate(system, np.ones((1, 2)), times, solver)
    assert found.states[:, 0] == pytest.approx(np.exp(np.outer(times, system.r)), rel=1e-4)
