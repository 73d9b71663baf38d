"""Error against run time of recognition: presets, settings and decoders on the same demonstrations.

Features are computed once for all settings that share them, and so is a classifier: what differs
in filters or decoder alone is fitted once. A project's tasks are measured each by itself; the
Trade-off page stores what it measured as a run of the project.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from forcelab.cluster import current_cluster
from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.labels import is_model
from forcelab.measure.rows import Row, Table, with_front
from forcelab.measure.timing import measure_peak, measure_seconds
from forcelab.parallel import share_work
from forcelab.process import interruptible
from forcelab.project import LabelsUsed, Project, Provenance, StoredRun
from forcelab.recognition.cross_validation import held_out_prediction
from forcelab.recognition.dataset import Dataset, load_dataset
from forcelab.recognition.examples import (
    Examples,
    LabelledDemonstration,
    actions_of,
    common_rate,
    prepare_examples,
)
from forcelab.recognition.groups import fold_groups
from forcelab.recognition.metrics import Counts, Scores, pool
from forcelab.recognition.presets import PRESETS
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import fit_examples
from forcelab.resources import versions
from forcelab.text import there_are

#: What the columns of the table hold.
ERROR, SECONDS = "1 - F1@50", "recognition (CPU s per min)"
#: Into so many groups demonstrations are parted, each of which is left out in turn.
FOLDS = 4


@dataclass(frozen=True)
class Variant:
    """Settings, with what is varied in them (such as ``"classifier"``) and how."""

    name: str
    setting: str
    settings: Settings


#: Preset ``paper`` trained on fewer samples, which are almost copies of each other: what the
#: wavelet variants differ from, as training on all of them takes minutes.
_PAPER = PRESETS["paper"].replace(stride=50)
_FAST = PRESETS["fast"]
_NO_CHANGES = _FAST.replace(changes=False)
_OFF: dict[str, Any] = {"threshold": None, "median": None, "drop": None}

#: All wavelet variants but the presets train on every fiftieth sample unless they say otherwise.
VARIANTS: tuple[Variant, ...] = (
    *(Variant("preset", name, settings) for name, settings in PRESETS.items()),
    Variant("stride", "every 200th sample", _PAPER.replace(stride=200)),
    Variant("stride", "every 50th sample", _PAPER),
    Variant("scales", "every 2 octaves", _PAPER.replace(spacing=2.0)),
    Variant("scales", "every 1/2 octave", _PAPER.replace(spacing=0.5)),
    Variant("phase", "none", _PAPER.replace(phase=False)),
    Variant("phase", "cos and sin", _PAPER.replace(circular=True)),
    Variant("classifier", "naive-bayes", _PAPER.replace(classifier="naive-bayes")),
    Variant("classifier", "decision-tree", _PAPER.replace(classifier="decision-tree")),
    Variant("classifier", "logistic", _PAPER.replace(classifier="logistic")),
    Variant("classifier", "extra-trees", _PAPER.replace(classifier="extra-trees")),
    Variant("filters", "none", _PAPER.replace(**_OFF)),
    Variant("filters", "median of 101", _PAPER.replace(threshold=None, median=101)),
    Variant("decoder", "order", _PAPER.replace(**_OFF, decoder="semi-markov")),
    Variant("windows", "filters", _NO_CHANGES.replace(decoder="filters", median=5, drop=0.125)),
    Variant("windows", "changes not learnt", _NO_CHANGES),
    Variant("windows", "durations only", _FAST.replace(choreography="durations")),
    Variant("windows", "logistic", _FAST.replace(classifier="logistic")),
    Variant("windows", "mlp, wavelets beside", PRESETS["mlp"].replace(features="windows+wavelets")),
)

#: A quick look: little that takes long.
QUICK: tuple[Variant, ...] = tuple(
    variant
    for variant in VARIANTS
    if (variant.name, variant.setting)
    in {
        ("preset", "fast"),
        ("stride", "every 200th sample"),
        ("classifier", "naive-bayes"),
        ("classifier", "extra-trees"),
        ("windows", "durations only"),
    }
)

#: What is done after the classifier, and what a fit needs besides features.
_AFTER = frozenset({"preset", "threshold", "median", "drop", "decoder", "choreography"})
_FIT = frozenset({"classifier", "stride", "seed", "balanced", "calibrated", "trimmed", "changes"})


def sharing_features(variants: Sequence[Variant]) -> list[list[Variant]]:
    """The variants in groups that share their features; every order is kept."""
    return _grouped(variants, lambda settings: _other_values(settings, _AFTER | _FIT))


def sharing_fit(variants: Sequence[Variant]) -> list[list[Variant]]:
    """Variants of the same features in groups that share their classifier."""

    def key(settings: Settings) -> tuple[object, ...]:
        # Only an SVM is fitted otherwise where no probabilities are needed.
        probabilities = settings.classifier == "svm" and settings.needs_probabilities
        return *_other_values(settings, _AFTER), probabilities

    return _grouped(variants, key)


def _other_values(settings: Settings, without: frozenset[str]) -> tuple[str, ...]:
    """The values of all other settings, to compare by."""
    return tuple(repr(value) for name, value in vars(settings).items() if name not in without)


def _grouped(
    variants: Sequence[Variant], key: Callable[[Settings], tuple[object, ...]]
) -> list[list[Variant]]:
    """Groups whose settings have the same key, in the order in which they begin."""
    groups: dict[tuple[object, ...], list[Variant]] = {}
    for variant in variants:
        groups.setdefault(key(variant.settings), []).append(variant)
    return list(groups.values())


@dataclass
class VariantResult:
    """The mistakes and the CPU seconds of one variant, fold by fold."""

    counts: list[Counts] = field(default_factory=list)
    #: Per minute of signal, of each demonstration: features, and what comes after them.
    features: list[float] = field(default_factory=list)
    predict: list[float] = field(default_factory=list)
    fit: float = 0.0
    #: Minutes that were trained on.
    trained: float = 0.0
    peak_bytes: int = 0
    refusal: str = ""


@dataclass(frozen=True)
class Prepared:
    """Demonstrations with their features, and the CPU seconds that each took."""

    labelled: Sequence[LabelledDemonstration]
    examples: list[Examples]
    seconds: list[float]
    peak_bytes: int

    @property
    def minutes(self) -> list[float]:
        """Minutes of signal of each demonstration."""
        return [item.demonstration.duration / 60 for item in self.labelled]


def require_labelled(labelled: Sequence[LabelledDemonstration]) -> list[LabelledDemonstration]:
    """The demonstrations with a segment; `InputError` if they are fewer than two."""
    used = [item for item in labelled if item.segments]
    if len(used) < 2:
        raise InputError(
            f"Measuring recognition needs two labelled demonstrations; {there_are(len(used))}."
        )
    return used


def reference_text(demonstrations: int, groups: int) -> str:
    """What so many demonstrations, left out in so many groups, are compared with."""
    turns = "one left out at a time"
    if groups < demonstrations:
        turns = f"left out in {groups} groups in turn"
    return f"the coder's labels of {demonstrations} demonstrations, {turns}"


def median_and_spread(seconds: Sequence[float]) -> tuple[float, float]:
    """Median and interquartile range; a row needs a time of at least the clock's tick."""
    low, middle, high = np.percentile(seconds, [25, 50, 75]).tolist()
    return max(middle, time.get_clock_info("process_time").resolution), high - low


