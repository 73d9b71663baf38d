"""The table of all commands: what they are called, which keys they have and where they belong."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QCoreApplication

__all__ = ["COMMANDS", "GROUPS", "QT_TRANSLATE_NOOP", "Command", "translated"]


def QT_TRANSLATE_NOOP(context: str, text: str) -> str:  # noqa: ARG001
    """Mark a text for translation and leave it as it is.

    ``pyside6-lupdate`` looks for this name; PySide's own function is typed to give an object.
    """
    return text


@dataclass(frozen=True, slots=True)
class Command:
    """Something the window can be told to do.

    Parameters
    ----------
    id : str
        Never changes; the coder's own keys are remembered under it.
    text : str
        What the menu says, in English; `shown` is translated.
    keys : tuple of str
        The default keys, as Qt spells them, such as ``"Ctrl+Left"``.
    group : str
        One of :data:`GROUPS`, in English.
    repeats : bool
        Whether it is repeated while its key is held.
    checkable : bool
        Whether it switches something on and off.
    """

    id: str
    text: str
    keys: tuple[str, ...]
    group: str
    repeats: bool = False
    checkable: bool = False

    @property
    def shown(self) -> str:
        """The text in the coder's language."""
        return translated(self.text)

    @property
    def shown_group(self) -> str:
        """The group in the coder's language."""
        return translated(self.group)


def translated(text: str) -> str:
    """A text of the table in the coder's language."""
    return QCoreApplication.translate("forcelab", text)


def _group(name: str, *rows: tuple[str, ...]) -> tuple[Command, ...]:
    """The commands of a group.

    A row is an id, a text, the default keys with blanks between them, and where it applies
    ``"repeats"`` or ``"switch"``.
    """
    return tuple(
        Command(id_, text, tuple(keys.split()), name, "repeats" in how, "switch" in how)
        for id_, text, keys, *how in rows
    )


