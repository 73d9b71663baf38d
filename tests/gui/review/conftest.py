"""A small project that stays open, for views that only look at it; and the trainer on a bench."""

import pytest
from factories import run_result_of
from window_helpers import FakeTrainingBackend, open_painted_document


@pytest.fixture(scope="module")
def shared_document(app, tmp_path_factory):
    with open_painted_document(tmp_path_factory.mktemp("study")) as document:
        yield document


@pytest.fixture(autouse=True)
def _no_pause_before_labels_are_compared(monkeypatch):
    monkeypatch.setattr("forcelab.gui.review.queue.COMPARE_DELAY", 10)
    monkeypatch.setattr("forcelab.gui.review.agreement.COMPARE_DELAY", 10)


@pytest.fixture
def document(shared_document):
    shared_document.open_demonstration(shared_document.infos[0].id)
    yield shared_document
    shared_document.review.set_run(None)
    for assignment in shared_document.project.coding.assignments():
        shared_document.project.coding.unassign(assignment.demonstration, assignment.author)


@pytest.fixture
def show(app):
    """Show a widget, in a size if one is given, until the test is over; gives it."""
    shown = []

    def show(widget, *size):
        if size:
            widget.resize(*size)
        widget.show()
        shown.append(widget)
        return widget

    yield show
    for widget in shown:
        widget.close()
        widget.deleteLater()


@pytest.fixture
def work(document):
    """What the trainer does in the background; it finds the same each time."""
    work = FakeTrainingBackend()
    work.result = run_result_of(document.project)
    return work


@pytest.fixture
def trainer(document, jobs, work, until, monkeypatch):
    """The trainer of `document`, which is to be one that may be changed."""
    from forcelab.gui.review.trainer import Trainer

    monkeypatch.setattr("forcelab.gui.review.trainer.COUNT_DELAY", 50)
    trainer = Trainer(document, jobs, backend=work)
    until(lambda: not jobs.busy)
    yield trainer
    trainer.cancel()
    document.close()


@pytest.fixture
def train(trainer, until):
    """Train to the end."""

    def train():
        assert trainer.train()
        until(lambda: not trainer.training)

    return train
