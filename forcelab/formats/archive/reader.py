"""Reading an archive: whole into a new project, or only what any file of recordings holds."""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError, StaleTrackError
from forcelab.formats.archive.members import MANIFEST, Members, open_members
from forcelab.formats.archive.values import (
    VERDICTS,
    edit_of,
    event_of,
    field,
    made_of,
    note_of,
    number,
    segments_of,
    verdict_of,
)
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.labels import Segments, Track, check_name, overhang
from forcelab.project import AssignmentEvent, Edit, Incoming, LabelsUsed, Note, Project, Verdict
from forcelab.project.loading import natural_order
from forcelab.project.records import check_length
from forcelab.vocabulary import Vocabulary

__all__ = ["read", "read_archive", "sniff"]

#: Tasks that may have a vocabulary.
MOST_TASKS = 1000

_STAYED = (
    "The edits, vocabularies, models' predictions, assignments, verdicts, recognisers and runs "
    "stayed in the archive; importing it by itself into a new project brings everything."
)


def sniff(path: Path, head: bytes) -> bool:
    """Whether a file is a project archive, whatever its name.

    Parameters
    ----------
    path : Path
        The file.
    head : bytes
        Its first bytes; 64 are enough for an archive as this program writes it.
    """
    if not head.startswith(b"PK\x03\x04"):
        return False
    if head[30 : 30 + len(MANIFEST)] == MANIFEST.encode():
        return True
    try:  # packed again by another program, in another order
        with zipfile.ZipFile(path) as archive:
            return MANIFEST in archive.namelist()
    except (zipfile.BadZipFile, NotImplementedError, OSError):
        return False


def read_archive(path: str | Path, project_path: str | Path) -> Project:
    """Make a new project of an archive and open it.

    Parameters
    ----------
    path : path-like
        The archive.
    project_path : path-like
        The project's folder; must not exist, or be empty.

    Raises
    ------
    InputError
        If the archive is damaged, unsafe or of a newer version, or the folder is taken. Nothing is
        left of the new project then.
    """
    bounds: dict[str, tuple[float, float]] = {}
    with open_members(Path(path)) as members, Project.creating(project_path) as project:
        with tempfile.TemporaryDirectory(dir=project.path) as scratch:
            for id_ in members.ids():
                demonstration, source = _demonstration(members, id_, Path(scratch))
                truth = _truth(members, id_)
                notes = _notes(members, id_)
                incoming = Incoming(demonstration, source=source, truth=truth, notes=notes)
                bounds[id_] = demonstration.start, demonstration.end
                added = project.add_all([incoming])
                if added[0].name != demonstration.name:
                    raise InputError(f"The archive '{path}' has two '{demonstration.name}'.")
        try:
            numbers = project.replay(_edits(members, bounds))
        except StaleTrackError as error:
            where = members.where("edits.json")
            raise InputError(f"The edits do not fit together in {where}.") from error
        for id_ in members.ids():
            if project.tracks(id_) != tuple(
                track for track, _ in _tracks(members, id_, bounds[id_])
            ):
                where = members.where(f"demonstrations/{id_}/tracks.json")
                raise InputError(f"The edits do not lead to the segments of {where}.")
        known = _object(members, "vocabularies.json")
        if len(known) > MOST_TASKS:
            where = members.where("vocabularies.json")
            raise InputError(f"There are {len(known):,} tasks in {where}; {MOST_TASKS:,} at most.")
        for task, actions in known.items():
            check_length(task, "task")
            vocabulary = Vocabulary.from_json(actions)
            for word in (task, *vocabulary.names):
                check_name(word)
            project.set_vocabulary(task, vocabulary)
        _read_assignments(members, project)
        _read_recognisers(members, project, numbers)
        for run in members.objects("runs.json"):
            where = members.where("runs.json")
            kind, result = field(run, "kind", str, where), field(run, "result", dict, where)
            project.add_run(kind, result=result, **_made(run, where, numbers))
        _read_verdicts(members, project)
        if members.unread:
            raise InputError(f"The archive '{path}' holds '{min(members.unread)}' for no use.")
    return Project.open(project_path)


