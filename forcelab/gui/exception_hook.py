"""Unexpected errors: logged in full and shown once, while the program goes on.

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
from PySide6.QtGui import QFontDatabase
from PySide6.QtWidgets import (
    QDialog,
    QHBoxLayout,
    QLabel,
    QPlainTextEdit,
    QPushButton,
    QSizePolicy,
    QStyle,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui.layout import copy_button, emphasise, fill_layout, push_button, sentence_label
from forcelab.version import full_version

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


class ExceptionHook(QObject):
    """Reports uncaught exceptions of all threads, for as long as the window lives.

    `say` gets the sentence of a :class:`ForcelabError`, which is no fault of the program; `counts`
    holds how often each place failed.
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
        before = self._before

        def uninstall() -> None:
            """Restore the hooks and close the log."""
            sys.excepthook, threading.excepthook = before
            qInstallMessageHandler(None)
            log.removeHandler(handler)
            log.setLevel(level)
            handler.close()

        # Not a method: this object is gone by then, and its methods with it.
        window.destroyed.connect(uninstall)

    def _on_error(
        self, kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        """The ``sys.excepthook``; it also gets errors in slots and in Qt's virtual methods."""
        if issubclass(kind, KeyboardInterrupt) or getattr(self._reporting, "busy", False):
            self._before[0](kind, error, trace)
            return
        self._reporting.busy = True
        try:
            self._report(error)
        finally:
            self._reporting.busy = False

    def _on_thread(self, arguments: threading.ExceptHookArgs) -> None:
        """The ``threading.excepthook``."""
        if arguments.exc_value is not None and not isinstance(arguments.exc_value, SystemExit):
            self._on_error(arguments.exc_type, arguments.exc_value, arguments.exc_traceback)

    def _on_message(self, kind: QtMsgType, context: QMessageLogContext, message: str) -> None:
        """Log Qt's messages; the coder could do nothing about them."""
        del context  # empty in Qt's release builds
        log.log(_LEVELS.get(kind, logging.WARNING), "Qt: %s", message)

    def _report(self, error: BaseException) -> None:
        """Log an error in the thread that raised it, and show it in the GUI's thread."""
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
        if isinstance(error, ForcelabError):
            self._say(str(error))
        elif self._open is not None:
            self._open.add()
        else:
            self._open = FaultDialog(error_report(error), log_file(), self._window)
            self._open.finished.connect(self._closed)
            self._open.show()

    def _closed(self) -> None:
        """Let the next fault be shown."""
        self._open = None


def error_report(error: BaseException) -> str:
    """Versions, platform and traceback, for whoever mends it."""
    head = (
        f"forcelab {full_version()}, Python {platform.python_version()}, Qt {qVersion()}, "
        f"{platform.platform()}\n"
    )
    return head + "".join(traceback.format_exception(error))


def _place(error: BaseException) -> str:
    """The innermost line of this program in the traceback, and the error's type."""
    frames = traceback.extract_tb(error.__traceback__)
    own_frames = [frame for frame in frames if "forcelab" in Path(frame.filename).parts]
    where = [f"{frame.filename}:{frame.lineno}" for frame in own_frames or frames]
    return f"{where[-1] if where else 'an unknown place'} ({type(error).__name__})"


def _handler(path: Path) -> logging.Handler:
    """The log on disk; the terminal if there can be none."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handler: logging.Handler = RotatingFileHandler(
            path, maxBytes=LARGEST, backupCount=OLDER, encoding="utf-8"
        )
    except OSError:
        handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(threadName)s %(message)s"))
    return handler


class FaultDialog(QDialog):
    """Says that the labels are safe and where the log is; `details` can be copied. Not modal."""

    def __init__(self, details: str, log_file: Path, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setWindowTitle("Something went wrong")
        self._details = details
        self._further = 0
        self._text = self._details_view(details)
        parts = self._message_row(log_file), (self._text, 1), self._buttons()
        fill_layout(QVBoxLayout(self), *parts, spacing=14)

    def _message_row(self, log_file: Path) -> QHBoxLayout:
        """The message beside its icon."""
        headline = _wrapped("Something went wrong.")
        emphasise(headline, 1.2)
        lines = (
            "Your labels are safe: every stroke was stored when it was made.",
            "You can go on working. If it happens again, restart forcelab.",
            f"Details are in {log_file}",
        )
        self._more = _wrapped("")
        self._more.hide()
        words = fill_layout(QVBoxLayout(), headline, *map(_wrapped, lines), self._more)
        sign = QLabel()
        size = self.style().pixelMetric(QStyle.PixelMetric.PM_LargeIconSize)
        icon = self.style().standardIcon(QStyle.StandardPixmap.SP_MessageBoxWarning)
        sign.setPixmap(icon.pixmap(size, size))
        sign.setAlignment(Qt.AlignmentFlag.AlignTop)
        return fill_layout(QHBoxLayout(), sign, (words, 1), spacing=16)

    def _details_view(self, details: str) -> QPlainTextEdit:
        """The details, hidden at first."""
        text = QPlainTextEdit(details, readOnly=True, tabChangesFocus=True)
        text.setFont(QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont))
        text.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        text.setAccessibleName("Details")
        metrics = self.fontMetrics()
        text.setMinimumSize(metrics.averageCharWidth() * 80, metrics.lineSpacing() * 12)
        text.hide()
        return text

    def _buttons(self) -> QHBoxLayout:
        self._show = QPushButton("Show details")
        self._show.setCheckable(True)
        self._show.toggled.connect(self._show_details)
        self._show.setAccessibleName(self._show.text())
        copy = copy_button("Copy details", self._details, "Copy details")
        close = push_button("Close", self.accept, "Close")
        close.setDefault(True)
        close.setFocus()
        return fill_layout(QHBoxLayout(), self._show, copy, 1, close)

    def add(self) -> None:
        """Count another error while this is open."""
        self._further += 1
        self._more.setText(f"Further errors since then, in the same file: {self._further}")
        self._more.show()

    def _show_details(self, shown: bool) -> None:
        self._text.setVisible(shown)
        self._show.setText("Hide details" if shown else "Show details")
        self.adjustSize()


def _wrapped(text: str) -> QLabel:
    """A paragraph that can be copied, by keys too."""
    label = sentence_label(text)
    label.setMinimumWidth(label.fontMetrics().averageCharWidth() * 56)
    label.setTextInteractionFlags(
        Qt.TextInteractionFlag.TextSelectableByMouse
        | Qt.TextInteractionFlag.TextSelectableByKeyboard
    )
    label.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Minimum)
    return label
