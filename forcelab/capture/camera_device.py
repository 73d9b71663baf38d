"""A camera that OpenCV reads, and how it is found again after it was unplugged."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError

__all__ = ["Camera", "Capture", "open_camera"]

_LINKS = Path("/dev/v4l/by-id")  # names that stay with a camera whatever number it gets (udev)


class Capture(Protocol):
    """What OpenCV's capture objects do."""

    def read(self) -> tuple[bool, NDArray[np.uint8] | None]:
        """Wait for the next frame: whether there is one, and its picture (blue, green, red)."""

    def get(self, what: int, /) -> float:
        """A property."""

    def release(self) -> None:
        """Let go of the camera."""


class Camera:
    """A camera as of :class:`Capture`, that can be opened again.

    Parameters
    ----------
    which : str
        Its number, such as ``"0"``, or its device, such as ``"/dev/video0"``.

    Raises
    ------
    InputError
        If it cannot be opened.
    """

    def __init__(self, which: str) -> None:
        self.which = which
        self._lasting = _lasting(which)
        self._capture: Any = None
        if not self.reopen():
            raise InputError(
                f"The camera {which} cannot be opened; plug it in, close what else uses it, and "
                f"see 'forcelab capture --list' for what there is."
            )

    def reopen(self) -> bool:
        """Connect anew, by its own name where it has one; gives whether it is there."""
        from forcelab.video.opencv import opencv

        self.release()
        which = self.which
        if self._lasting is not None:
            if not self._lasting.exists():
                return False
            which = str(self._lasting.resolve())
        number = which.removeprefix("/dev/video")
        capture = opencv().VideoCapture(int(number) if number.isdigit() else which)
        if not capture.isOpened():
            return False
        self._capture = capture
        return True

    def read(self) -> tuple[bool, NDArray[np.uint8] | None]:
        """The next frame; see :class:`Capture`."""
        if self._capture is None:
            return False, None
        found: tuple[bool, NDArray[np.uint8] | None] = self._capture.read()
        return found

    def get(self, what: int, /) -> float:
        """A property by OpenCV's number."""
        return float(self._capture.get(what)) if self._capture is not None else 0.0

    def release(self) -> None:
        """Let go of it."""
        if self._capture is not None:
            self._capture.release()
            self._capture = None


def open_camera(which: str) -> Capture:
    """Open a camera; see :class:`Camera`."""
    return Camera(which)


def _lasting(which: str, links: Path = _LINKS) -> Path | None:
    """The name of a camera that does not change when it is plugged in again, where there is one."""
    device = Path(f"/dev/video{which}" if which.isdigit() else which)
    if not links.is_dir():
        return None
    # A camera may have several, the pictures first.
    return next((link for link in sorted(links.iterdir()) if link.resolve() == device), None)
