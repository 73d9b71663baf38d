"""A whole project as one file: a zip of readable JSON and plain arrays.

::

    forcelab.json                            what this is, and the version of the archive
    vocabularies.json                        the actions of each task
    demonstrations/ID/demonstration.json     name, task, channels, rate, video, source, notes
    demonstrations/ID/times.npy signals.npy  seconds (n,) and channels (n, c), 64-bit numbers
    demonstrations/ID/video-DIGEST.mp4       the video, if there is one
    demonstrations/ID/truth.json             what a simulation knows of it, if it is simulated
    demonstrations/ID/tracks.json            every author's segments as they are now
    edits.json                               every edit ever made, the first one first
    assignments.json                         who was to label what and when it was done
    verdicts.json                            what people said where labels and predictions differ
    recognisers.json recognisers/ID.skops    recognisers, and how they were made
    runs.json                                runs, the first one first, and how to repeat them

ID is the hash of a demonstration's or a recogniser's content, and DIGEST that of a video's; all are
checked when an archive is read. The same project always gives the same bytes.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import math
import re
import shutil
import stat
import tempfile
import tokenize
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from datetime import datetime
from pathlib import Path
from typing import IO, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError, StaleTrackError
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.io import atomic_file
from forcelab.labels import Segment, Segments, Track, check_name, overhang
from forcelab.project import (
    AssignmentEvent,
    DemonstrationInfo,
    Edit,
    Incoming,
    LabelsUsed,
    Note,
    Project,
    StoredRecogniser,
    StoredRun,
    StoredVerdict,
    Verdict,
)
from forcelab.project.records import (
    ASSIGNMENT_KINDS,
    EDIT_KINDS,
    VERDICT_KINDS,
    check_length,
    segments_to_json,
)
from forcelab.text import natural_order
from forcelab.vocabulary import Vocabulary

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


def provenance_of(item: object, where: str) -> dict[str, Any]:
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


def provenance_to_json(made: StoredRecogniser | StoredRun) -> dict[str, Any]:
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


#: The member that tells a project archive from every other zip; the first one written.
MANIFEST = "forcelab.json"

#: The version of the archive that is written, and the newest that is read.
VERSION = 3

#: Bytes that an archive may always unpack to.
LARGEST = 64 << 20

#: How many times its own size a larger archive may unpack to. Arrays, videos and recognisers are
#: stored as they are, and the text that is compressed shrinks far less than this.
LARGEST_RATIO = 200

#: Bytes of text that are parsed at once, and those of all edits, which are parsed one by one.
LARGEST_TEXT, LARGEST_EDITS = 32 << 20, 128 << 20

_ID = "[0-9a-f]{32}"
_VIDEO = r"video-(?P<digest>[0-9a-f]{16})(\.[a-z0-9]{1,8})?"
_MEMBER = re.compile(
    r"(forcelab|vocabularies|edits|assignments|verdicts|recognisers|runs)\.json"
    rf"|demonstrations/{_ID}/(demonstration\.json|tracks\.json|truth\.json|times\.npy|signals\.npy|{_VIDEO})"
    rf"|recognisers/{_ID}\.skops"
)
_FOLDER = re.compile(rf"demonstrations/({_ID}/)?|recognisers/")


class ArchiveWriter:
    """Writes members that depend on nothing but their content: no times, no users, no rights."""

    def __init__(self, stream: BinaryIO) -> None:
        self._zip = zipfile.ZipFile(stream, "w")

    def close(self) -> None:
        """Write the table of contents."""
        self._zip.close()

    def json(self, name: str, value: object) -> None:
        """Write a value as text, compressed."""
        text = json.dumps(value, ensure_ascii=False, indent=1) + "\n"
        self._zip.writestr(_member_info(name, zipfile.ZIP_DEFLATED), text.encode())

    def json_list(self, name: str, values: Iterable[object]) -> None:
        """Write values as a list in text, compressed, holding one of them at a time."""
        info = _member_info(name, zipfile.ZIP_DEFLATED)
        with self._zip.open(info, "w", force_zip64=True) as member:
            before = "["
            for value in values:
                text = json.dumps(value, ensure_ascii=False, indent=1).replace("\n", "\n ")
                member.write(f"{before}\n {text}".encode())
                before = ","
            member.write(b"[]\n" if before == "[" else b"\n]\n")

    def array(self, name: str, array: NDArray[np.float64]) -> None:
        """Write an array in NumPy's format, as it is."""
        with self._zip.open(_member_info(name), "w", force_zip64=True) as member:
            np.lib.format.write_array(member, array, version=(1, 0), allow_pickle=False)

    def file(self, name: str, path: Path) -> None:
        """Write a file as it is."""
        with (
            path.open("rb") as read,
            self._zip.open(_member_info(name), "w", force_zip64=True) as member,
        ):
            shutil.copyfileobj(read, member, 1 << 20)


