"""Training without what the other demonstrations contradict: wrong labels go, right ones stay."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from factories import labelled_set, synthetic_set
from sklearn.ensemble import ExtraTreesClassifier

from forcelab.jobs import finish
from forcelab.labels import Segment
from forcelab.recognition import ensemble
from forcelab.recognition import label_noise as trimming_module
from forcelab.recognition import training as training_module
from forcelab.recognition.cross_validation import leave_one_out_job, split_examples
from forcelab.recognition.examples import LabelledDemonstration, prepare_examples
from forcelab.recognition.groups import fold_groups
from forcelab.recognition.label_noise import DroppedSegment, drop_contradicted, dropped_remarks
from forcelab.recognition.presets import preset
from forcelab.recognition.training import fit_examples, train

FAST = preset("fast").replace(trimmed=True)
#: still, grab, hold, release, still: the hold of the demonstration with this number is renamed.
WRONG, HOLD = 1, 2


@pytest.fixture(autouse=True)
def _small_forests(monkeypatch):
    """Of what is learnt in the end: what is left out is found by other trees, before."""
    monkeypatch.setattr(ensemble, "TREES", 2)


def renamed(item, k, action):
    segments = list(item.segments)
    segments[k] = replace(segments[k], action=action)
    return LabelledDemonstration(item.demonstration, tuple(segments))


@pytest.fixture(scope="module")
def right():
    return labelled_set(6, rate=100.0)


@pytest.fixture(scope="module")
def wrong(right):
    return [*right[:WRONG], renamed(right[WRONG], HOLD, "release"), *right[WRONG + 1 :]]


def prepared(items):
    return [prepare_examples(item, FAST) for item in items]


@pytest.fixture(scope="module")
def mistaken(wrong):
    """The wrong segment, as it is to be found."""
    return DroppedSegment(wrong[WRONG].demonstration.name, wrong[WRONG].segments[HOLD], "hold")


@pytest.mark.parametrize("name", ["fast", "best"])
def test_a_wrong_label_is_left_out_and_no_other(wrong, mistaken, name):
    settings = preset(name).replace(trimmed=True)
    examples = [prepare_examples(item, settings) for item in wrong]
    cleaned, left_out = finish(drop_contradicted(examples, settings))
    assert left_out == (mistaken,)
    for i, (before, after) in enumerate(zip(examples, cleaned, strict=True)):
        gone = [s for s in before.segments if s not in after.segments]
        assert gone == ([mistaken.segment] if i == WRONG else [])
        assert after.features is before.features


def test_right_labels_all_stay(right):
    examples = prepared(right)
    cleaned, left_out = finish(drop_contradicted(examples, FAST))
    assert left_out == ()
    assert [e.segments for e in cleaned] == [e.segments for e in examples]


def test_without_trimming_everything_is_trained_on(wrong):
    examples = prepared(wrong)
    cleaned, left_out = finish(drop_contradicted(examples, FAST.replace(trimmed=False)))
    assert left_out == ()
    assert all(after is before for after, before in zip(cleaned, examples, strict=True))


@pytest.fixture
def everything_suspect(monkeypatch):
    """Each segment is as good as certain to be another action."""
    monkeypatch.setattr(
        trimming_module,
        "score_suspicions",
        lambda probabilities, line: [
            (int(number), int(row.argmax()), 1.0)
            for number, row in zip(line.known, probabilities, strict=True)
        ],
    )


@pytest.mark.usefixtures("everything_suspect")
def test_two_demonstrations_cannot_outvote_each_other(right):
    assert finish(drop_contradicted(prepared(right[:2]), FAST))[1] == ()
    assert finish(drop_contradicted(prepared(right[:3]), FAST))[1] != ()


@pytest.mark.usefixtures("everything_suspect")
def test_no_more_than_a_third_of_an_action_goes(right):
    _, left_out = finish(drop_contradicted(prepared(right), FAST))
    # Of twelve times still and six times each of the others.
    assert Counter(c.segment.action for c in left_out) == {
        "still": 4,
        "grab": 2,
        "hold": 2,
        "release": 2,
    }


@pytest.mark.usefixtures("everything_suspect")
def test_of_a_rare_action_two_stay_whatever_speaks_against_them(right):
    items = [renamed(item, HOLD, "squeeze") if i < 2 else item for i, item in enumerate(right)]
    recogniser = finish(fit_examples(prepared(items), FAST))
    assert "squeeze" not in [c.segment.action for c in recogniser.dropped]
    assert "squeeze" in recogniser.actions
    # Of four holds one may go, as one of three is not yet more than a third.
    assert sum(c.segment.action == "hold" for c in recogniser.dropped) == 1


@pytest.mark.usefixtures("everything_suspect")
def test_a_segment_that_no_time_step_sees_is_not_judged(right):
    examples = prepared(right)
    # Shorter than a step, before the first one.
    first, *others = examples[0].segments
    blink = Segment(0.0, 0.004, "still")
    blinked = replace(examples[0], segments=(blink, replace(first, start=0.004), *others))
    cleaned, left_out = finish(drop_contradicted([blinked, *examples[1:]], FAST))
    assert left_out
    assert blink in cleaned[0].segments


def test_what_stands_in_for_a_gap_speaks_against_nothing(wrong, mistaken):
    examples = prepared(wrong)
    example, segment = examples[WRONG], mistaken.segment
    gap = (example.times > segment.start) & (example.times < segment.end)
    examples[WRONG] = replace(example, valid=example.valid & ~gap)
    assert finish(drop_contradicted(examples, FAST))[1] == ()


@pytest.fixture
def taught_live(monkeypatch):
    """What the parts that follow a stream are taught by."""
    trained_on = []
    fitting = training_module.fit_live_models

    def watched(labelled, *others):
        trained_on.extend(labelled)
        return fitting(labelled, *others)

    monkeypatch.setattr(training_module, "fit_live_models", watched)
    return trained_on


def test_classifier_decoder_and_live_parts_do_not_learn_what_is_left_out(
    wrong, mistaken, taught_live
):
    recogniser = train(wrong, FAST)
    assert recogniser.dropped == (mistaken,)
    assert [item.demonstration.id for item in taught_live] == [i.demonstration.id for i in wrong]
    assert mistaken.segment not in taught_live[WRONG].segments
    assert len(taught_live[WRONG].segments) == len(wrong[WRONG].segments) - 1
    clean = [
        LabelledDemonstration(
            i.demonstration, tuple(s for s in i.segments if s != mistaken.segment)
        )
        for i in wrong
    ]
    same = train(clean, FAST.replace(trimmed=False))
    assert recogniser.grammar.to_json() == same.grammar.to_json()
    unseen = synthetic_set(7, rate=100.0)[6][0]
    np.testing.assert_array_equal(
        recogniser.predict(unseen).probabilities, same.predict(unseen).probabilities
    )


def test_an_evaluation_says_what_was_not_trained_on(wrong, mistaken):
    (remark,) = [
        r for r in finish(leave_one_out_job(wrong, FAST, folds=3)).remarks if "contradict" in r
    ]
    assert f"release of {mistaken.demonstration}" in remark
    assert f"at {mistaken.segment.start:.2f} s (rather hold)" in remark


def test_labels_that_are_left_out_have_no_say_in_what_is_trimmed(wrong):
    parts = fold_groups([item.demonstration for item in wrong], 3)
    examples = prepared(wrong)
    for group in parts[:2]:  # that with the wrong label, and another
        poisoned = [
            replace(
                example,
                features=np.full_like(example.features, 7.0),
                segments=tuple(replace(s, action="poison") for s in example.segments),
            )
            if i in group
            else example
            for i, example in enumerate(examples)
        ]
        folds = [split_examples(some, group) for some in (examples, poisoned)]
        first, second = (finish(fit_examples(train, FAST)) for train, _ in folds)
        assert second.dropped == first.dropped
        assert bool(first.dropped) == (WRONG not in group)
        np.testing.assert_array_equal(
            second.predict_examples(folds[0][1][0]).probabilities,
            first.predict_examples(folds[0][1][0]).probabilities,
        )


def test_demonstrations_of_one_name_are_distinguished(wrong, mistaken, monkeypatch, taught_live):
    # The right label of the one lies where the wrong one of the other does.
    same = replace(wrong[WRONG].demonstration, name="one")
    twin = replace(same, signals=-same.signals)
    items = [
        *wrong[:WRONG],
        LabelledDemonstration(same, wrong[WRONG].segments),
        *wrong[WRONG + 1 :],
    ]
    items.append(LabelledDemonstration(twin, wrong[WRONG].segments))
    contradicted = [(replace(mistaken, demonstration="one"),)]

    def first_only(examples, settings):
        yield from ()
        cleaned = list(examples)
        rest = tuple(s for s in cleaned[WRONG].segments if s != mistaken.segment)
        cleaned[WRONG] = replace(cleaned[WRONG], segments=rest)
        return cleaned, contradicted[0]

    monkeypatch.setattr(training_module, "drop_contradicted", first_only)
    train(items, FAST)
    assert mistaken.segment not in taught_live[WRONG].segments
    assert mistaken.segment in taught_live[-1].segments


def test_what_is_left_out_hangs_on_the_seed_alone(wrong, monkeypatch):
    seeds = []

    def seeded(trees, *, random_state):
        seeds.append(random_state)
        return ExtraTreesClassifier(2, random_state=random_state)

    monkeypatch.setattr("sklearn.ensemble.ExtraTreesClassifier", seeded)
    finish(drop_contradicted(prepared(wrong), FAST.replace(seed=5)))
    assert set(seeds) == {5}


def test_a_remark_names_a_few_and_each_once():
    found = [DroppedSegment(f"foam-{i}", Segment(1.0, 2.0, "grab"), "hold") for i in range(5)]
    (remark,) = dropped_remarks([*found, replace(found[0], other="still")])
    assert remark.count(" at ") == 3
    assert remark.endswith("and 2 more.")
    assert dropped_remarks([]) == ()
