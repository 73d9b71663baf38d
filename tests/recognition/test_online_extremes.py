"""Live recognition of signals that break careless code: finite, quiet, and as stated."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic import synthetic_set

from forcelab.demonstration import Demonstration
from forcelab.labels import UNLABELLED
from forcelab.recognition.examples import Labelled
from forcelab.recognition.latency import with_latency
from forcelab.recognition.online import OnlineRecogniser
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import train

RATE, N = 250.0, 900


@pytest.fixture(scope="module")
def trained():
    items = [Labelled(*item) for item in synthetic_set(1, rate=RATE)]
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
}


@pytest.mark.parametrize(
    ("kind", "latency"), [*((kind, 0.1) for kind in SIGNALS), ("holes", 2.0), ("huge", 2.0)]
)
def test_labels_are_those_stated_whatever_comes(trained, channels, kind, latency):
    values = SIGNALS[kind](len(channels))
    times = np.arange(N) / RATE
    online = OnlineRecogniser(trained, latency, channels, RATE)
    parts = [online.push(times[i : i + 20], values[i : i + 20]) for i in range(0, N, 20)]
    parts.append(online.finish())
    codes = np.concatenate([part.codes for part in parts])
    probabilities = np.concatenate([part.probabilities for part in parts])
    assert np.isfinite(probabilities).all()
    stated = with_latency(
        trained, Demonstration("d", "t", times, values.astype(float), channels), latency
    )
    assert len(codes) == N
    assert np.abs(probabilities - stated.probabilities).max() < 1e-3
    assert np.array_equal(codes, stated.codes)


@settings(max_examples=20, deadline=None)
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