def recognise(
    recogniser: Recogniser,
    prepared: Prepared,
    i: int,
    actions: tuple[str, ...],
    spent: VariantResult,
) -> None:
    """Recognise a demonstration that was left out, on the clock, and count its mistakes."""
    examples = prepared.examples[i]
    if not spent.counts:
        _, peak = measure_peak(lambda: recogniser.predict_examples(examples))
        spent.peak_bytes = max(prepared.peak_bytes, peak + examples.features.nbytes)
    prediction, seconds = measure_seconds(lambda: recogniser.predict_examples(examples))
    tested = held_out_prediction(prepared.labelled[i], examples, prediction, actions)
    spent.counts.append(tested.counts("filtered"))
    spent.features.append(prepared.seconds[i] / prepared.minutes[i])
    spent.predict.append(seconds / prepared.minutes[i])


def row_of(name: str, setting: str, spent: VariantResult, size: str, reference: str) -> Row:
    """The row of one way to recognise, or of what it was refused for."""
    scores = pool(size, spent.counts) if spent.counts and not spent.refusal else None
    refusal = spent.refusal
    if scores is not None and scores.f1["50"] is None:
        refusal = "There is no segment to compare with."
    if scores is None or refusal:
        return Row(name, setting, size, reference, refusal=refusal)
    seconds, spread = median_and_spread(np.add(spent.features, spent.predict).tolist())
    return Row(
        name,
        setting,
        size,
        reference,
        error=1.0 - (scores.f1["50"] or 0.0),
        seconds=seconds,
        spread=spread,
        peak_bytes=spent.peak_bytes,
        further=_further_figures(scores, spent),
    )


