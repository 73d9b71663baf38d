"""The dialog for a recogniser's settings: its form, and an editor for each kind of value."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from statistics import median_low
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QSize, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QCheckBox,
    QComboBox,
    QCompleter,
    QDialog,
    QDoubleSpinBox,
    QFormLayout,
    QGridLayout,
    QGroupBox,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
    QPushButton,
    QStackedWidget,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import InputError
from forcelab.gui.document import Document
from forcelab.gui.icons import icon
from forcelab.gui.item_views import Index
from forcelab.gui.key_events import ignore_wheel
from forcelab.gui.layout import (
    dialog_buttons,
    muted_label,
    page_layout,
    scroll_area,
    separator,
    set_tone,
)
from forcelab.gui.review.trainer import default_author
from forcelab.gui.text import escape_ampersands, thousands
from forcelab.label_map import MergeMap
from forcelab.recognition.setting_fields import FIELD_GROUPS, FIELDS, SettingField

if TYPE_CHECKING:
    from forcelab.recognition.dataset import Choice
    from forcelab.recognition.settings import Settings


@dataclass(frozen=True, slots=True)
class TrainingFacts:
    """What the demonstrations that are trained on have in common.

    Parameters
    ----------
    channels : tuple of str
        Recognition channels that all of them have.
    rate : float
        Their median rate in Hz; 0 without a demonstration.
    labelled : float
        Seconds that are labelled by whom they are trained on.
    spellings : frozenset of str
        All actions as they are spelt.
    """

    channels: tuple[str, ...] = ()
    rate: float = 0.0
    labelled: float = 0.0
    spellings: frozenset[str] = frozenset()

    def cost(self, settings: Settings) -> tuple[int, int]:
        """Numbers that describe a time step, and labelled steps that are trained on."""
        channels = self.channels if settings.channels is None else settings.channels
        rate = settings.rate or self.rate
        features = settings.width(len(channels))
        steps = rate / settings.hop(rate) if rate else 0.0
        return features, round(self.labelled * steps / settings.stride)


def training_facts(document: Document, choice: Choice) -> TrainingFacts:
    """The facts of what is chosen, from the list of demonstrations; opens no array."""
    from forcelab.signals.channels import channel_map

    if document.project is None:
        return TrainingFacts()
    # From the store: what was painted a moment ago is not in the window's list yet.
    infos = [info for info in document.project.demonstrations.infos() if info.task in choice.tasks]
    if not infos:
        return TrainingFacts()
    maps = [channel_map(info.channels).names for info in infos]
    common = set.intersection(*map(set, maps))
    author = choice.author or default_author(document, {*choice.tasks, choice.test_task})
    spelt = frozenset[str]().union(
        *(document.project.actions.painted(task) for task in choice.tasks)
    )
    return TrainingFacts(
        channels=tuple(name for name in maps[0] if name in common),
        rate=median_low(info.rate for info in infos),
        labelled=sum(info.labelled.get(author, 0.0) for info in infos) if author else 0.0,
        spellings=spelt,
    )


_PRESET_TEXTS = {
    "paper": "The published method, unchanged: to compare with what was published.",
    "released": (
        "What the authors' published code does where it differs from their text: slower movements "
        "and stronger filters."
    ),
    "fast": (
        "As best, but without peaks, trained on every fifth decision, contradicted or not, and not "
        "calibrated."
    ),
    "best": "The most accurate on the paper's recordings, with calibrated probabilities.",
}


def preset_text(name: str) -> str:
    """What a preset is, in one sentence; empty for one that has none."""
    return _PRESET_TEXTS.get(name, "")


def settings_summary(settings: Settings, facts: TrainingFacts) -> str:
    """What settings use, a line each; what is not used is left out."""
    values = {field.name: getattr(settings, field.name) for field in FIELDS}
    lines = []
    for field in FIELDS:
        value = values[field.name]
        if not field.applies(values) or (value is None and field.name != "channels"):
            continue
        if field.name == "stride" and value == 1:
            continue  # all of them
        if field.name == "channels":
            shown = ", ".join(value or facts.channels) or "–"
        elif field.kind == "merge":
            shown = ", ".join(f"{source} → {target}" for source, target in value.items())
        elif field.kind == "choice":
            shown = dict(field.options)[value]
        elif field.kind == "flag":
            shown = "✓" if value else ""
        else:
            shown = f"{value:g} {field.unit if field.unit else ''}".strip()
        if shown:
            lines.append(f"{field.label}: {shown}")
    return "\n".join(lines)


class Editor(QWidget):
    """Shows one value and lets it be changed."""

    changed = Signal()

    def __init__(self, field: SettingField) -> None:
        super().__init__()
        self.field = field
        self.setToolTip(field.tip)

    @abstractmethod
    def value(self) -> Any:
        """What it shows, as :class:`~forcelab.recognition.settings.Settings` takes it."""

    @abstractmethod
    def set_value(self, value: Any) -> None:
        """Show another value; nobody is told."""


class NumberEditor(Editor):
    """A number, behind a switch where it may be off."""

    def __init__(self, field: SettingField) -> None:
        super().__init__(field)
        self.switch = QCheckBox("on") if field.default is not None else None
        # One that holds whole numbers only ends at 2^31.
        self.box = QDoubleSpinBox()
        self.box.setDecimals(field.decimals)
        self.box.setRange(field.lowest, field.highest)
        self.box.setSingleStep(field.step)
        if field.unit:
            self.box.setSuffix(f" {field.unit}")
        self.box.setAccessibleName(field.label)
        self.box.setMinimumWidth(16 * self.fontMetrics().averageCharWidth())
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        if self.switch is not None:
            self.switch.setAccessibleName(f"Use: {field.label}")
            self.switch.toggled.connect(self._switched)
            row.addWidget(self.switch)
        row.addWidget(self.box)
        row.addStretch(1)
        self.box.valueChanged.connect(lambda _: self.changed.emit())
        self.setFocusProxy(self.switch or self.box)
        ignore_wheel(self.box)
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

    def __init__(self, field: SettingField) -> None:
        super().__init__(field)
        self.box = QComboBox()
        self.box.setAccessibleName(field.label)
        for value, name in field.options:
            self.box.addItem(name, value)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self.box)
        row.addStretch(1)
        self.setFocusProxy(self.box)
        ignore_wheel(self.box)
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

    def __init__(self, field: SettingField) -> None:
        super().__init__(field)
        self.box = QCheckBox("on")
        self.box.setAccessibleName(field.label)
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

    def __init__(self, field: SettingField, facts: TrainingFacts) -> None:
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
        box = QCheckBox(escape_ampersands(name if here else f"{name} (not in this task)"))
        box.setAccessibleName(f"Channel {name}")
        box.toggled.connect(lambda _: self.changed.emit())
        at = len(self.boxes)
        self._grid.addWidget(box, at // 2, at % 2, Qt.AlignmentFlag.AlignLeft)
        self.boxes[name] = box


class MergeEditor(Editor):
    """Two columns; an empty line at the end waits for more. Delete takes a line away."""

    def __init__(self, field: SettingField, facts: TrainingFacts) -> None:
        super().__init__(field)
        self._spellings = facts.spellings
        self.table = _MergeTable(0, 2)
        self.table.setAccessibleName(field.label)
        self.table.setHorizontalHeaderLabels(["spelling", "taken as"])
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        header.setHighlightSections(False)
        self.table.verticalHeader().hide()
        self.table.setTabKeyNavigation(False)
        self.table.setFixedHeight(round(7.5 * self.fontMetrics().height()))
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.AllEditTriggers)
        self.table.setItemDelegate(_SpellingDelegate(facts.spellings, self.table))
        self.table.itemChanged.connect(self._edited)
        self.hint = muted_label(
            "Click a line and write what was labelled and what it is to count as; an emptied "
            "line is left out."
        )
        self.remark = set_tone("warning")
        self.remark.hide()
        page_layout(self, self.table, self.hint, self.remark, spacing=2)
        self.set_value(MergeMap())

    def value(self) -> MergeMap:
        """The map.

        Raises
        ------
        InputError
            If a line names only one of the two, a spelling stands twice, a chain of merges, or
            a merge into no action.
        """
        targets: dict[str, str] = {}
        for source, target in self.lines():
            if source in targets:
                raise InputError(f"'{source}' is merged twice; keep one of the two lines.")
            targets[source] = target
        merge = MergeMap(targets)
        merge.check_targets()
        return merge

    def set_value(self, value: Any) -> None:
        """Show a map."""
        self.blockSignals(True)
        self.table.blockSignals(True)
        self.table.setRowCount(0)
        for source, target in (*value.items(), ("", "")):
            self._append(source, target)
        self.table.blockSignals(False)
        self._flag()
        self.blockSignals(False)

    def lines(self) -> list[tuple[str, str]]:
        """What stands in the lines that are not empty."""
        found = []
        for row in range(self.table.rowCount()):
            source, target = (self._text(row, column) for column in (0, 1))
            if source or target:
                found.append((source, target))
        return found

    def unknown(self) -> tuple[str, ...]:
        """Spellings that nobody labelled; perhaps mistyped."""
        sources = dict.fromkeys(source for source, _ in self.lines() if source)
        return tuple(name for name in sources if name not in self._spellings)

    def _append(self, source: str, target: str) -> None:
        """Add a line."""
        row = self.table.rowCount()
        self.table.insertRow(row)
        self.table.setItem(row, 0, QTableWidgetItem(source))
        self.table.setItem(row, 1, QTableWidgetItem(target))

    def _text(self, row: int, column: int) -> str:
        """What stands in a cell."""
        item = self.table.item(row, column)
        return "" if item is None else item.text().strip()

    def _edited(self, _item: QTableWidgetItem) -> None:
        """Keep one empty line at the end, and tell."""
        self.table.blockSignals(True)
        last = self.table.rowCount() - 1
        if last < 0 or self._text(last, 0) or self._text(last, 1):
            self._append("", "")
        self.table.blockSignals(False)
        self._flag()
        self.changed.emit()

    def _flag(self) -> None:
        """Mark the spellings that nobody labelled."""
        unknown = self.unknown()
        self.table.blockSignals(True)
        for row in range(self.table.rowCount()):
            item = self.table.item(row, 0)
            if item is not None:
                strange = self._text(row, 0) in unknown
                item.setData(Qt.ItemDataRole.DecorationRole, icon("warning") if strange else None)
                item.setToolTip("Nobody labelled this here." if strange else "")
        self.table.blockSignals(False)
        self.remark.setVisible(bool(unknown))
        self.remark.setText("Nobody labelled here: {}".format(", ".join(unknown)))


class _SpellingDelegate(QStyledItemDelegate):
    """Cells to write in, which offer the spellings that were labelled."""

    def __init__(self, spellings: Iterable[str], parent: QWidget) -> None:
        super().__init__(parent)
        self._spellings = sorted(spellings, key=str.lower)

    def createEditor(self, parent: QWidget, option: QStyleOptionViewItem, index: Index) -> QWidget:
        """A line to write in."""
        line = QLineEdit(parent)
        line.setFrame(False)
        offered = QCompleter(self._spellings, line)
        offered.setCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
        offered.setFilterMode(Qt.MatchFlag.MatchContains)
        line.setCompleter(offered)
        return line


class _MergeTable(QTableWidget):
    """A table in which Delete takes lines away."""

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Empty the chosen line, or leave it to the table."""
        if event.key() in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace) and self.currentRow() >= 0:
            if self.currentRow() < self.rowCount() - 1:
                row = self.currentRow()
                self.removeRow(row)
                # Whoever listens to cells that change is told of the one that is there now.
                if (item := self.item(row, 0)) is not None:
                    self.itemChanged.emit(item)
            event.accept()
            return
        super().keyPressEvent(event)


