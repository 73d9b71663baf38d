"""The queue in the window: every place where human and model differ, one key each."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.arranging import PageOrNote, column, muted, search_field
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.review.queue_buttons import VerdictButtons
from forcelab.gui.review.queue_list import QueueList
from forcelab.gui.review.queue_model import Item, QueueModel
from forcelab.gui.review.queue_reading import QueueReader
from forcelab.gui.review.queue_undo import VerdictHistory
from forcelab.gui.review.queue_words import action_name, missing, summary
from forcelab.gui.shortcuts import keys
from forcelab.labels import Segment
from forcelab.project.records import StoredVerdict, VerdictKind
from forcelab.review.differences import Difference
from forcelab.review.queue import Queue
from forcelab.review.run_result import Outcome
from forcelab.review.verdicts import action_for, judge, withdraw

__all__ = ["QueueView"]


class QueueView(QWidget):
    """Differences by section, and three verdicts.

    Parameters
    ----------
    document : Document
        Whose outcome is compared with the tracks as they are now.
    jobs : Jobs
        Where that is done.
    """

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document = document
        self.reader = QueueReader(document, jobs, self)
        # Asked for before the comparison was there.
        self._steps = 0
        self._verdict: VerdictKind | None = None
        self._history = VerdictHistory(document)
        self.setAccessibleName("Disagreement queue")
        self.model = QueueModel(self)
        self.list = QueueList(self.model, lambda: self.reader.vocabulary)
        self.list.chosen.connect(document.examine)
        self.list.withdrawn.connect(self.withdraw)
        sought = "Filter by action or demonstration"
        self.filter = search_field(sought, sought)
        self.filter.textChanged.connect(self._show)
        self.buttons = VerdictButtons()
        self.buttons.judged.connect(self.judge)
        self.buttons.withdrawn.connect(self.withdraw)
        self._summary, self._pages = muted(), PageOrNote(self.list)
        parts = self.filter, self._summary, self._pages, self.buttons
        column(self, *parts, growing=self._pages, margin=4, spacing=4)
        self.reader.changed.connect(self._compared)
        document.examined_changed.connect(self._follow)
        document.training_changed.connect(self._training_changed)
        self._show()

    def showEvent(self, event: QShowEvent) -> None:
        """Catch up with what happened while it was hidden."""
        super().showEvent(event)
        self.reader.watched = True
        if self.reader.stale:
            self.reader.compare()

    def hideEvent(self, event: QHideEvent) -> None:
        """Compare no more until it is wanted."""
        super().hideEvent(event)
        self.reader.watched = False

    # Verbs of the window

    @property
    def queue(self) -> Queue:
        """What was found."""
        return self.reader.read.queue if self.reader.read is not None else Queue()

    @property
    def current(self) -> Item | None:
        """The item that is being looked at."""
        return self.list.current

    def step(self, direction: int) -> None:
        """Go to the next difference, or with -1 to the one before, as soon as it is known.

        After the last one the first comes again.
        """
        if self.reader.stale:
            self._steps = direction
            self.reader.compare()
            return
        if not self.list.waiting:
            if self.list.unfold_one():
                self.step(direction)
                return
            self.document.say(self._missing or "Everything listed is judged.")
            return
        place, wrapped = self.list.beside(direction)
        if not self.document.examine(place):
            return
        if wrapped:
            first, last = "Back at the first.", "Back at the last."
            self.document.say(first if direction > 0 else last)
        elif not self.isVisible():  # or one would wonder what is wrong there
            sides = map(action_name, (place.human, place.predicted))
            self.document.say("Human: {}; model: {}.".format(*sides))

    def judge(self, verdict: VerdictKind) -> bool:
        """Say who is right about the difference that is examined, and go on to the next one.

        If the model is right, the coder's own track gets what it predicts, as one edit that can be
        undone; the difference is open again then.
        """
        item, read = self.current, self.reader.read
        if item is None or read is None or not isinstance(item.about, Difference):
            if self.reader.stale and self.document.examined is not None:
                self._verdict = verdict  # it may be open again, after an undo
                self.reader.compare()
                return False
            self.document.say("Choose a difference to judge first, with N.", True)
            return False
        difference, outcome = item.about, read.outcome
        self.document.say("")  # what became of the verdict before is over
        after = self.list.after()
        project, author = self.document.project, self.document.author
        assert project is not None
        edit = None
        try:
            if verdict == "model":
                before = project.head(difference.demonstration, author)
                if not self._repaint(difference, outcome):
                    return False
                if project.head(difference.demonstration, author) != before:
                    edit = project.revertible(difference.demonstration, author, "undo")
            said = judge(project, outcome, difference, verdict, author, edit)
        except ForcelabError as error:
            self.document.say(str(error), True)
            return False
        self._history.add(said, edit.id if edit is not None else 0)
        self.reader.put_away(self.queue.after(said, difference))
        if after is not None:
            self.document.examine(after)
        elif not self.list.waiting:
            self.document.say("That was the last one; everything listed is judged.")
        self.reader.track_changed()
        return True

    def undo(self) -> bool:
        """Take back the latest verdict or edit, wherever that was."""
        return self._revert(self._history.undo)

    def redo(self) -> bool:
        """Give the verdict again, or make the edit again, that was taken back last."""
        return self._revert(self._history.redo)

    def _revert(self, verb: Callable[[], bool]) -> bool:
        """Undo or redo, and show what came of it."""
        try:
            done = verb()
        except ForcelabError as error:
            self.document.say(str(error), True)
            return False
        if done:
            self.reader.track_changed()
        return done

    def withdraw(self) -> bool:
        """Take back what was said of the item that is chosen; it is open again."""
        item, project = self.current, self.document.project
        if item is None or project is None or not isinstance(item.about, StoredVerdict):
            self.document.say("Choose a judged place first, at the end of the queue.", True)
            return False
        try:
            withdraw(project, item.about, self.document.author)
            self._history.add_withdrawn(item.about)
        except ForcelabError as error:
            self.document.say(str(error), True)
            return False
        told = "The verdict is withdrawn; labels stay as they are."
        self.document.say(told)
        self.reader.track_changed()
        self.reader.compare()
        return True

    # Inside

    def _repaint(self, difference: Difference, outcome: Outcome) -> bool:
        """Give the coder's track what the model sees; gives whether the verdict may be kept."""
        document = self.document
        if document.author != outcome.author:
            told = (
                "The verdict is kept; only {0} can change {0}'s labels. To change them as {1}, "
                "copy them ({2})."
            )
            key = keys().shown("copy_from") or "in the menu Segments"
            document.say(told.format(outcome.author, document.author, key))
            return True
        if document.id != difference.demonstration and not document.examine(difference):
            return False
        action, start, end = action_for(outcome, difference), difference.start, difference.end
        if action is None:
            document.erase(start, end)
        else:
            document.adopt(Segment(start, end, action))
        return not document.refused

    def _follow(self) -> None:
        """Mark the place that is examined, wherever it was chosen; only that one is judged."""
        self.list.mark(self.document.examined)
        self._offer()

    def _offer(self) -> None:
        """Offer the verdicts that can be given."""
        item = self.current
        self.buttons.offer(
            open_=item is not None and not item.judged, judged=bool(item and item.judged)
        )

    def _training_changed(self) -> None:
        """Where there is nothing to list yet, say that it will come."""
        if self.document.outcome is None:
            self._show()

    def _compared(self) -> None:
        """Show what was found, and go where one wanted to go meanwhile."""
        self._show()
        if self._steps and not self.reader.stale:
            direction, self._steps = self._steps, 0
            self.step(direction)
        if self._verdict and not self.reader.stale:
            verdict, self._verdict = self._verdict, None
            self.judge(verdict)

    @property
    def _missing(self) -> str:
        """Why there is nothing to list, if that is so."""
        return missing(self.document.outcome, self.reader.read, training=self.document.training)

    def _show(self) -> None:
        """Show what the filter lets through."""
        read = self.reader.read
        names = {} if read is None else {d.id: d.name for d in read.outcome.tested}
        if self.model.show(self.queue, names, self.filter.text()):
            self.list.mark(self.document.examined, unfold=False)
        self.list.viewport().update()
        empty = self._missing
        if not empty and not self.model.sections:
            empty = "Nothing here fits the filter."
        self._pages.say(empty)
        there = bool(self.queue.open or self.queue.judged)
        self.filter.setVisible(there)
        self.buttons.setVisible(there)
        self._summary.setVisible(there)
        self._summary.setText(summary(self.queue))
        self._offer()
