"""Three hints for the first demonstration: each goes once it was followed or closed, for good."""

from __future__ import annotations

from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QSizePolicy

from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.layout import fill_layout, tool_button
from forcelab.gui.shortcuts import keys
from forcelab.gui.theme import colours, themes

#: What is hinted at, one after the other.
HINTS = ("play", "paint", "next")
#: Where those are remembered that were neither followed nor closed yet.
LEFT = "hints/left"


class HintBar(QFrame):
    """One hint at a time, above the timeline; none before :meth:`begin` was ever called."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self._document = document
        self._left = tuple(hint for hint in HINTS if hint in settings.strings(LEFT))
        self._opened = ""  # the demonstration in which the hints are shown
        self.setAccessibleName("Hint")
        self._number, self._text = QLabel(), QLabel(wordWrap=True)
        self._text.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        tip = "Close this hint; it does not come back"
        self.close_button = tool_button(
            "cross", "Close the hint", lambda: self._finish(self._left[0]), tip
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
        if not settings.settings().contains(LEFT):
            self._keep(HINTS)

    def _finish(self, hint: str) -> None:
        """Remember that a hint is not needed any more."""
        if hint in self._left:
            self._keep(tuple(other for other in self._left if other != hint))

    def _colour(self) -> None:
        c = colours()
        self.setStyleSheet(
            f"HintBar {{ background: {c.background}; border: 0; "
            f"border-left: 4px solid {c.accent}; border-bottom: 1px solid {c.panel_edge}; }}"
        )

    def _keep(self, left: tuple[str, ...]) -> None:
        self._left = left
        settings.store(LEFT, left)
        self._show()

    def _play_followed(self) -> None:
        if self._document.view.playing:
            self._finish("play")

    def _paint_followed(self) -> None:
        if self._document.editor.segments:
            self._finish("paint")

    def _demonstration_changed(self) -> None:
        """Another one that is opened is the next."""
        before, self._opened = self._opened, self._document.id
        if before and self._opened and before != self._opened:
            self._finish("next")
        self._show()

    def _show(self) -> None:
        self.setVisible(bool(self._left) and self._document.demonstration is not None)
        if not self._left:
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
        self._number.setText(f"<b>{HINTS.index(self._left[0]) + 1} of {len(HINTS)}</b>")
        self._text.setText(text[self._left[0]])
