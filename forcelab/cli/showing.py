"""``forcelab`` and ``forcelab gui``: the window, or a picture of it."""

from __future__ import annotations

import argparse

from forcelab.cli.output import printable
from forcelab.gui.app import Start
from forcelab.gui.app import run as run_window


def run(arguments: argparse.Namespace) -> int:
    """Open the window, or draw it into a file and tell its name."""
    status = run_window(
        Start(
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
    )
    if arguments.screenshot is not None:
        print(printable(str(arguments.screenshot)))
    return status
