"""The queue: every place where human and model differ, judged with one key each, with undo."""

from __future__ import annotations

from collections import Counter
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any, Literal

from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtGui import QHideEvent, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QHBoxLayout, QSizePolicy, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import (
    PageOrPlaceholder,
    fill_layout,
    muted_label,
    page_layout,
    push_button,
    search_field,
    set_enabled_with_reason,
)
from forcelab.gui.obstacles import CHOOSE_DIFFERENCE
from forcelab.gui.review.queue_list import (
    QueueItem,
    QueueList,
    QueueModel,
    QueueSection,
    action_name,
)
from forcelab.gui.review.reviewed_run import blind_demonstrations, untested_text, visible_run
from forcelab.gui.shortcuts import keys
from forcelab.labels import Segment
from forcelab.project import Project
from forcelab.project.records import StoredVerdict, VerdictKind, utc_now
from forcelab.review.differences import Difference, current_tracks
from forcelab.review.queue import ComparedDemonstration, Queue, arrange_queue
from forcelab.review.run_result import RunResult, action_styles
from forcelab.review.verdicts import model_action, record_verdict, withdraw_verdict
from forcelab.vocabulary import Vocabulary

#: The tracks are compared again when nothing was painted for so many ms.
COMPARE_DELAY = 120
#: Which job compares.
QUEUE_JOB = "review queue"


@dataclass(frozen=True)
class QueueData:
    """What was read and compared."""

    run: RunResult  # as far as the coder may see it
    queue: Queue = field(default_factory=Queue)
    known: dict[str, ComparedDemonstration] = field(default_factory=dict)


def read_queue(
    path: Path, run: RunResult, known: Mapping[str, ComparedDemonstration]
) -> Generator[Any, None, QueueData]:
    """Read and compare, as a job; `run` is without what the coder may not see.

    What is `known` is not compared again as long as its track is the same.
    """
    with Project.open(path) as project:
        verdicts, tracks = project.coding.verdicts(), current_tracks(project, run)
    queue, now = yield from arrange_queue(run, tracks, verdicts, known, invented=True)
    return QueueData(run, queue, now)


