"""The bar above the review: what is trained, how, since when, and how far it is."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QSize, Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QHBoxLayout,
    QMenu,
    QProgressBar,
    QPushButton,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.arranging import allow, toned
from forcelab.gui.document import Document
from forcelab.gui.icons import icon
from forcelab.gui.naming import verbatim
from forcelab.gui.review.bar_texts import progress_text, run_text
from forcelab.gui.review.elided import Elided
from forcelab.gui.review.learning import Learning
from forcelab.gui.review.run_choice import RunChoice
from forcelab.gui.review.task_list import TaskList
from forcelab.gui.review.whose_line import WhoseLine
from forcelab.gui.shortcuts import keys

__all__ = ["TrainBar"]


#: Pixels left and right of the row.
EDGE = 6
#: From which width of the bar on, in pixels, more of the tasks is seen.
ROOMY = 1200


class TrainBar(QWidget):
    """One row; what has no room in it is found in the menu at its end."""

    compare_asked = Signal()

    def __init__(self, document: Document, learning: Learning) -> None:
        super().__init__()
        self.document, self.learning = document, learning
        self.setAccessibleName("Training")
        self._make()
        self._row = QHBoxLayout()
        self._row.setSpacing(6)
        self._parts: tuple[QWidget, ...] = (
            self.task,
            self.train,
            self.whose,
            self.automatic,
            self.settings,
            self.standing,
            self.progress,
            self.told,
            self.cancel,
            self.runs,
            self.compare,
        )
        for widget in (*self._parts, self.more):
            self._row.addWidget(widget)
        self._row.setStretchFactor(self.standing, 1)
        self._row.setStretchFactor(self.told, 1)
        column = QVBoxLayout(self)
        column.setContentsMargins(EDGE, 4, EDGE, 4)
        column.setSpacing(3)
        # What has no room is hidden; it must not keep the window wide.
        column.setSizeConstraint(QVBoxLayout.SizeConstraint.SetNoConstraint)
        column.addLayout(self._row)
        column.addWidget(self.trouble_row)
        learning.changed.connect(self.refresh)
        learning.runs_changed.connect(self._count_runs)
        document.listing_changed.connect(self.refresh)
        document.project_changed.connect(self.refresh)
        document.tracks_changed.connect(self._show_labels)
        keys().changed.connect(self._name_keys)
        self._name_keys()
        self._count_runs()
        self.refresh()

    # What it is made of

    def _make(self) -> None:
        """All that stands in the row."""
        self.task = TaskList(self.learning)
        self.train = QPushButton("Train")
        self.train.clicked.connect(self.learning.train)
        self.whose = WhoseLine(self.document)
        self.automatic = QCheckBox("by itself")
        self.automatic.setToolTip("Train five seconds after the last edit")
        self.automatic.setAccessibleName("Train by itself after edits")
        self.automatic.toggled.connect(self.learning.set_automatic)
        self.settings = QPushButton()
        self.settings.setToolTip("How a recogniser is trained")
        self.settings.clicked.connect(self.open_settings)
        self.standing = Elided()
        self.standing.setAccessibleName("How the recogniser stands")
        self.progress = QProgressBar()
        self.progress.setTextVisible(False)
        self.progress.setFixedWidth(110)
        self.progress.setMaximumHeight(8)
        self.progress.setAccessibleName("Progress of the training")
        self.told = Elided()
        self.told.setAccessibleName("What the training does")
        self.cancel = QPushButton("Cancel")
        self.cancel.setAccessibleName("Cancel the training")
        self.cancel.clicked.connect(self.learning.cancel)
        self.runs = RunChoice(self.document, self.learning)
        self.compare = QPushButton("Compare…")
        self.compare.setAccessibleName("Compare two runs")
        self.compare.clicked.connect(self.compare_asked)
        self.more = QToolButton()
        self.more.setIcon(icon("more"))
        self.more.setToolTip("More")
        self.more.setAccessibleName("More about training")
        self.more.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self._menu = QMenu(self)
        self._menu.aboutToShow.connect(self._fill_menu)
        self.more.setMenu(self._menu)
        for button in (self.train, self.settings, self.cancel, self.compare):
            button.setAutoDefault(False)
        # Each goes as the other comes; a click leaves the keyboard where it is.
        self.train.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.cancel.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._make_trouble()

    def _make_trouble(self) -> None:
        """The row in which a refusal stands."""
        self.trouble = toned("trouble")
        self.trouble.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.dismiss = QToolButton()
        self.dismiss.setIcon(icon("cross"))
        self.dismiss.setToolTip("Dismiss")
        self.dismiss.setAccessibleName("Dismiss this message")
        self.dismiss.clicked.connect(self.learning.dismiss)
        self.trouble_row = QWidget()
        row = QHBoxLayout(self.trouble_row)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self.trouble, 1)
        row.addWidget(self.dismiss, 0, Qt.AlignmentFlag.AlignTop)

    # Showing

    def sizeHint(self) -> QSize:
        """Wide, as high as its rows."""
        return QSize(900, super().sizeHint().height())

    def minimumSizeHint(self) -> QSize:
        """What has no room goes into the menu."""
        return QSize(360, super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show what has room."""
        super().resizeEvent(event)
        self._fit()

    def changeEvent(self, event: QEvent) -> None:
        """A larger font takes more room."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange and hasattr(self, "trouble_row"):
            self._fit()

    def refresh(self) -> None:
        """Show how it stands."""
        learning = self.learning
        now = QApplication.focusWidget()
        held = now is not None and self.isAncestorOf(now)
        self.task.refresh()
        self.automatic.blockSignals(True)
        self.automatic.setChecked(learning.automatic)
        self.automatic.blockSignals(False)
        allow(self.train, self._obstacle(training=learning.training))
        self._show_labels()
        self._show_preset()
        self._show_progress()
        self.trouble.setText(learning.trouble)
        self.trouble_row.setVisible(bool(learning.trouble))
        self._fit()
        if held and QApplication.focusWidget() is not now:  # which is hidden from now on
            (self.cancel if learning.training else self.train).setFocus()

    def _obstacle(self, *, training: bool = False) -> str:
        """Why nothing can be trained now; empty where it can."""
        if training:
            return "A training goes on; wait for it or cancel it."
        none = "There is nothing to train on yet; import demonstrations and label them."
        return "" if self.learning.ready else self.learning.trouble or none

    def _show_labels(self) -> None:
        """Name the coder whose labels are trained on, among several, and what was trained on."""
        learning = self.learning
        before = self.whose.text, self.standing.text
        self.whose.show_coder(learning.whose if learning.ready else None)
        stands = learning.stands
        self.standing.set_text(*stands)
        if (self.whose.text, self.standing.text) != before:
            self._name_keys()
            self._fit()

    def _show_preset(self) -> None:
        """Print what it is trained with on the button that changes it."""
        name = "Settings…"
        if self.learning.ready:
            preset, changed = self.learning.called
            told = "Settings: {0}, changed…" if changed else "Settings: {0}…"
            name = told.format(preset)
        self.settings.setText(name)
        self.settings.setAccessibleName(name)
        allow(self.settings, self._obstacle())

    def _show_progress(self) -> None:
        """Show how far the training is."""
        step, training = self.learning.step, self.learning.training
        self.progress.setRange(0, 0 if step is None else max(step.total, 1))
        if step is not None:
            self.progress.setValue(min(step.done, step.total))
        if not training:
            self.told.set_text("")
        elif step is None:
            self.told.set_text("starting")
        else:
            self.told.set_text(progress_text(step), progress_text(step, short=True))

    def _fit(self) -> None:
        """Hide what has no room, the least needed first; how it stands is always seen."""
        training = self.learning.training
        self.task.fit(roomy=self.width() >= ROOMY)
        texts = [self.standing, self.told] if training else [self.standing]
        needed: list[QWidget] = [self.task]
        needed += [self.progress, self.cancel] if training else [self.train]
        optional: list[QWidget] = [self.runs]
        if not training:
            optional = [self.settings, self.runs, self.automatic, self.compare]
            if self.whose.text:
                optional.insert(0, self.whose)
        gap = self._row.spacing()
        room = self.width() - 2 * EDGE - sum(_wide(widget) + gap for widget in needed)
        room -= sum(text.short_width + gap for text in texts)
        whole = sum(_wide(widget) + gap for widget in optional)
        if whole > room:
            room -= _wide(self.more) + gap
        shown = set[QWidget]()
        for widget in optional:
            wide = _wide(widget) + gap
            if wide <= room:
                shown.add(widget)
                room -= wide
            else:
                break  # what matters less does not overtake
        for widget in self._parts:
            widget.setVisible(widget in needed or widget in texts or widget in shown)
        self.more.setVisible(len(shown) < len(optional))

    def _fill_menu(self) -> None:
        """Offer what is not in the row."""
        self._menu.clear()
        if self.automatic.isHidden():
            action = self._menu.addAction("Train by itself after edits")
            action.setCheckable(True)
            action.setChecked(self.learning.automatic)
            action.toggled.connect(self.learning.set_automatic)
        if self.settings.isHidden():
            self._menu.addAction("Settings…", self.open_settings)
        if self.runs.isHidden() and self.learning.runs:
            runs = self._menu.addMenu("Review another run")
            for kept in self.learning.runs:
                shown = runs.addAction(verbatim(run_text(kept)))
                shown.triggered.connect(
                    lambda _checked=False, number=kept.number: self.learning.show_run(number)
                )
        if self.compare.isHidden():
            self._menu.addAction("Compare two runs…", self.compare_asked.emit)

    def _count_runs(self) -> None:
        """Two runs can be compared, one cannot."""
        few = "Train a second time, with other settings or labels, and compare then."
        allow(self.compare, "" if len(self.learning.runs) > 1 else few)

    def _name_keys(self) -> None:
        """Say the key where one looks for it, and whose labels are meant."""
        key, whose = keys().shown("train"), self.whose.text
        text = "Train on the labels as they are now"
        text = f"{text}. {whose}" if whose else text
        self.train.setToolTip(f"{text} ({key})" if key else text)
        self.train.setAccessibleName(text)

    def open_settings(self) -> None:
        """Let the coder choose how recognisers are trained."""
        learning = self.learning
        if not learning.ready:
            return
        from forcelab.gui.review.settings_dialog import SettingsDialog  # loads much
        from forcelab.gui.review.settings_facts import facts_of

        facts = facts_of(learning.document, learning.choice)
        dialog = SettingsDialog(learning.settings, facts, self.window())

        def take() -> None:
            if dialog.chosen is not None:
                learning.set_settings(dialog.chosen)

        dialog.accepted.connect(take)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()


def _wide(widget: QWidget) -> int:
    """The pixels that a widget needs in the row."""
    return max(widget.minimumWidth(), widget.sizeHint().width())
