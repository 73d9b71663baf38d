"""Who the simulated coders are: how late and how exactly they label, and what they mix up."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from forcelab.errors import InputError
from forcelab.labels import is_model

__all__ = ["CODERS", "Coder", "Confusion"]


def _check_probability(what: str, probability: float) -> None:
    """Refuse what is no probability."""
    if not 0 <= probability <= 1:
        raise InputError(f"{what} needs a probability from 0 to 1, not {probability}.")


@dataclass(frozen=True, slots=True)
class Confusion:
    """A habit of taking one action for another.

    Parameters
    ----------
    action, taken_for : str
        What it is, and what the coder calls it.
    probability : float
        Of doing so, where the rest fits.
    after, before : str, optional
        Only where this action comes right before, or right after it.
    shorter : float
        Only segments shorter than this, s.

    Raises
    ------
    InputError
        If the probability is none.
    """

    action: str
    taken_for: str
    probability: float
    after: str | None = None
    before: str | None = None
    shorter: float = float("inf")

    def __post_init__(self) -> None:
        _check_probability(f"Taking '{self.action}' for '{self.taken_for}'", self.probability)


@dataclass(frozen=True, slots=True)
class Coder:
    """A simulated coder; the defaults are a careful one who is never wrong.

    Parameters
    ----------
    name : str
        The author of the coder's tracks.
    lag : float
        By which every edge is seen too late, s.
    starts : dict of str to float
        By how much more an edge is seen late (early if negative) where this action starts, s.
    sharp, ramp : float
        Standard deviation of an edge where the forces jump, and where they change slowly, s.
    gap, margin : float
        Mean length of what stays unlabelled between two actions, and at each end of the
        recording, s.
    short : float
        Segments shorter than this, in s, may be overlooked or taken for a neighbour.
    overlooked, neighbour : float
        Probability that a short segment stays unlabelled, and that it is taken for the action
        before or after it.
    confusions : tuple of Confusion
        The coder's habits.

    Raises
    ------
    InputError
        If the name is empty or that of a model, or a number is out of its range.
    """

    name: str
    lag: float = 0.0
    starts: Mapping[str, float] = field(default_factory=dict)
    sharp: float = 0.0
    ramp: float = 0.0
    gap: float = 0.0
    margin: float = 0.0
    short: float = 0.0
    overlooked: float = 0.0
    neighbour: float = 0.0
    confusions: tuple[Confusion, ...] = ()

    def __post_init__(self) -> None:
        if not self.name.strip() or is_model(self.name):
            raise InputError(f"'{self.name}' is no coder; give the simulated coder another name.")
        if not np.isfinite([self.lag, *self.starts.values()]).all():
            raise InputError(f"The lag of '{self.name}', and at each start, must be finite.")
        for name in ("sharp", "ramp", "gap", "margin", "short"):
            value = getattr(self, name)
            if not 0 <= value < float("inf"):
                raise InputError(
                    f"{name} of '{self.name}' must be finite and not negative, not {value}."
                )
        _check_probability(f"Overlooking by '{self.name}'", self.overlooked)
        _check_probability(f"A neighbour taken by '{self.name}'", self.neighbour)


#: The coders of the sample project. Ines is exact, but lets large actions swallow small ones; Tomas
#: labels later and less exactly, and overlooks more.
CODERS = (
    Coder(
        "Ines",
        lag=0.015,
        starts={"release": -0.02, "slipped": -0.02},
        sharp=0.015,
        ramp=0.06,
        gap=0.04,
        margin=0.07,
        short=0.4,
        overlooked=0.04,
        neighbour=0.05,
        confusions=(
            Confusion("search", "insert", 0.6, before="insert", shorter=0.5),
            Confusion("hold", "insert", 0.25, after="insert", before="release", shorter=0.8),
            Confusion("hold", "twist", 0.2, after="twist", before="twist", shorter=0.6),
            Confusion("slip", "slip transition", 0.08),
        ),
    ),
    Coder(
        "Tomas",
        lag=0.035,
        starts={"grab": 0.02, "hold": 0.03},
        sharp=0.025,
        ramp=0.09,
        gap=0.05,
        margin=0.08,
        short=0.4,
        overlooked=0.06,
        neighbour=0.06,
        confusions=(
            Confusion("search", "insert", 0.2, before="insert", shorter=0.3),
            Confusion("grab", "pull", 0.15, before="pull"),
            Confusion("twist", "hold", 0.1, shorter=0.6),
            Confusion("slip transition", "slip", 0.1),
        ),
    ),
)
