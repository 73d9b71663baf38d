"""Cameras that the system knows of; none is opened."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

__all__ = ["LOOK", "Camera", "cameras"]

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
