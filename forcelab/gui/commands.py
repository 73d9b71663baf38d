"""The table of all commands: what they are called, which keys they have and where they belong."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["COMMANDS", "GROUPS", "Command"]


@dataclass(frozen=True, slots=True)
class Command:
    """A command of the window.

    The coder's own keys are stored under `id`, which never changes. `keys` are the defaults as Qt
    spells them, such as ``"Ctrl+Left"``; a command that `repeats` does so while its key is held.
    """

    id: str
    text: str
    keys: tuple[str, ...]
    group: str
    repeats: bool = False
    checkable: bool = False


def _group(name: str, *rows: tuple[str, ...]) -> tuple[Command, ...]:
    """The commands of a group.

    A row is an id, a text, the default keys with blanks between them, and where it applies
    ``"repeats"`` or ``"switch"`` (checkable).
    """
    return tuple(
        Command(id_, text, tuple(keys.split()), name, "repeats" in flags, "switch" in flags)
        for id_, text, keys, *flags in rows
    )


_FILE = _group(
    "File",
    ("new_project", "New project…", "Ctrl+N"),
    ("open_project", "Open project…", "Ctrl+O"),
    ("import", "Import demonstrations…", "Ctrl+I"),
    ("attach_video", "Attach video…", ""),
    ("export_labels", "Export labels…", ""),
    ("save", "Save (automatic)", "Ctrl+S"),
    ("preferences", "Preferences…", "Ctrl+,"),
    ("next_demonstration", "Next demonstration", "PgDown"),
    ("previous_demonstration", "Previous demonstration", "PgUp"),
    ("next_to_label", "Next demonstration to label", "Ctrl+PgDown"),
    ("search", "Search demonstrations", "Ctrl+F"),
    ("choose_all", "Select all demonstrations", "Ctrl+A"),
    ("quit", "Quit", "Ctrl+Q"),
)
_VIEW = _group(
    "View",
    ("workspace_label", "Label", "Ctrl+1", "switch"),
    ("workspace_review", "Review", "Ctrl+2", "switch"),
    ("workspace_capture", "Capture", "Ctrl+3", "switch"),
    ("full_screen", "Full screen", "F11", "switch"),
    ("zoom_in", "Zoom in", "Ctrl+= Ctrl++", "repeats"),
    ("zoom_out", "Zoom out", "Ctrl+-", "repeats"),
    ("zoom_fit", "Whole demonstration", "Ctrl+0"),
    ("zoom_selection", "Zoom to the selection", "Ctrl+E"),
    ("reset_layout", "Reset layout", ""),
    ("theme_light", "Light theme", "", "switch"),
    ("theme_dark", "Dark theme", "", "switch"),
    ("theme_system", "Same theme as system", "", "switch"),
)
_PLAYBACK = _group(
    "Playback",
    ("step_back", "One video frame back", "Left", "repeats"),
    ("step_forward", "One video frame forward", "Right", "repeats"),
    ("leap_back", "Larger step back", "Ctrl+Left", "repeats"),
    ("leap_forward", "Larger step forward", "Ctrl+Right", "repeats"),
    ("pan_left", "Show earlier time", "Shift+Left", "repeats"),
    ("pan_right", "Show later time", "Shift+Right", "repeats"),
    ("to_start", "To the start", "Ctrl+Home"),
    ("to_end", "To the end", "Ctrl+End"),
    ("play", "Play or pause", "Space"),
    ("play_segment", "Play the current segment", "Shift+Space"),
    ("slower", "Slower", "End -"),
    ("faster", "Faster", "Home +"),
    ("normal_speed", "Normal speed", "Backspace 0"),
    ("next_camera", "Show the next camera", "F7"),
)
_LABELLING = _group(
    "Labelling",
    ("range_in", "Start of the range", "["),
    ("range_out", "End of the range", "]"),
    ("cancel", "Cancel the stroke or the range", "Esc"),
    ("split", "Split the segment at the cursor", "Ctrl+B"),
    ("merge", "Merge the segments in the range", "Ctrl+M"),
    ("fill_gaps", "Fill gaps…", "Ctrl+G"),
    ("copy_from", "Copy from another track…", "Ctrl+Shift+C"),
    ("erase_range", "Make the range unlabelled", "Ctrl+Del"),
    ("undo", "Undo", "Ctrl+Z", "repeats"),
    ("redo", "Redo", "Ctrl+Shift+Z Ctrl+Y", "repeats"),
    ("snapping", "Snap to contacts, edges, frames and samples", "Ctrl+Shift+S", "switch"),
    ("synchronise", "Synchronise the video…", "Ctrl+Shift+V"),
    ("note", "Note on the demonstration…", "Ctrl+Shift+N"),
    ("coder", "Label as another coder…", "Ctrl+L"),
    ("done", "Mark as done", "Ctrl+Return"),
)
_SEGMENTS = _group(
    "Segments",
    ("delete", "Delete the segment", "Del"),
    ("previous_segment", "Previous segment", "K", "repeats"),
    ("next_segment", "Next segment", "L", "repeats"),
    ("start_earlier", "Start earlier", "Alt+Left", "repeats"),
    ("start_later", "Start later", "Alt+Right", "repeats"),
    ("end_earlier", "End earlier", "Ctrl+Shift+Left Alt+Shift+Left", "repeats"),
    ("end_later", "End later", "Ctrl+Shift+Right Alt+Shift+Right", "repeats"),
    ("move_earlier", "Move earlier", "Ctrl+Shift+Down Ctrl+Alt+Left", "repeats"),
    ("move_later", "Move later", "Ctrl+Shift+Up Ctrl+Alt+Right", "repeats"),
    ("start_to_cursor", "Start to the cursor", ","),
    ("end_to_cursor", "End to the cursor", "."),
    ("fine_nudges", "Move by 1 ms instead of 10 ms", "Ctrl+T", "switch"),
)
_REVIEW = _group(
    "Review",
    ("train", "Train", "F5"),
    ("cancel_training", "Cancel the training", ""),
    ("workspace_tradeoff", "Accuracy and speed", "Ctrl+4"),
    ("next_review", "Next thing to review", "N", "repeats"),
    ("previous_review", "Previous thing to review", "Shift+N", "repeats"),
    ("accept", "Accept the prediction here", "G"),
    ("accept_all", "Accept all predictions in view", "Shift+G"),
    ("verdict_human", "Human right", "Shift+H"),
    ("verdict_model", "Model right", "Shift+M"),
    ("verdict_ambiguous", "Ambiguous", "Shift+A"),
)
_CAPTURE = _group(
    "Capture",
    ("record", "Record, or stop and keep", "F9"),
    ("discard_recording", "Discard the recording", "F10"),
    ("show_recording", "Open the last recording", "Ctrl+F9"),
)
_HELP = _group(
    "Help",
    ("help", "Keys and mouse", "? F1"),
    ("change_keys", "Change keys…", ""),
    ("manual", "Manual", ""),
    ("about", "About forcelab", ""),
)

#: Every command there is, in the order of menus and help.
COMMANDS: tuple[Command, ...] = (
    _FILE + _VIEW + _PLAYBACK + _LABELLING + _SEGMENTS + _REVIEW + _CAPTURE + _HELP
)
#: The groups, in order.
GROUPS: tuple[str, ...] = tuple(dict.fromkeys(command.group for command in COMMANDS))
