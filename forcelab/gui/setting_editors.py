"""An editor for each kind of value that a setting can have."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import Any

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QFileDialog,
    QHBoxLayout,
    QLineEdit,
    QWidget,
)

from forcelab.gui.key_events import ignore_wheel
from forcelab.gui.layout import fill_layout, page_layout, push_button
from forcelab.gui.widgets import ElidedLabel, combo_box
from forcelab.setting_field import SettingField

#: Letters of a choice that a form has room for.
LONGEST_CHOICE = 40


class Editor(QWidget):
    """Shows the value of a field and lets it be changed."""

    changed = Signal()

    def __init__(self, field: SettingField) -> None:
        super().__init__()
        self.field = field
        self.setToolTip(field.tip)

    @abstractmethod
    def value(self) -> Any:
        """The value, as the setting takes it."""

    def set_value(self, value: Any) -> None:
        """Show another value; emits no signal."""
        with QSignalBlocker(self):
            self._show(value)

    @abstractmethod
    def _show(self, value: Any) -> None: ...

    def _lay_out(self, *controls: QWidget) -> None:
        """Put controls beside each other; the first gets the keyboard."""
        fill_layout(QHBoxLayout(self), *controls, 1, margins=0)
        self.setFocusProxy(controls[0])


class NumberEditor(Editor):
    """A number, behind a switch where it may be off."""

    def __init__(self, field: SettingField) -> None:
        super().__init__(field)
        # One that holds whole numbers only ends at 2^31.
        self.box = QDoubleSpinBox(
            decimals=field.decimals,
            minimum=field.lowest,
            maximum=field.highest,
            singleStep=field.step,
            suffix=f" {field.unit}" if field.unit else "",
        )
        self.box.setAccessibleName(field.label)
        self.box.setMinimumWidth(16 * self.fontMetrics().averageCharWidth())
        self.box.valueChanged.connect(self.changed)
        ignore_wheel(self.box)
        self.switch: QCheckBox | None = None
        if field.default is None:
            self._lay_out(self.box)
        else:
            self.switch = QCheckBox("on")
            self.switch.setAccessibleName(f"Use: {field.label}")
            self.switch.toggled.connect(self.box.setVisible)
            self.switch.toggled.connect(self.changed)
            self._lay_out(self.switch, self.box)
            self.box.hide()
        self._exact: float | None = None

    def value(self) -> float | int | None:
        if self.switch is not None and not self.switch.isChecked():
            return None
        number = self.box.value()
        if self.field.kind == "whole":
            return round(number)
        # A value that was set may have more decimals than are shown.
        exact = self._exact
        rounded = None if exact is None else round(exact, self.field.decimals)
        return exact if exact is not None and rounded == round(number, 9) else number

    def _show(self, value: Any) -> None:
        self._exact = None if value is None or self.field.kind == "whole" else float(value)
        if self.switch is not None:
            self.switch.setChecked(value is not None)
        if value is None:
            value = self.field.default
        if value is not None:
            # What was set elsewhere is shown as it is, also where the form would not lead there.
            self.box.setRange(min(value, self.field.lowest), max(value, self.field.highest))
            self.box.setValue(value)


class ChoiceEditor(Editor):
    """One of several values."""

    def __init__(self, field: SettingField) -> None:
        super().__init__(field)
        self.box = combo_box(field.label, {name: value for value, name in field.options})
        self.box.currentIndexChanged.connect(self.changed)
        ignore_wheel(self.box)
        if max(map(len, dict(field.options).values()), default=0) > LONGEST_CHOICE:
            self._shorten()
        self._lay_out(self.box)

    def _shorten(self) -> None:
        """Let a choice with long texts be no wider than a form; each in full is its tip."""
        box = self.box
        box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        box.setMinimumContentsLength(LONGEST_CHOICE)
        for i in range(box.count()):
            box.setItemData(i, box.itemText(i), Qt.ItemDataRole.ToolTipRole)
        box.currentTextChanged.connect(box.setToolTip)

    def value(self) -> str:
        return str(self.box.currentData())

    def _show(self, value: Any) -> None:
        if self.box.findData(value) < 0:  # such as code of one's own that is not here
            self.box.addItem(str(value), value)
        self.box.setCurrentIndex(self.box.findData(value))


class FlagEditor(Editor):
    """Yes or no."""

    def __init__(self, field: SettingField) -> None:
        super().__init__(field)
        self.box = QCheckBox("on")
        self.box.setAccessibleName(field.label)
        self.box.toggled.connect(self.changed)
        self._lay_out(self.box)

    def value(self) -> bool:
        return self.box.isChecked()

    def _show(self, value: Any) -> None:
        self.box.setChecked(bool(value))


class FolderEditor(Editor):
    """A folder, which a dialog chooses."""

    def __init__(self, field: SettingField) -> None:
        super().__init__(field)
        self._folder = Path()
        self._shown = ElidedLabel()
        self._shown.setAccessibleName(field.label)
        name = f"Choose: {field.label}"
        self._choose = push_button("Choose…", self._ask, name, auto_default=False)
        fill_layout(QHBoxLayout(self), self._choose, (self._shown, 1), margins=0)
        self.setFocusProxy(self._choose)

    def value(self) -> Path:
        return self._folder

    def _show(self, value: Any) -> None:
        self._folder = Path(value)
        self._shown.set_text(str(value))

    def _ask(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, self.field.label, str(self._folder))
        if chosen:
            self._show(chosen)
            self.changed.emit()


class PathsEditor(Editor):
    """Import paths with commas between."""

    def __init__(self, field: SettingField) -> None:
        super().__init__(field)
        self.line = QLineEdit()
        self.line.setAccessibleName(field.label)
        self.line.editingFinished.connect(self.changed)
        page_layout(self, self.line)
        self.setFocusProxy(self.line)

    def value(self) -> tuple[str, ...]:
        return tuple(filter(None, map(str.strip, self.line.text().split(","))))

    def _show(self, value: Any) -> None:
        self.line.setText(", ".join(value))


def editor_for(field: SettingField) -> Editor:
    """The editor of a number, a choice, a flag, a folder or import paths."""
    kinds: dict[str, Callable[[SettingField], Editor]] = {
        "choice": ChoiceEditor,
        "flag": FlagEditor,
        "folder": FolderEditor,
        "paths": PathsEditor,
    }
    return kinds.get(field.kind, NumberEditor)(field)
