"""The dialog that imports labels of other programs onto demonstrations of the open project."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QFormLayout,
    QHBoxLayout,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from forcelab.formats.label_files import ImportedTrack, LabelOptions, LabelReport, importing_labels
from forcelab.gui.author_choice import UnsignedCoder
from forcelab.gui.document import Document
from forcelab.gui.file_dialogs import FileDrop, ask_files, let_remove
from forcelab.gui.item_views import TableColumn, TableRow, TextModel, TextTable
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import (
    ProgressBar,
    add_buttons,
    copyable,
    fill_layout,
    push_button,
    resize_on_screen,
    seconds_box,
    sentence_label,
    set_enabled_with_reason,
)
from forcelab.gui.text import name_fields
from forcelab.gui.theme import colours
from forcelab.gui.widgets import ElidedComboBox, combo_box
from forcelab.text import counted

_COLUMNS: Final = (
    TableColumn("File", number=False),
    TableColumn("Demonstration", number=False),
    TableColumn("Author", number=False),
    TableColumn("Segments"),
    TableColumn("Result", number=False),
)
#: What is said of a track before and after the import.
_PLANNED: Final = {"new": "new", "replaced": "replaces labels", "unchanged": "same labels"}
_DONE: Final = {"new": "imported", "replaced": "replaced", "unchanged": "same labels"}
#: How many lines of remarks are shown at once.
LINES: Final = 4
#: Options of the command, and the fields in their place.
_FIELDS: Final = {
    "--demo": "Demonstration",
    "--replace": "Replace existing labels",
    "--offset": "Add to all times",
    "--tiers": "Tiers of ELAN and Praat: Actions",
}


class LabelImportDialog(FileDrop, QDialog):
    """Choose label files, see what each belongs to, and import them.

    What is hidden from the coder stays hidden.
    """

    def __init__(self, document: Document, jobs: Jobs, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Import labels")
        resize_on_screen(self, QSize(760, 520))
        self.setAcceptDrops(True)
        self._document, self._jobs = document, jobs
        self._files: list[Path] = []
        self._model = TextModel(self)
        self.table = TextTable(self._model)
        self.table.setAccessibleName("Labels in the files")
        self.table.verticalHeader().hide()
        self.table.selectionModel().selectionChanged.connect(self._show_remarks)
        let_remove(self.table, self._remove)
        self._bar = ProgressBar("Progress of the import")
        self._text = copyable()
        self._text.setAlignment(Qt.AlignmentFlag.AlignTop)
        self._text.setMargin(4)
        self._sentences = QScrollArea(widgetResizable=True)
        self._sentences.setWidget(self._text)
        self._sentences.setFixedHeight(LINES * self.fontMetrics().lineSpacing() + 8)
        column = fill_layout(QVBoxLayout(self), self._heading(), (self.table, 1), self._form())
        fill_layout(column, self._bar, self._sentences)
        self.go, _ = add_buttons(self, "Import", self._import)
        self._show(LabelReport(), _PLANNED)

    def _heading(self) -> QHBoxLayout:
        label = sentence_label(
            "Label files, chosen or dropped here: ELAN, TextGrids of Praat, BORIS, Label Studio, "
            "Audacity, tables (CSV). Each belongs to the demonstration of its name."
        )
        self.pick = push_button(
            "Choose files…", lambda: self.add_files(ask_files(self, "Label files", "labels"))
        )
        return fill_layout(QHBoxLayout(), (label, 1), self.pick)

    def _form(self) -> QFormLayout:
        """What the files do not say themselves."""
        document = self._document
        self.demonstration = ElidedComboBox()
        self.demonstration.setAccessibleName("Demonstration")
        self.demonstration.addItem("By the name of each file", None)
        if document.demonstration is not None:
            self.demonstration.addItem(
                f"This demonstration ({document.demonstration.name})", document.id
            )
        self.author = UnsignedCoder(document, LabelOptions().author)
        self.tiers = combo_box(
            "Tiers of ELAN and Praat",
            {
                "Authors: each annotation names an action": "authors",
                "Actions: each annotation is the action its tier is called": "actions",
            },
        )
        self.offset = seconds_box("Add to all times")
        self.offset.setRange(-1e6, 1e6)
        self.replacing = QCheckBox("Replace existing labels of these authors (can be undone)")
        for changed in (
            self.demonstration.currentIndexChanged,
            self.author.currentTextChanged,
            self.tiers.currentIndexChanged,
            self.offset.valueChanged,
            self.replacing.toggled,
        ):
            changed.connect(self._preview)
        form = QFormLayout()
        form.addRow("Demonstration", self.demonstration)
        form.addRow("Coder for unsigned labels", self.author)
        form.addRow("Tiers of ELAN and Praat", self.tiers)
        form.addRow("Add to all times", self.offset)
        form.addRow("", self.replacing)
        return form

    def add_files(self, files: Sequence[Path]) -> None:
        self._files = list(dict.fromkeys([*self._files, *files]))
        if files:
            self._preview()
            self.go.setFocus()

    def reject(self) -> None:
        """Cancel a running import, and close."""
        self._jobs.cancel("label import")
        super().reject()

    def _remove(self) -> None:
        """Remove the files of the selected rows."""
        rows = {index.row() for index in self.table.selectionModel().selectedRows()}
        listed = (*(track.file for track in self._report.tracks), *self._report.unread)
        names = {path for row, path in enumerate(listed) if row in rows}
        self._files = [path for path in self._files if path not in names]
        self._preview()

    def _preview(self) -> None:
        """Read the files anew, to show what they are labels of; not while they are imported."""
        if not self._bar.isHidden():
            return
        if self._files:
            self._run(self.author.name, writing=False)
        else:
            self._jobs.cancel("label import")
            self._show(LabelReport(), _PLANNED)

    def _import(self) -> None:
        self._run(self.author.settle(), writing=True)

    def _run(self, author: str, *, writing: bool) -> None:
        project = self._document.project
        if project is None:
            return
        set_enabled_with_reason(
            self.go, "Wait until this is imported." if writing else "Wait until the files are read."
        )
        self._bar.setVisible(writing)
        options = LabelOptions(author, self.tiers.currentData(), self.offset.value())
        job = importing_labels(
            project.path,
            self._files,
            options,
            demonstration=self.demonstration.currentData(),
            replacing=self.replacing.isChecked(),
            viewer=self._document.author,
            writing=writing,
        )
        preview = partial(self._show, words=_PLANNED)
        done = partial(self._imported, tuple(self._files)) if writing else preview
        self._jobs.run(job, done, self._failed, self._bar.show_progress, key="label import")

    def _imported(self, files: Sequence[Path], report: LabelReport) -> None:
        """Show what was imported; files that were left out or added meanwhile stay in the list."""
        self._document.reread()
        left_out = report.trouble()
        self._files = [path for path in self._files if path not in files or path in left_out]
        self._show(report, _DONE)
        if not set(files).issuperset(self._files):
            self._preview()

    def _failed(self, error: Exception) -> None:
        self._show(self._report, _PLANNED)
        self._say(str(error), trouble=True)

    def _show(self, report: LabelReport, words: dict[str, str]) -> None:
        """Show a row for each track, and what else there is to say."""
        self._report = report
        self._bar.setVisible(False)
        rows = [_row(track, words) for track in report.tracks]
        for path, why in report.unread.items():
            rows.append(_trouble(TableRow((path.name, "", "", "", _reason(why, path)))))
        self._model.show(_COLUMNS, rows)
        self.table.fit_columns(stretched=len(_COLUMNS) - 1)
        ready = report.count("new") + report.count("replaced")
        reason = "Add files first." if not rows else "" if ready else "There is nothing to import."
        self._done = ready if words is _DONE else 0
        set_enabled_with_reason(self.go, "These labels are imported." if self._done else reason)
        self._show_remarks()

    def _show_remarks(self) -> None:
        """Show what there is to say: first on the selected rows, whose cells may be too short."""
        indices = self.table.selectionModel().selectedRows()
        selected = [self._model.rows[index.row()] for index in indices]
        lines = [f"{row.cells[0]}: {row.cells[-1]}" for row in selected if row.colours]
        if self._done:
            lines.append(f"{counted(self._done, 'track')} imported.")
        for path, remarks in self._report.remarks.items():
            lines += [f"{path.name}: {name_fields(remark, _FIELDS)}" for remark in remarks]
        self._say("\n".join(lines))

    def _say(self, text: str, trouble: bool = False) -> None:
        self._text.setText(text)
        self._text.setStyleSheet(f"color: {colours().trouble}" if trouble else "")
        self._sentences.setVisible(bool(text))


def _row(track: ImportedTrack, words: dict[str, str]) -> TableRow:
    at = track.demonstration
    result = _reason(track.reason, track.file) or words[track.status]
    result += f": {track.changes}" if track.changes else ""
    name = at.name if at else ""
    row = TableRow((track.file.name, name, track.author, f"{track.segments:,}", result))
    return _trouble(row) if track.reason else row


def _reason(why: str, path: Path) -> str:
    """Why something was left out, as a cell has room for it."""
    return name_fields(why.replace(str(path), path.name), _FIELDS)


def _trouble(row: TableRow) -> TableRow:
    """A row of what is left out."""
    return replace(row, colours=(None, None, None, None, colours().trouble))
