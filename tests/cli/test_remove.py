"""What is not wanted any more can be taken out again: demonstrations, runs, recognisers."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from dataclasses import fields, replace

import pytest

from forcelab.labels import Segment
from forcelab.project import LabelsUsed, Project, Provenance, Verdict
from forcelab.project.demonstrations import DemonstrationStore
from forcelab.project.runs import RunStore
from forcelab.project.track_editor import TrackEditor

MADE = {"settings": {"preset": "fast"}, "seed": None, "versions": {}}


@pytest.fixture
def runs(project):
    """Three runs, the first two with a recogniser of theirs, and a recogniser of none."""
    with Project.open(project) as opened:
        id_ = opened.demonstrations.load("foam-01").id
        author = opened.demonstrations.info(id_).authors[0]
        used = [LabelsUsed(id_, author, 0)]
        numbers = [
            opened.runs.add_training(
                "evaluate",
                "of a run",
                content,
                Provenance(labels=used, **MADE),
                trained_on=used,
                result={"told": content.hex() * 250},
            )
            for content in (b"one" * 1000, b"two" * 1000)
        ]
        numbers.append(opened.runs.add("evaluate", Provenance(labels=used, **MADE), result={}))
        opened.runs.add_recogniser("alone", b"three" * 20_000, Provenance(labels=used, **MADE))
        return numbers


def names_of(opened):
    return [info.name for info in opened.demonstrations.infos()]


def test_one_of_several_videos_is_removed_alone(forcelab, project, tmp_path):
    (film := tmp_path / "film.mp4").write_bytes(b"a film")
    with Project.open(project) as opened:
        id_ = opened.demonstrations.id_of("foam-01")
        for name in ("front", "left"):
            opened.media.attach_video(id_, film, name=name)
    words = "remove", project, "foam-01", "--video", "left"
    assert "the video 'left' of 'foam-01' was not removed" in forcelab(*words).sentence
    result = forcelab(*words, "--yes", "--json").json
    assert result["videos"] == [{"demonstration": id_, "name": "left"}]
    assert result["removed"] == []
    with Project.open(project) as opened:
        assert opened.demonstrations.info(id_).videos == ("front",)
    assert "no video 'left'" in forcelab(*words, "--yes").sentence
    assert forcelab("remove", project, "--run", "1", "--video", "left").status == 2


def test_it_is_removed_only_when_that_is_confirmed(forcelab, project):
    forcelab("assign", project, "foam-01", "--author", "Anna")
    with Project.open(project) as opened:
        names = names_of(opened)
        authors = opened.demonstrations.info(opened.demonstrations.load("foam-01").id).authors
    sentence = forcelab("remove", project, "foam-01").sentence
    for output in ("'foam-01' was not removed", "1 assignment", "--yes", *authors):
        assert output in sentence
    result = forcelab("remove", project, "foam-01", "--yes", "--json")
    assert [demonstration["name"] for demonstration in result.json["removed"]] == ["foam-01"]
    with Project.open(project) as opened:
        assert names_of(opened) == [name for name in names if name != "foam-01"]
    assert "no demonstration 'foam-01'" in forcelab("remove", project, "foam-01", "--yes").sentence


def test_what_is_damaged_can_be_removed_assigned_and_exported(forcelab, project, tmp_path):
    with Project.open(project) as opened:
        id_ = opened.demonstrations.id_of("foam-01")
        times = opened.path / "demonstrations" / id_ / "times.npy"
    times.write_bytes(b"\x93NUMPY")
    assert forcelab("assign", project, "foam-01", "--author", "Anna").status == 0
    assert forcelab("export", project, "--demo", "foam-01", "--out", tmp_path / "out").status == 0
    assert forcelab("remove", project, "foam-01", "--yes").status == 0
    with Project.open(project) as opened:
        assert "foam-01" not in names_of(opened)
    assert not times.parent.exists()


def test_several_go_together_or_not_at_all(forcelab, project):
    with Project.open(project) as opened:
        names = names_of(opened)
    assert (
        "no demonstration 'nothing'"
        in forcelab("remove", project, names[0], "nothing", "--yes").sentence
    )
    sentence = forcelab("remove", project, *names[:2]).sentence
    assert f"'{names[0]}', '{names[1]}' were not removed" in sentence
    with Project.open(project) as opened:
        assert names_of(opened) == names
    forcelab("remove", project, names[0], names[1], names[0], "--yes")
    with Project.open(project) as opened:
        assert names_of(opened) == names[2:]


def test_the_list_of_runs_tells_what_each_takes_up(forcelab, project, runs):
    plain = forcelab("runs", project, "--json").json
    assert [run["run"] for run in plain] == runs
    assert plain[0]["bytes"] > 300_000 > plain[2]["bytes"]
    assert [run["recogniser"] is None for run in plain] == [False, False, True]
    output = forcelab("runs", project).out
    assert "alone" in output
    assert "of a run" not in output  # it belongs to a run, beside which it stands


def test_runs_go_with_their_recognisers_and_give_the_room_back(forcelab, project, runs):
    store = project / "project.sqlite"
    sentence = forcelab("remove", project, "--run", *runs).sentence
    for output in ("run 1, run 2, run 3 were not removed", "2 recognisers", "MB"):
        assert output in sentence
    with Project.open(project) as opened:
        before = store.stat().st_size
        paths = [opened.runs.recogniser_path(use.recogniser) for use in opened.runs.uses()[:2]]
    assert not any(forcelab("remove", project, "--run", 2, 1, "--yes").err)
    assert store.stat().st_size < before / 2
    assert not any(path.exists() for path in paths)
    with Project.open(project) as opened:
        assert [run.id for run in opened.runs.summaries()] == [3]
        assert [recogniser.name for recogniser in opened.runs.recognisers()] == ["alone"]
    assert "There is no run 2" in forcelab("remove", project, "--run", 3, 2, "--yes").sentence
    assert [run["run"] for run in forcelab("runs", project, "--json").json] == [3]


def test_what_people_said_and_accepted_of_a_run_stays(forcelab, project, runs):
    with Project.open(project) as opened:
        id_ = opened.demonstrations.load("foam-01").id
        result = Verdict(
            id_, 0.0, 0.1, "grab", "slip", author="bert", coder="anna", verdict="model", run=1
        )
        opened.coding.add_verdict(result)
        labelling = TrackEditor(opened, id_, "anna")
        labelling.accept((Segment(0.2, 0.3, "slip"),), "model fast 1")
        segments, origins = labelling.segments, opened.tracks.origins(id_, "anna")
    sentence = forcelab("remove", project, "--run", 1).sentence
    assert "1 verdict" in sentence
    assert "1 edit" in sentence
    forcelab("remove", project, "--run", 1, "--yes")
    with Project.open(project) as opened:
        assert TrackEditor(opened, id_, "anna").segments == segments
        assert opened.tracks.origins(id_, "anna") == origins
        assert [origin.proposer for origin in origins.values()] == ["model fast 1"]
        (verdict,) = opened.coding.verdicts()
        assert replace(result, run=None, time=verdict.time) == Verdict(
            **{field.name: getattr(verdict, field.name) for field in fields(Verdict)}
        )
    # The store refuses to change what people said, as before.
    with (
        closing(sqlite3.connect(project / "project.sqlite")) as store,
        pytest.raises(sqlite3.IntegrityError, match="kept for ever"),
    ):
        store.execute("UPDATE verdict SET run = 2")


def test_a_recogniser_goes_and_its_run_stays(forcelab, project, runs):
    with Project.open(project) as opened:
        ids = {recogniser.name: recogniser.id for recogniser in opened.runs.recognisers()}
    assert (
        "no recogniser 'abcdef'"
        in forcelab("remove", project, "--recogniser", "abcdef", "--yes").sentence
    )
    forcelab("remove", project, "--recogniser", ids["alone"][:8], ids["of a run"], "--yes")
    with Project.open(project) as opened:
        assert [recogniser.name for recogniser in opened.runs.recognisers()] == ["of a run"]
        assert [bool(use.recogniser) for use in opened.runs.uses()].count(True) == 1
        assert len(opened.runs.summaries()) == len(runs)
    assert list((project / "recognisers").glob("*.skops"))


def test_nothing_named_is_told(forcelab, project):
    assert "--run" in forcelab("remove", project, "--yes").wrong_word


def test_a_run_that_appears_while_it_is_asked_for_is_told_as_none(forcelab, project, monkeypatch):
    uses = RunStore.uses

    def late(self, number=None):
        found = uses(self, number)
        with Project.open(project) as other:
            other.runs.add("evaluate", Provenance(labels=[], **MADE), result={})
        return found

    monkeypatch.setattr(RunStore, "uses", late)
    assert "There is no run 1 in" in forcelab("remove", project, "--run", 1, "--yes").sentence


def test_what_somebody_else_removes_meanwhile_does_not_keep_the_rest(
    forcelab, project, runs, monkeypatch
):
    remove_all = DemonstrationStore.remove_all

    def others_first(self, heads):
        with Project.open(project) as other:
            (alone,) = (item.id for item in other.runs.recognisers() if item.name == "alone")
            other.runs.remove(runs[0])
            other.runs.remove_recogniser(alone)
        remove_all(self, heads)

    with Project.open(project) as opened:
        (alone,) = (item.id for item in opened.runs.recognisers() if item.name == "alone")
    monkeypatch.setattr(DemonstrationStore, "remove_all", others_first)
    output = forcelab("remove", project, "--run", *runs[:2], "--recogniser", alone, "--yes")
    assert output.status == 0
    with Project.open(project) as opened:
        assert [run.id for run in opened.runs.summaries()] == runs[2:]
        assert opened.runs.recognisers() == ()


def test_a_number_that_the_store_cannot_hold_is_that_of_no_run(forcelab, project):
    number = 2**64
    for words in (("remove", project, "--run", number), ("runs", project, "--compare", number, 1)):
        assert f"There is no run {number} in" in forcelab(*words).sentence


@pytest.mark.parametrize("damage", ["settings = '['", "name = CAST(x'ff' AS TEXT)"])
def test_a_damaged_recogniser_can_be_removed(forcelab, project, runs, damage):
    with Project.open(project) as opened:
        (alone,) = (item.id for item in opened.runs.recognisers() if item.name == "alone")
    with closing(sqlite3.connect(project / "project.sqlite")) as store, store:
        store.execute("PRAGMA ignore_check_constraints = ON")
        store.execute(f"UPDATE recogniser SET {damage} WHERE id = ?", [alone])
    output = forcelab("runs", project).sentence
    if "settings" in damage:
        assert f"remove it with 'forcelab remove --recogniser {alone[:8]}', or" in output
    output = forcelab("remove", project, "--recogniser", alone[:8], "--yes").out
    assert output.startswith(f"Removed recogniser '{alone[:8]}': its file (")
    assert "alone" not in forcelab("runs", project).out
