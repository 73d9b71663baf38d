"""Brier score and calibration error against their definitions, written plainly."""

from __future__ import annotations

import numpy as np
import pytest

from forcelab.recognition.probabilities import Reliability

ACTIONS = ("grab", "hold", "pull")


@pytest.fixture
def drawn():
    random = np.random.default_rng(0)
    return random.dirichlet(np.ones(3), 400), random.integers(-1, 3, 400)


def test_figures_are_their_definitions(drawn):
    P, human = drawn
    found = Reliability.of(P, ACTIONS, human, ACTIONS)
    squares, gaps = [], {}
    for p, h in zip(P, human, strict=True):
        if h < 0:
            continue
        squares.append(sum((p[k] - (k == h)) ** 2 for k in range(3)))
        gaps.setdefault(min(int(10 * p.max()), 9), []).append(p.max() - (p.argmax() == h))
    assert found.brier == pytest.approx(np.mean(squares))
    assert found.ece == pytest.approx(sum(abs(sum(g)) for g in gaps.values()) / len(squares))


def test_parts_add_up_to_the_whole(drawn):
    P, human = drawn
    whole = Reliability.of(P, ACTIONS, human, ACTIONS).to_json()
    parts = [Reliability.of(P[s], ACTIONS, human[s], ACTIONS) for s in (np.s_[:90], np.s_[90:])]
    added = (parts[0] + parts[1]).to_json()
    assert added["brier"] == pytest.approx(whole["brier"])
    np.testing.assert_allclose(added["bins"], whole["bins"])


def test_an_action_that_is_not_known_is_wrong_however_sure():
    found = Reliability.of(np.array([[1.0, 0.0]]), ("grab", "hold"), np.array([2]), ACTIONS)
    assert (found.brier, found.ece) == (2.0, 1.0)


def test_nothing_labelled_has_no_figures():
    found = Reliability.of(np.full((4, 3), 1 / 3), ACTIONS, np.full(4, -1), ACTIONS)
    assert found.to_json() == {"brier": None, "ece": None, "bins": []}
