"""The stream on the most awkward signals there are: what is right is known, and that is given."""

import numpy as np
import pytest

from forcelab.errors import InputError
from forcelab.signals.cwt import cwt
from forcelab.signals.streaming import StreamingCwt
from forcelab.signals.wavelets import Morlet

SCALES = np.array([3.0, 8.0, 40.0])
TOLERANCE = 3e-5
#: Coefficients that are denormal themselves have steps of 5e-324, which is all they can keep.
LEAST = 2e-323 / TOLERANCE


def streamed(x, scales=SCALES, wavelet=None, block=100, tolerance=TOLERANCE):
    """Coefficients of every sample, shape (c, k, n)."""
    stream = StreamingCwt(scales, x.shape[1], wavelet, tolerance)
    parts = [stream.push(x[i : i + block]) for i in range(0, len(x), block)]
    whole = np.concatenate([*parts, stream.finish()], axis=2)
    return np.stack([whole[:, j, d : d + len(x)] for j, d in enumerate(stream.delays)], axis=1)


def worst(x, found, scales=SCALES, wavelet=None):
    """Largest error relative to the largest coefficient of the scale, or to the signal's rounding.

    Where a wavelet has nothing below the Nyquist frequency its coefficients are nothing beside
    the signal, and only that is asked of them.
    """
    errors = []
    for c in range(x.shape[1]):
        wanted = cwt(x[:, c], scales, wavelet)
        around = float(np.max(np.abs(x[:, c] - x[0, c])))
        for a, mine, theirs in zip(scales, found[c], wanted, strict=True):
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
    assert not streamed(column(np.full(400, level)), block=90).any()


@pytest.mark.parametrize("size", [1e-320, 1e-308, 1e-300, 1e-160, 1.0, 1e160, 1e300])
def test_any_amplitude_gives_the_offline_coefficients(size):
    x = column(noise() * size)
    assert worst(x, streamed(x, block=70)) <= TOLERANCE


def test_from_denormal_to_huge_in_one_stream():
    x = column(noise() * np.logspace(-320, 300, 700))
    found = streamed(x, block=13)
    assert worst(x, found) <= TOLERANCE
    # At their time the tiny ones are given as they are, not as nothing beside what is to come.
    early = x[:200]
    assert np.abs(found[0, 0, :180]).max() == pytest.approx(
        np.abs(cwt(early[:, 0], SCALES[:1])[0, :180]).max(), rel=1e-3
    )


def test_a_small_vibration_on_a_large_offset_is_heard():
    x = 1e9 + 1e-6 * np.sin(2 * np.pi * np.arange(2000) / 16)
    # The offset has left steps of 1.2e-7 of it: the transform of these is right, nothing else.
    assert worst(column(x), streamed(column(x))) <= TOLERANCE
    assert np.abs(streamed(column(x))[0, 1, 500]) > 1e-7


@pytest.mark.parametrize("place", [0, 1, 2, 99, 100, 333, 698, 699])
def test_one_impulse_anywhere(place):
    x = column(np.eye(1, 700, place)[0])
    assert worst(x, streamed(x)) <= TOLERANCE


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
    assert worst(x.astype(np.float64), streamed(x)) <= TOLERANCE


def test_read_only_and_fortran_ordered_blocks_are_taken_and_left_alone():
    x = np.asfortranarray(np.column_stack([noise(), noise(seed=1)]))
    x.flags.writeable = False
    before = x.copy()
    assert worst(x, streamed(x)) <= TOLERANCE
    assert np.array_equal(x, before)


def test_a_single_channel_among_silent_ones():
    x = np.zeros((700, 5))
    x[:, 3] = noise()
    found = streamed(x)
    assert not found[[0, 1, 2, 4]].any()
    assert worst(x[:, 3:4], found[3:4]) <= TOLERANCE


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 127])
def test_streams_shorter_than_the_wavelet(n):
    x = column(noise(n))
    scales = np.array([3.0, 10.0 * n + 4])
    assert worst(x, streamed(x, scales, block=3), scales) <= TOLERANCE


@pytest.mark.parametrize("p", [0.5, 1.0, 2.0, 5.0, 20.0, 50.0])
def test_any_number_of_oscillations(p):
    # The carrier at most at a third of the Nyquist frequency.
    scales = np.array([1.0, 1.5, 4.0]) * max(3.0, 3 * p / np.pi)
    x = column(noise(1500))
    assert worst(x, streamed(x, scales, Morlet(p)), scales, Morlet(p)) <= TOLERANCE


@pytest.mark.parametrize(("scale", "heard"), [(0.5, 0.06), (1.0, 0.06), (2.0, 0.02), (2.5, 2e-3)])
def test_a_wavelet_beyond_nyquist_rings_offline_and_live_alike(scale, heard):
    # What it rings after 512 samples live has ended: of white noise the share stated.
    smooth = np.convolve(noise(900), np.hanning(40), "valid")
    for x, share in ((noise(3000), heard), (np.eye(1, 3000, 1500)[0], 0.1 * heard)):
        assert worst(column(x), streamed(column(x), [scale]), [scale]) <= share
    scales = [scale]
    wanted = cwt(smooth, scales)
    found = streamed(column(smooth), scales)[0]
    # Of a signal without power up there nothing is left of the ringing.
    assert np.abs(found - wanted)[0, 50:-50].max() <= TOLERANCE * np.abs(smooth).max()


def test_a_wavelet_with_nothing_below_nyquist_gives_nothing():
    x = column(noise())
    found = streamed(x, [8.0], Morlet(50.0))
    assert np.abs(found).max() < 1e-100


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", [0, 99])
def test_missing_samples_are_refused_and_the_stream_goes_on_as_if_they_had_not_come(wrong, place):
    x = column(noise(300))
    stream, clean = StreamingCwt(SCALES, 1), StreamingCwt(SCALES, 1)
    stream.push(x[:100])
    clean.push(x[:100])
    holed = x[100:200].copy()
    holed[place] = wrong
    with pytest.raises(InputError, match="finite"):
        stream.push(holed)
    assert np.array_equal(stream.push(x[100:]), clean.push(x[100:]))
