"""The dialog for a recogniser's settings: its form, and an editor for each kind of value."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from statistics import median_low
from typing import Any

from PySide6.QtCore import QSignalBlocker, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QCheckBox,
    QCompleter,
    QDialog,
    QFormLayout,
    QGridLayout,
    QGroupBox,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
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
from forcelab.gui.layout import (
    copyable,
    dialog_buttons,
    fill_layout,
    label_of,
    muted_label,
    page_layout,
    push_button,
    scroll_area,
    separator,
    set_enabled_with_reason,
    toned_label,
)
from forcelab.gui.review.trainer import Trainer, default_author
from forcelab.gui.review.training_preferences import PRESET_TEXTS, TrainingChoice
from forcelab.gui.setting_editors import Editor, editor_for
from forcelab.gui.text import escape_ampersands
from forcelab.gui.widgets import combo_box
from forcelab.label_map import MergeMap
from forcelab.recognition.plugins import known_paths
from forcelab.recognition.presets import PRESETS, preset
from forcelab.recognition.settings import FIELD_GROUPS, FIELDS, Settings, applies
from forcelab.setting_field import SettingField
from forcelab.signals.channels import channel_map
from forcelab.signals.cwt import frequencies


@dataclass(frozen=True, slots=True)
class TrainingFacts:
    """What the demonstrations that are trained on have in common."""

    channels: tuple[str, ...] = ()  # that all of them have
    rate: float = 0.0  # their median rate in Hz; 0 without a demonstration
    labelled: float = 0.0  # seconds
    spellings: frozenset[str] = frozenset()  # all actions as they are spelt

    def cost(self, settings: Settings) -> tuple[int, int]:
        """Numbers that describe a time step, and labelled steps that are trained on."""
        channels = self.channels if settings.channels is None else settings.channels
        rate = settings.rate or self.rate
        features = len(settings.feature_bands(len(channels), 1.0))
        if not rate:
            return features, 0
        steps = rate / settings.hop(rate)
        return features, round(self.labelled * steps / settings.training_stride(rate))


def training_facts(document: Document, choice: TrainingChoice) -> TrainingFacts:
    """The facts of a choice, from the list of demonstrations; opens no array."""
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


def settings_summary(settings: Settings, facts: TrainingFacts) -> str:
    """The settings in use, a line each."""
    values = {field.name: getattr(settings, field.name) for field in FIELDS}
    lines = []
    for field in FIELDS:
        value = values[field.name]
        if not applies(field.name, values) or (value is None and field.name != "channels"):
            continue
        if field.name == "stride" and value == 1:
            continue  # all of them
        if field.name == "channels":
            text = ", ".join(value or facts.channels) or "–"
        elif field.kind == "merge":
            text = ", ".join(f"{source} → {target}" for source, target in value.items())
        elif field.kind == "choice":
            text = own_options(field).get(value, value)
        elif field.kind == "flag":
            text = "✓" if value else ""
        else:
            text = f"{value:g} {field.unit}".strip()
        if text:
            lines.append(f"{field.label}: {text}")
    return "\n".join(lines)


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
        self._names: tuple[str, ...] | None = None

    def value(self) -> tuple[str, ...] | None:
        """The names, in the order in which they were set; refused (InputError) without any."""
        chosen = [name for name, box in self.boxes.items() if box.isChecked()]
        if self.boxes and not chosen:
            raise InputError("Choose at least one channel.")
        if self._names is not None and set(chosen) == set(self._names):
            return self._names
        return None if chosen == list(self._all) else tuple(chosen)

    def _show(self, value: Any) -> None:
        """Check the channels in use; one that this task lacks can only be unchecked."""
        self._names = None if value is None else tuple(value)
        for name in self._names or ():
            if name not in self.boxes:
                self._add(name)
        for name, box in self.boxes.items():
            box.setChecked(name in (self._all if self._names is None else self._names))

    def _add(self, name: str) -> None:
        in_task = name in self._all
        box = QCheckBox(escape_ampersands(name if in_task else f"{name} (not in this task)"))
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
        self.remark = toned_label("warning")
        self.remark.hide()
        page_layout(self, self.table, self.hint, self.remark, spacing=2)
        self.set_value(MergeMap())

    def value(self) -> MergeMap:
        """The map; refused (InputError) where a line lacks a side, for double or chained merges."""
        targets: dict[str, str] = {}
        for source, target in self.lines():
            if source in targets:
                raise InputError(f"'{source}' is merged twice; keep one of the two lines.")
            targets[source] = target
        merge = MergeMap(targets)
        merge.check_targets()
        return merge

    def _show(self, value: Any) -> None:
        with QSignalBlocker(self.table):
            self.table.setRowCount(0)
            for source, target in (*value.items(), ("", "")):
                self._append(source, target)
        self._flag()

    def lines(self) -> list[tuple[str, str]]:
        """The lines that are not empty."""
        pairs = []
        for row in range(self.table.rowCount()):
            source, target = (self._text(row, column) for column in (0, 1))
            if source or target:
                pairs.append((source, target))
        return pairs

    def unknown(self) -> tuple[str, ...]:
        """Spellings that were never labelled; perhaps mistyped."""
        sources = dict.fromkeys(source for source, _ in self.lines() if source)
        return tuple(name for name in sources if name not in self._spellings)

    def _append(self, source: str, target: str) -> None:
        row = self.table.rowCount()
        self.table.insertRow(row)
        self.table.setItem(row, 0, QTableWidgetItem(source))
        self.table.setItem(row, 1, QTableWidgetItem(target))

    def _text(self, row: int, column: int) -> str:
        item = self.table.item(row, column)
        return "" if item is None else item.text().strip()

    def _edited(self, _item: QTableWidgetItem) -> None:
        """Keep one empty line at the end."""
        last = self.table.rowCount() - 1
        if last < 0 or self._text(last, 0) or self._text(last, 1):
            with QSignalBlocker(self.table):
                self._append("", "")
        self._flag()
        self.changed.emit()

    def _flag(self) -> None:
        """Mark the spellings that were never labelled."""
        unknown = self.unknown()
        with QSignalBlocker(self.table):
            for row in range(self.table.rowCount()):
                item = self.table.item(row, 0)
                if item is not None:
                    warning = self._text(row, 0) in unknown
                    sign = icon("warning") if warning else None
                    item.setData(Qt.ItemDataRole.DecorationRole, sign)
                    item.setToolTip("Never labelled in these demonstrations." if warning else "")
        self.remark.setVisible(bool(unknown))
        self.remark.setText("Never labelled here: {}".format(", ".join(unknown)))


class _SpellingDelegate(QStyledItemDelegate):
    """Cells to write in, which offer the spellings that were labelled."""

    def __init__(self, spellings: Iterable[str], parent: QWidget) -> None:
        super().__init__(parent)
        self._spellings = sorted(spellings, key=str.lower)

    def createEditor(self, parent: QWidget, option: QStyleOptionViewItem, index: Index) -> QWidget:
        line = QLineEdit(parent)
        line.setFrame(False)
        completer = QCompleter(self._spellings, line)
        completer.setCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
        completer.setFilterMode(Qt.MatchFlag.MatchContains)
        line.setCompleter(completer)
        return line


class _MergeTable(QTableWidget):
    """A table in which Delete takes lines away."""

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace) and self.currentRow() >= 0:
            if self.currentRow() < self.rowCount() - 1:
                row = self.currentRow()
                self.removeRow(row)
                # Listeners to changed cells hear of the one that has moved up.
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
    """All settings as fields; `trouble` says why they are refused."""

    changed = Signal()

    def __init__(self, facts: TrainingFacts) -> None:
        super().__init__()
        self.facts = facts
        self.editors: dict[str, Editor] = {}
        self.troubles: dict[str, QLabel] = {}
        self.trouble = ""
        self._base = preset("paper")
        self._wavelet = self._base.wavelet
        self._rows: dict[str, tuple[QFormLayout, QWidget]] = {}
        column = fill_layout(QVBoxLayout(self), margins=0)
        for name, fields in FIELD_GROUPS.items():
            box = QGroupBox(name)
            form = QFormLayout(box)
            form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
            form.setLabelAlignment(Qt.AlignmentFlag.AlignLeft)
            column.addWidget(box)
            for field in fields:
                self._add(field, form)
        column.addStretch(1)

    def set_settings(self, settings: Settings) -> None:
        self._base, self._wavelet = settings, settings.wavelet
        for name, editor in self.editors.items():
            value = getattr(settings, name)
            if name == "parameter" and value is None:
                value = WAVELET_PARAMETERS.get(settings.wavelet)
            editor.set_value(value)
        self._follow()

    def settings(self) -> Settings | None:
        """The settings, or None where they are refused; :attr:`trouble` says why."""
        for label in self.troubles.values():
            label.clear()
            label.hide()
        self.trouble = ""
        values = self._values()
        if values is None:
            return None
        try:
            return Settings(**values)
        except InputError as error:
            self._refuse(self._field_at_fault(values, error), error)
            return None

    def _values(self) -> dict[str, Any] | None:
        """The values of the editors, None where one is refused.

        What is not in use is as it was, or left out.
        """
        values, name = dict[str, Any](), ""
        try:
            for name, editor in self.editors.items():
                values[name] = editor.value()
        except InputError as error:
            self._refuse(name, error)
            return None
        own = (values["wavelet"], values["parameter"])
        base = (self._base.wavelet, WAVELET_PARAMETERS.get(self._base.wavelet))
        default = self._base.parameter is None and own == base
        if values["wavelet"] == "haar" or default:  # which is not written out, as it was not
            values["parameter"] = None
        # What has no editor.
        return values | {"windows": self._base.windows, "preset": self._base.preset}

    def _refuse(self, field: str, error: InputError) -> None:
        self.trouble = str(error)
        self.troubles[field].setText(self.trouble)
        self.troubles[field].show()

    def _field_at_fault(self, values: dict[str, Any], error: InputError) -> str:
        """The field to blame: with its old value the settings would be accepted."""
        for field in FIELDS:
            try:
                Settings(**{**values, field.name: getattr(self._base, field.name)})
            except InputError:
                continue
            return field.name
        return next((f.name for f in FIELDS if f.name in str(error)), FIELDS[-1].name)

    def _add(self, field: SettingField, form: QFormLayout) -> None:
        editor = _editor_for(field, self.facts)
        editor.changed.connect(self._edited)
        trouble = toned_label("trouble")
        trouble.hide()
        cell = QWidget()
        page_layout(cell, editor, trouble, spacing=2)
        name = QLabel(field.label)
        name.setToolTip(field.tip)
        form.addRow(name, cell)
        self.editors[field.name], self.troubles[field.name] = editor, trouble
        self._rows[field.name] = form, cell

    def _edited(self) -> None:
        wavelet = self.editors["wavelet"].value()
        if wavelet != self._wavelet:
            self._wavelet = wavelet
            self.editors["parameter"].set_value(WAVELET_PARAMETERS.get(wavelet, 0.0))
        self._follow()

    def _follow(self) -> None:
        """Show the fields in use, and what is wrong."""
        if (values := self._values()) is not None:
            for field in FIELDS:
                form, cell = self._rows[field.name]
                form.setRowVisible(cell, applies(field.name, values))
        self.settings()
        self.changed.emit()


def _editor_for(field: SettingField, facts: TrainingFacts) -> Editor:
    if field.kind == "channels":
        return ChannelsEditor(field, facts)
    if field.kind == "merge":
        return MergeEditor(field, facts)
    if field.kind == "choice":
        return editor_for(replace(field, options=tuple(own_options(field).items())))
    return editor_for(field)


def own_options(field: SettingField) -> dict[str, str]:
    """The values of a choice and what they are called, code of one's own among them.

    Features of one's own stand alone or beside each of the others.
    """
    options = dict(field.options)
    if field.name == "classifier":
        return options | known_paths("classifier")
    if field.name == "features":
        for path, name in known_paths("features").items():
            beside = {f"{value}+{path}": f"{text} + {name}" for value, text in field.options}
            options |= {path: name, **beside}
    return options


SUMMARY_PAGE, FORM_PAGE = 0, 1


def differs_from_preset(settings: Settings) -> bool:
    return settings != PRESETS.get(settings.preset)


class SettingsDialog(QDialog):
    """Presets; one is shown as a summary, until it is changed. `chosen` is None while refused."""

    def __init__(
        self, settings: Settings, facts: TrainingFacts, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.facts = facts
        self.chosen: Settings | None = settings
        self.setWindowTitle("Settings of the recogniser")
        self.form = SettingsForm(facts)
        self.form.changed.connect(self._form_changed)
        self.summary = copyable()
        self.summary.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.summary.setAccessibleName("What the preset uses")
        self.about = QLabel(wordWrap=True)
        self.about.setAccessibleName("What the preset is")
        self.scales, self.cost = muted_label(), muted_label()
        buttons, self.ok = dialog_buttons(self, "Use these settings")
        self._pages = QStackedWidget()
        self._pages.addWidget(self._summary_page())
        self._area = scroll_area(self.form)
        self._pages.addWidget(self._area)
        above, below = (self._preset_row(), self.about), (self.scales, self.cost, buttons)
        fill_layout(QVBoxLayout(self), *above, (self._pages, 1), separator(), *below)
        self._show_settings(settings)

    def sizeHint(self) -> QSize:
        line = self.fontMetrics().height()
        return QSize(38 * line, 40 * line)

    # What it is made of

    def _preset_row(self) -> QHBoxLayout:
        self.presets = combo_box("Preset", {name: name for name in PRESETS})
        for i, name in enumerate(PRESETS):
            self.presets.setItemData(i, PRESET_TEXTS.get(name, ""), Qt.ItemDataRole.ToolTipRole)
        self.presets.activated.connect(self._preset_chosen)
        self.changed_label = toned_label("warning", "changed")
        self.change = push_button(
            "&Change…", self.open_form, "Change these settings", auto_default=False
        )
        self.back = push_button(
            "&Back to the preset", self._preset_chosen, "Back to the preset", auto_default=False
        )
        chosen = label_of(self.presets, "&Preset"), self.presets, self.changed_label
        return fill_layout(QHBoxLayout(), *chosen, 1, self.change, self.back)

    def _summary_page(self) -> QWidget:
        page = QWidget()
        fill_layout(QVBoxLayout(page), self.summary, 1, margins=(0, 6, 0, 6))
        return scroll_area(page)

    # What happens

    def open_form(self, *, field: str = FIELDS[0].name) -> None:
        """Show the form, in which every field can be changed, one of them first."""
        self._pages.setCurrentIndex(FORM_PAGE)
        self.change.hide()
        self.back.show()
        editor = self.form.editors[field]
        editor.setFocus()
        QTimer.singleShot(0, editor, lambda: self._area.ensureWidgetVisible(editor))

    def _preset_chosen(self, _at: object = None) -> None:
        """Go back to a preset as it is."""
        self._show_settings(preset(str(self.presets.currentData())))

    def _show_settings(self, settings: Settings) -> None:
        """Show settings: a preset as a summary, anything else in the form."""
        at = self.presets.findData(settings.preset)
        self.presets.setCurrentIndex(max(at, 0))
        self.about.setText(PRESET_TEXTS.get(self.presets.currentText(), ""))
        self.form.set_settings(settings)
        if differs_from_preset(settings):
            self.open_form()
        else:
            self._pages.setCurrentIndex(SUMMARY_PAGE)
            self.change.show()
            self.back.hide()

    def _form_changed(self) -> None:
        self.chosen = self.form.settings()
        reason = "Correct what is marked first."
        set_enabled_with_reason(self.ok, "" if self.chosen is not None else reason)
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
        label = next((label for label in self.form.troubles.values() if label.text()), None)
        if label is not None and self.isVisible():
            QTimer.singleShot(0, label, lambda: self._area.ensureWidgetVisible(label))

    def _scales(self, settings: Settings) -> str:
        parts = []
        if "windows" in settings.known_features:
            shortest, longest = (1000 * settings.windows[i] for i in (0, -1))
            parts.append(f"{len(settings.windows)} windows, {shortest:.3g} to {longest:.3g} ms")
        if "wavelets" in settings.known_features:
            parts.append(f"{len(settings.scales)} scales")
            if rate := settings.rate or self.facts.rate:
                hertz = frequencies(settings.scales, rate, settings.mother)
                parts.append(f"{hertz.min():.3g} to {hertz.max():.3g} Hz at {rate:.6g} Hz")
        return ", ".join(parts)

    def _cost(self, settings: Settings) -> str:
        features, steps = self.facts.cost(settings)
        text = f"{features} features"
        if settings.own_features:  # how many there are only their code knows
            own = " and ".join(settings.own_features)
            text = f"{text} and those of {own}" if features else f"The features of {own}"
        if not steps:
            return f"{text}; nothing is labelled yet."
        return f"{text}, {steps:,} labelled time steps to train on"


def change_settings(trainer: Trainer, parent: QWidget, field: str = "") -> None:
    """Ask for other settings of a trainer's task, one of them first."""
    facts = training_facts(trainer.document, trainer.choice)
    dialog = SettingsDialog(trainer.settings, facts, parent)
    if field:
        dialog.open_form(field=field)

    def take() -> None:
        if dialog.chosen is not None:
            trainer.set_settings(dialog.chosen)

    dialog.accepted.connect(take)
    dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    dialog.open()
