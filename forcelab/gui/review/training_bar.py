"""The bar above the review: what is trained, how, since when, and how far it is."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QSize, Qt, Signal
from PySide6.QtGui import QContextMenuEvent, QResizeEvent
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QHBoxLayout,
    QMenu,
    QProgressBar,
    QPushButton,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.icons import icon
from forcelab.gui.layout import set_enabled_with_reason, set_tone
from forcelab.gui.review.task_choice import TaskComboBox
from forcelab.gui.review.trainer import Trainer
from forcelab.gui.review.training_backend import run_text, training_progress_text
from forcelab.gui.shortcuts import keys
from forcelab.gui.text import escape_ampersands
from forcelab.gui.widgets import ElidedComboBox, ElidedLabel
from forcelab.labels import is_model

#: Pixels of the longest name that is written out; the tip has all of it.
WIDEST_AUTHOR = 180


class AuthorLabel(ElidedLabel):
    """Names the coder whose labels are trained on, where it might be another."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self._document = document
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Preferred)
        self.setAccessibleName("Whose labels are trained on")

    def show_coder(self, whose: str | None) -> None:
        """Name a coder; nothing where nobody else has labelled."""
        document = self._document
        listed = (name for info in document.infos for name in info.labelled)
        # The list does not tell yet of whoever has just begun to label.
        people = {name for name in (*listed, *document.other_tracks) if not is_model(name)}
        several = whose is not None and bool({*people, document.author} - {whose})
        self.set_text(f"Labels of {whose}" if several else "")

    def sizeHint(self) -> QSize:
        """The text, or the beginning of a long one."""
        return QSize(min(self.long_width, WIDEST_AUTHOR), super().sizeHint().height())

    def minimumSizeHint(self) -> QSize:
        """All of what is hinted, so that no neighbour cuts it."""
        return self.sizeHint()


#: Characters of a run that are always seen.
RUN_CHARACTERS = 24


class RunComboBox(ElidedComboBox):
    """The runs, the latest first."""

    def __init__(self, document: Document, learning: Trainer) -> None:
        super().__init__()
        self.document, self.learning = document, learning
        self._name = "Which run is reviewed"
        self.set_name(self._name)
        self.setMinimumContentsLength(RUN_CHARACTERS)
        self.activated.connect(self._chosen)
        learning.runs_changed.connect(self.refresh)
        document.review.run_changed.connect(self._show_reviewed)
        self.refresh()

    def refresh(self) -> None:
        """List the runs that there are."""
        self.clear()
        for kept in self.learning.runs:
            self.addItem(run_text(kept), kept.number)
        self.setEnabled(bool(self.learning.runs))
        self.setPlaceholderText("no run yet")
        texts = map(run_text, self.learning.runs)
        widest = max(map(self.fontMetrics().horizontalAdvance, texts), default=0)
        self.view().setMinimumWidth(widest + 2 * self.fontMetrics().height())
        self._show_reviewed()

    def _show_reviewed(self) -> None:
        """Show which run is reviewed."""
        outcome = self.document.review.run
        self.setCurrentIndex(-1 if outcome is None else self.findData(outcome.number))
        how = "A right click removes it." if outcome is not None else ""
        self.setToolTip("\n".join(filter(None, (self._name, self.currentText(), how))))

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """What can be done with the run that is reviewed."""
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        action = menu.addAction("Remove this run…", self.ask_removal)
        project = self.document.project
        action.setEnabled(
            self.currentIndex() >= 0 and project is not None and not project.read_only
        )
        menu.popup(event.globalPos())

    def ask_removal(self) -> None:
        """Ask whether the run that is reviewed is to be removed, and say what goes with it."""
        from forcelab.gui.removal_dialog import removal_of_run

        project, number = self.document.project, self.currentData()
        if project is None or number is None:
            return
        try:
            uses = project.runs.uses(number)
        except ForcelabError as error:
            self.document.show_message(str(error), True)
            return
        if not uses:
            self.learning.list_runs()  # somebody else was faster
            return
        dialog = removal_of_run(self.currentText(), uses[0], self.window())
        dialog.accepted.connect(lambda: self.learning.remove_run(number))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()

    def _chosen(self, index: int) -> None:
        """Review another run."""
        number = self.itemData(index)
        if number is not None:
            self.learning.show_run(int(number))
        self._show_reviewed()  # until it is there, and where it cannot be read


