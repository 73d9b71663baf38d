"""Durations and order of actions, and where they change, as learnt from tracks."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from factories import labelled_set, synthetic_set
from hypothesis import given, settings
from hypothesis import strategies as st
from skops import io as skops_io

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.labels import Segment
from forcelab.recognition.cross_validation import split_examples
from forcelab.recognition.examples import LabelledDemonstration, gather_features, prepare_examples
from forcelab.recognition.presets import preset
from forcelab.recognition.storage import TRUSTED, load_recogniser, pack, save_recogniser
from forcelab.recognition.task_grammar import (
    NEAR,
    SLIP_SECONDS,
    TaskGrammar,
    boundary_steps,
    fit_boundary_model,
)
from forcelab.recognition.training import fit_examples, train

pytestmark = pytest.mark.usefixtures("small_fits")


def track(*pieces: tuple[str, float], hole: float = 0.0, start: float = 0.0):
    """Segments one after the other; None is unlabelled time."""
    segments, now = [], start
    for action, seconds in pieces:
        if action:
            segments.append(Segment(now, now + seconds, action))
        now += seconds + hole
    return tuple(segments)


def test_durations_of_many_segments_are_theirs():
    rng = np.random.default_rng(0)
    logs = rng.normal(math.log(0.5), 0.3, 400)
    tracks = [track(("grab", math.exp(x)), ("hold", 2.0)) for x in logs]
    learnt = TaskGrammar.learn(tracks, ["grab", "hold"])
    assert learnt.mean == pytest.approx([logs.mean(), math.log(2)], abs=0.01)
    assert learnt.sd[0] == pytest.approx(logs.std(), abs=0.02)
    assert learnt.sd[1] >= 0.1  # nobody repeats that exactly
    assert learnt.share == pytest.approx([0.21, 0.79], abs=0.02)
    assert learnt.start[0] > 0.99
    assert learnt.follow == pytest.approx(np.array([[0, 1], [1, 0]]))


def test_few_segments_are_drawn_together_and_known_less_well():
    few = TaskGrammar.learn([track(("grab", 0.5), ("hold", 2.0))], ["grab", "hold", "never"])
    many = TaskGrammar.learn([track(("grab", 0.5), ("hold", 2.0))] * 8, ["grab", "hold", "never"])
    assert math.log(0.5) < many.mean[0] < few.mean[0] < few.mean[2] < few.mean[1] < math.log(2.0)
    assert (few.sd[:2] > many.sd[:2]).all()
    assert few.sd[2] > few.sd[0]


def test_an_order_never_seen_is_unlikely_but_not_impossible():
    tracks = [track(("a", 1.0), ("b", 1.0), ("c", 1.0))] * 9
    follow = TaskGrammar.learn(tracks, ["a", "b", "c", "d"]).follow
    assert follow[0, 1] > 0.9
    assert 0 < follow[0, 2] < 0.1
    assert follow[3] == pytest.approx([1 / 3, 1 / 3, 1 / 3, 0])
    assert follow.sum(axis=1) == pytest.approx(np.ones(4))


def test_unlabelled_time_is_missing_and_no_action():
    short = TaskGrammar.learn([track(("a", 1.0), ("b", 1.0), hole=0.05)] * 9, ["a", "b", "c"])
    long = TaskGrammar.learn([track(("a", 1.0), ("b", 1.0), hole=2.0)] * 9, ["a", "b", "c"])
    assert short.follow[0, 1] > 0.9
    assert long.follow[0, 1] == pytest.approx(0.5)
    # A short hole belongs to both, so that they last as long as they will when decoded.
    assert math.exp(short.mean[0]) == pytest.approx(1.025, abs=1e-3)
    assert math.exp(long.mean[0]) == pytest.approx(1.0, abs=1e-3)


def test_slips_of_the_brush_teach_nothing():
    clean = [track(("a", 1.0), ("b", 0.5), ("a", 1.0))] * 3
    flicker = [("a", 0.02), ("b", 0.02)] * 4
    slips = track(("a", 0.98), ("b", 0.02), ("a", 0.02), ("b", 0.48), *flicker, ("a", 0.84))
    lone = track(("a", 1.0), ("b", 0.5), ("a", 1.0), ("b", 0.02), hole=1.0)
    learnt = TaskGrammar.learn([*clean, slips, lone], ["a", "b", "c"])
    right = TaskGrammar.learn([*clean, clean[0], clean[0]], ["a", "b", "c"])
    assert learnt.mean == pytest.approx(right.mean, abs=0.1)
    assert learnt.sd == pytest.approx(right.sd, abs=0.1)
    assert learnt.share == pytest.approx(right.share, abs=0.02)
    assert learnt.follow == pytest.approx(right.follow, abs=0.1)


def test_an_action_that_is_always_short_is_no_slip():
    click = track(("a", 1.0), ("click", 0.01), ("a", 1.0))
    learnt = TaskGrammar.learn([click] * 9, ["a", "click"])
    assert math.exp(learnt.mean[1]) == pytest.approx(0.01, rel=0.2)
    assert learnt.follow[0, 1] > 0.9
    # Of several lengths the longest always counts.
    twice = track(("a", 1.0), ("click", 0.01), ("a", 1.0), ("click", 0.02), ("a", 1.0))
    assert math.exp(TaskGrammar.learn([twice], ["a", "click"]).mean[1]) < 0.05


def test_other_actions_count_as_unlabelled():
    pieces = (("a", 1.0), ("other", 1.0), ("b", 1.0))
    learnt = TaskGrammar.learn([track(*pieces)] * 9, ["a", "b", "c"])
    assert learnt.follow[0, 1] == pytest.approx(0.5)
    assert learnt.share.sum() == pytest.approx(1)


def test_two_segments_of_one_action_that_touch_are_one():
    learnt = TaskGrammar.learn([track(("a", 1.0), ("a", 1.0), ("b", 2.0))] * 9, ["a", "b"])
    assert learnt.mean == pytest.approx([math.log(2)] * 2)
    assert learnt.follow[0, 0] == 0


@pytest.mark.parametrize("actions", [[], ["a"], ["a", "b"]])
def test_nothing_labelled_leaves_everything_possible(actions):
    learnt = TaskGrammar.learn([(), ()], actions)
    assert (learnt.sd > 0.5).all()
    assert learnt.start == pytest.approx(np.full(len(actions), 1 / max(len(actions), 1)))


names = st.sampled_from("abcd")
# All times are exact, lest a duration at the bound of a slip of the brush fall on either side, and
# none is so short that whoever takes longer leaves less out.
lasting = st.integers(math.ceil(64 * SLIP_SECONDS), 6400).map(lambda count: count / 64)
pieces = st.lists(st.tuples(names, lasting), max_size=8)


@settings(max_examples=50, deadline=None)
@given(tracks=st.lists(pieces, max_size=4), order=st.permutations("abcd"), factor=st.integers(1, 9))
def test_numbering_plays_no_part_and_slower_people_have_longer_durations(tracks, order, factor):
    cut_tracks = [track(*durations, hole=1.0) for durations in tracks]
    learnt = TaskGrammar.learn(cut_tracks, "abcd")
    other = TaskGrammar.learn(cut_tracks, order)
    places = ["abcd".index(action) for action in order]
    for name in ("mean", "sd", "share", "start"):
        assert getattr(other, name) == pytest.approx(getattr(learnt, name)[places])
    assert other.follow == pytest.approx(learnt.follow[np.ix_(places, places)])
    if any(cut_tracks):
        slow = [track(*[(a, factor * d) for a, d in durations], hole=1.0) for durations in tracks]
        slower = TaskGrammar.learn(slow, "abcd")
        assert slower.mean - learnt.mean == pytest.approx(np.full(4, math.log(factor)))
        assert slower.sd == pytest.approx(learnt.sd)


def test_it_is_written_down_and_read_again():
    learnt = TaskGrammar.learn([track(("a", 1.0), ("b", 0.3), ("a", 2.0))], ["a", "b", "c"])
    again = TaskGrammar.from_json(json.loads(json.dumps(learnt.to_json())))
    assert again.actions == learnt.actions
    for name in ("mean", "sd", "share", "start", "follow"):
        assert np.array_equal(getattr(again, name), getattr(learnt, name))


@pytest.mark.parametrize(
    "damage",
    [
        {"sd": [1.0, 0.0]},
        {"mean": [1.0]},
        {"mean": [1.0, math.nan]},
        {"mean": ["x", 1.0]},
        {"follow": [[0.0, 1.0]]},
        {"follow": [[0.0, -1.0], [1.0, 0.0]]},
        {"share": [0.0, 1.0]},
        {"start": None},
        {"actions": 3},
    ],
)
def test_a_damaged_one_is_not_read(damage):
    plain = TaskGrammar.learn([track(("a", 1.0), ("b", 0.3))], ["a", "b"]).to_json()
    with pytest.raises(ValueError):  # noqa: PT011 - whatever it says is told with the file
        TaskGrammar.from_json(plain | damage)


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
    demonstration = Demonstration(
        f"click {seed}", "clicking", t, force[:, None], (Channel("f", "N"),)
    )
    return LabelledDemonstration(demonstration, segments), changes


@pytest.fixture(scope="module")
def clicks():
    return [clicking(seed) for seed in range(6)]


def taught(examples, settings=QUICK):
    y, steps = boundary_steps(examples, settings)
    (X,) = finish(gather_features(examples, steps))
    rate = examples[0].rate
    spacing = settings.training_stride(rate) * settings.hop(rate) / rate
    return finish(fit_boundary_model(X, y, spacing, settings.seed))


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
    recogniser = train([other for other, _ in clicks[1:]], QUICK)
    without = replace(recogniser, boundary_model=None)
    # Just before the first change, already in what nobody would label.
    span = changes[0] - 0.08, changes[0] - 0.04
    confident, unsure = (
        which.predict(item.demonstration, probability_trace=True).probability_trace.of_action(
            "tight", *span
        )
        for which in (recogniser, without)
    )
    assert confident < 0.5 * unsure


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
    of_holed, of_hidden = (taught(some) for some in (holed, hidden))
    rows = examples[0].features
    np.testing.assert_array_equal(of_holed.ratios(rows), of_hidden.ratios(rows))


def test_time_with_missing_samples_teaches_nothing(clicks):
    examples = [prepare_examples(item, QUICK) for item, _ in clicks]
    gone = [replace(e, valid=e.times < 2.0, features=e.features.copy()) for e in examples]
    of_gone = taught(gone)
    for example in gone:
        example.features[~example.valid] = 1e6
    other = taught(gone)
    rows = examples[0].features
    np.testing.assert_array_equal(of_gone.ratios(rows), other.ratios(rows))


def test_what_is_left_out_has_no_say_in_where_actions_change(clicks):
    examples = [prepare_examples(item, QUICK) for item, _ in clicks]
    rows, parts = examples[0].features, [[0], [1, 2], [3, 4, 5]]
    # Another change than there was, and features that are none.
    wrong = (Segment(0.2, 2.6, "loose"), Segment(2.7, 4.0, "tight"), Segment(4.0, 4.1, "loose"))
    for part in parts:
        poisoned = list(examples)
        for i in part:
            nonsense = np.full_like(examples[i].features, 7.0)
            poisoned[i] = replace(examples[i], features=nonsense, segments=wrong)
        first, second = (
            finish(fit_examples(split_examples(some, part)[0], QUICK)).boundary_model.ratios(rows)
            for some in (examples, poisoned)
        )
        np.testing.assert_array_equal(first, second)
        ratios = taught(poisoned).ratios(rows)
        assert not np.array_equal(ratios, taught(examples).ratios(rows))


@pytest.mark.parametrize("off", [{"changes": False}, {"decoder": "filters"}])
def test_nothing_is_learnt_that_the_settings_do_without(clicks, off):
    assert learnt([item for item, _ in clicks], QUICK.replace(**off)) is None
    assert train([item for item, _ in clicks[:3]], QUICK.replace(**off)).boundary_model is None


def test_where_no_action_gives_way_to_another_training_goes_on_without(clicks):
    apart = []
    for item, _ in clicks[:4]:
        loose, tight = item.segments[0], item.segments[1]
        far = (replace(loose, end=loose.end - 0.3), tight)
        apart.append(LabelledDemonstration(item.demonstration, far))
    recogniser = train(apart, QUICK)
    assert recogniser.boundary_model is None
    assert recogniser.predict(clicks[5][0].demonstration).segments


@pytest.mark.parametrize(("count", "enough"), [(3, False), (4, True)])
def test_two_changes_are_too_few_to_learn_from(clicks, count, enough):
    item = clicks[0][0]
    few = LabelledDemonstration(item.demonstration, item.segments[:count])
    assert (learnt([few], QUICK.replace(stride=1)) is not None) == enough


# --- kept in a file -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def best():
    return train(labelled_set(2, rate=100.0), preset("best"))


def test_best_is_the_same_to_the_bit_when_it_was_saved(best, tmp_path):
    assert best.boundary_model is not None
    save_recogniser(best, tmp_path / "one")
    loaded = load_recogniser(tmp_path / "one")
    unseen = LabelledDemonstration(*synthetic_set(3, rate=100.0)[2]).demonstration
    before, after = (
        recogniser.predict(unseen, probability_trace=True) for recogniser in (best, loaded)
    )
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
    changed = isinstance(damage, dict) and damage
    content["changes"] = content["changes"] | damage if changed else damage
    (tmp_path / "one").write_bytes(skops_io.dumps(content))
    with pytest.raises(InputError, match="not a whole recogniser"):
        load_recogniser(tmp_path / "one")
