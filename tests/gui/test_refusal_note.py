"""Why something is not done, beside the place where it was tried."""

import pytest
from factories import cached_project, make_foam_project
from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit
from window_helpers import PanelMouse

from forcelab.errors import InputError
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.refusal_note import RefusalNote
from forcelab.labels import Segment
from forcelab.project import Project

TRACK = (Segment(0.2, 0.4, "grab"), Segment(0.5, 0.7, "hold"))


@pytest.fixture
def window(window_of_file, tmp_path):
    path = cached_project(make_foam_project, tmp_path / "study.forcelab", (("Ann", TRACK),))
    window = window_of_file(LaunchOptions(project=path), size=(1024, 640))
    window.activateWindow()
    window.label.tracks.setFocus()
    return window


@pytest.fixture
def note(window):
    return window.findChild(RefusalNote)


def below(note, widget, box):
    """Whether the note is just below a box of a widget, within the window."""
    corner = widget.mapTo(note.window(), box.bottomLeft())
    inside = note.window().rect().contains(note.geometry())
    return inside and 0 < note.geometry().top() - corner.y() < 10


def test_a_stroke_without_time_is_refused_below_the_own_track(app, window, note):
    tracks, document = window.label.tracks, window.document
    document.view.seek(0.45)
    for _ in range(2):
        QTest.keyClick(tracks, Qt.Key.Key_1)
    assert note.isVisible()
    assert note.text() == "A segment needs time: move the cursor before you end it."
    box = tracks.rows()[0].box.toRect()
    assert below(note, tracks, box)
    cursor = tracks.mapTo(window, QPointF(tracks.x_at(0.45), 0)).x()
    assert abs(note.x() - cursor) < 4
    app.processEvents()
    QTest.keyClick(tracks, Qt.Key.Key_Right)
    assert not note.isVisible()


def test_it_stays_on_the_track_where_a_list_has_the_keyboard(window, note):
    actions = window.label.vocabulary.list
    actions.setFocus()
    actions.setCurrentIndex(actions.model().index(0, 0))
    for _ in range(2):
        QTest.keyClick(actions, Qt.Key.Key_1)
    assert note.isVisible()
    assert note.text().startswith("A segment needs time")
    assert below(note, window.label.tracks, window.label.tracks.rows()[0].box.toRect())


def test_an_action_that_exists_is_refused_below_the_field(app, window, note):
    window.document.add_actions("zip")
    entry = window.label.vocabulary.entry
    entry.setFocus()
    QTest.keyClicks(entry, "zip")
    QTest.keyClick(entry, Qt.Key.Key_Return)
    assert note.isVisible()
    assert note.text() == "The action 'zip' already exists."
    assert below(note, entry, entry.rect())
    app.processEvents()
    QTest.keyClicks(entry, "ped")
    QTest.keyClick(entry, Qt.Key.Key_Return)
    assert "zipped" in window.document.vocabulary
    assert not note.isVisible()


def test_a_time_that_cannot_be_is_refused_at_its_row(app, window, note):
    table = window.label.segments.table
    box = table.visualRect(table.model().index(1, 2))
    QTest.mouseClick(table.viewport(), Qt.MouseButton.LeftButton, pos=box.center())
    QTest.mouseDClick(table.viewport(), Qt.MouseButton.LeftButton, pos=box.center())
    editor = table.viewport().findChild(QLineEdit)
    editor.selectAll()
    QTest.keyClicks(editor, "77")
    QTest.keyClick(editor, Qt.Key.Key_Return)
    app.processEvents()  # the table carries out what was typed a moment later
    assert note.isVisible()
    assert note.text().startswith("77 s is outside the demonstration")
    top = table.viewport().mapTo(window, box.topLeft()).y()
    assert top < note.y() < top + 3 * box.height() or note.geometry().bottom() < top


def test_a_stroke_that_the_store_refuses_goes_on_and_the_note_says_why(
    app, window, note, monkeypatch
):
    def full(*_, **__):
        raise InputError("The disk is full.")

    tracks, document = window.label.tracks, window.document
    document.view.seek(0.75)
    QTest.keyClick(tracks, Qt.Key.Key_1)
    document.view.seek(0.9)
    with monkeypatch.context() as broken:
        broken.setattr(document.project.tracks, "edit", full)
        QTest.keyClick(tracks, Qt.Key.Key_1)
    assert document.stroke is not None
    app.processEvents()
    assert note.isVisible()
    assert note.text() == "The disk is full."
    QTest.keyClick(tracks, Qt.Key.Key_1)
    assert document.stroke is None
    assert not note.isVisible()


def test_what_another_window_changed_is_refused_where_it_was_tried(app, window, note):
    project, actions = window.document.project, window.label.vocabulary
    # On a busy machine it may see what the other one does before it is tried.
    window._poll_timer.stop()
    with Project.open(project.path) as other:
        other.actions.add("foam", ["press"])
    actions.list.setFocus()
    actions.list.setCurrentIndex(actions.list.model().index(1, 0))
    assert not actions.recolour("hold", "#123456")
    app.processEvents()
    assert note.isVisible()
    assert "changed elsewhere" in note.text()
    viewport = actions.list.viewport()
    window._poll_timer.start()
    assert below(note, viewport, actions.list.visualRect(actions.list.currentIndex()))


def test_an_edit_by_the_mouse_is_refused_below_the_track(window, note, monkeypatch):
    tracks = window.label.tracks
    row = tracks.rows()[0].box
    project = window.document.project

    def full(*_, **__):
        raise InputError("The disk is full.")

    monkeypatch.setattr(project.tracks, "edit", full)
    window.document.set_action("hold")
    hand = PanelMouse(tracks)
    hand.press(0.75)
    hand.move(0.95)
    hand.release(0.95)
    assert window.document.editor.segments == TRACK
    assert note.isVisible()
    assert below(note, tracks, row.toRect())


def test_it_is_not_shown_where_the_place_cannot_be_seen(window, note):
    window.document.refuse("here")
    assert note.isVisible()
    window.show_workspace("capture")
    assert not note.isVisible()
    window.document.refuse("not here")
    assert not note.isVisible()
    assert window.statusBar().currentMessage() == "not here"
