"""Scores: how well a predicted track agrees with a human one, by samples, segments and events.

A demonstration is counted once, into :class:`Counts`; scores of one demonstration, of many pooled
ones and of resamples of them are made from counts alone, so that pooling is exact. Samples that the
human left unlabelled are never counted: predictions are masked there before segments are gathered.
A sample that the human labelled and the prediction did not is wrong.

*Segments.* A frame metric hardly notices a prediction that flickers; edit score, F1 at an overlap
and boundary errors do. Lea, Flynn, Vidal, Reiter and Hager, "Temporal convolutional networks for
action segmentation and detection", CVPR 2017: the edit score and F1@k. Farha and Gall, "MS-TCN",
CVPR 2019: the same, in the form in which they are commonly reported. A coder who leaves a few
hundredths of a second between two actions cuts a predicted segment that runs through in two, and
each boundary into an edge that no prediction can miss. Some publish their segmental scores so,
others cut the unlabelled time out first; the two differ by ten points and more, so both are
reported ("labelled").

*Events.* Ward, Lukowicz and Gellersen, "Performance metrics for activity recognition", ACM
Transactions on Intelligent Systems and Technology 2(1), article 6, 2011. Each action is taken on
its own, as the binary question "is it this action?". An *event* is one human or one predicted
segment of the action. Time is cut wherever either answer changes, which leaves pieces that are
right (both yes), missed (only the human says yes), false (only the prediction does) or empty. A
missed or false piece gets its name from its two neighbours:

    ================  ================  ===============
    right neighbours  missed piece      false piece
    ================  ================  ===============
    none              deletion          insertion
    one               underfill         overfill
    both              fragmentation     merge
    ================  ================  ===============

Where time breaks off, at a gap, beside unlabelled human time and at both ends of the recording,
there is no neighbour: an event never reaches across. A sample called by the wrong action is an
error of two actions, missed for the one and false for the other.

Tracks of segments without samples are overlaid in nanoseconds, from the edges alone, so that an
hour costs no more than its segments. With even stamps every score is the same; where stamps jitter,
rates differ by as much.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Sized
from dataclasses import asdict, dataclass, fields
from functools import reduce
from operator import add
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Codes, Real, Whole
from forcelab.errors import InputError
from forcelab.labels import UNLABELLED, Segments
from forcelab.notebook import html_table, html_title
from forcelab.sample_runs import Runs, sample_ends, stretches
from forcelab.text import percent


@dataclass(frozen=True, eq=False, slots=True)
class Overlay:
    """A human and a predicted track over one demonstration, cut into p pieces."""

    #: human, predicted: the segments of both, the predicted ones masked to where the human labelled
    human: Runs
    predicted: Runs
    #: Every stretch the human labelled, cut wherever either track changes. Its codes number the
    #: pairs of actions and mean nothing by themselves.
    pieces: Runs
    #: human_codes, predicted_codes: (p,); the actions of each piece; the predicted one may be
    #: unlabelled
    human_codes: Codes
    predicted_codes: Codes
    actions: int  # how many actions there are

    @classmethod
    def from_codes(
        cls, human: Codes, predicted: Codes, actions: int, gather: Callable[[Codes], Runs]
    ) -> Overlay:
        """Mask the prediction to where the human labelled, and gather both tracks and their pairs.

        Codes (n,) lie below `actions`, negative ones are unlabelled; `gather` makes runs of such
        codes.
        """
        masked = np.where(human < 0, UNLABELLED, np.maximum(predicted, UNLABELLED))
        columns = actions + 1  # unlabelled is the first
        pieces = gather(np.where(human < 0, UNLABELLED, human * columns + masked + 1))
        return cls(
            human=gather(human),
            predicted=gather(masked),
            pieces=pieces,
            human_codes=pieces.codes // columns,
            predicted_codes=pieces.codes % columns - 1,
            actions=actions,
        )


def overlay(human: Codes, predicted: Codes, times: Real, actions: Sized) -> Overlay:
    """Lay a predicted over a human track: codes (n,) at strictly increasing times (n,) in seconds.

    Where the human left a sample unlabelled (any negative code) the prediction is unlabelled too
    before anything is gathered, so that what was predicted there cannot matter to anything. A
    ValueError says that lengths disagree or a code has no action.
    """
    k = len(actions)
    if not len(human) == len(predicted) == len(times):
        raise ValueError(
            f"{len(human)} human and {len(predicted)} predicted codes for {len(times)} times"
        )
    highest = max(human.max(initial=-1), predicted[human >= 0].max(initial=-1))
    if highest >= k:
        raise ValueError(f"a code of {highest} for {k} actions")
    ends = sample_ends(times)
    return Overlay.from_codes(human, predicted, k, lambda codes: stretches(codes, times, ends))


#: The overlaps (intersection over union, in percent) at which F1 is reported.
OVERLAPS = (10, 25, 50)


def edit_distance(a: Codes, b: Codes) -> int:
    """Levenshtein distance of two sequences of codes (m,) and (n,)."""
    short, long = sorted((a, b), key=len)
    places = np.arange(len(long) + 1)
    row = places
    for number, code in enumerate(short.tolist(), 1):
        # Of the usual table a row at a time: from above and across, then along it.
        above = np.minimum(row[1:] + 1, row[:-1] + (long != code))
        row = np.minimum.accumulate(np.concatenate([[number], above]) - places) + places
    return int(row[-1])


def edit_score(over: Overlay) -> float | None:
    """1 - edit distance of the two sequences of actions / length of the longer (0 to 1).

    Durations play no part. None where the human labelled nothing.
    """
    longer = max(len(over.human), len(over.predicted))
    if longer == 0:
        return None
    return 1.0 - edit_distance(over.human.codes, over.predicted.codes) / longer


@dataclass(frozen=True, eq=False, slots=True)
class Matches:
    """The matched predicted and human segments; m pairs."""

    #: human, predicted: (m,); numbers of the matched segments among the human and the predicted
    #: ones
    human: Whole
    predicted: Whole

    def __len__(self) -> int:
        return len(self.human)


def match_segments(over: Overlay, overlap: int) -> Matches:
    """Match predicted to human segments as F1@k does, at a least `overlap` in percent, above 0.

    In the order of time each predicted segment points at the human segment of its own action with
    the largest intersection over union (the earlier of two equal ones), counted in samples. It is
    matched if that is at least `overlap` and no earlier one was matched to the same human segment;
    it does not turn to its second choice. This is the rule of the published code (``>=``), so that
    figures can be compared.
    """
    same = np.flatnonzero(over.human_codes == over.predicted_codes)
    firsts = over.pieces.firsts[same]
    human, predicted = over.human.holding(firsts), over.predicted.holding(firsts)
    # Two segments share at most one stretch, so these pairs are all the pairs that overlap.
    shared = over.pieces.samples[same]
    union = over.human.samples[human] + over.predicted.samples[predicted] - shared
    selection = np.lexsort((human, -shared / union, predicted))
    _, best = np.unique(predicted[selection], return_index=True)
    best = selection[best]
    # Whole numbers on both sides: an overlap of exactly one half is one half.
    best = best[100 * shared[best] >= overlap * union[best]]
    matched, earliest = np.unique(human[best], return_index=True)
    return Matches(matched, predicted[best[earliest]])


def f1(counts: Whole) -> Real:
    """F1 of counts (..., 3) of segments: matched, predicted and human ones without a match.

    NaN where there is no segment at all.
    """
    return _fractions(2 * counts[..., 0], counts @ (2, 1, 1))


def boundary_errors(over: Overlay, matches: Matches, *, inner: bool = False) -> Real:
    """Distances of matched segments' edges in milliseconds, shape (2 m,).

    Both edges of every matched pair are counted, start against start and end against end. Edges
    that meet because unlabelled human time, a gap or an end of the recording cuts both segments at
    the same place are counted as they are, with an error of zero; `inner` leaves out the first edge
    and the last one.
    """
    human, predicted = matches.human, matches.predicted
    starts = over.human.starts[human] - over.predicted.starts[predicted]
    ends = over.human.ends[human] - over.predicted.ends[predicted]
    if inner:
        starts, ends = starts[human > 0], ends[human < len(over.human) - 1]
    return 1000.0 * np.abs(np.concatenate([starts, ends]))


_RIGHT, _MISSED, _FALSE = 0, 1, 2


@dataclass(frozen=True, slots=True)
class Tally:
    """A count of events or pieces, and their time."""

    count: int = 0  # number of events or stretches
    seconds: float = 0.0  # their time

    def __add__(self, other: Tally) -> Tally:
        return Tally(self.count + other.count, self.seconds + other.seconds)


@dataclass(frozen=True, slots=True)
class Events:
    """Event errors summed over all actions.

    Whatever was predicted in unlabelled human time is not counted. The time that is right is
    ``human - deletion - fragmentation - underfill``, and also
    ``predicted - insertion - merge - overfill``.
    """

    human: Tally = Tally()  # all human events, and their time
    predicted: Tally = Tally()  # all predicted ones
    insertion: Tally = Tally()  # predicted events that meet no human event of their action
    deletion: Tally = Tally()  # human events that no predicted event of their action meets
    #: Human events that several predicted ones fall into, and the time missed between those
    fragmentation: Tally = Tally()
    #: Predicted events that join several human ones, and the false time between those
    merge: Tally = Tally()
    overfill: Tally = Tally()  # stretches of predicted events over an edge of a human one
    underfill: Tally = Tally()  # stretches by which they stay short of such an edge

    def __add__(self, other: Events) -> Events:
        return Events(
            *(getattr(self, part.name) + getattr(other, part.name) for part in fields(self))
        )

    def to_json(self) -> dict[str, dict[str, float]]:
        """``{"human": {"count": ..., "seconds": ...}, "predicted": ..., "insertion": ...}``."""
        return asdict(self)


def _event_pieces(
    over: Overlay,
) -> tuple[Whole, Whole, Whole, Real]:
    """Right, missed and false time of all actions, by action and then by time.

    What each piece is, how many of its two neighbours are right, its first sample, and its seconds.
    """
    disagreeing = np.flatnonzero(over.human_codes != over.predicted_codes)
    false = disagreeing[over.predicted_codes[disagreeing] >= 0]
    kinds = np.full(len(over.pieces), _RIGHT)
    kinds[disagreeing] = _MISSED
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
    return kind, neighbours, over.pieces.firsts[piece[heads]], ends[tails] - starts[heads]


def event_errors(over: Overlay) -> Events:
    """Count and time the event errors of one demonstration (see the module)."""
    if len(over.pieces) == 0:
        return Events()
    kinds, neighbours, firsts, seconds = _event_pieces(over)

    def tally(kind: int, right: int, events: Runs | None = None) -> Tally:
        """Sum up stretches, counting the events that hold them where `events` is given."""
        chosen = (kinds == kind) & (neighbours == right)
        numbers = np.flatnonzero(chosen)
        if events is not None:
            numbers = np.unique(events.holding(firsts[chosen]))
        return Tally(len(numbers), float(seconds[chosen].sum()))

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


#: Seconds within which a predicted boundary counts as a human one found.
NEAR = 0.1


def without_unlabelled(over: Overlay) -> Overlay:
    """The overlay with all that the human left unlabelled, and gaps, cut out.

    Neighbours of one action that now touch are one segment.
    """
    places = np.concatenate([[0], np.cumsum(over.pieces.samples)])
    times = np.concatenate([[0.0], np.cumsum(over.pieces.seconds)])
    return Overlay.from_codes(
        over.human_codes,
        over.predicted_codes,
        over.actions,
        lambda codes: gather_runs(codes, places, times),
    )


def boundaries_found(closed: Overlay) -> tuple[int, int]:
    """Number of human boundaries with a predicted one within 100 ms, and of all human boundaries.

    Boundaries, of an overlay without unlabelled time, are where one action gives way to another;
    the ends of the recording are none. A predicted one counts whichever its actions are.
    """
    human = closed.human.starts[1:]
    predicted = closed.pieces.starts[1:][np.diff(closed.predicted_codes) != 0]
    if len(predicted) == 0:
        return 0, len(human)
    after = np.searchsorted(predicted, human)
    sides = np.maximum(after - 1, 0), np.minimum(after, len(predicted) - 1)
    near = np.minimum(*(np.abs(human - predicted[side]) for side in sides))
    # Stamps are rounded: 100 ms are 100 ms.
    return int((near <= NEAR * (1 + 1e-9)).sum()), len(human)


@dataclass(frozen=True, eq=False, slots=True)
class Counts:
    """All that the scores of a demonstration, or of several, are made from; k actions."""

    #: (k, k + 1); samples by human action (rows) and predicted action (columns); the last column
    #: counts those predicted as unlabelled
    confusion: Whole
    edits: tuple[float, ...]  # edit score of each demonstration that has one
    #: (3, 3); A row for each of :data:`~forcelab.recognition.metrics.OVERLAPS`: matched segments,
    #: predicted ones without a match, human ones without a match
    segments: Whole
    boundaries: Real  # (b,); boundary errors in milliseconds
    events: Events  # event errors
    labelled_segments: Whole  # (3, 3); as `segments`, in labelled time alone
    #: (2,); human boundaries in labelled time that have a predicted one within 100 ms, and all
    found: Whole
    labelled_boundaries: Real  # (c,); as `boundaries`, in labelled time alone

    def __add__(self, other: Counts) -> Counts:
        return Counts(
            self.confusion + other.confusion,
            self.edits + other.edits,
            self.segments + other.segments,
            np.concatenate([self.boundaries, other.boundaries]),
            self.events + other.events,
            self.labelled_segments + other.labelled_segments,
            self.found + other.found,
            np.concatenate([self.labelled_boundaries, other.labelled_boundaries]),
        )


@dataclass(frozen=True, slots=True)
class Scores:
    """How well predictions agree with a human. Rates are fractions; None where undefined.

    Parameters
    ----------
    name : str
        Of the demonstration, or of the pool.
    accuracy : float or None
        Share of the human-labelled samples that are predicted right.
    balanced_accuracy : float or None
        Mean, over the actions that the human used, of the share of their samples predicted right.
    coverage : float or None
        Share of the human-labelled samples that are not predicted as unlabelled.
    kappa : float or None
        Cohen's kappa over the human-labelled samples, predicted-unlabelled being one more
        category; 0 where human or prediction is constant, which leaves nothing to agree about
        beyond chance.
    edit : float or None
        Segmental edit score; of a pool the mean over its demonstrations, each weighted equally.
    f1 : dict of str to float or None
        Segmental F1 at overlaps of ``"10"``, ``"25"`` and ``"50"`` percent. Unlabelled human time
        cuts segments, as in the published code.
    f1_labelled : dict of str to float or None
        The same in labelled time alone: unlabelled human time is cut out before segments are
        gathered, so that an action which goes on behind it is one.
    boundaries_found : float or None
        In labelled time alone, the share of human boundaries with a predicted one within 100 ms.
    boundary_ms : dict of str to float or None
        ``"median"`` and ``"p90"`` (90th percentile, linear between neighbours) of the distances,
        in ms, of the edges of human segments from those of the predicted segments matched to them
        for F1@10. Where both are cut by unlabelled human time the distance is 0, so that the median
        of a coder who leaves a little between all actions tells nothing.
    boundary_labelled_ms : dict of str to float or None
        The same in labelled time alone, as `f1_labelled`; without the first and the last edge.
    confusion : list of list of int
        Samples; rows are human and columns predicted actions, the last column unlabelled.
    events : Events
        Ward's event errors.

    Examples
    --------
    >>> human = labelled[0].segments
    >>> scores = forcelab.score_tracks(human, human[:2])
    >>> scores.f1["50"] < 1, scores.coverage < 1
    (True, True)
    """

    name: str
    accuracy: float | None
    balanced_accuracy: float | None
    coverage: float | None
    kappa: float | None
    edit: float | None
    f1: dict[str, float | None]
    f1_labelled: dict[str, float | None]
    boundaries_found: float | None
    boundary_ms: dict[str, float | None]
    boundary_labelled_ms: dict[str, float | None]
    confusion: list[list[int]]
    events: Events

    def _repr_html_(self) -> str:
        """As notebooks show it: the main scores in percent, and the median boundary error."""
        median = self.boundary_labelled_ms["median"]
        rows = {
            "accuracy": percent(self.accuracy),
            "coverage": percent(self.coverage),
            "edit": percent(self.edit),
            **{f"F1@{overlap}": percent(f1) for overlap, f1 in self.f1.items()},
            "boundary, median ms": "-" if median is None else f"{median:.0f}",
        }
        return html_title(self.name) + html_table((), rows.items())

    def to_json(self) -> dict[str, Any]:
        """Only dictionaries, lists, strings, numbers and None, under the names above."""
        return asdict(self)


def count(human: Codes, predicted: Codes, times: Real, actions: Sequence[str]) -> Counts:
    """Compare codes (n,) of a predicted with a human track; parameters as of :func:`overlay`."""
    return count_overlay(overlay(human, predicted, times, actions))


def count_overlay(over: Overlay) -> Counts:
    """Count an overlay, whatever it was made from."""
    matches = [match_segments(over, overlap) for overlap in OVERLAPS]
    edit = edit_score(over)
    closed = without_unlabelled(over)
    closed_matches = [match_segments(closed, overlap) for overlap in OVERLAPS]
    return Counts(
        confusion=_confusion(over),
        edits=() if edit is None else (edit,),
        segments=count_matches(over, matches),
        boundaries=boundary_errors(over, matches[0]),
        events=event_errors(over),
        labelled_segments=count_matches(closed, closed_matches),
        found=np.array(boundaries_found(closed)),
        labelled_boundaries=boundary_errors(closed, closed_matches[0], inner=True),
    )


def count_matches(over: Overlay, matches: Sequence[Matches]) -> Whole:
    """Matched segments, predicted and human ones without a match; a row for each of `matches`."""
    return np.array(
        [[len(m), len(over.predicted) - len(m), len(over.human) - len(m)] for m in matches]
    )


def _confusion(over: Overlay) -> Whole:
    """Samples by human and predicted action, shape (k, k + 1)."""
    counts = np.zeros((over.actions, over.actions + 1), dtype=np.int64)
    # Unlabelled is code -1, which indexes the last column.
    np.add.at(counts, (over.human_codes, over.predicted_codes), over.pieces.samples)
    return counts


def pool(name: str, parts: Sequence[Counts]) -> Scores:
    """Score several demonstrations, counted with the same actions, together."""
    total = reduce(add, parts)
    found = score_resamples([total], np.ones((1, 1), dtype=np.int64))
    values = {
        metric: None if np.isnan(score) else float(score) for metric, (score,) in found.items()
    }
    plain = nested(values) | {"confusion": total.confusion.tolist(), "events": total.events}
    return Scores(name=name, **plain)


#: The parts of :class:`Events`.
EVENTS = tuple(part.name for part in fields(Events))
#: Every number in the scores but the confusion, as the path to it in their JSON.
METRICS = (
    *("accuracy", "balanced_accuracy", "coverage", "kappa", "edit"),
    *(f"f1.{overlap}" for overlap in OVERLAPS),
    *(f"f1_labelled.{overlap}" for overlap in OVERLAPS),
    "boundaries_found",
    *("boundary_ms.median", "boundary_ms.p90"),
    *("boundary_labelled_ms.median", "boundary_labelled_ms.p90"),
    *(f"events.{part}.{unit}" for part in EVENTS for unit in ("count", "seconds")),
)
#: Numbers held at once while boundary errors are resampled: 32 MB.
AT_ONCE = 4_000_000


def score_resamples(parts: Sequence[Counts], weights: Whole) -> dict[str, Real]:
    """Score resamples, given weights (r, n) of n demonstrations, each as one pool: (r,) each.

    A key for each of :data:`METRICS`; NaN where the metric is not defined. Kappa is Cohen's
    (Educational and Psychological Measurement 20(1), 1960); where both raters are constant and
    agree, the formula is 0 / 0, and it is 0 as it is by the formula when one of them is constant.
    """
    result = _frame_metrics(parts, weights)
    edits = np.array([sum(part.edits) for part in parts])
    result["edit"] = _fractions(weights @ edits, weights @ np.array([len(p.edits) for p in parts]))
    for name, segments in (("f1", "segments"), ("f1_labelled", "labelled_segments")):
        counts = np.tensordot(weights, np.stack([getattr(part, segments) for part in parts]), 1)
        result |= {f"{name}.{k}": rates for k, rates in zip(OVERLAPS, f1(counts).T, strict=True)}
    hits, boundaries = (weights @ np.stack([part.found for part in parts])).T
    result["boundaries_found"] = _fractions(hits, boundaries)
    for name, errors in (
        ("boundary_ms", [part.boundaries for part in parts]),
        ("boundary_labelled_ms", [part.labelled_boundaries for part in parts]),
    ):
        median, p90 = _percentiles(errors, weights, (50, 90))
        result |= {f"{name}.median": median, f"{name}.p90": p90}
    for name in EVENTS:
        for unit in ("count", "seconds"):
            each = np.array([getattr(getattr(part.events, name), unit) for part in parts])
            result[f"events.{name}.{unit}"] = (weights @ each).astype(np.float64)
    return result


def _frame_metrics(parts: Sequence[Counts], weights: Whole) -> dict[str, Real]:
    """The metrics that are made from the confusion."""
    confusions = np.stack([part.confusion for part in parts]).astype(np.float64)
    right = weights @ np.diagonal(confusions, axis1=1, axis2=2)
    labelled = weights @ confusions.sum(axis=2)
    predicted = weights @ confusions[:, :, :-1].sum(axis=1)
    total = labelled.sum(axis=1)
    used = labelled > 0
    recalls = np.divide(right, labelled, out=np.zeros_like(right), where=used)
    chance = (labelled[:, : right.shape[1]] * predicted).sum(axis=1)
    kappa = np.divide(
        total * right.sum(axis=1) - chance,
        total**2 - chance,
        out=np.zeros_like(total),
        where=total**2 > chance,
    )
    return {
        "accuracy": _fractions(right.sum(axis=1), total),
        "balanced_accuracy": _fractions(recalls.sum(axis=1), used.sum(axis=1)),
        "coverage": _fractions(predicted.sum(axis=1), total),
        "kappa": np.where(total > 0, kappa, np.nan),
    }


def _percentiles(parts: Sequence[Real], weights: Whole, percents: tuple[int, ...]) -> list[Real]:
    """Percentiles of the boundary errors, linear between neighbours as ``np.percentile`` is.

    All errors are sorted once; in a resample each occurs as often as its demonstration.
    """
    errors = np.concatenate(parts)
    owners = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    order = np.argsort(errors, kind="stable")
    errors, owners = errors[order], owners[order]
    result = [np.full(len(weights), np.nan) for _ in percents]
    if len(errors) == 0:
        return result
    step = max(1, AT_ONCE // len(errors))
    for first in range(0, len(weights), step):
        chunk = slice(first, first + step)
        upto = np.cumsum(weights[chunk][:, owners], axis=1)
        count = upto[:, -1]
        defined = count > 0
        for share, values in zip(percents, result, strict=True):
            rank = np.maximum(count - 1, 0) * (share / 100)
            low = np.floor(rank)
            ends = [
                errors[np.minimum((upto <= at[:, None]).sum(axis=1), len(errors) - 1)]
                for at in (low, np.minimum(low + 1, np.maximum(count - 1, 0)))
            ]
            interpolated = ends[0] + (rank - low) * (ends[1] - ends[0])
            values[chunk] = np.where(defined, interpolated, np.nan)
    return result


def _fractions(parts: NDArray[np.number], wholes: NDArray[np.number]) -> Real:
    """Fractions; NaN of nothing."""
    above, below = parts.astype(np.float64), wholes.astype(np.float64)
    return np.divide(above, below, out=np.full(above.shape, np.nan), where=below > 0)


def nested(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values by the names of :data:`METRICS`, as the JSON of scores has them."""
    result: dict[str, Any] = {}
    for name, value in values.items():
        *path, last = name.split(".")
        inner = result
        for part in path:
            inner = inner.setdefault(part, {})
        inner[last] = value
    return result


