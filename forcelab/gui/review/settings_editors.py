"""The editors of a form of settings: each shows and gives one value."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QGridLayout,
    QHBoxLayout,
    QWidget,
)

from forcelab.errors import InputError
from forcelab.gui.naming import verbatim
from forcelab.gui.review.settings_facts import Facts
from forcelab.gui.review.settings_field import Field
from forcelab.gui.wheel_guard import guard_from_wheel

__all__ = ["ChannelsEditor", "ChoiceEditor", "Editor", "FlagEditor", "NumberEditor"]


class Editor(QWidget):
    """Shows one value and lets it be changed."""

    changed = Signal()

    def __init__(self, field: Field) -> None:
        super().__init__()
        self.field = field
        self.setToolTip(field.shown_tip)

    @abstractmethod
    def value(self) -> Any:
        """What it shows, as :class:`~forcelab.recognition.settings.Settings` takes it."""

    @abstractmethod
    def set_value(self, value: Any) -> None:
        """Show another value; nobody is told."""


class NumberEditor(Editor):
    """A number, behind a switch where it may be off."""

    def __init__(self, field: Field) -> None:
        super().__init__(field)
        self.switch = QCheckBox("on") if field.default is not None else None
        # One that holds whole numbers only ends at 2^31.
        self.box = QDoubleSpinBox()
        self.box.setDecimals(field.decimals)
        self.box.setRange(field.lowest, field.highest)
        self.box.setSingleStep(field.step)
        if field.unit:
            self.box.setSuffix(f" {field.unit}")
        self.box.setAccessibleName(field.shown)
        self.box.setMinimumWidth(16 * self.fontMetrics().averageCharWidth())
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        if self.switch is not None:
            self.switch.setAccessibleName(f"Use: {field.shown}")
            self.switch.toggled.connect(self._switched)
            row.addWidget(self.switch)
        row.addWidget(self.box)
        row.addStretch(1)
        self.box.valueChanged.connect(lambda _: self.changed.emit())
        self.setFocusProxy(self.switch or self.box)
        guard_from_wheel(self.box)
        self._exact: float | None = None
        self._switched(self.switch is None or self.switch.isChecked())

    def value(self) -> float | int | None:
        """The number, or None when it is off."""
        if self.switch is not None and not self.switch.isChecked():
            return None
        shown = self.box.value()
        if self.field.kind == "whole":
            return round(shown)
        # What was given may have more decimals than are shown.
        exact = self._exact
        rounded = None if exact is None else round(exact, self.field.decimals)
        return exact if exact is not None and rounded == round(shown, 9) else shown

    def set_value(self, value: Any) -> None:
        """Show a number, or that there is none."""
        self._exact = None if value is None or self.field.kind == "whole" else float(value)
        self.blockSignals(True)
        if self.switch is not None:
            self.switch.setChecked(value is not None)
        if value is None:
            value = self.field.default
        if value is not None:
            # What was set elsewhere is shown as it is, also where the form would not lead there.
            self.box.setRange(min(value, self.field.lowest), max(value, self.field.highest))
            self.box.setValue(value)
        self._switched(self.switch is None or self.switch.isChecked())
        self.blockSignals(False)

    def _switched(self, on: bool) -> None:
        """Show the number only where it counts."""
        self.box.setVisible(on)
        self.changed.emit()


class ChoiceEditor(Editor):
    """One of several values."""

    def __init__(self, field: Field) -> None:
        super().__init__(field)
        self.box = QComboBox()
        self.box.setAccessibleName(field.shown)
        for value, name in field.options:
            self.box.addItem(name, value)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self.box)
        row.addStretch(1)
        self.setFocusProxy(self.box)
        guard_from_wheel(self.box)
        self.box.currentIndexChanged.connect(lambda _: self.changed.emit())

    def value(self) -> str:
        """The one that is chosen."""
        return str(self.box.currentData())

    def set_value(self, value: Any) -> None:
        """Choose one."""
        self.blockSignals(True)
        self.box.setCurrentIndex(max(self.box.findData(value), 0))
        self.blockSignals(False)


class FlagEditor(Editor):
    """Yes or no."""

    def __init__(self, field: Field) -> None:
        super().__init__(field)
        self.box = QCheckBox("on")
        self.box.setAccessibleName(field.shown)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self.box)
        self.setFocusProxy(self.box)
        self.box.toggled.connect(lambda _: self.changed.emit())

    def value(self) -> bool:
        """Whether it is switched on."""
        return self.box.isChecked()

    def set_value(self, value: Any) -> None:
        """Switch it on or off."""
        self.blockSignals(True)
        self.box.setChecked(bool(value))
        self.blockSignals(False)


class ChannelsEditor(Editor):
    """Which recognition channels are used; all of them is None."""

    def __init__(self, field: Field, facts: Facts) -> None:
        super().__init__(field)
        self.boxes: dict[str, QCheckBox] = {}
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setColumnStretch(2, 1)
        self._all = facts.channels
        for name in facts.channels:
            self._add(name)
        self._given: tuple[str, ...] | None = None

    def value(self) -> tuple[str, ...] | None:
        """The names, in the order in which they were given.

        Raises
        ------
        InputError
            If there is none.
        """
        chosen = [name for name, box in self.boxes.items() if box.isChecked()]
        if self.boxes and not chosen:
            raise InputError("A recogniser needs something to look at; choose a channel.")
        if self._given is not None and set(chosen) == set(self._given):
            return self._given
        return None if chosen == list(self._all) else tuple(chosen)

    def set_value(self, value: Any) -> None:
        """Check those that are used; one that is not here can only be unchecked."""
        self.blockSignals(True)
        self._given = None if value is None else tuple(value)
        for name in self._given or ():
            if name not in self.boxes:
                self._add(name)
        for name, box in self.boxes.items():
            box.setChecked(name in self._all if self._given is None else name in self._given)
        self.blockSignals(False)

    def _add(self, name: str) -> None:
        """Offer a channel."""
        here = name in self._all
        box = QCheckBox(verbatim(name if here else f"{name} (not in this task)"))
        box.setAccessibleName(f"Channel {name}")
        box.toggled.connect(lambda _: self.changed.emit())
        at = len(self.boxes)
        self._grid.addWidget(box, at // 2, at % 2, Qt.AlignmentFlag.AlignLeft)
        self.boxes[name] = box
