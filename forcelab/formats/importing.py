"""Importing files into a project: all of them are read before anything is written.

A file that cannot be read is left out and reported; a strict import takes all files or none.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Generator, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.formats import identify, read
from forcelab.formats.import_report import Imported, ImportReport, report_of
from forcelab.formats.optoforce.calibration import read_calibrations
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.formats.table.labels import lies_beside
from forcelab.formats.videos import beside, paired, with_videos
from forcelab.jobs import Progress, finish
from forcelab.project import Added, Incoming, Project
from forcelab.project.records import Keepable
from forcelab.signals.quality import glitch_remarks
from forcelab.text import listed

__all__ = ["ImportReport", "Imported", "import_files", "importing"]

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
    paths, videos = paired(_without_companions(files))
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
            near = {path: video for path in paths if (video := beside(path)) is not None}
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
        infos = made.demonstrations()
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
    beside = {os.path.realpath(labels) for path in paths.values() if (labels := _companion(path))}
    return [path for key, path in reversed(paths.items()) if key not in beside]


def _companion(path: Path) -> Path | None:
    """The labels file that is read together with a table or bag, if there is one."""
    try:
        return lies_beside(path) if identify(path).name in {"table", "rosbag"} else None
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
            keep=_unsaid(recording.demonstration, options),
            truth=recording.truth,
            notes=recording.notes,
        )
        for file, recordings in read_files.items()
        for recording in recordings
    ]
    if Project.vacant(project):
        try:
            with Project.creating(project) as made:
                return tuple(map(Imported, files, made.add_all(given)))
        except InputError:
            if Project.vacant(project):
                raise
            # Another import made the project while this one was filling its own.
    with Project.open(project) as opened:
        return tuple(map(Imported, files, opened.add_all(given)))


def _unsaid(demonstration: Demonstration, options: ReadOptions) -> list[Keepable]:
    """What neither the file nor the options say about a demonstration."""
    unsaid: list[Keepable] = []
    if options.task is None and not demonstration.task:
        unsaid.append("task")
    if options.rate is None and demonstration.grid_rate is None:
        unsaid.append("grid_rate")
    return unsaid
