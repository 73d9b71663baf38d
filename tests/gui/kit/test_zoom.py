"""The ordinary plot: zoom, readout, what stands in its place, themes and files."""

import gc
from itertools import pairwise

import numpy as np
import pyqtgraph as pg
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QGuiApplication, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QVBoxLayout, QWidget
from window_helpers import pixels, shown_widget

from forcelab.gui.kit.plot import Plot, ViewFigure
from forcelab.gui.theme import colours, use_theme


class Line(Plot):
    """A line from the lower left to the upper right corner, in the colour of the cursor."""

    MARGINS = (58.0, 24.0, 14.0, 38.0)

    def redraw(self):
        self.clear()
        pen = pg.mkPen(colours().cursor, width=2)
        self.add(pg.PlotCurveItem([0.0, 10.0], [0.0, 1.0], pen=pen), "a line")
        self.show_all_of((0.0, 10.0), (0.0, 1.0))

    def readout(self, pointer):
        return "here" if self.area.contains(pointer) else ""


@pytest.fixture
def plot(app):
    plot = Line("force", "time", zooms=True)
    plot.setAccessibleName("Line")
    plot.redraw()
    with shown_widget(app, plot, (400, 300)):
        plot.clearFocus()
        yield plot


def turn_wheel(plot, spot, notches=1):
    event = QWheelEvent(
        spot, spot, QPoint(), QPoint(0, 120 * notches), Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(plot.viewport(), event)
    return event


def shown(plot):
    return [tuple(span) for span in plot.box.viewRange()]


def drag(plot, start, end):
    view, left = plot.viewport(), Qt.MouseButton.LeftButton
    QTest.mousePress(view, left, pos=start.toPoint())
    for share in (0.3, 0.6, 1.0):
        QTest.mouseMove(view, (start + (end - start) * share).toPoint())
    QTest.mouseRelease(view, left, pos=end.toPoint())


def test_the_wheel_zooms_at_the_pointer_and_a_double_click_shows_everything(plot):
    spot = plot.spot(7.5, 0.5)
    turn_wheel(plot, spot, 4)
    (x0, x1), (y0, y1) = shown(plot)
    assert 0 < x0 < 7.5 < x1 < 10
    assert 0 < y0 < 0.5 < y1 < 1
    assert (plot.spot(7.5, 0.5) - spot).manhattanLength() < 1.5
    plot.redraw()
    assert shown(plot)[0] == (x0, x1)  # what comes meanwhile leaves it as it is
    QTest.mouseDClick(plot.viewport(), Qt.MouseButton.LeftButton, pos=spot.toPoint())
    assert shown(plot) == [(0, 10), (0, 1)]
    turn_wheel(plot, spot, -3)
    assert shown(plot) == [(0, 10), (0, 1)]  # there is no more to see


def test_a_drag_pans_no_further_than_to_the_end(plot):
    turn_wheel(plot, plot.spot(5, 0.5), 6)
    before = shown(plot)[0][0]
    drag(plot, QPointF(200, 150), QPointF(230, 150))
    assert 0 < shown(plot)[0][0] < before
    for _ in range(9):
        drag(plot, QPointF(100, 150), QPointF(380, 150))
    assert shown(plot)[0][0] == pytest.approx(0.0)


def test_one_that_does_not_zoom_leaves_the_wheel_to_what_it_lies_in(app):
    plot = Line("force", "time")
    plot.redraw()
    with shown_widget(app, plot, (400, 300)):
        event = turn_wheel(plot, QPointF(200, 150))
        assert not event.isAccepted()
        assert shown(plot) == [(0, 10), (0, 1)]


def test_the_pointer_reads_and_files_have_no_readout(plot):
    without = plot.grab().toImage()
    file = ViewFigure(plot).image(1.0)
    QTest.mouseMove(plot.viewport(), QPoint(200, 150))
    assert plot.grab().toImage() != without
    assert ViewFigure(plot).image(1.0) == file
    QTest.mouseMove(plot.viewport(), QPoint(2, 2))
    assert plot.grab().toImage() == without


def test_what_is_read_goes_with_what_was_shown(plot):
    QTest.mouseMove(plot.viewport(), QPoint(200, 150))
    plot.say("There is nothing.")
    sentence = plot.grab().toImage()
    QTest.mouseMove(plot.viewport(), QPoint(2, 2))
    assert plot.grab().toImage() == sentence


def test_the_keyboards_frame_leaves_the_plot_behind_it_as_it_is(app, plot):
    QTest.mouseMove(plot.viewport(), QPoint(100, 200))
    inside = QRect(150, 30, 220, 120)
    without = plot.grab(inside).toImage()
    plot.activateWindow()
    plot.setFocus()
    app.processEvents()
    assert plot.hasFocus()
    assert plot.grab(inside).toImage() == without


def test_a_sentence_stands_in_its_place(plot):
    full = plot.grab().toImage()
    plot.say("There is nothing.")
    image = pixels(plot.grab().toImage())
    background = np.array(QColor(colours().background).getRgb()[:3])
    assert (image[250:] == background).all()
    assert (image[130:170] != background).any()
    plot.say("")
    assert plot.grab().toImage() == full


def test_another_theme_changes_everything_that_is_shown(app, plot):
    use_theme(app, "dark")
    again = Line("force", "time", zooms=True)
    again.redraw()
    with shown_widget(app, again, (400, 300)):
        again.clearFocus()
        images = plot.grab().toImage(), again.grab().toImage()
    use_theme(app, "light")
    assert images[0] == images[1]


def test_a_copy_is_twice_as_fine_and_its_lines_as_wide(plot):
    plot.copy()
    fine = pixels(QGuiApplication.clipboard().image())
    coarse = pixels(ViewFigure(plot).image(1.0))
    ink = np.array(QColor(colours().cursor).getRgb()[:3])
    counts = [(np.abs(image - ink).max(axis=2) < 60).sum() for image in (coarse, fine)]
    assert counts[1] / counts[0] == pytest.approx(4, rel=0.2)
    assert plot.box.addedItems[0].opts["pen"].widthF() == 2


def test_a_logarithmic_axis_has_numbers_wherever_it_is(plot):
    plot.bottom.setLogMode(True)
    for span, some in (((0.3, 30.0), {"1", "10"}), ((2.1, 5.2), {"5"}), ((1e-9, 1e9), {"1"})):
        plot.show_all_of(span, (0.0, 1.0))
        plot.show_all()
        values = plot.bottom.numbers()
        assert values
        assert some <= set(plot.bottom.tickStrings(values, 1.0, 1.0))
        spots = [plot.spot(10**value, 0).x() for value in values]
        assert all(b - a > 25 for a, b in pairwise(spots))


def test_marks_in_a_file_are_as_large_as_on_screen(app, plot):
    plot.add(pg.ScatterPlotItem([5.0], [0.2], size=20, pen=None, brush=colours().range))
    spot, figure = plot.spot(5.0, 0.2), ViewFigure(plot)
    ink = np.array(QColor(colours().range).getRgb()[:3])
    for scale in (1, 3):
        image = pixels(figure.image(scale))
        row = np.abs(image[round(scale * spot.y())] - ink).max(axis=1) < 40
        assert row.sum() == pytest.approx(20 * scale, abs=2 * scale)
    assert QRectF(plot.rect()).contains(spot)


def test_a_window_with_plots_can_be_deleted(app):
    """Its items belong to Qt and to Python, and either may end first."""
    for number in range(6):
        window = QWidget()
        plots = [Line("force", "time") for _ in range(3)]
        column = QVBoxLayout(window)
        for plot in plots:
            column.addWidget(plot)
            plot.redraw()
        window.show()
        app.processEvents()
        for plot in plots:
            plot.redraw()
        if number % 2:
            plots.clear()
        window.deleteLater()
        app.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)
        gc.collect()


def test_names_of_curves_stand_above_them(plot):
    named = plot.grab().toImage().copy(0, 0, 400, int(plot.area.top()))
    plot.clear()
    plot.update()
    assert named != plot.grab().toImage().copy(0, 0, 400, int(plot.area.top()))


def test_on_a_screen_of_twice_the_pixels_lines_are_as_wide_and_are_drawn_once(
    app, plot, monkeypatch
):
    pen = pg.mkPen(colours().range, width=3)
    plot.add(pg.ScatterPlotItem([5.0], [0.2], size=20, pen=pen, brush=None, useCache=False))
    ink = np.array(QColor(colours().range).getRgb()[:3])

    def inked():
        image = pixels(plot.grab().toImage())
        return (np.abs(image - ink).max(axis=2) < 60).sum()

    before = inked()
    monkeypatch.setattr(plot, "devicePixelRatioF", lambda: 2.0)
    assert inked() > 1.5 * before
    drawn = []
    plot.scene().sigPrepareForPaint.connect(lambda: drawn.append(True))
    plot.update()
    for _ in range(20):
        app.processEvents()
    assert len(drawn) == 1
