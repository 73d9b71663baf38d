"""The chooser: what is plugged in, found by itself, and what is added by hand."""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING

from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QMenu,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import InputError
from forcelab.gui import settings
from forcelab.gui.arranging import stress
from forcelab.gui.capture.device_rows import DeviceRows, counts, found_as
from forcelab.gui.capture.session import Session
from forcelab.gui.choosing import ask_file
from forcelab.gui.jobs import Jobs

if TYPE_CHECKING:
    from forcelab.capture.discovery import Camera, FoundPort

__all__ = ["Sources"]

#: The key of the job that looks.
LOOKING = "capture: what is plugged in"
#: Where the devices that were ticked last are remembered.
TICKED, BY_HAND = "capture/ticked", "capture/by hand"
#: Pixels: Qt's greatest height of a widget, and what devices that are connected need not exceed.
UNBOUNDED, HIGHEST = 16_777_215, 120


class Sources(QWidget):
    """A list with check boxes, and a line to add to it.

    Parameters
    ----------
    session : Session
    jobs : Jobs
    """

    def __init__(self, session: Session, jobs: Jobs) -> None:
        super().__init__()
        self._session, self._jobs = session, jobs
        self._first = True  # nobody has looked yet
        self._choosing = True
        self.rows = DeviceRows()
        self.rows.setAccessibleName("Devices and cameras")
        self.refresh_button = QPushButton("Look again")
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
        self.rows.currentItemChanged.connect(self._tell)
        self.rows.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.rows.customContextMenuRequested.connect(self._offer)
        self.rows.delete_pressed.connect(self._remove)
        self.nothing = QLabel(
            "Nothing was found; plug a device in, or add one below. Without any, 'forcelab "
            "replay' on the command line plays a demonstration as one; add the name it prints."
        )
        self.nothing.setWordWrap(True)
        heading = QLabel("Devices")
        stress(heading)
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
        self._tell()

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
        self._tell()
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
        self._jobs.run(_found(), self._list, self._failed, key=LOOKING)

    def add(self, name: str) -> None:
        """Add a device by its name, and tick it."""
        item = self.rows.put(name)
        item.setCheckState(Qt.CheckState.Checked)
        known = settings.strings(BY_HAND)
        settings.put(BY_HAND, tuple(dict.fromkeys((*known, name)))[-8:])
        self._tell()

    def remember(self) -> None:
        """Keep what is ticked for the next time; of what was added by hand, that too."""
        ticked = (*self.devices, *(f"camera:{one}" for one in self.cameras))
        settings.put(TICKED, ticked)
        known = settings.strings(BY_HAND)  # a calibration is kept: it is not easily found again
        settings.put(BY_HAND, [n for n in known if n in ticked or "calibration=" in n])

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
        if item is None or not counts(item):
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
        found = found_as(item)
        self.rows.takeItem(self.rows.row(item))
        settings.put(BY_HAND, [one for one in settings.strings(BY_HAND) if one != old])
        what, usable = ("", True) if found is None else found[1:]
        fresh = self.rows.put(name, what, usable, found=found)
        if found is None or name != found[0]:
            self.add(name)
        fresh.setCheckState(Qt.CheckState.Checked)
        self.rows.setCurrentItem(fresh)
        self._tell()

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
        if item is not None and counts(item):
            menu.addAction("Calibration file…", self._ask_calibration)
            name = self.rows.said(item)
            plain = calibrated_by(name, None)
            bare = menu.addAction("No calibration", lambda: self._rename(name, plain))
            bare.setEnabled(plain != name)
        remove = menu.addAction("Remove", self._remove)
        remove.setShortcut(QKeySequence(QKeySequence.StandardKey.Delete))
        remove.setEnabled(item is not None and found_as(item) is None)
        return menu

    def _remove(self) -> None:
        """Take the current device off the list, if it was added by hand."""
        item = self.rows.currentItem()
        if item is None or not self._choosing:
            return
        name = self.rows.said(item)
        if found_as(item) is not None:
            self._session.say(
                "{} is plugged in; untick it to leave it out.".format(name.partition("?")[0])
            )
            return
        self.rows.takeItem(self.rows.row(item))
        for key in (BY_HAND, TICKED):
            settings.put(key, [one for one in settings.strings(key) if one != name])
        self._tell()

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

    def _tell(self) -> None:
        """Say where there is nothing."""
        self.nothing.setVisible(not self.rows.count())
        self.rows.setVisible(self.rows.count() > 0)
        item = self.rows.currentItem()
        some = any(map(counts, self.rows.items_here()))
        self.calibration_button.setVisible(self._choosing and some)
        self.calibration_button.setEnabled(item is not None and counts(item))


def _found() -> Generator[None, None, tuple[tuple[FoundPort, ...], tuple[Camera, ...]]]:
    """What is plugged in."""
    from forcelab.capture.discovery import cameras, find_ports

    yield
    return find_ports(), cameras()
