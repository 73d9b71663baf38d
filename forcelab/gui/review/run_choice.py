"""The list of the runs that are kept, in which the one that is reviewed is chosen."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtWidgets import QMenu

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.review.bar_texts import run_text
from forcelab.gui.review.learning import Learning
from forcelab.gui.review.narrow_list import NarrowList

__all__ = ["RunChoice"]

#: Characters of a run that are always seen.
SHOWN = 24


class RunChoice(NarrowList):
    """The runs, the latest first."""

    def __init__(self, document: Document, learning: Learning) -> None:
        super().__init__()
        self.document, self.learning = document, learning
        self._name = "Which run is reviewed"
        self.set_name(self._name)
        self.setMinimumContentsLength(SHOWN)
        self.activated.connect(self._chosen)
        learning.runs_changed.connect(self.refresh)
        document.outcome_changed.connect(self._show_reviewed)
        self.refresh()

    def refresh(self) -> None:
        """List the runs that there are."""
        self.clear()
        for kept in self.learning.runs:
            self.addItem(run_text(kept), kept.number)
        self.setEnabled(bool(self.learning.runs))
        self.setPlaceholderText("no run yet")
        texts = map(run_text, self.learning.runs)
        widest = max(map(self.fontMetrics().horizontalAdvance, texts), default=0)
        self.view().setMinimumWidth(widest + 2 * self.fontMetrics().height())
        self._show_reviewed()

    def _show_reviewed(self) -> None:
        """Show which run is reviewed."""
        outcome = self.document.outcome
        self.setCurrentIndex(-1 if outcome is None else self.findData(outcome.number))
        how = "A right click removes it." if outcome is not None else ""
        self.setToolTip("\n".join(filter(None, (self._name, self.currentText(), how))))

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """What can be done with the run that is reviewed."""
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        action = menu.addAction("Remove this run…", self.ask_removal)
        project = self.document.project
        action.setEnabled(
            self.currentIndex() >= 0 and project is not None and not project.read_only
        )
        menu.popup(event.globalPos())

    def ask_removal(self) -> None:
        """Ask whether the run that is reviewed is to be removed, and say what goes with it."""
        from forcelab.gui.removing import removal_of_run

        project, number = self.document.project, self.currentData()
        if project is None or number is None:
            return
        try:
            uses = project.run_uses(number)
        except ForcelabError as error:
            self.document.say(str(error), True)
            return
        if not uses:
            self.learning.list_runs()  # somebody else was faster
            return
        dialog = removal_of_run(self.currentText(), uses[0], self.window())
        dialog.accepted.connect(lambda: self.learning.remove_run(number))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()

    def _chosen(self, index: int) -> None:
        """Review another run."""
        number = self.itemData(index)
        if number is not None:
            self.learning.show_run(int(number))
        self._show_reviewed()  # until it is there, and where it cannot be read
