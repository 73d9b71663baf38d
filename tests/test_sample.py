"""The sample project: made whole or not at all, and left alone once it is there."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from factories import foam_demonstration, perform_grips, render_placeholder

from forcelab import sample
from forcelab.cli import main
from forcelab.cli.commands import demo
from forcelab.clock import ClockMap
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.labels import Segment
from forcelab.project import Project
from forcelab.recognition import presets
from forcelab.recognition.settings import Settings
from forcelab.recognition.storage import load_recogniser
from forcelab.resources import asset
from forcelab.simulation import generate, rendering
from forcelab.simulation.scene import TASKS


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The sample project, of brief performances; two of one task are really filmed."""
    path = tmp_path_factory.mktemp("whole") / "sample.forcelab"
    render = rendering.render

    def filmed(performance, path, camera):
        # All brief performances look alike; one is synchronised with its video and one is not.
        really = re.fullmatch(r"foam-.*-0[15]", path.stem)
        return (render if really else render_placeholder)(performance, path, camera)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(generate, "perform_job", perform_grips)
        patch.setattr(rendering, "render", filmed)
        assert finish(sample.make_sample_job(path))
    return path


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(generate, "perform_job", perform_grips)
    monkeypatch.setattr(rendering, "render", render_placeholder)


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """The small sample project, of brief performances."""
    path = tmp_path_factory.mktemp("small") / "sample.forcelab"
    cheap = presets.preset("paper").replace(classifier="naive-bayes")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(presets, "preset", lambda _: cheap)
        patch.setattr(generate, "perform_job", perform_grips)
        assert finish(sample.make_sample_job(path, small=True))
    return path


@pytest.fixture
def copy(whole, tmp_path):
    return Path(shutil.copytree(whole, tmp_path / "moved.forcelab"))


def test_it_has_six_of_every_task_coded_by_two_one_or_nobody(whole):
    with Project.open(whole) as project:
        assert set(project.demonstrations.tasks()) == set(TASKS)
        for task in TASKS:
            authors = [info.authors for info in project.demonstrations.infos(task)]
            assert authors == [("Ines", "Tomas")] * 3 + [("Ines",)] * 2 + [()]
        assert {(person.name, person.kind) for person in project.coding.authors()} == {
            ("Ines", "coder"),
            ("Tomas", "coder"),
        }


def test_the_one_to_begin_with_waits_to_be_labelled_among_labelled_ones(whole, copy):
    with Project.open(whole) as project:
        infos = project.demonstrations.infos()
        [first] = [info for info in infos if info.id == sample.first_to_label(infos)]
        assert first.authors == ()
        assert sum("Ines" in info.authors for info in infos if info.task == first.task) == 5
        others = [info for info in infos if info.id != first.id]
        assert sample.first_to_label(others) == ""  # some other project
    with Project.open(copy) as project:  # with a recording of one's own besides, it still is
        project.demonstrations.add(foam_demonstration())
        assert sample.first_to_label(project.demonstrations.infos()) == first.id


def test_it_moves_with_its_videos_and_opens_synchronised_but_for_one_of_each_task(copy):
    with Project.open(copy) as project:
        for info in project.demonstrations.infos():
            video, truth = (
                project.demonstrations.load(info.id).video,
                project.demonstrations.truth(info.id)["video"],
            )
            assert video.path.is_relative_to(copy)
            assert video.path.stat().st_size > 0
            true = ClockMap(truth["offset"], truth["rate"])
            assert abs(true.offset) > 0
            assert video.clock == (ClockMap() if info.name.endswith("-05") else true)


def test_its_recogniser_was_trained_on_one_coder_and_recognises_what_nobody_labelled(whole):
    with Project.open(whole) as project:
        (stored,) = project.runs.recognisers()
        assert stored.name == "LEGO"
        assert Settings.from_json({k: v for k, v in stored.settings.items() if k != "choice"})
        learnt = {
            project.demonstrations.load(used.demonstration).name: used.author
            for used in stored.labels
        }
        assert learnt == {f"LEGO-1-{number:02d}": "Ines" for number in range(1, 6)}
        recogniser = load_recogniser(project.runs.recogniser_path(stored.id))
        found = recogniser.predict(project.demonstrations.load("LEGO-1-06")).segments
        assert {segment.action for segment in found} <= set(recogniser.actions)
        assert found


def test_where_it_is_already_nothing_is_done_and_what_people_did_stays(copy):
    with Project.open(copy) as project:
        id_ = project.demonstrations.load("foam-1-06").id
        mine = (Segment(0.0, 0.2, "still"),)
        project.tracks.edit(id_, "me", (), mine, "painted")
    assert list(sample.make_sample_job(copy)) == []
    with Project.open(copy) as project:
        assert project.tracks.get(id_, "me").segments == mine
        assert len(project.demonstrations.infos()) == 30


