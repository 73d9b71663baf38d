"""The bar above the review: what is trained, how, since when, and how far it is."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from itertools import accumulate

from PySide6.QtCore import QEvent, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QContextMenuEvent, QResizeEvent
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QHBoxLayout,
    QMenu,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.icons import icon
from forcelab.gui.layout import (
    SlimProgressBar,
    fill_layout,
    push_button,
    set_enabled_with_reason,
    toned_label,
    tool_button,
)
from forcelab.gui.review.task_choice import TaskComboBox
from forcelab.gui.review.trainer import RUNNING, Trainer
from forcelab.gui.review.training_backend import run_text, training_progress_text
from forcelab.gui.shortcuts import keys
from forcelab.gui.text import escape_ampersands
from forcelab.gui.widgets import ElidedComboBox, ElidedLabel
from forcelab.labels import is_model

#: Pixels of the longest name that is written out; the tip has all of it.
WIDEST_AUTHOR = 180


class AuthorLabel(ElidedLabel):
    """Names the coder whose labels are trained on, where there are several."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self._document = document
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Preferred)
        self.setAccessibleName("Coder of the training labels")

    def show_coder(self, coder: str | None) -> None:
        """Name a coder; nothing where no other coder has labelled."""
        document = self._document
        listed = (name for info in document.infos for name in info.labelled)
        # The list does not have coders yet who have just begun to label.
        people = {name for name in (*listed, *document.other_tracks) if not is_model(name)}
        several = coder is not None and bool({*people, document.author} - {coder})
        self.set_text(f"Labels by {coder}" if several else "")

    def sizeHint(self) -> QSize:
        """The text, or the beginning of a long one."""
        return QSize(min(self.long_width, WIDEST_AUTHOR), super().sizeHint().height())

    def minimumSizeHint(self) -> QSize:
        """All of the hint, so that no neighbour cuts it."""
        return self.sizeHint()


class AlsoComboBox(ElidedComboBox):
    """The other coders whose labels can be added to the coder's own; the merge map is below."""

    merge_map_requested = Signal()

    def __init__(self, trainer: Trainer) -> None:
        super().__init__()
        self._trainer = trainer
        self.setAccessibleName("Also learn from")
        self.setMinimumContentsLength(ALSO_CHARACTERS)
        self.activated.connect(self._chosen)

    def refresh(self) -> None:
        """List the coders who labelled what the coder has not."""
        coders = self._trainer.other_coders
        self.clear()
        for text, name in also_texts(coders):
            self.addItem(text, name)
        self.addItem("Merge map…", self)
        self.widen_list()
        self._show_choice()

    def _show_choice(self) -> None:
        self.setCurrentIndex(self.findData(self._trainer.also_from))
        self.setToolTip(f"{self.currentText()}\n{ALSO_TIP}")

    def _chosen(self, index: int) -> None:
        if self.itemData(index) is self:
            self.merge_map_requested.emit()
        else:
            self._trainer.set_also_from(self.itemData(index))
        self._show_choice()


#: Characters of the choice that are always seen.
ALSO_CHARACTERS = 24
ALSO_TIP = (
    "Where you have labelled nothing, another coder's labels can be learnt from. They are never "
    "tested; each run says what your own alone would do."
)


def also_texts(coders: Mapping[str, int]) -> list[tuple[str, str | None]]:
    """The choices of other coders, each with the name that it stands for."""
    texts: list[tuple[str, str | None]] = [("Also learn from: no other coder", None)]
    return texts + [(f"Also learn from: {name} ({coders[name]})", name) for name in sorted(coders)]


#: Characters of a run that are always seen.
RUN_CHARACTERS = 24


class RunComboBox(ElidedComboBox):
    """The runs, the latest first."""

    def __init__(self, document: Document, trainer: Trainer) -> None:
        super().__init__()
        self.document, self.trainer = document, trainer
        self._name = "Which run is reviewed"
        self.set_name(self._name)
        self.setMinimumContentsLength(RUN_CHARACTERS)
        self.activated.connect(self._chosen)
        trainer.runs_changed.connect(self.refresh)
        document.review.run_changed.connect(self._show_reviewed)
        self.refresh()

    def refresh(self) -> None:
        self.clear()
        for run in self.trainer.runs:
            self.addItem(run_text(run), run.id)
        set_enabled_with_reason(self, "" if self.trainer.runs else "Nothing was trained yet.")
        self.setPlaceholderText("no run yet")
        self.widen_list()
        self._show_reviewed()

    def _show_reviewed(self) -> None:
        run = self.document.review.run
        self.setCurrentIndex(-1 if run is None else self.findData(run.number))
        hint = "A right click removes it." if run is not None else ""
        self.setToolTip("\n".join(filter(None, (self._name, self.currentText(), hint))))

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        action = menu.addAction("Remove this run…", self.ask_removal)
        project = self.document.project
        reason = "" if self.currentIndex() >= 0 else "No run is reviewed."
        if project is None or project.read_only:
            reason = "The project can only be read."
        set_enabled_with_reason(action, reason)
        menu.popup(event.globalPos())

    def ask_removal(self) -> None:
        """Ask whether to remove the reviewed run, and say what goes with it."""
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
            self.trainer.list_runs()  # another window was faster
            return
        dialog = removal_of_run(self.currentText(), uses[0], self.window())
        dialog.accepted.connect(lambda: self.trainer.remove_run(number))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()

    def _chosen(self, index: int) -> None:
        number = self.itemData(index)
        if number is not None:
            self.trainer.show_run(int(number))
        self._show_reviewed()  # until it is there, and where it cannot be read


