"""What the window is started for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class LaunchOptions:
    """What the window shows first.

    `project` is by default the last one; `demonstration` is a name or id, and `workspace`
    ``"tradeoff"`` that page of the review. `at` and `span` are in seconds, `size` in pixels;
    `theme` and `author` are by default the last ones. With `screenshot` the window is drawn into
    this PNG, without a display.
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
