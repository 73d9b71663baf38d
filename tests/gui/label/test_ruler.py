from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QColor
from PySide6.QtTest import QTest
from window_helpers import pixels

from forcelab.demonstration import Channel, Demonstration
from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.label.ruler import Ruler, TimeAxis, clock_time
from forcelab.gui.theme import colours


@pytest.fixture
def document(app):
    document = Document("Ann")
    times = np.arange(0.0, 20.0, 0.01)
    channels = (Channel("fx1", "N"),)
    document.view.demonstration = Demonstration("one", "", times, times[:, np.newaxis], channels)
    document.view.start, document.view.end = document.view.bounds
    return document


@pytest.fixture
def ruler(document):
    ruler = Ruler(document)
    ruler.resize(696, ruler.height())
    ruler.show()
    yield ruler
    ruler.close()
    ruler.deleteLater()


@pytest.mark.parametrize(
    ("seconds", "decimals", "shown"),
    [
        (0.0, 0, "0:00"),
        (95.0, 0, "1:35"),
        (59.9996, 3, "1:00.000"),
        (3661.25, 2, "1:01:01.25"),
        (-5.0, 1, "\N{MINUS SIGN}0:05.0"),
    ],
)
def test_times_are_told_in_minutes_and_seconds(seconds, decimals, shown):
    assert clock_time(seconds, decimals) == shown


@given(start=st.floats(-100, 1e6), span=st.floats(91, 1e6), room=st.floats(150, 4000))
@settings(max_examples=80, deadline=None)
def test_numbers_in_minutes_have_room_and_stand_at_whole_steps(app, start, span, room):
    axis = TimeAxis()
    axis.setRange(start, start + span)
    (step, values), *_ = axis.tickValues(start, start + span, room)
    labels = axis.tickStrings(values, 1.0, step)
    assert all(value % step == pytest.approx(0, abs=1e-3 * step) for value in values)
    face = text.font(10)
    for left, right in pairwise(labels):
        half = (text.width(left, face) + text.width(right, face)) / 2
        assert step / span * room > half


def test_no_half_of_a_number_stands_beside_the_cursor_s_time(ruler, document):
    panel, red = (QColor(name).getRgb()[:3] for name in (colours().panel, colours().cursor))
    ruler.grab()
    box = ruler._numbers.number_boxes[1].translated(ruler.plot.left(), 0).toRect()
    for shift in range(-40, 41, 4):
        document.view.seek(ruler.time_at(box.center().x() + shift))
        image = pixels(ruler.grab().toImage()).astype(int)
        (tag,) = np.nonzero((np.abs(image[5] - red) < 8).all(axis=1))
        first, last = tag.min(), tag.max()
        if last < box.left() or first > box.right():
            continue
        beside = [x for x in range(box.left(), box.right()) if not first - 2 <= x <= last + 2]
        assert (np.abs(image[10 : box.bottom() - 1, beside] - panel) < 8).all(), shift


def test_dragging_scrubs_the_cursor_and_marks_no_range(ruler, document):
    start = QPoint(round(ruler.x_at(5.0)), 10)
    QTest.mousePress(ruler.viewport(), Qt.MouseButton.LeftButton, pos=start)
    assert document.view.cursor == pytest.approx(5.0, abs=ruler.seconds_per_pixel)
    QTest.mouseMove(ruler.viewport(), QPoint(round(ruler.x_at(12.0)), 10))
    assert document.view.cursor == pytest.approx(12.0, abs=ruler.seconds_per_pixel)
    QTest.mouseRelease(ruler.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(300, 10))
    assert document.view.range is None


def test_scrubbing_past_the_end_stays_in_sight(ruler, document):
    document.view.set_span(5.0, 10.0)
    QTest.mousePress(ruler.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(400, 10))
    QTest.mouseMove(ruler.viewport(), QPoint(5000, 10))
    assert document.view.cursor == pytest.approx(10.0)
    assert (document.view.start, document.view.end) == (5.0, 10.0)


def test_the_cursors_time_stands_over_it_with_the_decimals_of_a_pixel(ruler, document):
    document.view.seek(7.5)
    assert ruler.cursor_text() == "7.500 s"
    image = pixels(ruler.grab().toImage()).astype(int)
    tag = (image[4] == np.array(QColor(colours().cursor).getRgb()[:3])).all(axis=1)
    assert abs(np.flatnonzero(tag).mean() - ruler.x_at(7.5)) < 3
    document.view.set_span(7.5, 7.501)  # never less than a few samples
    assert ruler.cursor_text() == "7.50000 s"


@pytest.mark.parametrize("width", [640, 696, 701, 767, 1003])
def test_at_either_end_cursor_and_its_time_are_seen(document, ruler, width):
    ruler.resize(width, ruler.height())
    for end in document.view.bounds:
        document.view.seek(end)
        image = pixels(ruler.grab().toImage()).astype(int)
        red = (image == np.array(QColor(colours().cursor).getRgb()[:3])).all(axis=2)
        assert red[4].sum() > 20, (width, end)  # the tag
        assert red[-3].any(), (width, end)  # the line


def test_a_long_span_is_told_in_minutes(document, ruler):
    times = np.arange(0.0, 300.0, 0.1)
    channels = (Channel("fx1", "N"),)
    document.view.demonstration = Demonstration("long", "", times, times[:, np.newaxis], channels)
    document.demonstration_changed.emit()
    document.view.fit()
    document.view.seek(100.0)
    assert ruler.cursor_text() == "1:40.000"
    ruler.grab()
