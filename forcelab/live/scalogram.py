"""A rolling scalogram of a stream.

The coefficient of a wide wavelet is complete only seconds after its sample. Until then it is shown
as it is known so far, by estimates some steps after the sample (:data:`RUNGS`): each is better than
the one before and replaces it. What is still estimated lies right of :attr:`RollingImage.complete`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.assemble import channels_of_all
from forcelab.capture.device import Device
from forcelab.capture.recorder import Recorder
from forcelab.capture.stream_merger import StreamMerger
from forcelab.demonstration import Channel
from forcelab.errors import InputError
from forcelab.live.even_steps import CausalGrid, Steps
from forcelab.signals.channels import channel_map
from forcelab.signals.cwt import frequencies
from forcelab.signals.streaming import StreamingCwt
from forcelab.signals.wavelets import Morlet

Real = NDArray[np.float64]
Sizes = NDArray[np.float32]

#: Decades from the first to the last colour at most, and the share of values below the last.
DECADES, TOP = 3.0, 0.998
#: Decades by which the last colour's value falls with each picture, where less would do, and by how
#: many it may stay above: after a glitch of many decades the rest must not wait for it to fall.
CALM, ABOVE = 0.02, 2.0


@dataclass(frozen=True, eq=False)
class RollingImage:
    """The last seconds as an image."""

    #: start, end: seconds at the edges of the first and the last column, on the clock of the stream
    start: float
    end: float
    values: Sizes  # (rows, columns); decimal logarithms of magnitudes; NaN where nothing is known
    hertz: Real  # (rows,); the frequency of each row, falling
    complete: Real  # (rows,); the time (s) up to which each row is complete
    #: low, high: for the first and the last colour
    low: float
    high: float


class ColumnRing:
    """Columns of the last seconds, each `width` seconds wide, at multiples of it."""

    def __init__(self, rows: int, columns: int, width: float) -> None:
        self._columns, self._width = columns, width
        self._values = np.full((rows, columns), np.nan, dtype=np.float32)
        self._newest = -1
        # Of each source the newest column of each row that it wrote to: a second block of one
        # column joins the first one, another source's better estimate replaces it.
        self._open: list[NDArray[np.int64]] = []
        self._high = -np.inf

    @property
    def seconds(self) -> float:
        """That are shown."""
        return self._columns * self._width

    def reach(self, until: float) -> None:
        """Time goes on: columns up to there are empty."""
        newest = int(np.floor(until / self._width))
        if newest > self._newest:
            first = max(self._newest + 1, newest - self._columns + 1)
            self._values[:, np.arange(first, newest + 1) % self._columns] = np.nan
            self._newest = newest

    def write(self, rows: NDArray[np.int64], times: Real, sizes: Sizes, source: int) -> None:
        """Write the largest magnitudes (k, n) of `rows` (k,) in each column.

        `times` (k, n) increase along each row; NaN is not written. What the same `source` (from 0)
        wrote into a column before counts, too.
        """
        ages = self._newest - np.floor(times / self._width)
        row, at = np.nonzero((ages >= 0) & (ages < self._columns))  # not so of NaN
        if not len(row):
            return
        places = self._newest - ages[row, at].astype(np.int64)
        firsts = np.flatnonzero(np.diff(row, prepend=-1) | np.diff(places, prepend=-1))
        largest = np.maximum.reduceat(sizes[row, at], firsts)
        target, places = rows[row[firsts]], places[firsts]
        columns = places % self._columns
        while len(self._open) <= source:
            self._open.append(np.full(len(self._values), -1, dtype=np.int64))
        joined = self._open[source][target] == places
        before = self._values[target[joined], columns[joined]]
        largest[joined] = np.fmax(largest[joined], before)
        self._open[source][target] = places  # the last of each row stays
        self._values[target, columns] = largest

    def image(self, hertz: Real, complete: Real) -> RollingImage:
        """The picture as it is now; parameters as of :class:`RollingImage`."""
        order = np.arange(self._newest - self._columns + 1, self._newest + 1)
        sizes = self._values[:, order % self._columns]
        with np.errstate(divide="ignore"):
            values = np.log10(sizes)
        finite = values[np.isfinite(values)]
        if finite.size:
            high = float(np.partition(finite, place := int(TOP * (finite.size - 1)))[place])
            self._high = max(high, min(self._high - CALM, high + ABOVE))
        high = self._high if np.isfinite(self._high) else 0.0
        start = float(order[0]) * self._width
        return RollingImage(
            start, start + self.seconds, values, hertz, complete, high - DECADES, high
        )


#: Error of what counts as complete, relative to the largest coefficient of its scale: a colour
#: stands for a hundredth of the range and more.
TOLERANCE = 1.4e-3
#: Seconds after its sample at which a coefficient that is not complete is estimated.
RUNGS = (0.1, 0.4, 1.6)
#: Smallest scale, in samples: a wavelet that is not cut by the Nyquist frequency. Largest scale;
#: and the share of the seconds shown that a wavelet may take to become complete.
SMALLEST, LARGEST, SHARE = 3.0, 1024.0, 0.45
#: Half-widths of a wavelet in scales at that tolerance (``support``), for the choice of scales.
HALF_WIDTH = 3.9
#: Samples that are transformed at once.
PIECE = 1000


def channels_to_show(channels: Sequence[Channel]) -> tuple[str, ...]:
    """Channels that a scalogram can show: recognition channels, then the recorded ones."""
    names = channel_map(channels).names
    return (*names, *(c.name for c in channels if c.name not in names))


@dataclass(frozen=True)
class _Rung:
    """A transform and which rows it gives."""

    transform: StreamingCwt
    rows: NDArray[np.int64]


class LiveScalogram:
    """Magnitudes of one channel over the last seconds, as `image`, which any thread may read.

    `rates` are samples a second of each device, as measured; rates that a device was told go first.
    An InputError says that there is no such channel, or it does not come evenly.
    """

    def __init__(
        self,
        recorder: Recorder,
        devices: Sequence[Device],
        channel: str,
        seconds: float,
        columns: int,
        rows: int,
        rates: Sequence[float] = (),
    ) -> None:
        self.image: RollingImage | None = None
        self._recorder = recorder
        chosen, recorded, self._apply = _channel_source(devices, channel)
        self._chosen = chosen
        used = [devices[i] for i in chosen]
        self._following = StreamMerger(used, lambda i, number: recorder.since(chosen[i], number))
        self._recorded = recorded
        measured = max((rates[i] for i in chosen if i < len(rates)), default=0.0)
        rate = self._following.rate or measured
        if not rate > 0:
            raise InputError(
                f"'{channel}' does not come evenly, so that it has no scalogram; choose another."
            )
        largest = min(LARGEST, SHARE * seconds * rate / HALF_WIDTH)
        if largest < 2 * SMALLEST:
            raise InputError(
                f"'{channel}' comes {rate:.3g} times a second, too rarely for a scalogram of "
                f"{seconds:.0f} s."
            )
        self.scales = np.geomspace(SMALLEST, largest, rows)
        wavelet = Morlet()
        self.hertz = frequencies(self.scales, rate, wavelet)
        full = StreamingCwt(self.scales, 1, wavelet, TOLERANCE)
        self._rungs = [_Rung(full, np.arange(rows))]
        for after in RUNGS:
            late = round(after * rate)
            members = np.flatnonzero(full.complete > late)
            if len(members) and late:
                transform = StreamingCwt(self.scales[members], 1, wavelet, TOLERANCE, late)
                self._rungs.insert(-1, _Rung(transform, members))
        self._complete: Real = full.complete.astype(np.float64) / rate
        longest = int(full.complete.max()) + 1
        self._grid = CausalGrid(len(recorded), rate, 2 * longest)
        self._times = np.full(longest, np.nan)  # of the steps that some row still waits for
        self._ring = ColumnRing(rows, columns, seconds / columns)

    def begin(self) -> None:
        """Follow from the oldest samples on that are still to be seen, so that it is full soon."""
        latest = self._recorder.latest(self._ring.seconds + float(self._complete.max()))
        none = np.empty(0)
        self._following.skip([(latest[i][0], none, none) for i in self._chosen])

    def read(self) -> tuple[Real, Real]:
        """Read the new samples from the recorder, for :meth:`take`."""
        return self._following.read()

    def take(self, times: Real, values: Real) -> Iterator[None]:
        """Take samples, in pieces so that other threads have a turn; asks no device."""
        steps = self._grid.push(times, values[:, self._recorded])
        for first in range(0, len(steps), PIECE):
            self._transform(steps[first : first + PIECE])
            yield
        if len(steps):
            complete = float(steps.times[-1]) - self._complete
            self.image = self._ring.image(self.hertz, complete)

    def _transform(self, steps: Steps) -> None:
        """Write the coefficients that steps of the grid bring."""
        signal = self._apply(steps.signals)[:, None]
        # In a gap nothing is known; what is put in for it only carries the wavelets across.
        times = np.where(steps.valid, steps.times, np.nan)
        self._times = np.concatenate([self._times, times])
        self._ring.reach(float(steps.times[-1]))
        n = len(steps)
        for source, rung in enumerate(self._rungs):
            sizes = np.abs(rung.transform.push(signal)[0]).astype(np.float32)
            self._write(rung, sizes, n, source)
        self._times = self._times[n:]

    def _write(self, rung: _Rung, sizes: NDArray[np.float32], n: int, source: int) -> None:
        """Write magnitudes (k, n), each row's at the time of the steps that it is of."""
        first = len(self._times) - n - rung.transform.delays
        times = self._times[first[:, None] + np.arange(n)]
        self._ring.write(rung.rows, times, sizes, source)


def _channel_source(
    devices: Sequence[Device], channel: str
) -> tuple[list[int], list[int], Callable[[Real], Real]]:
    """The devices of a channel, their columns, and the function that computes it from these."""
    owners = [i for i, device in enumerate(devices) for _ in device.channels]
    channels = channels_of_all([device.channels for device in devices])
    names = [item.name for item in channels]
    if channel in channel_map(channels).names:
        chosen_map = channel_map(channels, [channel])
        columns = list(chosen_map.recorded)
    elif channel in names:
        chosen_map = channel_map([channels[names.index(channel)]])
        columns = [names.index(channel)]
    else:
        raise InputError(f"There is no channel '{channel}'; there are {', '.join(names)}.")
    chosen = sorted({owners[column] for column in columns})
    joined = [column for column, owner in enumerate(owners) if owner in chosen]
    return chosen, [joined.index(c) for c in columns], lambda values: chosen_map.apply(values)[0]
