"""``forcelab attach``: a video that was made beside a recording comes to it."""

from __future__ import annotations

import shutil

import pytest
from factories import demonstration_with_video

from forcelab.project import Project


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    return demonstration_with_video(tmp_path_factory.mktemp("film")).video.path


def test_a_video_comes_to_a_demonstration_with_its_offset(forcelab, project, film):
    result = forcelab("attach", project, "foam-01", film, "--offset", "-0.25", "--json").json
    assert not result["replaced"]
    with Project.open(project) as opened:
        video = opened.demonstrations.load("foam-01").video
        assert video.clock.offset == -0.25
        assert video.path.read_bytes() == film.read_bytes()
    output = forcelab("attach", project, "foam-01", film)
    assert output.status == 0
    assert output.out.startswith("Replaced the video of 'foam-01'")
    assert result["remarks"] == []
    assert output.err == ""


def test_a_further_video_is_attached_by_its_name(forcelab, project, film):
    for name, sentence in (
        (None, f"Attached '{film}' to 'foam-01', offset"),
        ("left", f"Attached '{film}' to 'foam-01' as 'left', offset"),
        (" left ", f"Replaced the video 'left' of 'foam-01' by '{film}', offset"),
        (None, f"Replaced the video 'video 1' of 'foam-01' by '{film}', offset"),
    ):
        options = () if name is None else ("--name", name)
        assert forcelab("attach", project, "foam-01", film, *options).out.startswith(sentence)
    result = forcelab("attach", project, "foam-01", film, "--name", "left", "--json").json
    assert (result["name"], result["replaced"]) == ("left", True)
    with Project.open(project) as opened:
        videos = opened.demonstrations.load("foam-01").videos
        assert [video.name for video in videos] == ["video 1", "left"]
        assert opened.demonstrations.load("foam-01").name == "foam-01"
    loss = forcelab("remove", project, "foam-01").sentence
    assert "2 videos" in loss


def test_a_damaged_video_is_attached_and_told_of(forcelab, project, tmp_path, film):
    content = film.read_bytes()
    half = tmp_path / "half.avi"
    half.write_bytes(content[: len(content) // 4])
    output = forcelab("attach", project, "foam-01", half)
    assert output.status == 0
    assert output.err.startswith("forcelab: 'half.avi' is cut short")
    assert forcelab("attach", project, "foam-01", half, "--json").json["remarks"]


def test_what_is_no_video_is_not_attached(forcelab, project, tmp_path, film):
    notes = shutil.copy(__file__, tmp_path / "notes.mp4")
    assert "cannot be read as a video" in forcelab("attach", project, "foam-01", notes).sentence
    missing = tmp_path / "none.mp4"
    assert "There is no file" in forcelab("attach", project, "foam-01", missing).sentence
    assert (
        "is a folder; name the video" in forcelab("attach", project, "foam-01", tmp_path).sentence
    )
    table = tmp_path / "a.csv"
    table.write_text("t,fx\n0,1\n1,2\n")
    sentence = forcelab("attach", project, "foam-01", table).sentence
    assert "a.csv' is no video, but is read as a recording (tables as text" in sentence
    assert "import it as a demonstration" in sentence
    assert "offset" in forcelab("attach", project, "foam-01", film, "--offset", "nan").sentence
    with Project.open(project) as opened:
        assert opened.demonstrations.load("foam-01").video is None
