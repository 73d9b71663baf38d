"""The list at the left: demonstrations by task, how far each is labelled, and by whom."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

from PySide6.QtCore import (
    QItemSelectionModel,
    QModelIndex,
    QPoint,
    Qt,
    QTimer,
    Signal,
    SignalInstance,
)
from PySide6.QtGui import QAction, QActionGroup, QKeyEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QApplication,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QMenu,
    QStackedWidget,
    QToolButton,
    QTreeView,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui import settings
from forcelab.gui.demonstration_menu import DemonstrationMenu, confirm_reveal
from forcelab.gui.demonstration_model import (
    DemonstrationModel,
    DemonstrationRow,
    ListFilter,
    ListOrder,
    count_finished,
    find_next,
    grouped,
    ordered,
    rows_of,
)
from forcelab.gui.demonstration_painter import RowPainter
from forcelab.gui.document import Document
from forcelab.gui.icons import icon
from forcelab.gui.label.track_spans import track_spans
from forcelab.gui.layout import fill_layout, page_layout, push_button
from forcelab.gui.shortcuts import keys
from forcelab.gui.theme import themes
from forcelab.gui.widgets import ENTER_KEYS, ElidedComboBox, ElidedLabel
from forcelab.labels import Segments
from forcelab.segment_edits import SLIVER

#: Where the settings keep what the list is sorted by.
ORDER_KEY = "list/order"
ORDERS: dict[ListOrder, str] = {
    "name": "By name",
    "share": "Least labelled by me first",
    "edit": "Recently labelled first",
}
#: What of the list can be shown.
FILTERS: dict[ListFilter, str] = {
    "all": "All",
    "unlabelled": "Not labelled by me",
    "begun": "Started, not done",
    "assigned": "Assigned to me, to do",
    "done": "Done by me",
}
#: Letters of that choice which are always seen.
NARROW_WIDTH = 3


class Search(QLineEdit):
    """The search field; Escape clears and leaves it, Down leaves it for the list."""

    leaving = Signal()

    def keeps(self, event: QKeyEvent) -> bool:
        """Escape is for the search; in the window it means something else."""
        return event.key() == Qt.Key.Key_Escape

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Down, Qt.Key.Key_Escape):
            if event.key() == Qt.Key.Key_Escape:
                self.clear()
            self.leaving.emit()
        else:
            super().keyPressEvent(event)


class OrderButton(QToolButton):
    """The choice of the list's order, which is remembered."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setIcon(icon("sort"))
        self.setStyleSheet("QToolButton::menu-indicator { image: none; }")  # it lies on the icon
        self.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        menu = QMenu(self)
        self._choices = QActionGroup(menu)
        stored = settings.text(ORDER_KEY)
        for order, name in ORDERS.items():
            choice = menu.addAction(name)
            choice.setData(order)
            choice.setCheckable(True)
            choice.setChecked(order in (stored, "name"))  # of two the later counts
            self._choices.addAction(choice)
        self.setMenu(menu)
        self._choices.triggered.connect(self._chosen)
        self._show_order()

    @property
    def order(self) -> ListOrder:
        chosen: ListOrder = self._choices.checkedAction().data()
        return chosen

    def _chosen(self, choice: QAction) -> None:
        settings.store(ORDER_KEY, str(choice.data()))
        self._show_order()
        self.changed.emit()

    def _show_order(self) -> None:
        self.setAccessibleName("Order of the demonstrations")
        self.setToolTip(f"Order within each task: {self._choices.checkedAction().text()}")


class DemonstrationTree(QTreeView):
    """The view; Enter opens a row, the menu key its menu."""

    opening = Signal(QModelIndex)
    menu_requested = Signal(QPoint)

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
        """Enter opens; the menu key shows the menu at the row instead of the pointer."""
        if event.key() in ENTER_KEYS:
            self.opening.emit(self.currentIndex())
        elif event.key() == Qt.Key.Key_Menu:
            self.menu_requested.emit(self.visualRect(self.currentIndex()).center())
        else:
            super().keyPressEvent(event)


