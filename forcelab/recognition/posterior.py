"""Posterior marginals: how probable each action is at each step, over all segmentations."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from forcelab.recognition.choreography import Choreography
from forcelab.recognition.decoding import checked, runs_of
from forcelab.recognition.semimarkov import Scores, Use, Weights
from forcelab.recognition.sweep import Sweep

__all__ = ["marginals"]

Real = NDArray[np.float64]

#: Stands for minus infinity where that cannot be subtracted.
SMALLEST = -1e300


def marginals(
    log_probabilities: NDArray[np.floating],
    valid: NDArray[np.bool_],
    step: float,
    choreography: Choreography,
    use: Use = "order",
    weights: Weights | None = None,
) -> Real:
    """How probable each action is at each step, given all steps and the choreography.

    Exact: the forward-backward algorithm over segments. Parameters and errors as of
    :func:`forcelab.recognition.decoding.decode`.

    Returns
    -------
    ndarray of float64, shape (n, K)
        Rows sum to 1, and are 0 where nothing is decoded.
    """
    valid = checked(log_probabilities, valid, choreography)
    result = np.zeros(np.shape(log_probabilities))
    if not valid.any():
        return result
    scores = Scores.of(choreography, step, use, weights).per_place()
    for first, last in runs_of(valid):
        evidence = scores.evidence(log_probabilities[first:last])
        result[first:last] = _marginals(evidence, scores if first == 0 else scores.anywhere())
    return result


def _marginals(evidence: Real, scores: Scores) -> Real:
    """The same of one stretch."""
    n = len(evidence)
    forward = Sweep(scores, Total(), n)
    backward = Sweep(scores.reversed(), Total(), n)
    forward.push(evidence)
    backward.push(evidence[::-1])
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
    changes = np.cumsum(begun - np.exp(ending + ended + both - total), axis=1)
    present = np.exp(present - total)[:, None]
    # Sums of differences are off by roundings.
    steps = np.clip(np.concatenate([present, present + changes], axis=1).T, 0.0, 1.0)
    result = np.empty_like(steps)
    result[:, forward.order] = steps / steps.sum(axis=1, keepdims=True)
    return result


class Total:
    """The sum of all segmentations, as a logarithm: an algebra of :class:`Sweep`."""

    def windows(self, starts: Real, table: Real, out: Real) -> Real:
        """Logarithms of sums of exponentials."""
        if starts.strides[1] != starts.strides[2]:
            return self._apart(starts, table)
        # The windows overlap: each number is raised once, relative to the largest of them all.
        line = np.concatenate([starts[:, 0], starts[:, 1:, -1]], axis=1)
        unit = np.maximum(line.max(axis=1, keepdims=True), SMALLEST)
        line = np.exp(line - unit)
        top = np.maximum(table.max(axis=1, keepdims=True), SMALLEST)
        near, far = line.strides
        windows = as_strided(line, out.shape, (near, far, far), writeable=False)
        sums = np.einsum("kmw,kw->km", windows, np.exp(table - top))
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(sums) + unit + top)

    def _apart(self, starts: Real, table: Real) -> Real:
        """The same of windows that have few numbers in common."""
        unit = np.maximum(starts.max(axis=(1, 2)), SMALLEST)[:, None]
        top = np.maximum(table.max(axis=1, keepdims=True), SMALLEST)
        raised = np.exp(starts - unit[:, :, None])
        sums = np.einsum("kmw,kw->km", raised, np.exp(table - top))
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(sums) + unit + top)

    def join(self, one: Real, other: Real, out: Real) -> Real:
        """The logarithm of the sum."""
        return np.logaddexp(one, other, out=out)

    def running(self, scores: Real) -> Real:
        """Running sums."""
        return np.logaddexp.accumulate(scores, axis=1)

    def paths(self, follow: Real, sums: Real) -> Real:
        """Shape (m, K, K)."""
        return np.asarray(sums[:, :, None] + follow - sums[:, None, :])

    def follow(self, ends: Real, paths: Real) -> Real:
        """Logarithms of sums of exponentials."""
        every = ends[:, :, None] + paths
        unit = np.maximum(every.max(axis=1, keepdims=True), SMALLEST)
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(np.exp(every - unit).sum(axis=1)) + unit[:, 0])
