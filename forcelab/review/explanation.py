"""Explanations: why a recogniser predicted an action, and which training segments are alike.

*The held-out model.* A run stores no recogniser of its folds. To explain what one of them predicted
it is trained again with the labels, the settings and the seed of the run, so that it is the same
one; whether it predicts the same is checked.

*Attribution.* The log-odds of the predicted action against the human's, averaged over the time
steps of an interval, are shared out among channels and scales; where the two do not differ, or one
of them is unknown, the most probable other action takes the place of the missing one. For the MLP
by integrated gradients from the mean of all training time steps
(:mod:`forcelab.recognition.attribution`): they add up to the change of the log-odds, and the gap
says what is missing from that. For every other classifier by permutation: magnitude and phase of
one channel and scale are replaced by those of random training time steps, and the loss of log-odds
is what they contributed. Its error is the standard error over repetitions; such losses need not add
up, and bands that carry the same information hide each other.

*Neighbours.* A segment is described by mean and standard deviation of the log magnitudes of each
channel and scale, the mean level of each channel, and the logarithm of its duration. Each is
divided by its standard deviation over all training segments, so that none outweighs the others by
its unit; the distance of two segments is Euclidean.
"""

from __future__ import annotations

from collections.abc import Collection, Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from time import perf_counter
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.jobs import Progress, job
from forcelab.labels import UNLABELLED, Interval, Segments, to_codes
from forcelab.project import LabelsUsed, Project
from forcelab.recognition.attribution import (
    BlackBoxScorer,
    MlpScorer,
    Scorer,
    log_odds,
    make_scorer,
)
from forcelab.recognition.examples import (
    Examples,
    LabelledDemonstration,
    common_rate,
    suffix_actions,
)
from forcelab.recognition.groups import fold_groups
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.settings import Settings
from forcelab.recognition.storage import load_recogniser
from forcelab.recognition.training import clean_examples, fit_cleaned, prepare_all
from forcelab.review.differences import action_over, interval_at
from forcelab.review.run_result import RunResult
from forcelab.segment_edits import spliced
from forcelab.signals.channels import channel_map
from forcelab.signals.grid import measured
from forcelab.signals.minmax import run_extremes

Real = NDArray[np.float64]

#: How many neighbours of an action are looked for.
NEIGHBOURS = 3


@dataclass(frozen=True)
class Neighbour:
    """A training segment and its distance."""

    place: Interval  # of another demonstration; ``human`` is its action
    distance: float  # in standard deviations of training segments, over all numbers together


@dataclass(frozen=True, eq=False)
class SegmentFeatures:
    """The training segments of one or several demonstrations in numbers."""

    places: tuple[Interval, ...]  # length m; ``human`` is the action
    values: Real  # (m, d); not yet divided by anything

    @classmethod
    def joined(cls, parts: Sequence[SegmentFeatures]) -> SegmentFeatures:
        """Those of several demonstrations together; of at least one."""
        places = tuple(place for part in parts for place in part.places)
        return cls(places, np.concatenate([part.values for part in parts]))


def summarise(
    examples: Examples, demonstration: Demonstration, scales: int, start: float, end: float
) -> Real | None:
    """The numbers (d,) that describe ``[start, end)`` seconds of a demonstration.

    None where the stretch has no time step, or only some in gaps.
    """
    steps = slice(*np.searchsorted(examples.times, (start, end)))
    rows = examples.features[steps][examples.valid[steps]]
    if not len(rows):
        return None
    channels = channel_map(demonstration.channels, examples.channels)
    # All log magnitudes come first; phases, where there are any, have no mean to speak of.
    magnitudes = rows[:, : scales * len(examples.channels)]
    samples = slice(*np.searchsorted(demonstration.times, (start, end)))
    levels = channels.apply(demonstration.signals[samples][:, channels.recorded])
    known = measured(levels)
    counts = np.maximum(known.sum(axis=1), 1)
    return np.concatenate(
        [
            magnitudes.mean(axis=0),
            magnitudes.std(axis=0),
            np.where(known, levels, 0.0).sum(axis=1) / counts,
            [np.log(end - start)],
        ]
    )


