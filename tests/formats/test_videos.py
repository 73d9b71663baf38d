"""A video that is called as a recording goes with it, and keeps the clock it was given."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from factories import write_opencv_video

from forcelab.clock import ClockMap
from forcelab.errors import InputError
from forcelab.formats.importing import import_files, pair_videos
from forcelab.formats.recording import ReadOptions
from forcelab.project import Project


@pytest.fixture
def lab(tmp_path):
    """Two recordings; the second one has a video, as upper and lower case differ."""
    for name in ("VP07_1", "VP07_2"):
        shift = len(name) + int(name[-1])
        rows = "".join(f"{i * 0.01:.2f},{np.sin(i + shift):.4f}\n" for i in range(50))
        (tmp_path / f"{name}.csv").write_text("Zeit,Kraft\n" + rows)
    write_opencv_video(tmp_path / "VP07_2.avi", "MJPG", 3)
    (tmp_path / "VP07_2.avi").rename(tmp_path / "vp07_2.AVI")
    return tmp_path


def videos(path):
    with Project.open(path) as project:
        return {info.name: info.has_video for info in project.demonstrations.infos()}


def test_a_video_named_together_with_its_recording_is_attached(lab):
    files = [lab / "vp07_2.AVI", lab / "VP07_1.csv", lab / "VP07_2.csv"]
    report = import_files(lab / "p.forcelab", files)
    assert videos(lab / "p.forcelab") == {"VP07_1": False, "VP07_2": True}
    assert "vp07_2.AVI was attached" in " ".join(report.remarks[lab / "VP07_2.csv"])
    # It has 3 frames, and its recording half a second.
    assert "'vp07_2.AVI' lasts 0.07 s" in " ".join(report.remarks[lab / "VP07_2.csv"])


def test_recordings_of_one_name_in_several_folders_get_each_its_own_video():
    files = [Path(f"s{n}/trial.{ending}") for n in (1, 2) for ending in ("csv", "mp4")]
    first, second = files[0], files[2]
    assert pair_videos(files) == ([first, second], {first: {"": files[1]}, second: {"": files[3]}})
    # Only the second one has a video: the first one must not get that.
    assert pair_videos([first, *files[2:]]) == ([first, second], {second: {"": files[3]}})
    # A video apart from them may be of either, and so is of none.
    apart = Path("videos/trial.mp4")
    assert pair_videos([first, second, apart])[1] == {}
    assert pair_videos([first, apart])[1] == {first: {"": apart}}


def test_of_two_videos_of_one_name_none_is_taken():
    files = [Path(f"trial.{ending}") for ending in ("csv", "mp4", "avi")]
    assert pair_videos(files) == (files, {})


def test_further_videos_are_called_by_what_follows_the_name_of_their_recording():
    pull, pull_2 = Path("s/pull.csv"), Path("s/pull_2.csv")
    videos = [Path(f"s/{name}.mp4") for name in ("pull", "Pull.left", "pull_top down", "pull-2")]
    # What has the name of a recording is of that, however another one's name begins.
    of_second = [Path("s/pull_2.mp4"), Path("s/pull_2-left.mp4")]
    others = [Path("s/pulled.mp4"), Path("t/pull_2.left.mkv")]
    recordings, pairs = pair_videos([*videos, pull, *of_second, pull_2, others[0]])
    assert recordings == [pull, pull_2, others[0]]
    assert pairs == {
        pull: dict(zip(("", "left", "top down", "2"), videos, strict=True)),
        pull_2: dict(zip(("", "left"), of_second, strict=True)),
    }
    assert pair_videos([pull, pull_2, others[1]])[1] == {pull_2: {"left": others[1]}}


def test_further_videos_are_attached_when_a_recording_is_imported_again(lab):
    path, files, options = lab / "p.forcelab", sorted(lab.glob("*.csv")), ReadOptions(videos=True)
    import_files(path, files, options)
    shutil.copy(lab / "vp07_2.AVI", lab / "VP07_2.left.avi")
    report = import_files(path, files, options)
    assert "VP07_2.left.avi was attached as 'left'" in " ".join(report.remarks[lab / "VP07_2.csv"])
    with Project.open(path) as project:
        assert project.demonstrations.load("VP07_1").videos == ()
        assert [v.name for v in project.demonstrations.load("VP07_2").videos] == ["video 1", "left"]
    assert import_files(path, files, options).count("unchanged") == 2


def test_videos_beside_the_recordings_are_attached_when_asked_for_only(lab):
    files = sorted(lab.glob("*.csv"))
    import_files(lab / "p.forcelab", files)
    assert not any(videos(lab / "p.forcelab").values())
    import_files(lab / "p.forcelab", files, ReadOptions(videos=True))
    assert videos(lab / "p.forcelab") == {"VP07_1": False, "VP07_2": True}


def test_importing_again_keeps_the_clock_that_the_video_was_given(lab):
    path, files, options = lab / "p.forcelab", sorted(lab.glob("*.csv")), ReadOptions(videos=True)
    import_files(path, files, options)
    with Project.open(path) as project:
        project.media.set_video_clock(project.demonstrations.load("VP07_2").id, ClockMap(-3.4))
    assert import_files(path, files, options).count("unchanged") == 2
    with Project.open(path) as project:
        assert project.demonstrations.load("VP07_2").video.clock.offset == -3.4


def test_a_video_that_cannot_be_read_is_left_out(lab):
    video = lab / "VP07_1.mp4"
    video.write_bytes(b"no film")
    files, options = sorted(lab.glob("*.csv")), ReadOptions(videos=True)
    with pytest.raises(InputError, match=r"VP07_1\.mp4"):
        import_files(lab / "p.forcelab", files, replace(options, strict=True))
    assert not (lab / "p.forcelab").exists()
    report = import_files(lab / "p.forcelab", files, options)
    assert report.count("new") == len(files)
    assert list(report.unread) == [video]
    with Project.open(lab / "p.forcelab") as project:
        assert project.demonstrations.load("VP07_1").video is None


def test_a_video_without_its_recording_is_refused_with_what_to_do(lab):
    shutil.copy(lab / "vp07_2.AVI", lab / "other.avi")
    report = import_files(lab / "p.forcelab", [lab / "VP07_1.csv", lab / "other.avi"])
    assert report.count("new") == 1
    assert "import the recording first" in report.unread[lab / "other.avi"]
