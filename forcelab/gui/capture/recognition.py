"""The panel of live recognition: the present action, large, and how probable each one is."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QCoreApplication, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPalette
from PySide6.QtWidgets import QLabel, QSizePolicy, QVBoxLayout, QWidget

from forcelab.gui.capture.recognising import Loaded, Recognising
from forcelab.gui.capture.session import Session
from forcelab.gui.figures import text
from forcelab.gui.label.swatches import look_of, paint_swatch
from forcelab.gui.theme import colours, themes

if TYPE_CHECKING:
    from forcelab.live.promise import Promise

__all__ = ["PresentAction", "RecognitionPanel", "measured", "promise_text"]

#: Height of a bar's row, width of a cell at least, and rows at least and at most, in pixels.
ROW, CELL, FEWEST, MOST = 17, 128, 3, 6
#: Width of a cell at most, in pixels: a longer bar tells no more.
WIDEST = 240
#: Width of what is left for the present action, in pixels.
LARGE = 190
#: Seconds between two texts, and early scales that are named one by one.
OFTEN, NAMED = 0.5, 4
#: Expected error, as a share, below which a scale counts as known.
LEAST = 0.005


class RecognitionPanel(QWidget):
    """Shown while a recogniser is chosen.

    Parameters
    ----------
    session : Session
    parent : QWidget, optional

    Attributes
    ----------
    present : PresentAction
    promise, figures : QLabel
        What the latency means, and what is measured.
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._told = -math.inf
        self.setAccessibleName(self.tr("Live recognition"))
        self.present = PresentAction(session)
        self.promise, self.figures = _line(), _line()
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 4, 8, 2)
        column.setSpacing(3)
        for part in (self.present, self.figures, self.promise):
            column.addWidget(part)
        session.ticked.connect(self._ticked)
        session.changed.connect(self.refresh)
        session.recognising.changed.connect(self.refresh)
        themes().changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Say how it is now."""
        recognising = self._session.recognising
        self.setVisible(recognising.choice is not None)
        if recognising.choice is None:
            return
        loaded, trouble = recognising.loaded, recognising.trouble
        if trouble:
            _show(self.promise, trouble, colours().trouble)
        elif loaded is None:
            _show(self.promise, self.tr("Reading the recogniser…"), colours().muted)
        else:
            _show(self.promise, promise_text(loaded), colours().muted)
        self._measure()
        self.present.refresh()

    def _ticked(self) -> None:
        """Most frames move bars only; the text would flicker."""
        if self.isVisible():
            self.present.update()
            if self._session.now - self._told >= OFTEN:
                self._measure()

    def _measure(self) -> None:
        self._told = self._session.now
        connected = self._session.connected
        line = measured(self._session.recognising, self._session.now) if connected else ""
        _show(self.figures, line, colours().text)


class PresentAction(QWidget):
    """The action of the latest label, and a bar for each that the recogniser knows.

    Parameters
    ----------
    session : Session
    parent : QWidget, optional
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._said = ""
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.refresh()

    def sizeHint(self) -> QSize:
        """As high as the bars need, within bounds."""
        loaded = self._session.recognising.loaded
        count = 0 if loaded is None else len(loaded.recogniser.actions)
        columns = max(1, (max(self.width(), 480) - LARGE) // CELL)
        rows = min(max(-(-count // columns), FEWEST), MOST)
        return QSize(480, rows * ROW + 2)

    def minimumSizeHint(self) -> QSize:
        """Narrow, but as high as it is."""
        return QSize(240, self.sizeHint().height())

    def refresh(self) -> None:
        """Another recogniser, other actions."""
        self.updateGeometry()
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the action and the bars."""
        painter = QPainter(self)
        glimpse = self._session.recognising.glimpse
        action = "" if glimpse is None or not self._session.connected else glimpse.action
        self._tell(action)
        self._paint_action(painter, action)
        loaded = self._session.recognising.loaded
        if loaded is not None:
            known = glimpse.probabilities if glimpse is not None else ()
            self._paint_bars(painter, loaded.recogniser.actions, known)
        painter.end()

    def _tell(self, action: str) -> None:
        """For those who do not see it."""
        if action != self._said or not self.accessibleName():
            self._said = action
            self.setAccessibleName(self.tr("Present action: {0}").format(action or self._none()))

    def _none(self) -> str:
        return self.tr("unlabelled")

    def _paint_action(self, painter: QPainter, action: str) -> None:
        box = QRectF(0, 1, LARGE - 16, self.height() - 2)
        swatch = QRectF(box.left(), box.center().y() - 15, 30, 30)
        theme = colours()
        face = text.font(22.0, bold=True)
        if action:
            paint_swatch(painter, swatch, look_of(self._session.seen_vocabulary, action))
        else:
            painter.setPen(QColor(theme.frame))
            painter.setBrush(QColor(theme.unlabelled))
            painter.drawRect(swatch.adjusted(0, 0, -1, -1))
        room = box.right() - swatch.right() - 10
        said = text.elided(action, face, room) if action else self._none()
        ink = QColor(theme.text if action else theme.muted)
        face = face if action else text.font(14.0)
        text.put(painter, swatch.right() + 10, swatch.center().y(), said, face=face, ink=ink)

    def _paint_bars(
        self, painter: QPainter, actions: tuple[str, ...], known: tuple[float, ...]
    ) -> None:
        """Name, bar and number of each action, in columns."""
        theme, vocabulary = colours(), self._session.seen_vocabulary
        rows = max(1, (self.height() - 2) // ROW)
        columns = min(max(1, (self.width() - LARGE) // CELL), -(-len(actions) // rows))
        rows = min(rows, -(-len(actions) // columns))  # all columns of like height
        width = min((self.width() - LARGE) / columns, WIDEST)
        begin = (self.height() - rows * ROW) / 2
        face = text.font(10.0)
        number = text.width("100 %", face) + 14
        named = min(text.widest(actions, face) + 8, 0.55 * (width - number))
        for i, action in enumerate(actions[: rows * columns]):
            left, top = LARGE + (i // rows) * width, begin + (i % rows) * ROW
            share = known[i] if i < len(known) else 0.0
            middle = top + ROW / 2
            name = text.elided(action, face, named - 4)
            text.put(painter, left, middle, name, face=face, ink=QColor(theme.text))
            bar = QRectF(left + named, top + 4, width - named - number - 4, ROW - 8)
            painter.fillRect(bar, QColor(theme.grid))
            look = look_of(vocabulary, action)
            full = QRectF(bar.left(), bar.top(), bar.width() * share, bar.height())
            painter.fillRect(full, look.colour)
            painter.setPen(QColor(theme.frame))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(bar)
            if known:
                label = f"{100 * share:.0f} %"
                text.put(
                    painter, bar.right() + 5, middle, label, face=face, ink=QColor(theme.muted)
                )


def promise_text(loaded: Loaded) -> str:
    """What the latency means, in a sentence or two.

    Parameters
    ----------
    loaded : Loaded
    """
    translate = QCoreApplication.translate
    promise = loaded.promise
    if not promise.scales:
        return _of_windows(promise)
    # The smallest scales ring for long, but so softly that nothing is left to be said of it.
    early = [one for one in promise.early if one.error >= LEAST]
    if not early:
        sentence = translate(
            "forcelab", "{ms:.0f} ms are enough for all {scales} scales of the wavelets."
        )
        return sentence.format(ms=1000 * promise.latency, scales=promise.scales)
    shown = sorted(early, key=lambda one: -one.hertz)
    named = [f"{_hertz(one.hertz)} Hz ±{_percent(one.error)} %" for one in shown]
    if len(named) > NAMED:
        step = (len(named) - 1) / (NAMED - 1)
        named = [named[round(i * step)] for i in range(NAMED)]
        mark = " … "
    else:
        mark = ", "
    sentence = translate(
        "forcelab",
        "{early} of {scales} scales are estimated early, with an expected error: {named}.",
    )
    return sentence.format(
        early=len(early),
        scales=promise.scales,
        named=mark.join(named),
    )


def _of_windows(promise: Promise) -> str:
    """The same of a recogniser that looks at a stream in windows."""
    translate = QCoreApplication.translate
    sentence = translate(
        "forcelab",
        "Windows see {ahead:.0f} ms ahead, the decoder waits for {lag:.0f} ms more.",
    ).format(ahead=1000 * promise.ahead, lag=1000 * promise.filters)
    if promise.loss < 1.0:
        return sentence
    cost = translate(
        "forcelab", "So short a latency took {loss:.0f} points of accuracy on real recordings."
    )
    return f"{sentence} {cost.format(loss=promise.loss)}"


def measured(recognising: Recognising, now: float) -> str:
    """What live recognition costs, and how late its labels are on the screen.

    Parameters
    ----------
    recognising : Recognising
    now : float
        Seconds of the host's monotonic clock.
    """
    translate = QCoreApplication.translate
    glimpse, delays = recognising.glimpse, recognising.delays
    if glimpse is None or math.isnan(glimpse.until):
        if recognising.loaded is None or recognising.trouble:
            return ""
        return translate("forcelab", "Waiting for samples…")
    parts = []
    if delays:
        middle, most = np.percentile(delays, [50, 99])
        sentence = translate(
            "forcelab", "On the screen {middle:.0f} ms after the force (99 %: {most:.0f} ms)"
        )
        parts.append(sentence.format(middle=1000 * middle, most=1000 * most))
    lag = translate("forcelab", "now {lag:.0f} ms behind")
    parts.append(lag.format(lag=max(0.0, 1000 * (now - glimpse.until))))
    cost = translate("forcelab", "{cost:.0f} % of a core")
    parts.append(cost.format(cost=100 * glimpse.cost))
    return " · ".join(parts)


def _hertz(value: float) -> str:
    return f"{value:.0f}" if value >= 10 else f"{value:.1f}"


def _percent(share: float) -> str:
    value = 100 * share
    return f"{value:.0f}" if value >= 1 else f"{value:.1f}"


def _line() -> QLabel:
    """A text of a line or two that leaves the width alone."""
    label = QLabel()
    label.setTextFormat(Qt.TextFormat.PlainText)
    label.setWordWrap(True)
    label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
    return label


def _show(label: QLabel, line: str, colour: str) -> None:
    """Show a text; nothing is laid out anew where it is the same."""
    palette = label.palette()
    if palette.color(QPalette.ColorRole.WindowText) != QColor(colour):
        palette.setColor(QPalette.ColorRole.WindowText, QColor(colour))
        label.setPalette(palette)
    if label.text() != line:
        label.setText(line)
        label.setAccessibleName(line)
    if label.isHidden() == bool(line):
        label.setVisible(bool(line))
