"""Features of a stream, a fixed delay behind it: its uniform grid, rates, windows and wavelets.

The grid is the causal counterpart of :mod:`forcelab.signals.grid`. Samples are taken as evenly
spaced: what is missing between two of them is counted from their stamps and put in, so that a
jitter of stamps moves no sample. Lost samples, NaN, glitches and what cannot be a reading are
bridged by straight lines once the next sample is there. Steps of more than
:data:`~forcelab.demonstration.GAP_PERIODS` missing samples are not valid.

The windows are the Gaussian ones of :mod:`forcelab.recognition.features`, cut off `look` seconds
after their time step and normalised again, so that a wide one mostly looks back. In what is left of
a window the *level* is the weighted mean, the *slope* that of the weighted line of best fit, and
the *rms* the weighted standard deviation; of a whole Gaussian window these are the values that its
convolutions give. Channels count in units of what is usual in training; where a person's own
strength matters, in units of what is usual in the stream so far, which starts from there and
forgets. Training examples are made by pushing whole demonstrations, so that they hold nothing that
a stream could not know.

The wavelets are those of :mod:`forcelab.recognition.features`, a fixed delay behind. Offline the
floor of the magnitudes comes from noise and amplitude of the whole recording. A stream takes the
noise from the latest :data:`EVERY` steps, anew after as many, first after :data:`FIRST`, and the
amplitude from the latest :data:`LASTING` times so many.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS
from forcelab.recognition.features import KINDS, NOISE_SHARE, REACH, REST, ROUNDING
from forcelab.signals.conditioning import SPIKE, noise_level, robust_peak
from forcelab.signals.grid import SAME_RATE, measured
from forcelab.signals.streaming import CHUNK, CausalGlitches, StreamingCwt, level_of

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


class Resampling:
    """From one even rate to another, as :func:`forcelab.signals.grid.on_grid` does.

    `ratio` rows in for one row out. Straight lines to a higher rate; to a lower one the low-pass
    filter of :func:`scipy.signal.resample_poly` with the same window.
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


#: Samples from whose stamps the device's period is taken.
PROBE = 64
#: Missing samples that are waited for. Of a longer run the last value holds, so that the stream
#: goes on when one of two devices is gone.
PATIENCE = 1000


class CausalGrid:
    """Samples in, steps of a grid of `rate` Hz out, as soon as they cannot change any more.

    As offline, the device's own rate is kept where the two differ by less than 1 %; without one the
    median distance of the first stamps tells it. A gap is at most `longest` steps long, however
    long it was: what no wavelet spans.
    """

    def __init__(
        self, columns: int, rate: float, device_rate: float | None = None, longest: int = 100_000
    ) -> None:
        self._columns = columns
        self._rate = rate
        self._longest = max(longest, PATIENCE + 1)
        self.period = None if device_rate is None else 1.0 / device_rate
        self._waiting = Steps.none(columns)  # until the period is known
        self._glitches = CausalGlitches(columns)
        self._doubtful = Steps.none(columns)  # until it is known whether they are a glitch
        self._tail = Steps.none(columns)  # until what is missing is known
        self._before: Real | None = None  # the last settled values
        self._last_time = -math.inf
        self._absent = np.zeros(columns, dtype=bool)  # missing for longer than the patience
        self._resampling: Resampling | None = None

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

    def _resampler(self) -> Resampling | None:
        """The resampling from the device's rate to the grid's, where the two differ."""
        ratio = 1.0 / (self._known * self._rate)
        if abs(1.0 / ratio - 1) < SAME_RATE:
            return None
        if self._resampling is None:
            self._resampling = Resampling(self._columns, ratio)
        return self._resampling

    def _through(self, rows: Steps, ended: bool) -> Steps:
        """Rows at the device's rate brought to the grid's."""
        resampling = self._resampler()
        return rows if resampling is None else resampling.push(rows, ended)


