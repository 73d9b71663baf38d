"""Importing files into a project: all of them are read before anything is written.

A file that cannot be read is left out and reported; a strict import takes all files or none.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from forcelab.demonstration import Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.formats import identify, read
from forcelab.formats.calibration import read_calibrations
from forcelab.formats.label_tables import has_labels_beside
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.jobs import Progress, finish
from forcelab.project import Added, Incoming, Project
from forcelab.project.records import Keepable
from forcelab.signals.quality import glitch_remarks
from forcelab.text import listed

_SUFFIXES = frozenset(
    [".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".wmv", ".mts", ".m2ts"]
)


def pair_videos(paths: Sequence[Path]) -> tuple[list[Path], dict[Path, Path]]:
    """Part recordings and videos that are named together.

    Parameters
    ----------
    paths : sequence of Path
        In any order.

    Returns
    -------
    recordings : list of Path
        All that is not the video of another one, in order.
    videos : dict of Path to Path
        The video of each recording whose name, without its ending, one video has too: in the same
        folder, or in another one where a single recording is called so.
    """
    films: dict[str, list[Path]] = {}
    folders: dict[str, set[Path]] = {}
    for path in paths:
        if _is_video(path):
            films.setdefault(_key(path), []).append(path)
        else:
            folders.setdefault(_key(path), set()).add(path.parent)
    videos = {}
    for path in (one for one in paths if not _is_video(one)):
        called = films.get(_key(path), [])
        near = [film for film in called if film.parent == path.parent]
        found = near or (called if len(folders[_key(path)]) == 1 else [])
        if len(found) == 1:
            videos[path] = found[0]
    used = set(videos.values())
    return [path for path in paths if path not in used], videos


def videos_beside(path: Path) -> Path | None:
    """The video in a recording's folder that is called as it is, if there is exactly one."""
    try:
        there = [one for one in path.parent.iterdir() if _is_video(one) and _key(one) == _key(path)]
    except OSError:
        return None  # what is wrong is told when the recording is read
    return there[0] if len(there) == 1 else None


def with_videos(
    read_files: Mapping[Path, Sequence[Recording]], videos: Mapping[Path, Path], project: Path
) -> tuple[dict[Path, list[Recording]], dict[Path, InputError]]:
    """Recordings with their videos, which start with them until they are synchronised.

    A demonstration that has a video in the project keeps that and its clock.

    Returns
    -------
    recordings : dict of Path to list of Recording
        All of them; where the video cannot be read without one.
    failures : dict of Path to InputError
        The videos that cannot be read, and why.
    """
    from forcelab.video.validate import check_video

    result = {path: list(recordings) for path, recordings in read_files.items()}
    known = _with_video(project) if videos else frozenset()
    failures: dict[Path, InputError] = {}
    for path, video in videos.items():
        if (
            path not in result
            or len(result[path]) != 1
            or result[path][0].demonstration.video is not None
        ):
            continue
        recording = result[path][0]
        if recording.demonstration.id in known:
            continue
        try:
            damage = check_video(video, recording.demonstration.duration)
        except InputError as error:
            failures[video] = error
            continue
        remark = f"{video.name} was attached; synchronise it unless it starts when the forces do."
        result[path] = [
            replace(
                recording,
                demonstration=replace(recording.demonstration, video=VideoReference(video)),
                remarks=(*recording.remarks, remark, *filter(None, [damage])),
            )
        ]
    return result, failures


def _with_video(project: Path) -> frozenset[str]:
    """Ids of the demonstrations in a project, if it exists, that have a video."""
    if Project.vacant(project):
        return frozenset()
    with Project.open(project) as opened:
        return frozenset(info.id for info in opened.demonstrations.infos() if info.has_video)


def _is_video(path: Path) -> bool:
    """Whether a file is called like a video."""
    return path.suffix.lower() in _SUFFIXES


def _key(path: Path) -> str:
    """What a recording and its video have in common."""
    return path.stem.casefold()


#: So many files of which the same is to be remarked are named.
SHARING = 3


@dataclass(frozen=True, slots=True)
class Imported:
    """What became of one demonstration.

    Parameters
    ----------
    file : Path
        Where it was read from.
    added : Added
        Its name in the project, and whether it is new, updated or unchanged.
    """

    file: Path
    added: Added


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
        return sum(one.added.status == status for one in self.demonstrations)

    def told(self) -> tuple[str, ...]:
        """A line for each remark; where it is the same for several files, one line for all."""
        files: dict[str, list[str]] = {}
        for path, remarks in self.remarks.items():
            for remark in dict.fromkeys(remarks):
                files.setdefault(remark, []).append(path.name)
        return tuple(f"{listed(names, SHARING)}: {remark}" for remark, names in files.items())


