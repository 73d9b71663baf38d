"""What the hand commands: reaches, tremor and splines."""

from __future__ import annotations

import numpy as np
import pytest

from forcelab.simulation.hand import KNOT_STEP, Trajectory, minimum_jerk, tremor, wander

RNG = np.random.default_rng(17)
VALUES = [RNG.normal(size=(41, 3)), RNG.normal(size=(21, 3))]


def columns(command, lane, times):
    """One lane's commands at many times, shape (c, n)."""
    return command.subset(np.array([lane])).at(times)


def test_a_reach_starts_and_ends_at_rest_with_the_least_jerk():
    times = np.linspace(-0.2, 1.4, 16001)
    reach = minimum_jerk(times, start=0.2, duration=0.8)
    assert reach[times <= 0.2].max() == 0.0
    assert reach[times >= 1.0].min() == 1.0
    assert minimum_jerk(np.array([0.6]), 0.2, 0.8) == pytest.approx(0.5)
    speed = np.gradient(reach, times)
    acceleration = np.gradient(speed, times)
    assert speed.max() == pytest.approx(1.875 / 0.8, rel=1e-4)
    assert speed.min() > -1e-9
    # Flash and Hogan's peak, at u = (3 -+ sqrt 3) / 6; no jump at the ends.
    assert acceleration.max() == pytest.approx(10.0 / np.sqrt(3.0) / 0.8**2, rel=1e-3)
    assert np.abs(np.diff(acceleration)).max() < 0.02 * acceleration.max()


def test_tremor_has_unit_variance_and_keeps_to_its_band():
    times = np.arange(20000) / 1000.0
    spread = []
    for seed in range(20):
        shaking = tremor(times, np.random.default_rng(seed))
        spread.append(shaking.var())
        power = np.abs(np.fft.rfft(shaking * np.hanning(len(times)))) ** 2
        frequency = np.fft.rfftfreq(len(times), 1e-3)
        outside = power[(frequency < 7.5) | (frequency > 12.5)].sum()
        assert outside < 1e-3 * power.sum()
    assert np.mean(spread) == pytest.approx(1.0, rel=0.05)


def test_wandering_has_unit_variance_and_falls_off_beyond_a_hertz():
    times = np.arange(8000) / 33.0
    spread, powers = [], []
    for seed in range(12):
        moved = wander(times, np.random.default_rng(seed))
        spread.append(moved.var())
        powers.append(np.abs(np.fft.rfft(moved * np.hanning(len(times)))) ** 2)
    frequency = np.fft.rfftfreq(len(times), 1 / 33)
    power = np.mean(powers, axis=0)
    assert np.mean(spread) == pytest.approx(1.0, rel=0.05)
    assert power[frequency > 3.2].sum() < 1e-3 * power.sum()
    assert power[frequency > 1.0].sum() < 0.35 * power.sum()
    assert power[frequency < 0.33].sum() > 0.1 * power.sum()


def test_commands_go_through_their_values_and_stay_at_the_last():
    command = Trajectory.through(VALUES)
    for lane, values in enumerate(VALUES):
        knots = KNOT_STEP * np.arange(len(values))
        assert np.abs(columns(command, lane, knots).T - values).max() < 1e-12
    after = KNOT_STEP * np.arange(21, 41)
    assert np.abs(columns(command, 1, after).T - VALUES[1][-1]).max() < 1e-12


def test_commands_are_twice_continuously_differentiable_and_start_and_end_at_rest():
    command = Trajectory.through(VALUES)
    h = KNOT_STEP
    a, b, c, d = command.coefficients.transpose(2, 0, 1, 3)  # each (lanes, intervals, commands)
    ends = [((a * h + b) * h + c) * h + d, (3.0 * a * h + 2.0 * b) * h + c, 6.0 * a * h + 2.0 * b]
    for order, (end, start) in enumerate(zip(ends, (d, c, 2.0 * b), strict=True)):
        leaps = np.abs(end[:, :-1] - start[:, 1:])
        if order == 2:
            leaps[1, 19] = 0.0  # from where the shorter lane holds its last value
        assert leaps.max() < 1e-9 * np.abs(start).max()
    assert np.abs(c[:, 0]).max() < 1e-9 * np.abs(c).max()
    assert np.abs(ends[1][0, -1]).max() < 1e-9 * np.abs(c).max()


def test_a_lane_s_commands_do_not_depend_on_how_long_its_neighbours_are():
    alone = Trajectory.through(VALUES[1:])
    beside = Trajectory.through(VALUES).subset(np.array([1]))
    times = np.linspace(0.0, 20 * KNOT_STEP, 101, endpoint=False)
    assert np.array_equal(beside.at(times), alone.at(times))


def test_the_hand_drives_with_the_force_of_its_springs_and_dampers():
    command = Trajectory.through(VALUES)
    stiffness, damping = RNG.uniform(1.0, 9.0, (2, 3, 2))
    drive = command.driving(stiffness, damping)
    times = RNG.uniform(0.001, 40 * KNOT_STEP - 0.001, 400)
    h = 1e-7
    for lane in (0, 1):
        place = columns(command, lane, times)
        speed = (columns(command, lane, times + h) - columns(command, lane, times - h)) / (2.0 * h)
        expected = stiffness[:, lane, None] * place + damping[:, lane, None] * speed
        # A difference across a knot is off by the third derivative's jump times h.
        assert columns(drive, lane, times) == pytest.approx(expected, rel=1e-5, abs=1e-3)
