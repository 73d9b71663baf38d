"""Choreographies: what a hand is told becomes commands that do just that."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq

from forcelab.simulation.hand import KNOT_STEP, Trajectory
from forcelab.simulation.mechanics import Layout, Mechanics
from forcelab.simulation.scene import Arm, Body, Ground, Jaws, Scene
from forcelab.simulation.tasks.choreography import TAP_LENGTH, Choreography

CALM = {"opening": 0.008, "tempo": 1.0, "tremor": 0.0, "wander": 0.0, "sway": 0.0, "tap": 4.0}
BLOCK = Body("block", 0.02, 0.02, 500.0)
#: Knots before and after a corner of a command that its spline may round off.
ROUND = 4 * KNOT_STEP


def choreography(*, jaws=None, body=BLOCK, taps=False, seed=0, lifted=False, **hand):
    scene = Scene(
        "foam",
        jaws or Jaws(),
        body,
        arm=Arm(axes=("z",)) if lifted else None,
        ground=Ground() if lifted else None,
    )
    return Choreography(scene, CALM | hand, np.random.default_rng(seed), taps=taps)


def commanded(hand):
    """Times of the knots and the commands there, by name."""
    values = hand.values()
    times = KNOT_STEP * np.arange(len(values))
    return times, dict(zip(Layout.of(hand.scene).commands, values.T, strict=True))


# Gripping


@settings(max_examples=40)
@given(
    st.floats(0.5, 30.0),
    st.floats(100.0, 5000.0),
    st.floats(0.5, 2.0),
    st.floats(100.0, 1e6),
    st.sampled_from([1.0, 1.5]),
)
def test_a_grip_commands_the_jaws_to_where_finger_and_body_balance_at_that_force(
    force, finger, asymmetry, stiffness, exponent
):
    body = Body("block", 0.02, 0.02, stiffness, exponent=exponent)
    jaws = Jaws(stiffness=finger, asymmetry=asymmetry)
    hand = choreography(jaws=jaws, body=body)
    hand.grip(force, 0.1, 0.3)
    hand.phase("grab", 0.6)
    hand.end()
    _, command = commanded(hand)
    for side, spring in (("left jaw", finger), ("right jaw", finger * asymmetry)):
        end = command[side][-1]

        def unbalanced(place, spring=spring, end=end):
            pressed = stiffness * max(body.half_width - place, 0.0) ** exponent
            return spring * (end - place) + pressed

        place = brentq(unbalanced, -1.0, 1.0, xtol=1e-15)
        assert spring * (place - end) == pytest.approx(force, rel=1e-6)
    assert hand.hold == force


def test_the_mechanics_rest_in_a_grip_where_it_should_be():
    jaws = Jaws(stiffness=550.0, asymmetry=1.2)
    hand = choreography(jaws=jaws)
    hand.grip(5.0, 0.1, 0.3)
    hand.phase("grab", 0.6)
    system = Mechanics([hand.scene], Trajectory.through([hand.values()]))
    state = np.zeros((len(system.names), 1))
    state[:2] = BLOCK.half_width - 5.0 / BLOCK.stiffness
    now = np.array([0.55])
    instant = system.evaluate(now, state)
    np.testing.assert_allclose(instant.normal, 5.0, rtol=1e-9)
    assert np.abs(instant.rates).max() < 1e-6


def test_the_right_jaw_lags_behind_the_left_one():
    hand = choreography()
    hand.grip(4.0, 0.2, 0.3, lag=0.05)
    hand.phase("grab", 1.0)
    _, command = commanded(hand)
    steps = round(0.05 / KNOT_STEP)
    np.testing.assert_allclose(command["right jaw"][steps:], command["left jaw"][:-steps])


def test_opening_brings_the_jaws_back_to_where_they_were():
    hand = choreography()
    before = BLOCK.half_width + CALM["opening"]
    hand.grip(4.0, 0.1, 0.3)
    hand.open(0.6, 0.3)
    hand.phase("release", 1.2)
    _, command = commanded(hand)
    for side in ("left jaw", "right jaw"):
        assert command[side][0] == pytest.approx(before)
        assert command[side].min() < BLOCK.half_width
        assert command[side][-1] == pytest.approx(before)
    assert hand.hold == 0.0


def test_a_reach_is_the_move_of_least_jerk_between_two_places():
    hand = choreography(lifted=True)
    hand.move("tongs z", 0.04, 0.2, 0.5)
    hand.phase("hold", 1.0)
    times, command = commanded(hand)
    u = np.clip((times - 0.2) / 0.5, 0.0, 1.0)
    np.testing.assert_allclose(
        command["tongs z"], 0.04 * (10 * u**3 - 15 * u**4 + 6 * u**5), atol=1e-12
    )


# Moving


@settings(max_examples=40)
@given(st.floats(0.4, 4.0), st.floats(0.01, 2.0), st.floats(0.0, 0.5))
def test_a_pull_is_steady_but_for_a_soft_start_and_end(duration, pace, start):
    hand = choreography(lifted=True)
    hand.pull("tongs z", pace, start, duration)
    hand.phase("pull", start + duration + 0.5)
    times, command = commanded(hand)
    place = command["tongs z"]
    assert place[-1] == pytest.approx(pace * duration, rel=1e-9)
    speed = np.diff(place) / KNOT_STEP
    middle = 0.5 * (times[1:] + times[:-1])
    steady = speed[(middle > start + 0.16) & (middle < start + duration - 0.22)]
    if len(steady) > 10:
        assert np.ptp(steady) < 0.15 * steady.mean()
        # Soft ends take time that the middle makes up for.
        assert pace * 0.93 < steady.mean() < pace * duration / (duration - 0.25)
    assert speed.min() > -1e-9
    still = (middle < start - KNOT_STEP) | (middle > start + duration + 0.08)
    np.testing.assert_allclose(speed[still], 0.0, atol=1e-9)


def test_a_wiggle_swings_to_both_sides_and_ends_where_it_began():
    hand = choreography(lifted=True)
    hand.move("tongs z", 0.02, 0.0, 0.3)
    hand.wiggle("tongs z", 0.5, 1.5, 0.004, 5.0)
    hand.phase("search", 2.0)
    times, command = commanded(hand)
    swing = command["tongs z"] - 0.02
    inside = swing[(times > 0.6) & (times < 1.4)]
    assert inside.max() == pytest.approx(0.004, rel=0.02)
    assert inside.min() == pytest.approx(-0.004, rel=0.02)
    np.testing.assert_allclose(
        swing[((times > 0.3) & (times < 0.5)) | (times > 1.5)], 0, atol=1e-12
    )


def test_tremor_and_wandering_are_as_large_as_the_hand_says():
    hand = choreography(tremor=3e-5)
    hand.phase("hold", 60.0)
    _, command = commanded(hand)
    assert np.std(command["left jaw"]) == pytest.approx(3e-5, rel=0.05)
    hand = choreography(wander=5e-4)
    hand.phase("hold", 60.0)
    _, command = commanded(hand)
    assert np.std(command["left jaw"]) == pytest.approx(5e-4, rel=0.3)
    # The jaws tremble each by itself.
    assert abs(np.corrcoef(command["left jaw"], command["right jaw"])[0, 1]) < 0.5


# Taps


@pytest.mark.parametrize("duration", [0.5, 3.0])
def test_taps_lie_before_and_after_the_task_and_have_the_stated_length(duration):
    hand = choreography(taps=True)
    hand.phase("hold", duration)
    end = hand.end()
    assert len(hand.taps) == 2
    first, last = hand.taps
    assert first - TAP_LENGTH / 2 > 0.0
    assert first + TAP_LENGTH / 2 < hand.phases[0].start
    assert hand.phases[-1].end < last - TAP_LENGTH / 2
    assert last + TAP_LENGTH / 2 < end == hand.t
    tap = Trajectory.through([hand.values()])
    row = Layout.of(hand.scene).commands.index("tap")

    def force(time):
        return float(tap.at(np.array([time]))[row, 0])

    for at in hand.taps:
        assert force(at) == pytest.approx(CALM["tap"], rel=0.02)
        pushed = sum(quad(force, a, b)[0] for a, b in pairwise(at + np.linspace(-0.03, 0.03, 13)))
        # A squared sine is half as much as a push that is full all along.
        assert pushed == pytest.approx(0.5 * CALM["tap"] * TAP_LENGTH, rel=0.02)
        assert abs(force(at - TAP_LENGTH / 2 - ROUND)) < 0.01
        assert abs(force(at + TAP_LENGTH / 2 + ROUND)) < 0.01


def test_phases_follow_one_another_without_gaps():
    hand = choreography(taps=True)
    for action in ("still", "grab", "hold"):
        hand.phase(action, 0.4)
    assert [phase.action for phase in hand.phases] == ["still", "grab", "hold"]
    assert all(phase.end == following.start for phase, following in pairwise(hand.phases))
    assert hand.t == hand.phases[-1].end


def test_the_commands_reach_beyond_the_end_and_are_finite():
    hand = choreography(taps=True, tremor=3e-5, wander=5e-4, lifted=True)
    hand.grip(4.0, 0.7, 0.3)
    hand.phase("hold", 1.234)
    hand.end()
    values = hand.values()
    assert values.shape[1] == len(Layout.of(hand.scene).commands)
    assert (len(values) - 1) * KNOT_STEP >= hand.t
    assert np.isfinite(values).all()


def test_durations_are_those_of_the_recipe_in_the_tempo_of_the_hand():
    hand = choreography(tempo=1.5, close=0.2)
    assert hand.lasts("close") == pytest.approx(0.3)


def test_a_chance_is_taken_as_often_as_it_says():
    hand = choreography()
    taken = np.mean([hand.chance(0.3) for _ in range(3000)])
    assert taken == pytest.approx(0.3, abs=0.03)


# All of it
