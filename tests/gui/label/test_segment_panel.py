"""Segments behind the signals: they are seen there, and their edges are dragged there."""

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QKeyEvent
from PySide6.QtTest import QTest
from window_helpers import PanelMouse, open_foam_document, pixels, stored_rows

from forcelab.gui.label.scalogram import ScalogramPanel
from forcelab.gui.label.traces import ForcePanel
from forcelab.labels import Segment

TRACK = (Segment(1.0, 2.0, "grab"), Segment(2.0, 3.0, "hold"), Segment(5.0, 6.0, "release"))
TIMES = [(s.start, s.end, s.action) for s in TRACK]


@pytest.fixture
def document(app):
    with open_foam_document(TRACK) as document:
        yield document


#: A test of what each panel adds to what they have in common.
EITHER = pytest.mark.parametrize("panel", [ForcePanel, ScalogramPanel], indirect=True)


@pytest.fixture
def panel(request, document, jobs):
    panel = getattr(request, "param", ForcePanel)(document, jobs)
    panel.resize(88 + 1000 + 8, 160)
    panel.show()
    yield panel
    panel.close()


@pytest.fixture
def hand(panel):
    return PanelMouse(panel, y=80)


@EITHER
def test_an_edge_is_dragged_and_a_neighbour_that_touches_it_goes_along(document, hand):
    hand.drag(2.0, 2.5)
    assert stored_rows(document) == [(1.0, 2.5, "grab"), (2.5, 3.0, "hold"), TIMES[2]]
    assert document.view.range is None


def test_with_a_brush_an_edge_is_dragged_as_without_one(document, hand, panel):
    document.set_action("grab")
    hand.drag(6.0 - 2 * panel.seconds_per_pixel, 6.5)
    assert len(stored_rows(document)) == 3
    assert stored_rows(document)[2] == (5.0, pytest.approx(6.52, abs=0.02), "release")


@pytest.mark.parametrize(("beside", "end"), [(0.03, 6.6), (0.0, 6.6), (-1.03, 4.4)])
def test_a_drag_beside_a_segment_marks_a_range_from_its_edge(document, hand, panel, beside, end):
    hand.move(6.0 + beside, pressed=False)
    assert panel.cursor().shape() == Qt.CursorShape.ArrowCursor
    hand.drag(6.0 + beside, end)
    edge = 6.0 if end > 6.0 else 5.0
    assert document.view.range == pytest.approx(tuple(sorted((edge, end))))
    assert edge in document.view.range
    assert stored_rows(document) == TIMES


def test_what_is_dragged_snaps_and_is_looked_at(document, hand):
    document.view.contacts = np.array([3.7])
    hand.press(2.99)
    hand.move(3.4)
    hand.move(3.68)
    assert document.view.hint.time == 3.7
    assert document.view.displayed_time == 3.7
    hand.release(3.68)
    assert (2.0, 3.7, "hold") in stored_rows(document)


def test_escape_ends_a_drag_as_if_nothing_had_happened(document, hand, panel):
    hand.press(2.0)
    hand.move(2.5)
    assert panel.dragging
    assert panel.keeps(QKeyEvent(QKeyEvent.Type.KeyPress, Qt.Key.Key_Escape, hand.none))
    QTest.keyClick(panel, Qt.Key.Key_Escape)
    hand.release(2.5)
    assert stored_rows(document) == TIMES


def test_a_press_on_an_edge_without_a_drag_seeks_and_elsewhere_a_range_is_marked(document, hand):
    hand.click(2.0)
    assert document.view.cursor == pytest.approx(2.0)
    assert stored_rows(document) == TIMES
    hand.drag(3.5, 4.5)
    assert document.view.range == pytest.approx((3.5, 4.5))
    assert stored_rows(document) == TIMES


@EITHER
def test_segments_are_seen_as_the_track_is_now_and_not_once_switched_off(document, panel, until):
    def seen(time):
        image = pixels(panel.grab().toImage())
        return image[2, round(panel.x_at(time))]

    colour = np.array(QColor(document.vocabulary["hold"].colour).getRgb()[:3])
    before = seen(4.0)
    assert np.abs(seen(2.5) - colour).sum() < np.abs(before - colour).sum()
    document.editor.paint(3.5, 4.5, "hold")
    until(lambda: np.array_equal(seen(4.0), seen(2.5)))
    panel.set_tinted(False)
    assert (seen(2.5) != seen(4.0)).sum() == 0 or not panel.pictured
    assert np.abs(seen(4.0) - before).max() <= 60


@EITHER
def test_without_the_segments_nothing_is_dragged(document, hand, panel):
    panel.set_tinted(False)
    hand.drag(2.0, 2.5)
    assert stored_rows(document) == TIMES
    assert document.view.range == pytest.approx((2.0, 2.5))


@EITHER
def test_the_pointer_says_what_can_be_dragged(document, hand, panel):
    hand.move(2.0, pressed=False)
    assert panel.cursor().shape() == Qt.CursorShape.SplitHCursor
    hand.move(4.0, pressed=False)
    assert panel.cursor().shape() == Qt.CursorShape.ArrowCursor
