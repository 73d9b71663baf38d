"""Rows and columns of the scores: pooled with intervals, then every demonstration."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass

from forcelab.gui.review.metric_words import Metric
from forcelab.gui.review.rows import Column, Row
from forcelab.jobs import Progress
from forcelab.recognition.intervals import METHOD, Intervals, intervals
from forcelab.recognition.metrics import timed_counts
from forcelab.review.run_result import Outcome, Reviewed

__all__ = ["STAGES", "Sorting", "columns_of", "computing", "rows_of"]

#: As the scores name them.
STAGES = ("raw", "filtered")
#: Rows at the top that are never sorted: pooled and its intervals.
FIXED = 2


@dataclass(frozen=True, slots=True)
class Sorting:
    """By which column the demonstrations are sorted; None for the run's order."""

    column: int | None = None
    descending: bool = False


def computing(outcome: Outcome) -> Generator[Progress, None, dict[str, Intervals]]:
    """The intervals of both stages: as the run has them, otherwise from its segments.

    Yields
    ------
    Progress
    """
    result = {}
    for stage in STAGES:
        stored = outcome.scores.get(stage, {}).get("intervals")
        if stored is not None:
            result[stage] = Intervals.from_json(stored)
            continue
        counts = []
        for number, one in enumerate(outcome.tested, 1):
            if stage in one.stages:
                counts.append(timed_counts(one.human, one.stages[stage], outcome.actions))
            yield Progress(number, len(outcome.tested), one.name)
        result[stage] = intervals(counts, outcome.settings.seed)
    return result


def columns_of(metrics: Sequence[Metric]) -> tuple[Column, ...]:
    """Raw and filtered of each metric, beside one another."""
    words = {
        "raw": "raw",
        "filtered": "filtered",
    }
    return tuple(
        Column(f"{metric.title}\n{words[stage]}", metric.tip)
        for metric in metrics
        for stage in STAGES
    )


def rows_of(
    outcome: Outcome,
    seen: Sequence[Reviewed],
    metrics: Sequence[Metric],
    found: Mapping[str, Intervals],
    sorting: Sorting,
) -> tuple[tuple[Row, ...], tuple[str, ...]]:
    """All rows, and the ids of the demonstrations below the fixed ones.

    Parameters
    ----------
    outcome : Outcome
    seen : sequence of Reviewed
        The demonstrations that the coder may see.
    metrics : sequence of Metric
    found : mapping of str to Intervals
        By stage; empty while they are computed.
    sorting : Sorting
    """
    pairs = [(metric, stage) for metric in metrics for stage in STAGES]
    pooled = [
        metric.value(outcome.scores.get(stage, {}).get("pooled", {})) for metric, stage in pairs
    ]
    each = {
        one.id: [
            metric.value(scores[stage]) if stage in scores else None for metric, stage in pairs
        ]
        for one, scores in _by_demonstration(outcome)
    }
    shown = [one for one in seen if one.id in each]
    if sorting.column is not None:
        shown.sort(key=lambda one: _rank(each[one.id][sorting.column or 0], sorting.descending))
    rows = [
        _row("pooled", pairs, pooled, bold=True),
        _interval_row(pairs, found),
        *(_row(one.name, pairs, each[one.id]) for one in shown),
    ]
    return tuple(rows), tuple(one.id for one in shown)


def _by_demonstration(outcome: Outcome) -> list[tuple[Reviewed, dict[str, Mapping[str, object]]]]:
    """Each tested demonstration with its scores by stage; they stand in the order of the tested."""
    lists = {stage: outcome.scores.get(stage, {}).get("demonstrations", ()) for stage in STAGES}
    return [
        (one, {stage: found[i] for stage, found in lists.items() if i < len(found)})
        for i, one in enumerate(outcome.tested)
    ]


def _row(
    name: str,
    pairs: Sequence[tuple[Metric, str]],
    values: Sequence[float | None],
    *,
    bold: bool = False,
) -> Row:
    """Numbers as texts."""
    cells = tuple(metric.text(value) for (metric, _), value in zip(pairs, values, strict=True))
    return Row(cells, name, bold=bold)


def _interval_row(pairs: Sequence[tuple[Metric, str]], found: Mapping[str, Intervals]) -> Row:
    """The intervals of what is pooled, and how they were made or why there are none."""
    name = "95 % interval"
    if not found:
        tip = "The intervals are being computed."
        return Row(("…",) * len(pairs), name, tip)
    reason = next((one.reason for one in found.values() if one.reason), "")
    cells = tuple(
        metric.span(found[stage][metric.path] if stage in found else None)
        for metric, stage in pairs
    )
    return Row(cells, name, reason or METHOD)


def _rank(value: float | None, descending: bool) -> float:
    """What is sorted by; a missing number comes last either way."""
    if value is None:
        return math.inf
    return -value if descending else value
