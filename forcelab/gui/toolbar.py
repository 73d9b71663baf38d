"""The toolbar: the commands that coders use most, in words beside their icons."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from PySide6.QtCore import QSize, Qt, QTimer
from PySide6.QtGui import QAction, QShowEvent
from PySide6.QtWidgets import QToolBar, QWidget

from forcelab.gui.document import Document
from forcelab.gui.icons import icon
from forcelab.gui.layout import set_enabled_with_reason

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
                commands[id_].changed.connect(lambda b=button, c=commands[id_]: _name(b, c))
                _name(button, commands[id_])
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
        self._refresh()

    def _refresh(self) -> None:
        for id_, button in self.buttons.items():
            set_enabled_with_reason(button, self._obstacle(id_))


def _name(button: QAction, command: QAction) -> None:
    """Say in a button's tooltip all that the command does, and its key."""
    button.setToolTip(command.toolTip())
    button.setStatusTip(command.statusTip())
