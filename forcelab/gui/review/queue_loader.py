"""The queue's differences and verdicts, compared in the background, and how they are worded."""

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
from forcelab.gui.review.reviewed_run import blind_demonstrations, visible_outcome
from forcelab.labels import Segments
from forcelab.project import Project
from forcelab.review.differences import current_tracks, spelt
from forcelab.review.queue import Compared, Queue, arranging
from forcelab.review.run_result import Outcome, vocabulary_of
from forcelab.review.verdicts import report
from forcelab.vocabulary import Vocabulary

#: The tracks are compared again when nothing was painted for so many ms.
COMPARE_DELAY = 120
#: Which job compares.
QUEUE_JOB = "review queue"


@dataclass(frozen=True)
class QueueData:
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


def read_queue(
    path: Path, outcome: Outcome, before: QueueData | None, changed: Mapping[str, Segments] | None
) -> Generator[Any, None, QueueData]:
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
        verdicts = project.coding.verdicts()
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
    return QueueData(outcome, queue, tracks, known)


class QueueLoader(QObject):
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
        self.read: QueueData | None = None
        self.vocabulary = Vocabulary()
        self.watched = False
        # How many changes there were, and how many of them `read` knows of: all, and those after
        # which every track has to be read again.
        self._changes, self._compared = 1, 0
        self._upheavals, self._reread = 1, 0
        self._infos = document.infos
        self._soon = QTimer(self, singleShot=True, interval=COMPARE_DELAY)
        self._soon.timeout.connect(self.compare)
        document.review.run_changed.connect(self._all_changed)
        document.listing_changed.connect(self._listing_changed)
        document.author_changed.connect(self._author_changed)
        document.tracks_changed.connect(self.track_changed)
        document.vocabulary_changed.connect(self._load_vocabulary)

    @property
    def stale(self) -> bool:
        """Whether something has changed that `read` does not know of."""
        return self._compared != self._changes

    def track_changed(self) -> None:
        """The open demonstration's track or the verdicts have changed."""
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
            outcome = visible_outcome(document)
        except ForcelabError as error:
            document.show_message(str(error), True)
            return
        if outcome is None or document.project is None:
            self._jobs.cancel(QUEUE_JOB)
            self.read, self._compared = None, self._changes
            self.changed.emit()
            return
        before = self.read
        if before is not None and before.outcome.number != outcome.number:
            before = None
        changed = None
        if before is not None and self._reread == self._upheavals:
            own = bool(document.id) and document.author == outcome.author
            changed = {document.id: document.editor.segments} if own else {}
        self._jobs.run(
            read_queue(document.project.path, outcome, before, changed),
            partial(self._done, self._changes, self._upheavals if changed is None else None),
            key=QUEUE_JOB,
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
            blind = blind_demonstrations(self._document)
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

    def _done(self, changes: int, upheavals: int | None, read: QueueData) -> None:
        """Take over what was found."""
        self.read, self._compared = read, changes
        if upheavals is not None:
            self._reread = upheavals
        self._forget_blind()  # somebody else may look by now than when it began
        self._load_vocabulary()
        self.changed.emit()

    def _load_vocabulary(self) -> None:
        """Look up how the outcome's actions are drawn."""
        project = self._document.project
        if self.read is None or project is None:
            return
        self.vocabulary = vocabulary_of(project, self.read.outcome)


def missing_queue_text(outcome: Outcome | None, read: QueueData | None, *, training: bool) -> str:
    """Why there is nothing to list; empty where there is something.

    Parameters
    ----------
    outcome : Outcome or None
        What is reviewed.
    read : Read or None
        What was found in it, of what may be seen.
    training : bool
        Whether a recogniser is being trained.
    """
    if outcome is None:
        coming = (
            "A recogniser is being trained; every place where you and it differ will be listed "
            "here."
        )
        none = "Train a recogniser, and every place where you and it differ is listed here."
        return coming if training else none
    if read is None:
        return "Comparing…"
    if read.queue.open or read.queue.judged:
        return ""
    if not outcome.tested:
        return untested_text(
            outcome,
            "Nothing was tested, so nothing can differ.",
            "What the recogniser proposes for the others is in Proposals.",
        )
    if not read.outcome.tested:
        return "You code these demonstrations blind; what differs is shown when done."
    return "Labels and predictions agree everywhere."


def untested_text(outcome: Outcome, nothing: str, further: str = "") -> str:
    """Why an outcome tested no demonstration, as the run itself has found.

    Parameters
    ----------
    outcome : Outcome
    nothing : str
        What follows from it here; said where the run kept no reason.
    further : str, optional
        What there is all the same.
    """
    reason = outcome.remarks[0] if outcome.remarks else nothing  # the run notes it first
    return " ".join(filter(None, (reason, further)))


def section_text(kind: str) -> str:
    """What a section of the queue holds, in a sentence."""
    return {
        "suspected": "A recogniser that has not seen them contradicts, where it is usually right.",
        "actions": "Both see an action, but not the same one.",
        "missed": "Labelled, and the model sees nothing.",
        "boundaries": "Both see the same actions; only the edge between them differs.",
        "invented": "Unlabelled time, which is never scored, where the model sees an action.",
        "judged": "What somebody has judged, the latest first.",
    }[kind]


def percentages_text(kind: str) -> str:
    """What the percentages of a section are, and in which order it stands."""
    if kind == "suspected":
        return "Percentages: how much speaks for an error of the coder, the largest first."
    return "Percentages: how sure the model is; what is long and sure comes first."


def queue_summary(queue: Queue) -> str:
    """How much is open, and who was right so far."""
    main = len(queue.suspected) + len(queue.actions) + len(queue.missed)
    if not queue.judged:
        return f"{main} to judge, none judged yet."
    said = report(queue.judged)
    return (
        f"{main} to judge. Right so far: human {sum(pair.human_right for pair in said)}, model "
        f"{sum(pair.model_right for pair in said)}; ambiguous "
        f"{sum(pair.ambiguous for pair in said)}."
    )


def action_name(action: str | None) -> str:
    """An action as it is written in a row."""
    return "unlabelled" if action is None else action


def verdict_name(verdict: str) -> str:
    """A verdict as it is written in a row."""
    return {
        "human": "human right",
        "model": "model right",
        "ambiguous": "ambiguous",
    }[verdict]
