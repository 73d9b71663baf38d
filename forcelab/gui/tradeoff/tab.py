"""The tab of the Trade-off workspace, which is built when it is first shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtWidgets import QWidget

from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import page_layout
from forcelab.gui.review.trainer import Trainer

if TYPE_CHECKING:
    from forcelab.gui.tradeoff.workspace import TradeoffWorkspace

__all__ = ["TradeoffTab"]


class TradeoffTab(QWidget):
    """Room for the Trade-off workspace.

    Parameters
    ----------
    document : Document
    jobs : Jobs
    learning : Learning
        Whose settings are chosen there.
    """

    def __init__(self, document: Document, jobs: Jobs, learning: Trainer) -> None:
        super().__init__()
        self._given = (document, jobs, learning)
        self._built: TradeoffWorkspace | None = None
        self._column = page_layout(self)

    @property
    def workspace(self) -> TradeoffWorkspace:
        """The workspace; the first one who asks has it built."""
        if self._built is None:
            # What it needs is not loaded by those who only label.
            from forcelab.gui.tradeoff.measuring import Measuring
            from forcelab.gui.tradeoff.workspace import TradeoffWorkspace

            measuring = Measuring(*self._given, self)
            self._built = TradeoffWorkspace(measuring)
            self._column.addWidget(self._built)
        return self._built

    @property
    def settled(self) -> bool:
        """Whether what was measured the last time has been read."""
        return self._built is None or not self._built.measuring.reading

    def come_to_front(self, front: bool) -> None:
        """Show the latest measurement, or look at nothing any more."""
        if front or self._built is not None:
            self.workspace.measuring.set_front(front)

    def reset_layout(self) -> None:
        """Share out the room as at first."""
        if self._built is not None:
            self._built.reset_layout()
