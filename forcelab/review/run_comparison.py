"""Two runs side by side: what differs in their settings, and what that did to the scores."""

from __future__ import annotations

import json
from collections.abc import Generator, Mapping
from dataclasses import dataclass
from typing import Any

from forcelab.jobs import Progress, finish
from forcelab.recognition.intervals import Intervals, difference_intervals
from forcelab.recognition.metrics import Counts, count_segments, pool
from forcelab.review.run_result import DemonstrationResult, RunResult

#: The stages of prediction that have scores.
STAGES = ("raw", "filtered")


@dataclass(frozen=True)
class Comparison:
    """Two runs over the demonstrations that both tested.

    Parameters
    ----------
    one, other : RunResult
    shared : tuple of str
        Ids of the demonstrations that both tested, in the order of `one`.
    names : mapping of str to str
        Their names by id.
    pooled : mapping of str to (mapping, mapping)
        By stage the scores of both, pooled over the shared demonstrations, as of
        ``forcelab evaluate --json``.
    each : mapping of str to mapping of str to (mapping, mapping)
        The same for each shared demonstration, by stage and id.
    intervals : mapping of str to Intervals
        By stage, of `other` minus `one`: a paired bootstrap over the shared demonstrations.
    settings : tuple of (str, str, str)
        Name and both values of what was asked for differently.
    relabelled : tuple of str
        Ids of shared demonstrations whose human labels differ between the runs: there the
        difference is not the recognisers' alone.
    """

    one: RunResult
    other: RunResult
    shared: tuple[str, ...]
    names: Mapping[str, str]
    pooled: Mapping[str, tuple[Mapping[str, Any], Mapping[str, Any]]]
    each: Mapping[str, Mapping[str, tuple[Mapping[str, Any], Mapping[str, Any]]]]
    intervals: Mapping[str, Intervals]
    settings: tuple[tuple[str, str, str], ...]
    relabelled: tuple[str, ...]


def compare_runs(one: RunResult, other: RunResult) -> Comparison:
    """Compare two runs over what both tested.

    Parameters
    ----------
    one, other : RunResult
        From ``load_run(project, number)`` or ``latest_run(project)``.

    Returns
    -------
    Comparison
        Differences are what `other` has more.
    """
    return finish(comparison_job(one, other))


def comparison_job(one: RunResult, other: RunResult) -> Generator[Progress, None, Comparison]:
    """Compare two runs over what both tested.

    Scores are those that the runs hold; where one of them tested more than the other, pooled
    scores are made anew from the segments of the shared demonstrations.

    Parameters
    ----------
    one, other : RunResult

    Yields
    ------
    Progress
    """
    theirs = {each.id: each for each in other.tested}
    pairs = [(mine, theirs[mine.id]) for mine in one.tested if mine.id in theirs]
    shared = tuple(mine.id for mine, _ in pairs)
    pooled, each, found = {}, {}, {}
    for step, stage in enumerate(STAGES):
        counts: tuple[list[Counts], list[Counts]] = ([], [])
        for number, pair in enumerate(pairs):
            if all(stage in side.stages for side in pair):
                for outcome, side, into in zip((one, other), pair, counts, strict=True):
                    into.append(count_segments(side.human, side.stages[stage], outcome.actions))
            yield Progress(step * len(pairs) + number + 1, 2 * len(pairs), pair[0].name)
        sides = list(zip((one, other), counts, strict=True))
        first, second = (_pooled(outcome, stage, shared, parts) for outcome, parts in sides)
        pooled[stage] = (first, second)
        mine, yours = (_by_id(outcome, stage) for outcome in (one, other))
        each[stage] = {id_: (mine.get(id_, {}), yours.get(id_, {})) for id_ in shared}
        found[stage] = difference_intervals(*counts, seed=one.settings.seed)
    return Comparison(
        one,
        other,
        shared,
        {mine.id: mine.name for mine, _ in pairs},
        pooled,
        each,
        found,
        settings_that_differ(one, other),
        tuple(mine.id for mine, yours in pairs if mine.human != yours.human),
    )


def settings_that_differ(one: RunResult, other: RunResult) -> tuple[tuple[str, str, str], ...]:
    """Name and both values, as text, of everything that the runs were asked for differently."""
    mine, yours = _requested(one), _requested(other)
    return tuple(
        (name, as_text(mine.get(name)), as_text(yours.get(name)))
        for name in dict.fromkeys((*mine, *yours))
        if mine.get(name) != yours.get(name)
    )


def _requested(outcome: RunResult) -> dict[str, Any]:
    """What an outcome was made with, by name."""
    return outcome.settings.to_json() | {
        "tasks": list(outcome.tasks),
        "test task": outcome.test_task,
        "coder": outcome.author,
        "apart": outcome.apart,
        "groups left out": outcome.folds or None,
    }


def as_text(value: object) -> str:
    """A value as short text."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} → {as_text(given)}" for key, given in value.items()) or "–"
    if isinstance(value, (list, tuple)):
        return " + ".join(as_text(one) for one in value) or "–"
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


def _pooled(
    outcome: RunResult, stage: str, shared: tuple[str, ...], counts: list[Counts]
) -> Mapping[str, Any]:
    """The pooled scores of the shared demonstrations: as stored if those are all ever tested."""
    stored: Mapping[str, Any] | None = outcome.scores.get(stage, {}).get("pooled")
    if stored is not None and len(shared) == len(outcome.tested) + outcome.removed:
        return stored
    return pool("pooled", counts).to_json() if counts else {}


def _by_id(outcome: RunResult, stage: str) -> dict[str, Mapping[str, Any]]:
    """The scores of each tested demonstration; the run lists them in the same order."""
    listed = outcome.scores.get(stage, {}).get("demonstrations", ())
    tested: tuple[DemonstrationResult, ...] = outcome.tested
    return {one.id: scores for one, scores in zip(tested, listed, strict=False)}
