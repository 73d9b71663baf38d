"""Where verdicts have painted: one who judged goes on at once, and undoes from elsewhere."""

from __future__ import annotations

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.review.places import Place

__all__ = ["Repainted"]


class Repainted:
    """The places that verdicts repainted, the last one last.

    Undo works on the open demonstration, and after a verdict that is often another one already:
    there it would take back something that nobody has thought of for days.
    """

    def __init__(self, document: Document) -> None:
        self._document = document
        self._places: list[tuple[Place, int]] = []  # with the edit's number
        self._undone = 0  # the edit that took the last one back
        document.project_changed.connect(self._forget)
        document.author_changed.connect(self._forget)

    def add(self, place: Place) -> None:
        """A verdict has repainted a place just now."""
        self._places.append((place, self._head(place.demonstration)))

    def take(self) -> Place | None:
        """Where the coder's latest edit is, if it came of a verdict; it is forgotten here."""
        while self._places:
            place, edit = self._places[-1]
            if self._head(place.demonstration) != edit:
                self._places.pop()  # painted over since, or taken back
                continue
            here = self._head(self._document.id)
            if here > edit and here != self._undone:
                return None  # painted here since
            self._places.pop()
            return place
        return None

    def undone(self) -> None:
        """What was taken was taken back."""
        self._undone = self._head(self._document.id)

    def _head(self, demonstration: str) -> int:
        """The number of the latest edit of the coder's track."""
        document = self._document
        if document.project is None or not demonstration:
            return 0
        try:
            return document.project.head(demonstration, document.author)
        except ForcelabError:  # it has left the project
            return 0

    def _forget(self) -> None:
        """Another project, or another coder."""
        self._places.clear()
