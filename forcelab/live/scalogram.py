"""A rolling scalogram of a stream: the transform of the last seconds, a few times a second.

The coefficient of a wide wavelet is complete only seconds after its sample. Until then it is shown
as it is known so far, as if the force stayed as it is, and each picture knows better than the one
before. What is still estimated lies right of :attr:`RollingImage.complete`.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Real
from forcelab.capture.align import channels_of_all
from forcelab.capture.device import Device
from forcelab.capture.recorder import Recorder
from forcelab.capture.stream_merger import StreamMerger
from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.signals.channels import channel_map
from forcelab.signals.cwt import frequencies
from forcelab.signals.grid_reader import GridReader, columns_of
from forcelab.signals.scalogram import ChannelView, largest_magnitudes, reach
from forcelab.signals.wavelets import Morlet

Sizes = NDArray[np.float32]

#: Decades from the first to the last colour at most, and the share of values below the last.
DECADES, TOP = 3.0, 0.998
#: Decades by which the last colour's value falls with each second, where less would do, and by how
#: many it may stay above: after a glitch of many decades the rest must not wait for it to fall.
CALM, ABOVE = 0.5, 2.0
#: Half-width of a wavelet in scales: beyond it 1.4e-3 of the largest coefficient is missed, where a
#: colour stands for a hundredth of the range and more.
HALF_WIDTH = 4.3
#: Smallest scale, in samples: a wavelet that is not cut by the Nyquist frequency. Largest scale;
#: and the share of the seconds shown that a wavelet may take to become complete.
SMALLEST, LARGEST, SHARE = 3.0, 1024.0, 0.45
#: Samples whose median holds after the last one: its noise, held for long, would be loud.
HELD = 32


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


def channels_to_show(channels: Sequence[Channel]) -> tuple[str, ...]:
    """Channels that a scalogram can show: recognition channels, then the recorded ones."""
    names = channel_map(channels).names
    return (*names, *(c.name for c in channels if c.name not in names))


class LiveScalogram:
    """Magnitudes of one channel over the last seconds, as `image`, which any thread may read.

    `rates` are samples a second of each device, as measured; rates that a device was told go first.
    An InputError says that there is no such channel, or it does not come evenly.
    """

    def __init__(
        self,
        recorder: Recorder,
        channel: str,
        seconds: float,
        columns: int,
        rows: int,
        rates: Sequence[float] = (),
    ) -> None:
        self.image: RollingImage | None = None
        self._recorder, self._channel = recorder, channel
        devices = recorder.devices
        chosen, self._recorded = _channel_source(devices, channel)
        self._chosen = chosen
        used = [devices[i] for i in chosen]
        self._merger = StreamMerger(used, lambda i, number: recorder.since(chosen[i], number))
        measured = max((rates[i] for i in chosen if i < len(rates)), default=0.0)
        self._rate = self._merger.rate or measured
        if not self._rate > 0:
            raise InputError(
                f"'{channel}' does not come evenly, so that it has no scalogram; choose another."
            )
        largest = min(LARGEST, SHARE * seconds * self._rate / HALF_WIDTH)
        if largest < 2 * SMALLEST:
            raise InputError(
                f"'{channel}' comes {self._rate:.3g} times a second, too rarely for a scalogram of "
                f"{seconds:.0f} s."
            )
        self.scales = np.geomspace(SMALLEST, largest, rows)
        self.hertz = frequencies(self.scales, self._rate, Morlet())
        self._delays = HALF_WIDTH * self.scales / self._rate
        self._seconds, self._columns = seconds, columns
        # Samples before the first column and after the last that coefficients rest on.
        self._beyond = reach(self.scales, Morlet())
        self._times = np.empty(0)
        self._values = np.empty((0, len(self._merger.channels)))
        self._high = -np.inf

    def begin(self) -> None:
        """Follow from the oldest samples on that are still to be seen, so that it is full soon."""
        latest = self._recorder.latest(self._seconds + self._beyond / self._rate)
        self._merger.start([latest[i][0] for i in self._chosen])

    def read(self) -> tuple[Real, Real]:
        """Read the new samples from the recorder, for :meth:`take`."""
        return self._merger.read()

    def take(self, times: Real, values: Real) -> Iterator[Progress]:
        """Take samples, and draw, in steps so that other threads have a turn; asks no device."""
        if not len(times):
            return
        times = np.concatenate([self._times, times])
        # Two columns more, as they begin at multiples of their width.
        seconds = self._seconds * (1 + 2 / self._columns) + self._beyond / self._rate
        first = int(np.searchsorted(times, times[-1] - seconds))
        passed = times[-1] - (self._times[-1] if len(self._times) else times[0])
        self._times = times[first:]
        self._values = np.concatenate([self._values, values])[first:]
        if len(self._times) < 2:
            return
        width = self._seconds / self._columns
        end = width * (np.floor(self._times[-1] / width) + 1)
        edges = end - width * np.arange(self._columns, -1, -1)
        sizes = yield from self._magnitudes(edges)
        low, high = self._colours(sizes, passed)
        complete = self._times[-1] - self._delays
        self.image = RollingImage(
            float(edges[0]), float(end), sizes, self.hertz, complete, low, high
        )

    def _magnitudes(self, edges: Real) -> Generator[Progress, None, Sizes]:
        """The largest magnitudes between edges (s); NaN where there is no sample."""
        start, last = self._times[0], self._times[-1]
        count = int((last - start) * self._rate + 1e-6) + 1
        # What comes is as if the force stayed as it is, whatever a last glitch says.
        after = np.arange(1, self._beyond + 1)
        held = np.median(self._values[-HELD:], axis=0)
        recorded = Demonstration(
            self._channel,
            "",
            np.concatenate([self._times, last + after / self._rate]),
            np.concatenate([self._values, np.tile(held, (len(after), 1))]),
            self._merger.channels,
        )
        reader = GridReader(
            recorded, self._channel, self._recorded, False, self._rate, count + len(after)
        )
        bounds = np.ceil((edges - start) * self._rate - 1e-6).astype(np.int64)
        bounds = np.clip(bounds, 0, count)
        filled = bounds[:-1] < bounds[1:]
        out = np.full((len(self.scales), self._columns), np.nan, dtype=np.float32)
        view = ChannelView(reader, Morlet())
        job = largest_magnitudes(view, self.scales, np.append(bounds[:-1][filled], bounds[-1]))
        out[:, filled] = yield from job
        return out

    def _colours(self, sizes: Sizes, passed: float) -> tuple[float, float]:
        """The logarithms of the first and the last colour, some seconds after the last ones."""
        finite = sizes[np.isfinite(sizes)]
        if finite.size:
            high = float(np.partition(finite, place := int(TOP * (finite.size - 1)))[place])
            self._high = max(high, min(self._high - CALM * passed, high + ABOVE))
        high = self._high if np.isfinite(self._high) else 0.0
        return high - DECADES, high


def _channel_source(devices: Sequence[Device], channel: str) -> tuple[list[int], tuple[int, ...]]:
    """The devices of a channel, and its columns among theirs."""
    owners = [i for i, device in enumerate(devices) for _ in device.channels]
    channels = channels_of_all([device.channels for device in devices])
    names = [item.name for item in channels]
    if channel not in channels_to_show(channels):
        raise InputError(f"There is no channel '{channel}'; there are {', '.join(names)}.")
    columns = columns_of(channels, channel)
    chosen = sorted({owners[column] for column in columns})
    joined = [column for column, owner in enumerate(owners) if owner in chosen]
    return chosen, tuple(joined.index(column) for column in columns)