#: Windows at least so many time steps wide see means over one step each; their error is that of a
#: staircase under a bell, 1e-3 of the level's change within a window.
COARSE = 4.0
#: Seconds over which the running size forgets, and for how many seconds of usual strength the
#: size known from training counts beside it.
FORGETTING, TRUST = 20.0, 1.5
#: Channels beyond so many times their usual size count as this.
LARGEST = 1e6
#: Samples more than so many times as far from rest as the middle one of their cell count as this in
#: the running size: it would take minutes to forget a glitch. Where a cell has fewer samples than
#: the second number they are compared with so many latest ones, and each, which lasts longer, may
#: be the third number of times as far.
OUTLYING, LATEST, OUTLYING_FEW = 30.0, 2 * SPIKE + 1, 5.0
#: Cells whose windows are summed up at once: copies of them must stay small.
BLOCK = 256


@dataclass(frozen=True, eq=False)
class CausalWindows:
    """The windows of a stream, and the units of its forces."""

    windows: tuple[float, ...]  # length k; standard deviations in seconds
    look: float  # seconds after a time step that may be seen
    usual: Real  # (q,); size of each channel's movements in training, above 0
    own: bool  # whether forces are in units of the stream's own size

    @property
    def width(self) -> int:
        """Features of a time step: for each kind all windows of channel 1, then of channel 2."""
        return len(KINDS) * len(self.usual) * len(self.windows)

    def of(self, channels: Real, rate: float, hop: int) -> Real:
        """Features (m, f) of all time steps, `hop` samples apart, of finite channels (q, n).

        Time step i lies in the middle of the samples ``i hop .. (i + 1) hop``.
        """
        stream = StreamingWindows(self, rate, hop)
        return np.concatenate([stream.push(channels.T), stream.finish()])


def usual_size(recordings: Iterable[Real], rate: float) -> Real:
    """Size of each channel's movements, shape (q,): the median one of several recordings (q, n).

    The contraharmonic mean of the distances from rest: that of squares over that of sizes, to which
    rest adds nothing. 1 for a channel that never moves.
    """
    sizes = []
    for channels in recordings:
        rest = np.median(channels[:, : max(1, round(REST * rate))], axis=1)
        away = np.abs(channels - rest[:, None])
        most = np.max(away, axis=1)
        share = away / np.where(most > 0, most, 1.0)[:, None]
        total = share.sum(axis=1)
        sizes.append(most * (share**2).sum(axis=1) / np.where(total > 0, total, 1.0))
    size = np.median(sizes, axis=0)
    return np.where(size > 0, size, 1.0)


@dataclass(frozen=True, eq=False)
class _Window:
    """Weights of a window's values, the oldest first: of their mean and of their line's slope."""

    number: int
    weights: Real  # (2, count)

    @property
    def count(self) -> int:
        """Values that it sees."""
        return self.weights.shape[1]

    @classmethod
    def of(cls, number: int, spread: float, after: float, period: float) -> _Window:
        """A bell of this standard deviation, its newest value `after` seconds after its middle.

        Values are `period` seconds apart.
        """
        spread = max(spread, period / 2)  # a line needs two values
        count = 1 + max(1, math.ceil((REACH * spread + after) / period))
        times = after - period * np.arange(count)[::-1]
        weights = np.exp(-0.5 * np.square(times / spread))
        weights /= weights.sum()
        off = times - weights @ times
        slope = weights * off
        return cls(number, np.stack([weights, slope / (slope @ off)]))


