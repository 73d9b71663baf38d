from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.signals.grid import interpolate, on_grid


def recording(times, *columns, rate=None):
    signals = np.stack([np.broadcast_to(c, np.shape(times)) for c in columns], axis=1)
    channels = tuple(Channel(f"c{i}") for i in range(len(columns)))
    return Demonstration("demo", "task", times, signals, channels, grid_rate=rate)


def noise(n, seed=0):
    return np.random.default_rng(seed).standard_normal(n)


# Uniform stamps


@pytest.mark.parametrize("rate", [1000.0, 250.0, 198.3, 1 / 3])
@pytest.mark.parametrize("n", [2, 3, 1001])
def test_a_uniform_recording_is_taken_as_it_is(rate, n):
    demo = recording(5.0 + np.arange(n) / rate, noise(n), noise(n, 1))
    grid = on_grid(demo)
    np.testing.assert_array_equal(grid.times, demo.times)
    np.testing.assert_array_equal(grid.signals, demo.signals)
    assert grid.valid.all()
    assert grid.rate == pytest.approx(rate, rel=1e-9)


def test_stamps_rounded_to_microseconds_are_uniform_however_long_the_recording():
    # The median period is off by the rounding, which adds up to many periods.
    times = np.round(np.arange(400_000) / 360, 6)
    grid = on_grid(recording(times, noise(400_000)))
    np.testing.assert_array_equal(grid.times, times)


def test_hours_at_a_kilohertz_are_uniform():
    times = np.arange(7_200_000) * 0.001 + 0.1
    grid = on_grid(recording(times, 1.0))
    assert grid.times.size == times.size
    assert grid.times[-1] == times[-1]


@pytest.mark.parametrize("share", [0.991, 0.999, 1.0, 1.001, 1.009])
def test_a_rate_asked_for_within_one_per_cent_leaves_the_recording_alone(share):
    demo = recording(np.arange(500) / 1000, noise(500))
    grid = on_grid(demo, 1000 * share)
    np.testing.assert_array_equal(grid.signals, demo.signals)
    assert grid.rate == pytest.approx(1000)


def test_a_rate_further_away_is_met_to_a_thousandth():
    demo = recording(np.arange(5000) / 1000, 1.0)
    for rate in (1010.0, 989.9, 987.654, 701.3, 333.3):
        assert on_grid(demo, rate).rate == pytest.approx(rate, rel=1e-3)


def test_the_demonstrations_own_grid_rate_counts_unless_another_is_asked_for():
    demo = recording(np.arange(2000) / 1000, 1.0, rate=250.0)
    assert on_grid(demo).rate == pytest.approx(250)
    assert on_grid(demo, 500.0).rate == pytest.approx(500)


# Irregular stamps


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.05, 0.45))
def test_jittered_stamps_are_joined_by_straight_lines(seed, jitter):
    random = np.random.default_rng(seed)
    times = (np.arange(300) + jitter * random.uniform(-1, 1, 300)) / 100
    times -= times[0]
    demo = recording(times, 3 - 7 * times, noise(300, seed))
    grid = on_grid(demo)
    assert np.diff(grid.times) == pytest.approx(demo.period, rel=1e-9)
    assert grid.times[0] == 0
    assert times[-1] - demo.period < grid.times[-1] <= times[-1] + 1e-9
    np.testing.assert_allclose(grid.signals[:, 0], 3 - 7 * grid.times, atol=1e-9)
    np.testing.assert_allclose(
        grid.signals[:, 1], np.interp(grid.times, times, demo.signals[:, 1]), atol=1e-12
    )
    assert grid.valid.all()
    assert grid.rate == pytest.approx(1 / demo.period)


# Gaps and missing samples


def test_gaps_are_marked_from_one_period_after_the_last_stamp_to_the_next():
    places = np.concatenate([np.arange(100), np.arange(150, 300), np.arange(306, 400)])
    grid = on_grid(recording(places / 1000, noise(places.size)))
    expected = np.ones(400, dtype=bool)
    expected[100:150] = expected[300:306] = False
    np.testing.assert_array_equal(grid.valid, expected)
    np.testing.assert_allclose(grid.times, np.arange(400) / 1000, atol=1e-12)


