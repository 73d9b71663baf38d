"""What the command line prints: tables, JSON, a progress bar on terminals."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from forcelab.io import write_atomically
from forcelab.jobs import Progress
from forcelab.text import percent as percent  # noqa: PLC0414 - commands print by it too

WIDTH = 24


def table(rows: Sequence[Sequence[str]], right: Sequence[int] = ()) -> str:
    """Align rows in columns; the first is the header, and columns `right` are aligned right."""
    shown = [[printable(cell) for cell in row] for row in rows]
    widths = [max(len(row[c]) for row in shown) for c in range(len(rows[0]))]
    lines = []
    for row in shown:
        cells = [
            cell.rjust(width) if c in right else cell.ljust(width)
            for c, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def printable(name: str) -> str:
    """A name in one line, without characters that would steer a terminal."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in name)


def json_text(value: Any) -> str:
    """A value as JSON for people and programs, never with NaN."""
    return json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False)


def json_path(json_file: Path | None) -> Path | None:
    """The file that ``--json`` names; None where it names none, or ``-``: standard output."""
    return None if json_file == Path("-") else json_file


def print_result(as_json: bool, content: Any, text: str) -> None:
    """Print a text, or the same as JSON where ``--json`` asks for that."""
    print(json_text(content) if as_json else text)


def report(text: str, content: Any, json_file: Path | None) -> None:
    """Print a text, and write it as JSON to a file; where that is ``-``, print the JSON alone."""
    path = json_path(json_file)
    try:
        if path is not None:
            write_atomically(path, (json_text(content) + "\n").encode())
    finally:  # what took hours is told, even where the disk is full
        print_result(path != json_file, content, text)


@contextmanager
def progress_bar(title: str = "") -> Iterator[Callable[[Progress], None]]:
    """A bar on standard error while a job runs, if that is a terminal; gives its update."""
    shown = sys.stderr.isatty()

    def watch(progress: Progress) -> None:
        if shown:
            full = round(WIDTH * progress.done / max(progress.total, 1))
            bar = "█" * full + "·" * (WIDTH - full)
            words = printable(f"{title} {progress.text}".strip())
            sys.stderr.write(f"\r\x1b[K{words} {bar} {progress.done}/{progress.total}")
            sys.stderr.flush()

    try:
        yield watch
    finally:
        if shown:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()
