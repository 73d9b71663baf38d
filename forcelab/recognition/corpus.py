"""Labelled demonstrations out of a project."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import compress

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError, UnclearAuthorError
from forcelab.label_map import MergeMap
from forcelab.project import DemonstrationInfo, LabelsUsed, Project
from forcelab.recognition.examples import Labelled, kept_apart

__all__ = ["Corpus", "coder_of", "corpus"]


def coder_of(project: Project, infos: Sequence[DemonstrationInfo], author: str | None) -> str:
    """Whose labels are meant: the author asked for, or the only coder there is.

    Models are no coders: what they predicted is never trained on.

    Raises
    ------
    UnclearAuthorError
        If several coders labelled and none was chosen.
    InputError
        If nobody labelled anything, or the chosen one did not.
    """
    people = project.coders()
    coders = list(dict.fromkeys(a for info in infos for a in info.authors if a in people))
    if author is not None:
        if author not in coders:
            known = f"there are labels of {', '.join(coders)}" if coders else "nobody has yet"
            raise InputError(f"'{author}' has labelled nothing here; {known}.")
        return author
    if not coders:
        raise InputError("Nothing is labelled yet; label at least two actions first.")
    if len(coders) > 1:
        raise UnclearAuthorError(f"There are labels of {', '.join(coders)}; say whose to use.")
    return coders[0]


@dataclass(frozen=True)
class Corpus:
    """Labelled demonstrations, and which labels they were given.

    Parameters
    ----------
    labelled : list of Labelled
    labels : tuple of LabelsUsed
        For each: whose labels, and the latest edit of them when they were read.
    spelt : frozenset of str
        All actions as the coder spelt them.
    """

    labelled: list[Labelled]
    labels: tuple[LabelsUsed, ...]
    spelt: frozenset[str]

    def parted(self, pattern: str) -> tuple[Corpus, Corpus]:
        """The demonstrations whose names do not match a shell's pattern, and those that do.

        Raises
        ------
        InputError
            If one of them would be empty.
        """
        chosen = [fnmatchcase(item.demonstration.name, pattern) for item in self.labelled]
        if all(chosen) or not any(chosen):
            names = ", ".join(item.demonstration.name for item in self.labelled[:3])
            what = "every" if all(chosen) else "no"
            raise InputError(
                f"'{pattern}' matches {what} demonstration; there are {names} and the like. Give a "
                f"pattern that some names match, such as 'bob-*'."
            )

        def those(wanted: bool) -> Corpus:
            kept = [one is wanted for one in chosen]
            return Corpus(
                list(compress(self.labelled, kept)), tuple(compress(self.labels, kept)), self.spelt
            )

        return those(False), those(True)


def corpus(
    project: Project,
    tasks: Sequence[str],
    author: str | None = None,
    *,
    merge: MergeMap | None = None,
    apart: bool = False,
) -> Corpus:
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
    UnclearAuthorError
        If several coders labelled and none was chosen.
    InputError
        If a task has no demonstration, an array is damaged, or nothing is labelled.
    """
    with project.snapshot():
        for task in tasks:
            project.check_task(task)
        infos = [info for task in tasks for info in project.demonstrations(task)]
        coder = coder_of(project, infos, author)
        items = [
            Labelled(_intact(project, info), project.track(info.id, coder).segments)
            for info in infos
        ]
        labels = tuple(LabelsUsed(i.id, coder, project.head(i.id, coder)) for i in infos)
    spelt = frozenset(s.action for item in items for s in item.segments)
    labelled = [item.merged(merge) for item in items]
    if apart:
        labelled = kept_apart(labelled, [info.task for info in infos])
    return Corpus(labelled, labels, spelt)


def _intact(project: Project, info: DemonstrationInfo) -> Demonstration:
    """Load a demonstration and make sure that it is what was imported."""
    demonstration = project.load(info.id)
    if demonstration.fingerprint() != info.id:
        raise InputError(
            f"The arrays of '{info.name}' in '{project.path}' are damaged; import the recording "
            f"again."
        )
    return demonstration
