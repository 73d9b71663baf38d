"""What the queue shows: tracks and verdicts as they are stored, compared anew in the background."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, QTimer, Signal

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.review.seen import blind_to, seen_of
from forcelab.labels import Segments
from forcelab.project import Project
from forcelab.review.differences import current_tracks, spelt
from forcelab.review.queue import Compared, Queue, arranging
from forcelab.review.run_result import Outcome, vocabulary_of
from forcelab.vocabulary import Vocabulary

__all__ = ["QueueReader", "Read", "reading"]

#: The tracks are compared again when nothing was painted for so many ms.
PAUSE = 120
#: Which job compares.
KEY = "review queue"


@dataclass(frozen=True)
class Read:
    """What was read and compared.

    Parameters
    ----------
    outcome : Outcome
        What it was compared with, as far as the coder may see it.
    queue : Queue
    tracks : dict of str to tuple of Segment
    known : dict of str to Compared
        What need not be compared again while a track stays as it is.
    """

    outcome: Outcome
    queue: Queue = field(default_factory=Queue)
    tracks: dict[str, Segments] = field(default_factory=dict)
    known: dict[str, Compared] = field(default_factory=dict)


def reading(
    path: Path, outcome: Outcome, before: Read | None, changed: Mapping[str, Segments] | None
) -> Generator[Any, None, Read]:
    """Read and compare; a job.

    Parameters
    ----------
    path : Path
        Of the project.
    outcome : Outcome
        Without what the coder may not see.
    before : Read, optional
        What was read before.
    changed : mapping of str to tuple of Segment, optional
        The tracks that differ from `before`, as the coder spells them; None reads all of them.

    Raises
    ------
    ForcelabError
        If the project cannot be read.
    """
    with Project.open(path) as project:
        verdicts = project.verdicts()
        if before is None or changed is None:
            tracks = current_tracks(project, outcome)
        else:
            seen = {reviewed.id: reviewed for reviewed in outcome.tested}
            tracks = {id_: track for id_, track in before.tracks.items() if id_ in seen}
            for id_, track in changed.items():
                if id_ in tracks:
                    tracks[id_] = spelt(track, outcome, seen[id_])
    known = before.known if before is not None else {}
    queue, known = yield from arranging(outcome, tracks, verdicts, known, invented=True)
    return Read(outcome, queue, tracks, known)


class QueueReader(QObject):
    """Keeps the queue of a document's outcome up to date, as long as somebody looks at it.

    Attributes
    ----------
    read : Read or None
        What was found last; None before that.
    vocabulary : Vocabulary
        How the outcome's actions are drawn.
    changed : Signal
        Something else was found.
    watched : bool
        Whether somebody looks: otherwise nothing is compared until :meth:`compare` is called.
    """

    changed = Signal()

    def __init__(self, document: Document, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._document, self._jobs = document, jobs
        self.read: Read | None = None
        self.vocabulary = Vocabulary()
        self.watched = False
        # How many changes there were, and how many of them `read` knows of: all, and those after
        # which every track has to be read again.
        self._changes, self._compared = 1, 0
        self._upheavals, self._reread = 1, 0
        self._infos = document.infos
        self._soon = QTimer(self, singleShot=True, interval=PAUSE)
        self._soon.timeout.connect(self.compare)
        document.outcome_changed.connect(self._all_changed)
        document.listing_changed.connect(self._listing_changed)
        document.author_changed.connect(self._author_changed)
        document.tracks_changed.connect(self.track_changed)
        document.vocabulary_changed.connect(self._look_up)

    @property
    def stale(self) -> bool:
        """Whether something has changed that `read` does not know of."""
        return self._compared != self._changes

    def track_changed(self) -> None:
        """The open demonstration's track or the verdicts have changed."""
        self._changes += 1
        if self._document.outcome is None:
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
            outcome = seen_of(document)
        except ForcelabError as error:
            document.say(str(error), True)
            return
        if outcome is None or document.project is None:
            self._jobs.cancel(KEY)
            self.read, self._compared = None, self._changes
            self.changed.emit()
            return
        before = self.read
        if before is not None and before.outcome.number != outcome.number:
            before = None
        changed = None
        if before is not None and self._reread == self._upheavals:
            own = bool(document.id) and document.author == outcome.author
            changed = {document.id: document.segments} if own else {}
        self._jobs.run(
            reading(document.project.path, outcome, before, changed),
            partial(self._done, self._changes, self._upheavals if changed is None else None),
            key=KEY,
        )

    def _all_changed(self) -> None:
        """Another outcome; or tracks of any demonstration may have changed."""
        self._upheavals += 1
        self.track_changed()

    def _author_changed(self) -> None:
        """Somebody else looks, who may not be to see what is shown."""
        self._forget_blind()
        self._all_changed()

    def _forget_blind(self) -> None:
        """Show at once nothing of what is coded blind from now on."""
        if self.read is not None:
            blind = blind_to(self._document)
            if any(one.id in blind for one in self.read.outcome.tested):
                self.read = None
                self.changed.emit()

    def _listing_changed(self) -> None:
        """The list was read again; where only the open one was, its track has said so already."""
        self._forget_blind()
        here = self._document.id
        others = [
            [i for i in infos if i.id != here] for infos in (self._infos, self._document.infos)
        ]
        self._infos = self._document.infos
        same = len(others[0]) == len(others[1])
        if not same or any(a is not b for a, b in zip(*others, strict=True)):
            self._all_changed()

    def _done(self, changes: int, upheavals: int | None, read: Read) -> None:
        """Take over what was found."""
        self.read, self._compared = read, changes
        if upheavals is not None:
            self._reread = upheavals
        self._forget_blind()  # somebody else may look by now than when it began
        self._look_up()
        self.changed.emit()

    def _look_up(self) -> None:
        """Look up how the outcome's actions are drawn."""
        project = self._document.project
        if self.read is None or project is None:
            return
        self.vocabulary = vocabulary_of(project, self.read.outcome)
