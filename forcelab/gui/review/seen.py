"""What a coder may see of an outcome: nothing of demonstrations that are to be coded blind."""

from __future__ import annotations

from dataclasses import replace

from forcelab.gui.document import Document
from forcelab.review.run_result import Outcome

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
    return document.project.blind_to(document.author)


def seen_of(document: Document) -> Outcome | None:
    """The outcome that is reviewed, without what the coder is assigned to code blind.

    Scores that are pooled over demonstrations stay as the run has them. Its remarks name segments
    and demonstrations, so where it rests on labels that are hidden none of them is told. Such
    labels are nobody's: how often they were edited since is not told either.

    Raises
    ------
    ForcelabError
        If the project cannot be read.
    """
    outcome, blind = document.outcome, blind_to(document)
    if outcome is None or not blind:
        return outcome
    hidden = {
        used
        for used in outcome.labels
        if used.edit and used.author != document.author and used.demonstration in blind
    }
    return replace(
        outcome,
        labels=tuple(replace(u, author="") if u in hidden else u for u in outcome.labels),
        remarks=() if hidden else outcome.remarks,
        tested=tuple(one for one in outcome.tested if one.id not in blind),
        proposals=tuple(one for one in outcome.proposals if one.id not in blind),
    )
