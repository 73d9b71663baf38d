from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from forcelab.recognition.metrics import Events, Tally, event_errors, overlay

ACTIONS = ["a", "b", "c"]
ERRORS = ("insertion", "deletion", "fragmentation", "merge", "overfill", "underfill")


def of(human: str, predicted: str, times: np.ndarray | None = None) -> Events:
    """Errors of two tracks written one letter a sample (1 s), dots being unlabelled."""
    codes = [np.array(["abc".find(c) for c in text], dtype=np.int64) for text in (human, predicted)]
    stamps = np.arange(len(human), dtype=float) if times is None else times
    return event_errors(overlay(*codes, stamps, ACTIONS))


def errors(events: Events) -> dict[str, tuple[int, float]]:
    """The kinds of error that occur, as (count, seconds)."""
    found = {kind: getattr(events, kind) for kind in ERRORS}
    return {kind: (t.count, t.seconds) for kind, t in found.items() if t != Tally()}


# In these b is what surrounds the events of a, and is itself judged just as a is.


def test_an_event_that_is_not_there_is_an_insertion():
    # For b the inserted stretch is one missed in the middle.
    assert errors(of("bbbbbbbb", "bbbaabbb")) == {
        "insertion": (1, 2.0),
        "fragmentation": (1, 2.0),
    }


def test_an_event_that_is_missed_is_a_deletion():
    assert errors(of("bbbaabbb", "bbbbbbbb")) == {"deletion": (1, 2.0), "merge": (1, 2.0)}


def test_an_event_predicted_as_unlabelled_is_a_deletion_and_nothing_else():
    assert errors(of("bbbaabbb", "bbb..bbb")) == {"deletion": (1, 2.0)}


def test_an_event_in_pieces_is_fragmented_once_however_many_pieces():
    assert errors(of("aaaaaaaa", "a.aa.a.a")) == {"fragmentation": (1, 3.0)}


def test_events_run_together_are_merged_once_however_many_events():
    assert errors(of("abacabaa", "aaaaaaaa"))["merge"] == (1, 3.0)


def test_an_event_that_is_too_long_overfills_and_its_neighbour_underfills():
    assert errors(of("bbbbaaaa", "bbaaaaaa")) == {"overfill": (1, 2.0), "underfill": (1, 2.0)}


def test_an_event_that_is_short_at_both_ends_underfills_twice():
    assert errors(of("aaaaaaaa", ".aaaaa..")) == {"underfill": (2, 3.0)}


def test_a_wrong_name_is_a_deletion_of_the_one_and_an_insertion_of_the_other():
    assert errors(of("bbaabb", "bbccbb")) == {"deletion": (1, 2.0), "insertion": (1, 2.0)}


def test_false_time_under_two_human_actions_is_one_stretch():
    # a is false over c and b alike: one overfill of 3 s, not an overfill and an insertion.
    assert errors(of("aaccb", "aaaaa"))["overfill"] == (1, 3.0)


def test_no_event_reaches_across_unlabelled_human_time():
    found = of("aaa..bba", "aaaaaaaa")
    assert errors(found)["overfill"] == (1, 2.0)
    assert "merge" not in errors(found)
    assert found.human == Tally(3, 6.0)


def test_no_event_reaches_across_a_gap_in_the_stamps():
    times = np.concatenate([np.arange(4.0), np.arange(4.0) + 60])
    found = of("aabbbbaa", "aaaaaaaa", times)
    assert errors(found)["overfill"] == (2, 4.0)
    assert "merge" not in errors(found)
    assert found.human.seconds == 8.0


def test_a_fragmented_and_a_merged_event_at_once():
    # The paper's hard case: the first human event is in pieces, and its last piece runs into the
    # second human event.
    found = of("aaaaaabbaa", "aa.aaaaaaa")
    assert errors(found)["fragmentation"] == (1, 1.0)
    assert errors(found)["merge"] == (1, 2.0)


def test_errors_of_two_demonstrations_add_up():
    assert Events(human=Tally(2, 1.5), merge=Tally(1, 0.5)) + Events(
        human=Tally(1, 1.0), overfill=Tally(3, 0.25)
    ) == Events(human=Tally(3, 2.5), merge=Tally(1, 0.5), overfill=Tally(3, 0.25))


@st.composite
def tracks(draw):
    n = draw(st.integers(0, 40))

    def text() -> str:
        line = ""
        while len(line) < n:
            line += draw(st.sampled_from("abc.")) * draw(st.integers(1, 7))
        return line[:n]

    steps = np.ones(n)
    for place in draw(st.lists(st.integers(1, max(n, 1)), max_size=2)):
        steps[place - 1 : place] = 20.0
    return text(), text(), np.cumsum(steps)


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

        truth, said = events(0), events(1)
        for mine, theirs, none, several, edge in (
            (truth, said, "deletion", "fragmentation", "underfill"),
            (said, truth, "insertion", "merge", "overfill"),
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


@settings(max_examples=250, deadline=None)
@given(tracks())
def test_every_error_is_what_the_definitions_say_event_by_event(track):
    human, predicted, times = track
    assume(len(human) < 2 or np.median(np.diff(times)) == 1.0)
    assert errors(of(human, predicted, times)) == by_hand(human, predicted, times)


@settings(max_examples=100, deadline=None)
@given(tracks())
def test_errors_and_right_time_account_for_all_labelled_time(track):
    human, predicted, times = track
    found = of(human, predicted, times)
    period = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
    lasts = np.minimum(np.diff(times, append=times[-1:] + period), 5 * period)
    lasts = np.where(lasts == 5 * period, period, lasts)

    def length(chosen: list[bool]) -> float:
        return float(lasts[np.array(chosen, dtype=bool)].sum())

    both = list(zip(human, predicted, strict=True))
    right = length([h == p != "." for h, p in both])
    labelled = length([h != "." for h, _ in both])
    said = length([h != "." and p != "." for h, p in both])
    assert found.human.seconds == pytest.approx(labelled)
    assert found.predicted.seconds == pytest.approx(said)
    missed = [found.deletion, found.fragmentation, found.underfill]
    false = [found.insertion, found.merge, found.overfill]
    assert right + sum(t.seconds for t in missed) == pytest.approx(labelled)
    assert right + sum(t.seconds for t in false) == pytest.approx(said)
