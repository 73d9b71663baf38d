"""Parts that several pages are laid out with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Literal, TypeVar

from PySide6.QtCore import QByteArray, QEvent, QObject, QSize, Qt, QTimer, SignalInstance
from PySide6.QtGui import QAction, QFont, QHelpEvent, QMouseEvent, QPalette, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QApplication,
    QBoxLayout,
    QDialog,
    QDialogButtonBox,
    QDockWidget,
    QDoubleSpinBox,
    QFrame,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLayout,
    QLineEdit,
    QMainWindow,
    QMenu,
    QProgressBar,
    QPushButton,
    QScrollArea,
    QSplitter,
    QStackedWidget,
    QTabBar,
    QTableView,
    QToolButton,
    QToolTip,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui import settings
from forcelab.gui.icons import icon
from forcelab.jobs import Progress

#: Height of a table's row, in heights of its letters.
ROW_SPACING = 1.6
#: Free room around a placeholder, in pixels.
PAGE_MARGIN = 16
#: Of a widget that may become as high as it can (Qt's QWIDGETSIZE_MAX), in pixels.
UNLIMITED = 16_777_215
#: The version of the docks' layout: one of another version is not restored.
LAYOUT = 1
#: What a window's frame adds to its width and height at most, in pixels.
FRAME = QSize(16, 44)


def scroll_area(page: QWidget) -> QScrollArea:
    """A page that scrolls up and down if there is too little room; it wraps its texts."""
    area = QScrollArea(widgetResizable=True)
    area.setFrameShape(QFrame.Shape.NoFrame)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    area.setWidget(page)
    return area


def placeholder(text: str = "") -> QLabel:
    """A faint text in the middle, where there is nothing to show yet."""
    label = sentence_label(text)
    label.setMargin(PAGE_MARGIN)
    label.setAlignment(Qt.AlignmentFlag.AlignCenter)
    label.setForegroundRole(QPalette.ColorRole.PlaceholderText)
    return label


def set_enabled_with_reason(control: QWidget | QAction, obstacle: str) -> None:
    """Enable a control, menu entry or button of a toolbar; or disable it and show the reason.

    `obstacle` is the reason as a sentence; empty enables. It is shown at the mouse. An entry must
    be in its menus by then, and a button in its toolbar.
    """
    control.setEnabled(not obstacle)
    if isinstance(control, QAction):
        for menu in control.associatedObjects():
            if isinstance(menu, QMenu):
                menu.installEventFilter(_obstacles())
            elif isinstance(menu, QToolButton):
                set_enabled_with_reason(menu, obstacle)
    elif control.property("obstacle") is None:
        control.installEventFilter(_obstacles())
    control.setProperty("obstacle", obstacle)


class _Obstacles(QObject):
    """Shows why controls are disabled."""

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Show the reason at the mouse."""
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
    return _Obstacles()


class Dock(QDockWidget):
    """A dock whose buttons have the theme's colour; Qt's are black in any theme."""

    def __init__(self, title: str, parent: QWidget | None = None) -> None:
        super().__init__(title, parent)
        # Qt would draw the title in the application's font of this moment, whatever came later.
        face = QFont()
        face.setStyleHint(QFont.StyleHint.SansSerif)
        self.setFont(face)
        self._icons = {"close": icon("cross"), "float": icon("float")}
        self._set_icons()

    def event(self, event: QEvent) -> bool:
        """Set the icons again after what makes Qt set its own.

        A layout that is restored does, and tells it by no more than a request for a new layout.
        """
        handled = super().event(event)
        kinds = QEvent.Type
        if event.type() in (kinds.StyleChange, kinds.ParentChange, kinds.LayoutRequest):
            self._set_icons()
        return handled

    def _set_icons(self) -> None:
        for name, own in self._icons.items():
            button = self.findChild(QAbstractButton, f"qt_dockwidget_{name}button")
            assert isinstance(button, QAbstractButton)
            if button.icon().cacheKey() != own.cacheKey():  # setting it requests a layout itself
                button.setIcon(own)


