"""Live recognition of signals that break careless code: finite, quiet, and as stated."""

import numpy as np
import pytest
from factories import labelled_set, synthetic_set
from hypothesis import example, given, settings
from hypothesis import strategies as st

from forcelab.demonstration import Demonstration
from forcelab.labels import UNLABELLED
from forcelab.recognition.features import ROUNDING
from forcelab.recognition.live import OnlineRecogniser
from forcelab.recognition.live_features import EVERY, LASTING, Floor, StreamingFeatures
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import train
from forcelab.signals.streaming import HALF, StreamingCwt
from forcelab.signals.wavelets import Morlet
from tests.recognition.live_reference import reference_labels

RATE, N = 250.0, 900


@pytest.fixture(scope="module")
def trained():
    items = labelled_set(1, rate=RATE)
    return train(items, Settings(max_scale=16.0, stride=20))


@pytest.fixture(scope="module")
def channels(trained):
    return synthetic_set(1, rate=RATE)[0][0].channels


def noise(columns):
    return np.random.default_rng(1).standard_normal((N, columns))


def holed(columns):
    x = noise(columns)
    x[100:103] = np.nan
    x[300:360, 0] = np.inf
    x[500, :] = -np.inf
    x[850:, 1] = np.nan
    return x


def glitched(columns, places=slice(400, 401), n=N):
    x = 0.01 * np.random.default_rng(2).standard_normal((n, columns))
    x += np.sin(np.arange(n) / 40)[:, None]
    x[places] = 1e16
    return x


