"""The recogniser that judged a demonstration without having seen it, made once more.

A run keeps no recogniser of its folds. To explain what one of them made of a demonstration it is
trained again with the labels, the settings and the seed of the run, so that it is the same one;
whether it predicts the same is checked.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.labels import UNLABELLED, Segments, to_codes
from forcelab.project import LabelsUsed, Project
from forcelab.recognition.certainty import Certainty
from forcelab.recognition.examples import Examples, Labelled, common_rate, kept_apart
from forcelab.recognition.grouping import groups
from forcelab.recognition.influence import Network, Voter, judge_of
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.storage import load
from forcelab.recognition.training import fit_trimmed, preparing
from forcelab.recognition.trimming import trimming
from forcelab.review.nearest import Summaries, summarised
from forcelab.review.outcome import Outcome

__all__ = ["Withheld", "track_at", "withholding"]

#: How many time steps that were trained on are kept, to replace features by.
SAMPLE = 2048

Real = NDArray[np.float64]
How = Literal["left out", "other task", "final"]


@dataclass(frozen=True, eq=False)
class Withheld:
    """A recogniser that has not seen a demonstration, and that demonstration as it sees it.

    Parameters
    ----------
    run : int
        Number of the run that this is about.
    how : "left out", "other task" or "final"
        Trained on all others, or all but its group; trained on another task; or the final
        recogniser, of a demonstration that was never labelled.
    demonstration : Demonstration
        The one that was not seen.
    examples : Examples
        Its features; f of them at each of n time steps.
    judge : Network or Voter
        The classifier.
    hertz : ndarray, shape (k,)
        Of the scales or windows, the smallest first.
    certainty : Certainty or None
        Of the run if it kept any, else of `judge`; None if that gives no probabilities.
    kept : bool
        Whether `certainty` is the run's.
    same : float
        The share of samples, 0 to 1, that this recogniser labels as the run did.
    mean : ndarray, shape (f,)
        Of the features over all time steps that were trained on.
    sample : ndarray, shape (m, f)
        Some of those time steps, drawn at random.
    training : Summaries
        The segments that were trained on.
    seconds : dict of str to float
        Run time of ``features`` and ``fit``.
    """

    run: int
    how: How
    demonstration: Demonstration
    examples: Examples
    judge: Network | Voter
    hertz: Real
    certainty: Certainty | None
    kept: bool
    same: float
    mean: Real
    sample: Real
    training: Summaries
    seconds: dict[str, float]

    @property
    def bytes(self) -> int:
        """About the memory that it takes, with all of a classifier that keeps what it saw."""
        arrays = (self.examples.features, self.sample, self.training.values)
        return sum(array.nbytes for array in arrays) + self.demonstration.signals.nbytes


def track_at(project: Project, used: LabelsUsed) -> Segments:
    """One author's segments as they were after an edit, whatever was edited since."""
    if project.head(used.demonstration, used.author) == used.edit:
        return project.track(used.demonstration, used.author).segments
    segments: Segments = ()
    for edit in project.history(used.demonstration, used.author):
        if edit.id > used.edit:
            break
        end = edit.position + len(edit.removed)
        segments = segments[: edit.position] + edit.inserted + segments[end:]
    return segments


