"""Show what a project holds.

Demonstrations by task, with their length, rate, channels and labelled share by author.

for example:
  forcelab list lab.forcelab --task stylus
  forcelab list lab.forcelab --to-label Ines
"""

from __future__ import annotations

import argparse
from textwrap import shorten

from forcelab.cli.commands.note import note_json
from forcelab.cli.options import add_json, add_project, add_task, name_of
from forcelab.cli.output import json_text, printable, table
from forcelab.errors import InputError
from forcelab.project import DemonstrationInfo, Note, Project, left_to_label
from forcelab.text import counted, name_alike

#: Letters of a demonstration's notes.
NOTES_WIDTH = 60


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    add_task(parser, "only this task")
    parser.add_argument(
        "--to-label",
        metavar="NAME",
        type=name_of,
        help="only what this coder has not begun, or has assigned and not done",
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    with Project.open(arguments.project) as project:
        infos = project.demonstrations.infos(arguments.task)
        if arguments.task is not None:
            project.demonstrations.check_task(arguments.task)
        if arguments.to_label is not None:
            infos = _left_to_label(project, infos, arguments.to_label)
        recognisers = project.runs.recognisers()
        runs = project.runs.summaries()
        notes: dict[str, list[Note]] = {info.id: [] for info in infos}
        for note in project.coding.notes(arguments.to_label):
            notes.get(note.demonstration, []).append(note)
        beside = {
            info.id: [str(v.path) for v in project.demonstrations.load(info.id).videos[1:]]
            for info in infos
            if arguments.json and len(info.videos) > 1
        }
    if arguments.json:
        content = {
            "demonstrations": [
                _demonstration_json(info, beside.get(info.id, []), notes[info.id]) for info in infos
            ],
            "recognisers": [{"id": r.id, "name": r.name, "time": str(r.time)} for r in recognisers],
            "runs": [{"id": r.id, "kind": r.kind, "time": str(r.time)} for r in runs],
        }
        print(json_text(content))
        return
    if not infos and arguments.to_label is not None:
        print(f"Nothing of this is left to label for {printable(arguments.to_label)}.")
        return
    if not infos:
        print("No demonstrations; 'forcelab import' brings some in.")
        return
    rows = [["task", "demonstration", "seconds", "Hz", "channels", "labelled", "id"]]
    rows += [_row(info) for info in infos]
    if any(notes.values()):
        rows[0].append("notes")
        for row, info in zip(rows[1:], infos, strict=True):
            texts = "; ".join(f"{note.author}: {note.text}" for note in notes[info.id])
            # `forcelab note` has them whole.
            row.append(shorten(texts, NOTES_WIDTH, placeholder="…"))
    print(table(rows, right=[2, 3, 4]))
    for info in infos:
        if len(info.videos) > 1:
            print(printable(f"Videos of '{info.name}': {', '.join(info.videos)}"))
    counts = ((infos, "demonstration"), (recognisers, "recogniser"), (runs, "run"))
    print(f"\n{', '.join(counted(len(items), noun) for items, noun in counts)}.")


def _left_to_label(
    project: Project, infos: tuple[DemonstrationInfo, ...], author: str
) -> tuple[DemonstrationInfo, ...]:
    """What a coder still has to label."""
    assigned = {
        assignment.demonstration: assignment for assignment in project.coding.assignments(author)
    }
    similar = name_alike(author, project.coding.people())
    if similar is not None and not assigned:
        raise InputError(f"'{author}' has labelled nothing here; there is '{similar}'.")
    return tuple(
        info
        for info in infos
        if left_to_label(info.labelled.get(author, 0.0), assigned.get(info.id))
    )


def _row(info: DemonstrationInfo) -> list[str]:
    labelled = ", ".join(
        f"{author} {100 * seconds / info.duration:.0f} %"
        for author, seconds in info.labelled.items()
    )
    return [
        info.task,
        info.name,
        f"{info.duration:.2f}",
        f"{info.rate:.6g}",
        str(len(info.channels)),
        labelled or "-",
        info.id[:8],
    ]


def _demonstration_json(
    info: DemonstrationInfo, beside: list[str], notes: list[Note]
) -> dict[str, object]:
    return {
        "id": info.id,
        "name": info.name,
        "task": info.task,
        "samples": info.samples,
        "seconds": info.duration,
        "rate": info.rate,
        "channels": [{"name": c.name, "unit": c.unit} for c in info.channels],
        "labelled_seconds": dict(info.labelled),
        "video": info.has_video,
        "videos": list(info.videos),
        "beside": beside,
        "source": info.source,
        "notes": [note_json(note) for note in notes],
    }
