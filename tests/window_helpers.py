"""What tests of the window share: open documents, a mouse, a trainer whose work takes no time."""

from __future__ import annotations

import time
from contextlib import contextmanager
from datetime import datetime, timezone

import numpy as np
from factories import (
    PAINTED_TRACK,
    cached_project,
    folder_in_memory,
    make_foam_project,
    make_painted_project,
    make_training_project,
)
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt, QTimer
from PySide6.QtGui import QImage, QMouseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialog

from forcelab.errors import InputError
from forcelab.gui.document import Document
from forcelab.labels import Segment
from forcelab.project import Project, RunSummary
from forcelab.review.training import TrainingStep

#: Seconds that anything may take here that comes at once on a machine with nothing else to do.
PATIENCE = 240.0


def pixels(image: QImage) -> NDArray[np.int64]:
    """Red, green and blue of an image, shape (height, width, 3)."""
    image = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    return rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3).astype(int)


def named(parent, kind, name):
    """The control of a kind that has this name for screen readers."""
    return next(child for child in parent.findChildren(kind) if child.accessibleName() == name)


@contextmanager
def shown_widget(app, widget, size=(320, 400)):
    """A widget on screen."""
    widget.resize(*size)
    widget.show()
    app.processEvents()
    yield widget
    widget.close()
    widget.deleteLater()
    app.processEvents()


@contextmanager
def painted_once(window):
    """Paint a window after several steps, and not after each of them."""
    window.setUpdatesEnabled(False)
    yield
    window.setUpdatesEnabled(True)


def answer_dialog(parent, kind, press, use) -> None:
    """Press what opens a modal dialog of a kind, and do something with the dialog."""
    trouble = []

    def answer():
        dialog = QApplication.activeModalWidget()
        try:
            assert isinstance(dialog, kind)
            use(dialog)
        except BaseException as error:
            trouble.append(error)
            raise
        finally:
            if isinstance(dialog, QDialog) and dialog.isVisible():
                dialog.reject()

    QTimer.singleShot(0, parent, answer)
    press()
    assert not trouble


def status_messages(document) -> list[tuple[str, bool]]:
    """What the status line says from now on, and whether that is trouble."""
    messages: list[tuple[str, bool]] = []
    document.message_shown.connect(lambda text, trouble: messages.append((text, trouble)))
    return messages


@contextmanager
def open_painted_document(folder, segments=PAINTED_TRACK, seconds=10.0):
    """A document in which Ada's track over ten seconds is open."""
    path = cached_project(make_painted_project, folder / "study.forcelab", tuple(segments), seconds)
    document = Document("Ada")
    document.open_project(path)
    document.open_demonstration("01")
    yield document
    document.close()


@contextmanager
def open_foam_document(segments: tuple[Segment, ...] = (), **others: tuple[Segment, ...]):
    """A document of a new project with these tracks; Ann is the coder."""
    tracks = tuple((author, tuple(track)) for author, track in {"Ann": segments, **others}.items())
    with _open_document(make_foam_project, tracks) as document:
        yield document


def stored_rows(document) -> list[tuple[float, float, str]]:
    """What the store holds for Ann now, read by its own connection, to the microsecond."""
    with Project.open(document.project.path) as project:
        track = project.tracks.get(document.id, "Ann").segments
    return [(round(s.start, 6), round(s.end, 6), s.action) for s in track]


@contextmanager
def open_training_document(labelled=("01", "02"), tasks=("foam", "stylus")):
    """A document of a project: of each task three demonstrations, some labelled by Ann."""
    with _open_document(make_training_project, tuple(labelled), tuple(tasks)) as document:
        yield document


@contextmanager
def _open_document(make, *arguments):
    """Ann's document of a project in memory, with its first demonstration open."""
    with folder_in_memory() as folder:
        document = Document("Ann")
        document.open_project(cached_project(make, folder / "study.forcelab", *arguments))
        assert document.open_demonstration(document.infos[0].id)
        try:
            yield document
        finally:
            document.close()