def _further_figures(scores: Scores, spent: VariantResult) -> dict[str, float]:
    """The scores and seconds beside error and time, as far as they are known."""
    figures = {
        "accuracy": scores.accuracy,
        "balanced": scores.balanced_accuracy,
        "edit": scores.edit,
        "F1@50": scores.f1["50"],
        "F1@50, labelled time": scores.f1_labelled["50"],
        "boundaries found": scores.boundaries_found,
        "boundary (ms)": scores.boundary_ms["median"],
        "boundary p90 (ms)": scores.boundary_ms["p90"],
        "features (s/min)": float(np.median(spent.features)),
        "fit (s/min)": spent.fit / spent.trained,
        "predict (s/min)": float(np.median(spent.predict)),
    }
    return {name: figure for name, figure in figures.items() if figure is not None}


Rows = Generator[Progress, None, tuple[Row, ...]]
#: Takes what is labelled of a task, and what the rows call that.
Measure = Callable[[Sequence[LabelledDemonstration], str], Rows]


def measure_variants(
    labelled: Sequence[LabelledDemonstration],
    variants: Sequence[Variant],
    size: str,
    folds: int | None = FOLDS,
) -> Rows:
    """Measure variants on labelled demonstrations, each recognised without having been trained on.

    The error is ``1 - F1@50``, pooled over all demonstrations, and the seconds are those of
    features, classifier and filters or decoder per minute of signal: the median over
    demonstrations and their interquartile range, CPU time of all threads. `further` holds all the
    scores, and the seconds of features, fit (per minute trained on) and prediction by themselves.
    `folds` is the number of groups at most; None leaves out one demonstration at a time.
    """
    used = require_labelled(labelled)
    parts = fold_groups([item.demonstration for item in used], folds)
    groups = sharing_features(variants)
    watch = _ProgressCounter(variants, len(parts))
    spent: dict[Variant, VariantResult] = {}
    if current_cluster() is None:
        for alike in groups:
            spent |= yield from _measure_alike(alike, used, parts, watch)
    else:
        work = partial(_measure_alike_remotely, labelled=used, parts=parts)
        with closing(share_work(work, groups, 1)) as coming:
            for number, found in enumerate(coming, 1):
                spent |= found
                yield Progress(number, len(groups), "measuring")
    reference = reference_text(len(used), len(parts))
    return with_front([row_of(v.name, v.setting, spent[v], size, reference) for v in variants])


def _measure_alike(
    alike: Sequence[Variant],
    labelled: Sequence[LabelledDemonstration],
    parts: Sequence[Sequence[int]],
    watch: _ProgressCounter,
) -> Generator[Progress, None, dict[Variant, VariantResult]]:
    """What variants that share their features spend, one after the other."""
    spent = {variant: VariantResult() for variant in alike}
    try:
        prepared = yield from _compute_features(labelled, alike[0], watch)
    except InputError as error:
        _note_refusal(alike, spent, error)
    else:
        for group in sharing_fit(alike):
            yield from _measure_folds(prepared, group, parts, spent, watch)
    return spent


def _measure_alike_remotely(
    alike: Sequence[Variant],
    labelled: Sequence[LabelledDemonstration],
    parts: Sequence[Sequence[int]],
) -> dict[Variant, VariantResult]:
    return finish(_measure_alike(alike, labelled, parts, _ProgressCounter(alike, len(parts))))


class _ProgressCounter:
    """How far all of it is: a step for each fold of each fit, and one for each set of features."""

    def __init__(self, variants: Sequence[Variant], parts: int) -> None:
        groups = sharing_features(variants)
        fits = sum(len(sharing_fit(alike)) for alike in groups)
        self.total = len(groups) + fits * parts
        self.done = 0

    def progress(self, text: str) -> Progress:
        return Progress(min(self.done, self.total), self.total, text)


def _note_refusal(
    variants: Sequence[Variant], spent: dict[Variant, VariantResult], error: InputError
) -> None:
    """Remember why some variants have no figures."""
    for variant in variants:
        spent[variant].refusal = str(error)


