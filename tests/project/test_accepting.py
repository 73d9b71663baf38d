"""Accepting predictions: one stored edit, painted as if by hand, that tells who proposed it."""

from __future__ import annotations

from functools import reduce
from itertools import pairwise

import pytest
from factories import action_at, stored_track
from hypothesis import given
from hypothesis import strategies as st

from forcelab.errors import ForcelabError, InputError
from forcelab.labels import Segment
from forcelab.project.database import Database
from forcelab.project.track_editor import TrackEditor
from forcelab.segment_edits import free_parts, paint, paint_all

MODEL = "model paper 12"
ACTIONS = ("grab", "hold", "slip")


@st.composite
def tracks(draw):
    """Segments on whole tenths of a second, so that many of them touch."""
    edges = sorted(draw(st.sets(st.integers(0, 40), max_size=16)))
    picked = [
        Segment(start / 10, end / 10, draw(st.sampled_from(ACTIONS)))
        for start, end in pairwise(edges)
        if draw(st.booleans())
    ]
    return tuple(picked)


@given(tracks(), tracks())
def test_painting_all_at_once_is_painting_one_after_the_other(track, proposed):
    after, painted = paint_all(track, proposed)
    assert after == reduce(lambda t, s: paint(t, s.start, s.end, s.action), proposed, track)
    assert set(painted) <= set(proposed)
    assert reduce(lambda t, s: paint(t, s.start, s.end, s.action), painted, track) == after
    assert paint_all(after, proposed) == (after, ())


@given(tracks(), tracks())
def test_free_parts_are_all_that_is_proposed_where_nothing_is(track, proposed):
    parts = free_parts(track, proposed)
    for time in (tenth / 10 + 0.05 for tenth in range(41)):
        expected = action_at(proposed, time) if action_at(track, time) is None else None
        assert action_at(parts, time) == expected
    assert all(part.duration > 0.05 for part in parts)


def test_accepting_is_one_edit_that_tells_who_proposed_it(labelling):
    labelling.paint(0, 2, "hold")
    proposed = (Segment(1.25, 1.73, "grab"), Segment(3.0, 3.5, "slip"))
    edit = labelling.accept(proposed, MODEL)
    assert edit == labelling.history()[-1]
    assert (edit.kind, edit.author, edit.proposed_by) == ("paint", "Ada", MODEL)
    assert edit.what == ("grab 1.250-1.730 s, slip 3.000-3.500 s accepted from model paper 12")
    around = (Segment(0, 1.25, "hold"), proposed[0], Segment(1.73, 2, "hold"), proposed[1])
    assert labelling.segments == stored_track(labelling) == around
    assert labelling.accept(proposed, MODEL) is None
    assert labelling.accept((), MODEL) is None
    undone = labelling.undo()
    assert stored_track(labelling) == (Segment(0, 2, "hold"),)
    assert undone.proposed_by is None
    labelling.redo()
    assert stored_track(labelling) == around


def test_many_predictions_make_a_short_line(labelling):
    many = tuple(Segment(i / 4, i / 4 + 0.125, "grab") for i in range(40))
    assert labelling.accept(many[2:3], MODEL).what == (
        "grab 0.500-0.625 s accepted from model paper 12"
    )
    assert labelling.accept(many, MODEL).what == (
        "grab 0.000-0.125 s, grab 0.250-0.375 s, grab 0.750-0.875 s and 36 more accepted from "
        "model paper 12"
    )


def test_what_is_there_stays_where_it_is_not_to_be_replaced(labelling):
    labelling.paint(1, 2, "hold")
    edit = labelling.accept((Segment(0.5, 3.0, "grab"),), MODEL, replace=False)
    assert edit.what.startswith("grab 0.500-1.000 s, grab 2.000-3.000 s accepted from ")
    assert [s.action for s in stored_track(labelling)] == ["grab", "hold", "grab"]
    assert labelling.accept((Segment(1.2, 2.5, "slip"),), MODEL, replace=False) is None


@pytest.mark.parametrize("replace", [True, False])
def test_what_cannot_be_accepted_leaves_nothing(labelling, replace):
    good = (Segment(0.0, 1.0, "grab"),)
    for author, proposer, segments, sentence in (
        ("model x", MODEL, good, "'model x' is a model's name"),
        ("Ada", "Bert", good, "'Bert' is no model that proposes"),
        ("Ada", " ", good, "' ' is no model"),
        ("Ada", MODEL, (*good, Segment(0.5, 2.0, "hold")), "overlap"),
    ):
        with pytest.raises(InputError, match=sentence):
            TrackEditor(labelling.project, labelling.demonstration, author).accept(
                segments, proposer, replace
            )
    assert labelling.project.coding.authors() == ()
    with pytest.raises(InputError, match="no model that proposes"):
        labelling.project.tracks.edit(
            labelling.demonstration, "mlp", (), good, "p", kind="predict", proposed_by=MODEL
        )


def test_an_author_who_predicted_may_propose_whatever_the_name(labelling):
    proposed = (Segment(0.0, 1.0, "grab"),)
    labelling.project.tracks.edit(labelling.demonstration, "mlp", (), proposed, "p", kind="predict")
    assert labelling.accept(proposed, "mlp").proposed_by == "mlp"
    with pytest.raises(InputError, match="'mlp' is a model in this project"):
        TrackEditor(labelling.project, labelling.demonstration, "mlp").accept(
            (Segment(2.0, 3.0, "grab"),), MODEL
        )


@pytest.mark.parametrize("statement", [1, 4, 7, 10])
def test_a_failure_in_the_middle_of_accepting_leaves_nothing(labelling, monkeypatch, statement):
    labelling.paint(0, 5, "hold")
    before, count = labelling.segments, 0
    execute = Database.execute

    def failing(self, sql, *values):
        nonlocal count
        count += sql.startswith(("INSERT", "DELETE"))
        if count == statement:
            raise ForcelabError("the disk is gone")
        return execute(self, sql, *values)

    proposed = tuple(Segment(i + 0.2, i + 0.6, "grab") for i in range(4))
    monkeypatch.setattr(Database, "execute", failing)
    with pytest.raises(ForcelabError, match="disk is gone"):
        labelling.accept(proposed, MODEL)
    assert count == statement
    monkeypatch.undo()
    assert labelling.segments == stored_track(labelling) == before
    assert labelling.project.tracks.origins(labelling.demonstration, "Ada") == {}
    assert len(labelling.history()) == 1
    assert labelling.accept(proposed, MODEL) is not None
    assert len(stored_track(labelling)) == 9
    assert list(labelling.project.tracks.origins(labelling.demonstration, "Ada")) == list(proposed)
