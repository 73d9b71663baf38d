"""The list at the left: demonstrations by task, how far each is labelled, and by whom."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QItemSelectionModel, QModelIndex, QPoint, Qt, QTimer, Signal
from PySide6.QtWidgets import (
    QAbstractItemView,
    QApplication,
    QStackedWidget,
    QWidget,
)

from forcelab.gui.arranging import column
from forcelab.gui.document import Document
from forcelab.gui.label.track_spans import spans_of
from forcelab.gui.listing_menu import ListingMenu
from forcelab.gui.listing_model import ListingModel
from forcelab.gui.listing_painting import RowPainter
from forcelab.gui.listing_parts import Empty, Tools, Tree
from forcelab.gui.listing_rows import (
    Row,
    Shown,
    grouped,
    next_to_do,
    ordered,
    rows_of,
)
from forcelab.gui.theme import themes

__all__ = ["DemonstrationList"]

#: The share of the open demonstration is added up when nothing was painted for so many ms.
PAUSE = 100
#: Keys that with a click choose several demonstrations, and open none.
CHOOSING = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier


class DemonstrationList(QWidget):
    """Demonstrations to open, to assign and to put right.

    Parameters
    ----------
    document : Document
        What is open.

    Attributes
    ----------
    importing : Signal
        Somebody wants to import recordings into the project.
    """

    importing = Signal()

    def __init__(self, document: Document) -> None:
        super().__init__()
        self._document = document
        self._rows: tuple[Row, ...] = ()
        self._folded: set[str] = set()
        self._soon = QTimer(self, singleShot=True, interval=PAUSE)
        self.model = ListingModel(self)
        self.view = Tree(self)
        self.view.setModel(self.model)
        self.view.setItemDelegate(RowPainter(self.model, self.view))
        self.view.setAccessibleName("Demonstrations by task")
        self.menu = ListingMenu(document, self)
        self._tools = Tools()
        self.search, self.shown = self._tools.search, self._tools.shown
        self._order, self._count = self._tools.order, self._tools.count
        self._ranks: dict[str, int] = {}  # by id, the place in the list
        self._sorted: object = None  # whose view of what the ranks are
        self._empty = Empty()
        self._lay_out()
        self._connect()
        self._read()

    # Verbs of the window

    def focus_search(self) -> None:
        """Begin to search."""
        self.search.setFocus(Qt.FocusReason.ShortcutFocusReason)
        self.search.selectAll()

    def choose_all(self) -> None:
        """Choose every demonstration that is listed, for the menu of them all.

        Folded tasks are unfolded: what is chosen is seen.
        """
        self.view.setFocus(Qt.FocusReason.ShortcutFocusReason)
        for g in range(self.model.rowCount()):
            self.view.setExpanded(self.model.index(g, 0), True)
        self.view.selectAll()

    def open_next(self) -> None:
        """Open the demonstration below the open one."""
        self._open_neighbour(1)

    def open_previous(self) -> None:
        """Open the demonstration above the open one."""
        self._open_neighbour(-1)

    def open_to_label(self) -> None:
        """Open the next demonstration that is shown and left to label, the first after the last."""
        row = next_to_do(list(self.model.rows), self._document.id)
        if row is not None:
            self._document.open_demonstration(row.info.id)
            return
        self._document.say("Of the demonstrations shown, no other one is left to label.")

    def ask_video(self) -> None:
        """Ask for a video of the open demonstration."""
        opened = (info for info in self._document.infos if info.id == self._document.id)
        if (info := next(opened, None)) is not None:
            self.menu.ask_video(info)
        else:
            self._document.say("Open a demonstration first; a video belongs to one.", True)

    def ask_note(self) -> None:
        """Ask for a note on the open demonstration."""
        opened = (row for row in self._rows if row.info.id == self._document.id)
        if (row := next(opened, None)) is not None:
            self.menu.ask_note(row)
        else:
            self._document.say("Open a demonstration first; a note belongs to one.", True)

    # Inside

    def _lay_out(self) -> None:
        """Search above, list below it or what to do where there is none."""
        self._stack = QStackedWidget()
        self._stack.addWidget(self.view)
        self._stack.addWidget(self._empty)
        column(self, self._tools, self._stack, growing=self._stack)

    def _connect(self) -> None:
        """Listen to the document and to what is pressed."""
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
        self.view.selectionModel().selectionChanged.connect(self._tell_count)
        self.view.opening.connect(self._open)
        self.view.collapsed.connect(lambda index: self._fold(index, True))
        self.view.expanded.connect(lambda index: self._fold(index, False))
        self.view.customContextMenuRequested.connect(self._show_menu)
        self.view.menu_asked.connect(self._show_menu)
        self._empty.importing.connect(self.importing)
        self._empty.showing_all.connect(self._show_all)
        themes().changed.connect(self.view.viewport().update)

    def _forget(self) -> None:
        """Another project is open: nothing of the old one's list matters."""
        self._folded.clear()
        self._show_all()

    def _read(self) -> None:
        """Take over what the project tells."""
        project = self._document.project
        author = self._document.author
        assignments = project.assignments() if project is not None else ()
        notes = project.notes(author) if project is not None else ()
        self._rows = rows_of(self._document.infos, assignments, author, notes)
        self._update_own(show=False)
        now = (author, [(row.info.id, row.info.task) for row in self._rows])
        if self._sorted != now:
            self._sorted = now
            self._sort()
        self._show()

    def _update_own(self, show: bool = True) -> None:
        """Follow what is painted now; the list of the project is read more seldom."""
        document = self._document
        for i, row in enumerate(self._rows):
            if row.info.id == document.id:
                seconds = spans_of(document.segments).seconds
                share = min(seconds / row.info.duration, 1.0)
                if share != row.share:
                    self._rows = (*self._rows[:i], replace(row, share=share), *self._rows[i + 1 :])
                    if show:
                        self._show()
                return

    def _sort(self) -> None:
        """Give each demonstration its place; none moves while the open one is being labelled."""
        rows = ordered(self._rows, self._order.order)
        self._ranks = {row.info.id: rank for rank, row in enumerate(rows)}

    def _filter(self) -> None:
        """Show what is searched for now; nothing of it seems open that is not."""
        self.view.selectionModel().clear()
        self._show()
        self._select(self._document.id)

    def _show(self) -> None:
        """Show what is searched for."""
        what: Shown = self.shown.currentData()
        rows = sorted(self._rows, key=lambda row: self._ranks[row.info.id])
        groups = grouped(rows, self.search.text(), what, self._document.id)
        selected = self._selected()
        if self.model.show(groups):
            for g, group in enumerate(groups):
                # What is searched for is not hidden in a folded task.
                folded = group.task in self._folded and not self.search.text()
                self.view.setExpanded(self.model.index(g, 0), not folded)
            self._select(selected or self._document.id)
        self._tell_count()
        self._tools.setVisible(bool(self._rows))
        self._stack.setCurrentIndex(0 if groups else 1)
        if not groups:
            there = self._document.project is not None
            self._empty.say(there, bool(self._rows), self.search.text().strip())

    def _tell_count(self) -> None:
        """Say how many are chosen where there are several, else how many are shown."""
        here, chosen = len(self.model.ids()), len(self._chosen())
        several = f"{chosen} chosen"
        self._count.setText(several if chosen > 1 else f"{here}/{len(self._rows)}")
        self._count.setHidden(chosen < 2 and here == len(self._rows))

    def _chosen(self) -> tuple[Row, ...]:
        """The demonstrations that are selected, in the order of the list."""
        chosen, place = self.view.selectionModel().isSelected, self.model.index_of
        return tuple(row for row in self.model.rows if chosen(place(row.info.id)))

    def _selected(self) -> str:
        """Id of the demonstration with the keyboard's cursor; ``""`` without one."""
        item = self.model.at(self.view.currentIndex())
        return item.info.id if isinstance(item, Row) else ""

    def _select(self, id_: str) -> None:
        """Put the keyboard's cursor on a demonstration and bring it into view."""
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
        """Remember which tasks are folded, while nothing is searched for."""
        if not self.search.text():
            task = str(index.data())
            (self._folded.add if folded else self._folded.discard)(task)

    def _clicked(self, index: QModelIndex) -> None:
        """Open a demonstration, fold a task or unfold it; not where several are being chosen."""
        if QApplication.keyboardModifiers() & CHOOSING:
            return
        if isinstance(self.model.at(index), Row):
            self._open(index)
        else:
            self.view.setExpanded(index, not self.view.isExpanded(index))

    def _open(self, index: QModelIndex) -> None:
        """Open the demonstration that stands there, if it is not open already."""
        item = self.model.at(index)
        if isinstance(item, Row) and item.info.id != self._document.id:
            self._document.open_demonstration(item.info.id)

    def _open_first(self) -> None:
        """Open the first demonstration that was found."""
        if ids := self.model.ids():
            self._open(self.model.index_of(ids[0]))
            self.view.setFocus(Qt.FocusReason.OtherFocusReason)

    def _enter_list(self) -> None:
        """Go from the search to the first demonstration that was found."""
        if ids := self.model.ids():
            if self._selected() not in ids:
                self._select(ids[0])
            self.view.setFocus(Qt.FocusReason.OtherFocusReason)

    def _open_neighbour(self, step: int) -> None:
        """Open what stands below or above the open one, among what is shown."""
        ids = self.model.ids()
        if not ids:
            self._document.say("No demonstration is shown in the list.")
            return
        if self._document.id not in ids:
            target = 0 if step > 0 else len(ids) - 1
        else:
            target = ids.index(self._document.id) + step
        if 0 <= target < len(ids):
            self._document.open_demonstration(ids[target])
        elif step > 0:
            self._document.say("This is the last demonstration of the list.")
        else:
            self._document.say("This is the first demonstration of the list.")

    def _show_all(self) -> None:
        """Search for nothing any more."""
        self.search.clear()
        self.shown.setCurrentIndex(0)

    def _show_menu(self, where: QPoint) -> None:
        """Show what can be done with a demonstration or a task."""
        item, chosen = self.model.at(self.view.indexAt(where)), self._chosen()
        if item is not None:
            several = chosen if len(chosen) > 1 and item in chosen else ()
            self.menu.made_for(item, several).popup(self.view.viewport().mapToGlobal(where))
