"""The training bar: what it says, and that nothing is cut off where there is little room."""

from dataclasses import replace
from itertools import pairwise

import pytest
from factories import add_run, run_result_of
from PySide6.QtCore import Qt
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMenu
from window_helpers import open_training_document, run_summary, training_step

from forcelab.errors import InputError
from forcelab.gui.removal_dialog import Removal
from forcelab.gui.review.settings_dialog import SettingsDialog
from forcelab.gui.review.training_backend import run_text
from forcelab.gui.review.training_bar import TrainingBar
from forcelab.gui.review.training_preferences import TrainingChoice
from forcelab.labels import Segment
from forcelab.project import Verdict
from forcelab.recognition.settings import Settings


@pytest.fixture
def document(app):
    with open_training_document() as document:
        yield document


@pytest.fixture
def bar(document, trainer, show, app):
    bar = show(TrainingBar(document, trainer), 1300, 40)
    app.processEvents()
    return bar


def test_the_button_trains_and_cancel_answers_at_once(bar, trainer, work, until):
    work.gate = False
    assert bar.freshness.text == "not trained yet"
    bar.train.click()
    until(lambda: trainer.step is not None)
    assert bar.cancel.isVisible()
    assert bar.progress.isVisible()
    assert not bar.train.isVisible()
    bar.cancel.click()
    assert bar.train.isVisible()
    assert bar.train.isEnabled()
    assert not bar.progress.isVisible()


def test_a_click_on_train_leaves_the_keyboard_where_it_is(bar, trainer, work, until):
    work.gate = False
    bar.task.setFocus()
    QTest.mouseClick(bar.train, Qt.MouseButton.LeftButton)
    until(lambda: trainer.step is not None)
    assert not bar.train.isVisible()
    assert bar.focusWidget() is bar.task
    bar.cancel.click()
    bar.train.setFocus()
    QTest.keyClick(bar.train, Qt.Key.Key_Space)
    until(lambda: trainer.step is not None)
    assert bar.focusWidget() is bar.cancel
    QTest.keyClick(bar.cancel, Qt.Key.Key_Space)
    assert bar.focusWidget() is bar.train


def test_it_says_how_far_the_training_is(bar, trainer, work, until):
    work.gate = False
    work.steps = [training_step(epoch=41, fold=3, folds=10, seconds_left=12.2)]
    trainer.train()
    until(lambda: bar.step_text.text == "fold 3 of 10 · epoch 41 · 12 s left")
    assert bar.progress.value() / bar.progress.maximum() == pytest.approx(341 / 1200)


def test_how_up_to_date_the_recogniser_is_always_stands_there(bar, trainer, document, until):
    trainer.train()
    until(lambda: not trainer.training)
    assert bar.freshness.text == "up to date"
    document.editor.paint(6, 7, "grab")
    until(lambda: bar.freshness.text.startswith("1 change since"))
    document.editor.paint(7, 8, "hold")
    until(lambda: bar.freshness.text.startswith("2 changes since"))
    for width in (1300, 700, 420):
        bar.resize(width, 40)
        assert bar.freshness.isVisible()


def test_whose_labels_are_trained_on_stands_beside_the_button_among_several(
    bar, trainer, document, until, app
):
    assert bar.author.text == ""
    assert not bar.author.isVisible()
    document.set_author("Root")
    assert bar.author.text == "Labels by Ann"  # Root has labelled nothing yet
    document.editor.paint(0, 3, "grab")
    assert bar.author.text == "Labels by Ann"  # of one demonstration, while Ann has more
    other = next(i for i in document.infos if i.task == "foam" and i.id != document.id)
    document.project.tracks.edit(other.id, "Root", (), (Segment(0.0, 3.0, "grab"),), "made")
    document.refresh_listing()
    until(lambda: bar.author.text == "Labels by Root")
    assert bar.author.isVisible()
    assert "Labels by Root" in bar.train.toolTip()
    document.set_author("Ann")
    assert bar.author.text == "Labels by Ann"
    for width in (1300, 700, 420):
        bar.resize(width, 40)
        app.processEvents()
        assert not bar.author.isVisible() or bar.author.width() >= bar.author.sizeHint().width()
    trainer.train()
    until(lambda: not trainer.training)
    assert trainer._backend.requests[-1][2].author == "Ann"


LONG_NAME = "Wilhelmina Featherstonehaugh-Cholmondeley"


@pytest.fixture
def two_coders(document):
    """Ann has labelled 01 and 02, another coder 02 and 03 of the foam."""
    ids = [info.id for info in document.infos if info.task == "foam"]
    for id_ in ids[1:]:
        document.project.tracks.edit(id_, LONG_NAME, (), (Segment(0.0, 3.0, "grab"),), "made")
    document.refresh_listing()


