"""The button above the scalogram's axis, with the menu of all that can be chosen."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QAction, QActionGroup
from PySide6.QtWidgets import QMenu, QToolButton, QWidget

from forcelab.gui.figures.text import NAMES
from forcelab.gui.naming import verbatim

__all__ = ["ScalogramButton"]


class ScalogramButton(QToolButton):
    """Shows the channel; its menu chooses channel, magnitude or phase, and the range of colours.

    Signals
    -------
    channel_chosen(str), phase_chosen(bool), steady_chosen(bool)
    """

    channel_chosen = Signal(str)
    phase_chosen = Signal(bool)
    steady_chosen = Signal(bool)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName("Channel and kind of the scalogram")
        face = self.font()
        face.setPixelSize(10)
        self.setFont(face)
        self._choices = QMenu(self)
        # What the menu is cleared of goes, but no group would.
        self._channels, self._kinds = QActionGroup(self._choices), QActionGroup(self._choices)
        self.setMenu(self._choices)

    def offer(self, channels: Sequence[str], channel: str, phase: bool, steady: bool) -> None:
        """Say what can be chosen, and what is chosen."""
        room = max(self.width() - 18, 10)
        name = self.fontMetrics().elidedText(channel, NAMES, room)
        # The wide space keeps the name clear of the arrow.
        self.setText(verbatim(name) + "\N{EM SPACE}")
        self.setToolTip(f"{channel}: choose channel, magnitude or phase")
        self.setVisible(bool(channels))
        menu = self._choices
        menu.clear()
        for name in channels:
            action = self._add(verbatim(name), name == channel, self._channels)
            action.triggered.connect(lambda _=False, name=name: self.channel_chosen.emit(name))
        menu.addSeparator()
        magnitude = self._add("Magnitude", not phase, self._kinds)
        magnitude.triggered.connect(lambda: self.phase_chosen.emit(False))
        angle = self._add("Phase", phase, self._kinds)
        angle.triggered.connect(lambda: self.phase_chosen.emit(True))
        menu.addSeparator()
        same = self._add("Same colours for the whole demonstration", steady)
        same.setEnabled(not phase)
        same.triggered.connect(self.steady_chosen)

    def _add(self, name: str, on: bool, group: QActionGroup | None = None) -> QAction:
        """One line of the menu."""
        action = QAction(name, self._choices, checkable=True, checked=on)
        if group is not None:
            group.addAction(action)
        self._choices.addAction(action)
        return action