class DockedWindow(QMainWindow):
    """A window whose docks take back their widths as soon as there is room again.

    Qt makes them narrower where the window is small, and leaves them so when it is enlarged. Their
    widths are those that were set, or dragged.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._widths: dict[QDockWidget, int] = {}
        self._pressed: dict[QDockWidget, int] = {}  # when a button of the mouse was pressed

    def restoreState(
        self, state: QByteArray | bytes | bytearray | memoryview, /, version: int | None = 0
    ) -> bool:
        """Restore docks; the tabs that Qt leaves where they were before are hidden."""
        before = self._dock_tabs()
        restored = super().restoreState(state, version)
        if set(self._dock_tabs()) - set(before):
            for tabs in before:
                tabs.hide()
        return restored

    def _dock_tabs(self) -> list[QTabBar]:
        """The tabs of docks that lie behind one another."""
        return [child for child in self.children() if isinstance(child, QTabBar)]

    def set_widths(self, docks: Sequence[QDockWidget], width: int) -> None:
        """Give docks a width, hidden ones as well."""
        self._widths.update(dict.fromkeys(docks, width))
        self.resizeDocks(list(docks), [width] * len(docks), Qt.Orientation.Horizontal)

    def widen(self) -> None:
        """Give the visible docks their widths, as far as there is room."""
        shown = {
            dock: width
            for dock, width in self._widths.items()
            if dock.isVisible() and not dock.isFloating() and dock.width() != width
        }
        if shown:
            self.resizeDocks([*shown], [*shown.values()], Qt.Orientation.Horizontal)

    def store_docks(self, key: str) -> None:
        """Remember where the docks are, and how wide they should be: the window may be small."""
        settings.store(f"{key}/layout", bytes(self.saveState(LAYOUT).data()))
        widths = [f"{width} {dock.objectName()}" for dock, width in self._widths.items()]
        settings.store(f"{key}/widths", widths)

    def restore_docks(self, key: str) -> bool:
        """Have the docks as they were remembered; gives whether they were."""
        state = settings.data(f"{key}/layout")
        if not state or not self.restoreState(QByteArray(state), LAYOUT):
            return False
        for entry in settings.strings(f"{key}/widths"):
            width, _, name = entry.partition(" ")
            dock = self.findChild(QDockWidget, name)
            if isinstance(dock, QDockWidget) and width.isdecimal():
                self._widths[dock] = int(width)
        return True

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.widen()

    def event(self, event: QEvent) -> bool:
        """Note the widths of lists whose border the mouse dragged, which the window itself has."""
        if event.type() == QEvent.Type.MouseButtonPress:
            self._pressed = self._present_widths()
        handled = super().event(event)
        if event.type() == QEvent.Type.MouseButtonRelease:
            QTimer.singleShot(0, self, self._note_dragged)  # once Qt has moved it
        return handled

    def _note_dragged(self) -> None:
        """Keep the widths that are others than when the mouse was pressed; a click has none."""
        now = self._present_widths()
        self._widths |= {
            d: now[d] for d, width in self._pressed.items() if now.get(d, width) != width
        }
        self._pressed = {}

    def note_widths(self) -> None:
        """Keep the present widths of the visible docks."""
        self._widths = self._present_widths()

    def _present_widths(self) -> dict[QDockWidget, int]:
        docks = self.findChildren(QDockWidget, options=Qt.FindChildOption.FindDirectChildrenOnly)
        return {dock: dock.width() for dock in docks if dock.isVisible() and not dock.isFloating()}


class YieldingSplitter(QSplitter):
    """Parts below each other, one of which gives its room away while there is nothing in it."""

    def __init__(self) -> None:
        super().__init__(Qt.Orientation.Vertical, childrenCollapsible=False)
        self._filled: QByteArray | None = None

    def set_empty(self, part: QWidget, lines: int) -> None:
        """Leave a part so many lines of text; with 0 its room back."""
        if lines:
            self._filled = self.filled_state
            part.setMaximumHeight(lines * self.fontMetrics().height())
        elif self._filled is not None:
            part.setMaximumHeight(UNLIMITED)
            self.restoreState(self._filled)
            self._filled = None

    @property
    def filled_state(self) -> QByteArray:
        """The sizes as they are while nothing is empty, as of `saveState`."""
        return self.saveState() if self._filled is None else self._filled

    def sizes_set(self) -> None:
        """Have the present sizes once nothing is empty."""
        if self._filled is not None:
            self._filled = self.saveState()


def fill_splitter(splitter: QSplitter, parts: Sequence[QWidget], shares: Sequence[int]) -> None:
    """Put parts into a splitter, each with its share of any room; none can be dragged away."""
    splitter.setChildrenCollapsible(False)
    for i, (part, share) in enumerate(zip(parts, shares, strict=True)):
        splitter.addWidget(part)
        splitter.setStretchFactor(i, share)
    set_shares(splitter, shares)


def set_shares(splitter: QSplitter, shares: Sequence[int]) -> None:
    """Give each part its share, however large the splitter is."""
    splitter.setSizes([1000 * share for share in shares])


class PageOrPlaceholder(QStackedWidget):
    """A page, or a text (`note`) in its place where there is nothing to show."""

    def __init__(self, page: QWidget) -> None:
        super().__init__()
        self.note = placeholder()
        self.addWidget(page)
        self.addWidget(self.note)

    def say(self, text: str) -> None:
        """Show this text in place of the page; the page if it is empty."""
        self.note.setText(text)
        self.setCurrentIndex(1 if text else 0)


#: What stands in a row or column: a widget or layout, alone or with its share of the room that is
#: left; a number is the share of room that stays empty.
Part = QWidget | QLayout | int | tuple[QWidget | QLayout, int]
BoxT = TypeVar("BoxT", bound=QBoxLayout)


def fill_layout(
    layout: BoxT,
    *parts: Part,
    margins: int | tuple[int, int, int, int] | None = None,
    spacing: int | None = None,
) -> BoxT:
    """Add parts to a row or column, and give it back.

    Margins (all, or left, top, right and bottom) and spacing are pixels, by default the style's.
    """
    if margins is not None:
        layout.setContentsMargins(*((margins,) * 4 if isinstance(margins, int) else margins))
    if spacing is not None:
        layout.setSpacing(spacing)
    for part in parts:
        content, share = part if isinstance(part, tuple) else (part, 0)
        if isinstance(content, QWidget):
            layout.addWidget(content, share)
        elif isinstance(content, QLayout):
            layout.addLayout(content, share)
        else:
            layout.addStretch(content)
    return layout


def page_layout(
    room: QWidget,
    *parts: QWidget,
    growing: QWidget | None = None,
    margin: int = 0,
    spacing: int = 0,
) -> QVBoxLayout:
    """Stack parts in a widget; the `growing` one gets the room left. Pixels."""
    shared = [(part, int(part is growing)) for part in parts]
    return fill_layout(QVBoxLayout(room), *shared, margins=margin, spacing=spacing)


def push_button(
    text: str,
    press: Callable[..., object] | SignalInstance,
    name: str = "",
    tip: str = "",
    *,
    auto_default: bool = True,
) -> QPushButton:
    """A button and what a press calls or emits; `name` is for screen readers if the text says less.

    With `auto_default` Enter presses it in a dialog, as Qt has it, and in the window never.
    """
    button = QPushButton(text)
    if not auto_default:
        button.setAutoDefault(False)
    button.setAccessibleName(name)
    button.setToolTip(tip)
    button.clicked.connect(press)
    return button


def copy_button(label: str, copied: str, name: str) -> QPushButton:
    """A button that copies a text, and says so."""

    def copy() -> None:
        QApplication.clipboard().setText(copied)
        button.setText("Copied")

    button = push_button(label, copy, name)
    return button


def tool_button(image: str, name: str, press: Callable[..., object], tip: str = "") -> QToolButton:
    """A button with an icon; `name` is for screen readers, and the tooltip if there is no `tip`."""
    button = QToolButton()
    button.setIcon(icon(image))
    button.setAccessibleName(name)
    button.setToolTip(tip or name)
    button.clicked.connect(press)
    return button


def seconds_box(name: str) -> QDoubleSpinBox:
    """A field for a time to the millisecond, which counts once it is entered."""
    box = QDoubleSpinBox(decimals=3, suffix=" s")
    box.setKeyboardTracking(False)
    box.setAccessibleName(name)
    return box


def label_of(field: QWidget, text: str) -> QLabel:
    """The label of a field; the key that it names with an ampersand leads there."""
    label = QLabel(text)
    label.setBuddy(field)
    return label


def sentence_label(text: str = "") -> QLabel:
    """A plain text that wraps: names in it may hold anything."""
    return QLabel(text, wordWrap=True, textFormat=Qt.TextFormat.PlainText)


def muted_label(text: str = "") -> QLabel:
    """A faint sentence that wraps."""
    label = sentence_label(text)
    label.setForegroundRole(QPalette.ColorRole.PlaceholderText)
    return label


def copyable(text: str = "") -> QLabel:
    """A text that wraps and can be copied."""
    label = sentence_label(text)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return label


def emphasise(widget: QWidget, larger: float = 1.0) -> None:
    """Make a widget's font bold, and so many times as large."""
    face = widget.font()
    face.setBold(True)
    if larger != 1.0:
        face.setPointSizeF(larger * face.pointSizeF())
    widget.setFont(face)


