"""Decoding: the most probable course of actions, given probabilities and the choreography.

An exact semi-Markov Viterbi: of all segmentations of a stretch the one that scores best (the model
is stated in :mod:`forcelab.recognition.semimarkov`). The cost is one addition and one maximum for
each step, action and duration that is considered.

Sources
-------
Yu, "Hidden semi-Markov models", Artificial Intelligence 174, 2010. Guédon, "Estimating hidden
semi-Markov chains from discrete sequences", J. Comput. Graph. Stat. 12, 2003: segments cut off by
the ends of what was recorded.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.labels import UNLABELLED
from forcelab.recognition.choreography import Choreography
from forcelab.recognition.joining import Best
from forcelab.recognition.semimarkov import Scores, Use
from forcelab.recognition.sweep import Sweep

__all__ = ["best_code", "best_codes", "checked", "decode", "runs_of", "scored"]

Real = NDArray[np.float64]
Codes = NDArray[np.int64]


def decode(
    log_probabilities: NDArray[np.floating],
    valid: NDArray[np.bool_],
    step: float,
    choreography: Choreography,
    use: Use = "order",
    changes: NDArray[np.floating] | None = None,
) -> Codes:
    """The best course of actions.

    Parameters
    ----------
    log_probabilities : ndarray, shape (n, K)
        Of each action at each step, by the classifier; minus infinity is allowed, and a constant
        added to a step changes nothing.
    valid : ndarray of bool, shape (n,)
        False in gaps. What lies between two gaps is decoded by itself.
    step : float
        Seconds between two steps; 0.02 is fine enough.
    choreography : Choreography
        Of the same K actions.
    use : "none", "durations" or "order"
        How much of the choreography may be used: nothing but a cost of changes, durations, or
        also which action follows which and how demonstrations start.
    changes : ndarray, shape (n,), optional
        How much likelier than usual a change of actions is near each step, in nats; finite. It
        counts for nothing with "none".

    Returns
    -------
    ndarray of int64, shape (n,)
        Codes; unlabelled in gaps and where a step holds no number. Of equally good courses it is
        always the same one.

    Raises
    ------
    InputError
        If the numbers of steps or actions disagree, the step is not above 0 or there is no such
        use.
    """
    codes = np.full(len(log_probabilities), UNLABELLED, dtype=np.int64)
    for part, scores, evidence, after in scored(
        log_probabilities, valid, step, choreography, use, changes
    ):
        sweep = Sweep(scores, Best(), len(evidence))
        sweep.push(evidence, after)
        codes[part] = best_codes(sweep, len(evidence))
    return codes


def scored(
    log_probabilities: NDArray[np.floating],
    valid: NDArray[np.bool_],
    step: float,
    choreography: Choreography,
    use: Use,
    changes: NDArray[np.floating] | None,
) -> Iterator[tuple[slice, Scores, Real, Real | None]]:
    """Each stretch without a gap: where it is, the model, and what it takes of steps and changes.

    Parameters and errors as of :func:`decode`.
    """
    valid = checked(log_probabilities, valid, choreography)
    if not valid.any():
        return
    scores = Scores.of(choreography, step, use)
    for first, last in runs_of(valid):
        yield (
            slice(first, last),
            scores if first == 0 else scores.anywhere(),
            scores.evidence(log_probabilities[first:last]),
            None if changes is None else scores.changing(changes[first:last]),
        )


def checked(
    log_probabilities: NDArray[np.floating], valid: NDArray[np.bool_], choreography: Choreography
) -> NDArray[np.bool_]:
    """Where there is something to decode, shape (n,); steps that hold no number are gaps.

    Raises
    ------
    InputError
        If the numbers of steps or actions disagree.
    """
    K = len(choreography.actions)
    shape = np.shape(log_probabilities)
    if len(shape) != 2 or shape[1] != K:
        raise InputError(
            f"The decoder knows {K} actions but was given probabilities of shape {shape}; train "
            "the recogniser again."
        )
    if np.shape(valid) != shape[:1]:
        raise InputError(
            f"{shape[0]} steps have probabilities but {len(valid)} are marked valid or not; give "
            "one mark for each step."
        )
    if K == 0:
        return np.zeros(shape[0], dtype=np.bool_)
    missing = np.isnan(log_probabilities)
    return np.asarray(valid & ~missing.any(axis=1) if missing.any() else valid, dtype=np.bool_)


def runs_of(valid: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last (excluded) step of each stretch without a gap."""
    if valid.all():
        return [(0, len(valid))] if len(valid) else []
    edges = np.flatnonzero(np.diff(valid.astype(np.int8), prepend=0, append=0))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]


