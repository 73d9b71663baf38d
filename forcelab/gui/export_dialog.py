"""The dialog that exports labels into a folder."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from PySide6.QtWidgets import QCheckBox, QComboBox, QDialog, QFormLayout, QVBoxLayout, QWidget

from forcelab.formats.export import FORMATS, exporting
from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.file_dialogs import ask_folder
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import (
    ProgressBar,
    add_buttons,
    copyable,
    fill_layout,
    set_enabled_with_reason,
)
from forcelab.gui.text import name_fields
from forcelab.gui.widgets import ElidedComboBox
from forcelab.review.run_result import latest_predictions
from forcelab.text import counted

#: Where the settings keep the format that was exported last.
FORMAT_KEY = "export/format"


class ExportDialog(QDialog):
    """Export labels: which, in which format, into which folder.

    What is hidden from the coder is left out. `shown` are the ids of the listed demonstrations.
    """

    def __init__(
        self, document: Document, jobs: Jobs, shown: Sequence[str], parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Export labels")
        self._document, self._jobs = document, jobs
        # The name of a demonstration may be longer than the screen is wide.
        self.which = ElidedComboBox()
        if document.demonstration is not None:
            name = document.demonstration.name
            self.which.addItem(f"This demonstration ({name})", (document.id,))
        if shown:
            self.which.addItem(f"All in the list ({len(shown)})", tuple(shown))
            self.which.setCurrentIndex(self.which.count() - 1)  # what is wanted most
        if len(shown) < len(document.infos):  # the list is searched or narrowed
            all_ = f"The whole project ({len(document.infos)})"
            self.which.addItem(all_, tuple(info.id for info in document.infos))
        self.author = self._author_choice()
        self.format = _format_choice()
        self.format.currentIndexChanged.connect(self._match)
        self.replacing = QCheckBox("Overwrite existing files")
        self._bar = ProgressBar("Progress of the export")
        self._report_label = copyable()
        for choice in (self.which, self.author, self.format):  # what was said is of another export
            choice.currentIndexChanged.connect(self._report_label.clear)
        form = QFormLayout()
        form.addRow("Labels of", self.which)
        form.addRow("Labels by", self.author)
        form.addRow("Format", self.format)
        form.addRow("", self.replacing)
        fill_layout(QVBoxLayout(self), form, self._bar, self._report_label, 1)
        self.go, _ = add_buttons(self, "Export to folder…", self._choose)
        self._match()

    def _author_choice(self) -> ElidedComboBox:
        """All, or the author of any track; the coder's own labels are wanted most."""
        document, choice = self._document, ElidedComboBox()
        authors = [*dict.fromkeys(a for info in document.infos for a in info.authors)]
        coders = () if document.project is None else document.project.coding.coders()
        everybody = "All coders and models" if {*authors} - {*coders} else "All coders"
        choice.addItem(everybody, None)
        for author in authors:
            choice.addItem(author, (author,))
        choice.setCurrentIndex(max(choice.findText(document.author), 0))
        self._author_names = [everybody, *authors]
        return choice

    def export(self, folder: Path) -> None:
        """Write into a folder in the background, and report the result."""
        project = self._document.project
        if project is None:
            return
        set_enabled_with_reason(self.go, "Wait until this is written.")
        self._bar.setVisible(True)
        self._report_label.clear()
        settings.store(FORMAT_KEY, self.format.currentData())
        chosen = () if self._archives else self.which.currentData() or ()
        authors = self.author.currentData() if chosen else None
        infos = [info for info in self._document.infos if info.id in chosen]
        bare = sum(not {*info.authors} & {*(authors or info.authors)} for info in infos)
        what = f"{counted(bare, 'demonstration')} {'has' if bare == 1 else 'have'} no labels"
        by = "" if authors is None else f" by {authors[0]}"
        written = partial(self._written, f".\n{what}{by} yet." if bare else "")
        job = exporting(
            project.path,
            folder,
            self.format.currentData(),
            self.which.currentData(),
            self._document.author,
            self.replacing.isChecked(),
            authors,
            predictions=latest_predictions,
        )
        self._jobs.run(job, written, self._failed, self._bar.show_progress, key="export")

    def reject(self) -> None:
        """Cancel a running export, and close."""
        self._jobs.cancel("export")
        super().reject()

    def _match(self) -> None:
        """Disable what does not matter to a format: an archive holds all, a dataset is there.

        What a run predicts is written with all authors, by formats that hold it.
        """
        predictions = FORMATS[self.format.currentData()].predictions
        for index, name in enumerate(self._author_names):
            addition = " (no predictions)" if index else " and predictions"
            self.author.setItemText(index, f"{name}{addition if predictions else ''}")
        for choice in (self.which, self.author):
            why = "An archive holds all labels." if self._archives else ""
            set_enabled_with_reason(choice, why)
        why = "The dataset is replaced as a whole." if self._into_dataset else ""
        set_enabled_with_reason(self.replacing, why)
        self.go.setText("Write into dataset…" if self._into_dataset else "Export to folder…")

    @property
    def _archives(self) -> bool:
        return bool(self.format.currentData() == "archive")

    @property
    def _into_dataset(self) -> bool:
        return FORMATS[self.format.currentData()].per == "dataset"

    def _choose(self) -> None:
        what = "Dataset to write into" if self._into_dataset else "Folder to write into"
        chosen = ask_folder(self, what, "dataset" if self._into_dataset else "export")
        if chosen is not None:
            self.export(chosen)

    def _written(self, bare: str, files: tuple[Path, ...]) -> None:
        """Report the files, and how many of those chosen have nothing to write."""
        more = f" and {len(files) - 1} more" if len(files) > 1 else ""
        self._report(f"Written: {files[0]}{more}{bare}")

    def _failed(self, error: Exception) -> None:
        # What is chosen in a shell with an option is chosen above.
        self._report(name_fields(str(error), {"--author": "Labels by"}))

    def _report(self, text: str) -> None:
        self._bar.setVisible(False)
        set_enabled_with_reason(self.go, "")
        self._report_label.setText(text)


def _format_choice() -> QComboBox:
    """The formats by their groups, beginning with the one that was exported last."""
    choice = QComboBox()
    for name, format_ in FORMATS.items():
        before = FORMATS.get(str(choice.itemData(choice.count() - 1)))
        if before is not None and before.group != format_.group:
            choice.insertSeparator(choice.count())
        choice.addItem(format_.label, name)
    choice.setCurrentIndex(max(choice.findData(settings.text(FORMAT_KEY)), 0))
    return choice
