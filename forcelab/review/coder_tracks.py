"""The tracks of a project's coders, of each demonstration that one of them labelled."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from forcelab.errors import InputError
from forcelab.labels import Segments, is_model
from forcelab.project import Project


@dataclass(frozen=True)
class CoderTracks:
    """A demonstration with the tracks of its coders, of those who labelled anything."""

    id: str
    name: str
    task: str
    tracks: Mapping[str, Segments]  # by coder; only those who labelled anything


def coded_demonstrations(
    project: Project,
    task: str | None = None,
    authors: Collection[str] = (),
    viewer: str | None = None,
    without: Collection[str] = (),
) -> tuple[tuple[CoderTracks, ...], int]:
    """The tracks of a project's coders; models never count.

    Parameters
    ----------
    project : Project
    task : str, optional
        Only its demonstrations.
    authors : collection of str, optional
        Only these coders; by default all.
    viewer : str, optional
        Who will look at it: demonstrations that are blind for this coder are left out.
    without : collection of str, optional
        Authors that are no coders of their own, such as that of a consensus, unless they are among
        `authors`.

    Returns
    -------
    tuple of CoderTracks
        Demonstrations that at least one of the coders labelled.
    int
        How many were left out because they are blind for the viewer.

    Raises
    ------
    InputError
        If there is no such task or coder.

    Examples
    --------
    >>> coded, hidden = forcelab.coded_demonstrations(project, "foam")
    >>> [sorted(item.tracks) for item in coded]
    [['Ada', 'Bo'], ['Ada', 'Bo'], ['Ada', 'Bo']]
    """
    coders = project.coding.coders()
    if unknown := [name for name in authors if name not in coders]:
        names = ", ".join(f"'{name}'" for name in coders) or "none at all"
        raise InputError(f"There is no coder '{unknown[0]}'; there are {names}.")
    if task is not None:
        project.demonstrations.check_task(task)
    coded, hidden = [], 0
    for info in project.demonstrations.infos(task):
        if viewer is not None and project.coding.is_blind(info.id, viewer):
            hidden += 1
            continue
        tracks = {
            track.author: track.segments
            for track in project.tracks.of(info.id)
            if track.segments
            and not is_model(track.author)
            and (track.author in authors if authors else track.author not in without)
        }
        if tracks:
            coded.append(CoderTracks(info.id, info.name, info.task, tracks))
    return tuple(coded), hidden
