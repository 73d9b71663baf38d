"""The trainer of the window: one at a time, on a snapshot, and the old result stays."""

from dataclasses import replace

import pytest
from factories import add_run, remove_demonstration, run_result_of
from window_helpers import (
    FakeTrainingBackend,
    open_training_document,
    run_summary,
    status_messages,
)

from forcelab.errors import InputError
from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.review import training_preferences
from forcelab.gui.review.tab import TrainingIndicator
from forcelab.gui.review.trainer import Trainer, default_author
from forcelab.gui.review.training_bar import TrainingBar
from forcelab.gui.review.training_preferences import TrainingChoice
from forcelab.labels import Segment
from forcelab.project import Project, Verdict
from forcelab.recognition import groups
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import Settings


@pytest.fixture
def document(app):
    with open_training_document() as document:
        yield document


def test_training_ends_with_the_run_in_the_document(trainer, document, work, until):
    assert trainer.edits is None
    assert trainer.train()
    assert trainer.training
    until(lambda: not trainer.training)
    assert document.review.run is work.result
    assert trainer.edits == 0
    assert [step.epoch for step in trainer.step_history] == [1, 2, 3]
    path, settings, choice, name = work.requests[0]
    assert path == document.project.path
    assert settings == preset(training_preferences.PRESET.default)
    assert choice.tasks == ("foam",)
    assert name == "foam"


def test_many_demonstrations_are_left_out_in_groups_unless_somebody_chose_otherwise(
    trainer, work, train, monkeypatch
):
    def train_and_get_choice():
        train()
        return work.requests[-1][2]

    assert train_and_get_choice().folds == 0
    monkeypatch.setattr(groups, "MANY", 0)
    assert train_and_get_choice().folds == 10
    trainer.set_choice(TrainingChoice(("foam",), folds=0))
    assert train_and_get_choice().folds == 0
    trainer.set_choice(TrainingChoice(("foam",), folds=4))
    trainer._choice = None  # as after a restart
    assert trainer.choice.folds == 4
    assert train_and_get_choice().folds == 4


def test_cancel_answers_at_once_and_the_old_result_stays(trainer, document, work, until, train):
    train()
    old = document.review.run
    work.gate = False
    work.result = run_result_of(document.project, 2)
    trainer.train()
    until(lambda: len(work.requests) == 2)  # what never began is not closed either
    trainer.cancel()
    assert not trainer.training
    until(lambda: work.closed == 2)
    until(lambda: not trainer.jobs.busy)
    assert document.review.run is old
    assert not trainer.trouble


def test_a_refusal_is_a_sentence_and_the_old_result_stays(trainer, document, work, train):
    train()
    old = document.review.run
    messages = status_messages(document)
    work.result = InputError("Only 'grab' is labelled; label a second action.")
    train()
    assert trainer.trouble == "Only 'grab' is labelled; label a second action."
    assert messages == [(trainer.trouble, True)]  # seen in whichever workspace is in front
    assert document.review.run is old
    trainer.dismiss()
    assert not trainer.trouble


def test_edits_of_labels_that_are_hidden_are_not_counted(trainer, document, train):
    train()
    project, id_ = document.project, document.review.run.tested[0].id
    project.tracks.edit(id_, "Ann", project.tracks.get(id_, "Ann").segments, (), "began anew")
    project.coding.assign(id_, "Bob", blind=True)
    document.set_author("Bob")
    trainer._counter.count()
    assert trainer.edits == 0
    project.coding.set_done(id_, "Bob", True)
    trainer._counter.count()
    assert trainer.edits == 1


def test_after_a_long_training_none_comes_by_itself_for_as_long(
    trainer, document, work, until, monkeypatch
):
    now = [1000.0]
    monkeypatch.setattr("forcelab.gui.review.trainer.monotonic", lambda: now[0])
    trainer.pause.setInterval(1)
    trainer.set_automatic(True)
    work.gate = False
    trainer.train()
    now[0] += 240.0  # it takes four minutes
    work.gate = True
    until(lambda: not trainer.training)
    document.editor.paint(6.0, 7.0, "grab")
    until(lambda: trainer.edits == 1)
    fired = []
    trainer.pause.timeout.connect(lambda: fired.append(None))
    until(lambda: len(fired) > 3)
    assert len(work.requests) == 1
    now[0] += 239.0
    until(lambda: len(fired) > 6)
    assert len(work.requests) == 1
    now[0] += 2.0
    until(lambda: len(work.requests) == 2)


