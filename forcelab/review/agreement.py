"""How far coders agree: every two of them, all together, and each alone.

Cohen's and Fleiss' kappa over time: agreement beyond what chance alone would bring. Time is weighed
in seconds, not counted in samples. Unlabelled time is no class: kappa is taken over the time that
both (or, for Fleiss, two or more) labelled.

Sources
-------
Cohen, "A coefficient of agreement for nominal scales", Educ. Psychol. Meas. 20, 1960. Fleiss,
"Measuring nominal scale agreement among many raters", Psychol. Bull. 76, 1971, in the form for
ratings that are missing: Gwet, "Handbook of inter-rater reliability", 4th ed., 2014. Spitzer and
Fleiss, "A re-analysis of the reliability of psychiatric diagnosis", Br. J. Psychiatry 125, 1974:
the specific agreement. Landis and Koch, Biometrics 33, 1977: the words.

Where two coders put the same boundary, and how far apart. A boundary is the start of a segment, or
the end of one after which time is unlabelled: where two segments touch, the end of the first is the
start of the second and counts once.

How far two coders agree, and every place where they do not. Everything is computed from the tracks'
edges, exactly; nothing is sampled. Unlabelled time is no class: figures are taken over the time
that both coders labelled, and beside them stands how much time only one of them labelled.

A coder's own consistency, from one demonstration of a task to the next. Nobody labels everything
twice. But the demonstrations of a task repeat one choreography, so that a duration or an order of
actions that stands alone is worth a look. It need not be a mistake.

Source
------
Iglewicz and Hoaglin, "How to detect and handle outliers", ASQC 1993: the robust z and its 3.5.
"""

from __future__ import annotations

from collections.abc import Collection, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.labels import Segment, Segments, is_model, to_codes
from forcelab.project import Project
from forcelab.recognition.intervals import FEWEST, LEVEL, draws
from forcelab.recognition.metrics import OVERLAPS, Overlay, f1, match
from forcelab.review.differences import Interval
from forcelab.runs import Runs
from forcelab.segment_edits import SLIVER


@dataclass(frozen=True)
class CoderTracks:
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
) -> tuple[tuple[CoderTracks, ...], int]:
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
    known = project.coding.coders()
    if unknown := [name for name in authors if name not in known]:
        there = ", ".join(f"'{name}'" for name in known) or "none at all"
        raise InputError(f"There is no coder '{unknown[0]}'; there are {there}.")
    if task is not None:
        project.demonstrations.check_task(task)
    found, hidden = [], 0
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
            found.append(CoderTracks(info.id, info.name, info.task, tracks))
    return tuple(found), hidden


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


def cohen(seconds: NDArray[np.float64]) -> float | None:
    """Cohen's kappa of two coders.

    Parameters
    ----------
    seconds : ndarray, shape (K, K)
        How long one said the row's action while the other said the column's.

    Returns
    -------
    float or None
        1 for full agreement, 0 for what chance brings; None where there is no common time, or both
        know but one action: chance alone then agrees always.
    """
    total = float(seconds.sum())
    if total <= 0:
        return None
    shares = seconds / total
    expected = float(shares.sum(axis=1) @ shares.sum(axis=0))
    if 1 - expected < 1e-12:
        return None
    return (float(np.trace(shares)) - expected) / (1 - expected)


def fleiss(ratings: NDArray[np.int64], weights: NDArray[np.float64]) -> float | None:
    """Fleiss' kappa of any number of coders.

    Parameters
    ----------
    ratings : ndarray of int64, shape (p, K)
        How many coders gave each action to a piece of time; pieces with fewer than two are left
        out.
    weights : ndarray, shape (p,)
        Seconds.

    Returns
    -------
    float or None
        As of :func:`cohen`. With equally many coders throughout it is the figure of Fleiss (1971).
    """
    coders = ratings.sum(axis=1)
    enough = coders >= 2
    n, w = ratings[enough].astype(np.float64), weights[enough]
    if not w.sum() > 0:
        return None
    m, w = coders[enough].astype(np.float64), w / w.sum()
    agreed = float(w @ ((n * (n - 1)).sum(axis=1) / (m * (m - 1))))
    expected = float((((w / m) @ n) ** 2).sum())
    return None if 1 - expected < 1e-12 else (agreed - expected) / (1 - expected)


