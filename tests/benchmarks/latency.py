"""How long a person waits: times with their bounds, as a table.

A row holds every sample. What is told of it are quantiles, since what a person notices of a window
is not the mean but the slow ones.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Statistic = Literal["median", "p95", "p99", "worst"]

QUANTILES: dict[Statistic, float] = {"median": 0.5, "p95": 0.95, "p99": 0.99, "worst": 1.0}


@dataclass(frozen=True, slots=True)
class Bound:
    """What a row has to keep."""

    statistic: Statistic  # of the samples
    seconds: float  # it must be less

    def __str__(self) -> str:
        return f"{self.statistic} < {1000 * self.seconds:g}"


@dataclass(frozen=True)
class Latency:
    """How long one thing took, each time that it was done."""

    name: str  # what was done, such as ``"zoom and pan"``
    setting: str  # on what, such as ``"6 x 1e7 samples, 1 s visible"``
    #: Seconds, one for each time; not negative. Empty only with a `refusal`.
    samples: tuple[float, ...] = ()
    bound: Bound | None = None  # what it has to keep
    #: How often the result was wrong, of ``len(samples)``; None where nothing can be wrong. With a
    #: bound, none may be.
    wrong: int | None = None
    #: What it is compared with: the `name` of a row of the same setting, measured in the same run;
    #: empty for none.
    alternative: str = ""
    refusal: str = ""  # why there are no samples; empty where there are

    def at(self, statistic: Statistic) -> float:
        """A quantile of the samples in seconds, between two samples where it lies there."""
        return float(np.quantile(self.samples, QUANTILES[statistic]))

    @property
    def holds(self) -> bool | None:
        """Whether the bound is kept; None where there is none, or nothing was measured."""
        if self.bound is None or self.refusal:
            return None
        return self.at(self.bound.statistic) < self.bound.seconds and not self.wrong


@dataclass(frozen=True, slots=True)
class Level:
    """Something measured beside the times: how much of it there is."""

    name: str
    setting: str
    value: float
    unit: str  # such as ``"MB"``
    most: float  # what its amount, whatever the sign, may be at most

    @property
    def holds(self) -> bool:
        """Whether the bound is kept."""
        return abs(self.value) <= self.most


@dataclass(frozen=True)
class Latencies:
    """All rows of one measurement."""

    title: str  # what was measured, and how
    rows: tuple[Latency, ...]  # in the order in which they are shown
    loads: tuple[float, ...] = ()  # the machine's load (see :func:`load`) before and after
    remarks: tuple[str, ...] = ()  # sentences that belong below the table
    levels: tuple[Level, ...] = ()  # what was measured besides

    def level_cells(self) -> list[list[str]]:
        """Header and levels as text."""
        header = ["what", "on", "amount", "bound", "kept"]
        rows = [
            [
                level.name,
                level.setting,
                f"{level.value:.4g} {level.unit}",
                f"<= {level.most:g}",
                "yes" if level.holds else "NO",
            ]
            for level in self.levels
        ]
        return [header, *rows]

    def ratio(self, row: Latency) -> float | None:
        """How many times as long the row's alternative takes: the ratio of their medians.

        None where there is no alternative, it has no samples, or the row took no time at all.
        """
        for other in self.rows:
            if (other.name, other.setting) == (row.alternative, row.setting):
                if other.samples and row.samples and row.at("median") > 0:
                    return other.at("median") / row.at("median")
                return None
        return None

    def cells(self) -> list[list[str]]:
        """Header and rows as text; times in ms."""
        header = ["what", "on", "times", *QUANTILES, "wrong", "bound", "kept", "alternative takes"]
        return [header, *(self._cells(row) for row in self.rows)]

    def _cells(self, row: Latency) -> list[str]:
        if row.refusal:
            return [row.name, row.setting, "refused", *("" for _ in range(8))]
        holds_text = {True: "yes", False: "NO", None: ""}[row.holds]
        return [
            row.name,
            row.setting,
            str(len(row.samples)),
            *(_milliseconds(row.at(statistic)) for statistic in QUANTILES),
            "" if row.wrong is None else str(row.wrong),
            "" if row.bound is None else str(row.bound),
            holds_text,
            _times(self.ratio(row), row.alternative),
        ]


def load() -> float:
    """How many processes wanted a core on average over the last minute; NaN is never given.

    The number of cores is the most that leaves times undisturbed. Windows does not tell: 0 there.
    """
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0


def _milliseconds(seconds: float) -> str:
    """Milliseconds with three digits."""
    value = 1000 * seconds
    return f"{value:.0f}" if value >= 100 else f"{value:#.3g}"


def _times(ratio: float | None, name: str) -> str:
    """How many times as long an alternative takes."""
    return "" if ratio is None else f"{ratio:.3g} x ({name})"


def refused(names: Sequence[str], setting: str, refusal: str) -> tuple[Latency, ...]:
    """Rows of things that could not be measured, all for one reason."""
    return tuple(Latency(name, setting, refusal=refusal) for name in names)
