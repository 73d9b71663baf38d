"""Classifiers and features of one's own on the command line."""

import sys
from pathlib import Path

import pytest
from factories import FOREIGN_MODULE

from forcelab.project import Project
from forcelab.recognition import plugins

LAB = "lab_of_the_command_line"
QUICK = ["--task", "foam", "--max-scale", "64", "--stride", "4"]
QUICK += ["--threshold", "off", "--median", "5"]


@pytest.fixture
def new_process(monkeypatch):
    """Makes the process as one that knows nothing of other packages."""

    def forget():
        monkeypatch.setattr(plugins, "_named", {"classifier": {}, "features": {}})
        monkeypatch.setattr(plugins, "_imported", {})
        sys.modules.pop(LAB, None)
        Path("imported").unlink(missing_ok=True)

    forget()
    yield forget
    sys.modules.pop(LAB, None)


@pytest.fixture
def lab(tmp_path, monkeypatch, new_process):
    """The folder that one works in, with a module."""
    folder = tmp_path / "code"
    folder.mkdir()
    (folder / f"{LAB}.py").write_text(FOREIGN_MODULE)
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.chdir(folder)
    return LAB


def test_a_classifier_of_ones_own_is_evaluated_trained_and_used_again(
    forcelab, project, recordings, lab, new_process, monkeypatch
):
    own = f"{lab}:NearestMean"
    result = forcelab("evaluate", project, *QUICK, "--jobs", "1", "--classifier", own)
    assert (result.status, result.err) == (0, "")
    assert f"foam: preset paper, {own}, stride 4" in result.out
    with Project.open(project) as opened:
        (run,) = opened.runs.all()
    assert run.settings["classifier"] == own
    assert run.result["filtered"]["pooled"]["accuracy"] > 0.5
    trained = forcelab("train", project, *QUICK, "--classifier", own, "--out", "own.skops")
    assert trained.status == 0
    recording = recordings / "sponge-11.csv"
    labels = forcelab("predict", "own.skops", recording).out
    assert labels.count("\n") > 3
    # In another process the path is named by the environment, or nothing of it is imported.
    new_process()
    refused = forcelab("predict", "own.skops", recording)
    assert f"The classifier '{own}' is code from outside forcelab" in refused.sentence
    assert forcelab("review", project, "--limit", "1").status == 0  # what the run kept is text
    where = (run.result["tracks"][0]["demonstration"], "--at", "2")
    why = forcelab("why", project, *where)
    assert f"if you trust it, set FORCELAB_CLASSIFIERS={own}, " in why.sentence
    assert not Path("imported").exists()
    monkeypatch.setenv("FORCELAB_CLASSIFIERS", own)
    assert forcelab("predict", "own.skops", recording).out == labels
    assert forcelab("why", project, *where).status == 0


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("lab_that_is_nowhere:make", r"'lab_that_is_nowhere:make' cannot be loaded (No module"),
        (f"{LAB}:make", "has no attribute 'make'); install its package or add its folder"),
    ],
)
def test_what_cannot_be_loaded_is_said_before_the_work(forcelab, project, lab, name, sentence):
    assert sentence in forcelab("evaluate", project, *QUICK, "--classifier", name).sentence
    assert sentence in forcelab("plan", project, "sponge-11", "--classifier", name).sentence


def test_features_of_ones_own_are_evaluated_and_asked_for_again(
    forcelab, project, lab, new_process, monkeypatch
):
    own = f"{lab}:energy"
    quick = ["--task", "foam", "--step", "0.02", "--classifier", "logistic", "--jobs", "1"]
    for features in (f"windows+{own}", own):
        assert forcelab("evaluate", project, *quick, "--features", features).status == 0
    with Project.open(project) as opened:
        runs = opened.runs.all()
    assert {run.settings["features"] for run in runs} == {own, f"windows+{own}"}
    where = (runs[0].result["tracks"][0]["demonstration"], "--at", "2")
    first, last = (("--run", min(run.id for run in runs)), ("--run", max(run.id for run in runs)))
    why = forcelab("why", project, *where, *first)
    assert f"The features of {own} decided as well, but are of no channel" in why.out
    assert "train with windows beside" in forcelab("why", project, *where, *last).sentence
    new_process()
    refused = forcelab("why", project, *where, *first).sentence
    assert f"The features '{own}' are code from outside forcelab" in refused
    assert not Path("imported").exists()
    monkeypatch.setenv("FORCELAB_FEATURES", own)
    again = forcelab("why", project, *where, *first).out
    assert again.splitlines()[:8] == why.out.splitlines()[:8]
    plan = forcelab("plan", project, "sponge-11", "--features", own)
    assert f"computed  {own} " in plan.out
    assert "4 a time step" in plan.out


def test_what_no_file_can_hold_is_refused_before_the_long_training(forcelab, project, lab):
    own = f"{lab}:Locked"
    refused = forcelab("train", project, *QUICK, "--classifier", own, "--out", "own.skops")
    assert f"A recogniser with '{own}' cannot be kept in a file (" in refused.sentence
    assert not Path("own.skops").exists()
    (few,) = Path("fitted").read_text().split()
    assert forcelab("evaluate", project, *QUICK, "--jobs", "1", "--classifier", own).status == 0
    assert int(few) < min(map(int, Path("fitted").read_text().split()[1:]))


def test_what_no_file_can_hold_once_there_is_more_data_is_refused_after_the_first_fit(
    forcelab, project, lab
):
    later = """
class LockedLater(Locked):
    def fit(self, X, y):
        super().fit(X, y)
        if len(X) > {}:
            return self
        del self.lock
        return self
"""
    Path(f"{lab}.py").write_text(FOREIGN_MODULE + later.format(250))
    own = f"{lab}:LockedLater"
    options = ["--task", "foam", "--features", "windows", "--step", "0.02", "--calibrated"]
    options += ["--threshold", "off"]
    refused = forcelab("train", project, *options, "--classifier", own, "--out", "own.skops")
    assert f"A recogniser with '{own}' cannot be kept in a file (" in refused.sentence
    trial, first = map(int, Path("fitted").read_text().split())  # and no further ones
    assert trial <= 250 < first
