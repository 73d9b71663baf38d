"""The menu of the projects that were open before."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtWidgets import QMenu, QWidget

from forcelab.gui import settings
from forcelab.gui.naming import verbatim

__all__ = ["RecentProjects"]


class RecentProjects(QMenu):
    """Projects opened last, the latest first; what is no longer where it was can be located.

    Parameters
    ----------
    opening : callable
        Opens the project at a path.
    """

    def __init__(self, opening: Callable[[Path], object], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setTitle("Open recent")
        self.setToolTipsVisible(True)
        self._opening = opening
        self.aboutToShow.connect(self._list)

    def _list(self) -> None:
        """Offer the projects, and say which are not found."""
        self.clear()
        for path in settings.recent_projects():
            text = path.name if settings.is_folder(path) else f"{path.name} (not found)"
            action = self.addAction(verbatim(text), partial(self._opening, path))
            action.setToolTip(str(path))
        if self.isEmpty():
            self.addAction("No project was open before").setEnabled(False)
