"""A picture of the window, drawn when everything that it shows is loaded."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from PySide6.QtCore import (
    QBuffer,
    QEventLoop,
    QIODevice,
    QMessageLogContext,
    QtMsgType,
    qInstallMessageHandler,
)
from PySide6.QtGui import QPixmap
from PySide6.QtWidgets import QApplication

from forcelab.errors import InputError
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.window import Window
from forcelab.io import write_atomically

#: How long nothing may have changed before the window counts as settled, in seconds.
SETTLE_ROUNDS = 0.25


def settle(window: Window, patience: float) -> None:
    """Wait until the window is complete; InputError after `patience` seconds."""
    deadline = time.monotonic() + patience
    quiet_since = time.monotonic()
    while time.monotonic() - quiet_since < SETTLE_ROUNDS:
        QApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 20)
        if not window.settled:
            quiet_since = time.monotonic()
        if time.monotonic() > deadline:
            raise InputError(f"The window was not complete after {patience:g} s; try once more.")
        time.sleep(0.002)


def quiet_qt() -> None:
    """Drop the message that Qt prints for every window drawn without a display."""

    def print_message(_kind: QtMsgType, _context: QMessageLogContext, text: str) -> None:
        if "propagateSizeHints" not in text:
            print(text, file=sys.stderr)

    qInstallMessageHandler(print_message)


def draw(window: Window, start: LaunchOptions, path: Path, patience: float) -> None:
    """Draw the window into a PNG.

    Raises InputError if what it is to show does not exist, or the file cannot be written.
    """
    try:
        image = _image(window, start, path, patience)
    finally:
        window.close()
    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    image.save(buffer, "PNG")
    write_atomically(path, bytes(buffer.data().data()))


def _image(window: Window, start: LaunchOptions, path: Path, patience: float) -> QPixmap:
    """The window when it is complete."""
    if path.suffix.lower() != ".png":
        raise InputError(f"A screenshot is a .png, not '{path.name}'; change the suffix.")
    errors: list[str] = []

    def collect(message: str, error: bool) -> None:
        if error:
            errors.append(message)

    window.document.message_shown.connect(collect)
    window.resize(*(start.size or (1280, 800)))
    window.show()
    opened = window.begin(start)
    if errors and not opened:  # what else is said, as of a crash, is in the picture
        raise InputError(errors[0])
    settle(window, patience)
    return window.grab()
