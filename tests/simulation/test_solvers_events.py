"""Events: located, not stepped over; each once; jumps; what would never end is refused."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from simulation.mechanisms import Ball, Bouncer, Mechanism, Thrown

from forcelab.errors import InputError
from forcelab.simulation.solvers import (
    EventLocator,
    Explicit,
    Lsoda,
    Radau,
    Rosenbrock,
    integrate,
)

SOLVERS = [Explicit(1e-6), Rosenbrock(1e-6), Lsoda(1e-7), Radau(1e-6)]


def name(solver):
    return type(solver).__name__


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
        made, lost = found.events[lane][:2]
        assert (made.kind, lost.kind) == ("contact made", "contact lost")
        assert made.time == pytest.approx(meets, abs=1e-7)
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
@settings(max_examples=15, deadline=None)
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
        events = ("third|", "first|", "never|", "second|", "also second|", "|silent")

        def watched(self, _times, states):
            gates = np.array([0.3041, 0.3, 0.7, 0.304, 0.304, -1.0])[:, None]
            return states[:1] - gates

    found = integrate(Gates(), np.array([[0.0], [1.0]]), np.array([0.0, 0.5]), solver)
    kinds = [event.kind for event in found.events[0]]
    assert kinds == ["first", "second", "also second", "third"]
    assert moments(found) == pytest.approx([0.3, 0.304, 0.304, 0.3041], abs=1e-7)


@pytest.mark.parametrize("solver", SOLVERS, ids=name)
def test_a_direction_without_a_meaning_is_no_event_but_is_kept_in_mind(solver):
    class Swing(Mechanism):
        """Passes zero at 0.1, 0.3, 0.5 ... s, every other time upwards."""

        events = ("up|",)

        def newton(self):
            return np.full((2, self.lanes), 1e-2)

        def force(self, _times, states):
            return -((5 * np.pi) ** 2) * states[0]

        def watched(self, _times, states):
            return states[:1]

    found = integrate(Swing(m=1.0), np.array([[1.0], [0.0]]), np.linspace(0, 0.8, 9), solver)
    assert moments(found) == pytest.approx([0.3, 0.7], abs=1e-4)


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
