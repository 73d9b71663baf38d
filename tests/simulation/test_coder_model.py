"""Simulated coders: like people in how they differ, honest about what they got wrong."""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.labels import Segment, Track, to_codes
from forcelab.recognition.metrics import count, pool
from forcelab.simulation.coder_model import CODERS, Coder, Coding, Confusion, Mistake, code
from forcelab.simulation.scene import Body, Jaws, Motion, Performance, Scene

RATE = 500.0
SCENE = Scene("foam", Jaws(), Body("block", mass=0.02, half_width=0.02, stiffness=500.0))
#: The choreographies of the paper: actions with shortest and longest duration in seconds, and the
#: normal force in newtons that each ends at.
CHOREOGRAPHIES = {
    "LEGO": (
        "still .8 2 0|grab .25 .7 6|hold 1 2.4 6|search .2 2 5|insert .35 1 9|hold .3 1 6|"
        "release .2 .5 0|still .6 1.4 0|pull .6 1.1 8|hold 1 2.2 6|release .2 .5 0|still .8 1.8 0"
    ),
    "cartridge": (
        "still .8 2 0|grab .25 .7 10|hold 1 2.4 10|insert .8 2 16|release .2 .5 0|still .8 1.8 0|"
        "grab .2 .5 12|pull .5 1.2 14|hold 1 2.2 10|release .2 .5 0|still .8 1.8 0"
    ),
    "stylus": (
        "still .5 .8 0|grab .2 .4 6|pull .2 1 6|slip .2 .7 5|slip transition .3 1.5 2|"
        "slipped .3 1 3|still .6 1.8 0"
    ),
    "marker": (
        "still .8 2 0|grab .25 .7 10|twist .5 1.4 11|hold .2 1 10|twist .5 1.4 11|hold .2 1 10|"
        "twist .5 1.4 11|release .2 .5 0|still .8 1.8 0"
    ),
    "foam": "still .6 1.8 0|grab .2 .5 6|hold .8 1.5 5|release .25 .5 0|still 1.2 2 0",
}


def performance(actions, forces=None):
    """A performance of `actions`, with `forces` (n, 6) at RATE; nothing is felt without."""
    n = round(actions[-1].end * RATE) + 1 if actions else 2
    none = np.zeros((n, 2))
    motion = Motion(np.arange(n) / RATE, none, np.zeros((n, 3)), np.zeros((n, 4)), none)
    forces = np.zeros((n, 6)) if forces is None else forces
    return Performance(SCENE, motion, forces, RATE, tuple(actions), events=())


def row(*parts):
    """Segments one after another, from (action, seconds) pairs."""
    edges = np.cumsum([0.0, *(seconds for _, seconds in parts)]).tolist()
    return tuple(
        Segment(start, end, action)
        for (action, _), start, end in zip(parts, edges[:-1], edges[1:], strict=True)
    )


def performed(task, seed):
    """A plausible performance: grips that rise within each action, with a hand's tremor."""
    rng = np.random.default_rng([seed, 5])
    steps = [step.rsplit(" ", 3) for step in CHOREOGRAPHIES[task].split("|")]
    actions = row(*((name, rng.uniform(float(a), float(b))) for name, a, b, _ in steps))
    times = np.arange(round(actions[-1].end * RATE) + 1) / RATE
    normal = np.zeros(len(times))
    level = 0.0
    for action, (*_, newtons) in zip(actions, steps, strict=True):
        target = float(newtons) * rng.uniform(0.9, 1.1)
        done = np.clip((times - action.start) / min(action.duration, 0.5), 0, 1)
        normal += (target - level) * done**3 * (10 - 15 * done + 6 * done**2)
        level = target
    normal *= 1 + 0.01 * np.sin(2 * np.pi * 9.3 * times)
    forces = np.zeros((len(times), 6))
    forces[:, 2] = forces[:, 5] = -normal
    forces[:, 1] = 0.3 * normal
    return performance(actions, forces)


names = st.sampled_from(["still", "grab", "hold", "search", "insert", "pull", "twist", "release"])
rows = st.lists(st.tuples(names, st.floats(1e-3, 3.0)), min_size=1, max_size=8).map(
    lambda parts: row(*parts)
)
rates = st.floats(0, 1)
seconds = st.floats(0, 2.0)
coders = st.builds(
    Coder,
    name=st.just("Ada"),
    lag=st.floats(-2, 2),
    starts=st.dictionaries(names, st.floats(-1, 1), max_size=3),
    sharp=seconds,
    ramp=seconds,
    gap=seconds,
    margin=seconds,
    short=seconds,
    overlooked=rates,
    neighbour=rates,
    confusions=st.lists(st.builds(Confusion, names, names, rates), max_size=3).map(tuple),
)
seeds = st.integers(0, 2**32 - 1)


