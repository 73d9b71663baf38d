"""Recordings that a crash ended: their journals are still there, and nobody writes them."""

from __future__ import annotations

from pathlib import Path

__all__ = ["CAPTURES", "unfinished"]

#: Name of the folder in a project that holds recordings while they last.
CAPTURES = "captures"


def unfinished(path: Path) -> tuple[Path, ...]:
    """Journals of a project that nobody is writing.

    Parameters
    ----------
    path : Path
        The project's folder.
    """
    if not (path / CAPTURES).is_dir():  # every window that opens a project asks
        return ()
    from forcelab.capture.journal import SUFFIX
    from forcelab.capture.journal_writer import being_written

    found = sorted((path / CAPTURES).glob(f"*{SUFFIX}"))
    return tuple(journal for journal in found if not being_written(journal))
