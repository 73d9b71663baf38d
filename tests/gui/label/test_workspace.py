"""The Label workspace: contact events, lending of views, and what gives way in a low window."""

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QTabBar, QWidget

from forcelab.demonstration import Channel, Demonstration
from forcelab.gui.document import Document
from forcelab.gui.label.workspace import LabelWorkspace, Timeline
from forcelab.jobs import finish
from forcelab.labels import Segment
from forcelab.project import Project
from forcelab.signals.contacts import find_contacts


def touch(name, at):
    """Four seconds at 250 Hz of noise, with a contact of two seconds' length."""
    times = np.arange(1000) / 250
    noise = np.random.default_rng(1).normal(0, 0.01, len(times))
    force = np.where((times > at) & (times < at + 2), 3.0, 0.0) + noise
    return Demonstration(name, "stylus", times, force[:, np.newaxis], (Channel("fz1", "N"),))


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "study.forcelab"
    with Project.create(path) as project:
        project.demonstrations.add(touch("early", 0.5))
        project.demonstrations.add(touch("late", 1.5))
    return path


@pytest.fixture
def workspace(jobs):
    document = Document("Ada")
    workspace = LabelWorkspace(document, jobs)
    yield workspace
    workspace.release()
    jobs.close()  # before the document: what runs reads it
    document.close()
    workspace.deleteLater()


def test_contacts_are_found_again_when_the_same_demonstration_is_opened_again(
    workspace, path, until
):
    document = workspace.document
    for _ in range(2):
        document.open_project(path)
        document.open_demonstration("early")
        until(lambda: len(document.view.contacts))
        assert min(abs(document.view.contacts - 0.5)) < 0.05


def test_noise_attracts_nothing(workspace, tmp_path, until):
    """Nothing is touched but from 1 to 3 s; a sensor beside it creeps by little more than noise."""
    document, still = workspace.document, touch("still", 1.0)
    noise = np.random.default_rng(2).normal(0, 0.01, len(still.times))
    creep = 0.03 * np.sin(2 * np.pi * still.times)
    signals = np.column_stack((still.signals[:, 0], creep + noise))
    channels = (Channel("fz1", "N"), Channel("fz2", "N"))
    with Project.create(tmp_path / "creep.forcelab") as project:
        project.demonstrations.add(Demonstration("c", "stylus", still.times, signals, channels))
    document.open_project(tmp_path / "creep.forcelab")
    document.open_demonstration("c")
    until(lambda: len(document.view.contacts))
    events = finish(find_contacts(still.times, signals))
    assert any(event.time < 0.9 or event.time > 3.1 for event in events)
    assert all(0.9 < time < 3.1 for time in document.view.contacts)


def test_contacts_of_a_demonstration_that_was_left_reach_no_other(
    app, workspace, path, tmp_path, until
):
    document = workspace.document
    document.open_project(path)
    document.open_demonstration("early")
    Project.create(tmp_path / "empty.forcelab").close()
    document.open_project(tmp_path / "empty.forcelab")
    until(lambda: not workspace.jobs.busy)
    app.processEvents()  # what is still to be delivered
    assert len(document.view.contacts) == 0


def test_the_lists_keep_their_width_while_the_timeline_is_lent(app, workspace, path, until):
    workspace.document.open_project(path)
    workspace.document.open_demonstration("early")
    workspace.resize(1000, 600)
    workspace.show()
    until(lambda: workspace.segments.isVisible() and workspace.settled)
    app.processEvents()
    before = workspace.segments.width()
    for lent in workspace.lend():
        lent.setParent(None)
    workspace.resize(1300, 700)
    app.processEvents()
    workspace.take_back()
    app.processEvents()
    assert workspace.centralWidget().isVisible()
    assert workspace.segments.width() == pytest.approx(before, abs=2)


def test_the_lists_are_as_they_were_and_their_tabs_there_once_when_the_timeline_is_back(
    app, workspace, path, until
):
    def lists():
        for _ in range(4):
            app.processEvents()
        tabs = [child for child in workspace.children() if isinstance(child, QTabBar)]
        sizes = [dock.size().toTuple() for dock in workspace._docks.values() if dock.isVisible()]
        return sum(bar.isVisible() for bar in tabs), sizes

    workspace.document.open_project(path)
    workspace.document.open_demonstration("early")
    workspace.resize(1000, 600)
    workspace.show()
    until(lambda: workspace.segments.isVisible() and workspace.settled)
    before = lists()
    assert before[0] == 1
    for _ in range(2):
        for lent in workspace.lend():
            lent.setParent(None)
        app.processEvents()
        workspace.take_back()
        assert lists() == before
    workspace.remember_layout()
    workspace.restore_layout()
    assert lists()[0] == 1


