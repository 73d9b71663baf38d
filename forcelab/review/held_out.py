"""The recogniser of a run that has not seen a demonstration, trained again.

A run stores no recogniser of its folds. To explain what one of them predicted it is trained again
with the labels, the settings and the seed of the run, so that it is the same one; whether it
predicts the same is checked.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Literal

import numpy as np

from forcelab.arrays import Real
from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.labels import Segments, to_codes
from forcelab.project import LabelsUsed, Project
from forcelab.recognition.attribution import BlackBoxScorer, MlpScorer, make_scorer
from forcelab.recognition.ensemble import training_steps
from forcelab.recognition.examples import (
    Examples,
    LabelledDemonstration,
    common_rate,
    gather_features,
    suffix_actions,
)
from forcelab.recognition.groups import fold_groups
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.storage import load_recogniser
from forcelab.recognition.training import clean_examples, fit_cleaned, prepare_all
from forcelab.review.run_result import RunResult
from forcelab.review.similar_segments import SegmentFeatures, summarise_segments
from forcelab.segment_edits import spliced

#: How many time steps that were trained on are kept, to replace features by.
SAMPLE = 2048

TrainedHow = Literal["left out", "other task", "final"]


@dataclass(frozen=True, eq=False)
class HeldOutModel:
    """A recogniser that has not seen a demonstration, and that demonstration's examples."""

    run: int  # number of the run that this is about
    #: Trained on all others, or all but its group; trained on another task; or the final
    #: recogniser, of a demonstration that was never labelled
    how: TrainedHow
    demonstration: Demonstration  # the one that was not seen
    examples: Examples  # its features; f of them at each of n time steps
    scorer: MlpScorer | BlackBoxScorer
    hertz: Real  # (k,); of the scales or windows, the smallest first
    #: Of the run if it kept any, else of the scorer; None if that gives no probabilities
    probability_trace: ProbabilityTrace | None
    trace_from_run: bool  # whether the trace is the run's
    same_share: float  # of samples, 0 to 1, that this recogniser labels as the run did
    mean: Real  # (f,); of the features over all time steps that were trained on
    sample: Real  # (m, f); some of those time steps, drawn at random
    training: SegmentFeatures  # the segments that were trained on
    seconds: dict[str, float]  # run time of ``features`` and ``fit``

    @property
    def bytes(self) -> int:
        """About the memory that it takes."""
        arrays = (self.examples.features, self.sample, self.training.values)
        return sum(array.nbytes for array in arrays) + self.demonstration.signals.nbytes


def track_after_edit(project: Project, used: LabelsUsed) -> Segments:
    """One author's segments as they were after an edit, whatever was edited since."""
    if project.tracks.head(used.demonstration, used.author) == used.edit:
        return project.tracks.get(used.demonstration, used.author).segments
    segments: Segments = ()
    for edit in project.tracks.history(used.demonstration, used.author):
        if edit.id > used.edit:
            break
        segments = spliced(segments, edit.position, edit.removed, edit.inserted)
    return segments


