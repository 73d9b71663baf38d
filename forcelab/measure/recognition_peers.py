"""Other people's recognisers measured as ours are: the same folds, channels, labels and columns.

A peer says how probable each action is at each time step. What is made of that is measured twice:
its most probable actions as they come, and decoded as presets ``fast`` and ``best`` are, so that
what a decoder brings is not taken for what a classifier brings; where actions change our presets
learn with trees of their own, and peers do not. The memory of networks and of LightGBM is that
which Python is told of: their own is not seen.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.labels import UNLABELLED
from forcelab.measure.peers.classifiers import LIGHTGBM, MINIROCKET
from forcelab.measure.peers.networks import CNN, MS_TCN
from forcelab.measure.peers.peer import Fitted, Peer, Task
from forcelab.measure.recognition_spent import (
    Seen,
    Spent,
    enough,
    recognise,
    reference,
    remembered,
    row_of,
    timed,
)
from forcelab.measure.rows import Row
from forcelab.recognition.choreography import Choreography
from forcelab.recognition.examples import Examples, Labelled, actions_of, common_rate, prepare
from forcelab.recognition.grouping import groups
from forcelab.recognition.presets import PRESETS
from forcelab.recognition.recogniser import Recogniser
from forcelab.signals.channels import channel_map
from forcelab.signals.grid import on_grid

__all__ = ["PEERS", "measuring_peers"]

Real = NDArray[np.float64]

#: Those that are measured beside ours.
PEERS = (MINIROCKET, LIGHTGBM, CNN, MS_TCN)

#: What is made of a peer's probabilities.
DECODED = PRESETS["fast"].replace(changes=False)
WAYS = {
    "as it comes": DECODED.replace(decoder="filters"),
    "with our decoder": DECODED,
}


def measuring_peers(
    labelled: Sequence[Labelled],
    size: str,
    folds: int | None,
    peers: Sequence[Peer] | None = None,
) -> Generator[Progress, None, tuple[Row, ...]]:
    """Measure other people's recognisers as :func:`forcelab.measure.recognition.measuring` ours.

    Parameters
    ----------
    labelled : sequence of Labelled
    size : str
        As for ours.
    folds : int or None
        As for ours.
    peers : sequence of Peer, optional
        :data:`PEERS` by default.

    Yields
    ------
    Progress

    Returns
    -------
    tuple of Row
        Two for each peer; one with a refusal for each that is not installed.

    Raises
    ------
    InputError
        If fewer than two demonstrations are labelled.
    """
    asked = PEERS if peers is None else tuple(peers)
    used = enough(labelled)
    parts = groups([item.demonstration for item in used], folds)
    against = reference(len(used), len(parts))
    rows: list[Row] = []
    for number, peer in enumerate(asked):
        yield Progress(number * len(parts), len(asked) * len(parts), peer.name)
        try:
            peer.check()
            seen = _seen(peer, used)
            spent = {way: Spent() for way in WAYS}
            for i, part in enumerate(parts):
                _fold(peer, seen, part, spent)
                yield Progress(number * len(parts) + i + 1, len(asked) * len(parts), peer.name)
        except (InputError, ImportError) as error:
            why = error if isinstance(error, InputError) else f"{peer.name}: {error}."
            rows.append(Row(peer.name, "as it comes", size, against, refusal=str(why)))
            continue
        rows += [row_of(peer.name, way, found, size, against) for way, found in spent.items()]
    return tuple(rows)


def _seen(peer: Peer, labelled: Sequence[Labelled]) -> Seen:
    """What a peer knows of all demonstrations, each on the clock."""
    rate = common_rate([item.demonstration for item in labelled], DECODED)
    looked = [_steps(item, rate) for item in labelled]

    def look(i: int) -> Examples:
        example, channels, places = looked[i]
        return replace(example, features=peer.look(channels, example.rate, places))

    _, peak = remembered(lambda: look(0))
    found = [timed(lambda i=i: look(i)) for i in range(len(looked))]  # type: ignore[misc]
    return Seen(labelled, [made for made, _ in found], [taken for _, taken in found], peak)


def _steps(item: Labelled, rate: float) -> tuple[Examples, Real, NDArray[np.int64]]:
    """The time steps that ours decides at, and the channels it sees around them."""
    example = prepare(item, DECODED, rate)
    channels = channel_map(item.demonstration.channels)
    grid = on_grid(item.demonstration, rate, channels.recorded)
    places = np.searchsorted(grid.times, example.times)
    return example, channels.apply(grid.signals), places


def _fold(peer: Peer, seen: Seen, part: Sequence[int], spent: dict[str, Spent]) -> None:
    """Let a peer learn from all demonstrations but some, and recognise those."""
    every = actions_of(seen.examples)
    train = [example for i, example in enumerate(seen.examples) if i not in part]
    actions = actions_of(train)
    codes = [example.codes(actions) for example in train]
    known = np.unique(np.concatenate(codes))
    if len(known[known != UNLABELLED]) < 2:
        raise InputError("Training needs samples of two actions; label more.")
    task = Task([e.features for e in train], codes, len(actions), len(train[0].channels))
    fitted, taken = timed(lambda: _limited(peer, task))
    minutes = sum(m for i, m in enumerate(seen.minutes) if i not in part)
    for way, found in spent.items():
        settings = WAYS[way]
        recogniser = Recogniser(
            settings=settings,
            rate=train[0].rate,
            channels=train[0].channels,
            actions=actions,
            shortest={},
            classifier=_Classifier(fitted, np.arange(len(actions))),
            choreography=Choreography.learn([e.segments for e in train], actions)
            if settings.decodes
            else None,
        )
        found.fit += taken
        found.trained += minutes
        for i in part:
            recognise(recogniser, seen, i, every, found)


def _limited(peer: Peer, task: Task) -> Fitted:
    """Fit on one thread, as ours does."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        return peer.fit(task, DECODED.seed)


@dataclass(frozen=True, eq=False)
class _Classifier:
    """A peer named as those of scikit-learn are, which a recogniser asks."""

    fitted: Fitted
    classes_: NDArray[np.int64]

    def predict_proba(self, rows: Real) -> Real:
        """Probabilities of the actions, shape (m, K)."""
        return self.fitted(rows)

    def predict(self, rows: Real) -> NDArray[np.int64]:
        """Codes of the most probable actions, shape (m,)."""
        return np.asarray(self.fitted(rows).argmax(axis=1))
