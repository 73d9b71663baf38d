"""Training as the window does it, on a project of four demonstrations, one not labelled."""

import json
import sqlite3
import threading
from contextlib import closing
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from factories import (
    BAYES_SETTINGS,
    FOAM_SELECTION,
    labelled_set,
    make_labelled_project,
    synthetic_set,
)
from sklearn.naive_bayes import GaussianNB

from forcelab.cli import main
from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.labels import Segment, Track, from_codes
from forcelab.process import run_in_process
from forcelab.project import Project
from forcelab.recognition import plugins
from forcelab.recognition import training as training_module
from forcelab.recognition.cross_validation import leave_one_out_job
from forcelab.recognition.dataset import DataSelection
from forcelab.recognition.ensemble import FitProgress
from forcelab.recognition.examples import prepare_examples
from forcelab.recognition.storage import load_recogniser
from forcelab.recognition.training import training_job
from forcelab.review.run_result import edits_since, load_run
from forcelab.review.training import TrainingProgress, review_job


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return make_labelled_project(tmp_path_factory.mktemp("training") / "foam.forcelab")


@pytest.fixture(scope="module")
def trained(path):
    """What was told while training in a process of its own, and the run's number."""
    steps = []
    number = finish(
        run_in_process(review_job, path, BAYES_SETTINGS, FOAM_SELECTION, "foam"), steps.append
    )
    return steps, number


@pytest.fixture(scope="module")
def result(path, trained):
    with Project.open(path) as project:
        return load_run(project, trained[1])


def test_its_steps_lead_through_all_phases_and_never_back(trained):
    steps = [step for before, step in pairwise(trained[0]) if step is not before][1:]
    phases = list(dict.fromkeys(step.phase for step in steps))
    assert phases == ["features", "fold", "final fit", "proposals", "storing"]
    assert [step.fold for step in steps if step.phase == "fold"] == [1, 2, 3]
    assert {step.folds for step in steps} == {3}
    shares = [step.done / step.total for step in steps]
    assert shares == sorted(shares)
    assert shares[-1] == 1
    assert all(step.seconds_left is None for step in steps if step.fold < 2)
    assert all(step.seconds_left >= 0 for step in steps if step.fold >= 2)


def test_in_groups_as_many_recognisers_are_trained_and_the_run_tells_so(path, trained):
    steps = []
    choice = DataSelection(("foam",), folds=2)
    number = finish(review_job(path, BAYES_SETTINGS, choice, "foam"), steps.append)
    with Project.open(path) as project:
        found, alone = load_run(project, number), load_run(project, trained[1])
    assert [step.fold for step in steps if step.phase == "fold"] == [1, 2]
    assert {step.folds for step in steps[1:]} == {2}  # or too much time would seem to be left
    assert (found.folds, alone.folds) == (2, 0)
    assert [result.id for result in found.tested] == [result.id for result in alone.tested]


def test_its_tracks_are_those_of_evaluate_to_the_last_bit(path, result, capsys, tmp_path):
    arguments = [
        "--task",
        "foam",
        "--classifier",
        "naive-bayes",
        "--max-scale",
        "32",
        "--jobs",
        "1",
    ]
    assert main(["evaluate", str(path), *arguments, "--json", str(tmp_path / "out.json")]) in (
        0,
        None,
    )
    printed = json.loads((tmp_path / "out.json").read_text())
    with Project.open(path) as project:
        run = project.runs.all()[-1]
        evaluated = load_run(project, run.id)
    assert evaluated.number != result.number
    for which in ("raw", "filtered"):
        each = printed[which].pop("demonstrations")
        assert printed[which] == result.scores[which] == evaluated.scores[which]
        for found in (result, evaluated):
            assert [item.scores[which] for item in found.tested] == each
    for ours, theirs in zip(result.tested, evaluated.tested, strict=True):
        assert (ours.id, ours.human) == (theirs.id, theirs.human)
        assert ours.stages["raw"] == theirs.stages["raw"]
        assert ours.predicted == theirs.predicted
        assert (ours.start, ours.end) == (theirs.start, theirs.end)
        assert np.array_equal(ours.probability_trace.values, theirs.probability_trace.values)
    assert evaluated.proposals == ()


