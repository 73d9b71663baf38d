"""The tab of the Capture workspace, which is built when it is first shown, and its commands."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QVBoxLayout, QWidget

from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs

if TYPE_CHECKING:
    from forcelab.gui.capture.workspace import CaptureWorkspace

__all__ = ["CaptureTab"]


class CaptureTab(QWidget):
    """Room for the Capture workspace.

    Parameters
    ----------
    document : Document
    jobs : Jobs
    parent : QWidget, optional
    """

    def __init__(self, document: Document, jobs: Jobs, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.document = document
        self._jobs = jobs
        self._built: CaptureWorkspace | None = None
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)

    @property
    def workspace(self) -> CaptureWorkspace:
        """The workspace; the first one who asks has it built."""
        if self._built is None:
            # What it needs is not loaded by those who do not record.
            from forcelab.gui.capture.workspace import CaptureWorkspace

            self._built = CaptureWorkspace(self.document, self._jobs)
            layout = self.layout()
            assert layout is not None
            layout.addWidget(self._built)
        return self._built

    def come_to_front(self, front: bool) -> None:
        """Build the workspace when it is wanted."""
        if front:
            _ = self.workspace

    def let_go(self) -> None:
        """Let go of the devices; what is being recorded is kept."""
        if self._built is not None:
            self._built.let_go()

    def handlers(self) -> dict[str, Callable[[], object]]:
        """What the commands of capturing do, by their id in the table."""
        return {"record": self._record, "discard_recording": self._discard}

    def _record(self) -> None:
        """Record or stop, whichever workspace is in front."""
        if self._built is None:
            self.document.say(self.tr("Connect devices in the Capture workspace first."), True)
        else:
            self._built.record()

    def _discard(self) -> None:
        """Discard what is being recorded."""
        if self._built is None:
            self.document.say(self.tr("Nothing is being recorded."))
        else:
            self._built.session.discard()
