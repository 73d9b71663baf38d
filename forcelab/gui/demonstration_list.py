"""The list at the left: demonstrations by task, how far each is labelled, and by whom."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path

from PySide6.QtCore import (
    QItemSelectionModel,
    QModelIndex,
    QObject,
    QPoint,
    QPointF,
    QRectF,
    QSize,
    Qt,
    QTimer,
    Signal,
    SignalInstance,
)
from PySide6.QtGui import (
    QAction,
    QActionGroup,
    QColor,
    QFont,
    QFontMetricsF,
    QKeyEvent,
    QKeySequence,
    QPainter,
    QTextCursor,
)
from PySide6.QtWidgets import (
    QAbstractItemView,
    QApplication,
    QDialog,
    QHBoxLayout,
    QInputDialog,
    QLabel,
    QLineEdit,
    QMenu,
    QPlainTextEdit,
    QStackedWidget,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QToolButton,
    QTreeView,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui import settings
from forcelab.gui.demonstration_model import (
    DemonstrationModel,
    DemonstrationRow,
    ListFilter,
    ListOrder,
    TaskGroup,
    count_finished,
    find_next,
    grouped,
    ordered,
    percent,
    rows_of,
)
from forcelab.gui.document import Document
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.figures.text import NAMES
from forcelab.gui.file_dialogs import ask_file
from forcelab.gui.icons import icon, paint_icon
from forcelab.gui.item_views import (
    ABOVE,
    GAP,
    SIDE,
    SMALL,
    Index,
    draw_line,
    paint_chevron,
    paint_row_background,
    smaller,
)
from forcelab.gui.label.track_spans import track_spans
from forcelab.gui.layout import (
    dialog_buttons,
    fill_layout,
    label_of,
    page_layout,
    push_button,
    set_enabled_with_reason,
)
from forcelab.gui.shortcuts import keys
from forcelab.gui.text import ask, escape_ampersands, settle_name
from forcelab.gui.theme import Colours, colours, themes
from forcelab.gui.widgets import ENTER_KEYS, ElidedComboBox, ElidedLabel
from forcelab.labels import Segments
from forcelab.project import DemonstrationInfo, Project
from forcelab.segment_edits import SLIVER

#: The bar's width and thickness, in heights of the smaller line, and its most of a row's width.
BAR_WIDTH, BAR_THICKNESS, BAR_SHARE = 3.6, 0.32, 0.18


class RowPainter(QStyledItemDelegate):
    """Paints tasks as headings and demonstrations as two lines each."""

    def __init__(self, model: DemonstrationModel, parent: QObject) -> None:
        super().__init__(parent)
        self._model = model

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        """One line for a task, two for a demonstration."""
        height = QFontMetricsF(option.font).height()
        if isinstance(self._model.at(index), TaskGroup):
            return QSize(0, round(height * 1.7))
        return QSize(0, round(height * (1 + SMALL + 3 * ABOVE)))

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        item = self._model.at(index)
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        is_open = isinstance(item, DemonstrationRow) and item.info.id == self._model.opened
        paint_row_background(painter, option, is_open)
        if isinstance(item, TaskGroup):
            _paint_group(painter, option, item)
        elif item is not None:
            _paint_row(painter, option, item, is_open)
        painter.restore()


def _paint_group(painter: QPainter, option: QStyleOptionViewItem, group: TaskGroup) -> None:
    """A task: its chevron, its name, and how many of its demonstrations are done."""
    theme, box = colours(), QRectF(option.rect)
    font = QFont(option.font)
    font.setBold(True)
    height = QFontMetricsF(option.font).height()
    expanded = bool(option.state & QStyle.StateFlag.State_Open)
    left, right = box.left() + SIDE * height, box.right() - SIDE * height
    paint_chevron(painter, QPointF(left + 0.25 * height, box.center().y()), height, expanded)
    left += height * 0.9
    count = f"{group.finished}/{len(group.rows)}"
    small = smaller(option.font)
    room = QFontMetricsF(small).horizontalAdvance(count)
    draw_line(
        painter,
        QRectF(right - room - 1, box.top(), room + 1, box.height()),
        count,
        small,
        theme.muted,
    )
    name = group.task or "No task"
    where = QRectF(left, box.top(), right - room - GAP * height - left, box.height())
    draw_line(painter, where, name, font, theme.text, elide=NAMES)


def _paint_row(
    painter: QPainter, option: QStyleOptionViewItem, row: DemonstrationRow, is_open: bool
) -> None:
    """A demonstration: name and icons above; bar, percent and the other authors below."""
    theme, box = colours(), QRectF(option.rect)
    font = QFont(option.font)
    font.setBold(is_open)
    height = QFontMetricsF(option.font).height()
    left, right = box.left() + SIDE * height + 0.9 * height, box.right() - SIDE * height
    top = box.top() + ABOVE * height
    side = 0.85 * height
    edge = right
    for mark, ink in _marks(row, theme):
        where = QRectF(edge - side, top + (height - side) / 2, side, side)
        paint_icon(painter, where, mark, QColor(ink))
        edge -= side + GAP * height
    where = QRectF(left, top, edge - left, height)
    draw_line(painter, where, row.info.name, font, theme.text, elide=NAMES)

    small = smaller(option.font)
    sizes = QFontMetricsF(small)
    line = QRectF(left, top + height + ABOVE * height, right - left, sizes.height())
    wide = min(BAR_WIDTH * height, BAR_SHARE * box.width())
    bar = QRectF(line.left(), 0, wide, BAR_THICKNESS * height)
    bar.moveCenter(QPointF(bar.center().x(), line.center().y()))
    _paint_bar(painter, bar, row.share, theme)
    digits = sizes.horizontalAdvance("100 %")
    where = QRectF(bar.right() + GAP * height, line.top(), digits + 1, line.height())
    ink = theme.text if row.share else theme.muted
    draw_line(painter, where, f"{percent(row.share)} %", small, ink, Qt.AlignmentFlag.AlignRight)
    names = ", ".join(name for name, _ in row.others)
    if row.blind:
        names = "others hidden"
    start = where.right() + 1.5 * GAP * height
    draw_line(
        painter,
        QRectF(start, line.top(), right - start, line.height()),
        names,
        small,
        theme.muted,
        elide=Qt.TextElideMode.ElideRight,
    )


def _marks(row: DemonstrationRow, theme: Colours) -> list[tuple[str, str]]:
    """The icons of a demonstration and their colours, from the right."""
    marks = [("video", theme.muted)] if row.info.has_video else []
    if row.done:
        marks.append(("check", theme.text))
    elif row.blind:
        marks.append(("eye-off", theme.warning))
    elif row.assignment is not None:
        marks.append(("person", theme.text))
    if row.notes:
        marks.append(("note", theme.text))
    return marks


def _paint_bar(painter: QPainter, bar: QRectF, share: float, theme: Colours) -> None:
    """The labelled share as a bar."""
    radius = bar.height() / 2
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(translucent(theme.frame, 0.6))
    painter.drawRoundedRect(bar, radius, radius)
    if share > 0:
        # Never shorter than it is thick, so that a beginning is seen.
        length = max(bar.width() * share, bar.height())
        painter.setBrush(QColor(theme.curves[0]))
        painter.drawRoundedRect(QRectF(bar.left(), bar.top(), length, bar.height()), radius, radius)


#: Where the settings keep what the list is sorted by.
ORDER_KEY = "list/order"
ORDERS: dict[ListOrder, str] = {
    "name": "By name",
    "share": "Least labelled by me first",
    "edit": "Recently labelled first",
}
#: What of the list can be shown, and letters of that which are always seen.
FILTERS: dict[ListFilter, str] = {
    "all": "All",
    "unlabelled": "Not labelled by me",
    "begun": "Started, not done",
    "assigned": "Assigned to me, to do",
    "done": "Done by me",
}
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


class NoteDialog(QDialog):
    """Asks for a note of several lines; Ctrl+Return accepts it."""

    def __init__(self, name: str, text: str, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle(f"Note on {name}")
        self.text = QPlainTextEdit(text, tabChangesFocus=True)
        self.text.moveCursor(QTextCursor.MoveOperation.End)  # what is typed goes on
        label = label_of(self.text, "&Note for other coders (leave it empty for none):")
        buttons, save = dialog_buttons(self, "Save the note", "&Save")
        save.setToolTip(
            QKeySequence("Ctrl+Return").toString(QKeySequence.SequenceFormat.NativeText)
        )
        page_layout(self, label, self.text, buttons, growing=self.text, margin=10, spacing=8)

    def sizeHint(self) -> QSize:
        """About sixty letters wide and six lines high."""
        metrics = self.fontMetrics()
        lines = super().sizeHint().height() - self.text.sizeHint().height()
        return QSize(metrics.averageCharWidth() * 64, lines + metrics.lineSpacing() * 7)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Ctrl+Return comes here from the text, where Return alone begins a line."""
        if event.key() in ENTER_KEYS and event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            self.accept()
        else:
            super().keyPressEvent(event)


