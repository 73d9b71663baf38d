"""``forcelab simulate``."""

import os
import signal
import subprocess
import sys
import tempfile
from contextlib import contextmanager

import pytest
from factories import perform_grips

from forcelab.cli.commands import simulate
from forcelab.jobs import finish
from forcelab.project import Project
from forcelab.simulation import generate
from forcelab.simulation.generate import simulate_job as job
from forcelab.simulation.origin import origins

FOAM = ["simulate", "--task", "foam", "--seed", "7"]


@pytest.fixture
def quick(monkeypatch):
    """Brief performances instead of the mechanics, in this process."""
    monkeypatch.setattr(generate, "perform_job", perform_grips)
    monkeypatch.setattr(simulate, "cpu_count", lambda: 1)


def content(path):
    """What a project tells, but for when it was told."""
    with Project.open(path) as project:
        return {
            info.id: (info, project.tracks.of(info.id), project.demonstrations.truth(info.id))
            for info in project.demonstrations.infos()
        }, project.actions.vocabularies()


def test_the_same_seed_gives_the_same_demonstrations_in_every_project(quick, forcelab, tmp_path):
    result = forcelab(*FOAM, "--count", "1", "--out", tmp_path / "one")
    assert result.out.splitlines()[-1] == "1 demonstration: 1 new, 0 updated, 0 unchanged."
    forcelab(*FOAM, "--count", "2", "--out", tmp_path / "two")
    (first, actions), (second, same) = content(tmp_path / "one"), content(tmp_path / "two")
    assert same == actions
    assert len(second) == 2
    assert {id_: second[id_] for id_ in first} == first
    names = [{file.name for file in (tmp_path / at).rglob("video-*.mp4")} for at in ("one", "two")]
    assert len(names[0]) == 1
    assert names[0] < names[1]  # they are named by their content


def test_once_more_is_unchanged_and_more_of_them_are_added(quick, forcelab, tmp_path):
    project = tmp_path / "lab.forcelab"
    for count, statuses in ((1, ["new"]), (2, ["unchanged", "new"])):
        words = [*FOAM, "--count", count, "--out", project, "--no-video", "--json"]
        output = forcelab(*words).json
        assert [demonstration["status"] for demonstration in output["demonstrations"]] == statuses
        assert output["project"] == str(project)
    listed = forcelab("list", project, "--json").json["demonstrations"]
    assert [demonstration["name"] for demonstration in listed] == ["foam-7-01", "foam-7-02"]
    assert not any(demonstration["video"] for demonstration in listed)


def test_actions_that_a_task_has_already_keep_their_looks(quick, forcelab, project):
    with Project.open(project) as opened:
        before = opened.actions.vocabulary("foam")
    forcelab(*FOAM, "--count", "1", "--out", project, "--no-video")
    with Project.open(project) as opened:
        now = opened.actions.vocabulary("foam")
    assert tuple(now)[: len(before)] == tuple(before)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--task", "sponge"], "'sponge' to simulate; there are LEGO, cartridge, stylus, marker"),
        (["--count", "0"], "not 0"),
        (["--seed", "-1"], "not -1"),
        (["--rate", "1"], "not at 1 Hz"),
        (["--rate", "nan"], "not at nan Hz"),
    ],
)
def test_what_cannot_be_simulated_is_refused(forcelab, tmp_path, words, sentence):
    out = tmp_path / "lab.forcelab"
    result = forcelab(*FOAM, "--count", "1", "--out", out, *words)
    assert sentence in result.wrong_word
    assert not out.exists()


def test_what_is_no_project_or_may_only_be_read_is_refused_before_the_work(
    forcelab, project, tmp_path, monkeypatch
):
    monkeypatch.setattr(generate, "perform_job", None)  # not reached
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "notes.txt").write_text("mine")
    words = [*FOAM, "--count", "1", "--out"]
    assert "not a forcelab project" in forcelab(*words, tmp_path / "folder").sentence
    if os.geteuid() != 0:  # who may write everywhere is refused nothing
        project.chmod(0o555)
        assert "may only be read" in forcelab(*words, project).sentence
        project.chmod(0o755)


def test_stopped_before_the_end_nothing_is_added(quick, project, tmp_path):
    before = content(project)
    for path in (project, tmp_path / "new.forcelab"):
        making = job(path, origins("foam", 2, 7, 1000.0), video=False)
        for _ in range(4):
            next(making)
        making.close()
    assert content(project) == before
    assert not (tmp_path / "new.forcelab").exists()
    finish(job(project, origins("foam", 2, 7, 1000.0), video=False))
    assert len(content(project)[0]) == len(before[0]) + 2


@contextmanager
def full_disk(size):
    """No file grows beyond so many bytes here, as where a disk is full."""
    import resource

    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)


@pytest.mark.skipif(os.name != "posix", reason="needs limits of POSIX")
@pytest.mark.parametrize("video", [[], ["--no-video"]])
def test_a_full_disk_is_one_sentence_and_adds_nothing(
    quick, forcelab, tmp_path, monkeypatch, video
):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with full_disk(30_000):
        result = forcelab(*FOAM, "--count", "1", "--out", tmp_path / "lab.forcelab", *video)
    assert " disk" in result.sentence
    assert list(tmp_path.iterdir()) == []


#: A brief performance without video, and whether OpenCV is loaded.
BRIEFLY = """
import sys
from factories import perform_grips
from forcelab.cli import main
from forcelab.cli.commands import simulate
from forcelab.simulation import generate
generate.perform_job = perform_grips
simulate.cpu_count = lambda: 1
print(main([*sys.argv[1:], "--no-video"]), "cv2" in sys.modules)
"""


def test_without_video_opencv_is_never_loaded(tmp_path):
    words = [*FOAM, "--count", "1", "--out", str(tmp_path / "lab.forcelab")]
    done = subprocess.run(
        [sys.executable, "-c", BRIEFLY, *words],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert done.stdout.splitlines()[-1] == "0 False"
