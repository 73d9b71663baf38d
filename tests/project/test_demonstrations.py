from __future__ import annotations

import os
import shutil
from dataclasses import replace

import numpy as np
import pytest

from forcelab.clock import ClockMap
from forcelab.demonstration import VideoReference
from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import NewDemonstration, Project
from forcelab.project.actions import ActionStore

GRAB = (Segment(0.0, 0.1, "grab"),)
HOLD = (Segment(0.0, 0.1, "grab"), Segment(0.2, 0.3, "hold"))


def test_what_was_added_comes_back_bit_for_bit(project, make):
    new = make(1, name="Grüße 7", task="LEGO", grid_rate=500.0)
    added = project.demonstrations.add(new, source="x.csv")
    assert (added.id, added.name, added.status, added.remarks) == (new.id, "Grüße 7", "new", ())
    loaded = project.demonstrations.load(added.id)
    assert (loaded.name, loaded.task, loaded.channels) == (new.name, "LEGO", new.channels)
    assert (loaded.grid_rate, loaded.video, loaded.videos) == (500.0, None, ())
    assert loaded.times.tobytes() == new.times.tobytes()
    assert loaded.signals.tobytes() == new.signals.tobytes()
    assert isinstance(loaded.signals, np.memmap)
    assert not loaded.signals.flags.writeable


def test_the_list_tells_everything_without_the_arrays(project, make, path):
    new = make(1)
    id_ = project.demonstrations.add(new, [Track("anna", HOLD)], source="x.csv").id
    project.tracks.edit(id_, "mlp", (), GRAB, "predicted", kind="predict")
    project.demonstrations.add(make(2, name="02", task="foam"))
    shutil.rmtree(path / "demonstrations")
    other, info = project.demonstrations.infos()
    assert (info.id, info.name, info.task, info.source) == (id_, "01", "LEGO", "x.csv")
    assert (info.samples, info.channels) == (500, new.channels)
    assert (info.rate, info.duration) == (new.rate, new.duration)
    assert info.authors == ("anna", "mlp")
    assert info.labelled == pytest.approx({"anna": 0.2, "mlp": 0.1})
    assert not info.has_video
    assert other.authors == ()
    assert project.demonstrations.infos("foam") == (other,)
    assert [project.demonstrations.info(key) for key in (id_, other.id)] == [info, other]
    with pytest.raises(InputError, match="no demonstration 'f00'"):
        project.demonstrations.info("f00")
    with pytest.raises(InputError, match=r"'02' is the name of .*, not its id; .*id_of\('02'\) "):
        project.tracks.get("02", "anna")
    assert project.demonstrations.tasks() == ("foam", "LEGO")


def test_the_same_recording_twice_is_one_demonstration(project, make):
    tracks = [Track("anna", HOLD)]
    first = project.demonstrations.add(make(1), tracks)
    again = project.demonstrations.add(make(1), tracks)
    assert (first.status, again.status, again.remarks) == ("new", "unchanged", ())
    assert len(project.demonstrations.infos()) == 1
    assert len(project.tracks.history(first.id, "anna")) == 1


def test_the_same_recording_under_another_name_is_renamed_and_says_so(project, make):
    project.demonstrations.add(make(1, name="01", task="LEGO"))
    again = project.demonstrations.add(make(1, name="take 5", task="foam", grid_rate=100.0))
    assert again.status == "updated"
    assert again.remarks == (
        "The same recording was already in the project as '01' of task 'LEGO'; it is now "
        "'take 5' of task 'foam'.",
    )
    (info,) = project.demonstrations.infos()
    assert (info.name, info.task, info.rate) == ("take 5", "foam", 100.0)
    (remark,) = project.demonstrations.add(make(1, name="take 5", task="")).remarks
    assert remark.endswith("as 'take 5' of task 'foam'; it is now 'take 5' of no task.")


