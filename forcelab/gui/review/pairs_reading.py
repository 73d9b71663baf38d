"""The tracks of an outcome's demonstrations as they are now, followed while somebody paints."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from PySide6.QtCore import QObject, Signal

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.review.pairs_rows import read_tracks, tracks_of
from forcelab.labels import Segments, is_model

__all__ = ["CurrentTracks", "other_coders"]

KEY = "pairs tracks"


class CurrentTracks(QObject):
    """Tracks by demonstration and coder, spelt as in the outcome.

    Parameters
    ----------
    document : Document
    jobs : Jobs
        Reads all tracks in the background.
    parent : QObject, optional

    Attributes
    ----------
    tracks : dict
        What was read, by id and coder; of the tested demonstrations only.

    Signals
    -------
    changed()
        Of several demonstrations.
    """

    changed = Signal()

    def __init__(self, document: Document, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.tracks: dict[str, dict[str, Segments]] = {}
        self._document = document
        self._jobs = jobs
        self._painted: set[str] = set()

    def forget(self) -> None:
        """Another outcome is reviewed."""
        self._jobs.cancel(KEY)
        self.tracks = {}

    def lacks(self, coders: Collection[str]) -> bool:
        """Whether tracks of these coders were not read yet."""
        return bool(set(coders) - {coder for read in self.tracks.values() for coder in read})

    def read_all(self, coders: Sequence[str], hidden: Collection[str]) -> None:
        """Read the tracks of all demonstrations but the hidden ones, in the background."""
        outcome, project = self._document.outcome, self._document.project
        if outcome is None or project is None:
            return
        ids = {info.id for info in self._document.infos}.difference(hidden)
        self._painted.clear()

        def take(tracks: dict[str, dict[str, Segments]]) -> None:
            # What was painted meanwhile is newer than what the job has read.
            tracks |= {id_: self.tracks[id_] for id_ in self._painted & tracks.keys()}
            if self._document.outcome is outcome and tracks != self.tracks:
                self.tracks = tracks
                self.changed.emit()

        job = read_tracks(project.path, outcome, (outcome.author, *coders), ids)
        self._jobs.run(job, take, key=KEY)

    def read_open(self, coders: Sequence[str]) -> bool:
        """Read the open demonstration's tracks at once; gives whether they are other ones."""
        document = self._document
        outcome, project = document.outcome, document.project
        if outcome is None or project is None:
            return False
        reviewed = next((d for d in outcome.tested if d.id == document.id), None)
        if reviewed is None:
            return False
        try:
            found = tracks_of(project, outcome, reviewed, (outcome.author, *coders))
        except ForcelabError as error:
            document.say(str(error), True)
            return False
        changed = found != self.tracks.get(reviewed.id)
        self.tracks[reviewed.id] = found
        if changed:
            self._painted.add(reviewed.id)
        return changed


def other_coders(document: Document, hidden: Collection[str]) -> tuple[str, ...]:
    """Who else labelled what the outcome tested, as far as it is not hidden."""
    outcome = document.outcome
    if outcome is None:
        return ()
    tested = {reviewed.id for reviewed in outcome.tested}.difference(hidden)
    infos = (info for info in document.infos if info.id in tested)
    authors = dict.fromkeys(author for info in infos for author in info.authors)
    return tuple(a for a in authors if a != outcome.author and not is_model(a))
