from __future__ import annotations

from forcelab.project import Project


def names(result):
    return [
        (assignment["name"], assignment["author"], assignment["blind"], assignment["done"])
        for assignment in result.json["assignments"]
    ]


def test_demonstrations_are_assigned_blind_and_done(forcelab, project):
    result = forcelab("assign", project, "foam-01", "foam-02", "--author", "Anna", "--json")
    assert names(result) == [("foam-01", "Anna", True, None), ("foam-02", "Anna", True, None)]
    result = forcelab("assign", project, "foam-01", "--author", "Anna", "--done", "--json")
    assert result.json["assignments"][0]["done"]
    result = forcelab("assign", project, "foam-01", "--author", "Anna", "--reopen", "--json")
    assert names(result) == [("foam-01", "Anna", True, None)]
    forcelab("assign", project, "--task", "sponge", "--author", "Bert", "--open")
    result = forcelab("assign", project, "--json")
    assert len(names(result)) == 4
    result = forcelab("assign", project, "--author", "Bert")
    assert result.status == 0
    assert "Anna" not in result.out
    assert result.out.count("open") == 2
    forcelab("assign", project, "foam-01", "foam-02", "--author", "Anna", "--remove")
    with Project.open(project) as opened:
        assert {assignment.author for assignment in opened.coding.assignments()} == {"Bert"}
        assert len(opened.coding.assignment_events()) == 8


def test_nothing_assigned_is_said(forcelab, project):
    assert forcelab("assign", project).out == "Nothing is assigned.\n"
    assert forcelab("assign", project, "--json").json == {"assignments": []}


def test_what_cannot_be_assigned_is_one_sentence(forcelab, project):
    assert "--author" in forcelab("assign", project, "foam-01").wrong_word
    assert "no demonstration 'x'" in forcelab("assign", project, "x", "--author", "A").sentence
    assert (
        "names, ids or --task" in forcelab("assign", project, "--author", "A", "--done").wrong_word
    )
    assert "no task 'x'" in forcelab("assign", project, "--task", "x", "--author", "A").sentence
    assert forcelab("assign", project, "--json").json == {"assignments": []}
