import pytest

from forcelab.project import Project


def actions(project, author="coder"):
    with Project.open(project) as opened:
        return {
            segment.action
            for info in opened.demonstrations.infos("foam")
            for segment in opened.tracks.get(info.id, author).segments
        }


def test_an_action_is_renamed_in_all_of_a_coders_labels(forcelab, project):
    assert "hold" in actions(project)
    result = forcelab("rename", project, "hold", "grip", "--author", "coder", "--task", "foam")
    assert result.status == 0
    assert result.out.startswith("'hold' is now 'grip' in ")
    assert result.out.endswith("in 4 demonstrations of foam.\n")
    assert {"grip"} == actions(project) & {"hold", "grip"}


def test_two_are_merged_only_with_yes(forcelab, project):
    before = actions(project)
    words = ("rename", project, "hold", "grab", "--author", "coder")
    output = forcelab(*words).sentence
    assert "'hold' becomes 'grab' in " in output
    assert "The action 'grab' already exists. Give --yes to merge the two." in output
    assert output.endswith("Give --yes to merge the two.\n")
    assert actions(project) == before
    content = forcelab(*words, "--yes", "--json").json
    assert (content["merged"], content["tasks"]) == (True, ["foam", "sponge"])
    assert len(content["segments"]) == 6
    assert actions(project) == before - {"hold"}


def test_what_cannot_be_renamed_is_one_sentence(forcelab, project):
    before = actions(project)
    for words, result in (
        (("hodl", "grip", "--author", "coder"), "did you mean 'hold'"),
        (("hold", "grip", "--author", "coder", "--task", "x"), "no task 'x'"),
        (("hold", "grip", "--author", "Ben"), "Ben has no segment of it"),
    ):
        assert result in forcelab("rename", project, *words).sentence
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("forcelab.project.database.os.access", lambda *_: False)
        output = forcelab("rename", project, "hold", "grab", "--author", "coder").sentence
        assert "may only be read here" in output
    assert "--author must be given" in forcelab("rename", project, "hold", "grip").wrong_word
    assert actions(project) == before