#: The parameter that a wavelet begins with when it is chosen.
WAVELET_PARAMETERS = {
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

    def __init__(self, facts: TrainingFacts) -> None:
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
        for name, fields in FIELD_GROUPS.items():
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
                value = WAVELET_PARAMETERS.get(settings.wavelet)
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
                self._refuse(self._field_at_fault(values), error)
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
            and values["parameter"] == WAVELET_PARAMETERS.get(self._base.wavelet)
        )

    def _field_at_fault(self, values: dict[str, Any]) -> str:
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

    def _add(self, field: SettingField, form: QFormLayout) -> None:
        """Add the row of a field."""
        shown = _editor_for(field, self.facts)
        shown.changed.connect(self._edited)
        trouble = set_tone("trouble")
        trouble.hide()
        cell = QWidget()
        page_layout(cell, shown, trouble, spacing=2)
        name = QLabel(field.label)
        name.setToolTip(field.tip)
        form.addRow(name, cell)
        self.editors[field.name], self.troubles[field.name] = shown, trouble
        self._rows[field.name] = form, cell

    def _edited(self) -> None:
        """Follow what was changed."""
        wavelet = self.editors["wavelet"].value()
        if wavelet != self._wavelet and self._wavelet:
            self._wavelet = wavelet
            self.editors["parameter"].set_value(WAVELET_PARAMETERS.get(wavelet, 0.0))
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


