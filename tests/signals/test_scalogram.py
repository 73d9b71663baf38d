from __future__ import annotations

import math
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.signals import scalogram as module
from forcelab.signals.cwt import cwt
from forcelab.signals.grid import on_grid
from forcelab.signals.grid_reader import GridReader, open_reader
from forcelab.signals.scalogram import Cells, ChannelView, open_channel, row_scales, scalogram
from forcelab.signals.wavelets import Morlet

RATE = 1000.0
SCALES = row_scales(32, 2048.0)
#: Errors of a picture that is not coarse, of a row's largest power; and of the rows below a scale,
#: whose wavelets the Nyquist frequency cuts: they ring further than they are followed.
EXACT, RINGING = 2e-6, 1e-3
CUT_BELOW = (5 + 6.5) / math.pi


def recorded(x, times=None, names=("fz",)):
    x = np.asarray(x, dtype=np.float64)
    signals = x[:, np.newaxis] if x.ndim == 1 else x
    stamps = np.arange(len(signals)) / RATE if times is None else times
    return Demonstration("foam 1", "foam", stamps, signals, tuple(Channel(n, "N") for n in names))


def force(n, seed=3):
    """Slow forces of newtons, taps that ring, noise of 10 mN."""
    random = np.random.default_rng(seed)
    t = np.arange(n)
    x = 0.01 * random.standard_normal(n) + 5 * np.sin(2 * np.pi * t / 3000) * (t % 20000 > 9000)
    for at in random.integers(0, n, max(3, n // 5000)):
        m = min(200, n - at)
        x[at : at + m] += 3 * np.exp(-np.arange(m) / 20) * np.sin(0.6 * np.arange(m))
    return x


def make_picture(x, start=None, end=None, channel="fz", **settings):
    demonstration = x if isinstance(x, Demonstration) else recorded(x)
    view = finish(open_channel(demonstration, channel, 2048.0))
    request = {"scales": SCALES, "columns": 200, **settings}
    span = (demonstration.start if start is None else start, end or demonstration.end)
    return finish(scalogram(view, *span, **request))


def power(picture):
    return 10.0 ** (2 * picture.values.astype(np.float64))


def reference(x, first, last, columns, scales=SCALES, cell=1):
    """Largest power of each column, from the transform at the full rate."""
    full = np.abs(cwt(x, scales)) ** 2
    edges = first + (last - first) / columns * np.arange(columns + 1)
    edges = np.floor(edges / cell + 0.5 + 1e-6) * cell if cell > 1 else np.ceil(edges - 1e-6)
    edges = edges.astype(int)
    return np.maximum.reduceat(full[:, : edges[-1]], edges[:-1], axis=1)


def assert_exact(picture, expected):
    """Powers are those expected to within a share of the largest of their row."""
    error = np.abs(power(picture) - expected) / np.nanmax(expected, axis=1, keepdims=True)
    cut = picture.scales < CUT_BELOW
    assert np.nanmax(error[~cut], initial=0.0) < EXACT
    assert np.nanmax(error[cut], initial=0.0) < RINGING


@pytest.fixture(scope="module")
def tapped():
    return force(60_000)


@pytest.mark.parametrize(
    ("first", "last", "columns"),
    [(20_000, 20_100, 100), (20_000, 21_000, 500), (3_000, 13_000, 1000), (0, 12_000, 600)],
)
def test_a_picture_holds_the_largest_power_of_each_column(tapped, first, last, columns):
    picture = make_picture(tapped, first / RATE, last / RATE, columns=columns)
    expected = reference(tapped, first, last, columns)
    assert picture.values.shape == expected.shape
    assert_exact(picture, expected)


@pytest.mark.parametrize(
    ("p", "last", "columns"),
    [
        (2.0, 20_000, 250),
        (12.0, 11_000, 500),
        (30.0, 20_000, 250),
        (1000.0, 11_000, 500),
    ],
)
def test_other_carriers_are_as_right(tapped, p, last, columns):
    view = finish(open_channel(recorded(tapped), "fz", 1024.0, Morlet(p)))
    scales = row_scales(20, 1024.0, 2.0)
    request = {"scales": scales, "columns": columns}
    full = cwt(tapped, scales, Morlet(p))[:, 10_000:last]
    sizes = np.abs(full).reshape(20, columns, -1).max(axis=-1)
    picture = finish(scalogram(view, 10.0, last / RATE, **request))
    floor = 2e-6 * np.ptp(tapped) * np.sqrt(scales)[:, np.newaxis]
    # Taps outside the span are ten times as loud as what is seen.
    share = np.where(scales < (p + 6.5) / math.pi, 10 * RINGING, EXACT)[:, np.newaxis]
    allowed = share * sizes.max(axis=1, keepdims=True) ** 2 + floor * (2 * sizes + floor)
    assert np.all(np.abs(power(picture) - sizes**2) < allowed)
    turned = finish(scalogram(view, 10.0, last / RATE, **request, phase=True)).values
    each = (last - 10_000) // columns
    centres = full[:, each // 2 :: each]
    strong = np.abs(centres) > 0.1 * np.abs(centres).max(axis=1, keepdims=True)
    strong &= np.abs(centres) > 100 * floor
    # Not of wavelets that the Nyquist frequency cuts.
    strong &= scales[:, np.newaxis] > (p + 6.5) / math.pi
    assert strong.any() or p > 60
    error = np.abs(np.angle(np.exp(1j * (turned - np.angle(centres)))))
    assert np.max(error[strong], initial=0.0) < 1e-3


@pytest.mark.parametrize("p", [5.0, 8.0, 12.0])
@pytest.mark.parametrize(("last", "columns"), [(20_000, 20), (20_000, 250), (11_000, 500)])
def test_phases_of_cut_wavelets_are_as_sure_as_stated_for_any_carrier(p, last, columns):
    steps = np.random.default_rng(7).standard_normal(30_000)
    scales = (p + np.array([0.0, 0.5, 1.0, 1.5, 2.5])) / math.pi
    stated = np.array([0.15, 0.15, 0.06, 0.04, 0.01])
    for x in (steps, np.cumsum(steps)):
        view = finish(open_channel(recorded(x), "fz", 1024.0, Morlet(p)))
        request = {"scales": scales, "columns": columns, "phase": True}
        turned = finish(scalogram(view, 10.0, last / RATE, **request)).values
        each = (last - 10_000) // columns
        full = cwt(x, scales, Morlet(p))
        centres = full[:, 10_000:last][:, each // 2 :: each]
        strong = np.abs(centres) > 0.1 * np.abs(centres).max(axis=1, keepdims=True)
        assert strong.any(axis=1).all()
        error = np.abs(np.angle(np.exp(1j * (turned - np.angle(centres)))))
        assert np.all(np.where(strong, error, 0.0).max(axis=1) < stated)


@pytest.fixture
def long_from_little(monkeypatch):
    """Spans are long, and made of several blocks, that are short enough to be transformed."""
    for name, value in (("LONG", 1 << 14), ("BLOCK", 1 << 14), ("SHOWN", 1)):
        monkeypatch.setattr(module, name, value)


@pytest.mark.usefixtures("long_from_little")
@pytest.mark.parametrize(
    ("first", "last", "columns", "cell"),
    [(0, 60_000, 60, 64), (0, 60_000, 400, 64), (12_345, 51_000, 300, 64)],
)
def test_cells_hold_the_largest_power_of_each_column(tapped, first, last, columns, cell):
    picture = make_picture(tapped, first / RATE, last / RATE, columns=columns)
    assert_exact(picture, reference(tapped, first, last, columns, cell=cell))


@pytest.mark.usefixtures("long_from_little")
def test_cells_are_computed_once_and_only_where_something_is_seen(tapped, monkeypatch):
    view = finish(open_channel(recorded(tapped), "fz", 2048.0))
    read = GridReader.read
    touched = []
    monkeypatch.setattr(
        GridReader, "read", lambda self, *piece: touched.append(piece) or read(self, *piece)
    )
    request = {"scales": SCALES, "columns": 100}
    first = finish(scalogram(view, 0.0, 20.0, **request))
    assert view.cells(SCALES).missing(0, 60_000) == [2, 3]
    touched.clear()
    steps = list(scalogram(view, 1.0, 19.0, **request))
    assert not touched, "a span whose cells are there reads nothing"
    assert not steps, "nor has it a coarse picture first"
    again = finish(scalogram(view, 0.0, 20.0, **request))
    np.testing.assert_array_equal(again.values, first.values)


@pytest.mark.usefixtures("long_from_little")
def test_what_was_computed_before_a_picture_was_cancelled_is_kept(tapped):
    view = finish(open_channel(recorded(tapped), "fz", 2048.0))
    job = scalogram(view, 0.0, 60.0, scales=SCALES, columns=100)
    for _ in job:
        if len(view.cells(SCALES).missing(0, 60_000)) < 4:
            break
    job.close()
    assert len(view.cells(SCALES).missing(0, 60_000)) == 3
    entire = finish(scalogram(view, 0.0, 60.0, scales=SCALES, columns=100))
    np.testing.assert_array_equal(entire.values, make_picture(tapped, columns=100).values)


@pytest.mark.usefixtures("long_from_little")
def test_pictures_become_exact_bit_by_bit(tapped):
    view = finish(open_channel(recorded(tapped), "fz", 2048.0))
    request = {"scales": SCALES, "columns": 64}
    pictures = [step.picture for step in scalogram(view, 0.0, 60.0, **request)]
    shown = list({id(picture): picture for picture in pictures if picture is not None}.values())
    assert len(shown) == 5
    assert all(picture.coarse for picture in shown)
    exact = finish(scalogram(view, 0.0, 60.0, **request))
    assert not exact.coarse
    right = [np.sum(np.all(p.values == exact.values, axis=0)) for p in shown[2:]]
    assert right == pytest.approx([17, 34, 52], abs=2), "a chunk more each time"


def first_pictures(view, samples, columns=800, phase=False):
    """What is shown of a whole recording before the exact picture is begun."""
    job = scalogram(view, 0.0, samples / RATE, scales=SCALES, columns=columns, phase=phase)
    shown = []
    for step in job:
        if step.picture is not None and (not shown or shown[-1] is not step.picture):
            shown.append(step.picture)
        if step.text == "first picture":
            break
    job.close()
    return shown


def test_the_first_phases_of_a_long_span_know_all_scales():
    x = force(400_000)
    view = finish(open_channel(recorded(x), "fz", 2048.0))
    first = first_pictures(view, len(x), columns=400, phase=True)[-1]
    assert first.coarse
    assert np.isfinite(first.values).all()
    wide = first.scales > 700
    exact = cwt(x, first.scales[wide])[:, 500::1000]
    error = np.abs(np.angle(np.exp(1j * (first.values[wide] - np.angle(exact)))))
    size = np.abs(exact)
    # That of the nearest mean of 16 samples.
    assert np.max(error[size > 0.1 * size.max(axis=1, keepdims=True)]) < 0.1


def test_the_first_picture_of_a_long_span_knows_all_scales():
    x = force(400_000)
    x[180_000:220_000] = np.nan
    view = finish(open_channel(recorded(x), "fz", 2048.0))
    narrow, first = first_pictures(view, len(x))
    assert np.isnan(narrow.values[-2:]).all(), "what is there before the means are"
    lost = np.isnan(first.values)
    assert np.flatnonzero(lost.any(axis=0)).tolist() == list(range(360, 440)), "the gap alone"
    np.testing.assert_array_equal(lost, lost[:1].repeat(len(lost), axis=0))
    bridged = np.interp(np.arange(len(x)), np.flatnonzero(np.isfinite(x)), x[np.isfinite(x)])
    largest = reference(bridged, 0, len(x), 800, first.scales)
    known = ~lost[0]
    for row in np.flatnonzero(first.scales > 145):
        # Edges of columns move to the nearest mean of 16 samples, in columns of 500.
        shown_power = power(first)[row, known]
        np.testing.assert_allclose(shown_power, largest[row, known], atol=0.1 * largest[row].max())


@pytest.mark.parametrize(("p", "known"), [(60.0, [True, True, False, True]), (200.0, [True, True])])
def test_the_first_picture_of_a_high_carrier_tells_nothing_wrong(p, known):
    x = force(400_000)
    view = finish(open_channel(recorded(x), "fz", 2048.0, Morlet(p)))
    first = first_pictures(view, len(x))[-1]
    known = known + [False] * (len(first.scales) - len(known))
    assert np.isfinite(first.values).any(axis=1).tolist() == known
    if known[-1]:
        full = np.abs(cwt(x, first.scales[-1:], Morlet(p))) ** 2
        largest = full.reshape(800, -1).max(axis=1)
        # Six means to a wave: a decibel of what is folded, until the exact picture is there.
        np.testing.assert_allclose(power(first)[-1], largest, atol=0.25 * largest.max())


@pytest.mark.parametrize(
    ("samples", "share"), [(60_000, 1), (60_000, 16), (600_000, 1), (600_000, 4)]
)
def test_a_short_impact_vanishes_at_no_zoom(samples, share):
    x = np.zeros(samples)
    at = samples // 2 + 137
    x[at] = 4.0
    view = finish(open_channel(recorded(x), "fz", 2048.0))
    width = samples // share
    first = max(0, at - width // 3)
    picture = finish(
        scalogram(view, first / RATE, (first + width) / RATE, scales=SCALES, columns=150)
    )
    expected = (np.abs(cwt(x[at - 8000 : at + 8000], SCALES)) ** 2).max(axis=1)
    narrow = width / 150 > 4 * SCALES
    found = power(picture)
    np.testing.assert_allclose(found.max(axis=1), expected, rtol=0.02)
    column = (at - first) * 150 // (min(first + width, samples) - first)
    assert np.all(np.abs(np.argmax(found[narrow], axis=1) - column) <= 1)


@pytest.mark.parametrize("apart", [2.0, 4.0, 5.0])
@pytest.mark.parametrize("columns", [100, 500, 20_000])
def test_tones_that_beat_are_as_high_as_they_are(apart, columns):
    scale, t = 64.0, np.arange(60_000)
    low, high = (Morlet().p + sign * apart / 2 for sign in (-1, 1))
    x = np.sin(low / scale * t) + np.sin(high / scale * t)
    picture = make_picture(x, 20.0, 40.0, columns=columns, scales=np.array([scale]))
    assert_exact(picture, reference(x, 20_000, 40_000, picture.values.shape[1], [scale]))


@pytest.mark.parametrize(
    ("first", "last", "columns"), [(20_000, 20_100, 100), (3_000, 13_000, 500), (0, 60_000, 100)]
)
def test_phases_are_those_of_the_columns_centres(tapped, first, last, columns):
    picture = make_picture(tapped, first / RATE, last / RATE, columns=columns, phase=True)
    width = (last - first) // columns
    exact = cwt(tapped, SCALES)[:, first + width // 2 : last : width]
    error = np.abs(np.angle(np.exp(1j * (picture.values - np.angle(exact)))))
    size = np.abs(exact)
    error[size < 0.1 * size.max(axis=1, keepdims=True)] = 0.0
    wide = SCALES > 4
    assert np.nanmax(error[wide]) < 1e-3
    assert np.nanmax(error[~wide]) < 0.01


def test_phases_of_long_spans_go_through_a_coarser_grid_without_loss():
    x = force(600_000)
    scales = np.array([150.0, 300.0, 1000.0])
    picture = make_picture(x, columns=100, scales=scales, phase=True)
    exact = cwt(x, scales)[:, 3000::6000]
    error = np.abs(np.angle(np.exp(1j * (picture.values - np.angle(exact)))))
    size = np.abs(exact)
    assert np.max(error[size > 0.1 * size.max(axis=1, keepdims=True)]) < 0.03


@pytest.mark.usefixtures("long_from_little")
def test_a_coarse_picture_of_a_long_span_comes_first(tapped):
    view = finish(open_channel(recorded(tapped), "fz", 2048.0))
    steps = list(scalogram(view, 0.0, 60.0, scales=SCALES, columns=800))
    pictures = [step.picture for step in steps]
    first = next(picture for picture in pictures if picture is not None)
    assert first.coarse
    assert first.values.shape == (4, 800)
    assert pictures.index(first) < len(steps) / 2
    assert pictures[-1].coarse, "whoever sees the last step only still gets one"
    assert not make_picture(tapped, columns=800).coarse


def test_only_the_span_and_its_halo_are_read(monkeypatch):
    demonstration = recorded(force(300_000))
    view = finish(open_channel(demonstration, "fz", 256.0))
    touched = []
    read = GridReader.read
    monkeypatch.setattr(
        GridReader, "read", lambda self, *piece: touched.append(piece) or read(self, *piece)
    )
    scales = row_scales(16, 256.0)
    finish(scalogram(view, 100.0, 102.0, scales=scales, columns=400))
    halo = 8 * 256
    assert min(first for first, _ in touched) > 100_000 - halo
    assert max(last for _, last in touched) < 102_000 + halo


def test_memory_is_bounded_and_a_long_picture_can_be_cancelled_in_every_block():
    demonstration = recorded(force(900_000))
    view = finish(open_channel(demonstration, "fz", 2048.0))
    tracemalloc.start()
    steps = list(scalogram(view, 0.0, 900.0, scales=SCALES, columns=1500))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100e6
    assert sum(step.text == "rows" for step in steps) >= 900_000 / module.BLOCK


def test_missing_samples_are_bridged_as_in_recognition(tapped):
    x = tapped[:20_000].copy()
    x[5_000:5_004] = np.nan
    x[9_000:9_700] = np.inf
    picture = make_picture(x, 4.0, 12.0, columns=400)
    expected = reference(x, 4_000, 12_000, 400)
    known = np.isfinite(picture.values).all(axis=0)
    assert known[50]
    assert not known[252:284].any()
    assert known.sum() > 360
    expected[:, ~known] = np.nan
    assert_exact(picture, expected)


def test_a_piece_within_a_long_gap_knows_both_sides():
    x = force(20_000)
    x[5_000:15_000] = np.nan
    source = finish(open_reader(recorded(x), "fz"))
    values, known = source.read(9_000, 9_100)
    expected = on_grid(recorded(x)).signals[9_000:9_100, 0]
    np.testing.assert_allclose(values, expected, rtol=1e-9)
    assert not known.any()


@pytest.mark.parametrize("even", [True, False])
def test_a_gap_is_as_long_as_it_is_where_a_piece_begins_or_ends_in_it(even):
    x, times = force(1_000), np.arange(1_000) / RATE
    x[:8] = x[500:510] = x[-8:] = x[700:704] = np.nan
    if not even:
        times += np.where(times > 0.3, 4e-4, 0.0)
    demonstration = recorded(x, times)
    source, entire = finish(open_reader(demonstration, "fz")), on_grid(demonstration)
    assert source.uniform == even
    for piece in ((508, 530), (480, 502), (503, 506), (5, 20), (980, 995), (702, 710)):
        np.testing.assert_array_equal(source.read(*piece)[1], entire.valid[slice(*piece)])


@settings(max_examples=20, deadline=None)
@given(
    st.one_of(
        hnp.arrays(np.float64, st.integers(3, 60), elements=st.floats(0.2, 1.8)),
        st.integers(3, 60).map(np.ones),
    ),
    st.data(),
)
def test_pieces_are_those_of_the_whole_grid(distances, data):
    times = np.cumsum(distances) / RATE
    x = np.cumsum(np.sin(np.arange(len(times))))
    begin = data.draw(st.integers(0, len(x)))
    x[begin : begin + data.draw(st.integers(0, 9))] = np.nan
    demonstration = recorded(x, times)
    entire = on_grid(demonstration)
    source = finish(open_reader(demonstration, "fz"))
    assert source.count == len(entire.times)
    first = data.draw(st.integers(0, source.count - 1))
    last = data.draw(st.integers(first + 1, source.count))
    values, known = source.read(first, last)
    np.testing.assert_allclose(values, entire.signals[first:last, 0], rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(known, entire.valid[first:last])


def test_gaps_of_the_stamps_stay_empty():
    times = np.concatenate([np.arange(4000), 7000.25 + np.arange(4000)]) / RATE
    demonstration = recorded(force(8000), times)
    picture = make_picture(demonstration, 0.0, 11.0, columns=110)
    known = np.isfinite(picture.values).all(axis=0)
    assert known[:40].all()
    assert not known[41:70].any()
    assert known[71:].all()


def test_a_recognition_channel_is_made_of_its_columns():
    parts = np.stack([force(5000, seed) for seed in range(3)], axis=1)
    demonstration = recorded(parts, names=("fx1", "fy1", "fz1"))
    picture = make_picture(demonstration, channel="tangential 1", columns=500)
    expected = reference(np.hypot(parts[:, 0], parts[:, 1]), 0, 5000, 500)
    assert_exact(picture, expected)
    with pytest.raises(InputError, match="no recognition channel 'fx7'"):
        finish(open_channel(demonstration, "fx7", 64.0))


def test_a_stray_stamp_is_refused_in_one_sentence():
    times = np.append(np.arange(100) / RATE, 1e9)
    with pytest.raises(InputError, match="remove stray stamps"):
        finish(open_channel(recorded(np.zeros(101), times), "fz", 64.0))


@pytest.mark.parametrize("size", [1e-300, 1.0, 1e28])
def test_any_size_of_numbers_gives_the_same_picture(size):
    x = force(4000)
    with np.errstate(all="raise", under="ignore"):
        picture = make_picture(size * x, columns=100)
    shift = math.log10(size)
    np.testing.assert_allclose(
        picture.values - shift, make_picture(x, columns=100).values, atol=1e-3
    )


@pytest.mark.parametrize(("n", "phase"), [(4000, True), (400_000, False)])
def test_what_no_sensor_can_have_read_is_drawn_as_a_missing_sample(n, phase):
    x, columns = force(n), 50
    missing, printed = x.copy(), x.copy()
    for place in (0, slice(700, n, 997), slice(2000, 2040), n - 1):
        missing[place], printed[place] = np.nan, -3.4e38
    expected, found = (
        make_picture(y, columns=columns, phase=phase).values for y in (missing, printed)
    )
    np.testing.assert_array_equal(found, expected)


def test_silence_is_one_colour_and_has_no_phase():
    x = np.full(5000, 7.25)
    assert np.ptp(make_picture(x, columns=100).values, axis=1).max() == 0.0
    assert np.isnan(make_picture(x, columns=100, phase=True).values).all()
    x[4000:] += np.sin(np.arange(1000) / 3)
    picture = make_picture(x, columns=100)
    # But for the narrowest wavelet, which the Nyquist frequency cuts: it rings.
    quiet = picture.values[1:8, :60]
    assert np.ptp(quiet, axis=1).max() < 1e-6, "far from the tone the floor has no structure"


def test_nothing_recorded_gives_an_empty_picture():
    picture = make_picture(np.full(3000, np.nan), columns=50)
    assert np.isnan(picture.values).all()


def test_what_lies_outside_the_recording_is_left_out():
    picture = make_picture(force(3000), -5.0, 50.0, columns=100)
    assert picture.start == pytest.approx(0.0)
    assert picture.end == pytest.approx(3.0)


@pytest.mark.parametrize("n", [2, 3, 10])
def test_the_shortest_recordings_have_pictures(n):
    for phase in (False, True):
        picture = make_picture(np.arange(n) % 2, columns=100, phase=phase)
        assert picture.values.shape == (32, n)


def test_the_range_of_colours_is_that_of_the_whole_demonstration():
    x = force(100_000)
    view = finish(open_channel(recorded(x), "fz", 2048.0))
    magnitudes = np.abs(cwt(x, row_scales(24, 2048.0)))
    low, high = np.log10(np.quantile(magnitudes, (0.05, 0.999)))
    assert view.low == pytest.approx(low, abs=0.5)
    assert view.high == pytest.approx(high, abs=0.3)


@pytest.mark.parametrize(("n", "phase"), [(60_000, True), (600_000, False)])
def test_a_glitch_is_left_out_and_told(n, phase):
    x = force(n)
    missing, wild = x.copy(), x.copy()
    # One in the middle, and one that the first of the stretches meets which tell the colours.
    for place in (n // 2 + 137, 5_000):
        missing[place], wild[place] = np.nan, 1e16
    expected, found = (make_picture(y, columns=300, phase=phase) for y in (missing, wild))
    np.testing.assert_array_equal(found.values, expected.values)
    assert (found.view.low, found.view.high) == (expected.view.low, expected.view.high)
    assert found.view.reader.left_out(0, n) == 2
    assert found.view.reader.left_out(0, n // 2) == 1
    assert expected.view.reader.left_out(0, n) == 0


def test_glitches_are_left_out_of_uneven_recordings_and_of_forces_made_of_two_channels():
    x = np.stack([force(20_000, seed) for seed in range(3)], axis=1)
    missing, wild = x.copy(), x.copy()
    missing[9_000, 1], wild[9_000, 1] = np.nan, -1e16
    times = np.arange(20_000) / RATE
    times[12_000:] += 4e-4
    expected, found = (
        make_picture(recorded(y, times, ("fx1", "fy1", "fz1")), channel="tangential 1", columns=200)
        for y in (missing, wild)
    )
    np.testing.assert_array_equal(found.values, expected.values)
    assert found.view.reader.left_out(0, 20_000) == 1


def test_a_spike_that_is_no_glitch_leaves_the_forces_their_colours():
    x = force(100_000)
    usual = finish(open_channel(recorded(x), "fz", 2048.0))
    x[5_000:5_200] = 1e7
    loud = finish(open_channel(recorded(x), "fz", 2048.0))
    assert loud.high < usual.high + 3
    assert loud.low == pytest.approx(usual.low, abs=0.5)


@pytest.mark.usefixtures("long_from_little")
def test_a_loud_sample_hides_nothing_that_is_far_from_it():
    x = force(120_000)
    quiet = make_picture(x, columns=240)
    x[100_000] = 1e8
    loud = make_picture(x, columns=240)
    # What rests on no sample of the chunks that the widest wavelets hear it from.
    far = slice(0, 140)
    np.testing.assert_allclose(loud.values[:, far], quiet.values[:, far], atol=0.02)


@pytest.mark.usefixtures("long_from_little")
def test_rounding_of_what_is_loud_in_the_middle_of_a_wide_column_is_not_told_as_a_force():
    x = 1 + 1e6 * np.exp(-(((np.arange(400_000) - 150_000) / 1500) ** 2))
    # Of the seven chunks of the second column, neither the first nor the last hears of it.
    column = make_picture(x, columns=4).values[:, 1]
    floor = 1e-6 * 0.5e6 * np.sqrt(SCALES)
    assert np.all(10.0**column >= 0.99 * floor)


def test_what_is_left_out_can_be_asked_for_while_more_is_come_across():
    x = force(4_000)
    x[[5, 1000, 3999]] = 1e16
    source = finish(open_channel(recorded(x), "fz", 2048.0)).reader
    counts = [source.left_out(*span) for span in ((0, 5), (0, 6), (5, 1000), (999.5, 4000))]
    assert counts == [0, 1, 1, 2]


@pytest.mark.parametrize(("samples", "size"), [(10_000_000, 64), (100_000_000, 1024)])
def test_cells_of_endless_recordings_are_bounded(samples, size):
    reader = finish(open_reader(recorded(np.zeros(1000)), "fz"))
    cells = Cells(ChannelView(replace(reader, count=samples), Morlet()), row_scales(100, 2048.0))
    assert cells.size == size
    assert cells.values.nbytes <= module.MOST


@pytest.mark.usefixtures("long_from_little")
def test_a_long_span_whose_columns_are_too_narrow_for_cells_is_exact(tapped):
    picture = make_picture(tapped, columns=1500)
    assert_exact(picture, reference(tapped, 0, 60_000, 1500))