def look_up(record: Mapping[str, Any], name: str) -> Any:
    """The value in a JSON of scores under a name such as ``"f1.50"``; None if there is none."""
    value: Any = record
    for part in name.split("."):
        if not isinstance(value, (dict, Mapping)):  # to ask for a dict alone is much faster
            return None
        value = value.get(part)
    return value


#: Ticks a second: the samples of these overlays.
TICKS = 1_000_000_000


def overlay_segments(human: Segments, predicted: Segments, actions: Sequence[str]) -> Overlay:
    """Lay predicted over human segments; what is predicted in unlabelled time is left out.

    Segments are in order and never overlap; touching ones of one action are one.
    """
    number = {action: code for code, action in enumerate(actions, 1)}
    both = (*human, *predicted)
    edges = np.array([(s.start, s.end) for s in both])
    ticks, firsts, places = np.unique(
        np.rint(edges * TICKS).astype(np.int64), return_index=True, return_inverse=True
    )
    times = edges.ravel()[firsts]
    # Each segment raises the code of its track from unlabelled, -1, and its end takes it back.
    codes = np.array([number[s.action] for s in both], dtype=np.int64)
    track = np.repeat([0, 1], [len(human), len(predicted)])
    starts, ends = places.reshape(-1, 2).T
    # Of segments that overlap all the same, as in a damaged run, the later one counts.
    np.minimum(ends[:-1], starts[1:], out=ends[:-1], where=track[:-1] == track[1:])
    steps = np.zeros((2, len(ticks)), dtype=np.int64)
    np.add.at(steps, (track, starts), codes)
    np.subtract.at(steps, (track, ends), codes)
    human_codes, predicted_codes = steps[:, :-1].cumsum(axis=1) - 1
    return Overlay.from_codes(
        human_codes, predicted_codes, len(actions), lambda c: gather_runs(c, ticks, times)
    )


