"""Scores of samples, segments and events, against references that count plainly."""

from __future__ import annotations

import json
import time
from functools import lru_cache

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

from forcelab.errors import InputError
from forcelab.labels import Segment, from_codes
from forcelab.recognition.metrics import (
    OVERLAPS,
    TICKS,
    Events,
    Scores,
    Tally,
    boundary_errors,
    count,
    count_segments,
    edit_distance,
    edit_score,
    event_errors,
    match_segments,
    overlay,
    overlay_segments,
    pool,
    score_tracks,
)

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


def times_of(n: int, rate: float = 100.0) -> np.ndarray:
    return np.arange(n) / rate


def score(name, human, predicted, times, actions) -> Scores:
    return pool(name, [count(human, predicted, times, actions)])


def score_words(human: str, predicted: str, actions: list[str] = ACTIONS) -> Scores:
    h, p = spell(human, actions), spell(predicted, actions)
    return score("d", h, p, times_of(len(h)), actions)


@st.composite
def pairs(draw, actions=4, least=1, most=60, longest=12, step=0.01, gap=0.4):
    """A human and a predicted track, both made of runs, and their stamps, perhaps with gaps."""
    n = draw(st.integers(least, most))

    def track() -> np.ndarray:
        codes: list[int] = []
        while len(codes) < n:
            codes += [draw(st.integers(-1, actions - 1))] * draw(st.integers(1, longest))
        return np.array(codes[:n], dtype=np.int64)

    steps = np.full(n, step)
    for place in draw(st.lists(st.integers(1, max(n, 1)), max_size=2)):
        steps[place - 1 : place] = gap
    return track(), track(), np.cumsum(steps)


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
    s = score_words(
        "still100 grab50 hold100 insert50 release40 still60",
        "still110 grab35 hold20 grab5 hold95 release75 still60",
    )
    assert s.accuracy == pytest.approx(0.825, abs=1e-12)
    assert s.edit == pytest.approx(0.71428571, abs=5e-9)
    assert [s.f1[k] for k in ("10", "25", "50")] == pytest.approx([0.76923077] * 3, abs=5e-9)
    assert s.kappa == pytest.approx(0.759243, abs=5e-7)
    assert s.coverage == 1.0


def test_boundary_errors_are_in_milliseconds_of_the_stamps():
    # still ends 30 ms late, grab starts 30 ms late; both outer edges meet.
    s = score_words("still50 grab50", "still53 grab47")
    assert s.boundary_ms == {"median": pytest.approx(15.0), "p90": pytest.approx(30.0)}


def test_boundaries_are_those_of_segments_matched_at_ten_percent():
    # The human's grab overlaps the predicted one by 20 %: matched for F1@10 alone.
    s = score_words("grab20 still80", "grab100")
    assert s.f1 == {"10": pytest.approx(2 / 3), "25": 0.0, "50": 0.0}
    assert s.boundary_ms["median"] == pytest.approx(400.0)


# --- what is undefined is None ------------------------------------------------------------------


@pytest.mark.parametrize("actions", [[], ["a"], ACTIONS])
@pytest.mark.parametrize("n", [0, 1, 30])
def test_nothing_labelled_gives_none_and_no_warning(n, actions):
    nothing = np.full(n, -1, dtype=np.int64)
    predicted = np.full(n, len(actions) - 1, dtype=np.int64)
    record = score("d", nothing, predicted, times_of(n), actions).to_json()
    confusion, events = record.pop("confusion"), record.pop("events")
    assert {value for key, value in flat(record) if key != "name"} == {None}
    assert confusion == [[0] * (len(actions) + 1)] * len(actions)
    assert {value for _, value in flat(events)} == {0}


def test_a_single_sample_is_scored():
    right, wrong = score_words("grab1", "grab1"), score_words("grab1", "hold1")
    assert (right.accuracy, right.edit, right.f1["50"]) == (1.0, 1.0, 1.0)
    assert (wrong.accuracy, wrong.edit, wrong.f1["10"]) == (0.0, 0.0, 0.0)
    assert wrong.boundary_ms == {"median": None, "p90": None}


def test_the_record_has_exactly_the_promised_keys_and_survives_strict_json():
    record = score_words("still50 grab50 -10", "still60 grab50").to_json()
    assert list(record) == KEYS
    assert list(record["f1"]) == ["10", "25", "50"]
    assert list(record["boundary_ms"]) == ["median", "p90"]
    assert json.loads(json.dumps(record, allow_nan=False)) == record


@pytest.mark.parametrize(
    ("human", "predicted", "n"), [([0, 1], [0], 2), ([0, 0], [0, 0], 3), ([0, 2], [0, 0], 2)]
)
def test_codes_that_do_not_fit_are_refused(human, predicted, n):
    with pytest.raises(ValueError, match=r"codes|code of 2"):
        count(np.array(human), np.array(predicted), times_of(n), ["a", "b"])