class EmptyNote(QWidget):
    """What is shown instead of an empty list: why it is empty, and what to do."""

    def __init__(self, importing: SignalInstance, show_all: Callable[[], object]) -> None:
        super().__init__()
        self._label = QLabel(wordWrap=True, alignment=Qt.AlignmentFlag.AlignCenter)
        self._import = push_button("Import demonstrations…", importing)
        self._all = push_button("Show all", show_all)
        column = fill_layout(QVBoxLayout(self), 1, self._label, margins=16)
        column.addSpacing(8)
        for button in (self._import, self._all):
            column.addWidget(button, 0, Qt.AlignmentFlag.AlignHCenter)
        column.addStretch(2)

    def say(self, has_project: bool, has_demonstrations: bool, search: str = "") -> None:
        """Say what is missing; `search` is the text searched for in vain."""
        self._import.setVisible(has_project and not has_demonstrations)
        self._all.setVisible(has_demonstrations)
        if has_demonstrations and search:
            text = f"No demonstration shown has '{search}' in its name, task, notes or id."
        elif has_demonstrations:
            text = "No demonstration matches this filter."
        elif has_project:
            text = (
                "This project has no demonstrations yet. Import them: tables (CSV, TSV), ROS "
                "bags, raw OptoForce dumps, *.pdl or archives."
            )
        else:
            text = "No project is open. Open one, or make a new one, from the menu."
        self._label.setText(text)


#: Gaps between segments shorter than this, in seconds, are hardly ever meant.
SHORT_GAP = 0.05


def _short_gaps_text(segments: Segments) -> str:
    """How many gaps between segments look like slips, and what fills them; empty for none."""
    gaps = (right.start - left.end for left, right in pairwise(segments))
    count = sum(SLIVER < gap < SHORT_GAP for gap in gaps)
    if not count:
        return ""
    number, them = ("1 gap", "it") if count == 1 else (f"{count} gaps", "them")
    key = keys().shown("fill_gaps") or "Fill gaps"
    return f", with {number} below {1000 * SHORT_GAP:.0f} ms ({key} there fills {them})"


#: The share of the open demonstration is added up when nothing was painted for so many ms.
PAUSE = 100
#: Keys that with a click choose several demonstrations, and open none.
SELECTING_KEYS = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier


