"""Serial ports and cameras that the system knows of; none is opened."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

__all__ = ["Camera", "SerialPort", "cameras", "serial_ports"]

VIDEO_CLASS = Path("/sys/class/video4linux")


@dataclass(frozen=True, slots=True)
class SerialPort:
    """A serial port.

    Parameters
    ----------
    device : str
        Such as ``/dev/ttyACM0`` or ``COM3``.
    description : str
        What the device says of itself.
    usable : bool
        Whether this user may read and write it.
    """

    device: str
    description: str
    usable: bool


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera, by the device that OpenCV would open.

    Parameters
    ----------
    device, name : str
        Such as ``/dev/video0``, and what the driver calls it.
    usable : bool
        Whether this user may read it.
    """

    device: str
    name: str
    usable: bool


def serial_ports() -> tuple[SerialPort, ...]:
    """All serial ports, sorted by device."""
    from serial.tools import list_ports

    found = sorted(list_ports.comports(), key=lambda port: str(port.device))
    return tuple(
        SerialPort(port.device, port.description or "", os.access(port.device, os.R_OK | os.W_OK))
        for port in found
    )


def cameras(folder: Path = VIDEO_CLASS) -> tuple[Camera, ...]:
    """The video capture devices of a Linux system; empty elsewhere.

    Parameters
    ----------
    folder : Path
        Where the kernel lists them.
    """
    if not folder.is_dir():
        return ()
    return tuple(
        Camera(
            f"/dev/{entry.name}",
            (entry / "name").read_text(errors="replace").strip(),
            os.access(f"/dev/{entry.name}", os.R_OK),
        )
        for entry in sorted(folder.iterdir())
        if (entry / "name").is_file()
    )
