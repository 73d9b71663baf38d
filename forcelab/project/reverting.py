"""Undo and redo of what was done in many tracks at once, as one step.

The edits of one renaming share their author, their time and the first half of their sentence:
so much tells them, in a project that was copied or merged as well.
"""

from __future__ import annotations

import sqlite3
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from forcelab.project.history import edit_of, line_of, stands
from forcelab.project.painted import ProjectPainted
from forcelab.project.records import Edit
from forcelab.text import counted, listed

__all__ = ["ProjectReverting", "Reverted"]

#: What the sentence of a renaming in one track holds, and where its number of segments begins.
RENAMED, NUMBER = " is now ", " in "
#: A sentence names so many demonstrations, and only counts further ones.
NAMED = 3


@dataclass(frozen=True, slots=True)
class Reverted:
    """What an undo or a redo has changed.

    Parameters
    ----------
    edits : tuple of Edit
        The undo, or redo, of each track; that of the demonstration that was asked for comes first.
    tasks : mapping of str to str
        By the id of each demonstration among them, its task.
    left : tuple of str
        Names of further demonstrations where the same was done and stays as it is, as something
        else was edited there since.
    """

    edits: tuple[Edit, ...]
    tasks: Mapping[str, str]
    left: tuple[str, ...] = ()

    @property
    def actions(self) -> dict[str, tuple[set[str], set[str]]]:
        """By task, the actions of what was taken away and of what came instead."""
        found: dict[str, tuple[set[str], set[str]]] = defaultdict(lambda: (set(), set()))
        for edit in self.edits:
            gone, back = found[self.tasks[edit.demonstration]]
            gone.update(segment.action for segment in edit.removed)
            back.update(segment.action for segment in edit.inserted)
        return dict(found)

    @property
    def reaches_farther(self) -> bool:
        """Whether other demonstrations are concerned than the one that was asked for."""
        return len(self.edits) > 1 or bool(self.left)

    @property
    def renames(self) -> bool:
        """Whether it is a renaming that was undone or redone."""
        return RENAMED in self.edits[0].what

    def sentence(self) -> str:
        """What was done, for people."""
        told = self.edits[0].what
        if len(self.edits) > 1:
            pairs = [zip(edit.removed, edit.inserted, strict=True) for edit in self.edits]
            changed = sum(old != new for pair in pairs for old, new in pair)
            what, _, _ = told.rpartition(NUMBER)
            told = f"{what}{NUMBER}{counted(changed, 'segment')} of "
            told += counted(len(self.edits), "demonstration")
        if self.left:
            names = listed([f"'{name}'" for name in self.left], NAMED)
            told += f"; not in {names}, where something else was edited since"
        return told


class ProjectReverting(ProjectPainted):
    """How a :class:`~forcelab.project.Project` takes back what was done in many tracks."""

    def undo_everywhere(self, demonstration: str, author: str) -> Reverted | None:
        """Take back a track's latest edit, and a renaming in all of the author's tracks.

        A track in which something was edited after the renaming is left as it is.

        Parameters
        ----------
        demonstration : str
            Its id.
        author : str
            Whose track it is.

        Returns
        -------
        Reverted or None
            None if there is nothing to undo in this track.
        """
        return self._revert_everywhere(demonstration, author, "undo")

    def redo_everywhere(self, demonstration: str, author: str) -> Reverted | None:
        """Take back a track's latest undo, and that of a renaming in all of the author's tracks.

        A track in which the renaming can be redone no more, or not yet, is left as it is.

        Parameters
        ----------
        demonstration, author : str
            As of :meth:`undo_everywhere`.

        Returns
        -------
        Reverted or None
            None if there is nothing to redo in this track.
        """
        return self._revert_everywhere(demonstration, author, "redo")

    def _revert_everywhere(
        self, demonstration: str, author: str, kind: Literal["undo", "redo"]
    ) -> Reverted | None:
        """Undo or redo, all of it or nothing."""
        id_ = self._id(demonstration)
        with self._db.writing():
            first = self._tracks.revert(id_, author, kind)
            if first is None:
                return None
            task = self._db.one("SELECT task FROM demonstration WHERE id = ?", id_)
            assert task is not None
            edits, tasks, left = [first], {id_: str(task["task"])}, []
            for row in self._made_with(first):
                line = line_of(self._db, row["track"])
                top = line.undo
                if kind == "redo":
                    top = None if line.redo is None else edit_of(self._db, line.redo).reverts
                if top == row["id"]:
                    another = self._tracks.revert(row["demonstration"], author, kind)
                    assert another is not None
                    edits.append(another)
                    tasks[another.demonstration] = str(row["task"])
                elif stands(self._db, row["track"], row["id"]) == (kind == "undo"):
                    left.append(str(row["name"]))
            return Reverted(tuple(edits), tasks, tuple(left))

    def _made_with(self, edit: Edit) -> list[sqlite3.Row]:
        """The edits of other tracks that were made together with what an undo or a redo reverts."""
        while edit.reverts is not None:
            edit = edit_of(self._db, edit.reverts)
        what, _, number = edit.what.rpartition(NUMBER)
        if not number or RENAMED not in what:
            return []
        return self._db.all(
            "SELECT edit.id, track, demonstration, demonstration.name, task FROM edit "
            "JOIN track ON track.id = edit.track JOIN author ON author.id = track.author "
            "JOIN demonstration ON demonstration.id = track.demonstration "
            "WHERE edit.time = ? AND author.name = ? AND edit.id <> ? "
            "AND substr(what, 1, ?) = ? ORDER BY edit.id",
            edit.time.isoformat(),
            edit.author,
            edit.id,
            len(what) + len(NUMBER),
            what + NUMBER,
        )
