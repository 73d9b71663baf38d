from __future__ import annotations

import sqlite3
import time
from contextlib import closing

import pytest

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import Project

GRAB = (Segment(0.0, 0.1, "grab"),)


def test_a_renamed_demonstration_has_its_new_name_everywhere(project, make, path):
    id_ = project.demonstrations.add(make(1, name="01"), [Track("anna", GRAB)]).id
    project.demonstrations.rename(id_, "  Grüße 7 ")
    with Project.open(path) as again:
        assert again.demonstrations.load("Grüße 7").id == id_
        assert [info.name for info in again.demonstrations.infos()] == ["Grüße 7"]
        assert again.tracks.get(id_, "anna").segments == GRAB


def test_no_two_demonstrations_of_a_task_get_one_name(project, make):
    id_ = project.demonstrations.add(make(1, name="01")).id
    project.demonstrations.add(make(2, name="02"))
    project.demonstrations.add(make(3, name="03", task="foam"))
    with pytest.raises(InputError, match="'01' was not renamed, .* task 'LEGO' is called '02'"):
        project.demonstrations.rename(id_, "02")
    with pytest.raises(InputError, match="needs a name"):
        project.demonstrations.rename(id_, " ")
    with pytest.raises(InputError, match="no demonstration 'f00'"):
        project.demonstrations.rename("f00", "x")
    with pytest.raises(InputError, match="not valid Unicode"):
        project.demonstrations.rename(id_, "\ud800")
    project.demonstrations.rename(id_, "03")
    project.demonstrations.rename(id_, "03")
    assert {info.name for info in project.demonstrations.infos("LEGO")} == {"02", "03"}


def test_a_video_that_cannot_be_read_changes_nothing(project, make, film, tmp_path, path):
    filmed = make(1, name="01", videos=(VideoReference(film, ClockMap(1.0)),))
    id_ = project.demonstrations.add(filmed).id
    before = sorted(path.rglob("*"))
    for wrong in (tmp_path / "missing.mp4", tmp_path):
        with pytest.raises(InputError, match="The video was not attached to '01': .*\\.") as caught:
            project.media.attach_video(id_, wrong)
        assert "\n" not in str(caught.value)
    assert sorted(path.rglob("*")) == before
    assert project.demonstrations.load(id_).video.clock == ClockMap(1.0)


def test_what_others_write_is_noticed_and_what_one_writes_oneself_is_not(project, id_, path):
    assert not project.changed_elsewhere()
    with Project.open(path) as other:
        assert not project.changed_elsewhere()
        assert not other.changed_elsewhere()
        other.tracks.edit(id_, "anna", (), GRAB, "painted")
        assert project.changed_elsewhere()
        assert not project.changed_elsewhere()
        assert not other.changed_elsewhere()
        project.demonstrations.rename(id_, "seven")
        assert other.changed_elsewhere()
    assert not project.changed_elsewhere()


def test_a_thousand_demonstrations_are_listed_at_once(path):
    channels = (Channel("fx", "N"), Channel("fy", "N"))
    segments = tuple(Segment(i * 0.02, i * 0.02 + 0.015, "abc"[i % 3]) for i in range(20))
    with Project.create(path) as project:
        project.demonstrations.add(
            Demonstration("first", "t", [0.0, 1.0], [[0.0, 0.0]] * 2, channels)
        )
    # As if added, without the slow files.
    with closing(sqlite3.connect(path / "project.sqlite")) as store, store:
        store.execute("INSERT INTO author VALUES (1, 'anna', 'coder'), (2, 'b', 'coder')")
        for i in range(1000):
            store.execute(
                "INSERT INTO demonstration SELECT printf('%032x', ?), 'pen-' || ?, "
                "'task ' || ?, channels, samples, period, duration, grid_rate, video, "
                "video_offset, video_rate, source FROM demonstration WHERE name = 'first'",
                (i, i, i % 6),
            )
            for author in (1, 2):
                track = 2 * i + author
                store.execute(
                    "INSERT INTO track VALUES (?, printf('%032x', ?), ?)", (track, i, author)
                )
                rows = [(track, s.start, s.end, s.action) for s in segments]
                store.executemany("INSERT INTO segment VALUES (?, ?, ?, ?)", rows)
    took = []
    for _ in range(5):
        begun = time.process_time()
        with Project.open(path) as project:
            infos = project.demonstrations.infos()
        took.append(time.process_time() - begun)
    assert len(infos) == 1001
    assert infos[6].labelled == pytest.approx({"anna": 0.3, "b": 0.3})
    # 25 ms where nothing else is at work; ten times that says that it grew with the square.
    assert min(took) < 0.25


def test_another_task_gets_the_demonstration_with_its_actions_and_their_looks(project, make):
    pen = make(1, name="pen-1", task="stylus")
    first = project.demonstrations.add(pen, [Track("anna", GRAB)]).id
    project.demonstrations.add(make(2, name="block", task="foam"))
    grab = project.actions.vocabulary("stylus")["grab"]
    project.demonstrations.set_task(first, " foam ")
    assert project.demonstrations.load(first).task == "foam"
    assert project.actions.vocabulary("foam")["grab"].look == grab.look
    assert project.tracks.get(first, "anna").segments == GRAB
    project.demonstrations.set_task(first, "")
    assert project.demonstrations.tasks() == ("", "foam")


def test_a_task_takes_no_second_demonstration_of_the_same_name(project, make):
    first = project.demonstrations.add(make(1, name="pen-1", task="stylus")).id
    project.demonstrations.add(make(2, name="pen-1", task="foam"))
    with pytest.raises(InputError, match="'foam' has another demonstration called 'pen-1'; rename"):
        project.demonstrations.set_task(first, "foam")
    assert project.demonstrations.info(first).task == "stylus"
