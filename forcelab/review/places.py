"""Places in a demonstration that are worth a look."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Place"]


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