def test_another_coder_can_be_learnt_from_as_well(bar, trainer, two_coders, until, app):
    until(lambda: trainer.other_coders)
    assert trainer.other_coders == {LONG_NAME: 1}
    assert bar.also.isVisible()
    assert bar.also.currentText() == "Also learn from: no other coder"
    assert [bar.also.itemText(i) for i in range(3)] == [
        "Also learn from: no other coder",
        f"Also learn from: {LONG_NAME} (1)",
        "Merge map…",
    ]
    bar.also.activated.emit(1)
    assert trainer.also_from == LONG_NAME
    assert LONG_NAME in bar.also.toolTip()
    assert bar.also.shown_text.startswith("Also learn from: Wil")
    trainer.train()
    until(lambda: not trainer.training)
    assert trainer._backend.requests[-1][2].also_from == LONG_NAME
    bar.resize(420, 40)
    app.processEvents()
    assert not bar.also.isVisible()
    bar.overflow_button.menu().aboutToShow.emit()
    menu = next(a.menu() for a in bar.overflow_button.menu().actions() if "Also" in a.text())
    assert [(a.text(), a.isChecked()) for a in menu.actions()] == [
        ("no other coder", False),
        (f"{LONG_NAME} (1)", True),
    ]
    menu.actions()[0].trigger()
    assert trainer.also_from is None


def test_the_merge_map_is_below_the_other_coders(bar, trainer, two_coders, until, app):
    until(lambda: trainer.other_coders)
    bar.also.activated.emit(2)
    dialog = next(w for w in app.topLevelWidgets() if isinstance(w, SettingsDialog))
    editor = dialog.form.editors["merge"]
    until(lambda: not editor.visibleRegion().isEmpty())
    dialog.reject()
    assert bar.also.currentText() == "Also learn from: no other coder"


def test_nobody_is_offered_who_adds_nothing_or_must_not_be_seen(
    bar, trainer, document, two_coders, until
):
    until(lambda: trainer.other_coders)
    trainer.set_also_from(LONG_NAME)
    trainer.set_choice(replace(trainer.choice, test_task="stylus"))
    assert trainer.also_from is None
    assert not bar.also.isVisible()
    trainer.set_choice(replace(trainer.choice, test_task=None))
    assert trainer.also_from == LONG_NAME
    third = [info.id for info in document.infos if info.task == "foam"][2]
    document.project.coding.assign(third, "Ann", blind=True)
    document.refresh_listing()
    assert trainer.other_coders == {}
    assert trainer.also_from is None


@pytest.mark.parametrize("training", [False, True])
def test_at_no_width_is_anything_cut_off(bar, trainer, work, two_coders, until, app, training):
    work.runs = tuple(run_summary(n) for n in range(1, 4))
    trainer.list_runs()
    until(lambda: trainer.runs)
    if training:
        work.gate = False
        trainer.train()
        until(lambda: trainer.step is not None)
    for width in (1600, 1000, 700, 560):
        bar.resize(width, 40)
        app.processEvents()
        shown = [w for w in (*bar._parts, bar.overflow_button) if w.isVisible()]
        boxes = sorted((w.geometry() for w in shown), key=lambda box: box.left())
        assert boxes[-1].right() <= width
        assert all(a.right() < b.left() for a, b in pairwise(boxes))
        for widget in shown:
            assert widget.width() >= widget.minimumSizeHint().width()


def test_what_has_no_room_is_in_the_menu(bar, trainer, work, until, app):
    work.runs = (run_summary(2), run_summary(1))
    work.outcomes = {n: run_result_of(trainer.document.project, n) for n in (1, 2)}
    trainer.list_runs()
    until(lambda: trainer.document.review.run is not None)
    bar.resize(420, 40)
    app.processEvents()
    assert not bar.settings.isVisible()
    assert bar.overflow_button.isVisible()
    bar.overflow_button.menu().aboutToShow.emit()
    texts = [action.text() for action in bar.overflow_button.menu().actions()]
    assert texts == [
        "Train automatically after edits",
        "Settings…",
        "Review another run",
        "Compare two runs…",
    ]
    bar.overflow_button.menu().actions()[2].menu().actions()[1].trigger()
    until(lambda: trainer.document.review.run.number == 1)
    bar.overflow_button.menu().actions()[0].trigger()
    assert trainer.automatic
    assert bar.automatic.isChecked()
    bar.resize(1600, 40)
    assert not bar.overflow_button.isVisible()


def test_a_refusal_stands_beneath_until_it_is_dismissed(bar, trainer, work, until):
    work.result = InputError("Only 'grab' is labelled; label a second action.")
    trainer.train()
    until(bar.trouble_row.isVisible)
    assert "second action" in bar.trouble.text()
    bar.dismiss.click()
    assert not bar.trouble_row.isVisible()


def test_what_training_hides_hands_the_keyboard_to_what_cancels_it(bar, trainer, work, until):
    """Not to whatever comes next in the window: in a field, letters would be typed."""
    bar.activateWindow()
    work.gate = False
    bar.settings.setFocus()
    trainer.train()
    assert bar.cancel.hasFocus()
    work.gate = True
    until(lambda: not trainer.training)
    assert bar.train.hasFocus()


