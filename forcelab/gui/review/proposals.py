"""Unlabelled demonstrations, the one to label next first, and taking predictions over."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import QModelIndex, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QShowEvent
from PySide6.QtWidgets import QStyle, QStyledItemDelegate, QStyleOptionViewItem, QWidget

from forcelab.gui.arranging import PageOrNote, column, muted
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES
from forcelab.gui.indexes import Index
from forcelab.gui.jobs import Jobs
from forcelab.gui.label.track_spans import spans_of
from forcelab.gui.review.accept_buttons import AcceptButtons
from forcelab.gui.review.rows import Column, Row, TextModel, TextRows
from forcelab.gui.review.seen import blind_to
from forcelab.gui.theme import colours

if TYPE_CHECKING:
    from collections.abc import Generator

    from forcelab.review.active_learning import Proposal
    from forcelab.review.run_result import Outcome

__all__ = ["ProposalsView"]

KEY = "proposals"
#: The column with a bar, and how wide it is in pixels, so that bars can be compared.
UNCERTAINTY, WIDE = 1, 140
#: Of its length; the rest is mostly time without any action.
LABELLED = 0.9


class ProposalsView(QWidget):
    """What should be labelled next, and the predictions of what is open.

    A row leads to the most uncertain stretch of its demonstration. Nothing is computed while the
    view is hidden, and nothing is shown of what is coded blind.

    Attributes
    ----------
    accepting : AcceptButtons
        Take predictions over.
    rows : tuple of Proposal
        What is listed.
    """

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document, self.jobs = document, jobs
        self.setAccessibleName("Proposals")
        self.model = TextModel(self)
        self.rows: tuple[Proposal, ...] = ()
        self._shown: Outcome | None = None
        self._found: tuple[Proposal, ...] = ()
        self.table = self._table()
        self.order = muted()
        self.accepting = AcceptButtons(document)
        self._pages = PageOrNote(self.table)
        parts = self.order, self._pages, self.accepting
        column(self, *parts, growing=self._pages, margin=4, spacing=4)
        document.outcome_changed.connect(self._refresh)
        document.author_changed.connect(self._refresh)
        document.listing_changed.connect(self._listing_changed)
        document.tracks_changed.connect(self._follow)
        document.outcome_changed.connect(self._follow)
        document.demonstration_changed.connect(self._follow)
        self._say_empty()

    def showEvent(self, event: QShowEvent) -> None:
        """Catch up with what happened while it was hidden."""
        super().showEvent(event)
        self._refresh()
        self._follow()

    def _table(self) -> TextRows:
        """The rows."""
        table = TextRows(self.model)
        table.setAccessibleName("Unlabelled demonstrations, the one to label next first")
        table.setTextElideMode(NAMES)
        self._bars = _Bars(lambda row: self.rows[row].uncertainty)
        table.setItemDelegateForColumn(UNCERTAINTY, self._bars)
        table.clicked.connect(self._go)
        return table

    def _follow(self, *_: object) -> None:
        """Tell how much of the open demonstration is labelled by now."""
        if not self.isVisible():
            return
        if self._in_order() != self.rows:
            self._list()
        elif (told := self._told()) != self.model.rows:
            self.model.retell(told)
            self._say_order()

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

    def _say_order(self) -> None:
        """Say which demonstration comes first, and why."""
        if self.rows and self.rows[0].id in self._done():
            text = "All of these are labelled by now. Train again with them."
        elif self._weighed():
            text = (
                "Label the first one next: the recogniser is uncertain of it, and many of the "
                "others are like it. The list is sorted by the product of the two."
            )
        else:
            text = (
                "The most uncertain comes first. Train again to weigh each by how many of the "
                "others are like it, so that odd ones do not come first."
            )
        self.order.setText(text)

    def _weighed(self) -> bool:
        """Whether they are ordered by how many are like each, too."""
        from forcelab.review.active_learning import weighed

        return bool(self._found) and weighed(self._found)

    def _listing_changed(self) -> None:
        """Who is blind where may have changed."""
        if self.isVisible():
            self._list()

    def _list(self) -> None:
        """Show what may be seen."""
        seen = self._in_order()
        if seen != self.rows:
            self.rows = seen
            columns = [
                Column("demonstration", number=False),
                Column("uncertainty", number=False),
                Column("probably wrong"),
                Column("labelled"),
            ]
            if self._weighed():
                columns.insert(UNCERTAINTY + 1, Column("like others"))
            self.model.show(columns, self._told())
            self.table.fit_columns(stretched=0)
            self.table.horizontalHeader().resizeSection(UNCERTAINTY, WIDE)
        self._say_order()
        self._say_empty()

    def _in_order(self) -> tuple[Proposal, ...]:
        """What may be seen; what the coder has labelled by now comes last."""
        blind, done = blind_to(self.document), self._done()
        seen = (one for one in self._found if one.id not in blind)
        return tuple(sorted(seen, key=lambda one: one.id in done))

    def _done(self) -> frozenset[str]:
        """The demonstrations that the coder has labelled, if not to the last moment."""
        return frozenset(id_ for id_, share in self._labelled().items() if share >= LABELLED)

    def _told(self) -> tuple[Row, ...]:
        """What is listed, as texts."""
        labelled, weighed = self._labelled(), self._weighed()
        return tuple(
            Row(
                (
                    one.name,
                    f"{100 * one.uncertainty:.0f} %",
                    *([f"{100 * (one.typicality or 0.0):.0f} %"] if weighed else []),
                    f"{one.wrong:.1f} s",
                    f"{100 * labelled[one.id]:.0f} %" if one.id in labelled else "–",
                ),
                tip=self._tip(one),
            )
            for one in self.rows
        )

    def _tip(self, one: Proposal) -> str:
        """What the figures mean."""
        text = (
            f"{one.name} ({one.task}), {one.seconds:.1f} s: of moments as uncertain as "
            "these, tested "
            f"demonstrations had so many wrong that about {one.wrong:.1f} s are expected to "
            "be wrong "
            "here. Labelling it is expected to put these right."
        )
        if one.typicality is None:
            return text
        typical = "It is {0:.0f} % like all that are listed."
        return f"{text} {typical.format(100 * one.typicality)}"

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
        self.order.setVisible(bool(self.rows))
        outcome = self.document.outcome
        tasks = () if outcome is None else outcome.tasks
        there = [info for info in self.document.infos if info.task in tasks]
        blind = blind_to(self.document)
        if self.rows:
            text = ""
        elif outcome is None:
            text = "Train a recogniser: it proposes labels for what is unlabelled."
        elif self.jobs.awaits(KEY):
            text = "Ranking what is unlabelled…"
        elif outcome.proposals or any(info.id in blind for info in there):
            text = "There is nothing here that may be seen."
        elif any(outcome.author not in info.labelled for info in there):
            # A run of the command line tests only, and demonstrations are imported later.
            text = (
                "This run proposes nothing for what is unlabelled. Train again; if nothing is "
                "listed here then, Training says why."
            )
        else:
            text = (
                "Every demonstration was labelled when this recogniser was trained; there is "
                "nothing to propose."
            )
        self._pages.say(text)

    def _go(self, index: QModelIndex) -> None:
        """Go to the most uncertain stretch of a row."""
        if index.isValid():
            self.document.examine(self.rows[index.row()].place)


def _ranking(outcome: Outcome) -> Generator[None, None, tuple[Proposal, ...]]:
    """Rank what an outcome proposes."""
    from forcelab.review.active_learning import proposals

    yield None
    return proposals(outcome)


class _Bars(QStyledItemDelegate):
    """Draws a share, which `share` gives for a row, as a bar beside its number."""

    def __init__(self, share: Callable[[int], float]) -> None:
        super().__init__()
        self._share = share

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        """Draw the ground as always, then number and bar."""
        self.initStyleOption(option, index)
        number, option.text = option.text, ""
        style = option.widget.style()
        style.drawControl(QStyle.ControlElement.CE_ItemViewItem, option, painter)
        theme = colours()
        box = QRectF(option.rect).adjusted(4, 4, -4, -4)
        bar = QRectF(box.left() + 42, box.top(), max(box.width() - 42, 0), box.height())
        chosen = bool(option.state & QStyle.StateFlag.State_Selected)
        painter.save()
        painter.setPen(QColor(theme.accent_text if chosen else theme.text))
        painter.drawText(
            QRectF(box.left(), box.top(), 36, box.height()),
            Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter,
            number,
        )
        painter.fillRect(bar, QColor(theme.panel_edge))
        bar.setWidth(bar.width() * self._share(index.row()))
        painter.fillRect(bar, QColor(theme.muted))
        painter.restore()