def code_row(actions, coder, seed=0, forces=None):
    return code(performance(actions, forces), coder, np.random.default_rng(seed))


@settings(max_examples=40, deadline=None)
@given(rows, coders, seeds, st.data())
def test_segments_stay_in_order_and_inside_whatever_the_habits(actions, coder, seed, data):
    # Some actions left out: a performance with holes is coded with holes.
    chosen = data.draw(st.lists(st.booleans(), min_size=len(actions), max_size=len(actions)))
    actions = tuple(a for a, keep in zip(actions, chosen, strict=True) if keep)
    coded = code_row(actions, coder, seed)
    track = coded.track.segments
    assert coded.track.author == "Ada"
    assert all(left.end <= right.start for left, right in pairwise(track))
    if track:
        assert actions[0].start <= track[0].start
        assert track[-1].end <= actions[-1].end


@settings(max_examples=40, deadline=None)
@given(rows, coders, seeds)
def test_the_mistakes_tell_exactly_how_track_and_truth_differ(actions, coder, seed):
    coded = code_row(actions, coder, seed)
    wrong = {mistake.segment: mistake.taken_for for mistake in coded.mistakes}
    assert all(segment.action != confused_with for segment, confused_with in wrong.items())
    assert list(wrong) == [action for action in actions if action in wrong]
    named = [(wrong.get(action, action.action), action) for action in actions]
    for name, action in named:
        # Edges are off by less than half an action, so its middle belongs to it for certain.
        middle = (action.start + action.end) / 2
        at = {s.action for s in coded.track.segments if s.start <= middle < s.end}
        assert at <= {name}
        if name is not None and action.duration > 100 * (coder.gap + coder.margin):
            assert at == {name}
    # Touching actions called the same are one segment; what was overlooked parts its neighbours.
    called = [
        name
        for number, (name, _) in enumerate(named)
        if name is not None and (number == 0 or named[number - 1][0] != name)
    ]
    assert [segment.action for segment in coded.track.segments] == called


@given(rows)
def test_a_careful_coder_repeats_the_truth(actions):
    distinct = tuple(
        dataclasses.replace(action, action=f"{number} {action.action}")
        for number, action in enumerate(actions)
    )
    assert code_row(distinct, Coder("Ada")) == Coding(Track("Ada", distinct), ())


# Habits, one at a time, on 400 actions of one second each.
NAMES = [f"action {number}" for number in range(400)]
MANY = row(*((name, 1.0) for name in NAMES))
INNER = np.arange(1.0, 400.0)


def errors(coder, forces=None):
    """How late (s) a coder without gaps sees each of the 399 inner edges."""
    track = code_row(MANY, coder, 1, forces).track.segments
    starts = np.array([segment.start for segment in track])
    assert [segment.end for segment in track] == [*starts[1:], 400.0]
    return starts[1:] - INNER


def changing(rise, newtons=5.0, channels=(2, 5), late=0.0):
    """Forces (n, 6) that change by `newtons` within `rise` seconds around every inner edge."""
    knots = np.ravel(INNER[:, np.newaxis] + late + rise * np.array([-0.5, 0.5]))
    levels = np.repeat(np.arange(400) % 2, 2)[1:-1]
    times = np.arange(round(400 * RATE) + 1) / RATE
    forces = np.zeros((len(times), 6))
    forces[:, list(channels)] = -newtons * np.interp(times, knots, levels)[:, np.newaxis]
    return forces


def test_edges_are_seen_late_by_the_lag_and_the_habit_of_the_action_that_starts():
    coder = Coder("Ada", lag=0.03, starts={"action 7": 0.05, "action 9": -0.04})
    late = np.full(399, 0.03)
    late[[6, 8]] = 0.08, -0.01
    np.testing.assert_allclose(errors(coder), late, atol=1e-9)


@pytest.mark.parametrize("channels", [(2,), (2, 5), (0,), (4,)])
def test_edges_spread_little_at_jumps_and_much_on_ramps(channels):
    coder = Coder("Ada", sharp=0.01, ramp=0.1)
    # A standard deviation from 399 values is within 11 % of the true one (3 sigma).
    assert errors(coder, changing(0.002, 5.0, channels)).std() == pytest.approx(0.01, rel=0.11)
    # Of a steady slope, 30 of the 200 ms looked at see 15 % of the change.
    slope = errors(coder, changing(1.0, 8.0, channels))
    assert slope.std() == pytest.approx(0.1 - 0.15 * 0.09, rel=0.11)
    assert abs(slope.mean()) < 3 * 0.1 / 20


