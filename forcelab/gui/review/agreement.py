"""The agreement view: how far several coders agree, and one track made from two."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

from PySide6.QtCore import QTimer
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import QApplication, QTabBar, QWidget

from forcelab.gui.document import Document
from forcelab.gui.figures.text import signed
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import PageOrPlaceholder, page_layout, scroll_area
from forcelab.gui.review.agreement_details import (
    CoderMatrix,
    ConsistencyView,
    PairDetails,
    unfocused_label,
)
from forcelab.gui.review.consensus import ConsensusBar
from forcelab.gui.review.reviewed_run import blind_demonstrations
from forcelab.gui.widgets import OverflowTabs, combo_box
from forcelab.jobs import Progress
from forcelab.labels import is_model
from forcelab.project import Project
from forcelab.review.agreement import Agreement, PairAgreement, agreement_job
from forcelab.review.coder_tracks import coded_demonstrations
from forcelab.review.kappa import landis_koch
from forcelab.text import task_text

#: Coders are compared again when nothing was painted for so many ms.
COMPARE_DELAY = 400


class AgreementView(QWidget):
    """Who coded what, how far they agree and where not, and the consensus of two.

    Compared in a job while the view is visible. Demonstrations that the coder is to label blind are
    left out, and counted.
    """

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document = document
        self.result: Agreement | None = None
        self._jobs = jobs
        self._listed: object = None  # what was known of the demonstrations when they were compared
        self._stale = True
        self.task = combo_box("Task", {})
        self.task.activated.connect(self._recompute)
        self.note, self.summary = unfocused_label(muted=True), unfocused_label()
        self.counts = unfocused_label()
        self.matrix, self.pair = CoderMatrix(), PairDetails(document)
        self.matrix.chosen.connect(self._show_pair)
        self.consistency, self.consensus = ConsistencyView(document), ConsensusBar(document)
        self.pages = OverflowTabs()
        self.pages.setAccessibleName("Coders")
        self.pages.addTab(self._agreement_page(), "Agreement")
        self.pages.addTab(scroll_area(self.consensus), "Consensus")
        self.pages.addTab(scroll_area(self.consistency), "Each coder")
        self.pages.currentChanged.connect(self.focus_consensus)
        self.room = PageOrPlaceholder(self.pages)
        page_layout(self, self.task, self.note, self.room, growing=self.room, margin=4, spacing=4)
        self._soon = QTimer(self, singleShot=True, interval=COMPARE_DELAY)
        self._soon.timeout.connect(self.refresh)
        document.project_changed.connect(self._project_changed)
        document.author_changed.connect(self._author_changed)
        document.listing_changed.connect(self._listing_changed)
        document.tracks_changed.connect(self._tracks_changed)
        self._show()

    def showEvent(self, event: QShowEvent) -> None:
        """Compare again: any demonstration may have been edited meanwhile."""
        super().showEvent(event)
        self._stale = True
        self._forget_blind()
        self.refresh()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._soon.stop()
        self._jobs.cancel("coders")

    def refresh(self) -> None:
        """Compare the coders again, if anything has changed and the view is visible."""
        self._soon.stop()
        project = self.document.project
        if not self.isVisible() or not self._stale:
            return
        self._stale = False
        if project is None:
            self._done(None)
            return
        self._list_tasks()
        self._listed = self._listing()
        task, viewer = self.task.currentData(), self.document.author
        job = _compare_coders(project.path, task, viewer, self.consensus.name)
        self._jobs.run(job, self._done, self._failed, key="coders")

    def focus_consensus(self) -> None:
        """Give the keyboard to the consensus, unless its tab was reached by arrow keys."""
        by_arrows = isinstance(QApplication.focusWidget(), QTabBar)  # which go on to other tabs
        if self.consensus.isVisible() and not by_arrows:
            self.consensus.setFocus()

    # Inside

    def _agreement_page(self) -> QWidget:
        page = QWidget()
        parts = self.summary, self.matrix, self.counts, self.pair
        page_layout(page, *parts, growing=self.pair, margin=6, spacing=6)
        return scroll_area(page)

    def _project_changed(self) -> None:
        self.result = None
        self._jobs.cancel("coders")
        self.task.clear()
        self._show()
        self._recompute()

    def _author_changed(self) -> None:
        """Compare for another coder, who may be blind to what is shown."""
        self._forget_blind()
        self._recompute()

    def _forget_blind(self) -> None:
        """Show at once nothing of what the coder codes blind from now on."""
        if self.result is not None and blind_demonstrations(self.document) & {
            d.id for d in self.result.coded
        }:
            self.result = None
            self._show()

    def _recompute(self) -> None:
        """Compare again, a moment after the last edit."""
        self._stale = True
        if self.isVisible():
            self._soon.start()

    def _tracks_changed(self) -> None:
        """Compare again if the open demonstration's labels are not those that were compared."""
        document = self.document
        current = {document.author: document.editor.segments, **document.other_tracks}
        coded = () if self.result is None else self.result.coded
        compared_tracks = next((d.tracks for d in coded if d.id == document.id), {})
        if any(
            segments != compared_tracks.get(author, ())
            for author, segments in current.items()
            if not is_model(author) and author != self.consensus.name
        ):
            self._recompute()

    def _listing_changed(self) -> None:
        """Compare again if demonstrations, their labels or assignments are others now."""
        if self.isVisible() and self._listing() != self._listed:
            self._forget_blind()
            self._recompute()

    def _listing(self) -> object:
        """What is known of the demonstrations, without the progress of the consensus."""
        project, name = self.document.project, self.consensus.name
        assigned = () if project is None else project.coding.assignments(self.document.author)
        return assigned, [
            (info.id, info.name, info.task, {a: s for a, s in info.labelled.items() if a != name})
            for info in self.document.infos
        ]

    def _list_tasks(self) -> None:
        tasks = tuple(dict.fromkeys(info.task for info in self.document.infos))
        listed = tuple(self.task.itemData(i) for i in range(1, self.task.count()))
        if self.task.count() and listed == tasks:
            return
        chosen = self.task.currentData()  # None of all tasks
        self.task.clear()
        self.task.addItem("All tasks")
        for task in tasks:
            self.task.addItem(task_text(task), task)
        self.task.setCurrentIndex(0 if chosen is None else max(self.task.findData(chosen), 0))
        self.task.setVisible(len(tasks) > 1)

    def _done(self, result: Agreement | None) -> None:
        self.result = result
        self._show()

    def _failed(self, error: Exception) -> None:
        """Report the error; what was found before stays."""
        self._stale = True
        self.document.show_message(str(error), True)

    def _show(self) -> None:
        result = self.result
        hidden = 0 if result is None else result.hidden
        note = f"{hidden} demonstrations are left out until you have labelled them blind."
        if hidden == 1:
            note = "1 demonstration is left out until you have labelled it blind."
        self.note.setText(note)
        self.note.setVisible(hidden > 0)
        if result is None or not result.pairs:
            self.room.say(self._missing())
            return
        self.room.say("")
        self.summary.setText(self._summary_text(result))
        self.counts.setText(_coder_counts(result))
        self.consensus.show_coded(result.coded)  # before a pair of them is chosen
        self.matrix.setVisible(True)
        self.matrix.show_agreement(result)
        self.consistency.show_agreement(result, {d.id: d.name for d in result.coded})

    def _missing(self) -> str:
        """Why there is nothing to compare, and what to do about it."""
        if self.document.project is None:
            return "Open a project to compare its coders."
        if self.result is None:
            return "Comparing the coders…"
        return (
            "No demonstration here is labelled by two coders yet, so there is nothing to compare. "
            "Assign some to a second coder, blind: right-click them in the list of demonstrations, "
            "or use “forcelab assign PROJECT DEMO --author NAME”."
        )

    def _summary_text(self, result: Agreement) -> str:
        if result.fleiss is None or result.fleiss_coders < 3:
            return "The darker a cell, the better the two agree; a click tells more."
        return (
            f"Fleiss' kappa of all {len(result.authors)} coders: {signed(f'{result.fleiss:.2f}')}, "
            f"“{landis_koch(result.fleiss)}” by Landis and Koch. It extends kappa to "
            "more than two coders. The darker a cell, the better the two agree."
        )

    def _show_pair(self, pair: PairAgreement | None) -> None:
        self.pair.setVisible(pair is not None)
        if pair is not None and self.result is not None:
            if not self.consensus.isVisible():  # not while the coder decides
                self.consensus.choice.choose(pair.a, pair.b)
            self.pair.show_pair(pair, {d.id: d.name for d in self.result.coded})


def _compare_coders(
    path: Path, task: str | None, viewer: str, consensus: str
) -> Generator[Progress, None, Agreement]:
    """Compare the coders of a project, as a job."""
    yield Progress(0, 1, "")
    with Project.open(path) as project:
        existing = task if task in project.demonstrations.tasks() else None
        coded, hidden = coded_demonstrations(project, existing, viewer=viewer, without=(consensus,))
    return (yield from agreement_job(coded, hidden=hidden))


def _coder_counts(result: Agreement) -> str:
    """How many demonstrations of each task each coder has labelled."""
    lines = (
        f"{author}: " + ", ".join(f"{task_text(task)} {count}" for task, count in tasks.items())
        for author, tasks in sorted(result.counts.items())
    )
    return "\n".join(("Demonstrations labelled, by task:", *lines))
