"""What the command line prints: tables, JSON, a progress bar on terminals."""

from __future__ import annotations

import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from forcelab.io import write_atomically
from forcelab.jobs import Progress
from forcelab.labels import Interval
from forcelab.text import duration_text

#: What stands for standard output where a file is written.
STANDARD_OUTPUT = Path("-")
WIDTH = 24
#: Seconds between two drawings of a bar, after which its pace is known, and that need no telling.
REDRAW_INTERVAL, PACE_KNOWN_AFTER, NEARLY_DONE = 0.1, 2.0, 5.0

_quiet = ContextVar("quiet", default=False)


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


def interval_cells(interval: Interval) -> list[str]:
    """Start, end and both actions of a stretch, in a table."""
    times = [f"{time:.3f}" for time in (interval.start, interval.end)]
    return [*times, interval.human or "-", interval.predicted or "-"]


def printable(name: str) -> str:
    """A name in one line, without characters that would steer a terminal."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in name)


def json_text(value: Any) -> str:
    """A value as JSON for people and programs, never with NaN."""
    return json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False)


def print_result(as_json: bool, content: Any, text: str, *, aside: bool = False) -> None:
    """Print a text, or the same as JSON where ``--json`` asks for that.

    With `aside`, standard output holds a file, and the text goes to standard error.
    """
    if aside and not as_json:
        print_aside(text)
    else:
        print(json_text(content) if as_json else text)


def report(text: str, content: Any, json_file: Path | None, *, aside: bool = False) -> None:
    """Print a text, and write it as JSON to a file; where that is ``-``, print the JSON alone."""
    printed = json_file == STANDARD_OUTPUT
    try:
        if json_file is not None and not printed:
            write_atomically(json_file, (json_text(content) + "\n").encode())
    finally:  # what took hours is told, even where the disk is full
        print_result(printed, content, text, aside=aside)


@contextmanager
def quietly(quiet: bool) -> Iterator[None]:
    """Within the block, if `quiet`, neither remarks nor progress are shown."""
    before = _quiet.set(quiet)
    try:
        yield
    finally:
        _quiet.reset(before)


def print_remark(sentence: str) -> None:
    """Print a sentence that is neither a result nor an error."""
    print_aside(printable(sentence))


def print_aside(text: str) -> None:
    """Print on standard error, unless it is to be quiet."""
    if not _quiet.get():
        clear_line()
        print(text, file=sys.stderr, flush=True)


def shows_progress() -> bool:
    """Whether a line on standard error may show how it goes: on a terminal, unless quiet."""
    return sys.stderr.isatty() and not _quiet.get()


def show_line(text: str) -> None:
    """Show how it goes, in the place of what was shown before."""
    sys.stderr.write(f"\r{text}\x1b[K")  # not cleared first, which would flicker
    sys.stderr.flush()


def clear_line() -> None:
    """Remove the line that shows how it goes."""
    if shows_progress():
        show_line("")


@contextmanager
def progress_bar(title: str = "") -> Iterator[Callable[[Progress], None]]:
    """A bar on standard error while a job runs, if progress is shown; gives its update."""
    watch = _Bar(title).update if shows_progress() else lambda _: None
    try:
        yield watch
    finally:
        clear_line()


class _Bar:
    """How far a job is, and for how long its present stage goes on at the pace so far."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._first = self._last = Progress(0, 0, "")  # of the present stage
        self._begun = self._drawn = -math.inf

    def update(self, progress: Progress) -> None:
        now = time.monotonic()
        if progress.total != self._last.total or progress.done < self._last.done:
            self._first, self._begun, self._drawn = progress, now, -math.inf
        self._last = progress
        if now - self._drawn < REDRAW_INTERVAL:
            return
        self._drawn = now
        full = round(WIDTH * progress.done / max(progress.total, 1))
        bar = "█" * full + "·" * (WIDTH - full)
        bar += f" {progress.done:,}/{progress.total:,}{self._time_left(now - self._begun)}"
        words = printable(f"{self._title} {progress.text}".strip())
        room = max(_terminal_width() - len(bar) - 2, 1)
        show_line(f"{words if len(words) <= room else words[: room - 1] + '…'} {bar}")

    def _time_left(self, passed: float) -> str:
        """The rest of the stage; nothing while that is a guess, or it is nearly over."""
        done = self._last.done - self._first.done
        if done == 0 or passed < PACE_KNOWN_AFTER:
            return ""
        seconds = passed / done * (self._last.total - self._last.done)
        if seconds < NEARLY_DONE:
            return ""
        # An MLP may end before its last epoch: it is known by the loss it has.
        how = "about" if getattr(self._last, "loss", None) is None else "up to"
        # In steps of ten seconds: what is estimated is not known better.
        return f", {how} {duration_text(10 * math.ceil(seconds / 10))} left"


def _terminal_width() -> int:
    try:
        return os.get_terminal_size(sys.stderr.fileno()).columns or 80
    except OSError:
        return 80
