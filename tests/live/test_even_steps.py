"""The even grid of a stream."""

import numpy as np

from forcelab.live.even_steps import PATIENCE, CausalGrid, Steps


def test_how_a_gap_is_bridged_does_not_depend_on_the_blocks():
    """Of one channel for longer than is waited, while others miss a few samples now and then."""
    n = 3 * PATIENCE
    signals = np.cumsum(np.random.default_rng(0).standard_normal((n, 3)), axis=0)
    signals[300 : 300 + PATIENCE + 200, 0] = np.nan
    signals[[100, 101, 102, 2300, n - 1], 1] = 1e16
    signals[2200:2204, 2] = 5e9  # it lasts
    for first in range(0, n, 90):
        signals[first : first + 30, 1 + first // 90 % 2] = np.nan
    times = np.arange(n) / 250.0
    times[2000:] += 3.0 * PATIENCE / 250  # then nothing at all for a while
    times[2500] = times[2499]
    found = []
    for size in (n, 1, 7, 61, 500):
        grid, steps = CausalGrid(3, 250.0, 100_000), Steps.none(3)
        for first in range(0, n, size):
            steps += grid.push(times[first : first + size], signals[first : first + size])
            steps += grid.push(times[:0], signals[:0])  # nothing new
        found.append(steps + grid.finish())
    for other in found[1:]:
        assert np.array_equal(other.times, found[0].times)
        assert np.array_equal(other.signals, found[0].signals)
        assert np.array_equal(other.valid, found[0].valid)
    assert np.abs(found[0].signals[:, :2]).max() < 1e3
    assert np.count_nonzero(found[0].signals[:, 2] == 5e9) == 4
