"""The laws of contact against closed forms: restitution, breakaway, stick-slip and the click."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from forcelab.simulation import contact
from forcelab.simulation.scene import TASKS, Pads
from forcelab.simulation.tasks import scene_of

LOAD = 8.0


def lugre_of(pads, velocity, bristle, load=LOAD):
    """Force against the motion, and the bristles' rate."""
    velocity, bristle = np.broadcast_arrays(velocity, bristle)
    speed = np.abs(velocity)
    limit = contact.bristle_limit(speed, pads.static, pads.kinetic, pads.stribeck)
    rate = contact.bristle_rate(velocity[None], bristle[None], pads.stiffness, limit)[0]
    force = contact.lugre(load, velocity, bristle, rate, pads.stiffness, pads.damping, pads.viscous)
    return force, rate


def dragged(pads, mass, force, end, start=(0.0, 0.0, 0.0), **options):
    """A mass on a plane drawn by ``force(t, x, v)``: solution of (x, v, z)."""

    def rates(t, y):
        friction, rate = lugre_of(pads, y[1], y[2])
        return [y[1], (force(t, y[0], y[1]) - friction) / mass, rate]

    settings_ = {"rtol": 1e-8, "atol": 1e-11, "max_step": end / 50, **options}
    return solve_ivp(rates, (0.0, end), start, "LSODA", **settings_)


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize(("damping", "speed"), [(0.0, 1.0), (0.3, 1.0), (2.0, 1.5)])
def test_a_bounce_has_hunt_and_crossley_s_restitution_and_depth(exponent, damping, speed):
    mass, stiffness = 0.1, 3e4
    n = np.array(exponent)

    def rates(t, y):
        return [y[1], -float(contact.hunt_crossley(y[0], y[1], stiffness, damping, n)) / mass]

    def surface(t, y):
        return y[0] + 1e-15 * (t == 0.0)

    surface.terminal, surface.direction = True, -1
    bounce = solve_ivp(
        rates,
        (0.0, 0.1),
        [0.0, speed],
        "DOP853",
        rtol=1e-11,
        atol=1e-14,
        events=surface,
        max_step=1e-4,
    )
    exit_speed = -bounce.y_events[0][0][1]

    if damping == 0.0:
        assert exit_speed == pytest.approx(speed, rel=1e-8)
        return
    # m v dv / (1 + lambda v) = -K x^n dx: u - ln(1 + u) with u = lambda v is the same on return,
    # and at the deepest point x^(n+1) K / (n+1) = m (u - ln(1 + u)) / lambda^2.
    absorbed = damping * speed - np.log1p(damping * speed)
    back = brentq(lambda u: -u - np.log1p(-u) - absorbed, 0.0, 1.0 - 1e-12, xtol=1e-15)
    assert exit_speed == pytest.approx(back / damping, rel=1e-7)
    deepest = ((exponent + 1.0) / stiffness * mass * absorbed / damping**2) ** (
        1.0 / (exponent + 1.0)
    )
    assert bounce.y[0].max() == pytest.approx(deepest, rel=5e-4)


@given(
    depth=st.floats(-1.0, 1.0),
    rate=st.floats(-1e4, 1e4),
    stiffness=st.floats(1e1, 1e8),
    damping=st.floats(0.0, 1e3),
)
def test_contact_never_pulls_and_is_nothing_apart(depth, rate, stiffness, damping):
    for law in (contact.hunt_crossley, contact.kelvin_voigt):
        force = law(np.array(depth), np.array(rate), np.array(stiffness), np.array(damping))
        assert np.isfinite(force)
        assert force >= 0.0
        if depth <= 0.0:
            assert force == 0.0
        if depth > 1e-9 and rate >= 0.0:
            assert force > 0.0


@pytest.mark.parametrize("exponent", [None, np.array(1.5)])
def test_stored_energy_is_the_work_against_the_undamped_force(exponent):
    depths = np.linspace(-1e-3, 2e-3, 3001)
    force = contact.hunt_crossley(depths, np.zeros(3001), 1e5, 0.0, exponent)
    work = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(depths))])
    stored = contact.hunt_crossley_energy(depths, 1e5, exponent)
    assert np.abs(stored - work).max() < 1e-7


