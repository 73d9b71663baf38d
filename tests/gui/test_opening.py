"""Opening projects: what is opened by itself, and what is not."""

import pytest
from painted import opened
from PySide6.QtWidgets import QWidget

from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.opening import Opening
from forcelab.jobs import Progress
from forcelab.project import Project


@pytest.fixture
def document(app, tmp_path):
    with opened(tmp_path) as document:
        yield document


@pytest.fixture
def make(app):
    """Make what opens projects into a document."""
    windows = []

    def made(document, *, remembering=True):
        windows.append(QWidget())
        return Opening(document, Jobs(windows[-1]), windows[-1], remembering=remembering)

    yield made
    for window in windows:
        window.deleteLater()


def test_the_demonstration_of_last_time_is_opened_but_not_for_a_picture(document, make):
    path, (one, two) = document.project.path, document.infos
    opening = make(document)
    document.open_demonstration(two.id)
    opening.remember_demonstration()
    assert opening.open(path)
    assert document.id == two.id
    assert make(document, remembering=False).open(path)
    assert document.id == one.id


def test_a_sample_project_that_is_ready_late_does_not_close_another(
    document, make, tmp_path, monkeypatch, until
):
    def making(path, *_):
        yield Progress(0, 1, "")
        Project.create(path).close()

    monkeypatch.setattr("forcelab.sample.making", making)
    for busy, shown in ((document, document.project.path), (Document("Eve"), tmp_path / "sample")):
        opening, over = make(busy), []
        opening.sampling.connect(over.append)
        opening.make_sample(tmp_path / ("other" if busy is document else "sample"))
        until(lambda over=over: over[-1] is None)
        assert busy.project.path == shown
    assert settings.recent_projects() == (tmp_path / "sample",)
    busy.close()
