"""Parts that several pages are laid out with."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import Literal

from PySide6.QtCore import QEvent, QObject, QSize, Qt, QTimer
from PySide6.QtGui import QAction, QHelpEvent, QMouseEvent, QPalette, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QDialog,
    QDialogButtonBox,
    QDockWidget,
    QFrame,
    QHeaderView,
    QLabel,
    QLineEdit,
    QMainWindow,
    QMenu,
    QProgressBar,
    QPushButton,
    QScrollArea,
    QStackedWidget,
    QTableView,
    QToolTip,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.icons import icon
from forcelab.jobs import Progress

#: Height of a table's row, in heights of its letters.
ROW_SPACING = 1.6
#: Free room around a placeholder, in pixels.
PAGE_MARGIN = 16
#: What a window's frame adds to its width and height at most, in pixels.
FRAME = QSize(16, 44)


def scroll_area(page: QWidget) -> QScrollArea:
    """A page that can be scrolled up and down where there is too little room.

    Parameters
    ----------
    page : QWidget
        Wraps its texts: it is as wide as the room.
    """
    area = QScrollArea()
    area.setWidgetResizable(True)
    area.setFrameShape(QFrame.Shape.NoFrame)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    area.setWidget(page)
    return area


def placeholder(text: str = "") -> QLabel:
    """What stands, faint and in the middle, where there is nothing to show yet."""
    label = _sentence(text)
    label.setMargin(PAGE_MARGIN)
    label.setAlignment(Qt.AlignmentFlag.AlignCenter)
    label.setForegroundRole(QPalette.ColorRole.PlaceholderText)
    return label


def set_enabled_with_reason(control: QWidget | QAction, obstacle: str) -> None:
    """Switch a control or an entry of menus on; or off, and tell why where it is clicked.

    `obstacle` is the reason, as a sentence, and empty where it can be used. An entry is in its
    menus by then.
    """
    control.setEnabled(not obstacle)
    if isinstance(control, QAction):
        for menu in control.associatedObjects():
            if isinstance(menu, QMenu):
                menu.installEventFilter(_obstacles())
    elif control.property("obstacle") is None:
        control.installEventFilter(_obstacles())
    control.setProperty("obstacle", obstacle)


class _Obstacles(QObject):
    """Tells the obstacles of controls that are switched off."""

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Show the reason where the mouse is."""
        # Not when pressed: Qt hides what is shown once the button is released.
        if isinstance(event, QMouseEvent) and event.type() == QEvent.Type.MouseButtonRelease:
            place = event.globalPosition().toPoint()
        elif isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            place = event.globalPos()
        else:
            return False
        assert isinstance(watched, QWidget)
        control: QWidget | QAction | None = watched
        if isinstance(watched, QMenu):
            control = watched.actionAt(watched.mapFromGlobal(place))
        obstacle = control is not None and not control.isEnabled() and control.property("obstacle")
        if obstacle:
            QToolTip.showText(place, obstacle, watched)
        return bool(obstacle)


@cache
def _obstacles() -> _Obstacles:
    """The one for all controls."""
    return _Obstacles()


class Dock(QDockWidget):
    """A list at a window's side whose buttons have the theme's ink; Qt's are black in any."""

    def __init__(self, title: str, parent: QWidget | None = None) -> None:
        super().__init__(title, parent)
        self._set_icons()

    def event(self, event: QEvent) -> bool:
        """Have the icons again after what makes Qt set its own."""
        done = super().event(event)
        if event.type() in (QEvent.Type.StyleChange, QEvent.Type.ParentChange):
            self._set_icons()
        return done

    def _set_icons(self) -> None:
        """Let the buttons show the theme's icons."""
        for name, drawing in (("close", "cross"), ("float", "float")):
            button = self.findChild(QAbstractButton, f"qt_dockwidget_{name}button")
            assert isinstance(button, QAbstractButton)
            button.setIcon(icon(drawing))


class DockedWindow(QMainWindow):
    """A window whose lists at the sides take back their widths as soon as there is room again.

    Qt makes them narrower where the window is small, and leaves them so when it is enlarged. Their
    widths are those that were set, or that somebody has dragged them to.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._widths: dict[QDockWidget, int] = {}

    def set_widths(self, docks: Sequence[QDockWidget], width: int) -> None:
        """Make lists as wide as that, those that are hidden as well."""
        self._widths.update(dict.fromkeys(docks, width))
        self.resizeDocks(list(docks), [width] * len(docks), Qt.Orientation.Horizontal)

    def widen(self) -> None:
        """Give the lists that are shown their widths, as far as there is room."""
        shown = {
            dock: width
            for dock, width in self._widths.items()
            if dock.isVisible() and not dock.isFloating() and dock.width() != width
        }
        if shown:
            self.resizeDocks([*shown], [*shown.values()], Qt.Orientation.Horizontal)

    @property
    def widths(self) -> list[str]:
        """The widths that the lists should have, to be remembered with the layout."""
        return [f"{width} {dock.objectName()}" for dock, width in self._widths.items()]

    def recall_widths(self, widths: Iterable[str]) -> None:
        """Have the widths that were remembered: the window may have been small when it closed."""
        for width, _, name in (entry.partition(" ") for entry in widths):
            dock = self.findChild(QDockWidget, name)
            if isinstance(dock, QDockWidget) and width.isdecimal():
                self._widths[dock] = int(width)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Share out the room anew."""
        super().resizeEvent(event)
        self.widen()

    def event(self, event: QEvent) -> bool:
        """Note the widths after a mouse was used on the window itself: it dragged a border."""
        done = super().event(event)
        if event.type() == QEvent.Type.MouseButtonRelease:
            QTimer.singleShot(0, self, self.note_widths)  # once Qt has moved it
        return done

    def note_widths(self) -> None:
        """The lists that are shown are as wide as they should be."""
        docks = self.findChildren(QDockWidget, options=Qt.FindChildOption.FindDirectChildrenOnly)
        self._widths = {
            dock: dock.width() for dock in docks if dock.isVisible() and not dock.isFloating()
        }