def test_five_periods_are_no_gap():
    places = np.concatenate([np.arange(100), np.arange(104, 200)])
    grid = on_grid(recording(places / 1000, noise(places.size)))
    assert grid.valid.all()
    assert grid.times.size == 200


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_runs_of_more_than_five_missing_samples_are_marked(bad):
    x = np.arange(100.0)
    x[10:15] = bad  # five: bridged
    x[30:36] = bad  # six: marked
    x[94:] = bad
    grid = on_grid(recording(np.arange(100) / 10, x, np.ones(100)))
    expected = np.ones(100, dtype=bool)
    expected[30:36] = expected[94:] = False
    np.testing.assert_array_equal(grid.valid, expected)
    np.testing.assert_allclose(grid.signals[:94, 0], np.arange(94.0))
    assert grid.signals[94:, 0].tolist() == [93.0] * 6


def test_a_channel_that_misses_the_first_samples_is_held_and_marked():
    x = np.arange(50.0)
    x[:8] = np.nan
    grid = on_grid(recording(np.arange(50) / 10, x))
    assert grid.valid.tolist() == [False] * 8 + [True] * 42
    assert grid.signals[:8, 0].tolist() == [8.0] * 8


def test_short_holes_of_different_channels_do_not_add_up_to_a_long_one():
    x, y = np.ones(60), np.ones(60)
    x[20:24] = y[24:28] = np.nan
    assert on_grid(recording(np.arange(60) / 10, x, y)).valid.all()


def test_a_channel_of_nothing_but_missing_samples_is_marked_throughout():
    grid = on_grid(recording(np.arange(50) / 10, np.full(50, np.nan), np.ones(50)))
    assert not grid.valid.any()
    assert np.isfinite(grid.signals).all()


@pytest.mark.parametrize("rate", [100.0, 250.0, 1000.0, 1700.0, 4000.0])
def test_gaps_are_marked_on_any_grid(rate):
    places = np.concatenate([np.arange(1000), np.arange(1500, 3000)])
    x = noise(places.size)
    x[2000:2100] = np.nan  # stamps 2.5 .. 2.6 s
    grid = on_grid(recording(places / 1000, x), rate)
    for lost, (start, end) in ((True, (1.0, 1.5)), (True, (2.5, 2.6)), (False, (1.5, 2.5))):
        inside = (grid.times > start + 1e-6) & (grid.times < end - 1e-6)
        assert inside.any()
        assert np.all(grid.valid[inside] != lost)
    assert np.mean(~grid.valid) == pytest.approx(0.2, abs=0.002)


# Other rates


@pytest.mark.parametrize("rate", [500.0, 360.0, 100.0, 300.3, 985.0])
def test_a_coarser_grid_keeps_slow_tones_and_drops_fast_ones(rate):
    times = np.arange(8000) / 1000
    slow, fast = 0.2 * rate / 2, min(1.3 * rate / 2, 495.0)
    demo = recording(times, np.sin(2 * np.pi * slow * times), np.sin(2 * np.pi * fast * times))
    grid = on_grid(demo, rate)
    assert grid.rate == pytest.approx(rate, rel=1e-3)
    assert np.diff(grid.times) == pytest.approx(1 / grid.rate)
    inner = (grid.times > 1) & (grid.times < 7)
    values_inside = grid.signals[inner, 0]
    np.testing.assert_allclose(
        values_inside, np.sin(2 * np.pi * slow * grid.times[inner]), atol=2e-3
    )
    if fast > 1.2 * grid.rate / 2:
        assert np.abs(grid.signals[inner, 1]).max() < 1e-3


@pytest.mark.parametrize("rate", [700.0, 360.0, 985.0, 0.5])
def test_a_constant_force_stays_constant_on_a_coarser_grid(rate):
    grid = on_grid(recording(np.arange(5000) / 1000, 8.0), rate)
    np.testing.assert_allclose(grid.signals, 8.0, rtol=1e-4)


