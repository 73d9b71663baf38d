"""The reviewed run as the coder may see it: without what is coded blind; its actions' styles."""

from __future__ import annotations

from dataclasses import replace

from forcelab.gui.document import Document
from forcelab.review.run_result import Outcome, vocabulary_of
from forcelab.vocabulary import Vocabulary


def blind_demonstrations(document: Document) -> frozenset[str]:
    """The demonstrations that the document's coder is assigned to code blind, and has not yet.

    Raises
    ------
    ForcelabError
        If the project cannot be read.
    """
    if document.project is None:
        return frozenset()
    return document.project.coding.blind_to(document.author)


def visible_outcome(document: Document) -> Outcome | None:
    """The outcome that is reviewed, without what the coder is assigned to code blind.

    Scores that are pooled over demonstrations stay as the run has them. Its remarks name segments
    and demonstrations, so where it rests on labels that are hidden none of them is told. Such
    labels are nobody's: how often they were edited since is not told either.

    Raises
    ------
    ForcelabError
        If the project cannot be read.
    """
    outcome, blind = document.review.run, blind_demonstrations(document)
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


def with_keys(
    vocabulary: Vocabulary, keys: Vocabulary, *, task: str = "", apart: bool = False
) -> Vocabulary:
    """The same looks, each action with the key that paints it now, or with none.

    Parameters
    ----------
    vocabulary : Vocabulary
        How the actions of an outcome look.
    keys : Vocabulary
        Of the open demonstration: its keys are the ones that paint.
    task : str
        The open demonstration's.
    apart : bool
        Whether the outcome's actions have their task as a suffix.
    """
    suffix = f"_{task}" if apart else ""
    known = {action.name + suffix: action.key for action in keys}
    return Vocabulary(tuple(replace(a, key=known.get(a.name, "")) for a in vocabulary))


def reviewed_vocabulary(document: Document) -> Vocabulary:
    """How the actions look that a document reviews; without that, those of what is open.

    Raises
    ------
    ForcelabError
        If the project cannot be read.
    """
    project, outcome = document.project, document.review.run
    if project is None or outcome is None:
        return document.vocabulary
    return vocabulary_of(project, outcome)
