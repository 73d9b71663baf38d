"""The force panel: every channel of the demonstration over time.

The overview draws from the same :class:`ForceChannels`. A hidden channel costs nothing: it is
neither read nor searched.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from functools import partial

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QObject, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QAction, QColor, QPainter, QPen
from PySide6.QtWidgets import QMenu

from forcelab.arrays import Real
from forcelab.demonstration import GAP_PERIODS, Channel, Demonstration
from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.jobs import Jobs
from forcelab.gui.kit import text_size
from forcelab.gui.kit.traces import Trace, column_edges
from forcelab.gui.label.lanes import (
    Lane,
    LaneAxis,
    Values,
    axis_of,
    lanes,
    paint_borders,
    paint_gaps,
    paint_groups,
    paint_notes,
    span_of,
    spanning,
)
from forcelab.gui.label.segment_panel import SignalPanel
from forcelab.gui.text import escape_ampersands
from forcelab.gui.theme import colours
from forcelab.jobs import Progress, finish
from forcelab.signals.minmax import Columns, Envelope, Extremes, drawn_together, read_envelopes

#: Up to so many samples are read at once, in some 10 ms; more are read in the background.
SYNCHRONOUS_SAMPLES = 500_000
#: Seconds between two drawings while channels are read.
REDRAW_SECONDS = 0.1

Gaps = Real
"""Starts and ends of gaps in seconds, shape (2, g)."""


def _gaps(demonstration: Demonstration) -> Generator[Progress, None, Gaps]:
    yield Progress(0, 1, "looking for gaps")
    return np.array(demonstration.gaps, dtype=np.float64).reshape(-1, 2).T


class ForceChannels(QObject):
    """The channels of the open demonstration, which of them are shown, and how.

    `gaps` are the starts and ends (s) of the gaps, shape (2, g), once they are known; `overlaid`
    channels of one unit share an axis, and with `autoscale` axes follow what is visible.
    `choices_changed` tells of other channels or another way to show them, `data_read` of more data.
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
        self._drawn: tuple[object, Columns, dict[str, Extremes]] | None = None
        #: Another number whenever other data is there.
        self.revision = 0
        self.channels: tuple[Channel, ...] = ()
        self.names: tuple[str, ...] = ()
        self.shown: tuple[str, ...] = ()
        self.gaps: Gaps = np.empty((2, 0))
        self.overlaid = False
        self.autoscale = False
        document.demonstration_changed.connect(self._open)
        self._open()

    # Data

    @property
    def read(self) -> float:
        """Which share of the shown channels was read, from 0 to 1."""
        envelopes = [self._envelopes[name] for name in self.shown]
        total = sum(len(envelope) for envelope in envelopes)
        return sum(envelope.filled for envelope in envelopes) / total if total else 1.0

    def envelope(self, name: str) -> Envelope:
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

    def extremes(self, edges: Real) -> tuple[Columns, dict[str, Extremes]]:
        """The extremes of all shown channels between edges in seconds, found together.

        Those asked for last are kept, as each channel's curve asks for them.
        """
        key = edges[0], edges[-1], len(edges), self.shown, self.revision
        if self._drawn is None or self._drawn[0] != key:
            demonstration = self._document.demonstration
            columns = Columns(np.empty(0), edges)
            if demonstration is not None:
                gap = GAP_PERIODS * demonstration.period
                columns = Columns(demonstration.times, edges, gap)
            drawn = drawn_together([self._envelopes[name] for name in self.shown], columns)
            self._drawn = key, columns, dict(zip(self.shown, drawn, strict=True))
        return self._drawn[1:]

    def samples(self, name: str, start: float, end: float) -> tuple[Real, Real]:
        """Times and values of a shown channel's samples within a span, and of those beside it."""
        demonstration = self._document.demonstration
        if demonstration is None:
            return np.empty(0), np.empty(0)
        first, last = np.searchsorted(demonstration.times, (start, end))
        around = slice(max(int(first) - 1, 0), int(last) + 1)
        return demonstration.times[around], self._envelopes[name].values[around]

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
        self._show_chosen()

    def show_all(self) -> None:
        if self._hidden & set(self.names):
            self._hidden -= set(self.names)
            self._show_chosen()

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
        self._show_chosen()

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
        self.names = tuple(channel.name for channel in self.channels)
        if demonstration is not None:
            if demonstration.signals.size <= SYNCHRONOUS_SAMPLES:
                self.gaps = finish(_gaps(demonstration))
            else:
                self._jobs.run(_gaps(demonstration), self._gaps_found, key="force gaps")
        self.revision += 1
        self._show_chosen()

    def _show_chosen(self) -> None:
        """Show what is not hidden, and read of that what was not read yet."""
        self.shown = tuple(name for name in self.names if name not in self._hidden)
        self._read()
        self.choices_changed.emit()

    def _read(self) -> None:
        demonstration = self._document.demonstration
        if demonstration is None or not self._id:
            return
        self._jobs.cancel("force envelopes")
        for column, name in enumerate(self.names):
            if name in self.shown and name not in self._envelopes:
                self._envelopes[name] = Envelope(demonstration.signals, column)
        envelopes = [self._envelopes[name] for name in self.shown]
        envelopes = [envelope for envelope in envelopes if envelope.filled < len(envelope)]
        if demonstration.signals.size <= SYNCHRONOUS_SAMPLES:
            finish(read_envelopes(envelopes))
        elif envelopes:
            job, progress = read_envelopes(envelopes), self._redraw_sometimes
            self._jobs.run(job, self._say_read, progress=progress, key="force envelopes")

    def _gaps_found(self, gaps: Gaps) -> None:
        self.gaps = gaps
        self._say_read()

    def _say_read(self, _: object = None) -> None:
        self.revision += 1
        self.data_read.emit()

    def _redraw_sometimes(self, _: object) -> None:
        """Redraw now and then while more is read."""
        now = time.monotonic()
        if now - self._drawn_at >= REDRAW_SECONDS:
            self._drawn_at = now
            self._say_read()


