"""Origins: which of a coder's segments were proposed, and by whom, whatever was done since."""

from __future__ import annotations

import json
import sqlite3
import time
from contextlib import closing

import pytest
from factories import quiet_demonstration, track_editor_in_memory
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.labels import Segment
from forcelab.project import Origin, Project

ONE, TWO = "model paper 1", "model paper 2"
GRAB, HOLD, SLIP = Segment(1, 2, "grab"), Segment(2, 3, "hold"), Segment(5, 6, "slip")


def origins(labelling):
    """The origins as this project follows them, which must be those of one that reads afresh."""
    found = labelling.project.tracks.origins(labelling.demonstration, "Ada")
    with Project.open(labelling.project.path) as other:
        assert other.tracks.origins(labelling.demonstration, "Ada") == found
    assert set(found) <= set(labelling.segments)
    return dict(found)


def test_what_was_accepted_is_proposed_and_what_was_painted_is_not(labelling):
    assert origins(labelling) == {}
    labelling.paint(0, 2.5, "hold")
    assert origins(labelling) == {}
    labelling.accept((GRAB,), ONE)
    # What is left of the hold on either side is as human as it was.
    assert len(labelling.segments) == 3
    assert origins(labelling) == {GRAB: Origin(ONE)}
    labelling.accept((SLIP,), TWO)
    labelling.paint(7, 8, "slip")
    assert origins(labelling) == {GRAB: Origin(ONE), SLIP: Origin(TWO)}
    assert labelling.project.tracks.origins(labelling.demonstration, "Bert") == {}


def test_what_was_removed_and_imported_again_begins_without_its_old_origins(labelling):
    project = labelling.project
    for proposer in (ONE, TWO):
        labelling.accept((GRAB,), proposer)
        assert origins(labelling) == {GRAB: Origin(proposer)}
        heads = {"Ada": project.tracks.head(labelling.demonstration, "Ada")}
        project.demonstrations.remove_all({labelling.demonstration: heads})
        assert project.demonstrations.add(quiet_demonstration()).id == labelling.demonstration
        labelling.refresh()
        assert origins(labelling) == {}
    labelling.paint(GRAB.start, GRAB.end, GRAB.action)
    assert origins(labelling) == {}
    with pytest.raises(InputError, match="no demonstration"):
        labelling.project.tracks.origins("f00", "Ada")


CHANGES = [
    (
        lambda t: t.move_edge(0, "end", 1.5),
        {Segment(1, 1.5, "grab"): True, Segment(1.5, 3, "hold"): True},
    ),
    (lambda t: t.move_edge(0, "end", 2.5), None),
    (lambda t: t.split(1.5), None),
    (lambda t: t.merge(0, 1), {Segment(1, 3, "grab"): True}),
    (lambda t: t.relabel(0, "pull"), {HOLD: False}),
    (lambda t: t.delete(0), {HOLD: False}),
    (lambda t: t.erase(1.2, 1.4), None),
    (lambda t: t.paint(1.2, 1.4, "pull"), None),
    (lambda t: t.paint(0, 1.4, "grab"), {Segment(0, 2, "grab"): True, HOLD: False}),
    (lambda t: t.paint(0, 9, "pull"), {}),
    (lambda t: t.move_segment(0, 0.5), {Segment(0.5, 1.5, "grab"): True, HOLD: False}),
    (lambda t: t.move_segment(0, 8), {HOLD: False}),
    (lambda t: t.accept((Segment(1.5, 4, "slip"),), TWO), None),
]


@pytest.mark.parametrize(("change", "expected"), CHANGES)
def test_a_segment_that_is_changed_by_hand_stays_proposed_and_undoing_mends_it(
    labelling, change, expected
):
    labelling.accept((GRAB, HOLD), ONE)
    before = origins(labelling)
    assert before == {GRAB: Origin(ONE), HOLD: Origin(ONE)}
    change(labelling)
    after = origins(labelling)
    if expected is not None:
        assert after == {segment: Origin(ONE, changed) for segment, changed in expected.items()}
    labelling.undo()
    assert origins(labelling) == before
    labelling.redo()
    assert origins(labelling) == after
    labelling.undo()
    labelling.undo()
    assert origins(labelling) == {}


def test_both_parts_of_a_segment_are_proposed_and_changed(labelling):
    labelling.accept((GRAB,), ONE)
    labelling.paint(1.2, 1.4, "pull")
    parts = (Segment(1, 1.2, "grab"), Segment(1.4, 2, "grab"))
    assert origins(labelling) == {part: Origin(ONE, True) for part in parts}
    labelling.paint(1.2, 1.4, "grab")
    assert origins(labelling) == {GRAB: Origin(ONE, True)}


def test_a_segment_that_gets_another_action_is_human_from_then_on(labelling):
    labelling.accept((GRAB,), ONE)
    labelling.relabel(0, "pull")
    labelling.relabel(0, "grab")
    assert labelling.segments == (GRAB,)
    assert origins(labelling) == {}


