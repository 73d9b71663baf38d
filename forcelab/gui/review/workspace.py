"""The Review workspace: timeline pairs, what leads to every mistake, and the place itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QByteArray, Qt
from PySide6.QtWidgets import QHBoxLayout, QSplitter, QTabWidget, QVBoxLayout, QWidget

from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.review.bar import TrainBar
from forcelab.gui.review.coders import CodersView
from forcelab.gui.review.comparing import ComparingDialog
from forcelab.gui.review.confusion import ConfusionView
from forcelab.gui.review.learning import Learning
from forcelab.gui.review.loss import LossView
from forcelab.gui.review.pairs import PairsView
from forcelab.gui.review.proposals import ProposalsView
from forcelab.gui.review.queue import QueueView
from forcelab.gui.review.scores import ScoresView
from forcelab.gui.review.why import WhyView

if TYPE_CHECKING:
    from forcelab.gui.label.workspace import LabelWorkspace

__all__ = ["ReviewWorkspace"]

#: What each side gets at first: pairs and lists; pairs and the place; lists and the video.
BESIDE, BELOW, LISTS = (11, 9), (2, 3), (3, 2)


class ReviewWorkspace(QWidget):
    """Pairs at the top, the place that is examined below them, lists and video beside.

    The timeline and the video are those of the Label workspace, borrowed while this one is in
    front: whatever can be done there can be done here, and nothing is decoded or computed twice.

    Parameters
    ----------
    document : Document
    jobs : Jobs
    learning : Learning
        Trains, and says how far that is.
    label : LabelWorkspace
        Who lends timeline and video.
    parent : QWidget, optional
    """

    def __init__(
        self,
        document: Document,
        jobs: Jobs,
        learning: Learning,
        label: LabelWorkspace,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.document = document
        self._jobs = jobs
        self._label = label
        self.bar = TrainBar(document, learning)
        self.pairs = PairsView(document, jobs)
        self.queue = QueueView(document, jobs)
        self.confusion = ConfusionView(document, jobs)
        self.scores = ScoresView(document, jobs)
        self.proposals = ProposalsView(document, jobs)
        self.why = WhyView(document, jobs)
        self.coders = CodersView(document, jobs)
        self.loss = LossView(document, learning)
        self.lists = QTabWidget()
        self.lists.setObjectName("narrow")  # all of them fit beside the pairs
        self.lists.setDocumentMode(True)
        self.lists.setUsesScrollButtons(True)
        self.lists.setAccessibleName(self.tr("What to review"))
        for title, page in (
            (self.tr("Queue"), self.queue),
            (self.tr("Confusion"), self.confusion),
            (self.tr("Scores"), self.scores),
            (self.tr("Why"), self.why),
            (self.tr("Proposals"), self.proposals),
            (self.tr("Coders"), self.coders),
            (self.tr("Training"), self.loss),
        ):
            self.lists.addTab(page, title)
        self._place = _holder()
        self._video = _holder()
        self._left = _split(Qt.Orientation.Vertical, (self.pairs, self._place), BELOW)
        self._right = _split(Qt.Orientation.Vertical, (self.lists, self._video), LISTS)
        self._whole = _split(Qt.Orientation.Horizontal, (self._left, self._right), BESIDE)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addWidget(self.bar)
        column.addWidget(self._whole, 1)
        self.bar.compare_asked.connect(self._compare)
        document.demonstration_changed.connect(self._demonstration_changed)

    def borrow(self) -> None:
        """Take timeline and video from the Label workspace."""
        timeline, video = self._label.lend()
        for holder, widget in ((self._place, timeline), (self._video, video)):
            layout = holder.layout()
            assert layout is not None
            layout.addWidget(widget)
        timeline.show()
        self._demonstration_changed()

    def restore_layout(self) -> None:
        """Share out the room as when the window was last closed."""
        for name, splitter in self._splitters.items():
            if state := settings.data(f"review/{name}"):
                splitter.restoreState(QByteArray(state))

    def remember_layout(self) -> None:
        """Keep how the room is shared out."""
        for name, splitter in self._splitters.items():
            settings.put(f"review/{name}", bytes(splitter.saveState().data()))

    def reset_layout(self) -> None:
        """Share out the room as at first."""
        for splitter, shares in ((self._left, BELOW), (self._right, LISTS), (self._whole, BESIDE)):
            _share_out(splitter, shares)

    # Inside

    @property
    def _splitters(self) -> dict[str, QSplitter]:
        """What the user can move, by the name it is remembered under."""
        return {"left": self._left, "right": self._right, "whole": self._whole}

    def _compare(self) -> None:
        """Set two runs of the project beside each other."""
        dialog = ComparingDialog(self.document, self._jobs, self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()

    def _demonstration_changed(self) -> None:
        """Give the video room only where there is one."""
        demonstration = self.document.demonstration
        filmed = demonstration is not None and demonstration.video is not None
        self._video.setVisible(filmed)
        self._place.setVisible(demonstration is not None)


def _holder() -> QWidget:
    """Room for a widget that is there at times only."""
    holder = QWidget()
    layout = QHBoxLayout(holder)
    layout.setContentsMargins(0, 0, 0, 0)
    return holder


def _split(
    orientation: Qt.Orientation, parts: tuple[QWidget, QWidget], shares: tuple[int, int]
) -> QSplitter:
    """Two widgets that share some room."""
    splitter = QSplitter(orientation)
    splitter.setChildrenCollapsible(False)
    for i, (part, share) in enumerate(zip(parts, shares, strict=True)):
        splitter.addWidget(part)
        splitter.setStretchFactor(i, share)
    _share_out(splitter, shares)
    return splitter


def _share_out(splitter: QSplitter, shares: tuple[int, int]) -> None:
    """Give each part its share, however large the whole is."""
    splitter.setSizes([1000 * share for share in shares])
