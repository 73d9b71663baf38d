"""Confidence intervals of scores by the percentile bootstrap over demonstrations.

Demonstrations are resampled with replacement, as many as there are, and each resample is scored;
the interval holds the middle 95 % of those scores. Counts of demonstrations add up, so a resample
is a row of weights, and all resamples together are a few products of matrices.

Sources: Efron, "Bootstrap methods: another look at the jackknife", Annals of Statistics 7(1), 1979,
the bootstrap; Efron, "Nonparametric standard errors and confidence intervals", Canadian Journal of
Statistics 9(2), 1981, section 4, the percentile interval. It is neither widened nor corrected for
bias and tends to be too narrow for a handful of demonstrations. It says nothing of what another
training of the same recogniser would give.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from forcelab.arrays import Real, Whole
from forcelab.recognition.metrics import METRICS, Counts, look_up, nested, score_resamples
from forcelab.text import counted


def draw_resamples(demonstrations: int, resamples: int, seed: int) -> Whole:
    """How often each demonstration is drawn in each resample, shape (resamples, demonstrations)."""
    random = np.random.default_rng(seed)
    chances = np.full(demonstrations, 1.0 / demonstrations)
    return random.multinomial(demonstrations, chances, size=resamples)


#: The share of resamples that an interval holds.
LEVEL = 0.95
RESAMPLES = 2000
#: Of fewer demonstrations there are at most three different resamples: no interval.
FEWEST = 3

#: What the intervals are, in words.
METHOD = f"percentile bootstrap over demonstrations ({RESAMPLES:,} resamples)"

Range = tuple[float, float]


@dataclass(frozen=True)
class Intervals:
    """Intervals of pooled scores."""

    #: Lower and upper end by the names of :data:`~forcelab.recognition.metrics.METRICS`, in the
    #: metric's own unit; None where the metric is not defined
    values: Mapping[str, Range | None] = field(default_factory=dict)
    reason: str = ""  # why there is none at all; empty where there are some
    seed: int = 0  # of the resamples

    def __getitem__(self, name: str) -> Range | None:
        return self.values.get(name)

    def to_json(self) -> dict[str, Any]:
        """Lists ``[lower, upper]`` or None under the names that the scores have in their JSON."""
        intervals = {name: self[name] for name in METRICS}
        return {
            "method": METHOD,
            "level": LEVEL,
            "resamples": RESAMPLES,
            "seed": self.seed,
            "reason": self.reason or None,
        } | nested({name: None if ends is None else list(ends) for name, ends in intervals.items()})

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> Intervals:
        """The inverse of :meth:`to_json`."""
        intervals = {name: look_up(record, name) for name in METRICS}
        values = {name: None if ends is None else tuple(ends) for name, ends in intervals.items()}
        return cls(values, record.get("reason") or "", int(record.get("seed", 0)))


def score_intervals(parts: Sequence[Counts], seed: int = 0) -> Intervals:
    """Intervals of the pooled scores of demonstrations, counted with the same actions."""
    if reason := _too_few_reason(len(parts)):
        return Intervals(reason=reason, seed=seed)
    resampled = score_resamples(parts, draw_resamples(len(parts), RESAMPLES, seed))
    return Intervals({name: percentile_interval(resampled[name]) for name in METRICS}, seed=seed)


def difference_intervals(
    first: Sequence[Counts], second: Sequence[Counts], seed: int = 0
) -> Intervals:
    """Intervals of the second minus the first, both of which tested the same demonstrations.

    The two are resampled together, so that what is hard for both does not widen the interval.
    """
    if len(first) != len(second):
        raise ValueError(f"{len(first)} demonstrations cannot be paired with {len(second)}")
    if reason := _too_few_reason(len(first)):
        return Intervals(reason=reason, seed=seed)
    weights = draw_resamples(len(first), RESAMPLES, seed)
    before, after = score_resamples(first, weights), score_resamples(second, weights)
    return Intervals({n: percentile_interval(after[n] - before[n]) for n in METRICS}, seed=seed)


def _too_few_reason(demonstrations: int) -> str:
    """Why so few demonstrations have no interval; empty if they have."""
    if demonstrations >= FEWEST:
        return ""
    few = counted(demonstrations, "demonstration")
    return f"An interval needs {FEWEST} demonstrations; {few} cannot tell how they differ."


def percentile_interval(values: Real) -> Range | None:
    """The middle of resampled scores; None where no resample has one."""
    values = values[np.isfinite(values)]
    if len(values) == 0:
        return None
    tail = 50 * (1 - LEVEL)
    low, high = np.percentile(values, [tail, 100 - tail])
    return float(low), float(high)
