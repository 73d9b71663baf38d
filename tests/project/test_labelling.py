"""Labelling: each verb is one stored edit with a line of history."""

import pytest
from factories import stored_track

from forcelab.errors import InputError, StaleTrackError
from forcelab.labels import Segment
from forcelab.project import Project
from forcelab.project.track_editor import TrackEditor


def test_every_verb_is_in_the_store_with_a_line_people_can_read(labelling):
    steps = [
        (lambda: labelling.paint(1.25, 1.73, "grab"), "grab 1.250-1.730 s painted"),
        (lambda: labelling.move_segment(0, 1.244), "grab 1.250-1.730 s moved to 1.244"),
        (lambda: labelling.move_edge(0, "end", 2.0), "end of grab 1.244-1.724 s moved to 2.000"),
        (lambda: labelling.relabel(0, "hold"), "hold"),
        (lambda: labelling.split(1.5), "hold 1.244-2.000 s split at 1.500"),
        (lambda: labelling.merge(0, 1), "2 segments merged into hold 1.244-2.000 s"),
        (lambda: labelling.erase(1.4, 1.6), "1.400-1.600 s made unlabelled"),
        (lambda: labelling.fill_gaps(0.5), "gaps up to 0.5 s filled"),
        (lambda: labelling.delete(0), "hold 1.244-2.000 s deleted"),
    ]
    for verb, what in steps:
        assert verb().what.endswith(what)
        assert stored_track(labelling) == labelling.segments
    assert labelling.segments == ()
    while labelling.undo():
        assert stored_track(labelling) == labelling.segments
    assert [edit.kind for edit in labelling.history()].count("undo") == len(steps)


def test_what_changes_nothing_is_no_edit(labelling):
    labelling.paint(1, 2, "grab")
    assert labelling.paint(1.2, 1.8, "grab") is None
    assert labelling.relabel(0, "grab") is None
    assert labelling.erase(5, 6) is None
    assert len(labelling.history()) == 1


def test_a_track_changed_elsewhere_is_not_written_over(labelling):
    labelling.paint(1, 2, "grab")
    with Project.open(labelling.project.path) as project:
        TrackEditor(project, labelling.demonstration, "Ada").paint(3, 4, "hold")
    with pytest.raises(StaleTrackError):
        labelling.erase(0, 9)
    assert len(stored_track(labelling)) == 2
    assert labelling.refresh()
    labelling.erase(0, 9)
    assert stored_track(labelling) == ()


def test_copying_cuts_at_the_stretch_and_takes_the_unlabelled_too(labelling):
    other = TrackEditor(labelling.project, labelling.demonstration, "Ben")
    other.paint(1, 2, "grab")
    other.paint(2, 3, "hold")
    other.split(1.6)
    labelling.paint(0, 5, "still")
    labelling.copy_from("Ben", 1.5, 4)
    assert labelling.segments == (
        Segment(0, 1.5, "still"),
        Segment(1.5, 1.6, "grab"),
        Segment(1.6, 2, "grab"),
        Segment(2, 3, "hold"),
        Segment(4, 5, "still"),
    )


def test_gaps_are_filled_within_a_stretch_only(labelling):
    for start in (0, 1, 2, 3):
        labelling.paint(start, start + 0.9, "grab")
    labelling.fill_gaps(0.2, within=(1.5, 2.5))
    edges = [(s.start, round(s.end, 9)) for s in labelling.segments]
    assert edges == [(0, 0.9), (1, 2.9), (3, 3.9)]


@pytest.mark.parametrize("verb", ["delete", "relabel", "move_segment"])
def test_a_segment_that_is_not_there_is_refused(labelling, verb):
    argument = {"delete": (), "relabel": ("grab",), "move_segment": (1.0,)}[verb]
    with pytest.raises(InputError, match="no segment 3"):
        getattr(labelling, verb)(3, *argument)
    assert labelling.history() == ()
