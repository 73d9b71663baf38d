"""A consensus is decided step by step, stored at each, and survives undo and restart."""

import pytest
from factories import action_at, foam_demonstration, folder_in_memory, make_track
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.labels import Segment
from forcelab.project import Project
from forcelab.review.consensus import Consensus
from forcelab.review.differences import Difference, coder_differences
from forcelab.segment_edits import SLIVER

ID = foam_demonstration().id
#: They differ in an edge, a whole action, and in whether the last of it is labelled.
ANN = make_track((0, 1, "grab"), (1, 3, "hold"), (3, 4, "pull"), (4, 5, "hold"), (6, 7, "release"))
BEN = make_track((0, 1.06, "grab"), (1.06, 3, "hold"), (3, 4, "slip"), (4, 5, "hold"))
EDGE, ACTION, LAST = (
    Difference(ID, 1, 1.06, "hold", "grab", kind="boundary"),
    Difference(ID, 3, 4, "pull", "slip", kind="action"),
    Difference(ID, 6, 7, "release", None, kind="missed"),
)


@pytest.fixture
def project():
    with (
        folder_in_memory() as folder,
        Project.create(folder / "p.forcelab") as project,
    ):
        id_ = project.demonstrations.add(foam_demonstration()).id
        project.tracks.edit(id_, "Ann", (), ANN, "made")
        project.tracks.edit(id_, "Ben", (), BEN, "made")
        project.id_ = id_
        yield project


def rows(segments):
    return [(round(s.start, 9), round(s.end, 9), s.action) for s in segments]


def begun(project):
    consensus = Consensus(project, project.id_, "Ann", "Ben")
    consensus.begin()
    return consensus


def test_what_both_say_is_taken_and_the_rest_waits(project):
    consensus = Consensus(project, project.id_, "Ann", "Ben")
    assert not consensus.begun
    assert consensus.differences == (EDGE, ACTION, LAST)
    consensus.begin()
    assert consensus.begun
    assert rows(consensus.segments) == [(0, 1, "grab"), (1.06, 3, "hold"), (4, 5, "hold")]
    assert consensus.undecided == (EDGE, ACTION, LAST)
    assert consensus.begin() is None


def test_every_kind_of_decision(project):
    consensus = begun(project)
    consensus.mean(EDGE)
    assert rows(consensus.segments)[:2] == [(0, 1.03, "grab"), (1.03, 3, "hold")]
    consensus.take(ACTION, "b")
    assert consensus.undecided == (LAST,)
    consensus.take(LAST, "a")
    assert consensus.undecided == ()
    assert rows(consensus.segments) == [
        (0, 1.03, "grab"),
        (1.03, 3, "hold"),
        (3, 4, "slip"),
        (4, 5, "hold"),
        (6, 7, "release"),
    ]
    consensus.put(ACTION, "search")
    assert (3, 4, "search") in rows(consensus.segments)
    assert "search 3.000-4.000 s" in project.tracks.history(project.id_, "consensus")[-1].what
    consensus.take(EDGE, "a")
    assert rows(consensus.segments)[:2] == [(0, 1, "grab"), (1, 3, "hold")]
    with pytest.raises(InputError, match="actions differ"):
        consensus.mean(ACTION)


def test_unlabelled_is_a_decision_that_is_undone_and_redone(project):
    consensus = begun(project)
    before = consensus.segments
    assert consensus.leave(ACTION) is not None
    assert consensus.segments == before
    assert consensus.take(LAST, "b") is not None  # Ben has nothing there
    assert consensus.undecided == (EDGE,)
    assert consensus.leave(ACTION) is None
    consensus.undo()
    assert consensus.undecided == (EDGE, LAST)
    consensus.undo()
    assert consensus.undecided == (EDGE, ACTION, LAST)
    assert consensus.can_undo
    assert consensus.can_redo
    consensus.redo()
    assert consensus.undecided == (EDGE, LAST)
    consensus.undo()
    consensus.take(ACTION, "a")
    assert not consensus.can_redo  # it was decided otherwise since
    consensus.leave(ACTION)
    assert ACTION not in consensus.undecided
    assert consensus.segments == before


