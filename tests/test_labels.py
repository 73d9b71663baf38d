from __future__ import annotations

from itertools import pairwise, permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.labels import (
    UNLABELLED,
    Segment,
    Track,
    check_action_name,
    from_codes,
    ordered,
    to_codes,
)

ACTIONS = ("grab", "hold", "pull")


@st.composite
def stamps(draw: st.DrawFn, gaps: bool = True) -> np.ndarray:
    """Irregular stamps, with gaps of many periods among them where asked for."""
    kinds = [st.floats(0.5, 2.0)] + [st.floats(20.0, 1e4)] * gaps
    steps = draw(st.lists(st.one_of(*kinds), min_size=1, max_size=40))
    period = draw(st.sampled_from([1e-3, 0.01, 1 / 3, 7.0]))
    return draw(st.floats(-1e3, 1e3)) + period * np.cumsum([0.0, *steps])


@st.composite
def coded(draw: st.DrawFn, gaps: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Stamps and codes that come in runs."""
    times = draw(stamps(gaps))
    runs = st.lists(st.tuples(st.integers(-1, 2), st.integers(1, 9)), min_size=len(times))
    codes = [code for code, length in draw(runs) for _ in range(length)]
    return times, np.array(codes[: len(times)])


@given(coded())
def test_codes_become_segments_and_the_same_codes_again(pair):
    times, codes = pair
    segments = from_codes(codes, times, ACTIONS)
    assert segments == ordered(segments)
    assert to_codes(segments, times, ACTIONS).tolist() == codes.tolist()


@given(coded(gaps=False))
def test_segments_with_edges_on_samples_become_codes_and_the_same_segments_again(pair):
    times, codes = pair
    edges = [*times, times[-1] + np.median(np.diff(times))]
    cuts = [0, *(np.flatnonzero(np.diff(codes)) + 1), len(codes)]
    segments = tuple(
        Segment(edges[first], edges[last], ACTIONS[codes[first]])
        for first, last in pairwise(cuts)
        if codes[first] >= 0
    )
    assert from_codes(to_codes(segments, times, ACTIONS), times, ACTIONS) == segments


@given(st.lists(st.tuples(st.floats(0, 9), st.floats(0.01, 3), st.sampled_from(ACTIONS))), stamps())
def test_every_sample_gets_the_action_of_the_segment_that_covers_it(triples, times):
    segments, now = [], float(times[0]) - 1.0
    for hole, length, action in triples:
        segments.append(Segment(now + hole, now + hole + length, action))
        now = segments[-1].end
    expected = [
        next((ACTIONS.index(s.action) for s in segments if s.start <= t < s.end), UNLABELLED)
        for t in times
    ]
    assert to_codes(segments, times, ACTIONS).tolist() == expected


def test_a_run_ends_where_the_next_sample_starts_and_does_not_reach_over_a_gap():
    times = np.array([0.0, 1.0, 2.0, 20.0, 21.0, 22.0])
    codes = np.array([0, 0, 0, 0, 1, -1])
    assert from_codes(codes, times, ACTIONS) == (
        Segment(0.0, 3.0, "grab"),
        Segment(20.0, 21.0, "grab"),
        Segment(21.0, 22.0, "hold"),
    )


def test_the_last_run_lasts_one_period_past_its_last_stamp():
    assert from_codes(np.array([2, 2, 2]), np.array([0.0, 0.5, 1.0]), ACTIONS) == (
        Segment(0.0, 1.5, "pull"),
    )


def test_nothing_in_nothing_out():
    times = np.array([0.0, 1.0])
    assert from_codes(np.array([], dtype=int), np.array([]), ACTIONS) == ()
    assert from_codes(np.array([-1, -7]), times, ACTIONS) == ()
    assert to_codes((), times, ACTIONS).tolist() == [UNLABELLED, UNLABELLED]


def test_an_action_without_a_code_is_refused():
    with pytest.raises(InputError, match="'slip' at 3 s is not among grab, hold, pull"):
        to_codes((Segment(3.0, 4.0, "slip"),), np.arange(9.0), ACTIONS)


def test_a_segment_covers_its_start_but_not_its_end():
    segment = Segment(1.0, 2.5, "grab")
    assert to_codes((segment,), np.array([0.9, 1.0, 2.4, 2.5]), ACTIONS).tolist() == [-1, 0, 0, -1]
    assert segment.duration == 1.5


@pytest.mark.parametrize(
    ("start", "end", "action", "sentence"),
    [
        (1.0, 1.0, "grab", "must end after it starts; 'grab' goes from 1.0 s to 1.0 s"),
        (2.0, 1.0, "grab", "must end after it starts"),
        (0.0, np.nan, "grab", "must end after it starts"),
        (-np.inf, 0.0, "grab", "must end after it starts"),
        (0.0, np.inf, "grab", "must end after it starts"),
        (1.5, 2.0, "", "segment at 1.5 s names no action"),
    ],
)
def test_a_segment_without_time_or_action_is_refused(start, end, action, sentence):
    with pytest.raises(InputError, match=sentence):
        Segment(start, end, action)


def test_a_track_sorts_its_segments_and_lists_actions_as_they_first_occur():
    segments = (Segment(0, 1, "pull"), Segment(1, 3, "grab"), Segment(4, 5, "pull"))
    for mixed in permutations(segments):
        track = Track("coder", mixed)
        assert track.segments == segments
        assert track.actions == ("pull", "grab")
        assert track.labelled == 4.0


def test_a_track_whose_segments_overlap_is_refused():
    with pytest.raises(InputError, match=r"'grab' ends at 2 s and 'hold' starts at 1\.5 s"):
        Track("coder", (Segment(1.5, 3.0, "hold"), Segment(0.0, 2.0, "grab")))


@pytest.mark.parametrize("author", ["", "  "])
def test_a_track_needs_an_author(author):
    with pytest.raises(InputError, match="needs an author"):
        Track(author)


def test_tracks_and_segments_cannot_be_changed():
    with pytest.raises(AttributeError):
        Segment(0, 1, "grab").end = 2.0
    with pytest.raises(AttributeError):
        Track("coder").author = "other"


@pytest.mark.parametrize("name", ["unlabelled", "Unlabeled", "NOT_LABELLED", " no  label "])
def test_no_action_is_called_as_time_without_one(name):
    with pytest.raises(InputError, match="cannot be called"):
        check_action_name(name)
    check_action_name("unlabelled grab")