def test_of_runs_that_came_by_themselves_the_last_ones_stay_and_those_that_were_used(
    trainer, document, work, until
):
    project = document.project
    trainer.pause.setInterval(1)
    trainer.set_automatic(True)
    requested = add_run(project)
    for number in range(6):
        work.result = run_result_of(project, add_run(project))
        document.editor.paint(6.0, 7.0 + number / 10, "grab")
        until(lambda: document.review.run is work.result and not trainer.training)
        if number == 1:
            judged = work.result.number
            project.coding.add_verdict(
                Verdict(
                    document.id,
                    6.0,
                    7.0,
                    "grab",
                    "hold",
                    author="Bea",
                    coder="Ann",
                    verdict="human",
                    run=judged,
                )
            )
    stored = [run.id for run in project.runs.summaries()]
    assert stored[:2] == [requested, judged]
    assert stored[2:] == list(range(work.result.number - 2, work.result.number + 1))
    assert [verdict.run for verdict in project.coding.verdicts()] == [judged]


def test_a_run_that_somebody_asked_for_while_it_was_made_by_itself_stays(
    trainer, document, work, until
):
    project = document.project
    trainer.pause.setInterval(1)
    trainer.set_automatic(True)
    for number in range(5):
        work.gate = number != 0
        work.result = run_result_of(project, add_run(project))
        document.editor.paint(6.0, 7.0 + number / 10, "grab")
        if number == 0:
            requested = work.result.number
            until(lambda: trainer.training)
            assert not trainer.train()  # Train is pressed
            work.gate = True
        until(lambda: document.review.run is work.result and not trainer.training)
    stored = [run.id for run in project.runs.summaries()]
    assert stored[0] == requested
    assert len(stored) == 4  # the last three that came by themselves besides


def test_without_an_edit_nothing_is_trained_by_itself(trainer, document, work, app, train):
    train()
    trainer.pause.setInterval(1)
    trainer.set_automatic(True)
    document.open_demonstration(document.infos[1].id)  # tells of tracks, and is no edit
    for _ in range(50):
        app.processEvents()
    trainer.pause.timeout.emit()
    assert len(work.requests) == 1


def test_what_was_painted_meanwhile_is_trained_next(trainer, document, work, until):
    work.gate = False
    trainer.pause.setInterval(20)
    trainer.train()
    trainer.set_automatic(True)
    document.editor.paint(6.0, 7.0, "grab")
    document.editor.paint(7.0, 8.0, "hold")
    until(lambda: trainer.pause.isActive() is False)
    assert len(work.requests) == 1  # not while the first one is under way
    work.gate = True
    until(lambda: len(work.requests) == 2)
    work.result = run_result_of(document.project, 2)
    until(lambda: not trainer.training and trainer.edits == 0)


def test_a_reopened_project_shows_its_last_result(document, work, jobs, until):
    work.runs = (run_summary(9, "stylus"), run_summary(7, "foam"), run_summary(3, "foam"))
    work.outcomes = {n: run_result_of(document.project, n, "foam") for n in (3, 7)}
    trainer = Trainer(document, jobs, backend=work)
    until(lambda: document.review.run is not None)
    assert document.review.run.number == 7
    trainer.show_run(3)
    until(lambda: document.review.run.number == 3)
    assert work.loaded == [7, 3]
    document.close()
    assert trainer.runs == ()
    assert trainer.edits is None


def test_a_task_s_own_run_comes_before_a_later_one_that_tested_another_task(document, work, until):
    across = run_summary(9, "foam", test_task="stylus")
    onto = run_summary(5, "stylus", test_task="foam")
    for runs, number in (
        ((across, onto, run_summary(3, "foam")), 3),
        ((across, onto), 5),
        ((across,), 9),
    ):
        work.runs = runs
        work.outcomes = {number: run_result_of(document.project, number, "foam")}
        document.review.set_run(None)
        jobs = Jobs()
        trainer = Trainer(document, jobs, backend=work)
        until(lambda: document.review.run is not None)
        assert document.review.run.number == number
        assert trainer.runs == runs
        jobs.close()


