"""What is drawn against what: kinds of errors and of times, and the points that come of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from forcelab.measure.rows import Row

__all__ = ["ERRORS", "TIMES", "Kind", "Point", "named", "points_of"]


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of error or of time.

    Parameters
    ----------
    text : str
        What it is called, to be translated.
    of : callable
        Its value of a row that was not refused; None where that has none.
    """

    text: str
    of: Callable[[Row], float | None]

    def title(self) -> str:
        """What it is called in the user's language."""
        return self.text


def _training(row: Row) -> float | None:
    """Features and fit of a minute that is trained on, in CPU seconds."""
    return row.further["features (s/min)"] + row.further["fit (s/min)"]


def _inaccuracy(row: Row) -> float | None:
    """What is missing to a perfect accuracy."""
    return 1.0 - row.further["accuracy"] if "accuracy" in row.further else None


ERRORS = (
    Kind("1 − F1@50", lambda row: row.error),
    Kind("1 − accuracy", _inaccuracy),
    Kind(
        "boundaries off by, median (ms)",
        lambda row: row.further.get("boundary (ms)"),
    ),
    Kind(
        "boundaries off by, 9 of 10 less (ms)",
        lambda row: row.further.get("boundary p90 (ms)"),
    ),
)
TIMES = (
    Kind("recognising a minute (CPU s)", lambda row: row.seconds),
    Kind("training on a minute (CPU s)", _training),
)
#: A fit that was too short for the clock took no longer, in seconds.
SHORTEST = 1e-4


@dataclass(frozen=True, slots=True)
class Point:
    """A row as it is drawn.

    Parameters
    ----------
    place : int
        Of the row in the measurement.
    kind, text : str
        What is varied, and what stands beside the point.
    seconds, error : float
    front : bool
        Whether no other point is better in one and as good in the other.
    """

    place: int
    kind: str
    text: str
    seconds: float
    error: float
    front: bool


def points_of(rows: Sequence[Row], error: Kind, time: Kind) -> tuple[Point, ...]:
    """The points of all rows that have both an error and a time, in their order."""
    from forcelab.measure.rows import with_front

    found: list[tuple[int, Row]] = []
    for place, row in enumerate(rows):
        if row.refusal:
            continue
        wrong, seconds = error.of(row), time.of(row)
        if wrong is not None and seconds is not None:
            seen = replace(row, size="", error=wrong, seconds=max(seconds, SHORTEST))
            found.append((place, seen))
    marked = with_front([row for _, row in found])
    return tuple(
        Point(place, row.name, named(row), row.seconds or 0.0, row.error or 0.0, row.pareto)
        for (place, _), row in zip(found, marked, strict=True)
    )


def named(row: Row) -> str:
    """What a row is called beside its point: presets by their name alone."""
    if row.name == "preset":
        return row.setting
    return f"{row.name}: {row.setting}"
