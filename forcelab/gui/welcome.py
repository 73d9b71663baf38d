"""The page shown while no project is open, and the progress of the sample project."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QCommandLinkButton,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui import settings
from forcelab.gui.icons import icon
from forcelab.gui.layout import ProgressBar, copyable, set_enabled_with_reason
from forcelab.jobs import Progress


class SampleProgress(QWidget):
    """A progress bar and Cancel; hidden while no sample project is being made."""

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
        """Show the progress; None when it is over."""
        self.setVisible(progress is not None)
        if progress is not None:
            text = f"Sample project: {progress.text}"
            self.bar.show_progress(replace(progress, text=f"{text} · %p %"))


#: How many recent projects are offered.
RECENT_SHOWN = 5


class Welcome(QWidget):
    """Ways to begin, and the progress of making the sample project."""

    opening = Signal()
    creating = Signal()
    sampling = Signal()
    cancelled = Signal()
    chosen = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        title = QLabel("Label and recognise force actions")
        face = title.font()
        face.setPointSizeF(face.pointSizeF() * 1.7)
        title.setFont(face)
        self._say = QLabel("A project is a folder of demonstrations with everybody's labels.")
        self._say.setWordWrap(True)
        self._trouble = copyable()
        self._trouble.setProperty("tone", "trouble")
        self._trouble.setVisible(False)
        self._buttons = [
            self._button(
                "Try the sample project",
                "Thirty simulated demonstrations with video; made once, in a minute.",
                self.sampling.emit,
                "play",
            ),
            self._button(
                "Open a project…",
                "A folder that forcelab made, such as study.forcelab.",
                self.opening.emit,
                "folder",
            ),
            self._button(
                "New project…",
                "An empty one; recordings are imported into it.",
                self.creating.emit,
                "plus",
            ),
        ]
        self._recent = QVBoxLayout()
        self._sample = SampleProgress()
        self._sample.cancelled.connect(self.cancelled)
        column = QVBoxLayout()
        column.addStretch(1)
        for widget in (title, self._say, self._trouble, self._sample, *self._buttons):
            column.addWidget(widget)
        column.addLayout(self._recent)
        column.addStretch(2)
        inner = QWidget()
        inner.setLayout(column)
        inner.setMinimumWidth(480)
        inner.setMaximumWidth(560)
        inner.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        outer = QVBoxLayout(self)
        outer.addWidget(inner, 1)
        outer.setAlignment(inner, Qt.AlignmentFlag.AlignHCenter)

    def set_recent(self, projects: Sequence[Path]) -> None:
        """Offer the projects opened last."""
        while (item := self._recent.takeAt(0)) is not None:
            if (old := item.widget()) is not None:
                old.deleteLater()
        for path in projects[:RECENT_SHOWN]:
            press, description = partial(self.chosen.emit, path), str(path.parent)
            if not settings.is_folder(path):
                description = f"Not found in {description}; click to locate it."
            self._recent.addWidget(self._button(path.name, description, press, "folder"))

    def show_trouble(self, sentence: str) -> None:
        """Say why a project could not be opened; ``""`` clears it."""
        self._trouble.setText(sentence)
        self._trouble.setVisible(bool(sentence))

    def show_progress(self, progress: Progress | None) -> None:
        """Show the progress of the sample project; None when it is over."""
        self._sample.show_progress(progress)
        making = "" if progress is None else "The sample project is being made."
        set_enabled_with_reason(self._buttons[0], making)

    def _button(
        self, text: str, description: str, press: Callable[[], object], mark: str
    ) -> QCommandLinkButton:
        """A large button with a line of explanation and an icon."""
        button = QCommandLinkButton(text, description)
        # The style's own arrow is black on any ground.
        button.setIcon(icon(mark))
        button.setAccessibleName(f"{text}: {description}")
        button.clicked.connect(lambda _checked: press())
        return button
