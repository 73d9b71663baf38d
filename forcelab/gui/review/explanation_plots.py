"""The parts of an explanation: probability chart, band map, nearest segments, and its sentences."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QMarginsF, QPointF, QRectF, QSize, QSizeF, Qt, Signal
from PySide6.QtGui import QColor, QImage, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QAbstractButton, QGridLayout, QLabel, QSizePolicy, QWidget

from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.kit import text_size
from forcelab.gui.kit.plot import FAINT, Bars, PanelPlot
from forcelab.gui.kit.traces import curve_colour
from forcelab.gui.label.scalogram_painting import SHADES, oklch_to_srgb
from forcelab.gui.label.swatches import paint_swatch, style_of
from forcelab.gui.review.reviewed_run import reviewed_vocabulary
from forcelab.gui.theme import colours, themes
from forcelab.jobs import Progress
from forcelab.labels import Interval
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.review.run_result import RunResult
from forcelab.vocabulary import Vocabulary

if TYPE_CHECKING:
    from forcelab.review.explanation import Band, Explanation
    from forcelab.review.similar_segments import ForcePreview, Neighbour


MINUS = "\N{MINUS SIGN}"


def signed_log_odds(value: float) -> str:
    """Log-odds with a sign, rounded for reading."""
    digits = f"{abs(value):.1f}" if abs(value) < 99.95 else f"{abs(value):.0f}"
    if not digits.strip("0."):
        return digits
    return (MINUS if value < 0 else "+") + digits


def interval_sentence(place: Interval) -> str:
    """What human and model made of an interval: ``0.90 s coded hold, predicted grab with 0.83``."""
    coded = f"{place.duration:.2f} s coded {place.human or 'unlabelled'}"
    if place.predicted is None:
        return f"{coded}; nothing is predicted"
    sure = "" if place.confidence is None else f" with {place.confidence:.2f}"
    return f"{coded}, predicted {place.predicted}{sure}"


def band_sentence(band: Band, why: Explanation) -> str:
    """One band: ``normal 2 at 8.1 Hz speaks for grab (+3.1)``."""
    side = "for" if band.weight >= 0 else "against"
    weight = signed_log_odds(band.weight)
    if band.error:
        weight += f" ± {band.error:.1f}"
    return f"{band.channel} at {band.hertz:.3g} Hz speaks {side} {why.favoured} ({weight})"


def strongest_bands(why: Explanation) -> str:
    """The three bands that weigh most, a line each."""
    lines = [band_sentence(band, why) for band in why.strongest() if band.weight]
    return "\n".join(lines) or "No band makes a difference here."


def method_sentence(why: Explanation) -> str:
    """How the weights were computed, and how reliable they are."""
    attribution = why.attribution
    log_odds = signed_log_odds(attribution.log_odds)
    odds = f"Log-odds of {why.favoured} against {why.against}: {log_odds} here"
    reference = signed_log_odds(attribution.reference)
    if attribution.method == "gradient":
        gap = f"{attribution.gap:.0e}" if attribution.gap >= 1e-12 else "1e-12"
        return (
            f"{odds}, {reference} at the mean of the training samples. Gradient along the way from "
            f"there, over {attribution.steps} samples; the bands add up to the difference to "
            f"within {gap}."
        )
    return (
        f"{odds}, {reference} with every band replaced. Permutation: what is lost when a band "
        f"comes from random training samples; {attribution.steps} samples, {attribution.repeats} "
        "repetitions, ± standard error. Bands that know the same hide each other."
    )


def recogniser_sentence(why: Explanation, name: str) -> str:
    """Which recogniser is explained; `name` is the demonstration's."""
    if why.how == "left out":
        sentence = f"The recogniser of the run that has not seen {name}"
    elif why.how == "other task":
        sentence = f"The recogniser of the run, trained on another task than {name}"
    else:
        sentence = f"The final recogniser, which was not trained on {name}"
    if why.how == "final" or not why.seconds.get("fit"):
        return sentence + "."
    seconds = why.seconds["features"] + why.seconds["fit"]
    same = f"{100 * why.same_share:.1f} % of its samples are the same"
    if why.same_share == 1:
        same = "it predicts the same"
    return f"{sentence}, trained once more in {seconds:.1f} s: {same}."


