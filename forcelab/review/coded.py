"""Demonstrations with the tracks of their coders, laid over each other and cut into pieces."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.labels import Segments, is_model, to_codes
from forcelab.project import Project
from forcelab.segment_edits import SLIVER

__all__ = ["Coded", "Pieces", "actions_of", "coded_demonstrations", "pieces_of"]


@dataclass(frozen=True)
class Coded:
    """A demonstration and what its coders labelled.

    Parameters
    ----------
    id, name, task : str
        Of the demonstration.
    tracks : mapping of str to tuple of Segment
        By coder; only those who labelled anything.
    """

    id: str
    name: str
    task: str
    tracks: Mapping[str, Segments]


@dataclass(frozen=True, eq=False, slots=True)
class Pieces:
    """Tracks laid over each other, cut wherever one of them changes; p pieces of c tracks.

    Parameters
    ----------
    starts, ends : ndarray of float64, shape (p,)
        In seconds.
    codes : ndarray of int64, shape (c, p)
        Numbers of actions, -1 where unlabelled; at least one track is labelled in each piece.
    """

    starts: NDArray[np.float64]
    ends: NDArray[np.float64]
    codes: NDArray[np.int64]

    @property
    def seconds(self) -> NDArray[np.float64]:
        """Length of each piece, shape (p,)."""
        return self.ends - self.starts

    @property
    def labelled_by_all(self) -> NDArray[np.bool_]:
        """Which pieces no track leaves unlabelled, shape (p,)."""
        return np.asarray((self.codes >= 0).all(axis=0))

    def joined(self, chosen: NDArray[np.bool_]) -> Pieces:
        """The chosen pieces, with touching ones of the same codes as one."""
        starts, ends, codes = self.starts[chosen], self.ends[chosen], self.codes[:, chosen]
        if not len(starts):
            return Pieces(starts, ends, codes)
        apart = starts[1:] - ends[:-1] > SLIVER
        cuts = np.flatnonzero(apart | (np.diff(codes) != 0).any(axis=0)) + 1
        firsts = np.concatenate([[0], cuts])
        lasts = np.concatenate([cuts, [len(starts)]]) - 1
        return Pieces(starts[firsts], ends[lasts], codes[:, firsts])


def pieces_of(tracks: Sequence[Segments], actions: Sequence[str]) -> Pieces:
    """Lay tracks over each other: exact, nothing is sampled.

    Pieces no longer than :data:`~forcelab.segment_edits.SLIVER` are float dust and left out.

    Parameters
    ----------
    tracks : sequence of tuple of Segment
        Each in order and never overlapping.
    actions : sequence of str
        Every action there is; its number is its code.
    """
    edges = np.unique([t for track in tracks for s in track for t in (s.start, s.end)])
    starts, ends = edges[:-1], edges[1:]
    long = ends - starts > SLIVER
    starts, ends = starts[long], ends[long]
    middles = starts + (ends - starts) / 2
    codes = np.stack([to_codes(track, middles, actions) for track in tracks])
    some = (codes >= 0).any(axis=0)
    return Pieces(starts[some], ends[some], codes[:, some])


def actions_of(tracks: Iterable[Segments]) -> tuple[str, ...]:
    """The actions in the order of their first occurrence."""
    return tuple(dict.fromkeys(s.action for track in tracks for s in track))


def coded_demonstrations(
    project: Project,
    task: str | None = None,
    authors: Collection[str] = (),
    viewer: str | None = None,
    without: Collection[str] = (),
) -> tuple[tuple[Coded, ...], int]:
    """What coders labelled in a project; models never count.

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
    tuple of Coded
        Demonstrations that at least one of the coders labelled.
    int
        How many were left out because they are blind for the viewer.

    Raises
    ------
    InputError
        If there is no such task or coder.
    """
    known = project.coders()
    if unknown := [name for name in authors if name not in known]:
        there = ", ".join(f"'{name}'" for name in known) or "none at all"
        raise InputError(f"There is no coder '{unknown[0]}'; there are {there}.")
    if task is not None:
        project.check_task(task)
    found, hidden = [], 0
    for info in project.demonstrations(task):
        if viewer is not None and project.is_blind(info.id, viewer):
            hidden += 1
            continue
        tracks = {
            track.author: track.segments
            for track in project.tracks(info.id)
            if track.segments
            and not is_model(track.author)
            and (track.author in authors if authors else track.author not in without)
        }
        if tracks:
            found.append(Coded(info.id, info.name, info.task, tracks))
    return tuple(found), hidden
