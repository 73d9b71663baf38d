"""Scores: how well a predicted track agrees with a human one.

A demonstration is counted once, into :class:`Counts`; scores of one demonstration and of many
pooled ones are made from counts alone, so that pooling is exact.

Samples that the human left unlabelled are never counted in anything: predictions are masked there
before segments are gathered. A sample that the human labelled and the prediction did not is wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import reduce
from operator import add
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.events import Events, event_errors
from forcelab.recognition.labelled_time import boundaries_found, closed_up, inner_boundary_errors
from forcelab.recognition.overlay import Overlay, overlay
from forcelab.recognition.segmental import (
    OVERLAPS,
    Matches,
    boundary_errors,
    edit_score,
    f1,
    match,
)

__all__ = ["Counts", "Scores", "count", "count_overlay", "pool", "score"]


@dataclass(frozen=True, eq=False, slots=True)
class Counts:
    """All that the scores of a demonstration, or of several, are made from; k actions.

    Parameters
    ----------
    confusion : ndarray of int64, shape (k, k + 1)
        Samples by human action (rows) and predicted action (columns); the last column counts
        those predicted as unlabelled.
    edits : tuple of float
        Edit score of each demonstration that has one.
    segments : ndarray of int64, shape (3, 3)
        A row for each of :data:`~forcelab.recognition.segmental.OVERLAPS`: matched segments,
        predicted ones without a match, human ones without a match.
    boundaries : ndarray of float64, shape (b,)
        Boundary errors in milliseconds.
    events : Events
        Event errors.
    labelled_segments : ndarray of int64, shape (3, 3)
        As `segments`, in labelled time alone.
    found : ndarray of int64, shape (2,)
        Human boundaries in labelled time that have a predicted one within 100 ms, and all.
    labelled_boundaries : ndarray of float64, shape (c,)
        As `boundaries`, in labelled time alone.
    """

    confusion: NDArray[np.int64]
    edits: tuple[float, ...]
    segments: NDArray[np.int64]
    boundaries: NDArray[np.float64]
    events: Events
    labelled_segments: NDArray[np.int64]
    found: NDArray[np.int64]
    labelled_boundaries: NDArray[np.float64]

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

    def to_json(self) -> dict[str, Any]:
        """Only dictionaries, lists, strings, numbers and None, under the names above."""
        return asdict(self)


def count(
    human: NDArray[np.int64],
    predicted: NDArray[np.int64],
    times: NDArray[np.float64],
    actions: Sequence[str],
) -> Counts:
    """Compare a predicted with a human track over one demonstration.

    Parameters
    ----------
    human, predicted : ndarray of int64, shape (n,)
        Codes of every sample; negative means unlabelled.
    times : ndarray, shape (n,)
        Times of the samples in seconds, strictly increasing.
    actions : sequence of str, length k
        The action with code ``i`` is ``actions[i]``.

    Raises
    ------
    ValueError
        If the lengths disagree, or a code has no action.
    """
    return count_overlay(overlay(human, predicted, times, actions))


def count_overlay(over: Overlay) -> Counts:
    """Count an overlay of a human and a predicted track, whatever it was made from."""
    matches = [match(over, overlap) for overlap in OVERLAPS]
    edit = edit_score(over)
    closed = closed_up(over)
    closed_matches = [match(closed, overlap) for overlap in OVERLAPS]
    return Counts(
        confusion=_confusion(over),
        edits=() if edit is None else (edit,),
        segments=_segments(over, matches),
        boundaries=boundary_errors(over, matches[0]),
        events=event_errors(over),
        labelled_segments=_segments(closed, closed_matches),
        found=np.array(boundaries_found(closed)),
        labelled_boundaries=inner_boundary_errors(closed, closed_matches[0]),
    )


def _segments(over: Overlay, matches: Sequence[Matches]) -> NDArray[np.int64]:
    """Matched segments, predicted and human ones without a match; a row for each overlap."""
    return np.array(
        [[len(m), len(over.predicted) - len(m), len(over.human) - len(m)] for m in matches]
    )


def _confusion(over: Overlay) -> NDArray[np.int64]:
    """Samples by human and predicted action, shape (k, k + 1)."""
    counts = np.zeros((over.actions, over.actions + 1), dtype=np.int64)
    # Unlabelled is code -1, which indexes the last column.
    np.add.at(counts, (over.human_codes, over.predicted_codes), over.pieces.samples)
    return counts


def pool(name: str, parts: Sequence[Counts]) -> Scores:
    """Score several demonstrations together.

    Parameters
    ----------
    name : str
        What the scores are called.
    parts : sequence of Counts, at least one
        All made with the same actions.
    """
    total = reduce(add, parts)
    labelled = total.confusion.sum(axis=1)
    right = np.diagonal(total.confusion)
    used = labelled > 0
    samples = int(labelled.sum())
    return Scores(
        name=name,
        accuracy=_share(int(right.sum()), samples),
        balanced_accuracy=float(np.mean(right[used] / labelled[used])) if samples else None,
        coverage=_share(int(total.confusion[:, :-1].sum()), samples),
        kappa=_kappa(total.confusion),
        edit=sum(total.edits) / len(total.edits) if total.edits else None,
        f1=_f1s(total.segments),
        f1_labelled=_f1s(total.labelled_segments),
        boundaries_found=_share(*(int(number) for number in total.found)),
        boundary_ms=_distances(total.boundaries),
        boundary_labelled_ms=_distances(total.labelled_boundaries),
        confusion=total.confusion.tolist(),
        events=total.events,
    )


def score(
    name: str,
    human: NDArray[np.int64],
    predicted: NDArray[np.int64],
    times: NDArray[np.float64],
    actions: Sequence[str],
) -> Scores:
    """Score one demonstration: :func:`pool` of its :func:`count` alone."""
    return pool(name, [count(human, predicted, times, actions)])


def _f1s(segments: NDArray[np.int64]) -> dict[str, float | None]:
    """F1 at each overlap."""
    return {
        str(overlap): f1(*(int(number) for number in row))
        for overlap, row in zip(OVERLAPS, segments, strict=True)
    }


def _distances(errors: NDArray[np.float64]) -> dict[str, float | None]:
    """Median and 90th percentile; None of nothing."""
    if not len(errors):
        return {"median": None, "p90": None}
    median, p90 = np.percentile(errors, [50, 90])
    return {"median": float(median), "p90": float(p90)}


def _share(part: int, whole: int) -> float | None:
    """A fraction; None of nothing."""
    return part / whole if whole else None


def _kappa(confusion: NDArray[np.int64]) -> float | None:
    """Cohen's kappa (Educational and Psychological Measurement 20(1), 1960) of counts (k, k + 1).

    Where both raters are constant and agree, the formula is 0 / 0; it is 0 here as it is by the
    formula when only one of them is constant.
    """
    n = int(confusion.sum())
    if n == 0:
        return None
    human, predicted = confusion.sum(axis=1).tolist(), confusion.sum(axis=0)[:-1].tolist()
    # Both sides times n squared, in whole numbers: zero is exactly zero.
    chance = sum(h * p for h, p in zip(human, predicted, strict=True))
    possible = n * n - chance
    return (n * int(np.trace(confusion)) - chance) / possible if possible else 0.0
