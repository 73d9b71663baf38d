"""Overlays of segments: every score is that of the samples the segments were made from."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.labels import Segment, from_codes
from forcelab.recognition.metrics import (
    TICKS,
    count_segments,
    overlay_segments,
    pool,
    score,
    score_tracks,
)

ACTIONS = ("still", "grab", "hold", "pull")


@st.composite
def tracks(draw):
    """Human and predicted codes made of runs, and even stamps with a gap now and then."""
    n = draw(st.integers(2, 60))

    def track() -> np.ndarray:
        codes: list[int] = []
        while len(codes) < n:
            codes += [draw(st.integers(-1, 3))] * draw(st.integers(1, 12))
        return np.array(codes[:n], dtype=np.int64)

    steps = np.full(n, 8)
    for place in draw(st.lists(st.integers(1, n), max_size=2)):
        steps[place - 1] = 400
    return track(), track(), np.cumsum(steps) / 1024


@settings(max_examples=40, deadline=None)
@given(tracks())
def test_scores_of_segments_are_those_of_their_samples(drawn):
    human, predicted, times = drawn
    segments = [from_codes(codes, times, ACTIONS) for codes in (human, predicted)]
    if np.median(np.diff(times)) * 1024 > 8:
        return  # more gaps than samples: a sample has no length
    counts = count_segments(*segments, ACTIONS)
    expected = score("d", human, predicted, times, ACTIONS).to_json()
    found = pool("d", [counts]).to_json()
    samples = np.array(expected.pop("confusion"))
    ticks = np.array(found.pop("confusion"))
    assert ticks / TICKS * 128 == pytest.approx(samples, abs=1e-5)
    for name, value in expected.items():
        if isinstance(value, dict):
            for key, inner in value.items():
                assert found[name][key] == pytest.approx(inner, abs=1e-9), (name, key)
        else:
            assert found[name] == (pytest.approx(value, abs=1e-9) if value is not None else None)


def test_touching_segments_of_one_action_are_one():
    human = (Segment(0, 1, "grab"), Segment(1, 2, "grab"), Segment(2, 3, "hold"))
    over = overlay_segments(human, (Segment(0.5, 2.5, "grab"),), ACTIONS)
    assert over.human.starts.tolist() == [0, 2]
    assert over.predicted.seconds.tolist() == [2.0]
    assert over.pieces.seconds.tolist() == [0.5, 1.5, 0.5, 0.5]


def test_nothing_at_all_is_no_piece():
    assert len(overlay_segments((), (), ACTIONS).pieces) == 0
    assert len(overlay_segments((), (Segment(0, 1, "grab"),), ACTIONS).pieces) == 0


def test_two_tracks_are_scored_without_a_recording():
    human = (Segment(0.5, 1.0, "grab"), Segment(1.5, 2.5, "hold"))
    predicted = (Segment(0.0, 0.75, "grab"), Segment(0.75, 2.0, "hold"))
    found = score_tracks(human, predicted, name="one")
    assert (found.name, found.accuracy, found.coverage) == ("one", 0.5, pytest.approx(1 / 1.5))
    assert found.edit == pytest.approx(2 / 3)  # the unlabelled half second cuts 'hold' in two
    assert found.boundary_labelled_ms["median"] == pytest.approx(250.0)
    nothing = score_tracks(human, ())
    assert (nothing.accuracy, nothing.coverage, nothing.edit) == (0.0, 0.0, 0.0)
    assert score_tracks((), predicted).accuracy is None
    with pytest.raises(InputError, match="'hold' is not among the actions grab"):
        score_tracks(human, predicted, ["grab"])
