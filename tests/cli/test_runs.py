"""``forcelab runs``."""

import pytest
from factories import BAYES_SETTINGS, FOAM_SELECTION, make_labelled_project

from forcelab.jobs import finish
from forcelab.project import Project
from forcelab.recognition.project_runs import evaluate_tasks_job


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = make_labelled_project(
        tmp_path_factory.mktemp("runs") / "foam.forcelab", labelled=3, bare=0
    )
    with Project.open(path) as project:
        for settings in (BAYES_SETTINGS, BAYES_SETTINGS.replace(threshold=None, stride=4)):
            finish(evaluate_tasks_job(project, settings, FOAM_SELECTION))
    return path


def test_the_list_names_every_run_with_its_scores(path, forcelab):
    lines = forcelab("runs", path).out.splitlines()
    with Project.open(path) as project:
        accuracy = project.runs.get(2).result["filtered"]["pooled"]["accuracy"]
    assert [line.split()[0] for line in lines[1:3]] == ["1", "2"]
    assert f"{100 * accuracy:.1f}" in lines[2].split()
    usual = "paper, max_scale 32.0, classifier naive-bayes"
    assert f"{usual}  " in lines[1]
    assert f"{usual}, stride 4, threshold –  " in lines[2]
    plain = forcelab("runs", path, "--json").json
    assert [run["run"] for run in plain] == [1, 2]
    assert plain[1]["accuracy"] == accuracy
    assert plain[1]["settings"]["stride"] == 4


def test_a_comparison_says_what_differed_and_by_how_much(path, forcelab):
    output = forcelab("runs", path, "--compare", 1, 2).out
    assert "stride" in output
    assert "foam 03" in output
    plain = forcelab("runs", path, "--compare", 2, 1, "--json").json
    first, second = (scores["accuracy"] for scores in plain["pooled"]["filtered"])
    assert f"{100 * (first - second):+.1f}" in output
    assert plain["runs"] == [2, 1]
    kappas = [f"{scores['kappa']:.3f}" for scores in plain["pooled"]["filtered"]]
    (kappa,) = [
        line.split() for line in output.split("filtered")[1].splitlines() if "kappa" in line
    ]
    assert kappa[1:3] == kappas[::-1]
    named = {line.split("  ")[0] for line in output.splitlines()}
    assert {"balanced", "F1@50", "F1@50 labelled", "boundary median", "boundary 90 %"} <= named
    assert len(plain["shared"]) == 3


def test_a_run_that_is_not_there_is_told_in_a_sentence(path, forcelab):
    assert "There is no run 9" in forcelab("runs", path, "--compare", 1, 9).sentence


def test_a_project_without_runs_says_how_to_make_one(tmp_path, forcelab):
    Project.create(tmp_path / "p.forcelab").close()
    result = forcelab("runs", tmp_path / "p.forcelab")
    assert result.status == 0
    assert "forcelab evaluate" in result.out
