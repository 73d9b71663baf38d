"""The project, as everybody outside this package uses it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any, Literal

from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.labels import Segments, Track
from forcelab.project.adding import add_all
from forcelab.project.arranging import attach_video, rename, set_video_clock
from forcelab.project.computed import ProjectComputed
from forcelab.project.database import Database
from forcelab.project.discarding import discard
from forcelab.project.edits import Tracks
from forcelab.project.judged import ProjectJudged
from forcelab.project.loading import info, infos, known_id, known_ids, load, natural_order, truth
from forcelab.project.records import (
    Added,
    Author,
    DemonstrationInfo,
    Edit,
    Incoming,
)
from forcelab.project.stamps import attach_beside, attach_stamps, stamps
from forcelab.project.vocabularies import painted_actions, vocabularies, write_vocabulary
from forcelab.vocabulary import Vocabulary

__all__ = ["Project"]


class Project(ProjectJudged, ProjectComputed):
    """A folder of demonstrations with everybody's labels and every edit ever made.

    Made by :meth:`create` or :meth:`open`; a context manager. Everything is on the disk when a
    method returns, but for :meth:`sync_behind`. Several processes may have one project open; each
    thread opens its own. A demonstration is told by its id, except in :meth:`load`.

    Every method raises :class:`~forcelab.errors.InputError` if the disk is full, the store is
    damaged, or another process keeps it busy for more than five seconds; nothing was written then.

    Attributes
    ----------
    path : Path
        The project's folder.
    """

    def __init__(self, path: Path, database: Database) -> None:
        super().__init__(path, database)
        self._tracks = Tracks(database)

    # Demonstrations

    def add(
        self, demonstration: Demonstration, tracks: Iterable[Track] = (), source: str = ""
    ) -> Added:
        """Add one demonstration; see :meth:`add_all`.

        Parameters
        ----------
        demonstration, tracks, source
            As of :class:`Incoming`.
        """
        return self.add_all([Incoming(demonstration, tuple(tracks), source)])[0]

    def add_all(self, given: Iterable[Incoming]) -> tuple[Added, ...]:
        """Add demonstrations, or update those with the same content, all or none of them.

        Name, task, rate and video become those given, but for what is to be kept; without a video,
        the one there stays. Where another demonstration of the task has the name, a number is put
        after it. An author's track is imported if there is none or it is as last imported; if it
        was edited since, it stays. Actions that the task's vocabulary lacks are added to it, with
        the looks that were given where these are free.

        Parameters
        ----------
        given : iterable of Incoming
            What is to be added, in this order.

        Returns
        -------
        tuple of Added
            What became of each.

        Raises
        ------
        InputError
            If a video cannot be read or two tracks of a demonstration have one author; nothing was
            added.
        """
        return add_all(self._db, self._tracks, tuple(given))

    def demonstrations(self, task: str | None = None) -> tuple[DemonstrationInfo, ...]:
        """What there is, or what there is of one task, sorted by task and name."""
        return infos(self._db, task)

    def info(self, demonstration: str) -> DemonstrationInfo:
        """What there is of one demonstration, by its id.

        Raises
        ------
        InputError
            If there is no such demonstration.
        """
        return info(self._db, demonstration)

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

    def truth(self, demonstration: str) -> dict[str, Any] | None:
        """What was told as the truth when it was added; None for all but simulated ones.

        Raises
        ------
        InputError
            If there is no such demonstration or the file is damaged.
        """
        return truth(self._db, demonstration)

    def attach_stamps(self, demonstration: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep a recording's raw stamps beside it, in place of those there.

        Parameters
        ----------
        demonstration : str
            Its id.
        arrays : mapping of str to ndarray
            Numbers and names, such as of :class:`~forcelab.capture.gathering.Gathered`.

        Raises
        ------
        InputError
            If there is no such demonstration or they cannot be written.
        """
        attach_stamps(self._db, demonstration, arrays)

    def attach_beside(self, demonstration: str, path: str | PathLike[str]) -> str:
        """Keep a file beside a recording, such as the video of a second camera; gives its name.

        Nothing of the program shows it, and archives leave it out.

        Parameters
        ----------
        demonstration : str
            Its id.
        path : path-like
            A file; what is in it is not looked at.

        Raises
        ------
        InputError
            If there is no such demonstration or it cannot be copied.
        """
        return attach_beside(self._db, demonstration, Path(path))

    def stamps(self, demonstration: str) -> dict[str, NDArray[Any]] | None:
        """The raw stamps beside a demonstration; None for all but recorded ones.

        Archives leave them out.

        Raises
        ------
        InputError
            If there is no such demonstration or the file is damaged.
        """
        return stamps(self._db, demonstration)

    def discard(self, demonstration: str, heads: Mapping[str, int]) -> None:
        """Remove a recording that was not worth keeping, for good, with what was marked live.

        Parameters
        ----------
        demonstration : str
            Its id.
        heads : mapping of str to int
            Of each author, the :meth:`head` of the track it was added with.

        Raises
        ------
        InputError
            If there is no such demonstration, or it was labelled, assigned, reviewed or used for
            training or evaluation since: it stays then.
        """
        discard(self._db, demonstration, heads)

    def rename(self, demonstration: str, name: str) -> None:
        """Give a demonstration another name.

        Raises
        ------
        InputError
            If there is no such demonstration, the name is blank, or another demonstration of the
            task has it.
        """
        rename(self._db, demonstration, name)

    def attach_video(
        self, demonstration: str, path: str | PathLike[str], clock: ClockMap | None = None
    ) -> None:
        """Copy a video into the project, in place of the one that the demonstration has.

        Parameters
        ----------
        demonstration : str
            Its id.
        path : path-like
            The video; what is in it is not looked at.
        clock : ClockMap, optional
            From the video's own timestamps to force time; by default both are the same.

        Raises
        ------
        InputError
            If there is no such demonstration or the video cannot be read; nothing was changed.
        """
        attach_video(self._db, demonstration, Path(path), clock or ClockMap())

    def set_video_clock(self, demonstration: str, clock: ClockMap) -> None:
        """Say how the clock of a demonstration's video maps onto the force clock.

        Raises
        ------
        InputError
            If there is no such demonstration or it has no video.
        """
        set_video_clock(self._db, demonstration, clock)

    # Labels

    def sync_behind(self) -> None:
        """Let edits return before the disk has them, for a coder who paints one after the other.

        From now on what a method stored is safe from this process being killed, and a moment later
        from a power cut as well.
        """
        self._db.sync_behind()

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
        proposed_by: str | None = None,
    ) -> Edit:
        """Change a track, as one transaction that is in the store when this returns.

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
        proposed_by : str, optional
            The model whose prediction a person accepts with this edit.

        Raises
        ------
        StaleTrackError
            If the track is not `before`, as another window or process changed it.
        InputError
            If there is no such demonstration, segments overlap or are out of order, or the author
            is of the other kind, or what proposed is no model. Nothing was written then.
        """
        id_ = self._id(demonstration)
        with self._db.writing():
            return self._tracks.edit(
                id_, author, before, after, what, kind=kind, proposed_by=proposed_by
            )

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

    def head(self, demonstration: str, author: str) -> int:
        """The number of the latest edit of a track, undoing and redoing included; 0 if none.

        As long as it is the same the track is the same.
        """
        return self._tracks.head(self._id(demonstration), author)

    def history(
        self,
        demonstration: str,
        author: str,
        *,
        latest: int | None = None,
        before: int | None = None,
    ) -> tuple[Edit, ...]:
        """Every edit ever made of a track, the first one first.

        Parameters
        ----------
        demonstration, author : str
            Whose track over what.
        latest : int, optional
            Only so many, the latest ones; a long history is read by pages.
        before : int, optional
            Only edits before the one with this number.
        """
        return self._tracks.history(self._id(demonstration), author, latest, before)

    def replay(self, edits: Iterable[Edit]) -> dict[int, int]:
        """Make edits again as they were made, with their times, all or nothing.

        Parameters
        ----------
        edits : iterable of Edit
            In the order in which they were made, as from :meth:`history`.

        Returns
        -------
        dict of int to int
            The new number of each edit by its old one.

        Raises
        ------
        InputError
            If an edit does not fit what the edits before it left, or its demonstration is not here.
        """
        edits = tuple(edits)
        with self._db.writing():
            if missing := {edit.demonstration for edit in edits} - known_ids(self._db):
                raise InputError(f"There is no demonstration '{min(missing)}' in '{self.path}'.")
            return self._tracks.replay(edits)

    # Vocabularies

    def vocabulary(self, task: str) -> Vocabulary:
        """The actions of a task; empty if there is none."""
        return self.vocabularies().get(task, Vocabulary())

    def vocabularies(self) -> dict[str, Vocabulary]:
        """Every vocabulary by task."""
        return vocabularies(self._db)

    def painted_actions(self, task: str) -> frozenset[str]:
        """The actions that any coder's or model's segment of a task has."""
        return painted_actions(self._db, task)

    def set_vocabulary(
        self, task: str, vocabulary: Vocabulary, *, before: Vocabulary | None = None
    ) -> bool:
        """Replace the actions of a task; no label changes.

        Parameters
        ----------
        task : str
        vocabulary : Vocabulary
            The actions from now on.
        before : Vocabulary, optional
            What it is made from: where another process has changed that, nothing is written.

        Returns
        -------
        bool
            Whether it was written.
        """
        with self._db.writing():
            if before is not None and self.vocabulary(task) != before:
                return False
            write_vocabulary(self._db, task, vocabulary)
            return True

    def add_actions(self, task: str, names: Iterable[str]) -> Vocabulary:
        """Add the actions that a task's vocabulary lacks; gives all that it has then.

        Raises
        ------
        InputError
            If a name is blank.
        """
        with self._db.writing():
            old = self.vocabulary(task)
            new = old.with_actions(*names)
            if new != old:
                write_vocabulary(self._db, task, new)
            return new

    def _id(self, id_: str) -> str:
        """The id, if there is such a demonstration."""
        return known_id(self._db, id_)
