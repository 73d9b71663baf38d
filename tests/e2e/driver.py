"""Runs the real program, and tells a test where things are on the screen.

The program is started through its own ``main()``. Questions come in as lines of JSON and answers
go out the same way; whatever is done to the program is done by mouse and keys from outside, but
for the verb ``paint``, with which a test that kills the program paints as fast as it can.
"""

from __future__ import annotations

import json
import sys
import threading

from PySide6.QtCore import QEvent, QModelIndex, QObject, QPoint, QPointF, Qt, Signal
from PySide6.QtGui import QMouseEvent, QPainter
from PySide6.QtWidgets import QAbstractItemView, QApplication, QWidget

from forcelab.cli import main
from forcelab.gui import window as window_module
from forcelab.gui.label.tracks import TrackPanel

LEFT, NONE = Qt.MouseButton.LeftButton, Qt.MouseButton.NoButton


def indexes(model, parent):
    """All indexes of a model, those of a tree from the top."""
    for row in range(model.rowCount(parent)):
        for column in range(8):
            index = model.index(row, column, parent)
            if index.isValid():
                yield index
                yield from indexes(model, index) if column == 0 else ()


class Answering(QObject):
    """Answers questions in the GUI's thread."""

    line_read = Signal(str)

    def __init__(self, window):
        super().__init__(window)
        self.window = window
        self.line_read.connect(self.answer)
        threading.Thread(target=self.listen, daemon=True).start()

    def listen(self):
        for line in sys.stdin:
            self.line_read.emit(line)

    def answer(self, line):
        question = json.loads(line)
        try:
            answer = getattr(self, question.pop("ask"))(**question)
        except Exception as error:  # noqa: BLE001 - so that the test hears of it, and does not wait
            answer = repr(error)
        print(json.dumps(answer), flush=True)

    def state(self):
        document = self.window.document
        trainer, video = self.window.review.trainer, self.window.label.video
        place = document.review.examined
        return {
            "id": document.id,
            "cursor": document.view.cursor,
            "span": [document.view.start, document.view.end],
            "range": document.view.range,
            "selected": document.selected,
            "action": document.action,
            "stroke": document.stroke and document.stroke.action,
            "playing": document.view.playing,
            "settled": self.window.settled,
            "title": self.window.windowTitle(),
            "popup": QApplication.activePopupWidget() is not None,
            "modal": QApplication.activeModalWidget() is not None,
            "dialog": int(getattr(QApplication.activeModalWidget(), "winId", int)()),
            "per_pixel": self.window.label.tracks.seconds_per_pixel,
            "focus": type(QApplication.focusWidget()).__name__,
            "window": int(self.window.winId()),
            "training": trainer.training,
            "fold": trainer.step.fold if trainer.step is not None else 0,
            "run": document.review.run.number if document.review.run is not None else 0,
            "edits": trainer.edits,
            "examined": place and [place.start, place.end, place.human, place.predicted],
            "frame": video.shown_index if video.isVisible() else -1,
            "frames": [panel.shown_index for panel in video.panels if panel.isVisible()],
            "video": self.window.label.videos.video and self.window.label.videos.video.name,
            "decoders": sum(thread.name.startswith("video ") for thread in threading.enumerate()),
            "reviewing": self.window.review.isVisible(),
        }

    def point(self, time):
        """Where a time lies on the coder's own track, in pixels of the screen."""
        tracks = self.window.label.tracks
        spot = tracks.mapToGlobal(QPoint(round(tracks.x_at(time)), tracks.height() // 4))
        return [spot.x(), spot.y()]

    def widget(self, kind, name=""):
        """The middle of a visible widget of a class, with an accessible name."""
        for widget in self.window.findChildren(QWidget):
            if type(widget).__name__ != kind or name not in widget.accessibleName():
                continue
            if widget.isVisible():
                spot = widget.mapToGlobal(widget.rect().center())
                return [spot.x(), spot.y()]
        return None

    def row(self, view, text):
        """The middle of the row of a list in which a text stands."""
        for widget in self.window.findChildren(QAbstractItemView):
            if view not in type(widget).__name__ + widget.accessibleName():
                continue
            for index in indexes(widget.model(), QModelIndex()):
                if text in str(index.data()):
                    spot = widget.viewport().mapToGlobal(widget.visualRect(index).center())
                    return [spot.x(), spot.y()]
        return None

    def entry(self, text):
        """The middle of an entry of the menu that is open."""
        menu = QApplication.activePopupWidget()
        while menu is not None:
            for action in menu.actions():
                if action.text().replace("&", "").startswith(text):
                    spot = menu.mapToGlobal(menu.actionGeometry(action).center())
                    return [spot.x(), spot.y()]
            return [action.text() for action in menu.actions()]
        return None

    def paint(self):
        """Drag on the track for ever, telling each segment once it has been painted."""
        document, tracks = self.window.document, self.window.label.tracks
        document.set_action(document.vocabulary.names[0])
        document.view.set_snapping(False)
        number = 0
        while True:
            number += 1
            # Each second time round from the middle of what is there: a press on an edge would move
            # it, and what was seen would be gone by a stroke that nobody has seen yet.
            left = tracks.gutter + 20 + 17 * (number % 35) + 7 * (number // 35 % 2)
            for kind, x, button in (
                (QEvent.Type.MouseButtonPress, left, LEFT),
                (QEvent.Type.MouseMove, left + 14, NONE),
                (QEvent.Type.MouseButtonRelease, left + 14, LEFT),
            ):
                where = QPointF(x, 20)
                point = QPointF(tracks.mapToGlobal(where))
                held = NONE if kind == QEvent.Type.MouseButtonRelease else LEFT
                keys = Qt.KeyboardModifier.NoModifier
                event = QMouseEvent(kind, where, point, button, held, keys)
                QApplication.sendEvent(tracks.viewport(), event)
            QApplication.processEvents()
            drawn = [[s.start, s.end, s.action] for s in Painted.segments]
            print(json.dumps({"number": number, "seen": drawn}), flush=True)


class Painted:
    """What the track panel has drawn last."""

    segments = ()


def watch_painting():
    """Keep what the track panel draws, when it has drawn it."""
    draw = TrackPanel.paint_content

    def watched(panel, painter: QPainter, plot):
        draw(panel, painter, plot)
        Painted.segments = panel.document.editor.segments

    TrackPanel.paint_content = watched


def answer_from_the_start():
    """Answer as soon as the window shows what it was started for."""
    begin = window_module.Window.begin

    def begun(window, start):
        begin(window, start)
        window.answering = Answering(window)
        print(json.dumps("ready"), flush=True)

    window_module.Window.begin = begun


if __name__ == "__main__":
    watch_painting()
    answer_from_the_start()
    sys.exit(main(sys.argv[1:]))
