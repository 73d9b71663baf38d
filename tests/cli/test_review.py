"""``forcelab review``."""

import numpy as np
import pytest
from factories import BAYES_SETTINGS, FOAM_SELECTION, make_labelled_project

from forcelab.cli.commands.review import KINDS
from forcelab.jobs import finish
from forcelab.project import Project
from forcelab.recognition.project_runs import evaluate_tasks_job
from forcelab.review.confusion import count_confusion
from forcelab.review.queue import review_queue
from forcelab.review.run_result import load_run
from forcelab.review.verdicts import record_verdict


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = make_labelled_project(
        tmp_path_factory.mktemp("review") / "foam.forcelab", labelled=3, bare=0
    )
    with Project.open(path) as project:
        finish(evaluate_tasks_job(project, BAYES_SETTINGS, FOAM_SELECTION))
    return path


def test_the_queue_is_printed_and_says_the_same_as_json(path, forcelab):
    with Project.open(path) as project:
        found = review_queue(project, load_run(project, 1), invented=True)
        infos = project.demonstrations.infos()
    plain = forcelab("review", path, "--kind", "boundaries", "--kind", "missed", "--json").json
    listed = [(d["start"], d["end"]) for d in plain["queue"]["boundaries"]]
    assert listed == [(d.start, d.end) for d in found.boundaries]
    names = {info.id: info.name for info in infos}
    assert all(d["demonstration"] == names[d["id"]] for d in plain["queue"]["boundaries"])
    assert set(plain["queue"]) == {"boundaries", "missed"}
    assert plain["counts"]["boundaries"] == len(found.boundaries) > 0
    printed = forcelab("review", path, "--kind", "boundaries", "--limit", 1).out
    assert printed.count("boundary ") == 1
    assert f"{found.boundaries[0].start:.3f}" in printed


def test_where_nothing_is_of_a_kind_it_says_which_kinds_there_are(path, forcelab):
    with Project.open(path) as project:
        queue = review_queue(project, load_run(project, 1), invented=True)
    (empty, *_) = (kind for kind in KINDS if not getattr(queue, kind))
    others = "".join(f" --kind {kind}" for kind in KINDS if getattr(queue, kind))
    printed = forcelab("review", path, "--kind", empty).out
    assert f"Nothing is of the kind {empty}; see the others with{others}.\n" in printed


def test_the_places_of_a_cell_of_the_confusion_matrix_are_listed(path, forcelab):
    with Project.open(path) as project:
        outcome = load_run(project, 1)
    cells = finish(count_confusion(outcome))
    numbers = cells.numbers()
    row, column = map(int, np.unravel_index(numbers.argmax(), numbers.shape))
    human, model = outcome.actions[row], (*outcome.actions, "unlabelled")[column]
    plain = forcelab("review", path, "--actions", human, model, "--json").json
    places = cells.places(human, None if model == "unlabelled" else model)
    assert [(p["start"], p["end"]) for p in plain["places"]] == [(p.start, p.end) for p in places]
    names = {result.id: result.name for result in outcome.tested}
    assert all(p["demonstration"] == names[p["id"]] != p["id"] for p in plain["places"])
    assert plain["number"] == len(places) == numbers[row, column] > 1
    assert plain["seconds"] == pytest.approx(sum(place.duration for place in places))
    printed = forcelab("review", path, "--actions", human, model, "--limit", 1).out
    assert f"{len(places)} places" in printed
    assert printed.count(f"{places[0].start:.3f}") == 1
    assert f"{places[1].start:.3f}" not in printed
    missed = forcelab("review", path, "--actions", human, "unlabelled").out
    assert "left unlabelled" in missed
    assert (
        "There is no action 'grip'" in forcelab("review", path, "--actions", "grip", model).sentence
    )


def test_verdicts_are_reported_by_pair(path, forcelab):
    with Project.open(path) as project:
        outcome = load_run(project, 1)
        first = review_queue(project, outcome).boundaries[0]
        record_verdict(project, outcome, first, "human", outcome.author)
    assert "human right" in forcelab("review", path).out
    (pair,) = forcelab("review", path, "--json").json["verdicts"]
    assert (pair["human"], pair["human_right"]) == (first.human, 1)


def test_without_an_evaluation_it_says_how_to_make_one(tmp_path, forcelab):
    path = tmp_path / "empty.forcelab"
    Project.create(path).close()
    assert "forcelab evaluate" in forcelab("review", path).sentence
