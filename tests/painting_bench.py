"""A document with a track to paint on, and hands to paint with."""

from __future__ import annotations

import os
import tempfile
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from made_once import made_once

from forcelab.demonstration import Channel, Demonstration
from forcelab.labels import Segment
from forcelab.project import Project
from forcelab.vocabulary import Vocabulary

__all__ = ["Hand", "opened", "shown"]

#: These tests are not about the disk, and every commit waits for it: they run in memory.
MEMORY = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
#: Seconds, samples a second, and what is painted before a test begins.
LENGTH, RATE = 10.0, 100.0
ACTIONS = ("grab", "hold", "release")


def demonstration() -> Demonstration:
    """Ten seconds at 100 Hz, from 0 to 10 s exactly."""
    times = np.arange(int(LENGTH * RATE)) / RATE
    signals = np.sin(times)[:, np.newaxis]
    return Demonstration("01", "foam", times, signals, (Channel("fz", "N"),))


def study(path: Path, tracks: tuple[tuple[str, tuple[Segment, ...]], ...]) -> None:
    """A project of one demonstration with these tracks."""
    recording = demonstration()
    with Project.create(path) as project:
        project.demonstrations.add(recording)
        project.actions.set_vocabulary("foam", Vocabulary().with_actions(*ACTIONS))
        for author, track in tracks:
            project.tracks.edit(recording.id, author, (), track, "made") if track else None


@contextmanager
def opened(segments: tuple[Segment, ...] = (), **others: tuple[Segment, ...]):
    """A document of a new project with these tracks; Ann is the coder."""
    from forcelab.gui.document import Document

    folder = tempfile.TemporaryDirectory(dir=MEMORY)
    tracks = tuple((author, tuple(track)) for author, track in {"Ann": segments, **others}.items())
    path = made_once(study, Path(folder.name) / "study.forcelab", tracks)
    document = Document("Ann")
    document.open_project(path)
    assert document.open_demonstration(document.infos[0].id)
    try:
        yield document
    finally:
        document.close()
        folder.cleanup()


def shown(document) -> list[tuple[float, float, str]]:
    """What the store holds for Ann now, read by its own connection, to the microsecond."""
    with Project.open(document.project.path) as project:
        track = project.tracks.get(document.id, "Ann").segments
    return [(round(s.start, 6), round(s.end, 6), s.action) for s in track]


class Hand:
    """A mouse above a panel whose time axis is a thousand pixels wide from pixel 88 on.

    With the whole demonstration in view a pixel is 10 ms, which is also the distance of samples.
    """

    def __init__(self, panel, y: int = 20) -> None:
        from PySide6.QtCore import Qt

        self.panel, self.y = panel, y
        self.none = Qt.KeyboardModifier.NoModifier

    def at(self, time: float):
        """Where on the panel a time lies."""
        from PySide6.QtCore import QPoint

        document = self.panel.document
        share = (time - document.view.start) / (document.view.end - document.view.start)
        return QPoint(round(88 + 1000 * share), self.y)

    def press(self, time: float, modifiers=None) -> None:
        from PySide6.QtCore import Qt
        from PySide6.QtTest import QTest

        button = Qt.MouseButton.LeftButton
        QTest.mousePress(self.panel, button, modifiers or self.none, self.at(time))

    def move(self, time: float, modifiers=None, *, pressed: bool = True) -> None:
        from PySide6.QtCore import QEvent, QPointF, Qt
        from PySide6.QtGui import QMouseEvent
        from PySide6.QtWidgets import QApplication

        where = QPointF(self.at(time))
        left, none = Qt.MouseButton.LeftButton, Qt.MouseButton.NoButton
        buttons = left if pressed else none
        modifiers = modifiers or self.none
        there = QPointF(self.panel.mapToGlobal(where))
        event = QMouseEvent(QEvent.Type.MouseMove, where, there, none, buttons, modifiers)
        QApplication.sendEvent(self.panel, event)

    def release(self, time: float, modifiers=None) -> None:
        from PySide6.QtCore import Qt
        from PySide6.QtTest import QTest

        button = Qt.MouseButton.LeftButton
        QTest.mouseRelease(self.panel, button, modifiers or self.none, self.at(time))

    def click(self, time: float, modifiers=None) -> None:
        self.press(time, modifiers)
        self.release(time, modifiers)

    def drag(self, start: float, end: float, modifiers=None) -> None:
        self.press(start, modifiers)
        self.move((start + end) / 2, modifiers)
        self.move(end, modifiers)
        self.release(end, modifiers)