class PanelMouse:
    """A mouse above a panel whose time axis is a thousand pixels wide from pixel 88 on.

    With the whole demonstration in view a pixel is 10 ms, which is also the distance of samples.
    """

    def __init__(self, panel, y: int = 20) -> None:
        self.panel, self.y = panel, y
        self.none = Qt.KeyboardModifier.NoModifier

    def at(self, time: float):
        """Where on the panel a time lies."""
        document = self.panel.document
        share = (time - document.view.start) / (document.view.end - document.view.start)
        return QPoint(round(88 + 1000 * share), self.y)

    def press(self, time: float, modifiers=None) -> None:
        button = Qt.MouseButton.LeftButton
        QTest.mousePress(self.panel.viewport(), button, modifiers or self.none, self.at(time))

    def move(self, time: float, modifiers=None, *, pressed: bool = True) -> None:
        where = QPointF(self.at(time))
        left, none = Qt.MouseButton.LeftButton, Qt.MouseButton.NoButton
        buttons = left if pressed else none
        modifiers = modifiers or self.none
        on_screen = QPointF(self.panel.mapToGlobal(where))
        event = QMouseEvent(QEvent.Type.MouseMove, where, on_screen, none, buttons, modifiers)
        QApplication.sendEvent(self.panel.viewport(), event)

    def release(self, time: float, modifiers=None) -> None:
        button = Qt.MouseButton.LeftButton
        QTest.mouseRelease(self.panel.viewport(), button, modifiers or self.none, self.at(time))

    def click(self, time: float, modifiers=None) -> None:
        self.press(time, modifiers)
        self.release(time, modifiers)

    def drag(self, start: float, end: float, modifiers=None) -> None:
        self.press(start, modifiers)
        self.move((start + end) / 2, modifiers)
        self.move(end, modifiers)
        self.release(end, modifiers)


def training_step(epoch=1, loss=1.0, fold=1, folds=3, phase="fold", seconds_left=12.0):
    """What a training tells of an epoch."""
    done = 100 * fold + (epoch or 0)
    text = f"fold {fold} of {folds}"
    return TrainingStep(
        done, 100 * (folds + 2), text, phase, fold, folds, epoch, loss, seconds_left
    )


def play(work, trail=None):
    """A job's steps of `work`, then its result once its gate is open; an exception is raised."""
    try:
        for step in work.steps:
            if trail is not None:
                trail.append(step)
            yield step
        while not work.gate:
            time.sleep(0.001)
            yield work.steps[-1] if work.steps else None
        if isinstance(work.result, Exception):
            raise work.result
        return work.result
    finally:
        work.closed += 1


def run_summary(number, title="foam", *, tasks=None, test_task=None, f1=0.9, preset=""):
    """A run as it is listed."""
    choice = {"tasks": [title] if tasks is None else tasks, "test_task": test_task}
    return RunSummary(
        id=number,
        kind="evaluate",
        time=datetime(2026, 3, 1, 12, tzinfo=timezone.utc),
        settings={"preset": preset, "choice": choice},
        seed=0,
        labels=(),
        versions={},
        digest={"title": title, "f1": f1},
    )


class FakeTrainingBackend:
    """The trainer's work, as told: steps, then an outcome or an error."""

    def __init__(self):
        self.requests = []
        self.loaded = []
        self.steps = [training_step(epoch=n, loss=1.0 / n) for n in (1, 2, 3)]
        self.result = None
        self.runs = ()
        self.outcomes = {}
        self.gate = True  # whether a training that has told all its steps may end
        self.closed = 0

    def train(self, path, make_arguments, name, trail):
        self.requests.append((path, *make_arguments(), name))
        return (yield from play(self, trail))

    def load(self, _path, number):
        self.loaded.append(number)
        yield None
        if number not in self.outcomes:
            raise InputError(f"There is no run {number} any more.")
        return self.outcomes[number]

    def list_runs(self, _path):
        yield None
        return self.runs

    def remove(self, path, number):
        yield None
        with Project.open(path) as project:
            project.runs.remove(number)
        self.runs = tuple(run for run in self.runs if run.id != number)

    def count_edits(self, project, outcome):
        """Every edit of the labels that were used, one by one."""
        return sum(
            edit.id > used.edit
            for used in outcome.labels
            for edit in project.tracks.history(used.demonstration, used.author)
        )
