"""Signals that ask a command to stop: Ctrl+C, the system's, a closed terminal."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

#: What else ends a program besides Ctrl+C. Windows has no SIGHUP; there it is SIGBREAK when the
#: console is closed.
SIGNALS = [
    getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)
]


class Interrupted(KeyboardInterrupt):
    """A signal asked to stop; everything is cleaned up as after Ctrl+C."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


@contextmanager
def interruptible() -> Iterator[None]:
    """Within the block, signals to end raise `Interrupted` once: cleaning up is not interrupted."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, _: FrameType | None) -> None:
        signal.signal(number, signal.SIG_IGN)
        raise Interrupted(number)

    # One that is ignored already stays so: that is how nohup keeps a program alive.
    handled = [number for number in SIGNALS if signal.getsignal(number) is signal.SIG_DFL]
    for number in handled:
        signal.signal(number, stop)
    try:
        yield
    finally:
        for number in handled:
            signal.signal(number, signal.SIG_DFL)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Within the block Ctrl+C waits, so that nothing is left half done."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, *SIGNALS)}
    waiting = [number for number, handler in before.items() if callable(handler)]
    for number in waiting:
        signal.signal(number, lambda number, _: received.append(number))
    try:
        yield
    finally:
        for number in waiting:
            signal.signal(number, before[number])
    for number in received[:1]:
        signal.raise_signal(number)
