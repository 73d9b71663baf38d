"""Unexpected errors: logged with all that helps to mend them, shown once, and the program goes on.

A fault is known by the place where it was raised. The first at a place is shown, unless another is
being shown; all are counted, and the log names the second, fourth, eighth... so that a fault in
something that is drawn fifty times a second fills neither screen nor disk.
"""

from __future__ import annotations

import logging
import os
import platform
import sys
import threading
import traceback
from collections import Counter
from collections.abc import Callable
from logging.handlers import RotatingFileHandler
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from PySide6.QtCore import (
    QMessageLogContext,
    QObject,
    QStandardPaths,
    Qt,
    QtMsgType,
    Signal,
    Slot,
    qInstallMessageHandler,
    qVersion,
)
from PySide6.QtWidgets import QWidget

from forcelab import __version__
from forcelab.errors import ForcelabError

if TYPE_CHECKING:
    from forcelab.gui.fault_dialog import FaultDialog

__all__ = ["Faults", "log_file"]

log = logging.getLogger("forcelab")

#: The log is cut at this many bytes, and so many older pieces are kept.
LARGEST, OLDER = 1_000_000, 3
_LEVELS = {
    QtMsgType.QtDebugMsg: logging.DEBUG,
    QtMsgType.QtInfoMsg: logging.INFO,
    QtMsgType.QtWarningMsg: logging.WARNING,
    QtMsgType.QtCriticalMsg: logging.ERROR,
    QtMsgType.QtFatalMsg: logging.CRITICAL,
}


def log_file() -> Path:
    """Where the log lies: in the platform's folder for state, or beside the named settings."""
    if named := os.environ.get("FORCELAB_SETTINGS"):
        return Path(named).with_name("forcelab.log")
    folder = QStandardPaths.writableLocation(QStandardPaths.StandardLocation.GenericStateLocation)
    return Path(folder) / "forcelab" / "forcelab.log"


class Faults(QObject):
    """Takes over what nobody else catches, in all threads, until the window is gone.

    Parameters
    ----------
    window : QWidget
        Above which a fault is shown, and with which this ends.
    say : callable
        Told the sentence of a :class:`ForcelabError`, which is no fault of the program.

    Attributes
    ----------
    counts : Counter of str
        How often something went wrong at each place.
    """

    _caught = Signal(object)

    def __init__(self, window: QWidget, say: Callable[[str], object]) -> None:
        super().__init__(window)
        self.counts: Counter[str] = Counter()
        self._window = window
        self._say = say
        self._open: FaultDialog | None = None
        self._reporting = threading.local()
        self._lock = threading.Lock()
        handler = _handler(log_file())
        log.addHandler(handler)
        level = log.level
        log.setLevel(logging.INFO)
        self._caught.connect(self._take, Qt.ConnectionType.QueuedConnection)
        self._before = sys.excepthook, threading.excepthook
        sys.excepthook = self._on_error
        threading.excepthook = self._on_thread
        qInstallMessageHandler(self._on_message)
        # Not a method: this object is gone by then, and its methods with it.
        window.destroyed.connect(_undo(self._before, handler, level))

    def _on_error(
        self, kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        """What ``sys.excepthook`` gets: also errors in slots and in Qt's virtual methods."""
        if issubclass(kind, KeyboardInterrupt) or getattr(self._reporting, "busy", False):
            self._before[0](kind, error, trace)
            return
        self._reporting.busy = True
        try:
            self._report(error)
        finally:
            self._reporting.busy = False

    def _on_thread(self, what: threading.ExceptHookArgs) -> None:
        """What ``threading.excepthook`` gets."""
        if what.exc_value is not None and not isinstance(what.exc_value, SystemExit):
            self._on_error(what.exc_type, what.exc_value, what.exc_traceback)

    def _on_message(self, kind: QtMsgType, context: QMessageLogContext, message: str) -> None:
        """What Qt says of itself: for the log only, since no coder can do anything about it."""
        del context  # empty in Qt's release builds
        log.log(_LEVELS.get(kind, logging.WARNING), "Qt: %s", message)

    def _report(self, error: BaseException) -> None:
        """Log an error, in whatever thread it was raised, and have it shown in the GUI's."""
        if isinstance(error, ForcelabError):
            log.warning("%s", error)
            self._caught.emit(error)
            return
        place = _place(error)
        with self._lock:
            self.counts[place] += 1
            count = self.counts[place]
        if count == 1:
            log.error("Unexpected error at %s", place, exc_info=error)
            self._caught.emit(error)
        elif count & (count - 1) == 0:
            log.error("The unexpected error at %s was met %d times.", place, count)

    @Slot(object)
    def _take(self, error: BaseException) -> None:
        """Show one error."""
        from forcelab.gui.fault_dialog import FaultDialog

        if isinstance(error, ForcelabError):
            self._say(str(error))
        elif self._open is not None:
            self._open.add()
        else:
            self._open = FaultDialog(details(error), log_file(), self._window)
            self._open.finished.connect(self._closed)
            self._open.show()

    def _closed(self) -> None:
        """The next fault may be shown."""
        self._open = None


def details(error: BaseException) -> str:
    """What somebody needs who mends it: versions, platform and where it happened."""
    head = (
        f"forcelab {__version__}, Python {platform.python_version()}, Qt {qVersion()}, "
        f"{platform.platform()}\n"
    )
    return head + "".join(traceback.format_exception(error))


def _place(error: BaseException) -> str:
    """Where an error was raised: the innermost line of this program, and the error's type."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if "forcelab" in Path(frame.filename).parts]
    where = [f"{frame.filename}:{frame.lineno}" for frame in own or frames]
    return f"{where[-1] if where else 'an unknown place'} ({type(error).__name__})"


def _handler(path: Path) -> logging.Handler:
    """The log on disk; where there can be none, what is logged goes to the terminal."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        made: logging.Handler = RotatingFileHandler(
            path, maxBytes=LARGEST, backupCount=OLDER, encoding="utf-8"
        )
    except OSError:
        made = logging.StreamHandler()
    made.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(threadName)s %(message)s"))
    return made


def _undo(
    before: tuple[Callable[..., object], Callable[..., object]],
    handler: logging.Handler,
    level: int,
) -> Callable[[], None]:
    """What puts back the hooks and closes the log."""

    def undo() -> None:
        sys.excepthook, threading.excepthook = before
        qInstallMessageHandler(None)
        log.removeHandler(handler)
        log.setLevel(level)
        handler.close()

    return undo
