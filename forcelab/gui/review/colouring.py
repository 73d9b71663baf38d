"""How the actions of an outcome look, which may come from several tasks, and what paints them."""

from __future__ import annotations

from dataclasses import replace

from forcelab.gui.document import Document
from forcelab.project import Project
from forcelab.review.outcome import Outcome
from forcelab.vocabulary import Vocabulary, joined

__all__ = ["painted_by", "vocabulary_of", "vocabulary_seen"]


def vocabulary_of(project: Project, outcome: Outcome) -> Vocabulary:
    """All actions of an outcome, each with the look that it has where it is labelled.

    The task that is tested comes first, so that its tracks look as when they are labelled. Two
    actions of the same look, from two tasks, keep the colour and differ in texture; so do those
    that are kept apart by their task, like ``grab_hard`` and ``grab_soft``.

    Raises
    ------
    ForcelabError
        If the project cannot be read.
    """
    tasks = dict.fromkeys(([outcome.test_task] if outcome.test_task else []) + [*outcome.tasks])
    found = joined({task: project.vocabulary(task) for task in tasks}, apart=outcome.apart)
    keyless = Vocabulary(tuple(replace(action, key="") for action in found))
    return keyless.with_actions(*outcome.actions)


def painted_by(
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


def vocabulary_seen(document: Document) -> Vocabulary:
    """The same of what a document reviews; without that, of what is open.

    Raises
    ------
    ForcelabError
        If the project cannot be read.
    """
    project, outcome = document.project, document.outcome
    if project is None or outcome is None:
        return document.vocabulary
    return vocabulary_of(project, outcome)
