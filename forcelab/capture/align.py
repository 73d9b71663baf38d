"""The channels of several devices on the stamps of one of them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS, Channel
from forcelab.errors import InputError
from forcelab.signals.grid import interpolate

_EDGE = 0.25  # s by which devices may begin or end apart and be cut to what they share
_STAMPS_AT_ONCE = 1 << 16  # stamps; more would only take memory
#: Periods apart from which on a sample is missing between neighbours that were stamped evenly.
_MISSING_PERIODS = 1.5
#: Names of force channels, which have a unit or are raw counts, with the number of their sensor.
FORCE_NAME = re.compile(r"([ft][xyz])(\d*)")


@dataclass(frozen=True, eq=False)
class DeviceStream:
    """The samples of one device, on the host's clock."""

    #: When each was taken (s), shape (n,).
    host: NDArray[np.float64]
    #: Shape (n, c).
    values: NDArray[np.float64]
    #: Whether a value holds until the next one.
    holds: bool = False
    #: Whether the stamps come from a clock; else from arrivals, or with the samples.
    even: bool = True
    #: From when to when (s) it was unplugged.
    away: tuple[tuple[float, float], ...] = ()
    #: Whether the first value of one that holds was there before anything was recorded: then it
    #: holds for samples, too, that were on their way when recording began.
    before: bool = False
    #: Missing by the stamps that came with the samples, and how many gaps that are.
    lost: int = 0
    gaps: int = 0
    #: Whether it stayed away the last time until the recording ended.
    gone: bool = False


@dataclass(frozen=True, eq=False)
class AlignedChannels:
    """All channels on the stamps of one device."""

    #: Seconds from the first sample, strictly increasing, shape (n,).
    times: NDArray[np.float64]
    #: The channels of all devices in their order, shape (n, c); NaN where one has no sample near.
    signals: NDArray[np.float64]
    #: Host time (s) of time 0.
    start: float
    #: The device that gives the stamps.
    lead: int
    #: Which of its samples these are: all but those of the moments at the ends in which not all
    #: devices had begun, or some had ended.
    within: slice


def align(streams: Sequence[DeviceStream], names: Sequence[str]) -> AlignedChannels:
    """Bring all channels onto the stamps of the first device that samples evenly, and did."""
    even = [i for i, stream in enumerate(streams) if not stream.holds]
    # One that was silent all the time takes nothing away from the others.
    lead = next((i for i in even if len(streams[i].host) > 1), -1)
    if lead < 0 and not even and streams and len(streams[0].host) > 1:
        lead = 0
    if lead < 0:
        of_device = f" of {names[even[0] if even else 0]}" if names else ""
        raise InputError(
            f"Fewer than two samples{of_device} were recorded; look at its channels live first."
        )
    first = streams[lead]
    host = make_increasing(first.host)
    begin, end = _shared_time(host, [s for s in streams if not s.holds and len(s.host)])
    within = slice(*np.searchsorted(host, [begin, np.nextafter(end, np.inf)]).tolist())
    if within.stop - within.start < 2:
        within = slice(0, len(host))
    host = host[within]
    signals = np.empty((len(host), sum(stream.values.shape[1] for stream in streams)))
    column = 0
    for i, stream in enumerate(streams):
        part = signals[:, column : column + stream.values.shape[1]]
        if i == lead:
            part[:] = stream.values[within]
        else:
            resample(host, stream, part)
        column += part.shape[1]
    start = float(host[0])
    times = host - start
    times.flags.writeable = signals.flags.writeable = False  # so that no copy is needed
    return AlignedChannels(times, signals, start, lead, within)


def make_increasing(
    host: NDArray[np.float64], after: float = -np.inf, rate: float = 0.0
) -> NDArray[np.float64]:
    """Stamps (s) that go on increasing `after` one; two stretches may overlap by a delay.

    Those that would go back follow the one before by half a period, until they have caught up; that
    is the median one where no `rate` (Hz) is configured.
    """
    steps = np.diff(host, prepend=after)
    if (steps > 0).all():
        return host
    if rate > 0:
        least = 0.5 / rate
    else:
        forward = steps[(steps > 0) & np.isfinite(steps)]
        least = 0.5 * float(np.median(forward)) if len(forward) else 1e-6
    passed = least * np.arange(1, len(host) + 1)
    increasing: NDArray[np.float64] = np.maximum.accumulate(np.maximum(host - passed, after))
    return increasing + passed


def _shared_time(host: NDArray[np.float64], streams: Sequence[DeviceStream]) -> tuple[float, float]:
    """The time that all devices share, where they begin and end a moment apart."""
    begins = [float(s.host[0]) for s in streams if abs(s.host[0] - host[0]) < _EDGE]
    ends = [float(s.host[-1]) for s in streams if abs(s.host[-1] - host[-1]) < _EDGE]
    return max(begins, default=-np.inf), min(ends, default=np.inf)


def resample(
    host: NDArray[np.float64], stream: DeviceStream, out: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """A device's channels at other stamps (s, host's clock): NaN where no sample is near.

    Shape (n, c); written into `out` if that is given.
    """
    host_times, values = stream.host, stream.values
    if out is None:
        out = np.empty((len(host), values.shape[1]))
    out[:] = np.nan
    if len(host_times) == 0:
        return out
    host_times = make_increasing(host_times)
    if stream.holds:
        after = np.searchsorted(host_times, host, side="right")
        if stream.before:
            after = np.maximum(after, 1)
        known = after > 0
        out[known] = values[after[known] - 1]
        for gone, back in stream.away:
            # Until it has something to say again, for what it held may have changed unseen.
            times_after = host_times[host_times >= back]
            out[(host >= gone) & (host < (times_after[0] if len(times_after) else np.inf))] = np.nan
        return out
    if len(host_times) == 1:
        return out
    apart = (_MISSING_PERIODS if stream.even else GAP_PERIODS) * float(
        np.median(np.diff(host_times))
    )
    for first in range(0, len(host), _STAMPS_AT_ONCE):
        part = slice(first, first + _STAMPS_AT_ONCE)
        out[part] = interpolate(host[part], host_times, values, longest=apart, beyond=0.0)
    return out


def channels_of_all(devices: Sequence[Sequence[Channel]]) -> tuple[Channel, ...]:
    """The channels of all devices: ``fx1 fy1 fz1 fx2 ...``, others numbered where they clash."""
    forces = [c.name for device in devices for c in device if FORCE_NAME.fullmatch(c.name)]
    clash = len(set(forces)) < len(forces)
    channels: dict[str, Channel] = {}
    sensors = 0
    for device in devices:
        sensors_here = 0
        for channel in device:
            match = FORCE_NAME.fullmatch(channel.name)
            name = channel.name
            if match is not None and (clash or not match[2]):
                number = int(match[2] or 1)
                sensors_here = max(sensors_here, number)
                name = f"{match[1]}{number + (sensors if clash else 0)}"
            base, count = name, 1
            while name in channels:
                count += 1
                name = f"{base} {count}"
            channels[name] = Channel(name, channel.unit)
        sensors += sensors_here
    return tuple(channels.values())
