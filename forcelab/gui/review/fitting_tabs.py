"""Tabs of which only whole ones are seen; those without room stand in a menu at their end."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent, QResizeEvent
from PySide6.QtWidgets import QMenu, QTabBar, QTabWidget, QToolButton

from forcelab.gui.icons import icon
from forcelab.gui.review.moving import ARROWS, plain

__all__ = ["FittingTabs"]


class _Arrows(QTabBar):
    """While it has the keyboard, arrows go through all tabs; Qt stops at those that are hidden."""

    def keeps(self, event: QKeyEvent) -> bool:
        """Whether a key is one of these arrows, which are the window's too."""
        return event.key() in (Qt.Key.Key_Left, Qt.Key.Key_Right) and plain(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Bring the tab beside the one in front to the front."""
        tabs = self.parentWidget()
        if not self.keeps(event) or not isinstance(tabs, QTabWidget):
            super().keyPressEvent(event)
            return
        step = ARROWS[Qt.Key(event.key())][1]
        tabs.setCurrentIndex(min(max(tabs.currentIndex() + step, 0), tabs.count() - 1))


class FittingTabs(QTabWidget):
    """Tabs in one row, as many as have room; the one in front always has."""

    def __init__(self) -> None:
        super().__init__()
        self.setTabBar(_Arrows())
        self.setDocumentMode(True)
        self.more = QToolButton()
        self.more.setIcon(icon("more"))
        self.more.setToolTip("More")
        self.more.setAccessibleName("More tabs")
        self.more.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self._menu = QMenu(self.more)
        self._menu.aboutToShow.connect(self._fill)
        self.more.setMenu(self._menu)
        self.setCornerWidget(self.more, Qt.Corner.TopRightCorner)
        self.currentChanged.connect(self._fit)

    def setCurrentIndex(self, index: int) -> None:
        """Bring a tab to the front, which Qt does with none that is hidden."""
        self.setTabVisible(index, True)
        super().setCurrentIndex(index)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Ctrl+Tab goes through all tabs; Qt passes over those that are hidden."""
        step = {Qt.Key.Key_Tab: 1, Qt.Key.Key_Backtab: -1}.get(Qt.Key(event.key()))
        if step is None or not event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            super().keyPressEvent(event)
        elif self.count():
            self.setCurrentIndex((self.currentIndex() + step) % self.count())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show what has room."""
        super().resizeEvent(event)
        self._fit()

    def changeEvent(self, event: QEvent) -> None:
        """A larger font takes more room."""
        super().changeEvent(event)
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange):
            self._fit()

    def _fit(self) -> None:
        """Hide the tabs that have no room, the last ones first."""
        bar, front = self.tabBar(), self.currentIndex()
        widths = [bar.tabSizeHint(index).width() for index in range(self.count())]
        room = self.width()
        crowded = sum(widths) > room
        if crowded:
            room -= self.more.sizeHint().width() + widths[front]
        for index, width in enumerate(widths):
            if index == front:
                self.setTabVisible(index, True)
                continue
            shown = not crowded or width <= room
            self.setTabVisible(index, shown)
            room = room - width if shown else -1  # what stands behind does not overtake
        self.more.setVisible(crowded)
        bar.setElideMode(bar.elideMode())  # lays them out anew from the left

    def _fill(self) -> None:
        """Offer the tabs that have no room."""
        self._menu.clear()
        for index in range(self.count()):
            if not self.isTabVisible(index):
                action = self._menu.addAction(self.tabText(index))
                action.triggered.connect(partial(self.setCurrentIndex, index))
