"""The project, as everybody outside this package uses it."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Literal

from forcelab.atomic import sync_folder
from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.labels import Segments, Track
from forcelab.project import files
from forcelab.project.adding import add
from forcelab.project.database import Database
from forcelab.project.edits import Tracks
from forcelab.project.loading import DEMONSTRATIONS, find, infos, load, natural_order
from forcelab.project.records import Added, Author, DemonstrationInfo, Edit
from forcelab.project.runs import RECOGNISERS, Runs
from forcelab.project.vocabularies import vocabularies, write_vocabulary
from forcelab.vocabulary import Vocabulary

__all__ = ["Project"]

#: Seconds to wait while another process writes.
BUSY_TIMEOUT = 5.0


class Project(Runs):
    """A folder of demonstrations with everybody's labels and every edit ever made.

    Made by :meth:`create`, :meth:`open` or :meth:`open_or_create`; a context manager. Everything is
    on the disk when a method returns. Several processes may have one project open; each thread
    opens its own. A demonstration is told by its id, except in :meth:`load`.

    Every method raises :class:`~forcelab.errors.InputError` if the disk is full, the store is
    damaged, or another process keeps it busy for more than five seconds; nothing was written then.

    Attributes
    ----------
    path : Path
        The project's folder.
    """

    def __init__(self, path: Path, database: Database) -> None:
        super().__init__(database)
        self.path = path
        self._tracks = Tracks(database)

    @classmethod
    def create(cls, path: str | os.PathLike[str]) -> Project:
        """Make a new project and open it.

        Parameters
        ----------
        path : path-like
            The folder to make, by custom ``NAME.forcelab``; may exist if it is empty.

        Raises
        ------
        InputError
            If there is something already, or the folder cannot be made.
        """
        with cls.creating(path):
            pass
        return cls.open(path)

    @classmethod
    @contextlib.contextmanager
    def creating(cls, path: str | os.PathLike[str]) -> Iterator[Project]:
        """Make a new project that appears under its name once the block has filled it.

        Nothing is left of it if the block raises. Parameters and errors are those of
        :meth:`create`.
        """
        path = Path(path).absolute()
        refused = f"'{path}' cannot become a new project"
        with files.told(refused):
            if path.exists() and not path.is_dir():
                raise InputError(f"{refused}: it is a file; choose another name.")
            if path.exists() and any(path.iterdir()):
                raise InputError(f"{refused}: the folder is not empty; choose another name.")
            part = path.with_name(f".{secrets.token_hex(8)}.part")
            part.mkdir()
        try:
            with files.told(refused):
                (part / DEMONSTRATIONS).mkdir()
                (part / RECOGNISERS).mkdir()
                Database.create(part)
            with cls.open(part) as project:
                yield project
            with files.told(refused):
                sync_folder(part)
                if path.exists():
                    path.rmdir()
                part.rename(path)
                sync_folder(path.parent)
        except InputError as error:  # in the name that the user knows
            raise InputError(str(error).replace(str(part), str(path))) from error
        finally:
            shutil.rmtree(part, ignore_errors=True)

    @classmethod
    def open(cls, path: str | os.PathLike[str], timeout: float = BUSY_TIMEOUT) -> Project:
        """Open a project.

        An older version's is brought up to date; what killed imports left behind is cleared away.

        Parameters
        ----------
        path : path-like
            The project's folder.
        timeout : float
            Seconds to wait while another process writes.

        Raises
        ------
        InputError
            If that is no project, a damaged one or one of a newer version; it stays untouched.
        """
        folder = Path(path).absolute()
        project = cls(folder, Database(folder, timeout))
        try:
            with files.told(f"'{folder}' cannot be opened"):
                project._clear_away()
        except BaseException:
            project.close()
            raise
        return project

    @classmethod
    def open_or_create(cls, path: str | os.PathLike[str]) -> Project:
        """Open what is there; make a project where there is nothing or an empty folder."""
        folder = Path(path)
        with files.told(f"'{folder}' cannot be opened"):
            new = not folder.exists() or (folder.is_dir() and not any(folder.iterdir()))
        return cls.create(folder) if new else cls.open(folder)

    def close(self) -> None:
        """Let go of the store; nothing more can be asked."""
        self._db.close()

    def __enter__(self) -> Project:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    @contextlib.contextmanager
    def snapshot(self) -> Iterator[None]:
        """Reading inside this block shows one moment, whatever other processes commit."""
        with self._db.reading():
            yield

    # Demonstrations

    def add(
        self, demonstration: Demonstration, tracks: Iterable[Track] = (), source: str = ""
    ) -> Added:
        """Add a demonstration, or update the one with the same content.

        Name, task, rate and video become those given; without a video, the one there stays. Where
        another demonstration of the task has the name, a number is put after it. An author's track
        is imported if there is none or it is as last imported; if it was edited since, it stays.
        Actions that the task's vocabulary lacks are added to it.

        Parameters
        ----------
        demonstration : Demonstration
            Its arrays and its video are copied into the project.
        tracks : iterable of Track
            Coders' labels that came with it, at most one track an author.
        source : str
            Where it was read from, for people.

        Raises
        ------
        InputError
            If the video cannot be read or two tracks have one author; nothing was added.
        """
        plain = source.encode("utf-8", "backslashreplace").decode()
        return add(self._db, self._tracks, demonstration, tuple(tracks), plain)

    def demonstrations(self, task: str | None = None) -> tuple[DemonstrationInfo, ...]:
        """What there is, or what there is of one task, sorted by task and name."""
        return infos(self._db, task)

    def tasks(self) -> tuple[str, ...]:
        """The tasks of all demonstrations, sorted."""
        rows = self._db.all("SELECT DISTINCT task FROM demonstration")
        return tuple(sorted((row["task"] for row in rows), key=natural_order))

    def load(self, key: str) -> Demonstration:
        """Load a demonstration; its arrays are mapped into memory, read-only.

        Parameters
        ----------
        key : str
            Its id, its name, or the first six or more digits of its id.

        Raises
        ------
        InputError
            If there is none or more than one such demonstration, or a file of it is missing,
            truncated or another one.
        """
        return load(self._db, key)

    # Labels

    def authors(self) -> tuple[Author, ...]:
        """Everybody who made an edit, in order of first appearance."""
        return self._tracks.authors()

    def track(self, demonstration: str, author: str) -> Track:
        """One author's track, empty if the author made none.

        Raises
        ------
        InputError
            If there is no such demonstration.
        """
        return self._tracks.track(self._id(demonstration), author)

    def tracks(self, demonstration: str) -> tuple[Track, ...]:
        """The tracks over a demonstration, in order of their authors' first appearance.

        Raises
        ------
        InputError
            If there is no such demonstration.
        """
        return self._tracks.tracks(self._id(demonstration))

    def edit(
        self,
        demonstration: str,
        author: str,
        before: Segments,
        after: Segments,
        what: str,
        *,
        kind: Literal["paint", "predict"] = "paint",
    ) -> Edit:
        """Change a track, as one transaction that is on the disk when this returns.

        Parameters
        ----------
        demonstration : str
            Its id.
        author : str
            Whose track is changed, and who changes it. Whoever paints is a coder, whoever predicts
            is a model, and nobody is ever both.
        before, after : tuple of Segment
            The whole track as it is, and as it becomes.
        what : str
            A line of history for people, such as ``"grab 1.25-1.73 s moved to 1.244"``.
        kind : "paint" or "predict"
            Whether a person labelled or a model predicted.

        Raises
        ------
        StaleTrackError
            If the track is not `before`, as another window or process changed it.
        InputError
            If there is no such demonstration, segments overlap or are out of order, or the author
            is of the other kind. Nothing was written then.
        """
        id_ = self._id(demonstration)
        with self._db.writing():
            return self._tracks.edit(id_, author, before, after, what, kind=kind)

    def undo(self, demonstration: str, author: str) -> Edit | None:
        """Take back a track's latest edit not yet taken back; None if there is none.

        Reaches back to the first edit, past restarts. It is an edit itself.
        """
        with self._db.writing():
            return self._tracks.undo(self._id(demonstration), author)

    def redo(self, demonstration: str, author: str) -> Edit | None:
        """Take back a track's latest undo; None if there is none or something was edited since."""
        with self._db.writing():
            return self._tracks.redo(self._id(demonstration), author)

    def history(self, demonstration: str, author: str) -> tuple[Edit, ...]:
        """Every edit ever made of a track, the first one first."""
        return self._tracks.history(self._id(demonstration), author)

    def replay(self, edits: Iterable[Edit]) -> None:
        """Make edits again as they were made, with their times, all or nothing.

        Parameters
        ----------
        edits : iterable of Edit
            In the order in which they were made, as from :meth:`history`; they get new numbers.

        Raises
        ------
        InputError
            If an edit does not fit what the edits before it left, or its demonstration is not here.
        """
        edits = tuple(edits)
        with self._db.writing():
            if missing := {edit.demonstration for edit in edits} - self._ids():
                raise InputError(f"There is no demonstration '{min(missing)}' in '{self.path}'.")
            self._tracks.replay(edits)

    # Vocabularies

    def vocabulary(self, task: str) -> Vocabulary:
        """The actions of a task; empty if there is none."""
        return self.vocabularies().get(task, Vocabulary())

    def vocabularies(self) -> dict[str, Vocabulary]:
        """Every vocabulary by task."""
        return vocabularies(self._db)

    def set_vocabulary(self, task: str, vocabulary: Vocabulary) -> None:
        """Replace the actions of a task; no label changes."""
        with self._db.writing():
            write_vocabulary(self._db, task, vocabulary)

    def _id(self, key: str) -> str:
        """The demonstration's id, if there is such a demonstration."""
        return str(find(self._db, key)["id"])

    def _clear_away(self) -> None:
        """Delete what killed imports left behind."""
        for parent in (self.path / DEMONSTRATIONS, self.path / RECOGNISERS):
            parent.mkdir(exist_ok=True)
            if files.leftovers(parent, self._ids()):
                with self._db.writing():
                    for path in files.leftovers(parent, self._ids()):
                        shutil.rmtree(path, ignore_errors=True)

    def _ids(self) -> set[str]:
        """The ids of all demonstrations."""
        return {row["id"] for row in self._db.all("SELECT id FROM demonstration")}
