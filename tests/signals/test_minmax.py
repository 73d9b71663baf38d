from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.jobs import finish
from forcelab.signals.minmax import (
    CHUNK,
    SIZES,
    Columns,
    Envelope,
    drawn_together,
    read_envelopes,
    run_extremes,
)


def drawn_alone(envelope, columns):
    """The curve of one channel in each column."""
    return drawn_together([envelope], columns)[0]


def brute(times, values, edges):
    """The extremes of each column, looked up sample by sample."""
    low, high = [], []
    for left, right in pairwise(edges):
        inside = values[(times >= left) & (times < right)]
        inside = inside[np.isfinite(inside)]
        low.append(inside.min() if inside.size else np.nan)
        high.append(inside.max() if inside.size else np.nan)
    return np.array(low), np.array(high)


def read(signals, columns=(0,)):
    envelopes = [Envelope(signals, column) for column in columns]
    finish(read_envelopes(envelopes))
    return envelopes


def recording(random, n, missing=0.0, channels=1):
    """Irregular stamps with gaps in them, noise with spikes, and some samples missing."""
    steps = random.uniform(0.5e-3, 1.5e-3, n)
    steps[random.random(n) < 3 / n] += random.uniform(0.1, 5.0)
    signals = random.standard_normal((n, channels))
    signals[random.random((n, channels)) < 1e-3] *= 100
    lost = random.random((n, channels)) < missing
    signals[lost] = random.choice([np.nan, np.inf, -np.inf], lost.sum())
    return np.cumsum(steps), signals


