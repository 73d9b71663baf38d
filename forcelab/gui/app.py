"""The desktop program: one application and its window, or a picture of it without a display."""

from __future__ import annotations

import logging
import os
import signal
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import FrameType

import shiboken6
from PySide6.QtCore import (
    QEventLoop,
    QMessageLogContext,
    QSize,
    QSocketNotifier,
    QThread,
    QTimer,
    QtMsgType,
    qInstallMessageHandler,
)
from PySide6.QtGui import QIcon, QPixmap
from PySide6.QtWidgets import QApplication, QWidget

from forcelab.errors import InputError
from forcelab.gui import theme
from forcelab.gui.exception_hook import ExceptionHook
from forcelab.gui.figures.figure import encode_png
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.layout import resize_on_screen
from forcelab.gui.preferences import TEXT_SIZE, THEME
from forcelab.gui.window import Window
from forcelab.io import write_atomically
from forcelab.runtime import collect_garbage, collect_garbage_rarely, switch_threads_often
from forcelab.version import __version__

#: Width and height of the window in pixels, unless others are requested.
SIZE = (1280, 800)
#: Seconds that a picture waits for everything in it.
DRAWING_TIMEOUT = 60.0
#: What asks a program to end; Windows has no SIGHUP.
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
#: Milliseconds after which a signal that came before the event loop is looked at again.
POLL_MS = 20
#: Seconds that the process waits, without a window, for threads that have not ended with it.
SHUTDOWN_TIMEOUT = 5.0
#: How long nothing may have changed before the window counts as settled, in seconds.
QUIET_SECONDS = 0.25


def run(options: LaunchOptions) -> int:
    """Run the program until its window is closed; returns its exit status.

    With a screenshot it draws that and ends: InputError if what it is to show does not exist, or
    the file cannot be written. Qt must be known to start (:mod:`forcelab.gui.qt_check`).
    """
    application = _application(options.theme or THEME.value)
    if options.screenshot is not None:
        quiet_qt()
        draw(Window(options.author, remembering=False), options, options.screenshot)
        return 0
    with quit_on_signals(application) as windows:
        window = Window(options.author)
        windows.append(window)
        collect_garbage_rarely()
        window.document.demonstration_changed.connect(collect_garbage)
        switch_threads_often()
        ExceptionHook(window, lambda sentence: window.document.show_message(sentence, True))
        resize_on_screen(window, QSize(*SIZE))
        window.restore_layout()
        if options.size is not None:  # what is requested counts for more than the last layout
            window.resize(*options.size)
        window.show()
        window.begin(options)
        return shut_down(window, int(application.exec()))


def run_guide(page: str) -> int:
    """Show the guide, at a page, until its window is closed; returns the exit status."""
    from forcelab.gui.guide import GuideWindow

    application = _application(THEME.value)
    with quit_on_signals(application) as windows:
        guide = GuideWindow()
        windows.append(guide)
        theme.apply_to_application(guide)
        guide.show()
        guide.open(page)
        status = int(application.exec())
        shiboken6.delete(guide)
        return status


def _application(choice: str) -> QApplication:
    """The application, in a theme and with the coder's size of text."""
    running = QApplication.instance()
    application = running if isinstance(running, QApplication) else QApplication(sys.argv[:1])
    application.setApplicationName("forcelab")
    application.setApplicationDisplayName("forcelab")
    application.setApplicationVersion(__version__)
    application.setDesktopFileName("forcelab")  # by which Wayland finds the entry and its icon
    application.setWindowIcon(QIcon(str(Path(__file__).with_name("forcelab.svg"))))
    theme.use_theme(application, choice)
    theme.use_text_size(application, TEXT_SIZE.value)
    return application


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
        application.setQuitOnLastWindowClosed(False)  # which would end it with status 0
        for window in windows:
            window.close()
        application.exit(128 + number)

    def request_leave(number: int, _: FrameType | None) -> None:
        # Python hears of it wherever it happens to be; the window is closed from the event loop.
        QTimer.singleShot(0, partial(leave, number))

    numbers = [getattr(signal, name) for name in SIGNALS if hasattr(signal, name)]
    # One that is ignored already stays so: that is how nohup keeps a program alive.
    before = {number: signal.getsignal(number) for number in numbers}
    handled = {
        number: handler for number, handler in before.items() if handler is not signal.SIG_IGN
    }
    for number in handled:
        signal.signal(number, request_leave)
    try:
        with _on_wakeup():
            yield windows
    finally:
        for number, handler in handled.items():
            signal.signal(number, handler)


