"""How a recorder, its devices and its cameras do, as values."""

from __future__ import annotations

from dataclasses import dataclass

from forcelab.demonstration import Channel

__all__ = ["CameraState", "DeviceState", "RecorderState"]


@dataclass(frozen=True, slots=True)
class DeviceState:
    """How a device does.

    Parameters
    ----------
    name : str
    channels : tuple of Channel
    plugged : bool
        Whether it is there.
    samples, lost, saturated : int
        Samples that came, were missing by the counter, and were beyond the sensor's range, since
        the recording began; before that, since it was opened.
    rate : float
        Samples a second as measured, in Hz; 0 while not known.
    offset : float
        Host time (s) at which its counter reads zero; NaN where there is no clock.
    clock_rate : float
        Its seconds as told in seconds of the host: 1 + 200e-6 for a clock 200 ppm slow; NaN where
        there is no clock.
    residual : float
        Root mean square distance (s) of the earliest arrivals from the clock.
    alarms : tuple of str
        Of ``unplugged``, ``stalled``, ``saturation``, ``lost samples``, ``drift`` (of its clock)
        and ``zero`` (which wanders).
    wandered : tuple of (Channel, float)
        The channels whose zero wandered, and by how much in their unit.
    """

    name: str
    channels: tuple[Channel, ...]
    plugged: bool
    samples: int
    lost: int
    saturated: int
    rate: float
    offset: float
    clock_rate: float
    residual: float
    alarms: tuple[str, ...]
    wandered: tuple[tuple[Channel, float], ...] = ()


@dataclass(frozen=True, slots=True)
class CameraState:
    """How a camera does.

    Parameters
    ----------
    name : str
    frames, dropped : int
        That came, and that are missing between those, since the recording began; before that,
        since it was opened.
    rate : float
        Frames a second as measured; 0 while not known.
    alarms : tuple of str
        Of ``no picture`` and ``not written``.
    """

    name: str
    frames: int
    dropped: int
    rate: float
    alarms: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RecorderState:
    """How a recorder does.

    Parameters
    ----------
    recording : bool
    name : str
        Of the demonstration that is recorded; empty while none is.
    seconds : float
        Since the recording began; 0 while none is.
    in_memory : int
        Bytes that the disk refuses and that are kept in memory.
    devices : tuple of DeviceState
    cameras : tuple of CameraState
    """

    recording: bool
    name: str
    seconds: float
    in_memory: int
    devices: tuple[DeviceState, ...]
    cameras: tuple[CameraState, ...]

    @property
    def obstacle(self) -> str:
        """Why no recording can begin, in a sentence; empty where one can."""
        if any(device.plugged for device in self.devices):
            return ""
        return "No device is plugged in, so nothing can be recorded; plug one in again."
