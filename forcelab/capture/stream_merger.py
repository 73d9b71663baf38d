"""Several devices' samples on the stamps of the first, while they come."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.assemble import Stream, channels_of_all, onto
from forcelab.capture.device import Device
from forcelab.capture.reader import Window
from forcelab.demonstration import Channel

Real = NDArray[np.float64]

#: Seconds by which another device may be behind the first before it is not waited for any more.
PATIENCE = 0.25
#: Samples of another device that are kept from before the last stamp: they tell its period.
KEPT = 64
#: Seconds of another device that are kept while the first is silent, as when it is unplugged.
SILENT = 60.0


class StreamMerger:
    """What a recorder's devices give, joined as :mod:`forcelab.capture.assemble` does.

    The stamps are those of the clocks as they are known when the samples come; afterwards, when all
    arrivals are known, a demonstration's are better by up to some milliseconds.

    Parameters
    ----------
    devices : sequence of Device
        Open; the first that does not hold gives the stamps.
    since : callable
        Samples of a device from a number on, such as
        :meth:`~forcelab.capture.recorder.Recorder.since`.

    Attributes
    ----------
    channels : tuple of Channel
        Of the joined samples, as a demonstration of these devices has them.
    rate : float
        Samples a second of the first device, as it was told; 0 where it was not.
    """

    def __init__(
        self,
        devices: Sequence[Device],
        since: Callable[[int, int], Window],
    ) -> None:
        self.channels: tuple[Channel, ...] = channels_of_all([d.channels for d in devices])
        holds = [device.holds for device in devices]
        self._lead = next((i for i, held in enumerate(holds) if not held), 0)
        self.rate = devices[self._lead].rate
        self._since, self._holds = since, holds
        self._times = [np.empty(0) for _ in devices]
        self._values = [np.empty((0, len(device.channels))) for device in devices]
        self._next = [0] * len(devices)
        self._last = -np.inf

    def skip(self, latest: Sequence[Window]) -> None:
        """Leave out what came before.

        Parameters
        ----------
        latest : sequence of (int, ndarray, ndarray)
            The last sample of each device, such as
            :meth:`~forcelab.capture.recorder.Recorder.latest` gives for 0 s.
        """
        # What a device holds, it holds since before.
        self._next = [
            first + len(times) - int(held and len(times) > 0)
            for (first, times, _), held in zip(latest, self._holds, strict=True)
        ]

    def start(self, firsts: Sequence[int]) -> None:
        """Begin with each device's sample of this number."""
        self._next = list(firsts)

    def read(self, ends: Sequence[int | None] | None = None) -> tuple[Real, Real]:
        """The samples that all devices have by now.

        Parameters
        ----------
        ends : sequence of int or None, optional
            The end has come, and no other device is waited for: of each device, the number of the
            first sample that counts no more, such as the recorder's
            :attr:`~forcelab.capture.recorder.Recorder.ends`; None where all count.

        Returns
        -------
        times : ndarray of float64, shape (n,)
            Seconds of the host's monotonic clock, strictly increasing.
        values : ndarray of float64, shape (n, c)
            NaN where a device has no sample near.
        """
        for i, wanted in enumerate(self._next):
            first, times, values = self._since(i, wanted)
            if ends is not None and (end := ends[i]) is not None:
                times, values = times[: max(end - first, 0)], values[: max(end - first, 0)]
            self._next[i] = first + len(times)
            if len(times):
                self._times[i] = np.concatenate([self._times[i], times])
                self._values[i] = np.concatenate([self._values[i], values])
        host = self._times[self._lead]
        n = (
            len(host)
            if ends is not None
            else int(np.searchsorted(host, self._until(), side="right"))
        )
        if not n:
            self._forget(max((t[-1] for t in self._times if len(t)), default=0.0) - SILENT)
            return np.empty(0), np.empty((0, len(self.channels)))
        stamps = self._increasing(host[:n])
        columns = [
            self._values[i][:n] if i == self._lead else self._onto(stamps, i)
            for i in range(len(self._times))
        ]
        self._times[self._lead] = host[n:]
        self._values[self._lead] = self._values[self._lead][n:]
        self._last = float(stamps[-1])
        self._forget(self._last)
        return stamps, np.concatenate(columns, axis=1)

    def _forget(self, until: float) -> None:
        """Drop what the other devices told before a time (s), but for the last of it."""
        for i in range(len(self._times)):
            if i != self._lead:
                place = max(int(np.searchsorted(self._times[i], until)) - KEPT, 0)
                self._times[i] = self._times[i][place:]
                self._values[i] = self._values[i][place:]

    def _until(self) -> float:
        """Host time (s) up to which all devices have told."""
        host = self._times[self._lead]
        if not len(host):
            return -np.inf
        told = [
            float(times[-1]) if len(times) else -np.inf
            for i, times in enumerate(self._times)
            if i != self._lead and not self._holds[i]
        ]
        return max(min(told, default=np.inf), float(host[-1]) - PATIENCE)

    def _increasing(self, host: Real) -> Real:
        """Stamps that go on increasing when the clock that gave them was set back."""
        least = 0.5 / self.rate if self.rate > 0 else 1e-6
        passed = least * np.arange(1, len(host) + 1)
        highest = np.maximum.accumulate(np.concatenate([[self._last], host - passed]))
        return highest[1:] + passed

    def _onto(self, stamps: Real, device: int) -> Real:
        stream = Stream(self._times[device], self._values[device], self._holds[device])
        return onto(stamps, stream)
