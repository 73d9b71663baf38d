"""The panel of live recognition: the present action, what the latency means, what is measured."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from forcelab.gui.capture.calm_label import CalmLabel, show_text
from forcelab.gui.capture.present_action import PresentAction
from forcelab.gui.capture.recognising import Loaded, Recognising
from forcelab.gui.capture.session import Session
from forcelab.gui.theme import colours, themes

if TYPE_CHECKING:
    from forcelab.live.recognition import LatencyBudget

__all__ = ["RecognitionPanel", "measured", "promise_text"]

#: Seconds between two texts, and early scales that are named one by one.
OFTEN, NAMED = 0.5, 4
#: Expected error, as a share, below which a scale counts as known.
LEAST = 0.005


class RecognitionPanel(QWidget):
    """Shown while a recogniser is chosen.

    Parameters
    ----------
    session : Session

    Attributes
    ----------
    present : PresentAction
    promise, figures : QLabel
        What the latency means, and what is measured.
    """

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._session = session
        self._told = -math.inf
        self.setAccessibleName("Live recognition")
        self.present = PresentAction(session)
        self.promise, self.figures = CalmLabel(), CalmLabel()
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
            _show(self.promise, "Reading the recogniser…", colours().muted)
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


def promise_text(loaded: Loaded) -> str:
    """What the latency means, in a sentence or two.

    Parameters
    ----------
    loaded : Loaded
    """
    promise = loaded.promise
    if not promise.scales:
        return _of_windows(promise)
    # The smallest scales ring for long, but so softly that nothing is left to be said of it.
    early = [one for one in promise.early if one.error >= LEAST]
    if not early:
        sentence = "{ms:.0f} ms are enough for all {scales} scales of the wavelets."
        return sentence.format(ms=1000 * promise.latency, scales=promise.scales)
    shown = sorted(early, key=lambda one: -one.hertz)
    named = [f"{_hertz(one.hertz)} Hz ±{_percent(one.error)} %" for one in shown]
    if len(named) > NAMED:
        step = (len(named) - 1) / (NAMED - 1)
        named = [named[round(i * step)] for i in range(NAMED)]
        mark = " … "
    else:
        mark = ", "
    sentence = "{early} of {scales} scales are estimated early, with an expected error: {named}."
    return sentence.format(
        early=len(early),
        scales=promise.scales,
        named=mark.join(named),
    )


def _of_windows(promise: LatencyBudget) -> str:
    """The same of a recogniser that looks at a stream in windows."""
    sentence = (
        f"Windows see {1000 * promise.ahead:.0f} ms ahead, the decoder waits for "
        f"{1000 * promise.filters:.0f} ms more."
    )
    if promise.loss < 1.0:
        return sentence
    cost = "So short a latency took {loss:.0f} points of accuracy on real recordings."
    return f"{sentence} {cost.format(loss=promise.loss)}"


def measured(recognising: Recognising, now: float) -> str:
    """What live recognition costs, and how late its labels are on the screen.

    Parameters
    ----------
    recognising : Recognising
    now : float
        Seconds of the host's monotonic clock.
    """
    glimpse, delays = recognising.glimpse, recognising.delays
    if glimpse is None or math.isnan(glimpse.until):
        if recognising.loaded is None or recognising.trouble:
            return ""
        return "Waiting for samples…"
    parts = []
    if delays:
        middle, most = np.percentile(delays, [50, 99])
        parts.append(
            f"On the screen {1000 * middle:.0f} ms after the force (99 %: {1000 * most:.0f} ms)"
        )
    parts.append(f"now {max(0.0, 1000 * (now - glimpse.until)):.0f} ms behind")
    parts.append(f"{100 * glimpse.cost:.0f} % of a core")
    return " · ".join(parts)


def _hertz(value: float) -> str:
    return f"{value:.0f}" if value >= 10 else f"{value:.1f}"


def _percent(share: float) -> str:
    value = 100 * share
    return f"{value:.0f}" if value >= 1 else f"{value:.1f}"


def _show(label: QLabel, line: str, colour: str) -> None:
    """Show a text in a colour."""
    palette = label.palette()
    if palette.color(QPalette.ColorRole.WindowText) != QColor(colour):
        palette.setColor(QPalette.ColorRole.WindowText, QColor(colour))
        label.setPalette(palette)
    show_text(label, line)
