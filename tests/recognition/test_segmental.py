from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.labels import from_codes
from forcelab.recognition.metrics import (
    OVERLAPS,
    boundary_errors,
    edit_distance,
    edit_score,
    match_segments,
    overlay,
)
from forcelab.runs import sample_ends, stretches

ACTIONS = ["a", "b", "c"]


@st.composite
def tracks(draw):
    """A human and a predicted track of runs, and their stamps, perhaps with gaps."""
    n = draw(st.integers(0, 50))

    def track() -> np.ndarray:
        codes: list[int] = []
        while len(codes) < n:
            codes += [draw(st.integers(-1, 2))] * draw(st.integers(1, 9))
        return np.array(codes[:n], dtype=np.int64)

    steps = np.ones(n)
    for place in draw(st.lists(st.integers(1, max(n, 1)), max_size=2)):
        steps[place - 1 : place] = 30.0
    return track(), track(), np.cumsum(steps) / 50


def segments_of(codes: list[int], times: np.ndarray) -> list[tuple[int, set[int]]]:
    """Segments as (action, set of sample numbers), one sample at a time."""
    found: list[tuple[int, set[int]]] = []
    period = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
    for i, code in enumerate(codes):
        gap = i > 0 and times[i] - times[i - 1] > 5 * period
        if code >= 0:
            if i == 0 or code != codes[i - 1] or gap:
                found.append((code, set()))
            found[-1][1].add(i)
    return found


def matched_by_sets(human, predicted, overlap: int) -> set[tuple[int, int]]:
    """The published loop of F1@k on sets of sample numbers."""
    taken: dict[int, int] = {}
    for j, (action, samples) in enumerate(predicted):
        ious = [
            len(samples & other) / len(samples | other) if action == name else 0.0
            for name, other in human
        ]
        best = int(np.argmax(ious)) if ious else -1
        if ious and ious[best] * 100 >= overlap and best not in taken:
            taken[best] = j
    return set(taken.items())


@settings(max_examples=150, deadline=None)
@given(
    st.lists(st.integers(0, 3), max_size=14),
    st.lists(st.integers(0, 3), max_size=14),
)
def test_edit_distance_is_the_recursive_definition(a, b):
    @lru_cache(None)
    def far(i: int, j: int) -> int:
        if i == 0 or j == 0:
            return i + j
        change = 0 if a[i - 1] == b[j - 1] else 1
        return min(far(i - 1, j) + 1, far(i, j - 1) + 1, far(i - 1, j - 1) + change)

    distance = edit_distance(np.array(a, dtype=np.int64), np.array(b, dtype=np.int64))
    assert distance == far(len(a), len(b))


def test_edit_distance_is_right_beyond_the_width_of_a_machine_word():
    rng = np.random.default_rng(1)
    a, b = rng.integers(0, 6, 500), rng.integers(0, 6, 730)
    row = np.arange(len(b) + 1)
    for i, symbol in enumerate(a):
        diagonal = np.concatenate([[i + 1], np.minimum(row[1:] + 1, row[:-1] + (b != symbol))])
        row = np.minimum.accumulate(diagonal - np.arange(len(b) + 1)) + np.arange(len(b) + 1)
    assert edit_distance(a, b) == row[-1]


@settings(max_examples=100, deadline=None)
@given(tracks())
def test_runs_are_the_segments_of_from_codes(track):
    codes, _, times = track
    found = stretches(codes, times, sample_ends(times))
    expected = from_codes(codes, times, ACTIONS)
    assert [ACTIONS[code] for code in found.codes] == [s.action for s in expected]
    assert found.starts.tolist() == [s.start for s in expected]
    assert found.ends.tolist() == [s.end for s in expected]


@settings(max_examples=200, deadline=None)
@given(tracks(), st.sampled_from(OVERLAPS))
def test_matching_is_the_published_loop_on_sets_of_samples(track, overlap):
    human, predicted, times = track
    found = match_segments(overlay(human, predicted, times, ACTIONS), overlap)
    masked = [-1 if h < 0 else p for h, p in zip(human, predicted, strict=True)]
    expected = matched_by_sets(segments_of(human, times), segments_of(masked, times), overlap)
    assert set(zip(found.human.tolist(), found.predicted.tolist(), strict=True)) == expected


@settings(max_examples=100, deadline=None)
@given(tracks())
def test_boundary_errors_are_the_distances_of_matched_edges(track):
    human, predicted, times = track
    over = overlay(human, predicted, times, ACTIONS)
    masked = np.where(human < 0, -1, predicted)
    h, p = from_codes(human, times, ACTIONS), from_codes(masked, times, ACTIONS)
    expected = []
    for i, j in matched_by_sets(segments_of(human, times), segments_of(masked, times), 10):
        expected += [abs(h[i].start - p[j].start) * 1e3, abs(h[i].end - p[j].end) * 1e3]
    errors = boundary_errors(over, match_segments(over, 10))
    assert sorted(errors) == pytest.approx(sorted(expected))


def of(human: str, predicted: str):
    """An overlay of two tracks written one letter a sample, dots being unlabelled."""
    codes = [np.array(["abc".find(c) for c in text], dtype=np.int64) for text in (human, predicted)]
    return overlay(*codes, np.arange(len(human)) / 10, ACTIONS)


def test_an_overlap_of_exactly_one_half_counts_as_one_half():
    assert len(match_segments(of("aaaabb", "aabbbb"), 50)) == 2


def test_of_two_predicted_segments_over_one_human_one_the_earlier_is_matched():
    found = match_segments(of("aaaaaaaaaa", "aaabaaaaaa"), 10)
    assert (found.human.tolist(), found.predicted.tolist()) == ([0], [0])


def test_of_two_human_segments_overlapped_alike_the_earlier_is_matched():
    found = match_segments(of("aaabaaa", "aaaaaaa"), 10)
    assert (found.human.tolist(), found.predicted.tolist()) == ([0], [0])


def test_a_predicted_segment_does_not_turn_to_its_second_choice():
    # Both predicted a's overlap the first human a best, and the second one also the second.
    found = match_segments(of("aaaaaaaabaa", "aabaaaaaaaa"), 10)
    assert (found.human.tolist(), found.predicted.tolist()) == ([0], [0])


def test_unlabelled_human_time_splits_both_tracks_at_the_same_place():
    over = of("aaa..aaa", "aaaaaaaa")
    assert len(over.human) == len(over.predicted) == 2
    assert edit_score(over) == 1.0
    assert boundary_errors(over, match_segments(over, 50)).tolist() == [0.0] * 4


def test_nothing_predicted_scores_no_edit_and_leaves_no_boundary():
    over = of("aabb", "....")
    assert edit_score(over) == 0.0
    assert boundary_errors(over, match_segments(over, 10)).size == 0
