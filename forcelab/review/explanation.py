"""Explanations: why a recogniser predicted an action, and which training segments are alike.

The log-odds of the predicted action against the human's, averaged over the time steps of an
interval, are shared out among channels and scales; where the two do not differ, or one of them is
unknown, the most probable other action takes the place of the missing one. For the MLP by
integrated gradients from the mean of all training time steps
(:mod:`forcelab.recognition.attribution`): they add up to the change of the log-odds, and the gap
says what is missing from that. For every other classifier by permutation: magnitude and phase of
one channel and scale are replaced by those of random training time steps, and the loss of log-odds
is what they contributed. Its error is the standard error over repetitions; such losses need not add
up, and bands that carry the same information hide each other.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Mapping
from dataclasses import asdict, dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np

from forcelab.arrays import Real, Whole
from forcelab.errors import InputError
from forcelab.jobs import Progress, job
from forcelab.labels import Interval
from forcelab.recognition.attribution import MlpScorer, Scorer, log_odds
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.recognition.settings import Settings
from forcelab.review.differences import action_over, interval_at
from forcelab.review.held_out import HeldOutModel, train_held_out
from forcelab.review.run_result import RunResult
from forcelab.review.similar_segments import Neighbour, nearest_segments, summarise

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
    bands: Whole,
    *,
    mean: Real,
    sample: Real,
    seed: int = 0,
) -> Generator[Progress, None, Attribution]:
    """Contribution of each band to the log-odds of two actions, over time steps (n, f).

    By gradient where possible, else by permutation. `shape` are channels q and scales k, and
    `bands` (f,) say which of them each feature is of, as
    :meth:`~forcelab.recognition.settings.Settings.feature_bands` does; q times k is none. The
    gradient compares with `mean` (f,), permutation replaces by rows of `sample` (m, f).
    """

    def odds(features: Real) -> Real:
        return log_odds(scorer, features, favoured, against)

    if not isinstance(scorer, MlpScorer):
        return (yield from _permute_bands(odds, rows, shape, bands, sample, seed))
    total = np.zeros(rows.shape[1])
    for first in range(0, len(rows), BLOCK):
        block = rows[first : first + BLOCK]
        total += scorer.integrated_gradients(block, mean, favoured, against).sum(axis=0)
        yield Progress(min(first + BLOCK, len(rows)), len(rows), "explaining")
    shares = total / len(rows)
    sums = np.bincount(bands, shares, shape[0] * shape[1] + 1)[:-1]
    weights = np.asarray(sums, dtype=np.float64).reshape(shape)
    here, reference = float(odds(rows).mean()), float(odds(mean[np.newaxis])[0])
    return Attribution(
        method="gradient",
        bands=weights,
        bands_error=np.zeros(shape),
        channels=weights.sum(axis=1),
        channels_error=np.zeros(shape[0]),
        log_odds=here,
        reference=reference,
        gap=abs(float(shares.sum()) - (here - reference)),
        steps=len(rows),
        repeats=0,
    )


def _permute_bands(
    odds: Callable[[Real], Real],
    rows: Real,
    shape: tuple[int, int],
    bands: Whole,
    sample: Real,
    seed: int,
) -> Generator[Progress, None, Attribution]:
    """The loss of log-odds when a band, or a whole channel, is replaced."""
    random = np.random.default_rng(seed)
    chosen = rows[np.unique(np.linspace(0, len(rows) - 1, STEPS).round().astype(np.int64))]
    here = float(odds(chosen).mean())
    q, k = shape
    groups = [np.flatnonzero(bands == band) for band in range(q * k)]
    groups += [np.flatnonzero(bands // k == channel) for channel in range(q)]
    groups.append(np.arange(rows.shape[1]))
    losses, errors = np.zeros(len(groups)), np.zeros(len(groups))
    for number, columns in enumerate(groups):
        drawn = random.integers(len(sample), size=REPEATS * len(chosen))
        changed = np.tile(chosen, (REPEATS, 1))
        changed[:, columns] = sample[np.ix_(drawn, columns)]
        left = odds(changed).reshape(REPEATS, -1).mean(axis=1)
        losses[number] = here - left.mean()
        errors[number] = left.std(ddof=1) / np.sqrt(REPEATS)
        yield Progress(number + 1, len(groups), "explaining")
    return Attribution(
        method="permutation",
        bands=losses[: q * k].reshape(shape),
        bands_error=errors[: q * k].reshape(shape),
        channels=losses[q * k : -1],
        channels_error=errors[q * k : -1],
        log_odds=here,
        reference=here - float(losses[-1]),
        gap=0.0,
        steps=len(chosen),
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
    how: str  # which recogniser it was; see :class:`~forcelab.review.held_out.HeldOutModel`
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
            "place": asdict(self.place),
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
                action: [asdict(n.place) | {"distance": n.distance} for n in found_here]
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
    bands = np.pad(bands, (0, rows.shape[1] - len(bands)), constant_values=shape[0] * shape[1])
    attribution = yield from attribute_bands(
        scorer, rows, favoured, against, shape, bands, mean=held_out.mean, sample=held_out.sample
    )
    target = summarise(
        examples, held_out.demonstration, len(held_out.hertz), place.start, place.end
    )
    assert target is not None  # there are samples
    without = {place.demonstration, *hidden}
    neighbours = {
        action: tuple(
            _neighbour_with_prediction(run, neighbour)
            for neighbour in nearest_segments(target, held_out.training, action, without=without)
        )
        for action in (favoured, against)
    }
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
        remarks=_remarks(held_out, place, run.settings),
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


def _remarks(held_out: HeldOutModel, place: Interval, settings: Settings) -> tuple[str, ...]:
    """Remarks on an unknown action, another prediction than the run's, and features of no band."""
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
    if settings.own_features:
        paths = ", ".join(settings.own_features)
        remarks.append(
            f"The features of {paths} decided as well, but are of no channel and frequency."
        )
    return tuple(remarks)
