"""What a scene carries and what it does without; scenes that do not fit together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scenes import SCENES, mechanics

from forcelab.errors import InputError
from forcelab.simulation.mechanics import Layout, left_out
from forcelab.simulation.scene import Arm, Body, Ground, Jaws, Pads, Profile, Socket, Thread


def has(name, word):
    return any(word in row for row in Layout.of(SCENES[name]).names)


def test_a_scene_without_tangential_motion_carries_no_friction_and_no_places():
    assert Layout.of(SCENES["grip"]).names == (
        "left jaw",
        "right jaw",
        "body x",
        "left jaw rate",
        "right jaw rate",
        "body x rate",
    )


@pytest.mark.parametrize(
    ("name", "states"),
    [("grip", 6), ("lift", 13), ("held", 18), ("tapering", 12), ("socket", 22), ("twist", 13)],
)
def test_a_scene_has_exactly_the_states_of_its_parts(name, states):
    layout = Layout.of(SCENES[name])
    assert len(layout.names) == states
    assert len(set(layout.names)) == states
    assert has(name, "bristle") == (name != "grip")
    assert has(name, "in the socket") == (name == "socket")
    assert has(name, "socket bristle") == (name == "socket")
    assert has(name, "table bristle") == (name in {"lift", "socket"})
    assert has(name, "thread bristle") == has(name, "wrist") == (name == "twist")
    assert has(name, "tongs y") == (name in {"held", "socket"})


@pytest.mark.parametrize("name", SCENES)
def test_only_events_of_parts_that_are_there_are_watched(name):
    events = " ".join(mechanics(SCENES[name]).events)
    assert ("slip" in events) == has(name, "bristle")
    assert ("snap" in events) == (name == "socket")
    assert ("body lifted" in events) == (name in {"lift", "socket"})


def test_what_is_left_out_says_how_many_states_that_saves():
    grip, lift = Layout.of(SCENES["grip"]), Layout.of(SCENES["lift"])
    held = Layout.of(SCENES["held"])
    assert "motion along y and z: 8 states" in left_out(SCENES["grip"])
    assert len(held.coordinates) - len(grip.coordinates) == 8 / 2
    assert "motion along y: 4 states, 2 jaw bristles" in left_out(SCENES["lift"])
    assert len(held.rubbing) - len(lift.rubbing) == 2 / 2
    assert any(line.startswith("socket and snap") for line in left_out(SCENES["lift"]))
    assert any(line.startswith("twist") for line in left_out(SCENES["lift"]))
    assert left_out(SCENES["socket"]) == (
        "twist: 4 states, no thread bristle",
        "width that varies: the body is as wide everywhere",
        "holder: nothing holds the body but jaws and table",
    )


@pytest.mark.parametrize("name", SCENES)
def test_scales_turn_a_newton_into_each_place_s_own_measure(name):
    system = mechanics(SCENES[name])
    assert system.scales.shape == (len(system.names), 1)
    assert (system.scales > 0).all()
    scales = dict(zip(system.names, system.scales[:, 0], strict=True))
    body = SCENES[name].body
    if body.exponent == 1.0:
        assert scales["left jaw"] == pytest.approx(1.0 / body.stiffness)
    else:
        # At ten newtons, a curved contact is as stiff as its law's slope there.
        deep = (10.0 / body.stiffness) ** (1.0 / body.exponent)
        force = body.stiffness * (deep + scales["left jaw"] * np.array([0.0, 0.01])) ** 1.5
        assert np.diff(force) == pytest.approx(0.01, rel=1e-2)


@pytest.mark.parametrize(
    ("build", "sentence"),
    [
        (lambda: Jaws(mass=0.0), "Jaws.mass must be finite and above zero, not 0.0."),
        (lambda: Jaws(damping=-1.0), "Jaws.damping must be finite and not negative, not -1.0."),
        (lambda: Body("block", 0.1, 0.01, float("nan")), "Body.stiffness must be finite and above"),
        (lambda: Body("block", 0.1, 0.01, 1e3, exponent=0.5), "exponent is at least 1"),
        (lambda: Pads(kinetic=0.0), "Pads.kinetic must be finite and above zero"),
        (lambda: Pads(static=0.5), "friction at rest is not below that in motion"),
        (lambda: Thread(0.01, 1e-6, 0.01, 0.02), "torque at rest is not below that in motion"),
        (lambda: Arm(axes=("z", "y")), "the axes are y, z or y and z"),
        (lambda: Profile(0.03, 0.0, 0.1, 0.02), "Profile.taper must be finite and above zero"),
        (lambda: Profile(0.03, 0.01, 0.1, 0.02, lopsided=1.0), "lopsided by less than 1"),
        (lambda: Socket(0.0, 0.004, 1.0, 1.0, 5e-4, 6e-4), "more than its width below the rim"),
        (lambda: Socket(0.0, 0.004, 1.0, 1.0, 5e-3, 6e-4), "not below the bottom"),
        (lambda: replace(SCENES["grip"], ground=Ground()), "a table needs an arm that moves"),
        (lambda: replace(SCENES["socket"], arm=Arm()), "a socket needs a table and y"),
        (lambda: replace(SCENES["twist"], arm=Arm()), "a thread and an arm are not combined"),
    ],
)
def test_scenes_that_make_no_sense_are_refused_with_a_sentence(build, sentence):
    with pytest.raises(InputError, match=sentence):
        build()


def test_parts_tell_what_scenes_of_a_batch_have_in_common():
    grip = SCENES["grip"]
    heavier = replace(grip, body=replace(grip.body, mass=1.0))
    assert heavier.parts == grip.parts
    assert len({scene.parts for scene in SCENES.values()}) == len(SCENES) - 1  # grip is curved
