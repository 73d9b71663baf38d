"""Why: what spoke for the predicted action at a place, and which training segments are alike."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from PySide6.QtCore import QTimer
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.arranging import PageOrNote, column
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.review import why_words
from forcelab.gui.review.seen import blind_to
from forcelab.gui.review.why_choice import at_cursor, chosen, reason
from forcelab.gui.review.why_jobs import Shelf, explain, withhold
from forcelab.gui.review.why_page import WhyPage
from forcelab.jobs import Progress
from forcelab.review.differences import Interval

if TYPE_CHECKING:
    from forcelab.review.explanation import Why, Withheld
    from forcelab.review.run_result import Outcome

__all__ = ["WhyView"]

#: Keys of the jobs.
KEYS = TRAINING, EXPLAINING, TRACING = "why training", "why", "why traces"
#: ms in which several things that change at once are answered once.
TOGETHER = 20


class WhyView(QWidget):
    """Explains the place that is examined, the selected segment, or what is at the cursor.

    Nothing is computed while it is hidden. The recogniser that has not seen the demonstration is
    trained in the background the first time that a place of it is explained, and then kept.

    Attributes
    ----------
    place : Place or None
        What is explained, or is being explained.
    why : Why or None
        The explanation on the screen; of an older place as long as it is grey.
    """

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document, self.jobs = document, jobs
        self.place: Interval | None = None
        self.why: Why | None = None
        self.shelf = Shelf()
        self._outcome: Outcome | None = None
        self._hidden: frozenset[str] = frozenset()  # what is coded blind by whoever looks
        self._away: Interval | None = None  # the neighbour that is looked at meanwhile
        self._selecting = False  # whether the selection is newer than what was examined
        self._training: tuple[int, str] | None = None  # run and demonstration being withheld
        self._stopped = False
        self._begun = 0.0
        self.setAccessibleName("Why")
        self.page = WhyPage(document)
        self.page.back.clicked.connect(self.go_back)
        self.page.stop.clicked.connect(self._stop_or_go)
        self.page.neighbours.chosen.connect(self._go_to)
        self._room = PageOrNote(self.page)
        column(self, self._room)
        self._timer = QTimer(self, singleShot=True, interval=TOGETHER)
        self._timer.timeout.connect(self.refresh)
        document.outcome_changed.connect(self._ask)
        document.examined_changed.connect(self._examined)
        document.selection_changed.connect(self._selected)
        document.demonstration_changed.connect(self._ask)
        document.tracks_changed.connect(self._ask)
        document.author_changed.connect(self._ask)
        document.listing_changed.connect(self._ask)
        document.cursor_moved.connect(self._moved)

    def showEvent(self, event: QShowEvent) -> None:
        """Catch up with what was asked for meanwhile."""
        super().showEvent(event)
        if blind_to(self.document) != self._hidden:
            self.refresh()  # before anything is painted that may not be seen any more
        self._ask()

    def hideEvent(self, event: QHideEvent) -> None:
        """Nothing is computed for nobody."""
        super().hideEvent(event)
        self._timer.stop()
        self._cancel()
        if self.page.stale or not self.page.neighbours.traced:
            self.place = None  # to be begun again

    @property
    def settled(self) -> bool:
        """Whether all is on the screen that there is to show."""
        waiting = self._timer.isActive() or any(map(self.jobs.awaits, KEYS))
        return not (self.isVisible() and waiting)

    # Which place

    def _ask(self, *_: object) -> None:
        """Look soon what is to be explained."""
        if self.isVisible():
            self._timer.start()

    def _examined(self) -> None:
        self._selecting = False
        self._ask()

    def _selected(self) -> None:
        self._selecting = self.document.selected is not None
        self._ask()

    def _moved(self, *_: object) -> None:
        """The cursor counts only where nothing was chosen."""
        if (
            self.isVisible()
            and not self.document.playing
            and chosen(self.document, self._selecting) is None
        ):
            self._ask()

    def _wanted(self) -> Interval | None:
        """What is to be explained now."""
        if self._away is not None and self.document.examined == self._away:
            here = self.document.id == self._away.demonstration and not self._selecting
            if here and not self.document.coding_blind:
                return self.place
        self._away = None
        return chosen(self.document, self._selecting) or at_cursor(self.document)

    # Showing

    def refresh(self) -> None:
        """Explain what is to be explained, unless it is on the screen already."""
        document = self.document
        place = self._wanted()
        self.page.back.setVisible(self._away is not None)
        self.page.neighbours.mark(self._away)
        if place is None or document.outcome is None:
            self._cancel()
            self.place = self.why = None
            self.page.forget()
            self._room.say(reason(self.document))
            return
        hidden = blind_to(document)
        if (place, hidden) == (self.place, self._hidden) and document.outcome is self._outcome:
            return
        if hidden - self._hidden:  # a neighbour may be among those
            self.page.forget()
        self._hidden = hidden
        if document.outcome is not self._outcome:
            self.shelf.clear()
        self.place, self._outcome, self._stopped = place, document.outcome, False
        self._room.say("")
        reviewed = self._outcome.find(place.demonstration)
        certainty = None if reviewed is None else reviewed.certainty
        self.page.begin(place, certainty, self._outcome.settings.threshold)
        self._cancel(EXPLAINING, TRACING)
        self._begin()

    def _begin(self) -> None:
        """Explain with what is on the shelf, or train it first."""
        project, place, outcome = self.document.project, self.place, self._outcome
        if project is None or place is None or outcome is None:
            return
        id_ = place.demonstration
        withheld = self.shelf.get(project.path, outcome, id_)
        if withheld is not None:
            self.jobs.cancel(TRAINING)  # of another demonstration
            self._explain(withheld)
            return
        ticket = outcome.number, id_
        if self.jobs.awaits(TRAINING) and self._training == ticket:
            return  # on its way
        self._training, self._begun = ticket, time.monotonic()
        path = project.path

        def done(made: Withheld) -> None:
            self.shelf.put(path, outcome, id_, made)
            self._begin()

        job = withhold(path, outcome, id_)
        self.jobs.run(job, done, self._failed, self._tell, TRAINING)
        self._tell(Progress(0, 1, "features"))

    def _explain(self, withheld: Withheld) -> None:
        """Explain the place."""
        project, place, outcome = self.document.project, self.place, self._outcome
        assert project is not None
        assert place is not None
        assert outcome is not None
        self.page.state.hide()
        job = explain(withheld, outcome, place, self._hidden)
        self.jobs.run(job, self._show, self._failed, key=EXPLAINING)

    def _show(self, why: Why) -> None:
        """Put an explanation on the screen; the traces of its neighbours follow."""
        assert self._outcome is not None
        self.why = why
        self.page.show_why(why, self._name_of, self._outcome.settings.threshold)
        self._trace()

    def _trace(self) -> None:
        """Read what the neighbours looked like."""
        project = self.document.project
        places = [card.neighbour.place for card in self.page.neighbours.cards]
        if project is None or not places:
            return
        from forcelab.review.explanation import tracing

        job, show = tracing(project.path, places), self.page.neighbours.show_traces
        self.jobs.run(job, show, self._failed, key=TRACING)

    def _name_of(self, id_: str) -> str:
        """The name of a demonstration."""
        return next((info.name for info in self.document.infos if info.id == id_), id_)

    # Jobs, their progress, and their end

    def _cancel(self, *keys: str) -> None:
        """Give up what nobody waits for any more: without keys, all that is under way."""
        for key in keys or KEYS:
            self.jobs.cancel(key)

    def _tell(self, progress: object) -> None:
        """Say how far the training is."""
        if isinstance(progress, Progress) and self.place and self._outcome:
            name = self._name_of(self.place.demonstration)
            elapsed = time.monotonic() - self._begun
            self.page.say(why_words.left(progress, name, elapsed, self._outcome), "Stop")

    def _failed(self, error: Exception) -> None:
        """Say what stands in the way."""
        self._stopped = True
        told = str(error) if isinstance(error, ForcelabError) else "This did not work."
        self.page.say(told, "Try again")

    def _stop_or_go(self) -> None:
        """Stop the training, or begin again."""
        self._stopped = not self._stopped
        if self._stopped:
            self._cancel()
            self.page.say("Stopped before it was explained.", "Explain")
        else:
            self._begin()

    # Going there and back

    def _go_to(self, place: Interval) -> None:
        """Look at a neighbour; the explanation stays."""
        self._away, before = place, self._away
        if not self.document.examine(place):
            self._away = before
        self.refresh()

    def go_back(self) -> None:
        """Go back from a neighbour to the place that is explained."""
        self._away = None
        if self.place is not None:
            self.document.examine(self.place)
        self.refresh()
