"""Solvers against closed forms: order, accuracy, independence of the lanes, energy."""

import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.optimize import brentq

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.simulation import solvers as rodas
from forcelab.simulation.solvers import EventLocator, integrate, integrating
from tests.simulation.mechanisms import (
    Ball,
    Bouncer,
    Mechanism,
    Oscillator,
    Thrown,
    driven,
    errors,
    lsoda,
    order,
    radau,
    rk45,
    rosenbrock,
)


def name(solver):
    return solver.method


ALL = [rk45(1e-7), lsoda(1e-6), radau(1e-5), rosenbrock(1e-6)]


@pytest.mark.parametrize("solver", ALL, ids=name)
def test_a_driven_and_damped_oscillator_moves_as_its_closed_form_says(solver):
    system, start = driven()
    assert errors(system, start, np.linspace(0, 0.3, 301), solver).max() < 1e-4


@pytest.mark.parametrize("kind", [rk45, lsoda, radau, rosenbrock])
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
    k = np.array([1e3, 1e6, 1e1, 2e3])
    system = Ball(m=[1e-3, 0.02, 1e-2, 0.05], k=k, c=0.02 * np.sqrt(k))
    start = np.array([[1e-4] * 4, np.linspace(-0.2, 0, 4)])
    times = np.linspace(0, 0.02, 41)
    together = integrate(system, start, times, solver)
    for lane in range(4):
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
    steps = integrate(system, start, np.linspace(0, 0.02, 11), rosenbrock()).steps
    assert (steps[:3] < 60).all()
    assert steps[3] > 200
    # A look at the derivatives takes four columns of each lane.
    assert sizes.count(4 * 4) < 130
    assert sizes.count(4 * 1) > 160


@pytest.mark.parametrize("solver", ALL, ids=name)
def test_the_job_tells_how_many_samples_there_are_and_gives_the_same(solver):
    system, start = driven()
    times = np.linspace(0, 0.05, 201)
    visits = []
    result = finish(integrating(system, start, times, solver), visits.append)
    done = [progress.done for progress in visits]
    assert done == sorted(done)
    assert len(done) > 1
    assert {progress.total for progress in visits} == {2 * 201}
    assert np.array_equal(result.states, integrate(system, start, times, solver).states)
    assert np.array_equal(result.states[0], start)


@pytest.mark.parametrize("solver", ALL, ids=name)
def test_time_need_not_start_at_zero(solver):
    system, start = driven()
    system.push *= 0
    times = np.linspace(0, 0.05, 26)
    early, late = (integrate(system, start, times + t, solver) for t in (0.0, 7.0))
    assert np.abs(early.states - late.states)[:, 0].max() < 1e-8


SOLVERS = [rk45(1e-6), rosenbrock(1e-6), lsoda(1e-7), radau(1e-6)]


def moments(solution, lane=0):
    return np.array([event.time for event in solution.events[lane]])


@pytest.mark.parametrize("solver", SOLVERS, ids=name)
def test_a_ball_meets_and_leaves_a_spring_and_dashpot_when_the_closed_form_says(solver):
    ball = Ball(m=[0.05, 0.05], k=[1e5, 500.0], c=[5.0, 0.2])
    height = 2e-3
    times = np.linspace(0, 0.08, 321)
    found = integrate(ball, np.array([[height] * 2, [0.0] * 2]), times, solver)
    meets = np.sqrt(2 * height / 9.81)
    for lane in range(2):
        touching = ball.lane(lane).touching(np.sqrt(2 * 9.81 * height))
        period = np.pi / np.sqrt(ball.k[lane] / ball.m[lane])
        leaves = meets + float(
            brentq(lambda t: touching(t)[0], 0.5 * period, 1.9 * period, xtol=1e-14)  # noqa: B023
        )
        made_contact, lost = found.events[lane][:2]
        assert (made_contact.kind, lost.kind) == ("contact made", "contact lost")
        assert made_contact.time == pytest.approx(meets, abs=1e-7)
        assert lost.time == pytest.approx(leaves, abs=1e-7)
        within = (times > meets) & (times < leaves)
        error = found.states[within, 0, lane] - touching(times[within] - meets)
        force = ball.k[lane] * np.abs(error).max()
        assert force < 1e-3


