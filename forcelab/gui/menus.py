"""Menu bar and toolbar, made from the table of commands; the menus of projects and tracks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from PySide6.QtCore import QSize, Qt, QTimer
from PySide6.QtGui import QAction, QActionGroup, QShowEvent
from PySide6.QtWidgets import QMainWindow, QMenu, QTabWidget, QToolBar, QToolButton, QWidget

from forcelab.gui import settings
from forcelab.gui.commands import COMMANDS, GROUPS
from forcelab.gui.document import Document
from forcelab.gui.icons import icon
from forcelab.gui.layout import set_enabled_with_reason
from forcelab.gui.preferences import THEME
from forcelab.gui.text import escape_ampersands


def fill_menus(
    window: QMainWindow,
    commands: Mapping[str, QAction],
    obstacle: Callable[[str], str],
    panels: Sequence[QAction],
    shown_tracks: QMenu,
    recent: QMenu,
) -> None:
    """Fill a window's menu bar from the table of commands.

    `commands` are the window's actions by command id, `panels` those that show and hide panels;
    `obstacle` tells why a command cannot be carried out now.
    """
    menus = {group: window.menuBar().addMenu(f"&{group}") for group in GROUPS}
    for menu in menus.values():
        # Only while it is open: to the key of a disabled action nothing is answered at all.
        menu.aboutToShow.connect(partial(_disable_entries, menu, obstacle))
        menu.aboutToHide.connect(partial(_disable_entries, menu, lambda _: ""))
    for command in COMMANDS:
        menu = menus[command.group]
        if command.below_line:
            menu.addSeparator()
        if not command.id.startswith("theme_"):
            menu.addAction(commands[command.id])
        if command.id == "open_project":
            menu.addMenu(recent)
    view = menus["View"]
    view.addSeparator()
    view.addMenu("Panels").addActions(panels)
    view.addMenu(shown_tracks)
    themes = [commands[f"theme_{choice}"] for choice in ("light", "dark", "system")]
    view.addMenu("Theme").addActions(themes)
    _exclusive_group(window, themes)
    commands[f"theme_{THEME.value}"].setChecked(True)


def _disable_entries(menu: QMenu, obstacle: Callable[[str], str]) -> None:
    """Disable the commands in a menu that cannot be carried out."""
    for action in menu.actions():
        if action.objectName():
            set_enabled_with_reason(action, obstacle(action.objectName()))


def follow_tabs(tabs: QTabWidget, actions: Sequence[QAction]) -> None:
    """Check the action of the tab in front; there is one for each tab."""
    _exclusive_group(tabs, actions)
    tabs.currentChanged.connect(lambda index: actions[index].setChecked(True))
    actions[tabs.currentIndex()].setChecked(True)


def _exclusive_group(parent: QMainWindow | QTabWidget, actions: Sequence[QAction]) -> None:
    """Let one of these actions be checked at a time."""
    group = QActionGroup(parent)
    for action in actions:
        group.addAction(action)


#: Commands with their text and icon; an empty row is a line.
BUTTONS: tuple[tuple[str, ...], ...] = (
    ("import", "Import", "import"),
    (),
    ("undo", "Undo", "undo"),
    ("redo", "Redo", "redo"),
    (),
    ("split", "Split", "split"),
    ("merge", "Merge", "merge"),
    ("delete", "Delete", "trash"),
    (),
    ("note", "Note", "note"),
    ("done_and_next", "Done and next", "check-next"),
    (),
    ("train", "Train", "network"),
)
#: Buttons turn grey at most so many ms after a change: during playback there are many.
REFRESH_MS = 50


class ToolBar(QToolBar):
    """Buttons for commands, grey where these cannot be carried out; movable.

    `commands` are the window's actions by command id, `obstacle` tells why one cannot be carried
    out now.
    """

    def __init__(
        self,
        document: Document,
        commands: Mapping[str, QAction],
        obstacle: Callable[[str], str],
        parent: QWidget,
    ) -> None:
        super().__init__("Toolbar", parent)
        self.setObjectName("toolbar")
        self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self.setIconSize(QSize(16, 16))
        self._obstacle = obstacle
        self._soon = QTimer(self, singleShot=True, interval=REFRESH_MS)
        self._soon.timeout.connect(self._refresh)
        self.buttons: dict[str, QAction] = {}
        for row in BUTTONS:
            if row:
                id_, text, name = row
                # Not the command's own action, whose key says why where this one is disabled.
                button = self.buttons[id_] = self.addAction(icon(name), text)
                button.triggered.connect(commands[id_].trigger)
                commands[id_].changed.connect(lambda b=button, c=commands[id_]: _copy_tips(b, c))
                _copy_tips(button, commands[id_])
            else:
                self.addSeparator()
        view, review = document.view, document.review
        for signal in (
            *(document.project_changed, document.listing_changed, document.demonstration_changed),
            *(document.author_changed, document.tracks_changed, document.selection_changed),
            *(view.cursor_moved, view.range_changed, review.run_changed, review.training_changed),
        ):
            signal.connect(self.refresh_soon)

    def refresh_soon(self, *_: object) -> None:
        """Follow what can be done; at once when it is shown again."""
        if self.isVisible() and not self._soon.isActive():
            self._soon.start()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        overflow = self.findChild(QToolButton, "qt_toolbar_ext_button")
        if isinstance(overflow, QToolButton):  # Qt's arrow is black in any theme
            overflow.setIcon(icon("more"))
            overflow.setToolTip("More buttons")
        self._refresh()

    def _refresh(self) -> None:
        for id_, button in self.buttons.items():
            set_enabled_with_reason(button, self._obstacle(id_))


def _copy_tips(button: QAction, command: QAction) -> None:
    """Say in a button's tooltip all that the command does, and its key."""
    button.setToolTip(command.toolTip())
    button.setStatusTip(command.statusTip())


class RecentProjects(QMenu):
    """The projects opened last, the latest first; one that was moved can be located."""

    def __init__(self, opening: Callable[[Path], object], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setTitle("Open recent")
        self.setToolTipsVisible(True)
        self._opening = opening
        self.aboutToShow.connect(self._list)

    def _list(self) -> None:
        """List the projects, and say which are not found."""
        self.clear()
        for path in settings.recent_projects():
            text = path.name if settings.is_folder(path) else f"{path.name} (not found)"
            action = self.addAction(escape_ampersands(text), partial(self._opening, path))
            action.setToolTip(str(path))
        if self.isEmpty():
            self.addAction("No project was open before").setEnabled(False)


class ShownTracks(QMenu):
    """A check mark for each other author of the open demonstration."""

    def __init__(self, document: Document, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setTitle("Other tracks")
        self._document = document
        self.aboutToShow.connect(self._list)

    def _list(self) -> None:
        self.clear()
        document = self._document
        if document.coding_blind:
            self.addAction("Hidden until your blind coding is done").setEnabled(False)
            return
        for author in document.other_authors():
            action = self.addAction(escape_ampersands(author))
            action.setCheckable(True)
            action.setChecked(author not in document.hidden_authors)
            action.toggled.connect(partial(self._show, author))
        if self.isEmpty():
            self.addAction("Nobody else has labelled this").setEnabled(False)

    def _show(self, author: str, shown: bool) -> None:
        """Show or hide one author's tracks."""
        hidden = self._document.hidden_authors
        self._document.set_hidden_authors(hidden - {author} if shown else hidden | {author})
