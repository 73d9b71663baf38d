"""Closing the window when the system or Ctrl+C asks for it."""

from __future__ import annotations

import logging
import os
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from types import FrameType
from typing import TYPE_CHECKING

import shiboken6
from PySide6.QtCore import QSocketNotifier, QThread, QTimer
from PySide6.QtWidgets import QApplication, QWidget

if TYPE_CHECKING:
    from forcelab.gui.window import Window

__all__ = ["quit_on_signals", "shut_down"]

#: What asks a program to end; Windows has no SIGHUP.
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
#: Milliseconds after which a signal that came before the event loop is looked at again.
POLL_MS = 20
#: Seconds that the process waits, without a window, for threads that have not ended with it.
TIMEOUT = 5.0


@contextmanager
def quit_on_signals(application: QApplication) -> Iterator[list[QWidget]]:
    """Within the block, signals close the yielded windows; the program exits with 128 + number.

    An exception, as Python would raise, is of no use in an event loop: Qt prints it and goes on.
    While a window is built it is worse: raised in a method that Qt calls, it leaves Qt without what
    that should have returned, and the program crashes. So the block begins before that, and a
    signal that comes too early waits for the event loop. The application's event loop ends, and
    that of any dialog.
    """
    windows: list[QWidget] = []

    def leave(number: int) -> None:
        if QThread.currentThread().loopLevel() == 0:
            QTimer.singleShot(POLL_MS, partial(leave, number))
            return
        for window in windows:
            window.close()
        application.exit(128 + number)

    def request_leave(number: int, _: FrameType | None) -> None:
        # Python hears of it wherever it happens to be; the window is closed from the event loop.
        QTimer.singleShot(0, partial(leave, number))

    known = [getattr(signal, name) for name in SIGNALS if hasattr(signal, name)]
    # One that is ignored already stays so: that is how nohup keeps a program alive.
    before = {number: signal.getsignal(number) for number in known}
    handled = {number: was for number, was in before.items() if was is not signal.SIG_IGN}
    for number in handled:
        signal.signal(number, request_leave)
    try:
        with _on_wakeup():
            yield windows
    finally:
        for number, was in handled.items():
            signal.signal(number, was)


def shut_down(window: Window, status: int) -> int:
    """Delete a closed window before the interpreter goes; returns the exit status.

    Left to the interpreter's end, its parts go in no particular order, when half of what they call
    is gone already. A thread that is still at work then, deep in a library, would crash: with one
    that does not end in time the process ends at once. All labels are stored, and the layout is.
    """
    if not window.at_rest(TIMEOUT):
        logging.shutdown()
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:  # as where there is no console
                stream.flush()
        os._exit(status)
    shiboken6.delete(window)
    return status


@contextmanager
def _on_wakeup() -> Iterator[None]:
    """Within the block, a signal wakes the event loop.

    Python only handles signals while it runs, and in a window where nothing moves that is when
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