class ArchiveReader:
    """The members of an archive whose names and sizes were found harmless."""

    def __init__(self, path: Path, archive: zipfile.ZipFile) -> None:
        self.path = path
        self.unread = _checked_name(path, archive)
        self._names = frozenset(self.unread)
        self._zip = archive
        self.version = VERSION

    def __contains__(self, name: str) -> bool:
        return name in self._names

    def ids(self) -> list[str]:
        """The ids of all demonstrations, sorted."""
        return sorted({n.split("/")[1] for n in self._names if n.startswith("demonstrations/")})

    def content(self, name: str) -> bytes:
        """The content of a member."""
        with self._opened(name) as member:
            return member.read()

    def json(self, name: str) -> Any:
        """The value of a member of JSON."""
        try:
            return json.loads(self.content(name))
        except (ValueError, RecursionError) as error:
            raise InputError(f"{self.where(name)} is no valid JSON.") from error

    def objects(self, name: str) -> Iterator[Any]:
        """The objects of a member that is a list of JSON, held one at a time.

        So where each ends on a line of its own, as :class:`ArchiveWriter` has it; else all at once.
        """
        part, more, several = "", True, False
        try:
            with self._opened(name) as member, io.TextIOWrapper(member, "utf-8") as lines:
                for line in lines:
                    part += line
                    if len(part) > LARGEST_TEXT:
                        raise InputError(
                            f"{self.where(name)} holds an entry of more than "
                            f"{LARGEST_TEXT >> 20} MiB, which forcelab writes nowhere."
                        )
                    if line.rstrip() not in (" }", " },"):
                        continue
                    if not more or not (several or part.startswith("[")):
                        raise ValueError("no list")
                    yield json.loads(part.strip().removeprefix("[").removesuffix(","))
                    part, more, several = "", line.rstrip() == " },", True
            rest = json.loads(part) if not several else []
            if (several and (more or part.strip() != "]")) or not isinstance(rest, list):
                raise ValueError("no list")
            yield from rest
        except (ValueError, RecursionError) as error:
            raise InputError(f"{self.where(name)} is no valid JSON list.") from error

    def array(self, name: str) -> NDArray[np.float64]:
        """An array of 64-bit numbers, read-only."""
        data = self.content(name)
        stream = io.BytesIO(data)
        try:
            if np.lib.format.read_magic(stream) != (1, 0):
                raise ValueError("another version of the format")
            shape, by_columns, dtype = np.lib.format.read_array_header_1_0(stream)
            if by_columns or dtype != np.dtype("<f8"):
                raise ValueError("not rows of 64-bit numbers")
            # A view of the bytes: the shape that the header claims reserves no memory.
            array: NDArray[np.float64] = np.frombuffer(data, "<f8", offset=stream.tell())
            return array.reshape(shape)
        except (ValueError, tokenize.TokenError) as error:
            raise InputError(f"{self.where(name)} is no array of 64-bit numbers.") from error

    def extract(self, name: str, folder: Path) -> Path:
        """Write a video into a folder, under the name of its content."""
        target = folder / name.rpartition("/")[2]
        digest = hashlib.sha256()
        with self._opened(name) as member, target.open("xb") as write:
            while block := member.read(1 << 20):
                digest.update(block)
                write.write(block)
        expected = _MEMBER.fullmatch(name)
        if expected is None or digest.hexdigest()[:16] != expected["digest"]:
            raise InputError(f"The content of {self.where(name)} does not match its name.")
        return target

    def where(self, name: str) -> str:
        """A member's name for messages."""
        return f"'{name}' in the archive '{self.path}'"

    @contextlib.contextmanager
    def _opened(self, name: str) -> Iterator[IO[bytes]]:
        """A member open for reading; whatever is wrong with it is one sentence."""
        if name not in self._names:
            raise InputError(f"The archive '{self.path}' lacks '{name}'; it is not complete.")
        self.unread.discard(name)
        with _quoted_name(self.path), self._zip.open(name) as member:
            yield member