def test_a_name_that_is_taken_gets_a_number_once(project, make):
    names = [project.demonstrations.add(make(seed)).name for seed in (1, 2, 3)]
    assert names == ["01", "01 (2)", "01 (3)"]
    again = project.demonstrations.add(make(3))
    assert (again.name, again.status, again.remarks) == ("01 (3)", "unchanged", ())
    assert project.demonstrations.add(make(4, task="foam")).name == "01"
    clash = project.demonstrations.add(make(5))
    assert clash.remarks == (
        "Another recording of task 'LEGO' is called '01'; this one is now '01 (4)'.",
    )


def test_imported_labels_are_replaced_until_somebody_edits_them(project, make):
    id_ = project.demonstrations.add(make(1), [Track("anna", GRAB)]).id
    again = project.demonstrations.add(make(1), [Track("anna", HOLD)])
    assert (again.status, again.remarks) == ("updated", ())
    assert project.tracks.get(id_, "anna").segments == HOLD
    assert [edit.kind for edit in project.tracks.history(id_, "anna")] == ["import", "import"]

    project.tracks.edit(id_, "anna", HOLD, GRAB, "hold erased")
    added = project.demonstrations.add(make(1), [Track("anna", HOLD), Track("bert", HOLD)])
    assert added.remarks == (
        "The labels of 'anna' on '01' were edited in the project; those in the file were left out. "
        "To replace the edited ones, import those of the file as a table of segments: start, end, "
        "action (forcelab labels --replace; in the window File > Import labels).",
    )
    assert project.tracks.get(id_, "anna").segments == GRAB
    assert project.tracks.get(id_, "bert").segments == HOLD

    project.tracks.undo(id_, "anna")  # as imported once more
    project.demonstrations.add(make(1), [Track("anna", GRAB)])
    assert project.tracks.get(id_, "anna").segments == GRAB
    project.tracks.undo(id_, "anna")
    assert project.tracks.get(id_, "anna").segments == HOLD


def test_labels_in_the_name_of_a_model_are_left_out(project, id_, make):
    project.tracks.edit(id_, "mlp", (), GRAB, "predicted", kind="predict")
    added = project.demonstrations.add(make(1), [Track("mlp", HOLD)])
    assert "that is a model" in added.remarks[0]
    assert project.tracks.get(id_, "mlp").segments == GRAB


def test_two_tracks_of_one_author_are_refused_and_nothing_is_added(project, make, path):
    with pytest.raises(InputError, match="two tracks of one author"):
        project.demonstrations.add(make(1), [Track("anna", GRAB), Track("anna", HOLD)])
    assert project.demonstrations.infos() == ()
    assert list((path / "demonstrations").iterdir()) == []


@pytest.mark.parametrize("place", [(-1.01, 0.1), (0.1, 1.7), (50.0, 51.0)])
def test_labels_beyond_their_recording_are_refused_and_nothing_is_added(project, make, place):
    late = Track("anna", (Segment(*place, "grab"),))
    with pytest.raises(InputError, match=r"beyond its recording.*'anna' on '02'; shift or erase"):
        project.demonstrations.add_all(
            [NewDemonstration(make(1), ()), NewDemonstration(make(2, name="02"), (late,))]
        )
    assert project.demonstrations.infos() == ()
    project.demonstrations.add(make(2), [Track("anna", (Segment(-0.9, 1.4, "grab"),))])


def test_added_labels_extend_the_vocabulary_and_change_nothing_in_it(project, make):
    project.demonstrations.add(make(1), [Track("anna", HOLD)])
    assert project.actions.vocabulary("LEGO").names == ("grab", "hold")
    mine = project.actions.vocabulary("LEGO").rebound("grab", "q")
    project.actions.set_vocabulary("LEGO", mine)
    slip = (Segment(0.3, 0.4, "slip"), Segment(0.1, 0.2, "hold"))
    project.demonstrations.add(make(2, name="02"), [Track("anna", slip)])
    assert project.actions.vocabulary("LEGO").names == ("grab", "hold", "slip")
    assert project.actions.vocabulary("LEGO")["grab"] == mine["grab"]
    assert len(project.actions.vocabulary("foam")) == 0


