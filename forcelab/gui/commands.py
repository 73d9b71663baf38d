"""The table of all commands: what they are called, which keys they have and where they belong."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Command:
    """A command of the window.

    The coder's own keys are stored under `id`, which never changes. `keys` are the defaults as Qt
    spells them, such as ``"Ctrl+Left"``; a command that `repeats` does so while its key is held.
    A command `below_line` begins another section of its menu. `needs` is one of :data:`NEEDS`, or
    empty.
    """

    id: str
    text: str
    keys: tuple[str, ...]
    group: str
    repeats: bool = False
    checkable: bool = False
    below_line: bool = False
    needs: str = ""


#: What a command can need: an open project, one that can be written, that or none (which is then
#: made), one with demonstrations; an open demonstration that can be seen, one in a project that can
#: be written.
NEEDS = frozenset({"project", "write", "write or new", "listed", "view", "edit"})


def _group(name: str, *rows: tuple[str, ...]) -> tuple[Command, ...]:
    """The commands of a group.

    A row is an id, a text, the default keys with blanks between them, and where they apply
    ``"repeats"``, ``"switch"`` (checkable) and what it needs. An empty row is a line in the menu.
    """
    commands: list[Command] = []
    below_line = False
    for row in rows:
        if row:
            id_, text, keys, *words = row
            repeats, checkable = "repeats" in words, "switch" in words
            needs = "".join(NEEDS.intersection(words))
            commands.append(
                Command(id_, text, tuple(keys.split()), name, repeats, checkable, below_line, needs)
            )
        below_line = not row
    return tuple(commands)


_FILE = _group(
    "File",
    ("new_project", "New project…", "Ctrl+N"),
    ("open_project", "Open project…", "Ctrl+O"),
    (),
    ("import", "Import demonstrations…", "Ctrl+I", "write or new"),
    ("import_labels", "Import labels…", "", "write"),
    ("export_labels", "Export labels…", "", "listed"),
    ("save", "Save (automatic)", "Ctrl+S", "project"),
    (),
    ("quit", "Quit", "Ctrl+Q"),
)
_EDIT = _group(
    "Edit",
    ("undo", "Undo", "Ctrl+Z", "repeats", "edit"),
    ("redo", "Redo", "Ctrl+Shift+Z Ctrl+Y", "repeats", "edit"),
    (),
    ("delete", "Delete the segment", "Del", "edit"),
    (),
    ("search", "Find demonstrations", "Ctrl+F", "listed"),
    ("choose_all", "Select all demonstrations", "Ctrl+A", "listed"),
    (),
    ("preferences", "Preferences…", "Ctrl+,"),
    ("change_keys", "Change keys…", ""),
)
_VIEW = _group(
    "View",
    ("workspace_label", "Label", "Ctrl+1", "switch", "project"),
    ("workspace_review", "Review", "Ctrl+2", "switch", "project"),
    ("workspace_capture", "Capture", "Ctrl+3", "switch", "project"),
    (),
    ("toolbar", "Toolbar", "Ctrl+Shift+T", "switch"),
    ("full_screen", "Full screen", "F11", "switch"),
    (),
    ("zoom_in", "Zoom in", "Ctrl+= Ctrl++", "repeats", "view"),
    ("zoom_out", "Zoom out", "Ctrl+-", "repeats", "view"),
    ("zoom_fit", "Whole demonstration", "Ctrl+0", "view"),
    ("zoom_selection", "Zoom to the selection", "Ctrl+E", "view"),
    (),
    ("show_scalogram", "Scalogram", "F6", "switch"),
    ("segments_behind", "Segments behind the signals", "F4", "switch"),
    ("reset_layout", "Reset layout", ""),
    ("theme_light", "Light theme", "", "switch"),
    ("theme_dark", "Dark theme", "", "switch"),
    ("theme_system", "Same theme as system", "", "switch"),
)
_DEMONSTRATION = _group(
    "Demonstration",
    ("next_demonstration", "Next demonstration", "PgDown", "listed"),
    ("previous_demonstration", "Previous demonstration", "PgUp", "listed"),
    ("next_to_label", "Next demonstration to label", "Ctrl+PgDown", "listed"),
    (),
    ("done_and_next", "Done and next", "Ctrl+Return", "edit"),
    ("done", "Mark as done", "Ctrl+Shift+Return", "edit"),
    ("assign", "Assign for blind coding…", "", "write"),
    (),
    ("rename", "Rename the demonstration…", "F2", "write"),
    ("task", "Move to another task…", "", "write"),
    ("note", "Note on the demonstration…", "Ctrl+Shift+N", "write"),
    (),
    ("attach_video", "Attach video…", "", "write"),
    ("synchronise", "Synchronise the video…", "Ctrl+Shift+V", "edit"),
)
_PLAYBACK = _group(
    "Playback",
    ("step_back", "One video frame back", "Left", "repeats", "view"),
    ("step_forward", "One video frame forward", "Right", "repeats", "view"),
    ("leap_back", "Larger step back", "Ctrl+Left", "repeats", "view"),
    ("leap_forward", "Larger step forward", "Ctrl+Right", "repeats", "view"),
    ("to_start", "To the start", "Home Ctrl+Home", "view"),
    ("to_end", "To the end", "End Ctrl+End", "view"),
    (),
    ("pan_left", "Show earlier time", "Shift+Left", "repeats", "view"),
    ("pan_right", "Show later time", "Shift+Right", "repeats", "view"),
    (),
    ("play", "Play or pause", "Space", "view"),
    ("play_segment", "Play the current segment", "Shift+Space", "view"),
    (),
    ("slower", "Slower", "- <", "view"),
    ("faster", "Faster", "+ >", "view"),
    ("normal_speed", "Normal speed", "0 Backspace", "view"),
    (),
    ("next_camera", "Show the next video", "F7", "view"),
    ("side_by_side", "Show all videos side by side", "Shift+F7", "view"),
)
_LABELS = _group(
    "Labels",
    ("range_in", "Start of the range", "[", "view"),
    ("range_out", "End of the range", "]", "view"),
    ("cancel", "Cancel the stroke or the range", "Esc"),
    (),
    ("split", "Split the segment at the cursor", "Ctrl+B", "edit"),
    ("merge", "Merge the segments in the range", "Ctrl+M", "edit"),
    ("fill_gaps", "Fill gaps…", "Ctrl+G", "edit"),
    ("copy_from", "Copy from another track…", "Ctrl+Shift+C", "edit"),
    ("erase_range", "Make the range unlabelled", "Ctrl+Del", "edit"),
    (),
    ("previous_segment", "Previous segment", "K", "repeats", "view"),
    ("next_segment", "Next segment", "L", "repeats", "view"),
    (),
    ("start_earlier", "Start earlier", "Alt+Left", "repeats", "edit"),
    ("start_later", "Start later", "Alt+Right", "repeats", "edit"),
    ("end_earlier", "End earlier", "Ctrl+Shift+Left Alt+Shift+Left", "repeats", "edit"),
    ("end_later", "End later", "Ctrl+Shift+Right Alt+Shift+Right", "repeats", "edit"),
    ("move_earlier", "Move earlier", "Ctrl+Shift+Down Ctrl+Alt+Left", "repeats", "edit"),
    ("move_later", "Move later", "Ctrl+Shift+Up Ctrl+Alt+Right", "repeats", "edit"),
    (),
    ("start_to_cursor", "Start to the cursor", ",", "edit"),
    ("end_to_cursor", "End to the cursor", ".", "edit"),
    (),
    ("snapping", "Snap to contacts, edges, frames and samples", "Ctrl+Shift+S", "switch"),
    ("fine_nudges", "Move by 1 ms instead of 10 ms", "Ctrl+T", "switch", "view"),
    ("coder", "Label as another coder…", "Ctrl+L", "project"),
)
_REVIEW = _group(
    "Review",
    ("train", "Train", "F5", "project"),
    ("cancel_training", "Cancel the training", ""),
    ("workspace_tradeoff", "Accuracy and speed", "Ctrl+4", "project"),
    (),
    ("next_review", "Next thing to review", "N", "repeats", "view"),
    ("previous_review", "Previous thing to review", "Shift+N", "repeats", "view"),
    (),
    ("accept", "Accept the prediction here", "G", "edit"),
    ("accept_all", "Accept all predictions in view", "Shift+G", "edit"),
    (),
    ("verdict_human", "Human right", "Shift+H", "edit"),
    ("verdict_model", "Model right", "Shift+M", "edit"),
    ("verdict_ambiguous", "Ambiguous", "Shift+A", "edit"),
)
_CAPTURE = _group(
    "Capture",
    ("record", "Record, or stop and keep", "F9", "project"),
    ("discard_recording", "Discard the recording", "F10", "project"),
    ("show_recording", "Open the last recording", "Ctrl+F9", "project"),
)
_HELP = _group(
    "Help",
    ("manual", "User guide", "F1"),
    ("help", "Keyboard shortcuts", "?"),
    (),
    ("about", "About forcelab", ""),
)

#: Every command there is, in the order of menus and help.
COMMANDS: tuple[Command, ...] = (
    _FILE + _EDIT + _VIEW + _DEMONSTRATION + _PLAYBACK + _LABELS + _REVIEW + _CAPTURE + _HELP
)
#: The groups, in order.
GROUPS: tuple[str, ...] = tuple(dict.fromkeys(command.group for command in COMMANDS))