def held_out_progress(progress: Progress, name: str, elapsed: float, run: RunResult) -> str:
    """How far the training is: ``Training without pen-03 … about 12 s left``."""
    started = f"Training without {name} …"
    seconds, tested = run.seconds, max(len(run.tested), 1)
    folds = min(run.folds or tested, tested)
    usual = seconds.get("features", 0.0) + seconds.get("fit", 0.0) / folds
    rest = usual - elapsed
    if not usual or progress.text == "explaining":
        return started
    if rest < 1:
        return f"{started} nearly done"
    return f"{started} about {rest:.0f} s left"


#: Pixels around the plot: for its numbers, for the actions' names, and for the time below.
CHART_MARGINS = CHART_LEFT, CHART_TOP, CHART_RIGHT, CHART_BOTTOM = 30.0, 6.0, 40.0, 20.0
CHART_FONT = 10.0
#: Names take at most this share of the width; a line that stands out less than this has an edge.
NAME_SHARE, FAINT_CONTRAST = 0.35, 2.0
#: Lines that stay below this are not named; names are at least so many pixels apart.
NAMED_PROBABILITY, NAME_SPACING = 0.05, 13.0
#: Seconds and shares of the place's length that are shown on either side of it.
LEAST_CONTEXT, CONTEXT_SHARE = 0.5, 1.0


