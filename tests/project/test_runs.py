"""Recognisers and runs: kept with what repeats them, whole or not at all."""

import errno
import sqlite3
from contextlib import closing, contextmanager

import pytest

from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import LabelsUsed, Project, Provenance
from forcelab.project.files import move_into

MADE = {"settings": {"preset": "paper"}, "seed": 7, "versions": {"forcelab": "1"}}


@pytest.fixture
def used(project, make):
    id_ = project.demonstrations.add(make(1), [Track("anna", (Segment(0.0, 0.1, "grab"),))]).id
    return LabelsUsed(id_, "anna", project.tracks.head(id_, "anna"))


def test_what_was_made_comes_back_with_how_it_was_made(project, path, used, tmp_path):
    (file := tmp_path / "r.skops").write_bytes(b"learnt")
    id_ = project.runs.add_recogniser("Grüße", file, Provenance(labels=[used], **MADE))
    assert project.runs.add_recogniser("again", b"learnt", Provenance(labels=[], **MADE)) == id_
    number = project.runs.add(
        "evaluate", Provenance(labels=[used], **MADE), result={"digest": {"f1": 1}}
    )
    with Project.open(path) as again:
        (recogniser,), run = again.runs.recognisers(), again.runs.get(number)
        assert again.runs.recogniser_path(id_).read_bytes() == b"learnt"
        assert again.runs.all() == (run,)
        assert [summary.digest for summary in again.runs.summaries("evaluate")] == [{"f1": 1}]
        assert again.runs.summaries("train") == ()
    assert (recogniser.name, run.kind, run.result) == ("Grüße", "evaluate", {"digest": {"f1": 1}})
    for stored in (recogniser, run):
        assert (stored.settings, stored.seed, stored.versions) == tuple(MADE.values())
        assert stored.labels == (used,)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"kind": " "}, "A run needs a kind"),
        ({"name": " "}, "A recogniser needs a name"),
        ({"seed": 2**63}, "The seed 9223372036854775808 does not fit into 64 bits"),
        ({"labels": ("0" * 32, "anna", 0)}, "There is no demonstration '0000"),
        ({"labels": (None, "bert", 1)}, "Edit 1 in .* is none of 'bert' over the demonstration"),
        ({"trained_on": (None, "anna", 99)}, "Edit 99 in .* is none of 'anna' over"),
    ],
)
def test_what_cannot_be_kept_is_refused_with_nothing_kept(project, used, change, sentence):
    kwargs = {"labels": [used], **MADE, "kind": "evaluate", "name": "one", "trained_on": [used]}
    for key, value in change.items():
        labels = key in ("labels", "trained_on")
        kwargs[key] = [LabelsUsed(value[0] or used.demonstration, *value[1:])] if labels else value
    provenance = Provenance(**{key: kwargs.pop(key) for key in ("labels", *MADE)})
    with pytest.raises(InputError, match=sentence):
        project.runs.add_training(content=b"learnt", provenance=provenance, result={}, **kwargs)
    assert (project.runs.all(), project.runs.recognisers()) == ((), ())


@pytest.mark.parametrize("moved", [False, True])
def test_a_run_and_its_recogniser_are_kept_both_or_neither(project, path, used, monkeypatch, moved):
    def full(home, staged):
        if moved:
            move_into(home, staged)
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("forcelab.project.files.move_into", full)
    with pytest.raises(InputError, match="'one' was not added to .*: No space left .*; make room"):
        project.runs.add_training(
            "evaluate",
            "one",
            b"learnt",
            Provenance(labels=[used], **MADE),
            trained_on=[used],
            result={},
        )
    assert (project.runs.all(), project.runs.recognisers()) == ((), ())
    assert list((path / "recognisers").iterdir()) == []


def test_whoever_opens_the_project_just_before_a_recogniser_is_kept_leaves_its_mark(
    project, path, monkeypatch
):
    writing, marked = project._db.writing, []

    @contextmanager
    def open_then_write():
        with Project.open(path):
            pass
        with writing():
            yield

    def move(home, staged):
        marked.extend(file.stem for file in home.glob("*.uncommitted"))
        move_into(home, staged)

    monkeypatch.setattr(project._db, "writing", open_then_write)
    monkeypatch.setattr("forcelab.project.files.move_into", move)
    id_ = project.runs.add_recogniser("one", b"learnt", Provenance(labels=[], **MADE))
    assert marked == [id_]


def test_a_recogniser_that_did_not_get_into_the_store_is_gone_when_it_is_opened(
    project, path, used
):
    id_ = project.runs.add_recogniser("one", b"learnt", Provenance(labels=[used], **MADE))
    folder = path / "recognisers"
    unmarked = f"{'e' * 32}.skops"  # an older store was put back
    for name in (f"{'f' * 32}.skops", f"{'f' * 32}.uncommitted", f"{id_}.uncommitted", unmarked):
        (folder / name).write_bytes(b"")
    with Project.open(path):
        assert {file.name for file in folder.iterdir()} == {f"{id_}.skops", unmarked}


def test_what_is_gone_or_damaged_is_told_with_the_cure(project, path, used):
    with pytest.raises(InputError, match="no run 3"):
        project.runs.get(3)
    with pytest.raises(InputError, match="There is no recogniser 'f00' in .* train it again"):
        project.runs.recogniser_path("f00")
    id_ = project.runs.add_recogniser("one", b"learnt", Provenance(labels=[used], **MADE))
    project.runs.recogniser_path(id_).unlink()
    with pytest.raises(InputError, match="skops' is missing; train the recogniser again"):
        project.runs.recogniser_path(id_)
    number = project.runs.add("evaluate", Provenance(labels=[], **MADE), result={})
    with closing(sqlite3.connect(path / "project.sqlite")) as store, store:
        store.execute("UPDATE run SET result = '{ }}'")
    with pytest.raises(InputError, match=f"run {number} found is damaged .*; repeat it, or"):
        project.runs.get(number)
