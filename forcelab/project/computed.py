"""What was computed from a project's labels: recognisers and runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from os import PathLike
from pathlib import Path
from typing import Any

from forcelab.errors import InputError
from forcelab.project import clearing, files
from forcelab.project.clearing import RunUse
from forcelab.project.coding import ProjectCoding
from forcelab.project.history import edits_since
from forcelab.project.loading import known_ids
from forcelab.project.made import LabelsUsed, RunSummary, StoredRecogniser, StoredRun
from forcelab.project.runs import (
    RECOGNISERS,
    RUN,
    columns_of,
    keep_recogniser,
    keep_run,
    keeping,
    recogniser_id,
    recogniser_of,
    row_of_run,
    run_of,
    summaries,
)

__all__ = ["ProjectComputed"]


class ProjectComputed(ProjectCoding):
    """The recognisers and runs of a :class:`~forcelab.project.Project`."""

    def add_recogniser(
        self,
        name: str,
        data: bytes | str | PathLike[str],
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
        data : bytes or path-like
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
        columns = columns_of(self._db, settings, seed, labels, versions, time)
        with files.told(f"The recogniser '{name}' was not added to '{self.path}'"):
            content = data if isinstance(data, bytes) else Path(data).read_bytes()
            id_ = recogniser_id(content)
            with keeping(self._db, id_):
                keep_recogniser(self._db, id_, name, content, columns)
        return id_

    def recognisers(self) -> tuple[StoredRecogniser, ...]:
        """Every recogniser, the first one first."""
        return tuple(map(recogniser_of, self._db.all("SELECT * FROM recogniser ORDER BY rowid")))

    def recogniser_path(self, id_: str) -> Path:
        """The file of a recogniser.

        Raises
        ------
        InputError
            If there is no such recogniser or its file is missing.
        """
        if not self._db.one("SELECT 1 FROM recogniser WHERE id = ?", id_):
            raise InputError(
                f"There is no recogniser '{id_}' in '{self.path}' any more; train it again."
            )
        path = self.path / RECOGNISERS / f"{id_}.skops"
        files.check_file(path)
        if not path.is_file():
            raise InputError(f"The file '{path}' is missing; train the recogniser again.")
        return path

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
        columns = columns_of(self._db, settings, seed, labels, versions, time)
        with self._db.writing():
            return keep_run(self._db, kind, result, columns)

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
        columns = columns_of(self._db, settings, seed, labels, versions)
        of_recogniser = columns_of(self._db, settings, seed, trained_on, versions)
        id_ = recogniser_id(content)
        with (
            files.told(f"The recogniser '{name}' was not added to '{self.path}'"),
            keeping(self._db, id_),
        ):
            number = keep_run(self._db, kind, dict(result) | {"recogniser": id_}, columns)
            keep_recogniser(self._db, id_, name, content, of_recogniser)
        return number

    def run_summaries(self, kind: str | None = None) -> tuple[RunSummary, ...]:
        """Every run, or every run of a kind, without its result; the first one first."""
        return summaries(self._db, kind)

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
        return edits_since(self._db, labels, tasks)

    def runs(self) -> tuple[StoredRun, ...]:
        """Every run, the first one first."""
        return tuple(map(run_of, self._db.all(f"SELECT {RUN} FROM run ORDER BY id")))

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
        return run_of(row_of_run(self._db, number))
