"""The first start: the page while no project is open, the sample project, three hints.

Each hint goes once it was followed or closed, for good.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from PySide6.QtWidgets import (
    QCommandLinkButton,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.icons import icon
from forcelab.gui.layout import (
    ProgressRow,
    copyable,
    emphasise,
    fill_layout,
    muted_label,
    sentence_label,
    set_enabled_with_reason,
    tool_button,
)
from forcelab.gui.preferences import SAMPLE_FOLDER
from forcelab.gui.project_actions import ProjectActions, sample_place
from forcelab.gui.shortcuts import keys
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import show_text
from forcelab.jobs import Progress


class SampleProgress(ProgressRow):
    """How far the sample project is made; hidden while none is being made."""

    def __init__(self, opening: ProjectActions) -> None:
        super().__init__("the sample project", opening.cancel_sample)
        self.bar.setMinimumWidth(280)

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
#: Pixels between two columns.
BETWEEN = 32


class Welcome(QWidget):
    """Ways to begin, and the progress of making the sample project; recent projects beside them."""

    def __init__(self, opening: ProjectActions, read_guide: Callable[[], object]) -> None:
        super().__init__()
        self._opening = opening
        title = QLabel("Label and recognise force actions")
        emphasise(title, 1.7)
        explanation = sentence_label(
            "A project is a folder of demonstrations with everybody's labels."
        )
        self._trouble = copyable()
        self._trouble.setProperty("tone", "trouble")
        self._trouble.hide()
        self._sample_button = self._button(
            "Try the sample project", "", lambda: opening.make_sample(sample_place()), "play"
        )
        self._sample = SampleProgress(opening)
        ways = (
            (
                "Label your own recordings…",
                "They are imported into a new project beside them.",
                opening.ask_import,
                "pencil",
            ),
            (
                "Open a project…",
                "A folder that forcelab made, such as study.forcelab.",
                opening.ask_open,
                "folder",
            ),
            (
                "New project…",
                "An empty one, to record into or to import into later.",
                opening.ask_new,
                "plus",
            ),
            ("Read the guide", "It begins with the first hour, step by step.", read_guide, "book"),
        )
        ways_page, self._recent_page = QWidget(), QWidget()
        below = fill_layout(QVBoxLayout(ways_page), self._sample_button, self._sample, margins=0)
        fill_layout(below, *(self._button(*way) for way in ways), 1)
        self._recent = QVBoxLayout()
        heading = muted_label("Recent projects")
        # What is between the columns belongs to the second one, which may be hidden.
        margins = BETWEEN, 0, 0, 0
        fill_layout(QVBoxLayout(self._recent_page), heading, self._recent, 1, margins=margins)
        page = QGridLayout()
        page.setHorizontalSpacing(0)
        page.addWidget(title, 1, 1, 1, 2)
        page.addWidget(explanation, 2, 1, 1, 2)
        page.addWidget(self._trouble, 3, 1, 1, 2)
        for column, side, beside in ((1, ways_page, 0), (2, self._recent_page, BETWEEN)):
            side.setMinimumWidth(NARROWEST + beside)
            side.setMaximumWidth(WIDEST + beside)
            page.addWidget(side, 4, column)
        for edge in (0, 3):
            page.setColumnStretch(edge, 1)
        page.setRowStretch(0, 1)
        page.setRowStretch(5, 2)
        page.setRowMinimumHeight(3, 12)
        self.setLayout(page)
        opening.sampling.connect(self._show_progress)
        opening.refused.connect(self.show_trouble)
        opening.recent_changed.connect(self.refresh)
        SAMPLE_FOLDER.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Offer the projects opened last, and say where the sample project lies."""
        projects, place = settings.recent_projects(), sample_place()
        while (item := self._recent.takeAt(0)) is not None:
            if (old := item.widget()) is not None:
                old.deleteLater()
        for path in projects[:RECENT_SHOWN]:
            press, description = partial(self._opening.open_recent, path), str(path.parent)
            if not settings.is_folder(path):
                description = f"Not found in {description}; click to locate it."
            self._recent.addWidget(self._button(path.name, description, press, "folder"))
        self._recent_page.setVisible(bool(projects))
        made = "" if settings.is_folder(place) else "; made once, in a minute or two"
        what = f"Thirty simulated demonstrations with video{made}, in {place.parent}."
        self._sample_button.setDescription(what)

    def show_trouble(self, sentence: str) -> None:
        """Say why a project could not be opened; ``""`` clears it."""
        show_text(self._trouble, sentence)

    def _show_progress(self, progress: Progress | None) -> None:
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


#: What is hinted at, one after the other.
HINTS = ("play", "paint", "next")
#: Where those are remembered that were neither followed nor closed yet.
PENDING = "hints/left"


class HintBar(QFrame):
    """One hint at a time, above the timeline; none before :meth:`begin` was ever called."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self._document = document
        self._pending = tuple(hint for hint in HINTS if hint in settings.strings(PENDING))
        self._opened = ""  # the demonstration in which the hints are shown
        self.setAccessibleName("Hint")
        self._number, self._text = QLabel(), QLabel(wordWrap=True)
        self._text.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        tip = "Close this hint; it does not come back"
        self.close_button = tool_button(
            "cross", "Close the hint", lambda: self._finish(self._pending[0]), tip
        )
        self.close_button.setAutoRaise(True)
        parts = self._number, (self._text, 1), self.close_button
        fill_layout(QHBoxLayout(self), *parts, margins=(10, 4, 4, 4), spacing=10)
        document.view.playing_changed.connect(self._play_followed)
        document.tracks_changed.connect(self._paint_followed)
        document.demonstration_changed.connect(self._demonstration_changed)
        keys().changed.connect(self._show)
        themes().changed.connect(self._colour)
        self._colour()
        self._show()

    def begin(self) -> None:
        """Show the hints, unless they were shown before."""
        if not settings.settings().contains(PENDING):
            self._remember(HINTS)

    def _finish(self, hint: str) -> None:
        """Remember that a hint is not needed any more."""
        if hint in self._pending:
            self._remember(tuple(other for other in self._pending if other != hint))

    def _colour(self) -> None:
        c = colours()
        self.setStyleSheet(
            f"HintBar {{ background: {c.background}; border: 0; "
            f"border-left: 4px solid {c.accent}; border-bottom: 1px solid {c.panel_edge}; }}"
        )

    def _remember(self, pending: tuple[str, ...]) -> None:
        self._pending = pending
        settings.store(PENDING, pending)
        self._show()

    def _play_followed(self) -> None:
        if self._document.view.playing:
            self._finish("play")

    def _paint_followed(self) -> None:
        if self._document.editor.segments:
            self._finish("paint")

    def _demonstration_changed(self) -> None:
        """Note that the coder has gone on to another demonstration."""
        before, self._opened = self._opened, self._document.id
        if before and self._opened and before != self._opened:
            self._finish("next")
        self._show()

    def _show(self) -> None:
        self.setVisible(bool(self._pending) and self._document.demonstration is not None)
        if not self._pending:
            return
        play, following = (keys().shown(command) for command in ("play", "done_and_next"))
        text = {
            "play": f"Play the demonstration: press {play or 'the button below'}, and once more to "
            "stop.",
            "paint": "Paint what happens: drag along your track, the top row, and choose an "
            "action; or press its key at start and end.",
            "next": f"All labelled? Press {following or 'Done and next'}: it is marked as done, "
            "and the next demonstration to label opens.",
        }
        self._number.setText(f"<b>{HINTS.index(self._pending[0]) + 1} of {len(HINTS)}</b>")
        self._text.setText(text[self._pending[0]])
