"""The menu bar, in the order of the table of commands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PySide6.QtGui import QAction, QActionGroup
from PySide6.QtWidgets import QMainWindow, QMenu, QTabWidget

from forcelab.gui import settings
from forcelab.gui.shortcuts import COMMANDS

__all__ = ["fill_menus", "follow_tabs", "follow_view"]


#: Commands that a line stands above: their menus are too long to be searched for one entry.
_BEGINNING = frozenset(
    {"import", "next_demonstration", "quit", "full_screen", "zoom_in", "reset_layout", "pan_left"}
    | {"to_start", "slower", "next_camera", "split", "undo", "snapping", "synchronise"}
    | {"previous_segment", "start_earlier", "start_to_cursor", "next_review", "accept"}
    | {"verdict_human"}
)
#: Groups of commands that act on the demonstration in view, and the others that do.
_GROUPS_IN_VIEW = frozenset({"Time", "Playing", "Labelling", "Segments", "Review"})
_IN_VIEW = frozenset({"zoom_in", "zoom_out", "zoom_fit", "zoom_selection"})
#: Those of these groups that mean something wherever one is.
_ANYWHERE = frozenset({"cancel", "coder", "note", "snapping", "train", "cancel_training"})


def fill_menus(
    window: QMainWindow,
    commands: Mapping[str, QAction],
    panels: Sequence[QAction],
    shown_tracks: QMenu,
    recent: QMenu,
) -> None:
    """Make the menus of a window.

    Parameters
    ----------
    window : QMainWindow
        Whose menu bar is filled.
    commands : mapping of str to QAction
        The actions of the commands that the window has, by id.
    panels : sequence of QAction
        Show and hide panels.
    shown_tracks : QMenu
        Shows and hides the tracks of others.
    recent : QMenu
        Opens a project that was open before.
    """
    menus: dict[str, QMenu] = {}
    for command in COMMANDS:
        if command.id not in commands:
            continue
        if command.group not in menus:
            menus[command.group] = window.menuBar().addMenu("&" + command.group)
        if command.id in _BEGINNING:  # one that begins a menu shows no line
            menus[command.group].addSeparator()
        if not command.id.startswith("theme_"):
            menus[command.group].addAction(commands[command.id])
        if command.id == "open_project":
            menus[command.group].addMenu(recent)
    view = menus["View"]
    view.addSeparator()
    view.addMenu("Panels").addActions(panels)
    view.addMenu(shown_tracks)
    chosen = settings.text("window/theme", "system")
    themes = [commands[f"theme_{choice}"] for choice in ("light", "dark", "system")]
    view.addMenu("Theme").addActions(themes)
    _one_of(window, themes)
    commands[f"theme_{chosen}"].setChecked(True)


def follow_view(commands: Mapping[str, QAction], seen: bool) -> None:
    """Switch off what acts on the demonstration in view while another workspace hides it."""
    for command in COMMANDS:
        acts = command.group in _GROUPS_IN_VIEW or command.id in _IN_VIEW
        if acts and command.id not in _ANYWHERE and command.id in commands:
            commands[command.id].setEnabled(seen)


def follow_tabs(tabs: QTabWidget, actions: Sequence[QAction]) -> None:
    """Check the action of the tab that is in front; there is one for each tab."""
    _one_of(tabs, actions)
    tabs.currentChanged.connect(lambda index: actions[index].setChecked(True))
    actions[tabs.currentIndex()].setChecked(True)


def _one_of(parent: QMainWindow | QTabWidget, actions: Sequence[QAction]) -> None:
    """Of these actions one is checked at a time."""
    group = QActionGroup(parent)
    for action in actions:
        action.setCheckable(True)
        group.addAction(action)
