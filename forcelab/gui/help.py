"""Help: keys from the table that binds them, mouse gestures, and About."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement, pairwise

import PySide6
from PySide6.QtCore import QRectF, QSize, Qt, qVersion
from PySide6.QtGui import (
    QKeyEvent,
    QPainter,
    QPaintEvent,
    QPalette,
    QResizeEvent,
)
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui import settings
from forcelab.gui.commands import COMMANDS, GROUPS
from forcelab.gui.document import Document
from forcelab.gui.exception_hook import log_file
from forcelab.gui.layout import (
    copy_button,
    emphasise,
    fill_layout,
    push_button,
    resize_on_screen,
    search_field,
)
from forcelab.gui.shortcuts import Keys, key_name
from forcelab.gui.text import contains_words
from forcelab.resources import versions
from forcelab.version import full_version

#: What the mouse does, as (gesture, what it does), in English.
MOUSE_HELP = (
    ("Click", "Go to that time"),
    ("Wheel", "Zoom at the pointer"),
    ("Shift + wheel", "Show earlier or later time"),
    ("Middle button, drag", "Show earlier or later time"),
    ("Drag on the forces", "Mark a range"),
    ("Drag on the overview", "Show that stretch of time"),
    (
        "Ctrl or Shift + click in the list",
        "Choose several demonstrations, for the right button's menu",
    ),
    ("Drag on the track", "Paint with the chosen action"),
    ("Drag an edge", "Move where a segment starts or ends: grab it from within the segment"),
    ("Shift + drag a segment, or Alt + drag", "Move the whole segment"),
    ("Ctrl while painting or dragging an edge, or Alt", "Do not snap"),
    ("Ctrl while moving a segment", "Do not snap"),
    ("Double click a segment", "Zoom to it"),
    ("Double click an edit in the history", "Go back or forth to where it was the last one"),
    ("Drop files on the window", "Import demonstrations, or open a project"),
    ("Right button", "Menu of what is under the pointer"),
)
#: What pressing an action's key does.
PAINTING_HELP = (
    ("Press, press again", "Start at the cursor, end at the cursor"),
    ("Hold", "Paint from the press to the release"),
    ("Press with a range marked", "Fill the range"),
    ("Press with a segment selected", "Give the segment that action"),
    ("Hold, or tap and tap again, while recording", "Mark the action live, in Capture"),
)


#: About how many characters wide keys and gestures are, and what they do.
LEFT, RIGHT = 24, 30


@dataclass(frozen=True, slots=True)
class _Section:
    """A heading with its rows: keys or a gesture in pieces, and what it does.

    `caps` draws the pieces as keys.
    """

    heading: str
    rows: tuple[tuple[tuple[str, ...], str], ...]
    caps: bool


class HelpPage(QDialog):
    """All keys and gestures, searchable."""

    def __init__(self, document: Document, keys: Keys, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Keyboard shortcuts")
        self._document, self._keys = document, keys
        self._search = search_field("Search", "Search keys and gestures")
        self._search.setTextMargins(4, 2, 4, 2)
        self._search.textChanged.connect(self._fill)
        self._area = QScrollArea(widgetResizable=True)
        self._area.setFrameShape(QFrame.Shape.NoFrame)
        self._area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._area.setAccessibleName("Keys and gestures")
        buttons = QDialogButtonBox()
        close = push_button("Close", self.accept, "Close")
        buttons.addButton(close, QDialogButtonBox.ButtonRole.AcceptRole)
        fill_layout(QVBoxLayout(self), self._search, self._area, buttons, spacing=10)
        resize_on_screen(self, self.sizeHint())
        self._fill()
        keys.changed.connect(self._fill)
        document.vocabulary_changed.connect(self._fill)
        self._search.setFocus()

    def sizeHint(self) -> QSize:
        metrics = self.fontMetrics()
        return QSize(metrics.averageCharWidth() * 210, metrics.lineSpacing() * 56)

    def resizeEvent(self, event: QResizeEvent) -> None:
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
        """The number of columns that fit."""
        return max(1, min(3, self.width() // (self.fontMetrics().averageCharWidth() * 54)))

    def _sections(self) -> list[_Section]:
        """The task's actions, the commands by group, the mouse."""
        sections = []
        actions = tuple(
            ((key_name(action.key),) if action.key else (), action.name)
            for action in self._document.vocabulary
        )
        if actions:
            sections.append(_Section("Actions of this task", actions, caps=True))
        painting = tuple(((press,), effect) for press, effect in PAINTING_HELP)
        sections.append(_Section("With the key of an action", painting, caps=False))
        for group in GROUPS:
            rows = tuple(
                (tuple(map(key_name, self._keys[command.id])), command.text.rstrip("…"))
                for command in COMMANDS
                if command.group == group and self._keys[command.id]
            )
            sections += [_Section(group, rows, caps=True)] if rows else []
        mouse = tuple(((gesture,), effect) for gesture, effect in MOUSE_HELP)
        sections.append(_Section("Mouse", mouse, caps=False))
        return sections

    def _matching(self) -> list[_Section]:
        """The sections with the rows that contain the search text."""
        query, sections = self._search.text(), []
        for section in self._sections():
            rows = tuple(
                row
                for row in section.rows
                if contains_words(" ".join((section.heading, row[1], *row[0])), query)
            )
            sections += [replace(section, rows=rows)] if rows else []
        return sections

    def _fill(self) -> None:
        """Lay the sections out in columns of like height, in reading order."""
        self._columns = self._fitting()
        page = QWidget()
        across = fill_layout(QHBoxLayout(page), margins=(4, 4, 12, 4), spacing=28)
        sections = self._matching()
        for group in _balanced_columns(sections, self._columns) if sections else ():
            column = fill_layout(QVBoxLayout(), *map(_card, group), 1, spacing=18)
            across.addLayout(column, 1)
        if not sections:
            sentence = f"Nothing is called '{self._search.text()}'."
            label = QLabel(sentence, textFormat=Qt.TextFormat.PlainText)
            label.setAlignment(Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop)
            across.addWidget(label)
        self._area.setWidget(page)


