"""What really happened: cues in motion and events, and the actions that they bound."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from factories import make_track
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.simulation.scene import Event, Motion
from forcelab.simulation.tasks.ground_truth import (
    CONTACT_LOST,
    CONTACT_MADE,
    SHORTEST,
    Course,
    Phase,
    first,
    grip_settled,
    last,
    true_actions,
)

RATE = 1000.0
TIMES = np.arange(6000) / RATE
LEFT, RIGHT = CONTACT_MADE


def course(*events, grip=None):
    """A course with these events, (time, kind), and this grip in N."""
    normal = np.zeros((len(TIMES), 2))
    if grip is not None:
        normal[:] = grip[:, None]
    nothing = np.zeros((len(TIMES), 4))
    motion = Motion(TIMES, normal, nothing[:, :3], nothing, normal)
    return Course(motion, tuple(Event(time, kind) for time, kind in events))


def begins(time):
    """A cue that is found at a time, or not at all."""
    return lambda _course, _planned: time


def planned(*phases):
    """Phases of (action, duration, cue) one after the other, from 1 s."""
    result, now = [], 1.0
    for action, duration, cue in phases:
        result.append(Phase(action, now, now + duration, cue))
        now += duration
    return result


# Cues


def test_the_first_and_the_last_event_of_the_kinds_near_the_plan_are_found():
    found = course((0.1, LEFT), (1.9, RIGHT), (2.0, LEFT), (2.1, "snap in"), (5.0, LEFT))
    assert first(LEFT, RIGHT)(found, 2.0) == 1.9
    assert last(LEFT, RIGHT)(found, 2.0) == 2.0
    assert first(LEFT)(found, 2.0) == 2.0
    assert first("snap in", lead=0.05)(found, 2.0) == pytest.approx(2.05)


def test_events_too_far_from_the_plan_are_none_of_it():
    found = course((2.0, LEFT))
    assert first(LEFT, near=0.2)(found, 2.15) == 2.0
    assert first(LEFT, near=0.2)(found, 2.25) is None
    assert last(LEFT, near=0.2)(found, 1.75) is None
    assert first("snap in")(found, 2.0) is None
    assert first(*CONTACT_LOST)(found, 2.0) is None


def test_a_grip_has_settled_where_it_reaches_nine_tenths_of_what_it_will_be():
    grip = np.interp(TIMES, [2.0, 2.4], [0.0, 5.0])
    found = grip_settled(course(grip=grip), 2.4)
    # Nine tenths are reached at 2.36 s; a mean over a knock's length comes a little later.
    assert found == pytest.approx(2.36, abs=0.03)


def test_a_knock_on_the_way_is_not_yet_a_grip():
    grip = np.interp(TIMES, [2.0, 2.4], [0.0, 5.0])
    grip[(TIMES > 2.1) & (TIMES < 2.11)] = 14.0
    found = grip_settled(course(grip=grip), 2.4)
    assert found == pytest.approx(2.36, abs=0.03)


def test_a_grip_that_never_comes_or_lies_beyond_the_recording_does_not_hurt():
    nothing = course(grip=np.zeros(len(TIMES)))
    for when in (0.0, 3.0, 5.99, 6.5):
        found = grip_settled(nothing, when)
        assert found is None or abs(found - when) <= 0.3 + 1e-9


# Actions


ACTIONS = {
    "without cues everything happened as planned": (
        [("still", 1.0, None), ("grab", 0.5, None), ("hold", 1.0, None)],
        [(1.0, 2.0, "still"), (2.0, 2.5, "grab"), (2.5, 3.5, "hold")],
    ),
    "an action begins where its cue is found and the one before ends there": (
        [("still", 1.0, None), ("grab", 0.5, begins(2.2)), ("hold", 1.0, begins(None))],
        [(1.0, 2.2, "still"), (2.2, 2.5, "grab"), (2.5, 3.5, "hold")],
    ),
    "neighbours of one action are one": (
        [("insert", 0.5, None), ("insert", 0.5, begins(1.7)), ("release", 0.5, None)],
        [(1.0, 2.0, "insert"), (2.0, 2.5, "release")],
    ),
    # The jaws slipped off before they ever stuck.
    "what did not happen is left out and leaves no gap": (
        [("pull", 1.0, None), ("slip", 0.5, begins(2.3)), ("slipped", 1.0, begins(2.1))],
        [(1.0, 2.3, "pull"), (2.3, 3.5, "slipped")],
    ),
    "two actions about one that did not happen are one": (
        [("hold", 1.0, None), ("search", 0.5, begins(2.5)), ("hold", 1.0, None)],
        [(1.0, 3.5, "hold")],
    ),
}


@pytest.mark.parametrize(("phases", "expected"), ACTIONS.values(), ids=ACTIONS)
def test_actions_are_what_was_planned_and_where_it_happened(phases, expected):
    assert true_actions(planned(*phases), course()) == make_track(*expected)


def test_a_cue_after_the_end_leaves_the_last_action_out():
    phases = planned(("hold", 1.0, None), ("release", 0.5, begins(4.0)))
    actions = true_actions(phases, course())
    assert [action.action for action in actions] == ["hold"]


cues = st.one_of(st.none(), st.builds(begins, st.none()), st.builds(begins, st.floats(-1.0, 12.0)))
plans = st.lists(
    st.tuples(st.sampled_from(["still", "grab", "hold"]), st.floats(0.0, 2.0), cues),
    min_size=1,
    max_size=8,
)


@settings(max_examples=80)
@given(plans)
def test_whatever_the_cues_the_actions_are_in_order_without_gaps_and_none_is_too_short(plan):
    phases = planned(*plan)
    actions = true_actions(phases, course())
    order = [phase.action for phase in phases]
    for earlier, following in pairwise(actions):
        assert earlier.end == following.start
        assert earlier.action != following.action
    for action in actions:
        assert action.duration >= SHORTEST - 1e-12
        # The actions are some of the plan's, in its order.
        assert action.action in order
        order = order[order.index(action.action) :]
    if actions:
        lost = SHORTEST * len(phases)
        assert actions[0].start >= 1.0
        assert actions[-1].end >= phases[-1].end - lost
    else:
        assert phases[-1].end - phases[0].start < SHORTEST * len(phases)
