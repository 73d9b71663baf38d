"""A panel paints only what has changed; what is on the screen is what a whole paint would give."""

import numpy as np
import pytest
from window_helpers import open_foam_document

from forcelab.gui.jobs import Jobs
from forcelab.gui.kit.time_panel import TimePanel
from forcelab.gui.label.lanes import LaneAxis
from forcelab.gui.label.workspace import LabelWorkspace
from forcelab.gui.view_state import Snap
from forcelab.labels import Segment


@pytest.fixture
def workspace(app, until):
    with open_foam_document((Segment(1.0, 2.0, "grab"), Segment(2.0, 4.0, "hold"))) as document:
        jobs = Jobs()
        workspace = LabelWorkspace(document, jobs)
        workspace.resize(800, 500)
        workspace.show()
        until(lambda: not jobs.busy and workspace.settled)
        for _ in range(5):
            app.processEvents()
        yield workspace
        workspace.release()
        jobs.close()
        workspace.close()
        workspace.deleteLater()


def on_screen(app, workspace):
    """The pixels that have been painted, without painting any more."""
    for _ in range(3):
        app.processEvents()
    picture = (
        workspace.screen()
        .grabWindow(workspace.winId())
        .toImage()
        .convertToFormat(workspace.grab().toImage().format())
    )
    return np.frombuffer(picture.constBits(), np.uint8).reshape(picture.height(), -1).copy()


def whole_paint(app, workspace):
    for panel in workspace.findChildren(TimePanel):
        panel.update()
    return on_screen(app, workspace)


def moves(document, random):
    """What moves cursor, hint, range and stroke, one at a time."""
    at = lambda: float(random.uniform(*document.view.bounds))  # noqa: E731
    return [
        lambda: document.view.seek(at()),
        lambda: document.view.step(int(random.integers(-3, 4))),
        lambda: document.view.set_range(at(), at()),
        document.view.clear_range,
        document.view.mark_in,
        lambda: document.view.set_hint(Snap(at(), "edge")),
        lambda: document.view.set_hint(None),
        lambda: document.begin_stroke("grab", at()),
        document.cancel_stroke,
        lambda: document.view.zoom(float(random.uniform(0.5, 1.5)), at()),
        document.view.fit,
    ]


def test_what_was_painted_in_parts_is_what_is_painted_at_once(app, workspace, until):
    document, random = workspace.document, np.random.default_rng(3)
    for _ in range(25):
        for _ in range(int(random.integers(1, 4))):
            moves(document, random)[int(random.integers(11))]()
            if random.random() < 0.5:
                app.processEvents()
        until(lambda: workspace.settled and not workspace.jobs.busy)
        in_parts = on_screen(app, workspace)
        assert np.array_equal(in_parts, whole_paint(app, workspace))


def test_a_step_of_the_cursor_repaints_little_of_a_panel(app, workspace):
    from PySide6.QtCore import QEvent, QObject

    class Area(QObject):
        painted = 0

        def eventFilter(self, _, event):  # noqa: N802 - Qt's name
            if event.type() == QEvent.Type.Paint:
                box = event.region()
                self.painted += sum(part.width() * part.height() for part in box)
            return False

    document, panel, area = workspace.document, workspace.scalogram, Area()
    document.view.seek(3.0)
    for _ in range(5):
        app.processEvents()
    panel.viewport().installEventFilter(area)
    document.view.step(1)
    for _ in range(3):
        app.processEvents()
    panel.viewport().removeEventFilter(area)
    assert 0 < area.painted < 0.03 * panel.width() * panel.height()


def test_panning_makes_no_axis_anew(app, workspace, monkeypatch):
    made = []
    make = LaneAxis.generateDrawSpecs
    monkeypatch.setattr(
        LaneAxis, "generateDrawSpecs", lambda *args: made.append(args) or make(*args)
    )
    for start in (1.0, 1.2, 1.4):
        workspace.document.view.set_span(start, start + 1.0)
        app.processEvents()
    assert len(made) <= len(workspace.force.axes)  # the first time, perhaps
