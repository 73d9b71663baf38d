"""``forcelab sync``: proposes, stores when told to, and takes a clock by hand."""

import shutil
from pathlib import Path

import pytest
from factories import VIDEO_OFFSET, demonstration_with_video, synthetic_demonstration

from forcelab.clock import ClockMap
from forcelab.project import Project


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("filmed")
    with Project.create(folder / "lab.forcelab") as created:
        created.demonstrations.add(demonstration_with_video(folder))
        created.demonstrations.add(synthetic_demonstration(1, rate=100.0)[0])
    return folder / "lab.forcelab"


@pytest.fixture
def project(filmed, tmp_path):
    return Path(shutil.copytree(filmed, tmp_path / "lab.forcelab"))


def clock_of(folder):
    with Project.open(folder) as project:
        return project.demonstrations.load("filmed 1").video.clock


def test_a_proposal_is_told_and_not_stored(project, forcelab):
    result = forcelab("sync", project, "filmed 1")
    assert result.status == 0
    assert "confidence" in result.out
    assert "--accept" in result.out
    output = forcelab("sync", project, "filmed 1", "--json").json
    assert output["clock"]["offset"] == pytest.approx(VIDEO_OFFSET, abs=0.04)
    assert output["clock"]["rate"] == 1.0
    assert output["confidence"] > 0.5
    assert len(output["taps"]) == 2
    assert output["residual"] < 0.034
    assert output["stored"] is False
    assert clock_of(project) == ClockMap()


def test_an_accepted_proposal_is_stored(project, forcelab):
    output = forcelab("sync", project, "filmed 1", "--accept", "--json").json
    assert output["stored"] is True
    assert clock_of(project) == ClockMap(**output["clock"])


def test_a_clock_is_set_by_hand(project, forcelab):
    result = forcelab("sync", project, "filmed 1", "--offset", "-1.25", "--rate", "1.00002")
    assert "offset -1.2500 s, rate +20.0 ppm" in result.out
    assert clock_of(project) == ClockMap(-1.25, 1.00002)
    output = forcelab("sync", project, "filmed 1", "--offset", "2", "--json").json
    assert output["before"] == {"offset": -1.25, "rate": 1.00002}
    assert "confidence" not in output
    assert clock_of(project) == ClockMap(2.0, 1.00002)


def test_the_video_to_synchronise_is_chosen_by_its_name(project, forcelab):
    with Project.open(project) as opened:
        id_ = opened.demonstrations.id_of("filmed 1")
        film = opened.demonstrations.load(id_).video.path
        opened.media.attach_video(id_, film, ClockMap(9.0), "left")
    result = forcelab("sync", project, "filmed 1", "--video", "left", "--accept")
    assert result.out.startswith("filmed 1, left: the video's clock\n  before      offset +9.0")
    with Project.open(project) as opened:
        first, left = opened.demonstrations.load("filmed 1").videos
    assert first.clock == ClockMap()
    assert left.clock.offset == pytest.approx(VIDEO_OFFSET, abs=0.04)
    assert forcelab("sync", project, "filmed 1").out.startswith("filmed 1, video 1: the video's")
    assert "no video 'lift'" in forcelab("sync", project, "filmed 1", "--video", "lift").sentence


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("filmed 1", "--rate", "0"), "positive rate"),
        (("filmed 1", "--offset", "nan"), "finite offset"),
        (("other",), "other"),
    ],
)
def test_what_cannot_be_done_is_told_and_changes_nothing(project, forcelab, words, sentence):
    assert sentence in forcelab("sync", project, *words).sentence
    words = ("filmed 1", "--offset", "1", "--accept")
    assert "not both" in forcelab("sync", project, *words).wrong_word
    assert clock_of(project) == ClockMap()


def test_without_a_video_that_is_said(project, forcelab):
    with Project.open(project) as created:
        (name,) = (info.name for info in created.demonstrations.infos() if not info.has_video)
    assert "has no video" in forcelab("sync", project, name).sentence


def test_a_proposal_that_is_not_sure_says_what_to_do_and_is_not_stored(
    project, forcelab, monkeypatch
):
    monkeypatch.setattr("forcelab.signals.sync.TRUSTED_CONFIDENCE", 1.1)
    result = forcelab("sync", project, "filmed 1").out
    assert "low: look at the frames at a tap" in result
    refused = forcelab("sync", project, "filmed 1", "--accept").sentence
    assert "'filmed 1' is not stored" in refused
    assert clock_of(project) == ClockMap()
    # The words of either are enough to have it all the same, whatever clock was there.
    options = refused.split("give ")[1].split(" instead")[0]
    assert f"if the frames at a tap fit, give {options} to store it" in result
    forcelab("sync", project, "filmed 1", "--offset", "2", "--rate", "1.00002")
    refused = forcelab("sync", project, "filmed 1", "--accept").sentence
    options = refused.split("give ")[1].split(" instead")[0]
    assert f"give {options} to store it" in forcelab("sync", project, "filmed 1").out
    forcelab("sync", project, "filmed 1", *options.split())
    assert clock_of(project).offset == pytest.approx(VIDEO_OFFSET, abs=0.04)
    assert clock_of(project).rate == 1.0


def test_a_damaged_film_is_told_by_the_name_of_its_demonstration(project, forcelab):
    with Project.open(project) as opened:
        path = opened.demonstrations.load("filmed 1").video.path
    path.write_bytes(b"no film")
    sentence = forcelab("sync", project, "filmed 1").sentence
    assert f"The video of 'filmed 1' ('{path}') cannot be read as a video: " in sentence
    path.unlink()
    sentence = forcelab("sync", project, "filmed 1").sentence
    assert f"The video of 'filmed 1' ('{path}') is not there; put it back" in sentence
