from __future__ import annotations

import pytest

from forcelab.project import Project


def notes(result):
    return [(note["name"], note["author"], note["text"]) for note in result.json["notes"]]


def test_a_note_is_written_replaced_and_taken_away(forcelab, project):
    result = forcelab("note", project, "foam-01", "slipped\nat 3.2 s", "--author", "Ada", "--json")
    assert notes(result) == [("foam-01", "Ada", "slipped\nat 3.2 s")]
    assert result.json["notes"][0]["task"] == "foam"
    result = forcelab("note", project, "foam-01", "leave out", "--author", "Ada")
    assert result.out.splitlines()[1].endswith("leave out")
    assert "slipped" not in result.out
    forcelab("note", project, "foam-02", "second try", "--author", "Bert")
    both = [("foam-01", "Ada", "leave out"), ("foam-02", "Bert", "second try")]
    assert notes(forcelab("note", project, "--json")) == both
    assert notes(forcelab("note", project, "foam-02", "--json")) == both[1:]
    assert notes(forcelab("note", project, "--author", "Ada", "--json")) == both[:1]
    assert forcelab("note", project, "foam-01", "", "--author", "Ada").out == "There is no note.\n"
    result = forcelab("note", project, "foam-01", "--history", "--json")
    assert [text for *_, text in notes(result)] == ["slipped\nat 3.2 s", "leave out", ""]
    with Project.open(project) as opened:
        assert [note.text for note in opened.coding.notes()] == ["second try"]


def test_the_list_has_a_column_of_notes_where_there_are_any(forcelab, project):
    before = forcelab("list", project).out
    assert "notes" not in before
    forcelab("note", project, "foam-02", "second\x1b[31m try", "--author", "Bert")
    forcelab("note", project, "foam-02", "leave out", "--author", "Ada")
    result = forcelab("list", project)
    header, *rows = result.out.splitlines()
    assert header.endswith("  notes")
    [noted] = [row for row in rows if "foam-02" in row]
    assert noted.endswith(r"  Bert: second\x1b[31m try; Ada: leave out")
    without = [line for line in result.out.splitlines() if "foam-02" not in line]
    assert without[1:] == [line for line in before.splitlines() if "foam-02" not in line][1:]
    listed = {
        d["name"]: d["notes"] for d in forcelab("list", project, "--json").json["demonstrations"]
    }
    assert [note["author"] for note in listed["foam-02"]] == ["Bert", "Ada"]
    assert listed["foam-01"] == []
    assert "notes" not in forcelab("list", project, "--task", "sponge").out


def test_a_long_note_is_cut_in_the_list_and_whole_by_itself(forcelab, project):
    text = "word " * 60
    forcelab("note", project, "foam-02", text, "--author", "Ada")
    [noted] = [row for row in forcelab("list", project).out.splitlines() if "foam-02" in row]
    assert noted.endswith(" word…")
    assert len(noted) < 160
    assert text.strip() in forcelab("note", project).out


def test_what_is_left_to_a_blind_coder_is_listed_without_the_notes_of_others(forcelab, project):
    for name in ("foam-01", "foam-02"):
        forcelab("note", project, name, "leave out", "--author", "Bert")
    forcelab("assign", project, "foam-01", "--author", "Ada")
    result = forcelab("list", project, "--to-label", "Ada")
    assert ["leave out" in line for line in result.out.splitlines() if "foam-0" in line][:2] == [
        False,
        True,
    ]


def test_who_only_has_something_assigned_is_found_beside_a_name_nearly_the_same(forcelab, project):
    forcelab("assign", project, "foam-01", "--author", "Bert")
    assert "there is 'Bert'" in forcelab("list", project, "--to-label", "bert").sentence


def test_removing_says_that_notes_would_go(forcelab, project):
    forcelab("note", project, "foam-01", "leave out", "--author", "Ada")
    assert ", 1 note, for good" in forcelab("remove", project, "foam-01").sentence
    assert "note" not in forcelab("remove", project, "foam-02").sentence
    assert forcelab("remove", project, "foam-01", "--yes").status == 0
    assert forcelab("note", project, "--json").json == {"notes": []}


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("x", "leave out", "--author", "Ada"), "no demonstration 'x'"),
        (("foam-01", "leave out", "--author", "model net"), "is a model; only coders"),
        (("foam-01", "\udcff", "--author", "Ada"), "not valid Unicode"),
    ],
)
def test_what_cannot_be_noted_is_one_sentence(forcelab, project, words, sentence):
    assert sentence in forcelab("note", project, *words).sentence
    assert forcelab("note", project).out == "There is no note.\n"


def test_a_note_is_somebodys(forcelab, project):
    assert "--author" in forcelab("note", project, "foam-01", "leave out").wrong_word
