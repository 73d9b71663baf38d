import numpy as np
import pytest
from factories import cached_project
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from window_helpers import pixels

from forcelab.demonstration import Channel, Demonstration
from forcelab.gui.document import Document
from forcelab.gui.label.overview import HEIGHT, TRACK_HEIGHT, Overview, WholeTrace
from forcelab.gui.label.traces import ForcePanel
from forcelab.gui.theme import colours
from forcelab.labels import Segment, Track
from forcelab.project import Project

CHANNELS = (Channel("fx1", "N"), Channel("fy1", "N"))
LEFT = Qt.MouseButton.LeftButton


def study(path):
    times = np.arange(0.0, 20.0, 0.001)
    signals = np.stack([np.sin(times), np.full(len(times), -3.0)], axis=1)
    with Project.create(path) as project:
        track = Track("Ann", (Segment(2.0, 6.0, "grab"), Segment(6.0, 10.0, "hold")))
        project.demonstrations.add(Demonstration("one", "foam", times, signals, CHANNELS), (track,))


@pytest.fixture
def document(app, tmp_path):
    path = cached_project(study, tmp_path / "study.forcelab")
    document = Document("Ann")
    document.open_project(path)
    document.open_demonstration("one")
    document.view.set_span(5.0, 10.0)
    yield document
    document.close()


@pytest.fixture
def overview(document, jobs):
    force = ForcePanel(document, jobs)
    overview = Overview(document, force)
    overview.force = force
    overview.resize(696, overview.height())
    overview.show()
    yield overview
    overview.close()


def x_at(overview, time):
    return round(overview.axis.at(time))


def drag(overview, start, end):
    QTest.mousePress(overview.viewport(), LEFT, pos=QPoint(start, 20))
    QTest.mouseMove(overview.viewport(), QPoint((start + end) // 2, 20))
    QTest.mouseMove(overview.viewport(), QPoint(end, 20))
    QTest.mouseRelease(overview.viewport(), LEFT, pos=QPoint(end, 20))


def span(overview):
    return overview.document.view.start, overview.document.view.end


def near(expected):
    return pytest.approx(expected, abs=0.08)


def test_a_glitch_leaves_the_forces_to_be_seen_and_is_marked(overview):
    document = overview.document
    plain = document.demonstration
    before = pixels(overview.grab().toImage()).astype(int)
    signals = np.array(plain.signals)
    signals[7000, 0] = 1e16
    document.view.demonstration = Demonstration("g", "", plain.times, signals, CHANNELS)
    document.editor.demonstration = "glitch"
    document.demonstration_changed.emit()
    after = pixels(overview.grab().toImage()).astype(int)
    changed = np.flatnonzero((before != after).any(axis=(0, 2)))
    assert changed.size
    assert np.abs(changed - overview.axis.at(7.0)).max() < 8
    red = np.array(QColor(colours().trouble).getRgb()[:3])
    assert (np.abs(after - red).max(axis=2) <= 20).sum() > 5


def test_dragging_the_window_pans_and_stops_at_the_ends(overview):
    drag(overview, x_at(overview, 7.0), x_at(overview, 11.0))
    assert span(overview) == near((9.0, 14.0))
    drag(overview, x_at(overview, 10.0), 2000)
    assert span(overview) == near((15.0, 20.0))
    assert overview.document.view.range is None


def test_dragging_an_edge_zooms(overview):
    drag(overview, x_at(overview, 10.0), x_at(overview, 16.0))
    assert span(overview) == near((5.0, 16.0))
    drag(overview, x_at(overview, 5.0), x_at(overview, 1.0))
    assert span(overview) == near((1.0, 16.0))
    drag(overview, x_at(overview, 1.0), x_at(overview, 18.0))
    assert span(overview) == near((16.0, 18.0))


def test_dragging_elsewhere_shows_that_span(overview):
    drag(overview, x_at(overview, 18.0), x_at(overview, 13.0))
    assert span(overview) == near((13.0, 18.0))
    drag(overview, x_at(overview, 9.0), -50)  # it ends where the demonstration does
    assert span(overview) == near((0.0, 9.0))
    overview.document.view.fit()
    drag(overview, x_at(overview, 4.0), x_at(overview, 6.0))
    assert span(overview) == near((4.0, 6.0))


def test_a_click_centres_the_window_and_moves_the_cursor(overview):
    QTest.mouseClick(overview.viewport(), LEFT, pos=QPoint(x_at(overview, 15.0), 20))
    assert span(overview) == near((12.5, 17.5))
    assert overview.document.view.cursor == near(15.0)
    QTest.mouseClick(overview.viewport(), LEFT, pos=QPoint(x_at(overview, 0.5), 20))
    assert span(overview) == near((0.0, 5.0))
    assert overview.document.view.cursor == near(0.5)


def test_a_tiny_window_can_be_taken_hold_of_at_either_edge(overview):
    overview.document.view.set_span(8.0, 8.001)
    x = overview.axis.at(8.0)
    assert overview.handle_at(x - 5) == "start"
    assert overview.handle_at(x + 5) == "end"
    assert overview.handle_at(x) == "body"
    assert overview.handle_at(x + 40) == "new"


def test_the_wheel_zooms_and_pans(overview):
    for modifier, turned, expected in (
        (Qt.KeyboardModifier.NoModifier, QPoint(0, 120), (5.5, 9.5)),
        (Qt.KeyboardModifier.ShiftModifier, QPoint(0, 120), (5.1, 9.1)),
        (Qt.KeyboardModifier.NoModifier, QPoint(120, 0), (4.7, 8.7)),
    ):
        event = QWheelEvent(
            QPointF(300, 20),
            QPointF(300, 20),
            QPoint(),
            turned,
            Qt.MouseButton.NoButton,
            modifier,
            Qt.ScrollPhase.NoScrollPhase,
            False,
        )
        QApplication.sendEvent(overview.viewport(), event)
        assert span(overview) == near(expected)


def test_the_track_and_the_shown_channels_are_seen(overview):
    overview.document.view.fit()
    image = pixels(overview.grab().toImage())
    row = image[round(HEIGHT - TRACK_HEIGHT / 2) - 3]
    for time, action in ((3.0, "grab"), (9.0, "hold")):
        colour = QColor(overview.document.vocabulary[action].colour).getRgb()[:3]
        assert np.abs(row[x_at(overview, time)] - np.array(colour)).max() <= 2
    x = x_at(overview, 15.0)
    before = image[: round(HEIGHT - TRACK_HEIGHT) - 2, x]
    overview.force.source.set_shown("fy1", False)
    after = pixels(overview.grab().toImage())[: round(HEIGHT - TRACK_HEIGHT) - 2, x]
    assert (before != after).any()


def test_only_the_window_is_drawn_anew_when_the_span_changes(overview, monkeypatch):
    before = pixels(overview.grab().toImage())
    monkeypatch.setattr(overview, "paint_background", lambda _: pytest.fail("drawn anew"))
    monkeypatch.setattr(WholeTrace, "_paint_image", lambda *_: None)  # kept: see test_traces
    overview.document.view.set_span(1.0, 3.0)
    overview.document.view.seek(2.0)
    after = pixels(overview.grab().toImage())
    assert (before != after).any()
    cursor = np.array(QColor(colours().cursor).getRgb()[:3])
    assert (np.abs(after[5:40, x_at(overview, 2.0)] - cursor).max(axis=1) <= 2).all()


def test_without_a_demonstration_it_is_empty_and_nothing_can_be_dragged(overview):
    overview.document.close()
    overview.grab()
    drag(overview, 200, 400)
    assert overview.document.view.range is None
