"""Renaming an action that has segments, or merging it into another one.

Nobody edits another's track: only the coder's own segments get the new name. It keeps key and look;
where others use the old name, that stays in the vocabulary with others. Who codes a demonstration
of a task blind is told nothing of what others have labelled on it: there the old one stays, whether
they use it or not.
"""

from __future__ import annotations

import json
import sqlite3
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

from forcelab.errors import InputError
from forcelab.labels import check_action_name
from forcelab.project.coding import ProjectCoding
from forcelab.project.loading import natural_order
from forcelab.project.painted import ProjectPainted
from forcelab.project.records import utc_now
from forcelab.project.vocabularies import write_vocabulary
from forcelab.text import counted, listed, unknown_word
from forcelab.vocabulary import Vocabulary

__all__ = ["ProjectRenaming", "Renaming"]

#: A sentence names so many tasks or coders, and only counts further ones.
NAMED = 5


@dataclass(frozen=True, slots=True)
class Renaming:
    """What renaming an action changes, or has changed.

    Parameters
    ----------
    author : str
        The coder whose segments get the new name.
    old, new : str
        The names.
    tasks : tuple of str
        Whose actions change.
    segments : mapping of str to int
        By the id of each demonstration, how many segments get the new name.
    merges : bool
        Whether there is an action of the new name already.
    others : mapping of str to int
        By other coder, how many segments keep the old name, as far as the coder may see them.
    kept : frozenset of str
        The tasks in which the old name stays an action, as others use it.
    learnt : bool
        Whether recognisers or runs were made of what changes; they keep the old name.
    """

    author: str
    old: str
    new: str
    tasks: tuple[str, ...]
    segments: Mapping[str, int]
    merges: bool
    others: Mapping[str, int]
    kept: frozenset[str]
    learnt: bool

    def sentences(self, *, done: bool) -> str:
        """What changes, or has changed, and what stays, for people."""
        told = f"'{self.old}' {'is now' if done else 'becomes'} '{self.new}'"
        where = listed([task or "no task" for task in self.tasks], NAMED)
        if self.segments:
            segments = counted(sum(self.segments.values()), "segment")
            number = counted(len(self.segments), "demonstration")
            told += f" in {segments} of {self.author}, in {number} of {where}."
        else:
            told += f" in {where}; {self.author} has no segment of '{self.old}'."
        if self.merges and not done:
            told += f" There is an action '{self.new}' already."
        if self.others:
            left = [f"{who} ({counted(number, 'segment')})" for who, number in self.others.items()]
            told += f" It stays '{self.old}' for {listed(left, NAMED)}."
        elif self.kept:
            told += f" '{self.old}' stays in the list, as others may use it."
        if self.kept and not self.merges:
            gets = "has" if done else "gets"
            told += f" '{self.new}' keeps key and colour; '{self.old}' {gets} others."
        if self.learnt:
            told += f" Recognisers and runs made before keep '{self.old}': train again."
        return told


