"""What a coder may see of an outcome: nothing of demonstrations that are to be coded blind."""

from __future__ import annotations

from dataclasses import replace

from forcelab.gui.document import Document
from forcelab.review.outcome import Outcome

__all__ = ["blind_to", "seen_of"]


def blind_to(document: Document) -> frozenset[str]:
    """The demonstrations that the document's coder is assigned to code blind, and has not yet.

    Raises
    ------
    ForcelabError
        If the project cannot be read.
    """
    if document.project is None:
        return frozenset()
    return frozenset(
        one.demonstration
        for one in document.project.assignments(document.author)
        if one.blind and one.done is None
    )


def seen_of(document: Document) -> Outcome | None:
    """The outcome that is reviewed, without what the coder is assigned to code blind.

    Scores that are pooled over demonstrations stay as the run has them.

    Raises
    ------
    ForcelabError
        If the project cannot be read.
    """
    outcome, blind = document.outcome, blind_to(document)
    if outcome is None or not blind:
        return outcome
    return replace(
        outcome,
        tested=tuple(one for one in outcome.tested if one.id not in blind),
        proposals=tuple(one for one in outcome.proposals if one.id not in blind),
    )
