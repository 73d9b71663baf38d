"""Devices and cameras: what is plugged in, what was added by hand, and what is chosen."""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QPoint, Qt, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QMenu,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import InputError
from forcelab.gui import settings
from forcelab.gui.capture.controller import CaptureController
from forcelab.gui.figures.text import NAMES
from forcelab.gui.file_dialogs import ask_file
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import emphasise, set_enabled_with_reason
from forcelab.gui.theme import colours, themes

if TYPE_CHECKING:
    from forcelab.capture.discovery import Camera, FoundPort


#: How a device was found: its name, what it is, and whether it may be opened.
FoundDevice = tuple[str, str, bool]
#: What is kept with a row: ``"device"`` or ``"camera"``, its name, and how it was found.
_KIND, _NAME, _FOUND = (Qt.ItemDataRole.UserRole + i for i in range(3))


class DeviceRows(QListWidget):
    """Rows of devices, by their names.

    Signals
    -------
    delete_pressed()
        The Delete key was pressed.
    """

    delete_pressed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setSpacing(2)
        self.setTextElideMode(NAMES)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        themes().changed.connect(self._colour)
        self._colour()

    def event(self, event: QEvent) -> bool:
        """Delete is for the rows before it is for a command of the window."""
        if (
            isinstance(event, QKeyEvent)
            and event.type() == QEvent.Type.ShortcutOverride
            and event.matches(QKeySequence.StandardKey.Delete)
        ):
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Delete is for the current row."""
        if event.matches(QKeySequence.StandardKey.Delete):
            self.delete_pressed.emit()
        else:
            super().keyPressEvent(event)

    def items_here(self) -> list[QListWidgetItem]:
        """All rows in their order."""
        return [self.item(i) for i in range(self.count())]

    def names(self) -> list[str]:
        """All names in their order, as they are typed."""
        return [self.said(item) for item in self.items_here()]

    def said(self, item: QListWidgetItem) -> str:
        """A row's name as it is typed."""
        prefix = "camera:" if item.data(_KIND) == "camera" else ""
        return prefix + str(item.data(_NAME))

    def ticked(self, kind: str) -> tuple[str, ...]:
        """The names of the devices or cameras that are ticked, in their order."""
        return tuple(
            str(item.data(_NAME))
            for item in self.items_here()
            if item.data(_KIND) == kind and item.checkState() == Qt.CheckState.Checked
        )

    def put(
        self, name: str, what: str = "", usable: bool = True, found: FoundDevice | None = None
    ) -> QListWidgetItem:
        """Add a row, or give the one that there is.

        Parameters
        ----------
        name : str
            As it is typed.
        what : str
            What it is, in words.
        usable : bool
            Whether it may be opened.
        found : (str, str, bool), optional
            How it was found, where it is plugged in: name, `what` and `usable`.
        """
        for row in self.items_here():
            if self.said(row) == name:
                row.setData(_FOUND, display_name(row) if found is None else found)
                return row
        kind, _, rest = name.partition(":")
        short, _, options = name.partition("?")
        raw = kind == "optoforce" and "calibration=" not in options
        uncalibrated = "not calibrated: raw counts" if raw else ""
        denied = "" if usable else "not yours to open"
        lines = [short, what, options, denied, uncalibrated]
        item = QListWidgetItem("\n".join(line for line in lines if line))
        item.setToolTip("\n".join([name, *filter(None, (what, denied, uncalibrated))]))
        item.setData(_KIND, "camera" if kind == "camera" else "device")
        item.setData(_NAME, rest if kind == "camera" else name)
        item.setData(_FOUND, found)
        item.setFlags(
            Qt.ItemFlag.ItemIsEnabled
            | Qt.ItemFlag.ItemIsSelectable
            | Qt.ItemFlag.ItemIsUserCheckable
        )
        item.setCheckState(Qt.CheckState.Unchecked)
        self.addItem(item)
        return item

    def _colour(self) -> None:
        """What is connected cannot be ticked, and is to be read all the while."""
        self.setStyleSheet(f"QListWidget:disabled {{ color: {colours().muted}; }}")


