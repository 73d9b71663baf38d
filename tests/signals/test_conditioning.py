from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from forcelab.signals.conditioning import bridge, condition, glitches, noise_level

NAN, INF = np.nan, np.inf

anything = hnp.arrays(
    np.float64, st.integers(1, 40), elements=st.floats(allow_nan=True, allow_infinity=True)
)


@settings(max_examples=100, deadline=None)
@given(anything)
def test_any_input_comes_out_finite_and_below_two(x):
    ready = condition(x)
    assert np.isfinite(ready.values).all()
    assert np.abs(ready.values).max() < 2
    assert np.isfinite(ready.noise).all()


@pytest.mark.parametrize("value", [0.0, -0.0, 5e-324, 1e-300, 0.1, -7.0, 1e300, 1.7e308])
def test_a_constant_leaves_nothing(value):
    ready = condition(np.full(20, value))
    assert not ready.values.any()
    assert ready.exponent.tolist() == [0]
    assert ready.noise.tolist() == [0.0]


def test_a_channel_without_a_single_sample_leaves_nothing():
    ready = condition([NAN, INF, -INF])
    assert ready.values.tolist() == [[0.0, 0.0, 0.0]]


def test_missing_samples_lie_on_straight_lines_and_the_ends_hold():
    assert bridge(np.array([NAN, 1.0, NAN, INF, 4.0, -INF])).tolist() == [1, 1, 2, 3, 4, 4]


def test_a_bridge_across_the_whole_range_of_numbers_does_not_overflow():
    ready = condition([1.6e308, NAN, -1.6e308])
    first, middle, last = ready.values[0]
    assert middle == 0
    assert first == -last > 0.4


def test_values_are_read_whatever_their_type_order_and_layout():
    x = np.array([3, -1, 4, 1, -5, 9, 2, 6])
    expected = condition(x.astype(np.float64)).values
    frozen = x.astype(np.float64)
    frozen.flags.writeable = False
    wide = np.zeros((8, 3))
    wide[:, 1] = x
    for other in (
        x.astype(np.int16),
        x.astype(np.int8),
        x.astype(">f8"),
        x.astype(">i2"),
        x.astype(np.float32),
        x.astype(np.float16),
        x.astype(np.longdouble),
        list(map(int, x)),
        frozen,
        wide[:, 1],
        x[::-1].astype(np.float64)[::-1],
    ):
        np.testing.assert_array_equal(condition(other).values, expected)


def test_channels_do_not_bear_upon_each_other():
    random = np.random.default_rng(0)
    x = random.standard_normal((3, 50)) * np.array([[1e-9], [1.0], [1e9]])
    together = condition(x)
    for c in range(3):
        alone = condition(x[c])
        np.testing.assert_array_equal(together.values[c], alone.values[0])
        assert together.exponent[c] == alone.exponent[0]
        assert together.noise[c] == alone.noise[0]


def test_the_noise_level_is_the_standard_deviation_of_white_noise():
    noise = 0.013 * np.random.default_rng(1).standard_normal(200_000)
    assert noise_level(noise) == pytest.approx(0.013, rel=0.01)


def test_the_noise_level_ignores_slow_forces_and_rare_impacts():
    random = np.random.default_rng(2)
    t = np.arange(20_000) / 1000
    force = 8 * np.sin(2 * np.pi * 0.5 * t) + 0.01 * random.standard_normal(t.size)
    force[random.choice(t.size, 100, replace=False)] += 50
    assert noise_level(force) == pytest.approx(0.01, rel=0.05)


@pytest.mark.parametrize("n", [1, 2])
def test_so_few_samples_have_no_noise(n):
    assert noise_level(np.arange(float(n))) == 0


@pytest.mark.parametrize("step", [1.0, 0.0125, 2.0**-20, 1e-3 / 3])
@pytest.mark.parametrize("offset", [0.0, -512.3])
def test_counts_that_mostly_repeat_have_the_noise_of_rounding(step, offset):
    t = np.arange(4000) / 1000
    counts = offset + step * np.round(20 * np.sin(2 * np.pi * 0.5 * t))
    assert noise_level(counts) == pytest.approx(step / np.sqrt(12), rel=1e-6)
    ready = condition(counts)
    noise = np.ldexp(ready.noise[0], int(ready.exponent[0]))
    assert noise == pytest.approx(step / np.sqrt(12), rel=1e-6)


