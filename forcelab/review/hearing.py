"""What a model that has not seen a demonstration says about a human's segments and their parts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.labels import Segments
from forcelab.recognition.certainty import Certainty
from forcelab.recognition.witnesses import MARGIN
from forcelab.review.differences import Difference
from forcelab.review.outcome import Reviewed

__all__ = ["Heard", "heard"]

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Heard:
    """What the model says about one demonstration; K actions.

    Parameters
    ----------
    demonstration : str
        Its id.
    segments : tuple of Segment
        The human's, m of them.
    said : ndarray of float64, shape (m, K)
        Mean probability of each action over the middle of each segment.
    predicted : ndarray of float64, shape (m, K)
        Share of the same that the prediction gives to each action.
    parts : tuple of Difference
        The stretches of kind "action", p of them.
    of_parts : ndarray of float64, shape (p, K)
        The same over each of these.
    """

    demonstration: str
    segments: Segments
    said: Real
    predicted: Real
    parts: tuple[Difference, ...]
    of_parts: Real


def heard(
    reviewed: Reviewed,
    segments: Segments,
    actions: Sequence[str],
    differences: Iterable[Difference] = (),
) -> Heard:
    """Gather what the model says about a human's segments.

    Without probabilities its word is the share of time that it gives to each action.

    Parameters
    ----------
    reviewed : Reviewed
    segments : tuple of Segment
        The human's.
    actions : sequence of str
        The outcome's.
    differences : iterable of Difference
        Between these segments and the prediction; without any, only whole segments are judged.
    """
    parts = tuple(d for d in differences if d.kind == "action")
    said = _said(reviewed, [(s.start, s.end) for s in segments], actions)
    of_parts = _said(reviewed, [(d.start, d.end) for d in parts], actions)
    predicted = np.zeros_like(said)
    for row, s in enumerate(segments):
        predicted[row] = _shares(reviewed.predicted, *_middle(s.start, s.end), actions)
    return Heard(reviewed.id, segments, said, predicted, parts, of_parts)


def _said(reviewed: Reviewed, spans: Sequence[tuple[float, float]], actions: Sequence[str]) -> Real:
    """Mean probability of each action over the middle of each span, shape (spans, K)."""
    said = np.zeros((len(spans), len(actions)))
    raw = reviewed.stages.get("raw", reviewed.predicted)
    for row, (start, end) in enumerate(spans):
        inside = _middle(start, end)
        if reviewed.certainty is None:
            said[row] = _shares(raw, *inside, actions)
        else:
            said[row] = _means(reviewed.certainty, *inside, actions)
    return said


def _middle(start: float, end: float) -> tuple[float, float]:
    """A span without its edges."""
    margin = MARGIN * (end - start)
    return start + margin, end - margin


def _means(certainty: Certainty, start: float, end: float, actions: Sequence[str]) -> Real:
    """Mean probability of each action, in the order of `actions`."""
    means = dict(zip(certainty.actions, certainty.mean(start, end).tolist(), strict=True))
    return np.array([means.get(action, 0.0) for action in actions])


def _shares(segments: Segments, start: float, end: float, actions: Sequence[str]) -> Real:
    """Share of ``[start, end)`` that segments give to each action."""
    seconds = dict.fromkeys(actions, 0.0)
    for segment in segments:
        both = min(segment.end, end) - max(segment.start, start)
        if both > 0 and segment.action in seconds:
            seconds[segment.action] += both
    return np.array(list(seconds.values())) / (end - start)
