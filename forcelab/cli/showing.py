"""``forcelab`` and ``forcelab gui``: the window, or a picture of it."""

from __future__ import annotations

import argparse

from forcelab.gui.app import Start
from forcelab.gui.app import run as run_window


def run(arguments: argparse.Namespace) -> int:
    """Open the window, or draw it into a file."""
    return run_window(
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