@pytest.mark.parametrize("solver", SOLVERS, ids=name)
def test_a_jump_is_taken_where_the_event_is_and_only_there(solver):
    system = Bouncer(e=[0.8, 0.5])
    start = np.array([[0.05, 0.02], [0.0, 0.0]])
    times = np.linspace(0, 0.18, 1801)
    found = integrate(system, start, times, solver)
    for lane in range(2):
        first = np.sqrt(2 * start[0, lane] / 9.81)
        flights = 2 * first * system.e[lane] ** np.arange(1, 6)
        bounces = first + np.append(0, np.cumsum(flights))
        bounces = bounces[bounces < 0.18]
        assert moments(found, lane) == pytest.approx(bounces, abs=1e-8)
        assert {event.kind for event in found.events[lane]} == {"bounce"}
        speed = found.states[np.searchsorted(times, bounces[0]) - 1 :, 1, lane][:2]
        assert speed == pytest.approx([-9.81 * first, system.e[lane] * 9.81 * first], abs=1e-2)
        assert found.states[:, 0, lane].min() > -1e-9


@pytest.mark.parametrize("solver", SOLVERS, ids=name)
def test_an_event_function_that_starts_at_zero_has_crossed_nothing(solver):
    # Up from zero and down through it again; down from zero; never off it.
    system = Thrown(a=[-10.0, -10.0, 0.0])
    start = np.array([[0.0, 0.0, 0.0], [1.0, -1.0, 0.0]])
    found = integrate(system, start, np.linspace(0, 0.5, 6), solver)
    assert [[event.kind for event in lane] for lane in found.events] == [["down"], [], []]
    assert found.events[0][0].time == pytest.approx(0.2, abs=1e-7)


@pytest.mark.parametrize("solver", SOLVERS, ids=name)
def test_what_rests_exactly_where_contact_begins_sinks_in_without_an_event(solver):
    found = integrate(
        Ball(m=0.012, k=4e4, c=60.0), np.zeros((2, 1)), np.linspace(0, 0.02, 21), solver
    )
    assert found.events == ((),)
    assert found.states[-1, 0, 0] == pytest.approx(-0.012 * 9.81 / 4e4, rel=1e-2)


def test_states_within_a_step_that_err_to_the_wrong_side_of_zero_are_no_event():
    def path(shares):
        # Sinks from zero, but for what a solver's polynomial makes of it.
        return shares, np.stack([1e-15 * shares * (0.3 - shares), shares])

    system = Thrown()
    passage = EventLocator(system).first(system, path, 1.0, np.array([0.0]))
    assert passage.happened == ()
    assert (passage.share, *passage.sides) == (1.0, -1.0)


@pytest.mark.parametrize("solver", [replace(s, longest=0.1) for s in SOLVERS], ids=name)
@settings(max_examples=8, deadline=None)
@given(middle=st.floats(0.2, 0.8), half=st.floats(0.01, 0.09))
def test_what_crosses_and_comes_back_within_one_step_is_found(solver, middle, half):
    # x = a/2 ((t - middle)^2 - half^2) is below zero for twice `half`, a step lasts 0.1 s.
    start = np.array([[middle**2 - half**2], [-2 * middle]])
    found = integrate(Thrown(a=2.0), start, np.array([0.0, 1.0]), solver)
    assert [event.kind for event in found.events[0]] == ["down", "up"]
    assert moments(found) == pytest.approx([middle - half, middle + half], abs=1e-7)


@pytest.mark.parametrize("solver", SOLVERS, ids=name)
def test_several_events_of_a_step_come_in_order_and_those_of_an_instant_together(solver):
    class Gates(Thrown):
        rising = ("third", "first", "never", "second", "also second")
        events = (*((name, "") for name in rising), ("", "silent"))

        def watched(self, _times, states):
            gates = np.array([0.3041, 0.3, 0.7, 0.304, 0.304, -1.0])[:, None]
            return states[:1] - gates

    found = integrate(Gates(), np.array([[0.0], [1.0]]), np.array([0.0, 0.5]), solver)
    kinds = [event.kind for event in found.events[0]]
    assert kinds == ["first", "second", "also second", "third"]
    assert moments(found) == pytest.approx([0.3, 0.304, 0.304, 0.3041], abs=1e-7)


@pytest.mark.parametrize("solver", SOLVERS, ids=name)
def test_events_without_end_are_refused_in_a_sentence(solver):
    class Chatter(Thrown):
        """Is sent back whenever it passes zero, from either side."""

        def jump(self, _event, rising, state):
            return np.array([state[0], -1.0 if rising else 1.0])

    start = np.array([[-0.5, 0.1001], [-1.0, -1.0]])
    with pytest.raises(InputError) as refused:
        integrate(Chatter(a=[0.0, 0.0]), start, np.linspace(0, 0.3, 4), solver)
    assert str(refused.value) == (
        "The motion of demonstration 2 cannot be resolved at 0.1001 s: 'down' and 'up' follow "
        "each other without end; raise the damping there."
    )


