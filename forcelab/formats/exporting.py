"""Writing the labels of a project, or all of it, into a folder."""

from __future__ import annotations

from collections.abc import Collection, Generator
from pathlib import Path
from typing import Literal

from forcelab.errors import InputError
from forcelab.formats.folders import file_names, filling
from forcelab.formats.tracks import write_audacity, write_csv
from forcelab.jobs import Progress
from forcelab.labels import Track
from forcelab.project import Project

__all__ = ["FORMATS", "Format", "exporting"]

Format = Literal["csv", "audacity", "archive"]

#: What labels are written as.
FORMATS: tuple[Format, ...] = ("csv", "audacity", "archive")


def exporting(
    path: Path,
    out: Path,
    kind: Format,
    ids: Collection[str] | None = None,
    viewer: str | None = None,
    replacing: bool = True,
) -> Generator[Progress, None, tuple[Path, ...]]:
    """Write labels into a folder, as a job.

    Parameters
    ----------
    path : Path
        The project's folder.
    out : Path
        The folder to write into; made unless it is there.
    kind : "csv", "audacity" or "archive"
        A file a demonstration, a file a track, or everything the project holds as one file.
    ids : collection of str, optional
        Only of these demonstrations; an archive always has all.
    viewer : str, optional
        A coder from whom hidden tracks are left out; a project in which any are makes no archive.
    replacing : bool
        Whether files that are there are replaced.

    Returns
    -------
    tuple of Path
        What was written.

    Raises
    ------
    InputError
        If there is nothing to write, a file is there that is not to be replaced, or the folder
        cannot be written into or lies in a project.
    """
    with Project.open(path) as project:
        if kind == "archive":
            return (yield from _archive(project, out, viewer, replacing))
        return (yield from _tracks(project, out, kind, ids, viewer, replacing))


def _archive(
    project: Project, out: Path, viewer: str | None, replacing: bool
) -> Generator[Progress, None, tuple[Path, ...]]:
    """Write the whole project as one zip named after it."""
    from forcelab.formats.archive import write_archive

    if viewer is not None and any(
        one.blind and one.done is None for one in project.assignments(viewer)
    ):
        raise InputError(
            f"An archive holds everybody's labels, and some are hidden from '{viewer}' until "
            f"blind coding is done; export tracks instead."
        )
    written = out / f"{project.path.resolve().stem}.zip"
    _check([written], replacing)
    with filling(out, [project.path]):
        yield Progress(0, 1, written.name)
        write_archive(project, written)
    return (written,)


def _tracks(
    project: Project,
    out: Path,
    kind: Format,
    ids: Collection[str] | None,
    viewer: str | None,
    replacing: bool,
) -> Generator[Progress, None, tuple[Path, ...]]:
    """Write the tracks: as CSV a file a demonstration, for Audacity a file a track."""
    wanted: list[tuple[str, tuple[Track, ...]]] = []
    for info in project.demonstrations():
        if not info.authors or (ids is not None and info.id not in ids):
            continue
        tracks = project.tracks(info.id)
        if viewer is not None and project.is_blind(info.id, viewer):
            tracks = tuple(track for track in tracks if track.author == viewer)
        title = f"{info.task} - {info.name}" if info.task else info.name
        if kind == "csv":
            wanted += [(title, tracks)] if tracks else []
        else:
            wanted += [(f"{title} - {track.author}", (track,)) for track in tracks]
    if not wanted:
        raise InputError(f"'{project.path}' has no labels to export; label something first.")
    # Not NAME.csv: that is what recordings are called.
    suffix = ".labels.csv" if kind == "csv" else ".txt"
    names = file_names([title for title, _ in wanted])
    written = tuple(out / f"{name}{suffix}" for name in names)
    _check(written, replacing)
    with filling(out, [project.path]):
        for done, (file, (_, tracks)) in enumerate(zip(written, wanted, strict=True)):
            yield Progress(done, len(wanted), file.name)
            if kind == "csv":
                write_csv(file, tracks)
            else:
                write_audacity(file, tracks[0])
    return written


def _check(files: Collection[Path], replacing: bool) -> None:
    """Refuse to replace files unless that is wanted."""
    there = [] if replacing else [file for file in files if file.exists()]
    if there:
        raise InputError(
            f"'{there[0].name}' is in '{there[0].parent}' already; choose an empty folder, or say "
            f"that files are to be replaced."
        )
