"""The vocabulary of a task, changed by several processes at once."""

import pytest

from forcelab.errors import InputError
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
