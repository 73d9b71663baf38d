"""What the mouse does, and what pressing the key of an action does: the tables of the help page."""

from __future__ import annotations

__all__ = ["MOUSE", "PAINTING"]


def _pairs(*texts: str) -> tuple[tuple[str, str], ...]:
    """Every second text with the one before it."""
    return tuple(zip(texts[::2], texts[1::2], strict=True))


#: What the mouse does, as (gesture, what it does), in English.
MOUSE = _pairs(
    "Click",
    "Go to that time",
    "Wheel",
    "Zoom at the pointer",
    "Shift + wheel",
    "Show earlier or later time",
    "Middle button, drag",
    "Show earlier or later time",
    "Drag on the forces",
    "Mark a range",
    "Drag on the overview",
    "Show that stretch of time",
    "Ctrl or Shift + click in the list",
    "Choose several demonstrations, for the right button's menu",
    "Drag on the track",
    "Paint with the chosen action",
    "Drag an edge",
    "Move where a segment starts or ends; with an action chosen, from within the segment",
    "Shift + drag a segment, or Alt + drag",
    "Move the whole segment",
    "Ctrl while painting or dragging an edge, or Alt",
    "Do not snap",
    "Ctrl while moving a segment",
    "Do not snap",
    "Double click a segment",
    "Zoom to it",
    "Double click an edit in the history",
    "Go back or forth to where it was the last one",
    "Drop files on the window",
    "Import demonstrations, or open a project",
    "Right button",
    "Menu of what is under the pointer",
)
#: What pressing an action's key does.
PAINTING = _pairs(
    "Press, press again",
    "Start at the cursor, end at the cursor",
    "Hold",
    "Paint from the press to the release",
    "Press with a range marked",
    "Fill the range",
    "Press with a segment selected",
    "Give the segment that action",
    "Hold, or tap and tap again, while recording",
    "Mark the action live, in Capture",
)