class DemonstrationMenu(QObject):
    """The context menu and its verbs; each verb is a call of the project and asks nothing."""

    def __init__(self, document: Document, parent: QWidget) -> None:
        super().__init__(parent)
        self._document, self._window = document, parent
        self._left: dict[str, str] = {}  # by id, the task that a demonstration was taken from

    def menu_for(
        self, item: DemonstrationRow | TaskGroup, several: Sequence[DemonstrationRow] = ()
    ) -> QMenu:
        """The menu of a demonstration, of several, or of a task; deletes itself once closed."""
        menu = QMenu(self._window)
        menu.aboutToHide.connect(menu.deleteLater)
        project = self._document.project
        if isinstance(item, TaskGroup):
            self._fill(menu, item.rows, single=False)
        else:
            self._fill(menu, several or (item,), single=not several)
        if project is None or project.read_only:
            for action in menu.actions():
                if action.data() != "open":
                    set_enabled_with_reason(action, "The project can only be read.")
        return menu

    # Verbs

    def assign(self, ids: list[str], author: str) -> bool:
        """Assign demonstrations to a coder, blind."""
        return self._each(ids, lambda project, id_: project.coding.assign(id_, author))

    def unassign(self, ids: list[str], author: str) -> bool:
        """Withdraw a coder's assignments."""
        return self._each(ids, lambda project, id_: project.coding.unassign(id_, author))

    def set_done(self, ids: list[str], done: bool) -> bool:
        """Mark demonstrations as done by the coder, or as not done."""
        author = self._document.author

        return self._each(ids, lambda project, id_: project.coding.set_done(id_, author, done))

    def rename(self, id_: str, name: str) -> bool:
        return self._each([id_], lambda project, id_: project.demonstrations.rename(id_, name))

    def set_note(self, id_: str, text: str) -> bool:
        """Write the coder's note on a demonstration; ``""`` removes it."""
        author = self._document.author
        return self._each([id_], lambda project, id_: project.coding.set_note(id_, author, text))

    def set_task(self, ids: list[str], task: str) -> bool:
        """Move demonstrations to another task; the menu of each offers the way back."""
        old = {info.id: info.task for info in self._document.infos}

        def carry_out(project: Project, id_: str) -> None:
            project.demonstrations.set_task(id_, task)
            self._left[id_] = old.get(id_, "")

        done = self._each(ids, carry_out)
        if done and self._document.id not in ids:
            self._document.reread()  # both tasks may list other actions now
        return done

    def remove(self, heads: Mapping[str, Mapping[str, int]]) -> bool:
        """Remove demonstrations for good: by id, the track heads the coder has agreed to lose."""
        return self._do(heads, lambda project: project.demonstrations.remove_all(heads))

    def attach_video(self, id_: str, path: Path, name: str | None = None) -> bool:
        """Copy a video into the project, in place of the one of that name; by default the first.

        Its clock is set by synchronising.
        """
        from forcelab.formats import naming_recording
        from forcelab.video.validate import check_video

        damage = ""

        def attach(project: Project, id_: str) -> None:
            nonlocal damage
            # What is no video is not copied, and takes no video's place.
            with naming_recording(path):
                damage = check_video(path, project.demonstrations.info(id_).duration)
            project.media.attach_video(id_, path, name=name)

        done = self._each([id_], attach)
        if done and damage:
            self._document.show_message(damage, True)
        return done

    # Inside

    def _fill(self, menu: QMenu, rows: Sequence[DemonstrationRow], *, single: bool) -> None:
        """What can be done with a demonstration, or with all of several at once."""

        def count(ids: Sequence[str]) -> str:
            return "" if single else f"{len(ids)} "

        ids = [row.info.id for row in rows]
        done_ids = [row.info.id for row in rows if row.done]
        undone_ids = [row.info.id for row in rows if not row.done]
        if single:
            self._add_open(menu, ids[0])
        if undone_ids:
            menu.addAction(f"Mark {count(undone_ids)}as done", lambda: self._ask_done(undone_ids))
        if done_ids:
            text = f"Mark {count(done_ids)}as not done"
            menu.addAction(text, lambda: self.set_done(done_ids, False))
        menu.addAction(f"Assign {count(ids)}for blind coding…", lambda: self.ask_assign(rows))
        assigned: dict[str, list[str]] = {}
        for row in rows:
            for assignment in row.assignments:
                assigned.setdefault(assignment.author, []).append(row.info.id)
        for author, assigned_ids in assigned.items():
            which = (
                "the assignment" if len(assigned_ids) == 1 else f"{len(assigned_ids)} assignments"
            )
            text = f"Withdraw {which} ({escape_ampersands(author)})"
            menu.addAction(text, self._withdrawing(assigned_ids, author))
        menu.addSeparator()
        if single:
            self._add_changes(menu, rows[0])
        menu.addAction(f"Move {count(ids)}to another task…", lambda: self.ask_task(rows))
        before = self._left.get(ids[0], rows[0].info.task)
        if single and before != rows[0].info.task:
            back = f"Back to task '{escape_ampersands(before) or 'No task'}'"
            menu.addAction(back, lambda: self.set_task(ids, before))
        menu.addSeparator()
        menu.addAction(f"Remove {count(ids)}from the project…", lambda: self._ask_remove(rows))

    def _add_open(self, menu: QMenu, id_: str) -> None:
        first = menu.addAction("Open", lambda: self._document.open_demonstration(id_))
        first.setData("open")
        set_enabled_with_reason(first, "It is open." if id_ == self._document.id else "")
        menu.addSeparator()

    def _add_changes(self, menu: QMenu, row: DemonstrationRow) -> None:
        """Note, name and videos of one demonstration."""
        info = row.info
        menu.addAction("Note…", lambda: self.ask_note(row))
        menu.addAction("Rename…", lambda: self.ask_name(row))
        if len(info.videos) < 2:
            video = "Replace video…" if info.has_video else "Attach video…"
            menu.addAction(video, lambda: self.ask_video(info, *info.videos))
        else:
            self._add_videos(menu.addMenu("Replace video"), info, self.ask_video)
        if info.has_video:
            menu.addAction("Add another video…", lambda: self.ask_video(info))
            self._add_videos(menu.addMenu("Remove video"), info, self._ask_remove_video)

    def _add_videos(
        self, menu: QMenu, info: DemonstrationInfo, ask: Callable[[DemonstrationInfo, str], object]
    ) -> None:
        for name in info.videos:
            menu.addAction(escape_ampersands(name) + "…", partial(ask, info, name))

    def _withdrawing(self, ids: list[str], author: str) -> Callable[[], object]:
        """A call that withdraws these assignments, once the coder agrees to what that shows."""

        def withdraw() -> None:
            own = ids if author == self._document.author else ()
            if confirm_reveal(self._document, own, self._window, withdrawing=True):
                self.unassign(ids, author)

        return withdraw

    def _each(self, ids: list[str], verb: Callable[[Project, str], object]) -> bool:
        """Change demonstrations one after the other."""
        return self._do(ids, lambda project: [verb(project, id_) for id_ in ids])

    def _do(self, ids: Collection[str], verb: Callable[[Project], object]) -> bool:
        """Change demonstrations, then read them again; returns whether that succeeded."""
        project = self._document.project
        if project is None:
            return False
        try:
            verb(project)
        except ForcelabError as error:
            self._document.refuse(str(error))
            return False
        finally:
            is_open = self._document.id in ids
            self._document.reread() if is_open else self._document.refresh_listing()
        return True

    def _ask_done(self, ids: list[str]) -> None:
        """Mark as done, once the coder agrees to see what others labelled."""
        if confirm_reveal(self._document, ids, self._window):
            self.set_done(ids, True)

    def _choose(self, title: str, text: str, names: Iterable[str]) -> str | None:
        """Ask for one of these names, or another one; None if cancelled."""
        offered = list(dict.fromkeys(names))
        name, agreed = QInputDialog.getItem(self._window, title, text, offered, 0, True)
        return name if agreed else None

    def ask_assign(self, rows: Sequence[DemonstrationRow]) -> None:
        project, document = self._document.project, self._document
        if project is None:
            return
        # Mostly somebody else: a second coder who must not see what this one has labelled.
        others = [name for name in project.coding.people() if name != document.author]
        names = [*others, document.author]
        text = (
            "Until it is done, the coder sees nobody else's labels or notes, and no predictions.\n"
            "Coder:"
        )
        name = self._choose("Assign for blind coding", text, names)
        if name is None:
            return
        coder = settle_name(self._window, name, names)
        ids = [row.info.id for row in rows]
        if self.assign(ids, coder):  # of which nothing is seen but by that coder
            what = "The demonstration is" if len(ids) == 1 else f"{len(ids)} demonstrations are"
            document.show_message(f"{what} assigned to {coder}.")

    def ask_name(self, row: DemonstrationRow) -> None:
        name, agreed = QInputDialog.getText(
            self._window, "Rename demonstration", "Name:", QLineEdit.EchoMode.Normal, row.info.name
        )
        if agreed and name.strip() != row.info.name:
            self.rename(row.info.id, name)

    def ask_note(self, row: DemonstrationRow) -> None:
        """Edit the coder's note on a demonstration in a dialog that blocks nothing."""
        if not self._do((), Project.refuse_read_only):
            return
        author = self._document.author
        text = next((note.text for note in row.notes if note.author == author), "")
        dialog = NoteDialog(row.info.name, text, self._window)

        def write() -> None:
            if self.set_note(row.info.id, dialog.text.toPlainText()):
                dialog.deleteLater()
            else:
                dialog.open()  # what was typed is not lost

        dialog.accepted.connect(write)
        dialog.rejected.connect(dialog.deleteLater)
        dialog.open()

    def ask_task(self, rows: Sequence[DemonstrationRow]) -> None:
        project = self._document.project
        if project is None:
            return
        tasks = project.demonstrations.tasks()
        title = f"Move {rows[0].info.name if len(rows) == 1 else len(rows)} to another task"
        text = "Labels are kept; missing actions are added to the task.\nTask:"
        task = self._choose(title, text, (rows[0].info.task, *tasks))
        if task is not None:
            name = settle_name(self._window, task, tasks)
            self.set_task([row.info.id for row in rows], name)

    def _ask_remove(self, rows: Sequence[DemonstrationRow]) -> None:
        """Remove demonstrations, once the coder agrees to what goes with them."""
        from forcelab.gui.removal_dialog import confirm_removal

        agreed: dict[str, dict[str, int]] = {}

        def ask(project: Project) -> None:
            # Read before anything is asked: labels painted meanwhile are not among what was told.
            heads = {
                row.info.id: {
                    name: project.tracks.head(row.info.id, name) for name in row.info.authors
                }
                for row in rows
            }
            if confirm_removal(rows, self._document.author, project, self._window):
                agreed.update(heads)

        if self._do((), ask) and agreed and self.remove(agreed):
            message = f"'{rows[0].info.name}' was removed."
            if len(rows) > 1:
                message = f"{len(rows)} demonstrations were removed."
            self._document.show_message(message)

    def _ask_remove_video(self, info: DemonstrationInfo, name: str) -> None:
        answers = "Remove", "Cancel"
        answer = ask(
            self._window,
            "Remove video",
            f"Remove the video '{name}' of '{info.name}' for good?",
            "The file that it was attached from stays, and so do all labels.",
            answers,
            default=1,
            escape=1,
        )
        if answer == answers[0]:
            self._each([info.id], lambda project, id_: project.media.remove_video(id_, name))

    def ask_video(self, info: DemonstrationInfo, name: str | None = None) -> None:
        """Attach a video in place of the one of that name; a further one is asked for its name."""
        path = ask_file(
            self._window,
            f"Video of {info.name}",
            "video",
            "Videos (*.mp4 *.avi *.mkv *.mov *.webm *.m4v);;All files (*)",
        )
        if path is not None and name is None and info.has_video:
            own = path.stem.removeprefix(info.name).strip("._- ") or path.stem
            title = f"Add another video to {info.name}"
            text = "A video of the same name is replaced.\nName:"
            name = self._choose(title, text, (own, *info.videos))
            path = None if name is None else path
        if path is not None and self.attach_video(info.id, path, name):
            self._document.show_message(
                f"'{info.name}' has its video; Demonstration > Synchronise the video puts it in "
                "time."
            )


def confirm_reveal(
    document: Document, ids: Collection[str], window: QWidget, *, withdrawing: bool = False
) -> bool:
    """Ask whether to end blind coding of these demonstrations; True if there is nothing to ask.

    It ends as they are marked as done, or by `withdrawing` the coder's assignments.
    """
    project = document.project
    hidden = set() if project is None else project.coding.blind_to(document.author) & set(ids)
    if not hidden:
        return True
    names = [f"'{info.name}'" for info in document.infos if info.id in hidden]
    which = names[0] if len(names) == 1 else f"{len(names)} demonstrations"
    step = f"Withdraw your assignment of {which}" if withdrawing else f"Mark {which} as done"
    text = f"{step} and end blind coding?"
    detail = (
        "You will see the labels and notes of others and the predictions. What has been seen "
        "cannot be hidden again."
    )
    answers = "Withdraw" if withdrawing else "Mark as done", "Cancel"
    answer = ask(window, "End blind coding", text, detail, answers, default=1, escape=1)
    return answer == answers[0]


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
        document.finish_stroke()  # it may leave a gap, or fill one
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
