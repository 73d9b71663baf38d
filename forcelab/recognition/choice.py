"""Which demonstrations of a project are trained on, and which are tested on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from forcelab.errors import InputError
from forcelab.project import Project
from forcelab.recognition.corpus import Corpus, corpus
from forcelab.recognition.grouping import check_folds, usual_folds
from forcelab.recognition.settings import Settings

__all__ = ["Choice"]


@dataclass(frozen=True)
class Choice:
    """Which demonstrations of a project are meant.

    Parameters
    ----------
    tasks : tuple of str
        Joined into one. Empty: evaluate every task by itself; train on the only one there is.
    test_task : str, optional
        Evaluate by testing on this task instead of leaving one demonstration out.
    author : str, optional
        The coder; may be left out where there is only one.
    apart : bool
        Whether joined tasks keep their actions apart, ``grab`` becoming ``grab_TASK``.
    test_names : str, optional
        Evaluate by testing on the demonstrations with such names, a shell's pattern, training on
        all others: those of one person on those of the rest.
    adapt : bool
        Whether what is tested is matched to what is trained on, as
        :mod:`forcelab.recognition.adaptation` does.
    folds : int, optional
        In how many groups demonstrations are left out, as
        :func:`~forcelab.recognition.grouping.groups` parts them; 0: each by itself. None where
        nobody said: as :func:`~forcelab.recognition.grouping.usual_folds` has it.
    """

    tasks: tuple[str, ...] = ()
    test_task: str | None = None
    author: str | None = None
    apart: bool = False
    test_names: str | None = None
    adapt: bool = False
    folds: int | None = None

    def check(self) -> None:
        """Refuse what can never be.

        Raises
        ------
        InputError
            If actions are kept apart by task and looked for in another task, two ways to part
            demonstrations are chosen, there is a single group of them, or one of them is left out
            at a time and to be adapted.
        """
        if self.folds and not self.leaves_out:
            raise InputError(
                "What is tested on is chosen, so that nothing is left out; choose that or groups."
            )
        check_folds(self.folds)
        if self.test_names is not None and self.test_task is not None:
            raise InputError("Test on a task or on demonstrations by their names, not on both.")
        if self.adapt and self.leaves_out:
            raise InputError(
                "What is adapted is a task or a person that was not trained on; choose "
                "demonstrations to test on, by task or by name."
            )
        if self.apart and self.test_task is not None:
            raise InputError(
                "Actions kept apart by task are found in no other task; join or merge them instead."
            )

    @property
    def leaves_out(self) -> bool:
        """Whether demonstrations are left out in turn, not chosen to be tested on."""
        return self.test_task is None and self.test_names is None

    def settled(self, found: Corpus) -> Choice:
        """The same with a number of groups, by how many demonstrations there are to leave out."""
        if not self.leaves_out or self.folds is not None:
            return self
        labelled = sum(bool(item.segments) for item in found.labelled)
        return replace(self, folds=usual_folds(labelled))

    def corpus(self, project: Project, tasks: Sequence[str], settings: Settings) -> Corpus:
        """The demonstrations of some tasks, chosen this way."""
        merge = settings.merge if self.apart else None  # otherwise merged when prepared
        return corpus(project, tasks, self.author, merge=merge, apart=self.apart)

    def parts(self, project: Project, tasks: Sequence[str], settings: Settings) -> list[Corpus]:
        """What is trained on, and what is tested on where that is another part.

        Raises
        ------
        InputError
            If there is nothing of these tasks, or no name matches.
        """
        found = self.corpus(project, tasks, settings)
        if self.test_task is not None:
            return [found, self.corpus(project, [self.test_task], settings)]
        if self.test_names is None:
            return [found]
        return list(found.parted(self.test_names))