class ProjectRenaming(ProjectPainted, ProjectCoding):
    """What a :class:`~forcelab.project.Project` knows of renaming actions."""

    def renaming(
        self, author: str, old: str, new: str, tasks: Collection[str] | None = None
    ) -> Renaming:
        """What :meth:`rename_action` would change; parameters and errors are those of it."""
        known = {
            task: vocabulary
            for task, vocabulary in self.vocabularies().items()
            if tasks is None or task in tasks
        }
        used = [row for row in self._using(old) if tasks is None or row["task"] in tasks]
        mine = [row for row in used if row["author"] == author]
        others = [row for row in used if row["author"] != author]
        hidden = self.blind_to(author)
        seen = [row for row in others if row["demonstration"] not in hidden]
        # Others may use it wherever the coder must not know whether they do.
        shared = frozenset(row["task"] for row in seen) | self.blind_tasks(author)
        offering = {task for task, vocabulary in known.items() if old in vocabulary}
        if not (mine or seen or offering):
            names = dict.fromkeys(name for one in known.values() for name in one.names)
            raise InputError(unknown_word("action", old, names or ("none at all",)))
        changing = {row["task"] for row in mine} | (offering - shared)
        if not changing:
            raise InputError(
                f"'{old}' was not renamed: {author} has no segment of it, and others may use it."
            )
        if not new.strip() or new == old:
            raise InputError(f"'{old}' needs another name to be renamed.")
        check_action_name(new)
        own = {row["task"] for row in self._using(new) if row["author"] == author}
        left: Counter[str] = Counter()
        for row in seen:
            if row["task"] in changing:
                left[row["author"]] += row["segments"]
        return Renaming(
            author=author,
            old=old,
            new=new,
            tasks=tuple(sorted(changing, key=natural_order)),
            segments={row["demonstration"]: row["segments"] for row in mine},
            merges=any(new in known.get(task, ()) or task in own for task in changing),
            others=dict(left),
            kept=shared & changing & offering,
            learnt=self._learnt_from({row["demonstration"] for row in mine}, author),
        )

    def rename_action(
        self,
        author: str,
        old: str,
        new: str,
        tasks: Collection[str] | None = None,
        *,
        merge: bool = False,
    ) -> Renaming:
        """Rename an action in all of a coder's tracks, one edit a track, all or nothing.

        Each edit stands in the history of its track and can be undone there, or all of them at
        once by :meth:`~forcelab.project.Project.undo_everywhere`. The action keeps its
        colour and its key; where others use it, the old name stays for them with the next that
        are free. Predictions, recognisers and runs keep the old name.

        Parameters
        ----------
        author : str
            The coder; nobody else's labels change.
        old, new : str
            The names.
        tasks : collection of str, optional
            Only in demonstrations of these tasks.
        merge : bool
            Whether the new name may be that of an action there is. What had the two names cannot
            be told apart any more, but by the history; no segments become one.

        Returns
        -------
        Renaming
            What has changed.

        Raises
        ------
        InputError
            If there is no such action, only others have segments of it, the new name is blank, the
            old one or says that there is none, or an action has it and `merge` is not given.
            Nothing was changed then.
        """
        with self._db.writing():
            change = self.renaming(author, old, new, tasks)
            if change.merges and not merge:
                raise InputError(
                    f"There is an action '{new}' already; merge the two or choose another name."
                )
            now = self._free_time()
            for id_, number in change.segments.items():
                before = self._tracks.track(id_, author).segments
                after = tuple(replace(s, action=new) if s.action == old else s for s in before)
                what = f"{old} is now {new} in {counted(number, 'segment')}"
                self._tracks.edit(id_, author, before, after, what, kind="paint", time=now)
            for task in change.tasks:
                vocabulary = _renamed(self.vocabulary(task), old, new, task in change.kept)
                write_vocabulary(self._db, task, vocabulary)
            return change

    def refuse_removing(self, author: str, action: str, task: str) -> None:
        """Refuse to take an action out of a task's vocabulary that segments have, or may have.

        Parameters
        ----------
        author : str
            The coder who would remove it, and is told no more than that coder may know.
        action, task : str

        Raises
        ------
        InputError
            If a segment of the task has the action, as far as the coder may see; or if the coder
            codes demonstrations of the task blind.
        """
        hidden = self.blind_to(author)
        rows = self._db.all(
            "SELECT DISTINCT demonstration, author.name AS author FROM segment "
            "JOIN track ON track.id = segment.track JOIN author ON author.id = track.author "
            "JOIN demonstration ON demonstration.id = track.demonstration "
            "WHERE action = ? AND task = ?",
            action,
            task,
        )
        if any(row["author"] == author or row["demonstration"] not in hidden for row in rows):
            raise InputError(
                f"There are segments of '{action}' in demonstrations of {task or 'no task'}; "
                "rename it to the action they should be, or delete those."
            )
        if task in self.blind_tasks(author):
            raise InputError(
                f"'{action}' stays in the list, as others may use it: {author} codes "
                f"demonstrations of {task or 'no task'} blind. It can be removed once those are "
                "done."
            )

    def blind_tasks(self, author: str) -> frozenset[str]:
        """The tasks of demonstrations of which everything by others is hidden from a coder.

        Parameters
        ----------
        author : str
        """
        rows = self._db.all(
            "SELECT DISTINCT task FROM demonstration WHERE id IN (SELECT value FROM json_each(?))",
            json.dumps(sorted(self.blind_to(author))),
        )
        return frozenset(row["task"] for row in rows)

    def _free_time(self) -> datetime:
        """The time now, or just after: that of no edit yet, as edits made together share theirs."""
        now = utc_now()
        while self._db.one("SELECT 1 FROM edit WHERE time = ? LIMIT 1", now.isoformat()):
            now += timedelta(microseconds=1)  # a coarse clock, or one that was put back
        return now

    def _using(self, action: str) -> list[sqlite3.Row]:
        """How many segments of an action each coder has on each demonstration."""
        return self._db.all(
            "SELECT demonstration, task, author.name AS author, count(*) AS segments FROM segment "
            "JOIN track ON track.id = segment.track JOIN author ON author.id = track.author "
            "JOIN demonstration ON demonstration.id = track.demonstration "
            "WHERE action = ? AND kind = 'coder' GROUP BY track.id ORDER BY author.id, track.id",
            action,
        )

    def _learnt_from(self, demonstrations: Collection[str], author: str) -> bool:
        """Whether a recogniser or a run was made of an author's labels of some demonstrations."""
        row = self._db.one(
            "SELECT 1 FROM (SELECT labels FROM recogniser UNION ALL SELECT labels FROM run), "
            "json_each(labels) WHERE json_extract(value, '$[1]') = ? "
            "AND json_extract(value, '$[0]') IN (SELECT value FROM json_each(?)) LIMIT 1",
            author,
            json.dumps(list(demonstrations)),
        )
        return row is not None


def _renamed(vocabulary: Vocabulary, old: str, new: str, kept: bool) -> Vocabulary:
    """The actions of a task once a coder's `old` is `new`."""
    if old not in vocabulary:
        return vocabulary.with_actions(new)
    if new in vocabulary:
        return vocabulary if kept else vocabulary.removed(old)
    renamed = vocabulary.renamed(old, new)
    return renamed.with_actions(old) if kept else renamed
