"""Write a note for other coders on a demonstration.

Each coder has one note on each demonstration; a new TEXT replaces it, and an empty one
('') removes it. Without TEXT: lists the notes. Every note ever written is kept.

for example:
  forcelab note lab.forcelab pull-03 'sensor slipped at 3.2 s' --author Ines
"""

from __future__ import annotations

import argparse

from forcelab.cli.options import UsageError, add_author, add_json, add_project
from forcelab.cli.output import print_result, table
from forcelab.cli.project_hints import hint_at_new_names
from forcelab.project import DemonstrationInfo, Note, Project


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    parser.add_argument("demonstration", metavar="DEMO", nargs="?", help="its name or id")
    parser.add_argument("text", metavar="TEXT", nargs="?", help="the note")
    add_author(parser, "the note's coder; without TEXT: only this coder's")
    parser.add_argument(
        "--history",
        action="store_true",
        help="list every note ever written, also those that were replaced",
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    author, key, text = arguments.author, arguments.demonstration, arguments.text
    if text is not None and author is None:
        raise UsageError("Nobody was named; say whose note it is with --author NAME.")
    with Project.open(arguments.project) as project:
        id_ = project.demonstrations.id_of(key) if key is not None else None
        if id_ is not None and text is not None:
            with hint_at_new_names(arguments.project, project):
                project.coding.set_note(id_, author, text)
        infos = {info.id: info for info in project.demonstrations.infos()}
        notes = project.coding.note_events() if arguments.history else project.coding.notes()
    pairs = [
        (note, infos[note.demonstration])
        for note in notes
        if id_ in (None, note.demonstration) and author in (None, note.author)
    ]
    header = ["task", "demonstration", "coder", "written", "note"]
    print_result(
        arguments.json,
        {
            "notes": [
                {"id": info.id, "name": info.name, "task": info.task, **note_json(note)}
                for note, info in pairs
            ]
        },
        table([header, *(_row(*pair) for pair in pairs)]) if pairs else "There is no note.",
    )


def note_json(note: Note) -> dict[str, object]:
    return {"author": note.author, "text": note.text, "time": note.time.isoformat()}


def _row(note: Note, info: DemonstrationInfo) -> list[str]:
    return [
        info.task,
        info.name,
        note.author,
        f"{note.time:%Y-%m-%d %H:%M}",
        " ".join(note.text.split()) or "-",
    ]
