"""What a peer is: something others made that tells actions apart, and what it is given of a task.

Each is given the same recognition channels on the same grid, decides at the same time steps, and
learns from the same human labels; unlabelled time is neither learnt nor scored.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.measure.peers import Library

__all__ = ["Fitted", "Peer", "Task", "around"]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]
#: Probabilities, shape (m, K), from the rows of a whole demonstration, shape (m, f).
Fitted = Callable[[Real], Real]


@dataclass(frozen=True)
class Task:
    """What a peer learns from.

    Parameters
    ----------
    rows : sequence of ndarray, shape (m, f)
        What it knows of the time steps of each training demonstration.
    codes : sequence of ndarray of int64, shape (m,)
        The human's actions, 0 to K - 1; -1 where unlabelled.
    actions : int
        K.
    channels : int
    """

    rows: Sequence[Real]
    codes: Sequence[Whole]
    actions: int
    channels: int

    def labelled(self) -> tuple[Real, Whole]:
        """Rows of all labelled time steps of all demonstrations, and their actions."""
        known = [codes >= 0 for codes in self.codes]
        rows = [rows[some] for rows, some in zip(self.rows, known, strict=True)]
        return np.concatenate(rows), np.concatenate(
            [codes[some] for codes, some in zip(self.codes, known, strict=True)]
        )


@dataclass(frozen=True)
class Peer(Library):
    """A method of others.

    Parameters
    ----------
    name, module : str
        As of :class:`~forcelab.measure.peers.Library`.
    look : callable
        Takes recognition channels, shape (q, n), samples a second, and the samples in the middle
        of each time step, shape (m,); gives what it knows of them, shape (m, f).
    fit : callable
        Takes a task and a seed; gives what recognises.
    """

    look: Callable[[Real, float, Whole], Real]
    fit: Callable[[Task, int], Fitted]


def around(channels: Real, rate: float, places: Whole, count: int, period: float) -> Real:
    """Means of each channel in cells around some samples, shape (m, q * count).

    Parameters
    ----------
    channels : ndarray, shape (q, n)
    rate : float
        Samples a second.
    places : ndarray of int64, shape (m,)
    count : int
        Cells around each, half of them before it; a channel's stand together.
    period : float
        Seconds that a cell lasts; below a sample it is read off between two of them.

    Notes
    -----
    Beyond its ends a channel has its end values.
    """
    edges = places[:, None] + rate * period * (np.arange(count + 1) - count / 2)[None]
    n = channels.shape[1]
    pad = int(np.ceil(np.abs(edges - np.clip(edges, 0, n)).max())) + 1
    out = np.empty((len(places), len(channels), count))
    for i, channel in enumerate(channels):
        held = np.pad(channel, pad, mode="edge")
        total = np.concatenate([[0.0], np.cumsum(held)])
        sums = np.interp(edges + pad + 0.5, np.arange(len(total)), total)
        out[:, i] = np.diff(sums, axis=1) / (rate * period)
    return out.reshape(len(places), -1)
