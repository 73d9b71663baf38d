"""The recording that was kept last, which may be discarded if it is asked for twice."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer, Signal

if TYPE_CHECKING:
    from forcelab.capture.save import SavedRecording

__all__ = ["LastKept"]

#: Milliseconds within which it must be asked for a second time.
TWICE_MS = 6000


class LastKept(QObject):
    """What was kept last, and whether it was asked to be discarded.

    Asking twice keeps the hands on the keys, where a dialog would ask for the mouse.

    Parameters
    ----------
    parent : QObject, optional

    Attributes
    ----------
    kept : Kept or None
    path : Path or None
        The folder of the project that it is in.
    """

    changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.kept: SavedRecording | None = None
        self.path: Path | None = None
        self._patience = QTimer(self)
        self._patience.setSingleShot(True)
        self._patience.setInterval(TWICE_MS)
        self._patience.timeout.connect(self.changed)

    @property
    def asked(self) -> bool:
        """Whether it was asked for once, a moment ago."""
        return self._patience.isActive()

    def take(self, kept: SavedRecording, path: Path | None) -> None:
        """Remember what was kept just now."""
        self.forget()
        if kept.added.status == "new":
            self.kept, self.path = kept, path
        self.changed.emit()

    def forget(self) -> None:
        """There is nothing to discard any more."""
        self._patience.stop()
        there, self.kept, self.path = self.kept is not None, None, None
        if there:
            self.changed.emit()

    def asked_twice(self) -> bool:
        """Ask for it to be discarded; gives whether that was the second time."""
        if self._patience.isActive():
            self._patience.stop()
            return True
        self._patience.start()
        self.changed.emit()
        return False
