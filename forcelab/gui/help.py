"""The help page: all keys from the table that binds them, and what the mouse does."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QKeyEvent, QPainter, QPaintEvent, QPalette, QResizeEvent
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.arranging import resize_on_screen, search_field, stress
from forcelab.gui.document import Document
from forcelab.gui.gestures import MOUSE, PAINTING
from forcelab.gui.shortcuts import COMMANDS, GROUPS, Keys, key_name

__all__ = ["MOUSE", "HelpPage"]

#: About how many characters wide keys and gestures are, and what they do.
LEFT, RIGHT = 24, 30


@dataclass(frozen=True, slots=True)
class _Section:
    """A heading with its rows: what to press or to do, each as pieces, and what it does."""

    heading: str
    rows: tuple[tuple[tuple[str, ...], str], ...]
    caps: bool


class HelpPage(QDialog):
    """All keys and gestures, searchable.

    Parameters
    ----------
    document : Document
        Whose task's actions come first.
    keys : Keys
        The keys that count now.
    offered : collection of str, optional
        The ids of the commands that do something; by default all.
    """

    def __init__(
        self,
        document: Document,
        keys: Keys,
        parent: QWidget | None = None,
        offered: Collection[str] | None = None,
    ) -> None:
        super().__init__(parent)
        self._offered = [c for c in COMMANDS if offered is None or c.id in offered]
        self.setWindowTitle("Keys and mouse")
        self._document = document
        self._keys = keys
        self._search = search_field("Search", "Search keys and gestures")
        self._search.setTextMargins(4, 2, 4, 2)
        self._search.textChanged.connect(self._fill)
        self._area = QScrollArea()
        self._area.setWidgetResizable(True)
        self._area.setFrameShape(QFrame.Shape.NoFrame)
        self._area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._area.setAccessibleName("Keys and gestures")
        buttons = QDialogButtonBox()
        close = QPushButton("Close")
        close.setAccessibleName("Close")
        close.clicked.connect(self.accept)
        buttons.addButton(close, QDialogButtonBox.ButtonRole.AcceptRole)
        layout = QVBoxLayout(self)
        layout.setSpacing(10)
        layout.addWidget(self._search)
        layout.addWidget(self._area, 1)
        layout.addWidget(buttons)
        resize_on_screen(self, self.sizeHint())
        self._columns = self._fitting()
        self._fill()
        keys.changed.connect(self._fill)
        document.vocabulary_changed.connect(self._fill)
        self._search.setFocus()

    def sizeHint(self) -> QSize:
        """Room for three columns."""
        metrics = self.fontMetrics()
        return QSize(metrics.averageCharWidth() * 210, metrics.lineSpacing() * 56)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Lay out as many columns as there is room for."""
        super().resizeEvent(event)
        if self._fitting() != self._columns:
            self._fill()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Scroll from the search field, too."""
        bar = self._area.verticalScrollBar()
        steps = {
            Qt.Key.Key_Up: -bar.singleStep(),
            Qt.Key.Key_Down: bar.singleStep(),
            Qt.Key.Key_PageUp: -bar.pageStep(),
            Qt.Key.Key_PageDown: bar.pageStep(),
        }
        step = steps.get(Qt.Key(event.key()))
        if step is None:
            super().keyPressEvent(event)
        else:
            bar.setValue(bar.value() + step)

    def _fitting(self) -> int:
        """How many columns there is room for."""
        return max(1, min(3, self.width() // (self.fontMetrics().averageCharWidth() * 54)))

    def _sections(self) -> list[_Section]:
        """All there is to say: the task's actions, the commands by group, the mouse."""
        sections = []
        actions = tuple(
            ((key_name(action.key),) if action.key else (), action.name)
            for action in self._document.vocabulary
        )
        if actions:
            sections.append(_Section("Actions of this task", actions, caps=True))
        painting = tuple(((how,), what) for how, what in PAINTING)
        sections.append(_Section("With the key of an action", painting, caps=False))
        for group in GROUPS:
            rows = tuple(
                (tuple(map(key_name, self._keys[command.id])), command.text.rstrip("…"))
                for command in self._offered
                if command.group == group and self._keys[command.id]
            )
            sections += [_Section(group, rows, caps=True)] if rows else []
        mouse = tuple(((how,), what) for how, what in MOUSE)
        sections.append(_Section("Mouse", mouse, caps=False))
        return sections

    def _matching(self) -> list[_Section]:
        """The sections with the rows that contain what is searched for."""
        wanted = self._search.text().casefold().strip()
        found = []
        for section in self._sections():
            rows = tuple(
                row
                for row in section.rows
                if wanted in " ".join((section.heading, row[1], *row[0])).casefold()
            )
            if rows:
                found.append(_Section(section.heading, rows, section.caps))
        return found

    def _fill(self) -> None:
        """Lay the sections out in columns, in reading order, the columns of like height."""
        self._columns = self._fitting()
        page = QWidget()
        across = QHBoxLayout(page)
        across.setContentsMargins(4, 4, 12, 4)
        across.setSpacing(28)
        sections = self._matching()
        for group in _shared_out(sections, self._columns) if sections else ():
            column = QVBoxLayout()
            column.setSpacing(18)
            for section in group:
                column.addWidget(_card(section))
            column.addStretch(1)
            across.addLayout(column, 1)
        if not sections:
            nothing = f"Nothing is called '{self._search.text()}'."
            label = QLabel(nothing)
            label.setTextFormat(Qt.TextFormat.PlainText)
            label.setAlignment(Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop)
            across.addWidget(label)
        self._area.setWidget(page)