class ProgressBar(QProgressBar):
    """The progress of a job, as much of its text as fits in one line; hidden at first."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.hide()

    def show_progress(self, progress: Progress) -> None:
        self.setRange(0, progress.total)
        self.setValue(progress.done)
        self.setFormat(progress.text)
        self.setToolTip(super().text())

    def text(self) -> str:
        """The text as far as it fits; Qt would break it into lines, and cut them."""
        room = self.width() - self.fontMetrics().height()
        return self.fontMetrics().elidedText(super().text(), Qt.TextElideMode.ElideRight, room)


class SlimProgressBar(QProgressBar):
    """How far a job is beside a text that says it; it runs to and fro until that is known."""

    def __init__(self, name: str, width: int) -> None:
        super().__init__(textVisible=False)
        self.setAccessibleName(name)
        self.setFixedWidth(width)
        self.setMaximumHeight(8)

    def show_step(self, step: Progress | None) -> None:
        self.setRange(0, 0 if step is None else max(step.total, 1))
        if step is not None:
            self.setValue(min(step.done, step.total))


class ProgressRow(QWidget):
    """The progress of a job, such as "the import", and Cancel beside it; hidden at first."""

    def __init__(self, job: str, cancel: Callable[..., object]) -> None:
        super().__init__()
        self.bar = ProgressBar(f"Progress of {job}")
        self.cancel = push_button("Cancel", cancel, f"Cancel {job}")
        fill_layout(QHBoxLayout(self), (self.bar, 1), self.cancel, margins=0)
        self.bar.show()  # together with Cancel: only now it is no window of its own
        self.hide()


def toned_label(tone: Literal["trouble", "warning"], text: str = "") -> QLabel:
    """A sentence in the theme's colour for trouble or warnings."""
    label = sentence_label(text)
    label.setProperty("tone", tone)  # by which the theme's style sheet finds it
    return label