def summarise_segments(
    examples: Examples, demonstration: Demonstration, scales: int
) -> SegmentFeatures:
    """The numbers of all human segments of a demonstration."""
    places, values = [], []
    for segment in examples.segments:
        summary = summarise(examples, demonstration, scales, segment.start, segment.end)
        if summary is not None:
            places.append(Interval(demonstration.id, segment.start, segment.end, segment.action))
            values.append(summary)
    width = (2 * scales + 1) * len(examples.channels) + 1
    return SegmentFeatures(tuple(places), np.array(values).reshape(len(values), width))


def nearest_segments(
    target: Real,
    training: SegmentFeatures,
    action: str,
    count: int = NEIGHBOURS,
    without: Collection[str] = (),
) -> tuple[Neighbour, ...]:
    """The training segments of one action nearest to a stretch (d,), the nearest one first.

    The standard deviations are those of the training segments of all actions. Of equally near ones
    the first in `training` comes first; demonstrations in `without` are left out.
    """
    chosen = [
        i
        for i, place in enumerate(training.places)
        if place.human == action and place.demonstration not in without
    ]
    if not chosen:
        return ()
    spread = training.values.std(axis=0)
    spread[spread == 0] = 1.0  # all training segments are alike in this
    distances = np.linalg.norm((training.values[chosen] - target) / spread, axis=1)
    order = np.argsort(distances, kind="stable")[:count]
    return tuple(Neighbour(training.places[chosen[i]], float(distances[i])) for i in order)


#: Columns that a trace has at most, and the width in pixels of its frame.
COLUMNS, WIDTH = 160, 192


@dataclass(frozen=True, eq=False)
class ForcePreview:
    """Forces and video frame of a stretch, for a thumbnail."""

    name: str  # of the demonstration
    #: low, high: (m, c); least and greatest sample of each column of time and each recorded
    #: channel, in the channel's unit; NaN where there is none
    low: Real
    high: Real
    #: (h, w, 3); the video's frame in the middle, made small; None without a video
    frame: NDArray[np.uint8] | None = None


def force_preview(
    demonstration: Demonstration, start: float, end: float, columns: int = COLUMNS
) -> ForcePreview:
    """The forces of ``[start, end)`` seconds, without the frame."""
    first, last = np.searchsorted(demonstration.times, (start, end)).tolist()
    first = min(first, len(demonstration.times) - 1)  # the last sample lasts on after its stamp
    values = demonstration.signals[first : max(last, first + 1)]
    firsts = np.unique(np.linspace(0, len(values), columns, endpoint=False).astype(np.int64))
    extremes = run_extremes(values, firsts, np.append(firsts[1:], len(values)))
    return ForcePreview(demonstration.name, extremes.low, extremes.high)


def preview_job(
    path: Path, places: Sequence[Interval]
) -> Generator[Progress, None, list[ForcePreview]]:
    """Previews of intervals of a project; a video that cannot be read gives no frame."""
    previews = []
    with Project.open(path) as project:
        for place in places:
            demonstration = project.demonstrations.load(place.demonstration)
            preview = force_preview(demonstration, place.start, place.end)
            if demonstration.video is not None:
                middle = 0.5 * (place.start + place.end)
                frame = yield from _read_frame(demonstration.video, middle)
                preview = ForcePreview(preview.name, preview.low, preview.high, frame)
            previews.append(preview)
            yield Progress(len(previews), len(places), "traces")
    return previews