def test_what_hardly_changes_shows_no_edge_however_sudden():
    coder = Coder("Ada", sharp=0.0, ramp=0.1)
    jumps = {newtons: errors(coder, changing(0.002, newtons, (2,))).std() for newtons in (0.02, 5)}
    assert jumps[0.02] > 0.085
    assert jumps[5] < 1e-9
    assert errors(coder).std() > 0.085


def test_only_what_changes_within_a_tenth_of_a_second_shows_an_edge():
    coder = Coder("Ada", sharp=0.0, ramp=0.1)
    for late in (-0.08, 0.08):
        assert errors(coder, changing(0.002, late=late)).std() < 1e-9
    for late in (-0.12, 0.12):
        assert errors(coder, changing(0.002, late=late)).std() > 0.085


def test_an_edge_is_never_off_by_more_than_four_tenths_of_an_action():
    wild = errors(Coder("Ada", ramp=10.0))
    assert wild.min() == pytest.approx(-0.4)
    assert wild.max() == pytest.approx(0.4)
    actions = row(("still", 1.0), ("grab", 0.05), ("hold", 1.0))
    for seed in range(20):
        grab = code_row(actions, Coder("Ada", ramp=10.0), seed).track.segments[1]
        assert 0.6 <= grab.start < 1.0201
        assert 1.0299 < grab.end <= 1.45


def test_the_unlabelled_is_as_long_as_asked_for():
    track = code_row(MANY, Coder("Ada", gap=0.05, margin=0.0)).track.segments
    gaps = [right.start - left.end for left, right in pairwise(track)]
    # Gamma of shape 2: the standard deviation is the mean over root 2.
    assert np.mean(gaps) == pytest.approx(0.05, abs=3 * 0.05 / np.sqrt(2 * 399))
    assert np.std(gaps) == pytest.approx(0.05 / np.sqrt(2), rel=0.2)
    middles = [(left.end + right.start) / 2 for left, right in pairwise(track)]
    np.testing.assert_allclose(middles, INNER, atol=1e-9)
    assert (track[0].start, track[-1].end) == (0.0, 400.0)


def test_both_ends_of_the_recording_stay_unlabelled():
    ends = []
    for seed in range(200):
        (still,) = code_row(row(("still", 2.0)), Coder("Ada", margin=0.08), seed).track.segments
        ends.append([still.start, 2.0 - still.end])
    np.testing.assert_allclose(np.mean(ends, axis=0), 0.08, atol=3 * 0.08 / np.sqrt(2 * 200))


def test_a_segment_keeps_four_tenths_of_itself_beside_the_longest_gaps():
    for segment in code_row(MANY, Coder("Ada", gap=50.0, margin=50.0)).track.segments:
        assert segment.duration >= 0.4 - 1e-9


def test_short_segments_are_overlooked_as_often_as_asked_for():
    coded = code_row(MANY, Coder("Ada", short=1.5, overlooked=0.2))
    assert abs(len(coded.mistakes) - 80) < 3 * np.sqrt(400 * 0.2 * 0.8)
    assert all(mistake.taken_for is None for mistake in coded.mistakes)
    chosen = {segment.action for segment in coded.track.segments}
    assert chosen == set(NAMES) - {mistake.segment.action for mistake in coded.mistakes}
    # Exactly as long as short is not short.
    assert not code_row(MANY, Coder("Ada", short=1.0, overlooked=1.0, neighbour=1.0)).mistakes


def test_short_segments_are_taken_for_a_neighbour_as_often_as_asked_for():
    mistakes = code_row(MANY, Coder("Ada", short=1.5, neighbour=0.3)).mistakes
    assert abs(len(mistakes) - 120) < 3 * np.sqrt(400 * 0.3 * 0.7)
    steps = [NAMES.index(m.taken_for) - NAMES.index(m.segment.action) for m in mistakes]
    assert set(steps) == {-1, 1}
    assert abs(sum(steps)) < 3 * np.sqrt(len(mistakes))
    # At the ends of the recording there is one neighbour, and it has the whole chance.
    certain = Coder("Ada", short=1.5, neighbour=1.0)
    (pair,) = code_row(row(("still", 1.0), ("grab", 2.0)), certain).mistakes
    assert pair == Mistake(Segment(0.0, 1.0, "still"), "grab")
    assert not code_row(row(("still", 1.0)), certain).mistakes