def best_codes(sweep: Sweep, last: int) -> Codes:
    """Codes of the `last` most recent steps of a sweep for the best, as if it ended now."""
    codes = np.empty(last, dtype=np.int64)
    begin, end = sweep.now - last, sweep.now
    row, start = _final(sweep)
    while True:
        codes[max(start - begin, 0) : end - begin] = sweep.order[row]
        if start <= begin:
            return codes
        end = start
        row, start = _before(sweep, row, start)


def best_code(sweep: Sweep, ago: int) -> int:
    """The code of the step that came so many steps ago, 0 being the last, as if it ended now."""
    step = sweep.now - 1 - ago
    row, start = _final(sweep)
    while start > step:
        row, start = _before(sweep, row, start)
    return int(sweep.order[row])


def _final(sweep: Sweep) -> tuple[int, int]:
    """Row and start of the segment that goes on at the end of what was seen."""
    now, place = sweep.now, sweep.now - sweep.base
    sums = sweep.sums[:, place]
    whole = sweep.whole + sums
    row = int(whole.argmax())
    found, start = float(whole[row]), 0
    for group in sweep.groups:
        begin = sweep.margin + place - group.reach
        near = sweep.starts[group.rows, begin : sweep.margin + place] + group.open
        near += sums[group.rows, None]
        best = int(near.argmax())
        if near.flat[best] > found:
            found = float(near.flat[best])
            row, start = divmod(best, group.reach)
            row, start = row + group.rows.start, start + now - group.reach
        last = place - group.reach - 1
        if last > 0:
            slope = sweep.slope[group.rows] * now
            far = sweep.far(group.rows, last) + group.open_end[:, 0] + slope + sums[group.rows]
            best = int(far.argmax())
            if far[best] > found:
                found, row = float(far[best]), best + group.rows.start
                start = _far_start(sweep, row, last)
    return row, start


def _before(sweep: Sweep, row: int, start: int) -> tuple[int, int]:
    """Row and start of the segment before the one in `row` that starts at `start`."""
    # What comes later changes nothing about it, and a stream asks again at every step.
    known = sweep.before.get((row, start))
    if known is None:
        known = sweep.before[row, start] = _found_before(sweep, row, start)
    return known


def _found_before(sweep: Sweep, row: int, start: int) -> tuple[int, int]:
    """The same, looked for."""
    place = start - sweep.base
    scores = sweep.scores
    ends = sweep.ends[:, place] + sweep.sums[:, place]
    row = int((ends + scores.follow[:, row]).argmax())
    group = next(group for group in sweep.groups if row < group.rows.stop)
    table = group.table[row - group.rows.start]
    begin = sweep.margin + place - group.reach
    near = sweep.starts[row, begin : begin + len(table)] + table
    best = int(near.argmax())
    found, began = float(near[best]), start - group.reach + best
    last = place - group.reach - 1
    if last > 0:
        end = float(group.end[row - group.rows.start, 0] + sweep.slope[row] * start)
        if sweep.far(row, last) + end > found:
            found, began = float(sweep.far(row, last)) + end, _far_start(sweep, row, last)
    first = sweep.first(start, start + 1)[row, 0]
    return row, 0 if first >= found else began


def _far_start(sweep: Sweep, row: int, last: int) -> int:
    """The best start at place `last` or before; what is forgotten counts as its last step."""
    level = sweep.level(row, 0, last + 1)
    best = int(level.argmax())
    return sweep.base + (best if level[best] >= sweep.far(row, last) else 0)
