"""Agreement of coders: every two of them, all together, and the consistency of each.

Everything is computed from the tracks' edges, exactly; nothing is sampled, and time is weighed in
seconds. Unlabelled time is no class: kappa and the other figures are taken over the time that both
(or, for Fleiss, two or more) labelled, and beside them stands how much time only one of them
labelled.

A boundary is the start of a segment, or the end of one after which time is unlabelled: where two
segments touch, the end of the first is the start of the second and counts once.

A coder's own consistency: coders do not label everything twice, but the demonstrations of a task
repeat one choreography, so that a duration or an order of actions that stands alone is worth a
look. It need not be a mistake.

Sources: Cohen, "A coefficient of agreement for nominal scales", Educ. Psychol. Meas. 20, 1960.
Fleiss, "Measuring nominal scale agreement among many raters", Psychol. Bull. 76, 1971, in the form
for ratings that are missing: Gwet, "Handbook of inter-rater reliability", 4th ed., 2014. Spitzer
and Fleiss, "A re-analysis of the reliability of psychiatric diagnosis", Br. J. Psychiatry 125,
1974: the specific agreement. Landis and Koch, Biometrics 33, 1977: the words. Iglewicz and Hoaglin,
"How to detect and handle outliers", ASQC 1993: the robust z and its 3.5.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.jobs import Progress, job
from forcelab.labels import Interval, Segment, Segments, is_model, to_codes
from forcelab.project import Project
from forcelab.recognition.intervals import FEWEST, draw_resamples, percentile_interval
from forcelab.recognition.metrics import OVERLAPS, Overlay, f1, gather_runs, match_segments
from forcelab.review.differences import Difference, difference_kind, track_pieces
from forcelab.sample_runs import Runs
from forcelab.segment_edits import SLIVER


@dataclass(frozen=True)
class CoderTracks:
    """A demonstration with the tracks of its coders, of those who labelled anything."""

    id: str
    name: str
    task: str
    tracks: Mapping[str, Segments]  # by coder; only those who labelled anything


@dataclass(frozen=True, eq=False, slots=True)
class TrackPieces:
    """Tracks laid over each other, cut wherever one of them changes; p pieces of c tracks."""

    #: starts, ends: (p,); in seconds
    starts: NDArray[np.float64]
    ends: NDArray[np.float64]
    #: (c, p); numbers of actions, -1 where unlabelled; at least one track is labelled in each piece
    codes: NDArray[np.int64]

    @property
    def seconds(self) -> NDArray[np.float64]:
        """Length of each piece, shape (p,)."""
        return self.ends - self.starts

    @property
    def labelled_by_all(self) -> NDArray[np.bool_]:
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
    tuple of Coded
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


#: Each word with the kappa up to which it holds.
WORDS = (
    (0.0, "poor"),
    (0.20, "slight"),
    (0.40, "fair"),
    (0.60, "moderate"),
    (0.80, "substantial"),
    (1.0, "almost perfect"),
)
#: Resamples of the bootstrap.
RESAMPLES = 1000


def cohen_kappa(seconds: NDArray[np.float64]) -> float | None:
    """Cohen's kappa of the seconds (K, K) of each pair of actions by two coders.

    1 for full agreement, 0 for what chance brings; None where there is no common time, or both know
    but one action: chance alone then agrees always.
    """
    kappa = float(_kappas(seconds[None])[0])
    return None if math.isnan(kappa) else kappa


def _kappas(seconds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cohen's kappa of each of some tables (m, K, K), nan where there is none."""
    total = seconds.sum(axis=(1, 2))
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = seconds / total[:, None, None]
        expected = (shares.sum(axis=2) * shares.sum(axis=1)).sum(axis=1)
        kappas = (np.trace(shares, axis1=1, axis2=2) - expected) / (1 - expected)
    return np.where((total > 0) & (1 - expected >= 1e-12), kappas, np.nan)


def fleiss_kappa(ratings: NDArray[np.int64], weights: NDArray[np.float64]) -> float | None:
    """Fleiss' kappa of how many coders gave each action (p, K), weighted by seconds (p,).

    Pieces with fewer than two are left out. None as of :func:`cohen_kappa`; with equally many
    coders throughout it is the figure of Fleiss (1971).
    """
    coders = ratings.sum(axis=1)
    comparable = coders >= 2
    n, w = ratings[comparable].astype(np.float64), weights[comparable]
    if not w.sum() > 0:
        return None
    m, w = coders[comparable].astype(np.float64), w / w.sum()
    agreed = float(w @ ((n * (n - 1)).sum(axis=1) / (m * (m - 1))))
    expected = float((((w / m) @ n) ** 2).sum())
    return None if 1 - expected < 1e-12 else (agreed - expected) / (1 - expected)


