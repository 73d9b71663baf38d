from __future__ import annotations

import json
import time

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from sklearn.metrics import (
    accuracy_score,
    cohen_kappa_score,
    confusion_matrix,
    recall_score,
)

from forcelab.recognition.metrics import Counts, Scores, count, pool, score

ACTIONS = ["still", "grab", "hold", "insert", "release"]
KEYS = ["name", "accuracy", "balanced_accuracy", "coverage", "kappa", "edit", "f1"]
KEYS += ["f1_labelled", "boundaries_found", "boundary_ms", "boundary_labelled_ms"]
KEYS += ["confusion", "events"]


def spell(text: str, actions: list[str] = ACTIONS) -> np.ndarray:
    """Codes of a track written as ``"still100 grab50 -20"``; a bare number is unlabelled."""
    parts = []
    for word in text.split():
        name = word.rstrip("0123456789")
        code = -1 if name == "-" else actions.index(name)
        parts.append(np.full(int(word[len(name) :]), code, dtype=np.int64))
    return np.concatenate(parts) if parts else np.empty(0, dtype=np.int64)


def at(n: int, rate: float = 100.0) -> np.ndarray:
    return np.arange(n) / rate


def of(human: str, predicted: str, actions: list[str] = ACTIONS) -> Scores:
    h, p = spell(human, actions), spell(predicted, actions)
    return score("d", h, p, at(len(h)), actions)


@st.composite
def pairs(draw, actions=4, low=-1, most=60):
    """A human and a predicted track, both made of runs, and their stamps, perhaps with gaps."""
    n = draw(st.integers(1, most))

    def track() -> np.ndarray:
        codes: list[int] = []
        while len(codes) < n:
            codes += [draw(st.integers(low, actions - 1))] * draw(st.integers(1, 12))
        return np.array(codes[:n], dtype=np.int64)

    steps = np.ones(n)
    for place in draw(st.lists(st.integers(1, n), max_size=2)):
        steps[place - 1] = 40.0
    return track(), track(), np.cumsum(steps) / 100


def numbers(scores: Scores) -> dict:
    """Everything but the confusion, which alone depends on how actions are numbered."""
    record = scores.to_json()
    del record["confusion"]
    return record


def flat(record, prefix=""):
    for key, value in record.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


# --- known answers ------------------------------------------------------------------------------


def test_golden_values_of_a_whole_demonstration():
    s = of(
        "still100 grab50 hold100 insert50 release40 still60",
        "still110 grab35 hold20 grab5 hold95 release75 still60",
    )
    assert s.accuracy == pytest.approx(0.825, abs=1e-12)
    assert s.edit == pytest.approx(0.71428571, abs=5e-9)
    assert [s.f1[k] for k in ("10", "25", "50")] == pytest.approx([0.76923077] * 3, abs=5e-9)
    assert s.kappa == pytest.approx(0.759243, abs=5e-7)
    assert s.coverage == 1.0


def test_golden_values_of_a_constant_prediction():
    s = of("a40 b20 a40", "a100", ["a", "b"])
    assert (s.accuracy, s.kappa) == (0.8, 0.0)
    assert s.edit == pytest.approx(1 / 3)
    assert s.f1 == {"10": 0.5, "25": 0.5, "50": 0.0}
    assert s.balanced_accuracy == 0.5


def test_kappa_is_zero_wherever_one_of_the_raters_is_constant():
    assert of("a60", "a40 b20", ["a", "b"]).kappa == 0.0
    assert of("a60", "a60", ["a", "b"]).kappa == 0.0
    assert of("a30 b30", "-60", ["a", "b"]).kappa == 0.0


def test_predicted_unlabelled_is_wrong_uncovered_and_the_last_column():
    s = of("still60 grab40", "still30 -30 grab40")
    assert s.accuracy == 0.7
    assert s.coverage == 0.7
    assert s.balanced_accuracy == 0.75
    assert s.confusion[0] == [30, 0, 0, 0, 0, 30]
    assert s.confusion[1] == [0, 40, 0, 0, 0, 0]


def test_boundary_errors_are_in_milliseconds_of_the_stamps():
    # still ends 30 ms late, grab starts 30 ms late; both outer edges meet.
    s = of("still50 grab50", "still53 grab47")
    assert s.boundary_ms == {"median": pytest.approx(15.0), "p90": pytest.approx(30.0)}


