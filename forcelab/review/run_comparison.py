"""Two runs compared: settings that differ, and the scores over what both tested."""

from __future__ import annotations

import json
from collections.abc import Generator, Mapping
from dataclasses import dataclass
from typing import Any

from forcelab.jobs import Progress, finish
from forcelab.recognition.intervals import Intervals, difference_intervals
from forcelab.recognition.metrics import Counts, count_segments, pool
from forcelab.recognition.results import STAGES, DemonstrationResult
from forcelab.review.run_result import RunResult


@dataclass(frozen=True)
class Comparison:
    """Two runs over the demonstrations that both tested."""

    first: RunResult
    second: RunResult
    #: What both have found for each demonstration that both tested, in the order of `first`
    pairs: tuple[tuple[DemonstrationResult, DemonstrationResult], ...]
    #: By stage the scores of both, pooled over the shared demonstrations, as of ``forcelab evaluate
    #: --json``
    pooled: Mapping[str, tuple[Mapping[str, Any], Mapping[str, Any]]]
    #: By stage, of `second` minus `first`: a paired bootstrap over the shared demonstrations
    intervals: Mapping[str, Intervals]
    #: Name and both values of what was asked for differently
    settings: tuple[tuple[str, str, str], ...]

    @property
    def relabelled(self) -> tuple[DemonstrationResult, ...]:
        """The demonstrations whose human labels differ between the runs.

        There the difference is not the recognisers' alone.
        """
        return tuple(mine for mine, yours in self.pairs if mine.human != yours.human)


def compare_runs(first: RunResult, second: RunResult) -> Comparison:
    """Compare two runs over what both tested.

    Parameters
    ----------
    first, second : RunResult
        From ``load_run(project, number)`` or ``latest_run(project)``.

    Returns
    -------
    Comparison
        Differences are what `second` has more.

    Examples
    --------
    >>> comparison = forcelab.compare_runs(run, run)
    >>> len(comparison.pairs), comparison.settings
    (3, ())
    """
    return finish(comparison_job(first, second))


def comparison_job(first: RunResult, second: RunResult) -> Generator[Progress, None, Comparison]:
    """Compare two runs over what both tested.

    Scores are those that the runs store; where one of them tested more than the other, pooled
    scores are computed anew from the segments of the shared demonstrations.
    """
    second_by_id = {each.id: each for each in second.tested}
    pairs = tuple(
        (result, second_by_id[result.id]) for result in first.tested if result.id in second_by_id
    )
    pooled, intervals = {}, {}
    for step, stage in enumerate(STAGES):
        counts: tuple[list[Counts], list[Counts]] = ([], [])
        for number, pair in enumerate(pairs):
            if all(stage in side.stages for side in pair):
                for run, side, counts_of_run in zip((first, second), pair, counts, strict=True):
                    counts_of_run.append(
                        count_segments(side.human, side.stages[stage], run.actions)
                    )
            yield Progress(step * len(pairs) + number + 1, 2 * len(pairs), pair[0].name)
        pooled[stage] = (
            _pooled(first, stage, len(pairs), counts[0]),
            _pooled(second, stage, len(pairs), counts[1]),
        )
        intervals[stage] = difference_intervals(*counts, seed=first.settings.seed)
    return Comparison(first, second, pairs, pooled, intervals, settings_that_differ(first, second))


def settings_that_differ(first: RunResult, second: RunResult) -> tuple[tuple[str, str, str], ...]:
    """Name and both values, as text, of every setting and selection in which the runs differ."""
    first_settings, second_settings = _requested(first), _requested(second)
    return tuple(
        (name, as_text(first_settings.get(name)), as_text(second_settings.get(name)))
        for name in dict.fromkeys((*first_settings, *second_settings))
        if first_settings.get(name) != second_settings.get(name)
    )


def _requested(run: RunResult) -> dict[str, Any]:
    """A run's settings and selection, by name."""
    return run.settings.to_json() | {
        "tasks": list(run.tasks),
        "test task": run.test_task,
        "coder": run.author,
        "also learnt from": run.also_from or None,
        "apart": run.apart,
        "groups left out": run.folds or None,
    }


def as_text(value: object) -> str:
    """A value as short text."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} → {as_text(item)}" for key, item in value.items()) or "–"
    if isinstance(value, (list, tuple)):
        return " + ".join(as_text(item) for item in value) or "–"
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


def _pooled(run: RunResult, stage: str, shared: int, counts: list[Counts]) -> Mapping[str, Any]:
    """The pooled scores of `shared` demonstrations: as stored if those are all ever tested."""
    stored: Mapping[str, Any] | None = run.scores.get(stage, {}).get("pooled")
    if stored is not None and shared == len(run.tested) + run.removed:
        return stored
    return pool("pooled", counts).to_json() if counts else {}