def test_while_there_are_no_segments_the_actions_have_the_room_of_their_list(
    app, workspace, path, until
):
    document, docks = workspace.document, workspace._docks
    with Project.open(path) as project:
        late = project.demonstrations.id_of("late")
        project.tracks.edit(late, "Ada", (), (Segment(1.5, 3.5, "hold"),), "painted")
        project.actions.add("stylus", ["hold"])
    document.open_project(path)
    document.open_demonstration("late")
    workspace.resize(1000, 700)
    workspace.show()
    until(lambda: workspace.segments.isVisible() and workspace.settled)

    def heights():
        for _ in range(3):
            app.processEvents()
        return [docks[name].height() for name in ("actions", "segments")]

    filled = heights()
    document.open_demonstration("early")
    empty = heights()
    assert empty[1] == docks["segments"].minimumSizeHint().height()
    assert empty[0] > filled[0] + 30
    assert not workspace.segments.filter.isVisible()
    workspace.resize(1000, 900)
    larger = heights()
    assert larger[1] == empty[1]
    assert larger[0] > empty[0] + 150
    workspace.resize(1000, 700)
    workspace.tracks.setFocus()
    document.view.seek(1.0)
    QTest.keyClick(workspace.tracks, Qt.Key.Key_1)
    document.view.seek(2.0)
    QTest.keyClick(workspace.tracks, Qt.Key.Key_1)
    assert heights() == filled
    assert workspace.segments.filter.isVisible()
    document.editor.undo_everywhere()
    assert heights() == empty


class Part(QWidget):
    def __init__(self, height):
        super().__init__()
        self.setMinimumSize(100, height)

    def set_compact(self, _):
        pass

    def least_height(self, **_):
        return self.minimumHeight()


@pytest.fixture
def parts():
    heights = {"ruler": 20, "tracks": 50, "force": 80, "scalogram": 60, "overview": 40, "bar": 30}
    return {name: Part(height) for name, height in heights.items()}


@pytest.fixture
def timeline(app, parts):
    window = QWidget()  # the timeline itself would not become lower than what it shows
    window.resize(500, 500)
    timeline = timeline_in(window, parts)
    window.show()
    yield timeline
    window.close()


def timeline_in(window, parts):
    panels = {parts["force"]: 5, parts["scalogram"]: 3}
    timeline = Timeline(parts["ruler"], parts["tracks"], panels, parts["overview"], parts["bar"])
    timeline.setParent(window)
    return timeline


def shown_parts(timeline, parts, height):
    timeline.resize(400, height)
    assert timeline.height() == height
    return "".join(name[0] for name, part in parts.items() if not part.isHidden())


def test_in_a_low_window_the_least_needed_give_way_and_come_back(timeline, parts):
    assert timeline.minimumSizeHint().height() == 100
    heights = (400, 290, 230, 100, 230, 290, 400)
    assert [shown_parts(timeline, parts, height) for height in heights] == [
        "rtfsob", "rtfsb", "rtfb", "rtb", "rtfb", "rtfsb", "rtfsob"
    ]  # fmt: skip


def test_what_is_not_wanted_leaves_its_room_to_others(timeline, parts):
    timeline.set_shown(parts["force"], False)
    assert shown_parts(timeline, parts, 240) == "rtsob"
    timeline.set_shown(parts["force"], True)
    assert shown_parts(timeline, parts, 240) == "rtfb"
    timeline.set_shown(parts["tracks"], False)
    assert "t" not in shown_parts(timeline, parts, 400)


def test_a_part_that_grows_takes_the_room_of_others(timeline, parts, until):
    assert shown_parts(timeline, parts, 400) == "rtfsob"
    parts["tracks"].setMinimumHeight(160)
    until(parts["overview"].isHidden)
    assert shown_parts(timeline, parts, 400) == "rtfsb"


class Rows(Part):
    """A first panel that can do with less."""

    def __init__(self):
        super().__init__(10)
        self.compact = False

    def set_compact(self, compact):
        self.compact = compact

    def least_height(self, *, compact):
        return 30 if compact else 50


def test_tracks_are_compact_where_the_first_panel_would_have_no_room_else(app, parts):
    rows = parts["tracks"] = Rows()
    window = QWidget()
    window.resize(500, 500)
    timeline = timeline_in(window, parts)
    window.show()
    assert timeline.minimumSizeHint().height() == 80
    shown = [
        (shown_parts(timeline, parts, height), rows.compact) for height in (200, 180, 100, 200)
    ]
    assert shown == [("rtfb", False), ("rtfb", True), ("rtb", True), ("rtfb", False)]
    window.close()