@contextlib.contextmanager
def open_archive(path: Path) -> Iterator[ArchiveReader]:
    """Open an archive, and refuse it before anything is read if it is none of ours or unsafe."""
    with contextlib.ExitStack() as stack:
        with _quoted_name(path):
            archive = stack.enter_context(zipfile.ZipFile(path))
        members = ArchiveReader(path, archive)
        if MANIFEST not in members:
            raise InputError(f"'{path}' is not a forcelab archive: it holds no {MANIFEST}.")
        manifest = members.json(MANIFEST)
        version = field(manifest, "version", int, members.where(MANIFEST))
        if version > VERSION:
            raise InputError(
                f"The archive '{path}' was written by a newer forcelab (version {version}, this "
                f"program knows {VERSION}); update forcelab to read it."
            )
        members.version = version
        yield members


def _member_info(name: str, compression: int = zipfile.ZIP_STORED) -> zipfile.ZipInfo:
    """The header of a member to write."""
    info = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
    info.compress_type = compression
    info.create_system = 3
    info.external_attr = 0o644 << 16
    return info


def _checked_name(path: Path, archive: zipfile.ZipFile) -> set[str]:
    """The names of all members, after a look at every one of them."""
    names: set[str] = set()
    for info in archive.infolist():
        name = info.orig_filename
        if _FOLDER.fullmatch(name):
            continue
        if not _MEMBER.fullmatch(name):
            wrong = "is no part of a project"
        elif name in names:
            wrong = "is there twice"
        elif stat.S_ISLNK(info.external_attr >> 16):
            wrong = "is a link"
        elif info.flag_bits & 1:
            wrong = "is encrypted"
        elif info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            wrong = "is compressed in an unknown way"
        elif info.file_size > _largest(name):
            wrong = (
                f"unpacks to {info.file_size:,} bytes of text, and {_largest(name):,} is the most"
            )
        else:
            names.add(name)
            continue
        raise InputError(f"The archive '{path}' was refused: its member {name!r} {wrong}.")
    size = path.stat().st_size
    declared = sum(info.file_size for info in archive.infolist())
    limit = max(LARGEST, LARGEST_RATIO * size)
    if declared > limit or sum(info.compress_size for info in archive.infolist()) > size:
        raise InputError(
            f"The archive '{path}' was refused: {size} bytes claim to unpack to {declared}, and "
            f"{limit} would be the most."
        )
    return names


def _largest(name: str) -> float:
    """How many bytes a member may have by itself: text takes many times its length when parsed."""
    if name == "runs.json" or not name.endswith(".json"):
        return math.inf
    return LARGEST_EDITS if name == "edits.json" else LARGEST_TEXT


@contextlib.contextmanager
def _quoted_name(path: Path) -> Iterator[None]:
    """Turn a failure to read a zip into one sentence."""
    try:
        yield
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise InputError(f"The archive '{path}' is damaged ({error}); get it once more.") from error
    except OSError as error:
        raise InputError(f"The archive '{path}' cannot be read: {error.strerror}.") from error


