"""Writing the labels of a project, or all of it, into a folder."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Generator
from pathlib import Path
from typing import Literal

from forcelab.errors import InputError
from forcelab.formats.boris import Observation, VideoFile, to_boris
from forcelab.formats.elan import to_elan
from forcelab.formats.output_folder import file_names, output_folder
from forcelab.formats.track_text import AnnotatedTrack, to_audacity, to_csv, to_statistics_table
from forcelab.io import write_atomically
from forcelab.jobs import Progress
from forcelab.labels import Track
from forcelab.project import DemonstrationInfo, Project
from forcelab.video.index import told_length, told_rate
from forcelab.vocabulary import joined

Format = Literal["csv", "table", "elan", "boris", "audacity", "archive"]

#: What labels are written as.
FORMATS: tuple[Format, ...] = ("csv", "table", "elan", "boris", "audacity", "archive")


def exporting(
    path: Path,
    out: Path,
    kind: Format,
    ids: Collection[str] | None = None,
    viewer: str | None = None,
    replacing: bool = True,
    authors: Collection[str] | None = None,
) -> Generator[Progress, None, tuple[Path, ...]]:
    """Write labels into a folder, as a job.

    Parameters
    ----------
    path : Path
        The project's folder.
    out : Path
        The folder to write into; made unless it is there.
    kind : "csv", "table", "elan", "boris", "audacity" or "archive"
        csv and elan: a file a demonstration. table and boris: one file of all. audacity: a file a
        track. archive: everything the project holds as one file.
    ids : collection of str, optional
        Only of these demonstrations; an archive always has all.
    authors : collection of str, optional
        Only tracks of these; an archive always has all.
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
        chosen = _select(project, ids, viewer, authors)
        if not chosen:
            if ids is not None or authors is not None:
                raise InputError("What was chosen has no labels; export more, or label it first.")
            raise InputError(f"'{project.path}' has no labels to export; label something first.")
        if kind in ("table", "boris"):
            return (yield from _one_file(project, out, kind, chosen, replacing))
        return (yield from _file_each(project, out, kind, chosen, replacing))


def _archive(
    project: Project, out: Path, viewer: str | None, replacing: bool
) -> Generator[Progress, None, tuple[Path, ...]]:
    """Write the whole project as one zip named after it."""
    from forcelab.formats.archive import write_archive

    if viewer is not None and project.coding.blind_to(viewer):
        raise InputError(
            f"An archive holds everybody's labels, and some are hidden from '{viewer}' until "
            f"blind coding is done; export tracks instead."
        )
    written = out / f"{project.path.resolve().stem}.zip"
    _check([written], replacing)
    with output_folder(out, [project.path]):
        yield Progress(0, 1, written.name)
        write_archive(project, written)
    return (written,)


#: A demonstration with those of its tracks that are written.
_Selection = tuple[DemonstrationInfo, tuple[Track, ...]]


def _select(
    project: Project,
    ids: Collection[str] | None,
    viewer: str | None,
    authors: Collection[str] | None,
) -> list[_Selection]:
    """The tracks to write, by demonstration."""
    known = [author.name for author in project.coding.authors()]
    for name in authors or ():
        if name not in known:
            there = ", ".join(known) or "none at all"
            raise InputError(f"Nobody called '{name}' labelled here; there are {there}.")
    chosen = []
    for info in project.demonstrations.infos():
        if not info.authors or (ids is not None and info.id not in ids):
            continue
        hidden = viewer is not None and project.coding.is_blind(info.id, viewer)
        tracks = tuple(
            track
            for track in project.tracks.of(info.id)
            if (not hidden or track.author == viewer)
            and (authors is None or track.author in authors)
        )
        if tracks:
            chosen.append((info, tracks))
    return chosen


def _titles(project: Project) -> dict[str, str]:
    """What files of each demonstration are called after: its name, if no other has the same.

    So labels can be laid beside the recording that they are of, and are read with it.
    """
    infos = project.demonstrations.infos()
    times = Counter(info.name.casefold() for info in infos)
    return {
        info.id: f"{info.task} - {info.name}"
        if info.task and times[info.name.casefold()] > 1
        else info.name
        for info in infos
    }


