"""What the window is started for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

#: The pages of the review, beside its pairs.
REVIEW_PAGES = ("queue", "confusion", "scores", "why", "proposals", "coders", "loss", "tradeoff")
#: Dialogs that can be drawn, and the command that opens each; the settings of a training have none.
DIALOGS = {
    "import": "import",
    "export": "export_labels",
    "synchronise": "synchronise",
    "settings": "train",
    "preferences": "preferences",
    "keys": "help",
    "guide": "manual",
}


@dataclass(frozen=True, slots=True)
class LaunchOptions:
    """What the window shows first.

    `project` is by default the last one; `demonstration` is a name or id, and `workspace` may be
    one of :data:`REVIEW_PAGES`, too. `at` and `span` are in seconds, `size` in pixels; `theme` and
    `author` are by default the last ones. With `screenshot` the window is drawn into this PNG,
    without a display; or one of :data:`DIALOGS`, that of import with these `files`.
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
    dialog: str = ""
    files: tuple[Path, ...] = ()
