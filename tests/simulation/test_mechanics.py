"""The equations of motion against energy, momentum and closed forms."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq

from forcelab.errors import InputError
from forcelab.simulation.hand import Trajectory
from forcelab.simulation.mechanics import (
    STRAIGHTENING,
    Layout,
    Mechanics,
    friction_limit,
    left_out,
    sliding_friction,
    socket_push,
    stack_numbers,
    table_under,
    width_at,
)
from forcelab.simulation.scene import (
    Jaws,
    Pads,
    Profile,
    Socket,
    Thread,
)
from forcelab.simulation.solvers import integrate
from tests.simulation.mechanisms import lsoda, rk45, rosenbrock
from tests.simulation.scenes import (
    FREE,
    SCENES,
    SLIPPERY,
    energy,
    follow,
    mechanics,
    named,
    power,
    scattered,
    state,
    without_losses,
)

COMMANDS = {"left jaw": 0.018, "right jaw": 0.017, "tap": 0.5}
LOSSLESS = [name for name in SCENES if name != "twist"]
seeds = st.integers(0, 2**32 - 1)


def stacked_lanes(name: str, lanes: int) -> Mechanics:
    """Lanes of one kind that differ in mass and command."""
    scene = SCENES[name]
    scenes = [replace(scene, body=replace(scene.body, mass=0.02 * (i + 1))) for i in range(lanes)]
    width = len(mechanics(scene).layout.commands)
    rng = np.random.default_rng(3)
    return Mechanics(scenes, Trajectory.through([0.02 * rng.random((9, width)) for _ in scenes]))


@settings(max_examples=5, deadline=None)
@pytest.mark.parametrize("name", SCENES)
@given(seed=seeds)
def test_nothing_undriven_gives_energy_away(name, seed):
    system = mechanics(SCENES[name], COMMANDS)
    states = scattered(system, np.random.default_rng(seed), 1000)
    gained = power(system, states, COMMANDS)
    assert gained.max() < 1e-5  # W, of tens
    assert np.median(gained) < -1e-4


@settings(max_examples=5, deadline=None)
@pytest.mark.parametrize("name", LOSSLESS)
@given(seed=seeds)
def test_without_damping_and_friction_energy_is_neither_lost_nor_gained(name, seed):
    system = mechanics(without_losses(SCENES[name]), COMMANDS)
    states = scattered(system, np.random.default_rng(seed), 1000)
    # Across the kink where contact begins, the difference quotient is off by K v^2 h.
    assert np.abs(power(system, states, COMMANDS)).max() < 1e-3
    assert np.median(np.abs(power(system, states, COMMANDS))) < 1e-7


@pytest.mark.parametrize(
    ("name", "start", "end", "extent"),
    [
        # From the thick part over the rim and the taper until nothing is between the jaws.
        ("tapering", {"left jaw": 0.019, "right jaw": 0.019, "tongs z rate": 2.0}, 0.025, 0.045),
        # Across the click, onto the bottom and back.
        (
            "socket",
            {
                "left jaw": 0.019,
                "right jaw": 0.019,
                "tongs y": 0.02,
                "body y": 0.0203,
                "body z rate": -0.8,
                "body x": 1e-3,
                "in the socket": 1.0,
            },
            0.015,
            0.004,
        ),
    ],
)
def test_energy_is_kept_all_along_a_motion_through_width_and_click(name, start, end, extent):
    scene = replace(without_losses(SCENES[name]), gravity=0.0)
    scene = replace(scene, arm=replace(scene.arm, stiffness=0.0))
    system = mechanics(scene, {"left jaw": 0.012, "right jaw": 0.012})
    motion = follow(system, state(system, start), end, "DOP853", rtol=1e-8, atol=1e-10)
    q = named(system, motion.y)
    moved = q["tongs z"] if name == "tapering" else -q["body z"]
    assert moved.max() > extent
    held = energy(system, motion.y, {"left jaw": 0.012, "right jaw": 0.012})
    assert np.ptp(held) < 1e-6 * held[0]


def test_a_body_that_is_let_fall_and_bounces_only_loses_energy():
    scene = replace(SCENES["lift"], body=replace(SCENES["lift"].body, damping=0.2))
    system = mechanics(scene, {"left jaw": 0.0199, "right jaw": 0.0199})
    grip = {"left jaw": 0.0199, "right jaw": 0.0199}
    start = state(system, {**grip, "body z": 0.03, "body x rate": 0.2, "tongs z": 0.01})
    motion = follow(system, start, 0.15, rtol=1e-6, atol=1e-10)
    held = energy(system, motion.y, grip)
    q = named(system, motion.y)
    assert q["body z"].min() < 0.0
    # What the bristles store is not counted: they give a little of it back.
    assert np.diff(held).max() < 1e-4 * held[0]
    assert held[-1] < 0.2 * held[0]


@given(seed=seeds)
@settings(max_examples=10, deadline=None)
def test_forces_between_jaws_body_tongs_and_cap_keep_momentum(seed):
    rng = np.random.default_rng(seed)
    for name in ("grip", "curved", "tapering", "twist"):
        scene = replace(SCENES[name], jaws=FREE, holder=None, gravity=0.0)
        if scene.arm:
            scene = replace(scene, arm=replace(scene.arm, stiffness=0.0, damping=0.0))
        if scene.thread:
            loose = Thread(0.008, 2e-6, 1e-12, 1e-12, wrist_stiffness=0.0, wrist_damping=0.0)
            scene = replace(scene, thread=loose)
        system = mechanics(scene)
        q = named(system, system.rates(np.zeros(200), scattered(system, rng, 200)))
        jaws, body = scene.jaws.mass, scene.body.mass
        right, left = q["right jaw rate"], q["left jaw rate"]
        along_x = jaws * right - jaws * left + body * q["body x rate"]
        assert np.abs(along_x).max() < 1e-9 * np.abs(jaws * right).max()
        pairs = []
        if scene.arm:
            pairs = [(scene.arm.mass * q["tongs z rate"], body * q["body z rate"])]
        if scene.thread:
            wrist = scene.thread.wrist_inertia * q["wrist angle rate"]
            pairs = [(wrist, scene.thread.inertia * q["cap angle rate"])]
        for first, second in pairs:
            assert np.abs(first + second).max() < 1e-9 * np.abs(first).max() > 0


@pytest.mark.parametrize("name", ["grip", "curved"])
def test_a_static_grip_presses_as_springs_in_series_do(name):
    scene = SCENES[name]
    body, jaws = scene.body, scene.jaws
    left, right = 0.016, 0.0155
    stiff_left, stiff_right = jaws.stiffness, jaws.asymmetry * jaws.stiffness

    def gap(force: float) -> float:
        sunk = 2.0 * (force / body.stiffness) ** (1.0 / body.exponent)
        jaws_apart = left + right + force / stiff_left + force / stiff_right
        return 2.0 * body.half_width - jaws_apart - sunk

    force = brentq(gap, 0.0, 100.0, xtol=1e-13)
    system = mechanics(scene, {"left jaw": left, "right jaw": right})
    sunk = (force / body.stiffness) ** (1.0 / body.exponent)
    place = left + force / stiff_left
    balance = state(
        system,
        {
            "left jaw": place,
            "right jaw": right + force / stiff_right,
            "body x": body.half_width - place - sunk,
        },
    )
    assert np.abs(system.rates(np.zeros(1), balance[:, None])).max() < 1e-8

    apart = state(system, {"left jaw": 0.03, "right jaw": 0.025})
    rest = follow(system, apart, 3.0).y[:, -1]
    sensor_forces = system.sensor_forces(np.zeros(1), rest[:, None])[:, 0]
    assert sensor_forces[[2, 5]] == pytest.approx([-force, -force], abs=1e-6)
    assert rest[:3] == pytest.approx(balance[:3], abs=1e-8)


def test_a_body_that_nothing_touches_falls_freely_and_leaves_the_tongs_alone():
    system = mechanics(SCENES["lift"], {"left jaw": 0.05, "right jaw": 0.05})
    open_ = {"left jaw": 0.05, "right jaw": 0.05, "body z": 1.0, "body z rate": 0.3}
    end = named(system, follow(system, state(system, open_), 0.3).y[:, -1])
    assert end["body z"] == pytest.approx(1.0 + 0.3 * 0.3 - 0.5 * 9.81 * 0.09, abs=1e-9)
    assert end["body z rate"] == pytest.approx(0.3 - 9.81 * 0.3, abs=1e-8)
    assert end["tongs z"] == 0.0
    assert end["left jaw"] == pytest.approx(0.05, abs=1e-12)


def test_a_drop_on_the_table_is_that_of_spring_and_dashpot_until_they_would_pull():
    scene = SCENES["lift"]
    mass, stiffness, damping = scene.body.mass, scene.ground.stiffness, scene.ground.damping
    system = mechanics(scene, {"left jaw": 0.05, "right jaw": 0.05})
    speed = 0.4
    start = state(system, {"left jaw": 0.05, "right jaw": 0.05, "body z rate": -speed})

    rest = -mass * 9.81 / stiffness
    decay = damping / (2.0 * mass)
    omega = np.sqrt(stiffness / mass - decay**2)

    def place(t):
        a, b = -rest, (-speed - decay * rest) / omega
        wave = a * np.cos(omega * t) + b * np.sin(omega * t)
        slope = omega * (b * np.cos(omega * t) - a * np.sin(omega * t))
        shrink = np.exp(-decay * t)
        return rest + shrink * wave, shrink * (slope - decay * wave)

    def push(t):
        z, v = place(t)
        return -stiffness * z - damping * v

    free = brentq(push, 0.6 * np.pi / omega, 1.2 * np.pi / omega)
    z_free, v_free = place(free)
    assert z_free < 0 < v_free  # let go while the table is still dented

    times = np.linspace(0.0, 2.0 * free, 200)
    # The start is just inside: the dashpot sets in with a jump at the surface.
    start[list(system.names).index("body z")] = -1e-15
    motion = follow(system, start, times[-1], "DOP853", t_eval=times, max_step=free / 40)
    flown = np.maximum(times - free, 0.0)
    expected = place(np.minimum(times, free))[0] + v_free * flown - 0.5 * 9.81 * flown**2
    assert named(system, motion.y)["body z"] == pytest.approx(expected, abs=1e-9)


def test_lifting_is_felt_as_the_grip_and_the_weight():
    scene = SCENES["lift"]
    weight = scene.body.mass * scene.gravity
    force, pads = 5.0, scene.arm.pads
    grip = scene.body.half_width - force / scene.body.stiffness
    command = {"left jaw": grip - force / 1200.0, "right jaw": grip - force / 1200.0}
    command["tongs z"] = 0.1 + weight / scene.arm.stiffness
    system = mechanics(scene, command)
    bent = 0.5 * weight / (force * pads.stiffness)
    bristles = {"left jaw bristle z": bent, "right jaw bristle z": bent}
    lifted = {"left jaw": grip, "right jaw": grip, "tongs z": 0.1, "body z": 0.1}
    balance = state(system, {**lifted, **bristles})[:, None]
    assert np.abs(system.rates(np.zeros(1), balance)).max() < 1e-9
    sensor_forces = system.sensor_forces(np.zeros(1), balance)[:, 0].reshape(2, 3)
    assert sensor_forces[:, 2] == pytest.approx([-force, -force])
    assert sensor_forces[:, 1].sum() == pytest.approx(-weight)
    assert sensor_forces[:, 0].tolist() == [0.0, 0.0]


def test_a_twist_is_felt_the_other_way_round_by_the_other_jaw():
    scene = replace(SCENES["twist"], jaws=Jaws(dome=0.0))
    system = mechanics(scene, {"left jaw": 0.015, "right jaw": 0.015})
    turning = {"left jaw": 0.019, "right jaw": 0.019, "wrist angle rate": 1.0}
    column = state(system, turning)[:, None]
    left, right = system.sensor_forces(np.zeros(1), column)[:, 0].reshape(2, 3)
    # Turned anticlockwise, the left jaw moves towards -y, and the cap holds it back.
    assert left[0] > 0.01
    assert right[0] == -left[0]
    assert named(system, system.rates(np.zeros(1), column))["cap angle rate"] > 0
    assert named(system, system.rates(np.zeros(1), column))["wrist angle rate"] < 0


def test_domes_in_the_air_feel_their_own_inertia():
    scene = replace(SCENES["held"], jaws=Jaws(dome=0.01, asymmetry=2.0))
    system = mechanics(scene, {"left jaw": 0.06, "right jaw": 0.06, "tongs y": 0.02})
    column = state(system, {"left jaw": 0.05, "right jaw": 0.05})[:, None]
    sensor_forces = system.sensor_forces(np.zeros(1), column)[:, 0]
    sideways = -0.01 * 700.0 * 0.02 / 0.35
    outwards = 0.01 * 1200.0 * 0.01 / 0.05
    expected = [sideways, 0.0, outwards, sideways, 0.0, 2.0 * outwards]
    assert sensor_forces == pytest.approx(expected, abs=1e-12)

    twist = replace(SCENES["twist"], jaws=Jaws(dome=0.01))
    system = mechanics(twist, {"left jaw": 0.05, "right jaw": 0.05, "wrist angle": 0.1})
    column = state(system, {"left jaw": 0.05, "right jaw": 0.05})[:, None]
    around = 0.01 * twist.thread.radius * 0.9 * 0.1 / 6e-4
    sensor_forces = system.sensor_forces(np.zeros(1), column)[:, 0]
    # Speeding up anticlockwise, the left dome is driven towards -y and lags towards +y.
    assert sensor_forces == pytest.approx([around, 0, 0, -around, 0, 0], abs=1e-12)


def test_what_moves_alone_is_held_back_by_its_own_damper():
    scene = SCENES["held"]
    jaws = {"left jaw": 0.05, "right jaw": 0.05}
    system = mechanics(scene, jaws)
    dampers = {
        "left jaw": scene.jaws.damping / scene.jaws.mass,
        "tongs y": scene.arm.damping / scene.arm.mass,
        "body x": scene.holder.damping / scene.body.mass,
        "body z": scene.holder.damping / scene.body.mass,
    }
    for name, expected in dampers.items():
        moving = state(system, {**jaws, f"{name} rate": 0.1})[:, None]
        slowed = named(system, system.rates(np.zeros(1), moving)[:, 0])
        assert slowed[f"{name} rate"] == pytest.approx(-0.1 * expected)


def test_a_tap_presses_the_left_dome_alone_and_pushes_its_jaw_outwards():
    system = mechanics(SCENES["grip"], {"left jaw": 0.05, "right jaw": 0.05, "tap": 4.0})
    pushed = state(system, {"left jaw": 0.05 + 4.0 / 1200.0, "right jaw": 0.05})[:, None]
    assert np.abs(system.rates(np.zeros(1), pushed)).max() < 1e-9
    assert system.sensor_forces(np.zeros(1), pushed)[:, 0] == pytest.approx([0, 0, -4.0, 0, 0, 0])


def test_a_tilted_sensor_feels_part_of_the_grip_as_tangential_but_no_more_force():
    straight = mechanics(SCENES["lift"], COMMANDS)
    jaws = Jaws(tilt_left=0.2, azimuth_left=np.pi / 2.0, tilt_right=0.1)
    tilted = mechanics(replace(SCENES["lift"], jaws=jaws), COMMANDS)
    column = state(straight, {"left jaw": 0.018, "right jaw": 0.018, "tongs z rate": 0.01})
    here = straight.sensor_forces(np.zeros(1), column[:, None]).reshape(2, 3)
    tilted_forces = tilted.sensor_forces(np.zeros(1), column[:, None]).reshape(2, 3)
    assert np.linalg.norm(tilted_forces, axis=1) == pytest.approx(np.linalg.norm(here, axis=1))
    inward = -here[0, 2]
    assert tilted_forces[0, 1] == pytest.approx(here[0, 1] * np.cos(0.2) + inward * np.sin(0.2))
    assert tilted_forces[1, 0] == pytest.approx(-here[1, 2] * np.sin(0.1))


@pytest.mark.parametrize("name", SCENES)
def test_a_lane_of_a_batch_is_the_same_alone_bit_for_bit(name):
    batch = stacked_lanes(name, 5)
    states = scattered(batch, np.random.default_rng(11), 5)
    times = np.linspace(0.0, 0.03, 5)
    rates, watched = batch.rates(times, states), batch.watched(times, states)
    assert np.array_equal(rates[: batch.dof], states[batch.dof : 2 * batch.dof])
    for lane in range(5):
        alone = batch.lane(lane)
        now, column = times[lane : lane + 1], states[:, lane : lane + 1]
        assert np.array_equal(alone.rates(now, column)[:, 0], rates[:, lane])
        assert np.array_equal(alone.watched(now, column)[:, 0], watched[:, lane])
    some = batch.subset(np.array([3, 1]))
    assert np.array_equal(some.rates(times[[3, 1]], states[:, [3, 1]]), rates[:, [3, 1]])
    assert np.array_equal(some.scales, batch.scales[:, [3, 1]])


@pytest.mark.parametrize("name", SCENES)
def test_a_lane_that_is_lost_does_not_harm_its_neighbours(name):
    batch = stacked_lanes(name, 3)
    states = scattered(batch, np.random.default_rng(12), 3)
    states[0, 0], states[1, 0] = -0.01, -0.01  # jaws that meet
    rates = batch.rates(np.zeros(3), states)
    states[:-1, 1] = np.nan
    lost = batch.rates(np.zeros(3), states)
    assert np.array_equal(lost[:, [0, 2]], rates[:, [0, 2]])


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("stiffness", [1e1, 1e8])
@pytest.mark.parametrize("mass", [1e-6, 1e2])
def test_rates_are_finite_numbers_over_huge_ranges(name, stiffness, mass):
    scene = SCENES[name]
    scene = replace(scene, body=replace(scene.body, stiffness=stiffness, mass=mass))
    system = mechanics(scene, COMMANDS)
    rng = np.random.default_rng(2)
    size = 10.0 ** rng.uniform(-12.0, 6.0, (len(system.names), 500))
    states = size * rng.choice([-1.0, 1.0], size.shape)
    if system.layout.socket:
        states[-1] = rng.integers(0, 2, 500)
    assert np.isfinite(system.rates(np.zeros(500), states)).all()
    assert np.isfinite(system.watched(np.zeros(500), states)).all()
    assert np.isfinite(system.sensor_forces(np.zeros(500), states)).all()
    assert (system.scales > 0).all()
    assert np.isfinite(system.scales).all()


def test_event_functions_do_not_jump_but_where_the_state_does():
    for name, scene in SCENES.items():
        system = mechanics(scene, COMMANDS)
        rng = np.random.default_rng(8)
        first, second = scattered(system, rng, 1), scattered(system, rng, 1)
        if system.layout.socket:
            second[-1] = first[-1] = 1.0
            first[-3:-1] = 0.0
        if system.layout.ground:  # across the surface the dashpot's force jumps, and its slip
            first[system.names.index("body z")] = second[system.names.index("body z")] = -1e-3
        share = np.linspace(0.0, 1.0, 20001)
        fine = system.watched(np.zeros(20001), first + share * (second - first))
        leaps = [np.abs(np.diff(v, axis=1)).max(axis=1) for v in (fine, fine[:, ::10])]
        assert (leaps[0] <= 0.2 * leaps[1] + 1e-12).all(), name


def test_contact_is_lost_at_the_tip_even_by_jaws_that_squeeze_each_other():
    system = mechanics(SCENES["tapering"], {"left jaw": -0.01, "right jaw": -0.01})
    shut = state(system, {"left jaw": -1e-4, "right jaw": -1e-4})
    shut = np.repeat(shut[:, None], 2, axis=1)
    shut[system.names.index("tongs z")] = [0.0399, 0.0401]
    before, after = system.watched(np.zeros(2), shut)[:2].T
    assert (before > 0).all()
    assert (after < 0).all()


def test_entering_and_leaving_the_socket_change_the_mode_alone():
    system = mechanics(SCENES["socket"])
    enters = system.events.index(("into the socket", ""))
    leaves = system.events.index(("out of the socket", ""))
    outside = state(system, {"body y": 0.02})
    inside = system.jump(enters, True, outside)
    assert inside[-1] == 1.0
    assert np.array_equal(inside[:-1], outside[:-1])
    assert np.array_equal(system.jump(enters, False, outside), outside)
    assert np.array_equal(system.jump(leaves, True, inside), outside)
    assert np.array_equal(system.jump(0, True, inside), inside)


@pytest.mark.parametrize(
    ("places", "leaves"),
    [
        ({"body y": 0.02, "body z": -1e-4}, False),
        ({"body y": 0.0235, "body z": -1e-4}, False),  # the walls hold it
        ({"body y": 0.02, "body z": 4e-4}, False),
        ({"body y": 0.02, "body z": 6e-4}, True),
        ({"body y": 0.0235, "body z": 4e-4}, True),  # sideways, just above the studs
    ],
)
def test_a_body_leaves_the_socket_upwards_or_above_the_rim_sideways(places, leaves):
    system = mechanics(SCENES["socket"])
    column = state(system, {**places, "in the socket": 1.0})[:, None]
    row = system.events.index(("out of the socket", ""))
    assert (system.watched(np.zeros(1), column)[row, 0] > 0) == leaves


def test_a_frictionless_pull_leaves_the_body_where_it_is():
    scene = replace(SCENES["held"], arm=replace(SCENES["held"].arm, pads=SLIPPERY))
    system = mechanics(scene, {**COMMANDS, "tongs z": 0.1})
    end = named(system, follow(system, state(system, {"left jaw": 0.02}), 0.2).y[:, -1])
    assert end["tongs z"] > 0.02
    assert abs(end["body z"]) < 1e-9


def turned(scene, angle, seconds, end):
    """The wrist turned at an even speed for some seconds, then held; the motion and the command."""
    count = round(end / 0.005)
    knots = np.zeros((count + 1, 4))
    knots[:, :2] = 0.01
    knots[:, 2] = angle * np.minimum(np.linspace(0.0, end / seconds, count + 1), 1.0)
    command = Trajectory.through([knots])
    system = Mechanics([scene], command)
    grip = state(system, {"left jaw": 0.0171, "right jaw": 0.0171})
    motion = follow(system, grip, end, rtol=1e-7, atol=1e-9)
    return named(system, motion.y), command.at(motion.t)[2]


def test_a_cap_sticks_below_the_torque_at_rest_and_turns_with_that_in_motion_above():
    thread = Thread(0.008, 2e-6, static=0.03, kinetic=0.02, pads=Pads(2.0, 2.0))
    scene = replace(SCENES["twist"], thread=thread)
    give = thread.static / thread.kinetic / thread.stiffness

    held, command = turned(scene, 0.6 * (thread.static / 0.9 + give), 0.5, 1.0)
    torque = 0.9 * (command[-1] - held["wrist angle"][-1])
    share = torque / thread.static
    assert 0.5 < share < 0.7
    assert held["cap angle"][-1] == pytest.approx(share * give, rel=1e-2)
    assert abs(held["cap angle rate"][-1]) < 1e-5

    moved, command = turned(scene, 0.4, 1.0, 1.0)
    late = moved["cap angle"] > 0.2
    speed = 0.4
    steady = 0.02 + 0.01 * np.exp(-((speed / thread.stribeck) ** 2)) + 0.02 * thread.viscous * speed
    middle = late & (command < 0.36)
    torque = 0.9 * (command - moved["wrist angle"]) + 0.02 * (speed - moved["wrist angle rate"])
    assert torque[middle] == pytest.approx(steady, rel=2e-3)


def has(name, word):
    return any(word in row for row in Layout.of(SCENES[name]).names)


@pytest.mark.parametrize(
    ("name", "states"),
    [("grip", 6), ("lift", 13), ("held", 18), ("tapering", 12), ("socket", 22), ("twist", 13)],
)
def test_a_scene_has_exactly_the_states_of_its_parts(name, states):
    layout = Layout.of(SCENES[name])
    assert len(layout.names) == len(set(layout.names)) == states
    assert has(name, "bristle") == (name != "grip")
    assert has(name, "in the socket") == has(name, "socket bristle") == (name == "socket")
    assert has(name, "table bristle") == (name in {"lift", "socket"})
    assert has(name, "thread bristle") == has(name, "wrist") == (name == "twist")
    assert has(name, "tongs y") == (name in {"held", "socket"})


@pytest.mark.parametrize("name", SCENES)
def test_only_events_of_parts_that_are_there_are_watched(name):
    events = " ".join(chain.from_iterable(mechanics(SCENES[name]).events))
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


#: Closed forms are met by one solver as by another: what each of them does is tested by itself.
SOLVER = lsoda(tolerance=1e-6)


def event_times(solution, kind, lane=0):
    """The times of one kind of event."""
    return [event.time for event in solution.events[lane] if event.kind == kind]


def test_a_falling_body_is_set_down_and_lifted_at_the_times_of_free_fall():
    scene = without_losses(SCENES["lift"])
    system = mechanics(scene, {"left jaw": 0.05, "right jaw": 0.05})
    start = state(system, {"left jaw": 0.05, "right jaw": 0.05, "body z": 0.02})
    solution = integrate(system, start[:, None], np.linspace(0.0, 0.2, 201), SOLVER)
    falls = np.sqrt(2.0 * 0.02 / 9.81)
    omega, rest = np.sqrt(4e4 / 0.05), 0.05 * 9.81 / 4e4
    speed = 9.81 * falls
    # Through the table: a swing about the dent in which it would rest.
    dented = 2.0 * (np.pi - np.arctan2(speed / omega, rest)) / omega
    assert event_times(solution, "body set down") == pytest.approx(
        [falls, 3.0 * falls + dented], abs=2e-7
    )
    assert event_times(solution, "body lifted")[0] == pytest.approx(falls + dented, abs=2e-7)


def test_a_jaw_meets_and_loses_a_body_after_half_a_swing():
    scene = replace(without_losses(SCENES["grip"]), jaws=FREE)
    system = mechanics(scene)
    start = state(system, {"left jaw": 0.03, "right jaw": 0.1, "left jaw rate": -0.5})
    solution = integrate(system, start[:, None], np.linspace(0.0, 0.1, 101), SOLVER)
    reduced = 0.5 * 0.05
    half = np.pi * np.sqrt(reduced / scene.body.stiffness)
    assert event_times(solution, "left jaw: contact made") == pytest.approx([0.02], abs=1e-7)
    assert event_times(solution, "left jaw: contact lost") == pytest.approx([0.02 + half], abs=1e-7)
    end = named(system, solution.states[-1, :, 0])
    assert end["left jaw rate"] == pytest.approx(0.0, abs=1e-6)  # equal masses swap their speeds
    assert end["body x rate"] == pytest.approx(0.5, rel=1e-6)


def test_a_pulled_grip_slips_when_friction_at_rest_is_used_up():
    scene = replace(SCENES["held"], jaws=Jaws(dome=0.0))
    force, growth = 4.0, 8.0
    grip = 0.02 - force / scene.body.stiffness
    knots = np.zeros((301, 5))
    knots[:, :2] = grip - force / 1200.0
    knots[:, 3] = growth / scene.arm.stiffness * 0.005 * np.arange(301)
    system = Mechanics([scene], Trajectory.through([knots]))
    start = state(system, {"left jaw": grip, "right jaw": grip})
    times = np.linspace(0.0, 1.5, 1501)
    solution = integrate(system, start[:, None], times, SOLVER)
    begins = event_times(solution, "left jaw: slip begins")
    assert begins == event_times(solution, "right jaw: slip begins")
    fy = system.sensor_forces(times, solution.states[:, :, 0].T).reshape(2, 3, -1)[:, 1]
    limit = scene.arm.pads.static * force
    assert np.abs(fy).max() == pytest.approx(0.96 * limit, rel=0.015)
    at = np.interp(begins[0], times, -fy.mean(axis=0))
    # Told at 95 % of what the bristles bear at the speed with which they already yield.
    assert at == pytest.approx(0.95 * limit, rel=0.02)
    height = solution.states[:, system.names.index("tongs z"), 0]
    held = solution.states[:, system.names.index("body z"), 0]
    stuck = times < begins[0]
    assert (height - held)[stuck].max() < 1.5 * scene.arm.pads.static / scene.arm.pads.stiffness
    assert (height - held)[-1] > 4.0 * scene.arm.pads.static / scene.arm.pads.stiffness


def test_a_body_clicks_in_when_the_closed_form_says():
    scene = replace(without_losses(SCENES["socket"]), gravity=0.0)
    socket, mass, speed = scene.socket, scene.body.mass, 0.9
    system = mechanics(scene, {"left jaw": 0.05, "right jaw": 0.05})
    start = state(
        system,
        {
            "left jaw": 0.05,
            "right jaw": 0.05,
            "body y": socket.place,
            "body z": 9e-4,
            "body z rate": -speed,
        },
    )

    def pace(depth):
        u = min(depth / (0.25 * socket.depth), 1.0)
        bump = np.exp(0.5 - 0.5 * ((depth - socket.snap_depth) / socket.snap_width) ** 2)
        stored = u * u * (3.0 - 2.0 * u) * socket.snap * socket.snap_width * bump
        return 1.0 / np.sqrt(speed**2 - 2.0 * stored / mass)

    way = quad(pace, 0.0, 0.001)[0] + quad(pace, 0.001, socket.snap_depth)[0]
    solution = integrate(system, start[:, None], np.linspace(0.0, 0.02, 201), SOLVER)
    kinds = [event.kind for event in solution.events[0]]
    assert event_times(solution, "into the socket") == pytest.approx([0.001], abs=1e-8)
    assert event_times(solution, "snap in") == pytest.approx([0.001 + way], abs=1e-7)
    order = ["into the socket", "snap in", "snap out", "out of the socket"]
    assert [kind for kind in kinds if kind in order] == order
    end = named(system, solution.states[-1, :, 0])
    assert end["body z rate"] == pytest.approx(speed, rel=1e-5)  # it bounced off the bottom
    assert end["in the socket"] == 0.0


@pytest.mark.parametrize("stiffness", [1e1, 1e8])
@pytest.mark.parametrize("mass", [1e-6, 1e2])
def test_a_bounce_is_right_over_seven_decades_of_stiffness_and_eight_of_mass(stiffness, mass):
    scene = without_losses(SCENES["grip"])
    scene = replace(
        scene,
        jaws=replace(FREE, mass=100.0),
        body=replace(scene.body, stiffness=stiffness, mass=mass),
    )
    system = mechanics(scene)
    reduced = mass * 100.0 / (mass + 100.0)
    speed = 1.0 / np.sqrt(stiffness * reduced)  # presses with one newton at most
    start = state(system, {"left jaw": 0.02, "right jaw": 9.0, "body x rate": -speed})
    half = np.pi * np.sqrt(reduced / stiffness)
    times = np.linspace(0.0, 1.5 * half, 7)
    solution = integrate(system, start[:, None], times, rk45(tolerance=1e-6))
    rebound = speed * (100.0 - mass) / (100.0 + mass)
    x = named(system, solution.states[:, :, 0].T)
    assert x["body x rate"][-1] == pytest.approx(rebound, abs=1e-4 * speed)
    assert event_times(solution, "left jaw: contact lost") == pytest.approx(
        [half], rel=1e-4, abs=2e-10
    )
    depth = 0.02 - x["left jaw"] - x["body x"]
    assert stiffness * depth[2] == pytest.approx(1.0, rel=1e-4)


@pytest.mark.parametrize("stiffness", [1e3, 1e6])
@pytest.mark.parametrize("mass", [1e-6, 1e2])
def test_a_grip_presses_as_its_springs_do_whether_soft_or_stiff_light_or_heavy(stiffness, mass):
    scene = SCENES["grip"]
    scene = replace(scene, body=replace(scene.body, stiffness=stiffness, mass=mass))
    system = mechanics(scene, {"left jaw": 0.01, "right jaw": 0.01})
    start = state(system, {"left jaw": 0.0201, "right jaw": 0.0201})[:, None]
    times = np.linspace(0.0, 0.1, 11)
    solution = integrate(system, start, times, rosenbrock(tolerance=1e-3))
    force = 0.01 / (1.0 / 1200.0 + 1.0 / stiffness)
    sensor_forces = system.sensor_forces(times[-1:], solution.states[-1])[:, 0]
    assert sensor_forces[[2, 5]] == pytest.approx([-force, -force], abs=1e-3)


def test_a_grip_too_stiff_for_the_steps_allowed_is_refused_with_a_sentence():
    scene = replace(SCENES["grip"], body=replace(SCENES["grip"].body, stiffness=1e8, mass=1e-6))
    system = mechanics(scene, {"left jaw": 0.01, "right jaw": 0.01})
    start = state(system, {"left jaw": 0.0201, "right jaw": 0.0201})[:, None]
    times = np.linspace(0.0, 0.1, 11)
    with pytest.raises(InputError, match="demonstration 1 cannot be resolved"):
        integrate(system, start, times, rk45(max_steps=500))


SOCKET = Socket(place=0.02, depth=0.006, friction=4.0, snap=5.0, snap_depth=0.004, snap_width=5e-4)


def namespace(part):
    return stack_numbers([part])


def pushed(depths, socket=SOCKET, y=0.02, x=0.0, speed=0.0, inside=1.0):
    """Force (3, n) of the socket on a body at some depths, and how hard its walls hold it."""
    ones = np.ones(len(depths))
    place = np.stack([x * ones, y * ones, -depths])
    moving = np.stack([0.0 * ones, 0.0 * ones, speed * ones])
    return socket_push(place, moving, inside * ones, namespace(socket), np.zeros(1))


def rubbed(depths, socket, speed, bristle):
    """Force (n,) of the socket along z, with its walls' friction."""
    force, hold = pushed(depths, socket, speed=speed)
    moving, bent = np.full((2, 1, len(depths)), [[[speed]], [[bristle]]])
    return force[2] - sliding_friction(hold, moving, bent, namespace(socket).rubbing)[0][0]


