"""Devices and cameras: what is plugged in, what was added by hand, and what is chosen.

A recorded demonstration can be chosen, too, and plays as a device.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

from PySide6.QtCore import QPoint, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QFormLayout,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QMenu,
    QSizePolicy,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import ForcelabError, InputError
from forcelab.gui import settings
from forcelab.gui.capture.controller import CaptureController
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES
from forcelab.gui.file_dialogs import ask_file, ask_folder
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import (
    UNLIMITED,
    dialog_buttons,
    emphasise,
    fill_layout,
    push_button,
    resize_on_screen,
    run_dialog,
    search_field,
    sentence_label,
    set_enabled_with_reason,
    toned_label,
)
from forcelab.gui.text import contains_words
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import ElidedComboBox
from forcelab.project import DemonstrationInfo, Project

if TYPE_CHECKING:
    from forcelab.capture.discovery import FoundCamera, FoundPort
    from forcelab.capture.lsl import FoundStream


#: How a device was found: its name, what it is, and whether it may be opened.
FoundDevice = tuple[str, str, bool]
#: What stands before the number or path of a camera.
CAMERA = "camera:"
#: Data of a row: its name as it is typed, and how it was found.
_NAME, _FOUND = (Qt.ItemDataRole.UserRole + i for i in range(2))


class DeviceRows(QListWidget):
    """Rows of devices, by their names."""

    delete_pressed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setSpacing(2)
        self.setTextElideMode(NAMES)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        themes().changed.connect(self._colour)
        self._colour()

    def keeps(self, event: QKeyEvent) -> bool:
        """Delete is for the rows before it is for a command of the window."""
        return event.matches(QKeySequence.StandardKey.Delete)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if self.keeps(event):
            self.delete_pressed.emit()
        else:
            super().keyPressEvent(event)

    def all_items(self) -> list[QListWidgetItem]:
        """All rows in their order."""
        return [self.item(i) for i in range(self.count())]

    def names(self) -> list[str]:
        """All names in their order, as they are typed."""
        return [self.name_of(item) for item in self.all_items()]

    def name_of(self, item: QListWidgetItem) -> str:
        """A row's name as it is typed."""
        return str(item.data(_NAME))

    def row_of(self, name: str) -> QListWidgetItem | None:
        """The row with a name."""
        return next((item for item in self.all_items() if self.name_of(item) == name), None)

    def ticked(self) -> tuple[str, ...]:
        """The names of the rows that are ticked, in their order."""
        checked = Qt.CheckState.Checked
        return tuple(self.name_of(i) for i in self.all_items() if i.checkState() == checked)

    def add_row(self, name: str, device: FoundDevice | None = None) -> QListWidgetItem:
        """Add a row by its name as it is typed, or give the one with that name.

        `device` is how it was found where it is plugged in.
        """
        if (row := self.row_of(name)) is not None:
            row.setData(_FOUND, device or found_as(row))
            return row
        _, description, usable = device or ("", "", True)
        kind, _, rest = name.partition(":")
        short, _, options = name.partition("?")
        if kind == "replay":
            short, *more = recorded_lines(rest.partition("?")[0], options)
            description, options = "\n".join(more), ""
        raw = kind == "optoforce" and "calibration=" not in options
        uncalibrated = "not calibrated: raw counts" if raw else ""
        denied = "" if usable else "not yours to open"
        lines = [short, description, options, denied, uncalibrated]
        item = QListWidgetItem("\n".join(line for line in lines if line))
        item.setToolTip("\n".join([name, *filter(None, (description, denied, uncalibrated))]))
        item.setData(_NAME, name)
        item.setData(_FOUND, device)
        item.setCheckState(Qt.CheckState.Unchecked)
        self.addItem(item)
        return item

    def _colour(self) -> None:
        """Devices that are connected cannot be ticked, and are to be read all the while."""
        self.setStyleSheet(f"QListWidget:disabled {{ color: {colours().muted}; }}")


def sends_counts(item: QListWidgetItem) -> bool:
    """Whether a row is a device that gives counts, of which a calibration makes newtons."""
    return str(item.data(_NAME)).startswith("optoforce:")