#: Pixels left and right of the row.
BAR_MARGIN = 6
#: From which width of the bar on, in pixels, more of the tasks is seen.
ROOMY_WIDTH = 1200


class TrainingBar(QWidget):
    """One row; what has no room in it is found in the menu at its end."""

    compare_requested = Signal()

    def __init__(self, document: Document, learning: Trainer) -> None:
        super().__init__()
        self.document, self.learning = document, learning
        self.setAccessibleName("Training")
        self._build_row()
        self._row = QHBoxLayout()
        self._row.setSpacing(6)
        self._parts: tuple[QWidget, ...] = (
            self.task,
            self.train,
            self.author,
            self.automatic,
            self.settings,
            self.standing,
            self.progress,
            self.told,
            self.cancel,
            self.runs,
            self.compare,
        )
        for widget in (*self._parts, self.overflow_button):
            self._row.addWidget(widget)
        self._row.setStretchFactor(self.standing, 1)
        self._row.setStretchFactor(self.told, 1)
        column = QVBoxLayout(self)
        column.setContentsMargins(BAR_MARGIN, 4, BAR_MARGIN, 4)
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

    def _build_row(self) -> None:
        """All that stands in the row."""
        self.task = TaskComboBox(self.learning)
        self.train = QPushButton("Train")
        self.train.clicked.connect(self.learning.train)
        self.author = AuthorLabel(self.document)
        self.automatic = QCheckBox("Train automatically")
        self.automatic.setToolTip("Train five seconds after the last edit")
        self.automatic.setAccessibleName("Train automatically after edits")
        self.automatic.toggled.connect(self.learning.set_automatic)
        self.settings = QPushButton()
        self.settings.setToolTip("How a recogniser is trained")
        self.settings.clicked.connect(self.open_settings)
        self.standing = ElidedLabel()
        self.standing.setAccessibleName("How the recogniser stands")
        self.progress = QProgressBar()
        self.progress.setTextVisible(False)
        self.progress.setFixedWidth(110)
        self.progress.setMaximumHeight(8)
        self.progress.setAccessibleName("Progress of the training")
        self.told = ElidedLabel()
        self.told.setAccessibleName("What the training does")
        self.cancel = QPushButton("Cancel")
        self.cancel.setAccessibleName("Cancel the training")
        self.cancel.clicked.connect(self.learning.cancel)
        self.runs = RunComboBox(self.document, self.learning)
        self.compare = QPushButton("Compare…")
        self.compare.setAccessibleName("Compare two runs")
        self.compare.clicked.connect(self.compare_requested)
        self.overflow_button = QToolButton()
        self.overflow_button.setIcon(icon("more"))
        self.overflow_button.setToolTip("More")
        self.overflow_button.setAccessibleName("More about training")
        self.overflow_button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self._menu = QMenu(self)
        self._menu.aboutToShow.connect(self._fill_menu)
        self.overflow_button.setMenu(self._menu)
        for button in (self.train, self.settings, self.cancel, self.compare):
            button.setAutoDefault(False)
        # Each goes as the other comes; a click leaves the keyboard where it is.
        self.train.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.cancel.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._build_trouble_row()

    def _build_trouble_row(self) -> None:
        """The row in which a refusal stands."""
        self.trouble = set_tone("trouble")
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
        set_enabled_with_reason(self.train, self._why_not_trainable(training=learning.training))
        self._show_labels()
        self._show_preset()
        self._show_progress()
        self.trouble.setText(learning.trouble)
        self.trouble_row.setVisible(bool(learning.trouble))
        self._fit()
        if held and QApplication.focusWidget() is not now:  # which is hidden from now on
            (self.cancel if learning.training else self.train).setFocus()

    def _why_not_trainable(self, *, training: bool = False) -> str:
        """Why nothing can be trained now; empty where it can."""
        if training:
            return "A training goes on; wait for it or cancel it."
        none = "There is nothing to train on yet; import demonstrations and label them."
        return "" if self.learning.ready else self.learning.trouble or none

    def _show_labels(self) -> None:
        """Name the coder whose labels are trained on, among several, and what was trained on."""
        learning = self.learning
        before = self.author.text, self.standing.text
        self.author.show_coder(learning.author if learning.ready else None)
        stands = learning.freshness
        self.standing.set_text(*stands)
        if (self.author.text, self.standing.text) != before:
            self._name_keys()
            self._fit()

    def _show_preset(self) -> None:
        """Print what it is trained with on the button that changes it."""
        name = "Settings…"
        if self.learning.ready:
            preset, changed = self.learning.preset_used
            told = "Settings: {0}, changed…" if changed else "Settings: {0}…"
            name = told.format(preset)
        self.settings.setText(name)
        self.settings.setAccessibleName(name)
        set_enabled_with_reason(self.settings, self._why_not_trainable())

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
            self.told.set_text(
                training_progress_text(step), training_progress_text(step, short=True)
            )

    def _fit(self) -> None:
        """Hide what has no room, the least needed first; how it stands is always seen."""
        training = self.learning.training
        self.task.fit(roomy=self.width() >= ROOMY_WIDTH)
        texts = [self.standing, self.told] if training else [self.standing]
        needed: list[QWidget] = [self.task]
        needed += [self.progress, self.cancel] if training else [self.train]
        optional: list[QWidget] = [self.runs]
        if not training:
            optional = [self.settings, self.runs, self.automatic, self.compare]
            if self.author.text:
                optional.insert(0, self.author)
        gap = self._row.spacing()
        room = self.width() - 2 * BAR_MARGIN - sum(_width_needed(widget) + gap for widget in needed)
        room -= sum(text.short_width + gap for text in texts)
        whole = sum(_width_needed(widget) + gap for widget in optional)
        if whole > room:
            room -= _width_needed(self.overflow_button) + gap
        shown = set[QWidget]()
        for widget in optional:
            wide = _width_needed(widget) + gap
            if wide <= room:
                shown.add(widget)
                room -= wide
            else:
                break  # what matters less does not overtake
        for widget in self._parts:
            widget.setVisible(widget in needed or widget in texts or widget in shown)
        self.overflow_button.setVisible(len(shown) < len(optional))

    def _fill_menu(self) -> None:
        """Offer what is not in the row."""
        self._menu.clear()
        if self.automatic.isHidden():
            action = self._menu.addAction("Train automatically after edits")
            action.setCheckable(True)
            action.setChecked(self.learning.automatic)
            action.toggled.connect(self.learning.set_automatic)
        if self.settings.isHidden():
            self._menu.addAction("Settings…", self.open_settings)
        if self.runs.isHidden() and self.learning.runs:
            runs = self._menu.addMenu("Review another run")
            for kept in self.learning.runs:
                shown = runs.addAction(escape_ampersands(run_text(kept)))
                shown.triggered.connect(
                    lambda _checked=False, number=kept.number: self.learning.show_run(number)
                )
        if self.compare.isHidden():
            self._menu.addAction("Compare two runs…", self.compare_requested.emit)

    def _count_runs(self) -> None:
        """Two runs can be compared, one cannot."""
        few = "Train a second time, with other settings or labels, and compare then."
        set_enabled_with_reason(self.compare, "" if len(self.learning.runs) > 1 else few)

    def _name_keys(self) -> None:
        """Say the key where one looks for it, and whose labels are meant."""
        key, whose = keys().shown("train"), self.author.text
        text = "Train on the labels as they are now"
        text = f"{text}. {whose}" if whose else text
        self.train.setToolTip(f"{text} ({key})" if key else text)
        self.train.setAccessibleName(text)

    def open_settings(self) -> None:
        """Let the coder choose how recognisers are trained."""
        learning = self.learning
        if not learning.ready:
            return
        from forcelab.gui.review.settings_dialog import (
            SettingsDialog,  # loads much
            training_facts,
        )

        facts = training_facts(learning.document, learning.choice)
        dialog = SettingsDialog(learning.settings, facts, self.window())

        def take() -> None:
            if dialog.chosen is not None:
                learning.set_settings(dialog.chosen)

        dialog.accepted.connect(take)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()


def _width_needed(widget: QWidget) -> int:
    """The pixels that a widget needs in the row."""
    return max(widget.minimumWidth(), widget.sizeHint().width())
