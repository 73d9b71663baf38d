"""Whose labels are trained on, beside the button that trains."""

from __future__ import annotations

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QSizePolicy

from forcelab.gui.document import Document
from forcelab.gui.review.elided import Elided
from forcelab.labels import is_model

__all__ = ["WhoseLine"]

#: Pixels of the longest name that is written out; the tip has all of it.
LONGEST = 180


class WhoseLine(Elided):
    """Names the coder whose labels are trained on, where it might be another."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self._document = document
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Preferred)
        self.setAccessibleName("Whose labels are trained on")

    def show_coder(self, whose: str | None) -> None:
        """Name a coder; nothing where nobody else has labelled."""
        document = self._document
        listed = (name for info in document.infos for name in info.labelled)
        # The list does not tell yet of whoever has just begun to label.
        people = {name for name in (*listed, *document.others) if not is_model(name)}
        several = whose is not None and bool({*people, document.author} - {whose})
        self.set_text(f"Labels of {whose}" if several else "")

    def sizeHint(self) -> QSize:
        """The text, or the beginning of a long one."""
        return QSize(min(self.long_width, LONGEST), super().sizeHint().height())

    def minimumSizeHint(self) -> QSize:
        """All of what is hinted, so that no neighbour cuts it."""
        return self.sizeHint()