_FILE = _group(
    QT_TRANSLATE_NOOP("forcelab", "File"),
    ("new_project", QT_TRANSLATE_NOOP("forcelab", "New project…"), "Ctrl+N"),
    ("open_project", QT_TRANSLATE_NOOP("forcelab", "Open project…"), "Ctrl+O"),
    ("import", QT_TRANSLATE_NOOP("forcelab", "Import demonstrations…"), "Ctrl+I"),
    ("attach_video", QT_TRANSLATE_NOOP("forcelab", "Attach video…"), ""),
    ("export_labels", QT_TRANSLATE_NOOP("forcelab", "Export labels…"), ""),
    ("save", QT_TRANSLATE_NOOP("forcelab", "Save (automatic)"), "Ctrl+S"),
    ("next_demonstration", QT_TRANSLATE_NOOP("forcelab", "Next demonstration"), "PgDown"),
    ("previous_demonstration", QT_TRANSLATE_NOOP("forcelab", "Previous demonstration"), "PgUp"),
    ("next_to_label", QT_TRANSLATE_NOOP("forcelab", "Next demonstration to label"), "Ctrl+PgDown"),
    ("search", QT_TRANSLATE_NOOP("forcelab", "Search demonstrations"), "Ctrl+F"),
    ("choose_all", QT_TRANSLATE_NOOP("forcelab", "Choose all in the list"), "Ctrl+A"),
    ("quit", QT_TRANSLATE_NOOP("forcelab", "Quit"), "Ctrl+Q"),
)
_VIEW = _group(
    QT_TRANSLATE_NOOP("forcelab", "View"),
    ("workspace_label", QT_TRANSLATE_NOOP("forcelab", "Label"), "Ctrl+1", "switch"),
    ("workspace_review", QT_TRANSLATE_NOOP("forcelab", "Review"), "Ctrl+2", "switch"),
    ("workspace_capture", QT_TRANSLATE_NOOP("forcelab", "Capture"), "Ctrl+3", "switch"),
    ("workspace_tradeoff", QT_TRANSLATE_NOOP("forcelab", "Trade-off"), "Ctrl+4", "switch"),
    ("full_screen", QT_TRANSLATE_NOOP("forcelab", "Full screen"), "F11", "switch"),
    ("zoom_in", QT_TRANSLATE_NOOP("forcelab", "Zoom in"), "Ctrl+= Ctrl++", "repeats"),
    ("zoom_out", QT_TRANSLATE_NOOP("forcelab", "Zoom out"), "Ctrl+-", "repeats"),
    ("zoom_fit", QT_TRANSLATE_NOOP("forcelab", "Whole demonstration"), "Ctrl+0"),
    ("zoom_selection", QT_TRANSLATE_NOOP("forcelab", "Zoom to the selection"), "Ctrl+E"),
    ("reset_layout", QT_TRANSLATE_NOOP("forcelab", "Put all panels back"), ""),
    ("theme_light", QT_TRANSLATE_NOOP("forcelab", "Light theme"), "", "switch"),
    ("theme_dark", QT_TRANSLATE_NOOP("forcelab", "Dark theme"), "", "switch"),
    ("theme_system", QT_TRANSLATE_NOOP("forcelab", "Theme of the system"), "", "switch"),
)
_TIME = _group(
    QT_TRANSLATE_NOOP("forcelab", "Time"),
    ("step_back", QT_TRANSLATE_NOOP("forcelab", "One video frame back"), "Left", "repeats"),
    ("step_forward", QT_TRANSLATE_NOOP("forcelab", "One video frame forward"), "Right", "repeats"),
    ("leap_back", QT_TRANSLATE_NOOP("forcelab", "Larger step back"), "Ctrl+Left", "repeats"),
    ("leap_forward", QT_TRANSLATE_NOOP("forcelab", "Larger step forward"), "Ctrl+Right", "repeats"),
    ("pan_left", QT_TRANSLATE_NOOP("forcelab", "Show earlier time"), "Shift+Left", "repeats"),
    ("pan_right", QT_TRANSLATE_NOOP("forcelab", "Show later time"), "Shift+Right", "repeats"),
    ("to_start", QT_TRANSLATE_NOOP("forcelab", "To the start"), "Ctrl+Home"),
    ("to_end", QT_TRANSLATE_NOOP("forcelab", "To the end"), "Ctrl+End"),
)
_PLAYING = _group(
    QT_TRANSLATE_NOOP("forcelab", "Playing"),
    ("play", QT_TRANSLATE_NOOP("forcelab", "Play or pause"), "Space"),
    ("play_segment", QT_TRANSLATE_NOOP("forcelab", "Play the current segment"), "Shift+Space"),
    ("slower", QT_TRANSLATE_NOOP("forcelab", "Slower"), "End -"),
    ("faster", QT_TRANSLATE_NOOP("forcelab", "Faster"), "Home +"),
    ("normal_speed", QT_TRANSLATE_NOOP("forcelab", "Normal speed"), "Backspace 0"),
    ("next_camera", QT_TRANSLATE_NOOP("forcelab", "Show the next camera"), "F7"),
)
_LABELLING = _group(
    QT_TRANSLATE_NOOP("forcelab", "Labelling"),
    ("range_in", QT_TRANSLATE_NOOP("forcelab", "Start of the range"), "["),
    ("range_out", QT_TRANSLATE_NOOP("forcelab", "End of the range"), "]"),
    ("cancel", QT_TRANSLATE_NOOP("forcelab", "Cancel the stroke or the range"), "Esc"),
    ("split", QT_TRANSLATE_NOOP("forcelab", "Split the segment at the cursor"), "Ctrl+B"),
    ("merge", QT_TRANSLATE_NOOP("forcelab", "Merge the segments in the range"), "Ctrl+M"),
    ("fill_gaps", QT_TRANSLATE_NOOP("forcelab", "Fill gaps…"), "Ctrl+G"),
    ("copy_from", QT_TRANSLATE_NOOP("forcelab", "Copy from another track…"), "Ctrl+Shift+C"),
    ("erase_range", QT_TRANSLATE_NOOP("forcelab", "Make the range unlabelled"), "Ctrl+Del"),
    ("undo", QT_TRANSLATE_NOOP("forcelab", "Undo"), "Ctrl+Z", "repeats"),
    ("redo", QT_TRANSLATE_NOOP("forcelab", "Redo"), "Ctrl+Shift+Z Ctrl+Y", "repeats"),
    (
        "snapping",
        QT_TRANSLATE_NOOP("forcelab", "Snap to contacts, edges, frames and samples"),
        "Ctrl+Shift+S",
        "switch",
    ),
    ("synchronise", QT_TRANSLATE_NOOP("forcelab", "Synchronise the video…"), "Ctrl+Shift+V"),
    ("note", QT_TRANSLATE_NOOP("forcelab", "Note on the demonstration…"), "Ctrl+Shift+N"),
    ("coder", QT_TRANSLATE_NOOP("forcelab", "Label as another coder…"), "Ctrl+L"),
    ("done", QT_TRANSLATE_NOOP("forcelab", "Mark as done"), "Ctrl+Return"),
)
_SEGMENTS = _group(
    QT_TRANSLATE_NOOP("forcelab", "Segments"),
    ("delete", QT_TRANSLATE_NOOP("forcelab", "Delete the segment"), "Del"),
    ("previous_segment", QT_TRANSLATE_NOOP("forcelab", "Previous segment"), "K", "repeats"),
    ("next_segment", QT_TRANSLATE_NOOP("forcelab", "Next segment"), "L", "repeats"),
    ("start_earlier", QT_TRANSLATE_NOOP("forcelab", "Start earlier"), "Alt+Left", "repeats"),
    ("start_later", QT_TRANSLATE_NOOP("forcelab", "Start later"), "Alt+Right", "repeats"),
    (
        "end_earlier",
        QT_TRANSLATE_NOOP("forcelab", "End earlier"),
        "Ctrl+Shift+Left Alt+Shift+Left",
        "repeats",
    ),
    (
        "end_later",
        QT_TRANSLATE_NOOP("forcelab", "End later"),
        "Ctrl+Shift+Right Alt+Shift+Right",
        "repeats",
    ),
    (
        "move_earlier",
        QT_TRANSLATE_NOOP("forcelab", "Move earlier"),
        "Ctrl+Shift+Down Ctrl+Alt+Left",
        "repeats",
    ),
    (
        "move_later",
        QT_TRANSLATE_NOOP("forcelab", "Move later"),
        "Ctrl+Shift+Up Ctrl+Alt+Right",
        "repeats",
    ),
    ("start_to_cursor", QT_TRANSLATE_NOOP("forcelab", "Start to the cursor"), ","),
    ("end_to_cursor", QT_TRANSLATE_NOOP("forcelab", "End to the cursor"), "."),
    (
        "fine_nudges",
        QT_TRANSLATE_NOOP("forcelab", "Move by 1 ms instead of 10 ms"),
        "Ctrl+T",
        "switch",
    ),
)
_REVIEW = _group(
    QT_TRANSLATE_NOOP("forcelab", "Review"),
    ("train", QT_TRANSLATE_NOOP("forcelab", "Train"), "F5"),
    ("cancel_training", QT_TRANSLATE_NOOP("forcelab", "Cancel the training"), ""),
    ("next_review", QT_TRANSLATE_NOOP("forcelab", "Next thing to review"), "N", "repeats"),
    (
        "previous_review",
        QT_TRANSLATE_NOOP("forcelab", "Previous thing to review"),
        "Shift+N",
        "repeats",
    ),
    ("accept", QT_TRANSLATE_NOOP("forcelab", "Accept the prediction here"), "G"),
    ("accept_all", QT_TRANSLATE_NOOP("forcelab", "Accept all predictions in view"), "Shift+G"),
    ("verdict_human", QT_TRANSLATE_NOOP("forcelab", "Human right"), "Shift+H"),
    ("verdict_model", QT_TRANSLATE_NOOP("forcelab", "Model right"), "Shift+M"),
    ("verdict_ambiguous", QT_TRANSLATE_NOOP("forcelab", "Ambiguous"), "Shift+A"),
)
_CAPTURE = _group(
    QT_TRANSLATE_NOOP("forcelab", "Capture"),
    ("record", QT_TRANSLATE_NOOP("forcelab", "Record, or stop and keep"), "F9"),
    ("discard_recording", QT_TRANSLATE_NOOP("forcelab", "Discard the recording"), "F10"),
    ("show_recording", QT_TRANSLATE_NOOP("forcelab", "Look at what was kept last"), "Ctrl+F9"),
)
_HELP = _group(
    QT_TRANSLATE_NOOP("forcelab", "Help"),
    ("help", QT_TRANSLATE_NOOP("forcelab", "Keys and mouse"), "? F1"),
    ("change_keys", QT_TRANSLATE_NOOP("forcelab", "Change keys…"), ""),
    ("manual", QT_TRANSLATE_NOOP("forcelab", "Manual"), ""),
    ("about", QT_TRANSLATE_NOOP("forcelab", "About forcelab"), ""),
)

#: Every command there is, in the order of menus and help.
COMMANDS: tuple[Command, ...] = (
    _FILE + _VIEW + _TIME + _PLAYING + _LABELLING + _SEGMENTS + _REVIEW + _CAPTURE + _HELP
)
#: The groups, in order.
GROUPS: tuple[str, ...] = tuple(dict.fromkeys(command.group for command in COMMANDS))