class ProbabilityChart(PanelPlot):
    """Probabilities over time; a click moves the cursor there."""

    def __init__(self, document: Document) -> None:
        super().__init__("", "")
        self.document = document
        self.left.setTicks([[(0.0, "0"), (0.5, "0.5"), (1.0, "1")]])
        self.setAccessibleName("Probability of each action")
        self.probability_trace: ProbabilityTrace | None = None
        self.interval: Interval | None = None
        self.threshold: float | None = None
        self.missing = ""
        #: Actions whose names stand at the right ends of their lines, with the last values.
        self._named: list[tuple[float, str]] = []
        self._cursor = pg.InfiniteLine()
        self._vocabulary = Vocabulary()
        for changed in (document.view.cursor_moved, document.demonstration_changed):
            changed.connect(self._show_cursor)
        document.vocabulary_changed.connect(self.redraw)

    @property
    def needed_height(self) -> float:
        return text_size.pixels(126)

    def show_place(
        self,
        place: Interval | None,
        certainty: ProbabilityTrace | None,
        threshold: float | None,
        missing: str = "",
    ) -> None:
        """Show the probabilities around an interval, the filter's threshold or what is missing."""
        self.interval, self.probability_trace = place, certainty
        self.threshold, self.missing = threshold, missing
        self.renew()

    @property
    def margins(self) -> tuple[float, float, float, float]:
        left, top, right, bottom = map(text_size.pixels, CHART_MARGINS)
        return left, top, right + self._room, bottom

    @property
    def _room(self) -> float:
        actions = () if self.probability_trace is None else self.probability_trace.actions
        names = text.widest(actions, text_size.font(CHART_FONT))
        return min(names, NAME_SHARE * self.width() - text_size.pixels(CHART_RIGHT))

    # Drawing

    def redraw(self) -> None:
        self.clear()
        self._named = []
        theme, place, certainty = colours(), self.interval, self.probability_trace
        self.box.setBackgroundColor(theme.unlabelled)
        if place is None:
            return
        margin = max(CONTEXT_SHARE * place.duration, LEAST_CONTEXT)
        span = place.start - margin, place.end + margin
        self.show_all_of(span, (-0.01, 1.02))
        shade = pg.mkBrush(translucent(theme.range, 0.15))
        ends = (place.start, place.end)
        self.add(pg.LinearRegionItem(ends, movable=False, brush=shade, pen=pg.mkPen(None)))
        for value in (0.0, 0.5, 1.0):
            self.add(pg.InfiniteLine(value, angle=0, pen=theme.frame))
        if self.threshold is not None:
            dotted = pg.mkPen(theme.on_unlabelled, style=Qt.PenStyle.DotLine)
            self.add(pg.InfiniteLine(self.threshold, angle=0, pen=dotted))
        if certainty is not None:
            self._vocabulary = reviewed_vocabulary(self.document)
            self._add_lines(certainty, span)
        self._cursor = pg.InfiniteLine(self.document.view.cursor, pen=theme.cursor)
        self._cursor.setVisible(self.document.id == place.demonstration)
        self.add(self._cursor)

    def _add_lines(self, certainty: ProbabilityTrace, span: tuple[float, float]) -> None:
        """Add a line for each action, the most probable ones on top."""
        first, last = np.searchsorted(certainty.times, span)
        around = slice(max(int(first) - 1, 0), int(last) + 1)
        times, values = certainty.times[around], certainty.values[around] / 255.0
        if not len(times):
            return
        ground = QColor(colours().unlabelled)
        for column in np.argsort(values.max(axis=0), kind="stable").tolist():
            line, action = values[:, column], certainty.actions[column]
            colour = style_of(self._vocabulary, action).colour
            pens = [pg.mkPen(colour, width=1.8)]
            if text.contrast(colour, ground) < FAINT_CONTRAST:
                pens.insert(0, pg.mkPen(colours().on_unlabelled, width=2.8))
            for pen in pens:
                self.add(pg.PlotCurveItem(times, line, pen=pen, antialias=True))
            if line.max() >= NAMED_PROBABILITY:
                self._named.append((float(line[-1]), action))

    def paint_foreground(self, painter: QPainter) -> None:
        """Write the unit, what is missing, and names moved apart where they would overlap."""
        face, theme, box = text_size.font(CHART_FONT), colours(), self.area
        x, y, ink = box.right() + 8, box.bottom() + text_size.pixels(12), QColor(theme.muted)
        text.draw_text(painter, x, y, "s", face=face, ink=ink)
        if self.probability_trace is None:
            message = text.elided(self.missing, face, box.width() - 8)
            x, y, ink = box.center().x(), self.spot(0, 0.25).y(), QColor(theme.on_unlabelled)
            text.draw_text(painter, x, y, message, face=face, ink=ink, align=0.5)
        named = sorted((self.spot(0, value).y(), action) for value, action in self._named)
        spacing = text_size.pixels(NAME_SPACING)
        named = named[: max(int(box.height() // spacing) + 1, 1)]
        heights: list[float] = []
        for y, _ in named:
            heights.append(max(y, heights[-1] + spacing) if heights else y)
        lowest = box.bottom()
        for i in reversed(range(len(heights))):
            heights[i] = min(heights[i], lowest)
            lowest = heights[i] - spacing
        for (y, action), height in zip(named, heights, strict=True):
            side = text_size.pixels(9)
            swatch = QRectF(box.right() + 12, height - side / 2 + 0.5, side, side)
            painter.setPen(QPen(QColor(theme.frame), 0.8))
            painter.drawLine(QLineF(box.right(), y, swatch.left() - 2, height))
            paint_swatch(painter, swatch, style_of(self._vocabulary, action))
            name, ink = text.elided_name(action, face, self._room + 8), QColor(theme.text)
            text.draw_text(painter, swatch.right() + 4, height, name, face=face, ink=ink)

    # Pointer

    def readout(self, pointer: QPointF) -> str:
        """The most probable actions at the pointer's time."""
        certainty, time = self.probability_trace, self.value_at(pointer).x()
        if certainty is None or not self.area.contains(pointer):
            return ""
        at = int(np.searchsorted(certainty.times, time))
        if not 0 < at < len(certainty.times):
            return ""
        values = certainty.values[at - 1] / 255.0
        best = [i for i in np.argsort(-values).tolist() if values[i] >= NAMED_PROBABILITY]
        shares = ", ".join(f"{certainty.actions[i]} {values[i]:.2f}" for i in best[:3])
        return f"{time:.2f} s: {shares}"

    def mousePressEvent(self, event: QMouseEvent) -> None:
        place, where = self.interval, event.position()
        if place is not None and self.area.left() <= where.x() <= self.area.right():
            is_open = self.document.id == place.demonstration
            if is_open and event.button() == Qt.MouseButton.LeftButton:
                self.document.view.seek(self.value_at(where).x())

    def _show_cursor(self) -> None:
        place = self.interval
        self._cursor.setVisible(place is not None and self.document.id == place.demonstration)
        self._cursor.setValue(self.document.view.cursor)


#: Heights of fonts; room for the numbers of Hz, for the legend, names and bars, in pixels.
MAP_FONT, NUMBER_FONT = 10.0, 9.0
MAP_LEFT, LEGEND_WIDTH, HEAD_HEIGHT, BARS_HEIGHT = 52.0, 74.0, 20.0, 54.0
#: The legend grows with its names up to this share of the width.
BAR_SHARE = 0.28
#: A cell at least so wide and high shows its number.
NUMBER_CELL_WIDTH, NUMBER_CELL_HEIGHT = 34.0, 12.0
#: Hues, in degrees of OKLCH, of what speaks against and of what speaks for: blue and orange
#: differ for every kind of colour vision, and each gets stronger with its lightness.
AGAINST_HUE, FOR_HUE = 255.0, 55.0


@cache
def balance_colours(dark: bool) -> NDArray[np.uint8]:
    """Colours from the strongest against to the strongest for, shape (SHADES, 3).

    The middle is close to the ground of the theme, and lightness runs evenly away from it to
    either side, so that equal steps look equal. Shared: not to be changed.
    """
    position = np.linspace(-1.0, 1.0, SHADES)
    ground, far = (0.26, 0.80) if dark else (0.97, 0.50)
    lightness = ground + (far - ground) * np.abs(position)
    chroma = 0.155 * np.abs(position)
    hue = np.radians(np.where(position < 0, AGAINST_HUE, FOR_HUE))
    return oklch_to_srgb(lightness, chroma, hue)


def balance_colour(share: float, dark: bool) -> QColor:
    """The colour of a weight as a share, -1 to 1, of the heaviest one."""
    table = balance_colours(dark)
    place = round((min(max(share, -1.0), 1.0) + 1) / 2 * (len(table) - 1))
    red, green, blue = (int(value) for value in table[place])
    return QColor(red, green, blue)


class BandMap(PanelPlot):
    """A map of weights: a column for each channel, a row for each scale, with Hz at the left.

    Below each column stands a bar for the channel as a whole; with its number everything can be
    read without colours.
    """

    def __init__(self) -> None:
        super().__init__("")
        self.setAccessibleName("Bands that speak for and against")
        self.why: Explanation | None = None
        self.box.invertY()
        self._bars = self.add_box()

    def fit_text(self) -> None:
        super().fit_text()
        self.redraw()

    def set_why(self, why: Explanation | None) -> None:
        self.why = why
        self.setAccessibleDescription("" if why is None else strongest_bands(why))
        self.renew()

    @property
    def needed_height(self) -> float:
        rows = 8 if self.why is None else len(self.why.hertz)
        return text_size.pixels(HEAD_HEIGHT + min(max(rows * 15, 90), 240) + BARS_HEIGHT)

    # Where things are

    @property
    def margins(self) -> tuple[float, float, float, float]:
        left, top, bottom = map(text_size.pixels, (MAP_LEFT, HEAD_HEIGHT, BARS_HEIGHT))
        return left, top, self._legend, bottom

    @property
    def _legend(self) -> float:
        names = () if self.why is None else (self.why.favoured, self.why.against)
        texts = [f"for {name}" for name in names]
        needed = text.widest(texts, text_size.font(MAP_FONT)) + 14
        least = text_size.pixels(LEGEND_WIDTH)
        return min(max(needed, least), max(BAR_SHARE * self.width(), least))

    def place(self) -> None:
        super().place()
        area = self.area
        height = text_size.pixels(BARS_HEIGHT - 22)
        self._bars.setGeometry(area.left(), area.bottom() + 6, area.width(), height)

    def cell(self, channel: int, scale: int) -> QRectF:
        return QRectF(self.spot(channel, scale), self.spot(channel + 1, scale + 1))

    def readout(self, pointer: QPointF) -> str:
        if self.why is None or not self.area.contains(pointer):
            return ""
        from forcelab.review.explanation import Band

        attribution, at = self.why.attribution, self.value_at(pointer)
        i, j = (
            min(int(at.x()), len(self.why.channels) - 1),
            min(int(at.y()), len(self.why.hertz) - 1),
        )
        weight, error = float(attribution.bands[i, j]), float(attribution.bands_error[i, j])
        band = Band(self.why.channels[i], float(self.why.hertz[j]), weight, error)
        return band_sentence(band, self.why)

    # Drawing

    def redraw(self) -> None:
        self.clear()
        self._bars.clear()
        why, theme = self.why, colours()
        if why is None:
            return
        q, k = why.attribution.bands.shape
        self.show_all_of((0, q), (0, k))
        step = max(1, math.ceil(text_size.pixels(MAP_FONT + 3) / (self.area.height() / k)))
        hertz = [(j + 0.5, f"{why.hertz[j]:.3g}{'' if j else ' Hz'}") for j in range(0, k, step)]
        self.left.setTicks([hertz])
        columns, rows = (places.ravel() for places in np.indices((q, k)))
        shares = (why.attribution.bands / (np.abs(why.attribution.bands).max() or 1.0)).ravel()
        fills = [balance_colour(share, theme.dark) for share in shares.tolist()]
        gap = pg.mkPen(theme.panel)
        self.add(Bars(x0=columns, y0=rows, width=1, height=1, brushes=fills, pen=gap))
        weights, errors = why.attribution.channels, why.attribution.channels_error
        largest = float((np.abs(weights) + errors).max()) or 1.0
        most, least = max(float(weights.max()), 0.0), min(float(weights.min()), 0.0)
        missing = max(largest - (most - least), 0.0)  # of the room, which is on the emptier side
        low, high = (least - missing, most) if most else (least, most + missing)
        self._bars.setRange(xRange=(0, q), yRange=(low, high), padding=0)
        fills = [balance_colour(sign * 0.8, theme.dark) for sign in np.sign(weights).tolist()]
        middles = np.arange(q) + 0.5
        self._bars.addItem(Bars(x=middles, height=weights, width=0.5, brushes=fills, pen=None))
        self._bars.addItem(pg.InfiniteLine(0.0, angle=0, pen=theme.frame))

    def paint_foreground(self, painter: QPainter) -> None:
        """Write names and numbers, and frame the strongest bands."""
        why, theme = self.why, colours()
        if why is None:
            return
        painter.setRenderHint(QPainter.RenderHint.TextAntialiasing)
        face, small = text_size.font(MAP_FONT), text_size.font(NUMBER_FONT)
        head, ink = text_size.font(MAP_FONT, bold=True), QColor(theme.text)
        largest = float(np.abs(why.attribution.bands).max()) or 1.0
        marked = {(band.channel, band.hertz) for band in why.strongest() if band.weight}
        least = QSizeF(NUMBER_CELL_WIDTH, NUMBER_CELL_HEIGHT) * text_size.scale()
        foot = self.height() - text_size.pixels(7)
        x, muted = self.area.left() - 6, QColor(theme.muted)
        text.draw_text(painter, x, foot, "in all", face=face, ink=muted, align=1.0)
        for i, channel in enumerate(why.channels):
            for j, hertz in enumerate(why.hertz.tolist()):
                box, weight = self.cell(i, j), float(why.attribution.bands[i, j])
                if box.width() >= least.width() and box.height() >= least.height():
                    number, at = signed_log_odds(weight), box.center()
                    on = text.ink_on(balance_colour(weight / largest, theme.dark))
                    text.draw_text(painter, at.x(), at.y(), number, face=small, ink=on, align=0.5)
                if (channel, hertz) in marked:
                    painter.setBrush(Qt.BrushStyle.NoBrush)
                    painter.setPen(QPen(ink, 1.6))
                    painter.drawRect(box.adjusted(0.5, 0.5, -0.5, -0.5))
            box = self.cell(i, 0)
            x, middle = box.center().x(), self.area.top() / 2
            name = text.elided_name(channel, head, box.width() - 4, tuple(why.channels))
            text.draw_text(painter, x, middle, name, face=head, ink=ink, align=0.5)
            number = signed_log_odds(float(why.attribution.channels[i]))
            text.draw_text(painter, x, foot, number, face=face, ink=ink, align=0.5)
        self._paint_legend(painter, why)

    def _paint_legend(self, painter: QPainter, why: Explanation) -> None:
        """From the strongest for to the strongest against, with both actions' names."""
        theme, face = colours(), text_size.font(MAP_FONT)
        box, left = self.area, self.area.right() + 10
        largest = float(np.abs(why.attribution.bands).max())
        steps = 40
        line = text_size.pixels(MAP_FONT)
        lower, upper = box.top() + line + 6, box.bottom() - line - 6
        high = (upper - lower) / steps
        for step in range(steps):
            colour = balance_colour(1 - 2 * step / (steps - 1), theme.dark)
            painter.fillRect(QRectF(left, lower + step * high, 10, high + 0.5), colour)
        room = self._legend - 11
        for y, inwards, action in ((lower, line, why.favoured), (upper, -line, why.against)):
            name = text.elided_name(f"for {action}", face, room)
            text.draw_text(painter, left, y - inwards, name, face=face, ink=theme.text)
            number, at = signed_log_odds(math.copysign(largest, inwards)), y + inwards / 2
            text.draw_text(painter, left + 14, at, number, face=face, ink=theme.muted)


#: Heights of fonts, of a card and of its frame of video, in pixels.
CARD_NAME_FONT, CARD_FONT = 11.0, 10.0
CARD_HEIGHT, CARD_PADDING = 76, 6.0
CARD_MARGINS = QMarginsF(CARD_PADDING, CARD_PADDING, CARD_PADDING, CARD_PADDING)


class SegmentCard(QAbstractButton):
    """One training segment: its demonstration's name, when, how far off, and its forces."""

    def __init__(self, neighbour: Neighbour, name: str) -> None:
        super().__init__()
        self.neighbour, self.name = neighbour, name
        self.trace: ForcePreview | None = None
        self.span: tuple[float, float] | None = None
        self._frame: QImage | None = None
        self.setCheckable(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        start, distance = self._numbers()
        action = neighbour.place.human
        self.setAccessibleName(f"{name} at {start} s, {action}, distance {distance}")
        self.setToolTip("Show this segment with its surroundings")
        themes().changed.connect(self.update)

    def _numbers(self) -> tuple[str, str]:
        return f"{self.neighbour.place.start:.2f}", f"{self.neighbour.distance:.1f}"

    def sizeHint(self) -> QSize:
        return QSize(180, round(text_size.pixels(CARD_HEIGHT)))

    def show_trace(self, trace: ForcePreview, span: tuple[float, float]) -> None:
        """Show the forces, drawn from `span`'s lower to its upper force, and the frame."""
        self.trace, self.span = trace, span
        if trace.frame is not None:
            height, width = trace.frame.shape[:2]
            image = QImage(trace.frame.data, width, height, 3 * width, QImage.Format.Format_RGB888)
            self._frame = image.copy()  # of its own: the array goes
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        theme = colours()
        with QPainter(self) as painter:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            chosen = self.isChecked() or self.hasFocus()
            painter.setPen(QPen(QColor(theme.accent if chosen else theme.panel_edge), 1 + chosen))
            lit = self.underMouse() and self.isEnabled()
            painter.setBrush(QColor(theme.panel_edge if lit else theme.background))
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(1, 1, -1, -1), 4, 4)
            painter.setOpacity(1.0 if self.isEnabled() else FAINT)
            inside = QRectF(self.rect()).marginsRemoved(CARD_MARGINS)
            self._paint_line(painter, inside)
            lower = inside.adjusted(0, text_size.pixels(CARD_NAME_FONT) + 5, 0, 0)
            if self._frame is not None:
                lower.setLeft(self._paint_frame(painter, lower, self._frame) + CARD_PADDING)
            if self.trace is not None and self.span is not None:
                self._paint_trace(painter, lower, self.trace, self.span)

    def _paint_frame(self, painter: QPainter, box: QRectF, frame: QImage) -> float:
        width = min(box.height() * frame.width() / frame.height(), box.width() / 2)
        height = width * frame.height() / frame.width()
        place = QRectF(box.left(), box.center().y() - height / 2, width, height)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.drawImage(place, frame)
        return place.right()

    def _paint_line(self, painter: QPainter, box: QRectF) -> None:
        theme, y = colours(), box.top() + text_size.pixels(CARD_NAME_FONT) / 2
        face, small = text_size.font(CARD_NAME_FONT), text_size.font(CARD_FONT)
        seconds, distance = self._numbers()
        far, when, ink = f"d {distance}", f"{seconds} s", QColor(theme.muted)
        text.draw_text(painter, box.right(), y, far, face=small, ink=ink, align=1.0)
        room = box.width() - text.width(far, small) - text.width(when, small) - 18
        name = text.elided_name(self.name, face, max(room, 20))
        text.draw_text(painter, box.left(), y, name, face=face, ink=theme.text)
        at = box.left() + text.width(name, face) + 6
        text.draw_text(painter, at, y, when, face=small, ink=ink)

    def _paint_trace(
        self, painter: QPainter, box: QRectF, trace: ForcePreview, span: tuple[float, float]
    ) -> None:
        """Draw each channel as a band from its least to its greatest sample."""
        low, high = span
        unit = box.height() / ((high - low) or 1.0)
        columns, channels = trace.low.shape
        xs = np.repeat(box.left() + box.width() * np.arange(columns) / max(columns - 1, 1), 2)
        painter.setClipRect(box.adjusted(0, -1, 0, 1))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        for channel in range(channels):
            painter.setPen(QPen(curve_colour(channel, colours()), 1.1))
            ends = np.stack([trace.low[:, channel], trace.high[:, channel]], axis=1).ravel()
            line = pg.arrayToQPath(xs, box.bottom() - (ends - low) * unit, connect="finite")
            painter.drawPath(line)
        painter.setClipping(False)


class ColumnHeading(QWidget):
    """The name of a column's action with its colour, and what it is to the place."""

    def __init__(self, document: Document, action: str, role: str) -> None:
        super().__init__()
        self.action, self.role = action, role
        self._style = style_of(reviewed_vocabulary(document), action)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName(f"{action}, {role}")
        themes().changed.connect(self.update)

    def sizeHint(self) -> QSize:
        return QSize(160, round(text_size.pixels(20)))

    def paintEvent(self, event: QPaintEvent) -> None:
        theme = colours()
        with QPainter(self) as painter:
            painter.setOpacity(1.0 if self.isEnabled() else FAINT)
            middle, left = self.height() / 2, text_size.pixels(18)
            side = text_size.pixels(12)
            paint_swatch(painter, QRectF(1, middle - side / 2, side, side), self._style)
            face, small = text_size.font(CARD_NAME_FONT, bold=True), text_size.font(CARD_FONT)
            name = text.elided_name(self.action, face, max(self.width() - left, 20))
            text.draw_text(painter, left, middle, name, face=face, ink=theme.text)
            at = left + text.width(name, face) + 8
            role = text.elided(self.role, small, self.width() - at)
            if len(role) > 1:
                text.draw_text(painter, at, middle, role, face=small, ink=theme.muted)


class NearestSegments(QWidget):
    """Two columns of cards: segments of the one action, and of the other."""

    chosen = Signal(object)

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.cards: list[SegmentCard] = []
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setSpacing(6)
        for column in (0, 1):
            self._grid.setColumnStretch(column, 1)

    def show_neighbours(
        self,
        columns: Sequence[tuple[str, str, Sequence[Neighbour]]],
        name_of: Callable[[str], str],
    ) -> None:
        """Show other neighbours: for each column its action, what that is, and its segments."""
        while (item := self._grid.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.hide()
                widget.deleteLater()
        self.cards = []
        for column, (action, role, neighbours) in enumerate(columns):
            self._grid.addWidget(ColumnHeading(self.document, action, role), 0, column)
            for row, neighbour in enumerate(neighbours, 1):
                card = SegmentCard(neighbour, name_of(neighbour.place.demonstration))
                card.clicked.connect(partial(self.chosen.emit, neighbour.place))
                self._grid.addWidget(card, row, column)
                self.cards.append(card)
            if not neighbours:
                none = QLabel("No other demonstration has any.", wordWrap=True)
                self._grid.addWidget(none, 1, column, Qt.AlignmentFlag.AlignTop)

    def show_traces(self, traces: Sequence[ForcePreview]) -> None:
        """Show what the cards' segments looked like, all on one scale, in the cards' order."""
        ends = [
            (float(np.nanmin(t.low)), float(np.nanmax(t.high)))
            for t in traces
            if np.isfinite(t.low).any()
        ]
        if not ends:
            return
        span = min(low for low, _ in ends), max(high for _, high in ends)
        for card, trace in zip(self.cards, traces, strict=True):
            card.show_trace(trace, span)

    @property
    def all_traced(self) -> bool:
        return all(card.trace is not None for card in self.cards)

    def mark(self, place: Interval | None) -> None:
        for card in self.cards:
            card.setChecked(place is not None and card.neighbour.place == place)