def withholding(path: Path, outcome: Outcome, id_: str) -> Generator[Progress, None, Withheld]:
    """Train the recogniser of a run that has not seen a demonstration.

    Parameters
    ----------
    path : Path
        Of the project.
    outcome : Outcome
        The run.
    id_ : str
        Of a demonstration that the run tested or proposed labels for.

    Yields
    ------
    Progress
        Of features, a demonstration each; then of the fit, an epoch each.

    Raises
    ------
    InputError
        If the run has nothing to do with the demonstration, or it cannot be trained any more.
    """
    reviewed = outcome.find(id_)
    if reviewed is None:
        raise InputError(
            f"Run {outcome.number} neither tested nor proposed labels for this demonstration; "
            f"train again to have it explained."
        )
    started = perf_counter()
    with Project.open(path) as project:
        labelled = _labelled(project, outcome)
        own = next((item for item in labelled if item.demonstration.id == id_), None)
        held_out = own or Labelled(project.load(id_))
        final = None
        if own is None and outcome.recogniser:
            final = load(project.recogniser_path(outcome.recogniser))
    tested = {one.id for one in outcome.tested}
    how: How = "final" if own is None else "left out" if outcome.test_task is None else "other task"
    together = labelled
    if outcome.test_task is not None:
        together = [item for item in labelled if item.demonstration.id not in tested]
    learnt = [item for item in together if item is not own]
    if how == "left out":
        at = next(i for i, item in enumerate(together) if item is own)
        parts = groups([item.demonstration for item in together], outcome.folds)
        of = next(group for group in parts if at in group)
        learnt = [item for i, item in enumerate(together) if i not in of]
    # The run had all demonstrations on one grid, the one that is left out among them.
    rate = common_rate([item.demonstration for item in together], outcome.settings)
    settings = outcome.settings.replace(rate=rate)
    if final is not None:
        settings = settings.replace(rate=final.rate, channels=final.channels)
    *known, examples = yield from preparing([*learnt, held_out], settings)
    hertz = settings.bands(examples.rate)
    prepared = perf_counter()
    # What is shown as trained on must have been.
    known, left_out = yield from trimming(known, outcome.settings)
    training = Summaries.joined(
        [
            summarised(example, item.demonstration, len(hertz))
            for example, item in zip(known, learnt, strict=True)
        ]
    )
    recogniser = final or (yield from fit_trimmed(known, left_out, outcome.settings))
    fitted = perf_counter()
    judge = judge_of(recogniser)
    certainty = reviewed.certainty
    if certainty is None and (proba := judge.probabilities(examples.features)) is not None:
        certainty = Certainty.of(examples.times, proba, recogniser.actions)
    mean, sample = _rows(known, recogniser)
    # What was tested is scored on its own stamps; a proposal is as the recogniser made it.
    stamps = examples.times if own is None else held_out.demonstration.times
    return Withheld(
        run=outcome.number,
        how=how,
        demonstration=held_out.demonstration,
        examples=examples,
        judge=judge,
        hertz=hertz,
        certainty=certainty,
        kept=reviewed.certainty is not None,
        same=_same(recogniser, examples, stamps, reviewed.predicted),
        mean=mean,
        sample=sample,
        training=training,
        seconds={"features": prepared - started, "fit": fitted - prepared},
    )


def _labelled(project: Project, outcome: Outcome) -> list[Labelled]:
    """What the run had labels of, as they were then and in the run's order."""
    items, tasks = [], []
    for used in outcome.labels:
        segments = track_at(project, used)
        if segments:
            items.append(Labelled(project.load(used.demonstration), segments))
            tasks.append(project.info(used.demonstration).task)
    if not outcome.apart:
        return items
    return kept_apart([item.merged(outcome.settings.merge) for item in items], tasks)


def _rows(known: Sequence[Examples], recogniser: Recogniser) -> tuple[Real, Real]:
    """The mean over all time steps that were trained on, and some of them drawn at random."""
    stride, actions = recogniser.settings.stride, recogniser.actions
    random = np.random.default_rng(recogniser.settings.seed)
    parts = []
    for example in known:
        trained = example.codes(actions)[::stride] != UNLABELLED
        parts.append(example.features[::stride][trained])
    counts = np.array([len(part) for part in parts])
    mean = np.sum([part.sum(axis=0) for part in parts], axis=0) / counts.sum()
    picked = np.sort(random.integers(counts.sum(), size=SAMPLE))
    firsts = np.cumsum(counts) - counts
    owner = np.searchsorted(firsts, picked, side="right") - 1
    sample = [part[picked[owner == i] - firsts[i]] for i, part in enumerate(parts)]
    return mean, np.concatenate(sample)


def _same(recogniser: Recogniser, examples: Examples, stamps: Real, before: Segments) -> float:
    """The share of samples on which the recogniser and the run's prediction agree."""
    prediction = recogniser.predict_examples(examples)
    actions = tuple(dict.fromkeys((*recogniser.actions, *(s.action for s in before))))
    now = prediction.filtered[examples.nearest(stamps)]
    return float(np.mean(now == to_codes(before, stamps, actions)))
