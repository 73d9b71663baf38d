"""The stream gives what the offline engine gives, whatever the blocks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.signals.cwt import cwt, geometric_scales
from forcelab.signals.streaming import StreamingCwt, early_error
from forcelab.signals.wavelets import DOG, Haar, Morlet, RealMorlet

SCALES = geometric_scales(4.0, 256.0)


def stream_through(stream, x, blocks):
    """Coefficients of every sample, shape (c, k, n)."""
    parts, start, turn = [], 0, 0
    while start < len(x):
        parts.append(stream.push(x[start : start + blocks[turn % len(blocks)]]))
        start += blocks[turn % len(blocks)]
        turn += 1
    stream_values = np.concatenate([*parts, stream.finish()], axis=2)
    aligned = [stream_values[:, j, d : d + len(x)] for j, d in enumerate(stream.delays)]
    return np.stack(aligned, axis=1)


def make_signal(kind, n, seed=0):
    random = np.random.default_rng(seed)
    x = {
        "walk": np.cumsum(random.standard_normal(n)),
        "noise": random.standard_normal(n),
        "impulse": np.eye(1, n, n // 3)[0],
        "step": np.repeat([0.0, 1.0], [n // 2, n - n // 2]),
        "far": 1e9 + np.cumsum(random.standard_normal(n)),
        "large": 1e290 * random.standard_normal(n),
        "small": 1e-290 * random.standard_normal(n),
    }[kind]
    return x[:, None]


def worst(found, x, scales, wavelet=None):
    """Largest error over the scales, relative to the largest coefficient of the scale."""
    errors = []
    for c in range(x.shape[1]):
        expected = cwt(x[:, c], scales, wavelet)
        for mine, theirs in zip(found[c], expected, strict=True):
            errors.append(np.abs(mine - theirs).max() / np.abs(theirs).max())
    return max(errors)


@pytest.mark.parametrize("kind", ["walk", "noise", "impulse", "step", "far", "large", "small"])
@pytest.mark.parametrize("tolerance", [1e-3, 3e-5, 3e-7])
def test_complete_coefficients_are_the_offline_ones_within_the_tolerance(kind, tolerance):
    x = make_signal(kind, 6000)
    stream = StreamingCwt(SCALES, 1, tolerance=tolerance)
    assert worst(stream_through(stream, x, [20]), x, SCALES) <= tolerance


@settings(max_examples=12, deadline=None)
@given(
    blocks=st.lists(st.integers(1, 5000), min_size=1, max_size=5),
    n=st.integers(1, 4000),
    latency=st.one_of(st.none(), st.integers(0, 300)),
)
def test_blocks_of_any_size_give_the_same(blocks, n, latency):
    # Many blocks of one sample would take long and show nothing new.
    if sum(blocks) / len(blocks) < n / 300:
        blocks = [*blocks, n]
    x = make_signal("walk", n)
    first, second = (StreamingCwt(SCALES, 1, latency=latency) for _ in range(2))
    found, expected = stream_through(first, x, blocks), stream_through(second, x, [n])
    # Where a block begins decides which samples come from the decimated copy.
    assert np.abs(found - expected).max() <= 3e-9 * max(1.0, np.abs(x - x[0]).max())


@pytest.mark.parametrize("latency", [0, 7, 64, 200])
def test_an_early_coefficient_rests_on_no_later_sample_and_holds_the_newest(latency):
    x = make_signal("walk", 3000)
    stream = StreamingCwt(SCALES, 1, latency=latency)
    found = stream_through(stream, x, [50])
    for b in (500, 1711, 2500):
        for j, scale in enumerate(SCALES):
            end = b + stream.delays[j] + 1
            held = x[end - max(1, int(scale / 8)) : end, 0].mean()
            known = np.concatenate([x[:end, 0], np.full(3000, held)])
            expected = cwt(known, [scale])[0]
            assert abs(found[0, j, b] - expected[b]) <= 1e-4 * np.abs(expected).max()


@pytest.mark.parametrize(("kind", "most"), [("walk", 1.0), ("noise", 1.5)])
def test_early_estimates_err_as_much_as_is_said(kind, most):
    x, scale = make_signal(kind, 40_000), 32.0
    expected = cwt(x[:, 0], [scale])[0]
    inside = slice(400, -400)
    for share in (0.5, 1.0, 2.0, 3.0):
        found = stream_through(StreamingCwt([scale], 1, latency=int(share * scale)), x, [5000])[
            0, 0
        ]
        error = np.std((found - expected)[inside]) / np.std(expected[inside])
        assert 0.8 * early_error(share) < error < most * early_error(share)


@pytest.mark.parametrize("wavelet", [Morlet(2.0), Morlet(20.0), RealMorlet(), DOG(2), DOG(9)])
def test_other_wavelets_stream_too(wavelet):
    scales = np.array([64.0, 8.0, 150.0])  # in any order
    x = make_signal("walk", 4000)
    stream = StreamingCwt(scales, 1, wavelet, tolerance=1e-4)
    found = stream_through(stream, x, [33])
    assert worst(found, x, scales, wavelet) <= 1e-4
    assert not (wavelet.real and found.imag.any())


def test_a_cut_wavelet_agrees_as_far_as_its_ringing_is_waited_for():
    x = np.column_stack(
        [make_signal("impulse", 4000), make_signal("step", 4000), make_signal("walk", 4000)]
    )
    for wavelet, scales in ((Morlet(), [2.0]), (Haar(), [16.0, 100.0])):
        stream = StreamingCwt(scales, 3, wavelet, tolerance=1e-3)
        assert worst(stream_through(stream, x, [100]), x, scales, wavelet) <= 2e-2


def test_a_constant_gives_exactly_nothing_at_any_level():
    for level in (0.0, 7.0, 1e300, -1e9):
        stream = StreamingCwt(SCALES, 2)
        assert not stream_through(stream, np.full((3000, 2), level), [700]).any()


def test_nothing_drifts_and_nothing_grows():
    stream = StreamingCwt(SCALES, 1)
    random = np.random.default_rng(3)
    wave = np.sin(np.arange(4096) * 2 * np.pi / 64)[:, None]
    first, sizes = None, set()
    for turn in range(8):
        # A level that wanders far between two looks at the same wave.
        stream.push(1e6 * np.cumsum(random.standard_normal((500, 1)), axis=0))
        stream.push(np.zeros((4096, 1)))
        found = stream.push(wave)[:, :, 3000:]
        first = found if first is None else first
        assert np.abs(found - first).max() < 1e-5
        if turn:
            sizes.add(
                sum(t._table.nbytes for t in (stream._tapes.fine, *stream._tapes.coarse.values()))
            )
    assert len(sizes) == 1
    assert stream.pushed == 8 * 8692


def test_a_stream_that_is_reset_starts_anew():
    x = make_signal("walk", 1000)
    stream = StreamingCwt(SCALES, 1)
    stream.push(1e5 + make_signal("noise", 777))
    stream.reset()
    fresh = StreamingCwt(SCALES, 1)
    assert np.array_equal(stream_through(stream, x, [100]), stream_through(fresh, x, [100]))


@pytest.mark.parametrize("level", [0.0, 7.0])
def test_an_empty_block_and_an_empty_stream_give_nothing(level):
    stream = StreamingCwt(SCALES, 3)
    assert stream.finish().shape == (3, len(SCALES), 0)
    assert stream.push(np.empty((0, 3))).shape == (3, len(SCALES), 0)
    assert not stream.push(np.full((1, 3), level)).any()


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (([0.0], 1), "positive"),
        (([np.nan], 1), "positive"),
        (([4.0], 0), "at least one channel"),
        (([4.0], 1, None, 0.0), "tolerance"),
        (([4.0], 1, None, 1e-3, -1), "latency"),
    ],
)
def test_what_cannot_be_streamed_is_refused(arguments, word):
    with pytest.raises(InputError, match=word):
        StreamingCwt(*arguments)


@pytest.mark.parametrize("block", [np.zeros((5, 2)), np.zeros(5), [[np.nan]], [[np.inf]]])
def test_blocks_that_do_not_fit_are_refused_and_leave_the_stream_as_it_was(block):
    stream = StreamingCwt(SCALES, 1)
    stream.push(np.ones((10, 1)))
    with pytest.raises(InputError):
        stream.push(block)
    assert stream.pushed == 10


EXTREME_SCALES = np.array([3.0, 8.0, 40.0])
TOLERANCE = 3e-5
#: Coefficients that are denormal themselves have steps of 5e-324, which is all they can keep.
LEAST = 2e-323 / TOLERANCE


def stream_extreme(x, scales=EXTREME_SCALES, wavelet=None, block=100, tolerance=TOLERANCE):
    """Coefficients of every sample, shape (c, k, n)."""
    stream = StreamingCwt(scales, x.shape[1], wavelet, tolerance)
    parts = [stream.push(x[i : i + block]) for i in range(0, len(x), block)]
    stream_values = np.concatenate([*parts, stream.finish()], axis=2)
    return np.stack(
        [stream_values[:, j, d : d + len(x)] for j, d in enumerate(stream.delays)], axis=1
    )


def worst_error(x, found, scales=EXTREME_SCALES, wavelet=None):
    """Largest error relative to the largest coefficient of the scale, or to the signal's rounding.

    Where a wavelet has nothing below the Nyquist frequency its coefficients are nothing beside
    the signal, and only that is asked of them.
    """
    errors = []
    for c in range(x.shape[1]):
        expected = cwt(x[:, c], scales, wavelet)
        around = float(np.max(np.abs(x[:, c] - x[0, c])))
        for a, mine, theirs in zip(scales, found[c], expected, strict=True):
            top = max(float(np.abs(theirs).max()), 1e-9 * np.sqrt(a) * around, LEAST)
            size, exponent = np.frexp(top)
            parts = [
                np.ldexp(np.ascontiguousarray(z).view(float), -int(exponent))
                for z in (mine, theirs)
            ]
            apart = (parts[0] - parts[1]).view(complex)
            errors.append(float(np.abs(apart).max() / size))
    return max(errors)


def column(values):
    return np.asarray(values)[:, None]


def noise(n=700, seed=0):
    return np.random.default_rng(seed).standard_normal(n)


@pytest.mark.parametrize("level", [0.0, -0.0, 1e-300, 5e-324, 7.0, 1e9, 1e300, -1.7e308])
def test_a_constant_gives_exactly_nothing(level):
    assert not stream_extreme(column(np.full(400, level)), block=90).any()


@pytest.mark.parametrize("size", [1e-320, 1e-308, 1e-300, 1e-160, 1.0, 1e160, 1e300])
def test_any_amplitude_gives_the_offline_coefficients(size):
    x = column(noise() * size)
    assert worst_error(x, stream_extreme(x, block=70)) <= TOLERANCE


def test_from_denormal_to_huge_in_one_stream():
    x = column(noise() * np.logspace(-320, 300, 700))
    found = stream_extreme(x, block=13)
    assert worst_error(x, found) <= TOLERANCE
    # At their time the tiny ones are given as they are, not as nothing beside what is to come.
    early = x[:200]
    assert np.abs(found[0, 0, :180]).max() == pytest.approx(
        np.abs(cwt(early[:, 0], EXTREME_SCALES[:1])[0, :180]).max(), rel=1e-3
    )


def test_a_small_vibration_on_a_large_offset_is_heard():
    x = 1e9 + 1e-6 * np.sin(2 * np.pi * np.arange(2000) / 16)
    # The offset has left steps of 1.2e-7 of it: the transform of these is right, nothing else.
    assert worst_error(column(x), stream_extreme(column(x))) <= TOLERANCE
    assert np.abs(stream_extreme(column(x))[0, 1, 500]) > 1e-7


@pytest.mark.parametrize("place", [0, 1, 2, 99, 100, 333, 698, 699])
def test_one_impulse_anywhere(place):
    x = column(np.eye(1, 700, place)[0])
    assert worst_error(x, stream_extreme(x)) <= TOLERANCE


@pytest.mark.parametrize(
    "x",
    [
        np.repeat([0.0, 1.0], 350),
        np.repeat([-1e300, 1e300], 350),
        1e6 * np.arange(700.0),
        np.arange(700, dtype=np.int64) ** 2,
        np.round(2000 * noise()).astype(np.int16),
        np.where(np.arange(700) // 4 % 2, np.int16(32767), np.int16(-32768)),
        np.round(3 * noise()).astype(">i2"),
        noise().astype(">f8"),
        noise().astype(np.float32),
        noise() > 0,
        np.repeat(noise(), 2)[::2],
        noise()[::-1],
    ],
    ids=[
        "step", "huge step", "ramp", "integers", "int16", "int16 at its ends", "big-endian int16",
        "big-endian", "float32", "booleans", "every other", "backwards",
    ],
)  # fmt: skip
def test_any_kind_of_numbers_in_any_layout(x):
    x = column(x)
    assert worst_error(x.astype(np.float64), stream_extreme(x)) <= TOLERANCE


def test_read_only_and_fortran_ordered_blocks_are_taken_and_left_alone():
    x = np.asfortranarray(np.column_stack([noise(), noise(seed=1)]))
    x.flags.writeable = False
    before = x.copy()
    assert worst_error(x, stream_extreme(x)) <= TOLERANCE
    assert np.array_equal(x, before)


def test_a_single_channel_among_silent_ones():
    x = np.zeros((700, 5))
    x[:, 3] = noise()
    found = stream_extreme(x)
    assert not found[[0, 1, 2, 4]].any()
    assert worst_error(x[:, 3:4], found[3:4]) <= TOLERANCE


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 127])
def test_streams_shorter_than_the_wavelet(n):
    x = column(noise(n))
    scales = np.array([3.0, 10.0 * n + 4])
    assert worst_error(x, stream_extreme(x, scales, block=3), scales) <= TOLERANCE


@pytest.mark.parametrize("p", [0.5, 1.0, 2.0, 5.0, 20.0, 50.0])
def test_any_number_of_oscillations(p):
    # The carrier at most at a third of the Nyquist frequency.
    scales = np.array([1.0, 1.5, 4.0]) * max(3.0, 3 * p / np.pi)
    x = column(noise(1500))
    assert worst_error(x, stream_extreme(x, scales, Morlet(p)), scales, Morlet(p)) <= TOLERANCE


@pytest.mark.parametrize(("scale", "audible"), [(0.5, 0.06), (1.0, 0.06), (2.0, 0.02), (2.5, 2e-3)])
def test_a_wavelet_beyond_nyquist_rings_offline_and_live_alike(scale, audible):
    # What it rings after 512 samples live has ended: of white noise the share stated.
    smooth = np.convolve(noise(900), np.hanning(40), "valid")
    for x, share in ((noise(3000), audible), (np.eye(1, 3000, 1500)[0], 0.1 * audible)):
        assert worst_error(column(x), stream_extreme(column(x), [scale]), [scale]) <= share
    scales = [scale]
    expected = cwt(smooth, scales)
    found = stream_extreme(column(smooth), scales)[0]
    # Of a signal without power up there nothing is left of the ringing.
    assert np.abs(found - expected)[0, 50:-50].max() <= TOLERANCE * np.abs(smooth).max()


def test_a_wavelet_with_nothing_below_nyquist_gives_nothing():
    x = column(noise())
    found = stream_extreme(x, [8.0], Morlet(50.0))
    assert np.abs(found).max() < 1e-100


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", [0, 99])
def test_missing_samples_are_refused_and_the_stream_goes_on_as_if_they_had_not_come(wrong, place):
    x = column(noise(300))
    stream, clean = StreamingCwt(EXTREME_SCALES, 1), StreamingCwt(EXTREME_SCALES, 1)
    stream.push(x[:100])
    clean.push(x[:100])
    holed = x[100:200].copy()
    holed[place] = wrong
    with pytest.raises(InputError, match="finite"):
        stream.push(holed)
    assert np.array_equal(stream.push(x[100:]), clean.push(x[100:]))