#: Samples at least so many pixels apart are dotted.
DOT_DISTANCE = 7
#: Pixels at the right that notes cover, or values beside the cursor that would cover notes.
NOTES = 260.0


class ChannelTrace(Trace):
    """The curve of a channel of the open demonstration, in a box of its own."""

    def __init__(self, source: ForceChannels, box: pg.ViewBox, column: int) -> None:
        super().__init__(box, column)
        self._source = source

    @property
    def _name(self) -> str:
        return self._source.names[self._column]

    def version(self) -> object:
        return self._source.revision

    def extremes(self, edges: Real) -> Extremes:
        return self._source.extremes(edges)[1][self._name]

    def samples(self, start: float, end: float, width: float) -> tuple[Real, Real] | None:
        times, values = self._source.samples(self._name, start, end)
        return (times, values) if len(times) * DOT_DISTANCE <= width else None

    def glitches(self, start: float, end: float) -> tuple[Real, NDArray[np.bool_]]:
        return self._source.glitches(self._name, start, end)


class ForcePanel(SignalPanel):
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
        #: The lanes from top to bottom, each with its vertical axis in pixels.
        self.axes: tuple[tuple[Lane, Axis], ...] = ()
        self._strips: tuple[Lane, ...] = ()
        #: What the axes were made for, and the notes on it.
        self._fitted: object = None
        self._notes: list[str] = []
        self._values: Values = {}  # at the cursor
        self._numbered: list[float] = []  # the pixels of the axes' numbers, from the top
        self._lane_axes: list[LaneAxis] = []
        self._traces: list[ChannelTrace] = []
        self._noted_left = False
        self.source.choices_changed.connect(self.place)
        self.source.data_read.connect(self.invalidate)
        self.scene().sigPrepareForPaint.connect(self._fit)
        self.place()

    def plot_menu(self) -> QMenu:
        """The panel's menu, for a right click, the menu key and the window's own menus."""
        menu = QMenu(self.accessibleName(), self)
        source = self.source
        for name in source.names:
            show = partial(source.set_shown, name)
            _add_entry(menu, escape_ampersands(name), name in source.shown, show)
        menu.addSeparator()
        menu.addAction("Show all channels").triggered.connect(source.show_all)
        _add_entry(menu, "One axis for each unit", source.overlaid, source.set_overlaid)
        _add_entry(menu, "Scale to what is visible", source.autoscale, source.set_autoscale)
        menu.addSeparator()
        self.add_picture_entries(menu)
        return menu

    def tooltip_at(self, position: QPointF) -> str:
        """Whole names and units of channels, left of the curves."""
        for lane, _ in self.axes:
            if position.x() < self.gutter and lane.top <= position.y() <= lane.bottom:
                return "\n".join(
                    f"{channel.name} ({channel.unit})" if channel.unit else channel.name
                    for channel in (self.source.channels[i] for i in lane.channels)
                )
        return ""

    # Lanes

    def place(self) -> None:
        """Lay out a lane with its axis and its curves for each axis that there is to be."""
        source, plot = self.source, self.plot
        strips = lanes(source.channels, source.shown, plot.height(), overlaid=source.overlaid)
        while len(self._traces) < len(source.channels):
            self._traces.append(ChannelTrace(self.source, self.add_box(), len(self._traces)))
        while len(self._lane_axes) < len(strips):
            self._lane_axes.append(LaneAxis(self.gutter, lambda: self._values))
            self.addItem(self._lane_axes[-1])
        for trace in self._traces:
            trace.box.hide()
        for i, axis in enumerate(self._lane_axes):
            axis.setVisible(i < len(strips))
        for lane, axis in zip(strips, self._lane_axes, strict=False):
            for column in lane.channels:
                box = self._traces[column].box
                box.setGeometry(QRectF(plot.left(), lane.top, plot.width(), lane.height))
                box.show()
            axis.set_room(self.gutter)
            axis.show_lane(lane, source.channels)
        self._strips = strips
        self.axes, self._fitted = (), None
        self.invalidate()

    def _fit(self) -> None:
        """Let each axis hold its values; before each painting, as values may have been read."""
        self._values = self.source.values_at(self.document.view.cursor)
        if not self._strips or self.document.demonstration is None:
            self.axes, self._fitted = (), None
            return
        view, size = self.document.view, (self.size(), self.devicePixelRatioF())
        state = view.start, view.end, self.source.revision, self.source.autoscale, size
        if state == self._fitted:
            return
        self._fitted = state
        edges = column_edges(self._traces[0].box, self.devicePixelRatioF())[1]
        columns, extremes = self.source.extremes(edges)
        self._notes = self._notes_on(columns)
        names, axes = self.source.names, []
        for lane, lane_axis in zip(self._strips, self._lane_axes, strict=False):
            axis = axis_of(lane, self._span([names[i] for i in lane.channels], extremes))
            ends = axis.value(lane.bottom), axis.value(lane.top)
            if tuple(lane_axis.range) != ends:  # or it would draw its numbers again
                lane_axis.setRange(*ends)
            for box in (self._traces[column].box for column in lane.channels):
                if box.viewRange()[1] != [*ends]:
                    box.setYRange(*ends, padding=0)
            axes.append((lane, axis))
        if self.axes != tuple(axes):
            self.axes = tuple(axes)
            self._numbered = [
                round(axis.at(value)) + 0.5
                for (_, axis), lane_axis in zip(axes, self._lane_axes, strict=False)
                for value in lane_axis.numbers()
            ]
            self.resetCachedContent()  # lines behind the curves stand at the numbers

    # Drawing

    def paint_content(self, painter: QPainter, plot: QRectF) -> None:
        """Draw what lies behind the curves: gaps, lines at the axes' numbers, borders of lanes."""
        if not self.axes:
            self._paint_invitation(painter, plot)
            return
        theme = colours()
        self.paint_segments(painter, plot)
        paint_gaps(painter, self, self.source.gaps, plot)
        zeros = [
            round(axis.at(0.0)) + 0.5 for _, axis in self.axes if axis.start <= 0.0 <= axis.end
        ]
        for heights, ink, style in (
            (self._numbered, theme.grid, Qt.PenStyle.SolidLine),
            (zeros, theme.frame, Qt.PenStyle.DotLine),
        ):
            painter.setPen(QPen(QColor(ink), 1, style))
            painter.drawLines([QLineF(plot.left(), y, plot.right(), y) for y in heights])
        paint_borders(painter, [lane for lane, _ in self.axes], plot)

    def paint_gutter(self, painter: QPainter, box: QRectF) -> None:
        painter.fillRect(box, QColor(colours().panel))
        paint_groups(painter, [lane for lane, _ in self.axes])

    def paint_overlay(self, painter: QPainter, plot: QRectF) -> None:
        if not self.axes:
            return
        self._noted_left = self._notes_left
        paint_notes(painter, plot, self._notes, at_left=self._noted_left)
        x = self.x_at(self.document.view.cursor)
        for axis in self._lane_axes[: len(self._strips)]:
            if axis.tagged and plot.left() <= x <= plot.right():
                axis.paint_tag(painter, x, plot)

    # Inside

    @property
    def _notes_left(self) -> bool:
        """Whether notes give way to the values at the cursor."""
        tags = bool(self._strips) and self._lane_axes[0].tagged
        return tags and self.x_at(self.document.view.cursor) > self.plot.right() - text_size.pixels(
            NOTES
        )

    def _marks_moved(self, *_: object) -> None:
        """Move the notes to the other side when the cursor comes to where they are."""
        if self._noted_left != self._notes_left:
            self.update()
        super()._marks_moved()

    def _paint_invitation(self, painter: QPainter, plot: QRectF) -> None:
        """Say how hidden channels come back."""
        face = text_size.font(12)
        sentence = "Every channel is hidden; the menu of this panel shows them again."
        sentence = text.elided(sentence, face, plot.width() - 16)
        at, ink = plot.center(), QColor(colours().muted)
        text.draw_text(painter, at.x(), at.y(), sentence, face=face, ink=ink, align=0.5)

    def _span(self, names: list[str], extremes: dict[str, Extremes]) -> tuple[float, float] | None:
        """The least and the greatest value that an axis has to hold."""
        span = None
        if not self.source.autoscale and self.source.read >= 1.0:
            span = spanning(self.source.envelope(name).range for name in names)
        return span or spanning(span_of(extremes[name]) for name in names)

    def _notes_on(self, columns: Columns) -> list[str]:
        """How much of the data is drawn."""
        notes, view = [], self.document.view
        glitches = sum(
            len(self.source.glitches(name, view.start, view.end)[0]) for name in self.source.shown
        )
        if glitches:
            notes.append(
                "1 sample is a glitch, beyond all axes"
                if glitches == 1
                else f"{glitches:,} samples are glitches, beyond all axes"
            )
        if columns.pyramid and self.source.read < 1.0:
            notes.append(f"reading the channels: {100 * self.source.read:.0f} %")
        if columns.dense:
            notes.append(f"min/max of {columns.crowd:.0f} samples a pixel")
        return notes


def _add_entry(menu: QMenu, name: str, checked: bool, toggle: Callable[[bool], object]) -> None:
    entry = QAction(name, menu, checkable=True, checked=checked)
    entry.toggled.connect(toggle)
    menu.addAction(entry)
