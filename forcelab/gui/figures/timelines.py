"""Timeline pairs: what the coder saw above what the recogniser predicted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from PySide6.QtCore import QLineF, QRectF, QSizeF
from PySide6.QtGui import QColor, QPainter, QPen

from forcelab.errors import InputError
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis, draw_bottom
from forcelab.gui.figures.canvas import LIGHT, Figure, Theme
from forcelab.gui.figures.tracks import Look, paint_look, paint_track
from forcelab.labels import Segments
from forcelab.vocabulary import Vocabulary

__all__ = ["Pair", "TimelinePairs"]

MARGIN = 24.0
BAR = 13.0
#: Between human and predicted; between one pair and the next.
THIN = 2.0
ROW_GAP = 9.0
#: Names and notes longer than this are elided.
NAME_ROOM = 170.0
NOTE_ROOM = 150.0
LEGEND_ROOM = 190.0
LEGEND_LINE = 20.0
SWATCH = 22.0
#: From the last row to the bottom: marks, numbers and title of the time axis.
AXIS_ROOM = 36.0
#: Figures higher than this have a time axis at the top as well.
TALL = 900.0
KEY = "Upper bar: human. Lower bar: predicted. White: unlabelled."


@dataclass(frozen=True)
class Pair:
    """One demonstration's two tracks.

    Parameters
    ----------
    name : str
        The demonstration's.
    human, predicted : tuple of Segment
        In order, never overlapping. What lies outside ``[start, end)`` is not drawn.
    start, end : float
        The demonstration's, in seconds, finite, ``start < end``.
    note : str
        Said at the right, such as ``"72.0 %"``.

    Raises
    ------
    InputError
        If the demonstration is empty or runs backwards.
    """

    name: str
    human: Segments
    predicted: Segments
    start: float
    end: float
    note: str = ""

    def __post_init__(self) -> None:
        finite = math.isfinite(self.start) and math.isfinite(self.end)
        if not finite or not self.start < self.end:
            raise InputError(
                f"The timeline of '{self.name}' must end after it starts; it goes from "
                f"{self.start} s to {self.end} s."
            )


@dataclass(frozen=True)
class TimelinePairs(Figure):
    """Human and predicted timelines in pairs, on one time axis.

    Parameters
    ----------
    title : str
        At the top.
    pairs : tuple of Pair
        At least one; drawn from top to bottom.
    vocabulary : Vocabulary
        Has every action that is drawn.
    actions : tuple of str
        The legend's first actions; the others follow in the order of their occurrence, human
        tracks first.
    theme : Theme
        Colours apart from the actions'.
    width : float
        In pixels; the height follows from the number of pairs.
    note_key : str
        What the notes say, such as ``"At the right: frame accuracy."``; drawn below the title
        where any pair has a note.

    Raises
    ------
    InputError
        If there is no pair or the vocabulary lacks an action.
    """

    title: str
    pairs: tuple[Pair, ...]
    vocabulary: Vocabulary
    actions: tuple[str, ...] = ()
    theme: Theme = LIGHT
    width: float = 960.0
    note_key: str = ""

    def __post_init__(self) -> None:
        if not self.pairs:
            raise InputError("There is no demonstration to draw; choose at least one.")
        tracks = [pair.human for pair in self.pairs] + [pair.predicted for pair in self.pairs]
        found = (segment.action for track in tracks for segment in track)
        actions = tuple(dict.fromkeys((*self.actions, *found)))
        object.__setattr__(self, "actions", actions)
        for action in actions:
            if action not in self.vocabulary:
                raise InputError(f"The vocabulary lacks the action '{action}'; add it.")

    @property
    def size(self) -> QSizeF:
        """Width and height in pixels."""
        return QSizeF(self.width, self._rows_end + AXIS_ROOM + MARGIN)

    @cached_property
    def axis(self) -> Axis:
        """The time axis, from seconds to pixels."""
        start = min(pair.start for pair in self.pairs)
        end = max(pair.end for pair in self.pairs)
        names = [text.shown(pair.name) for pair in self.pairs]
        left = MARGIN + min(text.widest(names, text.font()), NAME_ROOM) + 10
        notes = [text.shown(pair.note) for pair in self.pairs]
        note_room = min(text.widest(notes, text.font(10)), NOTE_ROOM)
        right = self.width - MARGIN - (note_room + 10 if note_room else 0.0)
        return Axis(start, end, left, right)

    def boxes(self, row: int) -> tuple[QRectF, QRectF]:
        """Where the human and the predicted track of a pair lie, in pixels."""
        pair, axis = self.pairs[row], self.axis
        left, right = axis.at(pair.start), axis.at(pair.end)
        top = self._rows_top + row * (2 * BAR + THIN + ROW_GAP)
        human = QRectF(left, top, right - left, BAR)
        return human, human.translated(0, BAR + THIN)

    def paint(self, painter: QPainter) -> None:
        """Draw title, legend, pairs and time axis."""
        ink, muted = QColor(self.theme.text), QColor(self.theme.muted)
        room = self.width - 2 * MARGIN
        heading = text.font(14, bold=True)
        title = text.elided(self.title, heading, room)
        text.put(painter, MARGIN, MARGIN + 6, title, face=heading, ink=ink)
        key = f"{KEY} {self.note_key}" if any(pair.note for pair in self.pairs) else KEY
        key = text.elided(key, text.font(10), room)
        text.put(painter, MARGIN, MARGIN + 26, key, face=text.font(10), ink=muted)
        self._paint_legend(painter)
        axis = self.axis
        self._paint_grid(painter, axis)
        looks = self._looks
        for row, pair in enumerate(self.pairs):
            human, predicted = self.boxes(row)
            paint_track(painter, human, axis, pair.human, looks=looks, theme=self.theme)
            paint_track(painter, predicted, axis, pair.predicted, looks=looks, theme=self.theme)
            middle = human.bottom() + THIN / 2
            name = text.elided(pair.name, text.font(), axis.begin - 10 - MARGIN, middle=True)
            text.put(painter, axis.begin - 10, middle, name, face=text.font(), ink=ink, align=1.0)
            note = text.elided(pair.note, text.font(10), NOTE_ROOM)
            text.put(
                painter, self.width - MARGIN, middle, note, face=text.font(10), ink=muted, align=1.0
            )
        draw_bottom(painter, axis, self._rows_end, "time (s)", self.theme)
        if self._tall:
            draw_bottom(painter, axis, self._rows_top - 8, "time (s)", self.theme, above=True)

    @cached_property
    def _looks(self) -> dict[str, Look]:
        """Each action's number, colour and texture."""
        return {
            name: Look(i, QColor(self.vocabulary[name].colour), self.vocabulary[name].texture)
            for i, name in enumerate(self.actions, 1)
        }

    @cached_property
    def _legend(self) -> tuple[int, float]:
        """Number of columns of the legend, and the width of one."""
        room = self.width - 2 * MARGIN
        names = [text.shown(name) for name in self.actions]
        column = SWATCH + 7 + min(text.widest(names, text.font()), LEGEND_ROOM) + 20
        return max(1, int((room + 20) // column)), column

    @cached_property
    def _tall(self) -> bool:
        """Whether the figure needs a second time axis at the top."""
        return len(self.pairs) * (2 * BAR + THIN + ROW_GAP) > TALL

    @cached_property
    def _rows_top(self) -> float:
        """Upper edge of the first row, in pixels."""
        lines = math.ceil(len(self.actions) / self._legend[0])
        return MARGIN + 40 + lines * LEGEND_LINE + 12 + (AXIS_ROOM + 8 if self._tall else 0)

    @property
    def _rows_end(self) -> float:
        """Where the time axis lies, in pixels."""
        return self._rows_top + len(self.pairs) * (2 * BAR + THIN + ROW_GAP) - ROW_GAP + 8

    def _paint_grid(self, painter: QPainter, axis: Axis) -> None:
        """Draw a light line at every number of the time axis."""
        painter.setPen(QPen(QColor(self.theme.grid), 1.0))
        top, bottom = self._rows_top - 8, self._rows_end
        marks = axis.marks(10.0, upright=False)
        painter.drawLines([QLineF(axis.at(v), top, axis.at(v), bottom) for v, _ in marks])

    def _paint_legend(self, painter: QPainter) -> None:
        """Draw a numbered swatch and a name for each action, in columns."""
        columns, column = self._legend
        for i, name in enumerate(self.actions):
            x = MARGIN + i % columns * column
            y = MARGIN + 40 + i // columns * LEGEND_LINE
            swatch = QRectF(x, y + (LEGEND_LINE - BAR) / 2, SWATCH, BAR)
            paint_look(painter, swatch, self._looks[name])
            label = text.elided(name, text.font(), LEGEND_ROOM, middle=True)
            middle, ink = y + LEGEND_LINE / 2, QColor(self.theme.text)
            text.put(painter, x + SWATCH + 7, middle, label, face=text.font(), ink=ink)
