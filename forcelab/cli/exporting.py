"""``forcelab export``."""

from __future__ import annotations

import argparse

from forcelab.cli.output import json_text
from forcelab.formats.exporting import exporting
from forcelab.jobs import finish


def run(arguments: argparse.Namespace) -> None:
    """Write every track, or the whole project, into a folder."""
    written = finish(exporting(arguments.project, arguments.out, arguments.format))
    if arguments.json:
        print(json_text({"written": [str(path) for path in written]}))
        return
    for path in written:
        print(path)