def report_of(
    read_files: Mapping[Path, Sequence[Recording]],
    demonstrations: tuple[Imported, ...],
    failures: Mapping[Path, InputError],
) -> ImportReport:
    """The report on files that were read, on what became of what they hold, and on the others."""
    return ImportReport(
        demonstrations,
        _remarks(read_files, demonstrations),
        _counted_names(read_files),
        {path: str(error) for path, error in failures.items()},
    )


def _remarks(
    read_files: Mapping[Path, Sequence[Recording]], demonstrations: Sequence[Imported]
) -> dict[Path, tuple[str, ...]]:
    """The remarks of the formats, then those of the project, by file."""
    remarks = {
        file: [remark for recording in recordings for remark in recording.remarks]
        for file, recordings in read_files.items()
    }
    changed = {one.file for one in demonstrations if one.added.status != "unchanged"}
    for file in changed:
        remarks[file] += dict.fromkeys(r.left for r in read_files[file] if r.left)
    for one in demonstrations:
        remarks[one.file] += one.added.remarks
    return {file: tuple(sentences) for file, sentences in remarks.items() if sentences}


def _counted_names(read_files: Mapping[Path, Sequence[Recording]]) -> dict[str, int]:
    """What the formats counted, added up."""
    total: dict[str, int] = {}
    for recordings in read_files.values():
        for recording in recordings:
            for name, number in recording.statistics.items():
                total[name] = total.get(name, 0) + number
    return total


