"""The vocabulary of a task, changed by several processes at once."""

import pytest

from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import Project
from forcelab.vocabulary import Vocabulary


def test_actions_are_added_to_what_is_there_by_then(project, path):
    project.set_vocabulary("LEGO", Vocabulary().with_actions("grab"))
    with Project.open(path) as other:
        there = other.add_actions("LEGO", ["slip"])
    assert there.names == ("grab", "slip")
    added = project.add_actions("LEGO", ["grab", "hold"])
    assert added.names == ("grab", "slip", "hold")
    assert project.vocabulary("LEGO") == added
    assert added["slip"] == there["slip"]
    with pytest.raises(InputError):
        project.add_actions("LEGO", [" "])
    assert project.vocabulary("LEGO") == added


def test_a_vocabulary_made_from_an_older_one_is_not_written(project, path):
    before = project.vocabulary("LEGO")
    with Project.open(path) as other:
        other.add_actions("LEGO", ["slip"])
    mine = before.with_actions("grab")
    assert not project.set_vocabulary("LEGO", mine, before=before)
    assert project.vocabulary("LEGO").names == ("slip",)
    assert project.set_vocabulary("LEGO", mine, before=project.vocabulary("LEGO"))
    assert project.vocabulary("LEGO") == mine


def test_what_says_that_there_is_no_action_becomes_none(project, make):
    id_ = project.add(make()).id
    with pytest.raises(InputError, match="cannot be called 'Unlabelled'"):
        project.add_actions("LEGO", ["grab", "Unlabelled"])
    assert project.vocabulary("LEGO").names == ()
    with pytest.raises(InputError, match="cannot be called 'unlabelled'"):
        project.edit(id_, "Ada", (), (Segment(0.1, 0.2, "unlabelled"),), "painted")
    assert project.track(id_, "Ada").segments == ()


def test_a_project_that_has_such_an_action_can_go_on_with_it(project, make):
    old = (Segment(0.1, 0.2, "unlabelled"),)
    id_ = project.add(make(), [Track("Ada", old)]).id
    project.edit(id_, "Ada", old, (Segment(0.1, 0.3, "unlabelled"),), "moved")
    assert project.add_actions("LEGO", ["unlabelled", "grab"]).names == ("unlabelled", "grab")
    project.edit(id_, "Ada", project.track(id_, "Ada").segments, (Segment(0.1, 0.3, "grab"),), "")
