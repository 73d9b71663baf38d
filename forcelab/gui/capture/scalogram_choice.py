"""The field that chooses which channel the live scalogram is of."""

from __future__ import annotations

from forcelab.gui.capture.scalogram import LiveScalogramView
from forcelab.gui.capture.session import Session
from forcelab.gui.review.narrow_list import NarrowList

__all__ = ["ScalogramChoice"]


class ScalogramChoice(NarrowList):
    """Offers the channels of the devices that are connected.

    Parameters
    ----------
    session : Session
    view : LiveScalogramView
    """

    def __init__(self, session: Session, view: LiveScalogramView) -> None:
        super().__init__()
        self._session, self._view = session, view
        self._offered: tuple[str, ...] | None = None
        self.setAccessibleName("Channel of the live scalogram")
        self.activated.connect(self._chosen)
        session.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        """Offer what there is; what was chosen is offered even while nothing is connected."""
        channels = self._session.channels
        names: tuple[str, ...] = ()
        if channels:
            from forcelab.live.scalogram import channels_to_show

            names = channels_to_show(channels)
        chosen = self._view.channel
        if chosen and chosen not in names:
            names = (*names, chosen)
        if names != self._offered:
            self._offered = names
            self.clear()
            self.addItem("not shown", "")
            for name in names:
                self.addItem(name, name)
        self.setCurrentIndex(self.findData(chosen))

    def _chosen(self, row: int) -> None:
        self._view.choose(str(self.itemData(row)))
