"""``forcelab review``."""

import numpy as np
import pytest
from trained_project import CHOICE, FAST, make

from forcelab.jobs import finish
from forcelab.project import Project
from forcelab.recognition.experiments import evaluate_tasks
from forcelab.review.confusion import crossing
from forcelab.review.queue import queue
from forcelab.review.run_result import load
from forcelab.review.verdicts import judge


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = make(tmp_path_factory.mktemp("review") / "foam.forcelab", labelled=3, bare=0)
    with Project.open(path) as project:
        finish(evaluate_tasks(project, FAST, CHOICE))
    return path


def test_the_queue_is_printed_and_says_the_same_as_json(path, forcelab):
    with Project.open(path) as project:
        found = queue(project, load(project, 1), invented=True)
        infos = project.demonstrations.infos()
    plain = forcelab("review", path, "--kind", "boundaries", "--kind", "missed", "--json").json
    listed = [(d["start"], d["end"]) for d in plain["queue"]["boundaries"]]
    assert listed == [(d.start, d.end) for d in found.boundaries]
    names = {one.id: one.name for one in infos}
    assert all(d["demonstration"] == names[d["id"]] for d in plain["queue"]["boundaries"])
    assert set(plain["queue"]) == {"boundaries", "missed"}
    assert plain["counts"]["boundaries"] == len(found.boundaries) > 0
    told = forcelab("review", path, "--kind", "boundaries", "--limit", 1).out
    assert told.count("boundary ") == 1
    assert f"{found.boundaries[0].start:.3f}" in told


def test_the_places_of_a_cell_of_the_confusion_matrix_are_listed(path, forcelab):
    with Project.open(path) as project:
        outcome = load(project, 1)
    cells = finish(crossing(outcome))
    numbers = cells.numbers()
    row, column = map(int, np.unravel_index(numbers.argmax(), numbers.shape))
    human, model = outcome.actions[row], (*outcome.actions, "unlabelled")[column]
    plain = forcelab("review", path, "--actions", human, model, "--json").json
    places = cells.places(human, None if model == "unlabelled" else model)
    assert [(p["start"], p["end"]) for p in plain["places"]] == [(p.start, p.end) for p in places]
    names = {one.id: one.name for one in outcome.tested}
    assert all(p["demonstration"] == names[p["id"]] != p["id"] for p in plain["places"])
    assert plain["number"] == len(places) == numbers[row, column] > 1
    assert plain["seconds"] == pytest.approx(sum(place.duration for place in places))
    told = forcelab("review", path, "--actions", human, model, "--limit", 1).out
    assert f"{len(places)} places" in told
    assert told.count(f"{places[0].start:.3f}") == 1
    assert f"{places[1].start:.3f}" not in told
    missed = forcelab("review", path, "--actions", human, "unlabelled").out
    assert "left unlabelled" in missed
    assert (
        "There is no action 'grip'" in forcelab("review", path, "--actions", "grip", model).sentence
    )


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
