"""Open the window, or draw a picture of it.

The same as 'forcelab PROJECT'. Without a project it opens the last one; the first time,
it asks what to begin with. With --screenshot it needs no display: it draws the window
once it is complete, and quits.

for example:
  forcelab gui lab.forcelab --demo pull-03 --at 2.5
  forcelab gui lab.forcelab --workspace review --theme light --screenshot review.png
  forcelab gui lab.forcelab --dialog import pull.csv --screenshot import.png
"""

from __future__ import annotations

import argparse
import math
import os
import re
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from forcelab.cli.interrupts import uninterrupted
from forcelab.cli.options import UsageError, add_author, add_file
from forcelab.cli.output import STANDARD_OUTPUT, printable
from forcelab.errors import InputError
from forcelab.gui.launch_options import DIALOGS, REVIEW_PAGES, LaunchOptions
from forcelab.gui.qt_check import has_display, require_qt
from forcelab.text import unknown_word

#: Pixels a side that a window may have at most.
LARGEST = 8192


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "project", metavar="PROJECT", type=Path, nargs="?", help="project folder (the last one)"
    )
    group = parser.add_argument_group("what is shown")
    group.add_argument("--demo", metavar="NAME", help="demonstration to open (the first)")
    group.add_argument(
        "--workspace",
        metavar="NAME",
        choices=("label", "review", "capture", *REVIEW_PAGES),
        default="label",
        help=f"label (the default), review, capture; or of the review {', '.join(REVIEW_PAGES)}",
    )
    group.add_argument("--at", metavar="SECONDS", type=_seconds, help="where the cursor is")
    group.add_argument("--span", metavar="SECONDS", type=_span, help="how much time is visible")
    group = parser.add_argument_group("the window")
    group.add_argument("--size", metavar="WxH", type=_size, help="of the window (1280x800)")
    group.add_argument(
        "--theme", choices=("light", "dark", "system"), help="colours (as chosen in the window)"
    )
    add_author(group, "the coder (the last one who labelled in the project)")
    add_file(group, "--screenshot", "draw the window into this .png; - is standard output")
    group.add_argument(
        "--dialog",
        metavar=("NAME", "FILE"),
        nargs="+",
        help=f"with --screenshot: draw a dialog, {', '.join(DIALOGS)}; of import with each FILE",
    )


def run(arguments: argparse.Namespace) -> int:
    dialog, *files = arguments.dialog or ("",)
    if dialog and dialog not in DIALOGS:
        raise UsageError(unknown_word("dialog", dialog, DIALOGS))
    if files and dialog != "import":
        raise UsageError(f"Only --dialog import takes files; write '{files[0]}' before --dialog.")
    if dialog and arguments.screenshot is None:
        raise UsageError("--dialog draws a picture; add --screenshot FILE.png.")
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
        dialog=dialog,
        files=tuple(map(Path, files)),
    )
    # Only for a picture: it loads what reads recordings.
    if start.screenshot is not None:
        from forcelab.cli.files import check_outputs, output_file

        check_outputs([start.screenshot], [start.project], binary=True)
    if not has_display() and start.screenshot is None:
        raise InputError(
            "There is no display to open a window on; start forcelab on a desktop, or draw a "
            "picture with --screenshot FILE.png."
        )
    with uninterrupted():  # Qt crashes on what is raised while it begins, or calls a method
        if start.screenshot is not None:
            os.environ["QT_QPA_PLATFORM"] = "offscreen"
        require_qt()
        # Only now: it loads Qt.
        from forcelab.gui.app import run as run_window

        if start.screenshot is not None:
            with output_file(start.screenshot, ".png") as file:
                status = run_window(replace(start, screenshot=file))
            if start.screenshot != STANDARD_OUTPUT:
                print(printable(str(start.screenshot)))
            return status
    return run_window(start)


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{3,5})[xX](\d{3,5})", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"'{text}' is no size such as 1280x800")
    width, height = int(match[1]), int(match[2])
    if max(width, height) > LARGEST:
        raise argparse.ArgumentTypeError(f"'{text}' is too large; {LARGEST} pixels are the most")
    return width, height


def _seconds(text: str) -> float:
    with suppress(ValueError):
        if math.isfinite(seconds := float(text)):
            return seconds
    raise argparse.ArgumentTypeError(f"'{text}' is no time in seconds")


def _span(text: str) -> float:
    if (seconds := _seconds(text)) > 0:
        return seconds
    raise argparse.ArgumentTypeError(f"'{text}' is no length of time above 0 s")
