"""How far several coders agree: every two of them, all together, and each alone."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from forcelab.jobs import Progress
from forcelab.labels import Segments
from forcelab.review.coded import Coded, actions_of, pieces_of
from forcelab.review.consistency import Consistency, consistency
from forcelab.review.kappa import fleiss
from forcelab.review.pair import PairAgreement, agreeing

__all__ = ["Agreement", "agreement"]


@dataclass(frozen=True)
class Agreement:
    """How far all coders agree.

    Parameters
    ----------
    authors : tuple of str
        The coders that are compared, a coder with two names once.
    coded : tuple of Coded
        What was compared.
    pairs : tuple of PairAgreement
        Of every two who share a demonstration.
    fleiss : float or None
        Fleiss' kappa of all, over the time that two or more labelled.
    fleiss_coders : int
        How many coders the most coded demonstration has.
    repeated : tuple of PairAgreement
        Of two names that are one coder: how consistent the coder is.
    own : tuple of Consistency
        How consistent each coder is from one demonstration of a task to the next.
    hidden : int
        Demonstrations left out because who looks is to label them blind.
    """

    authors: tuple[str, ...]
    coded: tuple[Coded, ...]
    pairs: tuple[PairAgreement, ...]
    fleiss: float | None
    fleiss_coders: int = 0
    repeated: tuple[PairAgreement, ...] = ()
    own: tuple[Consistency, ...] = ()
    hidden: int = 0

    def pair(self, one: str, other: str) -> PairAgreement | None:
        """Of two coders, in whichever order; None where they share no demonstration."""
        return next((p for p in self.pairs if {p.a, p.b} == {one, other}), None)

    @property
    def counts(self) -> dict[str, dict[str, int]]:
        """How many demonstrations each coder labelled, by coder and task."""
        found: dict[str, dict[str, int]] = {}
        for one in self.coded:
            for author in one.tracks:
                of_tasks = found.setdefault(author, {})
                of_tasks[one.task] = of_tasks.get(one.task, 0) + 1
        return found

    def to_json(self) -> dict[str, Any]:
        """The figures as plain values."""
        return {
            "coders": list(self.authors),
            "counts": self.counts,
            "fleiss_kappa": self.fleiss,
            "pairs": [pair.to_json() for pair in self.pairs],
            "repeated": [pair.to_json() for pair in self.repeated],
            "own": [one.to_json() for one in self.own],
        }


def agreement(
    coded: Sequence[Coded], same: tuple[str, str] | None = None, hidden: int = 0
) -> Generator[Progress, None, Agreement]:
    """Compare all coders.

    Parameters
    ----------
    coded : sequence of Coded
        From :func:`~forcelab.review.coded.coded_demonstrations`.
    same : tuple of str, optional
        Two names of one coder, who labelled demonstrations twice: compared with each other only,
        and the second with nobody else.
    hidden : int
        Told in the result.

    Yields
    ------
    Progress
        After every demonstration of every pair.

    Returns
    -------
    Agreement
        Of every two who share a demonstration, and of all.
    """
    names = sorted({author for one in coded for author in one.tracks})
    compared = tuple(name for name in names if same is None or name != same[1])
    pairs = []
    for a, b in combinations(compared, 2):
        if (pair := (yield from agreeing(coded, a, b))) is not None:
            pairs.append(pair)
    again = None if same is None else (yield from agreeing(coded, *same))
    return Agreement(
        authors=compared,
        coded=tuple(coded),
        pairs=tuple(pairs),
        fleiss=_fleiss(coded, compared),
        fleiss_coders=max(
            (sum(name in compared for name in one.tracks) for one in coded), default=0
        ),
        repeated=() if again is None else (again,),
        own=tuple(one for name in names if (one := consistency(coded, name)).actions),
        hidden=hidden,
    )


def _fleiss(coded: Sequence[Coded], authors: Sequence[str]) -> float | None:
    """Fleiss' kappa of these coders over all demonstrations."""
    chosen: list[list[Segments]] = [
        [one.tracks[author] for author in authors if author in one.tracks] for one in coded
    ]
    chosen = [tracks for tracks in chosen if len(tracks) >= 2]
    actions = actions_of(track for tracks in chosen for track in tracks)
    ratings, weights = [np.empty((0, len(actions)), dtype=np.int64)], [np.empty(0)]
    for tracks in chosen:
        pieces = pieces_of(tracks, actions)
        numbers = np.arange(len(actions))[:, np.newaxis]
        ratings.append(np.stack([(row == numbers).T for row in pieces.codes]).sum(axis=0))
        weights.append(pieces.seconds)
    return fleiss(np.concatenate(ratings), np.concatenate(weights))
