"""The force panel: every channel of the demonstration over time.

The overview draws from the same :class:`ForceChannels`. A hidden channel costs nothing: it is
neither read nor searched.
"""

from __future__ import annotations

import math
import time
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QObject, QRectF, Qt, Signal
from PySide6.QtGui import QAction, QColor, QContextMenuEvent, QHelpEvent, QPainter
from PySide6.QtWidgets import QMenu, QToolTip

from forcelab.demonstration import GAP_PERIODS, Channel, Demonstration
from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.jobs import Jobs
from forcelab.gui.label.lanes import (
    NUMBER,
    Curve,
    CurveCanvas,
    Lane,
    axis_of,
    curve_colour,
    curve_ink,
    lanes,
    paint_axis,
    paint_gaps,
    paint_glitches,
    paint_ground,
    paint_groups,
    paint_notes,
    span_of,
    spanning,
)
from forcelab.gui.text import escape_ampersands, thousands
from forcelab.gui.theme import Colours, colours
from forcelab.gui.time_panel import TimePanel
from forcelab.jobs import Progress, finish
from forcelab.signals.minmax import Columns, Envelope, Extremes, drawn_together, read_envelopes

#: Heights of names and of a line of text, in pixels.
NAME, LINE = 11.0, 14.0
#: Least height of a line of two and of a line alone.
TWO_LINES, ONE_LINE = 11.0, 9.0
#: Where names start, with and without the brackets of groups left of them.
NAMES_BESIDE_BRACKET, NAMES_LEFT = 20.0, 6.0
#: Width of a value at the cursor: names and values end where the axis' numbers may begin.
VALUE_WIDTH = 40.0
#: A value from here on, as a glitch beyond its axis has, is written with a power of ten.
LARGEST_PLAIN = 1e9


def number_format(value: float | None, span: float) -> str:
    """A value with as many decimals as can be told apart on its axis; a dash for none."""
    if value is None:
        return "\N{EN DASH}"
    if not 1e-4 <= span < 1e5 or abs(value) >= LARGEST_PLAIN:
        return text.signed(f"{value:.2e}")
    power = math.floor(math.log10(span))
    decimals = max(3 - power, 0) if power >= 0 else 2 - power
    return text.signed(f"{value:.{decimals}f}")


@dataclass(frozen=True, slots=True)
class LaneTexts:
    """The texts of a lane, with names from `left` on in a gutter that ends at `right` (pixels).

    In a high lane a value at the cursor stands below the name of its channel, in a low one behind
    it; where there is no room for it in the gutter, it stands at the cursor.
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
        """Write the channels' names, and the unit where it has room; gives the boxes of texts."""
        lane, right, muted = self.lane, self.right, QColor(self.theme.muted)
        size = min(NAME, self._lines[1])
        small = text.font(min(NUMBER, size))
        alone = len(lane.channels) == 1
        taken = []
        if not alone and lane.unit:
            wide = text.width(lane.unit, small)
            place = QRectF(right - 6 - wide, lane.top + 2, wide, NUMBER)
            text.draw_text(
                painter, place.left(), place.center().y(), lane.unit, face=small, ink=muted
            )
            taken.append(place)
        x = self.left
        for column, y, below in self._name_places():
            room = right - x - (6 if alone else VALUE_WIDTH)
            face = text.font(size, bold=True)
            name = self.channels[column].name
            if text.width(name, face) > room:
                face = small
            name = text.elided_name(name, face, room)
            text.draw_text(painter, x, y, name, face=face, ink=curve_ink(column, self.theme))
            used = text.width(name, face)
            if self._behind_name:
                taken.append(QRectF(right - 6 - VALUE_WIDTH, y - NUMBER / 2, VALUE_WIDTH, NUMBER))
            elif alone and lane.unit and used + 5 + text.width(lane.unit, small) <= room:
                text.draw_text(painter, x + used + 5, y, lane.unit, face=small, ink=muted)
                used += 5 + text.width(lane.unit, small)
            taken.append(QRectF(x, y - size / 2, used + 3, size))
            if not math.isnan(below):
                taken.append(QRectF(x, below - NUMBER / 2, VALUE_WIDTH, NUMBER))
        return taken

    def paint_values(self, painter: QPainter, values: Mapping[str, float | None]) -> None:
        """Write the values at the cursor below the names or behind them, where they have room."""
        face, ink = text.font(NUMBER), QColor(self.theme.text)
        for column, y, below in self._name_places():
            shown = self._shown(column, values)
            if self._behind_name:
                shown = text.elided(shown, face, VALUE_WIDTH)
                text.draw_text(painter, self.right - 6, y, shown, face=face, ink=ink, align=1.0)
            elif not math.isnan(below):
                text.draw_text(painter, self.left, below, shown, face=face, ink=ink)

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
            text.draw_text(painter, left + wide - 4, y, number, face=face, ink=ink, align=1.0)

    @property
    def _lines(self) -> tuple[int, float]:
        """How many lines of text each channel has room for, and the height of one."""
        room = (self.lane.height - 2) / len(self.lane.channels)
        rows = 2 if room >= 2 * TWO_LINES else 1
        return rows, max(min(LINE, room / rows), TWO_LINES if rows == 2 else ONE_LINE)

    @property
    def _behind_name(self) -> bool:
        """Whether the value of a low lane stands behind the name, where unit and axis would be."""
        rows, line = self._lines
        if rows == 2 or len(self.lane.channels) > 1:
            return False
        name = self.channels[self.lane.channels[0]].name
        wide = text.width(name, text.font(min(NAME, line), bold=True))
        return wide <= self.right - 8 - VALUE_WIDTH - self.left

    def _name_places(self) -> list[tuple[int, float, float]]:
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
        span = self.axis.end - self.axis.start
        return number_format(values.get(self.channels[column].name), span)