def _shared_out(sections: Sequence[_Section], columns: int) -> list[list[_Section]]:
    """Deal sections out to columns without changing their order."""
    heights = [2.5 + sum(_lines(row, section.caps) for row in section.rows) for section in sections]
    low, high = max(heights, default=0.0), sum(heights)
    while high - low > 0.25:  # the lowest height into which all fit, by bisection
        middle = (low + high) / 2
        if len(_stacked(heights, middle)) <= columns:
            high = middle
        else:
            low = middle
    stacks = _stacked(heights, high)
    return [[sections[i] for i in stack] for stack in stacks] + [[]] * (columns - len(stacks))


def _lines(row: tuple[tuple[str, ...], str], caps: bool) -> float:
    """About how high a row is, in lines; caps are higher than words."""
    pieces, what = row
    wrapped = max(-(-len(what) // RIGHT), 1 if caps else -(-len(pieces[0]) // LEFT))
    return wrapped + (0.3 if caps else 0.1)


def _stacked(heights: Sequence[float], most: float) -> list[list[int]]:
    """Which of some heights go into each column if none may be higher than `most`."""
    stacks: list[list[int]] = []
    used = most + 1.0
    for i, height in enumerate(heights):
        if used + height > most:
            stacks.append([])
            used = 0.0
        stacks[-1].append(i)
        used += height
    return stacks


def _card(section: _Section) -> QWidget:
    """One section."""
    card = QWidget()
    grid = QGridLayout(card)
    grid.setContentsMargins(0, 0, 0, 0)
    grid.setHorizontalSpacing(14)
    grid.setVerticalSpacing(4)
    grid.setColumnStretch(1, 1)
    heading = QLabel(section.heading)
    stress(heading)
    rule = QFrame()
    rule.setFrameShape(QFrame.Shape.NoFrame)
    rule.setFixedHeight(1)
    rule.setAutoFillBackground(True)
    rule.setBackgroundRole(QPalette.ColorRole.Dark)
    grid.addWidget(heading, 0, 0, 1, 2)
    grid.addWidget(rule, 1, 0, 1, 2)
    grid.setColumnMinimumWidth(0, card.fontMetrics().averageCharWidth() * LEFT)
    for i, (pieces, what) in enumerate(section.rows, 2):
        says = QLabel(what)
        says.setTextFormat(Qt.TextFormat.PlainText)
        says.setWordWrap(True)
        if section.caps:
            says.setContentsMargins(0, 2, 0, 0)  # on one line with the letters in the caps
        grid.addWidget(_pieces(pieces, section.caps), i, 0, Qt.AlignmentFlag.AlignTop)
        grid.addWidget(says, i, 1, Qt.AlignmentFlag.AlignTop)
    return card


class _Cap(QLabel):
    """A key as it looks on a keyboard. Painted here: a style sheet for each costs 3 ms."""

    def __init__(self, key: str) -> None:
        super().__init__(key)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setContentsMargins(6, 1, 6, 3)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the cap below the letters; its lower edge is thicker."""
        with QPainter(self) as painter:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setPen(Qt.PenStyle.NoPen)
            box = QRectF(self.rect())
            painter.setBrush(self.palette().color(QPalette.ColorRole.Dark))
            painter.drawRoundedRect(box, 4, 4)
            painter.setBrush(self.palette().color(QPalette.ColorRole.Base))
            painter.drawRoundedRect(box.adjusted(1, 1, -1, -2), 3, 3)
        super().paintEvent(event)


def _pieces(pieces: Sequence[str], caps: bool) -> QWidget:
    """Keys side by side, or a gesture in words."""
    if not caps:
        gesture = QLabel(" ".join(pieces))
        gesture.setWordWrap(True)
        gesture.setFixedWidth(gesture.fontMetrics().averageCharWidth() * LEFT)
        gesture.setForegroundRole(QPalette.ColorRole.PlaceholderText)
        return gesture
    row = QWidget()
    across = QHBoxLayout(row)
    across.setContentsMargins(0, 0, 0, 0)
    across.setSpacing(4)
    for piece in pieces:
        across.addWidget(_Cap(piece))
    across.addStretch(1)
    return row