def _compute_features(
    labelled: Sequence[LabelledDemonstration], variant: Variant, watch: _ProgressCounter
) -> Generator[Progress, None, Prepared]:
    """Compute the features of all demonstrations, each on the clock."""
    settings, text = variant.settings, f"{variant.name} {variant.setting}: features"
    rate = common_rate([item.demonstration for item in labelled], settings)
    yield watch.progress(text)
    # Untimed, as counting memory takes time; it also loads and plans what the others then find.
    _, peak = measure_peak(lambda: prepare_examples(labelled[0], settings, rate))
    examples, seconds = [], []
    for item in labelled:
        prepared, duration = measure_seconds(partial(prepare_examples, item, settings, rate))
        examples.append(prepared)
        seconds.append(duration)
        yield watch.progress(text)
    watch.done += 1
    return Prepared(labelled, examples, seconds, peak)


def _measure_folds(
    prepared: Prepared,
    group: Sequence[Variant],
    parts: Sequence[Sequence[int]],
    spent: dict[Variant, VariantResult],
    watch: _ProgressCounter,
) -> Generator[Progress, None, None]:
    """Fit what a group of variants shares, then recognise the left-out ones by each of them."""
    actions = actions_of(prepared.examples)
    # A decoder needs more of a fit, which variants without one leave alone.
    first = next((variant for variant in group if variant.settings.decodes), group[0])
    ended = watch.done + len(parts)
    try:
        for number, part in enumerate(parts, 1):
            text = f"{group[0].name} {group[0].setting}: {number} of {len(parts)}"
            train = [e for i, e in enumerate(prepared.examples) if i not in part]
            recogniser, fitted = yield from _fit(train, first, watch, text)
            for variant in group:
                own = replace(
                    recogniser,
                    settings=variant.settings,
                    grammar=recogniser.grammar if variant.settings.decodes else None,
                )
                result = spent[variant]
                result.fit += fitted
                result.trained += sum(m for i, m in enumerate(prepared.minutes) if i not in part)
                for i in part:
                    recognise(own, prepared, i, actions, result)
                    yield watch.progress(text)
            watch.done += 1
    except InputError as error:
        _note_refusal(group, spent, error)
    watch.done = ended


def _fit(
    train: Sequence[Examples], variant: Variant, watch: _ProgressCounter, text: str
) -> Generator[Progress, None, tuple[Recogniser, float]]:
    """A recogniser and the CPU seconds of its fit, without those of the receiver of progress."""
    job = fit_examples(train, variant.settings)
    grown = 0.0
    try:
        while True:
            began = time.process_time()
            try:
                next(job)
            except StopIteration as end:
                recogniser: Recogniser = end.value
                return recogniser, grown + time.process_time() - began
            grown += time.process_time() - began
            yield watch.progress(text)
    finally:
        job.close()


def main_coder(project: Project, task: str) -> str:
    """The coder who labelled most demonstrations of a task; `InputError` if none is labelled."""
    names = (name for info in project.demonstrations.infos(task) for name in info.labelled)
    count = Counter(name for name in names if not is_model(name))
    if not count:
        raise InputError(f"Nothing of the task '{task}' is labelled; label at least two actions.")
    return count.most_common(1)[0][0]


def size_text(task: str, data: Dataset) -> str:
    """What the rows call the labelled demonstrations of a task."""
    used = [item.demonstration for item in data.labelled if item.segments]
    seconds = sum(demonstration.duration for demonstration in used)
    return f"{task}, {len(used)} demonstrations, {seconds:.0f} s"


def measure_tasks(
    project: Project,
    tasks: Sequence[str],
    author: str | None = None,
    *,
    quick: bool = False,
    thorough: bool = False,
) -> Generator[Progress, None, Table]:
    """Measure recognition on tasks of a project, all if none is named; the project stays as it is.

    By default on the labels of each task's main coder. `quick` measures a few variants only,
    `thorough` leaves out one demonstration at a time, however many there are.
    """

    def measure(labelled: Sequence[LabelledDemonstration], size: str) -> Rows:
        variants = QUICK if quick else VARIANTS
        return measure_variants(labelled, variants, size, None if thorough else FOLDS)

    rows = yield from rows_of_tasks(project, tasks, author, "recognition", measure)
    return Table("Recognition against run time", ERROR, SECONDS, rows, ".3f")


def rows_of_tasks(
    project: Project,
    tasks: Sequence[str],
    author: str | None,
    name: str,
    measure: Measure,
) -> Rows:
    """The rows of all tasks, of which one at least could be measured."""
    rows: list[Row] = []
    for task in tuple(tasks) or project.demonstrations.tasks():
        rows += yield from _rows_of_task(project, task, author, name, measure)
    if not rows:
        raise InputError(f"'{project.path}' has nothing to measure; import recordings first.")
    if not any(row.point for row in rows):
        reasons = dict.fromkeys(row.refusal for row in rows)
        raise InputError(" ".join([f"Nothing can be measured in '{project.path}'.", *reasons]))
    return tuple(rows)


