"""``forcelab`` and ``forcelab gui``: the window, or a picture of it."""

from __future__ import annotations

import argparse
from importlib import import_module

from forcelab.cli.output import printable
from forcelab.cli.stopping import unbroken
from forcelab.gui.app import has_display
from forcelab.gui.app import run as run_window
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.qt_check import require_qt


def run(arguments: argparse.Namespace) -> int:
    """Open the window, or draw it into a file and tell its name."""
    start = LaunchOptions(
        project=arguments.project,
        demonstration=arguments.demo or "",
        workspace=arguments.workspace,
        at=arguments.at,
        span=arguments.span,
        size=arguments.size,
        theme=arguments.theme or "",
        author=arguments.author or "",
        screenshot=arguments.screenshot,
    )
    with unbroken():  # Qt crashes on what is raised while it begins, or calls a method
        if start.screenshot is not None:
            status = run_window(start)
            print(printable(str(start.screenshot)))
            return status
        if has_display():
            require_qt()
            import_module("forcelab.gui.window")
    return run_window(start)
