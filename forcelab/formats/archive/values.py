"""The objects of a project archive as JSON, read without trust."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from datetime import datetime
from typing import Any

from forcelab.errors import InputError
from forcelab.labels import Segment, Segments, check_name
from forcelab.project import (
    AssignmentEvent,
    Edit,
    LabelsUsed,
    Note,
    StoredRecogniser,
    StoredRun,
    StoredVerdict,
    Verdict,
)
from forcelab.project.records import ASSIGNMENT_KINDS, EDIT_KINDS, VERDICT_KINDS, segments_to_json

__all__ = [
    "VERDICTS",
    "edit_of",
    "edit_to_json",
    "event_of",
    "event_to_json",
    "field",
    "made_of",
    "made_to_json",
    "note_of",
    "note_to_json",
    "number",
    "segments_of",
    "verdict_of",
    "verdict_to_json",
]

#: The versions of the archive from which on edits tell who proposed them, and it holds verdicts.
PROPOSALS = VERDICTS = 3
#: Nothing was done before, and nothing will have been done after.
FIRST_YEAR, LAST_YEAR = 1970, 2300


def field(record: object, name: str, kind: type | tuple[type, ...], where: str) -> Any:
    """One value of a JSON object; refused if it is not of that kind."""
    kinds = kind if isinstance(kind, tuple) else (kind,)
    # type() and not isinstance(): true and false are no numbers.
    if not isinstance(record, dict) or name not in record or type(record[name]) not in kinds:
        raise InputError(f"'{name}' is missing or wrong in {where}.")
    if isinstance(record[name], str) and "\0" in record[name]:
        raise InputError(f"'{name}' holds a NUL, which no table can hold, in {where}.")
    return record[name]


def number(value: object, where: str) -> float:
    """A JSON number as a float."""
    if type(value) not in (int, float):
        raise InputError(f"{value!r} is not a number in {where}.")
    try:
        return float(value)  # type: ignore[arg-type]
    except OverflowError as error:
        raise InputError(f"A number is too large in {where}.") from error


def edit_of(item: object, where: str, version: int) -> Edit:
    """An edit of a JSON object, as that version of the archive has it."""
    kind = field(item, "kind", str, where)
    if kind not in EDIT_KINDS:
        raise InputError(f"'{kind}' is no kind of edit in {where}.")
    reverts = field(item, "reverts", (int, type(None)), where)
    if (reverts is None) != (kind not in ("undo", "redo")):
        raise InputError(f"'reverts' is missing or wrong in {where}.")
    proposed_by = None
    if version >= PROPOSALS:
        proposed_by = field(item, "proposed_by", (str, type(None)), where)
        if proposed_by is not None and (kind != "paint" or not proposed_by.strip()):
            raise InputError(f"'proposed_by' is missing or wrong in {where}.")
    return Edit(
        id=field(item, "id", int, where),
        demonstration=field(item, "demonstration", str, where),
        author=field(item, "author", str, where),
        kind=kind,
        time=_time(item, "time", where),
        what=field(item, "what", str, where),
        position=field(item, "position", int, where),
        removed=segments_of(field(item, "removed", list, where), where),
        inserted=segments_of(field(item, "inserted", list, where), where),
        reverts=reverts,
        proposed_by=proposed_by,
    )


def edit_to_json(edit: Edit) -> dict[str, Any]:
    """An edit as a JSON object."""
    return {
        "id": edit.id,
        "demonstration": edit.demonstration,
        "author": edit.author,
        "kind": edit.kind,
        "time": edit.time.isoformat(),
        "what": edit.what,
        "position": edit.position,
        "removed": segments_to_json(edit.removed),
        "inserted": segments_to_json(edit.inserted),
        "reverts": edit.reverts,
        "proposed_by": edit.proposed_by,
    }


def event_of(item: object, where: str) -> AssignmentEvent:
    """An event of an assignment of a JSON object."""
    kind = field(item, "kind", str, where)
    if kind not in ASSIGNMENT_KINDS:
        raise InputError(f"'{kind}' is nothing that befalls an assignment in {where}.")
    return AssignmentEvent(
        demonstration=field(item, "demonstration", str, where),
        author=field(item, "author", str, where),
        kind=kind,
        time=_time(item, "time", where),
    )


def event_to_json(event: AssignmentEvent) -> dict[str, Any]:
    """An event of an assignment as a JSON object."""
    return {
        "demonstration": event.demonstration,
        "author": event.author,
        "kind": event.kind,
        "time": event.time.isoformat(),
    }


def note_of(item: object, demonstration: str, where: str) -> Note:
    """A note on a demonstration of a JSON object."""
    author, text = field(item, "author", str, where), field(item, "text", str, where)
    return Note(demonstration, author, text, _time(item, "time", where))


def note_to_json(note: Note) -> dict[str, Any]:
    """A note as a JSON object, in the record of its demonstration."""
    return {"author": note.author, "text": note.text, "time": note.time.isoformat()}


def verdict_of(item: object, where: str) -> Verdict:
    """A verdict of a JSON object; the run is the one with that place in the list of runs."""
    text = (str, type(None))
    kind = field(item, "verdict", str, where)
    if kind not in VERDICT_KINDS:
        raise InputError(f"'{kind}' is no verdict in {where}.")
    return Verdict(
        demonstration=field(item, "demonstration", str, where),
        author=field(item, "author", str, where),
        coder=field(item, "coder", str, where),
        start=number(field(item, "start", (int, float), where), where),
        end=number(field(item, "end", (int, float), where), where),
        human=field(item, "human", text, where),
        predicted=field(item, "predicted", text, where),
        verdict=kind,
        run=field(item, "run", (int, type(None)), where),
        time=_time(item, "time", where),
    )


def verdict_to_json(verdict: StoredVerdict, runs: Mapping[int, int]) -> dict[str, Any]:
    """A verdict as a JSON object; `runs` gives the place of each run in the list of runs."""
    assert verdict.time is not None
    return {
        "demonstration": verdict.demonstration,
        "author": verdict.author,
        "coder": verdict.coder,
        "start": verdict.start,
        "end": verdict.end,
        "human": verdict.human,
        "predicted": verdict.predicted,
        "verdict": verdict.verdict,
        "run": None if verdict.run is None else runs[verdict.run],
        "time": verdict.time.isoformat(),
    }


def made_of(item: object, where: str) -> dict[str, Any]:
    """How a recogniser or a run was made."""
    versions = field(item, "versions", dict, where)
    if not all(isinstance(text, str) for text in versions.values()):
        raise InputError(f"'versions' is wrong in {where}.")
    return {
        "time": _time(item, "time", where),
        "settings": field(item, "settings", dict, where),
        "seed": field(item, "seed", (int, type(None)), where),
        "labels": [
            LabelsUsed(
                demonstration=field(used, "demonstration", str, where),
                author=field(used, "author", str, where),
                edit=field(used, "edit", int, where),
            )
            for used in field(item, "labels", list, where)
        ],
        "versions": versions,
    }


def made_to_json(made: StoredRecogniser | StoredRun) -> dict[str, Any]:
    """How a recogniser or a run was made, as a JSON object."""
    return {
        "time": made.time.isoformat(),
        "settings": made.settings,
        "seed": made.seed,
        "labels": [asdict(used) for used in made.labels],
        "versions": made.versions,
    }


def segments_of(items: list[Any], where: str) -> Segments:
    """Segments of a JSON list of ``[start, end, action]``."""
    segments = []
    for item in items:
        if not isinstance(item, list) or len(item) != 3 or not isinstance(item[2], str):
            raise InputError(f"A segment is not start, end and action in {where}.")
        check_name(item[2])
        segments.append(Segment(number(item[0], where), number(item[1], where), item[2]))
    return tuple(segments)


def _time(record: object, name: str, where: str) -> datetime:
    """A time with its zone."""
    try:
        value = datetime.fromisoformat(field(record, name, str, where))
    except ValueError as error:
        raise InputError(f"'{name}' is no time in {where}.") from error
    if not FIRST_YEAR <= value.year <= LAST_YEAR:
        raise InputError(f"'{name}' is of the year {value.year} in {where}.")
    if value.tzinfo is None:
        raise InputError(f"'{name}' has no time zone in {where}.")
    return value
