"""Verdicts on differences: who is right, as people judge, and the edits that follow."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace

from forcelab.labels import Interval
from forcelab.project import Edit, Project, StoredVerdict, Verdict
from forcelab.project.records import VerdictKind
from forcelab.review.differences import Difference, action_as_coded
from forcelab.review.run_result import RunResult

#: An interval covers a difference if it shares this part of it.
COVERED = 0.5


@dataclass(frozen=True, slots=True)
class VerdictCount:
    """Counts of verdicts where human and model see a certain pair of actions."""

    human: str | None
    predicted: str | None
    human_right: int
    model_right: int
    ambiguous: int

    @property
    def total(self) -> int:
        """Verdicts in all."""
        return self.human_right + self.model_right + self.ambiguous


def applies_to(verdict: Verdict, difference: Difference) -> bool:
    """Whether a verdict is about a difference, which another recogniser may find a bit beside."""
    return (
        verdict.human == difference.human
        and difference.predicted in (verdict.predicted, None)
        and covers(verdict, difference)
    )


def covers(interval: Interval, difference: Difference) -> bool:
    """Whether an interval of the same demonstration covers most of a difference."""
    shared = min(interval.end, difference.end) - max(interval.start, difference.start)
    return shared >= COVERED * difference.duration


def record_verdict(
    project: Project,
    run: RunResult,
    difference: Difference,
    verdict: VerdictKind,
    author: str,
    edit: Edit | None = None,
) -> StoredVerdict:
    """Store an author's verdict on a difference; no label changes (see :func:`model_action`).

    `edit` is the one that gave the coder's track the model's action; the verdict is undone with it.
    """
    return project.coding.add_verdict(
        Verdict(
            difference.demonstration,
            difference.start,
            difference.end,
            difference.human,
            difference.predicted,
            author=author,
            coder=run.author,
            verdict=verdict,
            run=run.number or None,
            time=edit.time if edit is not None else None,
        )
    )


def withdraw_verdict(project: Project, verdict: StoredVerdict, author: str) -> StoredVerdict:
    """Withdraw a verdict; its difference is open again."""
    return project.coding.add_verdict(
        replace(verdict, author=author, verdict="withdrawn", time=None)
    )


def model_action(run: RunResult, difference: Difference) -> str | None:
    """The model's action over a difference, as the coder spells it; None for unlabelled."""
    action, result = difference.predicted, run.find(difference.demonstration)
    if action is None or result is None:
        return action
    return action_as_coded(action, run, result)


def count_verdicts(verdicts: Iterable[Verdict]) -> tuple[VerdictCount, ...]:
    """Counts of verdicts by pair of actions, the most frequent first."""
    counts: dict[tuple[str | None, str | None], Counter[str]] = {}
    for verdict in verdicts:
        pair = (verdict.human, verdict.predicted)
        counts.setdefault(pair, Counter())[verdict.verdict] += 1
    judged = [
        VerdictCount(human, predicted, counted["human"], counted["model"], counted["ambiguous"])
        for (human, predicted), counted in counts.items()
    ]
    return tuple(sorted(judged, key=lambda j: (-j.total, j.human or "", j.predicted or "")))
