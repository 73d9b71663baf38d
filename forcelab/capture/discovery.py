"""What is plugged in: serial devices by their USB identifiers, and cameras; none is opened."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from forcelab.errors import InputError

#: The cure where a device is not there; a window has a button for it.
LIST_HINT = "see 'forcelab capture --list' for what there is"

VIDEO_CLASS = Path("/sys/class/video4linux")
#: Whether this system tells what cameras there are.
LISTS_CAMERAS = sys.platform == "linux"


@dataclass(frozen=True, slots=True)
class FoundCamera:
    """A camera, by the device that OpenCV would open."""

    #: Such as ``/dev/video0``.
    device: str
    #: By its driver.
    name: str
    #: Whether this user may read it.
    usable: bool


def find_cameras(folder: Path = VIDEO_CLASS) -> tuple[FoundCamera, ...]:
    """The video capture devices of a Linux system, sorted by device.

    Empty on other systems, which tell cameras by their number only (:data:`LISTS_CAMERAS`), and
    where the system does not list them, as in some containers.
    """
    try:
        entries = sorted(folder.iterdir())
    except OSError:
        return ()
    named = ((entry.name, _driver_name(entry)) for entry in entries)
    return tuple(
        FoundCamera(f"/dev/{device}", name, os.access(f"/dev/{device}", os.R_OK))
        for device, name in named
        if name is not None
    )


def _driver_name(entry: Path) -> str | None:
    """The driver's name of a device; None where it is none, or was unplugged a moment ago."""
    try:
        return (entry / "name").read_text("utf-8", errors="replace").strip()
    except OSError:
        return None


#: Vendor and product of an OptoForce DAQ's USB port.
USB_ID = (0x04D8, 0x000A)
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
    """A serial port and what seems to be behind it."""

    #: Such as ``/dev/ttyACM0`` or ``COM3``.
    path: str
    #: ``"optoforce"``, ``"text"``, ``"encoder"`` or ``"unknown"``.
    kind: str
    #: What it seems to be, in words.
    description: str
    #: Serial number of its USB interface.
    serial: str | None
    #: Vendor and product; None for a port that is not USB.
    usb: tuple[int, int] | None
    #: Whether this user may read and write it.
    usable: bool

    @property
    def device(self) -> str | None:
        """What ``--device`` takes, such as ``"optoforce:/dev/ttyACM0"``; None if it is unknown."""
        return None if self.kind == "unknown" else f"{self.kind}:{self.path}"


def find_ports() -> tuple[FoundPort, ...]:
    """All serial ports, sorted by path."""
    from serial.tools import list_ports  # what looks for no port does without

    return tuple(sorted((_identify(port) for port in list_ports.comports()), key=lambda p: p.path))


def optoforce_ports() -> tuple[str, ...]:
    """Paths of the ports that may be OptoForce DAQs."""
    return tuple(port.path for port in find_ports() if port.kind == "optoforce")


def only_port(kind: str) -> str:
    """The path of the only device of a kind; InputError if there is none or several."""
    paths = [port.path for port in find_ports() if port.kind == kind]
    if len(paths) == 1:
        return paths[0]
    if paths:
        raise InputError(
            f"There are {len(paths)} devices that may be '{kind}'; say which, such as "
            f"{kind}:{paths[0]} (others: {', '.join(paths[1:])})."
        )
    raise InputError(
        f"No device of kind '{kind}' is plugged in; plug it in, or name its port, such as "
        f"{kind}:/dev/ttyUSB0."
    )


def relocate_port(known: FoundPort, ports: Iterable[FoundPort]) -> str | None:
    """Where a USB device is now: by its serial number, else at its old port; None while away."""
    same = (port for port in ports if port.usb == known.usb)
    if known.serial:
        return next((port.path for port in same if port.serial == known.serial), None)
    return next((port.path for port in same if port.path == known.path), None)


def _identify(port: Any) -> FoundPort:
    """What pyserial says of a port, and what that means."""
    path = str(port.device)
    usb = None if port.vid is None or port.pid is None else (int(port.vid), int(port.pid))
    kind, description = _classify(usb, _port_texts(port))
    return FoundPort(
        path,
        kind,
        description,
        port.serial_number or None,
        usb,
        # Windows keeps ports from nobody, and has no file of one that could be asked.
        sys.platform == "win32" or os.access(path, os.R_OK | os.W_OK),
    )


def _port_texts(port: Any) -> str:
    """The texts of a port; pyserial says 'n/a' where there is none."""
    parts = (port.manufacturer, port.product, port.description)
    texts = list(dict.fromkeys(str(part) for part in parts if part and part != "n/a"))
    return " ".join(texts)


def _classify(usb: tuple[int, int] | None, words: str) -> tuple[str, str]:
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
