"""Posterior marginals: how probable each action is at each step, over all segmentations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.choreography import Choreography
from forcelab.recognition.decoding import scored
from forcelab.recognition.joining import Total
from forcelab.recognition.semimarkov import Scores, Use
from forcelab.recognition.sweep import Sweep

__all__ = ["marginals"]

Real = NDArray[np.float64]


def marginals(
    log_probabilities: NDArray[np.floating],
    valid: NDArray[np.bool_],
    step: float,
    choreography: Choreography,
    use: Use = "order",
    changes: NDArray[np.floating] | None = None,
) -> Real:
    """How probable each action is at each step, given all steps and the choreography.

    Exact: the forward-backward algorithm over segments. Parameters and errors as of
    :func:`forcelab.recognition.decoding.decode`.

    Returns
    -------
    ndarray of float64, shape (n, K)
        Rows sum to 1, and are 0 where nothing is decoded.
    """
    result = np.zeros(np.shape(log_probabilities))
    for part, scores, evidence, after in scored(
        log_probabilities, valid, step, choreography, use, changes
    ):
        result[part] = _marginals(evidence, scores.per_place(), after)
    return result


def _marginals(evidence: Real, scores: Scores, changes: Real | None) -> Real:
    """The same of one stretch, given what a change scores after each step."""
    n = len(evidence)
    forward = Sweep(scores, Total(), n)
    backward = Sweep(scores.reversed(), Total(), n)
    forward.push(evidence, changes)
    # What comes after a step comes, backwards, after the next one.
    backward.push(evidence[::-1], None if changes is None else np.roll(changes[::-1], -1))
    # Each place with what lies before it, and after it; of an action that ends or starts there.
    inner = slice(1, n)
    rest = backward.sums[:, ::-1]
    ending, starting = forward.ends[:, inner], forward.starts[:, forward.margin :][:, inner]
    ended = backward.starts[:, backward.margin :][:, ::-1][:, inner]
    started = backward.ends[:, ::-1][:, inner]
    both = (forward.sums + rest)[:, inner]
    first = forward.first(1, n + 1)
    opening = np.concatenate([first[:, :-1] + ended + both, first[:, -1:] + rest[:, :1]], axis=1)
    present = np.logaddexp.reduce(opening, axis=1)
    total = np.logaddexp.reduce(present)
    begun = np.exp(starting + started + both - total)
    since = np.cumsum(begun - np.exp(ending + ended + both - total), axis=1)
    present = np.exp(present - total)[:, None]
    # Sums of differences are off by roundings.
    steps = np.clip(np.concatenate([present, present + since], axis=1).T, 0.0, 1.0)
    result = np.empty_like(steps)
    result[:, forward.order] = steps / steps.sum(axis=1, keepdims=True)
    return result