@pytest.mark.parametrize("choice", [FOAM_SELECTION, DataSelection(("foam",), test_task="hard")])
def test_features_for_testing_serve_the_final_fit_as_they_are(tmp_path, monkeypatch, choice):
    path = make_labelled_project(tmp_path / "p.forcelab", labelled=3, bare=1)
    with Project.open(path) as project:
        if choice.test_task:
            project.demonstrations.set_task(project.demonstrations.infos()[0].id, "hard")
        labelled = choice.load(project, ("foam",), BAYES_SETTINGS).labelled
        alone = finish(training_job(labelled, BAYES_SETTINGS))
        prepared = []

        def prepare(item, *others, **more):
            prepared.append(item.demonstration.name)
            return prepare_examples(item, *others, **more)

        monkeypatch.setattr(training_module, "prepare_examples", prepare)
        number = finish(review_job(path, BAYES_SETTINGS, choice, "foam"))
        (id_,) = project.runs.recogniser_bytes()
        trained = load_recogniser(project.runs.recogniser_path(id_))
        assert load_run(project, number).tested
        assert sorted(prepared) == sorted(
            info.name for info in project.demonstrations.infos() if info.labelled
        )
    assert trained.trained_on == alone.trained_on
    assert trained.shortest == alone.shortest
    for ours, theirs in zip(
        vars(trained.classifier).values(), vars(alone.classifier).values(), strict=True
    ):
        np.testing.assert_array_equal(ours, theirs)


def test_the_certainty_is_the_mean_of_the_probabilities_of_each_fiftieth_of_a_second(path, result):
    labelled = labelled_set(3, 100.0)
    tested = finish(leave_one_out_job(labelled, BAYES_SETTINGS)).tested
    with Project.open(path) as project:
        known = {item.name: item for item in result.tested}
        recogniser = load_recogniser(project.runs.recogniser_path(result.recogniser))
        (new,) = result.proposals
        prediction = recogniser.predict(project.demonstrations.load(new.id))
    assert set(known) == {item.name for item in tested}
    seconds = new.probability_trace.times
    for index in (0, 40, len(seconds) - 1):
        since = prediction.times - seconds[index]
        inside = (since > -0.01 - 1e-9) & (since < 0.01 - 1e-9)
        expected = prediction.probabilities[inside].mean(axis=0)
        assert new.probability_trace.values[index] / 255 == pytest.approx(expected, abs=0.003)
    assert new.predicted == from_codes(prediction.filtered, prediction.times, prediction.actions)


def test_the_final_recogniser_knows_all_that_is_labelled_and_proposes_for_the_rest(path, result):
    with Project.open(path) as project:
        recogniser = load_recogniser(project.runs.recogniser_path(result.recogniser))
        bare = [i.id for i in project.demonstrations.infos() if not i.labelled]
        stored = project.runs.recognisers()
    assert set(recogniser.trained_on) == {item.id for item in result.tested}
    assert [item.id for item in result.proposals] == bare
    assert result.proposals[0].human == ()
    assert set(result.proposals[0].stages) == {"raw", "threshold", "median", "filtered"}
    assert (stored[0].name, set(stored[0].demonstrations)) == ("foam", set(recogniser.trained_on))


def test_what_was_trained_is_stored_when_no_other_program_keeps_the_project_busy(
    tmp_path, monkeypatch
):
    path = make_labelled_project(tmp_path / "foam.forcelab")
    monkeypatch.setattr(Project, "open", partial(Project.open, timeout=0.02))
    with closing(sqlite3.connect(path / "project.sqlite", isolation_level=None)) as other:
        steps = []

        def note_step(step):
            steps.append(step.phase)
            if steps.count("storing") == 1 and steps[-1] == "storing":
                other.execute("BEGIN IMMEDIATE")
            elif steps.count("storing") == 3:
                other.execute("ROLLBACK")

        number = finish(review_job(path, BAYES_SETTINGS, FOAM_SELECTION, "foam"), note_step)
    assert steps.count("storing") == 3
    with Project.open(path) as project:
        assert [run.id for run in project.runs.summaries()] == [number]
        assert len(project.runs.recognisers()) == 1


def test_an_svm_without_probabilities_has_no_certainty():
    labelled = labelled_set(2, 100.0)
    settings = BAYES_SETTINGS.replace(classifier="svm", threshold=None, stride=5)
    tested = finish(leave_one_out_job(labelled, settings, probability_trace=True)).tested
    assert [item.probability_trace for item in tested] == [None, None]