def train_held_out(path: Path, run: RunResult, id_: str) -> Generator[Progress, None, HeldOutModel]:
    """Train the recogniser of a run that has not seen a demonstration.

    Progress over features, a demonstration each; then over the fit, an epoch each. An InputError
    says that the run has nothing to do with the demonstration, or it cannot be trained any more.
    """
    result = run.result_of(id_)
    if not run.settings.known_features:
        raise InputError(
            f"Run {run.number} knows only the features of '{run.settings.features}', which are of "
            f"no channel and frequency that could be shown; train with windows beside them, as "
            f"windows+{run.settings.features}."
        )
    started = perf_counter()
    with Project.open(path) as project:
        labelled = _labelled(project, run)
        labelled_item = next((item for item in labelled if item.demonstration.id == id_), None)
        held_out = labelled_item or LabelledDemonstration(project.demonstrations.load(id_))
        final = None
        if labelled_item is None and run.recogniser:
            final = load_recogniser(project.runs.recogniser_path(run.recogniser))
    how: TrainedHow = (
        "final" if labelled_item is None else "left out" if run.test_task is None else "other task"
    )
    together = [item for item in labelled if not item.added]
    if run.test_task is not None:
        tested = {item.id for item in run.tested}
        together = [item for item in labelled if item.demonstration.id not in tested]
    learnt = _without_fold_of(id_, together, run.folds) if how == "left out" else together
    learnt = [*learnt, *(item for item in labelled if item.added)]
    # The run had all demonstrations on one grid, the one that is left out among them.
    rate = common_rate([item.demonstration for item in together], run.settings)
    settings = run.settings.replace(rate=rate)
    if final is not None:
        settings = settings.replace(rate=final.rate, channels=final.channels)
    *training_examples, examples = yield from prepare_all([*learnt, held_out], settings)
    hertz = settings.bands(examples.rate)
    prepared = perf_counter()
    # What is shown as trained on must have been.
    training_examples, left_out = yield from clean_examples(training_examples, run.settings)
    training = SegmentFeatures.joined(
        [
            summarise_segments(example, item.demonstration, len(hertz))
            for example, item in zip(training_examples, learnt, strict=True)
        ]
    )
    recogniser = final or (yield from fit_cleaned(training_examples, left_out, run.settings))
    fitted = perf_counter()
    scorer = make_scorer(recogniser)
    trace = result.probability_trace
    if trace is None and (proba := scorer.probabilities(examples.features)) is not None:
        trace = ProbabilityTrace.from_probabilities(examples.times, proba, recogniser.actions)
    codes = [example.codes(recogniser.actions) for example in training_examples]
    stride = run.settings.training_stride(recogniser.rate)
    _, _, steps = training_steps(codes, stride, complete=True)
    (X,) = yield from gather_features(training_examples, steps)
    drawn = np.random.default_rng(run.settings.seed).integers(len(X), size=SAMPLE)
    # What was tested is scored on its own stamps; a proposal is as the recogniser made it.
    stamps = examples.times if labelled_item is None else held_out.demonstration.times
    return HeldOutModel(
        run=run.number,
        how=how,
        demonstration=held_out.demonstration,
        examples=examples,
        scorer=scorer,
        hertz=hertz,
        probability_trace=trace,
        trace_from_run=result.probability_trace is not None,
        same_share=_same_share(recogniser, examples, stamps, result.predicted),
        mean=X.mean(axis=0),
        sample=X[np.sort(drawn)],
        training=training,
        seconds={"features": prepared - started, "fit": fitted - prepared},
    )


def _without_fold_of(
    id_: str, labelled: Sequence[LabelledDemonstration], folds: int
) -> list[LabelledDemonstration]:
    """The demonstrations that are learnt from while one is left out, alone or with its group."""
    ids = [item.demonstration.id for item in labelled]
    groups = fold_groups([item.demonstration for item in labelled], folds)
    fold = next(group for group in groups if ids.index(id_) in group)
    return [item for i, item in enumerate(labelled) if i not in fold]


def _labelled(project: Project, run: RunResult) -> list[LabelledDemonstration]:
    """The demonstrations that the run had labels of, as they were then and in the run's order."""
    items, tasks = [], []
    for used in run.labels:
        segments = track_after_edit(project, used)
        if segments:
            demonstration = project.demonstrations.load(used.demonstration)
            added = used.author != run.author
            items.append(LabelledDemonstration(demonstration, segments, added=added))
            tasks.append(project.demonstrations.info(used.demonstration).task)
    if not run.apart:
        return items
    return suffix_actions([item.merged(run.settings.merge) for item in items], tasks)


def _same_share(
    recogniser: Recogniser, examples: Examples, stamps: Real, before: Segments
) -> float:
    """The share of samples on which the recogniser and the run's prediction agree."""
    prediction = recogniser.predict_examples(examples)
    actions = tuple(dict.fromkeys((*recogniser.actions, *(s.action for s in before))))
    now = prediction.filtered[examples.nearest(stamps)]
    return float(np.mean(now == to_codes(before, stamps, actions)))
