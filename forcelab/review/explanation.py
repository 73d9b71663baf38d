"""Why a recogniser saw an action somewhere: what spoke for it, and what it resembles.

The training segments that are most like a stretch of a demonstration. A segment is known by a few
numbers: mean and standard deviation of the log magnitudes of each channel and scale, the mean level
of each channel, and the logarithm of its duration. Each is divided by its standard deviation over
all training segments, so that none outweighs the others by its unit; the distance of two segments
is Euclidean.

The recogniser that judged a demonstration without having seen it, made once more. A run keeps no
recogniser of its folds. To explain what one of them made of a demonstration it is trained again
with the labels, the settings and the seed of the run, so that it is the same one; whether it
predicts the same is checked.

How much each channel and scale speaks for one action and against another. Two methods.
**Gradient**, for the MLP: how the log-odds grow along the straight line from the mean of all
training time steps to each time step of the place, shared out among the features; see
:mod:`forcelab.recognition.attribution`. The shares add up to the change of the log-odds, and what
is missing from that is told as the gap. **Permutation**, for every other classifier: the magnitude
and the phase of one channel and scale are replaced by those of random training time steps; what the
log-odds lose by it is what they owed to them. Its error is the standard error over repetitions;
such losses need not add up, and bands that know the same hide each other.

What is explained are the log-odds of two actions, averaged over the time steps of a place: of
the predicted action against the human's. Where the two do not differ, or one of them is not
known, the most probable other action takes the place of the missing one.
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
from forcelab.jobs import Progress
from forcelab.labels import UNLABELLED, Segments, to_codes
from forcelab.project import LabelsUsed, Project
from forcelab.recognition.attribution import Judge, Network, Voter, judge_of, log_odds
from forcelab.recognition.examples import Examples, Labelled, common_rate, kept_apart
from forcelab.recognition.groups import groups
from forcelab.recognition.label_noise import trimming
from forcelab.recognition.probability_trace import Certainty
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.storage import load
from forcelab.recognition.training import fit_trimmed, preparing
from forcelab.review.differences import Interval, action_over, place_at
from forcelab.review.run_result import Outcome
from forcelab.signals.channels import channel_map
from forcelab.signals.grid import measured

Real = NDArray[np.float64]

#: How many neighbours of an action are looked for.
NEIGHBOURS = 3


@dataclass(frozen=True)
class Neighbour:
    """A training segment and how far it is.

    Parameters
    ----------
    place : Place
        Of another demonstration; ``human`` is its action.
    distance : float
        In standard deviations of training segments, over all numbers together.
    """

    place: Interval
    distance: float


@dataclass(frozen=True, eq=False)
class SegmentFeatures:
    """The training segments of one or several demonstrations in numbers.

    Parameters
    ----------
    places : tuple of Place, length m
        ``human`` is the action.
    values : ndarray, shape (m, d)
        Not yet divided by anything.
    """

    places: tuple[Interval, ...]
    values: Real

    @classmethod
    def joined(cls, parts: Sequence[SegmentFeatures]) -> SegmentFeatures:
        """Those of several demonstrations together; of at least one."""
        places = tuple(place for part in parts for place in part.places)
        return cls(places, np.concatenate([part.values for part in parts]))


def summary(
    examples: Examples, demonstration: Demonstration, scales: int, start: float, end: float
) -> Real | None:
    """The numbers by which ``[start, end)`` seconds of a demonstration are known, shape (d,).

    Parameters
    ----------
    examples : Examples
        The demonstration's features.
    demonstration : Demonstration
        With the levels of its channels.
    scales : int
        How many scales the features have.
    start, end : float
        Seconds.

    Returns
    -------
    ndarray, shape (d,), or None
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


def summarised(examples: Examples, demonstration: Demonstration, scales: int) -> SegmentFeatures:
    """All human segments of a demonstration in numbers; parameters as of :func:`summary`."""
    places, values = [], []
    for segment in examples.segments:
        found = summary(examples, demonstration, scales, segment.start, segment.end)
        if found is not None:
            places.append(Interval(demonstration.id, segment.start, segment.end, segment.action))
            values.append(found)
    width = (2 * scales + 1) * len(examples.channels) + 1
    return SegmentFeatures(tuple(places), np.array(values).reshape(len(values), width))


