"""Verdicts on differences: what people say about them, and what becomes of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from forcelab.project import Edit, Project, StoredVerdict, Verdict
from forcelab.project.records import VerdictKind
from forcelab.review.differences import Difference, spelt_back
from forcelab.review.run_result import Outcome

#: A place covers a difference if it shares this part of it.
COVERED = 0.5


@dataclass(frozen=True, slots=True)
class Judged:
    """How often who was right where a human and a model see a certain pair of actions."""

    human: str | None
    predicted: str | None
    human_right: int
    model_right: int
    ambiguous: int

    @property
    def total(self) -> int:
        """Verdicts in all."""
        return self.human_right + self.model_right + self.ambiguous


def speaks_of(verdict: Verdict, difference: Difference) -> bool:
    """Whether a verdict is about a difference, which another recogniser may find a bit beside."""
    return (
        verdict.human == difference.human
        and difference.predicted in (verdict.predicted, None)
        and covers(verdict, difference)
    )


def covers(place: Verdict | Difference, difference: Difference) -> bool:
    """Whether a place of the same demonstration covers most of a difference."""
    shared = min(place.end, difference.end) - max(place.start, difference.start)
    return shared >= COVERED * difference.duration


def judge(
    project: Project,
    outcome: Outcome,
    difference: Difference,
    verdict: VerdictKind,
    author: str,
    edit: Edit | None = None,
) -> StoredVerdict:
    """Keep what somebody says about a difference; no label changes (see :func:`action_for`).

    Parameters
    ----------
    project : Project
    outcome : Outcome
        Where the difference was found.
    difference : Difference
    verdict : "human", "model" or "ambiguous"
    author : str
        Who judges.
    edit : Edit, optional
        What gave the coder's track what the model sees; the verdict is undone with it.
    """
    return project.coding.add_verdict(
        Verdict(
            demonstration=difference.demonstration,
            author=author,
            coder=outcome.author,
            start=difference.start,
            end=difference.end,
            human=difference.human,
            predicted=difference.predicted,
            verdict=verdict,
            run=outcome.number or None,
            time=edit.time if edit is not None else None,
        )
    )


def withdraw(project: Project, verdict: StoredVerdict, author: str) -> StoredVerdict:
    """Let a verdict count no more; what it was on is open again."""
    fields = {name: getattr(verdict, name) for name in Verdict.__dataclass_fields__}
    fields |= {"author": author, "verdict": "withdrawn", "time": None}
    return project.coding.add_verdict(Verdict(**fields))


def action_for(outcome: Outcome, difference: Difference) -> str | None:
    """What the model sees over a difference, spelt as the coder spells it; None is nothing."""
    action, reviewed = difference.predicted, outcome.find(difference.demonstration)
    if action is None or reviewed is None:
        return action
    return spelt_back(action, outcome, reviewed)


def report(verdicts: Iterable[Verdict]) -> tuple[Judged, ...]:
    """Who was right how often, by pair of actions; the pair with the most verdicts first.

    Parameters
    ----------
    verdicts : iterable of Verdict
        Those that count, as of ``project.coding.verdicts``.
    """
    counts: dict[tuple[str | None, str | None], Counter[str]] = {}
    for verdict in verdicts:
        pair = (verdict.human, verdict.predicted)
        counts.setdefault(pair, Counter())[verdict.verdict] += 1
    found = [
        Judged(human, predicted, said["human"], said["model"], said["ambiguous"])
        for (human, predicted), said in counts.items()
    ]
    return tuple(sorted(found, key=lambda j: (-j.total, j.human or "", j.predicted or "")))
