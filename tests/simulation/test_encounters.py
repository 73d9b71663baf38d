"""Contacts, slips and clicks followed by the solvers: located where the closed forms say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scenes import FREE, SCENES, mechanics, named, state, without_losses
from scipy.integrate import quad

from forcelab.errors import InputError
from forcelab.simulation.hand import Trajectory
from forcelab.simulation.mechanics import Mechanics
from forcelab.simulation.scene import Jaws
from forcelab.simulation.solvers import Explicit, Lsoda, Rosenbrock, integrate

SOLVERS = [Explicit(tolerance=1e-6), Lsoda(tolerance=1e-6)]


def when(solution, kind, lane=0):
    """The times of one kind of event."""
    return [event.time for event in solution.events[lane] if event.kind == kind]


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_falling_body_is_set_down_and_lifted_at_the_times_of_free_fall(solver):
    scene = without_losses(SCENES["lift"])
    system = mechanics(scene, {"left jaw": 0.05, "right jaw": 0.05})
    start = state(system, {"left jaw": 0.05, "right jaw": 0.05, "body z": 0.02})
    solution = integrate(system, start[:, None], np.linspace(0.0, 0.2, 201), solver)
    falls = np.sqrt(2.0 * 0.02 / 9.81)
    omega, rest = np.sqrt(4e4 / 0.05), 0.05 * 9.81 / 4e4
    speed = 9.81 * falls
    # Through the table: a swing about the dent in which it would rest.
    dented = 2.0 * (np.pi - np.arctan2(speed / omega, rest)) / omega
    assert when(solution, "body set down") == pytest.approx([falls, 3.0 * falls + dented], abs=2e-7)
    assert when(solution, "body lifted")[0] == pytest.approx(falls + dented, abs=2e-7)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_jaw_meets_and_loses_a_body_after_half_a_swing(solver):
    scene = replace(without_losses(SCENES["grip"]), jaws=FREE)
    system = mechanics(scene)
    start = state(system, {"left jaw": 0.03, "right jaw": 0.1, "left jaw rate": -0.5})
    solution = integrate(system, start[:, None], np.linspace(0.0, 0.1, 101), solver)
    reduced = 0.5 * 0.05
    half = np.pi * np.sqrt(reduced / scene.body.stiffness)
    assert when(solution, "left jaw: contact made") == pytest.approx([0.02], abs=1e-7)
    assert when(solution, "left jaw: contact lost") == pytest.approx([0.02 + half], abs=1e-7)
    end = named(system, solution.states[-1, :, 0])
    assert end["left jaw rate"] == pytest.approx(0.0, abs=1e-6)  # equal masses swap their speeds
    assert end["body x rate"] == pytest.approx(0.5, rel=1e-6)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_pulled_grip_slips_when_friction_at_rest_is_used_up(solver):
    scene = replace(SCENES["held"], jaws=Jaws(dome=0.0))
    force, growth = 4.0, 8.0
    grip = 0.02 - force / scene.body.stiffness
    knots = np.zeros((301, 5))
    knots[:, :2] = grip - force / 1200.0
    knots[:, 3] = growth / scene.arm.stiffness * 0.005 * np.arange(301)
    system = Mechanics([scene], Trajectory.through([knots]))
    start = state(system, {"left jaw": grip, "right jaw": grip})
    times = np.linspace(0.0, 1.5, 1501)
    solution = integrate(system, start[:, None], times, solver)
    begins = when(solution, "left jaw: slip begins")
    assert begins == when(solution, "right jaw: slip begins")
    fy = system.sensor_forces(times, solution.states[:, :, 0].T).reshape(2, 3, -1)[:, 1]
    limit = scene.arm.pads.static * force
    assert np.abs(fy).max() == pytest.approx(0.96 * limit, rel=0.015)
    at = np.interp(begins[0], times, -fy.mean(axis=0))
    # Told at 95 % of what the bristles bear at the speed with which they already yield.
    assert at == pytest.approx(0.95 * limit, rel=0.02)
    given = solution.states[:, system.names.index("tongs z"), 0]
    held = solution.states[:, system.names.index("body z"), 0]
    stuck = times < begins[0]
    assert (given - held)[stuck].max() < 1.5 * scene.arm.pads.static / scene.arm.pads.stiffness
    assert (given - held)[-1] > 4.0 * scene.arm.pads.static / scene.arm.pads.stiffness


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_body_clicks_in_when_the_closed_form_says(solver):
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
    solution = integrate(system, start[:, None], np.linspace(0.0, 0.02, 201), solver)
    kinds = [event.kind for event in solution.events[0]]
    assert when(solution, "into the socket") == pytest.approx([0.001], abs=1e-8)
    assert when(solution, "snap in") == pytest.approx([0.001 + way], abs=1e-7)
    order = ["into the socket", "snap in", "snap out", "out of the socket"]
    assert [kind for kind in kinds if kind in order] == order
    end = named(system, solution.states[-1, :, 0])
    assert end["body z rate"] == pytest.approx(speed, rel=1e-5)  # it bounced off the bottom
    assert end["in the socket"] == 0.0


@pytest.mark.parametrize("stiffness", [1e1, 1e4, 1e8])
@pytest.mark.parametrize("mass", [1e-6, 1e-2, 1e2])
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
    solution = integrate(system, start[:, None], times, Explicit(tolerance=1e-6))
    rebound = speed * (100.0 - mass) / (100.0 + mass)
    x = named(system, solution.states[:, :, 0].T)
    assert x["body x rate"][-1] == pytest.approx(rebound, abs=1e-4 * speed)
    assert when(solution, "left jaw: contact lost") == pytest.approx([half], rel=1e-4, abs=2e-10)
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
    solution = integrate(system, start, times, Rosenbrock(tolerance=1e-3))
    force = 0.01 / (1.0 / 1200.0 + 1.0 / stiffness)
    sensor_forces = system.sensor_forces(times[-1:], solution.states[-1])[:, 0]
    assert sensor_forces[[2, 5]] == pytest.approx([-force, -force], abs=1e-3)


def test_a_grip_too_stiff_for_the_steps_allowed_is_refused_with_a_sentence():
    scene = replace(SCENES["grip"], body=replace(SCENES["grip"].body, stiffness=1e8, mass=1e-6))
    system = mechanics(scene, {"left jaw": 0.01, "right jaw": 0.01})
    start = state(system, {"left jaw": 0.0201, "right jaw": 0.0201})[:, None]
    times = np.linspace(0.0, 0.1, 11)
    with pytest.raises(InputError, match="demonstration 1 cannot be resolved"):
        integrate(system, start, times, Explicit(max_steps=500))


def test_a_batch_is_followed_as_each_of_its_lanes_alone():
    scene = SCENES["lift"]
    scenes = [
        replace(scene, body=replace(scene.body, mass=m, stiffness=k))
        for m, k in ((0.01, 1e3), (0.05, 3e3), (0.2, 3e4))
    ]
    values = np.zeros((101, 4))
    values[:, :2] = 0.016
    values[:, 2] = 0.01 * np.linspace(0.0, 1.0, 101)
    system = Mechanics(scenes, Trajectory.through([values] * 3))
    alone = system.lane(0)
    start = state(alone, {"left jaw": 0.021, "right jaw": 0.021})
    times = np.linspace(0.0, 0.2, 101)
    together = integrate(system, np.repeat(start[:, None], 3, axis=1), times, Rosenbrock())
    for lane in range(3):
        single = integrate(system.lane(lane), start[:, None], times, Rosenbrock())
        assert together.states[:, :, lane] == pytest.approx(single.states[:, :, 0], abs=1e-10)
        kinds = [event.kind for event in single.events[0]]
        assert [event.kind for event in together.events[lane]] == kinds
