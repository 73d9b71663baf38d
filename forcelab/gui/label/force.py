"""The force panel: every channel of the demonstration over time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QRectF, Qt
from PySide6.QtGui import QAction, QColor, QContextMenuEvent, QHelpEvent, QPainter
from PySide6.QtWidgets import QMenu, QToolTip

from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.jobs import Jobs
from forcelab.gui.label.force_axes import (
    curve_colour,
    paint_axis,
    paint_gaps,
    paint_glitches,
    paint_ground,
    paint_groups,
    paint_notes,
)
from forcelab.gui.label.force_channels import ForceChannels
from forcelab.gui.label.force_curves import Canvas, Curve
from forcelab.gui.label.force_lanes import Lane, axis_of, lanes, span_of, spanning
from forcelab.gui.label.force_names import ALONE, BESIDE, LaneTexts
from forcelab.gui.naming import verbatim
from forcelab.gui.numerals import thousands
from forcelab.gui.panel import TimePanel
from forcelab.gui.theme import Colours, colours
from forcelab.signals.minmax import Columns, Extremes

__all__ = ["ForcePanel"]

#: Samples at least so many pixels apart are dotted.
FAR_APART = 7
#: So many pixels at the right are of notes, and of values beside the cursor that would cover them.
NOTES = 260.0

Real = NDArray[np.float64]


class ForcePanel(TimePanel):
    """All channels on the common time axis, each on its own vertical axis or one for each unit.

    Attributes
    ----------
    source : ForceChannels
        The channels and what is shown of them; the overview draws from it too.
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
        self._axes: tuple[tuple[Lane, Axis], ...] = ()
        self._canvas = Canvas(self.plot, 1.0)
        self._noted_left = False
        self.source.choices_changed.connect(self.invalidate)
        self.source.grown.connect(self.invalidate)

    def menu(self) -> QMenu:
        """The panel's menu, for a right click, the menu key and the window's own menus."""
        menu = QMenu(self.accessibleName(), self)
        menu.setToolTipsVisible(True)
        for name in self.source.names:
            self._entry(menu, verbatim(name), name in self.source.shown).toggled.connect(
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
        """Offer the menu."""
        menu = self.menu()
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(event.globalPos())

    def event(self, event: QEvent) -> bool:
        """Tell the whole name and the unit of a channel whose name is pointed at."""
        if isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            told = self._told(event.pos().x(), event.pos().y())
            QToolTip.showText(event.globalPos(), told, self)
            return True
        return super().event(event)

    # Drawing

    def paint_content(self, painter: QPainter, plot: QRectF) -> None:
        """Draw the curves, or what was read of them so far."""
        now = colours()
        strips = lanes(
            self.source.channels, self.source.shown, plot.height(), overlaid=self.source.overlaid
        )
        if not strips:
            self._axes = ()
            face = text.font(12)
            sentence = "Every channel is hidden; the menu of this panel shows them again."
            sentence = text.elided(sentence, face, plot.width() - 16)
            at = plot.center()
            ink = QColor(now.muted)
            text.put(painter, at.x(), at.y(), sentence, face=face, ink=ink, align=0.5)
            return
        canvas = self._canvas = self._canvas.cleared(plot, painter.device().devicePixelRatioF())
        columns = self.source.columns(self._times(canvas.edges()))
        found = self.source.drawn(self.source.shown, columns)
        names = self.source.names
        self._axes = tuple(
            (lane, axis_of(lane, self._span([names[i] for i in lane.channels], found)))
            for lane in strips
        )
        paint_gaps(painter, self, self.source.gaps, plot, now)
        paint_ground(painter, self._axes, plot, now)
        drawn = [
            (i, Curve(found[names[i]], axis, curve_colour(i, now), (lane.top, lane.bottom)))
            for lane, axis in self._axes
            for i in lane.channels
        ]
        if columns.samples * FAR_APART <= plot.width():
            for i, curve in drawn:
                canvas.draw([curve])
                self._paint_samples(canvas, columns, i, curve)
        else:
            canvas.draw([curve for _, curve in drawn])
        canvas.paint(painter)
        wild = self._paint_glitches(painter, now)
        self._paint_notes(painter, plot, columns, wild, now)

    def gutter_shows(self) -> object:
        """Lanes, axes and channels."""
        return self._axes, self.source.channels

    def paint_gutter(self, painter: QPainter, box: QRectF) -> None:
        """Draw names and vertical axes."""
        now = colours()
        painter.fillRect(box, QColor(now.panel))
        strips = [lane for lane, _ in self._axes]
        named = {lane.group: self._sensor(lane.group) for lane in strips}
        paint_groups(painter, strips, named, now)
        for lane, axis in self._axes:
            taken = self._texts(lane, axis).paint_names(painter)
            paint_axis(painter, lane, axis, box.right(), taken, now)

    def paint_overlay(self, painter: QPainter, plot: QRectF) -> None:
        """Write the values at the cursor."""
        cursor = self.document.cursor
        values, x = self.source.values_at(cursor), self.x_at(cursor)
        for lane, axis in self._axes:
            texts = self._texts(lane, axis)
            texts.paint_values(painter, values)
            if texts.tagged and plot.left() <= x <= plot.right():
                texts.paint_tag(painter, values, x, plot)

    # Inside

    @property
    def _notes_left(self) -> bool:
        """Whether notes give way to the values at the cursor."""
        tags = bool(self._axes) and self._texts(*self._axes[0]).tagged
        return tags and self.x_at(self.document.cursor) > self.plot.right() - NOTES

    def _texts(self, lane: Lane, axis: Axis) -> LaneTexts:
        """What is written of a lane."""
        return LaneTexts(lane, axis, self.source.channels, self._left, self.GUTTER, colours())

    def _marks_moved(self, *_: object) -> None:
        """Put the notes to the other side when the cursor comes to where they are."""
        if self._noted_left != self._notes_left:
            self.invalidate()
        super()._marks_moved()

    @property
    def _left(self) -> float:
        """Where names start."""
        return BESIDE if any(lane.group for lane, _ in self._axes) else ALONE

    def _times(self, x: Real) -> Real:
        """The times of pixels."""
        return self.document.start + (x - self.GUTTER) * self.seconds_per_pixel

    def _sensor(self, group: str) -> str:
        """What a group is called."""
        return f"sensor {group}" if group.isdigit() else group

    def _span(self, names: list[str], found: dict[str, Extremes]) -> tuple[float, float] | None:
        """The least and the greatest value that an axis has to hold."""
        whole = None
        if not self.source.autoscale and self.source.read >= 1.0:
            whole = spanning(self.source.envelope(name).range for name in names)
        return whole or spanning(span_of(found[name]) for name in names)

    def _paint_samples(self, canvas: Canvas, columns: Columns, i: int, curve: Curve) -> None:
        """Draw a dot at each of the few samples that are visible."""
        demonstration = self.document.demonstration
        if demonstration is None:
            return
        stamps = demonstration.times[columns.around]
        x = self.GUTTER + (stamps - self.document.start) / self.seconds_per_pixel
        values = self.source.envelope(self.source.names[i]).values[columns.around]
        inside = np.abs(x) < 2 * self.width()
        canvas.dots(x[inside], values[inside], curve.axis, curve.colour, curve.box)

    def _paint_glitches(self, painter: QPainter, now: Colours) -> int:
        """Draw where glitches are that the axes leave out, and count them."""
        document, number = self.document, 0
        for lane, _ in self._axes:
            for i in lane.channels:
                name = self.source.names[i]
                times, upwards = self.source.glitches(name, document.start, document.end)
                x = self.GUTTER + (times - document.start) / self.seconds_per_pixel
                paint_glitches(painter, x, upwards, (lane.top, lane.bottom), now)
                number += len(times)
        return number

    def _paint_notes(
        self, painter: QPainter, plot: QRectF, columns: Columns, wild: int, now: Colours
    ) -> None:
        """Say how much of the data is seen."""
        notes = []
        if wild:
            one, many = (
                "1 sample is a glitch, beyond all axes",
                "{0} samples are glitches, beyond all axes",
            )
            notes.append(one if wild == 1 else many.format(thousands(wild)))
        if columns.pyramid and self.source.read < 1.0:
            share = f"{100 * self.source.read:.0f}"
            notes.append(f"reading the channels: {share} %")
        if columns.dense:
            count = f"{columns.crowd:.0f}"
            notes.append(f"min/max of {count} samples a pixel")
        self._noted_left = self._notes_left
        paint_notes(painter, plot, notes, now, at_left=self._noted_left)

    def _told(self, x: float, y: float) -> str:
        """What is said of a place in the gutter."""
        for lane, _ in self._axes:
            if x < self.GUTTER and lane.top <= y <= lane.bottom:
                return "\n".join(
                    f"{channel.name} ({channel.unit})" if channel.unit else channel.name
                    for channel in (self.source.channels[i] for i in lane.channels)
                )
        return ""

    @staticmethod
    def _entry(menu: QMenu, name: str, checked: bool) -> QAction:
        """A line of the menu that is on or off."""
        entry = menu.addAction(name)
        entry.setCheckable(True)
        entry.setChecked(checked)
        return entry