def test_a_run_of_another_task_that_is_chosen_turns_to_that_task(
    trainer, document, work, until, app
):
    work.outcomes = {
        4: run_result_of(document.project, 4, "stylus"),
        5: run_result_of(document.project, 5, "stylus", test_task="foam", title="stylus to foam"),
    }
    assert trainer.task == "foam"
    trainer.show_run(5)
    until(lambda: document.review.run is work.outcomes[5])
    assert trainer.task == "foam"  # which it tests
    trainer.show_run(4)
    until(lambda: document.review.run is work.outcomes[4])
    assert trainer.task == "stylus"
    assert trainer.train()
    assert work.requests[-1][2].tasks == ("stylus",)
    trainer.cancel()
    trainer.show_run(4)
    trainer.set_task("foam")  # which has no run: what is still read for the other task is late
    until(lambda: not trainer.jobs.busy)
    for _ in range(50):
        app.processEvents()
    assert (trainer.task, document.review.run) == ("foam", None)


def test_of_two_runs_that_are_removed_at_once_both_go(trainer, document, until):
    project = document.project
    numbers = [add_run(project) for _ in range(2)]
    document.review.set_run(run_result_of(project, numbers[0]))
    for number in numbers:
        trainer.remove_run(number)
    until(lambda: not trainer.jobs.busy)
    until(lambda: document.review.run is None)
    assert not project.runs.all()


def test_a_removed_demonstration_leaves_the_review_at_once(trainer, document, work, until):
    project = document.project
    document.review.set_run(run_result_of(project, 4))
    first, *others = [result.id for result in document.review.run.tested]
    remove_demonstration(project, first)
    work.outcomes = {4: run_result_of(project, 4)}
    document.reread()
    until(lambda: document.review.run is work.outcomes[4])
    assert [result.id for result in document.review.run.tested] == others
    assert work.loaded == [4]
    document.refresh_listing()
    assert not trainer.jobs.busy  # nothing more is gone


def test_where_all_that_was_tested_is_removed_nothing_is_reviewed(
    trainer, document, work, until, monkeypatch
):
    def refuse_load(_path, number):
        yield None
        raise InputError(f"All demonstrations that run {number} tested were removed.")

    monkeypatch.setattr(work, "load", refuse_load)
    project = document.project
    document.review.set_run(run_result_of(project, 4))
    for result in (*document.review.run.tested, *document.review.run.proposals):
        remove_demonstration(project, result.id)
    document.reread()
    until(lambda: document.review.run is None)
    assert "removed" in trainer.trouble


def test_each_task_has_its_own_settings_and_choice(trainer, document, work, until):
    trainer.set_settings(Settings(stride=10))
    trainer.set_choice(TrainingChoice(("foam", "stylus"), apart=True))
    stylus = next(info.id for info in document.infos if info.task == "stylus")
    document.open_demonstration(stylus)
    assert trainer.task == "stylus"
    assert trainer.settings == preset(training_preferences.PRESET.default)
    assert trainer.choice == TrainingChoice(("stylus",))
    trainer.set_task("foam")
    assert trainer.settings == Settings(stride=10)
    assert trainer.choice == TrainingChoice(("foam", "stylus"), apart=True)


def test_settings_and_choice_are_remembered_for_the_next_time(trainer, document, work, until):
    trainer.set_settings(Settings(stride=7, merge=Settings().merge))
    trainer.set_choice(TrainingChoice(("foam",), "stylus", "Ann"))
    trainer.set_automatic(True)
    again = Trainer(document, trainer.jobs, backend=work)
    assert again.settings.stride == 7
    assert again.choice == TrainingChoice(("foam",), "stylus", "Ann")
    assert again.automatic
    trainer.set_automatic(False)