def test_a_demonstration_is_found_by_id_name_or_the_beginning_of_its_id(project, make):
    id_ = project.demonstrations.add(make(1, name="one")).id
    for key in (id_, "one", id_[:6], id_[:20]):
        assert project.demonstrations.load(key).id == id_
    with pytest.raises(InputError, match="no demonstration 'two'"):
        project.demonstrations.load("two")
    with pytest.raises(InputError, match="no demonstration"):
        project.demonstrations.load(id_[:5])
    with pytest.raises(InputError, match="no demonstration"):
        project.demonstrations.load("*" * 6)
    project.demonstrations.add(make(2, name="one", task="foam"))
    with pytest.raises(InputError, match=f"{id_[:12]}.*use the id"):
        project.demonstrations.load("one")
    impostor = project.demonstrations.add(make(3, name=id_)).id
    assert project.demonstrations.load(id_).id == id_
    assert project.demonstrations.load(impostor).name == id_


def test_a_project_and_its_video_can_be_moved(project, make, film, path):
    clock = ClockMap(-0.25, 1.00002)
    film.write_bytes(bytes_ := os.urandom(3_000_000))  # copied piece by piece
    demonstration = replace(make(1), videos=(VideoReference(film, clock),))
    project.demonstrations.add(demonstration)
    film.unlink()
    project.close()
    moved = path.rename(path.with_name("moved.forcelab"))
    with Project.open(moved) as again:
        assert again.demonstrations.infos()[0].has_video
        video = again.demonstrations.load("01").video
        assert video is not None
        assert (video.clock, video.path.suffix) == (clock, ".mp4")
        assert video.path.is_relative_to(moved)
        assert video.path.read_bytes() == bytes_
        assert again.demonstrations.add(again.demonstrations.load("01")).status == "unchanged"


def test_a_new_video_replaces_the_old_one_and_no_video_leaves_it(project, make, film, path):
    project.demonstrations.add(replace(make(1), videos=(VideoReference(film),)))
    other = film.with_name("other.avi")
    other.write_bytes(b"RIFF")
    again = replace(make(1), videos=(VideoReference(other),))
    assert project.demonstrations.add(again).status == "updated"
    assert project.demonstrations.add(make(1)).status == "unchanged"
    video = project.demonstrations.load("01").video
    assert video is not None
    assert video.path.read_bytes() == b"RIFF"
    assert len(list(path.rglob("video-*"))) == 1


def test_a_video_that_cannot_be_read_adds_nothing(project, make, film, path):
    film.unlink()
    with pytest.raises(InputError, match=r"'01' was not added .*No such file.*Take 1\.MP4"):
        project.demonstrations.add(replace(make(1), videos=(VideoReference(film),)))
    assert project.demonstrations.infos() == ()
    assert list((path / "demonstrations").iterdir()) == []


def truncate(file):
    return file.write_bytes(file.read_bytes()[:-8])


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda file: file.unlink(), "is missing"),
        (truncate, "is damaged"),
        (lambda file: np.save(file, np.zeros((500, 2), np.float32)), "does not hold"),
    ],
)
def test_a_damaged_array_is_named_and_importing_again_mends_it(
    project, make, path, damage, message
):
    demonstration = make(1)
    id_ = project.demonstrations.add(demonstration, [Track("anna", GRAB)]).id
    file = path / "demonstrations" / id_ / "signals.npy"
    damage(file)
    with pytest.raises(InputError, match=f"signals.npy.*{message}.*import the recording again"):
        project.demonstrations.load("01")
    assert project.tracks.get(id_, "anna").segments == GRAB
    assert project.demonstrations.add(demonstration).status == "updated"
    assert project.demonstrations.load("01").signals.tobytes() == demonstration.signals.tobytes()


def test_a_name_that_is_no_text_is_refused(project, make, path):
    with pytest.raises(InputError, match="not valid Unicode"):
        project.demonstrations.add(make(1, name="caf\udce9"))
    assert project.demonstrations.infos() == ()
    project.demonstrations.add(make(1), source="caf\udce9.csv")
    assert project.demonstrations.infos()[0].source == "caf\\udce9.csv"