def test_what_is_edited_while_it_trains_stays_and_is_counted(tmp_path):
    path = make_labelled_project(tmp_path / "p.forcelab", labelled=2, bare=0)
    job = review_job(path, BAYES_SETTINGS, FOAM_SELECTION, "foam")
    next(step for step in job if step.phase == "fold")
    with Project.open(path) as project:
        info = project.demonstrations.infos()[0]
        before = project.tracks.get(info.id, "Ada").segments
        project.tracks.edit(info.id, "Ada", before, before[1:], "deleted")
        demonstration, _ = synthetic_set(3, 100.0)[2]
        project.demonstrations.add(demonstration, [])
        number = finish(job)
        result = load_run(project, number)
        assert project.tracks.get(info.id, "Ada").segments == before[1:]
        assert result.find(info.id).human[0].action == before[0].action
        assert edits_since(project, result) == 2
        project.tracks.undo(info.id, "Ada")
        assert edits_since(project, result) == 1  # taken back: only the new demonstration


@pytest.mark.parametrize("which", [0, -1])
def test_what_is_removed_while_it_trains_costs_only_itself(tmp_path, which):
    path = make_labelled_project(tmp_path / "p.forcelab", labelled=3, bare=1)
    job = review_job(path, BAYES_SETTINGS, FOAM_SELECTION, "foam")
    next(step for step in job if step.phase == "fold")
    with Project.open(path) as project:
        gone = project.demonstrations.infos()[which].id
        heads = {
            name: project.tracks.head(gone, name)
            for name in project.demonstrations.info(gone).authors
        }
        project.demonstrations.remove_all({gone: heads})
        result = load_run(project, finish(job))
        left = {reviewed.id for reviewed in (*result.tested, *result.proposals)}
        assert left == {info.id for info in project.demonstrations.infos()}
        assert {used.demonstration for used in result.labels} == left


def test_a_training_that_is_cancelled_leaves_nothing_behind(tmp_path):
    path = make_labelled_project(tmp_path / "p.forcelab", labelled=3, bare=0)
    before = sorted(p.relative_to(path) for p in path.rglob("*"))
    threads = threading.active_count()
    for phase in ("features", "fold", "final fit"):
        with closing(
            run_in_process(review_job, path, BAYES_SETTINGS, FOAM_SELECTION, "foam")
        ) as job:
            next(step for step in job if getattr(step, "phase", "") == phase)
    with Project.open(path) as project:
        assert project.runs.summaries() == ()
        assert project.runs.recognisers() == ()
    assert sorted(p.relative_to(path) for p in path.rglob("*")) == before
    assert threading.active_count() == threads


def test_one_labelled_demonstration_trains_and_proposes_but_tests_nothing(tmp_path):
    path = make_labelled_project(tmp_path / "p.forcelab", labelled=1, bare=2)
    with Project.open(path) as project:
        result = load_run(
            project,
            finish(review_job(path, BAYES_SETTINGS, replace(FOAM_SELECTION, author="Ada"), "foam")),
        )
    assert result.tested == ()
    assert [item.name for item in result.proposals] == ["foam 02", "foam 03"]
    assert result.scores == {}
    assert any("Only one demonstration is labelled by Ada" in r for r in result.remarks)
    assert set(result.actions) == {"still", "grab", "hold", "release"}


def test_folds_that_cannot_be_trained_leave_the_final_recogniser(tmp_path):
    path = tmp_path / "p.forcelab"
    with Project.create(path) as project:
        for (demo, _), action in zip(synthetic_set(2, 100.0), ("grab", "hold"), strict=True):
            project.demonstrations.add(demo, [Track("Ada", (Segment(0.5, 1.5, action),))])
        result = load_run(project, finish(review_job(path, BAYES_SETTINGS, FOAM_SELECTION, "foam")))
    assert result.tested == ()
    assert set(result.actions) == {"grab", "hold"}
    assert any(remark.startswith("Nothing could be tested: With") for remark in result.remarks)


class Unstorable(GaussianNB):
    """Holds what no file can hold, as a classifier with a process of its own would."""

    def fit(self, X, y):
        self.lock = threading.Lock()
        return super().fit(X, y)


def test_scores_and_proposals_stay_where_no_file_can_hold_the_recogniser(tmp_path, monkeypatch):
    monkeypatch.setitem(plugins._named, "classifier", {})
    name = plugins.register_classifier(Unstorable)
    path = make_labelled_project(tmp_path / "p.forcelab")
    settings = BAYES_SETTINGS.replace(classifier=name)
    with Project.open(path) as project:
        result = load_run(project, finish(review_job(path, settings, FOAM_SELECTION, "foam")))
        assert project.runs.recognisers() == ()
    assert len(result.tested) == 3
    assert [item.name for item in result.proposals] == ["foam 04"]
    assert result.recogniser == ""
    assert any(
        remark.startswith(f"A recogniser with '{name}' cannot be kept in a file (")
        for remark in result.remarks
    )


