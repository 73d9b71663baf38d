"""Where measurements take place: the real window on made-up data, and a clock for what it paints.

By default nothing is seen of it: the window is painted into memory. With ``QT_QPA_PLATFORM`` set,
such as to ``xcb``, it is shown on that display.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from PySide6.QtCore import QEvent, QEventLoop, QObject, Qt, QTimer
from PySide6.QtWidgets import QApplication, QWidget

from forcelab.errors import InputError
from forcelab.gui import theme
from forcelab.gui.label.overview import Overview
from forcelab.gui.memory import tidy_between_demonstrations
from forcelab.gui.panel import TimePanel
from forcelab.gui.picture import without_chatter
from forcelab.gui.platform import require_qt
from forcelab.gui.window import Window

__all__ = ["AUTHOR", "SIZE", "Lateness", "Painted", "shown", "stage", "time_panels", "until"]

#: The coder of all measurements, and the size of the window in pixels.
AUTHOR = "Measured"
SIZE = (1920, 1080)
#: Seconds that anything, and one paint, may take before a measurement is given up.
PATIENCE = 120.0
PAINT_PATIENCE = 30.0
#: Milliseconds between two ticks of the timer whose lateness is measured.
TICK_MS = 5
#: How long nothing may have changed before the window counts as settled, in seconds.
STILL = 0.1


@contextmanager
def stage() -> Iterator[Path]:
    """An application, settings of its own, and a folder for data; all gone afterwards.

    Yields
    ------
    Path
        The folder.
    """
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    require_qt()
    running = QApplication.instance()
    application = running if isinstance(running, QApplication) else QApplication(["forcelab"])
    without_chatter()
    theme.apply(application, "light")
    before = os.environ.get("FORCELAB_SETTINGS")
    # A waiting event loop has to wake up to see that something took too long.
    wake = QTimer()
    wake.start(250)
    with tempfile.TemporaryDirectory(prefix="forcelab-measure-") as folder:
        os.environ["FORCELAB_SETTINGS"] = str(Path(folder) / "settings.ini")
        try:
            yield Path(folder)
        finally:
            wake.stop()
            if before is None:
                del os.environ["FORCELAB_SETTINGS"]
            else:
                os.environ["FORCELAB_SETTINGS"] = before


@contextmanager
def shown(project: Path | None = None, size: tuple[int, int] = SIZE) -> Iterator[Window]:
    """The real window, with a project and its first demonstration open.

    Parameters
    ----------
    project : Path, optional
    size : tuple of int
        In pixels.

    Yields
    ------
    Window
        Everything in it is there.
    """
    window = Window(AUTHOR, remembering=False)
    tidy_between_demonstrations(window.document)
    window.resize(*size)
    window.show()
    window.activateWindow()
    try:
        if project is not None and not window.opening.open(project):
            raise InputError(f"The project made for the measurement, '{project}', did not open.")
        settle(window)
        yield window
    finally:
        window.close()
        window.deleteLater()
        QApplication.processEvents()


def until(holds: Callable[[], bool], patience: float = PATIENCE) -> None:
    """Run the event loop, as the program does, until something holds.

    Raises
    ------
    InputError
        If that takes longer than `patience`, in seconds.
    """
    deadline = time.monotonic() + patience
    while not holds():
        if time.monotonic() > deadline:
            raise InputError(
                f"The window was not done after {patience:g} s; measure on a quieter machine."
            )
        # To wait inside Qt, and not in Python, leaves the interpreter to the window's threads.
        QApplication.processEvents(QEventLoop.ProcessEventsFlag.WaitForMoreEvents)


def rest(seconds: float) -> None:
    """Run the event loop for some time."""
    timer = QTimer()
    timer.setTimerType(Qt.TimerType.PreciseTimer)
    timer.setSingleShot(True)
    timer.start(round(1000 * seconds))
    until(lambda: not timer.isActive())


def settle(window: Window, still: float = STILL) -> None:
    """Run the event loop until everything that was asked for is on the screen, and stays so."""
    quiet_since = time.monotonic()

    def calm() -> bool:
        nonlocal quiet_since
        if not window.settled:
            quiet_since = time.monotonic()
        return time.monotonic() - quiet_since >= still

    tick = QTimer()
    tick.start(10)
    until(calm)
    tick.stop()


def time_panels(window: Window) -> list[QWidget]:
    """All that the window shows on the time axis, and the overview."""
    inside = window.findChildren(QWidget)
    return [w for w in inside if isinstance(w, TimePanel | Overview) and w.isVisible()]


class Painted(QObject):
    """Measures from an act to the end of the paint that shows it.

    Parameters
    ----------
    widgets : sequence of QWidget
        All of them have to be painted anew.
    """

    def __init__(self, widgets: Sequence[QWidget]) -> None:
        super().__init__()
        self._widgets = tuple(widgets)
        self._left: set[QWidget] = set()
        for widget in self._widgets:
            widget.installEventFilter(self)

    def __enter__(self) -> Painted:
        return self

    def __exit__(self, *_: object) -> None:
        for widget in self._widgets:
            widget.removeEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Hear that a widget is being painted; Qt paints all that is stale in one go."""
        if event.type() == QEvent.Type.Paint and isinstance(watched, QWidget):
            self._left.discard(watched)
        return False

    def seconds(self, act: Callable[[], object], also: Callable[[], bool] | None = None) -> float:
        """How long it takes from `act` until all is painted, and `also` holds, in seconds."""
        self._left = set(self._widgets)
        begin = time.perf_counter()
        act()
        until(lambda: not self._left and (also is None or also()), PAINT_PATIENCE)
        return time.perf_counter() - begin


class Lateness:
    """How late the event loop comes to a timer that is due every few milliseconds.

    Attributes
    ----------
    samples : list of float
        Seconds that each tick came later than it was due.
    """

    def __init__(self) -> None:
        self.samples: list[float] = []
        self._last = 0.0
        self._timer = QTimer()
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.setInterval(TICK_MS)
        self._timer.timeout.connect(self._tick)

    def __enter__(self) -> Lateness:
        self._last = time.perf_counter()
        self._timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.stop()

    def _tick(self) -> None:
        now = time.perf_counter()
        self.samples.append(max(0.0, now - self._last - TICK_MS / 1000))
        self._last = now
