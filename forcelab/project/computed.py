"""What was computed from a project's labels: recognisers and runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from forcelab.project import clearing
from forcelab.project.clearing import RunUse
from forcelab.project.coding import ProjectCoding
from forcelab.project.database import Database
from forcelab.project.loading import known_ids
from forcelab.project.made import LabelsUsed, RunSummary, StoredRecogniser, StoredRun
from forcelab.project.runs import Making, Runs

__all__ = ["ProjectComputed"]


class ProjectComputed(ProjectCoding):
    """The recognisers and runs of a :class:`~forcelab.project.Project`."""

    def __init__(self, path: Path, database: Database) -> None:
        super().__init__(path, database)
        self._runs = Runs(database)

    def add_recogniser(
        self,
        name: str,
        data: bytes | Path,
        *,
        settings: Mapping[str, Any],
        seed: int | None,
        labels: Sequence[LabelsUsed],
        versions: Mapping[str, str],
        time: datetime | None = None,
    ) -> str:
        """Keep a recogniser's file, which stays opaque here, and how it was made; gives its id.

        Parameters
        ----------
        name : str
            For people; not blank.
        data : bytes or Path
            Its content, or the file. The same content is kept once, as it was added first.
        settings : mapping
            Everything that training was told; anything that JSON can hold.
        seed : int or None
            The random seed.
        labels : sequence of LabelsUsed
            What it was trained on, one for each demonstration; see :meth:`head`.
        versions : mapping of str to str
            Of the program and the libraries.
        time : datetime, optional
            When it was made, in UTC; by default now.

        Raises
        ------
        InputError
            If it has no name, labels are not in the project or the file cannot be read.
        """
        made = Making(settings, seed, labels, versions, time)
        return self._runs.add_recogniser(name, data, made)

    def recognisers(self) -> tuple[StoredRecogniser, ...]:
        """Every recogniser, the first one first."""
        return self._runs.recognisers()

    def recogniser_path(self, id_: str) -> Path:
        """The file of a recogniser.

        Raises
        ------
        InputError
            If there is no such recogniser or its file is missing.
        """
        return self._runs.recogniser_path(id_)

    def add_run(
        self,
        kind: str,
        *,
        settings: Mapping[str, Any],
        seed: int | None,
        labels: Sequence[LabelsUsed],
        versions: Mapping[str, str],
        result: Mapping[str, Any],
        time: datetime | None = None,
    ) -> int:
        """Keep what was computed, and how; gives its number.

        Parameters
        ----------
        kind : str
            Such as ``"evaluate"``; not blank.
        settings, seed, labels, versions, time
            As of :meth:`add_recogniser`.
        result : mapping
            What came out; anything that JSON can hold.

        Raises
        ------
        InputError
            If it has no kind or labels are not in the project.
        """
        return self._runs.add_run(kind, Making(settings, seed, labels, versions, time), result)

    def add_training(
        self,
        kind: str,
        name: str,
        content: bytes,
        *,
        settings: Mapping[str, Any],
        seed: int | None,
        labels: Sequence[LabelsUsed],
        trained_on: Sequence[LabelsUsed],
        versions: Mapping[str, str],
        result: Mapping[str, Any],
    ) -> int:
        """Keep a run and its recogniser, both or neither; gives the run's number.

        Parameters
        ----------
        kind, settings, seed, labels, versions
            As of :meth:`add_run`.
        name, content
            The recogniser's, as of :meth:`add_recogniser`.
        trained_on : sequence of LabelsUsed
            What the recogniser was trained on.
        result : mapping
            What came out; the recogniser's id is added to it as ``"recogniser"``.

        Raises
        ------
        InputError
            If labels are not in the project, or it cannot be written.
        """
        made = Making(settings, seed, labels, versions)
        return self._runs.add_training(kind, made, result, (name, content, trained_on))

    def run_summaries(self, kind: str | None = None) -> tuple[RunSummary, ...]:
        """Every run, or every run of a kind, without its result; the first one first."""
        return self._runs.summaries(kind)

    def still_there(self, labels: Iterable[LabelsUsed]) -> list[LabelsUsed]:
        """Those of some labels whose demonstrations have not been removed meanwhile.

        What took minutes to compute from the others is worth keeping.
        """
        there = known_ids(self._db)
        return [used for used in labels if used.demonstration in there]

    def edits_since(self, labels: Sequence[LabelsUsed], tasks: Sequence[str] = ()) -> int:
        """How many edits some labels have had since, and how many demonstrations are new.

        Parameters
        ----------
        labels : sequence of LabelsUsed
            Whose later edits are counted; one that was taken back counts for nothing.
        tasks : sequence of str
            Their demonstrations that `labels` does not name are counted.
        """
        return self._runs.edits_since(labels, tasks)

    def runs(self) -> tuple[StoredRun, ...]:
        """Every run, the first one first."""
        return self._runs.runs()

    def forget_run(self, number: int, proposer: str) -> bool:
        """Delete a run that another one has taken the place of, with its recogniser.

        It stays where a verdict was given on it or labels were accepted from it: what people said
        is kept for ever, with what they said it of.

        Parameters
        ----------
        number : int
            The run's.
        proposer : str
            As whom it proposed labels.

        Returns
        -------
        bool
            Whether it is gone.
        """
        return clearing.forget_run(self._db, number, proposer)

    def run_uses(self, number: int | None = None) -> tuple[RunUse, ...]:
        """What runs take up on the disk and what hangs on them, the first one first.

        Parameters
        ----------
        number : int, optional
            Only of this run; by default of every one.
        """
        return clearing.uses(self._db, number)

    def recogniser_bytes(self) -> dict[str, int]:
        """How large the file of each recogniser is, by its id; 0 where it is missing."""
        return clearing.recogniser_bytes(self._db)

    def remove_run(self, number: int) -> None:
        """Delete a run for good: its predictions and scores, and its recogniser.

        Labels stay, those accepted from its predictions, too, and still tell who proposed them;
        verdicts stay, but no longer tell which run they were given on. A recogniser that another
        run has as well stays. Room that is free then is given back to the disk.

        Raises
        ------
        InputError
            If there is no such run.
        """
        clearing.remove_run(self._db, number)

    def remove_recogniser(self, id_: str) -> None:
        """Delete a recogniser for good; a run that it belongs to keeps what it found.

        Raises
        ------
        InputError
            If there is no such recogniser.
        """
        clearing.remove_recogniser(self._db, id_)

    def run(self, number: int) -> StoredRun:
        """One run.

        Raises
        ------
        InputError
            If there is no such run, or it is damaged.
        """
        return self._runs.run(number)