def shut_down(window: Window, status: int) -> int:
    """Delete a closed window before the interpreter goes; returns the exit status.

    Left to the interpreter's end, its parts go in no particular order, when half of what they call
    is gone already. A thread that is still at work then, deep in a library, would crash: with one
    that does not end in time the process ends at once. All labels are stored, and the layout is.
    """
    if not window.at_rest(SHUTDOWN_TIMEOUT):
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
    listener, pythons = socket.socketpair()
    with listener, pythons:
        listener.setblocking(False)
        pythons.setblocking(False)
        notifier = QSocketNotifier(listener.fileno(), QSocketNotifier.Type.Read)
        notifier.activated.connect(lambda: listener.recv(4096))
        before = signal.set_wakeup_fd(pythons.fileno(), warn_on_full_buffer=False)
        try:
            yield
        finally:
            signal.set_wakeup_fd(before)
            notifier.setEnabled(False)


def settle(window: Window, patience: float, dialog: QWidget | None = None) -> None:
    """Wait until the window and a dialog are complete; InputError after `patience` seconds."""

    def complete() -> bool:
        return window.settled and bool(getattr(dialog, "settled", True))

    deadline = time.monotonic() + patience
    quiet_since = time.monotonic()
    # Asked once more, as a busy machine may have let the quiet time pass in one sleep.
    while not complete() or time.monotonic() - quiet_since < QUIET_SECONDS:
        QApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 20)
        if not complete():
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


def draw(window: Window, options: LaunchOptions, path: Path) -> None:
    """Draw the window into a PNG.

    Raises InputError if what it is to show does not exist, or the file cannot be written.
    """
    try:
        image = _image(window, options, path)
    finally:
        window.close()
    write_atomically(path, encode_png(image.toImage()))


def _image(window: Window, options: LaunchOptions, path: Path) -> QPixmap:
    """The window when it is complete."""
    if path.suffix.lower() != ".png":
        raise InputError(f"A screenshot is a .png, not '{path.name}'; change the suffix.")
    errors: list[str] = []

    def collect(message: str, error: bool) -> None:
        if error:
            errors.append(message)

    window.document.message_shown.connect(collect)
    window.resize(*(options.size or SIZE))
    window.show()
    opened = window.begin(options)
    if errors and not opened:  # what else is said, as of a crash, is in the picture
        raise InputError(errors[0])
    settle(window, DRAWING_TIMEOUT)
    return _dialog_image(window, options) if options.dialog else window.grab()


def _dialog_image(window: Window, options: LaunchOptions) -> QPixmap:
    """A dialog of the window when it is complete; InputError if it cannot be opened now."""
    images: list[QPixmap] = []
    errors: list[InputError] = []

    def draw_dialog() -> None:
        shown = [widget for widget in QApplication.topLevelWidgets() if widget.isVisible()]
        dialog = next((widget for widget in shown if widget is not window), None)
        if dialog is None:
            errors.append(InputError(f"The dialog '{options.dialog}' cannot be opened here."))
            return
        if options.size is not None:
            dialog.resize(*options.size)
        try:
            settle(window, DRAWING_TIMEOUT, dialog)
            images.append(dialog.grab())
        except InputError as error:  # not through Qt, which would print it and go on
            errors.append(error)
        dialog.close()

    QTimer.singleShot(0, draw_dialog)
    window.open_dialog(options.dialog, options.files)
    deadline = time.monotonic() + DRAWING_TIMEOUT
    while not images and not errors:  # those that the window does not wait for
        if time.monotonic() > deadline:
            raise InputError(f"The dialog '{options.dialog}' was not drawn; try once more.")
        QApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 20)
    if errors:
        raise errors[0]
    return images[0]
