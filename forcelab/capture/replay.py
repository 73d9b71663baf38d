"""A recording played in real time: by emulated devices at ports, or as a device of its own."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.device import Block, Closable, Device, SoftwareZero, UnpluggedError
from forcelab.capture.emulator import BURST, VirtualOptoForce, VirtualTextDevice
from forcelab.demonstration import GAP_PERIODS, Demonstration
from forcelab.errors import InputError
from forcelab.formats.calibration import Calibrations
from forcelab.formats.optoforce_packets import KINDS
from forcelab.project import Project
from forcelab.signals.channels import channel_map

#: Counts that a packet can hold.
LARGEST = 32_767
#: Counts that tell a sample beyond them from one within.
FARTHEST = 10 * LARGEST


@dataclass(frozen=True)
class Sensor:
    """A 3-axis sensor of a recording, as a DAQ would read it."""

    #: Of its x, y and z.
    names: tuple[str, ...]
    #: Of the DAQ that plays it.
    serial: str
    #: What that reads, shape (n, 3).
    counts: NDArray[np.int64]
    #: Where the recording has no reading, shape (n,).
    missing: NDArray[np.bool_]
    #: Samples beyond what the sensor can read.
    clipped: int


@dataclass(frozen=True)
class Board:
    """All channels of a recording, as a microcontroller would print them."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    #: Shape (n, c); NaN where the recording has no reading.
    values: NDArray[np.float64]

    @property
    def header(self) -> tuple[str, ...]:
        """The names above its columns, with units."""
        both = zip(self.names, self.units, strict=True)
        return tuple(f"{name} [{unit}]" if unit else name for name, unit in both)


def extract_board(demonstration: Demonstration) -> Board:
    channels = demonstration.channels
    names, units = tuple(c.name for c in channels), tuple(c.unit for c in channels)
    return Board(names, units, np.asarray(demonstration.signals))


def extract_sensors(demonstration: Demonstration, calibrations: Calibrations) -> tuple[Sensor, ...]:
    """The 3-axis sensors of a recording with channels such as ``fx1 fy1 fz1`` (N), in counts.

    The calibrations are those of the DAQs ``SIM00001``, ``SIM00002``, ..., or of any. InputError if
    there is no such sensor, or no calibration for it.
    """
    columns = channel_map(demonstration.channels)
    tangential = [places for places in columns.columns if len(places) == 2]
    if not tangential:
        names = ", ".join(channel.name for channel in demonstration.channels)
        raise InputError(
            f"Demonstration '{demonstration.name}' has no 3-axis force sensor that an OptoForce "
            f"could be; its channels are {names}, and fx1, fy1 and fz1 are needed."
        )
    normal = columns.columns[len(tangential) : 2 * len(tangential)]
    sensors = []
    for number, (tangential_places, normal_place) in enumerate(
        zip(tangential, normal, strict=True), start=1
    ):
        recorded = [columns.recorded[place] for place in (*tangential_places, *normal_place)]
        serial = f"SIM{number:05}"
        calibration = calibrations.find(serial, KINDS[0])
        newtons = np.asarray(demonstration.signals[:, recorded])
        missing: NDArray[np.bool_] = np.logical_not(np.isfinite(newtons).all(axis=1))
        newtons_per_count = np.where(newtons < 0, calibration.negative, calibration.positive)
        readings = np.round(np.where(missing[:, None], 0.0, newtons) / newtons_per_count)
        # What is far beyond all that can be read has no whole number to be cut off.
        counts = np.clip(readings, -FARTHEST, FARTHEST).astype(np.int64)
        clipped = int((np.abs(counts) > LARGEST).any(axis=1).sum())
        sensor_names = tuple(demonstration.channels[column].name for column in recorded)
        sensors.append(Sensor(sensor_names, serial, counts, missing, clipped))
    return tuple(sensors)


