"""Why a recogniser saw an action somewhere: what spoke for it, and what it resembles.

What is explained are the log-odds of two actions, averaged over the time steps of a place: of
the predicted action against the human's. Where the two do not differ, or one of them is not
known, the most probable other action takes the place of the missing one.
"""

from __future__ import annotations

from collections.abc import Collection, Generator, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.recognition.certainty import Certainty
from forcelab.recognition.influence import Judge
from forcelab.review.nearest import Neighbour, nearest, summary
from forcelab.review.outcome import Outcome
from forcelab.review.places import Place, action_over, place_at
from forcelab.review.why_influence import Influence, influence
from forcelab.review.why_training import Withheld, withholding

__all__ = ["Band", "Why", "explaining", "why_at"]

Real = NDArray[np.float64]


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
        Which recogniser it was; see :class:`~forcelab.review.why_training.Withheld`.
    same : float
        The share of samples that it labels as the run did.
    neighbours : mapping of str to tuple of Neighbour
        The nearest training segments of `favoured` and of `against`.
    seconds : mapping of str to float
        Run time of ``features`` and ``fit``.
    remarks : tuple of str
        A sentence for each thing that is not as one might think.
    """

    place: Place
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
    withheld: Withheld, outcome: Outcome, place: Place, hidden: Collection[str] = ()
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
        neighbours[action] = tuple(_told(outcome, one) for one in near)
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


def _sides(judge: Judge, rows: Real, place: Place) -> tuple[str, str]:
    """Which action is spoken for, and which one against."""
    known, scores = judge.actions, judge.scores(rows).mean(axis=0)
    order = [known[i] for i in np.argsort(-scores, kind="stable")]
    favoured = place.predicted if place.predicted in known else order[0]
    assert favoured is not None
    if place.human in known and place.human not in (None, favoured):
        return favoured, place.human
    return favoured, next(action for action in order if action != favoured)


def _told(outcome: Outcome, found: Neighbour) -> Neighbour:
    """A neighbour with what was predicted there."""
    place, reviewed = found.place, outcome.find(found.place.demonstration)
    if reviewed is None:
        return found
    predicted = action_over(reviewed.predicted, place.start, place.end)
    return replace(found, place=replace(place, predicted=predicted))


def _remarks(withheld: Withheld, place: Place) -> tuple[str, ...]:
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


def _plain(place: Place) -> dict[str, Any]:
    """A place as plain values."""
    return {
        "demonstration": place.demonstration,
        "start": place.start,
        "end": place.end,
        "human": place.human,
        "predicted": place.predicted,
        "confidence": place.confidence,
    }
