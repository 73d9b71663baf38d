"""What a simulation knows of its demonstrations, and how their actions are to look."""

from __future__ import annotations

import pytest

from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import NewDemonstration, Project
from forcelab.vocabulary import COLOURS, Action, Vocabulary

TRUTH = {"taps": [0.1, 1 / 3], "mistakes": {"Ines": [[0.0, 0.1, "höld", None]]}}
LOOKS = Vocabulary((Action("hold", COLOURS[4], "5"), Action("grab", COLOURS[2], "3")))


def test_the_truth_comes_back_as_told_and_is_nobodys_track(project, make, path):
    id_ = project.demonstrations.add_all([NewDemonstration(make(1), truth=TRUTH)])[0].id
    with Project.open(path) as again:
        assert again.demonstrations.truth(id_) == TRUTH
        assert again.tracks.of(id_) == ()
        assert again.coding.authors() == ()


def test_a_demonstration_of_which_nothing_was_told_has_no_truth(project, make):
    assert project.demonstrations.truth(project.demonstrations.add(make(1)).id) is None
    with pytest.raises(InputError, match="no demonstration"):
        project.demonstrations.truth("0" * 32)


def test_another_truth_of_the_same_recording_is_an_update(project, make):
    new = NewDemonstration(make(1), truth=TRUTH)
    assert project.demonstrations.add_all([new])[0].status == "new"
    assert project.demonstrations.add_all([new])[0].status == "unchanged"
    added = project.demonstrations.add_all([NewDemonstration(make(1), truth={"taps": []})])[0]
    assert added.status == "updated"
    assert project.demonstrations.truth(added.id) == {"taps": []}
    assert (
        project.demonstrations.add(make(1)).status == "unchanged"
    )  # nothing told: the old one stays
    assert project.demonstrations.truth(added.id) == {"taps": []}


@pytest.mark.parametrize("content", [b'{"taps": [0.1', b"[]", b"\xff"])
def test_a_damaged_truth_is_one_sentence_and_is_mended_by_adding_again(project, make, content):
    id_ = project.demonstrations.add_all([NewDemonstration(make(1), truth=TRUTH)])[0].id
    (file,) = project.path.rglob("truth.json")
    file.write_bytes(content)
    with pytest.raises(InputError, match=r"truth\.json.*copy\.$"):
        project.demonstrations.truth(id_)
    assert (
        project.demonstrations.add_all([NewDemonstration(make(1), truth=TRUTH)])[0].status
        == "updated"
    )
    assert project.demonstrations.truth(id_) == TRUTH


def test_a_truth_that_cannot_be_stored_adds_nothing(project, make):
    with pytest.raises(InputError, match="not valid Unicode"):
        project.demonstrations.add_all(
            [NewDemonstration(make(1)), NewDemonstration(make(2), truth={"a": "\ud800"})]
        )
    assert project.demonstrations.infos() == ()


def test_actions_begin_with_the_looks_they_were_given_labelled_or_not(project, make):
    project.demonstrations.add_all([NewDemonstration(make(1), vocabulary=LOOKS)])
    assert project.actions.vocabulary("LEGO") == LOOKS


def test_looks_that_a_task_has_already_stay_and_new_ones_take_what_is_free(project, make):
    mine = Vocabulary((Action("grab", COLOURS[0], "1"), Action("pull", COLOURS[4], "5")))
    project.actions.set_vocabulary("LEGO", mine)
    track = Track("Ines", (Segment(0.0, 0.1, "twist"),))
    more = Vocabulary((*LOOKS, Action("slip", COLOURS[6], "7")))
    project.demonstrations.add_all([NewDemonstration(make(1), (track,), vocabulary=more)])
    now = project.actions.vocabulary("LEGO")
    assert now.names == ("grab", "pull", "hold", "slip", "twist")
    assert tuple(now)[:2] == tuple(mine)
    assert now["slip"] == more["slip"]  # free, so as given
    assert now["hold"].look not in {action.look for action in mine}