def write_archive(project: Project, path: str | Path) -> None:
    """Write everything that a project holds into one file, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written or a file of the project is missing or damaged; what was
        there before is untouched.
    """
    with (
        project.snapshot(),
        atomic_file(path) as stream,
        contextlib.closing(ArchiveWriter(stream)) as out,
    ):
        out.json(MANIFEST, {"format": "forcelab archive", "version": VERSION})
        vocabularies = project.actions.vocabularies()
        out.json("vocabularies.json", {task: v.to_json() for task, v in vocabularies.items()})
        edits: list[Edit] = []
        for info in sorted(project.demonstrations.infos(), key=lambda info: info.id):
            _write_demonstration(project, info, out)
            for author in info.authors:
                edits += project.tracks.history(info.id, author)
        edits.sort(key=lambda edit: edit.id)
        out.json("edits.json", [edit_to_json(edit) for edit in edits])
        events = project.coding.assignment_events()
        out.json("assignments.json", [event_to_json(event) for event in events])
        numbers = [run.id for run in project.runs.summaries()]
        places = {number: place for place, number in enumerate(numbers, 1)}
        verdicts = project.coding.verdict_events()
        out.json("verdicts.json", [verdict_to_json(verdict, places) for verdict in verdicts])
        recognisers = project.runs.recognisers()
        there = {info.id for info in project.demonstrations.infos()}
        named = [{"id": r.id, "name": r.name, **_provenance(r, there)} for r in recognisers]
        out.json("recognisers.json", named)
        for recogniser in recognisers:
            path_ = project.runs.recogniser_path(recogniser.id)
            out.file(f"recognisers/{recogniser.id}.skops", path_)
        # What hundreds of runs found is more than there is room for at once.
        runs = map(project.runs.get, numbers)
        out.json_list(
            "runs.json",
            ({"kind": r.kind, **_provenance(r, there), "result": r.result} for r in runs),
        )


def _provenance(made: StoredRecogniser | StoredRun, there: set[str]) -> dict[str, Any]:
    """How a thing was made; labels of demonstrations that were removed since cannot be told."""
    plain = provenance_to_json(made)
    labels = [used for used in plain["labels"] if used["demonstration"] in there]
    return {**plain, "labels": labels}


def _write_demonstration(project: Project, info: DemonstrationInfo, out: ArchiveWriter) -> None:
    """Write one demonstration's members."""
    home = f"demonstrations/{info.id}"
    d = project.demonstrations.load(info.id)
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
    if notes := project.coding.note_events(info.id):
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
    if (truth := project.demonstrations.truth(info.id)) is not None:
        out.json(f"{home}/truth.json", truth)
    kinds = {author.name: author.kind for author in project.coding.authors()}
    tracks = [
        {
            "author": track.author,
            "kind": kinds[track.author],
            "segments": segments_to_json(track.segments),
        }
        for track in project.tracks.of(info.id)
    ]
    out.json(f"{home}/tracks.json", tracks)


#: Tasks that may have a vocabulary.
MOST_TASKS = 1000

