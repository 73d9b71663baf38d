"""How far scores would move if other demonstrations of the same kind had been recorded.

Demonstrations are resampled with replacement, as many as there are, and each resample is scored;
the interval holds the middle 95 % of those scores. This is the percentile interval.

Sources
-------
Efron, "Bootstrap methods: another look at the jackknife", Annals of Statistics 7(1), 1979, the
bootstrap; Efron, "Nonparametric standard errors and confidence intervals", Canadian Journal of
Statistics 9(2), 1981, section 4: the percentile interval. It is neither widened nor corrected for
bias and tends to be too narrow for a handful of demonstrations. It says nothing of what another
training of the same recogniser would give.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.metrics import Counts
from forcelab.recognition.resampling import METRICS, draws, replicates
from forcelab.text import counted

__all__ = [
    "FEWEST",
    "LEVEL",
    "METHOD",
    "RESAMPLES",
    "Intervals",
    "differences",
    "intervals",
    "look_up",
]

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
    """Intervals of pooled scores.

    Parameters
    ----------
    values : mapping of str to (float, float) or None
        Lower and upper end by the names of :data:`~forcelab.recognition.resampling.METRICS`, in
        the metric's own unit; None where the metric is not defined.
    reason : str
        Why there is none at all; ``""`` where there are some.
    seed : int
        Of the resamples.
    """

    values: Mapping[str, Range | None] = field(default_factory=dict)
    reason: str = ""
    seed: int = 0

    def __getitem__(self, name: str) -> Range | None:
        return self.values.get(name)

    def to_json(self) -> dict[str, Any]:
        """Lists ``[lower, upper]`` or None under the names that the scores have in their JSON."""
        result: dict[str, Any] = {}
        for name in METRICS:
            *path, last = name.split(".")
            inner = result
            for part in path:
                inner = inner.setdefault(part, {})
            found = self[name]
            inner[last] = None if found is None else list(found)
        return {
            "method": METHOD,
            "level": LEVEL,
            "resamples": RESAMPLES,
            "seed": self.seed,
            "reason": self.reason or None,
        } | result

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> Intervals:
        """The inverse of :meth:`to_json`."""
        found = {name: look_up(record, name) for name in METRICS}
        values = {name: None if ends is None else tuple(ends) for name, ends in found.items()}
        return cls(values, record.get("reason") or "", int(record.get("seed", 0)))


def look_up(record: Mapping[str, Any], name: str) -> Any:
    """What stands in a JSON of scores under a name such as ``"f1.50"``; None if nothing does."""
    found: Any = record
    for part in name.split("."):
        if not isinstance(found, (dict, Mapping)):  # to ask for a dict alone is much faster
            return None
        found = found.get(part)
    return found


def intervals(parts: Sequence[Counts], seed: int = 0) -> Intervals:
    """Intervals of the scores of demonstrations that are pooled.

    Parameters
    ----------
    parts : sequence of Counts
        One for each demonstration, all made with the same actions.
    seed : int
        Of the resamples; the same seed gives the same intervals.
    """
    if reason := _too_few(len(parts)):
        return Intervals(reason=reason, seed=seed)
    found = replicates(parts, draws(len(parts), RESAMPLES, seed))
    return Intervals({name: _middle(found[name]) for name in METRICS}, seed=seed)


def differences(one: Sequence[Counts], other: Sequence[Counts], seed: int = 0) -> Intervals:
    """Intervals of `other` minus `one`, both of which tested the same demonstrations.

    The two are resampled together, so that what is hard for both does not widen the interval.

    Parameters
    ----------
    one, other : sequence of Counts, of equal length
        The same demonstrations in the same order; the actions of the two may differ.
    seed : int
        Of the resamples.

    Raises
    ------
    ValueError
        If the lengths differ.
    """
    if len(one) != len(other):
        raise ValueError(f"{len(one)} demonstrations cannot be paired with {len(other)}")
    if reason := _too_few(len(one)):
        return Intervals(reason=reason, seed=seed)
    weights = draws(len(one), RESAMPLES, seed)
    before, after = replicates(one, weights), replicates(other, weights)
    return Intervals({n: _middle(after[n] - before[n]) for n in METRICS}, seed=seed)


def _too_few(demonstrations: int) -> str:
    """Why so few demonstrations have no interval; ``""`` if they have."""
    if demonstrations >= FEWEST:
        return ""
    few = counted(demonstrations, "demonstration")
    return f"An interval needs {FEWEST} demonstrations; {few} cannot tell how they differ."


def _middle(values: NDArray[np.float64]) -> Range | None:
    """The middle of resampled scores; None where no resample has one."""
    values = values[np.isfinite(values)]
    if len(values) == 0:
        return None
    tail = 50 * (1 - LEVEL)
    low, high = np.percentile(values, [tail, 100 - tail])
    return float(low), float(high)
