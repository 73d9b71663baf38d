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


def streamed(stream, x, blocks):
    """Coefficients of every sample, shape (c, k, n)."""
    parts, start, turn = [], 0, 0
    while start < len(x):
        parts.append(stream.push(x[start : start + blocks[turn % len(blocks)]]))
        start += blocks[turn % len(blocks)]
        turn += 1
    whole = np.concatenate([*parts, stream.finish()], axis=2)
    aligned = [whole[:, j, d : d + len(x)] for j, d in enumerate(stream.delays)]
    return np.stack(aligned, axis=1)


def made(kind, n, seed=0):
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
        wanted = cwt(x[:, c], scales, wavelet)
        for mine, theirs in zip(found[c], wanted, strict=True):
            errors.append(np.abs(mine - theirs).max() / np.abs(theirs).max())
    return max(errors)


@pytest.mark.parametrize("kind", ["walk", "noise", "impulse", "step", "far", "large", "small"])
@pytest.mark.parametrize("tolerance", [1e-3, 3e-5, 3e-7])
def test_complete_coefficients_are_the_offline_ones_within_the_tolerance(kind, tolerance):
    x = made(kind, 6000)
    stream = StreamingCwt(SCALES, 1, tolerance=tolerance)
    assert worst(streamed(stream, x, [20]), x, SCALES) <= tolerance


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
    x = made("walk", n)
    one, other = (StreamingCwt(SCALES, 1, latency=latency) for _ in range(2))
    found, wanted = streamed(one, x, blocks), streamed(other, x, [n])
    # Where a block begins decides which samples come from the decimated copy.
    assert np.abs(found - wanted).max() <= 3e-9 * max(1.0, np.abs(x - x[0]).max())


@pytest.mark.parametrize("latency", [0, 7, 64, 200])
def test_an_early_coefficient_rests_on_no_later_sample_and_holds_the_newest(latency):
    x = made("walk", 3000)
    stream = StreamingCwt(SCALES, 1, latency=latency)
    found = streamed(stream, x, [50])
    for b in (500, 1711, 2500):
        for j, scale in enumerate(SCALES):
            end = b + stream.delays[j] + 1
            held = x[end - max(1, int(scale / 8)) : end, 0].mean()
            known = np.concatenate([x[:end, 0], np.full(3000, held)])
            wanted = cwt(known, [scale])[0]
            assert abs(found[0, j, b] - wanted[b]) <= 1e-4 * np.abs(wanted).max()


@pytest.mark.parametrize(("kind", "most"), [("walk", 1.0), ("noise", 1.5)])
def test_early_estimates_err_as_much_as_is_said(kind, most):
    x, scale = made(kind, 40_000), 32.0
    wanted = cwt(x[:, 0], [scale])[0]
    inside = slice(400, -400)
    for share in (0.5, 1.0, 2.0, 3.0):
        found = streamed(StreamingCwt([scale], 1, latency=int(share * scale)), x, [5000])[0, 0]
        error = np.std((found - wanted)[inside]) / np.std(wanted[inside])
        assert 0.8 * early_error(share) < error < most * early_error(share)


@pytest.mark.parametrize("wavelet", [Morlet(2.0), Morlet(20.0), RealMorlet(), DOG(2), DOG(9)])
def test_other_wavelets_stream_too(wavelet):
    scales = np.array([64.0, 8.0, 150.0])  # in any order
    x = made("walk", 4000)
    stream = StreamingCwt(scales, 1, wavelet, tolerance=1e-4)
    found = streamed(stream, x, [33])
    assert worst(found, x, scales, wavelet) <= 1e-4
    assert not (wavelet.real and found.imag.any())


def test_a_cut_wavelet_agrees_as_far_as_its_ringing_is_waited_for():
    x = np.column_stack([made("impulse", 4000), made("step", 4000), made("walk", 4000)])
    for wavelet, scales in ((Morlet(), [2.0]), (Haar(), [16.0, 100.0])):
        stream = StreamingCwt(scales, 3, wavelet, tolerance=1e-3)
        assert worst(streamed(stream, x, [100]), x, scales, wavelet) <= 2e-2


def test_a_constant_gives_exactly_nothing_at_any_level():
    for level in (0.0, 7.0, 1e300, -1e9):
        stream = StreamingCwt(SCALES, 2)
        assert not streamed(stream, np.full((3000, 2), level), [700]).any()


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
    x = made("walk", 1000)
    stream = StreamingCwt(SCALES, 1)
    stream.push(1e5 + made("noise", 777))
    stream.reset()
    fresh = StreamingCwt(SCALES, 1)
    assert np.array_equal(streamed(stream, x, [100]), streamed(fresh, x, [100]))


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
