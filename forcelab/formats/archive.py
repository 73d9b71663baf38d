"""A whole project as one file: a zip of readable JSON and plain arrays.

::

    forcelab.json                            what this is, and the version of the archive
    vocabularies.json                        the actions of each task
    demonstrations/ID/demonstration.json     name, task, channels, rate, video, source
    demonstrations/ID/times.npy signals.npy  seconds (n,) and channels (n, c), 64-bit numbers
    demonstrations/ID/video-DIGEST.mp4       the video, if there is one
    demonstrations/ID/tracks.json            every author's segments as they are now
    edits.json                               every edit ever made, the first one first
    recognisers.json recognisers/ID.skops    recognisers, and how they were made
    runs.json                                runs, the first one first, and how to repeat them

ID is the hash of a demonstration's or a recogniser's content, and DIGEST that of a video's; all are
checked when an archive is read. The same project always gives the same bytes.
"""

from __future__ import annotations

import atexit
import contextlib
import shutil
import tempfile
import zipfile
from pathlib import Path
from typing import Any

from forcelab.atomic import atomic_file
from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError, StaleTrackError
from forcelab.formats.archive_json import (
    edit_of,
    edit_to_json,
    field,
    made_of,
    made_to_json,
    number,
    segments_of,
    segments_to_json,
)
from forcelab.formats.archive_members import MANIFEST, VERSION, Members, Writer, open_members
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.labels import Track
from forcelab.project import DemonstrationInfo, Edit, Project
from forcelab.vocabulary import Vocabulary

__all__ = ["read", "read_archive", "sniff", "write_archive"]


def sniff(path: Path, head: bytes) -> bool:
    """Whether a file is a project archive, whatever its name.

    Parameters
    ----------
    path : Path
        The file.
    head : bytes
        Its first bytes; 64 are enough for an archive written by :func:`write_archive`.
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
        recognisers = project.recognisers()
        named = [{"id": r.id, "name": r.name, **made_to_json(r)} for r in recognisers]
        out.json("recognisers.json", named)
        for recogniser in recognisers:
            path_ = project.recogniser_path(recogniser.id)
            out.file(f"recognisers/{recogniser.id}.skops", path_)
        runs = [{"kind": r.kind, **made_to_json(r), "result": r.result} for r in project.runs()]
        out.json("runs.json", runs)


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
    with open_members(Path(path)) as members, Project.creating(project_path) as project:
        with tempfile.TemporaryDirectory(dir=project.path) as scratch:
            for id_ in members.ids():
                demonstration, source = _demonstration(members, id_, Path(scratch))
                added = project.add(demonstration, source=source)
                if added.name != demonstration.name:
                    raise InputError(f"The archive '{path}' has two '{demonstration.name}'.")
        try:
            project.replay(_edits(members))
        except StaleTrackError as error:
            where = members.where("edits.json")
            raise InputError(f"The edits do not fit together in {where}.") from error
        for id_ in members.ids():
            if project.tracks(id_) != tuple(track for track, _ in _tracks(members, id_)):
                where = members.where(f"demonstrations/{id_}/tracks.json")
                raise InputError(f"The edits do not lead to the segments of {where}.")
        for task, actions in _object(members, "vocabularies.json").items():
            project.set_vocabulary(task, Vocabulary.from_json(actions))
        _read_recognisers(members, project)
        for run in _list(members, "runs.json"):
            where = members.where("runs.json")
            kind, result = field(run, "kind", str, where), field(run, "result", dict, where)
            project.add_run(kind, result=result, **_made(members, run, where))
        if members.unread:
            raise InputError(f"The archive '{path}' holds '{min(members.unread)}' for no use.")
    return Project.open(project_path)


def read(path: Path, options: ReadOptions) -> list[Recording]:
    """Read the demonstrations of an archive with the labels of all coders.

    Models' predictions stay in the archive, so that nobody takes them for labels. Videos are
    unpacked into a temporary folder that lasts as long as this process.

    Parameters
    ----------
    path : Path
        The archive.
    options : ReadOptions
        Its task is that of demonstrations that have none.

    Raises
    ------
    InputError
        If the archive is damaged, unsafe or of a newer version.
    """
    scratch = Path(tempfile.mkdtemp(prefix="forcelab-"))
    atexit.register(shutil.rmtree, scratch, ignore_errors=True)
    recordings = []
    with open_members(path) as members:
        for id_ in members.ids():
            demonstration, _ = _demonstration(members, id_, scratch, options.task)
            tracks = _tracks(members, id_)
            recordings.append(
                Recording(
                    demonstration,
                    tracks=tuple(track for track, kind in tracks if kind == "coder"),
                    remarks=tuple(
                        f"The predictions of '{track.author}' over '{demonstration.name}' were "
                        f"left in the archive; make a new project of it to see them."
                        for track, kind in tracks
                        if kind == "model"
                    ),
                )
            )
    return recordings


def _write_demonstration(project: Project, info: DemonstrationInfo, out: Writer) -> None:
    """Write one demonstration's members."""
    home = f"demonstrations/{info.id}"
    d = project.load(info.id)
    if d.id != info.id:
        raise InputError(
            f"The arrays of '{info.name}' in '{project.path}' are no longer what was recorded; "
            f"import the recording again to put them back."
        )
    video = d.video and {
        "file": d.video.path.name,
        "offset": d.video.clock.offset,
        "rate": d.video.clock.rate,
    }
    record = {
        "name": d.name,
        "task": d.task,
        "channels": [[channel.name, channel.unit] for channel in d.channels],
        "grid_rate": d.grid_rate,
        "video": video,
        "source": info.source,
    }
    out.json(f"{home}/demonstration.json", record)
    out.array(f"{home}/times.npy", d.times)
    out.array(f"{home}/signals.npy", d.signals)
    if d.video and not d.video.path.is_file():
        raise InputError(
            f"The file '{d.video.path}' is missing; import the recording again to put it back."
        )
    if d.video:
        out.file(f"{home}/{d.video.path.name}", d.video.path)
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


