"""The plot: every point in its place, names that cover nothing, and a click that chooses."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from painted import shown
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtTest import QTest

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import covered_area
from forcelab.gui.tradeoff.measuring import ERRORS, TIMES, Point, points_of
from forcelab.gui.tradeoff.plot import MARK, lay_out
from forcelab.measure.rows import Row

from .conftest import FIGURES, row_of, spot_of

ROWS = [row_of(*figures[:-1]) for figures in FIGURES]


def front(error, time):
    return [p.text for p in points_of(ROWS, ERRORS[error], TIMES[time]) if p.front]


def test_the_front_follows_what_is_drawn():
    assert front(0, 0) == ["fast", "classifier: logistic"]
    assert front(0, 1) == ["classifier: logistic"]  # trained faster than all others
    points = points_of(ROWS, ERRORS[2], TIMES[1])
    assert [(p.error, p.seconds) for p in points] == [(f[5], pytest.approx(f[4])) for f in FIGURES]
    points = points_of(ROWS, ERRORS[1], TIMES[0])
    assert [p.error for p in points] == pytest.approx([f[2] / 2 for f in FIGURES])


def test_rows_without_a_figure_are_left_out():
    refused = Row("phase", "cos and sin", "foam", "labels", refusal="It cannot be trained.")
    bare = {k: v for k, v in ROWS[0].further.items() if not k.startswith("boundary")}
    rows = [refused, replace(ROWS[0], further=bare), ROWS[1]]
    assert [p.place for p in points_of(rows, ERRORS[0], TIMES[0])] == [1, 2]
    assert [p.place for p in points_of(rows, ERRORS[2], TIMES[0])] == [2]
    assert points_of([refused], ERRORS[0], TIMES[0]) == ()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("size", [(260, 200), (620, 460), (1200, 900)])
def test_names_cover_neither_each_other_nor_marks(app, seed, size):
    random = np.random.default_rng(seed)
    points = [
        Point(i, "preset" if i < 3 else "scales", f"setting number {i}",
              float(10 ** random.uniform(-2, 1)), float(random.uniform(0, 0.9)), i % 5 == 0)
        for i in range(22)
    ]  # fmt: skip
    faces = text.font(11), text.font(11, bold=True)
    layout = lay_out(points, QRectF(0, 0, *size), *faces, 1)
    marks = [QRectF(s.x() - MARK, s.y() - MARK, 2 * MARK, 2 * MARK) for s in layout.spots]
    for one, other in combinations(layout.names.values(), 2):
        assert not covered_area(one, [other])
    for name in layout.names.values():
        assert not covered_area(name, marks)
        assert layout.box.contains(name)
    assert all(layout.box.contains(spot) for spot in layout.spots)
    assert size[0] < 300 or len(layout.names) > 8  # in a thumbnail there is no room


@pytest.mark.parametrize("count", [1, 2])
def test_points_in_one_place_have_axes_too(app, count):
    points = [Point(i, "preset", f"p{i}", 0.5, 0.0, True) for i in range(count)]
    layout = lay_out(points, QRectF(0, 0, 500, 400), text.font(11), text.font(11), None)
    assert layout.across.start < 0.5 < layout.across.end
    assert layout.box.contains(layout.spots[0])
    assert layout.across.marks(10.0, upright=False)


@pytest.fixture
def plot(app):
    from forcelab.gui.tradeoff.plot import TradeoffPlot

    plot = TradeoffPlot()
    plot.show_points(points_of(ROWS, ERRORS[0], TIMES[0]), 0, "error", "time")
    plot.told, plot.asked = [], []
    plot.pointed.connect(plot.told.append)
    plot.chosen.connect(plot.asked.append)
    with shown(app, plot, (640, 480)):
        yield plot


def test_faster_is_left_and_better_is_down(plot):
    spots = [spot_of(plot, row) for row in range(len(ROWS))]
    assert sorted(range(4), key=lambda i: spots[i].x()) == [1, 2, 0, 3]
    assert sorted(range(4), key=lambda i: -spots[i].y()) == [3, 1, 0, 2]
    # A logarithmic axis: twice the time is equally far wherever.
    a, b, c = (spots[i].x() for i in (1, 2, 0))
    assert b - a == pytest.approx(c - b, abs=0.01)


def test_pointing_tells_and_a_click_chooses(plot):
    spot = spot_of(plot, 3)
    QTest.mouseMove(plot, spot.toPoint())
    assert plot.told == [3]
    assert plot.asked == []
    QTest.mouseClick(plot, Qt.MouseButton.LeftButton, pos=spot.toPoint())
    assert plot.asked == [3]
    QTest.mouseClick(plot, Qt.MouseButton.RightButton, pos=spot_of(plot, 1).toPoint())
    QTest.mouseClick(plot, Qt.MouseButton.LeftButton, pos=QPointF(120, 60).toPoint())
    assert plot.asked == [3]


def test_the_keyboard_goes_by_time_and_by_error_and_enter_chooses(plot):
    plot.setFocus()
    QTest.keyClick(plot, Qt.Key.Key_Return)
    assert plot.asked == []  # nothing is looked at yet
    for key, row in ((Qt.Key.Key_Right, 0), (Qt.Key.Key_Right, 3), (Qt.Key.Key_Right, 3),
                     (Qt.Key.Key_Left, 0), (Qt.Key.Key_Up, 2), (Qt.Key.Key_Down, 0),
                     (Qt.Key.Key_Down, 1)):  # fmt: skip
        QTest.keyClick(plot, key)
        assert plot.looked_at == row
    QTest.keyClick(plot, Qt.Key.Key_Return)
    assert plot.asked == [1]


def test_what_is_in_use_and_what_is_looked_at_are_seen(plot):
    before = plot.grab().toImage()
    plot.look_at(2)
    looked = plot.grab().toImage()
    assert looked != before
    plot.show_points(plot.points, 1, "error", "time")
    assert plot.grab().toImage() != looked
    assert plot.looked_at == 2
    plot.show_points(plot.points[:1], 1, "error", "time")
    assert plot.looked_at is None  # it is not drawn any more
