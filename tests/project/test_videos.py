"""Any number of videos of a demonstration, and those of stores that knew of one."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from forcelab.clock import ClockMap
from forcelab.demonstration import VideoReference
from forcelab.errors import InputError
from forcelab.project import Project

START = 100.0
FRAMES = {
    "start": np.array(START),
    "frames_0": np.column_stack([START + np.arange(5) / 10, np.zeros(5)]),
    "frames_1": np.column_stack([START + 0.25 + np.arange(5) / 10, np.zeros(5)]),
}
NAMES = {
    "video_names": np.array(["front", "left"]),
    "video_files": np.array(["", "beside-0123456789abcdef.mkv"]),
    "video_clocks": np.array([[0.0, 1.0], [0.5, 1.00001]]),
}


@pytest.fixture
def films(tmp_path):
    paths = [tmp_path / f"{name}.mp4" for name in ("first", "second", "third")]
    for path in paths:
        path.write_bytes(path.name.encode())
    return paths


def names_and_content(demonstration):
    return [(video.name, video.path.read_bytes()) for video in demonstration.videos]


def test_videos_come_back_in_order_and_a_name_given_again_replaces_one(project, make, films):
    one, two, three = films
    videos = (VideoReference(one, ClockMap(0.1)), VideoReference(two, ClockMap(-2.0, 1.1), "left"))
    id_ = project.demonstrations.add(make(1, name="01", videos=videos)).id
    assert project.demonstrations.info(id_).videos == ("video 1", "left")
    project.media.attach_video(id_, three, name=" high up ")
    project.media.attach_video(id_, three, ClockMap(7.0), name="left")
    project.media.set_video_clock(id_, ClockMap(3.0), "high up")
    project.media.set_video_clock(id_, ClockMap(0.2))
    demonstration = project.demonstrations.load(id_)
    assert names_and_content(demonstration) == [
        ("video 1", b"first.mp4"),
        ("left", b"third.mp4"),
        ("high up", b"third.mp4"),
    ]
    assert [video.clock.offset for video in demonstration.videos] == [0.2, 7.0, 3.0]
    home = demonstration.video.path.parent
    assert len(list(home.glob("video-*"))) == 2, "what two have in common lies there once"
    project.media.attach_video(id_, one, name="left")
    assert len(list(home.glob("video-*"))) == 2, "and goes when none has it"
    project.demonstrations.add(make(1, name="01", videos=(VideoReference(two, name="low"),)))
    assert project.demonstrations.info(id_).videos == ("video 1", "left", "high up", "low")
    with pytest.raises(InputError, match="no video 'lef'; did you mean 'left'"):
        project.media.set_video_clock(id_, ClockMap(), "lef")
    with pytest.raises(InputError, match="needs a name"):
        project.media.attach_video(id_, one, name=" ")
    with pytest.raises(InputError, match="longer than"):
        project.media.attach_video(id_, one, name=2000 * "x")
    project.media.remove_video(id_, "video 1")  # whose file is that of "left"
    assert names_and_content(project.demonstrations.load(id_))[0] == ("left", b"first.mp4")
    project.media.remove_video(id_, "high up")
    assert [path.read_bytes() for path in sorted(home.glob("video-*"), key=Path.read_bytes)] == [
        b"first.mp4",
        b"second.mp4",
    ]
    project.media.attach_video(id_, three, name="last")
    project.media.attach_video(id_, three)  # in place of the first one
    assert project.demonstrations.info(id_).videos == ("left", "low", "last")
    assert names_and_content(project.demonstrations.load(id_))[0] == ("left", b"third.mp4")
    with pytest.raises(InputError, match="no video 'high up'"):
        project.media.remove_video(id_, "high up")
    without = project.demonstrations.add(make(2, name="02")).id
    with pytest.raises(InputError, match="'02' has no video; attach one"):
        project.media.set_video_clock(without, ClockMap())
    project.demonstrations.remove_all({id_: {}})
    assert not home.exists()


def filmed_before(project, make, film, older, stamps):
    """A store of version 4: one video in its row, what a second camera saw beside it."""
    d = make(1, name="01", videos=(VideoReference(film, ClockMap(0.125, 1.00002)),))
    id_ = project.demonstrations.add(d).id
    project.demonstrations.add(make(2, name="02"))
    project.media.attach_stamps(id_, stamps)
    home = project.path / "demonstrations" / id_
    (home / "beside-0123456789abcdef.mkv").write_bytes(b"of the second camera")
    return older(4)


@pytest.mark.parametrize("stamps", [NAMES, FRAMES])
def test_a_store_that_knew_one_video_is_opened_with_all_of_them(
    project, make, films, older, stamps
):
    path = filmed_before(project, make, films[0], older, stamps)
    named = stamps is NAMES
    for _ in range(2):  # brought up to date, then as it is
        with Project.open(path) as opened:
            d = opened.demonstrations.load("01")
            first, second = ("front", "left") if named else ("first camera", "second camera")
            assert names_and_content(d) == [
                (first, b"first.mp4"),
                (second, b"of the second camera"),
            ]
            assert d.videos[0].clock == ClockMap(0.125, 1.00002)
            assert d.videos[1].clock == (ClockMap(0.5, 1.00001) if named else ClockMap(0.25))
            assert opened.demonstrations.load("02").videos == ()
    with Project.open(path) as opened:
        opened.media.attach_video(d.id, films[1], name=second)
        assert opened.demonstrations.load("01").videos[1].path.read_bytes() == b"second.mp4"
        assert not d.videos[1].path.exists()


@pytest.mark.parametrize(
    "stamps",
    [
        {},
        {"start": FRAMES["start"], "frames_0": FRAMES["frames_0"]},
        NAMES | {"video_clocks": np.array([[0.0, 1.0], [np.nan, 1.0]])},
        NAMES | {"video_clocks": np.array([[0.0, 1.0]])},
        NAMES | {"video_clocks": np.array([0.0, 1.0])},
        NAMES | {"video_files": np.array(["", "../../01.mkv"])},
        NAMES | {"video_files": np.array(["", "signals.npy"])},
        NAMES | {"video_names": np.array(["front", " "])},
        NAMES | {"video_names": np.array(["front", "front"])},
        NAMES | {"video_names": np.array([1.0, 2.0])},
        NAMES | {"video_names": np.array("front")},
        FRAMES | {"start": np.arange(3.0)},
    ],
)
def test_where_stamps_tell_nothing_of_a_second_camera_the_first_video_stays(
    project, make, films, older, stamps
):
    path = filmed_before(project, make, films[0], older, stamps)
    with Project.open(path) as opened:
        (video,) = opened.demonstrations.load("01").videos
        assert video.clock == ClockMap(0.125, 1.00002)
        assert (video.path.parent / "beside-0123456789abcdef.mkv").exists()


def test_damaged_stamps_and_links_leave_the_first_video(project, make, films, older):
    path = filmed_before(project, make, films[0], older, NAMES)
    home = next(path.glob("demonstrations/*/stamps.npz")).parent
    whole = (home / "stamps.npz").read_bytes()
    beside = home / "beside-0123456789abcdef.mkv"
    before = (path / "project.sqlite").read_bytes()

    def videos():
        for old in path.glob("project.sqlite*"):
            old.unlink()
        (path / "project.sqlite").write_bytes(before)
        with Project.open(path) as opened:
            return len(opened.demonstrations.load("01").videos)

    for damaged in (whole[:-30], whole[:60] + bytes(40) + whole[100:]):
        (home / "stamps.npz").write_bytes(damaged)
        assert videos() == 1
    (home / "stamps.npz").write_bytes(whole)
    assert videos() == 2
    beside.unlink()
    beside.symlink_to(films[1])
    assert videos() == 1


@pytest.mark.parametrize("value", ["x'00'", "'../film.mp4'", "'film.mp4'", "7"])
def test_an_old_store_with_a_video_of_elsewhere_is_refused(project, make, films, older, value):
    path = filmed_before(project, make, films[0], older, {})
    with closing(sqlite3.connect(path / "project.sqlite")) as store, store:
        store.execute("PRAGMA ignore_check_constraints = ON")
        store.execute(f"UPDATE demonstration SET video = {value} WHERE name = '01'")
    with pytest.raises(InputError, match="damaged"):
        Project.open(path)


def test_names_of_videos_are_filled_in_and_unique(make):
    videos = tuple(VideoReference(name=name, path=None) for name in ("", "left", " "))
    d = make(1, videos=videos)
    assert [video.name for video in d.videos] == ["video 1", "left", "video 3"]
    assert d.find_video() is d.video is d.videos[0]
    assert d.find_video("left") is d.videos[1]
    with pytest.raises(InputError, match="no video 'right'"):
        d.find_video("right")
    with pytest.raises(InputError, match="two videos called 'left'"):
        replace(d, videos=(videos[1], videos[1]))
    with pytest.raises(InputError, match="has no video"):
        make(1).find_video()