#: Pixels left and right of the row.
BAR_MARGIN = 6
#: From which width of the bar on, in pixels, more of the tasks is seen.
ROOMY_WIDTH = 1200


class TrainingBar(QWidget):
    """One row; what has no room in it is found in the menu at its end."""

    def __init__(self, document: Document, trainer: Trainer) -> None:
        super().__init__()
        self.document, self.trainer = document, trainer
        self.setAccessibleName("Training")
        self._others: tuple[dict[str, int], str | None] | None = None
        self._build_row()
        self._row = QHBoxLayout()
        self._parts: tuple[QWidget, ...] = (
            self.task,
            self.train,
            self.author,
            self.also,
            self.automatic,
            self.settings,
            self.freshness,
            self.progress,
            self.step_text,
            self.cancel,
            self.runs,
            self.compare,
        )
        fill_layout(self._row, *self._parts, self.overflow_button, spacing=6)
        self._row.setStretchFactor(self.freshness, 1)
        self._row.setStretchFactor(self.step_text, 1)
        column, margins = QVBoxLayout(self), (BAR_MARGIN, 4, BAR_MARGIN, 4)
        # What has no room is hidden; it must not keep the window wide.
        column.setSizeConstraint(QVBoxLayout.SizeConstraint.SetNoConstraint)
        fill_layout(column, self._row, self.trouble_row, margins=margins, spacing=3)
        trainer.changed.connect(self.refresh)
        trainer.runs_changed.connect(self._count_runs)
        document.listing_changed.connect(self.refresh)
        document.project_changed.connect(self.refresh)
        document.tracks_changed.connect(self._show_labels)
        keys().changed.connect(self._name_keys)
        self._count_runs()
        self.refresh()

    # What it is made of

    def _build_row(self) -> None:
        self.task = TaskComboBox(self.trainer)
        self.train = push_button("Train", self.trainer.train)
        self.author = AuthorLabel(self.document)
        self.also = AlsoComboBox(self.trainer)
        self.also.merge_map_requested.connect(lambda: self.open_settings(field="merge"))
        self.automatic = QCheckBox("Train automatically")
        self.automatic.setToolTip("Train five seconds after the last edit")
        self.automatic.setAccessibleName("Train automatically after edits")
        self.automatic.toggled.connect(self.trainer.set_automatic)
        self.settings = push_button("", self.open_settings, tip="How a recogniser is trained")
        self.freshness = ElidedLabel()
        self.freshness.setAccessibleName("State of the recogniser")
        self.progress = SlimProgressBar("Progress of the training", 110)
        self.step_text = ElidedLabel()
        self.step_text.setAccessibleName("What the training does")
        self.cancel = push_button("Cancel", self.trainer.cancel, "Cancel the training")
        self.runs = RunComboBox(self.document, self.trainer)
        self.compare = push_button("Compare…", self.open_comparison, "Compare two runs")
        self.overflow_button = QToolButton(popupMode=QToolButton.ToolButtonPopupMode.InstantPopup)
        self.overflow_button.setIcon(icon("more"))
        self.overflow_button.setToolTip("More")
        self.overflow_button.setAccessibleName("More about training")
        self._menu = QMenu(self)
        self._menu.aboutToShow.connect(self._fill_menu)
        self.overflow_button.setMenu(self._menu)
        # Each goes as the other comes; a click leaves the keyboard where it is.
        self.train.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.cancel.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._build_trouble_row()

    def _build_trouble_row(self) -> None:
        self.trouble = toned_label("trouble")
        self.trouble.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        dismiss = self.trainer.dismiss
        self.dismiss = tool_button("cross", "Dismiss this message", dismiss, "Dismiss")
        self.trouble_row = QWidget()
        row = fill_layout(QHBoxLayout(self.trouble_row), (self.trouble, 1), margins=0)
        row.addWidget(self.dismiss, 0, Qt.AlignmentFlag.AlignTop)

    # Showing

    def sizeHint(self) -> QSize:
        return QSize(900, super().sizeHint().height())

    def minimumSizeHint(self) -> QSize:
        """What has no room goes into the menu."""
        return QSize(360, super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def changeEvent(self, event: QEvent) -> None:
        """A larger font takes more room."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange and hasattr(self, "trouble_row"):
            self._fit()

    def refresh(self) -> None:
        trainer = self.trainer
        now = QApplication.focusWidget()
        had_focus = now is not None and self.isAncestorOf(now)
        self.task.refresh()
        with QSignalBlocker(self.automatic):
            self.automatic.setChecked(trainer.automatic)
        set_enabled_with_reason(self.train, RUNNING if trainer.training else trainer.obstacle)
        self._show_preset()
        self._show_progress()
        self.trouble.setText(trainer.trouble)
        self.trouble_row.setVisible(bool(trainer.trouble))
        self._show_labels()
        if had_focus and QApplication.focusWidget() is not now:  # which is hidden from now on
            (self.cancel if trainer.training else self.train).setFocus()

    def _show_labels(self) -> None:
        """Name the coder whose labels are trained on, and how old the run is."""
        trainer = self.trainer
        self.author.show_coder(trainer.author if trainer.ready else None)
        others = trainer.other_coders if trainer.ready else {}
        if (others, trainer.also_from) != self._others:
            self._others = others, trainer.also_from
            self.also.refresh()
        self.freshness.set_text(*trainer.freshness)
        self._name_keys()
        self._fit()

    def _show_preset(self) -> None:
        """Name the preset on the button that changes it."""
        name = "Settings…"
        if self.trainer.ready:
            preset, changed = self.trainer.preset_used
            name = f"Settings: {preset}, changed…" if changed else f"Settings: {preset}…"
        self.settings.setText(name)
        self.settings.setAccessibleName(name)
        set_enabled_with_reason(self.settings, self.trainer.obstacle)

    def _show_progress(self) -> None:
        step, training = self.trainer.step, self.trainer.training
        self.progress.show_step(step)
        text, short = "starting" if training else "", ""
        if training and step is not None:
            text, short = training_progress_text(step), training_progress_text(step, short=True)
        self.step_text.set_text(text, short)

    def _fit(self) -> None:
        """Hide what has no room, the least needed first; progress and freshness always show."""
        training = self.trainer.training
        self.task.fit(roomy=self.width() >= ROOMY_WIDTH)
        texts = [self.freshness, self.step_text] if training else [self.freshness]
        needed: list[QWidget] = [self.task]
        needed += [self.progress, self.cancel] if training else [self.train]
        optional: list[QWidget] = [self.runs]
        if not training:
            optional = [self.settings, self.runs, self.automatic, self.compare]
            if self._others and self._others[0]:
                optional.insert(0 if self._others[1] else 1, self.also)
            if self.author.text:
                optional.insert(0, self.author)
        gap = self._row.spacing()
        room = self.width() - 2 * BAR_MARGIN - sum(_width_needed(widget) + gap for widget in needed)
        room -= sum(text.short_width + gap for text in texts)
        widths = [_width_needed(widget) + gap for widget in optional]
        if sum(widths) > room:
            room -= _width_needed(self.overflow_button) + gap
        # What matters less does not overtake.
        count = sum(reached <= room for reached in accumulate(widths))
        for widget in self._parts:
            widget.setVisible(widget in (*needed, *texts, *optional[:count]))
        self.overflow_button.setVisible(count < len(optional))

    def _fill_menu(self) -> None:
        for submenu in self._menu.findChildren(QMenu):  # which clear() would leave
            submenu.deleteLater()
        self._menu.clear()
        if self.automatic.isHidden():
            action = self._menu.addAction("Train automatically after edits")
            action.setCheckable(True)
            action.setChecked(self.trainer.automatic)
            action.toggled.connect(self.trainer.set_automatic)
        if self.settings.isHidden():
            self._menu.addAction("Settings…", self.open_settings)
        if self.also.isHidden() and (coders := self.trainer.other_coders):
            also = self._menu.addMenu("Also learn from")
            for text, name in also_texts(coders):
                entry = also.addAction(escape_ampersands(text.removeprefix("Also learn from: ")))
                entry.setCheckable(True)
                entry.setChecked(name == self.trainer.also_from)
                entry.triggered.connect(partial(self.trainer.set_also_from, name))
        if self.runs.isHidden() and self.trainer.runs:
            runs = self._menu.addMenu("Review another run")
            for run in self.trainer.runs:
                entry = runs.addAction(escape_ampersands(run_text(run)))
                entry.triggered.connect(partial(self.trainer.show_run, run.id))
        if self.compare.isHidden():
            self._menu.addAction("Compare two runs…", self.open_comparison)

    def _count_runs(self) -> None:
        few = "Train again with other settings or labels to compare two runs."
        set_enabled_with_reason(self.compare, "" if len(self.trainer.runs) > 1 else few)

    def _name_keys(self) -> None:
        """Show the key and the coder in the tip."""
        key, author = keys().shown("train"), self.author.text
        text = "Train on the labels as they are now"
        text = f"{text}. {author}" if author else text
        self.train.setToolTip(f"{text} ({key})" if key else text)
        self.train.setAccessibleName(text)

    def open_settings(self, *, field: str = "") -> None:
        """Ask for other settings, one of them first."""
        if self.trainer.ready:
            from forcelab.gui.review.settings_dialog import change_settings  # loads much

            change_settings(self.trainer, self.window(), field)

    def open_comparison(self) -> None:
        from forcelab.gui.review.comparison_dialog import ComparisonDialog

        dialog = ComparisonDialog(self.document, self.trainer.jobs, self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()


def _width_needed(widget: QWidget) -> int:
    return max(widget.minimumWidth(), widget.sizeHint().width())
