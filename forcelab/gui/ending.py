"""Ending the window in good order when the system or Ctrl+C in its terminal asks for it."""

from __future__ import annotations

import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from types import FrameType

from PySide6.QtCore import QSocketNotifier, QTimer
from PySide6.QtWidgets import QApplication, QWidget

__all__ = ["ended_by_signals"]

#: What asks a program to end; Windows has no SIGHUP.
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")


@contextmanager
def ended_by_signals(window: QWidget, application: QApplication) -> Iterator[None]:
    """Within the block, signals to end close the window; the program gives 128 + their number.

    An exception, as Python would raise, is of no use in an event loop: Qt prints it and goes on.

    Parameters
    ----------
    window : QWidget
        Is closed, as by its own button.
    application : QApplication
        Its event loop ends, and that of any dialog.
    """

    def leave(number: int) -> None:
        window.close()
        application.exit(128 + number)

    def hear(number: int, _: FrameType | None) -> None:
        # Python hears of it wherever it happens to be; the window is closed from the event loop.
        QTimer.singleShot(0, partial(leave, number))

    known = [getattr(signal, name) for name in SIGNALS if hasattr(signal, name)]
    # One that is ignored already stays so: that is how nohup keeps a program alive.
    before = {number: signal.getsignal(number) for number in known}
    heard = {number: was for number, was in before.items() if was is not signal.SIG_IGN}
    for number in heard:
        signal.signal(number, hear)
    try:
        with _woken():
            yield
    finally:
        for number, was in heard.items():
            signal.signal(number, was)


@contextmanager
def _woken() -> Iterator[None]:
    """Within the block, a signal wakes the event loop.

    Python only hears of signals while it runs, and in a window where nothing moves that is when
    somebody next touches it.
    """
    ours, pythons = socket.socketpair()
    with ours, pythons:
        ours.setblocking(False)
        pythons.setblocking(False)
        notifier = QSocketNotifier(ours.fileno(), QSocketNotifier.Type.Read)
        notifier.activated.connect(lambda: ours.recv(4096))
        before = signal.set_wakeup_fd(pythons.fileno(), warn_on_full_buffer=False)
        try:
            yield
        finally:
            signal.set_wakeup_fd(before)
            notifier.setEnabled(False)