def test_the_runs_can_be_chosen(bar, trainer, work, document, until):
    work.runs = (run_summary(2, f1=None), run_summary(1))
    work.outcomes = {n: run_result_of(document.project, n) for n in (1, 2)}
    trainer.list_runs()
    until(lambda: bar.runs.currentData() == 2)
    assert "F1 90 %" in bar.runs.itemText(1)
    assert "F1" not in bar.runs.itemText(0)
    assert bar.runs.itemText(0).startswith("2: foam · 01 Mar")
    text = run_text(run_summary(7, preset="fast"))  # two runs of a task are told apart
    assert text.startswith("7: foam · fast · F1 90 %")
    bar.runs.activated.emit(1)
    until(lambda: document.review.run.number == 1)
    assert bar.runs.currentData() == 1
    bar.runs.resize(400, 30)
    assert bar.runs.shown_text == bar.runs.currentText() == run_text(run_summary(1))
    bar.runs.resize(120, 30)
    assert bar.runs.shown_text.endswith("…")  # never just cut off
    assert bar.runs.currentText() in bar.runs.toolTip()


def test_the_run_that_is_reviewed_is_removed_once_that_is_agreed_to(
    bar, trainer, work, document, until, app
):
    project = document.project
    numbers = [add_run(project, n=n) for n in range(3)]
    id_ = project.demonstrations.infos("foam")[0].id
    verdict = Verdict(
        id_, 0.0, 1.0, "grab", "hold", author="Bob", coder="Ann", verdict="model", run=numbers[2]
    )
    project.coding.add_verdict(verdict)
    work.runs = tuple(run_summary(n) for n in reversed(numbers))
    work.outcomes = {n: run_result_of(project, n) for n in numbers}
    trainer.list_runs()
    until(lambda: bar.runs.currentData() == numbers[2])

    def ask_removal():
        bar.runs.ask_removal()
        return [removal for removal in bar.findChildren(Removal) if removal.isVisible()][-1]

    middle = bar.runs.rect().center()
    where = bar.runs.mapToGlobal(middle)
    app.sendEvent(bar.runs, QContextMenuEvent(QContextMenuEvent.Reason.Mouse, middle, where))
    (menu,) = bar.runs.findChildren(QMenu)
    (action,) = menu.actions()
    assert action.text() == "Remove this run…"
    assert action.isEnabled()
    menu.close()
    dialog = ask_removal()
    assert run_text(run_summary(numbers[2])) in dialog.text.text()
    assert "Verdicts were given on it (1)" in dialog.text.text()
    dialog.reject()
    until(lambda: not trainer.jobs.busy)
    assert [run.id for run in project.runs.summaries()] == numbers
    ask_removal().remove.click()
    until(lambda: document.review.run is not None and document.review.run.number == numbers[1])
    until(lambda: bar.runs.currentData() == numbers[1])
    assert bar.runs.count() == 2
    assert [run.id for run in project.runs.summaries()] == numbers[:2]
    assert [verdict.run for verdict in project.coding.verdicts()] == [None]
    assert "accepted" not in ask_removal().text.text()
    assert "Verdicts" not in ask_removal().text.text()


def test_a_run_that_cannot_be_read_is_not_said_to_be_reviewed(bar, trainer, work, document, until):
    work.runs = (run_summary(2), run_summary(1))
    work.outcomes = {2: run_result_of(document.project, 2)}
    trainer.list_runs()
    until(lambda: bar.runs.currentData() == 2)
    bar.runs.setCurrentIndex(1)
    bar.runs.activated.emit(1)
    assert bar.runs.currentData() == 2
    assert bar.runs.currentIndex() == 0


def test_settings_and_tasks_are_named_as_they_were_changed(bar, trainer, until):
    assert bar.settings.text() == "Settings: ensemble…"
    trainer.set_settings(Settings(stride=10))
    assert bar.settings.text() == "Settings: paper, changed…"
    trainer.set_choice(TrainingChoice(("foam", "stylus"), apart=True))
    assert bar.task.currentText() == "foam + stylus, kept apart"
    bar.task.activated.emit(1)
    assert trainer.task == "stylus"
    assert bar.settings.text() == "Settings: ensemble…"
    assert bar.task.currentText() == "stylus"


def test_the_dialogs_set_what_was_chosen(bar, trainer, app):
    from PySide6.QtWidgets import QDialog

    bar.open_settings()
    dialog = next(w for w in app.topLevelWidgets() if isinstance(w, QDialog) and w.isVisible())
    dialog.open_form()
    dialog.form.editors["stride"].box.setValue(5)
    dialog.accept()
    assert trainer.settings.stride == 5
    bar.task.activated.emit(bar.task.count() - 1)
    dialog = next(w for w in app.topLevelWidgets() if isinstance(w, QDialog) and w.isVisible())
    dialog.boxes["stylus"].setChecked(True)
    dialog.accept()
    assert trainer.choice.tasks == ("foam", "stylus")


def test_without_a_project_there_is_nothing_to_press(bar, document):
    document.close()
    assert not bar.train.isEnabled()
    assert not bar.settings.isEnabled()
    assert bar.freshness.text == "not trained yet"
