"""Error against run time: one row for each thing measured, and one form for all tables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from forcelab.errors import InputError
from forcelab.measure.timing import Timed, machine
from forcelab.resources import versions

#: Marks a row of the Pareto front in the text table.
FRONT = "*"
MEGABYTE = 1e6

#: What is kept of a result that was timed: its error, and further figures by name and unit.
Judgement = tuple[float, dict[str, float]]


@dataclass(frozen=True)
class Row:
    """What one setting of one method costs, and how wrong it is.

    A method that refuses its work has its sentence in `refusal` and no numbers.
    """

    name: str  # the method, such as a solver's name
    setting: str  # its step, tolerance or the like, with its unit
    #: What it was run on, such as ``"foam, 6 lanes x 1 s"``. Only rows of one size compare.
    size: str
    reference: str  # what the result was compared with, and how well that is known itself
    error: float | None = None  # in the table's unit, not negative
    #: seconds and spread: Median of the CPU time in the table's unit, above zero, and its
    #: interquartile range.
    seconds: float | None = None
    spread: float | None = None
    peak_bytes: int | None = None  # peak of the memory taken
    #: Other figures of the same run by their name and unit, such as ``"largest (N)"``.
    further: Mapping[str, float] = field(default_factory=dict, hash=False)
    #: Whether no other row of this size is better in one and as good in the other of `error` and
    #: `seconds`.
    pareto: bool = False
    refusal: str = ""  # why there is no number; empty where there are numbers

    def __post_init__(self) -> None:
        numbers = (self.error, self.seconds, self.spread, self.peak_bytes)
        if self.refusal:
            sound = all(n is None for n in numbers) and not self.further and not self.pareto
        else:
            checked = [-1.0 if n is None else n for n in (*numbers, *self.further.values())]
            sound = all(math.isfinite(n) for n in checked) and min(checked[:4]) >= 0 < checked[1]
        if not sound:
            raise InputError(
                f"A row has either all its numbers, finite and not negative, or a refusal; that "
                f"of '{self.name}, {self.setting}' has {numbers} and '{self.refusal}'."
            )

    @property
    def point(self) -> tuple[float, float] | None:
        """Seconds and error; None where the work was refused."""
        if self.seconds is None or self.error is None:
            return None
        return self.seconds, self.error


def timed_row(
    name: str, setting: str, size: str, reference: str, timed: Timed[Judgement], scale: float
) -> Row:
    """The row of what was timed, or of what it was refused for.

    `scale`: what turns a second into the table's unit.
    """
    if timed.judged is None:
        return Row(name, setting, size, reference, refusal=timed.refusal)
    (error, further), seconds = timed.judged, scale * timed.seconds
    spread = scale * timed.spread
    return Row(name, setting, size, reference, error, seconds, spread, timed.peak_bytes, further)


def with_front(rows: Sequence[Row]) -> tuple[Row, ...]:
    """The same rows, with those of the Pareto front marked, for each size by itself.

    A row is on the front unless another one of its size is at least as good in both error and
    seconds and better in one of them. Of two equal rows either both are on it or none.
    """
    points = {i: row.point for i, row in enumerate(rows)}
    ordered = sorted((point, i) for i, point in points.items() if point is not None)
    last: dict[str, tuple[float, float]] = {}  # the front's slowest row so far, for each size
    front = set()
    for point, i in ordered:
        before = last.get(rows[i].size, (0.0, math.inf))
        if point[1] < before[1] or point == before:
            last[rows[i].size] = point
            front.add(i)
    return tuple(replace(row, pareto=i in front) for i, row in enumerate(rows))


@dataclass(frozen=True)
class Table:
    """All rows of one measurement, with what its columns mean."""

    title: str  # what was measured
    #: error and seconds: What the two columns hold, with their units.
    error: str
    seconds: str
    rows: tuple[Row, ...]  # in the order in which they are shown
    form: str = ".2e"  # how errors and further figures are written, as a format specification

    def __post_init__(self) -> None:
        if not self.rows:
            raise InputError(f"'{self.title}' has no row; measure at least one thing.")

    @property
    def sizes(self) -> tuple[str, ...]:
        """The sizes, in the order in which they occur."""
        return tuple(dict.fromkeys(row.size for row in self.rows))

    def of(self, size: str) -> tuple[Row, ...]:
        return tuple(row for row in self.rows if row.size == size)

    def cells(self, size: str) -> list[list[str]]:
        """Header and rows of one size as text: the front's mark, name, setting, then numbers."""
        rows = self.of(size)
        further = list(dict.fromkeys(key for row in rows for key in row.further))
        header = ["", "name", "setting", self.error, *further, self.seconds, "spread", "peak MB"]
        return [header, *(_cells(row, further, self.form) for row in rows)]

    def to_json(self) -> dict[str, Any]:
        """The table, the machine and the versions as plain values, without NaN."""
        return {
            "title": self.title,
            "units": {"error": self.error, "seconds": self.seconds},
            "machine": machine(),
            "versions": versions(),
            "rows": [asdict(row) for row in self.rows],
        }


def _cells(row: Row, further: Sequence[str], form: str) -> list[str]:
    if row.error is None or row.seconds is None or row.spread is None or row.peak_bytes is None:
        return ["", row.name, row.setting, "refused", *("" for _ in range(len(further) + 3))]
    return [
        FRONT if row.pareto else "",
        row.name,
        row.setting,
        f"{row.error:{form}}",
        *(f"{row.further[key]:{form}}" if key in row.further else "" for key in further),
        f"{row.seconds:#.3g}",
        f"{row.spread:#.2g}",
        f"{row.peak_bytes / MEGABYTE:.1f}",
    ]