def _demonstration(
    members: Members, id_: str, scratch: Path, task: str = ""
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
    if told is not None:
        offset, rate = (number(told.get(key), where) for key in ("offset", "rate"))
        folder = scratch / id_
        folder.mkdir()
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


def _tracks(members: Members, id_: str) -> list[tuple[Track, str]]:
    """The tracks of a demonstration, each with its author's kind."""
    name = f"demonstrations/{id_}/tracks.json"
    where = members.where(name)
    tracks = []
    for item in _list(members, name):
        kind = field(item, "kind", str, where)
        if kind not in ("coder", "model"):
            raise InputError(f"An author is neither coder nor model in {where}.")
        segments = segments_of(field(item, "segments", list, where), where)
        tracks.append((Track(field(item, "author", str, where), segments), kind))
    return tracks


def _read_recognisers(members: Members, project: Project) -> None:
    """Add every recogniser to the new project."""
    where = members.where("recognisers.json")
    for item in _list(members, "recognisers.json"):
        id_, name = field(item, "id", str, where), field(item, "name", str, where)
        data = members.content(f"recognisers/{id_}.skops")
        if project.add_recogniser(name, data, **_made(members, item, where)) != id_:
            raise InputError(f"The content of recogniser '{id_}' does not match its id in {where}.")


def _edits(members: Members) -> list[Edit]:
    """Every edit, each of a demonstration that is there."""
    where = members.where("edits.json")
    edits = [edit_of(item, where) for item in _list(members, "edits.json")]
    _check_known(members, [edit.demonstration for edit in edits], where)
    return edits


def _made(members: Members, item: object, where: str) -> dict[str, Any]:
    """How a recogniser or a run was made, of demonstrations that are there."""
    made = made_of(item, where)
    _check_known(members, made["demonstrations"], where)
    return made


def _check_known(members: Members, ids: list[str], where: str) -> None:
    """Refuse ids of demonstrations that the archive lacks."""
    if missing := set(ids) - set(members.ids()):
        raise InputError(f"The demonstration '{min(missing)}' is told but missing in {where}.")


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
