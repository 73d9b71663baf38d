"""The loss of each fold while it trains, and the remarks of the run that came of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF, QSize, Qt, QTimer
from PySide6.QtGui import QColor, QHideEvent, QShowEvent
from PySide6.QtWidgets import QSizePolicy, QVBoxLayout, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.kit.plot import Plot
from forcelab.gui.layout import fill_layout, muted_label, toned_label
from forcelab.gui.review.reviewed_run import on_visible_run_changed, visible_run
from forcelab.gui.review.trainer import Trainer
from forcelab.gui.theme import colours
from forcelab.review.run_result import RunResult

if TYPE_CHECKING:
    from forcelab.review.training import TrainingStep


#: From this ratio of the largest to the smallest loss on, the axis is logarithmic.
LOG_RATIO = 30.0
#: Newly come losses are drawn once in so many ms.
REFRESH_DELAY = 50
#: How near to a point of a curve the pointer reads it, in pixels.
REACH = 30.0

#: Of one fold: whether it is the final fit, its number, and its (epoch, loss).
Curve = tuple[bool, int, list[tuple[int, float]]]


def loss_curves(steps: Sequence[TrainingStep]) -> tuple[Curve, ...]:
    """The curve of each fold, in the order of training; steps without a loss are left out."""
    curves: dict[tuple[bool, int], list[tuple[int, float]]] = {}
    for step in steps:
        if step.loss is not None and step.epoch is not None and math.isfinite(step.loss):
            curve = curves.setdefault((step.phase == "final fit", step.fold), [])
            curve.append((step.epoch, step.loss))
    return tuple((final, fold, points) for (final, fold), points in curves.items())


class LossCurves(Plot):
    """The curves themselves: the fold at work is bold, the final fit has the range's blue."""

    MARGINS = (58.0, 24.0, 14.0, 38.0)

    def __init__(self, trainer: Trainer) -> None:
        super().__init__("loss", "epoch", zooms=True)
        self._trainer = trainer
        self.curves: tuple[Curve, ...] = ()
        self.setAccessibleName("Loss of each fold")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def sizeHint(self) -> QSize:
        return QSize(420, 200)

    def minimumSizeHint(self) -> QSize:
        return QSize(200, 110)

    def show_curves(self, curves: tuple[Curve, ...]) -> None:
        self.curves = curves
        last = curves[-1][2][-1] if curves else None
        self.setAccessibleDescription(
            "" if last is None else f"Loss {last[1]:.3g} after epoch {last[0]}"
        )
        self.redraw()

    @property
    def logarithmic(self) -> bool:
        values = [loss for _, _, points in self.curves for _, loss in points]
        return bool(values) and min(values) > 0 and max(values) / min(values) > LOG_RATIO

    def redraw(self) -> None:
        self.clear()
        self.say("" if self.curves else self.empty_text())
        if not self.curves:
            return
        epochs = [epoch for _, _, points in self.curves for epoch, _ in points]
        values = [loss for _, _, points in self.curves for _, loss in points]
        low, high = min(values), max(values)
        self.left.setLogMode(self.logarithmic)
        up = (min(0.0, low), high * 1.05 if high > 0 else 1.0)
        self.show_all_of(
            (1.0 if min(epochs) else 0.0, max(*epochs, 5)),
            (low / 1.2, high * 1.2) if self.logarithmic else up,
        )
        theme, names = colours(), {"now", "folds", "final fit"}
        for number, (final, _, points) in enumerate(self.curves):
            current = self._trainer.training and number == len(self.curves) - 1
            ink = QColor(theme.range if final else theme.text if current else theme.muted)
            if not (final or current):
                ink.setAlphaF(0.7)
            pen = pg.mkPen(ink, width=2.5 if current else 2.0 if final else 1.0)
            x, y = np.array(points, dtype=np.float64).T
            y = self.left.places(y)
            curve = pg.PlotCurveItem(x, y, pen=pen, antialias=True)
            name = "final fit" if final else "now" if current else "folds"
            self.add(curve, name if name in names else "")
            names.discard(name)
            if len(points) == 1:
                self.add(pg.ScatterPlotItem(x, y, size=4, pen=None, brush=ink))

    def readout(self, pointer: QPointF) -> str:
        points = [(final, fold, *point) for final, fold, curve in self.curves for point in curve]
        if not points:
            return ""
        epochs, losses = zip(*(point[2:] for point in points), strict=True)
        away = self.pixels_of(epochs, losses) - (pointer.x(), pointer.y())
        distances = np.hypot(*away.T)
        nearest = int(distances.argmin())
        if distances[nearest] > REACH:
            return ""
        final, fold, epoch, loss = points[nearest]
        return f"{'final fit' if final else f'fold {fold}'}, epoch {epoch}: loss {loss:.3g}"

    def empty_text(self) -> str:
        if self._trainer.ready and "mlp" not in self._trainer.settings.classifier:
            return "The loss of each fold is drawn here while it trains; this classifier has none."
        return "The loss of each fold is drawn here while it trains."


class LossView(QWidget):
    """The curves, and below them how long what took and what was left out.

    While it is hidden nothing is computed.
    """

    def __init__(self, document: Document, trainer: Trainer) -> None:
        super().__init__()
        self.document, self.trainer = document, trainer
        self.setAccessibleName("Training")
        self.curves = LossCurves(trainer)
        self.times, self.remarks = muted_label(), toned_label("warning")
        for label in (self.times, self.remarks):
            label.setContentsMargins(8, 0, 8, 2)
            label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        parts = (self.curves, 1), self.times, self.remarks
        fill_layout(QVBoxLayout(self), *parts, margins=(0, 0, 0, 4), spacing=2)
        self._soon = QTimer(self, singleShot=True, interval=REFRESH_DELAY)
        self._soon.timeout.connect(self.refresh)
        trainer.losses_changed.connect(self._refresh_soon)
        trainer.changed.connect(self._refresh_soon)
        on_visible_run_changed(document, self.refresh)
        self.refresh()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.refresh()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._soon.stop()

    def _refresh_soon(self) -> None:
        """Draw what came, together with what comes in the next moment."""
        if self.isVisible() and not self._soon.isActive():
            self._soon.start()

    def refresh(self) -> None:
        if not self.isVisible():
            return
        self.curves.show_curves(loss_curves(self.trainer.step_history))
        run = self.document.review.run
        for label, words in (
            (self.times, "" if run is None else self._run_times(run)),
            (self.remarks, self._remarks()),
        ):
            label.setText(words)
            label.setVisible(bool(words))

    def _remarks(self) -> str:
        """What the run says besides, as far as the coder may know it."""
        try:
            run = visible_run(self.document)
        except ForcelabError as error:
            return str(error)
        return "" if run is None else "\n".join(run.remarks)

    def _run_times(self, run: RunResult) -> str:
        parts = []
        for name, value in run.seconds.items():
            part = f"{'filters' if name == 'filter' else name} {_run_time_text(value)}"
            if name == "fit" and run.tested:
                each = _run_time_text(value / len(run.tested))
                part = f"{part} ({each} a fold)"
            parts.append(part)
        return " · ".join(parts)


def _run_time_text(value: float) -> str:
    """A run time with two digits that count."""
    if value >= 100:
        return f"{value:.0f} s"
    return f"{value * 1000:.0f} ms" if value < 0.1 else f"{value:.2g} s"
