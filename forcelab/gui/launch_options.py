"""What the window is started for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class LaunchOptions:
    """What the window is to show at first.

    Parameters
    ----------
    project : Path, optional
        By default the last one, or the sample project.
    demonstration : str
        Name or id; by default the first one.
    workspace : str
        ``"label"``, ``"review"``, ``"capture"``, or ``"tradeoff"`` for that page of the review.
    at : float, optional
        Where the cursor is, in seconds.
    span : float, optional
        How much time is visible, in seconds.
    size : tuple of int, optional
        Width and height of the window in pixels.
    theme : str
        ``"light"``, ``"dark"``, ``"system"``; ``""`` for the one chosen last.
    author : str
        The coder; ``""`` for the one who labelled last in the project.
    screenshot : Path, optional
        Draw the window into this PNG, without a display, and end.
    """

    project: Path | None = None
    demonstration: str = ""
    workspace: str = "label"
    at: float | None = None
    span: float | None = None
    size: tuple[int, int] | None = None
    theme: str = ""
    author: str = ""
    screenshot: Path | None = None