def read(path: Path, options: ReadOptions) -> list[Recording]:
    """Read the demonstrations of an archive with the labels of all coders.

    Models' predictions stay in the archive, so that nobody takes them for labels.

    Parameters
    ----------
    path : Path
        The archive.
    options : ReadOptions
        `task` is that of demonstrations that have none; videos are unpacked into `unpack`, and
        stay in the archive without one.

    Raises
    ------
    InputError
        If the archive is damaged, unsafe or of a newer version.
    """
    recordings: list[Recording] = []
    with open_members(path) as members:
        for id_ in members.ids():
            demonstration, source = _demonstration(members, id_, options.unpack, options.task or "")
            bounds = demonstration.start, demonstration.end
            tracks = tuple(
                track for track, kind in _tracks(members, id_, bounds) if kind == "coder"
            )
            truth = _truth(members, id_)
            notes = _notes(members, id_)
            recordings.append(
                Recording(demonstration, tracks, (), source, truth, left=_STAYED, notes=notes)
            )
    return sorted(recordings, key=_place)


def _place(recording: Recording) -> tuple[object, object]:
    """Where a recording comes in a list, as in that of a project."""
    one = recording.demonstration
    return natural_order(one.task), natural_order(one.name)


def _demonstration(
    members: Members, id_: str, unpack: Path | None, task: str = ""
) -> tuple[Demonstration, str]:
    """One demonstration and its source."""
    home = f"demonstrations/{id_}"
    name = f"{home}/demonstration.json"
    where = members.where(name)
    record = members.json(name)
    channels = []
    for item in field(record, "channels", list, where):
        if not isinstance(item, list) or [type(part) for part in item] != [str, str]:
            raise InputError(f"A channel needs a name and a unit in {where}.")
        channels.append(Channel(*item))
    video, told = None, field(record, "video", (dict, type(None)), where)
    if told is not None and unpack is not None:
        offset, rate = (number(told.get(key), where) for key in ("offset", "rate"))
        folder = Path(tempfile.mkdtemp(dir=unpack))
        file = members.extract(f"{home}/{field(told, 'file', str, where)}", folder)
        video = VideoReference(file, ClockMap(offset, rate))
    rate = field(record, "grid_rate", (int, float, type(None)), where)
    demonstration = Demonstration(
        name=field(record, "name", str, where),
        task=field(record, "task", str, where) or task,
        times=members.array(f"{home}/times.npy"),
        signals=members.array(f"{home}/signals.npy"),
        channels=tuple(channels),
        video=video,
        grid_rate=None if rate is None else number(rate, where),
    )
    if demonstration.id != id_:
        raise InputError(f"The content of {members.where(home)} does not match its id.")
    return demonstration, field(record, "source", str, where)


def _truth(members: Members, id_: str) -> dict[str, Any] | None:
    """What a simulation knows of a demonstration; None where nothing was told."""
    name = f"demonstrations/{id_}/truth.json"
    return _object(members, name) if name in members else None


def _notes(members: Members, id_: str) -> tuple[Note, ...]:
    """What coders wrote about a demonstration; older archives hold nothing of it."""
    name = f"demonstrations/{id_}/demonstration.json"
    record, where = members.json(name), members.where(name)
    items = field(record, "notes", list, where) if "notes" in record else []
    return tuple(note_of(item, id_, where) for item in items)


def _tracks(members: Members, id_: str, bounds: tuple[float, float]) -> list[tuple[Track, str]]:
    """The tracks of a demonstration from and to these seconds, each with its author's kind."""
    name = f"demonstrations/{id_}/tracks.json"
    where = members.where(name)
    tracks = []
    for item in _list(members, name):
        kind = field(item, "kind", str, where)
        if kind not in ("coder", "model"):
            raise InputError(f"An author is neither coder nor model in {where}.")
        segments = segments_of(field(item, "segments", list, where), where)
        _check_bounds(segments, bounds, where)
        tracks.append((Track(field(item, "author", str, where), segments), kind))
    return tracks


