"""Places in a demonstration that are worth a look."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from forcelab.labels import Segments

if TYPE_CHECKING:
    from forcelab.review.outcome import Reviewed  # loads scipy

__all__ = ["Place", "action_over", "place_at", "place_of"]


@dataclass(frozen=True, slots=True)
class Place:
    """A stretch of a demonstration, and what human and model make of it.

    Parameters
    ----------
    demonstration : str
        Its id.
    start, end : float
        Seconds, ``start < end``.
    human, predicted : str, optional
        The action that each sees there; None where it is unlabelled or nothing is known.
    confidence : float, optional
        Mean probability, 0 to 1, that the model gives to what it predicts.
    """

    demonstration: str
    start: float
    end: float
    human: str | None = None
    predicted: str | None = None
    confidence: float | None = None

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return self.end - self.start


def action_over(segments: Segments, start: float, end: float) -> str | None:
    """The action that covers most of ``[start, end)``; None where nothing covers any of it."""
    covered: dict[str, float] = {}
    for segment in segments:
        shared = min(segment.end, end) - max(segment.start, start)
        if shared > 0:
            covered[segment.action] = covered.get(segment.action, 0.0) + shared
    return max(covered, key=lambda action: covered[action], default=None)


def place_of(reviewed: Reviewed, start: float, end: float, human: str | None = None) -> Place:
    """A stretch of a demonstration with what human and model mostly make of it.

    Parameters
    ----------
    reviewed : Reviewed
    start, end : float
        Seconds.
    human : str, optional
        What the human makes of it, where that is known better.
    """
    predicted = action_over(reviewed.predicted, start, end)
    confidence = None
    if predicted is not None and reviewed.certainty is not None:
        confidence = reviewed.certainty.of_action(predicted, start, end)
    human = human or action_over(reviewed.human, start, end)
    return Place(reviewed.id, start, end, human, predicted, confidence)


def place_at(reviewed: Reviewed, time: float) -> Place | None:
    """The stretch around a time (s) in which neither human nor model changes their mind.

    None where nothing is labelled and nothing is predicted there.
    """
    start, end = reviewed.start, reviewed.end
    found = False
    for segments in (reviewed.human, reviewed.predicted):
        for segment in segments:
            if segment.start <= time < segment.end:
                found = True
                start, end = max(start, segment.start), min(end, segment.end)
            elif segment.end <= time:
                start = max(start, segment.end)
            else:
                end = min(end, segment.start)
    return place_of(reviewed, start, end) if found else None