# --- against scikit-learn -----------------------------------------------------------------------


@settings(max_examples=40, deadline=None)
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
    plain_confusion = np.array(plain.confusion)
    assert np.array_equal(np.array(moved.confusion)[order][:, [*order, 4]], plain_confusion)


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


# --- size ---------------------------------------------------------------------------------------


def test_samples_that_flicker_through_200_actions_take_seconds_not_minutes():
    rng = np.random.default_rng(0)
    actions = [f"a{i}" for i in range(200)]
    human = np.repeat(rng.integers(-1, 200, 500), 1000)
    predicted = np.where(rng.random(500_000) < 0.7, human, rng.integers(-1, 200, 500_000))
    start = time.process_time()
    counts = count(human, predicted, times_of(500_000, 1000.0), actions)
    assert time.process_time() - start < 2.0  # of a million four times as much
    assert counts.confusion.sum() == (human >= 0).sum()


LETTERS = ["a", "b", "c"]


overlaid_tracks = pairs(actions=3, least=0, most=50, longest=9, step=0.02, gap=0.6)


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


@settings(max_examples=60, deadline=None)
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


@settings(max_examples=60, deadline=None)
@given(overlaid_tracks, st.sampled_from(OVERLAPS))
def test_matching_is_the_published_loop_on_sets_of_samples(track, overlap):
    human, predicted, times = track
    found = match_segments(overlay(human, predicted, times, LETTERS), overlap)
    masked = [-1 if h < 0 else p for h, p in zip(human, predicted, strict=True)]
    expected = matched_by_sets(segments_of(human, times), segments_of(masked, times), overlap)
    assert set(zip(found.human.tolist(), found.predicted.tolist(), strict=True)) == expected


@settings(max_examples=60, deadline=None)
@given(overlaid_tracks)
def test_boundary_errors_are_the_distances_of_matched_edges(track):
    human, predicted, times = track
    over = overlay(human, predicted, times, LETTERS)
    masked = np.where(human < 0, -1, predicted)
    h, p = from_codes(human, times, LETTERS), from_codes(masked, times, LETTERS)
    expected = []
    for i, j in matched_by_sets(segments_of(human, times), segments_of(masked, times), 10):
        expected += [abs(h[i].start - p[j].start) * 1e3, abs(h[i].end - p[j].end) * 1e3]
    errors = boundary_errors(over, match_segments(over, 10))
    assert sorted(errors) == pytest.approx(sorted(expected))


def letters_overlay(human: str, predicted: str):
    """An overlay of two tracks written one letter a sample, dots being unlabelled."""
    codes = [np.array(["abc".find(c) for c in text], dtype=np.int64) for text in (human, predicted)]
    return overlay(*codes, np.arange(len(human)) / 10, LETTERS)


def test_an_overlap_of_exactly_one_half_counts_as_one_half():
    assert len(match_segments(letters_overlay("aaaabb", "aabbbb"), 50)) == 2


@pytest.mark.parametrize(
    ("human", "predicted"),
    [
        pytest.param("aaaaaaaaaa", "aaabaaaaaa", id="of two predicted over one human, the earlier"),
        pytest.param("aaabaaa", "aaaaaaa", id="of two human ones overlapped alike, the earlier"),
        # Both predicted a's overlap the first human a best, and the second one also the second.
        pytest.param("aaaaaaaabaa", "aabaaaaaaaa", id="a predicted one has no second choice"),
    ],
)
def test_only_the_first_segments_are_matched(human, predicted):
    found = match_segments(letters_overlay(human, predicted), 10)
    assert (found.human.tolist(), found.predicted.tolist()) == ([0], [0])


def test_unlabelled_human_time_splits_both_tracks_at_the_same_place():
    over = letters_overlay("aaa..aaa", "aaaaaaaa")
    assert len(over.human) == len(over.predicted) == 2
    assert edit_score(over) == 1.0
    assert boundary_errors(over, match_segments(over, 50)).tolist() == [0.0] * 4


def test_nothing_predicted_scores_no_edit_and_leaves_no_boundary():
    over = letters_overlay("aabb", "....")
    assert edit_score(over) == 0.0
    assert boundary_errors(over, match_segments(over, 10)).size == 0


ERRORS = ("insertion", "deletion", "fragmentation", "merge", "overfill", "underfill")


def letters_events(human: str, predicted: str, times: np.ndarray | None = None) -> Events:
    """Errors of two tracks written one letter a sample (1 s), dots being unlabelled."""
    codes = [np.array(["abc".find(c) for c in text], dtype=np.int64) for text in (human, predicted)]
    stamps = np.arange(len(human), dtype=float) if times is None else times
    return event_errors(overlay(*codes, stamps, LETTERS))


