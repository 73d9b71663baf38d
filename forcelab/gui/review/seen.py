"""What a coder may see of an outcome: nothing of demonstrations that are to be coded blind."""

from __future__ import annotations

from dataclasses import replace

from forcelab.gui.document import Document
from forcelab.review.outcome import Outcome

__all__ = ["seen_of"]


def seen_of(document: Document) -> Outcome | None:
    """The outcome that is reviewed, without what the coder is assigned to code blind.

    Scores that are pooled over demonstrations stay as the run has them.

    Raises
    ------
    ForcelabError
        If the project cannot be read.
    """
    outcome, project = document.outcome, document.project
    if outcome is None or project is None:
        return outcome
    author = document.author
    blind = {
        assignment.demonstration
        for assignment in project.assignments(author)
        if project.is_blind(assignment.demonstration, author)
    }
    if not blind:
        return outcome
    return replace(
        outcome,
        tested=tuple(one for one in outcome.tested if one.id not in blind),
        proposals=tuple(one for one in outcome.proposals if one.id not in blind),
    )
