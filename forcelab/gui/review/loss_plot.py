"""The loss of each fold while it trains, and the remarks of the run that came of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import (
    QColor,
    QFont,
    QHideEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
    QShowEvent,
)
from PySide6.QtWidgets import QSizePolicy, QVBoxLayout, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.figures.axes import Axis, LogAxis, draw_bottom, draw_left
from forcelab.gui.layout import muted_label, set_tone
from forcelab.gui.review.reviewed_run import visible_run
from forcelab.gui.review.trainer import Trainer
from forcelab.gui.theme import colours, themes
from forcelab.review.run_result import RunResult

if TYPE_CHECKING:
    from forcelab.review.training import TrainingStep


#: From this ratio of the largest to the smallest loss on, the axis is logarithmic.
LOG_RATIO = 30.0
#: Newly come losses are drawn once in so many ms.
REFRESH_DELAY = 50

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


class LossCurves(QWidget):
    """The curves themselves: the fold at work is bold, the final fit has the range's blue."""

    def __init__(self, trainer: Trainer) -> None:
        super().__init__()
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
        self.update()

    @property
    def logarithmic(self) -> bool:
        """Whether the losses span decades."""
        values = [loss for _, _, points in self.curves for _, loss in points]
        return bool(values) and min(values) > 0 and max(values) / min(values) > LOG_RATIO

    def paintEvent(self, event: QPaintEvent) -> None:
        theme = colours()
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(theme.background))
            if not self.curves:
                self._paint_empty(painter)
                return
            plot = QRectF(self.rect()).adjusted(58, 12, -14, -38)
            epochs = [epoch for _, _, points in self.curves for epoch, _ in points]
            values = [loss for _, _, points in self.curves for _, loss in points]
            right = max(*epochs, 2)
            across = Axis(1.0 if min(epochs) else 0.0, right, plot.left(), plot.right())
            up = self._loss_axis(values, plot)
            draw_bottom(painter, across, plot.bottom(), "epoch", theme)
            draw_left(painter, up, plot.left(), "loss", theme)
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            working = self._trainer.training
            for number, (final, _, points) in enumerate(self.curves):
                current = working and number == len(self.curves) - 1
                ink = QColor(theme.range if final else theme.text if current else theme.muted)
                if not (final or current):
                    ink.setAlphaF(0.7)
                width = 2.5 if current else 2.0 if final else 1.0
                painter.setPen(QPen(ink, width))
                spots = [QPointF(across.at(e), up.at(v)) for e, v in points]
                if len(spots) == 1:
                    painter.setBrush(ink)
                    painter.drawEllipse(spots[0], 2, 2)
                else:
                    painter.drawPolyline(QPolygonF(spots))
            self._paint_legend(painter, plot)

    def _loss_axis(self, values: list[float], plot: QRectF) -> Axis | LogAxis:
        high, low = max(values), min(values)
        if self.logarithmic:
            return LogAxis(low / 1.2, high * 1.2, plot.bottom(), plot.top())
        top = high * 1.05 if high > 0 else 1.0
        return Axis(min(0.0, low), top, plot.bottom(), plot.top())

    def _paint_legend(self, painter: QPainter, plot: QRectF) -> None:
        """The legend, top right, where curves that fall are not."""
        theme = colours()
        texts = []
        if self._trainer.training:
            texts.append(("now", theme.text))
        if any(not final for final, _, _ in self.curves):
            texts.append(("folds", theme.muted))
        if any(final for final, _, _ in self.curves):
            texts.append(("final fit", theme.range))
        face = QFont(self.font())
        face.setPixelSize(11)
        painter.setFont(face)
        top = plot.top()
        for line_text, ink in texts:
            box = QRectF(plot.right() - 120, top, 96, 14)
            painter.setPen(QColor(ink))
            painter.drawText(
                box, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, line_text
            )
            painter.setPen(QPen(QColor(ink), 2.0))
            painter.drawLine(
                QPointF(plot.right() - 18, box.center().y()),
                QPointF(plot.right() - 2, box.center().y()),
            )
            top += 15

    def _paint_empty(self, painter: QPainter) -> None:
        painter.setPen(QColor(colours().muted))
        painter.drawText(
            QRectF(self.rect()).adjusted(16, 8, -16, -8),
            Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap,
            self.empty_text(),
        )

    def empty_text(self) -> str:
        """Why there is no curve."""
        if self._trainer.ready and "mlp" not in self._trainer.classifier:
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
        self.times, self.remarks = muted_label(), set_tone("warning")
        for label in (self.times, self.remarks):
            label.setContentsMargins(8, 0, 8, 2)
            label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 4)
        column.setSpacing(2)
        column.addWidget(self.curves, 1)
        column.addWidget(self.times)
        column.addWidget(self.remarks)
        self._soon = QTimer(self, singleShot=True, interval=REFRESH_DELAY)
        self._soon.timeout.connect(self.refresh)
        trainer.losses_changed.connect(self._refresh_soon)
        trainer.changed.connect(self._refresh_soon)
        for changed in (document.review.run_changed, document.author_changed):
            changed.connect(self.refresh)
        document.listing_changed.connect(self.refresh)  # what is coded blind may have changed
        themes().changed.connect(self.refresh)
        self.refresh()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.refresh()

    def hideEvent(self, event: QHideEvent) -> None:
        """Do nothing more."""
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
        parts = [] if run is None else self._run_times(run)
        self.times.setText(" · ".join(parts))
        self.times.setVisible(bool(parts))
        remarks = self._remarks()
        self.remarks.setText(remarks)
        self.remarks.setVisible(bool(remarks))

    def _remarks(self) -> str:
        """What the run says besides, as far as the coder may know it."""
        try:
            run = visible_run(self.document)
        except ForcelabError as error:
            return str(error)
        return "" if run is None else "\n".join(run.remarks)

    def _run_times(self, run: RunResult) -> list[str]:
        """Run times of the parts of an evaluation."""
        names = {
            "features": "features",
            "fit": "fit",
            "predict": "predict",
            "filter": "filters",
        }
        parts = []
        for name, value in run.seconds.items():
            part = f"{names.get(name, name)} {_run_time_text(value)}"
            if name == "fit" and run.tested:
                each = _run_time_text(value / len(run.tested))
                part = f"{part} ({each} a fold)"
            parts.append(part)
        return parts


def _run_time_text(value: float) -> str:
    """A run time with two digits that count."""
    if value >= 100:
        return f"{value:.0f} s"
    return f"{value * 1000:.0f} ms" if value < 0.1 else f"{value:.2g} s"