def test_two_processes_see_what_the_other_committed(project, make, path):
    with Project.open(path) as other:
        id_ = other.demonstrations.add(make(1), [Track("anna", GRAB)]).id
        assert project.tracks.get(id_, "anna").segments == GRAB
        project.tracks.edit(id_, "anna", GRAB, HOLD, "hold painted")
        assert other.tracks.get(id_, "anna").segments == HOLD
        with project.snapshot():
            assert project.tracks.get(id_, "anna").segments == HOLD
            other.tracks.edit(id_, "anna", HOLD, (), "all erased")
            assert project.tracks.get(id_, "anna").segments == HOLD
        assert project.tracks.get(id_, "anna").segments == ()


def test_what_is_to_be_kept_is_kept_and_what_is_said_is_changed(project, make):
    first = project.demonstrations.add(make(1, task="foam", grid_rate=250.0))
    silent = NewDemonstration(make(1, task=""), keep=("task", "grid_rate"))
    assert project.demonstrations.add_all([silent]) == (replace(first, status="unchanged"),)
    (info,) = project.demonstrations.infos()
    assert (info.task, info.rate) == ("foam", 250.0)
    (added,) = project.demonstrations.add_all(
        [NewDemonstration(make(1, task="sponge"), keep=("grid_rate",))]
    )
    assert added.status == "updated"
    (info,) = project.demonstrations.infos()
    assert (info.task, info.rate) == ("sponge", 250.0)
    new = NewDemonstration(make(2, task="", name="02"), keep=("task", "grid_rate"))
    assert [added.status for added in project.demonstrations.add_all([new])] == ["new"]
    assert project.demonstrations.load("02").task == ""


def test_a_kept_task_decides_which_names_are_taken_and_where_actions_go(project, make):
    project.demonstrations.add(make(1, name="a", task="foam"))
    project.demonstrations.add(make(2, name="b", task="foam"))
    silent = NewDemonstration(make(2, name="a", task=""), (Track("anna", GRAB),), keep=("task",))
    assert project.demonstrations.add_all([silent])[0].name == "a (2)"
    assert project.actions.vocabulary("foam").names == ("grab",)
    assert "" not in project.actions.vocabularies()


def test_the_same_recording_twice_in_one_import_is_one_demonstration(project, make):
    added = project.demonstrations.add_all(
        [NewDemonstration(make(1)), NewDemonstration(make(1)), NewDemonstration(make(2, name="02"))]
    )
    assert [addition.status for addition in added] == ["new", "unchanged", "new"]
    assert len(project.demonstrations.infos()) == 2


@pytest.mark.parametrize("stop", [KeyboardInterrupt, MemoryError])
def test_an_import_that_is_stopped_half_way_leaves_everything_as_it_was(
    project, make, path, film, monkeypatch, stop
):
    old = make(1, videos=(VideoReference(film),))
    project.demonstrations.add(old, [Track("anna", GRAB)])
    before = (project.demonstrations.infos(), project.tracks.history(old.id, "anna"))
    files = sorted(file for file in path.rglob("*") if "sqlite" not in file.name)
    extend, calls = ActionStore.extend, []

    def stopped(*args):
        calls.append(args)
        if len(calls) == 3:
            raise stop
        extend(*args)

    demonstrations = [
        NewDemonstration(make(seed, name=str(seed)), (Track("anna", HOLD),))
        for seed in (1, 2, 3, 4)
    ]
    with monkeypatch.context() as patch:
        patch.setattr(ActionStore, "extend", stopped)
        with pytest.raises(stop):
            project.demonstrations.add_all(demonstrations)
    assert (project.demonstrations.infos(), project.tracks.history(old.id, "anna")) == before
    assert sorted(file for file in path.rglob("*") if "sqlite" not in file.name) == files
    statuses = [added.status for added in project.demonstrations.add_all(demonstrations)]
    assert statuses == ["updated", "new", "new", "new"]