def device_counts(item: QListWidgetItem) -> bool:
    """Whether a row is a device that gives counts, of which a calibration makes newtons."""
    return item.data(_KIND) == "device" and str(item.data(_NAME)).startswith("optoforce:")


def display_name(item: QListWidgetItem) -> FoundDevice | None:
    """How a row's device was found; None where it was added by hand."""
    found: FoundDevice | None = item.data(_FOUND)
    return found


#: The key of the job that looks.
SEARCHING = "capture: what is plugged in"
#: Where the devices that were ticked last are remembered.
TICKED, BY_HAND = "capture/ticked", "capture/by hand"
#: Pixels: Qt's greatest height of a widget, and what devices that are connected need not exceed.
UNBOUNDED, HIGHEST = 16_777_215, 120


class DeviceList(QWidget):
    """A list with check boxes, and a line to add to it.

    Parameters
    ----------
    session : Session
    jobs : Jobs
    """

    def __init__(self, session: CaptureController, jobs: Jobs) -> None:
        super().__init__()
        self._session, self._jobs = session, jobs
        self._first = True  # nobody has looked yet
        self._choosing = True
        self.rows = DeviceRows()
        self.rows.setAccessibleName("Devices and cameras")
        self.refresh_button = QPushButton("Refresh")
        self.refresh_button.setAccessibleName("Look again what is plugged in")
        self.refresh_button.clicked.connect(self.look)
        self.entry = QLineEdit()
        self.entry.setPlaceholderText("optoforce:PORT?calibration=FILE")
        self.entry.setToolTip(
            "A device by its name: optoforce:PORT, text:PORT or encoder:PORT with options "
            "behind a question mark; or camera:NUMBER. Return adds it."
        )
        self.entry.setAccessibleName("Add a device by its name")
        self.entry.returnPressed.connect(self._enter)
        self.calibration_button = QPushButton("Calibration…")
        self.calibration_button.setAccessibleName("Choose the device's calibration file")
        self.calibration_button.setToolTip(
            "A file that makes newtons of the counts of the chosen OptoForce DAQ"
        )
        self.calibration_button.clicked.connect(self._ask_calibration)
        self.rows.currentItemChanged.connect(self._show_empty_note)
        self.rows.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.rows.customContextMenuRequested.connect(self._offer)
        self.rows.delete_pressed.connect(self._remove)
        self.nothing = QLabel(
            "Nothing was found; plug a device in, or add one below. Without any, 'forcelab "
            "replay' on the command line plays a demonstration as one; add the name it prints."
        )
        self.nothing.setWordWrap(True)
        heading = QLabel("Devices")
        emphasise(heading)
        top = QHBoxLayout()
        top.addWidget(heading, 1)
        top.addWidget(self.refresh_button)
        self.nothing.setAlignment(Qt.AlignmentFlag.AlignTop)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(top)
        column.addWidget(self.rows, 1)
        column.addWidget(self.nothing, 1)
        column.addWidget(self.calibration_button)
        column.addWidget(self.entry)
        for name in settings.strings(BY_HAND):
            self.rows.put(name)
        self._show_empty_note()

    @property
    def devices(self) -> tuple[str, ...]:
        """Names of the devices that are ticked."""
        return self.rows.ticked("device")

    @property
    def cameras(self) -> tuple[str, ...]:
        """Numbers or paths of the cameras that are ticked."""
        return self.rows.ticked("camera")

    def set_open(self, choosing: bool) -> None:
        """Let devices be chosen; else show those that are ticked, and take no more room."""
        self.setEnabled(choosing)
        upright = QSizePolicy.Policy.Expanding if choosing else QSizePolicy.Policy.Maximum
        self.setSizePolicy(QSizePolicy.Policy.Preferred, upright)
        self.refresh_button.setVisible(choosing)
        self.entry.setVisible(choosing)
        self._choosing = choosing
        self._show_empty_note()
        height = 2 * (self.rows.frameWidth() + self.rows.spacing())
        for i in range(self.rows.count()):
            ticked = self.rows.item(i).checkState() == Qt.CheckState.Checked
            self.rows.setRowHidden(i, not (choosing or ticked))
            if ticked:
                height += self.rows.sizeHintForRow(i) + 2 * self.rows.spacing()
        self.rows.setMinimumHeight(0 if choosing else min(height, HIGHEST))
        self.rows.setMaximumHeight(UNBOUNDED if choosing else height)

    def look(self) -> None:
        """Look what is plugged in."""
        self._jobs.run(_find_devices(), self._list, self._failed, key=SEARCHING)

    def add(self, name: str) -> None:
        """Add a device by its name, and tick it."""
        item = self.rows.put(name)
        item.setCheckState(Qt.CheckState.Checked)
        known = settings.strings(BY_HAND)
        settings.store(BY_HAND, tuple(dict.fromkeys((*known, name)))[-8:])
        self._show_empty_note()

    def remember(self) -> None:
        """Keep what is ticked for the next time; of what was added by hand, that too."""
        ticked = (*self.devices, *(f"camera:{one}" for one in self.cameras))
        settings.store(TICKED, ticked)
        known = settings.strings(BY_HAND)  # a calibration is kept: it is not easily found again
        settings.store(BY_HAND, [n for n in known if n in ticked or "calibration=" in n])

    # Inside

    def _enter(self) -> None:
        """Take what was written."""
        name = self.entry.text().strip()
        if name and self._means(name):
            self.add(name)
            self.entry.clear()

    def _means(self, name: str) -> bool:
        """Whether a name means a device; says what is wrong with it otherwise."""
        from forcelab.capture.camera import check_camera
        from forcelab.capture.devices import device_named

        self._session.unsay()
        kind, _, which = name.partition(":")
        try:
            if kind == "camera":
                check_camera(which)
            else:
                device_named(name)
        except InputError as error:
            self._session.say(str(error), True)
            return False
        return True

    def _ask_calibration(self) -> None:
        """Let a calibration file be chosen for the current device."""
        from forcelab.capture.devices import calibrated_by

        item = self.rows.currentItem()
        if item is None or not device_counts(item):
            return
        name = self.rows.said(item)
        kinds = "Calibration files (*.toml)"
        file = ask_file(self, "Calibration file", "calibration", kinds)
        if file is not None:
            self._rename(name, calibrated_by(name, file))

    def _rename(self, old: str, name: str) -> None:
        """Give a device other options, where they mean something and it is still there."""
        item = next((one for one in self.rows.items_here() if self.rows.said(one) == old), None)
        if item is None or not self._means(name):
            return
        found = display_name(item)
        self.rows.takeItem(self.rows.row(item))
        settings.store(BY_HAND, [one for one in settings.strings(BY_HAND) if one != old])
        what, usable = ("", True) if found is None else found[1:]
        fresh = self.rows.put(name, what, usable, found=found)
        if found is None or name != found[0]:
            self.add(name)
        fresh.setCheckState(Qt.CheckState.Checked)
        self.rows.setCurrentItem(fresh)
        self._show_empty_note()

    def _offer(self, at: QPoint) -> None:
        """Offer what can be done with a device."""
        item = self.rows.itemAt(at)
        if item is None:
            return
        self.rows.setCurrentItem(item)
        menu = self.menu()
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(self.rows.viewport().mapToGlobal(at))

    def menu(self) -> QMenu:
        """What can be done with the current device."""
        from forcelab.capture.devices import calibrated_by

        menu, item = QMenu(self), self.rows.currentItem()
        if item is not None and device_counts(item):
            menu.addAction("Calibration file…", self._ask_calibration)
            name = self.rows.said(item)
            plain = calibrated_by(name, None)
            bare = menu.addAction("No calibration", lambda: self._rename(name, plain))
            set_enabled_with_reason(bare, "It has none." if plain == name else "")
        remove = menu.addAction("Remove", self._remove)
        remove.setShortcut(QKeySequence(QKeySequence.StandardKey.Delete))
        own = item is not None and display_name(item) is None
        set_enabled_with_reason(remove, "" if own else "Only devices added by hand are removed.")
        return menu

    def _remove(self) -> None:
        """Take the current device off the list, if it was added by hand."""
        item = self.rows.currentItem()
        if item is None or not self._choosing:
            return
        name = self.rows.said(item)
        if display_name(item) is not None:
            self._session.say(
                "{} is plugged in; untick it to leave it out.".format(name.partition("?")[0])
            )
            return
        self.rows.takeItem(self.rows.row(item))
        for key in (BY_HAND, TICKED):
            settings.store(key, [one for one in settings.strings(key) if one != name])
        self._show_empty_note()

    def _failed(self, error: Exception) -> None:
        self._session.say(str(error), True)

    def _list(self, found: tuple[tuple[FoundPort, ...], tuple[Camera, ...]]) -> None:
        """Show what was found, below it what was added by hand; ticks stay."""
        ports, films = found
        ticked = {*self.devices, *(f"camera:{one}" for one in self.cameras)}
        if self._first:
            self._first = False
            ticked |= set(settings.strings(TICKED))
        by_hand, current = self.rows.names(), self.rows.currentRow()
        chosen = by_hand[current] if current >= 0 else ""
        self.rows.clear()
        fresh = not ticked
        said = dict.fromkeys((*by_hand, *settings.strings(BY_HAND)))
        ticked_first = sorted(said, key=lambda n: (n not in ticked, "?" not in n))
        for port in ports:
            if port.device is not None:
                plugged = port.device, port.description, port.usable
                # What was said of a device by hand, such as its calibration, holds for it.
                known = (n for n in ticked_first if n.partition("?")[0] == port.device)
                name = next(known, port.device)
                item = self.rows.put(name, port.description, port.usable, found=plugged)
                # The tongs are what one comes for: they need no click.
                if name in ticked or (fresh and port.kind == "optoforce" and port.usable):
                    item.setCheckState(Qt.CheckState.Checked)
        for film in films:
            name = f"camera:{film.device.removeprefix('/dev/video')}"
            self.rows.put(name, film.name, film.usable, found=(name, film.name, film.usable))
        for name in (*by_hand, *settings.strings(BY_HAND)):
            kept = name in ticked or name in settings.strings(BY_HAND)
            if kept and name not in self.rows.names():
                self.rows.put(name)
        for item in self.rows.items_here():
            if self.rows.said(item) in ticked:
                item.setCheckState(Qt.CheckState.Checked)
            if self.rows.said(item) == chosen:
                self.rows.setCurrentItem(item)
        self.set_open(self._choosing)  # they may have been connected while it was looked

    def _show_empty_note(self) -> None:
        """Say where there is nothing."""
        self.nothing.setVisible(not self.rows.count())
        self.rows.setVisible(self.rows.count() > 0)
        item = self.rows.currentItem()
        some = any(map(device_counts, self.rows.items_here()))
        self.calibration_button.setVisible(self._choosing and some)
        counts = item is not None and device_counts(item)
        set_enabled_with_reason(
            self.calibration_button, "" if counts else "Choose a device that sends raw counts."
        )


def _find_devices() -> Generator[None, None, tuple[tuple[FoundPort, ...], tuple[Camera, ...]]]:
    """What is plugged in."""
    from forcelab.capture.discovery import cameras, find_ports

    yield
    return find_ports(), cameras()
