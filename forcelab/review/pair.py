"""How far two coders agree, and every place where they do not.

Everything is computed from the tracks' edges, exactly; nothing is sampled. Unlabelled time is no
class: figures are taken over the time that both coders labelled, and beside them stands how much
time only one of them labelled.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.review.boundaries import Boundaries, match_boundaries
from forcelab.review.coded import Coded, Pieces, actions_of, pieces_of
from forcelab.review.kappa import cohen, landis_koch, specific, spread
from forcelab.review.overlap import segment_counts, segment_f1
from forcelab.review.places import Place

__all__ = ["WITHIN", "PairAgreement", "agreeing"]

#: Milliseconds within which boundaries are counted.
WITHIN = (50, 100, 200)


@dataclass(frozen=True, eq=False)
class PairAgreement:
    """How far two coders agree over the demonstrations that both labelled.

    Parameters
    ----------
    a, b : str
        The coders. In the places, ``human`` is what `a` says and ``predicted`` what `b` says.
    actions : tuple of str
        In the order of their first occurrence; K of them.
    demonstrations : tuple of str
        Ids; D of them.
    seconds : ndarray of float64, shape (D, K + 1, K + 1)
        How long `a` said the row's action and `b` the column's; the last is unlabelled.
    offsets : ndarray of float64, shape (m,)
        Milliseconds by which `b` puts a boundary later than `a` does.
    boundaries : tuple of int
        How many boundaries `a` and `b` have, matched or not.
    f1 : dict of int to float or None
        F1 of segments by their least overlap in percent; see :func:`segment_counts`.
    apart : tuple of Place
        Where both labelled and say different actions, the longest first.
    alone : tuple of Place
        Where only one of them labelled, the longest first.
    shifted : tuple of Place
        Between the two times of a matched boundary, the farthest first.
    """

    a: str
    b: str
    actions: tuple[str, ...]
    demonstrations: tuple[str, ...]
    seconds: NDArray[np.float64]
    offsets: NDArray[np.float64]
    boundaries: tuple[int, int]
    f1: Mapping[int, float | None]
    apart: tuple[Place, ...]
    alone: tuple[Place, ...]
    shifted: tuple[Place, ...]

    @property
    def both(self) -> NDArray[np.float64]:
        """Seconds by action of `a` and of `b` that both labelled, shape (K, K)."""
        return np.asarray(self.seconds.sum(axis=0)[:-1, :-1])

    @property
    def kappa(self) -> float | None:
        """Cohen's kappa; see :func:`forcelab.review.kappa.cohen`."""
        return cohen(self.both)

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % interval of kappa; see :func:`forcelab.review.kappa.spread`."""
        return spread(self.seconds[:, :-1, :-1])

    @property
    def agreed(self) -> float | None:
        """Share of the time that both labelled in which they say the same."""
        total = float(self.both.sum())
        return float(np.trace(self.both)) / total if total > 0 else None

    @property
    def only(self) -> tuple[float, float]:
        """Seconds that only `a`, and only `b` labelled."""
        total = self.seconds.sum(axis=0)
        return float(total[:-1, -1].sum()), float(total[-1, :-1].sum())

    @property
    def only_share(self) -> float:
        """Share of the time that at least one labelled which only one labelled."""
        alone, total = sum(self.only), float(self.seconds.sum())
        return alone / total if total > 0 else 0.0

    @property
    def by_action(self) -> dict[str, float | None]:
        """Positive specific agreement; None for what neither says where both labelled."""
        shares = specific(self.both).tolist()
        return {
            action: None if np.isnan(share) else share
            for action, share in zip(self.actions, shares, strict=True)
        }

    @property
    def within(self) -> dict[int, float]:
        """Share of the matched boundaries at most so many ms apart; empty without any."""
        if not len(self.offsets):
            return {}
        # A nanosecond more: 50 ms are 50 ms, whatever the last bits of the times say.
        return {ms: float((np.abs(self.offsets) <= ms + 1e-6).mean()) for ms in WITHIN}

    @property
    def quartiles(self) -> tuple[float, float, float] | None:
        """Lower quartile, median and upper quartile of the offsets, in ms."""
        if not len(self.offsets):
            return None
        low, middle, high = np.percentile(self.offsets, [25, 50, 75])
        return float(low), float(middle), float(high)

    def to_json(self) -> dict[str, Any]:
        """The figures as plain values; places are left out."""
        kappa, quartiles = self.kappa, self.quartiles
        return {
            "coders": [self.a, self.b],
            "demonstrations": len(self.demonstrations),
            "seconds_both": float(self.both.sum()),
            "seconds_only": list(self.only),
            "only_share": self.only_share,
            "kappa": kappa,
            "kappa_interval": self.interval,
            "kappa_word": None if kappa is None else landis_koch(kappa),
            "agreed": self.agreed,
            "by_action": self.by_action,
            "boundaries": {
                "matched": len(self.offsets),
                "of": list(self.boundaries),
                "median_ms": None if quartiles is None else quartiles[1],
                "quartiles_ms": None if quartiles is None else [quartiles[0], quartiles[2]],
                "within_ms": {str(ms): share for ms, share in self.within.items()},
            },
            "segment_f1": {str(overlap): value for overlap, value in self.f1.items()},
        }


def agreeing(
    coded: Sequence[Coded], a: str, b: str
) -> Generator[Progress, None, PairAgreement | None]:
    """Compare two coders over the demonstrations that both labelled.

    None where there is no such demonstration. Exchanging the two transposes the matrices and turns
    the offsets' signs; kappa, shares and F1 stay.

    Yields
    ------
    Progress
        After each demonstration.
    """
    shared = [one for one in coded if a in one.tracks and b in one.tracks]
    if not shared:
        return None
    actions = actions_of(one.tracks[name] for one in shared for name in (a, b))
    seconds, offsets = [], []
    boundaries, segments = np.zeros(2, dtype=np.int64), []
    apart: list[Place] = []
    alone: list[Place] = []
    shifted: list[Place] = []
    for done, one in enumerate(shared):
        yield Progress(done, len(shared), f"{a} / {b}")
        first, second = one.tracks[a], one.tracks[b]
        pieces, edges = pieces_of((first, second), actions), match_boundaries(first, second)
        both, differ = pieces.labelled_by_all, pieces.codes[0] != pieces.codes[1]
        seconds.append(_seconds(pieces, len(actions)))
        offsets.append(edges.offsets)
        boundaries += edges.counts
        segments.append(segment_counts(pieces, first, second))
        apart += _differing(one.id, pieces.joined(both & differ), actions)
        alone += _differing(one.id, pieces.joined(~both), actions)
        shifted += _shifted(one.id, edges)
    return PairAgreement(
        a=a,
        b=b,
        actions=actions,
        demonstrations=tuple(one.id for one in shared),
        seconds=np.stack(seconds),
        offsets=np.concatenate(offsets),
        boundaries=(int(boundaries[0]), int(boundaries[1])),
        f1=segment_f1(np.sum(segments, axis=0)),
        apart=_longest_first(apart),
        alone=_longest_first(alone),
        shifted=_longest_first(shifted),
    )


def _differing(id_: str, pieces: Pieces, actions: Sequence[str]) -> list[Place]:
    """Each of the pieces of two tracks as a place; ``human`` is the first track's action."""
    names = (*actions, None)  # the last is found with -1
    rows = zip(pieces.starts.tolist(), pieces.ends.tolist(), *pieces.codes.tolist(), strict=True)
    return [Place(id_, start, end, names[a], names[b]) for start, end, a, b in rows]


def _seconds(pieces: Pieces, k: int) -> NDArray[np.float64]:
    """How long two tracks say what, shape (k + 1, k + 1); the last is unlabelled."""
    # Code -1 is the last row and the last column as it is.
    total = np.zeros((k + 1, k + 1))
    np.add.at(total, (pieces.codes[0], pieces.codes[1]), pieces.seconds)
    return total


def _shifted(id_: str, found: Boundaries) -> list[Place]:
    """The stretches between matched boundaries that are not at the same time."""
    places = []
    for (s, t), action, starting in zip(
        found.times.tolist(), found.actions, found.starting, strict=True
    ):
        # Who of the two says the action between its own boundary and the other's.
        first_says = (s < t) == starting
        if abs(s - t) > 1e-6:
            seen = (action, None) if first_says else (None, action)
            places.append(Place(id_, min(s, t), max(s, t), *seen))
    return places


def _longest_first(places: Iterable[Place]) -> tuple[Place, ...]:
    """By duration; equal ones by demonstration and time."""
    return tuple(sorted(places, key=lambda p: (-round(p.duration, 9), p.demonstration, p.start)))
