"""The named alternative to the window's own drawing: pyqtgraph as its manual tells to use it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QApplication, QVBoxLayout, QWidget

from forcelab.demonstration import Demonstration

__all__ = ["NAME", "PlainPlots", "plain_plots"]

NAME = "pyqtgraph, peak, clipped"


class PlainPlots(QWidget):
    """A plot for each channel, one above the other, with automatic peak downsampling and clipping.

    Parameters
    ----------
    demonstration : Demonstration
        What is plotted.
    """

    def __init__(self, demonstration: Demonstration) -> None:
        super().__init__()
        import pyqtgraph

        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        self._plots = [pyqtgraph.PlotWidget() for _ in demonstration.channels]
        for i, plot in enumerate(self._plots):
            column.addWidget(plot)
            plot.setDownsampling(auto=True, mode="peak")
            plot.setClipToView(True)
            plot.plot(demonstration.times, demonstration.signals[:, i])
            plot.disableAutoRange()
            if i:
                plot.setXLink(self._plots[0])

    @property
    def surfaces(self) -> list[QWidget]:
        """What is painted."""
        return [plot.viewport() for plot in self._plots]

    def set_span(self, start: float, end: float) -> None:
        """Show ``[start, end]``, in seconds."""
        self._plots[0].setXRange(start, end, padding=0)


@contextmanager
def plain_plots(demonstration: Demonstration, size: QSize) -> Iterator[PlainPlots]:
    """The plots on the screen, of the size of the window's force panel."""
    plots = PlainPlots(demonstration)
    plots.resize(size)
    plots.show()
    QApplication.processEvents()
    try:
        yield plots
    finally:
        plots.close()
        plots.deleteLater()
        QApplication.processEvents()
