"""What became of predictions: verdicts on them, and which labels come from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from forcelab.labels import Segment
from forcelab.project.database import Database
from forcelab.project.decisions import StoredVerdict, Verdict
from forcelab.project.folder import ProjectFolder
from forcelab.project.loading import known_id
from forcelab.project.origins import Origins
from forcelab.project.records import Origin
from forcelab.project.verdicts import Verdicts

__all__ = ["ProjectJudged"]


class ProjectJudged(ProjectFolder):
    """The verdicts of a :class:`~forcelab.project.Project`, and the origins of its labels."""

    def __init__(self, path: Path, database: Database) -> None:
        super().__init__(path, database)
        self._verdicts = Verdicts(database)
        self._origins = Origins(database)

    def add_verdict(self, verdict: Verdict) -> StoredVerdict:
        """Keep a verdict for ever; no label changes.

        Parameters
        ----------
        verdict : Verdict
            One of the kind ``"withdrawn"`` takes back what was said of the same place before.

        Returns
        -------
        StoredVerdict
            With its number, and with the time now where it had none.

        Raises
        ------
        InputError
            If there is no such demonstration or run, the stretch is empty, or a name is blank.
        """
        return self._verdicts.add((verdict,))[0]

    def add_verdicts(self, verdicts: Iterable[Verdict]) -> tuple[StoredVerdict, ...]:
        """Keep several verdicts as one transaction, all or nothing; see :meth:`add_verdict`."""
        return self._verdicts.add(verdicts)

    def verdicts(self, demonstration: str | None = None) -> tuple[StoredVerdict, ...]:
        """The verdicts that count: of each place the latest, unless it was withdrawn.

        A place is a stretch of a coder's labels over a demonstration with what coder and model see
        there; see :attr:`Verdict.place`.

        Parameters
        ----------
        demonstration : str, optional
            Its id; by default those on all demonstrations.

        Returns
        -------
        tuple of StoredVerdict
            In the order in which they were given.
        """
        return self._verdicts.counting(demonstration)

    def verdict_events(self) -> tuple[StoredVerdict, ...]:
        """Every verdict ever given, the first one first."""
        return self._verdicts.events(None)

    def origins(self, demonstration: str, author: str) -> Mapping[Segment, Origin]:
        """Which segments of a track, as it is now, a model proposed; what is human is left out.

        A segment keeps its origin, as changed, while a hand moves its edges, splits it, or merges
        it with others; one that gets another action is the coder's. What is taken back takes
        origins back as well.

        Parameters
        ----------
        demonstration, author : str
            Whose track over what.

        Returns
        -------
        mapping of Segment to Origin
            Stays as it is when the track is edited. The same object as long as nothing in it
            changes, so that it costs a query of the latest edit only.

        Raises
        ------
        InputError
            If there is no such demonstration.
        """
        origins = self._origins.of(demonstration, author)
        if origins is None:
            known_id(self._db, demonstration)
            return {}
        return origins