def _editor_for(field: SettingField, facts: TrainingFacts) -> Editor:
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


SUMMARY_PAGE, FORM_PAGE = 0, 1


def differs_from_preset(settings: Settings) -> bool:
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

    def __init__(
        self, settings: Settings, facts: TrainingFacts, parent: QWidget | None = None
    ) -> None:
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
        self.scales, self.cost = muted_label(), muted_label()
        buttons, self.ok = dialog_buttons(self, "Use these settings")
        self._pages = QStackedWidget()
        self._pages.addWidget(self._summary_page())
        self._pages.addWidget(self._form_page())
        column = QVBoxLayout(self)
        column.addLayout(self._preset_row())
        column.addWidget(self.about)
        column.addWidget(self._pages, 1)
        column.addWidget(separator())
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
            tip = preset_text(name)
            self.presets.setItemData(self.presets.count() - 1, tip, Qt.ItemDataRole.ToolTipRole)
        self.presets.activated.connect(self._preset_chosen)
        self.changed_label = set_tone("warning", "changed")
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
        return scroll_area(page)

    def _form_page(self) -> QWidget:
        """All fields."""
        self._area = scroll_area(self.form)
        return self._area

    # What happens

    def open_form(self) -> None:
        """Let every field be changed."""
        self._pages.setCurrentIndex(FORM_PAGE)
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
        self.about.setText(preset_text(str(self.presets.currentData())))
        self.form.set_settings(settings)
        if differs_from_preset(settings):
            self.open_form()
        else:
            self._pages.setCurrentIndex(SUMMARY_PAGE)
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
        self.changed_label.setVisible(differs_from_preset(self.chosen))
        self.summary.setText(settings_summary(self.chosen, self.facts))
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