def test_boundaries_are_those_of_segments_matched_at_ten_percent():
    # The human's grab overlaps the predicted one by 20 %: matched for F1@10 alone.
    s = of("grab20 still80", "grab100")
    assert s.f1 == {"10": pytest.approx(2 / 3), "25": 0.0, "50": 0.0}
    assert s.boundary_ms["median"] == pytest.approx(400.0)


# --- what is undefined is None ------------------------------------------------------------------


@pytest.mark.parametrize("actions", [[], ["a"], ACTIONS])
@pytest.mark.parametrize("n", [0, 1, 30])
def test_nothing_labelled_gives_none_and_no_warning(n, actions):
    nothing = np.full(n, -1, dtype=np.int64)
    predicted = np.full(n, len(actions) - 1, dtype=np.int64)
    record = score("d", nothing, predicted, at(n), actions).to_json()
    confusion, events = record.pop("confusion"), record.pop("events")
    assert {value for key, value in flat(record) if key != "name"} == {None}
    assert confusion == [[0] * (len(actions) + 1)] * len(actions)
    assert {value for _, value in flat(events)} == {0}


def test_a_single_sample_is_scored():
    right, wrong = of("grab1", "grab1"), of("grab1", "hold1")
    assert (right.accuracy, right.edit, right.f1["50"]) == (1.0, 1.0, 1.0)
    assert (wrong.accuracy, wrong.edit, wrong.f1["10"]) == (0.0, 0.0, 0.0)
    assert wrong.boundary_ms == {"median": None, "p90": None}


def test_an_action_the_human_never_used_does_not_enter_the_balanced_accuracy():
    assert of("still50 grab50", "still50 grab25 insert25").balanced_accuracy == 0.75


def test_the_record_has_exactly_the_promised_keys_and_survives_strict_json():
    record = of("still50 grab50 -10", "still60 grab50").to_json()
    assert list(record) == KEYS
    assert list(record["f1"]) == ["10", "25", "50"]
    assert list(record["boundary_ms"]) == ["median", "p90"]
    assert json.loads(json.dumps(record, allow_nan=False)) == record


@pytest.mark.parametrize(
    ("human", "predicted", "n"), [([0, 1], [0], 2), ([0, 0], [0, 0], 3), ([0, 2], [0, 0], 2)]
)
def test_codes_that_do_not_fit_are_refused(human, predicted, n):
    with pytest.raises(ValueError, match=r"codes|code of 2"):
        count(np.array(human), np.array(predicted), at(n), ["a", "b"])


# --- against scikit-learn -----------------------------------------------------------------------


@settings(max_examples=80, deadline=None)
@given(pairs())
def test_frame_metrics_agree_with_scikit_learn(tracks):
    human, predicted, times = tracks
    s = score("d", human, predicted, times, ["a", "b", "c", "d"])
    h, p = human[human >= 0], predicted[human >= 0]
    if len(h) == 0:
        assert (s.accuracy, s.kappa) == (None, None)
        return
    p = np.where(p < 0, 4, p)
    assert s.confusion == confusion_matrix(h, p, labels=range(5))[:4].tolist()
    assert s.accuracy == pytest.approx(accuracy_score(h, p))
    assert s.coverage == pytest.approx(np.mean(p < 4))
    recall = recall_score(h, p, labels=np.unique(h), average="macro", zero_division=0)
    assert s.balanced_accuracy == pytest.approx(recall)
    if len(np.unique(h)) > 1 and len(np.unique(p)) > 1:
        assert s.kappa == pytest.approx(cohen_kappa_score(h, p), abs=1e-12)
    else:
        assert s.kappa == 0.0


# --- properties ---------------------------------------------------------------------------------


@settings(max_examples=40, deadline=None)
@given(pairs())
def test_a_perfect_prediction_scores_one_everywhere(tracks):
    human, _, times = tracks
    s = score("d", human, human, times, ["a", "b", "c", "d"])
    assume((human >= 0).any())
    assert (s.accuracy, s.balanced_accuracy, s.coverage, s.edit) == (1, 1, 1, 1)
    assert s.f1 == {"10": 1, "25": 1, "50": 1}
    assert s.boundary_ms == {"median": 0, "p90": 0}
    assert s.kappa == (1 if len(np.unique(human[human >= 0])) > 1 else 0)
    errors = s.events.to_json()
    assert errors.pop("human") == errors.pop("predicted")
    assert {value for _, value in flat(errors)} == {0}