def test_the_small_one_is_a_part_of_the_whole_one_without_videos(whole, small):
    with Project.open(whole) as project, Project.open(small) as part:
        infos = part.demonstrations.infos()
        assert {info.task for info in infos} == set(sample.SMALL)
        assert len(infos) == 12
        assert not any(info.has_video for info in infos)
        assert sample.first_to_label(infos) == sample.first_to_label(project.demonstrations.infos())
        for info in infos:
            ours, theirs = (p.demonstrations.load(info.id) for p in (part, project))
            assert (ours.signals == theirs.signals).all()
            for coder in info.authors:
                tracks = [p.tracks.get(info.id, coder) for p in (part, project)]
                assert tracks[0] == tracks[1]
        assert {name for info in infos for name in info.authors} == set(sample.LABELLED)
        assert [stored.name for stored in part.runs.recognisers()] == [sample.SMALL[-1]]


def test_the_whole_one_will_do_for_the_small_one_but_not_the_other_way_around(whole, small):
    assert list(sample.make_sample_job(whole, small=True)) == []
    assert list(sample.make_sample_job(small, small=True)) == []
    with pytest.raises(InputError, match=r"is the small sample project; choose another folder"):
        finish(sample.make_sample_job(small))


def test_example_recordings_are_written_beside_other_files_but_over_none(tmp_path):
    folder = tmp_path / "new" / "recordings"
    files = sample.write_recordings(folder)
    assert [path.name for path in files] == [f"foam-{n:02d}.csv" for n in range(1, 7)]
    assert files[0].read_bytes() == asset("foam-01.csv").read_bytes()
    files[1].unlink()
    assert sample.write_recordings(folder) == files
    files[0].unlink()
    files[1].write_text("mine")
    with pytest.raises(InputError, match=r"foam-02\.csv' is there already and differs"):
        sample.write_recordings(folder)
    assert files[1].read_text() == "mine"
    assert not files[0].exists()


def test_what_is_there_and_is_not_the_sample_project_stays_untouched(tmp_path):
    other = tmp_path / "other.forcelab"
    Project.create(other).close()
    (tmp_path / "file").write_text("mine")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "notes.txt").write_text("mine")
    for name in ("other.forcelab", "file", "folder"):
        with pytest.raises(InputError, match=r"is not the sample project; choose another"):
            finish(sample.make_sample_job(tmp_path / name))
    assert (tmp_path / "file").read_text() == "mine"
    assert [entry.name for entry in (tmp_path / "folder").iterdir()] == ["notes.txt"]
    with Project.open(other) as project:
        assert project.demonstrations.infos() == ()


@pytest.mark.parametrize("steps", [1, 12, 36])
def test_stopped_at_any_step_it_leaves_nothing(quick, tmp_path, steps):
    job = sample.make_sample_job(tmp_path / "sample.forcelab")
    for _ in range(steps):
        next(job)
    job.close()
    assert list(tmp_path.iterdir()) == []


def test_an_error_late_on_leaves_nothing(quick, monkeypatch, tmp_path):
    monkeypatch.setattr(sample, "RECOGNISED", "sponge")
    with pytest.raises(InputError, match="sponge"):
        finish(sample.make_sample_job(tmp_path / "sample.forcelab"))
    assert list(tmp_path.iterdir()) == []


def test_interrupted_it_leaves_nothing(quick, monkeypatch, tmp_path, capsys):
    def interrupting(*_):
        assert any(tmp_path.glob(".forcelab-*.part/project.sqlite"))
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(rendering, "render", interrupting)
    monkeypatch.setattr(demo, "cpu_count", lambda: 1)
    try:
        assert main(["demo", str(tmp_path / "sample.forcelab")]) == 130
    except KeyboardInterrupt:  # it would end all tests
        pytest.fail("Ctrl+C was not heard.")
    assert capsys.readouterr().err == "forcelab: stopped; nothing was left half done.\n"
    assert list(tmp_path.iterdir()) == []


KILLED = """
import os, signal, sys
from pathlib import Path
from factories import perform_grips
from forcelab import sample
from forcelab.jobs import finish
from forcelab.simulation import generate, rendering

generate.perform_job = perform_grips
rendering.render = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
finish(sample.make_sample_job(Path("sample.forcelab")))
"""


@pytest.mark.skipif(os.name != "posix", reason="needs signals of POSIX")
def test_killed_it_is_not_there(tmp_path):
    tests = {"PYTHONPATH": str(Path(__file__).parent)}
    done = subprocess.run(
        [sys.executable, "-c", KILLED], cwd=tmp_path, env={**os.environ, **tests}, check=False
    )
    assert done.returncode == -signal.SIGKILL
    assert any(tmp_path.glob(".forcelab-*.part/project.sqlite"))
    assert Project.vacant(tmp_path / "sample.forcelab")
