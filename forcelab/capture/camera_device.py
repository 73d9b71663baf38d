"""A camera that OpenCV reads, and how it is found again after it was unplugged."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.ports import LOOK
from forcelab.errors import InputError

__all__ = ["Camera", "Capture", "check_camera", "open_camera", "open_cameras"]

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
                f"{LOOK}."
            )

    def reopen(self) -> bool:
        """Connect anew, by its own name where it has one; gives whether it is there."""
        from forcelab.video.codecs import opencv

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


def check_camera(which: str) -> None:
    """Refuse words that mean no camera, whichever is plugged in.

    Raises
    ------
    InputError
        Unless they are a number, a path, or an address on the network such as
        ``"rtsp://10.0.0.5/stream"``.
    """
    plain = which.isascii() and which.isdigit()
    if not plain and not which.startswith("/") and "://" not in which:
        raise InputError(
            f"'{which}' is no camera; write its number, such as 0, or its device, such as "
            f"/dev/video0."
        )


def open_camera(which: str) -> Capture:
    """Open a camera; see :class:`Camera`."""
    check_camera(which)
    return Camera(which)


def open_cameras(wanted: Sequence[str]) -> list[tuple[str, Capture]]:
    """Open cameras, as a :class:`~forcelab.capture.recorder.Recorder` takes them.

    Parameters
    ----------
    wanted : sequence of str
        As of :func:`open_camera`.

    Returns
    -------
    list of (str, Capture)
        Their names and they themselves.

    Raises
    ------
    InputError
        If one cannot be opened, or is named twice; none is open then.
    """
    opened: list[tuple[str, Capture]] = []
    try:
        for which in wanted:
            name = f"camera {which}"
            if any(name == other for other, _ in opened):
                raise InputError(f"The {name} is named twice; name it once.")
            opened.append((name, open_camera(which)))
    except BaseException:  # whatever that is: those before it are let go of
        for _, capture in opened:
            capture.release()
        raise
    return opened


def _lasting(which: str, links: Path = _LINKS) -> Path | None:
    """The name of a camera that does not change when it is plugged in again, where there is one."""
    device = Path(f"/dev/video{which}" if which.isdigit() else which)
    if not links.is_dir():
        return None
    # A camera may have several, the pictures first.
    return next((link for link in sorted(links.iterdir()) if link.resolve() == device), None)