def test_a_snap_resists_with_its_force_both_ways_and_takes_no_work_in_all():
    depths = np.linspace(-3e-3, 9e-3, 24001)
    numbers = 6.0, 3e-3, 5e-4
    force = contact.snap(depths, *numbers)
    assert force.min() == pytest.approx(-6.0, rel=1e-6)
    assert force.max() == pytest.approx(6.0, rel=1e-6)
    assert depths[force.argmin()] == pytest.approx(2.5e-3, abs=1e-6)
    assert depths[force.argmax()] == pytest.approx(3.5e-3, abs=1e-6)
    slope = np.gradient(contact.snap_energy(depths, *numbers), depths)
    assert np.abs(force + slope)[1:-1].max() < 1e-2
    assert abs(contact.snap_energy(depths[[0, -1]], *numbers)).max() < 1e-12


# Passivity: with V = N s0 z^2 / 2, is F v >= V' for every bristle that can be?


def least_loss(pads, speeds):
    """The least of ``F v - V'`` over bristles bent as far as they can be, at each speed."""
    bent = np.linspace(-1.0, 1.0, 401)[:, None] * pads.static / pads.stiffness
    force, rate = lugre_of(pads, speeds, bent, load=1.0)
    loss = force * speeds - pads.stiffness * bent * rate
    return loss.min(axis=0)


def passive_below(pads):
    """The speed of the docstring of `lugre`: up to it friction takes energy."""
    if pads.static <= pads.kinetic * (1.0 + pads.viscous / pads.damping):
        return np.inf
    return 4.0 * pads.kinetic * (pads.damping + pads.viscous) / pads.damping**2


#: Speeds, m/s, that a hand that slips does not reach; and of a cap, rad/s.
REACHED = {"jaws": 0.4, "table": 0.2, "socket": 1e9, "thread": 50.0}


def frictions(scene):
    """The frictions of a scene by name; that of a thread is told per newton metre."""
    parts = {
        "jaws": (scene.arm or scene.thread).pads,
        "table": scene.ground and scene.ground.friction,
        "socket": scene.socket and scene.socket.rubbing,
    }
    if scene.thread:
        t = scene.thread
        share = t.static / t.kinetic
        parts["thread"] = Pads(share, 1.0, t.stribeck, t.stiffness, t.damping, t.viscous)
    return {name: pads for name, pads in parts.items() if pads is not None}


@pytest.mark.parametrize("task", TASKS)
def test_the_friction_of_the_tasks_takes_energy_at_every_speed_that_a_hand_reaches(task):
    for number in range(3):
        for name, pads in frictions(scene_of(task, 0, number)).items():
            bound = passive_below(pads)
            assert bound > REACHED[name], name
            speeds = np.geomspace(1e-7, min(bound, 1e4), 100)
            assert least_loss(pads, speeds).min() >= -1e-15


@settings(max_examples=30, deadline=None)
@given(
    kinetic=st.floats(0.1, 2.0),
    more=st.floats(1.0, 2.0),
    damping=st.floats(0.01, 30.0),
    viscous=st.floats(0.0, 2.0),
)
def test_friction_takes_energy_up_to_the_stated_speed(kinetic, more, damping, viscous):
    pads = Pads(more * kinetic, kinetic, 0.01, 4000.0, damping, viscous)
    speeds = np.geomspace(1e-6, min(passive_below(pads), 1e3), 100)
    assert (least_loss(pads, speeds) >= -1e-12 * (1.0 + speeds**2 * damping)).all()


def test_beyond_the_stated_speed_bent_bristles_can_give_energy_away():
    pads = Pads(static=1.6, kinetic=0.8)
    assert least_loss(pads, np.array([1.5 * passive_below(pads)]))[0] < 0


@given(share=st.floats(-1.0, 1.0), velocity=st.floats(-10.0, 10.0), angle=st.floats(-np.pi, np.pi))
def test_bristles_never_bend_beyond_what_they_bear_at_rest(share, velocity, angle):
    pads = Pads()
    most = pads.static / pads.stiffness
    for edge in (1.0, 1.0 + 1e-9, 2.0):
        bristle = edge * most * np.array([np.cos(angle), np.sin(angle)])
        moved = velocity * np.array([share, np.sqrt(1.0 - share**2)])
        speed = np.hypot(*moved)
        limit = contact.bristle_limit(speed, pads.static, pads.kinetic, pads.stribeck)
        rate = contact.bristle_rate(moved, bristle, pads.stiffness, limit)
        assert bristle @ rate <= 1e-9 * most * speed


# Coulomb's limit.