class DemonstrationList(QWidget):
    """The list with its search, order and menus; `importing` asks for an import of recordings."""

    importing = Signal()

    def __init__(self, document: Document) -> None:
        super().__init__()
        self._document = document
        self._rows: tuple[DemonstrationRow, ...] = ()
        self._folded: set[str] = set()
        self._soon = QTimer(self, singleShot=True, interval=PAUSE)
        self.model = DemonstrationModel(self)
        self.view = DemonstrationTree(self)
        self.view.setModel(self.model)
        self.view.setItemDelegate(RowPainter(self.model, self.view))
        self.view.setAccessibleName("Demonstrations by task")
        self.menu = DemonstrationMenu(document, self)
        self.search = Search(placeholderText="Search names and tasks", clearButtonEnabled=True)
        self.shown, self._order, self._count = ElidedComboBox(), OrderButton(), ElidedLabel()
        self._ranks: dict[str, int] = {}  # by id, the place in the list
        self._sorted: object = None  # whose view of what the ranks are
        self._empty = EmptyNote(self.importing, self._show_all)
        self._lay_out()
        self._connect()
        self._read()

    # Verbs of the window

    def focus_search(self) -> None:
        self.search.setFocus(Qt.FocusReason.ShortcutFocusReason)
        self.search.selectAll()

    def choose_all(self) -> None:
        """Select all listed demonstrations, for their common menu; unfolds all tasks."""
        self.view.setFocus(Qt.FocusReason.ShortcutFocusReason)
        for g in range(self.model.rowCount()):
            self.view.setExpanded(self.model.index(g, 0), True)
        self.view.selectAll()

    def open_next(self) -> None:
        self._open_neighbour(1)

    def open_previous(self) -> None:
        self._open_neighbour(-1)

    def open_to_label(self) -> None:
        """Open the next listed demonstration that is left to label, cyclically."""
        if (row := self._next_to_label()) is not None:
            self._document.open_demonstration(row.info.id)

    def _next_to_label(self) -> DemonstrationRow | None:
        return find_next(list(self.model.rows), self._document.id, lambda row: row.to_do)

    def mark_done(self) -> None:
        """Mark the open demonstration as done, once the coder agrees to what that shows."""
        if confirm_reveal(self._document, {self._document.id}, self.window()):
            self._document.set_done()

    def done_and_next(self) -> None:
        """Mark the open demonstration as done, and open the next listed one that is not finished.

        A blind coder agrees first to what that shows.
        """
        document, demonstration = self._document, self._document.demonstration
        if demonstration is None or not confirm_reveal(document, {document.id}, self.window()):
            return
        if not document.finish_stroke():  # it may leave a gap, or fill one
            return
        gaps = _short_gaps_text(document.editor.segments)
        following = find_next(list(self.model.rows), document.id, lambda row: not row.finished)
        if not document.set_done(then_open="" if following is None else following.info.id):
            return
        key = keys().shown("train")
        left = f"no other demonstration in the list is left{f'; {key} trains' if key else ''}."
        if following is not None:
            left = f"{count_finished(self._rows)} of {len(self._rows)} are done."
        document.show_message(f"'{demonstration.name}' is marked as done{gaps}; {left}")

    def handlers(self) -> dict[str, Callable[[], object]]:
        """What the commands on demonstrations do, by their id in the table."""
        menu, act = self.menu, self._act
        return {
            "attach_video": partial(act, lambda rows: menu.ask_video(rows[0].info)),
            "note": partial(act, lambda rows: menu.ask_note(rows[0])),
            "rename": partial(act, lambda rows: menu.ask_name(rows[0])),
            "assign": partial(act, menu.ask_assign, several=True),
            "task": partial(act, menu.ask_task, several=True),
            "next_demonstration": self.open_next,
            "previous_demonstration": self.open_previous,
            "next_to_label": self.open_to_label,
            "done": self.mark_done,
            "done_and_next": self.done_and_next,
        }

    def _act(
        self, verb: Callable[[Sequence[DemonstrationRow]], object], *, several: bool = False
    ) -> None:
        """Do something with what a command acts on, if that is anything."""
        if rows := self._targets(several=several):
            verb(rows)

    def _targets(self, *, several: bool = False) -> tuple[DemonstrationRow, ...]:
        """What a command acts on: the open demonstration, or the list's row if it has the keyboard.

        There it acts on all that are chosen if it can act on `several`.
        """
        ids = {self._document.id}
        if self.view.hasFocus() and self._selected():
            ids = {self._selected()}
            if several:
                ids |= {row.info.id for row in self._chosen()}
        return tuple(row for row in self._rows if row.info.id in ids)

    def obstacles(self) -> dict[str, Callable[[], str]]:
        """Why commands cannot be carried out now, by their id; empty where they can."""
        missing = "Open a demonstration first."
        on_target = ("rename", "assign", "task", "note", "attach_video")
        return {
            "next_demonstration": partial(self._missing_neighbour, 1),
            "previous_demonstration": partial(self._missing_neighbour, -1),
            "next_to_label": lambda: (
                "No other demonstration in the list is left to label."
                if self._next_to_label() is None
                else ""
            ),
            "done": lambda: (
                "It is marked as done; a right click in the list takes that back."
                if any(row.done for row in self._rows if row.info.id == self._document.id)
                else ""
            ),
            **dict.fromkeys(on_target, lambda: "" if self._targets() else missing),
        }

    # Inside

    def _lay_out(self) -> None:
        self.search.setAccessibleName("Search names, tasks, notes and ids")
        self.search.setToolTip(self.search.accessibleName())
        self.shown.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # after a click keys paint, as before
        self.shown.setMinimumContentsLength(NARROW_WIDTH)
        self.shown.setAccessibleName("Which demonstrations are shown")
        for filter_, name in FILTERS.items():
            self.shown.addItem(name, filter_)
        choice = fill_layout(QHBoxLayout(), (self.shown, 1), self._count, self._order, spacing=2)
        self._tools = QWidget()
        fill_layout(QVBoxLayout(self._tools), self.search, choice, margins=6, spacing=4)
        self._stack = QStackedWidget()
        self._stack.addWidget(self.view)
        self._stack.addWidget(self._empty)
        page_layout(self, self._tools, self._stack, growing=self._stack)

    def _connect(self) -> None:
        document = self._document
        document.listing_changed.connect(self._read)
        document.project_changed.connect(self._forget)
        document.author_changed.connect(self._read)
        document.demonstration_changed.connect(self._mark_opened)
        document.tracks_changed.connect(self._soon.start)
        self._soon.timeout.connect(self._update_own)
        self.search.textChanged.connect(self._filter)
        self.search.returnPressed.connect(self._open_first)
        self.search.leaving.connect(self._enter_list)
        self.shown.currentIndexChanged.connect(self._filter)
        self._order.changed.connect(self._sort)
        self._order.changed.connect(self._show)
        self.view.clicked.connect(self._clicked)
        self.view.selectionModel().selectionChanged.connect(self._show_count)
        self.view.opening.connect(self._open)
        self.view.collapsed.connect(lambda index: self._fold(index, True))
        self.view.expanded.connect(lambda index: self._fold(index, False))
        self.view.customContextMenuRequested.connect(self._show_menu)
        self.view.menu_requested.connect(self._show_menu)
        themes().changed.connect(self.view.viewport().update)

    def _forget(self) -> None:
        """Forget the folding and filter of another project."""
        self._folded.clear()
        self._show_all()

    def _read(self) -> None:
        project = self._document.project
        author = self._document.author
        assignments = project.coding.assignments() if project is not None else ()
        notes = project.coding.notes(author) if project is not None else ()
        self._rows = rows_of(self._document.infos, assignments, author, notes)
        self._update_own(show=False)
        now = (author, [(row.info.id, row.info.task) for row in self._rows])
        if self._sorted != now:
            self._sorted = now
            self._sort()
        self._show()

    def _update_own(self, show: bool = True) -> None:
        """Update the share of the open demonstration, which changes with each edit."""
        document = self._document
        for i, row in enumerate(self._rows):
            if row.info.id == document.id:
                seconds = track_spans(document.editor.segments).seconds
                share = min(seconds / row.info.duration, 1.0)
                if share != row.share:
                    self._rows = (*self._rows[:i], replace(row, share=share), *self._rows[i + 1 :])
                    if show:
                        self._show()
                return

    def _sort(self) -> None:
        """Rank the demonstrations; no row moves while the open one is being labelled."""
        rows = ordered(self._rows, self._order.order)
        self._ranks = {row.info.id: rank for rank, row in enumerate(rows)}

    def _filter(self) -> None:
        """Show what matches the search; the cursor stands on nothing but the open demonstration."""
        self.view.selectionModel().clear()
        self._show()
        self._select(self._document.id)

    def _show(self) -> None:
        """Show the rows that match."""
        filter_: ListFilter = self.shown.currentData()
        rows = sorted(self._rows, key=lambda row: self._ranks[row.info.id])
        groups = grouped(rows, self.search.text(), filter_, self._document.id)
        selected = self._selected()
        if self.model.show(groups):
            for g, group in enumerate(groups):
                # What is searched for is not hidden in a folded task.
                folded = group.task in self._folded and not self.search.text()
                self.view.setExpanded(self.model.index(g, 0), not folded)
            self._select(selected or self._document.id)
        self._show_count()
        self._tools.setVisible(bool(self._rows))
        self._stack.setCurrentIndex(0 if groups else 1)
        if not groups:
            has_project = self._document.project is not None
            self._empty.say(has_project, bool(self._rows), self.search.text().strip())

    def _show_count(self) -> None:
        """Show how many are done; how many are selected if several are, or listed if not all."""
        listed, chosen, total = len(self.model.ids()), len(self._chosen()), len(self._rows)
        finished = count_finished(self._rows)
        if chosen > 1:
            self._count.set_text(f"{chosen} chosen")
        elif listed < total:
            self._count.set_text(f"{listed} of {total}", f"{listed}/{total}")
        else:
            self._count.set_text(f"{finished} of {total} done", f"{finished}/{total}")
        self._count.setToolTip(f"{finished} of {total} done by you; {listed} listed")

    def _chosen(self) -> tuple[DemonstrationRow, ...]:
        """The selected demonstrations, in the order of the list."""
        chosen, place = self.view.selectionModel().isSelected, self.model.index_of
        # Not from a generator: while Qt frees an index that one has passed on, Python 3.14 still
        # counts it among the generator's, and crashes when another thread searches for garbage.
        rows = [row for row in self.model.rows if chosen(place(row.info.id))]
        return tuple(rows)

    def _selected(self) -> str:
        """Id of the demonstration at the keyboard's cursor; ``""`` without one."""
        item = self.model.at(self.view.currentIndex())
        return item.info.id if isinstance(item, DemonstrationRow) else ""

    def _select(self, id_: str) -> None:
        """Move the keyboard's cursor to a demonstration and scroll to it."""
        index = self.model.index_of(id_)
        if index.isValid():
            # Said outright: the view would add to what is chosen while a shortcut's Ctrl is down.
            alone = QItemSelectionModel.SelectionFlag.ClearAndSelect
            rows = QItemSelectionModel.SelectionFlag.Rows
            self.view.selectionModel().setCurrentIndex(index, alone | rows)
            self.view.scrollTo(index, QAbstractItemView.ScrollHint.EnsureVisible)

    def _mark_opened(self) -> None:
        """Follow the document to another demonstration."""
        if self.model.opened != self._document.id:
            self.model.set_opened(self._document.id)
            self._update_own(show=False)
            self._sort()
            self._show()  # what was open until now is shown only if it fits
            self._select(self._document.id)

    def _fold(self, index: QModelIndex, folded: bool) -> None:
        """Remember which tasks are folded, except during a search."""
        if not self.search.text():
            task = str(index.data())
            (self._folded.add if folded else self._folded.discard)(task)

    def _clicked(self, index: QModelIndex) -> None:
        """Open a demonstration, or fold or unfold a task; not while several are being selected."""
        if QApplication.keyboardModifiers() & SELECTING_KEYS:
            return
        if isinstance(self.model.at(index), DemonstrationRow):
            self._open(index)
        else:
            self.view.setExpanded(index, not self.view.isExpanded(index))

    def _open(self, index: QModelIndex) -> None:
        item = self.model.at(index)
        if isinstance(item, DemonstrationRow) and item.info.id != self._document.id:
            self._document.open_demonstration(item.info.id)

    def _open_first(self) -> None:
        if ids := self.model.ids():
            self._open(self.model.index_of(ids[0]))
            self.view.setFocus(Qt.FocusReason.OtherFocusReason)

    def _enter_list(self) -> None:
        """Move the keyboard from the search to the first demonstration found."""
        if ids := self.model.ids():
            if self._selected() not in ids:
                self._select(ids[0])
            self.view.setFocus(Qt.FocusReason.OtherFocusReason)

    def _open_neighbour(self, step: int) -> None:
        """Open the listed demonstration that is `step` rows below the open one."""
        if id_ := self._neighbour(step):
            self._document.open_demonstration(id_)

    def _neighbour(self, step: int) -> str:
        """Id of the listed demonstration `step` rows below the open one; ``""`` without one."""
        ids = self.model.ids()
        target = 0 if step > 0 else len(ids) - 1
        if self._document.id in ids:
            target = ids.index(self._document.id) + step
        return ids[target] if 0 <= target < len(ids) else ""

    def _missing_neighbour(self, step: int) -> str:
        if self._neighbour(step):
            return ""
        if not self.model.ids():
            return "No demonstration is shown in the list."
        return f"This is the {'last' if step > 0 else 'first'} demonstration of the list."

    def _show_all(self) -> None:
        """Clear search and filter."""
        self.search.clear()
        self.shown.setCurrentIndex(0)

    def _show_menu(self, where: QPoint) -> None:
        item, chosen = self.model.at(self.view.indexAt(where)), self._chosen()
        if item is not None:
            several = chosen if len(chosen) > 1 and item in chosen else ()
            self.menu.menu_for(item, several).popup(self.view.viewport().mapToGlobal(where))