@pytest.mark.parametrize("solver", SOLVERS, ids=name)
def test_an_event_function_that_is_not_a_number_is_refused(solver):
    class Torn(Thrown):
        def watched(self, _times, states):
            with np.errstate(invalid="ignore"):
                return np.sqrt(0.2 - states[:1])

    with pytest.raises(InputError, match=r"of demonstration 1 cannot be resolved at 0\.(1\d*|2) s"):
        integrate(Torn(), np.array([[0.0], [1.0]]), np.linspace(0, 0.3, 31), solver)


STIFFNESSES = [1e1, 1e4, 1e6, 1e8]
MASSES = [1e-6, 1e-2, 1e2]
ADAPTIVE = [rk45(max_steps=1500), lsoda(1e-5, max_steps=1500), radau(max_steps=400)]
EVERY = [*ADAPTIVE, rosenbrock(max_steps=1500)]
DURATION = 1e-3
SENTENCE = re.compile(
    r"The motion of demonstration \d+ cannot be resolved at \S+ s: [^;]+; [^;]+\."
)


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
        integrate(Noise(), np.array([[1.0], [0.0]]), np.linspace(0, 1, 3), rosenbrock(1e-9))


@pytest.mark.parametrize("tolerance", [1e-1, 1.0, 10.0])
def test_loose_tolerances_give_numbers_or_refusals_on_a_stiff_drop(tolerance):
    system = Ball(m=[1e-4, 0.05], k=[1e7, 1e5], c=[1.0, 0.1])
    start = np.array([[1e-3, 1e-3], [-1.0, -0.3]])
    for kind in (rk45, lsoda, radau, rosenbrock):
        try:
            found = integrate(system, start, np.linspace(0, 0.02, 81), kind(tolerance))
        except InputError as error:
            assert SENTENCE.fullmatch(str(error))
        else:
            assert np.isfinite(found.states).all()


STAGES = len(rodas.NODES)


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
        ones = np.ones(STAGES)
        return 1 + z * (WHOLE @ GAMMA) @ np.linalg.solve(np.eye(STAGES) - z * BETA, ones)

    edge = 1j * np.geomspace(1e-2, 1e6, 400)
    assert max(abs(grows(z)) for z in edge) <= 1 + 1e-12
    assert abs(grows(-1e9)) < 1e-7


def test_the_error_falls_with_the_fourth_power_of_the_step():
    system, start = driven()
    # With a tolerance that nothing exceeds, all steps but the first few are the longest ones.
    solvers = [rosenbrock(1e9, longest=4e-3 / 2**n) for n in range(4)]
    assert order(system, start, np.array([0.0, 0.25]), solvers)[1:] == pytest.approx(4, abs=0.3)
    assert (order(system, start, np.linspace(0, 0.25, 501), solvers)[1:] > 3.7).all()


def test_a_stiff_contact_follows_a_slow_force_in_few_steps_with_little_error():
    # Jaws of 10 g on a cartridge, squeezed with the tremor of a hand.
    system = Oscillator(m=0.01, k=1e5, c=20.0, push=5.0, w=2 * np.pi * 10)
    start = system.exactly([0.0], np.zeros((2, 1)))[0]
    start += [[1e-5], [0.0]]  # a newton out of balance: what rings fades
    times = np.linspace(0, 1, 4001)
    found = integrate(system, start, times, rosenbrock(1e-3))
    error = 1e5 * (found.states - system.exactly(times, start))[:, 0]
    assert np.sqrt((error**2).mean()) < 1e-3
    assert np.abs(error).max() < 1e-2
    assert found.steps[0] < 300
    assert integrate(system, start, times, rk45(1e-3)).steps[0] > 4 * found.steps[0]


class Decay(Mechanism):
    """``y' = -r (y - cos(w t)) - w sin(w t)``, a first-order lag without any position."""

    names = ("y",)
    dof = 0

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
    found = integrate(Decay(rate), np.array([[2.0]]), times, rosenbrock(1e-4, longest=0.05))
    exact = np.cos(5 * times) + np.exp(-rate * times)
    assert np.abs(found.states[:, 0, 0] - exact).max() < 1e-3
    assert found.steps[0] < 150