def test_rounding_on_top_of_counts_is_no_step():
    random = np.random.default_rng(4)
    t = np.arange(4000) / 1000
    counts = np.round(20 * np.sin(2 * np.pi * 0.5 * t)) + 1e3
    dusty = counts * (1 + random.choice([-1, 0, 1], t.size) * np.finfo(float).eps)
    assert noise_level(dusty) == pytest.approx(1 / np.sqrt(12), rel=1e-6)
    assert noise_level(np.full(100, 0.1) * (1 + 1e-16 * random.standard_normal(100))) == 0


def test_counts_joined_by_straight_lines_are_not_judged_by_their_luckiest_sample():
    t = np.arange(4000) / 1000
    counts = np.round(20 * np.sin(2 * np.pi * 0.5 * t))
    finer = np.interp(np.arange(0, 3.999, 1 / 1003), t, counts)
    assert 0.05 < noise_level(finer) * np.sqrt(12) <= 1


@pytest.mark.parametrize("still", [0.3, 0.7])
def test_counts_that_flicker_have_the_same_noise_whether_half_of_them_repeat_or_not(still):
    random = np.random.default_rng(5)
    flicker = random.choice([-1.0, 0.0, 1.0], 20_000, p=[(1 - still) / 2, still, (1 - still) / 2])
    assert 0.25 < noise_level(flicker) < 1.5


@pytest.mark.parametrize("hertz", [0.01, 0.5, 20.0])
def test_a_smooth_force_is_not_taken_for_a_rounded_one(hertz):
    w = 2 * np.pi * hertz / 1000
    smooth = 10 * np.sin(w * np.arange(20_000))
    assert noise_level(smooth) < 10 * w * w


@pytest.mark.parametrize("size", [1e9, -1e16, 1e300])
def test_one_wild_sample_leaves_the_noise_as_it_was(size):
    x = 0.01 * np.random.default_rng(0).standard_normal(5000)
    before = noise_level(x)
    x[777] = size
    assert noise_level(x) == pytest.approx(before, rel=1e-2)


def test_glitches_are_told_from_what_lasts():
    x = 1e-12 * np.random.default_rng(0).standard_normal(4000)
    x[[10, 500, 501, 502, 3999]] = 1e12, 5e9, -5e9, 5e9, 1e300
    x[700] = NAN
    x[300:304] = 5e9
    before = x.copy()
    assert np.flatnonzero(glitches(x)).tolist() == [10, 500, 501, 502, 3999]
    np.testing.assert_array_equal(x, before)
    assert not glitches(np.full(5, NAN)).any()
    assert not glitches(np.empty(0)).any()


RESTS = {
    "exactly 0": lambda _, n: np.zeros(n),
    "rounding": lambda r, n: 1e-17 * r.standard_normal(n),
    "quiet": lambda r, n: 1e-6 * r.standard_normal(n),
    "steps, 0 nearly always": lambda r, n: 0.01 * (r.random(n) < 0.005),
    "counts of 24 bits": lambda r, n: np.round(r.standard_normal(n)),
}


@example(seed=0, rest="rounding", offset=0.0, impact=9e8, lasting=3, rings=False)
@given(
    seed=st.integers(0, 2**32 - 1),
    rest=st.sampled_from(sorted(RESTS)),
    offset=st.sampled_from([0.0, -20.0, 8e6]),
    impact=st.floats(-9e8, 9e8),
    lasting=st.integers(1, 200),
    rings=st.booleans(),
)
def test_no_impact_is_a_glitch_however_short_and_however_still_the_rest(
    seed, rest, offset, impact, lasting, rings
):
    x = offset + RESTS[rest](np.random.default_rng(seed), 3000)
    k = np.arange(lasting)
    x[1000 : 1000 + lasting] += impact * (np.exp(-k / 20) * np.cos(k) if rings else 1.0)
    assert not glitches(x).any()


@given(
    seed=st.integers(0, 2**32 - 1),
    size=st.floats(1e-20, 1e8),
    wild=st.floats(2e10, 1e292),
    place=st.integers(0, 1999),
    lasting=st.integers(1, 3),
)
def test_a_glitch_is_one_whatever_the_rest_is_like(seed, size, wild, place, lasting):
    x = size * np.random.default_rng(seed).standard_normal(2000)
    where = slice(place, place + lasting)
    x[where] = wild * max(1.0, 4 * size)
    assert np.array_equal(np.flatnonzero(glitches(x)), np.arange(2000)[where])
