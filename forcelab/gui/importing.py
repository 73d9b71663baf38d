"""The dialog that brings recordings into the open project."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import (
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QDoubleSpinBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QListWidget,
    QProgressBar,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from forcelab.formats.importing import ImportReport, importing
from forcelab.formats.recording import ReadOptions
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.naming import settled_name
from forcelab.gui.theme import colours
from forcelab.jobs import Progress

__all__ = ["ImportDialog"]


class ImportDialog(QDialog):
    """Files, their task, the coder of their labels; then the import itself and what became of it.

    Parameters
    ----------
    document : Document
        Its project receives the recordings.
    jobs : Jobs
        Reads and writes in the background.
    parent : QWidget, optional
    files : sequence of Path
        Chosen already, such as by dropping them on the window.
    """

    def __init__(
        self,
        document: Document,
        jobs: Jobs,
        parent: QWidget | None = None,
        files: Sequence[Path] = (),
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle(self.tr("Import recordings"))
        self.resize(560, 420)
        self._document, self._jobs = document, jobs
        self._files = QListWidget()
        self._files.setAccessibleName(self.tr("Files to import"))
        self._make_removable()
        choose = QPushButton(self.tr("Choose files…"))
        choose.clicked.connect(self._choose)
        self._task = QComboBox()
        self._task.setEditable(True)
        self._task.setAccessibleName(self.tr("Task"))
        self._task.addItems(document.project.tasks() if document.project else ())
        self._task.setCurrentText(document.demonstration.task if document.demonstration else "")
        self._author = self._author_choice()
        self._rate = QDoubleSpinBox()
        self._rate.setRange(0, 1e6)
        self._rate.setSuffix(self.tr(" Hz"))
        self._rate.setSpecialValueText(self.tr("as the stamps say"))
        self._rate.setAccessibleName(self.tr("Sample rate of files without stamps"))
        form = QFormLayout()
        form.addRow(self.tr("Task"), self._task)
        self._taskless = self._warning()
        form.addRow("", self._taskless)
        form.addRow(self.tr("Coder of labels, where a file names none"), self._author)
        form.addRow(self.tr("Sample rate, where files have no stamps"), self._rate)
        self._bar = QProgressBar()
        self._bar.setVisible(False)
        self._bar.setAccessibleName(self.tr("Progress of the import"))
        self._told = QLabel()
        self._told.setWordWrap(True)
        self._buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        self._go = QPushButton(self.tr("Import"))
        self._buttons.addButton(self._go, QDialogButtonBox.ButtonRole.ActionRole)
        self._go.setDefault(True)
        self._go.clicked.connect(self._import)
        self._buttons.rejected.connect(self.reject)
        top = QHBoxLayout()
        top.addWidget(
            QLabel(
                self.tr("Tables (CSV, TSV), the paper's databases (*.pdl), archives of projects")
            )
        )
        top.addStretch(1)
        top.addWidget(choose)
        column = QVBoxLayout(self)
        column.addLayout(top)
        column.addWidget(self._files, 1)
        column.addLayout(form)
        column.addWidget(self._bar)
        column.addWidget(self._told)
        column.addWidget(self._buttons)
        self._warn()
        self.add_files(files)

    def add_files(self, files: Sequence[Path]) -> None:
        """Add to what will be imported."""
        known = {self._files.item(row).text() for row in range(self._files.count())}
        self._files.addItems([str(path) for path in files if str(path) not in known])
        self._go.setEnabled(self._files.count() > 0)

    def reject(self) -> None:
        """Stop an import that goes on, and close."""
        self._jobs.cancel("import")
        super().reject()

    def _warning(self) -> QLabel:
        """What is said where no task is named."""
        label = QLabel(
            self.tr(
                "Without a task, files that name none go under 'No task', all together. Name what "
                "is done in them, such as stylus; recordings of another task are imported apart."
            )
        )
        label.setWordWrap(True)
        self._task.currentTextChanged.connect(self._warn)
        return label

    def _warn(self) -> None:
        """Say plainly what becomes of recordings without a task; that is allowed."""
        missing = not self._task.currentText().strip()
        self._taskless.setVisible(missing)
        self._taskless.setStyleSheet(f"color: {colours().warning}")
        self._go.setText(self.tr("Import without a task") if missing else self.tr("Import"))

    def _make_removable(self) -> None:
        """Let files be left out again, by Delete or the menu."""
        self._files.setSelectionMode(QListWidget.SelectionMode.ExtendedSelection)
        remove = QAction(self.tr("Do not import it"), self)
        remove.setShortcut(QKeySequence.StandardKey.Delete)
        remove.setShortcutContext(Qt.ShortcutContext.WidgetShortcut)
        remove.triggered.connect(self._remove)
        self._files.addAction(remove)
        self._files.setContextMenuPolicy(Qt.ContextMenuPolicy.ActionsContextMenu)

    def _choose(self) -> None:
        """Let the user choose files."""
        chosen, _ = QFileDialog.getOpenFileNames(self, self.tr("Recordings"))
        self.add_files([Path(name) for name in chosen])
        if chosen:
            self._go.setFocus()

    def _remove(self) -> None:
        """Leave out the files that are selected."""
        for item in self._files.selectedItems():
            self._files.takeItem(self._files.row(item))
        self._go.setEnabled(self._files.count() > 0)

    def _import(self) -> None:
        """Import in the background."""
        project = self._document.project
        if project is None:
            return
        options = ReadOptions(
            task=settled_name(self, self._task.currentText(), project.tasks()) or None,
            author=settled_name(self, self._author.currentText(), self._coders())
            or ReadOptions().author,
            rate=self._rate.value() or None,
        )
        files = [self._files.item(row).text() for row in range(self._files.count())]
        self._go.setEnabled(False)
        self._bar.setVisible(True)
        self._told.clear()
        self._jobs.run(
            importing(project.path, files, options),
            self._imported,
            self._failed,
            self._show,
            key="import",
        )

    def _author_choice(self) -> QComboBox:
        """Whose the labels are: labels that are brought were seldom made by who sits here now."""
        choice = QComboBox()
        choice.setEditable(True)
        choice.setAccessibleName(self.tr("Coder of labels, where a file names none"))
        names = [ReadOptions().author, *self._coders(), self._document.author]
        choice.addItems(list(dict.fromkeys(names)))
        return choice

    def _coders(self) -> list[str]:
        """Whose labels the project has."""
        project = self._document.project
        return [a.name for a in project.authors() if a.kind == "coder"] if project else []

    def _show(self, progress: Progress) -> None:
        """Show how far it is."""
        self._bar.setRange(0, progress.total)
        self._bar.setValue(progress.done)
        self._bar.setFormat(progress.text)

    def _imported(self, report: ImportReport) -> None:
        """Say what became of the files."""
        self._bar.setVisible(False)
        self._files.clear()
        counts = [report.count(status) for status in ("new", "updated", "unchanged")]
        lines = [self.tr("{0} new, {1} updated, {2} unchanged.").format(*counts)]
        for path, remarks in report.remarks.items():
            lines += [f"{path.name}: {remark}" for remark in remarks[:3]]
        self._told.setText("\n".join(lines[:12]))
        self._document.refresh_listing()
        if not self._document.id and self._document.infos:
            self._document.open_demonstration(self._document.infos[0].id)
        self._buttons.button(QDialogButtonBox.StandardButton.Close).setFocus()

    def _failed(self, error: Exception) -> None:
        """Say what stands in the way; nothing was imported."""
        self._bar.setVisible(False)
        self._go.setEnabled(True)
        self._told.setText(str(error))
