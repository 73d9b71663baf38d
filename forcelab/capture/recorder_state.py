"""How a recorder does, as one value."""

from __future__ import annotations

from dataclasses import dataclass

from forcelab.capture.camera import CameraState
from forcelab.capture.reader import DeviceState

__all__ = ["RecorderState"]


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
