"""Explain the actions that coders label.

What each is, where it starts and ends, and what not to mistake it for; with a picture
of its start and its end.

for example:
  forcelab actions slip 'slip transition'
"""

from __future__ import annotations

import argparse
from dataclasses import asdict

from forcelab.cli.options import UsageError, add_json
from forcelab.cli.output import print_result
from forcelab.resources import asset
from forcelab.terms import Entry, glossary


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("actions", metavar="ACTION", nargs="*", help="only these (all)")
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    entries = {entry.action: entry for entry in glossary()}
    for action in arguments.actions:
        if action not in entries:
            names = ", ".join(entries)
            raise UsageError(f"There is no '{action}' in the glossary; it has {names}.")
    chosen = [entries[action] for action in arguments.actions or entries]
    print_result(
        arguments.json,
        [{**asdict(entry), "picture": str(asset(entry.picture))} for entry in chosen],
        "\n\n".join(_entry_text(entry) for entry in chosen),
    )


def _entry_text(entry: Entry) -> str:
    return (
        f"{entry.action}: {entry.sentence}\n"
        f"  starts   {entry.starts}\n"
        f"  ends     {entry.ends}\n"
        f"  unlike   {entry.unlike}\n"
        f"  picture  {asset(entry.picture)}"
    )