@settings(max_examples=60, deadline=None)
@given(pairs(), st.integers(0, 2**32 - 1))
def test_what_is_predicted_where_the_human_labelled_nothing_changes_nothing(tracks, seed):
    human, predicted, times = tracks
    other = predicted.copy()
    hidden = human < 0
    other[hidden] = np.random.default_rng(seed).integers(-1, 4, hidden.sum())
    actions = ["a", "b", "c", "d"]
    assert score("d", human, predicted, times, actions) == score("d", human, other, times, actions)


@settings(max_examples=40, deadline=None)
@given(pairs(), st.permutations(range(4)))
def test_the_numbering_of_the_actions_changes_nothing(tracks, order):
    human, predicted, times = tracks
    actions = ["a", "b", "c", "d"]
    renumber = np.array([*order, -1])
    plain = score("d", human, predicted, times, actions)
    moved = score("d", renumber[human], renumber[predicted], times, actions)
    assert dict(flat(numbers(moved))) == pytest.approx(dict(flat(numbers(plain))), nan_ok=False)
    there = np.array(plain.confusion)
    assert np.array_equal(np.array(moved.confusion)[order][:, [*order, 4]], there)


@settings(max_examples=40, deadline=None)
@given(pairs())
def test_a_pool_of_one_is_its_score(tracks):
    actions = ["a", "b", "c", "d"]
    assert pool("d", [count(*tracks, actions)]) == score("d", *tracks, actions)


@settings(max_examples=40, deadline=None)
@given(st.lists(pairs(), min_size=2, max_size=4))
def test_pooling_sums_samples_segments_and_events_and_averages_the_edit_score(tracks):
    actions = ["a", "b", "c", "d"]
    counts = [count(*track, actions) for track in tracks]
    alone = [pool("d", [c]) for c in counts]
    pooled = pool("all", counts)
    assert np.array_equal(pooled.confusion, sum(np.array(s.confusion) for s in alone))
    edits = [s.edit for s in alone if s.edit is not None]
    assert pooled.edit == (pytest.approx(np.mean(edits)) if edits else None)
    true, false, missed = sum(c.segments[2] for c in counts)
    if true:
        precision, recall = true / (true + false), true / (true + missed)
        harmonic = 2 * precision * recall / (precision + recall)
        assert pooled.f1["50"] == pytest.approx(harmonic)
    for kind, tally in pooled.events.to_json().items():
        parts = [s.events.to_json()[kind] for s in alone]
        assert tally["count"] == sum(part["count"] for part in parts)
        assert tally["seconds"] == pytest.approx(sum(part["seconds"] for part in parts))
    errors = np.concatenate([c.boundaries for c in counts])
    if len(errors):
        assert pooled.boundary_ms["p90"] == pytest.approx(np.quantile(errors, 0.9))


def test_a_pool_weighs_frames_by_length_but_edit_scores_equally():
    long = count(spell("a90 b10", ["a", "b"]), spell("a100", ["a", "b"]), at(100), ["a", "b"])
    short = count(spell("b10", ["a", "b"]), spell("b10", ["a", "b"]), at(10), ["a", "b"])
    pooled = pool("all", [long, short])
    assert pooled.accuracy == pytest.approx(100 / 110)
    assert pooled.edit == pytest.approx((0.5 + 1.0) / 2)
    assert pooled.f1["50"] == pytest.approx(2 * 2 / (2 * 2 + 0 + 1))


# --- size ---------------------------------------------------------------------------------------


def timed(human: np.ndarray, predicted: np.ndarray, actions: list[str]) -> tuple[float, Counts]:
    stamps = at(len(human), 1000.0)
    start = time.process_time()
    counts = count(human, predicted, stamps, actions)
    return time.process_time() - start, counts


def test_a_million_samples_flickering_through_200_actions_take_seconds_not_minutes():
    rng = np.random.default_rng(0)
    actions = [f"a{i}" for i in range(200)]
    human = np.repeat(rng.integers(-1, 200, 1000), 1000)
    predicted = np.where(rng.random(10**6) < 0.7, human, rng.integers(-1, 200, 10**6))
    seconds, counts = timed(human, predicted, actions)
    assert counts.confusion.sum() == (human >= 0).sum()
    assert seconds < 6.0
