"""Frames that are missing are told from frames that are late, by arrivals alone."""

import numpy as np
import pytest

from forcelab.capture.camera import DropCounter

RATE = 30.0


def delivered(seed, seconds=300.0, dropped=0.0, starved=0):
    """When frames arrive at a reader that is busy now and then; how many are missing between."""
    rng = np.random.default_rng(seed)
    true = np.arange(int(seconds * RATE)) / RATE
    kept = rng.random(len(true)) >= dropped
    ready = true + rng.exponential(0.003, len(true))
    for begin in rng.uniform(0, seconds, 20):  # nobody reads for up to 0.4 s
        end = begin + rng.uniform(0.02, 0.4)
        ready[(ready > begin) & (ready < end)] = end
    for begin in rng.uniform(0, seconds, starved):  # all is late for two seconds
        late = (ready > begin) & (ready < begin + 2)
        ready[late] += rng.uniform(0, 0.02, late.sum())
    arrived = np.maximum.accumulate(ready)[kept] + 1e-3 * np.arange(kept.sum()) / RATE
    for i in range(1, len(arrived)):
        arrived[i] = max(arrived[i], arrived[i - 1] + 0.001)
    inside = kept[np.flatnonzero(kept)[0] : np.flatnonzero(kept)[-1]]
    return arrived, int((~inside).sum())


def counted(arrived, own=None):
    count = DropCounter()
    for i, at in enumerate(arrived):
        count.count(at, 0.0 if own is None else own[i])
    assert count.frames == len(arrived)
    return count


@pytest.mark.parametrize("seed", range(4))
def test_frames_that_are_late_are_not_missing(seed):
    count = counted(delivered(seed)[0])
    assert count.dropped <= 1  # of 9000
    assert counted(delivered(seed, starved=5)[0]).dropped <= 2
    assert count.rate == pytest.approx(RATE, rel=0.05)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("share", [0.002, 0.02])
def test_frames_that_are_missing_are_counted_among_late_ones(seed, share):
    arrived, missing = delivered(seed, dropped=share)
    assert counted(arrived).dropped == pytest.approx(missing, abs=max(2, 0.06 * missing))


def test_a_gap_is_counted_at_once_and_taken_back_when_it_was_a_delay():
    count = counted(np.arange(20) / RATE)
    count.count(23 / RATE)
    assert count.dropped == 3
    for late in (23.1, 23.2, 23.3, 24.0, 25.0):
        count.count(late / RATE)
    assert count.dropped == 0


def test_what_a_driver_kept_before_anybody_read_tells_no_period():
    count = counted(np.r_[np.arange(4) * 1e-5, 0.01 + np.arange(100) / RATE])
    assert count.dropped == 0
    assert count.rate == pytest.approx(RATE)


def test_by_its_own_stamps_every_frame_is_known_whenever_it_arrived():
    rng = np.random.default_rng(0)
    own = 1 + np.delete(np.arange(400), [20, 21, 90, 200]) / RATE
    arrived = np.maximum.accumulate(own + rng.exponential(0.1, len(own)))
    assert counted(arrived, own).dropped == 4


def test_what_it_did_not_see_while_it_was_away_it_did_not_drop():
    count = counted(np.arange(30) / RATE)
    count.interrupt()
    for i in range(30):
        count.count(20 + i / RATE)
    assert count.dropped == 0
    assert count.frames == 60
    count.restart()
    assert (count.frames, count.dropped) == (0, 0)
    assert count.rate == pytest.approx(RATE)


def test_another_rate_is_learnt():
    count = counted(np.concatenate([np.arange(90) / RATE, 3 + np.arange(1, 200) / 15]))
    before = count.dropped
    for i in range(200, 300):
        count.count(3 + i / 15)
    assert count.rate == pytest.approx(15, rel=1e-3)
    assert count.dropped == before
