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
    """Projects opened last that are still there, the latest first.

    Parameters
    ----------
    opening : callable
        Opens the project at a path.
    """

    def __init__(self, opening: Callable[[Path], object], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setTitle(self.tr("Open recent"))
        self.setToolTipsVisible(True)
        self._opening = opening
        self.aboutToShow.connect(self._list)

    def _list(self) -> None:
        """Offer the projects that there are now."""
        self.clear()
        for path in settings.recent_projects():
            action = self.addAction(verbatim(path.name), partial(self._opening, path))
            action.setToolTip(str(path))
        if self.isEmpty():
            self.addAction(self.tr("No project was open before")).setEnabled(False)
