"""Unlabelled demonstrations, the one to label next first, and buttons that accept predictions."""

from __future__ import annotations

from collections.abc import Callable, Generator

from PySide6.QtCore import QModelIndex, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QShowEvent
from PySide6.QtWidgets import (
    QDoubleSpinBox,
    QHBoxLayout,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES
from forcelab.gui.item_views import Index, TableColumn, TableRow, TextModel, TextTable
from forcelab.gui.jobs import Jobs
from forcelab.gui.label.track_spans import track_spans
from forcelab.gui.layout import (
    PageOrPlaceholder,
    fill_layout,
    muted_label,
    page_layout,
    push_button,
    set_enabled_with_reason,
)
from forcelab.gui.obstacles import obstacle_to_accept, obstacle_to_accept_all
from forcelab.gui.review.reviewed_run import blind_demonstrations
from forcelab.gui.shortcuts import keys
from forcelab.gui.theme import colours
from forcelab.review.active_learning import Proposal, acceptable_segments, rank_proposals
from forcelab.review.run_result import RunResult
from forcelab.text import counted


class AcceptButtons(QWidget):
    """Take over what is predicted at the cursor, in view, or with a probability.

    Each can be pressed only where there is something to take over.
    """

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self._lay_out()
        for signal in (
            document.tracks_changed,
            document.review.run_changed,
            document.demonstration_changed,
        ):
            signal.connect(self._follow)
        document.view.cursor_moved.connect(self._follow_cursor)
        document.view.span_changed.connect(self._follow_span)
        keys().changed.connect(self._name_buttons)
        self._name_buttons()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._follow()

    # What it is made of

    def _lay_out(self) -> None:
        self.here = push_button("", self.accept_here)
        self.in_view = push_button("", self.accept_in_view)
        name = "Accept all segments above this probability"
        self.above = push_button("Accept a&bove", self.accept_above, name)
        self.at_least = QDoubleSpinBox(minimum=0.0, maximum=1.0, decimals=2, singleStep=0.05)
        self.at_least.setValue(settings.number("review/accept_above", 0.9, lowest=0, highest=1))
        self.at_least.setAccessibleName("Least mean probability")
        self.at_least.valueChanged.connect(self._follow)
        self.at_least.editingFinished.connect(
            lambda: settings.store("review/accept_above", self.at_least.value())
        )
        upper = fill_layout(QHBoxLayout(), self.here, self.in_view, 1)
        lower = fill_layout(QHBoxLayout(), self.above, self.at_least, 1)
        fill_layout(QVBoxLayout(self), upper, lower, margins=0, spacing=4)

    def _name_buttons(self) -> None:
        for button, text, command in (
            (self.here, "Accept &here", "accept"),
            (self.in_view, "Accept all in &view", "accept_all"),
        ):
            key = keys().shown(command)
            # Below it: beside it, the longer one is cut off where the lists are narrow.
            button.setText(f"{text}\n{key}" if key else text)
            button.setAccessibleName(text.replace("&", ""))

    # Accepting

    def accept_here(self) -> bool:
        return self._accept_and_report(self.document.review.accept_here)

    def accept_in_view(self) -> bool:
        """Accept all predictions in view, where the coder labelled nothing."""
        return self._accept_and_report(self.document.review.accept_in_view)

    def accept_above(self) -> bool:
        """Accept all predictions that are probable enough, where the coder labelled nothing."""
        document, at_least = self.document, self.at_least.value()
        return self._accept_and_report(
            lambda: document.review.accept(*document.view.bounds, at_least, replace=False)
        )

    def _accept_and_report(self, accept: Callable[[], bool]) -> bool:
        """Accept, and say how many and how to undo it."""
        before = set(self.document.editor.segments)
        accepted = accept()
        if accepted:
            count = len(set(self.document.editor.segments) - before)
            key = keys().shown("undo").split(",")[0]
            text = f"{count} predicted segments were accepted; {key} takes them back."
            if count == 1:
                text = f"1 predicted segment was accepted; {key} takes it back."
            self.document.show_message(text)
        return accepted

    def _follow_cursor(self) -> None:
        if self.isVisible():
            set_enabled_with_reason(self.here, obstacle_to_accept(self.document))

    def _follow_span(self) -> None:
        if self.isVisible():
            set_enabled_with_reason(self.in_view, obstacle_to_accept_all(self.document))

    def _follow(self, *_: object) -> None:
        if not self.isVisible():
            return
        document = self.document
        self._follow_cursor()
        self._follow_span()
        reviewed, count = document.review.reviewed, 0
        if reviewed is not None:
            least = self.at_least.value()
            count = len(acceptable_segments(reviewed, *document.view.bounds, least))
        none = "No predicted segment of the open demonstration is that probable."
        set_enabled_with_reason(self.above, "" if count else none)
        found = counted(count, "segment")
        self.above.setToolTip(f"{found} of the open demonstration with at least this probability")


RANKING_JOB = "proposals"
COLUMNS = (
    TableColumn("Demonstration", number=False),
    TableColumn("Uncertainty", number=False),
    TableColumn("Probably wrong"),
    TableColumn("Labelled"),
)
#: The column with a bar, and how wide it is in pixels, so that bars can be compared.
UNCERTAINTY_COLUMN, BAR_WIDTH = 1, 140
#: Of its length; the rest is mostly time without any action.
LABELLED_SHARE = 0.9


class ProposalsView(QWidget):
    """What should be labelled next, and the predictions of the open demonstration.

    A row leads to the most uncertain interval of its demonstration. Nothing is computed while the
    view is hidden, and nothing is shown of what is coded blind.
    """

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document, self.jobs = document, jobs
        self.setAccessibleName("Proposals")
        self.model = TextModel(self)
        self.rows: tuple[Proposal, ...] = ()
        self._run: RunResult | None = None
        self._ranking: tuple[Proposal, ...] = ()
        self.table = self._table()
        self.order = muted_label()
        self.accepting = AcceptButtons(document)
        self.pages = PageOrPlaceholder(self.table)
        parts = self.order, self.pages, self.accepting
        page_layout(self, *parts, growing=self.pages, margin=4, spacing=4)
        for changed in (document.review.run_changed, document.author_changed):
            changed.connect(self._refresh)
        for changed in (
            document.listing_changed,
            document.tracks_changed,
            document.demonstration_changed,
        ):
            changed.connect(self._show)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._refresh()

    def _table(self) -> TextTable:
        table = TextTable(self.model)
        table.setAccessibleName("Unlabelled demonstrations, the one to label next first")
        table.setTextElideMode(NAMES)
        self._bars = _BarDelegate(lambda row: self.rows[row].uncertainty)
        table.setItemDelegateForColumn(UNCERTAINTY_COLUMN, self._bars)
        table.clicked.connect(self._go)
        return table

    def _refresh(self, *_: object) -> None:
        """Rank the proposals of the run, in the background."""
        if not self.isVisible():
            return
        run = self.document.review.run
        if run is not self._run:
            self._run, self._ranking = run, ()
            self.jobs.cancel(RANKING_JOB)
            if run is not None and run.proposals:
                self.jobs.run(_rank_proposals(run), self._ranked, key=RANKING_JOB)
        self._show()

    def _ranked(self, ranking: tuple[Proposal, ...]) -> None:
        self._ranking = ranking
        self._show()

    def _show(self, *_: object) -> None:
        """List what may be seen; what the coder has labelled by now comes last."""
        if not self.isVisible():
            return
        blind, labelled = blind_demonstrations(self.document), self._labelled()
        done = {id_ for id_, share in labelled.items() if share >= LABELLED_SHARE}
        visible = [proposal for proposal in self._ranking if proposal.id not in blind]
        rows = tuple(sorted(visible, key=lambda proposal: proposal.id in done))
        texts = [self._row(proposal, labelled.get(proposal.id)) for proposal in rows]
        if rows == self.rows:
            self.model.replace_texts(texts)
        else:
            self.rows = rows
            self.model.show(COLUMNS, texts)
            self.table.fit_columns(stretched=0)
            self.table.horizontalHeader().resizeSection(UNCERTAINTY_COLUMN, BAR_WIDTH)
        self.order.setVisible(bool(rows))
        all_done = rows and rows[0].id in done
        self.order.setText(self._done_text() if all_done else "The most uncertain comes first.")
        self.pages.say("" if rows else self._missing(blind))

    def _done_text(self) -> str:
        """The line above the list once all of it is labelled by the coder."""
        run = self.document.review.run
        if run is None or run.author == self.document.author:
            return "All of these are labelled by now. Train again with them."
        return f"You have labelled all of these by now; this run learnt from {run.author}'s labels."

    def _row(self, proposal: Proposal, labelled: float | None) -> TableRow:
        cells = (
            proposal.name,
            f"{100 * proposal.uncertainty:.0f} %",
            f"{proposal.wrong:.1f} s",
            "–" if labelled is None else f"{100 * labelled:.0f} %",
        )
        return TableRow(cells, tip=self._tip(proposal))

    def _tip(self, proposal: Proposal) -> str:
        return (
            f"{proposal.name} ({proposal.task}), {proposal.seconds:.1f} s: of moments as "
            "uncertain as these, tested demonstrations had so many wrong that about "
            f"{proposal.wrong:.1f} s are expected to be wrong here. Labelling it is expected to "
            "put these right."
        )

    def _labelled(self) -> dict[str, float]:
        """Which share of each demonstration the coder has labelled."""
        author = self.document.author
        seconds = {
            info.id: (info.labelled.get(author, 0.0), info.duration) for info in self.document.infos
        }
        open_one = self.document.id
        if open_one in seconds:  # what the list tells of it is as old as the last reading
            now = track_spans(self.document.editor.segments).seconds
            seconds[open_one] = now, seconds[open_one][1]
        return {id_: min(done / all_, 1.0) for id_, (done, all_) in seconds.items() if done * all_}

    def _missing(self, blind: frozenset[str]) -> str:
        run = self.document.review.run
        if run is None:
            return "Train a recogniser: it proposes labels for what is unlabelled."
        infos = [info for info in self.document.infos if info.task in run.tasks]
        if self.jobs.awaits(RANKING_JOB):
            return "Ranking what is unlabelled…"
        if run.proposals or any(info.id in blind for info in infos):
            return "There is nothing here that may be seen."
        if any(run.author not in info.labelled for info in infos):
            # A run of the command line tests only, and demonstrations are imported later.
            return (
                "This run proposes nothing for what is unlabelled. Train again; if nothing is "
                "listed here then, Training says why."
            )
        return (
            "Every demonstration was labelled when this recogniser was trained; there is "
            "nothing to propose."
        )

    def _go(self, index: QModelIndex) -> None:
        """Go to the most uncertain interval of a row."""
        if index.isValid():
            self.document.review.examine(self.rows[index.row()].place)


def _rank_proposals(run: RunResult) -> Generator[None, None, tuple[Proposal, ...]]:
    yield None
    return rank_proposals(run)


class _BarDelegate(QStyledItemDelegate):
    """Draws a share, which `share` gives for a row, as a bar beside its number."""

    def __init__(self, share: Callable[[int], float]) -> None:
        super().__init__()
        self._share = share

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
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
        flags = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        painter.drawText(QRectF(box.left(), box.top(), 36, box.height()), flags, number)
        painter.fillRect(bar, QColor(theme.panel_edge))
        bar.setWidth(bar.width() * self._share(index.row()))
        painter.fillRect(bar, QColor(theme.muted))
        painter.restore()
