"""The list of the queue: sections that fold, rows to choose, and the way from one to the next."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QEvent, QModelIndex, Qt, Signal
from PySide6.QtGui import QKeyEvent, QPalette
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableView

from forcelab.gui.review.moving import ENTER
from forcelab.gui.review.queue_model import Item, QueueModel
from forcelab.gui.review.queue_painting import QueuePainter, row_height
from forcelab.gui.theme import themes
from forcelab.review.differences import Interval
from forcelab.vocabulary import Vocabulary

__all__ = ["QueueList"]


class QueueList(QTableView):
    """The rows.

    Parameters
    ----------
    model : QueueModel
    vocabulary : callable
        Gives the vocabulary whose colours are drawn.

    Attributes
    ----------
    chosen : Signal
        With the place of a row that was clicked or opened with Enter.
    withdrawn : Signal
        Delete was pressed: the verdict on the marked row, if there is one, is to be withdrawn.
    """

    chosen = Signal(object)
    withdrawn = Signal()

    def __init__(self, model: QueueModel, vocabulary: Callable[[], Vocabulary]) -> None:
        super().__init__()
        self._model = model
        self._last = 0  # where in the order the marked item stood last
        self.setModel(model)
        self.setItemDelegate(QueuePainter(model, vocabulary, self))
        self.setAccessibleName("Where labels and predictions differ")
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setFrameShape(QTableView.Shape.NoFrame)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setShowGrid(False)
        self.setWordWrap(False)
        self.setMouseTracking(True)
        # The painter shows what is selected; the view's own ground would hide its words.
        ground = self.palette()
        ground.setColor(QPalette.ColorRole.Highlight, Qt.GlobalColor.transparent)
        self.setPalette(ground)
        self.setTabKeyNavigation(False)
        self.horizontalHeader().hide()
        self.horizontalHeader().setStretchLastSection(True)
        rows = self.verticalHeader()
        rows.hide()
        rows.setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        self._size_rows()
        self.clicked.connect(self._clicked)
        themes().changed.connect(self.viewport().update)

    def changeEvent(self, event: QEvent) -> None:
        """A larger font takes higher rows."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange:
            self._size_rows()

    def _size_rows(self) -> None:
        """Make rows as high as two lines."""
        self.verticalHeader().setDefaultSectionSize(row_height(self.font()))

    @property
    def current(self) -> Item | None:
        """The item that is marked."""
        found = self._model.at(self.currentIndex())
        return found if isinstance(found, Item) else None

    @property
    def _open(self) -> list[int]:
        """The sections of which something is to be judged and not folded away."""
        folded = self._model.folded
        return [
            number
            for number, section in enumerate(self._model.sections)
            if section.kind != "judged" and section.kind not in folded
        ]

    @property
    def waiting(self) -> int:
        """How many items are to be judged, without those that are folded away."""
        return sum(len(self._model.sections[number]) for number in self._open)

    def beside(self, direction: int) -> tuple[Interval, bool]:
        """The place of the next open item or of the one before, and whether it wrapped around.

        Where the marked one has gone, its place in the order counts. There must be an open item.
        """
        here, waiting = self._position(), self.waiting
        if here is None:
            here = self._last - (direction > 0)
        there = here + direction
        return self._place(there % waiting), not 0 <= there < waiting

    def after(self) -> Interval | None:
        """Where one goes when the current item is done; None where it is the only one."""
        if self._position() is None or self.waiting < 2:
            return None
        return self.beside(1)[0]

    def _position(self) -> int | None:
        """Which of the open items is marked."""
        index = self.currentIndex()
        if not index.isValid():
            return None
        marked, item = self._model.where(index.row())
        before = self._open
        if item < 0 or marked not in before:
            return None
        return item + sum(len(self._model.sections[n]) for n in before if n < marked)

    def _place(self, position: int) -> Interval:
        """The place of an open item."""
        for number in self._open:
            section = self._model.sections[number]
            if position < len(section):
                return section.item(position).place
            position -= len(section)
        raise IndexError(position)

    def mark(self, place: Interval | None, unfold: bool = True) -> None:
        """Mark a place, if it stands here, and bring it into view, unfolding its section."""
        found = None if place is None else self._model.find(place)
        if found is not None and self._model.sections[found[0]].kind in self._model.folded:
            if unfold:
                self._model.fold(found[0], False)
            else:
                found = None
        index = QModelIndex() if found is None else self._model.index(self._model.row(*found))
        if not index.isValid():
            self.clearSelection()
        if index != self.currentIndex():
            self.setCurrentIndex(index)
        if index.isValid():
            self._last = self._position() or 0
            self.scrollTo(index, QAbstractItemView.ScrollHint.EnsureVisible)

    def unfold_one(self) -> bool:
        """Unfold the first section with something to judge; gives whether there is one."""
        for number, section in enumerate(self._model.sections):
            if section.kind in self._model.folded and section.kind != "judged":
                self._model.fold(number, False)
                return True
        return False

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Enter shows the place; letters are the window's."""
        text = event.text()
        if event.key() in ENTER:
            self._clicked(self.currentIndex())
        elif event.key() == Qt.Key.Key_Delete:
            self.withdrawn.emit()
        elif text and text.isprintable():
            event.ignore()
        else:
            super().keyPressEvent(event)

    def _clicked(self, index: QModelIndex) -> None:
        """Show a place; fold or unfold a section."""
        found = self._model.at(index)
        if isinstance(found, Item):
            self.chosen.emit(found.place)
        elif found is not None:
            number, _ = self._model.where(index.row())
            self._model.fold(number, found.kind not in self._model.folded)