#: Up to so many samples are read at once, in some 10 ms; more are read in the background.
SYNCHRONOUS_SAMPLES = 500_000
#: Seconds between two drawings while channels are read.
REDRAW_SECONDS = 0.1

Real = NDArray[np.float64]
Gaps = Real
"""Starts and ends of gaps in seconds, shape (2, g)."""


def _gaps(demonstration: Demonstration) -> Generator[Progress, None, Gaps]:
    yield Progress(0, 1, "looking for gaps")
    return np.array(demonstration.gaps, dtype=np.float64).reshape(-1, 2).T


class ForceChannels(QObject):
    """The channels of the open demonstration, which of them are shown, and how.

    `gaps` are the starts and ends (s) of the gaps, shape (2, g), once they are known; `overlaid`
    channels of one unit share an axis, and with `autoscale` axes follow what is visible.
    `choices_changed` tells of other channels or another way to show them, `grown` of more data.
    """

    choices_changed = Signal()
    data_read = Signal()

    def __init__(self, document: Document, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._document = document
        self._jobs = jobs
        self._id = ""
        self._envelopes: dict[str, Envelope] = {}
        self._hidden: set[str] = set()
        self._drawn_at = 0.0
        self.channels: tuple[Channel, ...] = ()
        self.gaps: Gaps = np.empty((2, 0))
        self.overlaid = False
        self.autoscale = False
        document.demonstration_changed.connect(self._open)
        self._open()

    # Data

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(channel.name for channel in self.channels)

    @property
    def shown(self) -> tuple[str, ...]:
        return tuple(name for name in self.names if name not in self._hidden)

    @property
    def read(self) -> float:
        """Which share of the shown channels was read, from 0 to 1."""
        envelopes = [self._envelopes[name] for name in self.shown]
        total = sum(len(envelope) for envelope in envelopes)
        return sum(envelope.filled for envelope in envelopes) / total if total else 1.0

    def envelope(self, name: str) -> Envelope:
        """The envelope of a shown channel."""
        return self._envelopes[name]

    def glitches(self, name: str, start: float, end: float) -> tuple[Real, NDArray[np.bool_]]:
        """When a shown channel has glitches within a span, and which of them are upwards."""
        demonstration, envelope = self._document.demonstration, self._envelopes[name]
        if demonstration is None or envelope.limits is None:
            return np.empty(0), np.empty(0, dtype=np.bool_)
        times = demonstration.times[envelope.glitches]
        within = (start <= times) & (times <= end)
        upwards = envelope.values[envelope.glitches] > envelope.limits[1]
        return times[within], upwards[within]

    def columns(self, edges: NDArray[np.float64]) -> Columns:
        """The samples between edges in seconds."""
        demonstration = self._document.demonstration
        if demonstration is None:
            return Columns(np.empty(0), edges)
        return Columns(demonstration.times, edges, GAP_PERIODS * demonstration.period)

    def drawn(self, names: Sequence[str], columns: Columns) -> dict[str, Extremes]:
        """The extremes of some shown channels in each column, by their names."""
        if not names:
            return {}
        extremes = drawn_together([self._envelopes[name] for name in names], columns)
        return dict(zip(names, extremes, strict=True))

    def values_at(self, seconds: float) -> dict[str, float | None]:
        """The last sample of each shown channel at or before a time.

        None in a gap, outside of the recording and where the sample is missing.
        """
        demonstration = self._document.demonstration
        if demonstration is None:
            return {}
        times, period = demonstration.times, demonstration.period
        last = int(np.searchsorted(times, seconds, side="right")) - 1
        following = float(times[last + 1]) if last + 1 < len(times) else np.inf
        ended = seconds >= times[last] + period and following - times[last] > GAP_PERIODS * period
        if last < 0 or ended:
            return dict.fromkeys(self.shown)
        values = {name: float(self._envelopes[name].values[last]) for name in self.shown}
        return {name: value if np.isfinite(value) else None for name, value in values.items()}

    # Choices

    def set_shown(self, name: str, shown: bool) -> None:
        """Show or hide a channel; the choice is stored by its name."""
        if shown != (name in self._hidden):
            return
        self._hidden ^= {name}
        self._read()
        self.choices_changed.emit()

    def show_all(self) -> None:
        if self._hidden & set(self.names):
            self._hidden -= set(self.names)
            self._read()
            self.choices_changed.emit()

    def set_overlaid(self, overlaid: bool) -> None:
        """Draw the channels of one unit over each other, or each on its own axis."""
        if overlaid != self.overlaid:
            self.overlaid = overlaid
            self.choices_changed.emit()

    def set_autoscale(self, autoscale: bool) -> None:
        """Let axes follow what is visible, or hold the whole recording."""
        if autoscale != self.autoscale:
            self.autoscale = autoscale
            self.choices_changed.emit()

    def save_choices(self) -> None:
        settings.store("force/hidden", sorted(self._hidden))
        settings.store("force/overlaid", self.overlaid)
        settings.store("force/autoscale", self.autoscale)

    def restore_choices(self) -> None:
        self._hidden = set(settings.strings("force/hidden"))
        self.overlaid = settings.flag("force/overlaid")
        self.autoscale = settings.flag("force/autoscale")
        self._read()
        self.choices_changed.emit()

    # Reading

    def _open(self) -> None:
        """Read another demonstration; a new video clock leaves its samples as they are."""
        demonstration = self._document.demonstration
        if demonstration is not None and self._document.id == self._id:
            return
        self._id = self._document.id if demonstration is not None else ""
        self._jobs.cancel("force gaps")
        self._jobs.cancel("force envelopes")
        self._envelopes = {}
        self.gaps = np.empty((2, 0))
        self.channels = demonstration.channels if demonstration is not None else ()
        if demonstration is not None:
            if demonstration.signals.size <= SYNCHRONOUS_SAMPLES:
                self.gaps = finish(_gaps(demonstration))
            else:
                self._jobs.run(_gaps(demonstration), self._gaps_found, key="force gaps")
        self._read()
        self.choices_changed.emit()

    def _read(self) -> None:
        """Read what is shown and was not read yet."""
        demonstration = self._document.demonstration
        if demonstration is None or not self._id:
            return
        self._jobs.cancel("force envelopes")
        for column, name in enumerate(self.names):
            if name not in self._hidden and name not in self._envelopes:
                self._envelopes[name] = Envelope(demonstration.signals, column)
        envelopes = [self._envelopes[name] for name in self.shown]
        envelopes = [envelope for envelope in envelopes if envelope.filled < len(envelope)]
        if demonstration.signals.size <= SYNCHRONOUS_SAMPLES:
            finish(read_envelopes(envelopes))
        elif envelopes:
            key = "force envelopes"
            self._jobs.run(
                read_envelopes(envelopes),
                self._envelopes_read,
                progress=self._redraw_sometimes,
                key=key,
            )

    def _gaps_found(self, gaps: Gaps) -> None:
        self.gaps = gaps
        self.data_read.emit()

    def _envelopes_read(self, _: object) -> None:
        self.data_read.emit()

    def _redraw_sometimes(self, _: object) -> None:
        """Redraw now and then while more is read."""
        now = time.monotonic()
        if now - self._drawn_at >= REDRAW_SECONDS:
            self._drawn_at = now
            self.data_read.emit()


#: Samples at least so many pixels apart are dotted.
DOT_DISTANCE = 7
#: Pixels at the right that notes cover, or values beside the cursor that would cover notes.
NOTES = 260.0


class ForcePanel(TimePanel):
    """All channels on the common time axis, each on its own vertical axis or one for each unit.

    The overview draws from `source`, too.
    """

    #: The values at the cursor stand beside it, and in the gutter.
    beside_cursor = 120.0
    gutter_follows = True

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__(document)
        self.setAccessibleName("Forces")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMinimumHeight(80)
        self.source = ForceChannels(document, jobs, self)
        self.axes: tuple[tuple[Lane, Axis], ...] = ()
        self._canvas = CurveCanvas(self.plot, 1.0)
        self._noted_left = False
        self.source.choices_changed.connect(self.invalidate)
        self.source.data_read.connect(self.invalidate)

    def menu(self) -> QMenu:
        """The panel's menu, for a right click, the menu key and the window's own menus."""
        menu = QMenu(self.accessibleName(), self)
        menu.setToolTipsVisible(True)
        for name in self.source.names:
            self._entry(menu, escape_ampersands(name), name in self.source.shown).toggled.connect(
                lambda shown, name=name: self.source.set_shown(name, shown)
            )
        menu.addSeparator()
        menu.addAction("Show all channels").triggered.connect(self.source.show_all)
        entry = self._entry(menu, "One axis for each unit", self.source.overlaid)
        entry.toggled.connect(self.source.set_overlaid)
        entry = self._entry(menu, "Scale to what is visible", self.source.autoscale)
        entry.toggled.connect(self.source.set_autoscale)
        return menu

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        menu = self.menu()
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(event.globalPos())

    def event(self, event: QEvent) -> bool:
        """Show the whole name and the unit of a channel as a tooltip."""
        if isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            tip = self.gutter_tip(event.pos().x(), event.pos().y())
            QToolTip.showText(event.globalPos(), tip, self)
            return True
        return super().event(event)

    # Drawing

    def paint_content(self, painter: QPainter, plot: QRectF) -> None:
        """Draw the curves, as far as they are read."""
        theme = colours()
        strips = lanes(
            self.source.channels, self.source.shown, plot.height(), overlaid=self.source.overlaid
        )
        if not strips:
            self.axes = ()
            face = text.font(12)
            sentence = "Every channel is hidden; the menu of this panel shows them again."
            sentence = text.elided(sentence, face, plot.width() - 16)
            at = plot.center()
            ink = QColor(theme.muted)
            text.draw_text(painter, at.x(), at.y(), sentence, face=face, ink=ink, align=0.5)
            return
        canvas = self._canvas = self._canvas.cleared(plot, painter.device().devicePixelRatioF())
        columns = self.source.columns(self._times(canvas.edges()))
        extremes = self.source.drawn(self.source.shown, columns)
        names = self.source.names
        self.axes = tuple(
            (lane, axis_of(lane, self._span([names[i] for i in lane.channels], extremes)))
            for lane in strips
        )
        paint_gaps(painter, self, self.source.gaps, plot, theme)
        paint_ground(painter, self.axes, plot, theme)
        drawn = [
            (i, Curve(extremes[names[i]], axis, curve_colour(i, theme), (lane.top, lane.bottom)))
            for lane, axis in self.axes
            for i in lane.channels
        ]
        if columns.samples * DOT_DISTANCE <= plot.width():
            for i, curve in drawn:
                canvas.draw([curve])
                self._paint_samples(canvas, columns, i, curve)
        else:
            canvas.draw([curve for _, curve in drawn])
        canvas.paint(painter)
        glitches = self._paint_glitches(painter, theme)
        self._paint_notes(painter, plot, columns, glitches, theme)

    def gutter_shows(self) -> object:
        return self.axes, self.source.channels

    def paint_gutter(self, painter: QPainter, box: QRectF) -> None:
        theme = colours()
        painter.fillRect(box, QColor(theme.panel))
        strips = [lane for lane, _ in self.axes]
        named = {lane.group: self._sensor(lane.group) for lane in strips}
        paint_groups(painter, strips, named, theme)
        for lane, axis in self.axes:
            taken = self._lane_texts(lane, axis).paint_names(painter)
            paint_axis(painter, lane, axis, box.right(), taken, theme)

    def paint_overlay(self, painter: QPainter, plot: QRectF) -> None:
        cursor = self.document.view.cursor
        values, x = self.source.values_at(cursor), self.x_at(cursor)
        for lane, axis in self.axes:
            texts = self._lane_texts(lane, axis)
            texts.paint_values(painter, values)
            if texts.tagged and plot.left() <= x <= plot.right():
                texts.paint_tag(painter, values, x, plot)

    # Inside

    @property
    def _notes_left(self) -> bool:
        """Whether notes give way to the values at the cursor."""
        tags = bool(self.axes) and self._lane_texts(*self.axes[0]).tagged
        return tags and self.x_at(self.document.view.cursor) > self.plot.right() - NOTES

    def _lane_texts(self, lane: Lane, axis: Axis) -> LaneTexts:
        return LaneTexts(lane, axis, self.source.channels, self._left, self.GUTTER, colours())

    def _marks_moved(self, *_: object) -> None:
        """Move the notes to the other side when the cursor comes to where they are."""
        if self._noted_left != self._notes_left:
            self.invalidate()
        super()._marks_moved()

    @property
    def _left(self) -> float:
        return NAMES_BESIDE_BRACKET if any(lane.group for lane, _ in self.axes) else NAMES_LEFT

    def _times(self, x: Real) -> Real:
        return self.document.view.start + (x - self.GUTTER) * self.seconds_per_pixel

    def _sensor(self, group: str) -> str:
        return f"sensor {group}" if group.isdigit() else group

    def _span(self, names: list[str], extremes: dict[str, Extremes]) -> tuple[float, float] | None:
        """The least and the greatest value that an axis has to hold."""
        span = None
        if not self.source.autoscale and self.source.read >= 1.0:
            span = spanning(self.source.envelope(name).range for name in names)
        return span or spanning(span_of(extremes[name]) for name in names)

    def _paint_samples(self, canvas: CurveCanvas, columns: Columns, i: int, curve: Curve) -> None:
        """Draw a dot at each of the few samples that are visible."""
        demonstration = self.document.demonstration
        if demonstration is None:
            return
        stamps = demonstration.times[columns.around]
        x = self.GUTTER + (stamps - self.document.view.start) / self.seconds_per_pixel
        values = self.source.envelope(self.source.names[i]).values[columns.around]
        inside = np.abs(x) < 2 * self.width()
        canvas.dots(x[inside], values[inside], curve.axis, curve.colour, curve.box)

    def _paint_glitches(self, painter: QPainter, theme: Colours) -> int:
        """Draw where glitches are that the axes leave out; gives their number."""
        document, number = self.document, 0
        for lane, _ in self.axes:
            for i in lane.channels:
                name = self.source.names[i]
                times, upwards = self.source.glitches(name, document.view.start, document.view.end)
                x = self.GUTTER + (times - document.view.start) / self.seconds_per_pixel
                paint_glitches(painter, x, upwards, (lane.top, lane.bottom), theme)
                number += len(times)
        return number

    def _paint_notes(
        self, painter: QPainter, plot: QRectF, columns: Columns, glitches: int, theme: Colours
    ) -> None:
        """Write how much of the data is drawn."""
        notes = []
        if glitches:
            notes.append(
                "1 sample is a glitch, beyond all axes"
                if glitches == 1
                else f"{thousands(glitches)} samples are glitches, beyond all axes"
            )
        if columns.pyramid and self.source.read < 1.0:
            share = f"{100 * self.source.read:.0f}"
            notes.append(f"reading the channels: {share} %")
        if columns.dense:
            count = f"{columns.crowd:.0f}"
            notes.append(f"min/max of {count} samples a pixel")
        self._noted_left = self._notes_left
        paint_notes(painter, plot, notes, theme, at_left=self._noted_left)

    def gutter_tip(self, x: float, y: float) -> str:
        for lane, _ in self.axes:
            if x < self.GUTTER and lane.top <= y <= lane.bottom:
                return "\n".join(
                    f"{channel.name} ({channel.unit})" if channel.unit else channel.name
                    for channel in (self.source.channels[i] for i in lane.channels)
                )
        return ""

    @staticmethod
    def _entry(menu: QMenu, name: str, checked: bool) -> QAction:
        entry = menu.addAction(name)
        entry.setCheckable(True)
        entry.setChecked(checked)
        return entry