class _SampleFinder:
    """Finds the samples of a recording by seconds from its start."""

    def __init__(self, demonstration: Demonstration) -> None:
        self._times = np.asarray(demonstration.times) - demonstration.start
        self._farthest = 0.5 * GAP_PERIODS * demonstration.period

    def find(self, seconds: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """The samples nearest to these moments, and which moments lie in no gap."""
        after = np.clip(np.searchsorted(self._times, seconds), 1, len(self._times) - 1)
        nearer = seconds - self._times[after - 1] <= self._times[after] - seconds
        nearest = after - nearer
        return nearest, np.abs(seconds - self._times[nearest]) <= self._farthest


class Replay(Closable):
    """Virtual devices that play the parts of a recording together, a device each.

    Each gives its first sample over and over until all ports are opened and `lead` seconds have
    passed since then; all begin at the same moment. `speed` is in recorded seconds a second.
    """

    def __init__(
        self,
        demonstration: Demonstration,
        parts: Sequence[Sensor | Board],
        *,
        speed: float = 1.0,
        lead: float = 1.0,
    ) -> None:
        if not (0 < speed < np.inf and 0 <= lead < np.inf):
            raise InputError(
                f"Replaying needs a speed above 0 and a lead of 0 s or more, not {speed:g} and "
                f"{lead:g} s."
            )
        self.parts = tuple(parts)
        #: Seconds that playing takes.
        self.seconds = demonstration.duration / speed
        self._speed, self._lead = speed, lead
        self._finder = _SampleFinder(demonstration)
        self._start: float | None = None
        self._folder: Path | None = None
        rate = demonstration.rate * speed
        self.devices = [
            self._create_device(number, part, rate) for number, part in enumerate(self.parts)
        ]

    @property
    def ports(self) -> tuple[str, ...]:
        """Their names, once it was opened."""
        return tuple(device.port for device in self.devices)

    def open(self) -> None:
        """Switch all on, each at a port of its own."""
        self._folder = Path(tempfile.mkdtemp(prefix="forcelab-replay-"))
        try:
            for device in self.devices:
                device.path = self._folder / device.path.name
                device.open()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Switch all off; closing twice is fine."""
        for device in self.devices:
            device.close()
        if self._folder is not None:
            with suppress(OSError):
                self._folder.rmdir()

    @property
    def begun(self) -> bool:
        """Whether all ports have been opened."""
        return self._start is not None

    def ended(self, timeout: float) -> bool:
        """Whether all has been played, after waiting for at most so many seconds.

        It also lets the playing begin; call it again and again.
        """
        until = time.monotonic() + timeout
        opened = [device.begun for device in self.devices]
        if self._start is None and None not in opened:
            self._start = time.monotonic() + self._lead
            for device, begun in zip(self.devices, opened, strict=True):
                device.duration = self._start - (begun or 0.0) + self.seconds
        return all(device.ended.wait(max(until - time.monotonic(), 0.0)) for device in self.devices)

    def _recording_time(self, number: int, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Seconds of the recording at seconds of a device; 0 before it begins."""
        begun = self.devices[number].begun
        if self._start is None or begun is None:
            return np.zeros(len(times))
        return np.maximum(times - (self._start - begun), 0.0) * self._speed

    def _create_device(
        self, number: int, part: Sensor | Board, rate: float
    ) -> VirtualOptoForce | VirtualTextDevice:
        """The device that plays a part."""

        def now(times: NDArray[np.float64]) -> NDArray[np.int64]:
            return self._finder.find(self._recording_time(number, times))[0]

        def absent(times: NDArray[np.float64]) -> NDArray[np.bool_]:
            nearest, present = self._finder.find(self._recording_time(number, times))
            return ~present if isinstance(part, Board) else part.missing[nearest] | ~present

        if isinstance(part, Board):
            values, path = part.values, Path(f"ttyUSB{number}")
            return VirtualTextDevice(
                lambda times: values[now(times)], rate, path, absent, part.header
            )
        counts, path = part.counts, Path(f"ttyACM{number}")
        return VirtualOptoForce(lambda times: counts[now(times)], rate, path, absent, part.serial)


class RecordedDevice(Device):
    """A demonstration that is read in real time, over its own clock, as a device is.

    It gives the channels, units and rate of the recording, and gaps where that has them. At its end
    it begins again, or is gone like a device that was unplugged.
    """

    def __init__(self, project: Path | str, demonstration: str, *, loop: bool = True) -> None:
        """The one with this name or id in a project; it is loaded when the device is opened."""
        super().__init__()
        self._project, self._demonstration, self._loop = Path(project), demonstration, loop
        self._name_demonstration(demonstration)
        self._begun = 0.0  # by the host's monotonic clock
        self._played = 0  # samples, those in gaps included

    def _name_demonstration(self, title: str) -> None:
        self._title, self.name = title, f"replay:{self._project.name}/{title}"

    def open(self) -> None:
        """Load the recording and play it from its start."""
        with Project.open(self._project) as project:
            recording = project.demonstrations.load(self._demonstration)
        self._name_demonstration(recording.name)
        self._signals, self._finder = np.asarray(recording.signals), _SampleFinder(recording)
        self.channels, self.rate = recording.channels, 1.0 / recording.period
        self._length = round(recording.duration * self.rate)
        self._zero = SoftwareZero()
        self._begun, self._played = time.monotonic(), 0

    def reopen(self) -> None:
        raise UnpluggedError(f"'{self._title}' has ended.")

    def read(self, timeout: float) -> Block | None:
        """The samples that are due by now; they come in bursts, as those of other devices."""
        due_in = self._begun + self._played / self.rate - time.monotonic()
        time.sleep(min(max(due_in, BURST), timeout))
        arrived = time.monotonic()
        due = int((arrived - self._begun) * self.rate) + 1
        if not self._loop:
            if self._played >= self._length:
                raise UnpluggedError(
                    f"'{self._title}' has been played to its end; connect again to play "
                    f"it once more."
                )
            due = min(due, self._length)
        ticks = np.arange(self._played, due)
        self._played = max(due, self._played)
        nearest, present = self._finder.find(ticks % self._length / self.rate)
        ticks, values = ticks[present], self._signals[nearest[present]]
        if not len(ticks):
            return None
        return Block(np.full(len(ticks), arrived), ticks, self._zero.apply(values))

    def close(self) -> None:
        """There is nothing to release."""