def test_the_bumps_around_a_socket_have_the_slope_and_speed_that_they_seem_to():
    y = np.linspace(-0.05, 0.09, 14001)
    place, speed = np.stack([y, 0.0 * y]), np.stack([0.3 + 0.0 * y, 0.1 + 0.0 * y])
    table = table_under(place, speed, namespace(SOCKET))
    assert np.abs(np.gradient(table.depth, y) - table.slope)[1:-1].max() < 1e-4
    assert table.rate == pytest.approx(0.3 * table.slope - 0.1)
    assert table.depth.min() == 0.0
    assert table.depth.max() == pytest.approx(3e-4, rel=0.05)
    nearby = np.abs(y - 0.02) < 2e-4
    assert table.depth[nearby].max() < 1e-5  # it lies between the bumps
    assert table.depth[np.abs(y - 0.02) > 0.05].max() < 1e-7


def test_the_socket_takes_hold_of_a_body_without_a_jump_at_its_rim():
    force, hold = pushed(np.array([0.0, 1e-9]), y=0.0203, x=1e-3, speed=-0.1)
    rim, below = force.T
    assert rim.tolist() == [0.0, 0.0, 0.0]
    assert np.abs(below).max() < 1e-4
    assert hold[0] == 0.0
    assert 0.0 < hold[1] < 1e-4


