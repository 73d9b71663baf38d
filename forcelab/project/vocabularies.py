"""The vocabulary of each task."""

from __future__ import annotations

import json

from forcelab.project.database import Database
from forcelab.project.records import segments_from_json
from forcelab.project.troubles import told_of_content
from forcelab.vocabulary import Vocabulary

__all__ = ["drop_imported_actions", "extend_vocabulary", "vocabularies", "write_vocabulary"]


def vocabularies(database: Database) -> dict[str, Vocabulary]:
    """By task, every vocabulary that was written."""
    rows = database.all("SELECT task, actions FROM vocabulary ORDER BY task")
    found = {}
    for row in rows:
        with told_of_content(f"The list of actions of {row['task'] or 'no task'}"):
            found[row["task"]] = Vocabulary.from_json(json.loads(row["actions"]))
    return found


def write_vocabulary(database: Database, task: str, vocabulary: Vocabulary) -> None:
    """Replace the vocabulary of a task."""
    database.execute(
        "INSERT INTO vocabulary VALUES (?, ?) "
        "ON CONFLICT (task) DO UPDATE SET actions = excluded.actions",
        task,
        json.dumps(vocabulary.to_json(), ensure_ascii=False),
    )


def extend_vocabulary(database: Database, task: str, demonstration: str, looks: Vocabulary) -> None:
    """Add the actions that a task's vocabulary lacks.

    These are first those of `looks`, as they look there where that is free, then the others of the
    demonstration's tracks.
    """
    rows = database.all(
        "SELECT action FROM segment JOIN track ON track.id = segment.track "
        "WHERE demonstration = ? GROUP BY action ORDER BY min(start), action",
        demonstration,
    )
    old = vocabularies(database).get(task, Vocabulary())
    new = _joined(old, looks).with_actions(*(row["action"] for row in rows))
    if new != old:
        write_vocabulary(database, task, new)


def drop_imported_actions(database: Database, task: str, demonstration: str) -> tuple[str, ...]:
    """Take out of a task's vocabulary what a demonstration that has left the task brought along.

    These are the actions of its imported labels that no other demonstration of the task has. Where
    it was the last of the task, the vocabulary stays as it is.

    Returns
    -------
    tuple of str
        The actions that were taken out.
    """
    if not database.one("SELECT 1 FROM demonstration WHERE task = ?", task):
        return ()
    imports = database.all(
        "SELECT inserted FROM edit JOIN track ON track.id = edit.track "
        "WHERE demonstration = ? AND kind = 'import'",
        demonstration,
    )
    brought = {
        segment.action
        for row in imports
        for segment in segments_from_json(json.loads(row["inserted"]))
    }
    painted = database.all(
        "SELECT DISTINCT action FROM segment JOIN track ON track.id = segment.track "
        "JOIN demonstration ON demonstration.id = track.demonstration WHERE task = ?",
        task,
    )
    foreign = brought - {row["action"] for row in painted}
    old = vocabularies(database).get(task, Vocabulary())
    new = Vocabulary(tuple(action for action in old if action.name not in foreign))
    if new != old:
        write_vocabulary(database, task, new)
    return tuple(name for name in old.names if name in foreign)


def _joined(old: Vocabulary, looks: Vocabulary) -> Vocabulary:
    """Add the actions that are missing; one whose look or key is taken gets free ones."""
    for action in looks:
        if action.name in old:
            continue
        free = all(action.look != a.look and action.key not in ("", a.key) for a in old)
        old = Vocabulary((*old, action)) if free else old.with_actions(action.name)
    return old
