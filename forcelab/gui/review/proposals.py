"""Unlabelled demonstrations, the one to label next first, and taking predictions over."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QModelIndex, QSize, Qt
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import (
    QHeaderView,
    QStackedWidget,
    QTableView,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.arranging import muted, placeholder, whole_rows
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.label.track_spans import spans_of
from forcelab.gui.review.accept_buttons import AcceptButtons
from forcelab.gui.review.proposals_model import NAME, UNCERTAINTY, BarDelegate, ProposalModel
from forcelab.gui.review.seen import blind_to
from forcelab.gui.theme import themes

if TYPE_CHECKING:
    from collections.abc import Generator

    from forcelab.review.outcome import Outcome
    from forcelab.review.proposing import Proposal

__all__ = ["ProposalsView"]

KEY = "proposals"


class ProposalsView(QWidget):
    """What should be labelled next, and the predictions of what is open.

    A row leads to the most uncertain stretch of its demonstration. Nothing is computed while the
    view is hidden, and nothing is shown of what is coded blind.

    Parameters
    ----------
    document : Document
    jobs : Jobs

    Attributes
    ----------
    accepting : AcceptButtons
        Take predictions over.
    """

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document, self.jobs = document, jobs
        self.setAccessibleName(self.tr("Proposals"))
        self.model = ProposalModel(self)
        self._shown: Outcome | None = None
        self._found: tuple[Proposal, ...] = ()
        self.table = self._table()
        self.order = muted()
        self._empty = placeholder()
        self.accepting = AcceptButtons(document)
        self._pages = QStackedWidget()
        self._pages.addWidget(self.table)
        self._pages.addWidget(self._empty)
        column = QVBoxLayout(self)
        column.setContentsMargins(4, 4, 4, 4)
        column.setSpacing(4)
        column.addWidget(self.order)
        column.addWidget(self._pages, 1)
        column.addWidget(self.accepting)
        document.outcome_changed.connect(self._refresh)
        document.author_changed.connect(self._refresh)
        document.listing_changed.connect(self._listing_changed)
        document.tracks_changed.connect(self._follow)
        document.outcome_changed.connect(self._follow)
        document.demonstration_changed.connect(self._follow)
        themes().changed.connect(self.table.viewport().update)
        self._say_empty()

    def sizeHint(self) -> QSize:
        """Room for some rows."""
        return QSize(420, 260)

    def showEvent(self, event: QShowEvent) -> None:
        """Catch up with what happened while it was hidden."""
        super().showEvent(event)
        self._refresh()
        self._follow()

    # What it is made of

    def _table(self) -> QTableView:
        """The rows."""
        table = QTableView()
        table.setModel(self.model)
        table.setAccessibleName(self.tr("Unlabelled demonstrations, the one to label next first"))
        self._bars = BarDelegate(table)
        table.setItemDelegateForColumn(UNCERTAINTY, self._bars)
        whole_rows(table)
        table.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        header = table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(NAME, QHeaderView.ResizeMode.Stretch)
        table.clicked.connect(self._go)
        table.activated.connect(self._go)
        return table

    def _follow(self, *_: object) -> None:
        """Tell how much of the open demonstration is labelled by now."""
        if self.isVisible():
            self.model.set_labelled(self._labelled())

    # What is listed

    def _refresh(self) -> None:
        """Rank what the outcome proposes, in the background."""
        if not self.isVisible():
            return
        outcome = self.document.outcome
        if outcome is not self._shown:
            self._shown, self._found = outcome, ()
            self.jobs.cancel(KEY)
            if outcome is not None and outcome.proposals:
                self.jobs.run(_ranking(outcome), self._ranked, key=KEY)
        self._list()

    def _ranked(self, found: tuple[Proposal, ...]) -> None:
        """Show what was found."""
        self._found = found
        self._list()
        self._say_order()

    def _say_order(self) -> None:
        """Say which demonstration comes first, and why."""
        from forcelab.review.proposing import weighed

        if weighed(self._found):
            text = self.tr(
                "Label the first one next: the recogniser is uncertain of it, and many of the "
                "others are like it."
            )
        else:
            text = self.tr(
                "The most uncertain comes first. Train again to weigh each by how many of the "
                "others are like it, so that odd ones do not come first."
            )
        self.order.setText(text)

    def _listing_changed(self) -> None:
        """Who is blind where may have changed."""
        if self.isVisible():
            self._list()

    def _list(self) -> None:
        """Show what may be seen."""
        blind = blind_to(self.document)
        seen = tuple(one for one in self._found if one.id not in blind)
        if seen != self.model.rows:
            self.model.set_rows(seen, self._labelled())
        self._say_empty()

    def _labelled(self) -> dict[str, float]:
        """Which share of each demonstration the coder has labelled."""
        author = self.document.author
        seconds = {
            info.id: (info.labelled.get(author, 0.0), info.duration) for info in self.document.infos
        }
        open_one = self.document.id
        if open_one in seconds:  # what the list tells of it is as old as the last reading
            now = spans_of(self.document.segments).seconds
            seconds[open_one] = now, seconds[open_one][1]
        return {id_: min(done / all_, 1.0) for id_, (done, all_) in seconds.items() if done * all_}

    def _say_empty(self) -> None:
        """Say why there is nothing to see, where there is nothing."""
        self._pages.setCurrentIndex(0 if self.model.rows else 1)
        self.order.setVisible(bool(self.model.rows))
        outcome = self.document.outcome
        if outcome is None:
            text = self.tr("Train a recogniser: it proposes labels for what is unlabelled.")
        elif outcome.proposals:
            text = self.tr("There is nothing here that may be seen.")
        else:
            text = self.tr(
                "Every demonstration was labelled when this recogniser was trained; there is "
                "nothing to propose."
            )
        self._empty.setText(text)

    def _go(self, index: QModelIndex) -> None:
        """Go to the most uncertain stretch of a row."""
        if index.isValid():
            self.document.examine(self.model.rows[index.row()].place)


def _ranking(outcome: Outcome) -> Generator[None, None, tuple[Proposal, ...]]:
    """Rank what an outcome proposes."""
    from forcelab.review.proposing import proposals

    yield None
    return proposals(outcome)
