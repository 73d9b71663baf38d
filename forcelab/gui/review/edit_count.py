"""How many edits there were since what is reviewed was trained, counted as the coder goes on."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer, Signal

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.labels import Segments

if TYPE_CHECKING:
    from forcelab.project import Project
    from forcelab.review.run_result import Outcome

__all__ = ["EditCount"]

#: Edits are counted once in so many ms at most.
COUNTING = 1000


class EditCount(QObject):
    """Counts edits, and tells when the coder made one.

    Parameters
    ----------
    document : Document
    count : callable
        ``count(project, outcome)``: takes no time.
    parent : QObject, optional

    Attributes
    ----------
    edits : int or None
        None where nothing is reviewed.
    """

    counted = Signal()
    edited = Signal()

    def __init__(
        self,
        document: Document,
        count: Callable[[Project, Outcome], int],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self.edits: int | None = None
        self._document, self._of = document, count
        self._at = 0.0
        self._track = self._painted()
        self._later = QTimer(self, singleShot=True, interval=COUNTING)
        self._later.timeout.connect(self.count)
        document.tracks_changed.connect(self._tracks_changed)
        document.outcome_changed.connect(self.count)

    def forget(self) -> None:
        """Begin with nothing."""
        self._later.stop()
        self.edits = None

    def count(self) -> None:
        """Count now."""
        self._at = time.monotonic()
        project, edits = self._document.project, None
        if project is not None and self._document.outcome is not None:
            from forcelab.gui.review.seen import seen_of  # loads much, which an outcome has, too

            try:
                outcome = seen_of(self._document)
                edits = None if outcome is None else self._of(project, outcome)
            except ForcelabError:
                return  # the store is busy; the next edit counts again
        if edits != self.edits:
            self.edits = edits
            self.counted.emit()

    def _painted(self) -> tuple[str, str, Segments]:
        """Whose track over what, and the track."""
        return self._document.id, self._document.author, self._document.segments

    def _tracks_changed(self) -> None:
        """Count soon; the same track with other segments is an edit."""
        before, self._track = self._track, self._painted()
        wait = self._at + COUNTING / 1000 - time.monotonic()
        if wait <= 0:
            self.count()
        elif not self._later.isActive():
            self._later.start()
        if before[:2] == self._track[:2] and before[2] is not self._track[2]:
            self.edited.emit()
