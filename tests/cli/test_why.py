"""``forcelab why``: what it prints is what the window shows, of the run that is meant."""

import json

import pytest
from factories import QUICK_SETTINGS, make_evaluated_project

from forcelab.cli import main
from forcelab.jobs import finish
from forcelab.project import Project
from forcelab.review.differences import interval_at
from forcelab.review.explanation import explain
from forcelab.review.held_out import train_held_out
from forcelab.review.run_result import load_run


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    path = tmp_path_factory.mktemp("why") / "study.forcelab"
    make_evaluated_project(path, QUICK_SETTINGS.replace(classifier="naive-bayes"), count=3)
    settings = ["--stride", "4", "--classifier", "naive-bayes", "--max-scale", "64"]
    assert main(["evaluate", str(path), "--task", "foam", "--jobs", "1", *settings]) == 0
    return path


def test_it_prints_what_the_window_computes(project, forcelab):
    printed = forcelab("why", project, "foam 02", "--at", "2.0", "--json").json
    with Project.open(project) as opened:
        outcome = load_run(opened, printed.pop("run"))
        id_ = opened.demonstrations.load("foam 02").id
    withheld = finish(train_held_out(project, outcome, id_))
    why = finish(explain(withheld, outcome, interval_at(outcome.find(id_), 2.0)))
    expected = json.loads(json.dumps(why.to_json()))
    for explanation in (printed, expected):
        assert explanation["recogniser"].pop("seconds")
    assert printed == expected
    assert printed["recogniser"]["same"] == 1.0


def test_people_get_a_sentence_bands_method_and_neighbours(project, forcelab):
    printed = forcelab("why", project, "foam 02", "--at", "2.0").out
    for part in ("foam 02", " s coded ", "speaks ", "Permutation", "standard error", "distance"):
        assert part in printed


def test_a_time_without_anything_is_refused(project, forcelab):
    assert "at 99 s" in forcelab("why", project, "foam 02", "--at", 99).sentence


def test_a_run_is_needed(tmp_path, forcelab):
    path = tmp_path / "study.forcelab"
    make_evaluated_project(path, QUICK_SETTINGS.replace(classifier="naive-bayes"), count=2)
    words = ["why", path, "foam 02", "--at", 2]
    assert "evaluate" in forcelab(*words).sentence
    assert "no run 7" in forcelab(*words, "--run", 7).sentence