def test_what_is_not_overlooked_is_taken_for_a_neighbour_as_often_as_ever():
    mistakes = code_row(MANY, Coder("Ada", short=1.5, overlooked=0.5, neighbour=0.4)).mistakes
    taken = sum(mistake.taken_for is not None for mistake in mistakes)
    assert abs(taken - 400 * 0.5 * 0.4) < 3 * np.sqrt(400 * 0.2 * 0.8)


def test_an_action_is_confused_as_often_as_the_habit_says():
    actions = row(*((("grab", "pull")[number % 2], 1.0) for number in range(800)))
    coder = Coder(
        "Ada", confusions=(Confusion("grab", "hold", 0.2), Confusion("grab", "pull", 0.1))
    )
    mistakes = code_row(actions, coder).mistakes
    assert {mistake.segment.action for mistake in mistakes} == {"grab"}
    for name, share in (("hold", 0.2), ("pull", 0.1)):
        taken = sum(mistake.taken_for == name for mistake in mistakes)
        assert abs(taken - 400 * share) < 3 * np.sqrt(400 * share * (1 - share))


@pytest.mark.parametrize(
    ("conditions", "mistaken"),
    [
        ({}, [1, 3, 5]),
        ({"after": "insert"}, [3, 5]),
        ({"before": "release"}, [5]),
        ({"after": "grab", "before": "insert"}, [1]),
        ({"shorter": 0.5}, [3, 5]),
        ({"shorter": 0.25}, []),
        ({"after": "pull"}, []),
    ],
)
def test_a_habit_holds_only_where_it_fits(conditions, mistaken):
    actions = row(
        ("grab", 1.0),
        ("hold", 0.5),
        ("insert", 1.0),
        ("hold", 0.25),
        ("insert", 1.0),
        ("hold", 0.375),
        ("release", 1.0),
    )
    coder = Coder("Ada", confusions=(Confusion("hold", "search", 1.0, **conditions),))
    coded = code_row(actions, coder)
    assert coded.mistakes == tuple(Mistake(actions[number], "search") for number in mistaken)


def test_an_action_overlooked_between_two_alike_leaves_them_two():
    actions = row(("twist", 1.0), ("hold", 0.2), ("twist", 1.0))
    coded = code_row(actions, Coder("Ada", short=0.5, overlooked=1.0))
    assert coded.track.segments == (actions[0], actions[2])


# The two coders of the sample project.


def codings(task, seeds=25):
    """Performances of a task, each with what every coder made of it."""
    for seed in range(seeds):
        done = performed(task, seed)
        yield done, [code(done, c, np.random.default_rng([seed, n])) for n, c in enumerate(CODERS)]


@pytest.mark.parametrize("task", CHOREOGRAPHIES)
def test_the_two_coders_agree_as_people_do(task):
    counts, bare = [], []
    for done, coded in codings(task):
        times = np.arange(0, done.actions[-1].end, 0.01)
        names = sorted({action.action for action in done.actions})
        first, second = (to_codes(coding.track.segments, times, names) for coding in coded)
        counts.append(count(first, second, times, names))
        bare.append([np.mean(first < 0), np.mean(second < 0)])
    scores = pool(task, counts)
    assert 0.80 < scores.accuracy < 0.93
    assert 0.75 < scores.kappa < 0.92
    shares = np.mean(bare, axis=0)
    assert shares.min() > 0.045
    assert shares.max() < 0.12


@pytest.mark.parametrize(
    ("task", "confused"),
    [
        ("LEGO", {("search", "insert"), ("hold", "insert")}),
        ("stylus", {("grab", "pull"), ("slip", "slip transition"), ("slip transition", "slip")}),
        ("marker", {("hold", "twist"), ("twist", "hold")}),
    ],
)
def test_the_coders_have_the_habits_of_people_in_each_task(task, confused):
    coded = [coding for _, both in codings(task, 60) for coding in both]
    mistakes = [mistake for coding in coded for mistake in coding.mistakes]
    assert confused <= {(mistake.segment.action, mistake.taken_for) for mistake in mistakes}
    assert None in {mistake.taken_for for mistake in mistakes}
    # Most of what they say is right.
    assert len(mistakes) < 0.08 * sum(len(coding.track.segments) for coding in coded)


def test_the_two_coders_differ_and_neither_is_the_truth():
    assert [coder.name for coder in CODERS] == ["Ines", "Tomas"]
    late = [[], []]
    for done, coded in codings("foam", 60):
        for mine, coding in zip(late, coded, strict=True):
            holds = [s.start for s in coding.track.segments if s.action == "hold"]
            mine += [start - done.actions[2].start for start in holds]
    ines, tomas = map(np.mean, late)
    assert 0 < ines < tomas < 0.2