def test_partial_work_survives_a_restart_and_undo_reaches_back(project):
    begun(project).leave(ACTION)
    with Project.open(project.path) as again:
        consensus = Consensus(again, project.id_, "Ann", "Ben")
        assert consensus.undecided == (EDGE, LAST)
        consensus.undo()
        assert consensus.undecided == (EDGE, ACTION, LAST)
        consensus.undo()
        assert consensus.segments == ()
        assert not consensus.begun
        assert not consensus.can_undo


def test_edges_close_to_each_other_are_set_at_once_and_undone_at_once(project):
    consensus = begun(project)
    assert consensus.mean_all(0.05) is None
    assert consensus.mean_all().what == "1 edge up to 100 ms apart set to the mean"
    assert consensus.undecided == (ACTION, LAST)
    consensus.undo()
    assert consensus.undecided == (EDGE, ACTION, LAST)


def test_a_difference_that_a_coder_makes_later_is_open(project):
    consensus = begun(project)
    consensus.mean_all()
    consensus.take(ACTION, "a")
    consensus.leave(LAST)
    project.tracks.edit(project.id_, "Ann", ANN, (*ANN, Segment(8, 9, "grab")), "added")
    consensus.refresh()
    assert consensus.undecided == (Difference(project.id_, 8, 9, "grab", None, kind="missed"),)
    project.tracks.edit(project.id_, "Ben", BEN, (*BEN, Segment(8, 9, "grab")), "added")
    consensus.refresh()
    assert consensus.undecided == ()
    consensus.begin()
    assert (8, 9, "grab") in rows(consensus.segments)


def test_an_edge_beside_unlabelled_time_is_one(project):
    a = make_track((0, 1, "grab"), (2, 3, "hold"))
    b = make_track((0.1, 1.1, "grab"), (2, 2.9, "hold"))
    assert [(d.start, d.kind == "boundary") for d in coder_differences("d", a, b)] == [
        (0, True),
        (1, True),
        (2.9, True),
    ]
    # One coder has a segment that the other has not at all: no edge.
    assert [d.kind == "boundary" for d in coder_differences("d", a, a[:1])] == [False]


def test_three_different_authors_with_labels_are_needed(project):
    with pytest.raises(InputError, match="third name"):
        Consensus(project, project.id_, "Ann", "Ben", "Ann")
    with pytest.raises(InputError, match="'Cleo' labelled nothing"):
        Consensus(project, project.id_, "Ann", "Cleo")


@st.composite
def tracks(draw):
    edges = sorted(draw(st.sets(st.integers(0, 100), min_size=2, max_size=8)))
    names = draw(st.lists(st.sampled_from(["grab", "hold", None]), min_size=8, max_size=8))
    rows = zip(edges, edges[1:], names, strict=False)
    return tuple(Segment(s / 10, e / 10, name) for s, e, name in rows if name)


@settings(max_examples=40, deadline=None)
@given(tracks(), tracks())
def test_differences_are_exactly_where_two_tracks_differ(a, b):
    found = coder_differences("d", a, b)

    for tenth in range(100):
        time = tenth / 10 + 0.05
        here = [d for d in found if d.start <= time < d.end]
        expected = (action_at(a, time), action_at(b, time))
        assert [(d.human, d.predicted) for d in here] == (
            [expected] if expected[0] != expected[1] else []
        )
    assert all(d.duration > SLIVER for d in found)
    mirrored = [
        (d.start, d.end, d.predicted, d.human, d.kind == "boundary")
        for d in coder_differences("d", b, a)
    ]
    assert mirrored == [(d.start, d.end, d.human, d.predicted, d.kind == "boundary") for d in found]
