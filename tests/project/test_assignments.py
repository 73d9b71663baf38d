from __future__ import annotations

import subprocess
import sys
from datetime import datetime, timedelta, timezone

import pytest

from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import AssignmentEvent, Project

HOLD = (Segment(0.0, 0.1, "grab"), Segment(0.2, 0.3, "hold"))


def kinds(project: Project) -> list[str]:
    return [event.kind for event in project.coding.assignment_events()]


def test_a_coder_is_blind_from_the_assignment_until_it_is_done(project, id_, path):
    before = datetime.now(timezone.utc)
    assert project.coding.assignments() == ()
    assert not project.coding.is_blind(id_, "anna")
    item = project.coding.assign(id_, "anna")
    assert (item.demonstration, item.author, item.blind, item.done) == (id_, "anna", True, None)
    assert before <= item.assigned <= datetime.now(timezone.utc)
    with Project.open(path) as again:
        assert again.coding.assignments() == (item,)
        assert again.coding.is_blind(id_, "anna")
        assert not again.coding.is_blind(id_, "bert")
    done = project.coding.set_done(id_, "anna")
    assert done.done is not None
    assert done.done >= done.assigned == item.assigned
    assert not project.coding.is_blind(id_, "anna")
    assert project.coding.set_done(id_, "anna", done=False) == item
    assert project.coding.is_blind(id_, "anna")
    project.coding.unassign(id_, "anna")
    assert project.coding.assignments() == ()
    assert not project.coding.is_blind(id_, "anna")
    assert kinds(project) == ["blind", "done", "reopened", "removed"]


def test_what_changes_nothing_is_not_written_down(project, id_):
    assignment = project.coding.assign(id_, "anna")
    assert project.coding.assign(id_, "anna") == assignment
    assert project.coding.set_done(id_, "anna", done=False) == assignment
    done = project.coding.set_done(id_, "anna")
    assert project.coding.set_done(id_, "anna") == done
    assert kinds(project) == ["blind", "done"]


def test_an_open_assignment_hides_nothing_and_may_become_blind(project, id_):
    assignment = project.coding.assign(id_, "anna", blind=False)
    assert not project.coding.is_blind(id_, "anna")
    blind = project.coding.assign(id_, "anna")
    assert (blind.blind, blind.assigned) == (True, assignment.assigned)
    assert project.coding.is_blind(id_, "anna")
    assert kinds(project) == ["open", "blind"]


def test_assignments_are_told_by_coder_in_the_order_in_which_they_were_made(project, make):
    first, second = (project.demonstrations.add(make(seed, name=str(seed))).id for seed in (1, 2))
    project.coding.assign(second, "anna")
    project.coding.assign(first, "bert")
    project.coding.assign(first, "anna", blind=False)
    everybody = [(a.demonstration, a.author) for a in project.coding.assignments()]
    assert everybody == [(second, "anna"), (first, "bert"), (first, "anna")]
    assert [a.demonstration for a in project.coding.assignments("anna")] == [second, first]
    project.coding.unassign(second, "anna")
    project.coding.assign(second, "anna")
    assert [a.demonstration for a in project.coding.assignments("anna")] == [first, second]
    assert project.coding.authors() == ()


def test_only_what_is_there_is_assigned_and_only_to_coders(project, make):
    id_ = project.demonstrations.add(make(1, name="01")).id
    project.tracks.edit(id_, "mlp", (), HOLD, "predicted", kind="predict")
    for author in ("mlp", "model x"):
        with pytest.raises(InputError, match=f"'{author}' is a model; only coders"):
            project.coding.assign(id_, author)
    with pytest.raises(InputError, match="needs an author"):
        project.coding.assign(id_, " ")
    with pytest.raises(InputError, match="no demonstration 'f00'"):
        project.coding.assign("f00", "anna")
    for verb in (project.coding.unassign, lambda *what: project.coding.set_done(*what, done=False)):
        with pytest.raises(InputError, match="'01' is not assigned to 'anna'; assign it first"):
            verb(id_, "anna")
    with pytest.raises(InputError, match="'mlp' is a model; only coders"):
        project.coding.set_done(id_, "mlp")
    with pytest.raises(InputError, match="no demonstration 'f00'"):
        project.coding.set_done("f00", "anna")
    assert project.coding.assignment_events() == ()


def test_what_is_not_assigned_can_be_marked_as_done(project, id_):
    assert project.coding.set_done(id_, "anna").done is not None
    assert kinds(project) == ["open", "done"]


def test_events_happen_again_with_their_times_or_not_at_all(project, id_):
    then = datetime(2024, 5, 6, tzinfo=timezone.utc)
    events = [
        AssignmentEvent(id_, "anna", "blind", then),
        AssignmentEvent(id_, "anna", "done", then + timedelta(hours=1)),
    ]
    for wrong, sentence in (
        ([events[1]], "never assigned to 'anna' cannot be done"),
        ([*events, AssignmentEvent("f" * 32, "anna", "open", then)], "no demonstration 'fff"),
        ([*events, AssignmentEvent(id_, "", "open", then)], "needs an author"),
    ):
        with pytest.raises(InputError, match=sentence):
            project.coding.replay_assignments(wrong)
    assert project.coding.assignment_events() == ()
    project.coding.replay_assignments(events)
    assert project.coding.assignment_events() == tuple(events)
    assert project.coding.assignments()[0].done == then + timedelta(hours=1)


def test_two_processes_that_assign_at_once_lose_nothing(project, make, path):
    ids = [project.demonstrations.add(make(seed, name=str(seed))).id for seed in range(8)]
    code = """
import sys
from forcelab.project import Project
with Project.open(sys.argv[1]) as project:
    for id_ in sys.argv[3:]:
        project.coding.assign(id_, sys.argv[2])
        project.coding.assign(id_, "both")
        project.coding.set_done(id_, "both")
        project.coding.set_done(id_, sys.argv[2])
"""
    both = [
        subprocess.Popen([sys.executable, "-c", code, str(path), who, *ids])
        for who in ("anna", "bert")
    ]
    assert [process.wait() for process in both] == [0, 0]
    assert project.changed_elsewhere()
    assert len(project.coding.assignments()) == 3 * len(ids)
    assert all(assignment.done for assignment in project.coding.assignments())
    assert len(project.coding.assignment_events()) == 6 * len(ids)  # "both" was assigned once only


def test_everybody_who_has_something_to_do_with_it_is_known_by_name(project, make):
    id_ = project.demonstrations.add(
        make(0, "one"), [Track("Ada", (Segment(0.0, 0.1, "grab"),))]
    ).id
    project.tracks.edit(
        id_, "model one", (), (Segment(0.0, 0.1, "grab"),), "predicted", kind="predict"
    )
    project.coding.assign(id_, "Bert")
    project.coding.assign(id_, "Ada")
    project.coding.set_note(id_, "Cleo", "The film is dark.")
    assert project.coding.people() == ("Ada", "Bert", "Cleo")