def errors(events: Events) -> dict[str, tuple[int, float]]:
    """The kinds of error that occur, as (count, seconds)."""
    found = {kind: getattr(events, kind) for kind in ERRORS}
    return {kind: (t.count, t.seconds) for kind, t in found.items() if t != Tally()}


#: In these b is what surrounds the events of a, and is itself judged just as a is.
EVENT_ERRORS = {
    # For b the inserted stretch is one missed in the middle.
    "one that is not there is an insertion": (
        ("bbbbbbbb", "bbbaabbb"),
        {"insertion": (1, 2.0), "fragmentation": (1, 2.0)},
    ),
    "one that is missed is a deletion": (
        ("bbbaabbb", "bbbbbbbb"),
        {"deletion": (1, 2.0), "merge": (1, 2.0)},
    ),
    "one predicted as unlabelled is a deletion and nothing else": (
        ("bbbaabbb", "bbb..bbb"),
        {"deletion": (1, 2.0)},
    ),
    "one in pieces is fragmented once however many pieces": (
        ("aaaaaaaa", "a.aa.a.a"),
        {"fragmentation": (1, 3.0)},
    ),
    "one that is too long overfills and its neighbour underfills": (
        ("bbbbaaaa", "bbaaaaaa"),
        {"overfill": (1, 2.0), "underfill": (1, 2.0)},
    ),
    "one that is short at both ends underfills twice": (
        ("aaaaaaaa", ".aaaaa.."),
        {"underfill": (2, 3.0)},
    ),
    "a wrong name is a deletion of the one and an insertion of the other": (
        ("bbaabb", "bbccbb"),
        {"deletion": (1, 2.0), "insertion": (1, 2.0)},
    ),
}


@pytest.mark.parametrize(("tracks", "expected"), EVENT_ERRORS.values(), ids=EVENT_ERRORS)
def test_an_event_is_wrong_in_its_kinds(tracks, expected):
    assert errors(letters_events(*tracks)) == expected


#: A letter a sample, dots being unlabelled.
letter_tracks = pairs(actions=3, least=0, most=40, longest=7, step=1.0, gap=20.0).map(
    lambda drawn: (*("".join("abc."[code] for code in codes) for codes in drawn[:2]), drawn[2])
)


def by_hand(human: str, predicted: str, times: np.ndarray) -> dict[str, tuple[int, float]]:
    """The definitions one sample and one event at a time; every sample lasts one second."""
    n = len(human)
    broken = [True] + [bool(times[i] - times[i - 1] > 5) for i in range(1, n)]
    total = {kind: [0, 0.0] for kind in ERRORS}
    for action in "abc":
        # Answers per sample: None where nothing is labelled.
        yes = [
            None if h == "." else (h == action, p == action)
            for h, p in zip(human, predicted, strict=True)
        ]

        def events(who: int, yes=yes) -> list[range]:
            found = []
            for i in range(n):
                if yes[i] is None or not yes[i][who]:
                    continue
                start = i
                while not broken[start] and yes[start - 1] and yes[start - 1][who]:
                    start -= 1
                if not found or found[-1].start != start:
                    found.append(range(start, i + 1))
                found[-1] = range(start, i + 1)
            return found

        truth, guessed = events(0), events(1)
        for mine, theirs, none, several, edge in (
            (truth, guessed, "deletion", "fragmentation", "underfill"),
            (guessed, truth, "insertion", "merge", "overfill"),
        ):
            for event in mine:
                met = [set(event) & set(other) for other in theirs if set(event) & set(other)]
                if not met:
                    total[none][0] += 1
                    total[none][1] += len(event)
                    continue
                inner = set().union(*met)
                before = [i for i in event if i < min(inner)]
                after = [i for i in event if i > max(inner)]
                total[edge][0] += bool(before) + bool(after)
                total[edge][1] += len(before) + len(after)
                total[several][0] += len(met) > 1
                total[several][1] += max(inner) - min(inner) + 1 - len(inner)
    return {kind: (c, s) for kind, (c, s) in total.items() if c}


@settings(max_examples=60, deadline=None)
@given(letter_tracks)
def test_every_error_is_what_the_definitions_say_event_by_event(track):
    human, predicted, times = track
    assume(len(human) < 2 or np.median(np.diff(times)) == 1.0)
    assert errors(letters_events(human, predicted, times)) == by_hand(human, predicted, times)


