"""The vocabulary of a task, changed by several processes at once."""

import pytest

from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import Project
from forcelab.vocabulary import Vocabulary


def test_actions_are_added_to_what_is_there_by_then(project, path):
    project.actions.set_vocabulary("LEGO", Vocabulary().with_actions("grab"))
    with Project.open(path) as other:
        actions = other.actions.add("LEGO", ["slip"])
    assert actions.names == ("grab", "slip")
    added = project.actions.add("LEGO", ["grab", "hold"])
    assert added.names == ("grab", "slip", "hold")
    assert project.actions.vocabulary("LEGO") == added
    assert added["slip"] == actions["slip"]
    with pytest.raises(InputError):
        project.actions.add("LEGO", [" "])
    assert project.actions.vocabulary("LEGO") == added


def test_a_vocabulary_made_from_an_older_one_is_not_written(project, path):
    before = project.actions.vocabulary("LEGO")
    with Project.open(path) as other:
        other.actions.add("LEGO", ["slip"])
    mine = before.with_actions("grab")
    assert not project.actions.set_vocabulary("LEGO", mine, before=before)
    assert project.actions.vocabulary("LEGO").names == ("slip",)
    assert project.actions.set_vocabulary("LEGO", mine, before=project.actions.vocabulary("LEGO"))
    assert project.actions.vocabulary("LEGO") == mine


def test_what_says_that_there_is_no_action_becomes_none(project, make):
    id_ = project.demonstrations.add(make()).id
    with pytest.raises(InputError, match="cannot be called 'Unlabelled'"):
        project.actions.add("LEGO", ["grab", "Unlabelled"])
    assert project.actions.vocabulary("LEGO").names == ()
    with pytest.raises(InputError, match="cannot be called 'unlabelled'"):
        project.tracks.edit(id_, "Ada", (), (Segment(0.1, 0.2, "unlabelled"),), "painted")
    assert project.tracks.get(id_, "Ada").segments == ()


def test_a_project_that_has_such_an_action_can_go_on_with_it(project, make):
    old = (Segment(0.1, 0.2, "unlabelled"),)
    id_ = project.demonstrations.add(make(), [Track("Ada", old)]).id
    project.tracks.edit(id_, "Ada", old, (Segment(0.1, 0.3, "unlabelled"),), "moved")
    assert project.actions.add("LEGO", ["unlabelled", "grab"]).names == ("unlabelled", "grab")
    project.tracks.edit(
        id_, "Ada", project.tracks.get(id_, "Ada").segments, (Segment(0.1, 0.3, "grab"),), ""
    )
