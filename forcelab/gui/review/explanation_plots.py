"""The parts of an explanation: probability chart, band map, nearest segments, and its sentences."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QLineF, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QHelpEvent,
    QImage,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
)
from PySide6.QtWidgets import (
    QAbstractButton,
    QGridLayout,
    QLabel,
    QSizePolicy,
    QToolTip,
    QWidget,
)

from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.kit.traces import curve_colour
from forcelab.gui.label.scalogram_painting import oklch_to_srgb
from forcelab.gui.label.swatches import paint_swatch, style_of
from forcelab.gui.review.reviewed_run import reviewed_vocabulary
from forcelab.gui.theme import colours, themes
from forcelab.jobs import Progress
from forcelab.labels import Interval
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.review.run_result import RunResult
from forcelab.vocabulary import Vocabulary

if TYPE_CHECKING:
    from forcelab.review.explanation import Band, Explanation, ForcePreview, Neighbour


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
CHART_LEFT, CHART_RIGHT, CHART_TOP, CHART_BOTTOM = 30.0, 40.0, 6.0, 18.0
CHART_FONT = 10.0
#: Names take at most this share of the width; a line that stands out less than this has an edge.
NAME_SHARE, FAINT_CONTRAST = 0.35, 2.0
#: Lines that stay below this are not named; names are at least so many pixels apart.
NAMED_PROBABILITY, NAME_SPACING = 0.05, 13.0
#: Seconds and shares of the place's length that are shown on either side of it.
LEAST_CONTEXT, CONTEXT_SHARE = 0.5, 1.0


class ProbabilityChart(QWidget):
    """Probabilities over time; a click moves the cursor there."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.setAccessibleName("Probability of each action")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFixedHeight(self.sizeHint().height())
        self.probability_trace: ProbabilityTrace | None = None
        self.place: Interval | None = None
        self.threshold: float | None = None
        self.missing = ""
        self._names = 0.0
        document.view.cursor_moved.connect(self._cursor_moved)
        self._vocabulary = Vocabulary()
        document.vocabulary_changed.connect(self._recolour)
        themes().changed.connect(self.update)

    def sizeHint(self) -> QSize:
        return QSize(320, 126)

    def show_place(
        self,
        place: Interval | None,
        certainty: ProbabilityTrace | None,
        threshold: float | None,
        missing: str = "",
    ) -> None:
        """Show the probabilities around an interval, the filter's threshold or what is missing."""
        self.place, self.probability_trace, self.threshold = place, certainty, threshold
        self.missing = missing
        actions = () if certainty is None else certainty.actions
        self._names = text.widest(actions, text.font(CHART_FONT))
        self._recolour()

    @property
    def plot(self) -> QRectF:
        width = max(self.width() - CHART_LEFT - CHART_RIGHT - self._room, 1.0)
        return QRectF(CHART_LEFT, CHART_TOP, width, self.height() - CHART_TOP - CHART_BOTTOM)

    @property
    def _room(self) -> float:
        return min(self._names, NAME_SHARE * self.width() - CHART_RIGHT)

    @property
    def axis(self) -> Axis | None:
        """From seconds to pixels; None without an interval."""
        if self.place is None:
            return None
        margin = max(CONTEXT_SHARE * self.place.duration, LEAST_CONTEXT)
        box = self.plot
        start, end = self.place.start - margin, self.place.end + margin
        return Axis(start, end, box.left(), box.right())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        axis, x = self.axis, event.position().x()
        if axis is None or self.place is None or not CHART_LEFT <= x <= self.plot.right():
            return
        is_open = self.document.id == self.place.demonstration
        if is_open and event.button() == Qt.MouseButton.LeftButton:
            self.document.view.seek(axis.value(x))

    def paintEvent(self, event: QPaintEvent) -> None:
        with QPainter(self) as painter:
            axis = self.axis
            if axis is not None and self.place is not None:
                self._paint_ground(painter, axis, self.place)
                if self.probability_trace is None:
                    face, ink = text.font(CHART_FONT), QColor(colours().on_unlabelled)
                    box = self.plot
                    message = text.elided(self.missing, face, box.width() - 8)
                    x, y = box.center().x(), self._y(0.25)
                    text.draw_text(painter, x, y, message, face=face, ink=ink, align=0.5)
                else:
                    self._paint_lines(painter, axis, self.probability_trace)
                self._paint_cursor(painter, axis, self.place)

    # Inside

    def _paint_ground(self, painter: QPainter, axis: Axis, place: Interval) -> None:
        theme, box, face = colours(), self.plot, text.font(CHART_FONT)
        painter.fillRect(box, QColor(theme.unlabelled))
        shade = QColor(theme.range)
        shade.setAlpha(38)
        left, right = axis.at(place.start), axis.at(place.end)
        painter.fillRect(QRectF(left, box.top(), right - left, box.height()), shade)
        ink = QColor(theme.muted)
        for value in (0.0, 0.5, 1.0):
            y = self._y(value)
            painter.setPen(QPen(QColor(theme.frame), 0.6))
            painter.drawLine(QLineF(box.left(), y, box.right(), y))
            text.draw_text(painter, CHART_LEFT - 6, y, f"{value:g}", face=face, ink=ink, align=1.0)
        if self.threshold is not None:
            painter.setPen(QPen(QColor(theme.on_unlabelled), 0.8, Qt.PenStyle.DotLine))
            y = self._y(self.threshold)
            painter.drawLine(QLineF(box.left(), y, box.right(), y))
        for value, label in axis.marks(CHART_FONT, upright=False):
            x = axis.at(value)
            painter.setPen(QPen(QColor(theme.frame), 0.6))
            painter.drawLine(QLineF(x, box.bottom(), x, box.bottom() + 3))
            text.draw_text(painter, x, box.bottom() + 10, label, face=face, ink=ink, align=0.5)
        second = "s"
        text.draw_text(painter, box.right() + 8, box.bottom() + 10, second, face=face, ink=ink)

    def _y(self, probability: float) -> float:
        box = self.plot.adjusted(0, 2, 0, -1)
        return box.bottom() - probability * box.height()

    def _paint_lines(self, painter: QPainter, axis: Axis, certainty: ProbabilityTrace) -> None:
        """A line for each action, the most probable ones on top; names at their right ends."""
        times = certainty.times
        first, last = np.searchsorted(times, (axis.start, axis.end))
        values = certainty.values[max(first - 1, 0) : last + 1] / 255.0
        times = times[max(first - 1, 0) : last + 1]
        if not len(times):
            return
        xs = [axis.at(time) for time in times.tolist()]
        painter.save()
        painter.setClipRect(self.plot)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        named = []
        for column in np.argsort(values.max(axis=0), kind="stable").tolist():
            style = style_of(self._vocabulary, certainty.actions[column])
            ys = [self._y(value) for value in values[:, column].tolist()]
            line = QPolygonF([QPointF(x, y) for x, y in zip(xs, ys, strict=True)])
            if text.contrast(style.colour, QColor(colours().unlabelled)) < FAINT_CONTRAST:
                painter.setPen(QPen(QColor(colours().on_unlabelled), 2.8))
                painter.drawPolyline(line)
            painter.setPen(QPen(style.colour, 1.8))
            painter.drawPolyline(line)
            if values[:, column].max() >= NAMED_PROBABILITY:
                named.append((ys[-1], certainty.actions[column]))
        painter.restore()
        self._paint_names(painter, named)

    def _paint_names(self, painter: QPainter, named: list[tuple[float, str]]) -> None:
        """Names beside the ends of their lines, moved apart where they would overlap."""
        face, theme, box = text.font(CHART_FONT), colours(), self.plot
        named = sorted(named)[: max(int(box.height() // NAME_SPACING) + 1, 1)]
        heights: list[float] = []
        for y, _ in named:
            heights.append(max(y, heights[-1] + NAME_SPACING) if heights else y)
        lowest = box.bottom()
        for i in reversed(range(len(heights))):
            heights[i] = min(heights[i], lowest)
            lowest = heights[i] - NAME_SPACING
        for (y, action), height in zip(named, heights, strict=True):
            swatch = QRectF(box.right() + 12, height - 4, 9, 9)
            painter.setPen(QPen(QColor(theme.frame), 0.8))
            painter.drawLine(QLineF(box.right(), y, swatch.left() - 2, height))
            paint_swatch(painter, swatch, style_of(self._vocabulary, action))
            name = text.elided_name(action, face, self._room + 8)
            ink = QColor(theme.text)
            text.draw_text(painter, swatch.right() + 4, height, name, face=face, ink=ink)

    def _paint_cursor(self, painter: QPainter, axis: Axis, place: Interval) -> None:
        cursor = self.document.view.cursor
        if self.document.id == place.demonstration and axis.start <= cursor <= axis.end:
            painter.setPen(QPen(QColor(colours().cursor), 1.4))
            x = axis.at(cursor)
            painter.drawLine(QLineF(x, self.plot.top(), x, self.plot.bottom()))

    def _recolour(self) -> None:
        if self.probability_trace is not None:
            self._vocabulary = reviewed_vocabulary(self.document)
        self.update()

    def _cursor_moved(self, *_: object) -> None:
        """Follow the cursor, where it can be seen."""
        if self.isVisible() and self.place is not None:
            self.update()


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
def balance_colours(dark: bool, count: int = 255) -> NDArray[np.uint8]:
    """Colours from the strongest against to the strongest for, shape (count, 3); count is odd.

    The middle is close to the ground of the theme, and lightness runs evenly away from it to
    either side, so that equal steps look equal. Shared: not to be changed.
    """
    position = np.linspace(-1.0, 1.0, count)
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


class BandMap(QWidget):
    """A map of weights: a column for each channel, a row for each scale, with Hz at the left.

    Below each column stands a bar for the channel as a whole; with its number everything can be
    read without colours.
    """

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Bands that speak for and against")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.why: Explanation | None = None
        themes().changed.connect(self.update)

    def set_why(self, why: Explanation | None) -> None:
        self.why = why
        self.setAccessibleDescription("" if why is None else strongest_bands(why))
        self.setFixedHeight(self.sizeHint().height())
        self.update()

    def sizeHint(self) -> QSize:
        rows = 8 if self.why is None else len(self.why.hertz)
        return QSize(320, round(HEAD_HEIGHT + min(max(rows * 15, 90), 240) + BARS_HEIGHT))

    # Where things are

    @property
    def map(self) -> QRectF:
        width = max(self.width() - MAP_LEFT - self._legend, 1.0)
        return QRectF(
            MAP_LEFT, HEAD_HEIGHT, width, max(self.height() - HEAD_HEIGHT - BARS_HEIGHT, 1.0)
        )

    @property
    def _legend(self) -> float:
        names = () if self.why is None else (self.why.favoured, self.why.against)
        texts = [f"for {name}" for name in names]
        needed = text.widest(texts, text.font(MAP_FONT)) + 14
        return min(max(needed, LEGEND_WIDTH), max(BAR_SHARE * self.width(), LEGEND_WIDTH))

    def cell(self, channel: int, scale: int) -> QRectF:
        assert self.why is not None
        box, (q, k) = self.map, self.why.attribution.bands.shape
        width, height = box.width() / q, box.height() / k
        left, top = box.left() + channel * width, box.top() + scale * height
        return QRectF(left, top, width, height)

    def event(self, event: QEvent) -> bool:
        if isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            sentence = self.band_text(QPointF(event.pos()))
            QToolTip.showText(event.globalPos(), sentence, self)
            return True
        return super().event(event)

    def band_text(self, where: QPointF) -> str:
        """The sentence of the band at a point; empty where there is none."""
        if self.why is None or not self.map.contains(where):
            return ""
        attribution, box = self.why.attribution, self.map
        q, k = attribution.bands.shape
        i = min(int((where.x() - box.left()) / box.width() * q), q - 1)
        j = min(int((where.y() - box.top()) / box.height() * k), k - 1)
        from forcelab.review.explanation import Band

        weight, error = float(attribution.bands[i, j]), float(attribution.bands_error[i, j])
        band = Band(self.why.channels[i], float(self.why.hertz[j]), weight, error)
        return band_sentence(band, self.why)

    # Painting

    def paintEvent(self, event: QPaintEvent) -> None:
        with QPainter(self) as painter:
            if self.why is not None:
                painter.setOpacity(1.0 if self.isEnabled() else 0.35)
                painter.setRenderHint(QPainter.RenderHint.TextAntialiasing)
                self._paint_cells(painter, self.why)
                self._paint_axis(painter, self.why)
                self._paint_bars(painter, self.why)
                self._paint_legend(painter, self.why)

    def _paint_cells(self, painter: QPainter, why: Explanation) -> None:
        """One cell for each band, with its number where there is room."""
        theme, weights = colours(), why.attribution.bands
        largest = float(np.abs(weights).max()) or 1.0
        face = text.font(NUMBER_FONT)
        head = text.font(MAP_FONT, bold=True)
        marked = {(band.channel, band.hertz) for band in why.strongest() if band.weight}
        rings = []
        for i, channel in enumerate(why.channels):
            for j, hertz in enumerate(why.hertz.tolist()):
                box, weight = self.cell(i, j), float(weights[i, j])
                colour = balance_colour(weight / largest, theme.dark)
                painter.fillRect(box.adjusted(0, 0, -1, -1), colour)
                if (channel, hertz) in marked:
                    rings.append(box.adjusted(0.5, 0.5, -1.5, -1.5))
                if box.width() >= NUMBER_CELL_WIDTH and box.height() >= NUMBER_CELL_HEIGHT:
                    number, centre = signed_log_odds(weight), box.center()
                    ink = text.ink_on(colour)
                    text.draw_text(
                        painter, centre.x(), centre.y(), number, face=face, ink=ink, align=0.5
                    )
            box = self.cell(i, 0)
            name = text.elided_name(channel, head, box.width() - 4)
            ink = QColor(theme.text)
            text.draw_text(
                painter, box.center().x(), HEAD_HEIGHT / 2, name, face=head, ink=ink, align=0.5
            )
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(theme.text), 1.6))
        for ring in rings:
            painter.drawRect(ring)

    def _paint_axis(self, painter: QPainter, why: Explanation) -> None:
        theme, face = colours(), text.font(MAP_FONT)
        height = self.map.height() / len(why.hertz)
        stride = max(1, -int(-(MAP_FONT + 3) // height))
        for j in range(0, len(why.hertz), stride):
            middle = self.cell(0, j).center().y()
            label = f"{why.hertz[j]:.3g}"
            if j == 0:
                label = f"{label} Hz"
            ink = QColor(theme.muted)
            text.draw_text(painter, MAP_LEFT - 6, middle, label, face=face, ink=ink, align=1.0)

    def _paint_bars(self, painter: QPainter, why: Explanation) -> None:
        """A bar for each channel: up where it speaks for, down where it speaks against."""
        theme, face = colours(), text.font(MAP_FONT)
        weights, errors = why.attribution.channels, why.attribution.channels_error
        largest = float((np.abs(weights) + errors).max()) or 1.0
        box = self.map
        top, bottom = box.bottom() + 6, self.height() - 16.0
        most, least = max(float(weights.max()), 0.0), min(float(weights.min()), 0.0)
        unit = (bottom - top) / max(most - least, largest)
        zero = top + most * unit if most - least >= largest else (top if most == 0 else bottom)
        for i, weight in enumerate(weights.tolist()):
            column = self.cell(i, 0)
            wide = min(column.width() * 0.5, 40.0)
            left = column.center().x() - wide / 2
            bar = QRectF(left, zero - weight * unit, wide, weight * unit).normalized()
            painter.fillRect(bar, balance_colour(np.sign(weight) * 0.8, theme.dark))
            ink, at = QColor(theme.text), column.center().x()
            number = signed_log_odds(weight)
            text.draw_text(painter, at, self.height() - 7.0, number, face=face, ink=ink, align=0.5)
        painter.setPen(QPen(QColor(theme.frame), 1))
        painter.drawLine(QPointF(box.left(), zero), QPointF(box.right() - 1, zero))
        ink = QColor(theme.muted)
        label = "in all"
        text.draw_text(
            painter, MAP_LEFT - 6, self.height() - 7.0, label, face=face, ink=ink, align=1.0
        )

    def _paint_legend(self, painter: QPainter, why: Explanation) -> None:
        """From the strongest for to the strongest against, with both actions' names."""
        theme, face = colours(), text.font(MAP_FONT)
        box, left = self.map, self.map.right() + 10
        largest = float(np.abs(why.attribution.bands).max())
        steps = 40
        lower, upper = box.top() + MAP_FONT + 6, box.bottom() - MAP_FONT - 6
        high = (upper - lower) / steps
        for step in range(steps):
            colour = balance_colour(1 - 2 * step / (steps - 1), theme.dark)
            painter.fillRect(QRectF(left, lower + step * high, 10, high + 0.5), colour)
        room = self._legend - 11
        for y, action, value in (
            (lower, why.favoured, largest),
            (upper, why.against, -largest),
        ):
            outside = y - MAP_FONT if y == lower else y + MAP_FONT
            inside = y + MAP_FONT / 2 if y == lower else y - MAP_FONT / 2
            name = text.elided_name(f"for {action}", face, room)
            text.draw_text(painter, left, outside, name, face=face, ink=QColor(theme.text))
            number = signed_log_odds(value)
            text.draw_text(painter, left + 14, inside, number, face=face, ink=QColor(theme.muted))


#: Heights of fonts, of a card and of its frame of video, in pixels.
CARD_NAME_FONT, CARD_FONT = 11.0, 10.0
CARD_HEIGHT, CARD_PADDING = 76, 6.0


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
        return QSize(180, CARD_HEIGHT)

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
            painter.setOpacity(1.0 if self.isEnabled() else 0.35)
            inside = QRectF(self.rect()).adjusted(
                CARD_PADDING, CARD_PADDING, -CARD_PADDING, -CARD_PADDING
            )
            self._paint_line(painter, inside)
            lower = inside.adjusted(0, CARD_NAME_FONT + 5, 0, 0)
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
        theme, y = colours(), box.top() + CARD_NAME_FONT / 2
        face, small = text.font(CARD_NAME_FONT), text.font(CARD_FONT)
        seconds, distance = self._numbers()
        far = f"d {distance}"
        when = f"{seconds} s"
        ink = QColor(theme.muted)
        text.draw_text(painter, box.right(), y, far, face=small, ink=ink, align=1.0)
        room = box.width() - text.width(far, small) - text.width(when, small) - 18
        name = text.elided_name(self.name, face, max(room, 20))
        text.draw_text(painter, box.left(), y, name, face=face, ink=QColor(theme.text))
        at = box.left() + text.width(name, face) + 6
        text.draw_text(painter, at, y, when, face=small, ink=ink)

    def _paint_trace(
        self, painter: QPainter, box: QRectF, trace: ForcePreview, span: tuple[float, float]
    ) -> None:
        """Draw each channel as a band from its least to its greatest sample."""
        low, high = span
        unit = box.height() / ((high - low) or 1.0)
        columns, channels = trace.low.shape
        xs = box.left() + box.width() * np.arange(columns) / max(columns - 1, 1)
        painter.setClipRect(box.adjusted(0, -1, 0, 1))
        for channel in range(channels):
            painter.setPen(QPen(curve_colour(channel, colours()), 1.1))
            ends = np.stack([trace.low[:, channel], trace.high[:, channel]], axis=1).ravel()
            ys = box.bottom() - (ends - low) * unit
            finite = np.isfinite(ys)
            pieces = zip(np.repeat(xs, 2)[finite].tolist(), ys[finite].tolist(), strict=True)
            painter.drawPolyline(QPolygonF([QPointF(x, y) for x, y in pieces]))
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
        return QSize(160, 20)

    def paintEvent(self, event: QPaintEvent) -> None:
        theme = colours()
        with QPainter(self) as painter:
            painter.setOpacity(1.0 if self.isEnabled() else 0.35)
            paint_swatch(painter, QRectF(1, 4, 12, 12), self._style)
            face, small = text.font(CARD_NAME_FONT, bold=True), text.font(CARD_FONT)
            name = text.elided_name(self.action, face, max(self.width() - 18, 20))
            text.draw_text(painter, 18, 10, name, face=face, ink=QColor(theme.text))
            at = 18 + text.width(name, face) + 8
            role = text.elided(self.role, small, self.width() - at)
            if len(role) > 1:
                text.draw_text(painter, at, 10, role, face=small, ink=QColor(theme.muted))


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
                none = QLabel("No other demonstration has any.")
                none.setWordWrap(True)
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
        """Whether every card shows its forces."""
        return all(card.trace is not None for card in self.cards)

    def mark(self, place: Interval | None) -> None:
        for card in self.cards:
            card.setChecked(place is not None and card.neighbour.place == place)
