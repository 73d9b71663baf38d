"""The page shown while no project is open, and the progress of the sample project."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import (
    QCommandLinkButton,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui import settings
from forcelab.gui.icons import icon
from forcelab.gui.layout import (
    ProgressBar,
    copyable,
    emphasise,
    fill_layout,
    muted_label,
    push_button,
    set_enabled_with_reason,
)
from forcelab.jobs import Progress


class SampleProgress(QWidget):
    """A progress bar and Cancel; hidden while no sample project is being made."""

    cancelled = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.bar = ProgressBar("Progress of the sample project")
        self.bar.setMinimumWidth(280)
        self.cancel = push_button("Cancel", self.cancelled, "Cancel the sample project")
        fill_layout(QHBoxLayout(self), (self.bar, 1), self.cancel, margins=0)
        self.bar.show()  # together with Cancel: only now it is no window of its own
        self.setVisible(False)

    def show_progress(self, progress: Progress | None) -> None:
        """Show the progress; None when it is over."""
        self.setVisible(progress is not None)
        if progress is not None:
            text = f"%p % · sample project: {progress.text}"  # the end is cut where it is narrow
            self.bar.show_progress(replace(progress, text=text))


#: How many recent projects are offered.
RECENT_SHOWN = 5
#: Width of a column in pixels, at least and at most.
NARROWEST, WIDEST = 400, 480


class Welcome(QWidget):
    """Ways to begin, and the progress of making the sample project; recent projects beside them.

    The sample project lies at `sample`.
    """

    importing = Signal()
    opening = Signal()
    creating = Signal()
    reading = Signal()
    sampling = Signal()
    cancelled = Signal()
    chosen = Signal(object)

    def __init__(self, sample: Path) -> None:
        super().__init__()
        title = QLabel("Label and recognise force actions")
        emphasise(title, 1.7)
        say = QLabel("A project is a folder of demonstrations with everybody's labels.")
        say.setWordWrap(True)
        self._trouble = copyable()
        self._trouble.setProperty("tone", "trouble")
        self._trouble.setVisible(False)
        self._place = sample
        self._sample_button = self._button("Try the sample project", "", self.sampling.emit, "play")
        self._sample = SampleProgress()
        self._sample.cancelled.connect(self.cancelled)
        ways = (
            (
                "Label your own recordings…",
                "They are imported into a new project beside them.",
                self.importing.emit,
                "pencil",
            ),
            (
                "Open a project…",
                "A folder that forcelab made, such as study.forcelab.",
                self.opening.emit,
                "folder",
            ),
            (
                "New project…",
                "An empty one, to record into or to import into later.",
                self.creating.emit,
                "plus",
            ),
            (
                "Read the guide",
                "It begins with the first hour, step by step.",
                self.reading.emit,
                "book",
            ),
        )
        ways_page, self._recent_page = QWidget(), QWidget()
        below = fill_layout(QVBoxLayout(ways_page), self._sample_button, self._sample, margins=0)
        fill_layout(below, *(self._button(*way) for way in ways), 1)
        self._recent = QVBoxLayout()
        heading = muted_label("Recent projects")
        fill_layout(QVBoxLayout(self._recent_page), heading, self._recent, 1, margins=0)
        page = QGridLayout()
        page.setHorizontalSpacing(32)
        page.addWidget(title, 1, 1, 1, 2)
        page.addWidget(say, 2, 1, 1, 2)
        page.addWidget(self._trouble, 3, 1, 1, 2)
        for column, side in ((1, ways_page), (2, self._recent_page)):
            side.setMinimumWidth(NARROWEST)
            side.setMaximumWidth(WIDEST)
            page.addWidget(side, 4, column)
        for edge in (0, 3):
            page.setColumnStretch(edge, 1)
        page.setRowStretch(0, 1)
        page.setRowStretch(5, 2)
        page.setRowMinimumHeight(3, 12)
        self.setLayout(page)
        self.set_recent(())

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
        self._recent_page.setVisible(bool(projects))
        what = "Thirty simulated demonstrations with video; made once, in a minute or two, in {}."
        if settings.is_folder(self._place):
            what = "Thirty simulated demonstrations with video, in {}."
        self._sample_button.setDescription(what.format(self._place.parent))

    def show_trouble(self, sentence: str) -> None:
        """Say why a project could not be opened; ``""`` clears it."""
        self._trouble.setText(sentence)
        self._trouble.setVisible(bool(sentence))

    def show_progress(self, progress: Progress | None) -> None:
        """Show the progress of the sample project, below its button; None when it is over."""
        self._sample.show_progress(progress)
        if progress is not None:
            self.show_trouble("")
        making = "" if progress is None else "The sample project is being made."
        set_enabled_with_reason(self._sample_button, making)

    def _button(
        self, text: str, description: str, press: Callable[[], object], mark: str
    ) -> QCommandLinkButton:
        """A large button with a line of explanation and an icon."""
        button = QCommandLinkButton(text, description)
        # The style's own arrow is black on any ground.
        button.setIcon(icon(mark))
        button.setAccessibleName(f"{text}: {description}" if description else text)
        button.clicked.connect(lambda _checked: press())
        return button
