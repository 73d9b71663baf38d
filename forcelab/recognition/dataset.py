"""Datasets out of a project: labelled demonstrations to train and to test on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from itertools import compress

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError, UnclearAuthorError
from forcelab.label_map import MergeMap
from forcelab.labels import Segments
from forcelab.project import DemonstrationInfo, LabelsUsed, Project
from forcelab.recognition.copies import find_copies
from forcelab.recognition.examples import LabelledDemonstration, suffix_actions
from forcelab.recognition.groups import check_folds, default_fold_count
from forcelab.recognition.settings import Settings


def resolve_coder(project: Project, infos: Sequence[DemonstrationInfo], author: str | None) -> str:
    """The requested author or the only coder; what models predicted is never trained on."""
    people = project.coding.coders()
    coders = list(dict.fromkeys(a for info in infos for a in info.authors if a in people))
    if author is not None:
        if author not in coders:
            labelled_by = f"there are labels of {', '.join(coders)}" if coders else "nobody has yet"
            raise InputError(f"'{author}' has labelled nothing here; {labelled_by}.")
        return author
    if not coders:
        raise InputError("Nothing is labelled yet; label at least two actions first.")
    if len(coders) > 1:
        raise UnclearAuthorError(f"There are labels of {', '.join(coders)}; say whose to use.")
    return coders[0]


@dataclass(frozen=True)
class Dataset:
    """Labelled demonstrations, and which labels of the project they have."""

    labelled: list[LabelledDemonstration]
    #: For each: whose labels, and the latest edit of them when they were read
    labels: tuple[LabelsUsed, ...]
    spellings: frozenset[str]  # all actions as the coder spelt them
    #: By the demonstrations' ids: what a recogniser proposed and the coder accepted unchanged
    accepted: Mapping[str, Segments] = field(default_factory=dict)

    def split(self, pattern: str) -> tuple[Dataset, Dataset]:
        """The demonstrations whose names do not match a shell's pattern, and those that do."""
        matches = [fnmatchcase(item.demonstration.name, pattern) for item in self.labelled]
        if all(matches) or not any(matches):
            names = ", ".join(item.demonstration.name for item in self.labelled[:3])
            quantifier = "every" if all(matches) else "no"
            raise InputError(
                f"'{pattern}' matches {quantifier} demonstration; there are {names} and the like. "
                f"Give a pattern that some names match, such as 'bob-*'."
            )

        def select(matching: bool) -> Dataset:
            mask = [match is matching for match in matches]
            return Dataset(
                list(compress(self.labelled, mask)),
                tuple(compress(self.labels, mask)),
                self.spellings,
                self.accepted,
            )

        return select(False), select(True)


