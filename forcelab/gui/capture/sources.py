"""The chooser: what is plugged in, found by itself, and what is added by hand."""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui import settings
from forcelab.gui.capture.session import Session
from forcelab.gui.jobs import Jobs
from forcelab.gui.theme import colours, themes

if TYPE_CHECKING:
    from forcelab.capture.discovery import FoundPort
    from forcelab.capture.ports import Camera

__all__ = ["Sources"]

#: The key of the job that looks.
LOOKING = "capture: what is plugged in"
#: Where the devices that were ticked last are remembered.
TICKED, BY_HAND = "capture/ticked", "capture/by hand"
#: Pixels: Qt's greatest height of a widget, and what devices that are connected need not exceed.
UNBOUNDED, HIGHEST = 16_777_215, 120
#: What is kept with a row: ``"device"`` or ``"camera"``, and its name.
_KIND, _NAME = Qt.ItemDataRole.UserRole, Qt.ItemDataRole.UserRole + 1


class Sources(QWidget):
    """A list with check boxes, and a line to add to it.

    Parameters
    ----------
    session : Session
    jobs : Jobs
    parent : QWidget, optional
    """

    def __init__(self, session: Session, jobs: Jobs, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session, self._jobs = session, jobs
        self._first = True  # nobody has looked yet
        self.rows = QListWidget()
        self.rows.setAccessibleName(self.tr("Devices and cameras"))
        self.rows.setSpacing(2)
        self.rows.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        self.rows.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.refresh_button = QPushButton(self.tr("Look again"))
        self.refresh_button.setAccessibleName(self.tr("Look again what is plugged in"))
        self.refresh_button.clicked.connect(self.look)
        self.entry = _Entry()
        self.entry.setPlaceholderText(self.tr("optoforce:PORT?calibration=FILE"))
        self.entry.setToolTip(
            self.tr(
                "A device by its name: optoforce:PORT, text:PORT or encoder:PORT with options "
                "behind a question mark; or camera:NUMBER. Return adds it."
            )
        )
        self.entry.setAccessibleName(self.tr("Add a device by its name"))
        self.entry.returnPressed.connect(self._enter)
        self.nothing = QLabel(self.tr("Nothing was found; plug a device in, or add one below."))
        self.nothing.setWordWrap(True)
        heading = QLabel(self.tr("Devices"))
        face = heading.font()
        face.setBold(True)
        heading.setFont(face)
        top = QHBoxLayout()
        top.addWidget(heading, 1)
        top.addWidget(self.refresh_button)
        self.nothing.setAlignment(Qt.AlignmentFlag.AlignTop)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(top)
        column.addWidget(self.rows, 1)
        column.addWidget(self.nothing, 1)
        column.addWidget(self.entry)
        for name in settings.strings(BY_HAND):
            self._put(name)
        self._tell()
        themes().changed.connect(self._colour)
        self._colour()

    @property
    def devices(self) -> tuple[str, ...]:
        """Names of the devices that are ticked."""
        return self._ticked("device")

    @property
    def cameras(self) -> tuple[str, ...]:
        """Numbers or paths of the cameras that are ticked."""
        return self._ticked("camera")

    def set_open(self, choosing: bool) -> None:
        """Let devices be chosen; else show those that are ticked, and take no more room."""
        self.setEnabled(choosing)
        upright = QSizePolicy.Policy.Expanding if choosing else QSizePolicy.Policy.Maximum
        self.setSizePolicy(QSizePolicy.Policy.Preferred, upright)
        self.refresh_button.setVisible(choosing)
        self.entry.setVisible(choosing)
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
        item = self._put(name)
        item.setCheckState(Qt.CheckState.Checked)
        known = settings.strings(BY_HAND)
        settings.put(BY_HAND, tuple(dict.fromkeys((*known, name)))[-8:])
        self._tell()

    def remember(self) -> None:
        """Keep what is ticked for the next time; of what was added by hand, only that."""
        ticked = (*self.devices, *(f"camera:{one}" for one in self.cameras))
        settings.put(TICKED, ticked)
        settings.put(BY_HAND, [name for name in settings.strings(BY_HAND) if name in ticked])

    # Inside

    def _enter(self) -> None:
        """Take what was written."""
        name = self.entry.text().strip()
        if name:
            self.add(name)
            self.entry.clear()

    def _failed(self, error: Exception) -> None:
        self._session.say(str(error), True)

    def _list(self, found: tuple[tuple[FoundPort, ...], tuple[Camera, ...]]) -> None:
        """Show what was found, below it what was added by hand; ticks stay."""
        ports, films = found
        ticked = {*self.devices, *(f"camera:{one}" for one in self.cameras)}
        if self._first:
            self._first = False
            ticked |= set(settings.strings(TICKED))
        by_hand = [self._said(i) for i in range(self.rows.count())]
        self.rows.clear()
        fresh = not ticked
        for port in ports:
            if port.device is not None:
                item = self._put(port.device, port.description, port.usable)
                # The tongs are what one comes for: they need no click.
                if port.device in ticked or (fresh and port.kind == "optoforce" and port.usable):
                    item.setCheckState(Qt.CheckState.Checked)
        for film in films:
            item = self._put(
                f"camera:{film.device.removeprefix('/dev/video')}", film.name, film.usable
            )
        for name in (*by_hand, *settings.strings(BY_HAND)):
            kept = name in ticked or name in settings.strings(BY_HAND)
            if kept and name not in [self._said(i) for i in range(self.rows.count())]:
                self._put(name)
        for i in range(self.rows.count()):
            if self._said(i) in ticked:
                self.rows.item(i).setCheckState(Qt.CheckState.Checked)
        self._tell()

    def _put(self, name: str, what: str = "", usable: bool = True) -> QListWidgetItem:
        """Add a row, or give the one that there is."""
        for i in range(self.rows.count()):
            if self._said(i) == name:
                return self.rows.item(i)
        kind, _, rest = name.partition(":")
        short, _, options = name.partition("?")
        lines = [short, what, options, "" if usable else self.tr("not yours to open")]
        item = QListWidgetItem("\n".join(line for line in lines if line))
        item.setToolTip("\n".join([name, *filter(None, lines[1::2])]))
        item.setData(_KIND, "camera" if kind == "camera" else "device")
        item.setData(_NAME, rest if kind == "camera" else name)
        item.setFlags(
            Qt.ItemFlag.ItemIsEnabled
            | Qt.ItemFlag.ItemIsSelectable
            | Qt.ItemFlag.ItemIsUserCheckable
        )
        item.setCheckState(Qt.CheckState.Unchecked)
        self.rows.addItem(item)
        return item

    def _said(self, row: int) -> str:
        """A row's name as it is typed."""
        item = self.rows.item(row)
        prefix = "camera:" if item.data(_KIND) == "camera" else ""
        return prefix + str(item.data(_NAME))

    def _ticked(self, kind: str) -> tuple[str, ...]:
        """The names of a kind that are ticked, in their order."""
        items = [self.rows.item(i) for i in range(self.rows.count())]
        return tuple(
            str(item.data(_NAME))
            for item in items
            if item.data(_KIND) == kind and item.checkState() == Qt.CheckState.Checked
        )

    def _colour(self) -> None:
        """Give the boxes an edge that is seen: the style's own is lost on dark ground."""
        now = colours()
        self.rows.setStyleSheet(
            f"QListWidget::indicator:unchecked {{ background: {now.background}; "
            f"border: 1px solid {now.muted}; border-radius: 3px; width: 11px; height: 11px; }}"
        )

    def _tell(self) -> None:
        """Say where there is nothing."""
        self.nothing.setVisible(not self.rows.count())
        self.rows.setVisible(self.rows.count() > 0)


class _Entry(QLineEdit):
    """A line that Escape leaves."""

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Escape leaves everything as it was."""
        if event.key() == Qt.Key.Key_Escape:
            self.clear()
            self.clearFocus()
        else:
            super().keyPressEvent(event)


def _found() -> Generator[None, None, tuple[tuple[FoundPort, ...], tuple[Camera, ...]]]:
    """What is plugged in."""
    from forcelab.capture.discovery import find_ports
    from forcelab.capture.ports import cameras

    yield
    return find_ports(), cameras()