class StreamingWindows:
    """Features of a stream's time steps, as soon as all that they may depend on has come.

    Before its beginning a stream has its first value, after its end its last one. Memory stays the
    same, and what is given does not depend on the blocks.
    """

    def __init__(self, what: CausalWindows, rate: float, hop: int) -> None:
        self._what, self._hop = what, hop
        self.ahead = round(what.look * rate)  # samples after a time step that are seen
        step = hop / rate
        # A cell is what lies between the newest samples that two neighbouring steps see.
        self._coarse = [
            _Window.of(i, spread, (self.ahead - (hop - 1) / 2) / rate, step)
            for i, spread in enumerate(what.windows)
            if spread >= COARSE * step
        ]
        # Narrow ones see no farther than their reach: how many samples each leaves out.
        self._fine: list[tuple[int, _Window]] = []
        for i, spread in enumerate(what.windows):
            if spread < COARSE * step:
                seen = min(self.ahead, math.ceil(REACH * spread * rate))
                window = _Window.of(i, spread, seen / rate, 1 / rate)
                self._fine.append((self.ahead - seen, window))
        self._kept = max([hop] + [skip + one.count for skip, one in self._fine])
        self._cells = max([1] + [one.count for one in self._coarse])
        self._size = _RunningSize(len(what.usual), rate) if what.own else None
        self._samples = self._means = self._spreads = np.empty((0, len(what.usual)))
        self._last: Real | None = None
        # Steps before the first one see its first samples already. The newest sample of step 0,
        # and the number of the next step.
        self._newest = hop // 2 + self.ahead
        self._next = -(self._newest // hop)
        self._seen = 0

    def push(self, rows: Real) -> Real:
        """Take samples, shape (n, q); give the features that are due, shape (m, f)."""
        if not len(rows):
            return self._none()
        fresh = np.clip(rows / self._what.usual, -LARGEST, LARGEST)
        if not self._seen:
            self._begin(fresh[0])
        self._seen += len(fresh)
        self._last = rows[-1]
        if self._size is not None:
            self._size.see(fresh)
        self._samples = np.concatenate([self._samples, fresh])
        due = (len(self._samples) - self._kept) // self._hop + 1
        parts = [self._due(min(BLOCK, due - done)) for done in range(0, due, BLOCK)]
        return np.concatenate([self._none(), *parts])

    def finish(self) -> Real:
        """The features that are still to come; nothing may be pushed after this."""
        if self._last is None:
            return self._none()
        # A time step for each middle of a hop that was reached, at least one.
        wanted = max(1, -(-(self._seen - self._hop // 2) // self._hop))
        missing = wanted - max(self._next, 0)
        held = (wanted - self._next) * self._hop + self.ahead
        return self.push(np.repeat(self._last[None], held, axis=0))[:missing]

    def _none(self) -> Real:
        return np.empty((0, self._what.width))

    def _begin(self, first: Real) -> None:
        """Hold the first value for what the next step sees of the time before."""
        before = self._kept - 1 - (self._newest + self._next * self._hop)
        self._samples = np.repeat(first[None], before, axis=0)
        self._means = np.repeat(first[None], self._cells - 1, axis=0)
        self._spreads = np.zeros_like(self._means)

    def _due(self, m: int) -> Real:
        """Features of the next `m` time steps, the newest samples of which are here."""
        hop, kept, q = self._hop, self._kept, len(self._what.usual)
        cells = self._samples[kept - hop : kept + (m - 1) * hop].reshape(m, hop, q)
        means = np.add.reduce(cells, axis=1) / hop
        spreads = np.add.reduce(np.square(cells - means[:, None]), axis=1) / hop
        self._means = np.concatenate([self._means, means])
        self._spreads = np.concatenate([self._spreads, spreads])
        out = np.empty((m, len(KINDS), q, len(self._what.windows)))
        for skip, window in self._fine:
            first, count = kept - skip - window.count, window.count
            _put(out, window, _views(self._samples[first:], m, hop, count), None)
        for window in self._coarse:
            first, count = self._cells - window.count, window.count
            spread = _views(self._spreads[first:], m, 1, count)
            _put(out, window, _views(self._means[first:], m, 1, count), spread)
        if self._size is not None:
            rest, size = self._size.after(cells, self._newest + self._next * hop + 1)
            out[:, 0] -= rest[:, :, None]
            out /= size[:, None, :, None]
        self._samples = self._samples[m * hop :]
        self._means, self._spreads = self._means[m:], self._spreads[m:]
        early = max(0, -self._next)
        self._next += m
        return out.reshape(m, -1)[early:]


def _views(rows: Real, m: int, hop: int, count: int) -> Real:
    """Windows of `count` rows, `hop` apart; shape (m, count, q), nothing copied."""
    if m == 1:
        return rows[None, :count]
    far, near = rows.strides
    shape = (m, count, rows.shape[1])
    return as_strided(rows, shape, (hop * far, far, near), writeable=False)


def _put(out: Real, window: _Window, values: Real, spread: Real | None) -> None:
    """Write what one window sees: values (m, count, q), and the variance within each of them."""
    first = values[:, :1]  # so that what is constant is so without rounding
    away = values - first
    found = np.matmul(window.weights, away)
    squares = np.square(away - found[:, :1], out=away)
    found[:, :1] += first
    if spread is not None:
        squares += spread
    out[:, :2, :, window.number] = found
    out[:, 2, :, window.number] = np.sqrt(np.matmul(window.weights[0], squares))


class _RunningSize:
    """The recent size of a stream's forces, in units of the usual one.

    The contraharmonic mean of the distances from rest, as of :func:`usual_size`, over the last
    :data:`FORGETTING` seconds; in a long rest it goes back to the usual one.
    """

    def __init__(self, channels: int, rate: float) -> None:
        self._period, self._limit = 1.0 / rate, max(1, round(REST * rate))
        self._first = np.empty((0, channels))
        self._rest: Real | None = None
        self._latest: Real | None = None
        self._squares, self._sizes = np.zeros(channels), np.zeros(channels)

    def see(self, rows: Real) -> None:
        """Take samples; the first one holds for the time before."""
        if len(self._first) < self._limit:
            self._first = np.concatenate([self._first, rows])[: self._limit]

    def after(self, cells: Real, known: int) -> tuple[Real, Real]:
        """Level at rest and size, each of shape (m, q), after each of some cells (m, hop, q).

        Samples up to `known` are known with the first of them, as many more as a cell has with
        the next.
        """
        m, hop, _ = cells.shape
        keep = math.exp(-hop * self._period / FORGETTING)
        rests, sizes = (np.empty((m, cells.shape[2])) for _ in range(2))
        for i, cell in enumerate(cells):
            rest = self._rest
            if rest is None:
                rest = np.median(self._first[: known + i * hop], axis=0)
                if known + i * hop >= self._limit:
                    self._rest = rest
            away = np.abs(cell - rest)
            few = hop < LATEST
            near = self._near(cell, rest) if few else away
            middle = np.partition(near, len(near) // 2, axis=0)[len(near) // 2]
            away = np.minimum(away, (OUTLYING_FEW if few else OUTLYING) * middle)
            self._squares = keep * self._squares + self._period * np.square(away).sum(axis=0)
            self._sizes = keep * self._sizes + self._period * away.sum(axis=0)
            rests[i] = rest
            sizes[i] = (self._squares + TRUST) / (self._sizes + TRUST)
        return rests, sizes

    def _near(self, cell: Real, rest: Real) -> Real:
        """Distance of the latest samples from rest; before the first one, it holds."""
        if self._latest is None:
            self._latest = np.repeat(cell[:1], LATEST, axis=0)
        self._latest = np.concatenate([self._latest, cell])[-LATEST:]
        return np.asarray(np.abs(self._latest - rest))


Complex = NDArray[np.complex128]

#: Steps between two looks, and before the first. The transform's base is chosen anew as often.
EVERY, FIRST = CHUNK, 256
#: Looks after which the channel's size is forgotten.
LASTING = 64


def rows_of(coefficients: Complex, floor: Real, phase: bool) -> Real:
    """Features (n, q k or 2 q k) of steps from their coefficients (q, k, n) and floors (q, k)."""
    q, k, n = coefficients.shape
    out = np.empty((2 if phase else 1, q, k, n))
    magnitude, level = out[0], floor[:, :, None]
    np.abs(coefficients, out=magnitude)  # squares would overflow
    with np.errstate(divide="ignore"):
        np.log(magnitude, out=magnitude)
    if phase:
        np.arctan2(coefficients.imag, coefficients.real, out=out[1])
        out[1][magnitude <= level] = 0.0
    np.maximum(magnitude, level, out=magnitude)
    return out.reshape(len(out) * q * k, n).T


class Floor:
    """The floor of the magnitudes as it follows a stream: `now` (q, k), natural logarithms.

    It lies above the rounding, a share of how far samples are from the transform's base, one in
    :data:`~forcelab.signals.conditioning.RARE` left out: a glitch is forgotten with the last
    wavelet that holds it. What disturbs for longer the base may follow, and what comes after is
    rounded as it is.
    """

    def __init__(self, channels: int, scales: Real) -> None:
        self._rounding = np.log(ROUNDING * np.sqrt(scales))
        self._latest = np.empty((0, channels))
        self._base: Real | None = None
        self._peaks = np.empty((0, channels))  # of the latest looks
        self.now: Real | None = None

    def see(self, rows: Real) -> None:
        """Take steps, shape (n, q), none beyond the next multiple of :data:`EVERY`."""
        if self._base is None and len(rows):
            self._base = rows[0].copy()
        self._latest = np.concatenate([self._latest, rows])[-EVERY:]

    def look(self) -> None:
        """Compute the floor anew, at the first look or at a multiple of :data:`EVERY`."""
        if self._base is None:
            raise RuntimeError("a look needs a step")
        peak = robust_peak((self._latest - self._base).T)
        peaks = np.concatenate([self._peaks, [peak]])[-LASTING:]
        size = np.max(peaks, axis=0)
        size = np.where(size > 0, size, 1.0)  # as offline
        with np.errstate(divide="ignore"):  # no noise has the logarithm -inf
            noise = np.log(NOISE_SHARE) + np.log(noise_level(self._latest.T))
        self.now = np.maximum(noise[:, None], np.log(size)[:, None] + self._rounding)
        if len(self._latest) == EVERY:  # not at the first look, after which more is seen of it
            self._base, self._peaks = level_of(self._latest), peaks


class StreamingFeatures:
    """Features of steps, `delay` steps behind, of which the transform's latency is as long."""

    def __init__(self, channels: int, transform: StreamingCwt, delay: int, phase: bool) -> None:
        self._transform = transform
        self._delay = delay
        self._phase = phase
        self._floor = Floor(channels, transform.scales)
        self._pending = np.empty((0, channels))  # before the noise is known
        self._seen = 0

    def push(self, rows: Real) -> Real:
        """Take steps, shape (n, q); give the features that are due, shape (m, f)."""
        if self._floor.now is None:
            rows = np.concatenate([self._pending, rows])
            if len(rows) < FIRST:
                self._pending = rows
                return self._none()
            self._pending = rows[:0]
            self._floor.see(rows[:FIRST])
            self._floor.look()
        return self._features(rows) if len(rows) else self._none()

    def finish(self) -> Real:
        """The features that are still to come, with the last values held."""
        first = self._none()
        if self._floor.now is None:
            if not len(self._pending):
                return first
            self._floor.see(self._pending)
            self._floor.look()
            first = self._features(self._pending)
        rest = self._rows(self._transform.finish(), self._seen)
        return np.concatenate([first, rest])

    def _none(self) -> Real:
        columns = self._transform.channels * len(self._transform.scales)
        return np.empty((0, columns * (2 if self._phase else 1)))

    def _features(self, rows: Real) -> Real:
        """Features that come with steps, with a look at the noise wherever one is due."""
        coefficients = self._transform.push(rows)
        parts = []
        done = 0
        while done < len(rows):
            # What had been seen when the first look was taken was seen already.
            count = EVERY - self._seen % EVERY if self._seen else FIRST
            part = rows[done : done + count]
            parts.append(self._rows(coefficients[:, :, done : done + len(part)], self._seen))
            if self._seen:
                self._floor.see(part)
            self._seen += len(part)
            done += len(part)
            if self._seen % EVERY == 0:
                self._floor.look()
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def _rows(self, coefficients: Complex, first: int) -> Real:
        """Features of the coefficients that came with the steps from `first` on."""
        floor = self._floor.now
        if floor is None:
            raise RuntimeError("the noise must have been looked at before coefficients come")
        # What belongs before the first step is about samples that never were.
        return rows_of(coefficients[:, :, max(0, self._delay - first) :], floor, self._phase)
