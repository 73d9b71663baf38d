"""Choosing tasks: what can be trained and tested, and what cannot says why."""

import pytest
from window_helpers import open_training_document

from forcelab.gui.review.task_choice import TaskChoiceDialog
from forcelab.gui.review.trainer import OWN_MINIMUM, default_author
from forcelab.gui.review.training_preferences import TrainingChoice
from forcelab.labels import Segment
from forcelab.recognition import groups


@pytest.fixture
def document(app):
    with open_training_document() as document:
        yield document


@pytest.fixture
def ask(document, show):
    return lambda choice: show(TaskChoiceDialog(document, choice))


@pytest.fixture
def form(ask):
    return ask(TrainingChoice(("foam",)))


@pytest.mark.parametrize(
    "choice",
    [
        TrainingChoice(("foam",)),
        TrainingChoice(("foam", "stylus"), apart=True),
        TrainingChoice(("foam", "stylus")),
        TrainingChoice(("foam",), "stylus"),
        TrainingChoice(("stylus",), author="Ann"),
        TrainingChoice(("stylus",), folds=0),
        TrainingChoice(("stylus",), folds=5),
    ],
)
def test_what_is_shown_is_what_was_given(ask, choice):
    form = ask(choice)
    assert form.choice() == choice
    assert not form.trouble


def test_how_actions_are_shared_is_asked_of_several_joined_tasks_only(form):
    assert not form.apart.isVisible()
    form.boxes["stylus"].setChecked(True)
    assert form.apart.isVisible()
    form.apart.setChecked(True)
    assert form.choice() == TrainingChoice(("foam", "stylus"), apart=True)
    form.boxes["stylus"].setChecked(False)
    assert form.choice() == TrainingChoice(
        ("foam",)
    )  # a task by itself has nothing to be kept apart from


def test_how_many_are_left_out_is_shown_and_chosen(ask, form, monkeypatch):
    assert form.leave_out.isChecked()  # two are not many
    form.in_groups.setChecked(True)
    assert form.choice() == TrainingChoice(("foam",), folds=10)
    form.leave_out.setChecked(True)
    assert form.choice() == TrainingChoice(("foam",), folds=0)
    monkeypatch.setattr(groups, "MANY", 1)
    many = ask(TrainingChoice(("foam",)))
    assert many.in_groups.isChecked()
    assert many.choice() == TrainingChoice(("foam",))  # nobody has chosen yet
    five = ask(TrainingChoice(("foam",), folds=5))
    assert "5 groups" in five.in_groups.text()


def test_a_task_cannot_be_trained_on_and_tested(form):
    form.across.setChecked(True)
    assert form.choice().test_task == "stylus"  # the other one is offered
    assert not form.trouble
    form.test_task.setCurrentIndex(form.test_task.findData("foam"))
    assert "'foam' is trained on" in form.trouble
    form.boxes["foam"].setChecked(False)
    form.boxes["stylus"].setChecked(True)
    assert not form.trouble
    assert form.choice() == TrainingChoice(("stylus",), "foam")


def test_no_task_is_no_choice(form):
    form.boxes["foam"].setChecked(False)
    assert "choose a task" in form.trouble


def test_with_one_labelled_demonstration_it_says_what_can_be_done_anyway(show):
    with open_training_document(labelled=("01",)) as document:
        dialog = show(TaskChoiceDialog(document, TrainingChoice(("foam",))))
        assert "nothing can be tested" in dialog._explanation.text()
        assert dialog.ok.isEnabled()
        dialog.across.setChecked(True)
        assert "nothing can be tested" not in dialog._explanation.text()


def test_what_nobody_labelled_cannot_be_trained(show):
    with open_training_document(labelled=()) as document:
        dialog = show(TaskChoiceDialog(document, TrainingChoice(("foam",))))
        assert "two actions" in dialog.trouble
        assert not dialog.ok.isEnabled()


def test_whose_labels_is_asked_where_several_labelled(document, ask):
    document.project.tracks.edit(document.id, "Ben", (), (Segment(0, 1, "grab"),), "made")
    document.refresh_listing()
    form = ask(TrainingChoice(("foam",)))
    assert form.coder.isVisible()
    form.coder.setCurrentIndex(form.coder.findData("Ben"))
    assert form.choice().author == "Ben"


def test_one_that_codes_blind_does_not_learn_who_else_labelled(document, ask):
    document.project.tracks.edit(document.id, "Ben", (), (Segment(0, 1, "grab"),), "made")
    document.project.coding.assign(document.id, "Ann", blind=True)
    document.refresh_listing()
    form = ask(TrainingChoice(("foam",)))
    assert form.coder.findData("Ben") == -1


@pytest.mark.parametrize("own", [OWN_MINIMUM - 1, OWN_MINIMUM])
def test_whose_labels_are_taken_unless_somebody_is_chosen_is_told_as_it_is(document, ask, own):
    for info in document.infos[:own]:
        labels = document.project.tracks.get(info.id, "Ann").segments
        document.project.tracks.edit(info.id, "Cleo", (), labels, "made")
    document.set_author("Cleo")
    document.refresh_listing()
    tasks = {info.task for info in document.infos}
    assert (default_author(document, tasks) == "Cleo") == (own >= OWN_MINIMUM)
    form = ask(TrainingChoice(("foam",)))
    assert f"once I have completed {OWN_MINIMUM}" in form.coder.itemText(0)
