"""Live recognition: the recogniser and latency chosen, the current action, the measured latency."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QCheckBox, QLabel, QSizePolicy, QSpinBox, QVBoxLayout, QWidget

from forcelab.gui.capture.controller import CaptureController
from forcelab.gui.capture.recognition_controller import (
    LATENCIES,
    STREAM,
    LoadedRecogniser,
    RecogniserSelection,
    RecognitionController,
    can_send,
)
from forcelab.gui.figures import text
from forcelab.gui.file_dialogs import ask_file
from forcelab.gui.kit import text_size
from forcelab.gui.label.swatches import paint_swatch, style_of
from forcelab.gui.layout import fill_layout, set_enabled_with_reason
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import CalmLabel, ElidedComboBox

if TYPE_CHECKING:
    from forcelab.live.recognition import LatencyBudget


#: Height of a bar's row, width of a cell at least, and rows at least and at most, in pixels.
ROW, CELL, FEWEST, MOST = 17, 128, 3, 6
#: Width of a cell at most, in pixels: a longer bar tells no more.
WIDEST = 240
#: Probability above which an action is likelier than all others together.
LIKELY = 0.5
#: Width of the current action's column, in pixels.
LARGE = 190


class CurrentAction(QWidget):
    """The action of the latest label, and a bar for each that the recogniser knows."""

    def __init__(self, controller: CaptureController) -> None:
        super().__init__()
        self._controller = controller
        self._accessible_action = ""
        self.setToolTip(
            "Large: the action of the latest label, as it is kept. Bars: the probability of each "
            "action before the filters or the decoder decide."
        )
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.refresh()

    def sizeHint(self) -> QSize:
        """As high as the bars need, within bounds."""
        loaded = self._controller.recognition.loaded
        count = 0 if loaded is None else len(loaded.recogniser.actions)
        row, cell, large = (round(text_size.pixels(length)) for length in (ROW, CELL, LARGE))
        columns = max(1, (max(self.width(), 480) - large) // cell)
        rows = min(max(-(-count // columns), FEWEST), MOST)
        return QSize(480, rows * row + 2)

    def minimumSizeHint(self) -> QSize:
        """Narrow, but as high as it is."""
        return QSize(240, self.sizeHint().height())

    def refresh(self) -> None:
        """Another recogniser, other actions."""
        self.updateGeometry()
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the action and the bars."""
        with QPainter(self) as painter:
            snapshot = self._controller.recognition.track.snapshot
            action = "" if snapshot is None or not self._controller.connected else snapshot.action
            self._set_accessible_text(action)
            loaded = self._controller.recognition.loaded
            probabilities = snapshot.probabilities if snapshot is not None else ()
            self._paint_action(painter, action, self.decision_note(action, probabilities))
            if loaded is not None:
                self._paint_bars(painter, loaded.recogniser.actions, probabilities)

    def decision_note(self, action: str, probabilities: tuple[float, ...]) -> str:
        """Why the action of the latest label is not the likeliest one; empty where it is.

        `action` is empty where the label is unlabelled; `probabilities` are those of the
        recogniser's actions, as far as it gives them.
        """
        loaded = self._controller.recognition.loaded
        if loaded is None or max(probabilities, default=0.0) <= LIKELY:
            return ""
        if loaded.recogniser.actions[probabilities.index(max(probabilities))] == action:
            return ""
        if loaded.recogniser.settings.decodes:
            return "as the decoder decides"
        return "as the filters decide"

    def _set_accessible_text(self, action: str) -> None:
        if action != self._accessible_action or not self.accessibleName():
            self._accessible_action = action
            self.setAccessibleName(f"Current action: {action or 'unlabelled'}")

    def _paint_action(self, painter: QPainter, action: str, explained: str) -> None:
        side, right = text_size.pixels(30), text_size.pixels(LARGE) - 16
        swatch = QRectF(0, (self.height() - side) / 2, side, side)
        theme, face = colours(), text_size.font(22.0, bold=True)
        if action:
            paint_swatch(painter, swatch, style_of(self._controller.display_vocabulary, action))
        else:
            painter.setPen(QColor(theme.frame))
            painter.setBrush(QColor(theme.unlabelled))
            painter.drawRect(swatch.adjusted(0, 0, -1, -1))
        left, muted = swatch.right() + 10, QColor(theme.muted)
        label = text.elided(action, face, right - left) if action else "unlabelled"
        ink = QColor(theme.text) if action else muted
        face = face if action else text_size.font(14.0)
        text.draw_text(painter, left, swatch.center().y(), label, face=face, ink=ink)
        face = text_size.font(10.0)
        label = text.elided(explained, face, right - left)
        text.draw_text(painter, left, swatch.bottom() + 4, label, face=face, ink=muted)

    def _paint_bars(
        self, painter: QPainter, actions: tuple[str, ...], probabilities: tuple[float, ...]
    ) -> None:
        """Name, bar and number of each action, in columns."""
        theme, vocabulary = colours(), self._controller.display_vocabulary
        row, cell, large = (round(text_size.pixels(length)) for length in (ROW, CELL, LARGE))
        rows = max(1, (self.height() - 2) // row)
        columns = min(max(1, (self.width() - large) // cell), -(-len(actions) // rows))
        rows = min(rows, -(-len(actions) // columns))  # all columns of like height
        width = min((self.width() - large) / columns, text_size.pixels(WIDEST))
        begin = (self.height() - rows * row) / 2
        face = text_size.font(10.0)
        number = text.width("100 %", face) + 14
        named = min(text.widest(actions, face) + 8, 0.55 * (width - number))
        for i, action in enumerate(actions[: rows * columns]):
            left, top = large + (i // rows) * width, begin + (i % rows) * row
            share = probabilities[i] if i < len(probabilities) else 0.0
            middle = top + row / 2
            name = text.elided(action, face, named - 4)
            text.draw_text(painter, left, middle, name, face=face, ink=QColor(theme.text))
            bar = QRectF(left + named, top + 4, width - named - number - 4, row - 8)
            painter.fillRect(bar, QColor(theme.grid))
            style = style_of(vocabulary, action)
            full = QRectF(bar.left(), bar.top(), bar.width() * share, bar.height())
            painter.fillRect(full, style.colour)
            painter.setPen(QColor(theme.frame))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(bar)
            if probabilities:
                label = f"{100 * share:.0f} %"
                text.draw_text(
                    painter, bar.right() + 5, middle, label, face=face, ink=QColor(theme.muted)
                )


#: Milliseconds by which the arrows change the latency.
STEP = 50
#: The role of a row's description.
TIP = Qt.ItemDataRole.ToolTipRole


class RecogniserChoice:
    """Fields for a form; disabled while something is recorded."""

    def __init__(self, controller: CaptureController, parent: QWidget) -> None:
        self._controller, self._parent = controller, parent
        self._offered: tuple[RecogniserSelection, ...] = ()
        self.which = ElidedComboBox()
        self.which.setAccessibleName("Recogniser for live labels")
        self.which.activated.connect(self._chosen)
        self.latency = QSpinBox()
        self.latency.setRange(LATENCIES[0], LATENCIES[-1])
        self.latency.setSingleStep(STEP)
        self.latency.setSuffix(" ms")
        self.latency.setValue(controller.recognition.latency)
        self.latency.setKeyboardTracking(False)
        self.latency.setAccessibleName("Latency of the labels in milliseconds")
        self.latency.setToolTip(
            "How long a label waits for what follows its force: the longer, the surer"
        )
        self.latency.valueChanged.connect(controller.recognition.set_latency)
        self.send = QCheckBox("Send labels to LSL")
        self.send.setChecked(controller.recognition.sending)
        self.send.setToolTip(
            f"Other programs get the action as the stream '{STREAM}' of the Lab Streaming Layer, "
            f"and all probabilities as '{STREAM} probabilities'"
        )
        self.send.toggled.connect(controller.recognition.set_sending)
        self.nothing = QLabel(
            "No recogniser is trained in this project; train one in Review, or choose a file.",
            parent,  # alone it would be a window for a moment
        )
        self.nothing.setWordWrap(True)
        controller.changed.connect(self._enable)
        controller.recognition.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Offer what is available now."""
        recognition = self._controller.recognition
        self._offered = recognition.available()
        self.which.clear()
        self.which.addItem("none")
        for choice in self._offered:
            self.which.addItem(choice.name)
            self.which.setItemData(self.which.count() - 1, choice.about or str(choice.path), TIP)
        self.which.addItem("From a file…")
        chosen = recognition.selection
        paths = [selection.path for selection in self._offered]
        self.which.setCurrentIndex(0 if chosen is None else 1 + paths.index(chosen.path))
        self.which.setToolTip(self.which.currentData(TIP) or "")
        self._enable()

    def _enable(self) -> None:
        """The recogniser of a recording stays the same from its start to its end."""
        obstacle = self._controller.obstacle_to_set_up
        has_project = self._controller.document.project is not None
        closed = "" if has_project else "Open or make a project first; its recognisers are listed."
        set_enabled_with_reason(self.which, obstacle or closed)
        if not obstacle and self._controller.recognition.selection is None:
            obstacle = "Choose a recogniser first."
        set_enabled_with_reason(self.latency, obstacle)
        lacking = "" if can_send() else "Install it first: pip install 'forcelab[lsl]'."
        set_enabled_with_reason(self.send, lacking or obstacle)
        self.nothing.setVisible(has_project and not self._offered)

    def _chosen(self, row: int) -> None:
        """Take what was chosen in the list."""
        if 1 <= row <= len(self._offered):
            self._controller.recognition.select(self._offered[row - 1])
        elif row == 0:
            self._controller.recognition.select(None)
        else:
            self._ask()
        self.refresh()

    def _ask(self) -> None:
        """Let a file be chosen."""
        path = ask_file(self._parent, "Recogniser", "recogniser", "Recognisers (*.skops)")
        if path is not None:
            self._controller.recognition.select(RecogniserSelection(path.stem, path))


#: Seconds between two texts, and early scales that are named one by one.
OFTEN, NAMED = 0.5, 4
#: Expected error, as a share, below which a scale counts as known.
LEAST = 0.005


class RecognitionPanel(QWidget):
    """Shown while a recogniser is chosen."""

    def __init__(self, controller: CaptureController) -> None:
        super().__init__()
        self._controller = controller
        self._measured_shown_at = -math.inf
        self.setAccessibleName("Live recognition")
        self.current_action = CurrentAction(controller)
        self.budget_label, self.measurements = CalmLabel(), CalmLabel()
        parts = self.current_action, self.measurements, self.budget_label
        fill_layout(QVBoxLayout(self), *parts, margins=(8, 4, 8, 2), spacing=3)
        controller.ticked.connect(self._ticked)
        controller.changed.connect(self.refresh)
        controller.recognition.changed.connect(self.refresh)
        themes().changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        recognition = self._controller.recognition
        self.setVisible(recognition.selection is not None)
        if recognition.selection is None:
            return
        loaded, trouble = recognition.loaded, recognition.problem
        if trouble:
            self.budget_label.say(trouble, colours().trouble)
        elif loaded is None:
            self.budget_label.say("Reading the recogniser…", colours().muted)
        else:
            self.budget_label.say(latency_budget_text(loaded), colours().muted)
        self._measure()
        self.current_action.refresh()

    def _ticked(self) -> None:
        """Most frames move bars only; the text would flicker."""
        if self.isVisible():
            self.current_action.update()
            if self._controller.now - self._measured_shown_at >= OFTEN:
                self._measure()

    def _measure(self) -> None:
        controller = self._controller
        self._measured_shown_at = now = controller.now
        line = measured_text(controller.recognition, now) if controller.connected else ""
        self.measurements.say(line, colours().text)


def latency_budget_text(loaded: LoadedRecogniser) -> str:
    """What the latency means, in a sentence or two."""
    budget = loaded.budget
    if not budget.scales:
        return _window_budget_text(budget)
    # The smallest scales ring for long, but so softly that nothing is left to be said of it.
    early = [scale for scale in budget.early if scale.error >= LEAST]
    if not early:
        ms, scales = 1000 * budget.latency, budget.scales
        return f"{ms:.0f} ms are enough for all {scales} scales of the wavelets."
    ordered = sorted(early, key=lambda scale: -scale.hertz)
    named = [f"{_hertz(scale.hertz)} Hz ±{_percent(scale.error)} %" for scale in ordered]
    mark = " … " if len(named) > NAMED else ", "
    if len(named) > NAMED:
        step = (len(named) - 1) / (NAMED - 1)
        named = [named[round(i * step)] for i in range(NAMED)]
    which = f"{len(early)} of {budget.scales} scales"
    return f"{which} are estimated early, with an expected error: {mark.join(named)}."


def _window_budget_text(budget: LatencyBudget) -> str:
    """The same of a recogniser that looks at a stream in windows."""
    sentence = (
        f"Windows see {1000 * budget.ahead:.0f} ms ahead, the decoder waits for "
        f"{1000 * budget.filters:.0f} ms more."
    )
    if budget.loss < 1.0:
        return sentence
    cost = f"So short a latency took {budget.loss:.0f} points of accuracy on real recordings."
    return f"{sentence} {cost}"


def measured_text(recognition: RecognitionController, now: float) -> str:
    """What live recognition costs, and how late its labels are on the screen."""
    snapshot, delays = recognition.track.snapshot, recognition.delays
    if snapshot is None or math.isnan(snapshot.until):
        if recognition.loaded is None or recognition.problem:
            return ""
        return "Waiting for samples…"
    parts = []
    if delays:
        middle, most = np.percentile(delays, [50, 99])
        parts.append(
            f"On the screen {1000 * middle:.0f} ms after the force (99 %: {1000 * most:.0f} ms)"
        )
    parts.append(f"now {max(0.0, 1000 * (now - snapshot.until)):.0f} ms behind")
    parts.append(f"{100 * snapshot.cost:.0f} % of a core")
    return " · ".join(parts)


def _hertz(value: float) -> str:
    return f"{value:.0f}" if value >= 10 else f"{value:.1f}"


def _percent(share: float) -> str:
    value = 100 * share
    return f"{value:.0f}" if value >= 1 else f"{value:.1f}"