def _rows_of_task(
    project: Project, task: str, author: str | None, name: str, measure: Measure
) -> Rows:
    """The rows of a task; a single one with its refusal where it cannot be measured."""
    try:
        data = load_dataset(project, [task], author or main_coder(project, task))
        return (yield from measure(data.labelled, size_text(task, data)))
    except InputError as error:
        return (Row(name, "all", task, "the coder's labels", refusal=str(error)),)


#: The kind of the runs that hold measurements.
KIND = "tradeoff"
#: The name of a variant that is measured because it is in use.
OWN = "yours"


@dataclass(frozen=True)
class Measured:
    """A measurement of one task on one author's labels, as run `number` of a project; UTC.

    `rows` has one row for each of `variants`.
    """

    number: int
    time: datetime
    task: str
    author: str
    labels: tuple[LabelsUsed, ...]
    variants: tuple[Variant, ...]
    rows: tuple[Row, ...]

    def place_of(self, settings: Settings) -> int | None:
        """The number of the row of some settings; None where they were not measured."""
        matches = (i for i, v in enumerate(self.variants) if same_method(v.settings, settings))
        return next(matches, None)


def same_method(first: Settings, second: Settings) -> bool:
    """Whether settings are the same by whatever preset's name."""
    return first.replace(preset="") == second.replace(preset="")


def measure_and_store(
    path: Path,
    task: str,
    author: str | None,
    own: Settings,
    variants: Sequence[Variant] = VARIANTS,
) -> Generator[Progress, None, int]:
    """Measure a task of the project at `path` and store the result there; gives the run's number.

    `own`, the settings in use, are measured too, and all variants take channels, rate and merge
    map from them. Opens the project itself, as it runs in a process of its own.
    """
    with Project.open(path) as project:
        project.refuse_read_only()  # before the work and not after it
        yield Progress(0, 1, "labels")
        coder = author or main_coder(project, task)
        data = load_dataset(project, [task], coder)
        measured = _with_own(variants, own)
        rows = yield from measure_variants(data.labelled, measured, size_text(task, data))
        provenance = Provenance(
            settings={"choice": {"tasks": [task], "author": coder}},
            seed=None,
            labels=data.labels,
            versions=versions(),
        )
        with interruptible():
            return project.runs.add(
                KIND,
                provenance,
                {
                    "digest": {
                        "title": task,
                        "tested": sum(bool(i.segments) for i in data.labelled),
                    },
                    "rows": [asdict(row) for row in rows],
                    "settings": [variant.settings.to_json() for variant in measured],
                },
            )


def with_data_of(settings: Settings, data: Settings) -> Settings:
    """Settings with what belongs to the recordings, not to the method, taken from others."""
    return settings.replace(channels=data.channels, rate=data.rate, merge=data.merge)


def _with_own(variants: Sequence[Variant], own: Settings) -> tuple[Variant, ...]:
    """The variants on the own data, and the own settings if they are not among them."""
    measured = [replace(v, settings=with_data_of(v.settings, own)) for v in variants]
    if not any(same_method(v.settings, own) for v in measured):
        measured.append(Variant(OWN, f"{own.preset}, changed", own))
    return tuple(measured)


def load_measured(project: Project, number: int) -> Measured:
    """A stored measurement; `InputError` if there is none, of this kind and undamaged."""
    run = project.runs.get(number)
    if run.kind != KIND:
        raise InputError(f"Run {number} of '{project.path}' is no measurement of recognition.")
    try:
        return _measured(run)
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        raise InputError(
            f"What run {number} of '{project.path}' measured is damaged; measure again."
        ) from error


def _measured(run: StoredRun) -> Measured:
    """A run as a measurement; whatever is raised over what it holds, it is damaged."""
    rows = tuple(Row(**plain) for plain in run.result["rows"])
    settings = [Settings.from_json(plain) for plain in run.result["settings"]]
    variants = tuple(
        Variant(row.name, row.setting, used) for row, used in zip(rows, settings, strict=True)
    )
    return Measured(
        number=run.id,
        time=run.time,
        task=str(run.tasks[0]),
        author=str(run.choice["author"]),
        labels=run.labels,
        variants=variants,
        rows=with_front(rows),
    )
