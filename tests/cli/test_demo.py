"""``forcelab demo``."""

import shlex
import subprocess
import sys

import pytest
from factories import perform_grips, render_placeholder

from forcelab import sample
from forcelab.cli import main
from forcelab.cli.commands import demo
from forcelab.project import Project
from forcelab.recognition import presets
from forcelab.simulation import generate, rendering


@pytest.fixture(scope="module")
def demo_project(tmp_path_factory):
    """The sample project in a folder with a space, and what was said when it was made."""
    folder = tmp_path_factory.mktemp("a lab")
    cheap = presets.preset("paper").replace(classifier="naive-bayes")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(generate, "perform_job", perform_grips)
        patch.setattr(rendering, "render", render_placeholder)
        patch.setattr(demo, "cpu_count", lambda: 1)
        patch.setattr(presets, "preset", lambda _: cheap)
        assert main(["demo", str(folder / "my sample.forcelab")]) == 0
    return folder / "my sample.forcelab"


def test_a_second_time_it_says_so_and_changes_nothing(forcelab, demo_project):
    before = (demo_project / "project.sqlite").stat().st_mtime_ns
    result = forcelab("demo", demo_project, "--json")
    assert result.json == {
        "project": str(demo_project),
        "made": False,
        "tasks": ["cartridge", "foam", "LEGO", "marker", "stylus"],
        "demonstrations": 30,
        "recognisers": ["LEGO"],
    }
    assert "there already" in forcelab("demo", demo_project).out
    assert (demo_project / "project.sqlite").stat().st_mtime_ns == before


def test_the_commands_that_it_proposes_work_as_they_are_printed(
    forcelab, demo_project, monkeypatch
):
    monkeypatch.chdir(demo_project.parent)
    result = forcelab("demo", demo_project)
    proposed = [line for line in result.out.splitlines() if line.startswith("  forcelab ")]
    assert len(proposed) == 3
    extra = {
        "evaluate": ["--classifier", "naive-bayes", "--max-scale", "64", "--jobs", "1"],
        "gui": ["--screenshot", "window.png"],
    }
    for line in proposed:
        words = shlex.split(line)[1:]
        assert forcelab(*words, *extra.get(words[0], [])).status == 0
    assert (demo_project.parent / "pairs.svg").exists()
    assert (demo_project.parent / "window.png").exists()


def test_the_small_one_says_that_it_has_no_videos(forcelab, tmp_path, monkeypatch):
    cheap = presets.preset("paper").replace(classifier="naive-bayes")
    monkeypatch.setattr(presets, "preset", lambda _: cheap)
    monkeypatch.setattr(generate, "perform_job", perform_grips)
    monkeypatch.setattr(demo, "cpu_count", lambda: 1)
    monkeypatch.chdir(tmp_path)
    made = forcelab("demo", "--small").out
    assert made.startswith("Made sample.forcelab: 12 demonstrations of 2 tasks (foam, stylus), 1 ")
    assert "There are no videos" in made
    assert "synchronised" not in made
    assert f"--task {sample.SMALL[-1]} " in made
    assert "is the small sample project" in forcelab("demo").sentence


def test_the_example_recordings_are_imported_by_the_command_that_it_proposes(
    forcelab, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    written = forcelab("demo", "--files", "my recordings")
    assert "foam-01.csv to foam-06.csv, 6 recordings" in written.out
    (line,) = (line for line in written.out.splitlines() if line.startswith("  forcelab import"))
    _, _, project, files, option, task = shlex.split(line)
    names = sorted(str(path) for path in tmp_path.glob(files))
    assert len(names) == 6
    assert "6 new" in forcelab("import", project, *names, option, task).out
    assert len(forcelab("demo", "--files", "my recordings", "--json").json["files"]) == 6
    assert "not allowed with" in forcelab("demo", "--small", "--files", "x").wrong_word
    assert "leave out 'y.forcelab'" in forcelab("demo", "y.forcelab", "--files", "x").wrong_word


def test_it_lies_in_the_current_folder_where_no_other_is_named(forcelab, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(demo, "make_sample_job", lambda path, *_, **__: make_empty(path))
    assert forcelab("demo").out.startswith("Made sample.forcelab: ")
    assert [entry.name for entry in tmp_path.iterdir()] == ["sample.forcelab"]


def make_empty(path):
    Project.create(path).close()
    yield from ()
    return True


def test_what_is_something_else_is_refused_in_one_sentence(forcelab, tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    assert "choose another" in forcelab("demo", tmp_path).sentence
    assert "cannot become a new project" in forcelab("demo", tmp_path / "no" / "x").sentence


def test_where_it_is_already_neither_opencv_nor_scikit_learn_is_loaded(demo_project):
    script = (
        "import sys; from forcelab.cli import main; status = main(['demo', sys.argv[1], '--json'])"
        "; loaded = {'cv2', 'sklearn', 'scipy', 'PySide6'} & set(sys.modules)"
        "; sys.exit(status or bool(loaded) and str(loaded))"
    )
    subprocess.run([sys.executable, "-c", script, demo_project], check=True, capture_output=True)
