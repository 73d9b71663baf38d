"""The tasks: what is planned, what happens, and what the sensors feel of it."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
import pytest

from forcelab.jobs import finish
from forcelab.simulation.scene import TASKS
from forcelab.simulation.tasks import RATE, perform_job, scene_of, vocabulary
from forcelab.simulation.tasks.choreography import Choreography
from forcelab.simulation.tasks.plays import PLAYS
from forcelab.simulation.tasks.recipe import recipe
from forcelab.vocabulary import KEYS

#: The shortest demonstrations of a seed: to follow them takes the time of this file.
SEED = 1
NUMBERS = {
    "LEGO": (258, 519),
    "cartridge": (605, 620),
    "stylus": (37, 242),
    "marker": (282, 5),
    "foam": (461, 548),
}
#: The order of actions; coders of LEGO and cartridge may see a grab before the pull.
ORDERS = {
    "LEGO": "still grab hold search insert release still (grab )?pull hold release still",
    "cartridge": "still grab hold insert release still (grab )?pull hold release still",
    "stylus": "still grab pull slip slip_transition slipped still",
    "marker": "still grab twist hold twist (hold twist )?release still",
    "foam": "still grab hold release still",
}
#: Where a jaw shears by nothing but friction: a stylus also wedges the jaws apart.
KNOCKING = [f"{task} {n}" for task in TASKS if task != "stylus" for n in NUMBERS[task]]
#: Around a tap, jaws swing for so long, s.
SWING = 0.25
#: What the domes' own inertia amounts to at most while nothing is touched, N.
INERTIA = 0.3


@pytest.fixture(scope="module")
def performed():
    """Two demonstrations of every task: name -> performances."""
    return {task: finish(perform_job(task, SEED, NUMBERS[task], taps=True)) for task in TASKS}


@pytest.fixture(params=[f"{task} {number}" for task in TASKS for number in NUMBERS[task]])
def performance(request, performed):
    """Each of the demonstrations."""
    task, number = request.param.split()
    return performed[task][NUMBERS[task].index(int(number))]


def order_of(actions):
    """Actions in one line, neighbours of one name as one."""
    names = [action.replace(" ", "_") for action in actions]
    return " ".join(name for i, name in enumerate(names) if i == 0 or name != names[i - 1])


def happened(performance, ending):
    """Times of the events whose kind ends so."""
    return [event.time for event in performance.events if event.kind.endswith(ending)]


def named(performance, action):
    return [segment for segment in performance.actions if segment.action == action]


def untapped(performance):
    """Samples far enough from the taps."""
    times = performance.motion.times
    return np.logical_and.reduce(
        [(times < tap - 0.05) | (times > tap + SWING) for tap in performance.taps]
    )


def during(performance, segment):
    times = performance.motion.times
    return (times >= segment.start) & (times < segment.end)


# Plans


@pytest.mark.parametrize("task", TASKS)
def test_every_plan_has_the_order_of_its_task(task):
    for number in range(30):
        rng = np.random.default_rng(number)
        scene = recipe(task).drawn_scene(rng)
        numbers = recipe(task).drawn_hand(rng)
        hand = Choreography(scene, numbers, rng, taps=True)
        PLAYS[task](hand)
        assert re.fullmatch(ORDERS[task], order_of(phase.action for phase in hand.phases))
        assert all(
            performance.end == pytest.approx(other.start)
            for performance, other in pairwise(hand.phases)
        )
        assert all(phase.end > phase.start for phase in hand.phases)


@pytest.mark.parametrize("task", TASKS)
def test_a_scene_depends_on_seed_and_number_only(task):
    assert scene_of(task, 3, 1) == scene_of(task, 3, 1)
    assert scene_of(task, 3, 1).task == task
    others = [scene_of(task, 3, 2), scene_of(task, 4, 1)]
    assert len({repr(scene) for scene in (scene_of(task, 3, 1), *others)}) == 3


@pytest.mark.parametrize("task", TASKS)
def test_the_vocabulary_names_every_action_of_the_task_in_its_colour_of_all_tasks(task):
    words = vocabulary(task)
    assert tuple(action.name for action in words.actions) == recipe(task).actions
    assert [action.key for action in words] == list(KEYS[: len(words)])
    assert all(action.texture == 0 for action in words)
    for other in TASKS:
        for action in vocabulary(other).actions:
            if action.name in recipe(task).actions:
                assert action.look == words[action.name].look


# Actions


def test_the_actions_have_the_order_of_the_task_without_gaps(performance):
    actions = performance.actions
    assert re.fullmatch(
        ORDERS[performance.scene.task], order_of(action.action for action in actions)
    )
    assert all(a.end == b.start and a.action != b.action for a, b in pairwise(actions))
    assert {action.action for action in actions} <= set(recipe(performance.scene.task).actions)
    assert min(action.duration for action in actions) >= 0.02
    assert 2.0 < performance.motion.times[-1] < 25.0


def test_the_grab_begins_when_contact_is_made(performance):
    start = named(performance, "grab")[0].start
    contacts = [
        time
        for time in happened(performance, "jaw: contact made")
        if time > performance.actions[0].start
    ]
    assert start == contacts[0]


def test_the_last_rest_begins_when_the_last_contact_is_lost(performance):
    lost = happened(performance, "contact lost") + happened(performance, "jaws part")
    assert performance.actions[-1].action == "still"
    assert performance.actions[-1].start == pytest.approx(max(lost), abs=0.05)


@pytest.mark.parametrize("task", ["LEGO", "cartridge"])
def test_it_snaps_in_while_inserting_and_out_while_pulling(performed, task):
    for performance in performed[task]:
        (inserting,), (pulling,) = named(performance, "insert"), named(performance, "pull")
        assert any(
            inserting.start < time <= inserting.end for time in happened(performance, "snap in")
        )
        assert not any(time < inserting.start for time in happened(performance, "snap in"))
        assert any(
            pulling.start < time <= pulling.end for time in happened(performance, "snap out")
        )
        between = named(performance, "still")[1]
        resting = performance.motion.body[during(performance, between)]
        depth, place = performance.scene.socket.depth, performance.scene.socket.place
        # Let go it stays in; at the end it stands on the table again, near where it began.
        assert np.abs(resting[:, 2] + depth).max() < 0.25 * depth
        assert np.abs(resting[:, 1] - place).max() < 1e-3
        assert abs(performance.motion.body[-1, 2]) < 2e-3
        assert abs(performance.motion.body[-1, 1]) < 0.03


def test_the_stylus_sticks_slips_and_slips_off_until_the_jaws_meet(performed):
    for performance in performed["stylus"]:
        (slip,), (slipped,) = named(performance, "slip"), named(performance, "slipped")
        assert slip.start == min(happened(performance, "slip begins"))
        meet = [time for time in happened(performance, "jaws meet") if time > slip.start]
        assert meet[0] - 0.11 <= slipped.start <= meet[0]  # the hand sees it coming
        along = performance.motion.tongs[:, 1] - performance.motion.body[:, 2]
        before = performance.motion.times < slip.start - 0.01
        # Stuck, the jaws give by the bending of the domes; in the end they are beyond the tip.
        assert np.abs(along[before]).max() < 2e-3
        assert np.abs(performance.forces[untapped(performance)].reshape(-1, 3)[:, :2]).max() < 24.0
        tip = performance.scene.profile.end + performance.scene.profile.taper
        assert along[during(performance, slipped)][-1] > tip


def test_the_marker_turns_with_stick_and_slip_while_it_is_twisted(performed):
    for performance in performed["marker"]:
        cap = performance.motion.body[:, 3]
        assert np.ptp(cap) > 0.3
        twisted = np.logical_or.reduce(
            [during(performance, s) for s in named(performance, "twist")]
        )
        turned = np.abs(np.diff(cap))
        assert turned[twisted[1:]].sum() > 0.7 * turned.sum()
        speed = np.gradient(cap, performance.motion.times)
        stuck, slipping = np.abs(speed) < 0.05, np.abs(speed) > 0.5
        # Told apart by both thresholds, as a Schmitt trigger does.
        states_of_slip = np.where(slipping, 1, np.where(stuck, 0, -1))
        states_of_slip = states_of_slip[states_of_slip >= 0]
        assert np.count_nonzero(np.diff(states_of_slip) == 1) >= 2


def test_the_foam_is_lifted_while_held_and_stands_again(performed):
    for performance in performed["foam"]:
        (hold,) = named(performance, "hold")
        height = performance.motion.body[:, 2]
        assert height[during(performance, hold)].max() > 4e-3
        assert np.argmax(height) / RATE == pytest.approx((hold.start + hold.end) / 2, abs=1.0)
        assert abs(height[-1]) < 1e-3


# Forces


def test_forces_are_finite_and_of_a_size_that_hands_have(performance):
    assert np.isfinite(performance.forces).all()
    assert performance.forces.shape == (len(performance.motion.times), 6)
    assert performance.rate == RATE
    forces = performance.forces[untapped(performance)].reshape(-1, 2, 3)
    pressed = -forces[:, :, 2]
    shear = np.hypot(forces[:, :, 0], forces[:, :, 1])
    assert 1.5 < pressed.max() < 32.0
    assert shear.max() > 1.0
    # Silicone domes are pressed, never pulled; what is left is their inertia.
    assert pressed.min() > -INERTIA - 0.4


@pytest.mark.parametrize("performance", KNOCKING, indirect=True)
def test_no_knock_shears_a_dome_by_more_than_friction_bears(performance):
    # In one of a hundred demonstrations a body that snaps in knocks on the socket's bottom so hard
    # that 30 N shear a dome for some ms: more than a hand pulls with, and as much as it grips.
    calm = untapped(performance)
    scene, motion = performance.scene, performance.motion
    pads = (scene.arm or scene.thread).pads
    if scene.thread:
        past = scene.thread.radius * (motion.tongs[:, 2:] - motion.body[:, 3:])
    else:
        past = motion.tongs[:, :2] - motion.body[:, 1:3]
    passing = np.linalg.norm(np.gradient(past, motion.times, axis=0), axis=1)
    fast = (pads.damping + pads.viscous) * passing[:, np.newaxis]
    tilts = np.array([scene.jaws.tilt_left, scene.jaws.tilt_right])
    share = np.array([1.0, pads.asymmetry])
    most = motion.normal * (share * (pads.static + fast) + np.sin(tilts))
    sheared = np.linalg.norm(performance.forces.reshape(-1, 2, 3)[:, :, :2], axis=2)
    assert (sheared - most)[calm].max() < INERTIA


def test_nothing_is_felt_before_the_first_contact_and_after_the_last(performance):
    times, away = performance.motion.times, untapped(performance)
    grab = named(performance, "grab")[0].start
    lost = max(happened(performance, "contact lost") + happened(performance, "jaws part"))
    for rest in (away & (times < grab), away & (times > lost + 0.1)):
        assert rest.sum() > 0.2 * RATE
        assert np.abs(performance.forces[rest]).max() < INERTIA


@pytest.mark.parametrize("task", ["LEGO", "cartridge", "foam"])
def test_both_jaws_press_alike_while_nothing_else_holds_the_body(performed, task):
    performance = performed[task][0]
    grabbed = [during(performance, s) for s in performance.actions if s.action == "hold"]
    left, right = np.median(performance.motion.normal[np.logical_or.reduce(grabbed)], axis=0)
    assert left == pytest.approx(right, rel=0.1)


def test_what_presses_on_a_jaw_is_what_its_dome_feels(performance):
    calm = untapped(performance) & (performance.motion.normal.min(axis=1) > 0.5)
    sizes = np.linalg.norm(performance.forces[calm].reshape(-1, 2, 3), axis=2)
    # Friction adds to it, tilted or not.
    assert np.mean(sizes >= performance.motion.normal[calm] - 0.3) > 0.99


def test_a_finger_taps_the_left_sensor_before_and_after_the_actions(performance):
    first, last = performance.taps
    assert first + 0.015 <= performance.actions[0].start
    assert last - 0.015 >= performance.actions[-1].end - 1e-9
    times = performance.motion.times
    for tap in performance.taps:
        near = np.abs(times - tap) < 0.02
        peak = np.argmax(-performance.forces[near, 2])
        assert 1.0 < -performance.forces[near, 2][peak] < 7.0
        assert times[near][peak] == pytest.approx(tap, abs=0.006)
        assert np.abs(performance.forces[near][:, 3:]).max() < 0.3


def test_without_taps_there_are_none_and_progress_ends_where_all_is_done():
    steps = []
    (untouched,) = finish(perform_job("marker", SEED, [5], taps=False), steps.append)
    done = [step.done for step in steps]
    assert done == sorted(done)
    assert steps[-1].done <= steps[-1].total
    assert untouched.taps == ()
    assert untouched.actions[0].start == 0.0
    assert np.abs(untouched.forces[: round(0.2 * RATE)]).max() < INERTIA