def test_the_click_takes_exactly_its_force_in_and_out_when_the_walls_do_not_rub():
    depths = np.linspace(0.0, 0.0059, 11801)
    force = pushed(depths, replace(SOCKET, friction=0.0))[0][2]
    assert force.max() == pytest.approx(5.0, rel=1e-5)  # outwards: it takes so much to get in
    assert force.min() == pytest.approx(-5.0, rel=1e-5)
    assert depths[force.argmax()] < SOCKET.snap_depth < depths[force.argmin()]


def test_rubbing_walls_add_their_force_to_that_of_the_click_both_ways():
    walls = replace(SOCKET, rubbing=Pads(1.0, 1.0, viscous=0.0, damping=0.0, stiffness=3000.0))
    bent = 1.0 / 3000.0
    deep = np.array([0.0035, 0.0045])
    into = rubbed(deep, walls, -1e-6, -bent)
    out = rubbed(deep, walls, 1e-6, bent)
    assert into == pytest.approx([9.0, -1.0], rel=1e-5)
    assert out == pytest.approx([1.0, -9.0], rel=1e-5)


def test_a_body_outside_the_socket_feels_nothing_of_it_and_its_bristle_straightens():
    force, hold = pushed(np.array([-1e-3, 1e-3, 5e-3]), speed=-0.3, inside=0.0)
    assert not force.any()
    assert not hold.any()
    system = mechanics(SCENES["socket"])
    column = state(system, {"body z": -0.003, "body z rate": -0.3, "socket bristle": 2e-4})
    rates = system.rates(np.zeros(1), column[:, None])[:, 0]
    assert rates[system.names.index("socket bristle")] == pytest.approx(-2e-4 / STRAIGHTENING)


