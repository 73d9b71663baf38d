"""The dialog that chooses a demonstration to be played as a device."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from urllib.parse import unquote

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QFormLayout,
    QHeaderView,
    QLabel,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES
from forcelab.gui.file_dialogs import ask_folder
from forcelab.gui.layout import (
    dialog_buttons,
    fill_layout,
    resize_on_screen,
    search_field,
    set_enabled_with_reason,
    toned_label,
)
from forcelab.gui.text import contains_words
from forcelab.gui.widgets import ElidedComboBox
from forcelab.project import DemonstrationInfo, Project

#: What the choice of projects says after them.
ANOTHER = "Another project…"
#: Data of a row: the demonstration.
_INFO = Qt.ItemDataRole.UserRole


def recorded_lines(port: str, options: str) -> list[str]:
    """The rows of text for a device that plays a demonstration, by the parts of its name."""
    values = dict(part.split("=", 1) for part in options.split("&") if "=" in part)
    name, project = unquote(values.get("demonstration", "")), Path(unquote(port)).name
    end = "stops at its end" if values.get("loop") == "no" else "begins again at its end"
    return [name, f"plays as recorded in {project}", end]


class RecordedDeviceDialog(QDialog):
    """Choose a project, first the one that is open, and one of its demonstrations."""

    def __init__(self, document: Document, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Add a recorded demonstration")
        resize_on_screen(self, QSize(520, 480))
        self._document = document
        self._infos: Sequence[DemonstrationInfo] = ()
        self._row = 0  # of the chosen project
        what = QLabel(
            "It plays in real time with the channels, units and rate it was recorded with, as if "
            "its sensors were plugged in."
        )
        what.setWordWrap(True)
        self.project = ElidedComboBox()
        self.project.setAccessibleName("Project of the demonstration")
        self._list_projects()
        self.search = search_field("Search by name or task", "Search demonstrations to play")
        self.search.textChanged.connect(self._list_demonstrations)
        self.demonstrations = QTreeWidget()
        self.demonstrations.setHeaderLabels(["Demonstration", "Task", "Length", "Channels"])
        self.demonstrations.setRootIsDecorated(False)
        self.demonstrations.setUniformRowHeights(True)
        header = self.demonstrations.header()
        header.setStretchLastSection(False)
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        self.demonstrations.setAccessibleName("Demonstration to play")
        self.demonstrations.setTextElideMode(NAMES)
        self.demonstrations.itemDoubleClicked.connect(self.accept)
        self.demonstrations.currentItemChanged.connect(self._update)
        self.loop = QCheckBox("Loop; otherwise it stops at its end, as if it were unplugged")
        self.loop.setChecked(True)
        self._problem = toned_label("trouble")
        self._problem.setVisible(False)
        form = QFormLayout()
        form.addRow("Project", self.project)
        buttons, self.add_button = dialog_buttons(self, "Add the device", "&Add device")
        column = fill_layout(QVBoxLayout(self), what, form, self.search, (self.demonstrations, 1))
        fill_layout(column, self._problem, self.loop, buttons)
        self.add_button.setDefault(True)
        self.project.activated.connect(self._project_chosen)
        self._load()
        self.search.setFocus()

    @property
    def device(self) -> str:
        """The name of the chosen device, as it is typed; empty while none is chosen."""
        from forcelab.capture.device_names import quote_value  # loads what talks to devices

        info = self._chosen()
        if info is None:
            return ""
        alike = sum(other.name == info.name for other in self._infos)
        name = info.name if alike == 1 else info.id
        once = "" if self.loop.isChecked() else "&loop=no"
        path = quote_value(str(self.project.currentData()))
        return f"replay:{path}?demonstration={quote_value(name)}{once}"

    def _list_projects(self) -> None:
        """The open project, those opened last, and a way to any other."""
        project = self._document.project
        here = None if project is None else project.path.resolve()
        if here is not None:
            self.project.addItem(f"This project ({here.name})", here)
        for path in settings.recent_projects():
            if path != here and settings.is_folder(path):
                self.project.addItem(f"{path.name} in {path.parent}", path)
        self.project.insertSeparator(self.project.count())
        self.project.addItem(ANOTHER)

    def _project_chosen(self, row: int) -> None:
        """Show the demonstrations of a project; of another one once its folder is chosen."""
        if self.project.itemText(row) == ANOTHER:
            path = ask_folder(self, "Project of the demonstration", "project")
            if path is not None:
                self._row = row - 1  # above the line
                self.project.insertItem(self._row, f"{path.name} in {path.parent}", path)
            self.project.setCurrentIndex(self._row)
        self._row = self.project.currentIndex()
        self._load()

    def _load(self) -> None:
        """Read which demonstrations the project has."""
        self._infos, problem = (), ""
        path, project = self.project.currentData(), self._document.project
        if project is not None and path == project.path.resolve():
            self._infos = self._document.infos
        elif path is not None:
            try:
                with Project.open(path) as opened:
                    self._infos = opened.demonstrations.infos()
            except ForcelabError as error:
                problem = str(error)
        self._problem.setText(problem)
        self._problem.setVisible(bool(problem))
        self._list_demonstrations()

    def _list_demonstrations(self) -> None:
        """List what is searched for; at first the one that is open is chosen."""
        self.demonstrations.clear()
        for info in self._infos:
            if not contains_words(f"{info.task} {info.name}", self.search.text()):
                continue
            sent = f"{len(info.channels)} at {info.samples / info.duration:.0f} Hz"
            row = QTreeWidgetItem([info.name, info.task, f"{info.duration:.1f} s", sent])
            row.setData(0, _INFO, info)
            row.setToolTip(0, info.name)
            row.setToolTip(3, " ".join(channel.name for channel in info.channels))
            self.demonstrations.addTopLevelItem(row)
            if info.id == self._document.id:
                self.demonstrations.setCurrentItem(row)
        if self._chosen() is None and (first := self.demonstrations.topLevelItem(0)) is not None:
            self.demonstrations.setCurrentItem(first)
        self._update()

    def _chosen(self) -> DemonstrationInfo | None:
        row = self.demonstrations.currentItem()
        info: DemonstrationInfo | None = None if row is None else row.data(0, _INFO)
        return info

    def _update(self) -> None:
        empty = "No demonstration here has that name." if self._infos else "There is none to play."
        set_enabled_with_reason(self.add_button, "" if self._chosen() else empty)
