"""The list of the queue: sections that fold, rows to choose, and the way from one to the next."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QModelIndex, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractItemView, QTreeView, QWidget

from forcelab.gui.review.queue_model import Item, QueueModel, Section
from forcelab.gui.review.queue_painting import QueuePainter
from forcelab.gui.theme import themes
from forcelab.review.places import Place
from forcelab.vocabulary import Vocabulary

__all__ = ["QueueList"]

#: Sections that are folded at first: many and small, or no mistakes, or done with.
FOLDED = frozenset({"boundaries", "invented", "judged"})


class QueueList(QTreeView):
    """The rows.

    Parameters
    ----------
    model : QueueModel
    vocabulary : callable
        Gives the vocabulary whose colours are drawn.
    parent : QWidget, optional

    Attributes
    ----------
    chosen : Signal
        With the place of a row that was clicked or opened with Enter.
    """

    chosen = Signal(object)

    def __init__(
        self,
        model: QueueModel,
        vocabulary: Callable[[], Vocabulary],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._model = model
        self._folded = set(FOLDED)
        self._last = 0  # where in the order the marked item stood last
        self.setModel(model)
        self.setItemDelegate(QueuePainter(model, vocabulary, self))
        self.setAccessibleName(self.tr("Where labels and predictions differ"))
        self.setHeaderHidden(True)
        self.setIndentation(0)
        self.setUniformRowHeights(True)
        self.setRootIsDecorated(False)
        self.setExpandsOnDoubleClick(False)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setFrameShape(QTreeView.Shape.NoFrame)
        self.setMouseTracking(True)
        self.setTabKeyNavigation(False)
        self.clicked.connect(self._clicked)
        self.expanded.connect(lambda index: self._fold(index, False))
        self.collapsed.connect(lambda index: self._fold(index, True))
        themes().changed.connect(self.viewport().update)

    @property
    def current(self) -> Item | None:
        """The item that is marked."""
        found = self._model.at(self.currentIndex())
        return found if isinstance(found, Item) else None

    def open_items(self) -> list[tuple[QModelIndex, Item]]:
        """What is not judged and not folded away, in order."""
        folded = {s.kind for s in self._model.sections if s.kind in self._folded}
        return [
            (index, item)
            for index, item in self._model.items()
            if not item.judged and self._model.sections[index.parent().row()].kind not in folded
        ]

    def beside(self, direction: int) -> tuple[Place, bool]:
        """The place of the next open item or of the one before, and whether it wrapped around.

        Where the marked one has gone, its place in the order counts. There must be an open item.
        """
        items = self.open_items()
        here = self._position(items)
        if here is None:
            here = self._last - (direction > 0)
        there = here + direction
        return items[there % len(items)][1].place, not 0 <= there < len(items)

    def after(self) -> Place | None:
        """Where one goes when the current item is done; None where it is the only one."""
        items = self.open_items()
        if self._position(items) is None or len(items) < 2:
            return None
        return self.beside(1)[0]

    def _position(self, items: list[tuple[QModelIndex, Item]]) -> int | None:
        """Which of these is marked."""
        current = self.currentIndex()
        return next((i for i, (index, _) in enumerate(items) if index == current), None)

    def mark(self, place: Place | None, unfold: bool = True) -> None:
        """Mark a place, if it stands here, and bring it into view, unfolding its section."""
        index = QModelIndex() if place is None else self._model.index_of(place)
        if index.isValid() and not self.isExpanded(index.parent()):
            if unfold:
                self.expand(index.parent())
            else:
                index = QModelIndex()
        if not index.isValid():
            self.clearSelection()
        if index != self.currentIndex():
            self.setCurrentIndex(index)
        if index.isValid():
            self._last = self._position(self.open_items()) or 0
            self.scrollTo(index, QAbstractItemView.ScrollHint.EnsureVisible)

    def unfold(self) -> None:
        """Unfold what is not folded, after other rows have come."""
        self.blockSignals(True)
        for row, section in enumerate(self._model.sections):
            self.setExpanded(self._model.index(row, 0), section.kind not in self._folded)
        self.blockSignals(False)

    def unfold_one(self) -> bool:
        """Unfold the first section with something to judge; gives whether there is one."""
        for row, section in enumerate(self._model.sections):
            if section.kind in self._folded and section.kind != "judged":
                self.expand(self._model.index(row, 0))
                return True
        return False

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Enter shows the place; letters are the window's."""
        text = event.text()
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self._clicked(self.currentIndex())
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
            self.setExpanded(index, not self.isExpanded(index))

    def _fold(self, index: QModelIndex, folded: bool) -> None:
        """Remember which sections are folded."""
        section = self._model.at(index)
        if isinstance(section, Section):
            (self._folded.add if folded else self._folded.discard)(section.kind)
