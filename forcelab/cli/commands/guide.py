"""Open the user guide, or write it as web pages.

Opens the guide in a window, at PAGE if one is named. Where there is no display it prints
the page. With --out it writes all pages as HTML, with their pictures, for any browser.

for example:
  forcelab guide label
  forcelab guide --out guide
"""

from __future__ import annotations

import argparse

from forcelab.cli.interrupts import uninterrupted
from forcelab.cli.options import add_json, path_of
from forcelab.cli.output import print_result
from forcelab.gui.qt_check import has_display, require_qt
from forcelab.guide import CONTENTS, read_page


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "page", metavar="PAGE", nargs="?", help=f"{', '.join(CONTENTS)} ({CONTENTS[0]})"
    )
    parser.add_argument("--out", metavar="DIR", type=path_of, help="write HTML into this folder")
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    page = read_page(arguments.page or CONTENTS[0])
    if arguments.out is None and (arguments.json or not has_display()):
        content = {"page": page.name, "title": page.title, "text": page.text}
        print_result(arguments.json, content, page.text.rstrip())
        return 0
    with uninterrupted():  # Qt crashes on what is raised while it begins, or calls a method
        require_qt()
        # Only now: both load Qt.
        if arguments.out is None:
            from forcelab.gui.app import run_guide
        else:
            from forcelab.gui.guide_html import write_guide

            written = write_guide(arguments.out)
            first = arguments.out / f"{page.name}.html"
            print_result(arguments.json, {"written": [*map(str, written)]}, str(first))
            return 0
    return run_guide(page.name)
