"""Labels as segments while they come: as if all were there at once, whatever the blocks."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.labels import from_codes
from forcelab.live.recognition import SegmentBuilder, SnapshotBuffer
from forcelab.recognition.online import LiveLabels

ACTIONS = ("grab", "pull")
PERIOD = 0.01


def growing():
    return SegmentBuilder(SimpleNamespace(step=PERIOD, actions=ACTIONS))


def decided(times, codes, probabilities=None):
    return LiveLabels(np.asarray(times), np.asarray(codes, dtype=np.int64), probabilities)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.integers(-1, 1), min_size=2, max_size=60), st.lists(st.integers(1, 9)))
def test_segments_are_those_of_all_labels_at_once(codes, cuts):
    times = 5.0 + PERIOD * np.arange(len(codes))
    track, found, first = growing(), [], 0
    for size in [*cuts, len(codes)]:
        found += track.take(decided(times[first : first + size], codes[first : first + size]))
        first += size
    assert track.action == ("" if codes[-1] < 0 else ACTIONS[codes[-1]])
    assert track.until == pytest.approx(times[-1] + PERIOD)
    present = track.present
    found += track.finish()
    expected = from_codes(np.asarray(codes), times, ACTIONS)
    assert [s.segment.action for s in found] == [s.action for s in expected]
    for mine, theirs in zip(found, expected, strict=True):
        assert (mine.start, mine.end) == pytest.approx((theirs.start, theirs.end))
    assert (not present) == (codes[-1] < 0)


def test_a_gap_parts_segments_of_one_action():
    track = growing()
    times = np.concatenate([np.arange(10), np.arange(50, 60)]) * PERIOD
    found = track.take(decided(times, np.zeros(20))) + track.finish()
    assert [(s.start, s.end) for s in found] == [
        (0.0, pytest.approx(0.1)),
        (pytest.approx(0.5), pytest.approx(0.6)),
    ]


def test_what_is_seen_has_the_mean_probability_of_each_stretch_and_forgets_the_old():
    track, recent = growing(), SnapshotBuffer(ACTIONS)
    rng = np.random.default_rng(1)
    times = 100.0 + PERIOD * np.arange(4000)
    share = rng.random(4000)
    table = np.stack([share, 1 - share], axis=1)
    codes = (np.arange(4000) // 150) % 2
    for first in range(0, 4000, 37):
        part = slice(first, first + 37)
        block = decided(times[part], codes[part], table[part])
        recent.take(block, track.take(block))
    snapshot = recent.snapshot(track, 0.1)
    assert snapshot.action == ACTIONS[codes[-1]]
    assert snapshot.probabilities == pytest.approx(tuple(table[-1]))
    assert snapshot.segments[-1].end == pytest.approx(snapshot.until)
    assert min(s.end for s in snapshot.segments) > times[-1] - 16.0
    start, end = times[-1] - 2.0, times[-1] - 1.0
    inside = (times >= start) & (times < end)
    assert snapshot.probability_trace.of_action("grab", start, end) == pytest.approx(
        share[inside].mean(), abs=0.02
    )
    assert snapshot.probability_trace.start >= times[-1] - 16.0


def test_nothing_is_known_before_the_first_label():
    snapshot = SnapshotBuffer(ACTIONS).snapshot(growing(), 0.0)
    assert math.isnan(snapshot.until)
    assert snapshot.probability_trace is None
    assert snapshot.segments == ()