@settings(max_examples=20, deadline=None)
@given(
    st.floats(1, 8), st.floats(-6, 2), st.one_of(st.floats(0, 1.5), st.just(0.0)), st.integers(0, 9)
)
def test_rosenbrock_is_right_or_refuses_at_any_stiffness(stiffness, mass, damping, phase):
    k, m = 10.0**stiffness, 10.0**mass
    quick = np.sqrt(k / m)
    system = Oscillator(m=m, k=k, c=damping * np.sqrt(k * m), w=0.0)
    start = np.array([[np.cos(phase) / k], [np.sin(phase) * quick / k]])  # one newton
    duration = 1e-3
    times = np.linspace(0, duration, 21)
    try:
        found = integrate(system, start, times, rosenbrock(1e-3, max_steps=400)).states
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
    found = integrate(ball, start, times, rosenbrock(1e-6 * peak, longest=leaves))
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
        Line(-1.0), np.array([[0.0], [1.0]]), np.linspace(0, 2, 5), rosenbrock(1.0, longest=2.0)
    )
    assert [event.kind for event in found.events[0]] == ["up", "down"]
    way = np.sqrt(2e-3)
    times = [event.time for event in found.events[0]]
    assert times == pytest.approx([1 - way, 1 + way], abs=1e-7)


def test_a_step_whose_equations_have_no_solution_is_tried_shorter():
    # The first step, 2**-20 s, times gamma times the first lane's rate is one, without rounding.
    class Growth(Decay):
        def rates(self, _times, states):
            return self.r * states

    system, times = Growth([2.0**22, -1.0]), np.linspace(0, 2.0**-20, 3)
    solver = rosenbrock(1e-6, longest=2.0**-20)
    found = integrate(system, np.ones((1, 2)), times, solver)
    assert found.states[:, 0] == pytest.approx(np.exp(np.outer(times, system.r)), rel=1e-4)


SOFT, HARD = 10.0, 1e8
RATIO_DURATION = 0.05


class Chain(Mechanism):
    """A mass on a soft spring, and a light one that a hard and damped spring ties to it."""

    names = ("x", "y", "vx", "vy")
    dof = 2

    def __init__(self, m=0.05, light=1e-3, k=SOFT, hard=HARD, c=None):
        damping = 2 * np.sqrt(np.asarray(hard) * light) if c is None else c
        super().__init__(m=m, light=light, k=k, hard=hard, c=damping)

    def newton(self):
        impedance = np.sqrt(self.k * self.m)
        return np.stack([1 / self.k, 1 / self.k, 1 / impedance, 1 / impedance])

    def rates(self, _times, states):
        x, y, vx, vy = states
        tie = self.hard * (y - x) + self.c * (vy - vx)
        return np.stack([vx, vy, (tie - self.k * x) / self.m, -tie / self.light])

    def matrix(self):
        """The same as one linear system."""
        (m,), (light,), (k,), (hard,), (c,) = (self.m, self.light, self.k, self.hard, self.c)
        return np.array(
            [
                [0, 0, 1, 0],
                [0, 0, 0, 1],
                [-(k + hard) / m, hard / m, -c / m, c / m],
                [hard / light, -hard / light, c / light, -c / light],
            ]
        )


@pytest.mark.parametrize(
    "solver",
    [rosenbrock(1e-3), rk45(1e-3, max_steps=300), lsoda(1e-3), radau(1e-3)],
    ids=name,
)
def test_a_ratio_of_ten_million_is_right_or_refused_in_a_sentence(solver):
    chain = Chain()
    assert HARD / SOFT == 1e7
    times = np.linspace(0.0, RATIO_DURATION, 51)
    start = np.array([0.1, 0.1 + 1e-9, 0.0, 0.0])[:, None]  # a newton each in both springs
    exact = np.stack([expm(chain.matrix() * t) @ start[:, 0] for t in times])
    try:
        found = integrate(chain, start, times, solver).states[:, :, 0]
    except InputError as error:
        assert str(error).endswith(".")
        assert solver.method == "RK45", "a stiff solver must not refuse it"
        return
    assert np.isfinite(found).all()
    assert SOFT * np.abs(found[:, 0] - exact[:, 0]).max() < 0.02
    assert np.abs(found[:, 1] - found[:, 0]).max() < 2e-9 + 0.02 / SOFT * 1e-3