class PageOrPlaceholder(QStackedWidget):
    """A page, or what is said in its place where there is nothing to show.

    Attributes
    ----------
    note : QLabel
        What is said.
    """

    def __init__(self, page: QWidget) -> None:
        super().__init__()
        self.note = placeholder()
        self.addWidget(page)
        self.addWidget(self.note)

    def say(self, text: str) -> None:
        """Show this in place of the page; the page, where it is empty."""
        self.note.setText(text)
        self.setCurrentIndex(1 if text else 0)


def page_layout(
    room: QWidget,
    *parts: QWidget,
    growing: QWidget | None = None,
    margin: int = 0,
    spacing: int = 0,
) -> QVBoxLayout:
    """Put parts below each other into a widget.

    Parameters
    ----------
    growing : QWidget, optional
        The part that gets the room which the others leave.
    margin, spacing : int
        Around all of them, and between two, in pixels.
    """
    layout = QVBoxLayout(room)
    layout.setContentsMargins(margin, margin, margin, margin)
    layout.setSpacing(spacing)
    for part in parts:
        layout.addWidget(part, int(part is growing))
    return layout


def muted_label(text: str = "") -> QLabel:
    """A sentence that is said in passing, on as many lines as it needs."""
    label = _sentence(text)
    label.setForegroundRole(QPalette.ColorRole.PlaceholderText)
    return label


def copyable(text: str = "") -> QLabel:
    """What is told, on as many lines as it needs; it can be copied."""
    label = _sentence(text)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return label


def _sentence(text: str) -> QLabel:
    """A plain text, for names in it are anybody's, on as many lines as it needs."""
    return QLabel(text, wordWrap=True, textFormat=Qt.TextFormat.PlainText)


def emphasise(widget: QWidget, larger: float = 1.0) -> None:
    """Write what a widget says in bold letters, so many times as large."""
    face = widget.font()
    face.setBold(True)
    if larger != 1.0:
        face.setPointSizeF(larger * face.pointSizeF())
    widget.setFont(face)


class ProgressBar(QProgressBar):
    """How far a job is; hidden until there is one."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.hide()

    def show_progress(self, progress: Progress) -> None:
        """Show how far it is, in numbers and words."""
        self.setRange(0, progress.total)
        self.setValue(progress.done)
        self.setFormat(progress.text)


def set_tone(tone: Literal["trouble", "warning"], text: str = "") -> QLabel:
    """A sentence in a colour of the theme: on what is refused, or on what one should know."""
    label = _sentence(text)
    label.setProperty("tone", tone)  # by which the theme's style sheet finds it
    return label


def dialog_buttons(dialog: QDialog, name: str) -> tuple[QDialogButtonBox, QPushButton]:
    """The buttons of a dialog, and the one that takes what is chosen; `name` says that aloud."""
    roles = QDialogButtonBox.ButtonRole
    buttons = QDialogButtonBox()
    use = buttons.addButton("&Use", roles.AcceptRole)
    use.setAccessibleName(name)
    cancel = buttons.addButton("Cancel", roles.RejectRole)
    cancel.setAccessibleName(cancel.text())
    buttons.accepted.connect(dialog.accept)
    buttons.rejected.connect(dialog.reject)
    return buttons, use


def resize_on_screen(window: QWidget, size: QSize) -> None:
    """Give a window a size, or as much of it as its screen has room for, frame and all.

    Parameters
    ----------
    window : QWidget
    size : QSize
        In pixels, without the frame.
    """
    window.resize(size.boundedTo(window.screen().availableGeometry().size() - FRAME))


def search_field(placeholder: str, name: str) -> QLineEdit:
    """A line to type into that can be emptied by a click; `name` is for screen readers."""
    field = QLineEdit(placeholderText=placeholder, clearButtonEnabled=True)
    field.setAccessibleName(name)
    return field


def separator() -> QFrame:
    """A line between two groups."""
    line = QFrame()
    line.setFrameShape(QFrame.Shape.HLine)
    line.setFrameShadow(QFrame.Shadow.Plain)
    line.setForegroundRole(QPalette.ColorRole.Mid)
    return line


def whole_rows(table: QTableView) -> None:
    """Let a table be one of whole rows that are chosen one at a time, and read.

    It scrolls smoothly, draws no grid, and leaves the Tab key to the window.
    """
    modes = QAbstractItemView.ScrollMode
    table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
    table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
    table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
    table.setVerticalScrollMode(modes.ScrollPerPixel)
    table.setHorizontalScrollMode(modes.ScrollPerPixel)
    table.setShowGrid(False)
    table.setWordWrap(False)
    table.setTabKeyNavigation(False)
    rows = table.verticalHeader()
    rows.hide()
    rows.setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
    rows.setDefaultSectionSize(round(ROW_SPACING * table.fontMetrics().height()))
    table.horizontalHeader().setHighlightSections(False)
