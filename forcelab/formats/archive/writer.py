"""Writing a project as an archive."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

from forcelab.errors import InputError
from forcelab.formats.archive.members import MANIFEST, VERSION, Writer
from forcelab.formats.archive.values import (
    edit_to_json,
    event_to_json,
    made_to_json,
    note_to_json,
    verdict_to_json,
)
from forcelab.io import atomic_file
from forcelab.project import DemonstrationInfo, Edit, Project, StoredRecogniser, StoredRun
from forcelab.project.records import segments_to_json

__all__ = ["write_archive"]


def write_archive(project: Project, path: str | Path) -> None:
    """Write everything that a project holds into one file, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written or a file of the project is missing or damaged; what was
        there before is untouched.
    """
    with project.snapshot(), atomic_file(path) as stream, contextlib.closing(Writer(stream)) as out:
        out.json(MANIFEST, {"format": "forcelab archive", "version": VERSION})
        vocabularies = project.vocabularies()
        out.json("vocabularies.json", {task: v.to_json() for task, v in vocabularies.items()})
        edits: list[Edit] = []
        for info in sorted(project.demonstrations(), key=lambda info: info.id):
            _write_demonstration(project, info, out)
            for author in info.authors:
                edits += project.history(info.id, author)
        edits.sort(key=lambda edit: edit.id)
        out.json("edits.json", [edit_to_json(edit) for edit in edits])
        events = project.assignment_events()
        out.json("assignments.json", [event_to_json(event) for event in events])
        numbers = [run.id for run in project.run_summaries()]
        places = {number: place for place, number in enumerate(numbers, 1)}
        verdicts = project.verdict_events()
        out.json("verdicts.json", [verdict_to_json(verdict, places) for verdict in verdicts])
        recognisers = project.recognisers()
        there = {info.id for info in project.demonstrations()}
        named = [{"id": r.id, "name": r.name, **_made(r, there)} for r in recognisers]
        out.json("recognisers.json", named)
        for recogniser in recognisers:
            path_ = project.recogniser_path(recogniser.id)
            out.file(f"recognisers/{recogniser.id}.skops", path_)
        # What hundreds of runs found is more than there is room for at once.
        runs = map(project.run, numbers)
        out.json_list(
            "runs.json",
            ({"kind": r.kind, **_made(r, there), "result": r.result} for r in runs),
        )


def _made(made: StoredRecogniser | StoredRun, there: set[str]) -> dict[str, Any]:
    """How a thing was made; labels of demonstrations that were removed since cannot be told."""
    plain = made_to_json(made)
    labels = [used for used in plain["labels"] if used["demonstration"] in there]
    return {**plain, "labels": labels}


def _write_demonstration(project: Project, info: DemonstrationInfo, out: Writer) -> None:
    """Write one demonstration's members."""
    home = f"demonstrations/{info.id}"
    d = project.load(info.id)
    if d.fingerprint() != info.id:
        raise InputError(
            f"The arrays of '{info.name}' in '{project.path}' are no longer what was recorded; "
            f"import the recording again to put them back."
        )
    video = d.video and {
        "file": d.video.path.name,
        "offset": d.video.clock.offset,
        "rate": d.video.clock.rate,
    }
    record: dict[str, object] = {
        "name": d.name,
        "task": d.task,
        "channels": [[channel.name, channel.unit] for channel in d.channels],
        "grid_rate": d.grid_rate,
        "video": video,
        "source": info.source,
    }
    # Here older programs pass them over; a member of their own they would refuse.
    if notes := project.note_events(info.id):
        record["notes"] = [note_to_json(note) for note in notes]
    out.json(f"{home}/demonstration.json", record)
    out.array(f"{home}/times.npy", d.times)
    out.array(f"{home}/signals.npy", d.signals)
    if d.video and not d.video.path.is_file():
        raise InputError(
            f"The file '{d.video.path}' is missing; import the recording again to put it back."
        )
    if d.video:
        out.file(f"{home}/{d.video.path.name}", d.video.path)
    if (truth := project.truth(info.id)) is not None:
        out.json(f"{home}/truth.json", truth)
    kinds = {author.name: author.kind for author in project.authors()}
    tracks = [
        {
            "author": track.author,
            "kind": kinds[track.author],
            "segments": segments_to_json(track.segments),
        }
        for track in project.tracks(info.id)
    ]
    out.json(f"{home}/tracks.json", tracks)