def nearest(
    wanted: Real,
    training: SegmentFeatures,
    action: str,
    count: int = NEIGHBOURS,
    without: Collection[str] = (),
) -> tuple[Neighbour, ...]:
    """The training segments of one action that are nearest to a stretch.

    Parameters
    ----------
    wanted : ndarray, shape (d,)
        The stretch, as of :func:`summary`.
    training : Summaries
        Of all actions: the standard deviations are theirs.
    action : str
    count : int
        How many at most.
    without : collection of str
        Ids of demonstrations to leave out, such as the one that the stretch is of.

    Returns
    -------
    tuple of Neighbour
        The nearest one first; of equally near ones the one that comes first in `training`.
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
    distances = np.linalg.norm((training.values[chosen] - wanted) / spread, axis=1)
    order = np.argsort(distances, kind="stable")[:count]
    return tuple(Neighbour(training.places[chosen[i]], float(distances[i])) for i in order)


#: Columns that a trace has at most, and the width in pixels of its frame.
COLUMNS, WIDTH = 160, 192


@dataclass(frozen=True, eq=False)
class Trace:
    """A stretch in little.

    Parameters
    ----------
    name : str
        Of the demonstration.
    low, high : ndarray, shape (m, c)
        Least and greatest sample of each column of time and each recorded channel, in the
        channel's unit; NaN where there is none.
    frame : ndarray of uint8, shape (h, w, 3), or None
        The video's frame in the middle, made small; None without a video.
    """

    name: str
    low: Real
    high: Real
    frame: NDArray[np.uint8] | None = None


def trace(demonstration: Demonstration, start: float, end: float, columns: int = COLUMNS) -> Trace:
    """The forces of ``[start, end)`` seconds, without the frame."""
    first, last = np.searchsorted(demonstration.times, (start, end)).tolist()
    first = min(first, len(demonstration.times) - 1)  # the last sample lasts on after its stamp
    values = np.array(demonstration.signals[first : max(last, first + 1)])
    values[~np.isfinite(values)] = np.nan
    firsts = np.unique(np.linspace(0, len(values), columns, endpoint=False).astype(np.int64))
    # fmin and fmax pass over what is missing, and give NaN only where there is nothing else.
    low, high = np.fmin.reduceat(values, firsts), np.fmax.reduceat(values, firsts)
    return Trace(demonstration.name, low, high)


def tracing(path: Path, places: Sequence[Interval]) -> Generator[Progress, None, list[Trace]]:
    """The traces of some places, in their order; a video that cannot be read has no frame.

    Parameters
    ----------
    path : Path
        Of the project.
    places : sequence of Place

    Yields
    ------
    Progress
    """
    found = []
    with Project.open(path) as project:
        for place in places:
            demonstration = project.demonstrations.load(place.demonstration)
            made = trace(demonstration, place.start, place.end)
            if demonstration.video is not None:
                middle = 0.5 * (place.start + place.end)
                frame = yield from _framing(demonstration.video, middle)
                made = Trace(made.name, made.low, made.high, frame)
            found.append(made)
            yield Progress(len(found), len(places), "traces")
    return found


def _framing(
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
    except InputError:  # the stage shows what is the matter with it
        return None
    step = max(1, frame.shape[1] // WIDTH)
    height, width = (size // step * step for size in frame.shape[:2])
    # Means of squares of pixels: every step-th pixel alone would flicker with texture.
    blocks = frame[:height, :width].reshape(height // step, step, width // step, step, 3)
    return np.ascontiguousarray(blocks.mean(axis=(1, 3)).round().astype(np.uint8))


#: How many time steps that were trained on are kept, to replace features by.
SAMPLE = 2048

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
    training: SegmentFeatures
    seconds: dict[str, float]

    @property
    def bytes(self) -> int:
        """About the memory that it takes, with all of a classifier that keeps what it saw."""
        arrays = (self.examples.features, self.sample, self.training.values)
        return sum(array.nbytes for array in arrays) + self.demonstration.signals.nbytes


def track_at(project: Project, used: LabelsUsed) -> Segments:
    """One author's segments as they were after an edit, whatever was edited since."""
    if project.tracks.head(used.demonstration, used.author) == used.edit:
        return project.tracks.get(used.demonstration, used.author).segments
    segments: Segments = ()
    for edit in project.tracks.history(used.demonstration, used.author):
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
        held_out = own or Labelled(project.demonstrations.load(id_))
        final = None
        if own is None and outcome.recogniser:
            final = load(project.runs.recogniser_path(outcome.recogniser))
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
    training = SegmentFeatures.joined(
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
            items.append(Labelled(project.demonstrations.load(used.demonstration), segments))
            tasks.append(project.demonstrations.info(used.demonstration).task)
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


#: Of a permutation: time steps of the place that are looked at, at most, and repetitions.
STEPS, REPEATS = 64, 8
#: Time steps whose gradients are taken at once.
BLOCK = 4096


@dataclass(frozen=True, eq=False)
class Influence:
    """How much each band and channel speaks for one action and against another.

    Parameters
    ----------
    method : "gradient" or "permutation"
    bands, bands_error : ndarray, shape (q, k)
        Log-odds, means over time steps, of each channel and scale; positive speaks for the
        favoured action. Errors are standard errors over repetitions, 0 for the gradient.
    channels, channels_error : ndarray, shape (q,)
        The same of all scales of a channel together.
    log_odds, reference : float
        Mean log-odds at the place, and at the mean of what was trained on (of a permutation: with
        every feature replaced).
    gap : float
        Of the gradient: by how much the bands together miss ``log_odds - reference``.
    steps, repeats : int
        Time steps that were looked at, and how often each band was replaced (gradient: 0).
    """

    method: Literal["gradient", "permutation"]
    bands: Real
    bands_error: Real
    channels: Real
    channels_error: Real
    log_odds: float
    reference: float
    gap: float
    steps: int
    repeats: int


def influence(
    judge: Judge,
    rows: Real,
    favoured: str,
    against: str,
    shape: tuple[int, int],
    *,
    mean: Real,
    sample: Real,
    seed: int = 0,
) -> Generator[Progress, None, Influence]:
    """How much each band speaks for an action; by gradient where that can be had.

    Parameters
    ----------
    judge : Judge
    rows : ndarray, shape (n, f)
        Features of the time steps that are explained.
    favoured, against : str
        Two of the judge's actions.
    shape : (int, int)
        Channels q and scales k; f is q k, or 2 q k with phases.
    mean : ndarray, shape (f,)
        What the gradient compares with.
    sample : ndarray, shape (m, f)
        What permutation replaces by.
    seed : int
        Of the permutation.
    """
    if isinstance(judge, Network):
        return (yield from _by_gradient(judge, rows, favoured, against, shape, mean))
    return (yield from _by_permutation(judge, rows, favoured, against, shape, sample, seed))


def _by_gradient(
    network: Network, rows: Real, favoured: str, against: str, shape: tuple[int, int], mean: Real
) -> Generator[Progress, None, Influence]:
    """The shares of all features, gathered by band."""
    total = np.zeros(rows.shape[1])
    for first in range(0, len(rows), BLOCK):
        block = rows[first : first + BLOCK]
        total += network.shares(block, mean, favoured, against).sum(axis=0)
        yield Progress(min(first + BLOCK, len(rows)), len(rows), "explaining")
    shares = total / len(rows)
    # Log magnitudes come first, then the phases in the same order.
    bands = shares.reshape(-1, *shape).sum(axis=0)
    here = float(log_odds(network, rows, favoured, against).mean())
    there = float(log_odds(network, mean[np.newaxis], favoured, against)[0])
    return Influence(
        method="gradient",
        bands=bands,
        bands_error=np.zeros(shape),
        channels=bands.sum(axis=1),
        channels_error=np.zeros(shape[0]),
        log_odds=here,
        reference=there,
        gap=abs(float(shares.sum()) - (here - there)),
        steps=len(rows),
        repeats=0,
    )


def _by_permutation(
    judge: Judge,
    rows: Real,
    favoured: str,
    against: str,
    shape: tuple[int, int],
    sample: Real,
    seed: int,
) -> Generator[Progress, None, Influence]:
    """What the log-odds lose when a band, or a whole channel, is replaced."""
    random = np.random.default_rng(seed)
    chosen = np.unique(np.linspace(0, len(rows) - 1, STEPS).round().astype(np.int64))
    looked = rows[chosen]
    here = float(log_odds(judge, looked, favoured, against).mean())
    q, k = shape
    places = np.arange(rows.shape[1]).reshape(-1, q, k)
    groups = [places[:, i, j] for i in range(q) for j in range(k)]
    groups += [places[:, i].ravel() for i in range(q)] + [places.ravel()]
    losses, errors = np.zeros(len(groups)), np.zeros(len(groups))
    for number, columns in enumerate(groups):
        drawn = random.integers(len(sample), size=REPEATS * len(looked))
        changed = np.tile(looked, (REPEATS, 1))
        changed[:, columns] = sample[np.ix_(drawn, columns)]
        left = log_odds(judge, changed, favoured, against).reshape(REPEATS, -1).mean(axis=1)
        losses[number] = here - left.mean()
        errors[number] = left.std(ddof=1) / np.sqrt(REPEATS)
        yield Progress(number + 1, len(groups), "explaining")
    return Influence(
        method="permutation",
        bands=losses[: q * k].reshape(shape),
        bands_error=errors[: q * k].reshape(shape),
        channels=losses[q * k : -1],
        channels_error=errors[q * k : -1],
        log_odds=here,
        reference=here - float(losses[-1]),
        gap=0.0,
        steps=len(looked),
        repeats=REPEATS,
    )


@dataclass(frozen=True, slots=True)
class Band:
    """One channel at one scale, and how much it speaks for the favoured action.

    Parameters
    ----------
    channel : str
    hertz : float
        Of the scale.
    weight, error : float
        Log-odds, natural logarithm; the error is a standard error.
    """

    channel: str
    hertz: float
    weight: float
    error: float


@dataclass(frozen=True, eq=False)
class Why:
    """An explanation of one place.

    Parameters
    ----------
    place : Place
        What is explained.
    favoured, against : str
        What bands speak for, and against.
    channels : tuple of str, length q
    hertz : ndarray, shape (k,)
        Of the scales, the highest first.
    influence : Influence
    certainty : Certainty or None
        How probable each action is over the whole demonstration.
    kept : bool
        Whether that is the run's own; otherwise it was computed with the recogniser trained anew.
    how : str
        Which recogniser it was; see :class:`~forcelab.review.explanation.Withheld`.
    same : float
        The share of samples that it labels as the run did.
    neighbours : mapping of str to tuple of Neighbour
        The nearest training segments of `favoured` and of `against`.
    seconds : mapping of str to float
        Run time of ``features`` and ``fit``.
    remarks : tuple of str
        A sentence for each thing that is not as one might think.
    """

    place: Interval
    favoured: str
    against: str
    channels: tuple[str, ...]
    hertz: Real
    influence: Influence
    certainty: Certainty | None
    kept: bool
    how: str
    same: float
    neighbours: Mapping[str, tuple[Neighbour, ...]]
    seconds: Mapping[str, float]
    remarks: tuple[str, ...] = ()

    def strongest(self, count: int = 3) -> tuple[Band, ...]:
        """The bands that weigh most, for or against, the heaviest first."""
        weights, errors = self.influence.bands, self.influence.bands_error
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
        found = self.influence
        return {
            "place": _plain(self.place),
            "favoured": self.favoured,
            "against": self.against,
            "probabilities": self._probabilities(),
            "probabilities_of_run": self.kept,
            "recogniser": {"how": self.how, "same": self.same, "seconds": dict(self.seconds)},
            "method": found.method,
            "log_odds": found.log_odds,
            "reference": found.reference,
            "gap": found.gap,
            "steps": found.steps,
            "repeats": found.repeats,
            "channels": [
                {"channel": name, "weight": float(weight), "error": float(error)}
                for name, weight, error in zip(
                    self.channels, found.channels, found.channels_error, strict=True
                )
            ],
            "hertz": self.hertz.tolist(),
            "bands": found.bands.tolist(),
            "bands_error": found.bands_error.tolist(),
            "nearest": {
                action: [_plain(n.place) | {"distance": n.distance} for n in found_here]
                for action, found_here in self.neighbours.items()
            },
            "remarks": list(self.remarks),
        }

    def _probabilities(self) -> dict[str, float] | None:
        """Mean probability of each action over the place."""
        if self.certainty is None:
            return None
        values = self.certainty.mean(self.place.start, self.place.end)
        return dict(zip(self.certainty.actions, values.tolist(), strict=True))


def explaining(
    withheld: Withheld, outcome: Outcome, place: Interval, hidden: Collection[str] = ()
) -> Generator[Progress, None, Why]:
    """Explain a place.

    Parameters
    ----------
    withheld : Withheld
        Of the place's demonstration.
    outcome : Outcome
        The run.
    place : Place
    hidden : collection of str
        Ids of demonstrations that must not be shown, as somebody codes them blind.

    Yields
    ------
    Progress

    Raises
    ------
    InputError
        If there is no sample at the place.
    """
    examples, judge = withheld.examples, withheld.judge
    steps = slice(*np.searchsorted(examples.times, (place.start, place.end)))
    rows = examples.features[steps][examples.valid[steps]]
    if not len(rows):
        raise InputError(
            f"There is no sample of '{examples.name}' from {place.start:.3f} to {place.end:.3f} s; "
            f"choose a longer stretch."
        )
    favoured, against = _sides(judge, rows, place)
    shape = len(examples.channels), len(withheld.hertz)
    found = yield from influence(
        judge, rows, favoured, against, shape, mean=withheld.mean, sample=withheld.sample
    )
    wanted = summary(examples, withheld.demonstration, len(withheld.hertz), place.start, place.end)
    assert wanted is not None  # there are samples
    neighbours = {}
    for action in (favoured, against):
        near = nearest(wanted, withheld.training, action, without={place.demonstration, *hidden})
        neighbours[action] = tuple(_neighbour_with_prediction(outcome, one) for one in near)
    return Why(
        place=place,
        favoured=favoured,
        against=against,
        channels=examples.channels,
        hertz=withheld.hertz,
        influence=found,
        certainty=withheld.certainty,
        kept=withheld.kept,
        how=withheld.how,
        same=withheld.same,
        neighbours=neighbours,
        seconds=withheld.seconds,
        remarks=_remarks(withheld, place),
    )


def why_at(
    path: str | PathLike[str], outcome: Outcome, id_: str, time: float
) -> Generator[Progress, None, Why]:
    """Explain what a run predicted at a time of a demonstration.

    The recogniser that has not seen the demonstration is trained once more.

    Parameters
    ----------
    path : path-like
        The project's.
    outcome : Outcome
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
    """
    reviewed = outcome.find(id_)
    if reviewed is None:
        raise InputError(
            f"Run {outcome.number} neither tested nor proposed labels for this demonstration; "
            f"choose another run, or evaluate again."
        )
    place = place_at(reviewed, time)
    if place is None:
        raise InputError(
            f"Nothing is labelled or predicted in '{reviewed.name}' at {time:g} s; choose another "
            f"time."
        )
    withheld = yield from withholding(Path(path), outcome, id_)
    return (yield from explaining(withheld, outcome, place))


def _sides(judge: Judge, rows: Real, place: Interval) -> tuple[str, str]:
    """Which action is spoken for, and which one against."""
    known, scores = judge.actions, judge.scores(rows).mean(axis=0)
    order = [known[i] for i in np.argsort(-scores, kind="stable")]
    favoured = place.predicted if place.predicted in known else order[0]
    assert favoured is not None
    if place.human in known and place.human not in (None, favoured):
        return favoured, place.human
    return favoured, next(action for action in order if action != favoured)


def _neighbour_with_prediction(outcome: Outcome, found: Neighbour) -> Neighbour:
    """A neighbour with what was predicted there."""
    place, reviewed = found.place, outcome.find(found.place.demonstration)
    if reviewed is None:
        return found
    predicted = action_over(reviewed.predicted, place.start, place.end)
    return replace(found, place=replace(place, predicted=predicted))


def _remarks(withheld: Withheld, place: Interval) -> tuple[str, ...]:
    """What is not as one might think."""
    remarks = []
    if place.human is not None and place.human not in withheld.judge.actions:
        remarks.append(
            f"'{place.human}' is in no other demonstration, so that it could not be recognised."
        )
    if withheld.same < 1:
        remarks.append(
            f"The recogniser trained anew labels {100 * withheld.same:.1f} % of the samples as "
            f"the run did; the rest was made by another version or other settings."
        )
    return tuple(remarks)


def _plain(place: Interval) -> dict[str, Any]:
    """A place as plain values."""
    return {
        "demonstration": place.demonstration,
        "start": place.start,
        "end": place.end,
        "human": place.human,
        "predicted": place.predicted,
        "confidence": place.confidence,
    }
