"""``forcelab note``."""

from __future__ import annotations

import argparse

from forcelab.cli.newcomers import telling_newcomers
from forcelab.cli.options import WrongWordError
from forcelab.cli.output import json_text, table
from forcelab.project import DemonstrationInfo, Note, Project

__all__ = ["plain", "run"]


def run(arguments: argparse.Namespace) -> None:
    """Write a coder's note on a demonstration, and print the notes."""
    author, key, text = arguments.author, arguments.demonstration, arguments.text
    if text is not None and author is None:
        raise WrongWordError("Nobody was named; say whose note it is with --author NAME.")
    with Project.open(arguments.project) as project:
        id_ = project.id_of(key) if key is not None else None
        if id_ is not None and text is not None:
            with telling_newcomers(arguments.project):
                project.set_note(id_, author, text)
        infos = {info.id: info for info in project.demonstrations()}
        notes = project.note_events() if arguments.history else project.notes()
    notes = tuple(
        one for one in notes if id_ in (None, one.demonstration) and author in (None, one.author)
    )
    if arguments.json:
        print(json_text({"notes": [_plain(one, infos[one.demonstration]) for one in notes]}))
        return
    if not notes:
        print("There is no note.")
        return
    rows = [["task", "demonstration", "coder", "written", "note"]]
    print(table(rows + [_row(one, infos[one.demonstration]) for one in notes]))


def plain(note: Note) -> dict[str, object]:
    """A note of a demonstration as plain values."""
    return {"author": note.author, "text": note.text, "time": note.time.isoformat()}


def _row(note: Note, info: DemonstrationInfo) -> list[str]:
    """A note's line."""
    return [info.task, info.name, note.author, f"{note.time:%Y-%m-%d %H:%M}", note.text or "-"]


def _plain(note: Note, info: DemonstrationInfo) -> dict[str, object]:
    """A note as plain values."""
    return {"id": info.id, "name": info.name, "task": info.task, **plain(note)}
