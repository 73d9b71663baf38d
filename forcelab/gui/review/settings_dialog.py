"""The dialog in which a coder says how recognisers are trained."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QSize, Qt, QTimer
from PySide6.QtWidgets import (
    QComboBox,
    QDialog,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.arranging import muted, rule, scrolled, toned, use_or_cancel
from forcelab.gui.numerals import thousands
from forcelab.gui.review.settings_facts import Facts
from forcelab.gui.review.settings_fields import FIELDS
from forcelab.gui.review.settings_form import SettingsForm
from forcelab.gui.review.settings_words import of_preset, summary

if TYPE_CHECKING:
    from forcelab.recognition.settings import Settings

__all__ = ["SettingsDialog", "changed"]

SUMMARY, FORM = 0, 1


def changed(settings: Settings) -> bool:
    """Whether settings differ from those of the preset that they began with."""
    from forcelab.recognition.presets import PRESETS

    return settings != PRESETS.get(settings.preset)


class SettingsDialog(QDialog):
    """Presets; one is shown as a summary, until it is changed.

    Parameters
    ----------
    settings : Settings
        What is shown first.
    facts : Facts
        What the demonstrations say; for channels, frequencies, spellings and cost.
    parent : QWidget, optional

    Attributes
    ----------
    chosen : Settings or None
        What is shown; None while it is refused.
    """

    def __init__(self, settings: Settings, facts: Facts, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.facts = facts
        self.chosen: Settings | None = settings
        self.setWindowTitle("Settings of the recogniser")
        self.form = SettingsForm(facts)
        self.form.changed.connect(self._form_changed)
        self.summary = QLabel()
        self.summary.setWordWrap(True)
        self.summary.setTextFormat(Qt.TextFormat.PlainText)
        self.summary.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.summary.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.summary.setAccessibleName("What the preset uses")
        self.about = QLabel()
        self.about.setWordWrap(True)
        self.about.setAccessibleName("What the preset is")
        self.scales, self.cost = muted(), muted()
        buttons, self.ok = use_or_cancel(self, "Use these settings")
        self._pages = QStackedWidget()
        self._pages.addWidget(self._summary_page())
        self._pages.addWidget(self._form_page())
        column = QVBoxLayout(self)
        column.addLayout(self._preset_row())
        column.addWidget(self.about)
        column.addWidget(self._pages, 1)
        column.addWidget(rule())
        column.addWidget(self.scales)
        column.addWidget(self.cost)
        column.addWidget(buttons)
        self._show_settings(settings)

    def sizeHint(self) -> QSize:
        """Room for most of the form."""
        line = self.fontMetrics().height()
        return QSize(38 * line, 40 * line)

    # What it is made of

    def _preset_row(self) -> QHBoxLayout:
        """The presets, and the way back to one."""
        from forcelab.recognition.presets import PRESETS

        self.presets = QComboBox()
        self.presets.setAccessibleName("Preset")
        for name in PRESETS:
            self.presets.addItem(name, name)
            tip = of_preset(name)
            self.presets.setItemData(self.presets.count() - 1, tip, Qt.ItemDataRole.ToolTipRole)
        self.presets.activated.connect(self._preset_chosen)
        self.changed_label = toned("warning", "changed")
        self.change = QPushButton("&Change…")
        self.change.setAccessibleName("Change these settings")
        self.change.clicked.connect(self.open_form)
        self.back = QPushButton("&Back to the preset")
        self.back.setAccessibleName("Back to the preset")
        self.back.clicked.connect(self._preset_chosen)
        for button in (self.change, self.back):
            button.setAutoDefault(False)
        named = QLabel("&Preset")
        named.setBuddy(self.presets)
        row = QHBoxLayout()
        for widget in (named, self.presets, self.changed_label):
            row.addWidget(widget)
        row.addStretch(1)
        row.addWidget(self.change)
        row.addWidget(self.back)
        return row

    def _summary_page(self) -> QWidget:
        """What a preset uses, in words."""
        page = QWidget()
        column = QVBoxLayout(page)
        column.setContentsMargins(0, 6, 0, 6)
        column.addWidget(self.summary)
        column.addStretch(1)
        return scrolled(page)

    def _form_page(self) -> QWidget:
        """All fields."""
        self._area = scrolled(self.form)
        return self._area

    # What happens

    def open_form(self) -> None:
        """Let every field be changed."""
        self._pages.setCurrentIndex(FORM)
        self.change.hide()
        self.back.show()
        self.form.editors[FIELDS[0].name].setFocus()

    def _preset_chosen(self, _at: object = None) -> None:
        """Go back to a preset as it is."""
        from forcelab.recognition.presets import preset

        self._show_settings(preset(str(self.presets.currentData())))

    def _show_settings(self, settings: Settings) -> None:
        """Show settings: a preset as a summary, anything else in the form."""
        at = self.presets.findData(settings.preset)
        self.presets.setCurrentIndex(max(at, 0))
        self.about.setText(of_preset(str(self.presets.currentData())))
        self.form.set_settings(settings)
        if changed(settings):
            self.open_form()
        else:
            self._pages.setCurrentIndex(SUMMARY)
            self.change.show()
            self.back.hide()

    def _form_changed(self) -> None:
        """Say what the settings come to."""
        self.chosen = self.form.settings()
        self.ok.setEnabled(self.chosen is not None)
        if self.chosen is None:
            for label in (self.scales, self.cost):
                label.setText("–")
            self._bring_into_view()
            return
        self.changed_label.setVisible(changed(self.chosen))
        self.summary.setText(summary(self.chosen, self.facts))
        self.scales.setText(self._scales(self.chosen))
        self.cost.setText(self._cost(self.chosen))

    def _bring_into_view(self) -> None:
        """Show the field that is refused, once its sentence has got its room."""
        label = next((label for label in self.form.troubles.values() if label.text()), None)
        if label is not None and self.isVisible():
            QTimer.singleShot(0, label, lambda: self._area.ensureWidgetVisible(label))

    def _scales(self, settings: Settings) -> str:
        """How many scales there are, and which frequencies they answer to."""
        from forcelab.signals.cwt import frequencies

        if settings.features == "windows":
            return self._windows(settings)
        count = len(settings.scales)
        rate = settings.rate or self.facts.rate
        if not rate:
            return f"{count} scales"
        hertz = frequencies(settings.scales, rate, settings.mother)
        return f"{count} scales, {hertz.min():.3g} to {hertz.max():.3g} Hz at {rate:.6g} Hz"

    def _windows(self, settings: Settings) -> str:
        """How many windows there are, and how long."""
        shortest, longest = (1000 * settings.windows[i] for i in (0, -1))
        return f"{len(settings.windows)} windows, {shortest:.3g} to {longest:.3g} ms"

    def _cost(self, settings: Settings) -> str:
        """How much is trained on."""
        features, steps = self.facts.cost(settings)
        if not steps:
            return f"{features} features; nothing is labelled yet."
        return f"{features} features, {thousands(steps)} labelled time steps to train on"