@pytest.mark.parametrize("rate", [0.5, 0.3, 0.37, 0.999, 1.0, 7.77])
def test_even_a_grid_of_one_sample_in_seconds_has_the_rate_asked_for(rate):
    demo = recording(np.arange(40_000) / 1000, np.linspace(0, 1, 40_000))
    grid = on_grid(demo, rate)
    assert grid.rate == pytest.approx(rate, rel=1e-3)
    assert grid.times.size == pytest.approx(40 * rate, abs=1)
    assert grid.times[-1] < demo.end
    # A ramp stays a ramp; at the ends, where the signal is held, to a share of a step.
    np.testing.assert_allclose(grid.signals[:, 0], grid.times / 39.999, atol=0.2 / (40 * rate))


def test_a_grid_coarser_than_the_whole_recording_has_one_sample():
    grid = on_grid(recording(np.arange(100) / 1000, 2.0), 1.0)
    assert grid.times.tolist() == [0.0]
    assert grid.signals[0, 0] == pytest.approx(2.0)


def test_a_finer_grid_lies_on_straight_lines_between_the_samples():
    demo = recording(np.arange(50) / 100, noise(50))
    grid = on_grid(demo, 400.0)
    assert grid.rate == 400
    assert grid.times.size == 49 * 4 + 1
    np.testing.assert_allclose(grid.signals[::4], demo.signals, atol=1e-12)
    np.testing.assert_allclose(
        grid.signals[2::4, 0], 0.5 * (demo.signals[1:, 0] + demo.signals[:-1, 0]), atol=1e-12
    )


@settings(max_examples=60, deadline=None)
@given(st.floats(0.2, 5000), st.integers(2, 400), st.integers(0, 2**32 - 1))
def test_any_rate_gives_a_uniform_finite_grid_within_the_recording(rate, n, seed):
    random = np.random.default_rng(seed)
    times = np.cumsum(random.choice([0.001, 0.001, 0.00101, 0.002, 0.02], n))
    x = np.where(random.random(n) < 0.1, np.nan, random.standard_normal(n))
    demo = recording(times, x)
    grid = on_grid(demo, rate)
    own = 1 / demo.period
    expected = own if abs(rate / own - 1) < 0.01 else rate
    assert grid.rate == pytest.approx(expected, rel=1e-3)
    assert grid.times.shape == grid.valid.shape == grid.signals.shape[:1]
    assert np.isfinite(grid.signals).all()
    assert grid.times[0] == demo.start
    assert grid.times[-1] < demo.end + 1e-9
    assert grid.times[-1] > times[-1] - 1 / grid.rate - demo.period


def test_a_stray_stamp_years_away_is_refused_before_memory_runs_out():
    times = np.append(np.arange(100) / 1000, 1.7e9)
    with pytest.raises(InputError, match=r"'demo' spans 1\.7e\+09 s.*remove stray stamps"):
        on_grid(recording(times, 1.0))


def test_a_long_recording_costs_a_few_times_its_own_size(peak_memory):
    n = 1_000_000
    demo = recording(np.arange(n) / 1000, noise(n), noise(n, 1))
    own = demo.signals.nbytes + demo.times.nbytes
    for rate in (None, 250.0):
        assert peak_memory(partial(on_grid, demo, rate))[1] < 4 * own


def test_a_column_that_nobody_wants_makes_nothing_invalid():
    signals = np.ones((400, 2))
    signals[3:, 1] = np.nan
    demo = Demonstration("a", "", np.arange(400) / 100, signals, (Channel("fz"), Channel("gps")))
    assert not on_grid(demo).valid.all()
    grid = on_grid(demo, columns=[0])
    assert grid.valid.all()
    assert grid.signals.shape == (400, 1)


def test_between_samples_too_far_apart_and_beyond_the_ends_nothing_is_interpolated():
    stamps = np.array([1.0, 2.0, 3.0, 6.0, 7.0])
    values = np.stack([stamps**2, [0.0, np.nan, 2.0, 3.0, 4.0]], axis=1)
    times = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 7.0, 7.5, 8.0])
    found = interpolate(times, stamps, values, longest=2.0, beyond=0.5)
    expected = [np.nan, 1.0, 1.0, 2.5, 4.0, 9.0, np.nan, 36.0, 49.0, 49.0, np.nan]
    np.testing.assert_array_equal(found[:, 0], expected)
    # A missing sample is none; a stamp's own sample is there whatever lies beside it.
    np.testing.assert_array_equal(np.isnan(found[2:6, 1]), [False, True, True, False])
    assert not np.isnan(interpolate(times, stamps, values)[:, 0]).any()
