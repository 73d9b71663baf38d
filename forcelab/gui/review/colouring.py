"""How the actions of what is reviewed look, and which keys paint them."""

from __future__ import annotations

from dataclasses import replace

from forcelab.gui.document import Document
from forcelab.review.run_result import vocabulary_of
from forcelab.vocabulary import Vocabulary

__all__ = ["painted_by", "vocabulary_seen"]


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
    """How the actions look that a document reviews; without that, those of what is open.

    Raises
    ------
    ForcelabError
        If the project cannot be read.
    """
    project, outcome = document.project, document.outcome
    if project is None or outcome is None:
        return document.vocabulary
    return vocabulary_of(project, outcome)