@settings(max_examples=60, deadline=None)
@given(letter_tracks)
def test_errors_and_right_time_account_for_all_labelled_time(track):
    human, predicted, times = track
    found = letters_events(human, predicted, times)
    period = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
    lasts = np.minimum(np.diff(times, append=times[-1:] + period), 5 * period)
    lasts = np.where(lasts == 5 * period, period, lasts)

    def length(chosen: list[bool]) -> float:
        return float(lasts[np.array(chosen, dtype=bool)].sum())

    both = list(zip(human, predicted, strict=True))
    right = length([h == p != "." for h, p in both])
    labelled = length([h != "." for h, _ in both])
    agreed = length([h != "." and p != "." for h, p in both])
    assert found.human.seconds == pytest.approx(labelled)
    assert found.predicted.seconds == pytest.approx(agreed)
    missed = [found.deletion, found.fragmentation, found.underfill]
    false = [found.insertion, found.merge, found.overfill]
    assert right + sum(t.seconds for t in missed) == pytest.approx(labelled)
    assert right + sum(t.seconds for t in false) == pytest.approx(agreed)


THREE = ("grab", "hold", "pull")
runs = st.lists(st.tuples(st.integers(-1, 2), st.integers(1, 25)), min_size=1, max_size=8)


def track(parts, n):
    return np.resize(np.repeat([c for c, _ in parts], [k for _, k in parts]), n)


@given(runs, runs, st.integers(2, 120))
@settings(max_examples=40, deadline=None)
def test_unlabelled_time_is_as_if_it_had_never_been_recorded(human, predicted, n):
    h, p = track(human, n), track(predicted, n)
    found = score("", h, p, times_of(n), THREE)
    h, p = h[h >= 0], p[h >= 0]
    plain = score("", h, p, times_of(len(h)), THREE)
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
    found = score("", human, predicted, times_of(140), THREE)
    # Three matched segments and a sliver behind the second hole; one boundary, 20 ms late.
    assert found.f1["50"] == 6 / 7
    assert found.f1_labelled["50"] == 1.0
    assert found.boundaries_found == 1.0
    late = score("", human, np.repeat([0, 1], [101, 39]), times_of(140), THREE)
    assert late.boundaries_found == 0.0


def test_a_coder_who_leaves_a_little_between_actions_does_not_hide_how_far_edges_are_off():
    human = np.repeat([-1, 0, -1, 1, -1, 2, -1], [5, 40, 4, 40, 4, 40, 5])
    predicted = np.repeat([0, 1, 2], [56, 41, 41])  # 0 ends 70 ms of labelled time late, 1 40
    found = score("", human, predicted, times_of(138), THREE)
    assert found.boundary_ms["median"] == 0
    # Two boundaries, each the end of one segment and the start of the next.
    assert found.boundary_labelled_ms["median"] == pytest.approx(55.0)
    assert found.boundary_labelled_ms["p90"] == pytest.approx(70.0)
    # Within what the coder left unlabelled, a boundary is right wherever it is.
    right = score(
        "",
        human,
        np.repeat([0, 1, 2], [46, 46, 46]),
        times_of(138),
        THREE,
    )
    assert right.boundary_labelled_ms == {"median": 0, "p90": 0}


def test_one_action_has_no_boundaries_to_be_off():
    alone = score(
        "",
        np.repeat([-1, 0], [10, 90]),
        np.repeat([1, 0], [40, 60]),
        times_of(100),
        THREE,
    )
    assert alone.boundary_ms["p90"] > 200  # where the coder's labels begin, it was still wrong
    assert alone.boundary_labelled_ms == {"median": None, "p90": None}


FOUR = ("still", "grab", "hold", "pull")


@settings(max_examples=40, deadline=None)
@given(pairs(least=2, step=1 / 128, gap=400 / 1024))
def test_scores_of_segments_are_those_of_their_samples(drawn):
    human, predicted, times = drawn
    segments = [from_codes(codes, times, FOUR) for codes in (human, predicted)]
    if np.median(np.diff(times)) * 1024 > 8:
        return  # more gaps than samples: a sample has no length
    counts = count_segments(*segments, FOUR)
    expected = score("d", human, predicted, times, FOUR).to_json()
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
    over = overlay_segments(human, (Segment(0.5, 2.5, "grab"),), FOUR)
    assert over.human.starts.tolist() == [0, 2]
    assert over.predicted.seconds.tolist() == [2.0]
    assert over.pieces.seconds.tolist() == [0.5, 1.5, 0.5, 0.5]


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


def test_where_segments_of_a_damaged_run_overlap_the_later_one_counts():
    human = (Segment(0, 2, "grab"), Segment(2, 4, "hold"))
    overlapping = (Segment(0, 3, "hold"), Segment(1, 4, "hold"))
    for damaged, sound in (
        (overlapping, (Segment(0, 4, "hold"),)),
        (
            (Segment(0, 3, "grab"), Segment(1, 4, "hold")),
            (Segment(0, 1, "grab"), Segment(1, 4, "hold")),
        ),
    ):
        assert score_tracks(human, damaged) == score_tracks(human, sound)
