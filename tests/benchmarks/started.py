"""One start of the window, timed by the process that starts it.

Run as ``python -m tests.benchmarks.started [PROJECT]``; it prints them in seconds of the
machine's monotonic clock, which is the same for all processes, and ends. Only the reading
of the command line is left out.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from PySide6.QtCore import QTimer
from PySide6.QtGui import QPaintEvent

from forcelab.gui import app
from forcelab.gui.launch_options import LaunchOptions

__all__: list[str] = []


class _Told(app.Window):
    """A window that tells when it was first painted, and closes once it is complete."""

    def paintEvent(self, event: QPaintEvent) -> None:
        """Everything in the window is painted with it, before the event loop goes on."""
        super().paintEvent(event)
        if not hasattr(self, "_watch"):
            self._watch = QTimer(self)
            self._watch.timeout.connect(self._print_when_settled)
            QTimer.singleShot(0, self._painted)

    def _painted(self) -> None:
        print(time.monotonic(), flush=True)
        self._watch.start(10)

    def _print_when_settled(self) -> None:
        if self.settled:
            self._watch.stop()
            print(time.monotonic(), flush=True)
            self.close()


if __name__ == "__main__":
    app.Window = _Told  # type: ignore[misc]
    sys.exit(app.run(LaunchOptions(project=Path(sys.argv[1]) if len(sys.argv) > 1 else None)))