_NOT_IMPORTED = (
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
    with open_archive(Path(path)) as members, Project.creating(project_path) as project:
        with tempfile.TemporaryDirectory(dir=project.path) as scratch:
            for id_ in members.ids():
                demonstration, source = _demonstration(members, id_, Path(scratch))
                truth = _truth(members, id_)
                notes = _notes(members, id_)
                incoming = Incoming(demonstration, source=source, truth=truth, notes=notes)
                bounds[id_] = demonstration.start, demonstration.end
                added = project.demonstrations.add_all([incoming])
                if added[0].name != demonstration.name:
                    raise InputError(f"The archive '{path}' has two '{demonstration.name}'.")
        try:
            numbers = project.tracks.replay(_edits(members, bounds))
        except StaleTrackError as error:
            where = members.where("edits.json")
            raise InputError(f"The edits do not fit together in {where}.") from error
        for id_ in members.ids():
            if project.tracks.of(id_) != tuple(
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
            project.actions.set_vocabulary(task, vocabulary)
        _read_assignments(members, project)
        _read_recognisers(members, project, numbers)
        for run in members.objects("runs.json"):
            where = members.where("runs.json")
            kind, result = field(run, "kind", str, where), field(run, "result", dict, where)
            project.runs.add(kind, result=result, **_check_provenance(run, where, numbers))
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
    with open_archive(path) as members:
        for id_ in members.ids():
            demonstration, source = _demonstration(members, id_, options.unpack, options.task or "")
            bounds = demonstration.start, demonstration.end
            tracks = tuple(
                track for track, kind in _tracks(members, id_, bounds) if kind == "coder"
            )
            truth = _truth(members, id_)
            notes = _notes(members, id_)
            recordings.append(
                Recording(demonstration, tracks, (), source, truth, left=_NOT_IMPORTED, notes=notes)
            )
    return sorted(recordings, key=_new_folder)


def _new_folder(recording: Recording) -> tuple[object, object]:
    """Where a recording comes in a list, as in that of a project."""
    one = recording.demonstration
    return natural_order(one.task), natural_order(one.name)


def _demonstration(
    members: ArchiveReader, id_: str, unpack: Path | None, task: str = ""
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


def _truth(members: ArchiveReader, id_: str) -> dict[str, Any] | None:
    """What a simulation knows of a demonstration; None where nothing was told."""
    name = f"demonstrations/{id_}/truth.json"
    return _object(members, name) if name in members else None


def _notes(members: ArchiveReader, id_: str) -> tuple[Note, ...]:
    """What coders wrote about a demonstration; older archives hold nothing of it."""
    name = f"demonstrations/{id_}/demonstration.json"
    record, where = members.json(name), members.where(name)
    items = field(record, "notes", list, where) if "notes" in record else []
    return tuple(note_of(item, id_, where) for item in items)


def _tracks(
    members: ArchiveReader, id_: str, bounds: tuple[float, float]
) -> list[tuple[Track, str]]:
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


def _read_assignments(members: ArchiveReader, project: Project) -> None:
    """Let what happened to assignments happen in the new project."""
    name = "assignments.json"
    if name not in members and members.version < 2:
        return
    where = members.where(name)
    events = [event_of(item, where) for item in _list(members, name)]
    _check_proposal(members, events, where)
    project.coding.replay_assignments(events)


def _read_verdicts(members: ArchiveReader, project: Project) -> None:
    """Give every verdict again, on the runs as they are numbered in the new project."""
    name = "verdicts.json"
    if name not in members and members.version < VERDICTS:
        return
    where = members.where(name)
    verdicts = [verdict_of(item, where) for item in _list(members, name)]
    _check_proposal(members, verdicts, where)
    runs = dict(enumerate((run.id for run in project.runs.summaries()), 1))
    if unknown := {verdict.run for verdict in verdicts} - {None, *runs}:
        raise InputError(f"The run {unknown.pop()} is told but missing in {where}.")
    numbered = (v if v.run is None else replace(v, run=runs[v.run]) for v in verdicts)
    project.coding.add_verdicts(numbered)


def _read_recognisers(members: ArchiveReader, project: Project, numbers: dict[int, int]) -> None:
    """Add every recogniser to the new project."""
    where = members.where("recognisers.json")
    for item in _list(members, "recognisers.json"):
        id_, name = field(item, "id", str, where), field(item, "name", str, where)
        data = members.content(f"recognisers/{id_}.skops")
        if (
            project.runs.add_recogniser(name, data, **_check_provenance(item, where, numbers))
            != id_
        ):
            raise InputError(f"The content of recogniser '{id_}' does not match its id in {where}.")


def _edits(members: ArchiveReader, bounds: Mapping[str, tuple[float, float]]) -> Iterator[Edit]:
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


def _check_proposal(
    members: ArchiveReader, told: Sequence[AssignmentEvent | Verdict], where: str
) -> None:
    """Refuse what was done with a demonstration that is not there."""
    if missing := {one.demonstration for one in told} - set(members.ids()):
        raise InputError(f"The demonstration '{min(missing)}' is told but missing in {where}.")


def _check_provenance(item: object, where: str, numbers: dict[int, int]) -> dict[str, Any]:
    """How a recogniser or a run was made, with the new numbers of the edits it names."""
    made = provenance_of(item, where)
    used: list[LabelsUsed] = made["labels"]
    if missing := {one.edit for one in used} - {0, *numbers}:
        raise InputError(f"The edit {min(missing)} is told but missing in {where}.")
    made["labels"] = [replace(one, edit=numbers.get(one.edit, 0)) for one in used]
    return made


def _list(members: ArchiveReader, name: str) -> list[Any]:
    """A member that must be a JSON list."""
    value = members.json(name)
    if not isinstance(value, list):
        raise InputError(f"{members.where(name)} is not a list.")
    return value


def _object(members: ArchiveReader, name: str) -> dict[str, Any]:
    """A member that must be a JSON object."""
    value = members.json(name)
    if not isinstance(value, dict):
        raise InputError(f"{members.where(name)} is not an object.")
    return value