def dialog_buttons(
    dialog: QDialog, name: str, text: str = "&Use"
) -> tuple[QDialogButtonBox, QPushButton]:
    """Use and Cancel of a dialog, and the former, with its `text` and accessible name."""
    roles = QDialogButtonBox.ButtonRole
    buttons = QDialogButtonBox()
    use = buttons.addButton(text, roles.AcceptRole)
    use.setAccessibleName(name)
    cancel = buttons.addButton("Cancel", roles.RejectRole)
    cancel.setAccessibleName(cancel.text())
    buttons.accepted.connect(dialog.accept)
    buttons.rejected.connect(dialog.reject)
    return buttons, use


def add_buttons(
    dialog: QDialog, text: str, press: Callable[..., object]
) -> tuple[QPushButton, QPushButton]:
    """Add the button that does what a dialog is for, its default, and Close below all else."""
    buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close, dialog)
    go = buttons.addButton(text, QDialogButtonBox.ButtonRole.ActionRole)
    go.clicked.connect(press)
    buttons.rejected.connect(dialog.reject)
    layout = dialog.layout()
    assert layout is not None
    layout.addWidget(buttons)
    go.setDefault(True)  # only now: a button that is in no dialog yet cannot be its default
    return go, buttons.button(QDialogButtonBox.StandardButton.Close)


def run_dialog(dialog: QDialog) -> bool:
    """Show a dialog until it is closed; gives whether it was accepted."""
    accepted = bool(dialog.exec())
    dialog.deleteLater()
    return accepted


def resize_on_screen(window: QWidget, size: QSize) -> None:
    """Give a window a size (without its frame), or as much of it as its screen has room for."""
    window.resize(size.boundedTo(window.screen().availableGeometry().size() - FRAME))


def search_field(placeholder: str, name: str) -> QLineEdit:
    """A line edit that a click clears; `name` is for screen readers."""
    field = QLineEdit(placeholderText=placeholder, clearButtonEnabled=True)
    field.setAccessibleName(name)
    return field


def separator() -> QFrame:
    """A line between two groups."""
    line = QFrame(frameShape=QFrame.Shape.HLine)
    line.setFrameShadow(QFrame.Shadow.Plain)
    line.setForegroundRole(QPalette.ColorRole.Mid)
    return line


def whole_rows(table: QTableView) -> None:
    """Make a table read-only, select one whole row at a time and scroll smoothly.

    It has no grid, and leaves the Tab key to the window.
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
    table.horizontalHeader().setHighlightSections(False)
    table.installEventFilter(_RowHeights(table))


class _RowHeights(QObject):
    """Keeps the rows of a table as high as its letters need."""

    def __init__(self, table: QTableView) -> None:
        super().__init__(table)
        self._table = table
        self._fit()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.FontChange:
            self._fit()
        return False

    def _fit(self) -> None:
        height = round(ROW_SPACING * self._table.fontMetrics().height())
        self._table.verticalHeader().setDefaultSectionSize(height)
