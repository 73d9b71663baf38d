"""A stream of samples as it is captured, brought onto a uniform grid sample by sample.

The causal counterpart of :mod:`forcelab.signals.grid`. Samples are taken as evenly spaced: what is
missing between two of them is counted from their stamps and put in, so that a jitter of stamps
moves no sample. Lost samples and NaN are bridged by straight lines once the next sample is there.
Steps of more than :data:`~forcelab.demonstration.GAP_PERIODS` missing samples are not valid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS
from forcelab.signals.grid import SAME_RATE

__all__ = ["PATIENCE", "CausalGrid", "Steps"]

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: Samples from whose stamps the device's period is taken.
PROBE = 64
#: Missing samples that are waited for. Of a longer run the last value holds, so that the stream
#: goes on when one of two devices is gone.
PATIENCE = 1000


@dataclass(frozen=True)
class Steps:
    """Consecutive steps of the grid.

    Parameters
    ----------
    times : ndarray of float64, shape (n,)
        Seconds.
    signals : ndarray of float64, shape (n, c)
        Finite.
    valid : ndarray of bool, shape (n,)
    """

    times: Real
    signals: Real
    valid: Flags

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


class CausalGrid:
    """Samples in, steps of a grid out, as soon as they cannot change any more.

    Parameters
    ----------
    columns : int
    rate : float
        Samples a second of the grid. As offline, the device's own is kept where the two differ by
        less than 1 %.
    device_rate : float, optional
        What the device gives; by default the median of the first stamps' distances tells.
    longest : int
        A gap is at most so many steps long, however long it was: what no wavelet spans.

    Attributes
    ----------
    period : float or None
        Seconds between two samples of the device, once it is known.
    """

    def __init__(
        self, columns: int, rate: float, device_rate: float | None = None, longest: int = 100_000
    ) -> None:
        self._columns = columns
        self._rate = rate
        self._longest = max(longest, PATIENCE + 1)
        self.period = None if device_rate is None else 1.0 / device_rate
        self._waiting = Steps.none(columns)  # until the period is known
        self._tail = Steps.none(columns)  # until what is missing is known
        self._before: Real | None = None  # the last settled values
        self._last_time = -math.inf
        self._absent = np.zeros(columns, dtype=bool)  # missing for longer than the patience
        self._resampling: _Resampling | None = None

    def push(self, times: Real, signals: Real) -> Steps:
        """Take samples, shape (n,) and (n, columns); give the steps that are settled by now.

        Samples whose stamp is not finite or not later than the one before are left out.
        """
        incoming = self._later(times, signals)
        if self.period is None:
            self._waiting += incoming
            if len(self._waiting) < PROBE:
                return Steps.none(self._columns)
            incoming, self._waiting = self._waiting, Steps.none(self._columns)
            self.period = float(np.median(np.diff(incoming.times[:PROBE])))
        return self._through(self._settled(self._evened(incoming), ended=False), ended=False)

    def finish(self) -> Steps:
        """End the stream: what is missing is held; the steps that were still waiting."""
        rest = self._waiting
        self._waiting = Steps.none(self._columns)
        if self.period is None:
            steps = np.diff(rest.times)
            self.period = float(np.median(steps)) if len(steps) else 1.0 / self._rate
        return self._through(self._settled(self._evened(rest), ended=True), ended=True)

    @property
    def lag(self) -> int:
        """Steps that the grid stays behind the samples, where nothing is missing."""
        resampling = self._resampler()
        return 0 if resampling is None else resampling.lag

    @property
    def step(self) -> float:
        """Seconds between two steps; the period must be known."""
        resampling = self._resampler()
        return self._known * (1.0 if resampling is None else resampling.ratio)

    @property
    def _known(self) -> float:
        """The period, which is known by now."""
        if self.period is None:
            raise RuntimeError("the period is not known before the first samples")
        return self.period

    def _later(self, times: Real, signals: Real) -> Steps:
        """The samples whose stamps go on increasing."""
        times = np.asarray(times, dtype=np.float64)
        steps = times[1:] - times[:-1]
        # A NaN among them is less than nothing.
        ordered = len(times) == 1 or (len(times) > 1 and steps.min() > 0)
        if ordered and times[0] > self._newest() and times[-1] < np.inf:
            values = np.asarray(signals, dtype=np.float64)
            return Steps(times, values, np.ones(len(times), dtype=bool))
        usable = np.where(np.isfinite(times), times, -np.inf)
        highest = np.maximum.accumulate(np.concatenate([[self._newest()], usable]))
        fine = usable > highest[:-1]
        return Steps(
            times[fine],
            np.asarray(signals, dtype=np.float64)[fine],
            np.ones(int(fine.sum()), dtype=bool),
        )

    def _newest(self) -> float:
        """The last stamp that was taken."""
        return float(self._waiting.times[-1]) if len(self._waiting) else self._last_time

    def _evened(self, samples: Steps) -> Steps:
        """The samples with rows of NaN where some are missing."""
        if not len(samples):
            return samples
        period = self._known
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

    def _settled(self, rows: Steps, ended: bool) -> Steps:
        """Rows with nothing missing any more; the others wait."""
        rows = self._tail + rows if len(self._tail) else rows
        if not len(rows):
            return rows
        if np.isfinite(rows.signals).all():
            self._absent[:] = False
            self._tail = rows[:0]
            self._before = rows.signals[-1].copy()
            return rows
        signals, valid, limit = rows.signals.copy(), rows.valid.copy(), len(rows)
        for column in range(self._columns):
            limit = min(limit, self._filled(column, signals[:, column], valid, ended))
        rows = Steps(rows.times, signals, valid)
        self._tail = rows[limit:]
        if limit:
            self._before = signals[limit - 1].copy()
        return rows[:limit]

    def _filled(self, column: int, values: Real, valid: Flags, ended: bool) -> int:
        """Fill one column's missing samples as far as they are settled; how far that is."""
        lost = np.concatenate([[False], ~np.isfinite(values), [False]])
        before = math.nan if self._before is None else float(self._before[column])
        limit = len(values)
        for first, last in np.flatnonzero(np.diff(lost)).reshape(-1, 2).tolist():
            count = last - first
            left = float(values[first - 1]) if first else before
            right = float(values[last]) if last < len(values) else math.nan
            absent = bool(self._absent[column]) and first == 0
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

    def _resampler(self) -> _Resampling | None:
        """What brings the device's rate to the grid's, where the two differ."""
        ratio = 1.0 / (self._known * self._rate)
        if abs(1.0 / ratio - 1) < SAME_RATE:
            return None
        if self._resampling is None:
            self._resampling = _Resampling(self._columns, ratio)
        return self._resampling

    def _through(self, rows: Steps, ended: bool) -> Steps:
        """Rows at the device's rate brought to the grid's."""
        resampling = self._resampler()
        return rows if resampling is None else resampling.push(rows, ended)


