from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.labels import Segment
from forcelab.recognition.task_grammar import SLIP_SECONDS, TaskGrammar


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
    one = TaskGrammar.learn([track(("grab", 0.5), ("hold", 2.0))], ["grab", "hold", "never"])
    many = TaskGrammar.learn([track(("grab", 0.5), ("hold", 2.0))] * 8, ["grab", "hold", "never"])
    assert math.log(0.5) < many.mean[0] < one.mean[0] < one.mean[2] < one.mean[1] < math.log(2.0)
    assert (one.sd[:2] > many.sd[:2]).all()
    assert one.sd[2] > one.sd[0]


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


def test_what_nobody_asked_for_counts_as_unlabelled():
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
    made = [track(*one, hole=1.0) for one in tracks]
    learnt = TaskGrammar.learn(made, "abcd")
    other = TaskGrammar.learn(made, order)
    places = ["abcd".index(action) for action in order]
    for name in ("mean", "sd", "share", "start"):
        assert getattr(other, name) == pytest.approx(getattr(learnt, name)[places])
    assert other.follow == pytest.approx(learnt.follow[np.ix_(places, places)])
    if any(made):
        slow = [track(*[(a, factor * d) for a, d in one], hole=1.0) for one in tracks]
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
