"""A stream on an even grid, as soon as its samples cannot change any more.

Samples are taken as evenly spaced: what is missing between two of them is counted from their stamps
and put in, so that a jitter of stamps moves no sample. Lost samples, NaN, glitches and what cannot
be a reading are bridged by straight lines once the next sample is there. Steps of more than
:data:`~forcelab.demonstration.GAP_PERIODS` missing samples are not valid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS
from forcelab.signals.grid import measured
from forcelab.signals.streaming import CausalGlitches

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Steps:
    """Consecutive steps of the grid."""

    times: Real  # (n,); seconds
    signals: Real  # (n, c); finite
    valid: Flags  # (n,)

    def __len__(self) -> int:
        return len(self.times)

    @classmethod
    def none(cls, columns: int) -> Steps:
        """No step at all."""
        return cls(np.empty(0), np.empty((0, columns)), np.empty(0, dtype=bool))

    def __add__(self, other: Steps) -> Steps:
        return Steps(
            np.concatenate([self.times, other.times]),
            np.concatenate([self.signals, other.signals]),
            np.concatenate([self.valid, other.valid]),
        )

    def __getitem__(self, which: slice) -> Steps:
        return Steps(self.times[which], self.signals[which], self.valid[which])


#: Missing samples that are waited for. Of a longer run the last value holds, so that the stream
#: goes on when one of two devices is gone.
PATIENCE = 1000


class CausalGrid:
    """Samples in, steps of a grid of `rate` Hz out.

    A gap is at most `longest` steps long, however long it was: what no wavelet spans.
    """

    def __init__(self, columns: int, rate: float, longest: int) -> None:
        self._columns = columns
        self._period = 1.0 / rate
        self._longest = max(longest, PATIENCE + 1)
        self._glitches = CausalGlitches(columns)
        self._doubtful = Steps.none(columns)  # until it is known whether they are a glitch
        self._tail = Steps.none(columns)  # until what is missing is known
        self._before: Real | None = None  # the last settled values
        self._last_time = -math.inf
        self._absent = np.zeros(columns, dtype=bool)  # missing for longer than the patience

    def push(self, times: Real, signals: Real) -> Steps:
        """Take samples, shape (n,) and (n, columns); give the steps that are settled by now.

        Samples whose stamp is not finite or not later than the one before are left out.
        """
        return self._settled(self._evened(self._later(times, signals)), ended=False)

    def finish(self) -> Steps:
        """End the stream: what is missing is held; the steps that were still waiting."""
        return self._settled(Steps.none(self._columns), ended=True)

    def _later(self, times: Real, signals: Real) -> Steps:
        """The samples whose stamps go on increasing."""
        times = np.asarray(times, dtype=np.float64)
        steps = times[1:] - times[:-1]
        # A NaN among them is less than nothing.
        ordered = len(times) == 1 or (len(times) > 1 and steps.min() > 0)
        if ordered and times[0] > self._last_time and times[-1] < np.inf:
            values = np.asarray(signals, dtype=np.float64)
            return Steps(times, values, np.ones(len(times), dtype=bool))
        usable = np.where(np.isfinite(times), times, -np.inf)
        highest = np.maximum.accumulate(np.concatenate([[self._last_time], usable]))
        fine = usable > highest[:-1]
        return Steps(
            times[fine],
            np.asarray(signals, dtype=np.float64)[fine],
            np.ones(int(fine.sum()), dtype=bool),
        )

    def _evened(self, samples: Steps) -> Steps:
        """The samples with rows of NaN where some are missing."""
        if not len(samples):
            return samples
        period = self._period
        first = samples.times[0] - period if math.isinf(self._last_time) else self._last_time
        # Not np.diff with its prepend, which takes longer than all the rest of this.
        steps = samples.times - np.concatenate([[first], samples.times[:-1]])
        self._last_time = float(samples.times[-1])
        if np.rint(steps.max() / period) <= 1:  # nothing is missing, as nearly always
            return samples
        counts = np.maximum(1, np.rint(np.minimum(steps / period, 1e15))).astype(np.int64)
        counts = np.minimum(counts, self._longest + 1)
        ends = np.cumsum(counts) - 1
        times, valid = np.empty(ends[-1] + 1), np.ones(ends[-1] + 1, dtype=bool)
        signals = np.full((len(times), self._columns), np.nan)
        times[ends], signals[ends] = samples.times, samples.signals
        for i in np.flatnonzero(counts > 1):
            place = slice(ends[i] - counts[i] + 1, ends[i])
            distance = min(steps[i] / counts[i], period)
            times[place] = samples.times[i] - distance * np.arange(counts[i] - 1, 0, -1)
            valid[place] = steps[i] <= GAP_PERIODS * period
        return Steps(times, signals, valid)

    def _tamed(self, rows: Steps, ended: bool) -> Steps:
        """Rows with NaN for what is no reading; those that may be a glitch wait."""
        if not len(rows) and not len(self._doubtful):
            return rows
        rows = self._doubtful + rows if len(self._doubtful) else rows
        known = measured(rows.signals)
        signals = rows.signals if known.all() else np.where(known, rows.signals, np.nan)
        tame, settled = self._glitches.push(signals, ended)
        self._doubtful = Steps(rows.times, signals, rows.valid)[settled:]
        return Steps(rows.times, tame, rows.valid)[:settled]

    def _settled(self, rows: Steps, ended: bool) -> Steps:
        """Rows with nothing missing any more; the others wait."""
        rows = self._tamed(rows, ended)
        waited = len(self._tail)
        if not len(rows) and not (ended and waited):
            return rows
        rows = self._tail + rows if waited else rows
        known = np.isfinite(rows.signals)
        if known.all():
            self._absent[:] = False
            self._tail = rows[:0]
            self._before = rows.signals[-1].copy()
            return rows
        signals, valid, limit = rows.signals.copy(), rows.valid.copy(), len(rows)
        for column in range(self._columns):
            limit = min(limit, self._filled(column, signals[:, column], valid, waited, ended))
        rows = Steps(rows.times, signals, valid)
        self._tail = rows[limit:]
        if limit:
            self._before = signals[limit - 1].copy()
        return rows[:limit]

    def _filled(self, column: int, values: Real, valid: Flags, waited: int, ended: bool) -> int:
        """Fill one column's missing samples as far as they are settled; how far that is.

        Of the rows `waited` have been here before, perhaps for another column's sake: an absent
        one is filled up to there already.
        """
        lost = np.concatenate([[False], ~np.isfinite(values), [False]])
        before = math.nan if self._before is None else float(self._before[column])
        limit = len(values)
        for first, last in np.flatnonzero(np.diff(lost)).reshape(-1, 2).tolist():
            count = last - first
            left = float(values[first - 1]) if first else before
            right = float(values[last]) if last < len(values) else math.nan
            absent = bool(self._absent[column]) and first == waited
            if last == len(values) and not (ended or absent or count > PATIENCE):
                return first
            if absent or count > PATIENCE or math.isnan(right):
                values[first:last] = left if math.isfinite(left) else 0.0
            elif math.isnan(left):
                values[first:last] = right
            else:
                share = np.arange(1, count + 1) / (count + 1)
                values[first:last] = left + share * (right - left)
            if absent or count > GAP_PERIODS:
                valid[first:last] = False
            self._absent[column] = last == len(values) and not ended
        if not lost[-2]:
            self._absent[column] = False
        return limit