def _balanced_columns(sections: Sequence[_Section], columns: int) -> list[Sequence[_Section]]:
    """Distribute sections over columns without changing their order; the highest one is lowest.

    Of several ways it is that in which the first columns hold most.
    """
    heights = [2.5 + sum(_lines(row, section.caps) for row in section.rows) for section in sections]

    def highest(cuts: Sequence[int]) -> float:
        return max(sum(heights[a:b]) for a, b in pairwise((0, *cuts, len(heights))))

    ways = combinations_with_replacement(range(len(sections) + 1), columns - 1)
    cuts = min(sorted(ways, reverse=True), key=highest)
    return [sections[a:b] for a, b in pairwise((0, *cuts, len(sections)))]


def _lines(row: tuple[tuple[str, ...], str], caps: bool) -> float:
    """About how high a row is, in lines; caps are higher than words."""
    pieces, meaning = row
    wrapped = max(-(-len(meaning) // RIGHT), 1 if caps else -(-len(pieces[0]) // LEFT))
    return wrapped + (0.3 if caps else 0.1)


def _card(section: _Section) -> QWidget:
    card = QWidget()
    grid = QGridLayout(card)
    grid.setContentsMargins(0, 0, 0, 0)
    grid.setHorizontalSpacing(14)
    grid.setVerticalSpacing(4)
    grid.setColumnStretch(1, 1)
    heading = QLabel(section.heading)
    emphasise(heading)
    rule = QFrame(frameShape=QFrame.Shape.NoFrame)
    rule.setFixedHeight(1)
    rule.setAutoFillBackground(True)
    rule.setBackgroundRole(QPalette.ColorRole.Dark)
    grid.addWidget(heading, 0, 0, 1, 2)
    grid.addWidget(rule, 1, 0, 1, 2)
    grid.setColumnMinimumWidth(0, card.fontMetrics().averageCharWidth() * LEFT)
    for i, (pieces, meaning) in enumerate(section.rows, 2):
        explanation = QLabel(meaning, textFormat=Qt.TextFormat.PlainText, wordWrap=True)
        if section.caps:
            explanation.setContentsMargins(0, 2, 0, 0)  # on one line with the letters in the caps
        grid.addWidget(_pieces(pieces, section.caps), i, 0, Qt.AlignmentFlag.AlignTop)
        grid.addWidget(explanation, i, 1, Qt.AlignmentFlag.AlignTop)
    return card


class _KeyCap(QLabel):
    """A key as it looks on a keyboard. Painted here: a style sheet for each costs 3 ms."""

    def __init__(self, key: str) -> None:
        super().__init__(key)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setContentsMargins(6, 1, 6, 3)

    def paintEvent(self, event: QPaintEvent) -> None:
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
        gesture = QLabel(" ".join(pieces), wordWrap=True)
        gesture.setFixedWidth(gesture.fontMetrics().averageCharWidth() * LEFT)
        gesture.setForegroundRole(QPalette.ColorRole.PlaceholderText)
        return gesture
    row = QWidget()
    fill_layout(QHBoxLayout(row), *map(_KeyCap, pieces), 1, margins=0, spacing=4)
    return row


def facts() -> dict[str, str]:
    """Versions by name, and where settings and log are."""
    facts_by_name = {**versions(), "PySide6": PySide6.__version__, "Qt": qVersion()}
    facts_by_name["settings"] = settings.settings().fileName()
    facts_by_name["log"] = str(log_file())
    return facts_by_name


class AboutDialog(QDialog):
    """Versions and folders: all that a report of a fault needs."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("About forcelab")
        title = QLabel(f"forcelab {full_version()}")
        emphasise(title, 1.4)
        purpose = QLabel("Labels, recognises and scores the actions of hands in recorded forces.")
        form, lines = QFormLayout(), []
        for name, value in facts().items():
            lines.append(f"{name}: {value}")
            if name != "forcelab":
                plain = Qt.TextFormat.PlainText  # names of folders are no markup
                shown = QLabel(value, textFormat=plain)
                shown.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
                shown.setAccessibleName(name)
                form.addRow(name, shown)
        buttons = QDialogButtonBox()
        self.copy_button = copy_button("Copy", "\n".join(lines), "Copy versions and places")
        close = push_button("Close", self.accept, "Close")
        close.setDefault(True)
        buttons.addButton(self.copy_button, QDialogButtonBox.ButtonRole.ActionRole)
        buttons.addButton(close, QDialogButtonBox.ButtonRole.AcceptRole)
        fill_layout(QVBoxLayout(self), title, purpose, form, buttons, spacing=14)
