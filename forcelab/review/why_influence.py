"""How much each channel and scale speaks for one action and against another.

Two methods. **Gradient**, for the MLP: how the log-odds grow along the straight line from the
mean of all training time steps to each time step of the place, shared out among the features; see
:mod:`forcelab.recognition.influence`. The shares add up to the change of the log-odds, and what
is missing from that is told as the gap. **Permutation**, for every other classifier: the
magnitude and the phase of one channel and scale are replaced by those of random training time
steps; what the log-odds lose by it is what they owed to them. Its error is the standard error
over repetitions; such losses need not add up, and bands that know the same hide each other.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.recognition.influence import Judge, Network, log_odds

__all__ = ["Influence", "influence"]

#: Of a permutation: time steps of the place that are looked at, at most, and repetitions.
STEPS, REPEATS = 64, 8
#: Time steps whose gradients are taken at once.
BLOCK = 4096

Real = NDArray[np.float64]


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