class _Resampling:
    """From one even rate to another, as :func:`forcelab.signals.grid.on_grid` does.

    Straight lines to a higher rate; to a lower one the low-pass filter of
    :func:`scipy.signal.resample_poly` with the same window.

    Parameters
    ----------
    columns : int
    ratio : float
        Rows in for one row out.
    """

    def __init__(self, columns: int, ratio: float) -> None:
        if ratio <= 1:
            self.ratio, self._reach = ratio, 1
            self._up, self._down, self._taps = 1, 1, None
        else:
            from scipy.signal import firwin  # takes a second to load

            exact = Fraction(ratio).limit_denominator(max(1, int(1000 / ratio)))
            self._up, self._down = exact.denominator, exact.numerator
            self.ratio = self._down / self._up
            half = 10 * self._down
            shape = firwin(2 * half + 1, 1 / self._down, window=("kaiser", 8.0)) * self._up
            self._reach = math.ceil(half / self._up) + 1
            offsets = np.arange(-self._reach, self._reach + 1)
            places = np.arange(self._up)[:, None] - offsets * self._up + half
            inside = (places >= 0) & (places <= 2 * half)
            self._taps = np.where(inside, shape[np.clip(places, 0, 2 * half)], 0.0)
        self.lag = math.ceil(self._reach / self.ratio)
        self._rows = Steps.none(columns)
        self._first = 0  # number of the first row that is kept
        self._made = 0

    def push(self, rows: Steps, ended: bool) -> Steps:
        """The rows out whose surroundings are there."""
        if not self._first and not len(self._rows) and len(rows):
            self._rows = _repeated(rows[:1], self._reach)
            self._first = -self._reach
        rows = self._rows + rows
        if not len(rows):
            return rows
        count = self._first + len(rows)  # rows that came in all
        last = count - 1
        if ended:
            rows = rows + _repeated(rows[-1:], self._reach)
            final = (
                math.floor(last / self.ratio + 1e-6)
                if self._taps is None
                else math.ceil(count / self.ratio - 1e-9) - 1
            )
        else:
            final = math.floor((last - self._reach) / self.ratio - 1e-9)
        numbers = np.arange(self._made, max(self._made, final + 1))
        out = self._at(rows, numbers, last)
        self._made += len(numbers)
        keep = math.floor(self._made * self.ratio) - self._reach - self._first
        keep = min(max(keep, 0), len(rows))
        self._first += keep
        self._rows = rows[keep:]
        return out

    def _at(self, rows: Steps, numbers: NDArray[np.int64], last: int) -> Steps:
        """The rows out of these numbers."""
        places = numbers * self.ratio
        if self._taps is None:
            whole = np.minimum(np.floor(places + 1e-9).astype(np.int64), last)
        else:
            whole = (numbers * self._down) // self._up
        share = np.maximum(places - whole, 0.0)
        here = whole - self._first
        after = np.minimum(here + 1, len(rows) - 1)
        times = rows.times[here] + share * (rows.times[after] - rows.times[here])
        # Behind the last row all stamps are the last one's.
        valid = np.where(share < 0.5, rows.valid[here], rows.valid[after])
        if self._taps is None:
            signals = rows.signals[here] + share[:, None] * (
                rows.signals[after] - rows.signals[here]
            )
        else:
            around = here[:, None] + np.arange(-self._reach, self._reach + 1)
            taps = self._taps[(numbers * self._down) % self._up]
            signals = np.einsum("mt,mtc->mc", taps, rows.signals[around])
        return Steps(times, signals, valid)


def _repeated(row: Steps, count: int) -> Steps:
    """One row, several times."""
    return Steps(
        np.repeat(row.times, count),
        np.repeat(row.signals, count, axis=0),
        np.repeat(row.valid, count),
    )