@pytest.mark.parametrize(
    ("seconds", "share"), [(400.0, 1.0), (4.0, 0.98), (1.0, 0.96), (0.2, 0.91)]
)
def test_a_growing_pull_gives_way_at_the_static_limit_and_not_below(seconds, share):
    pads, limit = Pads(), Pads().static * LOAD
    most = pads.static / pads.stiffness
    motion = dragged(
        pads, 0.05, lambda t, *_: limit * t / seconds, 1.02 * seconds, max_step=seconds / 100
    )
    force, speed, place = motion.t / seconds, motion.y[1], motion.y[0]
    assert force[np.argmax(speed > 3.0 * pads.stribeck)] == pytest.approx(share, abs=0.01)
    stuck = force < 0.7
    if seconds > 1.0:
        assert place[stuck] == pytest.approx(most * force[stuck], abs=1e-3 * most)
    assert place[force < 0.9 * share].max() < 1.2 * most


@pytest.mark.parametrize("speed", [2e-3, 0.01, 0.1, 0.4])
def test_steady_sliding_takes_stribeck_s_coefficient_and_the_viscous_part(speed):
    pads = Pads()
    settled = solve_ivp(
        lambda _, z: lugre_of(pads, speed, z)[1],
        (0.0, 1e-2 / speed),
        [0.0],
        "LSODA",
        rtol=1e-9,
        atol=1e-13,
    )
    force = lugre_of(pads, speed, settled.y[0, -1])[0]
    curve = 0.8 + 0.3 * np.exp(-((speed / 0.01) ** 2)) + 0.4 * speed
    assert force == pytest.approx(LOAD * curve, rel=1e-6)


@pytest.mark.parametrize(("share", "trembling"), [(0.6, 0.0), (0.6, 0.1), (0.3, 0.5)])
def test_a_body_that_sticks_does_not_creep_even_when_the_pull_trembles(share, trembling):
    pads = Pads()
    times = 1.0 + 0.1 * np.arange(31)  # whole periods of the trembling

    def pull(t, x, v):
        steady = share * pads.static * LOAD * min(t / 0.2, 1.0)
        return steady * (1.0 + trembling * np.sin(20.0 * np.pi * t))

    motion = dragged(pads, 0.05, pull, times[-1], t_eval=times)
    assert motion.y[0] == pytest.approx(share * pads.static / pads.stiffness, rel=0.03)
    assert np.ptp(motion.y[0]) < 1e-7


def test_bristles_that_slide_askew_turn_into_the_direction_of_motion():
    pads = Pads()
    velocity = np.array([0.03, 0.04])
    limit = contact.bristle_limit(0.05, pads.static, pads.kinetic, pads.stribeck)
    settled = solve_ivp(
        lambda _, z: contact.bristle_rate(velocity, z, pads.stiffness, limit),
        (0.0, 1.0),
        [2e-4, -1e-4],
        "LSODA",
        rtol=1e-9,
        atol=1e-13,
    )
    assert pads.stiffness * settled.y[:, -1] == pytest.approx(limit * velocity / 0.05, rel=1e-5)


def test_stick_slip_is_that_of_coulomb_s_law_with_a_true_stick():
    # A mass drawn by a spring whose end moves evenly: it sticks until the spring bears
    # mu_static N, then slides until it stands, again and again.
    pads = Pads(static=0.9, kinetic=0.5, stribeck=1e-3, stiffness=2e6, damping=100.0, viscous=0.0)
    mass, spring, speed, end = 0.2, 500.0, 0.02, 2.2
    motion = dragged(
        pads,
        mass,
        lambda t, x, _: spring * (speed * t - x),
        end,
        t_eval=np.linspace(0, end, 6001),
        rtol=1e-7,
        atol=1e-10,
    )
    bears = spring * (speed * motion.t - motion.y[0])
    slips = np.flatnonzero(np.diff((motion.y[1] > 1.25 * speed).astype(int)) == 1)

    # In closed form: with kinetic friction alone the spring swings about what that bears.
    omega = np.sqrt(spring / mass)
    spare = (0.9 - 0.5) * LOAD / spring
    onset = 0.9 * LOAD / (spring * speed)
    phase = np.arctan2(spare, speed / omega)
    swing = 2.0 * (np.pi - phase) / omega
    drop = 2.0 * spare
    period = drop / speed + swing
    assert motion.t[slips[0]] == pytest.approx(onset, rel=0.01)
    assert np.diff(motion.t[slips]) == pytest.approx(period, rel=0.02)
    assert bears.max() == pytest.approx(0.9 * LOAD, rel=0.01)
    later = motion.t > onset + 2.0 * swing
    assert bears[later].min() == pytest.approx(0.9 * LOAD - spring * drop, rel=0.1)