#: So many files that cannot be read are named.
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
    """
    return finish(importing(project_path, files, options))


def importing(
    project_path: str | os.PathLike[str],
    files: Iterable[str | os.PathLike[str]],
    options: ReadOptions | None = None,
) -> Generator[Progress, None, ImportReport]:
    """Read files of any format, then write what they hold into a project.

    Nothing is written before every file has been read and validated; those that cannot be read are
    left out, or stop all of it if the options are strict. To stop iterating until then cancels the
    import; the writing itself is one step, which succeeds as a whole or changes nothing. An archive
    that is imported by itself into a new project is unpacked with everything in it; into a project
    that is there, archives bring recordings, where these came from, and the coders' labels.

    Parameters
    ----------
    project_path : path-like
        The project's folder; made if there is none.
    files : iterable of path-like
        The files. One that is named twice is read once, and a labels file that lies beside a
        recording which is also named is read with that recording; so is a video that is called as
        one of them.
    options : ReadOptions, optional
        How the files are to be understood where they do not say so themselves. Neither the task
        nor the rate of a demonstration that is there already changes where nobody says anything.

    Yields
    ------
    Progress
        Before each file is read, before the project is written, and at the end.

    Returns
    -------
    ImportReport
        What was added, with the remarks on each file, and which files could not be read.

    Raises
    ------
    InputError
        If no file can be read, one of them cannot and the options are strict, or the project
        cannot be written. The project is as it was then, and one that did not exist does not exist
        afterwards either.
    """
    paths, videos = pair_videos(_without_companions(files))
    if not paths:
        raise InputError("There is no file to import; name at least one.")
    project, options = Path(project_path), options or ReadOptions()
    if options.calibration is not None:
        read_calibrations(options.calibration)  # a wrong name is told, whatever the files need
    whole = options.format in {None, "archive"} and len(paths) == 1 and Project.vacant(project)
    if whole and _is_archive(paths[0]):
        return (yield from _unpacking(project, paths[0], options))
    if not Project.vacant(project):
        with Project.open(project) as opened:
            opened.refuse_read_only()  # before the work and not after it
    total = len(paths) + 1
    with tempfile.TemporaryDirectory(prefix="forcelab-") as scratch:
        options = replace(options, unpack=Path(scratch))
        read_files: dict[Path, list[Recording]] = {}
        failures: dict[Path, InputError] = {}
        for done, path in enumerate(paths):
            yield Progress(done, total, f"reading {path.name}")
            try:
                read_files[path] = [
                    replace(one, remarks=(*one.remarks, *glitch_remarks(one.demonstration)))
                    for one in _checked(path, read(path, options))
                ]
            except InputError as error:
                failures[path] = error
        if failures and (options.strict or not read_files):
            raise _refusal(failures, len(paths))
        if options.videos:
            near = {path: video for path in paths if (video := videos_beside(path)) is not None}
            videos = near | videos
        read_files, bad_videos = with_videos(read_files, videos, project)
        if bad_videos and options.strict:
            raise _refusal(bad_videos, len(paths) + len(bad_videos))
        failures |= bad_videos
        yield Progress(len(paths), total, f"writing {project.name}")
        demonstrations = _write(project, read_files, options)
    yield Progress(total, total, "done")
    return report_of(read_files, demonstrations, failures)


def _is_archive(path: Path) -> bool:
    """Whether a file is an archive of a project."""
    try:
        return identify(path).name == "archive"
    except InputError:
        return False  # what is wrong is told when the file is read


def _unpacking(
    project: Path, path: Path, options: ReadOptions
) -> Generator[Progress, None, ImportReport]:
    """Make a project of a whole archive, with everything that is in it."""
    from forcelab.formats.archive import read_archive

    yield Progress(0, 1, f"unpacking {path.name}")
    with read_archive(path, project) as made:
        infos = made.demonstrations.infos()
    yield Progress(1, 1, "done")
    demonstrations = tuple(Imported(path, Added(i.id, i.name, "new")) for i in infos)
    if options == ReadOptions(unpack=options.unpack, videos=options.videos):
        return ImportReport(demonstrations)
    remark = (
        "The archive was unpacked as it is, so that task, author and the other options were not "
        "used; import it into a project that is there to use them."
    )
    return ImportReport(demonstrations, {path: (remark,)})


def _without_companions(files: Iterable[str | os.PathLike[str]]) -> list[Path]:
    """The files in order, each once, without labels files that another file brings along."""
    paths = {os.path.realpath(file): Path(file) for file in reversed(list(files))}
    beside = {
        os.path.realpath(labels) for path in paths.values() if (labels := _companion_of(path))
    }
    return [path for key, path in reversed(paths.items()) if key not in beside]


def _companion_of(path: Path) -> Path | None:
    """The labels file that is read together with a table or bag, if there is one."""
    try:
        return has_labels_beside(path) if identify(path).name in {"table", "rosbag"} else None
    except (InputError, OSError):
        return None  # what is wrong is told when the file is read


def _refusal(failures: Mapping[Path, InputError], total: int) -> InputError:
    """One sentence for an import that did not take place, of the kind of the first error."""
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
    """The recordings, once their tracks, and every name in them, can be stored."""
    for recording in recordings:
        demonstration = recording.demonstration
        authors = [track.author for track in recording.tracks]
        if len(set(authors)) < len(authors):
            raise InputError(f"'{path}' has two tracks of one author; rename one.")
        texts = [demonstration.name, demonstration.task]
        texts += [
            text for channel in demonstration.channels for text in (channel.name, channel.unit)
        ]
        texts += [text for track in recording.tracks for text in (track.author, *track.actions)]
        texts += [text for note in recording.notes for text in (note.author, note.text)]
        for text in texts:
            if not text.isascii() and text.encode("utf-8", "ignore").decode() != text:
                raise InputError(
                    f"{str(path)!a}: the name {text!a} is not valid Unicode; rename the file or "
                    f"what it names."
                )
    return recordings


def _write(
    project: Path, read_files: Mapping[Path, list[Recording]], options: ReadOptions
) -> tuple[Imported, ...]:
    """Add all demonstrations or none; a new project gets its name once it is complete."""
    files = [file for file, recordings in read_files.items() for _ in recordings]
    given = [
        Incoming(
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
            with Project.creating(project) as made:
                return tuple(map(Imported, files, made.demonstrations.add_all(given)))
        except InputError:
            if Project.vacant(project):
                raise
            # Another import made the project while this one was filling its own.
    with Project.open(project) as opened:
        return tuple(map(Imported, files, opened.demonstrations.add_all(given)))


def _unreported(demonstration: Demonstration, options: ReadOptions) -> list[Keepable]:
    """What neither the file nor the options say about a demonstration."""
    unsaid: list[Keepable] = []
    if options.task is None and not demonstration.task:
        unsaid.append("task")
    if options.rate is None and demonstration.grid_rate is None:
        unsaid.append("grid_rate")
    return unsaid
