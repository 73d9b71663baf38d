"""How far the sample project is, with a way to do without it."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QWidget

from forcelab.gui.arranging import ProgressBar
from forcelab.jobs import Progress

__all__ = ["SampleProgress"]


class SampleProgress(QWidget):
    """A bar and Cancel; hidden while no sample project is being made."""

    cancelled = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.bar = ProgressBar("Progress of the sample project")
        self.bar.setMinimumWidth(480)
        self.cancel = QPushButton("Cancel")
        self.cancel.setAccessibleName("Cancel the sample project")
        self.cancel.clicked.connect(self.cancelled)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self.bar, 1)
        row.addWidget(self.cancel)
        self.bar.show()  # together with Cancel: only now it is no window of its own
        self.setVisible(False)

    def show_progress(self, progress: Progress | None) -> None:
        """Show how far it is; None when it is over."""
        self.setVisible(progress is not None)
        if progress is not None:
            told = f"Sample project: {progress.text}"
            self.bar.show_progress(replace(progress, text=f"{told} · %p %"))
