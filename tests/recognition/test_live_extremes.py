"""Live recognition of signals that break careless code: finite, quiet, and as stated."""

import numpy as np
import pytest
from factories import labelled_set, synthetic_set
from hypothesis import example, given, settings
from hypothesis import strategies as st

from forcelab.demonstration import Demonstration
from forcelab.labels import UNLABELLED
from forcelab.recognition.online import OnlineRecogniser
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import train
from tests.recognition.live_reference import pushed, reference_labels

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
    "huge": lambda c: 1e300 * noise(c),
    "denormal": lambda c: 1e-315 * noise(c),
    "offset": lambda c: 1e9 + 1e-6 * noise(c),
    "step": lambda c: np.repeat([[0.0], [1.0]], N // 2, axis=0) * np.ones(c),
    "counts": lambda c: np.round(2000 * noise(c)).astype(">i2"),
    "holes": holed,
    "glitch": glitched,
    "glitch before the end": lambda c: glitched(c, slice(2400, 2403), 2500),
}


@pytest.mark.parametrize(("kind", "latency"), [*((kind, 0.1) for kind in SIGNALS), ("holes", 2.0)])
def test_labels_are_those_stated_whatever_comes(trained, channels, kind, latency):
    values = SIGNALS[kind](len(channels)).astype(float)
    n = len(values)
    online = OnlineRecogniser(trained, latency, channels, RATE)
    times, codes, probabilities = pushed(online, np.arange(n) / RATE, values, [20])
    assert len(codes) == n
    assert np.isfinite(probabilities).all()
    if kind == "holes" or kind.startswith("huge"):  # nothing can be as large: it is missing
        gap = (times >= 300 / RATE) & (times < 360 / RATE) if kind == "holes" else times >= 0
        assert np.all(codes[gap] == UNLABELLED)
        assert not probabilities[gap].any()
        return
    demonstration = Demonstration("d", "t", np.arange(n) / RATE, values, channels)
    expected = reference_labels(trained, demonstration, latency)
    assert np.abs(probabilities - expected.probabilities).max() < 1e-3
    assert np.array_equal(codes, expected.codes)


@pytest.mark.parametrize("size", [1e12, 1e29])
def test_a_glitch_is_a_sample_that_is_missing(trained, channels, size):
    found = []
    for value, blocks in ((np.nan, [20]), (size, [7])):
        values = glitched(len(channels), slice(0, 0))
        values[400:402, 2] = value
        online = OnlineRecogniser(trained, 0.2, channels, RATE)
        found.append(pushed(online, np.arange(N) / RATE, values, blocks)[1])
    assert np.array_equal(*found)


@settings(max_examples=5, deadline=None)
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
    found = [
        pushed(OnlineRecogniser(trained, 0.2, channels, RATE), times, x, each)
        for each in (sizes, [20])
    ]
    (stamps, codes, known), (_, again, _) = found
    assert np.array_equal(codes, again)
    assert (np.diff(stamps) > 0).all()
    sums = known.sum(axis=1)
    assert (np.isclose(sums, 1.0, atol=1e-9) | ((sums == 0) & (codes == UNLABELLED))).all()
    assert (known >= 0).all()
