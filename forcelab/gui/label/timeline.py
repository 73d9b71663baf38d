"""The panels on one time axis, one below the other; in a low window the least needed give way."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from PySide6.QtCore import QEvent, QSize, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QSplitter, QVBoxLayout, QWidget

__all__ = ["Timeline"]


@runtime_checkable
class Slimming(Protocol):
    """A panel that can do with less height where room is short."""

    def set_slim(self, slim: bool) -> None:
        """Whether it is to do with less."""

    def least_height(self, slim: bool) -> int:
        """Its least height in pixels, so or so."""


class Timeline(QWidget):
    """Ruler, panels, overview and transport.

    Parameters
    ----------
    ruler, overview, transport : QWidget
        Above and below the panels.
    panels : sequence of QWidget
        Which share the room between them. The first one is always there, slim where the second one
        would have no room else; of the others, and of the overview after them, those are hidden
        that have no room.
    shares : sequence of int
        How much of the room each panel gets.

    Attributes
    ----------
    splitter : QSplitter
        Between the panels.
    """

    def __init__(
        self,
        ruler: QWidget,
        panels: tuple[QWidget, ...],
        shares: tuple[int, ...],
        overview: QWidget,
        transport: QWidget,
    ) -> None:
        super().__init__()
        self.splitter = QSplitter(Qt.Orientation.Vertical)
        self.splitter.setChildrenCollapsible(False)
        for i, (panel, share) in enumerate(zip(panels, shares, strict=True)):
            self.splitter.addWidget(panel)
            self.splitter.setStretchFactor(i, share)
        self._always = (ruler, panels[0], transport)
        self._optional = (*panels[1:], overview)
        self._unwanted: set[QWidget] = set()
        self._fitted = False
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        for widget, share in ((ruler, 0), (self.splitter, 1), (overview, 0), (transport, 0)):
            column.addWidget(widget, share)

    def set_wanted(self, panel: QWidget, wanted: bool) -> None:
        """Show a panel where there is room for it, or do not."""
        if wanted:
            self._unwanted.discard(panel)
        else:
            self._unwanted.add(panel)
        self._fit()

    # Qt

    def minimumSizeHint(self) -> QSize:
        """Wide enough for all, high enough for what never gives way."""
        wide = max(_least(widget).width() for widget in (*self._always, *self._optional))
        return QSize(wide, self._least_always(slim=True))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show what has room."""
        super().resizeEvent(event)
        self._fitted = True
        self._fit()

    def event(self, event: QEvent) -> bool:
        """A panel may need more room than before."""
        if event.type() == QEvent.Type.LayoutRequest:
            self._fit()
        return super().event(event)

    # Inside

    def _fit(self) -> None:
        """Hide what has no room, or is not wanted."""
        always = self._always[1]
        room = self.height() - self._least_always(slim=False)
        if isinstance(always, Slimming):
            first = next((panel for panel in self._optional if panel not in self._unwanted), None)
            needed = 0 if first is None else _least(first).height() + self.splitter.handleWidth()
            slim = self._fitted and room < needed
            always.set_slim(slim)
            room = self.height() - self._least_always(slim)
        roomy = True
        for widget in self._optional:
            if widget not in self._unwanted:
                room -= _least(widget).height() + self.splitter.handleWidth()
                # What matters less does not overtake; before it is laid out, all has room.
                roomy = roomy and (room >= 0 or not self._fitted)
            widget.setVisible(roomy and widget not in self._unwanted)
        always.setVisible(always not in self._unwanted)

    def _least_always(self, slim: bool) -> int:
        """The least height of what never gives way."""
        return sum(
            widget.least_height(slim) if isinstance(widget, Slimming) else _least(widget).height()
            for widget in self._always
        )


def _least(widget: QWidget) -> QSize:
    """The least size of a widget."""
    return widget.minimumSizeHint().expandedTo(widget.minimumSize())