def specific(seconds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Positive specific agreement of each action, shape (K,); nan where neither said it.

    ``2 n_kk / (n_k. + n_.k)``: if one of the two, drawn by lot, says the action, how probably the
    other says it too. `seconds` as of :func:`cohen`.
    """
    said = seconds.sum(axis=0) + seconds.sum(axis=1)
    shares = np.full(len(seconds), np.nan)
    np.divide(2 * np.diag(seconds), said, out=shares, where=said > 0)
    return shares


def spread(matrices: NDArray[np.float64]) -> tuple[float, float] | None:
    """95 % interval of Cohen's kappa by the percentile bootstrap over demonstrations.

    Parameters
    ----------
    matrices : ndarray, shape (D, K, K)
        One of :func:`cohen` for each demonstration.

    Returns
    -------
    tuple of float or None
        None with fewer than three demonstrations: they cannot tell how much demonstrations vary.
    """
    count = len(matrices)
    if count < FEWEST:
        return None
    weights = draws(count, RESAMPLES, 0).astype(np.float64)
    kappas = [k for k in map(cohen, np.tensordot(weights, matrices, axes=1)) if k is not None]
    if not kappas:
        return None
    aside = 50 * (1 - LEVEL)
    low, high = np.percentile(kappas, [aside, 100 - aside])
    return float(low), float(high)


def landis_koch(kappa: float) -> str:
    """The word of Landis and Koch for a kappa, such as ``"substantial"``."""
    return next((word for limit, word in WORDS if kappa <= limit + 1e-12), WORDS[-1][1])


#: Seconds up to which two boundaries of the same kind may be the same one.
WINDOW = 0.5

#: A boundary's kind: whether an action starts or ends, and which.
_Kind = tuple[bool, str]


@dataclass(frozen=True, eq=False)
class Boundaries:
    """Matched boundaries of two tracks; m pairs.

    Parameters
    ----------
    times : ndarray of float64, shape (m, 2)
        Seconds, of the first and the second track.
    actions : tuple of str, length m
        What starts or ends there.
    starting : tuple of bool, length m
        Whether it starts.
    counts : tuple of int
        How many boundaries each of the two has.
    """

    times: NDArray[np.float64]
    actions: tuple[str, ...]
    starting: tuple[bool, ...]
    counts: tuple[int, int]

    @property
    def offsets(self) -> NDArray[np.float64]:
        """Milliseconds by which the second track is later, shape (m,)."""
        return 1000.0 * (self.times[:, 1] - self.times[:, 0])


def boundaries(segments: Segments) -> dict[_Kind, list[float]]:
    """The times of every kind of boundary of a track, increasing.

    Touching segments of one action are one: nobody sees a boundary between them.
    """
    found: dict[_Kind, list[float]] = {}
    for index, segment in enumerate(segments):
        before = segments[index - 1] if index else None
        after = segments[index + 1] if index + 1 < len(segments) else None
        touched = before is not None and segment.start - before.end <= SLIVER
        if not (touched and before is not None and before.action == segment.action):
            found.setdefault((True, segment.action), []).append(segment.start)
        if after is None or after.start - segment.end > SLIVER:
            found.setdefault((False, segment.action), []).append(segment.end)
    return found


def match_boundaries(a: Segments, b: Segments, window: float = WINDOW) -> Boundaries:
    """Match boundaries of the same kind, the nearest first, each at most once.

    Parameters
    ----------
    a, b : tuple of Segment
        Two tracks.
    window : float
        Seconds that two matched ones are apart at most.
    """
    ours, theirs = boundaries(a), boundaries(b)
    rows: list[tuple[float, float, _Kind]] = []
    for kind in ours.keys() & theirs.keys():
        rows += [(s, t, kind) for s, t in _nearest(ours[kind], theirs[kind], window)]
    rows.sort()
    return Boundaries(
        times=np.array([row[:2] for row in rows], dtype=np.float64).reshape(-1, 2),
        actions=tuple(action for _, _, (_, action) in rows),
        starting=tuple(starting for _, _, (starting, _) in rows),
        counts=(sum(map(len, ours.values())), sum(map(len, theirs.values()))),
    )


def _nearest(ours: list[float], theirs: list[float], window: float) -> list[tuple[float, float]]:
    """Pairs of times, the nearest first; which track is the first makes no difference."""
    all_theirs = np.array(theirs)
    near = []
    for i, time in enumerate(ours):
        low, high = np.searchsorted(all_theirs, [time - window, time + window])
        # Rounded, so that the last bits of two equal distances do not decide.
        near += [
            (round(abs(theirs[j] - time), 9), time + theirs[j], i, j)
            for j in range(max(int(low) - 1, 0), min(int(high) + 1, len(theirs)))
        ]
    used_ours: set[int] = set()
    used_theirs: set[int] = set()
    pairs = []
    for distance, _, i, j in sorted(near):
        if distance <= window and i not in used_ours and j not in used_theirs:
            used_ours.add(i)
            used_theirs.add(j)
            pairs.append((ours[i], theirs[j]))
    return pairs


#: Ticks a second: overlaps are compared in whole numbers, so that one half is one half.
TICKS = 1e6


def segment_counts(pieces: Pieces, a: Segments, b: Segments) -> NDArray[np.int64]:
    """Count matched and unmatched segments of one demonstration.

    Each track in turn stands for the truth, by the rule of
    :func:`forcelab.recognition.metrics.match`. Only time that both labelled counts: a segment is
    weighed without the rest of it, and one that the other coder left unlabelled altogether is no
    segment. Durations are rounded to microseconds.

    Parameters
    ----------
    pieces : Pieces
        Of the two tracks.
    a, b : tuple of Segment
        The tracks.

    Returns
    -------
    ndarray of int64, shape (overlaps, 2, 3)
        By overlap and by who stands for the truth: matched, false, missed.
    """
    laid = _compressed(pieces, a, b)
    ways = _overlay(laid, 0, 1), _overlay(laid, 1, 0)
    found = []
    for overlap in OVERLAPS:
        for over in ways:
            true = len(match(over, overlap))
            found.append((true, len(over.predicted) - true, len(over.human) - true))
    return np.array(found, dtype=np.int64).reshape(len(OVERLAPS), 2, 3)


def segment_f1(counts: NDArray[np.int64]) -> dict[int, float | None]:
    """F1 of segments, by the least overlap in percent; None where there is no segment.

    The mean of both ways, which differ only where segments compete for one another. `counts` as of
    :func:`segment_counts`, summed over demonstrations.
    """
    found: dict[int, float | None] = {}
    for overlap, ways in zip(OVERLAPS, counts.tolist(), strict=True):
        values = [value for way in ways if (value := f1(*way)) is not None]
        found[overlap] = sum(values) / len(values) if values else None
    return found


class _Laid(NamedTuple):
    """Pieces that both labelled, on a clock that runs only there."""

    numbers: NDArray[np.int64]  # of each track's segments, shape (2, p)
    codes: NDArray[np.int64]  # of their actions, shape (2, p)
    ticks: NDArray[np.int64]  # where each piece starts, and the end of the last, shape (p + 1,)


def _compressed(pieces: Pieces, a: Segments, b: Segments) -> _Laid:
    """Cut out the time that only one labelled.

    On the remaining clock a segment stays one, even where the other coder left a gap within it.
    """
    ticks = np.rint(pieces.seconds * TICKS).astype(np.int64)
    both = pieces.labelled_by_all & (ticks > 0)
    middles = (pieces.starts + pieces.seconds / 2)[both]
    numbers = [np.searchsorted(_starts(track), middles, side="right") - 1 for track in (a, b)]
    clock = np.concatenate([[0], np.cumsum(ticks[both])])
    return _Laid(np.stack(numbers), pieces.codes[:, both], clock)


def _starts(track: Segments) -> list[float]:
    """Where segments start; touching ones of one action are one."""
    return [
        segment.start
        for before, segment in zip((None, *track), track, strict=False)
        if before is None or before.action != segment.action or segment.start - before.end > SLIVER
    ]


def _overlay(laid: _Laid, human: int, predicted: int) -> Overlay:
    """The overlay of the two tracks, in ticks instead of samples."""
    either = laid.numbers[human] * (int(laid.numbers[predicted].max(initial=0)) + 1)
    pairs = _stretches(laid, either + laid.numbers[predicted], laid.codes[human])
    first = np.searchsorted(laid.ticks, pairs.firsts)
    return Overlay(
        human=_stretches(laid, laid.numbers[human], laid.codes[human]),
        predicted=_stretches(laid, laid.numbers[predicted], laid.codes[predicted]),
        pieces=pairs,
        human_codes=laid.codes[human][first],
        predicted_codes=laid.codes[predicted][first],
        actions=int(laid.codes.max(initial=-1)) + 1,
    )


def _stretches(laid: _Laid, numbers: NDArray[np.int64], codes: NDArray[np.int64]) -> Runs:
    """Neighbouring pieces of one number as one stretch."""
    if not len(numbers):
        none, never = np.empty(0, dtype=np.int64), np.empty(0)
        return Runs(none, none, none, never, never)
    firsts = np.concatenate([[0], np.flatnonzero(np.diff(numbers)) + 1])
    starts = laid.ticks[firsts]
    ends = np.append(starts[1:], laid.ticks[-1])
    return Runs(codes[firsts], starts, ends, starts / TICKS, ends / TICKS)


@dataclass(frozen=True, slots=True)
class CoderDifference:
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

    def place(self, demonstration: str) -> Interval:
        """Where to look; ``human`` is the first coder, ``predicted`` the second."""
        return Interval(demonstration, self.start, self.end, self.a, self.b)


def differences(a: Segments, b: Segments) -> tuple[CoderDifference, ...]:
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
        found.append(CoderDifference(start, end, names[one], names[other], edge))
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
    apart: tuple[Interval, ...]
    alone: tuple[Interval, ...]
    shifted: tuple[Interval, ...]

    @property
    def both(self) -> NDArray[np.float64]:
        """Seconds by action of `a` and of `b` that both labelled, shape (K, K)."""
        return np.asarray(self.seconds.sum(axis=0)[:-1, :-1])

    @property
    def kappa(self) -> float | None:
        """Cohen's kappa; see :func:`forcelab.review.agreement.cohen`."""
        return cohen(self.both)

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % interval of kappa; see :func:`forcelab.review.agreement.spread`."""
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
    coded: Sequence[CoderTracks], a: str, b: str
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
    apart: list[Interval] = []
    alone: list[Interval] = []
    shifted: list[Interval] = []
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


def _differing(id_: str, pieces: Pieces, actions: Sequence[str]) -> list[Interval]:
    """Each of the pieces of two tracks as a place; ``human`` is the first track's action."""
    names = (*actions, None)  # the last is found with -1
    rows = zip(pieces.starts.tolist(), pieces.ends.tolist(), *pieces.codes.tolist(), strict=True)
    return [Interval(id_, start, end, names[a], names[b]) for start, end, a, b in rows]


def _seconds(pieces: Pieces, k: int) -> NDArray[np.float64]:
    """How long two tracks say what, shape (k + 1, k + 1); the last is unlabelled."""
    # Code -1 is the last row and the last column as it is.
    total = np.zeros((k + 1, k + 1))
    np.add.at(total, (pieces.codes[0], pieces.codes[1]), pieces.seconds)
    return total


def _shifted(id_: str, found: Boundaries) -> list[Interval]:
    """The stretches between matched boundaries that are not at the same time."""
    places = []
    for (s, t), action, starting in zip(
        found.times.tolist(), found.actions, found.starting, strict=True
    ):
        # Who of the two says the action between its own boundary and the other's.
        first_says = (s < t) == starting
        if abs(s - t) > 1e-6:
            seen = (action, None) if first_says else (None, action)
            places.append(Interval(id_, min(s, t), max(s, t), *seen))
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
    """How long the segments of an action of a task are.

    Parameters
    ----------
    task, action : str
    count : int
        Segments.
    mean : float
        Seconds.
    variation : float or None
        Standard deviation over mean; None with fewer than two segments.
    """

    task: str
    action: str
    count: int
    mean: float
    variation: float | None


@dataclass(frozen=True)
class Consistency:
    """How much one coder's labels vary.

    Parameters
    ----------
    author : str
    actions : tuple of Durations
        By task, in the order of their first occurrence.
    odd : tuple of Place
        Segments whose duration stands out among those of their action, the oddest first.
    rare : tuple of Place
        Two actions in an order that no other demonstration of the task has; ``human`` is the first
        of them, ``predicted`` the second.
    """

    author: str
    actions: tuple[Durations, ...]
    odd: tuple[Interval, ...]
    rare: tuple[Interval, ...]

    def to_json(self) -> dict[str, Any]:
        """The figures as plain values."""
        return {
            "coder": self.author,
            "odd_durations": len(self.odd),
            "rare_transitions": len(self.rare),
            "durations": [
                {
                    "task": one.task,
                    "action": one.action,
                    "segments": one.count,
                    "mean_s": one.mean,
                    "variation": one.variation,
                }
                for one in self.actions
            ],
        }


def consistency(coded: Sequence[CoderTracks], author: str) -> Consistency:
    """How much a coder's labels vary over the demonstrations of each task."""
    tasks = dict.fromkeys(one.task for one in coded if author in one.tracks)
    durations: list[Durations] = []
    odd: list[tuple[float, Interval]] = []
    rare: list[Interval] = []
    for task in tasks:
        theirs = (one for one in coded if one.task == task and author in one.tracks)
        tracks = {one.id: one.tracks[author] for one in theirs}
        by_action: dict[str, list[tuple[str, Segment]]] = {}
        for id_, segments in tracks.items():
            for segment in segments:
                by_action.setdefault(segment.action, []).append((id_, segment))
        for action, found in by_action.items():
            lengths = np.array([segment.duration for _, segment in found])
            mean = float(lengths.mean())
            variation = float(lengths.std(ddof=1)) / mean if len(lengths) > 1 else None
            durations.append(Durations(task, action, len(lengths), mean, variation))
            odd += _odd(found)
        rare += _rare(tracks)
    odd.sort(key=lambda item: -item[0])
    return Consistency(author, tuple(durations), tuple(place for _, place in odd), tuple(rare))


def _odd(found: Sequence[tuple[str, Segment]]) -> list[tuple[float, Interval]]:
    """Segments of one action whose duration stands out, with their robust z."""
    lengths = np.array([segment.duration for _, segment in found])
    away = np.abs(lengths - np.median(lengths))
    deviation = float(np.median(away))
    if len(found) < FEWEST_SEGMENTS or deviation <= 0:
        return []
    scores = 0.6745 * away / deviation
    return [
        (float(z), Interval(id_, segment.start, segment.end, segment.action))
        for z, (id_, segment) in zip(scores, found, strict=True)
        if z > STANDS_OUT
    ]


def _rare(tracks: dict[str, tuple[Segment, ...]]) -> list[Interval]:
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
    coded: tuple[CoderTracks, ...]
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
    coded: Sequence[CoderTracks], same: tuple[str, str] | None = None, hidden: int = 0
) -> Generator[Progress, None, Agreement]:
    """Compare all coders.

    Parameters
    ----------
    coded : sequence of Coded
        From :func:`~forcelab.review.agreement.coded_demonstrations`.
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


def _fleiss(coded: Sequence[CoderTracks], authors: Sequence[str]) -> float | None:
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
