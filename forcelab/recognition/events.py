"""Event errors: in which way a prediction is wrong.

Source
------
Ward, Lukowicz and Gellersen, "Performance metrics for activity recognition", ACM Transactions on
Intelligent Systems and Technology 2(1), article 6, 2011.

Each action is taken on its own, as the binary question "is it this action?". An *event* is one
human or one predicted segment of the action. Time is cut wherever either answer changes, which
leaves stretches that are right (both yes), missed (only the human says yes), false (only the
prediction does) or empty. A missed or false stretch gets its name from its two neighbours:

================  ================  ===============
right neighbours  missed stretch    false stretch
================  ================  ===============
none              deletion          insertion
one               underfill         overfill
both              fragmentation     merge
================  ================  ===============

Where time breaks off, at a gap, beside unlabelled human time and at both ends of the recording,
there is no neighbour: an event never reaches across. A sample called by the wrong action is an
error of two actions, missed for the one and false for the other.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.overlay import Overlay
from forcelab.runs import Runs

__all__ = ["Events", "Tally", "event_errors"]

_RIGHT, _MISSED, _FALSE = 0, 1, 2


@dataclass(frozen=True, slots=True)
class Tally:
    """How many, and how long together.

    Parameters
    ----------
    count : int
        Number of events or stretches.
    seconds : float
        Their time.
    """

    count: int = 0
    seconds: float = 0.0

    def __add__(self, other: Tally) -> Tally:
        return Tally(self.count + other.count, self.seconds + other.seconds)


@dataclass(frozen=True, slots=True)
class Events:
    """Event errors summed over all actions.

    Whatever was predicted in unlabelled human time is not counted. The time that is right is
    ``human - deletion - fragmentation - underfill``, and also
    ``predicted - insertion - merge - overfill``.

    Parameters
    ----------
    human, predicted : Tally
        All human and all predicted events, and their time.
    insertion : Tally
        Predicted events that meet no human event of their action, and their time.
    deletion : Tally
        Human events that no predicted event of their action meets, and their time.
    fragmentation : Tally
        Human events that several predicted ones fall into, and the time missed between those.
    merge : Tally
        Predicted events that join several human ones, and the false time between those.
    overfill : Tally
        Stretches by which predicted events reach over an edge of a human one, and their time.
    underfill : Tally
        Stretches by which predicted events stay short of an edge of a human one, and their time.
    """

    human: Tally = Tally()
    predicted: Tally = Tally()
    insertion: Tally = Tally()
    deletion: Tally = Tally()
    fragmentation: Tally = Tally()
    merge: Tally = Tally()
    overfill: Tally = Tally()
    underfill: Tally = Tally()

    def __add__(self, other: Events) -> Events:
        return Events(
            *(getattr(self, part.name) + getattr(other, part.name) for part in fields(self))
        )

    def to_json(self) -> dict[str, dict[str, float]]:
        """``{"human": {"count": ..., "seconds": ...}, "predicted": ..., "insertion": ...}``."""
        return asdict(self)


@dataclass(frozen=True, eq=False, slots=True)
class _Stretches:
    """Stretches of right, missed or false time of all actions, by action and then by time."""

    kinds: NDArray[np.int64]
    firsts: NDArray[np.int64]
    seconds: NDArray[np.float64]
    #: How many of the two neighbours are right.
    neighbours: NDArray[np.int64]


def _stretches(over: Overlay) -> _Stretches:
    """Cut time by the binary answers of each action."""
    wrong = np.flatnonzero(over.human_codes != over.predicted_codes)
    false = wrong[over.predicted_codes[wrong] >= 0]
    kinds = np.full(len(over.pieces), _RIGHT)
    kinds[wrong] = _MISSED
    # A piece is right or missed for the human's action and, if wrong, false for the predicted one.
    piece = np.concatenate([np.arange(len(over.pieces)), false])
    action = np.concatenate([over.human_codes, over.predicted_codes[false]])
    kind = np.concatenate([kinds, np.full(len(false), _FALSE)])
    order = np.lexsort((piece, action))
    piece, action, kind = piece[order], action[order], kind[order]

    starts, ends = over.pieces.starts[piece], over.pieces.ends[piece]
    touches = (action[1:] == action[:-1]) & (ends[:-1] == starts[1:])
    cuts = np.flatnonzero(~touches | (kind[1:] != kind[:-1])) + 1
    heads = np.concatenate([[0], cuts])
    tails = np.concatenate([cuts, [len(piece)]]) - 1
    kind = kind[heads]
    joined = touches[cuts - 1]
    neighbours = np.zeros(len(heads), dtype=np.int64)
    neighbours[1:] += joined & (kind[:-1] == _RIGHT)
    neighbours[:-1] += joined & (kind[1:] == _RIGHT)
    return _Stretches(
        kind, over.pieces.firsts[piece[heads]], ends[tails] - starts[heads], neighbours
    )


def event_errors(over: Overlay) -> Events:
    """Count and time the event errors of one demonstration (see the module)."""
    if len(over.pieces) == 0:
        return Events()
    cut = _stretches(over)

    def tally(kind: int, neighbours: int, events: Runs | None = None) -> Tally:
        """Sum up stretches, counting the events that hold them where `events` is given."""
        chosen = (cut.kinds == kind) & (cut.neighbours == neighbours)
        held = np.flatnonzero(chosen)
        if events is not None:
            held = np.unique(events.holding(cut.firsts[chosen]))
        return Tally(len(held), float(cut.seconds[chosen].sum()))

    return Events(
        human=Tally(len(over.human), float(over.human.seconds.sum())),
        predicted=Tally(len(over.predicted), float(over.predicted.seconds.sum())),
        insertion=tally(_FALSE, 0),
        deletion=tally(_MISSED, 0),
        fragmentation=tally(_MISSED, 2, over.human),
        merge=tally(_FALSE, 2, over.predicted),
        overfill=tally(_FALSE, 1),
        underfill=tally(_MISSED, 1),
    )
