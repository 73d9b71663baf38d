"""What is plugged in: serial devices by their USB identifiers, and cameras; none is opened."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from forcelab.capture.optoforce import USB_ID
from forcelab.errors import InputError

#: The cure where a device is not there; a window has a button for it.
LOOK = "see 'forcelab capture --list' for what there is"

VIDEO_CLASS = Path("/sys/class/video4linux")


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


def cameras(folder: Path = VIDEO_CLASS) -> tuple[Camera, ...]:
    """The video capture devices of a Linux system, sorted by device.

    Empty elsewhere, and where the system shows them to nobody, as in some containers.

    Parameters
    ----------
    folder : Path
        Where the kernel lists them.
    """
    try:
        entries = sorted(folder.iterdir())
    except OSError:
        return ()
    named = ((entry.name, _driver_name(entry)) for entry in entries)
    return tuple(
        Camera(f"/dev/{device}", name, os.access(f"/dev/{device}", os.R_OK))
        for device, name in named
        if name is not None
    )


def _driver_name(entry: Path) -> str | None:
    """What the driver calls a device; None where it is none, or was unplugged a moment ago."""
    try:
        return (entry / "name").read_text("utf-8", errors="replace").strip()
    except OSError:
        return None


#: Chips that adapters of every kind have; the encoder's, a QSB, is known by its name.
FTDI = 0x0403
#: Vendors of boards that mostly print text, and of the chips that such boards talk through.
BOARDS = {
    0x2341: "Arduino",
    0x2A03: "Arduino",
    0x1A86: "Arduino or the like (CH340)",
    0x10C4: "Arduino or the like (CP210x)",
    0x16C0: "Teensy",
    0x1B4F: "SparkFun",
    0x239A: "Adafruit",
    0x2E8A: "Raspberry Pi Pico",
    0x303A: "ESP32",
}


@dataclass(frozen=True, slots=True)
class FoundPort:
    """A serial port and what seems to be behind it.

    Parameters
    ----------
    path : str
        Such as ``/dev/ttyACM0`` or ``COM3``.
    kind : str
        ``"optoforce"``, ``"text"``, ``"encoder"`` or ``"unknown"``.
    description : str
        What it seems to be, in words.
    serial : str or None
        The serial number that its USB interface tells.
    usb : tuple of (int, int), or None
        Vendor and product; None for a port that is none of USB.
    usable : bool
        Whether this user may read and write it.
    """

    path: str
    kind: str
    description: str
    serial: str | None
    usb: tuple[int, int] | None
    usable: bool

    @property
    def device(self) -> str | None:
        """What ``--device`` takes, such as ``"optoforce:/dev/ttyACM0"``; None if it is unknown."""
        return None if self.kind == "unknown" else f"{self.kind}:{self.path}"


def find_ports() -> tuple[FoundPort, ...]:
    """All serial ports, sorted by path.

    Raises
    ------
    InputError
        If pyserial is not installed, or does not know this system.
    """
    try:
        from serial.tools import list_ports
    except ImportError as error:
        raise InputError(
            f"Serial ports cannot be listed ({error}); install pyserial with "
            f"'pip install pyserial'."
        ) from error
    return tuple(sorted((_found(port) for port in list_ports.comports()), key=lambda p: p.path))


def optoforce_ports() -> tuple[str, ...]:
    """Paths of the ports that may be OptoForce DAQs."""
    return tuple(port.path for port in find_ports() if port.kind == "optoforce")


def port_of(kind: str) -> str:
    """The path of the only device of a kind.

    Raises
    ------
    InputError
        If there is none or several.
    """
    found = [port.path for port in find_ports() if port.kind == kind]
    if len(found) == 1:
        return found[0]
    if found:
        raise InputError(
            f"There are {len(found)} devices that may be '{kind}'; say which, such as "
            f"{kind}:{found[0]} (others: {', '.join(found[1:])})."
        )
    raise InputError(
        f"No device of kind '{kind}' is plugged in; plug it in, or name its port, such as "
        f"{kind}:/dev/ttyUSB0."
    )


def port_like(known: FoundPort, ports: Iterable[FoundPort]) -> str | None:
    """Where a device is that was seen before: by its USB serial number, else at its old port.

    Returns
    -------
    str or None
        None while it is not there.
    """
    there = list(ports)
    if known.serial:
        same = [port for port in there if (port.usb, port.serial) == (known.usb, known.serial)]
        return same[0].path if same else None
    if known.usb:
        return next((p.path for p in there if (p.path, p.usb) == (known.path, known.usb)), None)
    return known.path if os.path.lexists(known.path) else None


def _found(port: Any) -> FoundPort:
    """What pyserial tells of a port, and what that means."""
    path = str(port.device)
    usb = None if port.vid is None or port.pid is None else (int(port.vid), int(port.pid))
    kind, description = _seems(usb, _words(port))
    return FoundPort(
        path,
        kind,
        description,
        port.serial_number or None,
        usb,
        os.access(path, os.R_OK | os.W_OK),
    )


def _words(port: Any) -> str:
    """What a port says of itself; pyserial says 'n/a' where it says nothing."""
    parts = (port.manufacturer, port.product, port.description)
    kept = list(dict.fromkeys(str(part) for part in parts if part and part != "n/a"))
    return " ".join(kept)


def _seems(usb: tuple[int, int] | None, words: str) -> tuple[str, str]:
    """The kind of a device, and what it is in words."""
    if usb == USB_ID:
        # An example number of its processor's maker: only asking for a serial number tells.
        return "optoforce", "OptoForce DAQ (or a device with the same USB number)"
    if "QSB" in words or "US Digital" in words:
        return "encoder", "US Digital QSB, quadrature encoder"
    if usb is not None and usb[0] in BOARDS:
        return "text", BOARDS[usb[0]]
    if usb is not None and usb[0] == FTDI:
        return "text", "Serial adapter (FTDI)"
    return "unknown", words or "Serial port"
