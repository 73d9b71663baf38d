"""Where actions change, learnt by itself: from what happens there, which nobody labelled."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from skops import io as skops_io
from synthetic import synthetic_set

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.labels import Segment
from forcelab.recognition.cross_validation import make_folds
from forcelab.recognition.examples import LabelledDemonstration, gather_features, prepare_examples
from forcelab.recognition.presets import preset
from forcelab.recognition.storage import TRUSTED, load_recogniser, pack, save_recogniser
from forcelab.recognition.task_grammar import NEAR, boundary_steps, fit_boundary_model
from forcelab.recognition.training import fit_examples, train

#: Small, so that a fit takes no time.
QUICK = preset("fast")
#: Where the actions of a click change, and how much a coder leaves bare around that, in seconds.
CLICKS, BARE = (1.0, 2.2, 3.1), 0.2


def clicking(seed):
    """A force that swells and shrinks slowly, and clicks where the actions take turns."""
    rng = np.random.default_rng(seed)
    changes = np.array(CLICKS) + rng.uniform(-0.3, 0.3, len(CLICKS))
    t = np.arange(0.0, 4.2, 0.01)
    edges = np.concatenate([[0.0], changes, [4.2]])
    slow = np.interp(t, 0.5 * (edges[:-1] + edges[1:]), [0.0, 1.0, 0.0, 1.0])
    clicks = sum(np.exp(-0.5 * ((t - change) / 0.015) ** 2) for change in changes)
    force = slow + 0.5 * clicks + 0.01 * rng.standard_normal(len(t))
    segments = tuple(
        Segment(start + BARE / 2, end - BARE / 2, "loose" if i % 2 == 0 else "tight")
        for i, (start, end) in enumerate(pairwise(edges.tolist()))
    )
    made = Demonstration(f"click {seed}", "clicking", t, force[:, None], (Channel("f", "N"),))
    return LabelledDemonstration(made, segments), changes


@pytest.fixture(scope="module")
def clicks():
    return [clicking(seed) for seed in range(6)]


def taught(examples, settings=QUICK):
    y, steps = boundary_steps(examples, settings)
    (X,) = finish(gather_features(examples, steps))
    return finish(fit_boundary_model(X, y, settings))


def learnt(items, settings=QUICK):
    return taught([prepare_examples(item, settings) for item in items], settings)


def test_a_change_is_seen_where_it_happens_and_nowhere_else(clicks):
    found = learnt([item for item, _ in clicks[1:]])
    item, changes = clicks[0]
    example = prepare_examples(item, QUICK)
    ratios = found.ratios(example.features)
    near = np.abs(example.times[:, None] - changes).min(axis=1)
    assert ratios[near < NEAR / 2].min() > 1.0
    assert np.mean(ratios[near > 3 * NEAR] < 0.0) > 0.95


def test_boundaries_are_found_in_what_coders_leave_unlabelled(clicks):
    item, changes = clicks[0]
    others = [other for other, _ in clicks[1:]]

    def off(settings):
        times = [s.start for s in train(others, settings).predict(item.demonstration).segments[1:]]
        assert len(times) == len(changes)
        return np.abs(np.array(times) - changes).max()

    assert off(QUICK) < 0.05
    assert off(QUICK) < off(QUICK.replace(changes=False))


def test_certainty_knows_of_changes_what_the_decoder_knows(clicks):
    item, changes = clicks[0]
    made = train([other for other, _ in clicks[1:]], QUICK)
    without = replace(made, boundary_model=None)
    # Just before the first change, already in what nobody would label.
    span = changes[0] - 0.08, changes[0] - 0.04
    sure, unsure = (
        one.predict(item.demonstration, probability_trace=True).probability_trace.of_action(
            "tight", *span
        )
        for one in (made, without)
    )
    assert sure < 0.5 * unsure


def test_what_lies_in_a_long_hole_is_neither_a_change_nor_anything_else(clicks):
    items = [item for item, _ in clicks]
    examples = [prepare_examples(item, QUICK) for item in items]
    # Without the second segment there are 0.9 s and more of which nobody says anything.
    holed = [replace(e, segments=(e.segments[0], *e.segments[2:])) for e in examples]
    hidden = []
    for example in holed:
        features = example.features.copy()
        inside = (example.times >= example.segments[0].end) & (
            example.times < example.segments[1].start
        )
        features[inside] = 1e6
        hidden.append(replace(example, features=features))
    one, other = (taught(some) for some in (holed, hidden))
    rows = examples[0].features
    np.testing.assert_array_equal(one.ratios(rows), other.ratios(rows))


def test_time_with_missing_samples_teaches_nothing(clicks):
    examples = [prepare_examples(item, QUICK) for item, _ in clicks]
    gone = [replace(e, valid=e.times < 2.0, features=e.features.copy()) for e in examples]
    one = taught(gone)
    for example in gone:
        example.features[~example.valid] = 1e6
    other = taught(gone)
    rows = examples[0].features
    np.testing.assert_array_equal(one.ratios(rows), other.ratios(rows))


def test_what_is_left_out_has_no_say_in_where_actions_change(clicks):
    examples = [prepare_examples(item, QUICK) for item, _ in clicks]
    rows, parts = examples[0].features, [[0], [1, 2], [3, 4, 5]]
    # Another change than there was, and features that are none.
    wrong = (Segment(0.2, 2.6, "loose"), Segment(2.7, 4.0, "tight"), Segment(4.0, 4.1, "loose"))
    for at, part in enumerate(parts):
        poisoned = list(examples)
        for i in part:
            nonsense = np.full_like(examples[i].features, 7.0)
            poisoned[i] = replace(examples[i], features=nonsense, segments=wrong)
        one, other = (
            finish(fit_examples(make_folds(given, parts)[at].train, QUICK)).boundary_model.ratios(
                rows
            )
            for given in (examples, poisoned)
        )
        np.testing.assert_array_equal(one, other)
        heard = taught(poisoned).ratios(rows)
        assert not np.array_equal(heard, taught(examples).ratios(rows))


@pytest.mark.parametrize("off", [{"changes": False}, {"decoder": "filters"}])
def test_nothing_is_learnt_that_nobody_asks_for(clicks, off):
    assert learnt([item for item, _ in clicks], QUICK.replace(**off)) is None
    assert train([item for item, _ in clicks[:3]], QUICK.replace(**off)).boundary_model is None


def test_where_no_action_gives_way_to_another_training_goes_on_without(clicks):
    apart = []
    for item, _ in clicks[:4]:
        loose, tight = item.segments[0], item.segments[1]
        far = (replace(loose, end=loose.end - 0.3), tight)
        apart.append(LabelledDemonstration(item.demonstration, far))
    made = train(apart, QUICK)
    assert made.boundary_model is None
    assert made.predict(clicks[5][0].demonstration).segments


@pytest.mark.parametrize(("kept", "enough"), [(3, False), (4, True)])
def test_two_changes_are_too_few_to_learn_from(clicks, kept, enough):
    item = clicks[0][0]
    few = LabelledDemonstration(item.demonstration, item.segments[:kept])
    assert (learnt([few], QUICK.replace(stride=1)) is not None) == enough


# --- kept in a file -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def best():
    return train(
        [LabelledDemonstration(*pair) for pair in synthetic_set(2, rate=100.0)], preset("best")
    )


def test_best_is_the_same_to_the_bit_when_it_was_saved(best, tmp_path):
    assert best.boundary_model is not None
    save_recogniser(best, tmp_path / "one")
    loaded = load_recogniser(tmp_path / "one")
    unseen = LabelledDemonstration(*synthetic_set(3, rate=100.0)[2]).demonstration
    before, after = (made.predict(unseen, probability_trace=True) for made in (best, loaded))
    np.testing.assert_array_equal(after.filtered, before.filtered)
    np.testing.assert_array_equal(after.probability_trace.values, before.probability_trace.values)
    rows = best.prepare(unseen).features
    np.testing.assert_array_equal(
        loaded.boundary_model.ratios(rows), best.boundary_model.ratios(rows)
    )


def test_a_file_from_before_predicts_without(best, tmp_path):
    content = skops_io.loads(pack(best), trusted=list(TRUSTED))
    del content["changes"], content["settings"]["changes"]
    (tmp_path / "older").write_bytes(skops_io.dumps(content))
    assert load_recogniser(tmp_path / "older").boundary_model is None


def test_one_of_other_features_is_refused(best, clicks, tmp_path):
    fewer = [replace(prepare_examples(item, QUICK), segments=item.segments) for item, _ in clicks]
    wide = [replace(e, features=np.repeat(e.features, 9, axis=1)) for e in fewer]
    other = taught(wide)
    (tmp_path / "one").write_bytes(pack(replace(best, boundary_model=other)))
    with pytest.raises(InputError, match="not a whole recogniser"):
        load_recogniser(tmp_path / "one")


@pytest.mark.parametrize(
    "damage",
    [
        {"share": 0.0},
        {"share": 1.0},
        {"share": float("nan")},
        {"share": "some"},
        {"classifier": None},
        {"classifier": {"classes_": [0, 1]}},
        "much",
        {},
    ],
)
def test_a_damaged_one_is_refused(best, tmp_path, damage):
    content = skops_io.loads(pack(best), trusted=list(TRUSTED))
    whole = isinstance(damage, dict) and damage
    content["changes"] = content["changes"] | damage if whole else damage
    (tmp_path / "one").write_bytes(skops_io.dumps(content))
    with pytest.raises(InputError, match="not a whole recogniser"):
        load_recogniser(tmp_path / "one")
