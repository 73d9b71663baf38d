"""The tab of the Review workspace, which is built when it is first wanted, and its commands."""

from __future__ import annotations

from collections.abc import Callable, Generator
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QWidget

from forcelab.gui.arranging import column
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.review.learning import TRAINING, Learning
from forcelab.gui.review.standing import Standing

if TYPE_CHECKING:
    from forcelab.gui.label.workspace import LabelWorkspace
    from forcelab.gui.review.workspace import ReviewWorkspace

__all__ = ["UNHURRIED", "ReviewTab"]

WARMING = "warming up"
#: Jobs that nobody waits for in front of the screen: it is complete without what they will bring.
UNHURRIED = frozenset({TRAINING, WARMING})


class ReviewTab(QWidget):
    """Room for the Review workspace.

    Parameters
    ----------
    document : Document
    jobs : Jobs
    label : LabelWorkspace
        Who lends timeline and video.

    Attributes
    ----------
    learning : Learning
        Trains, whichever workspace is in front.
    standing : Standing
        Says how far that is, for the window's status bar.
    """

    def __init__(self, document: Document, jobs: Jobs, label: LabelWorkspace) -> None:
        super().__init__()
        self.document = document
        self.learning = Learning(document, jobs, self)
        self.standing = Standing(self.learning)
        self._jobs = jobs
        self._label = label
        self._built: ReviewWorkspace | None = None
        self._painting = True  # whether the timeline has the keyboard while this is in front
        column(self)

    @property
    def workspace(self) -> ReviewWorkspace:
        """The workspace; the first one who asks has it built."""
        if self._built is None:
            # What it needs is not loaded by those who only label.
            from forcelab.gui.review.workspace import ReviewWorkspace

            self._built = ReviewWorkspace(self.document, self._jobs, self.learning, self._label)
            layout = self.layout()
            assert layout is not None
            layout.addWidget(self._built)
            self._built.restore_layout()
            self._jobs.run(_warming_up(), lambda _: None, key=WARMING)
        return self._built

    def come_to_front(self, front: bool) -> None:
        """Borrow timeline and video, or give them back."""
        self.standing.set_elsewhere(not front)
        tracks = self._label.tracks
        if front:
            self.workspace.borrow()
            if self._painting:  # or Qt gives the keyboard to whatever comes first
                tracks.setFocus()
            return
        if self.isAncestorOf(tracks):
            self._painting = self.focusWidget() is tracks
        self._label.take_back()

    def remember_layout(self) -> None:
        """Keep how the room is shared out."""
        if self._built is not None:
            self._built.remember_layout()

    def reset_layout(self) -> None:
        """Share out the room as at first."""
        if self._built is not None:
            self._built.reset_layout()

    def handlers(self) -> dict[str, Callable[[], object]]:
        """What the commands of reviewing do, by their id in the table."""
        document = self.document
        return {
            "train": self.learning.train,
            "cancel_training": self.learning.cancel,
            "next_review": partial(self._step, 1),
            "previous_review": partial(self._step, -1),
            "accept": document.accept_here,
            "accept_all": document.accept_in_view,
            "undo": self._undo,
            "redo": self._redo,
            "verdict_human": lambda: self.workspace.queue.judge("human"),
            "verdict_model": lambda: self.workspace.queue.judge("model"),
            "verdict_ambiguous": lambda: self.workspace.queue.judge("ambiguous"),
        }

    def _step(self, direction: int) -> None:
        """Go to the next thing to review, or back to the one before."""
        self.workspace.queue.step(direction)

    def _undo(self) -> bool:
        """Take back the latest verdict or edit; verdicts are given by keys in any workspace."""
        return self.document.undo() if self._built is None else self._built.queue.undo()

    def _redo(self) -> bool:
        """Do again what was taken back last."""
        return self.document.redo() if self._built is None else self._built.queue.redo()


def _warming_up() -> Generator[None, None, None]:
    """Load what training needs, so that it begins at once."""
    from forcelab.process import warm_up
    from forcelab.review.training import reviewing

    yield
    warm_up(reviewing)