@pytest.mark.parametrize(("n", "width"), [(4_000, 1000), (2 * CHUNK + 5_000, 1000), (40_000, 50)])
def test_glitches_count_as_missing_samples(n, width):
    random = np.random.default_rng(3)
    times = np.arange(n) / 1000
    known = random.standard_normal((n, 2))
    wild = np.sort(random.choice(np.arange(0, n - 1, 7), 12, replace=False))
    lost, spoilt = known.copy(), known.copy()
    lost[wild, 0] = np.nan
    spoilt[wild, 0] = random.choice([1e16, -1e12, 1e250], wild.size)
    for columns in ((0,), (0, 1)):
        clean, glitchy = read(lost, columns), read(spoilt, columns)
        np.testing.assert_array_equal(glitchy[0].glitches, wild)
        assert glitchy[0].range == clean[0].range
        for start, end in ((0.0, times[-1]), (times[n // 3], times[n // 3] + 0.9)):
            shown = Columns(times, np.linspace(start, end, width + 1))
            for ours, theirs in zip(
                drawn_together(glitchy, shown), drawn_together(clean, shown), strict=True
            ):
                np.testing.assert_array_equal(ours.low, theirs.low)
                np.testing.assert_array_equal(ours.high, theirs.high)


def test_large_values_that_last_are_no_glitches():
    signals = np.random.default_rng(4).standard_normal((4_000, 1))
    signals[100:110, 0], signals[500, 0] = 1e12, 1e20
    (envelope,) = read(signals)
    assert envelope.glitches.tolist() == [500]
    assert envelope.range == (signals.min(), 1e12)


def test_a_number_that_stands_for_an_absent_sensor_is_missing_and_no_glitch():
    signals = np.random.default_rng(5).standard_normal((4_000, 1))
    signals[2_000:3_000, 0], signals[500, 0] = 3.4e38, 1e12
    lost = np.where(signals > 1e9, np.nan, signals)
    (envelope,), (clean,) = read(signals), read(lost)
    assert envelope.glitches.tolist() == [500]
    assert envelope.range == clean.range
    shown = Columns(np.arange(4_000) / 1000, np.linspace(0.0, 4.0, 200))
    np.testing.assert_array_equal(drawn_alone(envelope, shown).high, drawn_alone(clean, shown).high)


def check(envelope, times, values, edges):
    """Every sample is in its column; what else is there comes from less than a block beside it."""
    columns = Columns(times, edges)
    found = envelope.extremes(columns)
    low, high = brute(times, values, edges)
    if not columns.pyramid:
        np.testing.assert_array_equal(found.low, low)
        np.testing.assert_array_equal(found.high, high)
        return
    held = ~np.isnan(low)
    block = SIZES[columns.top]
    assert block == 16 or block <= columns.crowd / 16
    assert (found.low[held] <= low[held]).all()
    assert (found.high[held] >= high[held]).all()
    for i in range(len(columns)):
        first, last = columns.firsts[i], columns.lasts[i]
        if first == last:
            assert np.isnan(found.low[i])
            continue
        near = np.arange(max(first - block + 1, 0), min(last + block - 1, len(times)))
        width = edges[i + 1] - edges[i]
        near = near[(times[near] >= edges[i] - width) & (times[near] <= edges[i + 1] + width)]
        near = values[near][np.isfinite(values[near])]
        if near.size:
            assert near.min() <= found.low[i] <= found.high[i] <= near.max() or not held[i]
        else:
            assert np.isnan(found.low[i])


@given(data=st.data())
@settings(max_examples=60, deadline=None)
def test_a_column_shows_its_samples_at_every_zoom(data):
    n = data.draw(st.sampled_from([2, 15, 16, 17, 300, 4099, 20_000]))
    random = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    missing = data.draw(st.sampled_from([0.0, 0.1, 0.98, 1.0]))
    times, signals = recording(random, n, missing)
    (envelope,) = read(signals)
    span = (times[-1] - times[0]) * 10.0 ** data.draw(st.floats(-4, 0.5))
    start = times[0] + data.draw(st.floats(-0.2, 1.0)) * (times[-1] - times[0])
    edges = np.linspace(start, start + span, data.draw(st.integers(1, 60)) + 1)
    check(envelope, times, signals[:, 0], edges)


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 40))
@settings(max_examples=30, deadline=None)
def test_columns_of_very_different_width_show_their_samples_too(seed, count):
    random = np.random.default_rng(seed)
    times, signals = recording(random, 30_000, 0.05)
    edges = np.sort(np.exp(random.uniform(np.log(times[0]), np.log(times[-1]), count + 1)))
    (envelope,) = read(signals)
    check(envelope, times, signals[:, 0], edges)


def test_nothing_reaches_across_a_gap():
    n = 20_000
    times = np.arange(n) / 1000.0
    times[7_003:] += 40.0  # within a block of 16 samples
    signals = np.where(np.arange(n) < 7_003, 0.0, 10.0)[:, np.newaxis]
    (envelope,) = read(signals)
    edges = np.linspace(0.0, times[-1] + 1e-3, 101)
    columns = Columns(times, edges, 0.005)
    assert columns.pyramid
    for found in (envelope.extremes(columns), drawn_alone(envelope, columns)):
        known = ~np.isnan(found.low)
        np.testing.assert_array_equal(found.low[known], found.high[known])
        assert set(found.low[known]) == {0.0, 10.0}
        assert np.count_nonzero(~known) > 60


@given(data=st.data())
@settings(max_examples=60, deadline=None)
def test_the_lines_between_samples_join_up_to_the_curve(data):
    random = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    times, signals = recording(random, data.draw(st.integers(2, 60)), 0.1)
    values = signals[:, 0]
    edges = np.linspace(times[0] - 1e-3, times[-1] + 1e-3, data.draw(st.integers(1, 300)) + 1)
    found = drawn_alone(Envelope(signals, 0), Columns(times, edges, 0.02))
    joined = (np.diff(times) <= 0.02) & np.isfinite(values[:-1]) & np.isfinite(values[1:])
    # Independent reference: the curve looked up at many times of each column.
    for i in range(len(edges) - 1):
        at = np.linspace(edges[i], edges[i + 1], 7)
        before = np.searchsorted(times, at, side="right") - 1
        inside = (before >= 0) & (before < len(times) - 1)
        inside[inside] = joined[before[inside]]
        on = np.interp(at[inside], times, np.where(np.isfinite(values), values, 0.0))
        own = values[(times >= edges[i]) & (times < edges[i + 1])]
        expected = np.concatenate([on, own[np.isfinite(own)]])
        if expected.size:
            slack = 1e-9 * (1 + np.abs(expected).max())
            assert found.low[i] <= expected.min() + slack
            assert found.high[i] >= expected.max() - slack
            nearest = np.concatenate([expected, own[np.isfinite(own)]])
            assert found.low[i] >= nearest.min() - slack
            assert found.high[i] <= nearest.max() + slack
        else:
            assert np.isnan(found.low[i])


def test_one_sample_among_a_million_is_never_lost():
    n = 1_000_000
    times, signals = np.arange(n) / 1000.0, np.zeros((n, 2))
    random = np.random.default_rng(3)
    spikes = np.sort(random.choice(n, 50, replace=False))
    signals[spikes, 1] = np.arange(1, 51) * np.where(np.arange(50) % 2, 1, -1)
    (envelope,) = read(signals, [1])
    for width in (100, 1000, 1601):
        edges = np.linspace(0, n / 1000.0, width + 1)
        found = envelope.extremes(Columns(times, edges))
        where = np.searchsorted(edges, times[spikes], side="right") - 1
        value = signals[spikes, 1]
        assert (found.low[where] <= value).all()
        assert (found.high[where] >= value).all()
        assert np.count_nonzero(found.high - found.low) <= 2 * len(np.unique(where))


@pytest.mark.parametrize("width", [65, 200, 1000, 5000])
def test_an_impact_of_one_sample_stands_in_its_column_and_in_one_beside_it_at_most(width):
    n, columns = 40 * width, 40
    times = np.arange(n) / 1000.0
    view = Columns(times, np.arange(columns + 1) * width / 1000.0 - 5e-4)
    block = max(16, width // 16)
    for past in (*range(-20, 21), -width // 2, *range(-width // 8, width // 8 + 1, 7)):
        signals = np.zeros((n, 1))
        at = 20 * width + past  # so many samples past an edge
        signals[at] = 1.0
        (envelope,) = read(signals)
        shown = np.flatnonzero(envelope.extremes(view).high == 1.0).tolist()
        own = at // width
        assert own in shown
        assert set(shown) <= {19, 20}
        assert shown == [own] or abs(past) < block


def test_what_is_looked_at_does_not_grow_with_the_samples():
    looked_at = []
    for n in (100_000, 1_600_000):
        columns = Columns(np.arange(n) / 1000.0, np.linspace(0, n / 1000.0, 401))
        _, bounds = columns.run
        looked_at.append(sum(e.blocks.size for e in columns.ends) + np.diff(bounds)[::2].sum())
    assert columns.pyramid
    assert max(looked_at) < 100 * 400


def test_the_bound_on_what_is_looked_at_without_a_pyramid_holds():
    n = 100_000
    times = np.arange(n) / 1000.0
    for width in (400, 1600, 30_000, 70_000):
        columns = Columns(times, np.linspace(0, n / 1000.0, width + 1))
        assert columns.pyramid or columns.samples <= 64 * len(columns)
        assert columns.dense == (n / width >= 3)


def test_the_pyramid_takes_a_sixth_of_its_channel():
    n = 16 * CHUNK
    envelope = Envelope(np.broadcast_to(0.0, (n, 1)), 0)
    assert envelope.bytes == 0
    envelope.read(0)
    assert envelope.bytes / (8 * n) == pytest.approx(1 / 6, rel=1e-3)


def test_what_was_read_is_shown_and_the_rest_is_not_there_yet():
    n = CHUNK + 5000
    times, signals = recording(np.random.default_rng(1), n)
    envelope = Envelope(signals, 0)
    edges = np.linspace(times[0], times[-1] + 1e-3, 101)
    columns = Columns(times, edges)
    assert np.isnan(envelope.extremes(columns).low).all()
    reading = read_envelopes([envelope])
    step = next(reading)
    assert (step.done, step.total, envelope.filled) == (CHUNK, n, CHUNK)
    shown = envelope.extremes(columns)
    np.testing.assert_array_equal(np.isnan(shown.low), edges[:-1] > times[CHUNK - 1])
    reading.close()
    finish(read_envelopes([envelope]))
    check(envelope, times, signals[:, 0], edges)
    assert envelope.range == (signals.min(), signals.max())


def test_channels_are_read_together_and_only_those_wanted(tmp_path):
    times, signals = recording(np.random.default_rng(4), CHUNK + 77, 0.01, channels=3)
    np.save(tmp_path / "signals.npy", signals)
    mapped = np.load(tmp_path / "signals.npy", mmap_mode="r")
    envelopes = [Envelope(mapped, column) for column in (2, 0)]
    order = [step.done for step in read_envelopes(envelopes)]
    assert order == [CHUNK, CHUNK, CHUNK + 77, CHUNK + 77]
    edges = np.linspace(times[0], times[-1], 50)
    for envelope, column in zip(envelopes, (2, 0), strict=True):
        check(envelope, times, signals[:, column], edges)


def test_a_channel_that_is_read_already_costs_nothing():
    _, signals = recording(np.random.default_rng(5), 1000)
    (envelope,) = read(signals)
    assert list(read_envelopes([envelope])) == []
    assert list(read_envelopes([])) == []


def test_a_channel_without_a_sample_has_no_range():
    (envelope,) = read(np.full((100, 1), np.nan))
    assert envelope.range is None
    assert SIZES[-1] == CHUNK


@given(data=st.data())
@settings(max_examples=60, deadline=None)
def test_channels_drawn_together_are_what_each_is_alone(data):
    n = data.draw(st.integers(1, 400))
    random = np.random.default_rng(data.draw(st.integers(0, 1000)))
    times = np.cumsum(random.exponential(0.01, n) * random.choice([1.0, 1.0, 1.0, 20.0], n))
    signals = random.normal(size=(n, 3))
    signals[random.random((n, 3)) < 0.1] = data.draw(st.sampled_from([np.nan, np.inf, 0.0]))
    first, last = sorted(data.draw(st.tuples(*[st.floats(-0.2, times[-1] + 0.2)] * 2)))
    columns = Columns(times, np.linspace(first, last + 1e-3, data.draw(st.integers(2, 80))), 0.05)
    envelopes = [
        Envelope(signals, i) for i in data.draw(st.sampled_from([(0, 1, 2), (2, 0), (1,)]))
    ]
    for found, envelope in zip(drawn_together(envelopes, columns), envelopes, strict=True):
        alone = drawn_alone(envelope, columns)
        np.testing.assert_array_equal(found.low, alone.low)
        np.testing.assert_array_equal(found.high, alone.high)


@pytest.mark.parametrize("channels", [(), (3,)])
def test_runs_may_overlap_be_empty_and_end_at_the_last_row(channels):
    values = np.random.default_rng(0).normal(size=(50, *channels))
    values[10:14], values[20] = np.nan, np.inf
    firsts, lasts = np.array([0, 9, 10, 18, 30, 30, 49]), np.array([10, 12, 13, 31, 30, 50, 50])
    found = run_extremes(values, firsts, lasts)
    for run, (first, last) in enumerate(zip(firsts, lasts, strict=True)):
        part = values[first:last]
        part = part[np.isfinite(part).all(axis=tuple(range(1, part.ndim)))]
        low = part.min(axis=0) if len(part) else np.full(channels, np.nan)
        high = part.max(axis=0) if len(part) else np.full(channels, np.nan)
        np.testing.assert_array_equal(found.low[run], low)
        np.testing.assert_array_equal(found.high[run], high)
