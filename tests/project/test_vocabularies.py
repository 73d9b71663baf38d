"""The vocabulary of a task, changed by several processes at once."""

import pytest

from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import Project
from forcelab.vocabulary import COLOURS, Action, Vocabulary


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


def test_an_action_of_several_tasks_has_one_colour_and_each_tasks_keys_begin_at_one(project):
    lego = project.actions.add("LEGO", ["still", "grab", "hold"])
    stylus = project.actions.add("stylus", ["slip"])
    stylus = project.actions.add("stylus", ["hold", "still"])
    assert [action.key for action in stylus] == ["1", "2", "3"]
    assert stylus["hold"].look == lego["hold"].look
    assert stylus["still"].look == lego["still"].look
    assert stylus["slip"].look == (COLOURS[3], 0)


def test_a_shared_action_gets_another_plain_colour_where_its_own_is_taken(project):
    project.actions.set_vocabulary(
        "LEGO", Vocabulary((Action("slip", COLOURS[0], "1"), Action("tap", COLOURS[1], "2", 1)))
    )
    project.actions.set_vocabulary("foam", Vocabulary((Action("hold", COLOURS[0], "1"),)))
    foam = project.actions.add("foam", ["slip", "tap"])
    assert [action.look for action in foam] == [(colour, 0) for colour in COLOURS[:3]]


def test_tasks_of_before_keep_their_keys_colours_and_textures(project):
    before = Vocabulary(
        (
            Action("still", COLOURS[0], "1"),
            Action("slip", COLOURS[7], "8"),
            Action("slipped", COLOURS[0], "a", 1),
        )
    )
    project.actions.set_vocabulary("stylus", before)
    after = project.actions.add("stylus", ["pull"])
    assert after.actions[:3] == before.actions
    assert after["pull"] == Action("pull", COLOURS[1], "2")


def test_a_colour_by_hand_goes_to_all_tasks_where_it_needs_no_texture(project):
    for task in ("LEGO", "foam", "stylus", "marker"):
        project.actions.add(task, ["grab", "hold"])
    own = project.actions.vocabulary("stylus").recoloured("hold", "#112233")
    project.actions.set_vocabulary("stylus", own)  # by hand, and in this task only
    taken = project.actions.vocabulary("marker").recoloured("grab", "#abcdef")
    project.actions.set_vocabulary("marker", taken)
    changed = project.actions.vocabulary("LEGO").recoloured("hold", "#abcdef")
    assert project.actions.set_vocabulary("LEGO", changed, recoloured="hold")
    assert project.actions.vocabulary("LEGO") == changed
    assert project.actions.vocabulary("foam") == changed
    assert project.actions.vocabulary("stylus") == own
    assert project.actions.vocabulary("marker") == taken
