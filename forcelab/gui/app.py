"""The desktop program: one application, one window, and pictures of it without a display."""

from __future__ import annotations

import os
import sys

from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.qt_check import require_qt

__all__ = ["has_display", "run"]

#: Seconds that a picture waits for everything in it to be there.
SHUTDOWN_TIMEOUT = 60.0


def run(start: LaunchOptions) -> int:
    """Run the program until its window is closed.

    Raises InputError if libraries that Qt needs are missing, or a screenshot cannot be made.
    """
    if start.screenshot is not None or not has_display():
        if start.screenshot is None:
            from forcelab.errors import InputError

            raise InputError(
                "There is no display to open a window on; start forcelab on a desktop, or draw a "
                "picture with --screenshot FILE.png."
            )
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    require_qt()
    from PySide6.QtCore import QSize
    from PySide6.QtWidgets import QApplication

    from forcelab import __version__
    from forcelab.gui import settings, theme
    from forcelab.gui.exception_hook import ExceptionHook
    from forcelab.gui.layout import resize_on_screen
    from forcelab.gui.shutdown import quit_on_signals, shut_down
    from forcelab.gui.window import Window
    from forcelab.runtime import collect_garbage, collect_garbage_rarely, switch_threads_often

    running = QApplication.instance()
    application = running if isinstance(running, QApplication) else QApplication(sys.argv[:1])
    application.setApplicationName("forcelab")
    application.setApplicationDisplayName("forcelab")
    application.setApplicationVersion(__version__)
    choices: dict[str, theme.Choice] = {"light": "light", "dark": "dark"}
    chosen = start.theme or settings.text("window/theme")
    theme.use_theme(application, choices.get(chosen, "system"))
    if start.screenshot is not None:
        from forcelab.gui.screenshot import draw, quiet_qt

        quiet_qt()
        draw(Window(start.author, remembering=False), start, start.screenshot, SHUTDOWN_TIMEOUT)
        return 0
    with quit_on_signals(application) as windows:
        window = Window(start.author)
        windows.append(window)
        collect_garbage_rarely()
        window.document.demonstration_changed.connect(collect_garbage)
        switch_threads_often()
        ExceptionHook(window, lambda sentence: window.document.show_message(sentence, True))
        resize_on_screen(window, QSize(1280, 800))
        window.restore_layout()
        if start.size is not None:  # what is asked for counts for more than what was last time
            window.resize(*start.size)
        window.show()
        window.begin(start)
        return shut_down(window, int(application.exec()))


def has_display() -> bool:
    """Whether a window can be shown on this machine."""
    if not sys.platform.startswith("linux") or os.environ.get("QT_QPA_PLATFORM"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
