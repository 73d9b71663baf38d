"""The menu that shows and hides the tracks of other authors."""

from __future__ import annotations

from functools import partial

from PySide6.QtWidgets import QMenu, QWidget

from forcelab.gui.document import Document
from forcelab.gui.naming import verbatim

__all__ = ["ShownTracks"]


class ShownTracks(QMenu):
    """A check mark for each other author of the open demonstration."""

    def __init__(self, document: Document, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setTitle("Other tracks")
        self._document = document
        self.aboutToShow.connect(self._list)

    def _list(self) -> None:
        """Offer the authors that there are now."""
        self.clear()
        document = self._document
        if document.coding_blind:
            self.addAction("Hidden until your blind coding is done").setEnabled(False)
            return
        for author in document.other_authors():
            action = self.addAction(verbatim(author))
            action.setCheckable(True)
            action.setChecked(author not in document.hidden_authors)
            action.toggled.connect(partial(self._show, author))
        if self.isEmpty():
            self.addAction("Nobody else has labelled this").setEnabled(False)

    def _show(self, author: str, shown: bool) -> None:
        """Show or hide one author's tracks."""
        hidden = self._document.hidden_authors
        self._document.set_hidden_authors(hidden - {author} if shown else hidden | {author})
