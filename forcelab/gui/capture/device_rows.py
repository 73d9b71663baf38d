"""The list of devices and cameras: a row each, with a box to tick."""

from __future__ import annotations

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import QListWidget, QListWidgetItem

from forcelab.gui.figures.text import NAMES
from forcelab.gui.theme import colours, themes

__all__ = ["DeviceRows", "counts", "found_as"]

#: How a device was found: its name, what it is, and whether it may be opened.
Found = tuple[str, str, bool]
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
        self, name: str, what: str = "", usable: bool = True, found: Found | None = None
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
                row.setData(_FOUND, found_as(row) if found is None else found)
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


def counts(item: QListWidgetItem) -> bool:
    """Whether a row is a device that gives counts, of which a calibration makes newtons."""
    return item.data(_KIND) == "device" and str(item.data(_NAME)).startswith("optoforce:")


def found_as(item: QListWidgetItem) -> Found | None:
    """How a row's device was found; None where it was added by hand."""
    found: Found | None = item.data(_FOUND)
    return found
