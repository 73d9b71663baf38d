"""The training segments that are most like a stretch of a demonstration.

A segment is known by a few numbers: mean and standard deviation of the log magnitudes of each
channel and scale, the mean level of each channel, and the logarithm of its duration. Each is
divided by its standard deviation over all training segments, so that none outweighs the others by
its unit; the distance of two segments is Euclidean.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Demonstration
from forcelab.recognition.examples import Examples
from forcelab.review.places import Place
from forcelab.signals.channels import channel_map
from forcelab.signals.grid import measured

__all__ = ["NEIGHBOURS", "Neighbour", "Summaries", "nearest", "summarised", "summary"]

Real = NDArray[np.float64]

#: How many neighbours of an action are looked for.
NEIGHBOURS = 3


@dataclass(frozen=True)
class Neighbour:
    """A training segment and how far it is.

    Parameters
    ----------
    place : Place
        Of another demonstration; ``human`` is its action.
    distance : float
        In standard deviations of training segments, over all numbers together.
    """

    place: Place
    distance: float


@dataclass(frozen=True, eq=False)
class Summaries:
    """The training segments of one or several demonstrations in numbers.

    Parameters
    ----------
    places : tuple of Place, length m
        ``human`` is the action.
    values : ndarray, shape (m, d)
        Not yet divided by anything.
    """

    places: tuple[Place, ...]
    values: Real

    @classmethod
    def joined(cls, parts: Sequence[Summaries]) -> Summaries:
        """Those of several demonstrations together; of at least one."""
        places = tuple(place for part in parts for place in part.places)
        return cls(places, np.concatenate([part.values for part in parts]))


def summary(
    examples: Examples, demonstration: Demonstration, scales: int, start: float, end: float
) -> Real | None:
    """The numbers by which ``[start, end)`` seconds of a demonstration are known, shape (d,).

    Parameters
    ----------
    examples : Examples
        The demonstration's features.
    demonstration : Demonstration
        With the levels of its channels.
    scales : int
        How many scales the features have.
    start, end : float
        Seconds.

    Returns
    -------
    ndarray, shape (d,), or None
        None where the stretch has no time step, or only some in gaps.
    """
    steps = slice(*np.searchsorted(examples.times, (start, end)))
    rows = examples.features[steps][examples.valid[steps]]
    if not len(rows):
        return None
    channels = channel_map(demonstration.channels, examples.channels)
    # All log magnitudes come first; phases, where there are any, have no mean to speak of.
    magnitudes = rows[:, : scales * len(examples.channels)]
    samples = slice(*np.searchsorted(demonstration.times, (start, end)))
    levels = channels.apply(demonstration.signals[samples][:, channels.recorded])
    known = measured(levels)
    counts = np.maximum(known.sum(axis=1), 1)
    return np.concatenate(
        [
            magnitudes.mean(axis=0),
            magnitudes.std(axis=0),
            np.where(known, levels, 0.0).sum(axis=1) / counts,
            [np.log(end - start)],
        ]
    )


def summarised(examples: Examples, demonstration: Demonstration, scales: int) -> Summaries:
    """All human segments of a demonstration in numbers; parameters as of :func:`summary`."""
    places, values = [], []
    for segment in examples.segments:
        found = summary(examples, demonstration, scales, segment.start, segment.end)
        if found is not None:
            places.append(Place(demonstration.id, segment.start, segment.end, segment.action))
            values.append(found)
    width = (2 * scales + 1) * len(examples.channels) + 1
    return Summaries(tuple(places), np.array(values).reshape(len(values), width))


def nearest(
    wanted: Real,
    training: Summaries,
    action: str,
    count: int = NEIGHBOURS,
    without: Collection[str] = (),
) -> tuple[Neighbour, ...]:
    """The training segments of one action that are nearest to a stretch.

    Parameters
    ----------
    wanted : ndarray, shape (d,)
        The stretch, as of :func:`summary`.
    training : Summaries
        Of all actions: the standard deviations are theirs.
    action : str
    count : int
        How many at most.
    without : collection of str
        Ids of demonstrations to leave out, such as the one that the stretch is of.

    Returns
    -------
    tuple of Neighbour
        The nearest one first; of equally near ones the one that comes first in `training`.
    """
    chosen = [
        i
        for i, place in enumerate(training.places)
        if place.human == action and place.demonstration not in without
    ]
    if not chosen:
        return ()
    spread = training.values.std(axis=0)
    spread[spread == 0] = 1.0  # all training segments are alike in this
    distances = np.linalg.norm((training.values[chosen] - wanted) / spread, axis=1)
    order = np.argsort(distances, kind="stable")[:count]
    return tuple(Neighbour(training.places[chosen[i]], float(distances[i])) for i in order)