def found_as(item: QListWidgetItem) -> FoundDevice | None:
    """How a row's device was found; None where it was added by hand."""
    device: FoundDevice | None = item.data(_FOUND)
    return device


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
        what = sentence_label(
            "It plays in real time with the channels, units and rate it was recorded with, as if "
            "its sensors were plugged in."
        )
        self.project = ElidedComboBox()
        self.project.setAccessibleName("Project of the demonstration")
        self._list_projects()
        self.search = search_field("Search by name or task", "Search demonstrations to play")
        self.search.textChanged.connect(self._list_demonstrations)
        self.demonstrations = QTreeWidget()
        self.demonstrations.setRootIsDecorated(False)
        self.demonstrations.setUniformRowHeights(True)
        self.demonstrations.setHeaderLabels(["Demonstration", "Task", "Length", "Channels"])
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


#: The keys of the jobs that look.
SEARCH_JOB, STREAM_JOB = "capture: what is plugged in", "capture: streams in the network"
#: Where the devices that were ticked last are remembered.
TICKED, BY_HAND = "capture/ticked", "capture/by hand"
#: Pixels that devices that are connected need not exceed.
HIGHEST = 120


class DeviceList(QWidget):
    """A list with check boxes, and a line to add to it."""

    def __init__(self, controller: CaptureController, jobs: Jobs) -> None:
        super().__init__()
        self._controller, self._jobs = controller, jobs
        self._remembered: set[str] | None = None  # were ticked last, and have not been found yet
        self._found: tuple[tuple[FoundPort, ...], tuple[FoundCamera, ...]] = (), ()
        self._streams: tuple[FoundStream, ...] = ()
        self._choosing = True
        self.rows = DeviceRows()
        self.rows.setAccessibleName("Devices and cameras")
        self.refresh_button = push_button("Refresh", self.refresh, "Refresh the list of devices")
        self.entry = QLineEdit(placeholderText="optoforce:PORT?calibration=FILE")
        self.entry.setToolTip(
            "A device by its name: optoforce:PORT, text:PORT, encoder:PORT, netft:ADDRESS, "
            "lsl:STREAM or replay:PROJECT with options behind a question mark; or camera:NUMBER. "
            "Return adds it."
        )
        self.entry.setAccessibleName("Add a device by its name")
        self.entry.returnPressed.connect(self._add_entry)
        self.calibration_button = push_button(
            "Calibration…",
            self._ask_calibration,
            "Choose the device's calibration file",
            "A file that makes newtons of the counts of the chosen OptoForce DAQ",
        )
        self.recorded_button = push_button(
            "Recorded demonstration…",
            self._ask_recorded,
            "Add a recorded demonstration as a device",
            "Play a demonstration as if its sensors were plugged in",
        )
        self.rows.currentItemChanged.connect(self._update_notes)
        self.rows.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.rows.customContextMenuRequested.connect(self._show_menu)
        self.rows.delete_pressed.connect(self._remove)
        self.nothing = sentence_label(
            "Nothing was found; plug a device in, or add one below. Without any, a recorded "
            "demonstration plays as if its sensors were plugged in."
        )
        heading = QLabel("Devices")
        emphasise(heading)
        top = fill_layout(QHBoxLayout(), (heading, 1), self.refresh_button)
        self.nothing.setAlignment(Qt.AlignmentFlag.AlignTop)
        column = fill_layout(QVBoxLayout(self), top, (self.rows, 1), (self.nothing, 1), margins=0)
        fill_layout(column, self.calibration_button, self.recorded_button, self.entry)
        for name in settings.strings(BY_HAND):
            self.rows.add_row(name)
        self._update_notes()

    @property
    def devices(self) -> tuple[str, ...]:
        """Names of the devices that are ticked."""
        return tuple(name for name in self.rows.ticked() if not name.startswith(CAMERA))

    @property
    def cameras(self) -> tuple[str, ...]:
        """Numbers or paths of the cameras that are ticked."""
        ticked = self.rows.ticked()
        return tuple(name.removeprefix(CAMERA) for name in ticked if name.startswith(CAMERA))

    def set_choosing(self, choosing: bool) -> None:
        """Let devices be chosen; else show those that are ticked, and take no more room."""
        set_enabled_with_reason(self, "" if choosing else "Disconnect to choose other devices.")
        upright = QSizePolicy.Policy.Expanding if choosing else QSizePolicy.Policy.Maximum
        self.setSizePolicy(QSizePolicy.Policy.Preferred, upright)
        self.refresh_button.setVisible(choosing)
        self.recorded_button.setVisible(choosing)
        self.entry.setVisible(choosing)
        self._choosing = choosing
        self._update_notes()
        height = 2 * (self.rows.frameWidth() + self.rows.spacing())
        for i in range(self.rows.count()):
            ticked = self.rows.item(i).checkState() == Qt.CheckState.Checked
            self.rows.setRowHidden(i, not (choosing or ticked))
            if ticked:
                height += self.rows.sizeHintForRow(i) + 2 * self.rows.spacing()
        self.rows.setMinimumHeight(0 if choosing else min(height, HIGHEST))
        self.rows.setMaximumHeight(UNLIMITED if choosing else height)

    def refresh(self) -> None:
        """Find what is plugged in, and the streams in the network."""
        self._jobs.run(_find_devices(), self._show_found, self._failed, key=SEARCH_JOB)
        self._jobs.run(_find_streams(), self._show_streams, self._failed, key=STREAM_JOB)

    def add(self, name: str) -> None:
        """Add a device by its name, and tick it."""
        item = self.rows.add_row(name)
        item.setCheckState(Qt.CheckState.Checked)
        by_hand = settings.strings(BY_HAND)
        settings.store(BY_HAND, tuple(dict.fromkeys((*by_hand, name)))[-8:])
        self._update_notes()

    def remember(self) -> None:
        """Keep what is ticked for the next time; of what was added by hand, that too."""
        ticked = self.rows.ticked()
        settings.store(TICKED, ticked)
        by_hand = settings.strings(BY_HAND)  # a calibration is kept: it is not easily found again
        settings.store(BY_HAND, [n for n in by_hand if n in ticked or "calibration=" in n])

    def _add_entry(self) -> None:
        """Take what was written."""
        name = self.entry.text().strip()
        if name and self._is_valid(name):
            self.add(name)
            self.entry.clear()

    def _is_valid(self, name: str) -> bool:
        """Whether a name is that of a device; shows what is wrong with it otherwise."""
        from forcelab.capture.camera import check_camera
        from forcelab.capture.device_names import parse_device

        self._controller.clear_messages()
        kind, _, camera = name.partition(":")
        try:
            if kind == "camera":
                check_camera(camera)
            else:
                parse_device(name)
        except InputError as error:
            self._controller.add_message(str(error), True)
            return False
        return True

    def _ask_recorded(self) -> None:
        """Let a demonstration be chosen that plays as a device."""
        dialog = RecordedDeviceDialog(self._controller.document, self)
        if run_dialog(dialog):
            self.add(dialog.device)

    def _ask_calibration(self) -> None:
        """Let a calibration file be chosen for the current device."""
        from forcelab.capture.device_names import with_calibration

        item = self.rows.currentItem()
        if item is None or not sends_counts(item):
            return
        name = self.rows.name_of(item)
        file = ask_file(self, "Calibration file", "calibration", "Calibration files (*.toml)")
        if file is not None:
            self._rename(name, with_calibration(name, file))

    def _rename(self, old: str, name: str) -> None:
        """Give a device other options, where they mean something and it is still in the list."""
        item = self.rows.row_of(old)
        if item is None or not self._is_valid(name):
            return
        device = found_as(item)
        self.rows.takeItem(self.rows.row(item))
        settings.store(BY_HAND, [item for item in settings.strings(BY_HAND) if item != old])
        row = self.rows.add_row(name, device)
        if device is None or name != device[0]:
            self.add(name)
        row.setCheckState(Qt.CheckState.Checked)
        self.rows.setCurrentItem(row)
        self._update_notes()

    def _show_menu(self, at: QPoint) -> None:
        item = self.rows.itemAt(at)
        if item is None:
            return
        self.rows.setCurrentItem(item)
        menu = self.menu()
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(self.rows.viewport().mapToGlobal(at))

    def menu(self) -> QMenu:
        """What can be done with the current device."""
        from forcelab.capture.device_names import with_calibration

        menu, item = QMenu(self), self.rows.currentItem()
        if item is not None and sends_counts(item):
            menu.addAction("Calibration file…", self._ask_calibration)
            name = self.rows.name_of(item)
            plain = with_calibration(name, None)
            bare = menu.addAction("No calibration", lambda: self._rename(name, plain))
            set_enabled_with_reason(bare, "It has none." if plain == name else "")
        remove = menu.addAction("Remove", self._remove)
        remove.setShortcut(QKeySequence(QKeySequence.StandardKey.Delete))
        by_hand = item is not None and found_as(item) is None
        plugged = "" if by_hand else "Only devices added by hand are removed."
        set_enabled_with_reason(remove, plugged)
        return menu

    def _remove(self) -> None:
        """Take the current device off the list, if it was added by hand."""
        item = self.rows.currentItem()
        if item is None or not self._choosing:
            return
        name = self.rows.name_of(item)
        if found_as(item) is not None:
            plugged = name.partition("?")[0]
            self._controller.add_message(f"{plugged} is plugged in; untick it to leave it out.")
            return
        self.rows.takeItem(self.rows.row(item))
        for key in (BY_HAND, TICKED):
            settings.store(key, [stored for stored in settings.strings(key) if stored != name])
        self._update_notes()

    def _failed(self, error: Exception) -> None:
        self._controller.add_message(str(error), True)

    def _show_found(self, devices: tuple[tuple[FoundPort, ...], tuple[FoundCamera, ...]]) -> None:
        self._found = devices
        self._show()

    def _show_streams(self, streams: tuple[FoundStream, ...]) -> None:
        self._streams = streams
        self._show()

    def _show(self) -> None:
        """Show what was found, below it what was added by hand; ticks stay."""
        from forcelab.capture.device_names import name_stream

        ports, cameras = self._found
        if self._remembered is None:
            self._remembered = set(settings.strings(TICKED))
        ticked = self._remembered.union(self.rows.ticked())
        current, by_hand = self.rows.currentItem(), settings.strings(BY_HAND)
        chosen = "" if current is None else self.rows.name_of(current)
        names = dict.fromkeys((*self.rows.names(), *by_hand))
        self.rows.clear()
        ticked_first = sorted(names, key=lambda n: (n not in ticked, "?" not in n))
        found: list[FoundDevice] = [
            (port.device, port.description, port.usable)
            for port in ports
            if port.device is not None
        ]
        found += [(name_stream(stream), stream.description, True) for stream in self._streams]
        for device in found:
            plugged, _, usable = device
            # What was said of a device by hand, such as its calibration, holds for it.
            matching = (n for n in ticked_first if n.partition("?")[0] == plugged)
            name = next(matching, plugged)
            item = self.rows.add_row(name, device)
            # The tongs are what one comes for: they need no click.
            if not ticked and plugged.startswith("optoforce:") and usable:
                item.setCheckState(Qt.CheckState.Checked)
        for camera in cameras:
            name = CAMERA + camera.device.removeprefix("/dev/video")
            self.rows.add_row(name, (name, camera.name, camera.usable))
        for name in names:
            if (name in ticked or name in by_hand) and self.rows.row_of(name) is None:
                self.rows.add_row(name)
        for item in self.rows.all_items():
            if self.rows.name_of(item) in ticked:
                item.setCheckState(Qt.CheckState.Checked)
            if self.rows.name_of(item) == chosen:
                self.rows.setCurrentItem(item)
        self._remembered -= set(self.rows.names())
        self.set_choosing(self._choosing)  # they may have been connected while it was looked

    def _update_notes(self) -> None:
        """Show a note where the list is empty, and the button where a device needs it."""
        self.nothing.setVisible(not self.rows.count())
        self.rows.setVisible(self.rows.count() > 0)
        item = self.rows.currentItem()
        sends_raw = any(map(sends_counts, self.rows.all_items()))
        self.calibration_button.setVisible(self._choosing and sends_raw)
        counts = item is not None and sends_counts(item)
        choose = "" if counts else "Choose a device that sends raw counts."
        set_enabled_with_reason(self.calibration_button, choose)


def _find_devices() -> Generator[None, None, tuple[tuple[FoundPort, ...], tuple[FoundCamera, ...]]]:
    from forcelab.capture.discovery import find_cameras, find_ports

    yield
    return find_ports(), find_cameras()


def _find_streams() -> Generator[None, None, tuple[FoundStream, ...]]:
    from forcelab.capture.lsl import search_streams

    found: tuple[FoundStream, ...] = ()
    for streams in search_streams():
        found = streams
        yield
    return found
