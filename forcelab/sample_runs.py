"""Runs of samples with one code, and when they end.

A stretch ends where the next sample starts; before a gap in the stamps (more than
:data:`~forcelab.demonstration.GAP_PERIODS` median periods) and at the end of the recording it ends
one median period after its last stamp. Segments, filters and metrics all follow this rule.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS


def sample_ends(times: NDArray[np.float64]) -> NDArray[np.float64]:
    """When each sample ends, shape (n,): at the next stamp.

    Before a gap and at the end of the recording it is one median period after its own stamp: a
    sample that ends before the next one starts has a gap behind it.
    """
    if len(times) == 0:
        return np.empty(0)
    steps = np.diff(times)
    period = float(np.median(steps)) if len(steps) else 1.0
    ends = np.append(times[1:], times[-1] + period)
    gap = np.flatnonzero(steps > GAP_PERIODS * period)
    ends[gap] = times[gap] + period
    return ends


def marked_runs(marked: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The first sample of each run of marked ones, and the one behind its last; shape (m, 2)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]])))
    return edges.reshape(-1, 2)


@dataclass(frozen=True, eq=False, slots=True)
class Runs:
    """Labelled stretches in order of time; m of them."""

    codes: NDArray[np.int64]  # (m,), never negative
    #: (m,), stretch ``i`` holds the samples ``firsts[i]`` up to, not including, ``lasts[i]``.
    firsts: NDArray[np.int64]
    lasts: NDArray[np.int64]
    #: (m,), when it starts and ends, s.
    starts: NDArray[np.float64]
    ends: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.codes)

    @property
    def samples(self) -> NDArray[np.int64]:
        """Length of each stretch in samples, shape (m,)."""
        return self.lasts - self.firsts

    @property
    def seconds(self) -> NDArray[np.float64]:
        """Length of each stretch in seconds, shape (m,)."""
        return self.ends - self.starts

    def holding(self, samples: NDArray[np.int64]) -> NDArray[np.int64]:
        """Which stretch holds each of `samples`, all of which must be labelled."""
        return np.searchsorted(self.firsts, samples, side="right") - 1


def stretches(
    codes: NDArray[np.int64], times: NDArray[np.float64], ends: NDArray[np.float64]
) -> Runs:
    """Gather neighbours of equal code; gaps in the stamps part them, the unlabelled is left out.

    `codes` (n,): every negative one means unlabelled; `times` (n,), which increase; `ends` (n,):
    their :func:`sample_ends`.
    """
    n = len(codes)
    if n == 0:
        return Runs(codes, codes, codes, times, times)
    cuts = np.flatnonzero((np.diff(codes) != 0) | (ends[:-1] < times[1:])) + 1
    firsts = np.concatenate([[0], cuts])
    lasts = np.concatenate([cuts, [n]])
    labelled = codes[firsts] >= 0
    firsts, lasts = firsts[labelled], lasts[labelled]
    return Runs(codes[firsts], firsts, lasts, times[firsts], ends[lasts - 1])
