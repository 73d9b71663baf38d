"""The form of all settings: one row each, hidden where it is not used, refused in its own row."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFormLayout, QGroupBox, QLabel, QVBoxLayout, QWidget

from forcelab.errors import InputError
from forcelab.gui.arranging import column, toned
from forcelab.gui.review.merge_editor import MergeEditor
from forcelab.gui.review.settings_editors import (
    ChannelsEditor,
    ChoiceEditor,
    Editor,
    FlagEditor,
    NumberEditor,
)
from forcelab.gui.review.settings_facts import Facts
from forcelab.gui.review.settings_field import Field
from forcelab.gui.review.settings_fields import FIELDS, GROUPS

if TYPE_CHECKING:
    from forcelab.recognition.settings import Settings

__all__ = ["SettingsForm"]

#: The parameter that a wavelet begins with when it is chosen.
PARAMETERS = {
    "morlet": 5.0,
    "real-morlet": 5.0,
    "uncorrected-morlet": 5.0,
    "torrence-compo": 5.0,
    "dog": 2.0,
}


class SettingsForm(QWidget):
    """All settings as fields.

    Parameters
    ----------
    facts : Facts
        What the demonstrations say.

    Attributes
    ----------
    trouble : str
        Why what is shown are no settings; empty where they are.
    """

    changed = Signal()

    def __init__(self, facts: Facts) -> None:
        super().__init__()
        self.facts = facts
        self.editors: dict[str, Editor] = {}
        self.troubles: dict[str, QLabel] = {}
        self.trouble = ""
        self.preset = "paper"
        self._base: Settings | None = None
        self._wavelet = ""
        self._rows: dict[str, tuple[QFormLayout, QWidget]] = {}
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        for name, fields in GROUPS.items():
            box = QGroupBox(name)
            form = QFormLayout(box)
            form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
            form.setLabelAlignment(Qt.AlignmentFlag.AlignLeft)
            whole.addWidget(box)
            for field in fields:
                self._add(field, form)
        whole.addStretch(1)

    def set_settings(self, settings: Settings) -> None:
        """Show settings."""
        self._base, self.preset = settings, settings.preset
        self._wavelet = settings.wavelet
        for name, shown in self.editors.items():
            value = getattr(settings, name)
            if name == "parameter" and value is None:
                value = PARAMETERS.get(settings.wavelet)
            shown.set_value(value)
        self._follow()

    def settings(self) -> Settings | None:
        """What is shown, or None where it is refused; :attr:`trouble` says why."""
        from forcelab.recognition.settings import Settings

        for label in self.troubles.values():
            label.clear()
            label.hide()
        self.trouble = ""
        try:
            values = self.values()
            try:
                return Settings(**values)
            except InputError as error:
                self._refuse(self._guilty(values), error)
        except _RefusedError as refused:
            self._refuse(refused.field, refused.error)
        return None

    def values(self) -> dict[str, Any]:
        """What the editors hold; what is not used is as it was, or left out.

        Raises
        ------
        _RefusedError
            If an editor holds no value.
        """
        values = {name: self._value(name) for name in self.editors}
        if values["wavelet"] == "haar":
            values["parameter"] = None
        elif self._base is not None and self._untouched(values):
            values["parameter"] = None  # the wavelet's default, as it was
        if self._base is not None:
            values["windows"] = self._base.windows  # which have no editor
        return values | {"preset": self.preset}

    def _value(self, name: str) -> Any:
        """What one editor holds."""
        try:
            return self.editors[name].value()
        except InputError as error:
            raise _RefusedError(name, error) from error

    def _refuse(self, field: str, error: InputError) -> None:
        """Say beneath a field what is wrong with it."""
        self.trouble = str(error)
        self.troubles[field].setText(self.trouble)
        self.troubles[field].show()

    def _untouched(self, values: dict[str, Any]) -> bool:
        """Whether wavelet and parameter are still the ones whose default was not written out."""
        assert self._base is not None
        return (
            self._base.parameter is None
            and values["wavelet"] == self._base.wavelet
            and values["parameter"] == PARAMETERS.get(self._base.wavelet)
        )

    def _guilty(self, values: dict[str, Any]) -> str:
        """The field that is to blame: with its old value the rest would do."""
        from forcelab.recognition.settings import Settings

        assert self._base is not None
        for field in FIELDS:
            try:
                Settings(**{**values, field.name: getattr(self._base, field.name)})
            except InputError:
                continue
            return field.name
        return next((f.name for f in FIELDS if f.name in self.trouble), FIELDS[-1].name)

    def _add(self, field: Field, form: QFormLayout) -> None:
        """Add the row of a field."""
        shown = _editor(field, self.facts)
        shown.changed.connect(self._edited)
        trouble = toned("trouble")
        trouble.hide()
        cell = QWidget()
        column(cell, shown, trouble, spacing=2)
        name = QLabel(field.shown)
        name.setToolTip(field.shown_tip)
        form.addRow(name, cell)
        self.editors[field.name], self.troubles[field.name] = shown, trouble
        self._rows[field.name] = form, cell

    def _edited(self) -> None:
        """Follow what was changed."""
        wavelet = self.editors["wavelet"].value()
        if wavelet != self._wavelet and self._wavelet:
            self._wavelet = wavelet
            self.editors["parameter"].set_value(PARAMETERS.get(wavelet, 0.0))
        if self._base is not None:
            self._follow()

    def _follow(self) -> None:
        """Show what is used, and say what is wrong."""
        try:
            values = self.values()
        except _RefusedError:
            values = {}
        for field in FIELDS if values else ():
            form, cell = self._rows[field.name]
            form.setRowVisible(cell, field.applies(values))
        self.settings()
        self.changed.emit()


class _RefusedError(Exception):
    """An editor holds no value."""

    def __init__(self, field: str, error: InputError) -> None:
        super().__init__(field)
        self.field, self.error = field, error


def _editor(field: Field, facts: Facts) -> Editor:
    """The editor of a field."""
    if field.kind in ("number", "whole"):
        return NumberEditor(field)
    if field.kind == "choice":
        return ChoiceEditor(field)
    if field.kind == "flag":
        return FlagEditor(field)
    if field.kind == "channels":
        return ChannelsEditor(field, facts)
    return MergeEditor(field, facts)
