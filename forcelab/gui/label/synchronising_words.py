"""Times and clocks in words, where video and force are synchronised."""

from __future__ import annotations

from PySide6.QtCore import QCoreApplication

from forcelab.clock import ClockMap
from forcelab.gui.figures.text import signed

__all__ = ["seconds", "told"]


def seconds(time: float | None) -> str:
    """A time of the table; a dash where it is still to be marked."""
    return "–" if time is None else signed(f"{time:.3f}")


def told(clock: ClockMap) -> str:
    """A clock for people."""
    words = QCoreApplication.translate("forcelab", "offset {0} s, rate {1} ppm")
    return words.format(signed(f"{clock.offset:+.4f}"), signed(f"{1e6 * (clock.rate - 1):+.1f}"))
