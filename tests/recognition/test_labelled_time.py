"""Scores in labelled time alone, against the same tracks with unlabelled samples cut out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.recognition.metrics import score

ACTIONS = ("grab", "hold", "pull")
runs = st.lists(st.tuples(st.integers(-1, 2), st.integers(1, 25)), min_size=1, max_size=8)


def track(parts, n):
    return np.resize(np.repeat([c for c, _ in parts], [k for _, k in parts]), n)


def at(n):
    return np.arange(n) / 100


@given(runs, runs, st.integers(2, 120))
@settings(max_examples=40, deadline=None)
def test_unlabelled_time_is_as_if_it_had_never_been_recorded(human, predicted, n):
    h, p = track(human, n), track(predicted, n)
    found = score("", h, p, at(n), ACTIONS)
    h, p = h[h >= 0], p[h >= 0]
    plain = score("", h, p, at(len(h)), ACTIONS)
    assert found.f1_labelled == plain.f1 == plain.f1_labelled
    for name, value in plain.boundary_labelled_ms.items():
        assert found.boundary_labelled_ms[name] == pytest.approx(value)
    hits = [
        any(abs(i - j) <= 10 for j in range(1, len(p)) if p[j] != p[j - 1])
        for i in range(1, len(h))
        if h[i] != h[i - 1]
    ]
    assert found.boundaries_found == (sum(hits) / len(hits) if hits else None)


def test_a_hole_cuts_segments_in_one_way_of_counting_only():
    human = np.repeat([0, -1, 0, -1, 1], [40, 5, 40, 5, 50])
    predicted = np.repeat([0, 1], [92, 48])
    found = score("", human, predicted, at(140), ACTIONS)
    # Three matched segments and a sliver behind the second hole; one boundary, 20 ms late.
    assert found.f1["50"] == 6 / 7
    assert found.f1_labelled["50"] == 1.0
    assert found.boundaries_found == 1.0
    late = score("", human, np.repeat([0, 1], [101, 39]), at(140), ACTIONS)
    assert late.boundaries_found == 0.0


def test_a_coder_who_leaves_a_little_between_actions_does_not_hide_how_far_edges_are_off():
    human = np.repeat([-1, 0, -1, 1, -1, 2, -1], [5, 40, 4, 40, 4, 40, 5])
    predicted = np.repeat([0, 1, 2], [56, 41, 41])  # 0 ends 70 ms of labelled time late, 1 40
    found = score("", human, predicted, at(138), ACTIONS)
    assert found.boundary_ms["median"] == 0
    # Two boundaries, each the end of one segment and the start of the next.
    assert found.boundary_labelled_ms["median"] == pytest.approx(55.0)
    assert found.boundary_labelled_ms["p90"] == pytest.approx(70.0)
    # Within what the coder left unlabelled, a boundary is right wherever it is.
    right = score("", human, np.repeat([0, 1, 2], [46, 46, 46]), at(138), ACTIONS)
    assert right.boundary_labelled_ms == {"median": 0, "p90": 0}


def test_one_action_has_no_boundaries_to_be_off():
    alone = score("", np.repeat([-1, 0], [10, 90]), np.repeat([1, 0], [40, 60]), at(100), ACTIONS)
    assert alone.boundary_ms["p90"] > 200  # where the coder's labels begin, it was still wrong
    assert alone.boundary_labelled_ms == {"median": None, "p90": None}