def test_the_choice_is_read_once_for_each_task(trainer, monkeypatch):
    read, recall = [], training_preferences.recall_choice
    monkeypatch.setattr(
        training_preferences, "recall_choice", lambda *of: read.append(of[1]) or recall(*of)
    )
    for task in ("other", "foam", "other"):
        trainer.set_task(task)
        read.clear()
        assert [trainer.choice.tasks for _ in range(3)] == [(task,)] * 3
        assert len(read) <= 1


def test_broken_settings_do_not_stand_in_the_way(trainer, document, work):
    path = document.project.path
    settings.store(training_preferences._task_key(path, "foam", "settings"), '{"stride": -3}')
    settings.store(training_preferences._task_key(path, "foam", "choice"), '{"tasks": 5}')
    again = Trainer(document, trainer.jobs, backend=work)
    assert again.settings == preset(training_preferences.PRESET.default)
    assert again.choice == TrainingChoice(("foam",))


def test_the_coders_own_labels_are_trained_on_where_there_are_some(trainer, document, work, train):
    train()
    assert work.requests[-1][2].author == "Ann"
    messages = status_messages(document)
    document.set_author("Ben")  # has no labels: those of who labelled most, and it is said
    train()
    assert work.requests[-1][2].author == "Ann"
    assert any("Ben" in text and "Ann" in text for text, _ in messages)
    trainer.set_choice(TrainingChoice(("foam",), author="Ann"))
    train()
    assert work.requests[-1][2].author == "Ann"


def test_a_result_of_another_project_is_thrown_away(trainer, document, work, until):
    work.gate = False
    trainer.train()
    document.close()
    work.gate = True
    until(lambda: not trainer.jobs.busy)
    assert document.review.run is None
    assert not trainer.training
    assert not trainer.train()
    assert "import" in trainer.trouble


def test_labels_painted_while_it_trains_are_not_overwritten(trainer, document, work, until):
    work.gate = False
    trainer.train()
    document.editor.paint(8.0, 9.0, "grab")
    work.gate = True
    until(lambda: not trainer.training)
    assert document.editor.segments[-1] == Segment(8.0, 9.0, "grab")
    until(lambda: trainer.edits == 1)


def test_the_status_bar_says_in_other_workspaces_how_training_stands(
    trainer, document, work, until
):
    line = TrainingIndicator(trainer)
    assert line.isHidden()  # nothing was trained
    work.gate = False
    trainer.train()
    until(lambda: trainer.step is not None and trainer.step.epoch == 3)
    assert not line.isHidden()
    assert "epoch 3" in line.text()
    line.set_elsewhere(False)  # the review says it itself
    assert line.isHidden()
    line.set_elsewhere(True)
    work.gate = True
    until(lambda: not trainer.training and trainer.edits == 0)
    assert line.text() == "Recogniser: up to date"
    document.editor.paint(6.0, 7.0, "grab")
    until(lambda: trainer.edits == 1)
    assert line.text().startswith("Recogniser: 1 change since")


@pytest.mark.parametrize("removed", [False, True])
def test_where_no_recogniser_is_kept_none_is_said_to_be_up_to_date(
    trainer, document, work, until, removed
):
    """Of what was only evaluated, or where it was removed: Capture says that there is none."""
    line, bar = TrainingIndicator(trainer), TrainingBar(document, trainer)
    if removed:
        document.project.runs.remove_recogniser(work.result.recogniser)
    else:
        work.result = replace(work.result, recogniser="")
    document.review.set_run(work.result)
    until(lambda: trainer.edits == 0)
    assert line.text() == "Run 1: up to date, no recogniser kept"
    assert bar.freshness.text == "up to date, no recogniser kept"
    document.editor.paint(6.0, 7.0, "grab")
    until(lambda: trainer.edits == 1)
    assert line.text() == "Run 1: 1 change since this run"
    assert bar.freshness.text == "1 change since this run"
    bar.deleteLater()


@pytest.mark.parametrize("has_recogniser", [True, False])
def test_what_was_trained_with_other_settings_is_not_said_to_be_up_to_date(
    trainer, document, work, until, has_recogniser
):
    line, bar = TrainingIndicator(trainer), TrainingBar(document, trainer)
    line.set_elsewhere(True)
    document.review.set_run(work.result if has_recogniser else replace(work.result, recogniser=""))
    until(lambda: trainer.edits == 0)
    words = (
        "trained with other settings" if has_recogniser else "other settings, no recogniser kept"
    )
    trainer.set_settings(preset("fast"))
    assert line.text() == f"{'Recogniser' if has_recogniser else 'Run 1'}: {words}"
    assert bar.freshness.text == words
    trainer.set_settings(preset(training_preferences.PRESET.default))
    assert "up to date" in line.text()
    assert "up to date" in bar.freshness.text
    bar.deleteLater()