def load_dataset(
    project: Project,
    tasks: Sequence[str],
    author: str | None = None,
    *,
    merge: MergeMap | None = None,
    apart: bool = False,
    also_from: str | None = None,
) -> Dataset:
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
    also_from : str, optional
        Another coder, whose labels are added where the first one has none; those of copies of what
        the first one labelled are not.

    Raises
    ------
    UnclearAuthorError
        If several coders labelled and none was chosen.
    InputError
        If a task has no demonstration, an array is damaged, or nothing is labelled.

    Examples
    --------
    >>> dataset = forcelab.load_dataset(project, ["foam"], "Ada")
    >>> [len(item.segments) for item in dataset.labelled]
    [5, 5, 5, 0]
    """
    with project.snapshot():
        for task in tasks:
            project.demonstrations.check_task(task)
        infos = [info for task in tasks for info in project.demonstrations.infos(task)]
        coder = resolve_coder(project, infos, author)
        items = [
            LabelledDemonstration(
                _load_checked(project, info), project.tracks.get(info.id, coder).segments
            )
            for info in infos
        ]
        coders = [coder] * len(items)
        if also_from is not None:
            chosen = _add_labels(project, items, coder, also_from)
            infos, items = [infos[i] for i in chosen], [*chosen.values()]
            coders = [also_from if item.added else coder for item in items]
        labels = tuple(
            LabelsUsed(info.id, author, project.tracks.head(info.id, author))
            for info, author in zip(infos, coders, strict=True)
        )
        accepted = {
            used.demonstration: tuple(
                segment
                for segment, origin in project.tracks.origins(
                    used.demonstration, used.author
                ).items()
                if not origin.changed
            )
            for used in labels
        }
    spelt = frozenset(s.action for item in items for s in item.segments)
    labelled = [item.merged(merge) for item in items]
    if apart:
        labelled = suffix_actions(labelled, [info.task for info in infos])
    return Dataset(labelled, labels, spelt, accepted)


def _add_labels(
    project: Project, items: Sequence[LabelledDemonstration], coder: str, other: str
) -> dict[int, LabelledDemonstration]:
    """The demonstrations by their places, first the coder's own, then those of the other coder.

    Copies of what the coder labelled would be seen before they are tested; they are left out. All
    count alike: with three or five own demonstrations beside ten of a stronger and faster person,
    own ones counted three times gave 1.6 points less to 0.8 more on five simulated tasks (`fast`),
    0.3 less on average. Beside three alone, the others' gained 0.5 to 11.4 points.
    """
    if other == coder or other not in project.coding.coders():
        problem = "these are the labels used anyway" if other == coder else "no such coder"
        raise InputError(f"'{other}' cannot be learnt from as well: {problem}.")
    copies = find_copies([item.demonstration for item in items])
    seen = {i for group in copies if any(items[j].segments for j in group) for i in group}
    own, added = {}, {}
    for i, item in enumerate(items):
        theirs = () if i in seen else project.tracks.get(item.demonstration.id, other).segments
        if theirs:
            added[i] = replace(item, segments=theirs, added=True)
        else:
            own[i] = item
    if not added:
        raise InputError(f"'{other}' has labelled nothing here that {coder} has not.")
    return own | added


def _load_checked(project: Project, info: DemonstrationInfo) -> Demonstration:
    """Load a demonstration and make sure that it is what was imported."""
    demonstration = project.demonstrations.load(info.id)
    if demonstration.fingerprint() != info.id:
        raise InputError(
            f"The arrays of '{info.name}' in '{project.path}' are damaged; import the recording "
            f"again."
        )
    return demonstration


@dataclass(frozen=True)
class DataSelection:
    """Demonstrations of a project to train and test on.

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
        :func:`~forcelab.recognition.groups.fold_groups` parts them; 0: each by itself. None where
        it was not chosen: :func:`default_fold_count`.
    also_from : str, optional
        Another coder, whose labels are learnt from where the first one has none, and never tested.

    Examples
    --------
    >>> selection = forcelab.DataSelection(tasks=("foam",), author="Ada")
    >>> len(selection.load(project, ["foam"], settings).labelled)
    4
    """

    tasks: tuple[str, ...] = ()
    test_task: str | None = None
    author: str | None = None
    apart: bool = False
    test_names: str | None = None
    adapt: bool = False
    folds: int | None = None
    also_from: str | None = None

    def check(self) -> None:
        """Refuse what can never be.

        Raises
        ------
        InputError
            If actions are kept apart by task and looked for in another task, two ways to part
            demonstrations are chosen, there is a single group of them, one of them is left out at a
            time and to be adapted, or labels are added to what is not left out in turn.
        """
        if self.folds and not self.leaves_out:
            raise InputError(
                "What is tested on is chosen, so that nothing is left out; choose that or groups."
            )
        check_folds(self.folds)
        if self.also_from is not None and not self.leaves_out:
            raise InputError(
                "Another coder's labels are added where demonstrations are left out in turn; "
                "choose that or what is tested on."
            )
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

    def joined_tasks(self, project: Project) -> tuple[str, ...]:
        """The tasks to train on together: those selected, or the only one that there is.

        Raises
        ------
        InputError
            If there are several and none was selected.
        """
        tasks = tuple(dict.fromkeys(self.tasks)) or project.demonstrations.tasks()
        if len(tasks) > 1 and not self.tasks:
            raise InputError(
                f"'{project.path}' has the tasks {', '.join(tasks)}; choose the task to train on, "
                f"or several to join."
            )
        return tasks

    def with_default_folds(self, dataset: Dataset) -> DataSelection:
        """The selection with a number of groups, by how many demonstrations are labelled."""
        if not self.leaves_out or self.folds is not None:
            return self
        labelled = sum(bool(item.segments) and not item.added for item in dataset.labelled)
        return replace(self, folds=default_fold_count(labelled))

    def load(self, project: Project, tasks: Sequence[str], settings: Settings) -> Dataset:
        """The demonstrations of some tasks, chosen this way."""
        merge = settings.merge if self.apart else None  # otherwise merged when prepared
        return load_dataset(
            project,
            tasks,
            self.author,
            merge=merge,
            apart=self.apart,
            also_from=self.also_from,
        )

    def load_parts(
        self, project: Project, tasks: Sequence[str], settings: Settings
    ) -> list[Dataset]:
        """The dataset to train on, and the one to test on where that is another.

        Raises
        ------
        InputError
            If there is nothing of these tasks, or no name matches.
        """
        dataset = self.load(project, tasks, settings)
        if self.test_task is not None:
            return [dataset, self.load(project, [self.test_task], settings)]
        if self.test_names is None:
            return [dataset]
        return list(dataset.split(self.test_names))
