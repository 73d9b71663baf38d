"""The Review workspace: timeline pairs, what leads to every mistake, and the place itself."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, TypeVar

from PySide6.QtCore import QByteArray, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QSplitter, QWidget

from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import (
    YieldingSplitter,
    fill_splitter,
    page_layout,
    placeholder,
    set_shares,
)
from forcelab.gui.review.pairs import PairsView
from forcelab.gui.review.queue import QueueView
from forcelab.gui.review.trainer import Trainer
from forcelab.gui.review.training_bar import TrainingBar
from forcelab.gui.widgets import OverflowTabs

if TYPE_CHECKING:
    from forcelab.gui.label.workspace import LabelWorkspace
    from forcelab.gui.review.agreement import AgreementView
    from forcelab.gui.review.confusion import ConfusionView
    from forcelab.gui.review.explanation import ExplanationView
    from forcelab.gui.review.loss_plot import LossView
    from forcelab.gui.review.proposals import ProposalsView
    from forcelab.gui.review.scores import ScoresView
    from forcelab.gui.review.tradeoff import TradeoffView

__all__ = ["ReviewWorkspace"]

Page = TypeVar("Page", bound=QWidget)

#: What each side gets at first: pairs and lists; pairs and the place; lists and the video.
BESIDE_SHARES, BELOW_SHARES, LIST_SHARES = (11, 9), (2, 3), (3, 2)
#: Height in pixels that the lists get before the video does: a matrix needs it to be read.
LISTS_HEIGHT = 350
#: Least width and height of the lists, in pixels, whichever are built, so that nothing moves when
#: another one is: the window fits a screen of 960 x 540. Where there is less than they need, they
#: scroll.
LEAST_SIZE = (276, 192)
#: Height of the pairs' sentence while there are none, in lines.
EMPTY_LINES = 6


class ReviewWorkspace(QWidget):
    """Pairs at the top, the examined interval below them, lists and video beside.

    The timeline and the video are those of the Label workspace, borrowed while this one is in
    front: whatever can be done there can be done here, and nothing is decoded or computed twice.

    Each list is loaded and built when it is first shown: all of them at once would hold up the
    window for half a second, when only the queue is visible.
    """

    def __init__(
        self, document: Document, jobs: Jobs, trainer: Trainer, label: LabelWorkspace
    ) -> None:
        super().__init__()
        self.document = document
        self._jobs = jobs
        self._label = label
        self.bar = TrainingBar(document, trainer)
        self.pairs = PairsView(document, jobs)
        self.queue = QueueView(document, jobs)
        self._trainer = trainer
        self.lists = OverflowTabs()
        self.lists.setObjectName("narrow")
        self.lists.setMinimumSize(*LEAST_SIZE)
        self.lists.setAccessibleName("What to review")
        titles = {
            "queue": "Queue",
            "confusion": "Confusion",
            "scores": "Scores",
            "why": "Why",
            "proposals": "Proposals",
            "coders": "Coders",
            "loss": "Training",
            "tradeoff": "Accuracy and speed",
        }
        self._rooms = {name: QWidget() for name in titles}
        for name, title in titles.items():
            self.lists.addTab(self._rooms[name], title)
        self._fill("queue", self.queue)
        self.lists.currentChanged.connect(self._build)
        self._place, self._video = QWidget(), QWidget()
        self._place_layout, self._video_layout = page_layout(self._place), page_layout(self._video)
        self._left, self._right = YieldingSplitter(), QSplitter(Qt.Orientation.Vertical)
        self._sides = QSplitter()
        fill_splitter(self._left, (self.pairs, self._place), BELOW_SHARES)
        fill_splitter(self._right, (self.lists, self._video), LIST_SHARES)
        fill_splitter(self._sides, (self._left, self._right), BESIDE_SHARES)
        self._right.splitterMoved.connect(self._video_dragged)
        self._video_by_hand = False  # the coder has chosen the video's height
        self.hint = placeholder(
            "Import demonstrations and label some, then train; the results appear here."
        )
        column = page_layout(self, self.bar, self._sides, self.hint, growing=self._sides)
        column.setStretch(2, 1)
        document.demonstration_changed.connect(self._demonstration_changed)
        document.listing_changed.connect(self._listing_changed)
        document.review.run_changed.connect(self._run_changed)
        self._listing_changed()
        self._run_changed()

    def borrow(self) -> None:
        """Take timeline and video from the Label workspace."""
        timeline, video = self._label.lend()
        self._place_layout.addWidget(timeline)
        self._video_layout.addWidget(video)
        timeline.show()
        self._demonstration_changed()

    def show_list(self, name: str) -> None:
        """Bring a list to the front, such as ``"queue"`` or ``"tradeoff"``."""
        self.lists.setCurrentIndex(tuple(self._rooms).index(name))

    def restore_layout(self) -> None:
        for name, splitter in self._splitters.items():
            if state := settings.data(f"review/{name}"):
                splitter.restoreState(QByteArray(state))
                self._video_by_hand |= splitter is self._right
        self._left.sizes_set()

    def remember_layout(self) -> None:
        for name, splitter in self._splitters.items():
            state = self._left.filled_state if splitter is self._left else splitter.saveState()
            by_hand = splitter is not self._right or self._video_by_hand
            settings.store(f"review/{name}", bytes(state.data()) if by_hand else b"")

    def reset_layout(self) -> None:
        set_shares(self._left, BELOW_SHARES)
        set_shares(self._sides, BESIDE_SHARES)
        self._video_by_hand = False
        self._share_lists()
        self._left.sizes_set()
        if "tradeoff" in vars(self):
            self.tradeoff.reset_layout()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        if not self._video_by_hand:
            self._share_lists()

    def _share_lists(self) -> None:
        """Give the video two fifths of the height, in a low window what the lists leave."""
        whole = self.height() - self.bar.height()
        lists = max(LIST_SHARES[0] * whole // sum(LIST_SHARES), min(LISTS_HEIGHT, whole))
        self._right.setSizes([lists, whole - lists])

    def _video_dragged(self) -> None:
        self._video_by_hand = True

    # The lists

    @cached_property
    def confusion(self) -> ConfusionView:
        from forcelab.gui.review.confusion import ConfusionView

        return self._fill("confusion", ConfusionView(self.document, self._jobs))

    @cached_property
    def scores(self) -> ScoresView:
        from forcelab.gui.review.scores import ScoresView

        return self._fill("scores", ScoresView(self.document, self._jobs))

    @cached_property
    def why(self) -> ExplanationView:
        from forcelab.gui.review.explanation import ExplanationView

        return self._fill("why", ExplanationView(self.document, self._jobs))

    @cached_property
    def proposals(self) -> ProposalsView:
        from forcelab.gui.review.proposals import ProposalsView

        return self._fill("proposals", ProposalsView(self.document, self._jobs))

    @cached_property
    def coders(self) -> AgreementView:
        from forcelab.gui.review.agreement import AgreementView

        return self._fill("coders", AgreementView(self.document, self._jobs))

    @cached_property
    def loss(self) -> LossView:
        from forcelab.gui.review.loss_plot import LossView

        return self._fill("loss", LossView(self.document, self._trainer))

    @cached_property
    def tradeoff(self) -> TradeoffView:
        from forcelab.gui.review.tradeoff import TradeoffView

        return self._fill("tradeoff", TradeoffView(self._trainer))

    # Inside

    def _fill(self, name: str, page: Page) -> Page:
        page_layout(self._rooms[name], page)
        return page

    def _build(self, index: int) -> None:
        """Build the list of a tab that has come to the front."""
        name = tuple(self._rooms)[index]
        getattr(self, name)
        if name == "coders":
            self.coders.focus_consensus()
        if self.queue.filter.hasFocus():  # Qt's choice as the first; there, N would be typed
            self.queue.list.setFocus()

    @property
    def _splitters(self) -> dict[str, QSplitter]:
        """The splitters by the name they are remembered under."""
        return {"left": self._left, "right": self._right, "whole": self._sides}

    def _demonstration_changed(self) -> None:
        """Give the video room only where there is one."""
        demonstration = self.document.demonstration
        filmed = demonstration is not None and demonstration.video is not None
        self._video.setVisible(filmed)
        self._place.setVisible(demonstration is not None)
        self._run_changed()

    def _run_changed(self) -> None:
        """Give the timeline, if there is one, the room of pairs that are of no run."""
        document = self.document
        yields = document.review.run is None and document.demonstration is not None
        self._left.set_empty(self.pairs, EMPTY_LINES if yields else 0)

    def _listing_changed(self) -> None:
        """Say what comes first where there is nothing to train on."""
        empty = not self.document.infos
        self._sides.setHidden(empty)
        self.hint.setVisible(empty)
