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
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.metrics import OVERLAPS, Counts, Events
from forcelab.text import counted

Real = NDArray[np.float64]
Weights = NDArray[np.int64]

#: The parts of :class:`~forcelab.recognition.metrics.Events`.
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


def draw_resamples(demonstrations: int, resamples: int, seed: int) -> Weights:
    """How often each demonstration is drawn in each resample, shape (resamples, demonstrations)."""
    random = np.random.default_rng(seed)
    chances = np.full(demonstrations, 1.0 / demonstrations)
    return random.multinomial(demonstrations, chances, size=resamples)


def score_resamples(parts: Sequence[Counts], weights: Weights) -> dict[str, Real]:
    """Score resamples, given weights (r, n) of n demonstrations, as pooling them would: (r,) each.

    A key for each of :data:`METRICS`; NaN where the metric is not defined.
    """
    result = _frame_metrics(parts, weights)
    edits = np.array([sum(part.edits) for part in parts])
    result["edit"] = _fractions(weights @ edits, weights @ np.array([len(p.edits) for p in parts]))
    for name in ("segments", "labelled_segments"):
        segments = np.stack([getattr(part, name).ravel() for part in parts])
        matched = (weights @ segments).reshape(len(weights), len(OVERLAPS), 3)
        for number, overlap in enumerate(OVERLAPS):
            true, false, missed = (matched[:, number, column] for column in range(3))
            f1 = "f1" if name == "segments" else "f1_labelled"
            result[f"{f1}.{overlap}"] = _fractions(2 * true, 2 * true + false + missed)
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


def _frame_metrics(parts: Sequence[Counts], weights: Weights) -> dict[str, Real]:
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


def _percentiles(parts: Sequence[Real], weights: Weights, percents: tuple[int, ...]) -> list[Real]:
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
        for percent, values in zip(percents, result, strict=True):
            rank = np.maximum(count - 1, 0) * (percent / 100)
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
        Lower and upper end by the names of :data:`~forcelab.recognition.intervals.METRICS`, in
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
            interval = self[name]
            inner[last] = None if interval is None else list(interval)
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
        intervals = {name: look_up(record, name) for name in METRICS}
        values = {name: None if ends is None else tuple(ends) for name, ends in intervals.items()}
        return cls(values, record.get("reason") or "", int(record.get("seed", 0)))


def look_up(record: Mapping[str, Any], name: str) -> Any:
    """The value in a JSON of scores under a name such as ``"f1.50"``; None if there is none."""
    value: Any = record
    for part in name.split("."):
        if not isinstance(value, (dict, Mapping)):  # to ask for a dict alone is much faster
            return None
        value = value.get(part)
    return value


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


def percentile_interval(values: NDArray[np.float64]) -> Range | None:
    """The middle of resampled scores; None where no resample has one."""
    values = values[np.isfinite(values)]
    if len(values) == 0:
        return None
    tail = 50 * (1 - LEVEL)
    low, high = np.percentile(values, [tail, 100 - tail])
    return float(low), float(high)
