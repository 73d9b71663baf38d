"""A small project that stays open, for views that only look at it; and the trainer on a bench."""

import pytest
from learning_bench import FakeWork, outcome_of
from painted import opened

from forcelab.gui.jobs import Jobs


@pytest.fixture(scope="module")
def kept(app, tmp_path_factory):
    with opened(tmp_path_factory.mktemp("study")) as document:
        yield document


@pytest.fixture
def document(kept):
    kept.open_demonstration(kept.infos[0].id)
    kept.told.clear()
    yield kept
    kept.review.set_run(None)
    for assignment in kept.project.coding.assignments():
        kept.project.coding.unassign(assignment.demonstration, assignment.author)


@pytest.fixture
def jobs(app):
    jobs = Jobs()
    yield jobs
    jobs.close()


@pytest.fixture
def up(app):
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
    work = FakeWork()
    work.result = outcome_of(document.project)
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
