"""Whether an open device gives the raw counts of a DAQ, and what is said of that."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from forcelab.demonstration import Channel

__all__ = ["counting", "uncalibrated"]


class _Told(Protocol):
    """What is known of a device."""

    @property
    def name(self) -> str:
        """What it is called."""

    @property
    def channels(self) -> Sequence[Channel]:
        """What it gives."""


def counting(device: _Told) -> bool:
    """Whether a device that is open gives the raw counts of an OptoForce DAQ."""
    called = device.name.startswith("optoforce:")
    return called and any(not channel.unit for channel in device.channels)


def uncalibrated(name: str, cure: str = "give ?calibration=FILE") -> str:
    """What is said of a device that gives raw counts, before it is recorded, and what to do."""
    return (
        f"{name} is not calibrated: its forces are recorded as raw counts, which do not compare "
        f"with newtons; {cure}."
    )
