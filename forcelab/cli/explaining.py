"""``forcelab actions``."""

from __future__ import annotations

import argparse
from dataclasses import asdict

from forcelab.cli.options import WrongWordError
from forcelab.cli.output import json_text
from forcelab.glossary import Entry, glossary
from forcelab.resources import asset


def run(arguments: argparse.Namespace) -> None:
    """Tell what each action is, or those that were asked for."""
    entries = {entry.action: entry for entry in glossary()}
    for action in arguments.actions:
        if action not in entries:
            known = ", ".join(entries)
            raise WrongWordError(f"There is no '{action}' in the glossary; it has {known}.")
    chosen = [entries[action] for action in arguments.actions or entries]
    if arguments.json:
        print(json_text([_plain(entry) for entry in chosen]))
    else:
        print("\n\n".join(_told(entry) for entry in chosen))


def _told(entry: Entry) -> str:
    """An entry for people."""
    return (
        f"{entry.action}: {entry.sentence}\n"
        f"  starts   {entry.starts}\n"
        f"  ends     {entry.ends}\n"
        f"  unlike   {entry.unlike}\n"
        f"  picture  {asset(entry.picture)}"
    )


def _plain(entry: Entry) -> dict[str, str]:
    """An entry as plain values, its picture with the whole path."""
    return {**asdict(entry), "picture": str(asset(entry.picture))}
