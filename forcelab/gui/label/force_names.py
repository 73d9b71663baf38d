"""Names of the channels beside their lanes, and their values at the cursor."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor, QPainter

from forcelab.demonstration import Channel
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.label.force_axes import NUMBER, curve_ink
from forcelab.gui.label.force_lanes import Lane
from forcelab.gui.theme import Colours

__all__ = ["ALONE", "BESIDE", "LaneTexts", "number_of"]

#: Heights of names and of a line of text, in pixels.
NAME, LINE = 11.0, 14.0
#: Least height of a line of two and of a line alone.
LEAST, SMALLEST = 11.0, 9.0
#: Where names start, with and without the brackets of groups left of them.
BESIDE, ALONE = 20.0, 6.0
#: Width of a value at the cursor: names and values end where the axis' numbers may begin.
VALUE = 40.0
#: A value from here on, as a glitch beyond its axis has, is written with a power of ten.
LONGEST = 1e9


def number_of(value: float | None, span: float) -> str:
    """A value with as many decimals as can be told apart on its axis; a dash for none."""
    if value is None:
        return "\N{EN DASH}"
    if not 1e-4 <= span < 1e5 or abs(value) >= LONGEST:
        return text.signed(f"{value:.2e}")
    power = math.floor(math.log10(span))
    decimals = max(3 - power, 0) if power >= 0 else 2 - power
    return text.signed(f"{value:.{decimals}f}")


@dataclass(frozen=True, slots=True)
class LaneTexts:
    """What is written of a lane.

    In a high lane a value at the cursor stands below the name of its channel, in a low one behind
    it; where there is no room for it in the gutter, it stands at the cursor.

    Parameters
    ----------
    lane : Lane
    axis : Axis
        The lane's.
    channels : sequence of Channel
        All channels of the recording.
    left, right : float
        Where names start and where the gutter ends, in pixels.
    theme : Colours
    """

    lane: Lane
    axis: Axis
    channels: Sequence[Channel]
    left: float
    right: float
    theme: Colours

    @property
    def tagged(self) -> bool:
        """Whether the values stand at the cursor: the gutter has no room for them."""
        return self._lines[0] == 1 and not self._behind_name

    def paint_names(self, painter: QPainter) -> list[QRectF]:
        """Write the names of the channels, and the unit where there is room for it.

        Returns
        -------
        list of QRectF
            What they and the values at the cursor take up.
        """
        lane, right, muted = self.lane, self.right, QColor(self.theme.muted)
        size = min(NAME, self._lines[1])
        small = text.font(min(NUMBER, size))
        alone = len(lane.channels) == 1
        taken = []
        if not alone and lane.unit:
            wide = text.width(lane.unit, small)
            place = QRectF(right - 6 - wide, lane.top + 2, wide, NUMBER)
            text.put(painter, place.left(), place.center().y(), lane.unit, face=small, ink=muted)
            taken.append(place)
        x = self.left
        for column, y, below in self._spots():
            room = right - x - (6 if alone else VALUE)
            face = text.font(size, bold=True)
            name = self.channels[column].name
            if text.width(name, face) > room:
                face = small
            name = text.elided_name(name, face, room)
            text.put(painter, x, y, name, face=face, ink=curve_ink(column, self.theme))
            used = text.width(name, face)
            if self._behind_name:
                taken.append(QRectF(right - 6 - VALUE, y - NUMBER / 2, VALUE, NUMBER))
            elif alone and lane.unit and used + 5 + text.width(lane.unit, small) <= room:
                text.put(painter, x + used + 5, y, lane.unit, face=small, ink=muted)
                used += 5 + text.width(lane.unit, small)
            taken.append(QRectF(x, y - size / 2, used + 3, size))
            if not math.isnan(below):
                taken.append(QRectF(x, below - NUMBER / 2, VALUE, NUMBER))
        return taken

    def paint_values(self, painter: QPainter, values: Mapping[str, float | None]) -> None:
        """Write the values at the cursor below the names or behind them, where they have room."""
        face, ink = text.font(NUMBER), QColor(self.theme.text)
        for column, y, below in self._spots():
            shown = self._shown(column, values)
            if self._behind_name:
                shown = text.elided(shown, face, VALUE)
                text.put(painter, self.right - 6, y, shown, face=face, ink=ink, align=1.0)
            elif not math.isnan(below):
                text.put(painter, self.left, below, shown, face=face, ink=ink)

    def paint_tag(
        self, painter: QPainter, values: Mapping[str, float | None], cursor: float, plot: QRectF
    ) -> None:
        """Write the values at the cursor's pixel, each in the colour of its curve."""
        lane, face = self.lane, text.font(NUMBER)
        shown = [(column, self._shown(column, values)) for column in lane.channels]
        wide = text.widest((number for _, number in shown), face) + 8
        high = len(shown) * (NUMBER + 2) + 2
        left = cursor + 5 if cursor + 5 + wide <= plot.right() else cursor - 5 - wide
        top = max(min(lane.top + 1, plot.bottom() - high), plot.top())
        if len(shown) == 1:  # in a low lane: it covers nothing of the next one's
            high = min(high, lane.height - 1)
            top = lane.middle - high / 2
        painter.fillRect(QRectF(left, top, wide, high), QColor(self.theme.background))
        for row, (column, number) in enumerate(shown):
            y = top + high * (row + 0.5) / len(shown)
            ink = curve_ink(column, self.theme)
            text.put(painter, left + wide - 4, y, number, face=face, ink=ink, align=1.0)

    @property
    def _lines(self) -> tuple[int, float]:
        """How many lines of text each channel has room for, and the height of one."""
        room = (self.lane.height - 2) / len(self.lane.channels)
        rows = 2 if room >= 2 * LEAST else 1
        return rows, max(min(LINE, room / rows), LEAST if rows == 2 else SMALLEST)

    @property
    def _behind_name(self) -> bool:
        """Whether the value of a low lane stands behind the name, where unit and axis would be."""
        rows, line = self._lines
        if rows == 2 or len(self.lane.channels) > 1:
            return False
        name = self.channels[self.lane.channels[0]].name
        wide = text.width(name, text.font(min(NAME, line), bold=True))
        return wide <= self.right - 8 - VALUE - self.left

    def _spots(self) -> list[tuple[int, float, float]]:
        """Channel, height of its name and of its value, for those with room; NaN without value."""
        rows, line = self._lines
        first = self.lane.top + 1 + line / 2
        step = rows * line
        return [
            (column, first + i * step, first + i * step + line if rows == 2 else math.nan)
            for i, column in enumerate(self.lane.channels)
            if first + i * step + line / 2 <= self.lane.bottom + 1
        ]

    def _shown(self, column: int, values: Mapping[str, float | None]) -> str:
        """The value of a channel in words."""
        span = self.axis.end - self.axis.start
        return number_of(values.get(self.channels[column].name), span)
