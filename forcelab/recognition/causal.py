"""Level, slope and strength of channels as far as a stream can know them, a fixed time ahead.

The causal counterpart of :mod:`forcelab.recognition.windows`: the same Gaussian windows, cut off
`look` seconds after their time step and normalised again, so that a wide one mostly looks back. In
what is left of a window the *level* is the weighted mean, the *slope* that of the weighted line of
best fit, and the *rms* the weighted standard deviation; of a whole Gaussian window these are the
values that its convolutions give. Channels count in units of what is usual in training; where a
person's own strength matters, in units of what is usual in the stream so far, which starts from
there and forgets.

What a recogniser learns from is made here, too, by pushing whole demonstrations: there is nothing
that a stream could know differently.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from forcelab.recognition.windows import KINDS, REACH, REST
from forcelab.signals.conditioning import SPIKE

__all__ = ["CausalWindows", "StreamingWindows", "usual_size"]

Real = NDArray[np.float64]

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
    """Which windows a stream is looked at in.

    Parameters
    ----------
    windows : tuple of float, length k
        Standard deviations in seconds.
    look : float
        Seconds after a time step that may be seen.
    usual : ndarray, shape (q,)
        Size of each channel's movements in training, above 0.
    own : bool
        Whether forces are in units of the stream's own size.
    """

    windows: tuple[float, ...]
    look: float
    usual: Real
    own: bool

    @property
    def width(self) -> int:
        """Features of a time step: for each kind all windows of channel 1, then of channel 2."""
        return len(KINDS) * len(self.usual) * len(self.windows)

    def of(self, channels: Real, rate: float, hop: int) -> Real:
        """Features of all time steps of a whole recording.

        Parameters
        ----------
        channels : ndarray, shape (q, n)
            Finite.
        rate : float
            Samples a second.
        hop : int
            Samples from one time step to the next.

        Returns
        -------
        ndarray, shape (m, f)
            Time step i lies in the middle of the samples ``i hop .. (i + 1) hop``.
        """
        stream = StreamingWindows(self, rate, hop)
        return np.concatenate([stream.push(channels.T), stream.finish()])


def usual_size(recordings: Iterable[Real], rate: float) -> Real:
    """Size of each channel's movements, shape (q,): the middle one of several recordings.

    Parameters
    ----------
    recordings : iterable of ndarray, shape (q, n)
    rate : float

    Notes
    -----
    The contraharmonic mean of the distances from rest: that of squares over that of sizes, to
    which rest adds nothing. 1 for a channel that never moves.
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
    """Features of a stream's time steps, as soon as all that they may see has come.

    Parameters
    ----------
    what : CausalWindows
    rate : float
        Samples a second.
    hop : int
        Samples from one time step to the next.

    Notes
    -----
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
    """How strong a stream has been of late, in units of what is usual.

    The contraharmonic mean of the distances from rest, as of :func:`usual_size`, over the last
    :data:`FORGETTING` seconds; in a long rest it goes back to what is usual.
    """

    def __init__(self, channels: int, rate: float) -> None:
        self._period, self._limit = 1.0 / rate, max(1, round(REST * rate))
        self._first = np.empty((0, channels))
        self._rest: Real | None = None
        self._latest: Real | None = None
        self._squares, self._sizes = np.zeros(channels), np.zeros(channels)

    def see(self, rows: Real) -> None:
        """Take samples, from whose beginning the rest is known."""
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
        """How far from rest the latest samples are; before the first one, it holds."""
        if self._latest is None:
            self._latest = np.repeat(cell[:1], LATEST, axis=0)
        self._latest = np.concatenate([self._latest, cell])[-LATEST:]
        return np.asarray(np.abs(self._latest - rest))
