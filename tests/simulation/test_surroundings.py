"""The table with its bumps, and the socket: slopes, energies and where they set in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scenes import SCENES, SLIPPERY, mechanics, state

from forcelab.simulation.mechanics import (
    STRAIGHTEN,
    sliding_friction,
    socket_push,
    stack_numbers,
    table_under,
)
from forcelab.simulation.scene import Pads, Profile, Socket, width_at

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


def test_a_plain_table_is_flat():
    table = table_under(np.array([[1e-3, -2e-3]]), np.array([[0.1, -0.2]]), None)
    assert table.depth.tolist() == [-1e-3, 2e-3]
    assert table.rate.tolist() == [-0.1, 0.2]
    assert table.slope is None


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


@pytest.mark.parametrize(("y", "x"), [(0.02, 0.0), (0.0203, 1e-3)])
def test_what_the_socket_takes_on_the_way_in_it_gives_back_on_the_way_out(y, x):
    depths = np.linspace(0.0, 0.0065, 13001)
    smooth = replace(SOCKET, friction=0.0)
    force = pushed(depths, smooth, y, x)[0]
    work = np.concatenate(
        [[0.0], np.cumsum(0.5 * (force[2, 1:] + force[2, :-1]) * np.diff(depths))]
    )
    walls = 0.5 * (SOCKET.walls * (y - 0.02) ** 2 + SOCKET.ends * x**2)
    bump = SOCKET.snap * 5e-4 * np.exp(0.5 - 0.5 * ((depths - 0.004) / 5e-4) ** 2)
    bottom = 0.5 * SOCKET.bottom * np.maximum(depths - 0.006, 0.0) ** 2
    inside = depths > 0.25 * SOCKET.depth
    assert np.abs(work - walls - bump - bottom)[inside].max() < 1e-7
    assert force[0, -1] == pytest.approx(-SOCKET.ends * x)
    assert force[1, -1] == pytest.approx(-SOCKET.walls * (y - 0.02))


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
    assert rates[system.names.index("socket bristle")] == pytest.approx(-2e-4 / STRAIGHTEN)


def test_friction_along_two_axes_is_that_along_their_sum():
    pads = namespace(Pads())
    velocity, bristle = np.array([0.03, 0.04]), np.array([1e-4, 1.5e-4])
    both, rates, limit = sliding_friction(
        np.array([5.0]), velocity[:, None], bristle[:, None], pads
    )
    turn = np.array([[0.6, 0.8], [-0.8, 0.6]])
    turned, turned_rates, same = sliding_friction(
        np.array([5.0]), (turn @ velocity)[:, None], (turn @ bristle)[:, None], pads
    )
    assert turned == pytest.approx(turn @ both)
    assert turned_rates == pytest.approx(turn @ rates)
    assert same == pytest.approx(limit)


def test_bristles_that_bear_nothing_straighten():
    pads = namespace(Pads())
    still = np.zeros((1, 2))
    force, rate, _ = sliding_friction(np.array([0.0, 2.0]), still, np.full((1, 2), 1e-4), pads)
    assert rate[0].tolist() == [-1e-4 / STRAIGHTEN, 0.0]
    assert force[0, 0] == 0.0
    assert force[0, 1] == pytest.approx(2.0 * 4000.0 * 1e-4)


PROFILES = {
    "waves": Profile(0.03, 0.01, 0.1, 0.02),
    "rim": Profile(0.03, 0.01, 0.05, 0.02, rim=1e-3, rim_length=4e-3),
    "lopsided": Profile(0.03, 0.01, 0.1, 0.02, rim=1e-3, lopsided=0.5),
}


@pytest.mark.parametrize("name", PROFILES)
def test_a_width_that_varies_has_the_slopes_that_it_seems_to(name):
    up = np.linspace(-0.01, 0.05, 60001)
    width = width_at(up, np.array([0.004]), namespace(PROFILES[name]))
    for value, slope in zip(
        (*width.half, width.left), (*width.slope, width.left_slope), strict=True
    ):
        seen = np.gradient(value, up)
        assert np.abs(seen - slope)[1:-1].max() < 1e-4 * max(np.abs(slope).max(), 1.0)


def test_a_body_is_wide_swells_before_its_end_and_ends_in_a_tip():
    profile = PROFILES["rim"]
    up = np.array([0.0, 0.005, 0.015, 0.03, 0.04, 0.05])
    width = width_at(up, np.array([0.004]), namespace(profile))
    middle = 0.5 * width.half.sum(axis=0)
    assert middle[:3] == pytest.approx([0.004, 0.0042, 0.0038])
    assert middle[3] == pytest.approx(0.005)
    assert middle[4:].tolist() == [0.0, 0.0]
    assert width.left.tolist() == [1.0, 1.0, 1.0, 1.0, 0.0, 0.0]
    assert (width.tip > 0).tolist() == [True, True, True, True, False, False]


def test_friction_in_the_scenes_for_closed_forms_is_next_to_nothing():
    # The other tests of the mechanics rest on it.
    force, _, _ = sliding_friction(
        np.array([10.0]), np.ones((1, 1)), np.full((1, 1), 1e-3), namespace(SLIPPERY)
    )
    assert abs(force).max() < 1e-7