def count_segments(human: Segments, predicted: Segments, actions: Sequence[str]) -> Counts:
    """:func:`count` of segments instead of samples; the confusion is in nanoseconds."""
    return count_overlay(overlay_segments(human, predicted, actions))


def score_tracks(
    human: Segments, predicted: Segments, actions: Sequence[str] | None = None, name: str = ""
) -> Scores:
    """Score a predicted against a human track, wherever the two come from.

    Unlabelled human time is never counted.

    Parameters
    ----------
    human, predicted : tuple of Segment
        In order, never overlapping, as of :class:`~forcelab.labels.Track`.
    actions : sequence of str, optional
        In the order of the confusion; by default that of their first occurrence.
    name : str
        Of the demonstration.

    Returns
    -------
    Scores
        Its confusion is in nanoseconds instead of samples.

    Raises
    ------
    InputError
        If an action is not among `actions`.

    Examples
    --------
    >>> human = labelled[0].segments
    >>> forcelab.score_tracks(human, human).accuracy
    1.0
    """
    used = tuple(dict.fromkeys(segment.action for segment in (*human, *predicted)))
    scored = used if actions is None else tuple(actions)
    if unknown := [action for action in used if action not in scored]:
        raise InputError(f"'{unknown[0]}' is not among the actions {', '.join(scored)}.")
    return pool(name, [count_segments(human, predicted, scored)])


def gather_runs(codes: Codes, ticks: Whole, times: Real) -> Runs:
    """Neighbours of equal code as one; code ``i`` holds from tick and time ``i`` to the next."""
    runs = stretches(codes, times[:-1], times[1:])
    return Runs(runs.codes, ticks[runs.firsts], ticks[runs.lasts], runs.starts, runs.ends)
