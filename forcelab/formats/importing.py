"""Importing files into a project: all of them are read before anything is written.

A file that cannot be read is left out and reported; a strict import takes all files or none.
"""

from __future__ import annotations

import contextlib
import os
import re
import tempfile
import time
from collections import Counter
from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import TypeVar

from forcelab.demonstration import Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.formats import identify, reading
from forcelab.formats.archive import unpacking
from forcelab.formats.calibration import read_calibrations
from forcelab.formats.label_tables import labels_file_beside
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.jobs import Progress, finish, map_progress
from forcelab.project import AddResult, NewDemonstration, Project
from forcelab.project.records import Keepable
from forcelab.signals.grid import glitch_remarks
from forcelab.text import listed

ResultT = TypeVar("ResultT")

#: What parts a recording's name from that of one of its videos.
_SEPARATOR = re.compile("[._-]")
_SUFFIXES = frozenset(
    [".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".wmv", ".mts", ".m2ts"]
)


def pair_videos(paths: Sequence[Path]) -> tuple[list[Path], dict[Path, dict[str, Path]]]:
    """Part recordings from the videos that belong to them.

    A video belongs to the recording with the same name but for the suffix, or with the beginning of
    its name up to a dot, dash or underscore, after which it is called: in the same folder, or in
    another one where only one recording has that name. All other files are recordings, in order.
    Gives, of each recording, the videos by what they are called; the one of its own name by "".
    """
    recordings: dict[str, list[Path]] = {}
    for path in paths:
        if not is_video(path):
            recordings.setdefault(path.stem.casefold(), []).append(path)
    candidates: dict[tuple[Path, str], list[Path]] = {}
    for video in filter(is_video, paths):
        # The longest name that a recording has is that of its own.
        ends = [len(video.stem), *(m.start() for m in reversed([*_SEPARATOR.finditer(video.stem)]))]
        for end in ends:
            named = recordings.get(video.stem[:end].casefold(), [])
            beside = [path for path in named if path.parent == video.parent]
            if beside or len({path.parent for path in named}) == 1:
                for path in beside or named:
                    candidates.setdefault((path, video.stem[end + 1 :]), []).append(video)
            if named:
                break
    video_of: dict[Path, dict[str, Path]] = {}
    for (path, name), videos in candidates.items():
        beside = [video for video in videos if video.parent == path.parent]
        if len(beside or videos) == 1:
            video_of.setdefault(path, {})[name] = (beside or videos)[0]
    used = {video for videos in video_of.values() for video in videos.values()}
    return [path for path in paths if path not in used], video_of


def videos_beside(paths: Sequence[Path]) -> dict[Path, dict[str, Path]]:
    """The videos in the folders of recordings that belong to them."""
    found: dict[Path, dict[str, Path]] = {}
    for folder in dict.fromkeys(path.parent for path in paths):
        with contextlib.suppress(OSError):  # what is wrong is told when the recording is read
            found |= pair_videos([*folder.iterdir()])[1]
    return {path: found[path] for path in paths if path in found}


def attach_videos(
    read_files: Mapping[Path, Sequence[Recording]],
    videos: Mapping[Path, Mapping[str, Path]],
    project: Path,
) -> tuple[dict[Path, list[Recording]], dict[Path, InputError]]:
    """Attach videos, which start with the forces until they are synchronised.

    A demonstration that has a video in the project keeps that and its clock. Also gives the videos
    that cannot be read, and why; their recordings stay without them.
    """
    from forcelab.video.validate import check_video  # OpenCV loads slowly

    result = {path: list(recordings) for path, recordings in read_files.items()}
    stored = _stored_videos(project) if videos else {}
    failures: dict[Path, InputError] = {}
    for path, named in videos.items():
        if len(result.get(path, ())) != 1:
            continue
        (recording,) = result[path]
        demonstration, remarks = recording.demonstration, list(recording.remarks)
        attached = list(demonstration.videos)
        present = {*stored.get(demonstration.id, ()), *(video.name for video in attached)}
        for name, video in sorted(named.items()):
            if name in present or (present and not name):
                continue
            try:
                damage = check_video(video, demonstration.duration)
            except InputError as error:
                failures[video] = error
                continue
            attached.append(VideoReference(video, name=name))
            title = f" as '{name}'" if name else ""
            remarks.append(
                f"{video.name} was attached{title}; synchronise it unless it starts when the "
                f"forces do."
            )
            remarks += filter(None, [damage])
        demonstration = replace(demonstration, videos=tuple(attached))
        result[path] = [replace(recording, demonstration=demonstration, remarks=tuple(remarks))]
    return result, failures


def _stored_videos(project: Path) -> dict[str, tuple[str, ...]]:
    """The names of the videos that the project's demonstrations have, by their ids."""
    if Project.vacant(project):
        return {}
    with Project.open(project) as opened:
        return {info.id: info.videos for info in opened.demonstrations.infos()}


def is_video(path: Path) -> bool:
    return path.suffix.lower() in _SUFFIXES


#: How many files are named that share a remark.
SHARING = 3


@dataclass(frozen=True, slots=True)
class Imported:
    """What became of one demonstration."""

    file: Path
    added: AddResult


@dataclass(frozen=True, slots=True)
class ImportReport:
    """What an import did.

    Parameters
    ----------
    demonstrations : tuple of Imported
        In the order of the files and, within a file, in the file's order.
    remarks : mapping of Path to tuple of str
        For each file that gave cause: a sentence for each thing that was dropped, repaired or is
        worth a look.
    statistics : mapping of str to int
        What the formats counted while they read, added up over all files.
    unread : mapping of Path to str
        The files that could not be read and were left out, each with the reason.
    """

    demonstrations: tuple[Imported, ...] = ()
    remarks: Mapping[Path, tuple[str, ...]] = field(default_factory=dict)
    statistics: Mapping[str, int] = field(default_factory=dict)
    unread: Mapping[Path, str] = field(default_factory=dict)

    def count(self, status: str) -> int:
        """How many demonstrations are ``"new"``, ``"updated"`` or ``"unchanged"``."""
        return sum(imported.added.status == status for imported in self.demonstrations)

    def remark_lines(self) -> tuple[str, ...]:
        """A line for each remark; one line for all files that share it."""
        files: dict[str, list[str]] = {}
        for path, remarks in self.remarks.items():
            for remark in dict.fromkeys(remarks):
                files.setdefault(remark, []).append(path.name)
        return tuple(f"{listed(names, SHARING)}: {remark}" for remark, names in files.items())


def _remarks(
    read_files: Mapping[Path, Sequence[Recording]], demonstrations: Sequence[Imported]
) -> dict[Path, tuple[str, ...]]:
    """The remarks of the formats, then those of the project, by file."""
    remarks = {
        file: [remark for recording in recordings for remark in recording.remarks]
        for file, recordings in read_files.items()
    }
    changed = {imported.file for imported in demonstrations if imported.added.status != "unchanged"}
    for file in changed:
        remarks[file] += dict.fromkeys(r.not_imported for r in read_files[file] if r.not_imported)
    for imported in demonstrations:
        remarks[imported.file] += imported.added.remarks
    return {file: tuple(sentences) for file, sentences in remarks.items() if sentences}


#: How many files are named that cannot be read.
NAMED = 20


def import_files(
    project_path: str | os.PathLike[str],
    files: Iterable[str | os.PathLike[str]],
    options: ReadOptions | None = None,
) -> ImportReport:
    """Read files of any format, then write what they hold into a project.

    Parameters
    ----------
    project_path : path-like
        The project's folder; made if there is none.
    files : iterable of path-like
        The files; a video beside its recording is attached if the options say so.
    options : ReadOptions, optional
        How the files are to be understood where they do not say so themselves.

    Returns
    -------
    ImportReport
        What was added, with the remarks on each file, and which files could not be read.

    Raises
    ------
    InputError
        If no file can be read, one of them cannot and the options are strict, or the project
        cannot be written; the project is as it was then.

    Examples
    --------
    >>> options = forcelab.ReadOptions(task="pull")
    >>> report = forcelab.import_files("new.forcelab", ["pull.csv"], options)
    >>> [imported.added.status for imported in report.demonstrations]
    ['new']
    """
    return finish(importing(project_path, files, options))


def importing(
    project_path: str | os.PathLike[str],
    files: Iterable[str | os.PathLike[str]],
    options: ReadOptions | None = None,
) -> Generator[Progress, None, ImportReport]:
    """As :func:`import_files`, as a job.

    Nothing is written before every file has been read and checked; cancelled until then, the import
    changes nothing. The writing itself succeeds as a whole or changes nothing. A file that is named
    twice is read once, and labels files and videos beside a recording are read with it. An archive
    that is imported alone into a new project is unpacked with everything in it; into an existing
    project archives bring recordings, their origin, and coders' labels. Neither the task nor the
    rate of an existing demonstration changes unless the file or the options say so.
    """
    formats = _formats_of(files)
    paths, videos = pair_videos(list(formats))
    if not paths:
        raise InputError("There is no file to import; name at least one.")
    project, options = Path(project_path), options or ReadOptions()
    if options.calibration is not None:
        read_calibrations(options.calibration)  # a wrong name is told, whatever the files need
    vacant = Project.vacant(project)
    whole = options.format in {None, "archive"} and [formats[path] for path in paths] == ["archive"]
    if vacant and whole:
        return (yield from _unpacking(project, paths[0], options))
    if not vacant:
        with Project.open(project) as opened:
            opened.refuse_read_only()  # before the work and not after it
    total = len(paths) + 1
    with tempfile.TemporaryDirectory(prefix="forcelab-") as scratch:
        options = replace(options, unpack=Path(scratch))
        read_files: dict[Path, list[Recording]] = {}
        failures: dict[Path, InputError] = {}
        for done, path in enumerate(paths):
            file_options = replace(options, format=options.format or formats[path])
            overall = Progress(done, total, f"reading {path.name}")
            yield overall
            which = f", file {done + 1} of {len(paths)}" if len(paths) > 1 else ""
            try:
                steps = reading(path, file_options)
                recordings = yield from _relayed(steps, overall, which)
                read_files[path] = [
                    replace(
                        recording,
                        remarks=(*recording.remarks, *glitch_remarks(recording.demonstration)),
                    )
                    for recording in _checked(path, recordings)
                ]
            except InputError as error:
                failures[path] = error
        if failures and (options.strict or not read_files):
            raise _refusal(failures, len(paths))
        if options.videos:
            beside = videos_beside(paths)
            videos = {path: beside.get(path, {}) | videos.get(path, {}) for path in beside | videos}
        read_files, bad_videos = attach_videos(read_files, videos, project)
        if bad_videos and options.strict:
            raise _refusal(bad_videos, len(paths) + len(bad_videos))
        failures |= bad_videos
        writing = Progress(len(paths), total, f"writing {project.name}")
        yield writing
        demonstrations = yield from _relayed(_writing(project, read_files, options), writing)
    statistics: Counter[str] = Counter()
    for recording in chain.from_iterable(read_files.values()):
        statistics.update(recording.statistics)
    return ImportReport(
        demonstrations,
        _remarks(read_files, demonstrations),
        statistics,
        {path: str(error) for path, error in failures.items()},
    )


#: Seconds after which the progress of a single step, such as one file, is shown.
SLOW = 1.0


def _relayed(
    steps: Generator[Progress, None, ResultT], overall: Progress, which: str = ""
) -> Generator[Progress, None, ResultT]:
    """Run one step of an import: where it takes long, its own progress is that of the import."""
    begun = time.monotonic()

    def shown(step: Progress) -> Progress:
        own = step.total > 1 and time.monotonic() - begun >= SLOW
        return replace(step, text=step.text + which) if own else overall

    return map_progress(steps, shown)


def _unpacking(
    project: Path, path: Path, options: ReadOptions
) -> Generator[Progress, None, ImportReport]:
    """Make a project of a whole archive."""
    with (yield from unpacking(path, project)) as unpacked:
        infos = unpacked.demonstrations.infos()
    demonstrations = tuple(Imported(path, AddResult(i.id, i.name, "new")) for i in infos)
    if options == ReadOptions(unpack=options.unpack, videos=options.videos):
        return ImportReport(demonstrations)
    remark = (
        "The archive was unpacked as it is, so that task, author and the other options were not "
        "used; import it into a project that is there to use them."
    )
    return ImportReport(demonstrations, {path: (remark,)})


def _formats_of(files: Iterable[str | os.PathLike[str]]) -> dict[Path, str | None]:
    """The files in order, each once, and which format each has by its content, if any.

    Labels files that are read with their recording, which has columns, are left out.
    """
    paths = {os.path.realpath(file): Path(file) for file in reversed(list(files))}
    formats: dict[str, str | None] = {}
    beside: set[str] = set()
    for key, path in reversed(paths.items()):
        formats[key] = None
        with contextlib.suppress(InputError, OSError):  # told when the file is read
            format_ = identify(path)
            formats[key] = format_.name
            several = len(paths) > 1 and format_.columns
            if several and (labels := labels_file_beside(path)) is not None:
                beside.add(os.path.realpath(labels))
    return {paths[key]: name for key, name in formats.items() if key not in beside}


def _refusal(failures: Mapping[Path, InputError], total: int) -> InputError:
    """One sentence for an import that did not take place, of the type of the first error."""
    refusal, *others = failures.values()
    if others:
        names = listed([path.name for path in failures], NAMED)
        refusal = type(refusal)(
            f"{len(failures)} of {total} files cannot be read ({names}), so nothing was imported; "
            f"first: {refusal}"
        )
    elif total > 1:
        refusal = type(refusal)(f"{refusal} None of the {total} files was imported.")
    refusal.files = tuple(failures)
    return refusal


def _checked(path: Path, recordings: list[Recording]) -> list[Recording]:
    """The recordings, once their tracks and all names in them can be stored."""
    for recording in recordings:
        demonstration = recording.demonstration
        authors = [track.author for track in recording.tracks]
        if len(set(authors)) < len(authors):
            raise InputError(f"'{path}' has two tracks of one author; rename one.")
        texts = [demonstration.name, demonstration.task]
        texts += [video.name for video in demonstration.videos]
        texts += [text for c in demonstration.channels for text in (c.name, c.unit)]
        texts += [text for track in recording.tracks for text in (track.author, *track.actions)]
        texts += [text for note in recording.notes for text in (note.author, note.text)]
        for text in texts:
            if not text.isascii() and text.encode("utf-8", "ignore").decode() != text:
                raise InputError(
                    f"{str(path)!a}: the name {text!a} is not valid Unicode; rename the file or "
                    f"what it names."
                )
    return recordings


def _writing(
    project: Path,
    read_files: Mapping[Path, list[Recording]],
    options: ReadOptions,
) -> Generator[Progress, None, tuple[Imported, ...]]:
    """Add all demonstrations or none; a new project gets its name once it is complete."""
    files = [file for file, recordings in read_files.items() for _ in recordings]
    demonstrations = [
        NewDemonstration(
            recording.demonstration,
            recording.tracks,
            recording.source or file.name,
            labels_from=file.name,
            keep=_unreported(recording.demonstration, options),
            truth=recording.truth,
            notes=recording.notes,
        )
        for file, recordings in read_files.items()
        for recording in recordings
    ]
    if Project.vacant(project):
        try:
            with Project.creating(project) as created:
                added = yield from created.demonstrations.add_all_job(demonstrations)
            return tuple(map(Imported, files, added))
        except InputError:
            if Project.vacant(project):
                raise
            # Another import made the project while this one was filling its own.
    with Project.open(project) as opened:
        added = yield from opened.demonstrations.add_all_job(demonstrations)
    return tuple(map(Imported, files, added))


def _unreported(demonstration: Demonstration, options: ReadOptions) -> list[Keepable]:
    """What neither the file nor the options say, so that the project keeps what it has."""
    unreported: list[Keepable] = []
    if options.task is None and not demonstration.task:
        unreported.append("task")
    if options.rate is None and demonstration.grid_rate is None:
        unreported.append("grid_rate")
    return unreported
