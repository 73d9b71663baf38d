"""Whose labels a recogniser is trained on, where nobody was chosen."""

from __future__ import annotations

from collections import Counter

from forcelab.gui.document import Document
from forcelab.labels import is_model

__all__ = ["has_labels", "whose_labels"]


def whose_labels(document: Document, tasks: set[str | None]) -> str | None:
    """The coder's own labels, or those of who labelled most; None where nobody did.

    So whoever looks at a project of others can train at once. Models are no coders.
    """
    if has_labels(document, tasks):
        return document.author
    infos = [info for info in document.infos if info.task in tasks]
    count = Counter(name for info in infos for name in info.labelled if not is_model(name))
    return count.most_common(1)[0][0] if count else None


def has_labels(document: Document, tasks: set[str | None]) -> bool:
    """Whether the coder of the window has labelled anything of some tasks."""
    demonstration = document.demonstration
    if demonstration is not None and demonstration.task in tasks and document.segments:
        return True
    return any(i.task in tasks and document.author in i.labelled for i in document.infos)
