"""What the mouse does, and what pressing the key of an action does: the tables of the help page."""

from __future__ import annotations

from forcelab.gui.commands import QT_TRANSLATE_NOOP

__all__ = ["MOUSE", "PAINTING"]


def _pairs(*texts: str) -> tuple[tuple[str, str], ...]:
    """Every second text with the one before it."""
    return tuple(zip(texts[::2], texts[1::2], strict=True))


#: What the mouse does, as (gesture, what it does), in English.
MOUSE = _pairs(
    QT_TRANSLATE_NOOP("forcelab", "Click"),
    QT_TRANSLATE_NOOP("forcelab", "Go to that time"),
    QT_TRANSLATE_NOOP("forcelab", "Wheel"),
    QT_TRANSLATE_NOOP("forcelab", "Zoom at the pointer"),
    QT_TRANSLATE_NOOP("forcelab", "Shift + wheel"),
    QT_TRANSLATE_NOOP("forcelab", "Show earlier or later time"),
    QT_TRANSLATE_NOOP("forcelab", "Middle button, drag"),
    QT_TRANSLATE_NOOP("forcelab", "Show earlier or later time"),
    QT_TRANSLATE_NOOP("forcelab", "Drag on the forces"),
    QT_TRANSLATE_NOOP("forcelab", "Mark a range"),
    QT_TRANSLATE_NOOP("forcelab", "Drag on the overview"),
    QT_TRANSLATE_NOOP("forcelab", "Show that stretch of time"),
    QT_TRANSLATE_NOOP("forcelab", "Ctrl or Shift + click in the list"),
    QT_TRANSLATE_NOOP("forcelab", "Choose several demonstrations, for the right button's menu"),
    QT_TRANSLATE_NOOP("forcelab", "Drag on the track"),
    QT_TRANSLATE_NOOP("forcelab", "Paint with the chosen action"),
    QT_TRANSLATE_NOOP("forcelab", "Drag an edge"),
    QT_TRANSLATE_NOOP(
        "forcelab",
        "Move where a segment starts or ends; with an action chosen, from within the segment",
    ),
    QT_TRANSLATE_NOOP("forcelab", "Shift + drag a segment, or Alt + drag"),
    QT_TRANSLATE_NOOP("forcelab", "Move the whole segment"),
    QT_TRANSLATE_NOOP("forcelab", "Ctrl while painting or dragging an edge, or Alt"),
    QT_TRANSLATE_NOOP("forcelab", "Do not snap"),
    QT_TRANSLATE_NOOP("forcelab", "Ctrl while moving a segment"),
    QT_TRANSLATE_NOOP("forcelab", "Do not snap"),
    QT_TRANSLATE_NOOP("forcelab", "Double click a segment"),
    QT_TRANSLATE_NOOP("forcelab", "Zoom to it"),
    QT_TRANSLATE_NOOP("forcelab", "Double click an edit in the history"),
    QT_TRANSLATE_NOOP("forcelab", "Go back or forth to where it was the last one"),
    QT_TRANSLATE_NOOP("forcelab", "Drop files on the window"),
    QT_TRANSLATE_NOOP("forcelab", "Import demonstrations, or open a project"),
    QT_TRANSLATE_NOOP("forcelab", "Right button"),
    QT_TRANSLATE_NOOP("forcelab", "Menu of what is under the pointer"),
)
#: What pressing an action's key does.
PAINTING = _pairs(
    QT_TRANSLATE_NOOP("forcelab", "Press, press again"),
    QT_TRANSLATE_NOOP("forcelab", "Start at the cursor, end at the cursor"),
    QT_TRANSLATE_NOOP("forcelab", "Hold"),
    QT_TRANSLATE_NOOP("forcelab", "Paint from the press to the release"),
    QT_TRANSLATE_NOOP("forcelab", "Press with a range marked"),
    QT_TRANSLATE_NOOP("forcelab", "Fill the range"),
    QT_TRANSLATE_NOOP("forcelab", "Press with a segment selected"),
    QT_TRANSLATE_NOOP("forcelab", "Give the segment that action"),
    QT_TRANSLATE_NOOP("forcelab", "Hold, or tap and tap again, while recording"),
    QT_TRANSLATE_NOOP("forcelab", "Mark the action live, in Capture"),
)
