"""Where two coders say different things, and where they differ by no more than a boundary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forcelab.labels import Segments
from forcelab.review.coded import Pieces, actions_of, pieces_of
from forcelab.review.places import Place
from forcelab.segment_edits import SLIVER

__all__ = ["Disagreement", "differences"]


@dataclass(frozen=True, slots=True)
class Disagreement:
    """A stretch in which two coders say different things.

    Parameters
    ----------
    start, end : float
        Seconds.
    a, b : str or None
        What each says; None where it is unlabelled.
    edge : bool
        Whether only a boundary differs: before and after it both say the same, and in it one says
        what both said before, the other what both say after.
    """

    start: float
    end: float
    a: str | None
    b: str | None
    edge: bool = False

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return self.end - self.start

    def place(self, demonstration: str) -> Place:
        """Where to look; ``human`` is the first coder, ``predicted`` the second."""
        return Place(demonstration, self.start, self.end, self.a, self.b)


def differences(a: Segments, b: Segments) -> tuple[Disagreement, ...]:
    """Every stretch in which two tracks differ, in order of time."""
    if not a and not b:
        return ()
    actions = actions_of((a, b))
    laid = pieces_of((a, b), actions)
    pieces = laid.joined(np.ones(len(laid.starts), dtype=np.bool_))
    names = (*actions, None)
    found = []
    for i, (one, other) in enumerate(pieces.codes.T.tolist()):
        if one == other:
            continue
        before, after = _neighbour(pieces, i, -1), _neighbour(pieces, i, 1)
        edge = before is not None and after is not None and {before, after} == {one, other}
        start, end = float(pieces.starts[i]), float(pieces.ends[i])
        found.append(Disagreement(start, end, names[one], names[other], edge))
    return tuple(found)


def _neighbour(pieces: Pieces, index: int, step: int) -> int | None:
    """What both say right beside a piece; None where they differ there too."""
    other = index + step
    touches = 0 <= other < len(pieces.starts) and (
        abs(pieces.starts[max(index, other)] - pieces.ends[min(index, other)]) <= SLIVER
    )
    if not touches:
        return -1  # both unlabelled
    one, two = pieces.codes[:, other].tolist()
    return int(one) if one == two else None
