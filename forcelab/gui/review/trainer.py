"""The window's trainer: what is trained and how, which runs are kept, what is under way."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, NamedTuple

from PySide6.QtCore import QObject, QTimer, Signal

from forcelab.errors import ForcelabError, InputError
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.review import training_preferences
from forcelab.gui.review.training_backend import Backend, SettingsAndChoice
from forcelab.gui.review.training_preferences import PRESET, TrainingChoice
from forcelab.labels import Segments, is_model
from forcelab.recognition.groups import default_fold_count
from forcelab.text import counted, task_text

if TYPE_CHECKING:
    from forcelab.project import Project, RunSummary
    from forcelab.recognition.dataset import DataSelection
    from forcelab.recognition.settings import Settings
    from forcelab.review.run_result import RunResult
    from forcelab.review.training import TrainingStep


#: A coder's own labels are trained on from so many complete demonstrations on, whoever labelled
#: more: with one, as after accepting a single prediction, nothing could be tested.
OWN_MINIMUM = 2
#: A demonstration is complete whose labels last so large a share of what another coder labelled of
#: it; of one that nobody else labelled, of its length.
COMPLETE_SHARE = 0.5


def default_folds(document: Document, tasks: Sequence[str], author: str | None) -> int:
    """In how many groups demonstrations are left out by default; 0: each by itself."""
    labelled = (author in info.labelled for info in document.infos if info.task in tasks)
    return default_fold_count(sum(labelled))


def default_author(document: Document, tasks: set[str | None]) -> str | None:
    """The coder's own labels, or those of the coder with the most; None where there are none.

    So a coder who opens another's project can train at once. The coder's own count from
    :data:`OWN_MINIMUM` complete demonstrations on, or where no other coder has more. One that was
    only begun counts where nobody has any complete. Models are no coders.
    """
    coder, open_one = document.author, document.demonstration
    begun: Counter[str] = Counter()
    complete: Counter[str] = Counter()
    for info in document.infos:
        if info.task not in tasks:
            continue
        seconds = {a: s for a, s in info.labelled.items() if s and not is_model(a)}
        if open_one is not None and info.id == document.id and document.editor.segments:
            # Which the list may not tell yet.
            seconds[coder] = sum(segment.duration for segment in document.editor.segments)
        begun.update(seconds.keys())
        for author, labelled in seconds.items():
            others = (s for a, s in seconds.items() if a != author)
            if labelled >= COMPLETE_SHARE * max(others, default=info.duration):
                complete[author] += 1
    count = complete or begun
    if not count:
        return None
    most, number = min(count.items(), key=lambda item: (-item[1], item[0]))
    return coder if count[coder] >= min(OWN_MINIMUM, number) else most


#: The keys of its jobs.
LOADING_RUN, LISTING_RUNS = "run", "runs"


#: So many of them stay for each task: enough to compare the last one with those before.
AUTOMATIC_RUNS_KEPT = 3


class _AutomaticRun(NamedTuple):
    """A run of an automatic training."""

    number: int
    proposer: str
    task: tuple[str | None, ...]


class AutomaticRuns:
    """Removes older automatic runs, while the window is open.

    After each there is a rest for as long as it took: where a training takes minutes, every edit
    would otherwise be followed by one more, and the machine would do nothing else. A run whose
    predictions were judged or accepted stays in the project; so does the one that is reviewed.
    """

    def __init__(self, document: Document) -> None:
        self._document = document
        self.forget()

    def forget(self) -> None:
        self._runs: list[_AutomaticRun] = []
        self._began = self._until = -inf

    @property
    def must_wait(self) -> bool:
        return monotonic() < self._until

    def begin(self) -> None:
        self._began = monotonic()

    def end(self) -> None:
        now = monotonic()
        self._until = now + (now - self._began)

    def trained(self, run: RunResult) -> None:
        """Add a run, and remove those that are too old by now, unless they were used."""
        task, document = (*run.tasks, run.test_task), self._document
        self._runs.append(_AutomaticRun(run.number, run.proposer, task))
        for old in [run for run in self._runs if run.task == task][:-AUTOMATIC_RUNS_KEPT]:
            reviewed = document.review.run
            if reviewed is not None and reviewed.number == old.number:
                continue
            self._runs.remove(old)
            if document.project is not None:
                try:
                    document.project.runs.forget(old.number, old.proposer)
                except ForcelabError as error:  # it stays, and is told like any other trouble
                    document.show_message(str(error), True)


#: Edits are counted once in so many ms at most.
COUNT_DELAY = 1000


class EditCounter(QObject):
    """Counts edits since the run that is reviewed, and emits `edited` when the coder made one."""

    counted = Signal()
    edited = Signal()

    def __init__(
        self,
        document: Document,
        count: Callable[[Project, RunResult], int],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self.edits: int | None = None
        self._document, self._count_edits = document, count
        self._at = 0.0
        self._track = self._painted()
        self._later = QTimer(self, singleShot=True, interval=COUNT_DELAY)
        self._later.timeout.connect(self.count)
        document.tracks_changed.connect(self._tracks_changed)
        document.review.run_changed.connect(self.count)

    def forget(self) -> None:
        self._later.stop()
        self.edits = None

    def count(self) -> None:
        self._at = monotonic()
        project, edits = self._document.project, None
        if project is not None and self._document.review.run is not None:
            # It loads much, which a run has, too.
            from forcelab.gui.review.reviewed_run import visible_run

            try:
                run = visible_run(self._document)
                edits = None if run is None else self._count_edits(project, run)
            except ForcelabError:
                return  # the store is busy; the next edit counts again
        if edits != self.edits:
            self.edits = edits
            self.counted.emit()

    def _painted(self) -> tuple[str, str, Segments]:
        """The open demonstration, its coder, and the track."""
        return self._document.id, self._document.author, self._document.editor.segments

    def _tracks_changed(self) -> None:
        """Count soon; the same track with other segments is an edit."""
        before, self._track = self._track, self._painted()
        wait = self._at + COUNT_DELAY / 1000 - monotonic()
        if wait <= 0:
            self.count()
        elif not self._later.isActive():
            self._later.start()
        if before[:2] == self._track[:2] and before[2] is not self._track[2]:
            self.edited.emit()


#: Automatic training begins when nothing was edited for so many ms.
QUIET_TIME = 5000
#: Why no other training can begin.
RUNNING = "A training is running; wait for it or cancel it."
#: The keys of the jobs that go on behind a complete screen: of a training, and of a measurement.
TRAINING, MEASURING = "training", "measuring recognition"


class Trainer(QObject):
    """Trains on a snapshot of the labels in the background, while the coder goes on.

    The reviewed run stays until a new one is there. Settings and choice are remembered for each
    task of each project; demonstrations of no task are of the task ``""``, so ask :attr:`ready`
    whether there is one.
    """

    changed = Signal()

    runs_changed = Signal()

    losses_changed = Signal()

    def __init__(
        self,
        document: Document,
        jobs: Jobs,
        parent: QObject | None = None,
        *,
        backend: Backend | None = None,
    ) -> None:
        super().__init__(parent)
        training_preferences.name_own_code()
        self.document = document
        self.jobs = jobs
        self._backend = backend or Backend()
        document.listing_changed.connect(self._listing_changed)
        self._counter = EditCounter(document, self._backend.count_edits, self)
        self._counter.counted.connect(self.changed)
        self._counter.edited.connect(self._edited)
        self.pause = QTimer(self, singleShot=True, interval=QUIET_TIME)
        self.pause.timeout.connect(self._train_automatically)
        self._automatic_runs = AutomaticRuns(document)
        PRESET.changed.connect(self._preset_changed)
        document.project_changed.connect(self._project_changed)
        document.demonstration_changed.connect(self._demonstration_changed)
        self._project_changed()

    def _forget(self) -> None:
        self._path: Path | None = None
        self.task = self.trouble = ""
        self._settings: Settings | None = None
        self._choice: TrainingChoice | None = None
        self._author: tuple[tuple[object, ...], str | None] | None = None
        self._other_coders: tuple[tuple[object, ...], dict[str, int]] | None = None
        self.document.review.set_training(False)
        self.step: TrainingStep | None = None
        self.step_history: list[TrainingStep] = []
        self.automatic = False
        self.runs: tuple[RunSummary, ...] = ()
        self._training_automatically = False
        self._automatic_runs.forget()

    @property
    def ready(self) -> bool:
        return self._path is not None and self.task in self.tasks

    @property
    def tasks(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(info.task for info in self.document.infos))

    @property
    def settings(self) -> Settings:
        if self._settings is None:
            values = training_preferences.recall_values(self._path or Path(), self.task)
            self._settings = training_preferences.settings_of(values, self.task)
        return self._settings

    @property
    def choice(self) -> TrainingChoice:
        """What a recogniser is trained on; without an author, the coder's own labels come first."""
        if self._choice is None:
            self._choice = training_preferences.recall_choice(self._path or Path(), self.task)
        return self._choice

    @property
    def preset_used(self) -> tuple[str, bool]:
        """The preset that the settings began with, and whether they were changed."""
        return training_preferences.recall_preset(self._path or Path(), self.task)

    @property
    def author(self) -> str | None:
        """Whose labels are trained on; None where nothing is labelled."""
        choice, document = self.choice, self.document
        if choice.author:
            return choice.author
        # Asked for several times an edit, over hundreds of demonstrations.
        tasks = {*choice.tasks, choice.test_task}
        state = document.infos, document.id, document.editor.segments, document.author, tasks
        if self._author is None or self._author[0] != state:
            self._author = state, default_author(document, tasks)
        return self._author[1]

    @property
    def also_from(self) -> str | None:
        """The other coder whose labels are learnt from, as long as there are any to add."""
        also = self.choice.also_from
        return also if also in self.other_coders else None

    @property
    def other_coders(self) -> dict[str, int]:
        """How many demonstrations of these tasks each other coder labelled that this one did not.

        None where another task is tested; labels that the coder must not see yet do not count.
        """
        document, author, choice = self.document, self.author, self.choice
        tasks, test = choice.tasks, choice.test_task
        state = document.infos, document.author, author, tasks, test
        if self._other_coders is None or self._other_coders[0] != state:
            project = document.project
            blind = frozenset() if project is None else project.coding.blind_to(document.author)
            unlabelled = (
                info
                for info in document.infos
                if author and test is None and info.task in tasks
                if not info.labelled.get(author)
            )
            coders = Counter(
                name
                for info in unlabelled
                for name, seconds in info.labelled.items()
                if seconds and not is_model(name)
                if name == document.author or info.id not in blind
            )
            self._other_coders = state, coders
        return self._other_coders[1]

    @property
    def reviewed_author(self) -> str:
        """Whose labels the reviewed run was trained on, if the next training takes others."""
        run = self.document.review.run
        if run is None or not self.ready or run.author == self.author:
            return ""
        return run.author

    @property
    def settings_changed(self) -> bool:
        """Whether the next training takes other settings or another coder's labels as well."""
        run = self.document.review.run
        if run is None or not self.ready:
            return False
        return run.settings != self.settings or run.also_from != (self.also_from or "")

    def set_settings(self, settings: Settings) -> None:
        self._settings = settings
        if self._path is not None:
            training_preferences.remember_settings(self._path, self.task, settings)
        self._chosen()

    def set_choice(self, choice: TrainingChoice) -> None:
        self._choice = choice
        if self._path is not None:
            training_preferences.remember_choice(self._path, self.task, choice)
        self._chosen()

    def set_also_from(self, coder: str | None) -> None:
        """Learn from another coder's labels as well, or from no other's."""
        self.set_choice(replace(self.choice, also_from=coder))

    def _chosen(self) -> None:
        self.trouble = ""
        self.changed.emit()

    def _preset_changed(self) -> None:
        """A task with no settings of its own has those of the other preset now."""
        self._settings = None
        self.changed.emit()

    def _switch_task(self, task: str) -> None:
        """Have the settings and the choice of another task count."""
        self.task = task
        self._settings = self._choice = None
        self.trouble = ""
        self.changed.emit()

    def dismiss(self) -> None:
        if self.trouble:
            self.trouble = ""
            self.changed.emit()

    def _refuse(self, sentence: str) -> None:
        """Report what is missing; also where the bar that shows it is not in front."""
        self.trouble = sentence
        self.document.show_message(sentence, True)
        self.changed.emit()

    def _builder(self) -> SettingsAndChoice:
        """A function that builds settings and choice in the job, as that loads much."""
        assert self._path is not None
        task, settings = self.task, self._settings
        values = training_preferences.recall_values(self._path, task)
        choice = replace(self.choice, author=self.author, also_from=self.also_from)
        coder = self.document.author
        if self.choice.author is None and choice.author not in (None, coder):
            self.document.show_message(
                f"{coder} has labelled fewer than {OWN_MINIMUM} demonstrations of this; training "
                f"on the labels of {choice.author}."
            )
        if choice.folds is None and choice.test_task is None:
            folds = default_folds(self.document, choice.tasks, choice.author)
            choice = replace(choice, folds=folds)

        def build() -> tuple[Settings, DataSelection]:
            used = training_preferences.settings_of(values, task) if settings is None else settings
            return used, choice.selection()

        return build

    def show_run(self, number: int) -> None:
        if self._path is not None:
            work = self._backend.load(self._path, number)
            self.jobs.run(work, self._take, self._failed_to_load, key=LOADING_RUN)

    def remove_run(self, number: int) -> None:
        """Remove a run of the project for good; where it is reviewed, the latest one is then."""
        if (path := self._path) is not None:
            # Without a key: the next one that is removed must not keep this one in the project.
            work = self._backend.remove(path, number)
            self.jobs.run(work, lambda _: self._removed(path, number), self._failed_to_load)

    def _removed(self, path: Path, number: int) -> None:
        if path != self._path:
            return
        reviewed = self.document.review.run
        if reviewed is not None and reviewed.number == number:
            self.jobs.cancel(LOADING_RUN)
            self.document.review.set_run(None)
        self.document.show_message(f"Run {number} was removed.")
        self.list_runs()

    def list_runs(self) -> None:
        """Read in the background which runs there are."""
        if self._path is not None:
            work = self._backend.list_runs(self._path)
            self.jobs.run(work, self._listed, self._failed_to_load, key=LISTING_RUNS)

    def _listed(self, runs: tuple[RunSummary, ...]) -> None:
        """Offer the runs; where none is reviewed yet, the latest one is."""
        self.runs = runs
        self.runs_changed.emit()
        if self.document.review.run is None:
            self._show_latest()

    def _show_latest(self) -> None:
        """Review the latest run of the task, or nothing where there is none.

        As with :func:`~forcelab.review.run_result.latest_run`, one that tested the task's own
        demonstrations comes before one that learnt from them and tested others.
        """
        run = min(
            (run for run in self.runs if self.task in (*run.tasks, run.test_task)),
            key=lambda run: (None, self.task, run.test_task).index(run.test_task),
            default=None,
        )
        reviewed = self.document.review.run
        if run is not None and (reviewed is None or reviewed.number != run.id):
            self.show_run(run.id)
        elif run is None and reviewed is not None:
            self.document.review.set_run(None)

    def _take(self, run: RunResult) -> None:
        """Review a run; what is trained next is of the same task."""
        self.document.review.set_run(run)
        if run.tasks and self.task not in (*run.tasks, run.test_task):
            self._switch_task(run.tasks[0])
        self.changed.emit()

    def _failed_to_load(self, error: Exception) -> None:
        if isinstance(error, ForcelabError):
            self._refuse(str(error))

    def _listing_changed(self) -> None:
        """Read the run again where it tested a demonstration that was removed."""
        self._other_coders = None  # some may be blind from now on
        run = self.document.review.run
        if run is None or self._path is None:
            return
        listed_ids = {info.id for info in self.document.infos}
        if all(demonstration.id in listed_ids for demonstration in (*run.tested, *run.proposals)):
            return
        work = self._backend.load(self._path, run.number)
        self.jobs.run(work, self._take, self._failed_to_reload, key=LOADING_RUN)

    def _failed_to_reload(self, error: Exception) -> None:
        """Review nothing where nothing that was tested is left."""
        self.document.review.set_run(None)
        self._failed_to_load(error)

    # How it stands

    @property
    def obstacle(self) -> str:
        """Why nothing can be trained; empty where it can."""
        none = "There is nothing to train on yet; import demonstrations and label them."
        return "" if self.ready else self.trouble or none

    @property
    def training_as_asked(self) -> bool:
        """Whether a training runs that the coder has asked for."""
        return self.training and not self._training_automatically

    @property
    def training(self) -> bool:
        return self.document.review.training

    @property
    def edits(self) -> int | None:
        """How many edits were made since the reviewed run was trained; None without one."""
        return self._counter.edits

    @property
    def has_recogniser(self) -> bool:
        """Whether the project has the recogniser of the reviewed run; an evaluation keeps none."""
        project, run = self.document.project, self.document.review.run
        if project is None or run is None:
            return False
        try:
            project.runs.recogniser_path(run.recogniser)
        except InputError:
            return False
        return True

    @property
    def freshness(self) -> tuple[str, str]:
        """How up to date the reviewed run is, at length and in short."""
        edits, coder, kept = self.edits, self.reviewed_author, self.has_recogniser
        if edits is None:
            return "not trained yet", ""
        if coder:  # while the next training takes another's labels
            return f"trained on the labels of {coder}", f"trained on {coder}"
        if edits:
            changes = f"{counted(edits, 'change')} since"
            return f"{changes} {'training' if kept else 'this run'}", changes
        if not kept:
            age = "other settings" if self.settings_changed else "up to date"
            return f"{age}, no recogniser kept", "no recogniser kept"
        if self.settings_changed:
            return "trained with other settings", "other settings"
        return "up to date", ""

    @property
    def _outdated(self) -> bool:
        """Whether a training would find anything new."""
        return bool(self.document.review.run is None or self.edits or self.reviewed_author)

    def set_automatic(self, automatic: bool) -> None:
        """Train automatically some seconds after edits, or only when asked to."""
        if automatic == self.automatic:
            return
        self.automatic = automatic
        if self._path is not None:
            training_preferences.remember_automatic(self._path, automatic)
        self._chosen()
        if automatic and self.edits:
            self.pause.start()
        elif not automatic:
            self.pause.stop()

    def set_task(self, task: str) -> None:
        """Turn to another task: its settings, its choice, and its latest run."""
        if task == self.task or self._path is None:
            return
        self.jobs.cancel(LOADING_RUN)  # a run of the task before
        self._switch_task(task)
        self._show_latest()

    # Training

    def train(self) -> bool:
        """Begin a training; gives whether it began. Never are there two at once."""
        if self.training:
            self._training_automatically = False  # from now on it counts as asked for
            return False
        self.pause.stop()
        self._training_automatically = False
        if self._path is None or not self.ready:
            self._refuse("There is nothing to train on; import demonstrations first.")
            return False
        self.step, self.step_history, self.trouble = None, [], ""
        self._automatic_runs.begin()
        self.document.review.set_training(True)
        name = " + ".join(map(task_text, self.choice.tasks))
        work = self._backend.train(self._path, self._builder(), name, self.step_history)
        self.jobs.run(work, self._trained, self._failed, self._progressed, key=TRAINING)
        self.changed.emit()
        self.losses_changed.emit()
        return True

    def cancel(self) -> None:
        """Cancel the training; the reviewed run stays."""
        self.pause.stop()
        if not self.training:
            return
        self.jobs.cancel(TRAINING)
        self.step = None
        self.document.review.set_training(False)
        self.changed.emit()

    def _progressed(self, step: object) -> None:
        if self.step_history and step is not None and self.step is not self.step_history[-1]:
            self.step = self.step_history[-1]
            self.changed.emit()
            self.losses_changed.emit()

    def _trained(self, run: RunResult) -> None:
        """Review the new run."""
        self.step = None
        self._automatic_runs.end()
        self.document.review.set_training(False)
        if self._training_automatically:
            self._automatic_runs.trained(run)
        if self.task in (*run.tasks, run.test_task):
            self.jobs.cancel(LOADING_RUN)
            self.document.review.set_run(run)
        else:  # the coder has turned to another task meanwhile
            done = f"The training of '{run.title}' is done; its run is in the list."
            self.document.show_message(done)
        self.changed.emit()
        self.losses_changed.emit()
        self.list_runs()
        if self.automatic and self.edits:
            self.pause.start()  # what was painted meanwhile

    def _failed(self, error: Exception) -> None:
        self.step = None
        self.document.review.set_training(False)
        expected = isinstance(error, ForcelabError)
        self._refuse(str(error) if expected else "The training failed; the log says more.")

    def _train_automatically(self) -> None:
        """Train after a pause, if there is something new; the longer it takes, the more seldom."""
        if self._automatic_runs.must_wait:
            self.pause.start()
        elif self.automatic and not self.training and self._outdated:
            self._training_automatically = self.train()

    # What happens to the document

    def _project_changed(self) -> None:
        for key in (TRAINING, LOADING_RUN, LISTING_RUNS):
            self.jobs.cancel(key)
        self.pause.stop()
        self._counter.forget()
        self._forget()
        project = self.document.project
        self._path = None if project is None else project.path
        if self._path is not None:
            self.task, self._choice = next(iter(self.tasks), ""), None
            self.automatic = training_preferences.recall_automatic(self._path)
            self.list_runs()
        self.changed.emit()
        self.losses_changed.emit()
        self.runs_changed.emit()

    def _demonstration_changed(self) -> None:
        """Follow to the task of the open demonstration, unless it is in the reviewed run."""
        demonstration, run = self.document.demonstration, self.document.review.run
        if demonstration is None:
            return
        task, id_ = demonstration.task, demonstration.id
        of_run = run is not None and (task in (*run.tasks, run.test_task) or bool(run.find(id_)))
        if not of_run:
            self.set_task(task)

    def _edited(self) -> None:
        """Train automatically after a pause without edits."""
        if self.automatic:
            self.pause.start()