class QueueLoader(QObject):
    """Keeps the queue of a document's run up to date while it is watched.

    Unwatched, nothing is compared until :meth:`compare` is called.
    """

    changed = Signal()

    def __init__(self, document: Document, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._document, self._jobs = document, jobs
        self.read: QueueData | None = None
        self.vocabulary = Vocabulary()
        self.watched = False
        # How many changes there were, and how many of them `read` knows of.
        self._changes, self._compared = 1, 0
        self._infos = document.infos
        self._soon = QTimer(self, singleShot=True, interval=COMPARE_DELAY)
        self._soon.timeout.connect(self.compare)
        document.review.run_changed.connect(self.track_changed)
        document.listing_changed.connect(self._listing_changed)
        document.author_changed.connect(self._author_changed)
        document.tracks_changed.connect(self.track_changed)
        document.vocabulary_changed.connect(self._load_vocabulary)

    @property
    def stale(self) -> bool:
        """Whether something has changed that `read` does not contain."""
        return self._compared != self._changes

    def track_changed(self) -> None:
        """Tracks, verdicts or the run have changed."""
        self._changes += 1
        if self._document.review.run is None:
            self.compare()
        elif self.watched:
            self._soon.start()

    def put_away(self, queue: Queue) -> None:
        """Show at once what the next comparison will find."""
        if self.read is not None:
            self.read = replace(self.read, queue=queue)
            self.changed.emit()

    def compare(self) -> None:
        """Compare in the background what has changed."""
        self._soon.stop()
        document = self._document
        try:
            run = visible_run(document)
        except ForcelabError as error:
            document.show_message(str(error), True)
            return
        if run is None or document.project is None:
            self._jobs.cancel(QUEUE_JOB)
            self.read, self._compared = None, self._changes
            self.changed.emit()
            return
        known = {} if self.read is None else self.read.known
        job = read_queue(document.project.path, run, known)
        self._jobs.run(job, partial(self._done, self._changes), key=QUEUE_JOB)

    def _author_changed(self) -> None:
        """Show what another coder may see, who may be blind to what is shown."""
        self._forget_blind()
        self.track_changed()

    def _forget_blind(self) -> None:
        """Show at once nothing of what is coded blind from now on."""
        if self.read is not None:
            blind = blind_demonstrations(self._document)
            if any(tested.id in blind for tested in self.read.run.tested):
                self.read = None
                self.changed.emit()

    def _listing_changed(self) -> None:
        """The list was read again; where only the open one changed, its track has been compared."""
        self._forget_blind()
        open_id, listings = self._document.id, (self._infos, self._document.infos)
        before, now = ([info for info in infos if info.id != open_id] for infos in listings)
        self._infos = self._document.infos
        if before != now:
            self.track_changed()

    def _done(self, changes: int, read: QueueData) -> None:
        self.read, self._compared = read, changes
        self._forget_blind()  # the coder may have changed since it began
        self._load_vocabulary()
        self.changed.emit()

    def _load_vocabulary(self) -> None:
        project = self._document.project
        if self.read is not None and project is not None:
            self.vocabulary = action_styles(project, self.read.run)


def queue_summary(queue: Queue) -> str:
    """How much is open, and who was right so far."""
    main = len(queue.suspected) + len(queue.actions) + len(queue.missed)
    if not queue.judged:
        return f"{main} to judge, none judged yet."
    counts = Counter(verdict.verdict for verdict in queue.judged)
    return (
        f"{main} to judge. Right so far: human {counts['human']}, model {counts['model']}; "
        f"ambiguous {counts['ambiguous']}."
    )


def what_is_left_text(folded: Sequence[QueueSection]) -> str:
    """What is left to judge when all that is unfolded is judged."""
    if not folded:
        return "That was the last one; everything listed is judged."
    left = ", ".join(f"{section.title} ({len(section)})" for section in folded)
    key = keys().shown("next_review") or "a click on the heading"
    return f"All unfolded places are judged. Left: {left}; {key} unfolds them."


#: What a button needs beside its text, in pixels.
BUTTON_MARGIN = 20


#: Of each verdict its text, what is left of it where there is little room, and its tip.
VERDICTS = {
    "human": ("Human right", "Human", "The label is right; it stays."),
    "model": (
        "Model right",
        "Model",
        "The prediction is right; your label is changed to it (undo takes it back).",
    ),
    "ambiguous": ("Ambiguous", "Unclear", "It cannot be decided; the label stays."),
}


class VerdictButtons(QWidget):
    """Three verdicts; for what is judged already, one button to withdraw the verdict."""

    judged = Signal(str)
    withdrawn = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.verdicts = {
            verdict: push_button("", partial(self.judged.emit, verdict), text, tip)
            for verdict, (text, _, tip) in VERDICTS.items()
        }
        text = "Withdraw the verdict"
        self.withdraw = push_button(text, self.withdrawn, text)
        buttons = (*self.verdicts.values(), self.withdraw)
        for button in buttons:
            button.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        fill_layout(QHBoxLayout(self), *((part, 1) for part in buttons), margins=0, spacing=4)
        keys().changed.connect(self._print_keys)
        self._print_keys()
        self.offer(None)

    def offer(self, item: QueueItem | None) -> None:
        """Offer verdicts on a difference, or to withdraw the one that is given."""
        judged = isinstance(item, StoredVerdict)
        for button in self.verdicts.values():
            button.setHidden(judged)
            obstacle = "" if isinstance(item, Difference) else CHOOSE_DIFFERENCE
            set_enabled_with_reason(button, obstacle)
        self.withdraw.setHidden(not judged)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._print_keys()

    def _print_keys(self) -> None:
        """Write each key below its verdict."""
        width = self.fontMetrics().horizontalAdvance
        longest = max(width(text) for text, _, _ in VERDICTS.values())
        short = self.width() < len(VERDICTS) * (longest + BUTTON_MARGIN)
        for verdict, button in self.verdicts.items():
            key = keys().shown(f"verdict_{verdict}")
            text = VERDICTS[verdict][short]
            button.setText(f"{text}\n{key}" if key else text)


UndoKind = Literal["undo", "redo"]
_time = attrgetter("time")


@dataclass(frozen=True)
class _VerdictChange:
    """A verdict that was given or withdrawn."""

    verdict: StoredVerdict
    withdrawn: bool
    edit: int
    time: datetime


class VerdictUndo:
    """The verdicts of this session, undone and redone in order of time with the coder's edits.

    After a verdict the coder goes on at once, often to another demonstration, so edits are looked
    for in the open one and in that of the latest verdict; what changes is shown.
    """

    def __init__(self, document: Document) -> None:
        self._document = document
        self._done: list[_VerdictChange] = []
        self._undone: list[_VerdictChange] = []
        document.project_changed.connect(self._forget)
        document.author_changed.connect(self._forget)

    def add(self, verdict: StoredVerdict, edit: int = 0, *, withdrawn: bool = False) -> None:
        """A verdict was given or withdrawn, with the edit of that number; 0 without one."""
        self._done.append(_VerdictChange(verdict, withdrawn, edit, utc_now()))
        self._undone.clear()

    def holds(self, kind: UndoKind) -> bool:
        """Whether there is a verdict that may be undone or redone."""
        return bool(self._done if kind == "undo" else self._undone)

    def revert(self, kind: UndoKind) -> bool:
        """Undo the latest verdict or edit, whichever is newer; or redo what was undone last."""
        document, project, undoing = self._document, self._document.project, kind == "undo"
        done, undone = self._done, self._undone
        changes, opposite = (done, undone) if undoing else (undone, done)
        while changes and self._counts(changes[-1]) == (changes[-1].withdrawn == undoing):
            changes.pop()  # undone or redone elsewhere
        if changes and not undoing and project is not None and document.id:
            latest = project.tracks.history(document.id, document.author, latest=1)
            if latest and latest[0].reverts is None and latest[0].time > changes[-1].time:
                changes.clear()
        if not changes or project is None:
            return self._revert_edit(kind)
        change = changes[-1]
        ids = {document.id, change.verdict.demonstration} - {""}
        tops = (project.tracks.revertible(id_, document.author, kind) for id_ in ids)
        edit = max((top for top in tops if top is not None), key=_time, default=None)
        together = edit is not None and change.edit in (edit.id, edit.reverts)
        if edit is not None and edit.time > change.time and not together:
            is_open = edit.demonstration == document.id
            return (is_open or document.review.examine(change.verdict)) and self._revert_edit(kind)
        if change.edit and not together:
            changes.pop()  # its labels went another way
            return self.revert(kind)
        if not document.review.examine(change.verdict):
            return False
        if not together:
            self._revert_verdict(change, project, kind)
        elif not self._revert_edit(kind):  # the verdict goes with its edit
            return False
        opposite.append(replace(changes.pop(), time=utc_now()))
        return True

    def _revert_edit(self, kind: UndoKind) -> bool:
        editor = self._document.editor
        result = editor.undo_everywhere() if kind == "undo" else editor.redo_everywhere()
        return result is not None

    def _revert_verdict(self, change: _VerdictChange, project: Project, kind: UndoKind) -> None:
        """Withdraw a verdict, or give it again."""
        document = self._document
        if change.withdrawn == (kind == "redo"):
            withdraw_verdict(project, change.verdict, document.author)
            document.show_message("The verdict is withdrawn.")
        else:
            project.coding.add_verdict(replace(change.verdict, id=0))
            document.show_message("The verdict counts again.")

    def _counts(self, change: _VerdictChange) -> bool:
        """Whether this verdict counts now."""
        project, verdict = self._document.project, change.verdict
        return project is not None and any(
            (v.place, v.verdict) == (verdict.place, verdict.verdict)
            for v in project.coding.verdicts(verdict.demonstration)
        )

    def _forget(self) -> None:
        self._done.clear()
        self._undone.clear()


class QueueView(QWidget):
    """Differences between the run and the tracks as they are now, and three verdicts."""

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document = document
        self.reader = QueueLoader(document, jobs, self)
        # Asked for before the comparison was there.
        self._steps = 0
        self._verdict: VerdictKind | None = None
        self.history = VerdictUndo(document)
        self.setAccessibleName("Disagreement queue")
        self.model = QueueModel(self)
        self.list = QueueList(self.model, lambda: self.reader.vocabulary)
        self.list.chosen.connect(document.review.examine)
        self.list.withdrawn.connect(self.withdraw)
        hint = "Filter by action or demonstration"
        self.filter = search_field(hint, hint)
        self.filter.textChanged.connect(self._show)
        self.buttons = VerdictButtons()
        self.buttons.judged.connect(self.judge)
        self.buttons.withdrawn.connect(self.withdraw)
        self._summary, self.pages = muted_label(), PageOrPlaceholder(self.list)
        parts = self.filter, self._summary, self.pages, self.buttons
        page_layout(self, *parts, growing=self.pages, margin=4, spacing=4)
        self.reader.changed.connect(self._compared)
        document.review.examined_changed.connect(self._follow)
        document.review.training_changed.connect(self._training_changed)
        self._show()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.reader.watched = True
        if self.reader.stale:
            self.reader.compare()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self.reader.watched = False

    # Verbs of the window

    @property
    def queue(self) -> Queue:
        return self.reader.read.queue if self.reader.read is not None else Queue()

    def step(self, direction: int) -> None:
        """Go to the next difference, or with -1 to the one before, once it is known; it wraps."""
        if self.reader.stale:
            self._steps = direction
            self.reader.compare()
            return
        if not self.list.waiting:
            if self.list.unfold_first():
                self.step(direction)
                return
            self.document.show_message(self._missing or "Everything listed is judged.")
            return
        place, wrapped = self.list.beside(direction)
        if not self.document.review.examine(place):
            return
        if wrapped:
            self.document.show_message(f"Back at the {'first' if direction > 0 else 'last'}.")
        elif not self.isVisible():  # or one would wonder what is wrong there
            human, model = action_name(place.human), action_name(place.predicted)
            self.document.show_message(f"Human: {human}; model: {model}.")

    def judge(self, verdict: VerdictKind) -> bool:
        """Judge the examined difference, and go on to the next one.

        If the model is right, the coder's own track gets what it predicts, as one edit that can be
        undone; the difference is open again then.
        """
        item, read = self.list.current, self.reader.read
        if read is None or not isinstance(item, Difference):
            if self.reader.stale and self.document.review.examined is not None:
                self._verdict = verdict  # it may be open again, after an undo
                self.reader.compare()
                return False
            self.document.refuse(CHOOSE_DIFFERENCE)
            return False
        difference, run = item, read.run
        self.document.show_message("")  # what became of the verdict before is over
        after = self.list.after()
        project, author = self.document.project, self.document.author
        assert project is not None
        edit = None
        try:
            if verdict == "model":
                before = project.tracks.head(difference.demonstration, author)
                if not self._repaint(difference, run):
                    return False
                if project.tracks.head(difference.demonstration, author) != before:
                    edit = project.tracks.revertible(difference.demonstration, author, "undo")
            stored = record_verdict(project, run, difference, verdict, author, edit)
        except ForcelabError as error:
            self.document.refuse(str(error))
            return False
        self.history.add(stored, edit.id if edit is not None else 0)
        self.reader.put_away(self.queue.after(stored, difference))
        if after is not None:
            self.document.review.examine(after)
        elif not self.list.waiting:
            self.document.show_message(what_is_left_text(self.list.folded))
        self.reader.track_changed()
        return True

    def revert(self, kind: UndoKind) -> bool:
        """Undo or redo the latest verdict or edit."""
        try:
            performed = self.history.revert(kind)
        except ForcelabError as error:
            self.document.refuse(str(error))
            return False
        if performed:
            self.reader.track_changed()
        return performed

    def withdraw(self) -> bool:
        """Withdraw the verdict on the chosen item; it is open again."""
        item, project = self.list.current, self.document.project
        if project is None or not isinstance(item, StoredVerdict):
            self.document.show_message(
                "Choose a judged place first, at the end of the queue.", True
            )
            return False
        try:
            withdraw_verdict(project, item, self.document.author)
            self.history.add(item, withdrawn=True)
        except ForcelabError as error:
            self.document.refuse(str(error))
            return False
        self.document.show_message("The verdict is withdrawn; labels stay as they are.")
        self.reader.track_changed()
        self.reader.compare()
        return True

    # Inside

    def _repaint(self, difference: Difference, run: RunResult) -> bool:
        """Give the coder's track what the model predicts; gives whether to store the verdict."""
        document = self.document
        if document.author != run.author:
            coder = run.author
            key = keys().shown("copy_from") or "in the menu Segments"
            document.show_message(
                f"The verdict is kept; only {coder} can change {coder}'s labels. To change them as "
                f"{document.author}, copy them ({key})."
            )
            return True
        if document.id != difference.demonstration and not document.review.examine(difference):
            return False
        action, start, end = model_action(run, difference), difference.start, difference.end
        if action is None:
            document.editor.erase(start, end)
        else:
            document.review.adopt(Segment(start, end, action))
        return not document.refused

    def _follow(self) -> None:
        """Mark the examined interval, wherever it was chosen; only that one is judged."""
        self.list.mark(self.document.review.examined)
        self.buttons.offer(self.list.current)

    def _training_changed(self) -> None:
        if self.document.review.run is None:
            self._show()

    def _compared(self) -> None:
        """Show the comparison, then carry out what was asked for meanwhile."""
        self._show()
        pending = self._steps or self._verdict
        if pending and self.reader.stale and not self.reader.watched:
            self.reader.compare()  # labels changed during it, and hidden it is not repeated
            return
        if self._steps and not self.reader.stale:
            direction, self._steps = self._steps, 0
            self.step(direction)
        if self._verdict and not self.reader.stale:
            verdict, self._verdict = self._verdict, None
            self.judge(verdict)

    @property
    def _missing(self) -> str:
        """Why there is nothing to list; empty where there is something."""
        run, read = self.document.review.run, self.reader.read
        if run is None and self.document.review.training:
            return (
                "A recogniser is being trained; every place where you and it differ will be "
                "listed here."
            )
        if run is None:
            return "Train a recogniser, and every place where you and it differ is listed here."
        if read is None:
            return "Comparing…"
        if read.queue.open or read.queue.judged:
            return ""
        if not run.tested:
            nothing = "Nothing was tested, so nothing can differ."
            return untested_text(run, nothing, "See the page Proposals.")
        blind = "You code these demonstrations blind; what differs is shown when done."
        return "Labels and predictions agree everywhere." if read.run.tested else blind

    def _show(self) -> None:
        read = self.reader.read
        names = {} if read is None else {d.id: d.name for d in read.run.tested}
        if self.model.show(self.queue, names, self.filter.text()):
            self.list.mark(self.document.review.examined, unfold=False)
        self.list.viewport().update()
        empty = self._missing
        if not empty and not self.model.sections:
            empty = "Nothing here fits the filter."
        self.pages.say(empty)
        for part in (self.filter, self.buttons, self._summary):
            part.setVisible(bool(self.queue.open or self.queue.judged))
        self._summary.setText(queue_summary(self.queue))
        self.buttons.offer(self.list.current)