def specific_agreement(seconds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Positive specific agreement of each action, shape (K,); nan where neither labelled it.

    ``2 n_kk / (n_k. + n_.k)``: if one of the two, drawn by lot, says the action, how probably the
    other says it too. `seconds` as of :func:`cohen_kappa`.
    """
    labelled = seconds.sum(axis=0) + seconds.sum(axis=1)
    shares = np.full(len(seconds), np.nan)
    np.divide(2 * np.diag(seconds), labelled, out=shares, where=labelled > 0)
    return shares


def kappa_interval(matrices: NDArray[np.float64]) -> tuple[float, float] | None:
    """95 % interval of Cohen's kappa by the percentile bootstrap over demonstrations (D, K, K).

    None with fewer than three: they cannot tell how much demonstrations vary.
    """
    count = len(matrices)
    if count < FEWEST:
        return None
    weights = draw_resamples(count, RESAMPLES, 0).astype(np.float64)
    return percentile_interval(_kappas(np.tensordot(weights, matrices, axes=1)))


def landis_koch(kappa: float) -> str:
    """The word of Landis and Koch for a kappa, such as ``"substantial"``."""
    return next((word for limit, word in WORDS if kappa <= limit + 1e-12), WORDS[-1][1])


#: Seconds up to which two boundaries of the same kind may be the same one.
WINDOW = 0.5

#: A boundary's kind: whether an action starts or ends, and which.
_Kind = tuple[bool, str]


@dataclass(frozen=True, eq=False)
class MatchedBoundaries:
    """Matched boundaries of two tracks; m pairs."""

    times: NDArray[np.float64]  # (m, 2); seconds, of the first and the second track
    actions: tuple[str, ...]  # length m; what starts or ends there
    starting: tuple[bool, ...]  # length m; whether it starts
    counts: tuple[int, int]  # how many boundaries each of the two has

    @property
    def offsets(self) -> NDArray[np.float64]:
        """Milliseconds by which the second track is later, shape (m,)."""
        return 1000.0 * (self.times[:, 1] - self.times[:, 0])


def boundary_times(segments: Segments) -> dict[_Kind, list[float]]:
    """The times of every kind of boundary of a track, increasing.

    Touching segments of one action are one: there is no boundary between them.
    """
    times: dict[_Kind, list[float]] = {}
    for index, segment in enumerate(segments):
        before = segments[index - 1] if index else None
        after = segments[index + 1] if index + 1 < len(segments) else None
        touched = before is not None and segment.start - before.end <= SLIVER
        if not (touched and before is not None and before.action == segment.action):
            times.setdefault((True, segment.action), []).append(segment.start)
        if after is None or after.start - segment.end > SLIVER:
            times.setdefault((False, segment.action), []).append(segment.end)
    return times


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


def segment_counts(pieces: TrackPieces, a: Segments, b: Segments) -> NDArray[np.int64]:
    """Count matched, false and missed segments, shape (overlaps, 2, 3), of two tracks.

    Each track in turn stands for the truth, by the rule of
    :func:`forcelab.recognition.metrics.match_segments`. Only time that both labelled counts: a
    segment is weighed without the rest of it, and one that the other coder left unlabelled
    altogether is no segment. Durations are rounded to microseconds.
    """
    common = _cut_to_both(pieces, a, b)
    overlays = _pair_overlay(common, 0, 1), _pair_overlay(common, 1, 0)
    counts = []
    for overlap in OVERLAPS:
        for over in overlays:
            true = len(match_segments(over, overlap))
            counts.append((true, len(over.predicted) - true, len(over.human) - true))
    return np.array(counts, dtype=np.int64).reshape(len(OVERLAPS), 2, 3)


def segment_f1(counts: NDArray[np.int64]) -> dict[int, float | None]:
    """F1 of segments, by the least overlap in percent; None where there is no segment.

    The mean of both ways, which differ only where segments compete for one another. `counts` as of
    :func:`segment_counts`, summed over demonstrations.
    """
    scores: dict[int, float | None] = {}
    for overlap, directions in zip(OVERLAPS, counts.tolist(), strict=True):
        values = [value for direction in directions if (value := f1(*direction)) is not None]
        scores[overlap] = sum(values) / len(values) if values else None
    return scores


class _LabelledByBoth(NamedTuple):
    """Pieces that both labelled, on a clock that runs only there."""

    numbers: NDArray[np.int64]  # of each track's segments, shape (2, p)
    codes: NDArray[np.int64]  # of their actions, shape (2, p)
    ticks: NDArray[np.int64]  # where each piece starts, and the end of the last, shape (p + 1,)


def _cut_to_both(pieces: TrackPieces, a: Segments, b: Segments) -> _LabelledByBoth:
    """Cut out the time that only one labelled.

    On the remaining clock a segment stays one, even where the other coder left a gap within it.
    """
    ticks = np.rint(pieces.seconds * TICKS).astype(np.int64)
    overlapping = pieces.labelled_by_all & (ticks > 0)
    middles = (pieces.starts + pieces.seconds / 2)[overlapping]
    numbers = [
        np.searchsorted(_segment_starts(track), middles, side="right") - 1 for track in (a, b)
    ]
    clock = np.concatenate([[0], np.cumsum(ticks[overlapping])])
    return _LabelledByBoth(np.stack(numbers), pieces.codes[:, overlapping], clock)


def _segment_starts(track: Segments) -> list[float]:
    """Where segments start; touching ones of one action are one."""
    return [
        segment.start
        for before, segment in zip((None, *track), track, strict=False)
        if before is None or before.action != segment.action or segment.start - before.end > SLIVER
    ]


def _pair_overlay(common: _LabelledByBoth, human: int, predicted: int) -> Overlay:
    """The overlay of the two tracks, in ticks instead of samples."""
    numbers, codes = common.numbers, common.codes
    both = numbers[human] * (int(numbers[predicted].max(initial=0)) + 1) + numbers[predicted]
    pieces, of_human, of_predicted = (
        gather_runs(row, common.ticks, common.ticks / TICKS)
        for row in (both, numbers[human], numbers[predicted])
    )

    def code(track: int, runs: Runs) -> NDArray[np.int64]:
        return codes[track][np.searchsorted(common.ticks, runs.firsts)]

    return Overlay(
        human=replace(of_human, codes=code(human, of_human)),
        predicted=replace(of_predicted, codes=code(predicted, of_predicted)),
        pieces=pieces,
        human_codes=code(human, pieces),
        predicted_codes=code(predicted, pieces),
        actions=int(codes.max(initial=-1)) + 1,
    )


def coder_differences(demonstration: str, a: Segments, b: Segments) -> tuple[Difference, ...]:
    """Every stretch in which two coders' tracks over a demonstration differ, in order of time.

    Only a boundary differs where before and after it both say the same, and in it one says what
    both said before, the other what both say after.
    """
    pieces = track_pieces(demonstration, a, b)
    both = [(piece.human, piece.predicted) for piece in pieces]
    differences = []
    for piece, before, after in zip(
        pieces, [(None, None), *both], [*both[1:], (None, None)], strict=False
    ):
        if piece.differs:
            agreed = before[0] == before[1] and after[0] == after[1]
            edge = agreed and {before[0], after[0]} == {piece.human, piece.predicted}
            kind = "boundary" if edge else difference_kind(piece.human, piece.predicted)
            where = demonstration, piece.start, piece.end
            differences.append(Difference(*where, piece.human, piece.predicted, kind=kind))
    return tuple(differences)


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
    seconds: NDArray[np.float64]
    #: (m,); milliseconds by which `b` puts a boundary later than `a` does
    offsets: NDArray[np.float64]
    boundaries: tuple[int, int]  # how many boundaries `a` and `b` have, matched or not
    #: F1 of segments by their least overlap in percent; see :func:`segment_counts`
    f1: Mapping[int, float | None]
    apart: tuple[Interval, ...]  # where both labelled and say different actions, the longest first
    alone: tuple[Interval, ...]  # where only one of them labelled, the longest first
    shifted: tuple[Interval, ...]  # between the two times of a matched boundary, the farthest first

    @property
    def both(self) -> NDArray[np.float64]:
        """Seconds by action of `a` and of `b` that both labelled, shape (K, K)."""
        return np.asarray(self.seconds.sum(axis=0)[:-1, :-1])

    @property
    def kappa(self) -> float | None:
        """Cohen's kappa; see :func:`forcelab.review.agreement.cohen_kappa`."""
        return cohen_kappa(self.both)

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % interval of kappa; see :func:`forcelab.review.agreement.kappa_interval`."""
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


def _time_matrix(pieces: TrackPieces, k: int) -> NDArray[np.float64]:
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
    """By duration; equal ones by demonstration and time."""
    return tuple(sorted(places, key=lambda p: (-round(p.duration, 9), p.demonstration, p.start)))


#: The robust z beyond which a duration stands out, and how many segments it takes to say so.
STANDS_OUT, FEWEST_SEGMENTS = 3.5, 5
#: A transition of one demonstration is rare if so many have been labelled.
FEWEST_DEMONSTRATIONS = 3


@dataclass(frozen=True)
class Durations:
    """Durations of the segments of an action of a task."""

    task: str
    action: str
    count: int  # segments
    mean: float  # seconds
    variation: float | None  # standard deviation over mean; None with fewer than two segments


@dataclass(frozen=True)
class Consistency:
    """The variation of one coder's labels."""

    author: str
    actions: tuple[Durations, ...]  # by task, in the order of their first occurrence
    #: Segments whose duration stands out among those of their action, the oddest first
    odd: tuple[Interval, ...]
    #: Two actions in an order that no other demonstration of the task has; ``human`` is the first
    #: of them, ``predicted`` the second
    rare: tuple[Interval, ...]

    def to_json(self) -> dict[str, Any]:
        """The figures as plain values."""
        return {
            "coder": self.author,
            "odd_durations": len(self.odd),
            "rare_transitions": len(self.rare),
            "durations": [
                {
                    "task": row.task,
                    "action": row.action,
                    "segments": row.count,
                    "mean_s": row.mean,
                    "variation": row.variation,
                }
                for row in self.actions
            ],
        }


def consistency(coded: Sequence[CoderTracks], author: str) -> Consistency:
    """The variation of a coder's labels over the demonstrations of each task."""
    tasks = dict.fromkeys(item.task for item in coded if author in item.tracks)
    durations: list[Durations] = []
    odd: list[tuple[float, Interval]] = []
    rare: list[Interval] = []
    for task in tasks:
        coded_by_author = (item for item in coded if item.task == task and author in item.tracks)
        tracks = {item.id: item.tracks[author] for item in coded_by_author}
        by_action: dict[str, list[tuple[str, Segment]]] = {}
        for id_, segments in tracks.items():
            for segment in segments:
                by_action.setdefault(segment.action, []).append((id_, segment))
        for action, coded_segments in by_action.items():
            lengths = np.array([segment.duration for _, segment in coded_segments])
            mean = float(lengths.mean())
            variation = float(lengths.std(ddof=1)) / mean if len(lengths) > 1 else None
            durations.append(Durations(task, action, len(lengths), mean, variation))
            odd += _odd_durations(coded_segments)
        rare += _rare_transitions(tracks)
    odd.sort(key=lambda item: -item[0])
    return Consistency(author, tuple(durations), tuple(place for _, place in odd), tuple(rare))


def _odd_durations(segments: Sequence[tuple[str, Segment]]) -> list[tuple[float, Interval]]:
    """Segments of one action whose duration stands out, with their robust z."""
    lengths = np.array([segment.duration for _, segment in segments])
    away = np.abs(lengths - np.median(lengths))
    deviation = float(np.median(away))
    if len(segments) < FEWEST_SEGMENTS or deviation <= 0:
        return []
    scores = 0.6745 * away / deviation
    return [
        (float(z), Interval(id_, segment.start, segment.end, segment.action))
        for z, (id_, segment) in zip(scores, segments, strict=True)
        if z > STANDS_OUT
    ]


def _rare_transitions(tracks: dict[str, tuple[Segment, ...]]) -> list[Interval]:
    """Orders of two actions that only one of the tracks has."""
    if len(tracks) < FEWEST_DEMONSTRATIONS:
        return []
    where: dict[tuple[str, str], set[str]] = {}
    for id_, segments in tracks.items():
        for left, right in pairwise(segments):
            where.setdefault((left.action, right.action), set()).add(id_)
    return [
        Interval(id_, left.start, right.end, left.action, right.action)
        for id_, segments in tracks.items()
        for left, right in pairwise(segments)
        if len(where[left.action, right.action]) == 1
    ]


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
                of_tasks = totals.setdefault(author, {})
                of_tasks[item.task] = of_tasks.get(item.task, 0) + 1
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
    coded : sequence of Coded
        From :func:`~forcelab.review.agreement.coded_demonstrations`.
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