SIGNALS = {
    "zeros": lambda c: np.zeros((N, c)),
    "tiny constant": lambda c: np.full((N, c), 1e-300),
    "huge constant": lambda c: np.full((N, c), 1e300),
    "tiny": lambda c: 1e-300 * noise(c),
    "huge": lambda c: 1e300 * noise(c),
    "denormal": lambda c: 1e-315 * noise(c),
    "offset": lambda c: 1e9 + 1e-6 * noise(c),
    "impulse": lambda c: np.eye(N, c, -450),
    "step": lambda c: np.repeat([[0.0], [1.0]], N // 2, axis=0) * np.ones(c),
    "ramp": lambda c: np.linspace(0, 1e6, N)[:, None] * np.ones(c),
    "counts": lambda c: np.round(2000 * noise(c)).astype(">i2"),
    "holes": holed,
    "glitch": glitched,
    "glitch before the end": lambda c: glitched(c, slice(2400, 2403), 2500),
}


@pytest.mark.parametrize(
    ("kind", "latency"), [*((kind, 0.1) for kind in SIGNALS), ("holes", 2.0), ("huge", 2.0)]
)
def test_labels_are_those_stated_whatever_comes(trained, channels, kind, latency):
    values = SIGNALS[kind](len(channels))
    n = len(values)
    times = np.arange(n) / RATE
    online = OnlineRecogniser(trained, latency, channels, RATE)
    parts = [online.push(times[i : i + 20], values[i : i + 20]) for i in range(0, n, 20)]
    parts.append(online.finish())
    codes = np.concatenate([part.codes for part in parts])
    probabilities = np.concatenate([part.probabilities for part in parts])
    assert np.isfinite(probabilities).all()
    expected = reference_labels(
        trained, Demonstration("d", "t", times, values.astype(float), channels), latency
    )
    assert len(codes) == n
    assert np.abs(probabilities - expected.probabilities).max() < 1e-3
    assert np.array_equal(codes, expected.codes)


def featured(x, transform):
    """Features of a stream that comes in blocks of 50, shape (n, f), a step behind."""
    transform.reset()
    stream = StreamingFeatures(x.shape[1], transform, int(transform.delays[0]), True)
    parts = [stream.push(x[i : i + 50]) for i in range(0, len(x), 50)]
    return np.concatenate([*parts, stream.finish()])


def pasts(transform):
    """Samples before a coefficient's beyond which none plays a part in it, for each scale."""
    return np.ceil(transform.pasts + HALF * transform.scales).astype(int)  # and a copy's filter


@pytest.mark.parametrize(("size", "place"), [(1e12, 1500), (1e16, 2 * EVERY - 1), (1e300, 1500)])
def test_a_glitch_is_forgotten_once_no_wavelet_holds_it(size, place):
    scales = np.array([2.0, 16.0, 128.0])
    transform = StreamingCwt(scales, 1, Morlet(), 3e-5, 100, together=True)
    x = glitched(1, slice(0, 0), 6000)
    y = x.copy()
    y[place] = size
    clean, found = featured(x, transform), featured(y, transform)
    for j, past in enumerate(pasts(transform).tolist()):
        after = place + past + 1
        assert after < 4000
        assert np.array_equal(found[after:, j::3], clean[after:, j::3])
        assert not np.array_equal(found[place : place + 50, j], clean[place : place + 50, j])


@pytest.mark.parametrize("burst", [slice(2000, 3300), slice(2060, 2800)], ids=str)
def test_the_floor_lies_above_the_rounding_that_a_long_disturbance_leaves_behind(burst):
    """It takes the base with it: samples after it, and those kept then, are rounded as it is."""
    scales, n = np.array([3.0, 16.0]), (LASTING + 5) * EVERY
    clean = glitched(1, slice(0, 0), n)
    disturbed = clean.copy()
    disturbed[burst] = 1e16
    one, other = (StreamingCwt(scales, 1, None, 3e-5, 50, together=True) for _ in range(2))
    floor, wrong = Floor(1, scales), []
    for first in range(0, n, EVERY):
        rows = slice(first, first + EVERY)
        apart = np.abs(one.push(disturbed[rows]) - other.push(clean[rows])).max(axis=2)[0]
        if first > burst.stop + (one.delays + pasts(one)).max():
            assert (apart <= np.exp(floor.now[0])).all()
            wrong.append(apart.max())
        floor.see(disturbed[rows])
        floor.look()
    assert wrong[0] > 1e-3  # or there is nothing to lie above
    assert wrong[-1] == 0.0
    assert floor.now.max() < np.log(1e-3)


def test_the_floor_stays_in_a_while_of_silence_and_recovers_from_a_wild_first_sample():
    floor, now = Floor(1, np.array([16.0])), []
    loud = 5.0 * np.sin(np.arange(EVERY) / 10)[:, None]
    for look in range(LASTING + 20):
        rows = loud if look < LASTING + 5 else 0.0 * loud
        floor.see(np.where(np.arange(EVERY)[:, None] + look == 0, 1e16, rows))
        floor.look()
        now.append(floor.now.item())
    assert now[LASTING - 1] > np.log(1e2)
    assert now[LASTING] < np.log(1e-2)
    # Without any noise it is the rounding of the forces before.
    assert now[LASTING + 6 :] == pytest.approx([np.log(5.0 * ROUNDING * 4.0)] * 14, abs=0.1)


@settings(max_examples=20, deadline=None)
@example(seed=14, sizes=[61])
@given(seed=st.integers(0, 999), sizes=st.lists(st.integers(1, 300), min_size=1, max_size=5))
def test_whatever_is_missing_probabilities_are_some_and_blocks_play_no_part(
    trained, channels, seed, sizes
):
    """Bursts of NaN, steps, a channel that dies, stamps that jump, stand still or go back."""
    rng = np.random.default_rng(seed)
    x = np.cumsum(np.where(rng.random((N, len(channels))) < 0.01, 1e6, 1e-3), axis=0)
    x += noise(len(channels))
    for place in rng.integers(0, N, 6).tolist():
        x[place : place + int(rng.integers(1, 80)), rng.integers(0, len(channels))] = np.nan
    x[N // 2 :, rng.integers(0, len(channels))] = x[N // 2, 0]
    jumps = np.where(rng.random(N) < 0.01, rng.choice([-0.5, -0.004, 0.05, 40.0], N), 0.0)
    times = np.arange(N) / RATE + np.cumsum(jumps)
    found = [pushed(trained, channels, times, x, each) for each in (sizes, [20])]
    (stamps, codes, known), (_, again, _) = found
    assert np.array_equal(codes, again)
    assert (np.diff(stamps) > 0).all()
    sums = known.sum(axis=1)
    assert (np.isclose(sums, 1.0, atol=1e-9) | ((sums == 0) & (codes == UNLABELLED))).all()
    assert (known >= 0).all()


def pushed(recogniser, channels, times, values, sizes):
    """Times, codes and probabilities of a stream that comes in blocks of these sizes in turn."""
    online = OnlineRecogniser(recogniser, 0.2, channels, RATE)
    parts, first = [], 0
    while first < len(times):
        last = first + sizes[len(parts) % len(sizes)]
        parts.append(online.push(times[first:last], values[first:last]))
        first = last
    parts.append(online.finish())
    return [
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("times", "codes", "probabilities")
    ]