@pytest.mark.parametrize(
    ("segments", "sentence"),
    [
        ((Segment(0.5, 1.5, "grab"),), "needs two actions and only 'grab' is labelled in foam"),
        ((), "Nothing is labelled yet"),
    ],
)
def test_too_few_actions_are_refused_in_a_sentence_that_says_what_can_be_done(
    tmp_path, segments, sentence
):
    path = tmp_path / "p.forcelab"
    with Project.create(path) as project:
        for demonstration, _ in synthetic_set(2, 100.0):
            project.demonstrations.add(demonstration, [Track("Ada", segments)])
        with pytest.raises(InputError, match=sentence):
            finish(review_job(path, BAYES_SETTINGS, FOAM_SELECTION, "foam"))
        assert project.runs.summaries() == ()


def test_a_recogniser_without_a_name_leaves_no_run_either(tmp_path):
    path = make_labelled_project(tmp_path / "p.forcelab", labelled=2, bare=0)
    with pytest.raises(InputError, match="needs a name"):
        finish(review_job(path, BAYES_SETTINGS, FOAM_SELECTION, " "))
    with Project.open(path) as project:
        assert (project.runs.summaries(), project.runs.recognisers()) == ((), ())


def test_an_action_of_a_single_demonstration_is_remarked(tmp_path):
    path = make_labelled_project(tmp_path / "p.forcelab", labelled=2, bare=0)
    with Project.open(path) as project:
        info = project.demonstrations.infos()[0]
        before = project.tracks.get(info.id, "Ada").segments
        slip = Segment(before[0].start, before[0].end, "slip")
        project.tracks.edit(info.id, "Ada", before, (slip, *before[1:]), "relabelled")
        result = load_run(project, finish(review_job(path, BAYES_SETTINGS, FOAM_SELECTION, "foam")))
    assert any("slip (only in foam 01)" in remark for remark in result.remarks)


def test_another_task_is_tested_on_and_both_tasks_get_proposals(tmp_path):
    path = make_labelled_project(tmp_path / "p.forcelab", labelled=2, bare=1)
    with Project.open(path) as project:
        for i, (demonstration, segments) in enumerate(synthetic_set(2, 100.0, "soft", seed=9)):
            project.demonstrations.add(demonstration, [Track("Ada", segments)] if i else [])
        choice = DataSelection(("foam",), test_task="soft")
        result = load_run(project, finish(review_job(path, BAYES_SETTINGS, choice, "foam")))
    assert [item.task for item in result.tested] == ["soft"]
    assert {item.task for item in result.proposals} == {"foam", "soft"}
    assert (result.tasks, result.test_task) == (("foam",), "soft")
    assert {used.demonstration for used in result.labels} >= {i.id for i in result.tested}


def test_the_time_left_is_what_the_fits_before_took():
    now = [0.0]
    steps = TrainingProgress(3, lambda: now[0])

    def job():
        yield Progress(1, 1, "features")
        for fold in range(3):
            for epoch in range(5):
                now[0] += 2.0
                yield FitProgress(epoch + 1, 200, f"fit {fold + 1} of 3", 0.5)

    left = [(step.fold, step.epoch, step.seconds_left) for step in steps.test(job())]
    assert all(seconds is None for fold, _, seconds in left if fold < 2)
    # Known to the first epoch after it: 12 s a fit, the first of the second being over.
    assert left[6] == (2, 1, pytest.approx(12 + 12 + 12))
    assert left[8] == (2, 3, pytest.approx(12 - 4 + 12 + 12))


def test_accepted_proposals_among_the_tested_labels_are_remarked_on(tmp_path):
    path = make_labelled_project(tmp_path / "foam.forcelab", labelled=2, bare=0)
    with Project.open(path) as project:
        first = project.demonstrations.infos()[0].id
        labels = project.tracks.get(first, "Ada").segments
        project.tracks.edit(first, "Ada", labels, (), "erased")
        project.tracks.edit(first, "Ada", (), labels, "accepted", proposed_by="model paper 1")
    number = finish(review_job(path, BAYES_SETTINGS, FOAM_SELECTION, "foam"))
    with Project.open(path) as project:
        remarks = load_run(project, number).remarks
    assert any(remark.startswith(f"{len(labels)} of ") for remark in remarks)
