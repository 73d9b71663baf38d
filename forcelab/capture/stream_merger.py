"""Several devices' samples on the stamps of the first, while they come."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from forcelab.arrays import Real
from forcelab.capture.align import DeviceStream, channels_of_all, make_increasing, resample
from forcelab.capture.device import Device
from forcelab.capture.reader import Window
from forcelab.demonstration import Channel

#: Seconds by which another device may be behind the first before it is not waited for any more.
PATIENCE_SECONDS = 0.25
#: Samples of another device that are kept from before the last stamp: they tell its period.
OVERLAP_SAMPLES = 64
#: Seconds of another device that are kept while the first is silent, as when it is unplugged.
SILENT_SECONDS = 60.0


class StreamMerger:
    """A recorder's devices, joined as :mod:`forcelab.capture.align` does, while they come.

    The stamps are those of the clocks as they are known when the samples come; afterwards, when all
    arrivals are known, a demonstration's are better by up to some milliseconds.
    """

    def __init__(
        self,
        devices: Sequence[Device],
        since: Callable[[int, int], Window],
    ) -> None:
        """`since` gives the samples of a device from a number on, as ``Recorder.since``.

        The first device that does not hold gives the stamps.
        """
        #: As a demonstration of these devices has them.
        self.channels: tuple[Channel, ...] = channels_of_all([d.channels for d in devices])
        holds = [device.holds for device in devices]
        self._lead = next((i for i, hold in enumerate(holds) if not hold), 0)
        #: Configured samples a second of the first device; 0 where there are none.
        self.rate = devices[self._lead].rate
        self._since, self._holds = since, holds
        self._times = [np.empty(0) for _ in devices]
        self._values = [np.empty((0, len(device.channels))) for device in devices]
        self._next = [0] * len(devices)
        self._last = -np.inf

    def skip(self, latest: Sequence[Window]) -> None:
        """Leave out what came before the last sample of each device, as of ``Recorder.latest``."""
        # What a device holds, it holds since before.
        self._next = [
            first + len(times) - int(holds and len(times) > 0)
            for (first, times, _), holds in zip(latest, self._holds, strict=True)
        ]

    def start(self, firsts: Sequence[int]) -> None:
        """Begin with each device's sample of this number."""
        self._next = list(firsts)

    def read(self, ends: Sequence[int | None] | None = None) -> tuple[Real, Real]:
        """The samples that all devices have by now: stamps (s, host's clock), and values.

        Stamps increase strictly; values, shape (n, c), are NaN where a device has no sample near.
        With `ends`, such as ``Recorder.ends``, the end has come, and no other device is waited for:
        of each device, the number of the first sample that counts no more; None where all count.
        """
        for i, number in enumerate(self._next):
            first, times, values = self._since(i, number)
            if ends is not None and (end := ends[i]) is not None:
                times, values = times[: max(end - first, 0)], values[: max(end - first, 0)]
            self._next[i] = first + len(times)
            if len(times):
                self._times[i] = np.concatenate([self._times[i], times])
                self._values[i] = np.concatenate([self._values[i], values])
        host = self._times[self._lead]
        until = self._complete_until() if ends is None else np.inf
        n = int(np.searchsorted(host, until, side="right"))
        if not n:
            self._forget(max((t[-1] for t in self._times if len(t)), default=0.0) - SILENT_SECONDS)
            return np.empty(0), np.empty((0, len(self.channels)))
        # A clock that is learnt better may set stamps back.
        stamps = make_increasing(host[:n], self._last, self.rate)
        columns = [
            self._values[i][:n]
            if i == self._lead
            else resample(stamps, DeviceStream(times, self._values[i], self._holds[i]))
            for i, times in enumerate(self._times)
        ]
        self._times[self._lead] = host[n:]
        self._values[self._lead] = self._values[self._lead][n:]
        self._last = float(stamps[-1])
        self._forget(self._last)
        return stamps, np.concatenate(columns, axis=1)

    def _forget(self, until: float) -> None:
        """Drop what the other devices sent before a time (s), but for the last of it."""
        for i in range(len(self._times)):
            if i != self._lead:
                place = max(int(np.searchsorted(self._times[i], until)) - OVERLAP_SAMPLES, 0)
                self._times[i] = self._times[i][place:]
                self._values[i] = self._values[i][place:]

    def _complete_until(self) -> float:
        """Host time (s) up to which all devices have sent."""
        host = self._times[self._lead]
        if not len(host):
            return -np.inf
        last_times = [
            float(times[-1]) if len(times) else -np.inf
            for i, times in enumerate(self._times)
            if i != self._lead and not self._holds[i]
        ]
        return max(min(last_times, default=np.inf), float(host[-1]) - PATIENCE_SECONDS)
