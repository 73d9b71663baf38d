"""The actions of each task, and renaming one in a coder's tracks.

No coder edits another's track: only the coder's own segments get the new name, which keeps key and
look; where others use the old name, that stays in the vocabulary with others. A coder who codes a
demonstration of a task blind must not learn what others have labelled on it: there the old one
stays, whether they use it or not.
"""

from __future__ import annotations

import json
import sqlite3
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

from forcelab.errors import InputError
from forcelab.labels import check_action_name
from forcelab.project.coding import CodingStore
from forcelab.project.database import Database, content_errors
from forcelab.project.records import segments_from_text, utc_now
from forcelab.project.tracks import NUMBER, RENAMED, TrackStore
from forcelab.text import counted, listed, natural_order, task_text, unknown_word
from forcelab.vocabulary import MOST_ACTIONS, Action, Vocabulary, joined

#: All segments, each with its track, the track's author and demonstration.
_SEGMENTS = (
    "segment JOIN track ON track.id = segment.track JOIN author ON author.id = track.author "
    "JOIN demonstration ON demonstration.id = track.demonstration"
)
#: A sentence names so many tasks or coders, and only counts further ones.
MOST_NAMED = 5


@dataclass(frozen=True, slots=True)
class ActionRename:
    """What renaming an action changes, or has changed.

    Attributes
    ----------
    author : str
        The coder whose segments get the new name.
    old, new : str
        The names.
    tasks : tuple of str
        Those whose actions change.
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
        text = f"'{self.old}' {'is now' if done else 'becomes'} '{self.new}'"
        where = listed([task_text(task) for task in self.tasks], MOST_NAMED)
        if self.segments:
            segments = counted(sum(self.segments.values()), "segment")
            number = counted(len(self.segments), "demonstration")
            text += f" in {segments} of {self.author}, in {number} of {where}."
        else:
            text += f" in {where}; {self.author} has no segment of '{self.old}'."
        if self.merges and not done:
            text += f" The action '{self.new}' already exists."
        if self.others:
            left = [
                f"{coder} ({counted(number, 'segment')})" for coder, number in self.others.items()
            ]
            text += f" It stays '{self.old}' for {listed(left, MOST_NAMED)}."
        elif self.kept:
            text += f" '{self.old}' stays in the list, as others may use it."
        if self.kept and not self.merges:
            gets = "has" if done else "gets"
            text += f" '{self.new}' keeps key and colour; '{self.old}' {gets} others."
        if self.learnt:
            text += f" Recognisers and runs made before keep '{self.old}': train again."
        return text


class ActionStore:
    """The actions of a project's tasks; ``project.actions``."""

    def __init__(self, database: Database, tracks: TrackStore, coding: CodingStore) -> None:
        self._db = database
        self._tracks = tracks
        self._coding = coding

    def vocabulary(self, task: str) -> Vocabulary:
        """The actions of a task; empty if there is none."""
        return self.vocabularies().get(task, Vocabulary())

    def joint_vocabulary(
        self, tasks: Iterable[str], test_task: str | None, *, apart: bool
    ) -> Vocabulary:
        """The actions of several tasks as :func:`forcelab.vocabulary.joined` makes them.

        Those of a task that is tested on come first, so that its tracks look as when they are
        labelled.
        """
        ordered = dict.fromkeys([*([] if test_task is None else [test_task]), *tasks])
        return joined({task: self.vocabulary(task) for task in ordered}, apart=apart)

    def vocabularies(self) -> dict[str, Vocabulary]:
        """Every vocabulary by task."""
        rows = self._db.all("SELECT task, actions FROM vocabulary ORDER BY task")
        vocabularies = {}
        for row in rows:
            with content_errors(f"The list of actions of {task_text(row['task'])}"):
                vocabularies[row["task"]] = Vocabulary.from_json(json.loads(row["actions"]))
        return vocabularies

    def painted(self, task: str) -> frozenset[str]:
        """The actions that any coder's or model's segment of a task has."""
        rows = self._db.all(f"SELECT DISTINCT action FROM {_SEGMENTS} WHERE task = ?", task)
        return frozenset(action for (action,) in rows)

    def set_vocabulary(
        self,
        task: str,
        vocabulary: Vocabulary,
        *,
        before: Vocabulary | None = None,
        recoloured: str = "",
    ) -> bool:
        """Replace the actions of a task; no label changes. Gives whether it was written.

        It was made from `before`: where another process has changed that, nothing is written. Other
        tasks where the action `recoloured` looked as it did here get its new colour, unless it
        would need a texture there.
        """
        with self._db.writing():
            old = self.vocabulary(task)
            if before is not None and old != before:
                return False
            self._write(task, vocabulary)
            if recoloured in old:
                look, colour = old[recoloured].look, vocabulary[recoloured].colour
                for other, actions in self.vocabularies().items():
                    if recoloured in actions and actions[recoloured].look == look:
                        following = actions.recoloured(recoloured, colour)
                        if following[recoloured].texture == 0:
                            self._write(other, following)
            return True

    def _write(self, task: str, vocabulary: Vocabulary) -> None:
        if len(vocabulary) > MOST_ACTIONS:  # which would not be read again
            raise InputError(
                f"A task has up to {MOST_ACTIONS:,} actions, and {task_text(task)} would have "
                f"{len(vocabulary):,}; check that these are actions and not remarks."
            )
        self._db.execute(
            "INSERT INTO vocabulary VALUES (?, ?) "
            "ON CONFLICT (task) DO UPDATE SET actions = excluded.actions",
            task,
            json.dumps(vocabulary.to_json(), ensure_ascii=False),
        )

    def elsewhere(self, task: str) -> list[Action]:
        """The actions of all other tasks that are plain: a new one of this task looks the same."""
        return [
            action
            for other, vocabulary in self.vocabularies().items()
            for action in vocabulary
            if other != task and action.texture == 0
        ]

    def add(self, task: str, names: Iterable[str]) -> Vocabulary:
        """Add the actions that a task's vocabulary lacks; gives all that it has then.

        Raises
        ------
        InputError
            If a name is blank, or a new one says that there is no action.
        """
        with self._db.writing():
            old = self.vocabulary(task)
            new = old.with_actions(*names, like=self.elsewhere(task))
            if new != old:
                for name in {*new.names} - {*old.names} - self.painted(task):
                    check_action_name(name)
                self.set_vocabulary(task, new)
            return new

    def preview_rename(
        self, author: str, old: str, new: str, tasks: Collection[str] | None = None
    ) -> ActionRename:
        """What :meth:`rename` would change; parameters and errors are those of it."""
        known = {
            task: vocabulary
            for task, vocabulary in self.vocabularies().items()
            if tasks is None or task in tasks
        }
        used = [row for row in self._uses(old) if tasks is None or row["task"] in tasks]
        own_rows = [row for row in used if row["author"] == author]
        others = [row for row in used if row["author"] != author]
        hidden = self._coding.blind_to(author)
        visible = [row for row in others if row["demonstration"] not in hidden]
        # Others may use it wherever the coder must not know whether they do.
        shared = frozenset(row["task"] for row in visible) | self._coding.blind_tasks(author)
        offering = {task for task, vocabulary in known.items() if old in vocabulary}
        if not (own_rows or visible or offering):
            names = dict.fromkeys(name for actions in known.values() for name in actions.names)
            raise InputError(unknown_word("action", old, names or ("none at all",)))
        changing = {row["task"] for row in own_rows} | (offering - shared)
        if not changing:
            raise InputError(
                f"'{old}' was not renamed: {author} has no segment of it, and others may use it."
            )
        if not new.strip() or new == old:
            raise InputError(f"'{old}' needs another name to be renamed.")
        check_action_name(new)
        own_of_new = {row["task"] for row in self._uses(new) if row["author"] == author}
        left: Counter[str] = Counter()
        for row in visible:
            if row["task"] in changing:
                left[row["author"]] += row["segments"]
        return ActionRename(
            author=author,
            old=old,
            new=new,
            tasks=tuple(sorted(changing, key=natural_order)),
            segments={row["demonstration"]: row["segments"] for row in own_rows},
            merges=any(new in known.get(task, ()) or task in own_of_new for task in changing),
            others=dict(left),
            kept=shared & changing & offering,
            learnt=self._learnt_from({row["demonstration"] for row in own_rows}, author),
        )

    def rename(
        self,
        author: str,
        old: str,
        new: str,
        tasks: Collection[str] | None = None,
        *,
        merge: bool = False,
    ) -> ActionRename:
        """Rename an action in all of a coder's tracks, one edit a track, all or nothing.

        Each edit stands in the history of its track and can be undone there, or all of them at
        once by ``tracks.undo_everywhere``. The action keeps its colour and its key; where others
        use it, the old name stays for them with the next that are free. Predictions, recognisers
        and runs keep the old name.

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

        Raises
        ------
        InputError
            If there is no such action, only others have segments of it, the new name is blank, the
            old one or says that there is none, or an action has it and `merge` is not given.
            Nothing was changed then.
        """
        with self._db.writing():
            change = self.preview_rename(author, old, new, tasks)
            if change.merges and not merge:
                raise InputError(
                    f"The action '{new}' already exists; merge the two or choose another name."
                )
            now = self._unused_time()
            for id_, number in change.segments.items():
                before = self._tracks.get(id_, author).segments
                after = tuple(replace(s, action=new) if s.action == old else s for s in before)
                description = f"{old}{RENAMED}{new}{NUMBER}{counted(number, 'segment')}"
                self._tracks.edit(id_, author, before, after, description, time=now)
            for task in change.tasks:
                vocabulary = _renamed(
                    self.vocabulary(task), old, new, task in change.kept, self.elsewhere(task)
                )
                self.set_vocabulary(task, vocabulary)
            return change

    def refuse_removing(self, author: str, action: str, task: str) -> None:
        """Refuse to take an action out of a task's vocabulary that segments have, or may have.

        The coder who would remove it is told no more than that coder may know: where the coder
        codes demonstrations of the task blind, others may use it.
        """
        hidden = self._coding.blind_to(author)
        rows = self._db.all(
            "SELECT DISTINCT demonstration, author.name AS author "
            f"FROM {_SEGMENTS} WHERE action = ? AND task = ?",
            action,
            task,
        )
        if any(row["author"] == author or row["demonstration"] not in hidden for row in rows):
            raise InputError(
                f"There are segments of '{action}' in demonstrations of {task_text(task)}; "
                "rename it to the action they should be, or delete those."
            )
        if task in self._coding.blind_tasks(author):
            raise InputError(
                f"'{action}' stays in the list, as others may use it: {author} codes "
                f"demonstrations of {task_text(task)} blind. It can be removed once those are "
                "done."
            )

    def extend(self, task: str, demonstration: str, styles: Vocabulary) -> None:
        """Add the actions of a demonstration's tracks that a task's vocabulary lacks.

        First those of `styles`, with the keys that they have there and, unless another task has
        them, with those looks, where these are free; then the others.
        """
        rows = self._db.all(
            "SELECT action FROM segment JOIN track ON track.id = segment.track "
            "WHERE demonstration = ? GROUP BY action ORDER BY min(start), action",
            demonstration,
        )
        old = self.vocabulary(task)
        new = old.with_actions(
            *styles.names,
            *(row["action"] for row in rows),
            like=(*self.elsewhere(task), *styles),
            keys={action.name: action.key for action in styles},
        )
        if new != old:
            self.set_vocabulary(task, new)

    def drop_imported(self, task: str, demonstration: str) -> tuple[str, ...]:
        """Remove the actions that came with the import of a demonstration that has left a task.

        Those stay that another demonstration of the task has; where it was the last of the task,
        all stay. Gives the removed actions.
        """
        if not self._db.one("SELECT 1 FROM demonstration WHERE task = ?", task):
            return ()
        imports = self._db.all(
            "SELECT inserted FROM edit JOIN track ON track.id = edit.track "
            "WHERE demonstration = ? AND kind = 'import'",
            demonstration,
        )
        imported = {s.action for row in imports for s in segments_from_text(row["inserted"])}
        foreign = imported - self.painted(task)
        old = self.vocabulary(task)
        new = Vocabulary(tuple(action for action in old if action.name not in foreign))
        if new != old:
            self.set_vocabulary(task, new)
        return tuple(name for name in old.names if name in foreign)

    def _unused_time(self) -> datetime:
        """Now, or just after: the time of no edit yet, as edits made together share theirs."""
        now = utc_now()
        while self._db.one("SELECT 1 FROM edit WHERE time = ? LIMIT 1", now.isoformat()):
            now += timedelta(microseconds=1)  # a coarse clock, or one that was put back
        return now

    def _uses(self, action: str) -> list[sqlite3.Row]:
        """How many segments of an action each coder has on each demonstration."""
        return self._db.all(
            "SELECT demonstration, task, author.name AS author, count(*) AS segments "
            f"FROM {_SEGMENTS} WHERE action = ? AND kind = 'coder' "
            "GROUP BY track.id ORDER BY author.id, track.id",
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


def _renamed(
    vocabulary: Vocabulary, old: str, new: str, keeps_old: bool, like: Iterable[Action]
) -> Vocabulary:
    """The actions of a task once a coder's `old` is `new`."""
    if old not in vocabulary:
        return vocabulary.with_actions(new, like=like)
    if new in vocabulary:
        return vocabulary if keeps_old else vocabulary.removed(old)
    renamed = vocabulary.renamed(old, new)
    return renamed.with_actions(old, like=like) if keeps_old else renamed
