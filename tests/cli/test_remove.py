"""A demonstration that was imported by mistake can be taken out again."""

from __future__ import annotations

from forcelab.project import Project


def test_it_is_removed_only_when_that_is_confirmed(forcelab, project):
    forcelab("assign", project, "foam-01", "--author", "Anna")
    with Project.open(project) as opened:
        names = [info.name for info in opened.demonstrations()]
        authors = opened.info(opened.load("foam-01").id).authors
    sentence = forcelab("remove", project, "foam-01").sentence
    for told in ("'foam-01' was not removed", "1 assignment", "--yes", *authors):
        assert told in sentence
    said = forcelab("remove", project, "foam-01", "--yes", "--json")
    assert said.json["removed"]["name"] == "foam-01"
    with Project.open(project) as opened:
        assert [i.name for i in opened.demonstrations()] == [n for n in names if n != "foam-01"]
    assert "no demonstration 'foam-01'" in forcelab("remove", project, "foam-01", "--yes").sentence
