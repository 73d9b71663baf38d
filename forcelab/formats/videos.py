"""Videos that belong to recordings: those that are called as they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from forcelab.demonstration import VideoReference
from forcelab.errors import InputError
from forcelab.formats.recording import Recording
from forcelab.project import Project

__all__ = ["beside", "paired", "with_videos"]

_SUFFIXES = frozenset(
    [".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".wmv", ".mts", ".m2ts"]
)


def paired(paths: Sequence[Path]) -> tuple[list[Path], dict[Path, Path]]:
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


def beside(path: Path) -> Path | None:
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
        return frozenset(info.id for info in opened.demonstrations() if info.has_video)


def _is_video(path: Path) -> bool:
    """Whether a file is called like a video."""
    return path.suffix.lower() in _SUFFIXES


def _key(path: Path) -> str:
    """What a recording and its video have in common."""
    return path.stem.casefold()
