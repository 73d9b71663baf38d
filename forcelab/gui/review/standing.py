"""What goes on behind the other workspaces: how far a training is, and how old its result."""

from __future__ import annotations

from forcelab.gui.elsewhere_line import ElsewhereLine
from forcelab.gui.review.bar_texts import progress_text
from forcelab.gui.review.learning import Learning

__all__ = ["Standing"]


class Standing(ElsewhereLine):
    """A line in the status bar; a click on it leads to the review.

    Seen while another workspace is in front: the review says it in its own bar.
    """

    def __init__(self, learning: Learning) -> None:
        super().__init__()
        self._learning = learning
        self.setStyleSheet("padding: 0 0.5em")
        self.setToolTip("Show the review")
        learning.changed.connect(self.refresh)
        learning.document.tracks_changed.connect(self.refresh)
        self.refresh()

    def words(self) -> str:
        """How far a training is, or how many edits there were since the last one."""
        learning = self._learning
        if learning.training:
            step = learning.step
            return "Training: {}".format("starting" if step is None else progress_text(step))
        outcome = learning.document.outcome
        if learning.edits is None or outcome is None:
            return ""
        run = f"Run {outcome.number}"
        what = "Recogniser" if learning.kept else run
        return f"{what}: {learning.stands[0]}"