def test_friction_along_two_axes_is_that_along_their_sum():
    pads = namespace(Pads())
    velocity, bristle = np.array([0.03, 0.04]), np.array([1e-4, 1.5e-4])
    both, rates = sliding_friction(np.array([5.0]), velocity[:, None], bristle[:, None], pads)
    turn = np.array([[0.6, 0.8], [-0.8, 0.6]])
    turned, turned_rates = sliding_friction(
        np.array([5.0]), (turn @ velocity)[:, None], (turn @ bristle)[:, None], pads
    )
    assert turned == pytest.approx(turn @ both)
    assert turned_rates == pytest.approx(turn @ rates)
    limits = [friction_limit(v[:, None], pads) for v in (velocity, turn @ velocity)]
    assert limits[0] == pytest.approx(limits[1])


PROFILES = {
    "waves": Profile(0.03, 0.01, 0.1, 0.02),
    "rim": Profile(0.03, 0.01, 0.05, 0.02, rim=1e-3, rim_length=4e-3),
    "lopsided": Profile(0.03, 0.01, 0.1, 0.02, rim=1e-3, lopsided=0.5),
}


def test_a_body_is_wide_swells_before_its_end_and_ends_in_a_tip():
    profile = PROFILES["rim"]
    up = np.array([0.0, 0.005, 0.015, 0.03, 0.04, 0.05])
    width = width_at(up, np.array([0.004]), namespace(profile))
    middle = 0.5 * width.half.sum(axis=0)
    assert middle[:3] == pytest.approx([0.004, 0.0042, 0.0038])
    assert middle[3] == pytest.approx(0.005)
    assert middle[4:].tolist() == [0.0, 0.0]
    assert width.rest.tolist() == [1.0, 1.0, 1.0, 1.0, 0.0, 0.0]
    assert (width.tip > 0).tolist() == [True, True, True, True, False, False]
