"""Parts of the list of demonstrations: its search, its view, and what is said in its place."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QModelIndex, QPoint, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QLabel,
    QLineEdit,
    QPushButton,
    QTreeView,
    QVBoxLayout,
    QWidget,
)

__all__ = ["Empty", "Search", "Tree"]


class Search(QLineEdit):
    """The search; Escape clears it, Down leaves it for what was found."""

    leaving = Signal()

    def event(self, event: QEvent) -> bool:
        """Keep Escape from the window, where it means something else."""
        if (
            event.type() == QEvent.Type.ShortcutOverride
            and isinstance(event, QKeyEvent)
            and event.key() == Qt.Key.Key_Escape
        ):
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Escape and Down; everything else edits."""
        if event.key() == Qt.Key.Key_Escape and self.text():
            self.clear()
        elif event.key() in (Qt.Key.Key_Down, Qt.Key.Key_Escape):
            self.leaving.emit()
        else:
            super().keyPressEvent(event)


class Tree(QTreeView):
    """The view; opens with Enter, and its menu with the menu key."""

    opening = Signal(QModelIndex)
    menu_asked = Signal(QPoint)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setHeaderHidden(True)
        self.setIndentation(0)
        self.setRootIsDecorated(False)
        self.setExpandsOnDoubleClick(False)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.setFrameShape(QTreeView.Shape.NoFrame)
        self.setMouseTracking(True)
        self.setTabKeyNavigation(False)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Enter opens; the menu key shows the menu at the row and not at the pointer."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.opening.emit(self.currentIndex())
        elif event.key() == Qt.Key.Key_Menu:
            self.menu_asked.emit(self.visualRect(self.currentIndex()).center())
        else:
            super().keyPressEvent(event)


class Empty(QWidget):
    """What is shown where there is no demonstration: why, and what to do."""

    importing = Signal()
    showing_all = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._label = QLabel()
        self._label.setWordWrap(True)
        self._label.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._import = QPushButton(self.tr("Import recordings…"))
        self._import.clicked.connect(self.importing)
        self._all = QPushButton(self.tr("Show all"))
        self._all.clicked.connect(self.showing_all)
        column = QVBoxLayout(self)
        column.setContentsMargins(16, 16, 16, 16)
        column.addStretch(1)
        column.addWidget(self._label)
        column.addSpacing(8)
        for button in (self._import, self._all):
            column.addWidget(button, 0, Qt.AlignmentFlag.AlignHCenter)
        column.addStretch(2)

    def say(self, has_project: bool, has_demonstrations: bool, search: str = "") -> None:
        """Say what is missing; `search` is what was searched for in vain."""
        self._import.setVisible(has_project and not has_demonstrations)
        self._all.setVisible(has_demonstrations)
        if has_demonstrations and search:
            text = self.tr("Among those shown, no name, task or id has '{0}' in it.").format(search)
        elif has_demonstrations:
            text = self.tr("No demonstration is of this kind.")
        elif has_project:
            text = self.tr(
                "This project has no demonstrations yet. Import recordings: tables (CSV), the "
                "paper's databases or archives."
            )
        else:
            text = self.tr("No project is open. Open one, or make a new one, from the menu.")
        self._label.setText(text)
