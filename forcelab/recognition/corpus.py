"""Labelled demonstrations out of a project."""

from __future__ import annotations

from collections.abc import Sequence

from forcelab.errors import InputError
from forcelab.merging import MergeMap
from forcelab.project import DemonstrationInfo, Project
from forcelab.recognition.evaluation import kept_apart
from forcelab.recognition.examples import Labelled

__all__ = ["coder_of", "corpus"]


def coder_of(project: Project, infos: Sequence[DemonstrationInfo], author: str | None) -> str:
    """Whose labels are meant: the author asked for, or the only coder there is.

    Models are no coders: what they predicted is never trained on.

    Raises
    ------
    InputError
        If nobody labelled anything, several did and none was chosen, or the chosen one did not.
    """
    people = {person.name for person in project.authors() if person.kind == "coder"}
    coders = list(dict.fromkeys(a for info in infos for a in info.authors if a in people))
    if author is not None:
        if author not in coders:
            known = f"there are labels of {', '.join(coders)}" if coders else "nobody has yet"
            raise InputError(f"'{author}' has labelled nothing here; {known}.")
        return author
    if not coders:
        raise InputError("Nothing is labelled yet; label at least two actions first.")
    if len(coders) > 1:
        raise InputError(f"There are labels of {', '.join(coders)}; choose one with --author.")
    return coders[0]


def corpus(
    project: Project,
    tasks: Sequence[str],
    author: str | None = None,
    *,
    merge: MergeMap | None = None,
    apart: bool = False,
) -> list[Labelled]:
    """The demonstrations of one or several tasks with one coder's labels.

    Parameters
    ----------
    project : Project
    tasks : sequence of str
        In this order.
    author : str, optional
        The coder; may be left out where there is only one.
    merge : MergeMap, optional
        Spellings to take as one action; the stored labels stay as they are.
    apart : bool
        Whether actions then get their task as a suffix, so that ``grab`` of two tasks stays two.

    Raises
    ------
    InputError
        If a task has no demonstration, or the coder is not clear.
    """
    infos: list[DemonstrationInfo] = []
    for task in tasks:
        found = project.demonstrations(task)
        if not found:
            known = ", ".join(f"'{name}'" for name in project.tasks())
            raise InputError(
                f"'{project.path}' has no demonstration of the task '{task}'; it has "
                f"{known or 'none at all'}."
            )
        infos.extend(found)
    coder = coder_of(project, infos, author)
    labelled = [
        Labelled(project.load(info.id), project.track(info.id, coder).segments).merged(merge)
        for info in infos
    ]
    return kept_apart(labelled, [info.task for info in infos]) if apart else labelled
