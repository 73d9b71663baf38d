"""The Label workspace: what it looks for in a demonstration that is opened."""

import numpy as np
import pytest

from forcelab.demonstration import Channel, Demonstration
from forcelab.gui.document import Document
from forcelab.gui.label.workspace import LabelWorkspace
from forcelab.project import Project


def touch(name, at):
    """Four seconds at 250 Hz of noise, with a contact of two seconds' length."""
    times = np.arange(1000) / 250
    noise = np.random.default_rng(1).normal(0, 0.01, len(times))
    force = np.where((times > at) & (times < at + 2), 3.0, 0.0) + noise
    return Demonstration(name, "stylus", times, force[:, np.newaxis], (Channel("fz1", "N"),))


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "study.forcelab"
    with Project.create(path) as project:
        project.demonstrations.add(touch("early", 0.5))
        project.demonstrations.add(touch("late", 1.5))
    return path


@pytest.fixture
def workspace(jobs):
    document = Document("Ada")
    workspace = LabelWorkspace(document, jobs)
    yield workspace
    workspace.let_go()
    jobs.close()  # before the document: what runs reads it
    document.close()
    workspace.deleteLater()


def test_contacts_are_found_again_when_the_same_demonstration_is_opened_again(
    workspace, path, until
):
    document = workspace.document
    for _ in range(2):
        document.open_project(path)
        document.open_demonstration("early")
        until(lambda: len(document.view.contacts))
        assert min(abs(document.view.contacts - 0.5)) < 0.05


def test_contacts_of_a_demonstration_that_was_left_reach_no_other(
    app, workspace, path, tmp_path, until
):
    document = workspace.document
    document.open_project(path)
    document.open_demonstration("early")
    Project.create(tmp_path / "empty.forcelab").close()
    document.open_project(tmp_path / "empty.forcelab")
    until(lambda: not workspace.jobs.busy)
    app.processEvents()  # what is still to be delivered
    assert len(document.view.contacts) == 0


def test_the_lists_keep_their_width_while_the_timeline_is_lent(app, workspace, path, until):
    workspace.document.open_project(path)
    workspace.document.open_demonstration("early")
    workspace.resize(1000, 600)
    workspace.show()
    until(lambda: workspace.segments.isVisible() and workspace.settled)
    app.processEvents()
    before = workspace.segments.width()
    for lent in workspace.lend():
        lent.setParent(None)
    workspace.resize(1300, 700)
    app.processEvents()
    workspace.take_back()
    app.processEvents()
    assert workspace.centralWidget().isVisible()
    assert workspace.segments.width() == pytest.approx(before, abs=2)