def test_who_labelled_most_is_trained_on(document):
    project = document.project
    other = [info for info in document.infos if info.task == "foam"][:1]
    for info in other:
        project.tracks.edit(
            info.id, "Cleo", (), project.tracks.get(info.id, "Ann").segments, "made"
        )
    document.set_author("Ben")
    document.refresh_listing()
    assert default_author(document, {"foam"}) == "Ann"
    document.set_author("Cleo")  # a single one, as after accepting a proposal, is no training
    assert default_author(document, {"foam"}) == "Ann"
    another = next(i for i in document.infos if i.task == "foam" and i.id != other[0].id)
    begun = project.tracks.get(another.id, "Ann").segments[:1]
    project.tracks.edit(another.id, "Cleo", (), begun, "made")
    document.refresh_listing()
    assert default_author(document, {"foam"}) == "Ann"  # the second one was only begun
    project.tracks.edit(
        another.id, "Cleo", begun, project.tracks.get(another.id, "Ann").segments, "made"
    )
    document.refresh_listing()
    assert default_author(document, {"foam"}) == "Cleo"
    assert default_author(document, {"no such task"}) is None


def test_who_alone_has_labelled_trains_on_a_single_demonstration(document):
    for info in document.infos:
        before = document.project.tracks.get(info.id, "Ann").segments
        document.project.tracks.edit(info.id, "Ann", before, (), "began anew")
    document.refresh_listing()
    document.set_author("Cleo")
    assert default_author(document, {"foam"}) is None
    document.editor.paint(0.0, 1.0, "grab")  # which the list does not tell yet
    assert default_author(document, {"foam"}) == "Cleo"


def test_what_was_trained_on_another_coder_is_not_up_to_date(
    trainer, document, work, until, app, train
):
    line = TrainingIndicator(trainer)
    line.set_elsewhere(True)
    train()
    assert line.text() == "Recogniser: up to date"
    trainer.pause.setInterval(20)
    trainer.set_automatic(True)
    document.set_author("Nora")
    for info in document.infos:
        labels = document.project.tracks.get(info.id, "Ann").segments
        document.project.tracks.edit(info.id, "Nora", (), labels, "made")
    document.refresh_listing()
    document.editor.paint(2.0, 3.0, "hold")
    assert trainer.reviewed_author == "Ann"
    assert line.text() == "Recogniser: trained on the labels of Ann"
    work.result = run_result_of(document.project, 2, author="Nora")
    until(lambda: len(work.requests) == 2)  # by itself, though no label of Ann's was edited
    until(lambda: not trainer.training)
    assert work.requests[-1][2].author == "Nora"
    assert line.text() == "Recogniser: up to date"


def test_demonstrations_of_no_task_are_trained_too(jobs, until):
    work = FakeTrainingBackend()
    with open_training_document(tasks=("",)) as document:
        work.result = run_result_of(document.project, task="", title="no task")
        trainer = Trainer(document, jobs, backend=work)
        bar = TrainingBar(document, trainer)
        until(lambda: not jobs.busy)
        assert bar.train.isEnabled()
        assert bar.task.currentText() == "no task"
        assert trainer.train()
        until(lambda: not trainer.training)
        assert document.review.run is work.result
        _, _, choice, name = work.requests[0]
        assert (choice.tasks, name) == (("",), "no task")
        document.close()


def test_without_demonstrations_there_is_nothing_to_train_on(jobs, tmp_path):
    Project.create(tmp_path / "empty.forcelab").close()
    document = Document("Ann")
    document.open_project(tmp_path / "empty.forcelab")
    trainer = Trainer(document, jobs, backend=FakeTrainingBackend())
    assert not trainer.train()
    assert "import demonstrations" in trainer.trouble
    document.close()