def _read_assignments(members: Members, project: Project) -> None:
    """Let what happened to assignments happen in the new project."""
    name = "assignments.json"
    if name not in members and members.version < 2:
        return
    where = members.where(name)
    events = [event_of(item, where) for item in _list(members, name)]
    _check_told(members, events, where)
    project.replay_assignments(events)


def _read_verdicts(members: Members, project: Project) -> None:
    """Give every verdict again, on the runs as they are numbered in the new project."""
    name = "verdicts.json"
    if name not in members and members.version < VERDICTS:
        return
    where = members.where(name)
    verdicts = [verdict_of(item, where) for item in _list(members, name)]
    _check_told(members, verdicts, where)
    runs = dict(enumerate((run.id for run in project.run_summaries()), 1))
    if unknown := {verdict.run for verdict in verdicts} - {None, *runs}:
        raise InputError(f"The run {unknown.pop()} is told but missing in {where}.")
    numbered = (v if v.run is None else replace(v, run=runs[v.run]) for v in verdicts)
    project.add_verdicts(numbered)


def _read_recognisers(members: Members, project: Project, numbers: dict[int, int]) -> None:
    """Add every recogniser to the new project."""
    where = members.where("recognisers.json")
    for item in _list(members, "recognisers.json"):
        id_, name = field(item, "id", str, where), field(item, "name", str, where)
        data = members.content(f"recognisers/{id_}.skops")
        if project.add_recogniser(name, data, **_made(item, where, numbers)) != id_:
            raise InputError(f"The content of recogniser '{id_}' does not match its id in {where}.")


def _edits(members: Members, bounds: Mapping[str, tuple[float, float]]) -> Iterator[Edit]:
    """Every edit, each of a demonstration that is there; `bounds` gives their seconds."""
    where = members.where("edits.json")
    for item in members.objects("edits.json"):
        edit = edit_of(item, where, members.version)
        if edit.demonstration not in bounds:
            raise InputError(
                f"The demonstration '{edit.demonstration}' is told but missing in {where}."
            )
        # What an edit removed, an earlier one has inserted.
        _check_bounds(edit.inserted, bounds[edit.demonstration], where)
        yield edit


def _check_bounds(segments: Segments, bounds: tuple[float, float], where: str) -> None:
    """Refuse labels that lie beyond their recording."""
    start, end = bounds
    slack = overhang(end - start)
    for segment in segments:
        if segment.start < start - slack or segment.end > end + slack:
            raise InputError(
                f"'{segment.action}' from {segment.start:.6g} to {segment.end:.6g} s lies beyond "
                f"its recording, which goes from {start:.6g} to {end:.6g} s, in {where}; erase it "
                "there and export again."
            )


def _check_told(members: Members, told: Sequence[AssignmentEvent | Verdict], where: str) -> None:
    """Refuse what was done with a demonstration that is not there."""
    if missing := {one.demonstration for one in told} - set(members.ids()):
        raise InputError(f"The demonstration '{min(missing)}' is told but missing in {where}.")


def _made(item: object, where: str, numbers: dict[int, int]) -> dict[str, Any]:
    """How a recogniser or a run was made, with the new numbers of the edits it names."""
    made = made_of(item, where)
    used: list[LabelsUsed] = made["labels"]
    if missing := {one.edit for one in used} - {0, *numbers}:
        raise InputError(f"The edit {min(missing)} is told but missing in {where}.")
    made["labels"] = [replace(one, edit=numbers.get(one.edit, 0)) for one in used]
    return made


def _list(members: Members, name: str) -> list[Any]:
    """A member that must be a JSON list."""
    value = members.json(name)
    if not isinstance(value, list):
        raise InputError(f"{members.where(name)} is not a list.")
    return value


def _object(members: Members, name: str) -> dict[str, Any]:
    """A member that must be a JSON object."""
    value = members.json(name)
    if not isinstance(value, dict):
        raise InputError(f"{members.where(name)} is not an object.")
    return value
