"""A day in a notebook, and what the window shows of it in the evening."""

import pytest
from factories import make_labelled_project
from notebook_day import spend_a_day

import forcelab
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.review.settings_dialog import own_options
from forcelab.recognition.settings import FIELDS

OWN = "notebook_day:small_tree"


@pytest.fixture(scope="module")
def day(tmp_path_factory):
    """The project, and what was found in it."""
    folder = tmp_path_factory.mktemp("notebook")
    csv = folder / "pull.csv"
    csv.write_text("time,fx1 (N),label\n0.00,0.5,grab\n0.01,0.7,grab\n0.02,0.9,\n")
    path = make_labelled_project(folder / "day.forcelab")
    return path, spend_a_day(path, csv)


def test_scores_tables_and_plots_agree(day):
    path, found = day
    assert found["seconds of hold"] > 1
    assert found["mean accuracy"] == pytest.approx(found["mean of each"], abs=1e-12)
    assert found["lower end"] < found["accuracy"]
    for picture in ("bump.svg", "pairs.svg"):
        assert (path / picture).read_text("utf-8").startswith("<?xml")
    with forcelab.Project.open(path) as project:
        assert project.runs.summaries()[-1].settings["classifier"] == OWN
        assert project.demonstrations.tasks() == ("foam", "pull")


def test_the_window_reviews_its_run_and_trains_the_own_classifier_again(day, windows, until):
    path, _ = day
    window = windows(LaunchOptions(project=path, workspace="review"), author="Ada")
    trainer, workspace = window.review.trainer, window.review.workspace
    until(lambda: len(workspace.pairs.area.entries) == 3)
    [run] = trainer.runs
    [classifier] = [field for field in FIELDS if field.name == "classifier"]
    assert run.settings["classifier"] == OWN
    assert OWN in own_options(classifier)
    settings = forcelab.preset("paper").replace(classifier=OWN, max_scale=64, stride=5)
    trainer.set_settings(settings)
    assert trainer.train()
    until(lambda: not trainer.training and len(trainer.runs) == 2)
    assert not trainer.trouble
    assert trainer.runs[0].settings["classifier"] == OWN
    assert trainer.runs[0].digest == run.digest
