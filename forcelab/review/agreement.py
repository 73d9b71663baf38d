"""Agreement of coders: every two of them, and all together.

Everything is computed from the tracks' edges, exactly; nothing is sampled, and time is weighed in
seconds. Unlabelled time is no class: kappa and the other figures are taken over the time that both
(or, for Fleiss, two or more) labelled, and beside them stands how much time only one of them
labelled.

A boundary is the start of a segment, or the end of one after which time is unlabelled: where two
segments touch, the end of the first is the start of the second and counts once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from forcelab.arrays import Codes, Flags, Real, Whole
from forcelab.jobs import Progress, job
from forcelab.labels import Interval, Segment, Segments, to_codes
from forcelab.recognition.metrics import (
    OVERLAPS,
    Overlay,
    count_matches,
    f1,
    gather_runs,
    match_segments,
)
from forcelab.review.coder_tracks import CoderTracks
from forcelab.review.consistency import Consistency, consistency
from forcelab.review.differences import track_pieces
from forcelab.review.kappa import (
    cohen_kappa,
    fleiss_kappa,
    kappa_interval,
    landis_koch,
    specific_agreement,
)
from forcelab.sample_runs import Runs
from forcelab.segment_edits import SLIVER


@dataclass(frozen=True, eq=False, slots=True)
class TrackPieces:
    """Tracks laid over each other, cut wherever one of them changes; p pieces of c tracks."""

    #: starts, ends: (p,); in seconds
    starts: Real
    ends: Real
    #: (c, p); numbers of actions, -1 where unlabelled; at least one track is labelled in each piece
    codes: Codes

    @property
    def seconds(self) -> Real:
        """Length of each piece, shape (p,)."""
        return self.ends - self.starts

    @property
    def labelled_by_all(self) -> Flags:
        """Mask of the pieces that every track labels, shape (p,)."""
        return np.asarray((self.codes >= 0).all(axis=0))


def overlay_tracks(tracks: Sequence[Segments], actions: Sequence[str]) -> TrackPieces:
    """Lay tracks over each other, with the indices of `actions` as codes; exact.

    Pieces no longer than :data:`~forcelab.segment_edits.SLIVER` are float dust and left out.
    """
    edges = np.unique([t for track in tracks for s in track for t in (s.start, s.end)])
    starts, ends = edges[:-1], edges[1:]
    long = ends - starts > SLIVER
    starts, ends = starts[long], ends[long]
    middles = starts + (ends - starts) / 2
    codes = np.stack([to_codes(track, middles, actions) for track in tracks])
    is_labelled = (codes >= 0).any(axis=0)
    return TrackPieces(starts[is_labelled], ends[is_labelled], codes[:, is_labelled])


def actions_of(tracks: Iterable[Segments]) -> tuple[str, ...]:
    """The actions in the order of their first occurrence."""
    return tuple(dict.fromkeys(s.action for track in tracks for s in track))


#: Seconds up to which two boundaries of the same kind may be the same one.
WINDOW = 0.5

#: A boundary's kind: whether an action starts or ends, and which.
_Kind = tuple[bool, str]


@dataclass(frozen=True, eq=False)
class MatchedBoundaries:
    """Matched boundaries of two tracks; m pairs."""

    times: Real  # (m, 2); seconds, of the first and the second track
    actions: tuple[str, ...]  # length m; what starts or ends there
    starting: tuple[bool, ...]  # length m; whether it starts
    counts: tuple[int, int]  # how many boundaries each of the two has

    @property
    def offsets(self) -> Real:
        """Milliseconds by which the second track is later, shape (m,)."""
        return 1000.0 * (self.times[:, 1] - self.times[:, 0])


def boundary_times(segments: Segments) -> dict[_Kind, list[float]]:
    """The times of every kind of boundary of a track, increasing.

    Touching segments of one action are one: there is no boundary between them.
    """
    times: dict[_Kind, list[float]] = {}
    neighbours = zip((None, *segments), segments, (*segments[1:], None), strict=False)
    for before, segment, after in neighbours:
        if _begins(before, segment):
            times.setdefault((True, segment.action), []).append(segment.start)
        if after is None or after.start - segment.end > SLIVER:
            times.setdefault((False, segment.action), []).append(segment.end)
    return times


def _begins(before: Segment | None, segment: Segment) -> bool:
    """Whether an action begins with a segment; touching ones of one action are one."""
    goes_on = before is not None and before.action == segment.action
    return not goes_on or before is None or segment.start - before.end > SLIVER


def match_boundaries(a: Segments, b: Segments, window: float = WINDOW) -> MatchedBoundaries:
    """Match boundaries of the same kind, the nearest first, at most `window` seconds apart."""
    times_a, times_b = boundary_times(a), boundary_times(b)
    rows: list[tuple[float, float, _Kind]] = []
    for kind in times_a.keys() & times_b.keys():
        rows += [(s, t, kind) for s, t in _nearest(times_a[kind], times_b[kind], window)]
    rows.sort()
    return MatchedBoundaries(
        times=np.array([row[:2] for row in rows], dtype=np.float64).reshape(-1, 2),
        actions=tuple(action for _, _, (_, action) in rows),
        starting=tuple(starting for _, _, (starting, _) in rows),
        counts=(sum(map(len, times_a.values())), sum(map(len, times_b.values()))),
    )


def _nearest(
    times_a: list[float], times_b: list[float], window: float
) -> list[tuple[float, float]]:
    """Pairs of times, the nearest first; which track is the first makes no difference."""
    all_theirs = np.array(times_b)
    near = []
    for i, time in enumerate(times_a):
        low, high = np.searchsorted(all_theirs, [time - window, time + window])
        # Rounded, so that the last bits of two equal distances do not decide.
        near += [
            (round(abs(times_b[j] - time), 9), time + times_b[j], i, j)
            for j in range(max(int(low) - 1, 0), min(int(high) + 1, len(times_b)))
        ]
    used_ours: set[int] = set()
    used_theirs: set[int] = set()
    pairs = []
    for distance, _, i, j in sorted(near):
        if distance <= window and i not in used_ours and j not in used_theirs:
            used_ours.add(i)
            used_theirs.add(j)
            pairs.append((times_a[i], times_b[j]))
    return pairs


#: Ticks a second: overlaps are compared in whole numbers, so that one half is one half.
TICKS = 1e6


def segment_counts(pieces: TrackPieces, a: Segments, b: Segments) -> Whole:
    """Count matched, false and missed segments, shape (overlaps, 2, 3), of two tracks.

    Each track in turn stands for the truth, by the rule of
    :func:`forcelab.recognition.metrics.match_segments`. Only time that both labelled counts: a
    segment is weighed without the rest of it, and one that the other coder left unlabelled
    altogether is no segment. Durations are rounded to microseconds.
    """
    common = _cut_to_both(pieces, a, b)
    overlays = _pair_overlay(common, 0, 1), _pair_overlay(common, 1, 0)
    return np.stack(
        [count_matches(over, [match_segments(over, k) for k in OVERLAPS]) for over in overlays], 1
    )


def segment_f1(counts: Whole) -> dict[int, float | None]:
    """F1 of segments, by the least overlap in percent; None where there is no segment.

    The mean of both ways, which differ only where segments compete for one another. `counts` as of
    :func:`segment_counts`, summed over demonstrations.
    """
    scores = f1(counts).mean(axis=1).tolist()
    return {k: None if np.isnan(f) else f for k, f in zip(OVERLAPS, scores, strict=True)}


class _LabelledByBoth(NamedTuple):
    """Pieces that both labelled, on a clock that runs only there."""

    numbers: Whole  # of each track's segments, shape (2, p)
    codes: Codes  # of their actions, shape (2, p)
    ticks: Whole  # where each piece starts, and the end of the last, shape (p + 1,)


def _cut_to_both(pieces: TrackPieces, a: Segments, b: Segments) -> _LabelledByBoth:
    """Cut out the time that only one labelled.

    On the remaining clock a segment stays one, even where the other coder left a gap within it.
    """
    ticks = np.rint(pieces.seconds * TICKS).astype(np.int64)
    overlapping = pieces.labelled_by_all & (ticks > 0)
    middles = (pieces.starts + pieces.seconds / 2)[overlapping]
    starts = (
        [s.start for before, s in zip((None, *track), track, strict=False) if _begins(before, s)]
        for track in (a, b)
    )
    numbers = [np.searchsorted(own, middles, side="right") - 1 for own in starts]
    clock = np.concatenate([[0], np.cumsum(ticks[overlapping])])
    return _LabelledByBoth(np.stack(numbers), pieces.codes[:, overlapping], clock)


def _pair_overlay(common: _LabelledByBoth, human: int, predicted: int) -> Overlay:
    """The overlay of the two tracks, in ticks instead of samples."""
    numbers, codes = common.numbers, common.codes
    both = numbers[human] * (int(numbers[predicted].max(initial=0)) + 1) + numbers[predicted]
    pieces, of_human, of_predicted = (
        gather_runs(row, common.ticks, common.ticks / TICKS)
        for row in (both, numbers[human], numbers[predicted])
    )

    def code(track: int, runs: Runs) -> Codes:
        return codes[track][np.searchsorted(common.ticks, runs.firsts)]

    return Overlay(
        human=replace(of_human, codes=code(human, of_human)),
        predicted=replace(of_predicted, codes=code(predicted, of_predicted)),
        pieces=pieces,
        human_codes=code(human, pieces),
        predicted_codes=code(predicted, pieces),
        actions=int(codes.max(initial=-1)) + 1,
    )


#: Milliseconds within which boundaries are counted.
WITHIN = (50, 100, 200)


@dataclass(frozen=True, eq=False)
class PairAgreement:
    """Agreement of two coders over the D demonstrations that both labelled; K actions.

    In the intervals ``human`` is the label of `a` and ``predicted`` that of `b`.
    """

    a: str
    b: str
    actions: tuple[str, ...]  # in the order of their first occurrence; K of them
    demonstrations: tuple[str, ...]  # ids; D of them
    #: (D, K + 1, K + 1); how long `a` said the row's action and `b` the column's; the last is
    #: unlabelled
    seconds: Real
    #: (m,); milliseconds by which `b` puts a boundary later than `a` does
    offsets: Real
    boundaries: tuple[int, int]  # how many boundaries `a` and `b` have, matched or not
    #: F1 of segments by their least overlap in percent; see :func:`segment_counts`
    f1: Mapping[int, float | None]
    apart: tuple[Interval, ...]  # where both labelled and say different actions, the longest first
    alone: tuple[Interval, ...]  # where only one of them labelled, the longest first
    shifted: tuple[Interval, ...]  # between the two times of a matched boundary, the farthest first

    @property
    def both(self) -> Real:
        """Seconds by action of `a` and of `b` that both labelled, shape (K, K)."""
        return np.asarray(self.seconds.sum(axis=0)[:-1, :-1])

    @property
    def kappa(self) -> float | None:
        """Cohen's kappa; see :func:`forcelab.review.kappa.cohen_kappa`."""
        return cohen_kappa(self.both)

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % interval of kappa; see :func:`forcelab.review.kappa.kappa_interval`."""
        return kappa_interval(self.seconds[:, :-1, :-1])

    @property
    def agreed(self) -> float | None:
        """Share of the time that both labelled in which they agree."""
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
        """Positive specific agreement; None for actions that neither has where both labelled."""
        shares = specific_agreement(self.both).tolist()
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


def compare_pair(
    coded: Sequence[CoderTracks], a: str, b: str
) -> Generator[Progress, None, PairAgreement | None]:
    """Compare two coders over the demonstrations that both labelled; None where there is none.

    Exchanging the two transposes the matrices and turns the offsets' signs; kappa, shares and F1
    stay. Progress after each demonstration.
    """
    shared = [item for item in coded if a in item.tracks and b in item.tracks]
    if not shared:
        return None
    actions = actions_of(item.tracks[name] for item in shared for name in (a, b))
    seconds, offsets = [], []
    boundaries, segments = np.zeros(2, dtype=np.int64), []
    apart: list[Interval] = []
    alone: list[Interval] = []
    shifted: list[Interval] = []
    for done, item in enumerate(shared):
        yield Progress(done, len(shared), f"{a} / {b}")
        first, second = item.tracks[a], item.tracks[b]
        pieces, edges = overlay_tracks((first, second), actions), match_boundaries(first, second)
        seconds.append(_time_matrix(pieces, len(actions)))
        offsets.append(edges.offsets)
        boundaries += edges.counts
        segments.append(segment_counts(pieces, first, second))
        for piece in track_pieces(item.id, first, second):
            if piece.differs:
                (alone if None in (piece.human, piece.predicted) else apart).append(piece)
        shifted += _shifted_intervals(item.id, edges)
    return PairAgreement(
        a=a,
        b=b,
        actions=actions,
        demonstrations=tuple(item.id for item in shared),
        seconds=np.stack(seconds),
        offsets=np.concatenate(offsets),
        boundaries=(int(boundaries[0]), int(boundaries[1])),
        f1=segment_f1(np.sum(segments, axis=0)),
        apart=_longest_first(apart),
        alone=_longest_first(alone),
        shifted=_longest_first(shifted),
    )


def _time_matrix(pieces: TrackPieces, k: int) -> Real:
    """Seconds of each pair of codes of two tracks, shape (k + 1, k + 1); the last is unlabelled."""
    # Code -1 is the last row and the last column as it is.
    total = np.zeros((k + 1, k + 1))
    np.add.at(total, (pieces.codes[0], pieces.codes[1]), pieces.seconds)
    return total


def _shifted_intervals(id_: str, boundaries: MatchedBoundaries) -> list[Interval]:
    """The stretches between matched boundaries that are not at the same time."""
    places = []
    for (s, t), action, starting in zip(
        boundaries.times.tolist(), boundaries.actions, boundaries.starting, strict=True
    ):
        # Who of the two says the action between its own boundary and the other's.
        first_says = (s < t) == starting
        if abs(s - t) > 1e-6:
            actions = (action, None) if first_says else (None, action)
            places.append(Interval(id_, min(s, t), max(s, t), *actions))
    return places


def _longest_first(places: Iterable[Interval]) -> tuple[Interval, ...]:
    """Sorted by duration, the longest first; equal ones by demonstration and time."""
    return tuple(sorted(places, key=lambda p: (-round(p.duration, 9), p.demonstration, p.start)))


@dataclass(frozen=True)
class Agreement:
    """Agreement of all coders."""

    authors: tuple[str, ...]  # the coders that are compared, a coder with two names once
    coded: tuple[CoderTracks, ...]  # the compared demonstrations
    pairs: tuple[PairAgreement, ...]  # of every two who share a demonstration
    fleiss: float | None  # Fleiss' kappa of all, over the time that two or more labelled
    fleiss_coders: int = 0  # how many coders the most coded demonstration has
    #: Of two names that are one coder: how consistent the coder is
    repeated: tuple[PairAgreement, ...] = ()
    #: How consistent each coder is from one demonstration of a task to the next
    own: tuple[Consistency, ...] = ()
    hidden: int = 0  # demonstrations left out because they are blind for the viewer

    def pair(self, first: str, second: str) -> PairAgreement | None:
        """The agreement of two coders, in either order; None where they share no demonstration."""
        return next((p for p in self.pairs if {p.a, p.b} == {first, second}), None)

    @property
    def counts(self) -> dict[str, dict[str, int]]:
        """Number of demonstrations that each coder labelled, by coder and task."""
        totals: dict[str, dict[str, int]] = {}
        for item in self.coded:
            for author in item.tracks:
                totals.setdefault(author, Counter())[item.task] += 1
        return totals

    def to_json(self) -> dict[str, Any]:
        """The figures as plain values."""
        return {
            "coders": list(self.authors),
            "counts": self.counts,
            "fleiss_kappa": self.fleiss,
            "pairs": [pair.to_json() for pair in self.pairs],
            "repeated": [pair.to_json() for pair in self.repeated],
            "own": [row.to_json() for row in self.own],
        }


@job
def agreement_job(
    coded: Sequence[CoderTracks], same: tuple[str, str] | None = None, hidden: int = 0
) -> Generator[Progress, None, Agreement]:
    """Compare all coders.

    Parameters
    ----------
    coded : sequence of CoderTracks
        From :func:`~forcelab.review.coder_tracks.coded_demonstrations`.
    same : tuple of str, optional
        Two names of one coder, who labelled demonstrations twice: compared with each other only,
        and the second with no other.
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

    Examples
    --------
    >>> coded, _ = forcelab.coded_demonstrations(project, "foam")
    >>> (pair,) = forcelab.finish(forcelab.agreement_job(coded)).pairs
    >>> pair.kappa
    1.0
    """
    names = sorted({author for item in coded for author in item.tracks})
    compared = tuple(name for name in names if same is None or name != same[1])
    pairs = []
    for a, b in combinations(compared, 2):
        if (pair := (yield from compare_pair(coded, a, b))) is not None:
            pairs.append(pair)
    repeated = None if same is None else (yield from compare_pair(coded, *same))
    return Agreement(
        authors=compared,
        coded=tuple(coded),
        pairs=tuple(pairs),
        fleiss=_fleiss_of_all(coded, compared),
        fleiss_coders=max(
            (sum(name in compared for name in item.tracks) for item in coded), default=0
        ),
        repeated=() if repeated is None else (repeated,),
        own=tuple(item for name in names if (item := consistency(coded, name)).actions),
        hidden=hidden,
    )


def _fleiss_of_all(coded: Sequence[CoderTracks], authors: Sequence[str]) -> float | None:
    """Fleiss' kappa of these coders over all demonstrations."""
    chosen: list[list[Segments]] = [
        [item.tracks[author] for author in authors if author in item.tracks] for item in coded
    ]
    chosen = [tracks for tracks in chosen if len(tracks) >= 2]
    actions = actions_of(track for tracks in chosen for track in tracks)
    ratings, weights = [np.empty((0, len(actions)), dtype=np.int64)], [np.empty(0)]
    for tracks in chosen:
        pieces = overlay_tracks(tracks, actions)
        numbers = np.arange(len(actions))[:, np.newaxis]
        ratings.append(np.stack([(row == numbers).T for row in pieces.codes]).sum(axis=0))
        weights.append(pieces.seconds)
    return fleiss_kappa(np.concatenate(ratings), np.concatenate(weights))
