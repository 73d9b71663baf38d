"""A whole project as one file: a zip of readable JSON and plain arrays.

::

    forcelab.json                            what this is, and the version of the archive
    vocabularies.json                        the actions of each task
    demonstrations/ID/demonstration.json     name, task, channels, rate, video, source, notes
    demonstrations/ID/times.npy signals.npy  seconds (n,) and channels (n, c), 64-bit numbers
    demonstrations/ID/video-DIGEST.mp4       the videos, if there are any
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
from collections.abc import Collection, Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from datetime import datetime
from pathlib import Path
from typing import IO, Any, BinaryIO, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError, StaleTrackError
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.formats.signatures import names_in_zip
from forcelab.io import atomic_file
from forcelab.jobs import Progress, finish
from forcelab.labels import Segment, Segments, Track, check_name, check_within
from forcelab.project import (
    AssignmentEvent,
    DemonstrationInfo,
    Edit,
    LabelsUsed,
    NewDemonstration,
    Note,
    Project,
    Provenance,
    StoredRecogniser,
    StoredRun,
    Verdict,
)
from forcelab.project.files import STORED_ID, STORED_VIDEO
from forcelab.project.records import (
    ASSIGNMENT_KINDS,
    EDIT_KINDS,
    VERDICT_KINDS,
    check_length,
    segments_to_json,
)
from forcelab.text import natural_order
from forcelab.vocabulary import Vocabulary

#: The versions of the archive from which on edits tell who proposed them, and it holds verdicts;
#: and from which on a demonstration has any number of videos.
PROPOSALS = VERDICTS = 3
VIDEOS = 4
#: Nothing was done before, and nothing will have been done after.
FIRST_YEAR, LAST_YEAR = 1970, 2300


WordT = TypeVar("WordT", bound=str)


class Record:
    """A JSON object of an archive; each value is checked when it is taken."""

    def __init__(self, value: object, where: str) -> None:
        self._value = value if isinstance(value, dict) else {}
        self.where = where

    def __contains__(self, name: str) -> bool:
        return name in self._value

    def get(self, name: str, *kinds: type) -> Any:
        """A value, which must be of one of the types."""
        # type() and not isinstance(): true and false are no numbers.
        if name not in self._value or type(self._value[name]) not in kinds:
            raise InputError(f"'{name}' is missing or wrong in {self.where}.")
        value = self._value[name]
        if isinstance(value, str) and "\0" in value:
            raise InputError(f"'{name}' holds a NUL, which no table can hold, in {self.where}.")
        return value

    def text(self, name: str) -> str:
        text: str = self.get(name, str)
        return text

    def records(self, name: str) -> list[Record]:
        return [Record(item, self.where) for item in self.get(name, list)]

    def number(self, name: str) -> float:
        return _number(self.get(name, int, float), self.where)

    def time(self, name: str) -> datetime:
        """A time, which must have a zone."""
        try:
            value = datetime.fromisoformat(self.text(name))
        except ValueError as error:
            raise InputError(f"'{name}' is no time in {self.where}.") from error
        if not FIRST_YEAR <= value.year <= LAST_YEAR:
            raise InputError(f"'{name}' is of the year {value.year} in {self.where}.")
        if value.tzinfo is None:
            raise InputError(f"'{name}' has no time zone in {self.where}.")
        return value

    def choice(self, name: str, choices: Sequence[WordT], problem: str) -> WordT:
        """One of some words; `problem` is what any other is not."""
        text = self.text(name)
        for word in choices:
            if word == text:
                return word
        raise InputError(f"'{text}' is {problem} in {self.where}.")

    def demonstration(self, ids: Collection[str]) -> str:
        """The id of a demonstration, which must be one of those."""
        id_ = self.text("demonstration")
        if id_ not in ids:
            raise InputError(f"The demonstration '{id_}' is named but missing in {self.where}.")
        return id_

    def segments(self, name: str) -> Segments:
        """A list of ``[start, end, action]``."""
        segments = []
        for item in self.get(name, list):
            if not isinstance(item, list) or len(item) != 3 or not isinstance(item[2], str):
                raise InputError(f"A segment is not start, end and action in {self.where}.")
            check_name(item[2])
            start, end = (_number(value, self.where) for value in item[:2])
            segments.append(Segment(start, end, item[2]))
        return tuple(segments)


def _number(value: object, where: str) -> float:
    if type(value) not in (int, float):
        raise InputError(f"{value!r} is not a number in {where}.")
    try:
        return float(value)  # type: ignore[arg-type]
    except OverflowError as error:
        raise InputError(f"A number is too large in {where}.") from error


def _to_json(record: object, names: Sequence[str], **replaced: object) -> dict[str, Any]:
    """Some attributes as a JSON object, times as text."""
    values = {name: replaced.get(name, getattr(record, name)) for name in names}
    return {k: v.isoformat() if isinstance(v, datetime) else v for k, v in values.items()}


_EDIT: Final = (
    *("id", "demonstration", "author", "kind", "time", "what", "position", "removed", "inserted"),
    *("reverts", "proposed_by"),
)
_ASSIGNMENT_EVENT: Final = ("demonstration", "author", "kind", "time")
#: Notes stand in the records of their demonstrations.
_NOTE: Final = ("author", "text", "time")
_VERDICT: Final = (
    *("demonstration", "author", "coder", "start", "end", "human", "predicted", "verdict", "run"),
    "time",
)
_PROVENANCE: Final = ("time", "settings", "seed", "labels", "versions")


def _edit_to_json(edit: Edit) -> dict[str, Any]:
    segments = {name: segments_to_json(getattr(edit, name)) for name in ("removed", "inserted")}
    return _to_json(edit, _EDIT, **segments)


def _edit_of(record: Record, version: int, ids: Collection[str]) -> Edit:
    """Parse an edit as archives of that version hold it."""
    kind = record.choice("kind", EDIT_KINDS, "no kind of edit")
    reverts = record.get("reverts", int, type(None))
    if (reverts is None) != (kind not in ("undo", "redo")):
        raise InputError(f"'reverts' is missing or wrong in {record.where}.")
    proposed_by = None
    if version >= PROPOSALS:
        proposed_by = record.get("proposed_by", str, type(None))
        if proposed_by is not None and (kind != "paint" or not proposed_by.strip()):
            raise InputError(f"'proposed_by' is missing or wrong in {record.where}.")
    return Edit(
        id=record.get("id", int),
        demonstration=record.demonstration(ids),
        author=record.text("author"),
        kind=kind,
        time=record.time("time"),
        what=record.text("what"),
        position=record.get("position", int),
        removed=record.segments("removed"),
        inserted=record.segments("inserted"),
        reverts=reverts,
        proposed_by=proposed_by,
    )


def _event_of(record: Record, ids: Collection[str]) -> AssignmentEvent:
    return AssignmentEvent(
        demonstration=record.demonstration(ids),
        author=record.text("author"),
        kind=record.choice("kind", ASSIGNMENT_KINDS, "nothing that befalls an assignment"),
        time=record.time("time"),
    )


def _verdict_of(record: Record, ids: Collection[str]) -> Verdict:
    """Parse a verdict; its run is a place in the list of runs, counted from 1."""
    return Verdict(
        demonstration=record.demonstration(ids),
        author=record.text("author"),
        coder=record.text("coder"),
        start=record.number("start"),
        end=record.number("end"),
        human=record.get("human", str, type(None)),
        predicted=record.get("predicted", str, type(None)),
        verdict=record.choice("verdict", VERDICT_KINDS, "no verdict"),
        run=record.get("run", int, type(None)),
        time=record.time("time"),
    )


#: The member that tells a project archive from every other zip; the first one written.
MANIFEST = "forcelab.json"

#: The version of the archive that is written, and the newest that is read.
VERSION = 4

#: Bytes that an archive may always unpack to.
LARGEST = 64 << 20

#: How many times its own size a larger archive may unpack to. Arrays, videos and recognisers are
#: stored as they are, and the text that is compressed shrinks far less than this.
LARGEST_RATIO = 200

#: Bytes of text that are parsed at once, and those of all edits, which are parsed one by one.
LARGEST_TEXT, LARGEST_EDITS = 32 << 20, 128 << 20

_ID, _VIDEO = STORED_ID.pattern, STORED_VIDEO.pattern
_MEMBER = re.compile(
    r"(forcelab|vocabularies|edits|assignments|verdicts|recognisers|runs)\.json"
    rf"|demonstrations/{_ID}/(demonstration\.json|tracks\.json|truth\.json|times\.npy|signals\.npy|{_VIDEO})"
    rf"|recognisers/{_ID}\.skops"
)
_FOLDER = re.compile(rf"demonstrations/({_ID}/)?|recognisers/")


class ArchiveWriter:
    """Writes members that depend on nothing but their content: no times, users or permissions."""

    def __init__(self, stream: BinaryIO) -> None:
        self._zip = zipfile.ZipFile(stream, "w")

    def close(self) -> None:
        self._zip.close()

    def json(self, name: str, value: object) -> None:
        text = json.dumps(value, ensure_ascii=False, indent=1) + "\n"
        self._zip.writestr(_member_info(name, zipfile.ZIP_DEFLATED), text.encode())

    def json_list(self, name: str, values: Iterable[object]) -> None:
        """Write a JSON list, holding one value at a time in memory."""
        info = _member_info(name, zipfile.ZIP_DEFLATED)
        with self._zip.open(info, "w", force_zip64=True) as member:
            before = "["
            for value in values:
                text = json.dumps(value, ensure_ascii=False, indent=1).replace("\n", "\n ")
                member.write(f"{before}\n {text}".encode())
                before = ","
            member.write(b"[]\n" if before == "[" else b"\n]\n")

    def array(self, name: str, array: NDArray[np.float64]) -> None:
        with self._zip.open(_member_info(name), "w", force_zip64=True) as member:
            np.lib.format.write_array(member, array, version=(1, 0), allow_pickle=False)

    def file(self, name: str, path: Path) -> None:
        with (
            path.open("rb") as read,
            self._zip.open(_member_info(name), "w", force_zip64=True) as member,
        ):
            shutil.copyfileobj(read, member, 1 << 20)


class ArchiveReader:
    """The members of an archive, once their names and sizes were found harmless."""

    def __init__(self, path: Path, archive: zipfile.ZipFile) -> None:
        self.path = path
        self.unread = _checked_names(path, archive)
        self._names = frozenset(self.unread)
        self._zip = archive
        self.version = VERSION

    def __contains__(self, name: str) -> bool:
        return name in self._names

    def ids(self) -> list[str]:
        return sorted({n.split("/")[1] for n in self._names if n.startswith("demonstrations/")})

    def content(self, name: str) -> bytes:
        with self._opened(name) as member:
            return member.read()

    def json(self, name: str) -> Any:
        try:
            return json.loads(self.content(name))
        except (ValueError, RecursionError) as error:
            raise InputError(f"{self.where(name)} is no valid JSON.") from error

    def object(self, name: str) -> dict[str, Any]:
        """The value of a member that must be a JSON object."""
        value = self.json(name)
        if not isinstance(value, dict):
            raise InputError(f"{self.where(name)} is not an object.")
        return value

    def record(self, name: str) -> Record:
        return Record(self.json(name), self.where(name))

    def records(self, name: str) -> list[Record]:
        """The objects of a member that must be a JSON list."""
        value = self.json(name)
        if not isinstance(value, list):
            raise InputError(f"{self.where(name)} is not a list.")
        return [Record(item, self.where(name)) for item in value]

    def each_record(self, name: str) -> Iterator[Record]:
        """The objects of a JSON list, held one at a time where possible.

        That is where each ends on a line of its own, as :class:`ArchiveWriter` has it.
        """
        where, part, several = self.where(name), "", False

        def parsed(text: str) -> list[Record]:
            values = json.loads(text)
            if not isinstance(values, list) or (several and not values):
                raise ValueError("no list, or a comma at its end")
            return [Record(value, where) for value in values]

        try:
            with self._opened(name) as member, io.TextIOWrapper(member, "utf-8") as lines:
                for line in lines:
                    part += line
                    if len(part) > LARGEST_TEXT:
                        raise InputError(
                            f"{where} holds an entry of more than {LARGEST_TEXT >> 20} MiB, which "
                            f"forcelab writes nowhere."
                        )
                    if line.rstrip() == " },":
                        yield from parsed(part.rstrip()[:-1] + "]")
                        part, several = "[", True
            yield from parsed(part)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{where} is no valid JSON list.") from error

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
        """Write a video into a folder, and check it against the digest in its name."""
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
        """Open a member for reading; whatever is wrong with it is one sentence."""
        if name not in self._names:
            raise InputError(f"The archive '{self.path}' lacks '{name}'; it is not complete.")
        self.unread.discard(name)
        with _zip_errors(self.path), self._zip.open(name) as member:
            yield member


@contextlib.contextmanager
def open_archive(path: Path) -> Iterator[ArchiveReader]:
    """Open an archive, and refuse it before reading if it is not one of ours or is unsafe."""
    with contextlib.ExitStack() as stack:
        with _zip_errors(path):
            archive = stack.enter_context(zipfile.ZipFile(path))
        members = ArchiveReader(path, archive)
        if MANIFEST not in members:
            raise InputError(f"'{path}' is not a forcelab archive: it holds no {MANIFEST}.")
        version = members.record(MANIFEST).get("version", int)
        if version > VERSION:
            raise InputError(
                f"The archive '{path}' was written by a newer forcelab (version {version}, this "
                f"program knows {VERSION}); update forcelab to read it."
            )
        members.version = version
        yield members


def _member_info(name: str, compression: int = zipfile.ZIP_STORED) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
    info.compress_type = compression
    info.create_system = 3
    info.external_attr = 0o644 << 16
    return info


def _checked_names(path: Path, archive: zipfile.ZipFile) -> set[str]:
    """The names of all members, each of which has been checked."""
    names: set[str] = set()
    for info in archive.infolist():
        name = info.orig_filename
        if _FOLDER.fullmatch(name):
            continue
        if not _MEMBER.fullmatch(name):
            problem = "is no part of a project"
        elif name in names:
            problem = "is there twice"
        elif stat.S_ISLNK(info.external_attr >> 16):
            problem = "is a link"
        elif info.flag_bits & 1:
            problem = "is encrypted"
        elif info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            problem = "is compressed in an unknown way"
        elif info.file_size > _largest(name):
            problem = (
                f"unpacks to {info.file_size:,} bytes of text, and {_largest(name):,} is the most"
            )
        else:
            names.add(name)
            continue
        raise InputError(f"The archive '{path}' was refused: its member {name!r} {problem}.")
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
    """Most bytes of one member: text takes many times its length when parsed."""
    if name == "runs.json" or not name.endswith(".json"):
        return math.inf
    return LARGEST_EDITS if name == "edits.json" else LARGEST_TEXT


@contextlib.contextmanager
def _zip_errors(path: Path) -> Iterator[None]:
    """Re-raise a failure to read a zip as one sentence."""
    try:
        yield
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise InputError(f"The archive '{path}' is damaged ({error}); get it once more.") from error
    except OSError as error:
        raise InputError(f"The archive '{path}' cannot be read: {error.strerror}.") from error


def write_archive(project: Project, path: str | Path) -> None:
    """Write everything that a project holds into one file, whole or not at all."""
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
        out.json("edits.json", [_edit_to_json(edit) for edit in edits])
        events = project.coding.assignment_events()
        out.json("assignments.json", [_to_json(event, _ASSIGNMENT_EVENT) for event in events])
        numbers = [run.id for run in project.runs.summaries()]
        places = {number: place for place, number in enumerate(numbers, 1)}
        verdicts = [
            _to_json(verdict, _VERDICT, run=None if verdict.run is None else places[verdict.run])
            for verdict in project.coding.verdict_events()
        ]
        out.json("verdicts.json", verdicts)
        recognisers = project.runs.recognisers()
        ids = {info.id for info in project.demonstrations.infos()}
        named = [{"id": r.id, "name": r.name, **_provenance(r, ids)} for r in recognisers]
        out.json("recognisers.json", named)
        for recogniser in recognisers:
            skops = project.runs.recogniser_path(recogniser.id)
            out.file(f"recognisers/{recogniser.id}.skops", skops)
        # What hundreds of runs found is more than there is room for at once.
        runs = map(project.runs.get, numbers)
        out.json_list(
            "runs.json",
            ({"kind": r.kind, **_provenance(r, ids), "result": r.result} for r in runs),
        )


def _provenance(record: StoredRecogniser | StoredRun, ids: set[str]) -> dict[str, Any]:
    """How it was made, without labels of demonstrations that were removed since."""
    labels = [asdict(used) for used in record.labels if used.demonstration in ids]
    return _to_json(record, _PROVENANCE, labels=labels)


def _write_demonstration(project: Project, info: DemonstrationInfo, out: ArchiveWriter) -> None:
    home = f"demonstrations/{info.id}"
    d = project.demonstrations.load(info.id)
    if d.fingerprint() != info.id:
        raise InputError(
            f"The arrays of '{info.name}' in '{project.path}' are no longer what was recorded; "
            f"import the recording again to put them back."
        )
    videos = [
        {"name": v.name, "file": v.path.name, "offset": v.clock.offset, "rate": v.clock.rate}
        for v in d.videos
    ]
    record: dict[str, object] = {
        "name": d.name,
        "task": d.task,
        "channels": [[channel.name, channel.unit] for channel in d.channels],
        "grid_rate": d.grid_rate,
        "videos": videos,
        "source": info.source,
    }
    # Here older programs pass them over; a member of their own they would refuse.
    if notes := project.coding.note_events(info.id):
        record["notes"] = [_to_json(note, _NOTE) for note in notes]
    out.json(f"{home}/demonstration.json", record)
    out.array(f"{home}/times.npy", d.times)
    out.array(f"{home}/signals.npy", d.signals)
    for path in dict.fromkeys(video.path for video in d.videos):
        if not path.is_file():
            raise InputError(
                f"The file '{path}' is missing; import the recording again to put it back."
            )
        out.file(f"{home}/{path.name}", path)
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


#: Tasks that may have a vocabulary, and videos of a demonstration.
MOST_TASKS, MOST_VIDEOS = 1000, 100

_NOT_IMPORTED = (
    "The edits, vocabularies, models' predictions, assignments, verdicts, recognisers and runs "
    "stayed in the archive; importing it by itself into a new project brings everything."
)


def sniff(path: Path, head: bytes) -> bool:
    """Whether a file is a project archive, whatever its name."""
    if not head.startswith(b"PK\x03\x04"):
        return False
    if head[30 : 30 + len(MANIFEST)] == MANIFEST.encode():
        return True
    return MANIFEST in names_in_zip(path)  # packed again by another program, in another order


def read_archive(path: str | Path, project_path: str | Path) -> Project:
    """Make a new project of an archive and open it; after an error nothing of it is left."""
    return finish(unpacking(Path(path), Path(project_path)))


def unpacking(path: Path, project_path: Path) -> Generator[Progress, None, Project]:
    """As :func:`read_archive`, as a job."""
    bounds: dict[str, tuple[float, float]] = {}
    with open_archive(path) as members, Project.creating(project_path) as project:
        ids = members.ids()
        with tempfile.TemporaryDirectory(dir=project.path) as scratch:
            for done, id_ in enumerate(ids):
                yield Progress(done, len(ids), f"unpacking {path.name}")
                incoming = _demonstration(members, id_, Path(scratch))
                demonstration = incoming.demonstration
                bounds[id_] = demonstration.start, demonstration.end
                added = project.demonstrations.add_all([incoming])
                if added[0].name != demonstration.name:
                    raise InputError(f"The archive '{path}' has two '{demonstration.name}'.")
        try:
            numbers = project.tracks.replay(_edits(members, bounds))
        except StaleTrackError as error:
            where = members.where("edits.json")
            raise InputError(f"The edits do not fit together in {where}.") from error
        for id_ in ids:
            tracks = tuple(track for track, _ in _tracks(members, id_, bounds[id_]))
            if project.tracks.of(id_) != tracks:
                where = members.where(f"demonstrations/{id_}/tracks.json")
                raise InputError(f"The edits do not lead to the segments of {where}.")
        stored = members.object("vocabularies.json")
        if len(stored) > MOST_TASKS:
            where = members.where("vocabularies.json")
            raise InputError(f"There are {len(stored):,} tasks in {where}; {MOST_TASKS:,} at most.")
        for task, actions in stored.items():
            check_length(task, "task")
            vocabulary = Vocabulary.from_json(actions)
            for word in (task, *vocabulary.names):
                check_name(word)
            project.actions.set_vocabulary(task, vocabulary)
        _read_assignments(members, project)
        _read_recognisers(members, project, numbers)
        for run in members.each_record("runs.json"):
            kind, result = run.text("kind"), run.get("result", dict)
            project.runs.add(kind, _provenance_of(run, numbers), result)
        _read_verdicts(members, project)
        if members.unread:
            raise InputError(f"The archive '{path}' holds '{min(members.unread)}' for no use.")
    return Project.open(project_path)


def read(path: Path, options: ReadOptions) -> Generator[Progress, None, list[Recording]]:
    """Read the demonstrations of an archive with the labels of all coders.

    Models' predictions stay in the archive, so that they are not taken for labels. Videos are
    unpacked into ``options.unpack``, and stay in the archive without one; ``options.task`` is the
    task of demonstrations that have none.
    """
    recordings: list[Recording] = []
    with open_archive(path) as members:
        ids = members.ids()
        for done, id_ in enumerate(ids):
            yield Progress(done, len(ids), f"reading {path.name}")
            packed = _demonstration(members, id_, options.unpack, options.task or "")
            bounds = packed.demonstration.start, packed.demonstration.end
            recordings.append(
                Recording(
                    packed.demonstration,
                    tuple(t for t, kind in _tracks(members, id_, bounds) if kind == "coder"),
                    source=packed.source,
                    truth=packed.truth,
                    not_imported=_NOT_IMPORTED,
                    notes=packed.notes,
                )
            )
    recordings.sort(key=lambda recording: natural_order(recording.demonstration.name))
    recordings.sort(key=lambda recording: natural_order(recording.demonstration.task))
    return recordings  # in the order of a project's list


def _demonstration(
    members: ArchiveReader, id_: str, unpack: Path | None, task: str = ""
) -> NewDemonstration:
    """One demonstration, without its tracks."""
    home = f"demonstrations/{id_}"
    record = members.record(f"{home}/demonstration.json")
    channels = []
    for item in record.get("channels", list):
        if not isinstance(item, list) or [type(part) for part in item] != [str, str]:
            raise InputError(f"A channel needs a name and a unit in {record.where}.")
        channels.append(Channel(*item))
    if members.version >= VIDEOS:
        described = record.records("videos")
    else:
        video = record.get("video", dict, type(None))
        described = [] if video is None else [Record(video, record.where)]
    if len(described) > MOST_VIDEOS:
        raise InputError(f"There are more than {MOST_VIDEOS} videos in {record.where}.")
    videos = []
    extracted: dict[str, Path] = {}
    for video in described if unpack is not None else ():
        clock = ClockMap(video.number("offset"), video.number("rate"))
        name = video.text("name") if members.version >= VIDEOS else ""
        file = video.text("file")
        if file not in extracted:  # two of the same content lie there once
            folder = Path(tempfile.mkdtemp(dir=unpack))
            extracted[file] = members.extract(f"{home}/{file}", folder)
        videos.append(VideoReference(extracted[file], clock, name))
    rate = record.get("grid_rate", int, float, type(None))
    demonstration = Demonstration(
        name=record.text("name"),
        task=record.text("task") or task,
        times=members.array(f"{home}/times.npy"),
        signals=members.array(f"{home}/signals.npy"),
        channels=tuple(channels),
        videos=tuple(videos),
        grid_rate=None if rate is None else record.number("grid_rate"),
    )
    if demonstration.id != id_:
        raise InputError(f"The content of {members.where(home)} does not match its id.")
    source, truth = record.text("source"), f"{home}/truth.json"
    notes = record.records("notes") if "notes" in record else []  # older archives hold none
    return NewDemonstration(
        demonstration,
        source=source,
        truth=members.object(truth) if truth in members else None,
        notes=tuple(
            Note(id_, note.text("author"), note.text("text"), note.time("time")) for note in notes
        ),
    )


def _tracks(
    members: ArchiveReader, id_: str, bounds: tuple[float, float]
) -> list[tuple[Track, str]]:
    """A demonstration's tracks, which must lie within `bounds` (s), each with its author's kind."""
    tracks = []
    for record in members.records(f"demonstrations/{id_}/tracks.json"):
        kind = record.text("kind")
        if kind not in ("coder", "model"):
            raise InputError(f"An author is neither coder nor model in {record.where}.")
        segments = record.segments("segments")
        check_within(segments, *bounds, _cure(record.where))
        tracks.append((Track(record.text("author"), segments), kind))
    return tracks


def _read_assignments(members: ArchiveReader, project: Project) -> None:
    """Replay the history of assignments in the new project."""
    name = "assignments.json"
    if name not in members and members.version < 2:
        return
    ids = set(members.ids())
    project.coding.replay_assignments([_event_of(r, ids) for r in members.records(name)])


def _read_verdicts(members: ArchiveReader, project: Project) -> None:
    """Add all verdicts, on the runs as they are numbered in the new project."""
    name = "verdicts.json"
    if name not in members and members.version < VERDICTS:
        return
    ids = set(members.ids())
    verdicts = [_verdict_of(record, ids) for record in members.records(name)]
    runs = dict(enumerate((run.id for run in project.runs.summaries()), 1))
    if unknown := {verdict.run for verdict in verdicts} - {None, *runs}:
        raise InputError(f"The run {unknown.pop()} is named but missing in {members.where(name)}.")
    numbered = (v if v.run is None else replace(v, run=runs[v.run]) for v in verdicts)
    project.coding.add_verdicts(numbered)


def _read_recognisers(members: ArchiveReader, project: Project, numbers: dict[int, int]) -> None:
    for record in members.records("recognisers.json"):
        id_, name = record.text("id"), record.text("name")
        data = members.content(f"recognisers/{id_}.skops")
        if project.runs.add_recogniser(name, data, _provenance_of(record, numbers)) != id_:
            raise InputError(
                f"The content of recogniser '{id_}' does not match its id in {record.where}."
            )


def _edits(members: ArchiveReader, bounds: Mapping[str, tuple[float, float]]) -> Iterator[Edit]:
    """Every edit, each of a demonstration in `bounds`, which gives start and end in seconds."""
    for record in members.each_record("edits.json"):
        edit = _edit_of(record, members.version, bounds)
        # What an edit removed, an earlier one has inserted.
        check_within(edit.inserted, *bounds[edit.demonstration], _cure(record.where))
        yield edit


def _cure(where: str) -> str:
    """What to do about labels of an archive that lie beyond their recording."""
    return f", in {where}; erase it there and export again."


def _provenance_of(record: Record, numbers: dict[int, int]) -> Provenance:
    """How a recogniser or run was made, with the new numbers of the edits it names."""
    versions = record.get("versions", dict)
    if not all(isinstance(text, str) for text in versions.values()):
        raise InputError(f"'versions' is wrong in {record.where}.")
    labels = [
        LabelsUsed(used.text("demonstration"), used.text("author"), used.get("edit", int))
        for used in record.records("labels")
    ]
    if missing := {used.edit for used in labels} - {0, *numbers}:
        raise InputError(f"The edit {min(missing)} is named but missing in {record.where}.")
    return Provenance(
        settings=record.get("settings", dict),
        seed=record.get("seed", int, type(None)),
        labels=tuple(replace(used, edit=numbers.get(used.edit, 0)) for used in labels),
        versions=versions,
        time=record.time("time"),
    )
