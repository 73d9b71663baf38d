"""Parts of the list of demonstrations: its search, its view, and what is said in its place."""

from __future__ import annotations

from PySide6.QtCore import QModelIndex, QPoint, Qt, Signal
from PySide6.QtGui import QAction, QActionGroup, QKeyEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QMenu,
    QPushButton,
    QToolButton,
    QTreeView,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui import settings
from forcelab.gui.icons import icon
from forcelab.gui.listing_rows import Order, Shown
from forcelab.gui.review.narrow_list import NarrowList

__all__ = ["Empty", "OrderButton", "Tools", "Tree"]

#: Where the settings keep what the list is sorted by.
ORDER = "list/order"
#: Letters of what is shown that are always seen.
NARROW = 4


class Search(QLineEdit):
    """The search; Escape empties it and leaves it, Down leaves it for what was found."""

    leaving = Signal()

    def keeps(self, event: QKeyEvent) -> bool:
        """Escape is for the search; in the window it means something else."""
        return event.key() == Qt.Key.Key_Escape

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Escape and Down; everything else edits."""
        if event.key() in (Qt.Key.Key_Down, Qt.Key.Key_Escape):
            if event.key() == Qt.Key.Key_Escape:
                self.clear()
            self.leaving.emit()
        else:
            super().keyPressEvent(event)


class OrderButton(QToolButton):
    """The choice of what the list is sorted by, which is remembered."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setIcon(icon("sort"))
        self.setStyleSheet("QToolButton::menu-indicator { image: none; }")  # it lies on the icon
        self.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        names: dict[Order, str] = {
            "name": "By name",
            "share": "Least labelled by me first",
            "edit": "Last labelled by me first",
        }
        menu = QMenu(self)
        self._choices = QActionGroup(menu)
        stored = settings.text(ORDER)
        for order, name in names.items():
            choice = menu.addAction(name)
            choice.setData(order)
            choice.setCheckable(True)
            choice.setChecked(order in (stored, "name"))  # of two the later counts
            self._choices.addAction(choice)
        self.setMenu(menu)
        self._choices.triggered.connect(self._chosen)
        self._tell()

    @property
    def order(self) -> Order:
        """What the list is sorted by."""
        chosen: Order = self._choices.checkedAction().data()
        return chosen

    def _chosen(self, choice: QAction) -> None:
        """Sort by something else from now on."""
        settings.put(ORDER, str(choice.data()))
        self._tell()
        self.changed.emit()

    def _tell(self) -> None:
        """Say what the list is sorted by."""
        self.setAccessibleName("Order of the demonstrations")
        chosen = self._choices.checkedAction().text()
        self.setToolTip(f"Order within each task: {chosen}")


class Tools(QWidget):
    """What stands above the list: search, what is shown, how many, and in which order."""

    def __init__(self) -> None:
        super().__init__()
        self.search, self.count, self.order = Search(), QLabel(), OrderButton()
        self.search.setPlaceholderText("Search names and tasks")
        self.search.setAccessibleName("Search names, tasks, notes and ids")
        self.search.setToolTip(self.search.accessibleName())
        self.search.setClearButtonEnabled(True)
        self.shown = NarrowList()
        self.shown.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # after a click keys paint, as before
        self.shown.setMinimumContentsLength(NARROW)
        self.shown.setAccessibleName("Which demonstrations are shown")
        names: dict[Shown, str] = {
            "all": "All",
            "unlabelled": "Not labelled by me",
            "begun": "Begun, not done",
            "assigned": "Assigned to me, to do",
            "done": "Done by me",
        }
        for what, name in names.items():
            self.shown.addItem(name, what)
        choice = QHBoxLayout()
        choice.addWidget(self.shown, 1)
        choice.addWidget(self.count)
        choice.addWidget(self.order)
        column = QVBoxLayout(self)
        column.setContentsMargins(6, 6, 6, 6)
        column.setSpacing(4)
        column.addWidget(self.search)
        column.addLayout(choice)


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
        self._import = QPushButton("Import demonstrations…")
        self._import.clicked.connect(self.importing)
        self._all = QPushButton("Show all")
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
            text = f"Among those shown, no name, task, note or id has '{search}' in it."
        elif has_demonstrations:
            text = "No demonstration is of this kind."
        elif has_project:
            text = (
                "This project has no demonstrations yet. Import them: tables (CSV, TSV), ROS "
                "bags, raw OptoForce dumps, *.pdl or archives."
            )
        else:
            text = "No project is open. Open one, or make a new one, from the menu."
        self._label.setText(text)
