"""``forcelab review``."""

import pytest
from trained_project import CHOICE, FAST, make

from forcelab.jobs import finish
from forcelab.project import Project
from forcelab.recognition.project_runs import evaluate_tasks
from forcelab.review.judging import judge
from forcelab.review.outcome import load
from forcelab.review.queue import queue


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = make(tmp_path_factory.mktemp("review") / "foam.forcelab", labelled=3, bare=0)
    with Project.open(path) as project:
        finish(evaluate_tasks(project, FAST, CHOICE))
    return path


def test_the_queue_is_printed_and_says_the_same_as_json(path, forcelab):
    with Project.open(path) as project:
        found = queue(project, load(project, 1), invented=True)
    plain = forcelab("review", path, "--kind", "boundaries", "--kind", "missed", "--json").json
    listed = [(d["start"], d["end"]) for d in plain["queue"]["boundaries"]]
    assert listed == [(d.start, d.end) for d in found.boundaries]
    assert set(plain["queue"]) == {"boundaries", "missed"}
    assert plain["counts"]["boundaries"] == len(found.boundaries) > 0
    told = forcelab("review", path, "--kind", "boundaries", "--limit", 1).out
    assert told.count("boundary ") == 1
    assert f"{found.boundaries[0].start:.3f}" in told


def test_verdicts_are_reported_by_pair(path, forcelab):
    with Project.open(path) as project:
        outcome = load(project, 1)
        first = queue(project, outcome).boundaries[0]
        judge(project, outcome, first, "human", outcome.author)
    assert "human right" in forcelab("review", path).out
    (pair,) = forcelab("review", path, "--json").json["verdicts"]
    assert (pair["human"], pair["human_right"]) == (first.human, 1)


def test_without_an_evaluation_it_says_how_to_make_one(tmp_path, forcelab):
    path = tmp_path / "empty.forcelab"
    Project.create(path).close()
    assert "forcelab evaluate" in forcelab("review", path).sentence