def _read_frame(
    video: VideoReference, time: float
) -> Generator[Progress, None, NDArray[np.uint8] | None]:
    """The frame at a time on the force clock (s); None before the first one or if undecodable."""
    from forcelab.video.index import indexing
    from forcelab.video.reader import VideoReader

    try:
        index = yield from indexing(video.path)
        with VideoReader(video.path, index, cache=0) as reader:
            number = reader.index_at(float(video.clock.to_device(time)))
            if number < 0:
                return None
            for _ in reader.reaching(number):
                yield Progress(0, 1, "frame")
            frame = reader.frame(number)  # kept by now
    except InputError:  # the Label workspace shows the error
        return None
    step = max(1, frame.shape[1] // WIDTH)
    height, width = (size // step * step for size in frame.shape[:2])
    # Means of squares of pixels: every step-th pixel alone would flicker with texture.
    blocks = frame[:height, :width].reshape(height // step, step, width // step, step, 3)
    return np.ascontiguousarray(blocks.mean(axis=(1, 3)).round().astype(np.uint8))


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
    tested = {demonstration_item.id for demonstration_item in run.tested}
    how: TrainedHow = (
        "final" if labelled_item is None else "left out" if run.test_task is None else "other task"
    )
    together = [item for item in labelled if not item.added]
    if run.test_task is not None:
        together = [item for item in labelled if item.demonstration.id not in tested]
    learnt = [item for item in together if item is not labelled_item]
    if how == "left out":
        at = next(i for i, item in enumerate(together) if item is labelled_item)
        parts = fold_groups([item.demonstration for item in together], run.folds)
        fold = next(group for group in parts if at in group)
        learnt = [item for i, item in enumerate(together) if i not in fold]
    learnt += [item for item in labelled if item.added]
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
    mean, sample = _rows(training_examples, recogniser)
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
        mean=mean,
        sample=sample,
        training=training,
        seconds={"features": prepared - started, "fit": fitted - prepared},
    )


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


def _rows(training_examples: Sequence[Examples], recogniser: Recogniser) -> tuple[Real, Real]:
    """The mean over all time steps that were trained on, and some of them drawn at random."""
    stride, actions = recogniser.settings.training_stride(recogniser.rate), recogniser.actions
    random = np.random.default_rng(recogniser.settings.seed)
    parts = []
    for example in training_examples:
        trained = example.codes(actions)[::stride] != UNLABELLED
        parts.append(example.features[::stride][trained])
    counts = np.array([len(part) for part in parts])
    mean = np.sum([part.sum(axis=0) for part in parts], axis=0) / counts.sum()
    picked = np.sort(random.integers(counts.sum(), size=SAMPLE))
    firsts = np.cumsum(counts) - counts
    owner = np.searchsorted(firsts, picked, side="right") - 1
    sample = [part[picked[owner == i] - firsts[i]] for i, part in enumerate(parts)]
    return mean, np.concatenate(sample)


def _same_share(
    recogniser: Recogniser, examples: Examples, stamps: Real, before: Segments
) -> float:
    """The share of samples on which the recogniser and the run's prediction agree."""
    prediction = recogniser.predict_examples(examples)
    actions = tuple(dict.fromkeys((*recogniser.actions, *(s.action for s in before))))
    now = prediction.filtered[examples.nearest(stamps)]
    return float(np.mean(now == to_codes(before, stamps, actions)))


#: Of a permutation: time steps of the place that are looked at, at most, and repetitions.
STEPS, REPEATS = 64, 8
#: Time steps whose gradients are taken at once.
BLOCK = 4096


@dataclass(frozen=True, eq=False)
class Attribution:
    """Contribution of each of k bands of q channels to the log-odds of two actions."""

    method: Literal["gradient", "permutation"]
    #: bands, bands_error: (q, k); log-odds, means over time steps, of each channel and scale;
    #: positive speaks for the favoured action. Errors are standard errors over repetitions, 0 for
    #: the gradient.
    bands: Real
    bands_error: Real
    #: channels, channels_error: (q,); the same of all scales of a channel together
    channels: Real
    channels_error: Real
    #: log_odds, reference: mean log-odds at the place, and at the mean of what was trained on (of a
    #: permutation: with every feature replaced)
    log_odds: float
    reference: float
    gap: float  # of the gradient: by how much the bands together miss ``log_odds - reference``
    #: steps, repeats: time steps that were looked at, and how often each band was replaced
    #: (gradient: 0)
    steps: int
    repeats: int


def attribute_bands(
    scorer: Scorer,
    rows: Real,
    favoured: str,
    against: str,
    shape: tuple[int, int],
    bands: NDArray[np.int64],
    *,
    mean: Real,
    sample: Real,
    seed: int = 0,
) -> Generator[Progress, None, Attribution]:
    """Contribution of each band to the log-odds of two actions, over time steps (n, f).

    By gradient where possible, else by permutation. `shape` are channels q and scales k, and
    `bands` (f,) say which of them each feature is of, as
    :meth:`~forcelab.recognition.settings.Settings.feature_bands` does; q times k is none. The
    gradient compares with
    `mean` (f,), permutation replaces by rows of `sample` (m, f).
    """
    if isinstance(scorer, MlpScorer):
        return (yield from _by_gradient(scorer, rows, favoured, against, shape, bands, mean))
    return (yield from _by_permutation(scorer, rows, favoured, against, shape, bands, sample, seed))


def _by_gradient(
    network: MlpScorer,
    rows: Real,
    favoured: str,
    against: str,
    shape: tuple[int, int],
    bands_of: NDArray[np.int64],
    mean: Real,
) -> Generator[Progress, None, Attribution]:
    """The integrated gradients of all features, summed by band."""
    total = np.zeros(rows.shape[1])
    for first in range(0, len(rows), BLOCK):
        block = rows[first : first + BLOCK]
        total += network.integrated_gradients(block, mean, favoured, against).sum(axis=0)
        yield Progress(min(first + BLOCK, len(rows)), len(rows), "explaining")
    shares = total / len(rows)
    sums = np.bincount(bands_of, shares, shape[0] * shape[1] + 1)[:-1]
    bands = np.asarray(sums, dtype=np.float64).reshape(shape)
    log_odds_here = float(log_odds(network, rows, favoured, against).mean())
    log_odds_reference = float(log_odds(network, mean[np.newaxis], favoured, against)[0])
    return Attribution(
        method="gradient",
        bands=bands,
        bands_error=np.zeros(shape),
        channels=bands.sum(axis=1),
        channels_error=np.zeros(shape[0]),
        log_odds=log_odds_here,
        reference=log_odds_reference,
        gap=abs(float(shares.sum()) - (log_odds_here - log_odds_reference)),
        steps=len(rows),
        repeats=0,
    )


def _by_permutation(
    scorer: Scorer,
    rows: Real,
    favoured: str,
    against: str,
    shape: tuple[int, int],
    bands: NDArray[np.int64],
    sample: Real,
    seed: int,
) -> Generator[Progress, None, Attribution]:
    """The loss of log-odds when a band, or a whole channel, is replaced."""
    random = np.random.default_rng(seed)
    chosen = np.unique(np.linspace(0, len(rows) - 1, STEPS).round().astype(np.int64))
    chosen_rows = rows[chosen]
    log_odds_here = float(log_odds(scorer, chosen_rows, favoured, against).mean())
    q, k = shape
    groups = [np.flatnonzero(bands == band) for band in range(q * k)]
    groups += [np.flatnonzero(bands // k == channel) for channel in range(q)]
    groups.append(np.arange(rows.shape[1]))
    losses, errors = np.zeros(len(groups)), np.zeros(len(groups))
    for number, columns in enumerate(groups):
        drawn = random.integers(len(sample), size=REPEATS * len(chosen_rows))
        changed = np.tile(chosen_rows, (REPEATS, 1))
        changed[:, columns] = sample[np.ix_(drawn, columns)]
        left = log_odds(scorer, changed, favoured, against).reshape(REPEATS, -1).mean(axis=1)
        losses[number] = log_odds_here - left.mean()
        errors[number] = left.std(ddof=1) / np.sqrt(REPEATS)
        yield Progress(number + 1, len(groups), "explaining")
    return Attribution(
        method="permutation",
        bands=losses[: q * k].reshape(shape),
        bands_error=errors[: q * k].reshape(shape),
        channels=losses[q * k : -1],
        channels_error=errors[q * k : -1],
        log_odds=log_odds_here,
        reference=log_odds_here - float(losses[-1]),
        gap=0.0,
        steps=len(chosen_rows),
        repeats=REPEATS,
    )


@dataclass(frozen=True, slots=True)
class Band:
    """One channel at one scale, and how much it speaks for the favoured action."""

    channel: str
    hertz: float  # of the scale
    #: weight, error: log-odds, natural logarithm; the error is a standard error
    weight: float
    error: float


@dataclass(frozen=True, eq=False)
class Explanation:
    """An explanation of one interval."""

    place: Interval  # the explained one
    #: favoured, against: what bands speak for, and against
    favoured: str
    against: str
    channels: tuple[str, ...]  # length q
    hertz: Real  # (k,); of the scales, the highest first
    attribution: Attribution
    #: How probable each action is over the whole demonstration
    probability_trace: ProbabilityTrace | None
    trace_from_run: bool  # whether that is the run's own, not computed anew
    how: str  # which recogniser it was; see :class:`~forcelab.review.explanation.HeldOutModel`
    same_share: float  # of samples, 0 to 1, that the recogniser labels as the run did
    #: The nearest training segments of `favoured` and of `against`
    neighbours: Mapping[str, tuple[Neighbour, ...]]
    seconds: Mapping[str, float]  # run time of ``features`` and ``fit``
    remarks: tuple[str, ...] = ()  # a sentence for each thing that is not as one might think

    def strongest(self, count: int = 3) -> tuple[Band, ...]:
        """The bands that weigh most, for or against, the heaviest first."""
        weights, errors = self.attribution.bands, self.attribution.bands_error
        order = np.argsort(-np.abs(weights), axis=None, kind="stable")[:count]
        return tuple(
            Band(
                self.channels[i],
                float(self.hertz[j]),
                float(weights[i, j]),
                float(errors[i, j]),
            )
            for i, j in zip(*np.unravel_index(order, weights.shape), strict=True)
        )

    def to_json(self) -> dict[str, Any]:
        """Everything but the probabilities outside of the place, as plain values."""
        attribution = self.attribution
        return {
            "place": _interval_json(self.place),
            "favoured": self.favoured,
            "against": self.against,
            "probabilities": self._probabilities(),
            "probabilities_of_run": self.trace_from_run,
            "recogniser": {"how": self.how, "same": self.same_share, "seconds": dict(self.seconds)},
            "method": attribution.method,
            "log_odds": attribution.log_odds,
            "reference": attribution.reference,
            "gap": attribution.gap,
            "steps": attribution.steps,
            "repeats": attribution.repeats,
            "channels": [
                {"channel": name, "weight": float(weight), "error": float(error)}
                for name, weight, error in zip(
                    self.channels, attribution.channels, attribution.channels_error, strict=True
                )
            ],
            "hertz": self.hertz.tolist(),
            "bands": attribution.bands.tolist(),
            "bands_error": attribution.bands_error.tolist(),
            "nearest": {
                action: [_interval_json(n.place) | {"distance": n.distance} for n in found_here]
                for action, found_here in self.neighbours.items()
            },
            "remarks": list(self.remarks),
        }

    def _probabilities(self) -> dict[str, float] | None:
        """Mean probability of each action over the place."""
        if self.probability_trace is None:
            return None
        values = self.probability_trace.mean(self.place.start, self.place.end)
        return dict(zip(self.probability_trace.actions, values.tolist(), strict=True))


def explain(
    held_out: HeldOutModel, run: RunResult, place: Interval, hidden: Collection[str] = ()
) -> Generator[Progress, None, Explanation]:
    """Explain an interval, without neighbours in the `hidden` demonstrations."""
    examples, scorer = held_out.examples, held_out.scorer
    steps = slice(*np.searchsorted(examples.times, (place.start, place.end)))
    rows = examples.features[steps][examples.valid[steps]]
    if not len(rows):
        raise InputError(
            f"There is no sample of '{examples.name}' from {place.start:.3f} to {place.end:.3f} s; "
            f"choose a longer stretch."
        )
    favoured, against = _sides(scorer, rows, place)
    shape = len(examples.channels), len(held_out.hertz)
    bands = run.settings.feature_bands(len(examples.channels), examples.rate)
    # One's own features, which come last, are of no channel and band.
    own = rows.shape[1] - len(bands)
    bands = np.append(bands, np.full(own, shape[0] * shape[1]))
    attribution = yield from attribute_bands(
        scorer, rows, favoured, against, shape, bands, mean=held_out.mean, sample=held_out.sample
    )
    target = summarise(
        examples, held_out.demonstration, len(held_out.hertz), place.start, place.end
    )
    assert target is not None  # there are samples
    neighbours = {}
    for action in (favoured, against):
        near = nearest_segments(
            target, held_out.training, action, without={place.demonstration, *hidden}
        )
        neighbours[action] = tuple(_neighbour_with_prediction(run, neighbour) for neighbour in near)
    return Explanation(
        place=place,
        favoured=favoured,
        against=against,
        channels=examples.channels,
        hertz=held_out.hertz,
        attribution=attribution,
        probability_trace=held_out.probability_trace,
        trace_from_run=held_out.trace_from_run,
        how=held_out.how,
        same_share=held_out.same_share,
        neighbours=neighbours,
        seconds=held_out.seconds,
        remarks=_remarks(held_out, place) + _own_remarks(run.settings),
    )


@job
def explain_at_job(
    path: str | PathLike[str], run: RunResult, id_: str, time: float
) -> Generator[Progress, None, Explanation]:
    """Explain what a run predicted at a time of a demonstration.

    The recogniser that has not seen the demonstration is trained once more.

    Parameters
    ----------
    path : path-like
        The project's.
    run : RunResult
        The run.
    id_ : str
        The demonstration's.
    time : float
        Seconds.

    Yields
    ------
    Progress

    Raises
    ------
    InputError
        If the run did not test it, or neither the human nor the run says anything at that time.

    Examples
    --------
    >>> id_ = project.demonstrations.id_of("foam 01")
    >>> explanation = forcelab.finish(forcelab.explain_at_job(project.path, run, id_, 1.0))
    >>> explanation.favoured
    'still'
    """
    result = run.result_of(id_)
    place = interval_at(result, time)
    if place is None:
        raise InputError(
            f"Nothing is labelled or predicted in '{result.name}' at {time:g} s; choose another "
            f"time."
        )
    held_out = yield from train_held_out(Path(path), run, id_)
    return (yield from explain(held_out, run, place))


def _sides(scorer: Scorer, rows: Real, place: Interval) -> tuple[str, str]:
    """The favoured action, and the one that it is compared with."""
    actions, scores = scorer.actions, scorer.scores(rows).mean(axis=0)
    order = [actions[i] for i in np.argsort(-scores, kind="stable")]
    favoured = place.predicted if place.predicted in actions else order[0]
    assert favoured is not None
    if place.human in actions and place.human not in (None, favoured):
        return favoured, place.human
    return favoured, next(action for action in order if action != favoured)


def _neighbour_with_prediction(run: RunResult, neighbour: Neighbour) -> Neighbour:
    place, result = neighbour.place, run.find(neighbour.place.demonstration)
    if result is None:
        return neighbour
    predicted = action_over(result.predicted, place.start, place.end)
    return replace(neighbour, place=replace(place, predicted=predicted))


def _remarks(held_out: HeldOutModel, place: Interval) -> tuple[str, ...]:
    """Remarks on an unknown action, and on a model that predicts otherwise than the run."""
    remarks = []
    if place.human is not None and place.human not in held_out.scorer.actions:
        remarks.append(
            f"'{place.human}' is in no other demonstration, so that it could not be recognised."
        )
    if held_out.same_share < 1:
        remarks.append(
            f"The recogniser trained anew labels {100 * held_out.same_share:.1f} % of the samples "
            f"as the run did; the rest was made by another version or other settings."
        )
    return tuple(remarks)


def _own_remarks(settings: Settings) -> tuple[str, ...]:
    """A remark on features that no band shows."""
    if not settings.own_features:
        return ()
    paths = ", ".join(settings.own_features)
    return (f"The features of {paths} decided as well, but are of no channel and frequency.",)


def _interval_json(place: Interval) -> dict[str, Any]:
    return {
        "demonstration": place.demonstration,
        "start": place.start,
        "end": place.end,
        "human": place.human,
        "predicted": place.predicted,
        "confidence": place.confidence,
    }