def _one_file(
    project: Project, out: Path, kind: Format, chosen: Collection[_Selection], replacing: bool
) -> Generator[Progress, None, tuple[Path, ...]]:
    """Write all tracks into one file."""
    name = project.path.resolve().stem
    ending = ".segments.csv" if kind == "table" else ".boris"
    written = out / f"{file_names([name])[0]}{ending}"
    _check([written], replacing)
    kinds = {author.name: author.kind for author in project.coding.authors()}
    titles = _titles(project)
    coded: list[AnnotatedTrack] = []
    observed: list[Observation] = []
    for done, (info, tracks) in enumerate(chosen):
        yield Progress(done, len(chosen), info.name)
        if kind == "boris":
            observed += _observations(project, info, titles[info.id], tracks)
        else:
            coded += [
                AnnotatedTrack(
                    info.name, info.task, info.duration, kinds.get(track.author, "coder"), track
                )
                for track in tracks
            ]
    if kind == "boris":
        content = to_boris(name, observed, joined(project.actions.vocabularies()))
    else:
        content = to_statistics_table(coded).encode("utf-8")
    with output_folder(out, [project.path]):
        write_atomically(written, content)
    return (written,)


def _observations(
    project: Project, info: DemonstrationInfo, title: str, tracks: Collection[Track]
) -> list[Observation]:
    """Tracks with what else is known of how they were observed: the video, and when."""
    video = project.demonstrations.load(info.id).video if info.has_video else None
    film = None
    if video is not None:
        film = VideoFile(video.path, video.clock, told_rate(video.path), told_length(video.path))
    return [
        Observation(
            title,
            info.task,
            track,
            film,
            next((e.time for e in project.tracks.history(info.id, track.author)), None),
        )
        for track in tracks
    ]


def _file_each(
    project: Project, out: Path, kind: Format, chosen: Collection[_Selection], replacing: bool
) -> Generator[Progress, None, tuple[Path, ...]]:
    """Write a file a demonstration, for Audacity a file a track."""
    titles, apart = _titles(project), kind == "audacity"
    wanted = [
        (info, part, f"{titles[info.id]} - {part[0].author}" if apart else titles[info.id])
        for info, tracks in chosen
        for part in ([(track,) for track in tracks] if apart else [tracks])
    ]
    # Not NAME.csv: that is what recordings are called.
    suffix = {"csv": ".labels.csv", "elan": ".eaf", "audacity": ".txt"}[kind]
    names = file_names([title for _, _, title in wanted])
    written = tuple(out / f"{name}{suffix}" for name in names)
    _check(written, replacing)
    made = []
    for done, (info, tracks, _) in enumerate(wanted):
        yield Progress(done, len(wanted), written[done].name)
        made.append(_content(project, info, kind, tracks, out))
    # All were made before: what a format cannot hold leaves no half of an export.
    with output_folder(out, [project.path]):
        for file, content in zip(written, made, strict=True):
            write_atomically(file, content)
    return written


def _content(
    project: Project, info: DemonstrationInfo, kind: Format, tracks: tuple[Track, ...], out: Path
) -> bytes:
    """What a file holds, or which demonstration it is that cannot be written so."""
    try:
        if kind == "elan":
            return to_elan(tracks, project.demonstrations.load(info.id).video, out)
        return (to_csv(tracks) if kind == "csv" else to_audacity(tracks[0])).encode()
    except InputError as error:
        raise InputError(f"'{info.name}': {error}") from error


def _check(files: Collection[Path], replacing: bool) -> None:
    """Refuse to replace files unless that is wanted."""
    there = [] if replacing else [file for file in files if file.exists()]
    if there:
        raise InputError(
            f"'{there[0].name}' is in '{there[0].parent}' already; choose an empty folder, or say "
            f"that files are to be replaced."
        )
