"""Labels and vocabularies of a project: who painted what, and every edit ever made."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Literal

from forcelab.errors import InputError
from forcelab.labels import Segments, Track, check_action_name
from forcelab.project.database import Database
from forcelab.project.edits import Tracks
from forcelab.project.folder import ProjectFolder
from forcelab.project.loading import known_id, known_ids
from forcelab.project.records import Author, Edit
from forcelab.project.vocabularies import vocabularies, write_vocabulary
from forcelab.vocabulary import Vocabulary

__all__ = ["ProjectPainted"]


class ProjectPainted(ProjectFolder):
    """The tracks of a :class:`~forcelab.project.Project`, and the actions they may hold."""

    def __init__(self, path: Path, database: Database) -> None:
        super().__init__(path, database)
        self._tracks = Tracks(database)

    def sync_behind(self) -> None:
        """Let edits return before the disk has them, for a coder who paints one after the other.

        From now on what a method stored is safe from this process being killed, and a moment later
        from a power cut as well.
        """
        self._db.sync_behind()

    def authors(self) -> tuple[Author, ...]:
        """Everybody who made an edit, in order of first appearance."""
        rows = self._db.all("SELECT name, kind FROM author ORDER BY id")
        return tuple(Author(row["name"], row["kind"]) for row in rows)

    def coders(self) -> tuple[str, ...]:
        """The people who made an edit, by name, in order of first appearance: no models."""
        return tuple(author.name for author in self.authors() if author.kind == "coder")

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
        replacing: int | None = None,
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
        replacing : int, optional
            The number of the track's latest edit, in whose place this one is: one undo then takes
            back both, and the history has one line.

        Raises
        ------
        StaleTrackError
            If the track is not `before`, or `replacing` not its latest edit, as another window or
            process changed it.
        InputError
            If there is no such demonstration, segments overlap or are out of order, or the author
            is of the other kind, or what proposed is no model. Nothing was written then.
        """
        id_ = self._id(demonstration)
        with self._db.writing():
            return self._tracks.edit(
                id_,
                author,
                before,
                after,
                what,
                kind=kind,
                proposed_by=proposed_by,
                replacing=replacing,
            )

    def undo(self, demonstration: str, author: str) -> Edit | None:
        """Take back a track's latest edit not yet taken back; None if there is none.

        Reaches back to the first edit, past restarts. It is an edit itself. A verdict for which
        the labels were edited goes with its edit, and comes back with it.
        """
        with self._db.writing():
            return self._tracks.revert(self._id(demonstration), author, "undo")

    def redo(self, demonstration: str, author: str) -> Edit | None:
        """Take back a track's latest undo; None if there is none or something was edited since."""
        with self._db.writing():
            return self._tracks.revert(self._id(demonstration), author, "redo")

    def revertible(
        self, demonstration: str, author: str, kind: Literal["undo", "redo"]
    ) -> Edit | None:
        """The edit that :meth:`undo` would take back, or the undo that :meth:`redo` would.

        None if there is none.
        """
        return self._tracks.revertible(self._id(demonstration), author, kind)

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
        with self._db.writing():
            known = known_ids(self._db)

            def of_known() -> Iterator[Edit]:
                for edit in edits:
                    if edit.demonstration not in known:
                        raise InputError(
                            f"There is no demonstration '{edit.demonstration}' in '{self.path}'."
                        )
                    yield edit

            return self._tracks.replay(of_known())

    # Vocabularies

    def vocabulary(self, task: str) -> Vocabulary:
        """The actions of a task; empty if there is none."""
        return self.vocabularies().get(task, Vocabulary())

    def vocabularies(self) -> dict[str, Vocabulary]:
        """Every vocabulary by task."""
        return vocabularies(self._db)

    def painted_actions(self, task: str) -> frozenset[str]:
        """The actions that any coder's or model's segment of a task has."""
        rows = self._db.all(
            "SELECT DISTINCT action FROM segment JOIN track ON track.id = segment.track "
            "JOIN demonstration ON demonstration.id = track.demonstration WHERE task = ?",
            task,
        )
        return frozenset(row["action"] for row in rows)

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
            If a name is blank, or a new one says that there is no action.
        """
        with self._db.writing():
            old = self.vocabulary(task)
            new = old.with_actions(*names)
            if new != old:
                for name in {*new.names} - {*old.names} - self.painted_actions(task):
                    check_action_name(name)
                write_vocabulary(self._db, task, new)
            return new

    def _id(self, id_: str) -> str:
        """The id, if there is such a demonstration."""
        return known_id(self._db, id_)