def test_what_the_coder_had_painted_before_stays_the_coders(labelling):
    labelling.paint(1, 2, "grab")
    labelling.accept((GRAB, HOLD), ONE)
    assert origins(labelling) == {HOLD: Origin(ONE)}


def test_the_latest_proposer_counts_and_leaves_rests_to_the_first(labelling):
    labelling.accept((Segment(0, 4, "hold"),), ONE)
    labelling.accept((GRAB,), TWO)
    assert origins(labelling) == {
        Segment(0, 1, "hold"): Origin(ONE, True),
        GRAB: Origin(TWO),
        Segment(2, 4, "hold"): Origin(ONE, True),
    }


def test_what_was_told_stays_as_it_was_told(labelling):
    labelling.accept((GRAB, HOLD), ONE)
    found = labelling.project.tracks.origins(labelling.demonstration, "Ada")
    labelling.delete(0)
    assert list(found) == [GRAB, HOLD]
    with pytest.raises(TypeError):
        found[SLIP] = Origin(ONE)  # type: ignore[index]
    labelling.paint(7, 8, "pull")
    again = labelling.project.tracks.origins(labelling.demonstration, "Ada")
    labelling.paint(8.5, 9.5, "pull")
    assert labelling.project.tracks.origins(labelling.demonstration, "Ada") is again


verbs = st.tuples(
    st.sampled_from(["paint", "erase", "accept", "fill", "edge", "relabel", "undo", "redo", "ask"]),
    st.integers(0, 80),
    st.integers(1, 25),
    st.sampled_from(["grab", "hold"]),
    st.sampled_from([ONE, TWO]),
)


@settings(max_examples=25, deadline=None)
@given(st.lists(verbs, max_size=30))
def test_whatever_is_done_origins_follow_the_labels(deeds):
    with track_editor_in_memory() as labelling:
        project = labelling.project
        # Each state as it was, by what can be undone: what is taken back must be as before.
        past, future = [({}, ())], []
        for verb, at, length, action, proposer in deeds:
            start, end = at / 10, (at + length) / 10
            before = labelling.segments
            edit = None
            if verb == "paint":
                edit = labelling.paint(start, end, action)
            elif verb == "erase":
                edit = labelling.erase(start, end)
            elif verb == "accept":
                edit = labelling.accept((Segment(start, end, action),), proposer)
                if edit:
                    # All of the proposed time is proposed, or was there already.
                    found = project.tracks.origins(labelling.demonstration, "Ada")
                    new = [s for s in labelling.segments if s not in before and s.action == action]
                    assert any(found.get(s) == Origin(proposer) for s in new)
            elif verb == "fill":
                edit = labelling.fill_gaps(length / 10)
            elif verb == "edge" and before:
                segment = before[at % len(before)]
                edit = labelling.move_edge(at % len(before), "end", segment.start + length / 10)
            elif verb == "relabel" and before:
                edit = labelling.relabel(at % len(before), action)
            elif verb == "undo" and labelling.undo():
                future.append(past.pop())
                assert (origins(labelling), labelling.segments) == past[-1]
            elif verb == "redo" and labelling.redo():
                past.append(future.pop())
                assert (origins(labelling), labelling.segments) == past[-1]
            elif verb == "ask":
                origins(labelling)
            if edit is not None:
                found = project.tracks.origins(labelling.demonstration, "Ada")
                past.append((dict(found), labelling.segments))
                future.clear()


def test_long_histories_are_followed_quickly_and_once(labelling):
    project, id_ = labelling.project, labelling.demonstration
    labelling.accept((Segment(0, 0.5, "grab"),), ONE)
    rows = []
    for number in range(1, 10_000):  # every other edit moves an edge of what was accepted before it
        start = number // 2
        old = [[start, start + 0.5, "grab"]] if number % 2 == 0 else []
        new = [start + 0.6, start + 0.9, "hold"] if number % 2 else [start, start + 0.4, "grab"]
        proposer = ONE if number % 2 else None
        rows.append((number + 1, json.dumps(old), json.dumps([new]), proposer))
    with closing(sqlite3.connect(project.path / "project.sqlite")) as store, store:
        store.executemany(
            "INSERT INTO edit (track, kind, time, what, position, id, removed, inserted, "
            "proposed_by) VALUES (1, 'paint', '', '', 0, ?, ?, ?, ?)",
            rows,
        )
    took, again = [], []
    for _ in range(2):
        with Project.open(project.path) as fresh:
            began = time.process_time()
            found = fresh.tracks.origins(id_, "Ada")
            took.append(time.process_time() - began)
            assert len(found) == 5001
            began = time.process_time()
            assert fresh.tracks.origins(id_, "Ada") is found
            again.append(time.process_time() - began)
    assert min(took) < 0.3
    assert min(again) < 0.01
