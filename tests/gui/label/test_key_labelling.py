"""Painting by keys: real key events in a real window."""

import numpy as np
import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QDockWidget,
    QLineEdit,
    QListWidget,
    QMainWindow,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)
from window_helpers import open_foam_document, stored_rows

from forcelab.gui.label.key_labelling import KeyLabelling
from forcelab.gui.label.tracks import TrackPanel
from forcelab.gui.preferences import HOLD_TIME, REACTION_TIME
from forcelab.vocabulary import Vocabulary

GRAB, HOLD, RELEASE = Qt.Key.Key_1, Qt.Key.Key_2, Qt.Key.Key_3
NONE = Qt.KeyboardModifier.NoModifier


@pytest.fixture
def document(app):
    with open_foam_document() as document:
        yield document


class Desk:
    """A window with a track, a list and fields, and a coder's hand on the keys."""

    def __init__(self, document):
        self.document = document
        self.now = 0.0
        self.window = QMainWindow()
        self.panel = TrackPanel(document)
        self.list, self.line, self.spin = QListWidget(), QLineEdit(), QSpinBox()
        self.list.addItems(["1 one", "2 two"])
        column = QVBoxLayout()
        for widget in (self.panel, self.list, self.line, self.spin):
            column.addWidget(widget)
        inside = QWidget()
        inside.setLayout(column)
        self.window.setCentralWidget(inside)
        self.keys = KeyLabelling(document, self.window, lambda: 100.0, clock=lambda: self.now)
        self.window.show()
        self.window.activateWindow()
        self.go(self.panel)

    def go(self, widget):
        widget.setFocus()
        QApplication.processEvents()

    @property
    def target(self):
        return QApplication.focusWidget() or self.window

    def press(self, key):
        QTest.keyPress(self.target, key)

    def release(self, key):
        QTest.keyRelease(self.target, key)

    def repeat(self, key, *kinds):
        """What a system sends again and again while a key is held."""
        for kind in kinds:
            QApplication.sendEvent(self.target, QKeyEvent(kind, key, NONE, "", autorep=True))

    def tap(self, key, at=None):
        if at is not None:
            self.document.view.seek(at)
        self.press(key)
        self.now += 0.05
        self.release(key)


@pytest.fixture
def desk(document):
    desk = Desk(document)
    yield desk
    desk.window.close()
    desk.window.deleteLater()


def test_press_to_begin_and_again_to_end_and_another_key_does_both_at_once(document, desk):
    desk.tap(GRAB, 1.0)
    assert stored_rows(document) == []
    desk.tap(HOLD, 2.0)
    desk.tap(RELEASE, 3.0)
    desk.tap(RELEASE, 4.0)
    assert document.stroke is None
    assert stored_rows(document) == [(1.0, 2.0, "grab"), (2.0, 3.0, "hold"), (3.0, 4.0, "release")]


def test_thinking_better_of_the_action_on_the_spot(document, desk):
    desk.tap(GRAB, 1.0)
    desk.tap(HOLD)
    desk.tap(HOLD, 2.0)
    assert stored_rows(document) == [(1.0, 2.0, "hold")]


def test_hold_for_as_long_as_the_action_lasts(document, desk):
    document.view.set_playing(True)
    document.view.seek(1.0)
    desk.press(GRAB)
    for step in range(1, 6):
        desk.repeat(GRAB, QEvent.Type.KeyPress, QEvent.Type.KeyRelease)
        document.view.seek(1.0 + step / 10)
        desk.now += 0.1
    assert stored_rows(document) == []
    desk.release(GRAB)
    assert stored_rows(document) == [(1.0, 1.5, "grab")]
    assert document.stroke is None


@pytest.mark.parametrize(("moved", "seconds"), [(0.1, HOLD_TIME.value / 1000 - 0.01), (0.0, 3.0)])
def test_a_short_press_or_one_without_moving_is_no_hold(document, desk, moved, seconds):
    document.view.seek(1.0)
    desk.press(GRAB)
    document.view.seek(1.0 + moved)
    desk.now += seconds
    desk.release(GRAB)
    assert document.stroke is not None
    assert stored_rows(document) == []


def test_the_key_of_the_next_action_can_be_held_too(document, desk):
    desk.tap(GRAB, 1.0)
    document.view.seek(2.0)
    desk.press(HOLD)
    document.view.seek(2.5)
    desk.now += 1.0
    desk.release(HOLD)
    assert stored_rows(document) == [(1.0, 2.0, "grab"), (2.0, 2.5, "hold")]
    assert document.stroke is None


def test_two_keys_held_one_after_the_other_leave_none_behind(document, desk):
    document.view.seek(1.0)
    desk.press(GRAB)
    document.view.seek(2.0)
    desk.now += 1.0
    desk.press(HOLD)
    desk.release(GRAB)
    document.view.seek(3.0)
    desk.now += 1.0
    desk.release(HOLD)
    assert stored_rows(document) == [(1.0, 2.0, "grab"), (2.0, 3.0, "hold")]


def test_a_range_is_filled_and_forgotten(document, desk):
    document.view.set_range(3.0, 4.0)
    desk.tap(HOLD)
    assert stored_rows(document) == [(3.0, 4.0, "hold")]
    assert document.view.range is None
    assert document.stroke is None


@pytest.mark.parametrize("cursor", [1.5, 5.0])  # the latter as by its menu
def test_the_selected_segment_is_relabelled_also_from_afar(document, desk, cursor):
    document.editor.paint(1.0, 2.0, "grab")
    document.view.seek(cursor)
    document.select(0)
    desk.tap(HOLD)
    assert stored_rows(document) == [(1.0, 2.0, "hold")]
    assert document.stroke is None


@pytest.mark.parametrize("left", [False, True])
def test_while_playing_a_selected_segment_is_not_relabelled_nor_after_it(document, desk, left):
    document.editor.paint(1.0, 2.0, "grab")
    document.view.seek(1.5)
    document.select(0)
    document.view.set_playing(True)
    if left:
        document.view.seek(5.0)
        document.view.set_playing(False)
    desk.tap(HOLD)
    assert stored_rows(document) == [(1.0, 2.0, "grab")]
    assert document.stroke is not None


def test_keys_paint_from_a_list_that_was_taken_out_of_the_window(document, desk):
    dock = QDockWidget("list", desk.window)
    dock.setWidget(desk.list)
    desk.window.addDockWidget(Qt.DockWidgetArea.RightDockWidgetArea, dock)
    dock.setFloating(True)
    dock.show()
    dock.activateWindow()
    desk.go(desk.list)
    desk.tap(GRAB, 1.0)
    desk.tap(GRAB, 2.0)
    assert stored_rows(document) == [(1.0, 2.0, "grab")]


def test_keys_do_nothing_while_another_workspace_is_shown(document):
    window = QMainWindow()
    keys = KeyLabelling(document, window, lambda: 100.0, shown=lambda: False)
    window.show()
    QTest.keyClick(window, GRAB)
    assert document.stroke is None
    assert keys.press("1")
    window.close()
    window.deleteLater()


def test_a_stroke_that_is_on_is_ended_inside_a_selected_segment(document, desk):
    document.editor.paint(2.0, 3.0, "hold")
    desk.tap(GRAB, 1.0)
    document.view.seek(2.5)
    document.select(0)
    desk.tap(GRAB)
    assert stored_rows(document) == [(1.0, 2.5, "grab"), (2.5, 3.0, "hold")]


def test_esc_forgets_the_stroke(document, desk):
    desk.tap(GRAB, 1.0)
    desk.tap(Qt.Key.Key_Escape, 2.0)
    assert document.stroke is None
    assert stored_rows(document) == []


def test_while_playing_the_reaction_time_is_taken_off(document, desk):
    REACTION_TIME.set_value(200)
    document.view.set_speed(0.5)
    document.view.set_playing(True)
    desk.tap(GRAB, 1.0)
    desk.tap(GRAB, 2.0)
    assert stored_rows(document) == [(0.9, 1.9, "grab")]


def test_the_reaction_time_never_turns_a_stroke_around(document, desk):
    REACTION_TIME.set_value(500)
    document.view.seek(1.0)
    desk.tap(GRAB)  # paused: begins at 1.0 s
    document.view.set_playing(True)
    desk.tap(HOLD, 1.2)  # 0.7 s is meant, before the beginning
    desk.tap(HOLD, 2.5)
    assert stored_rows(document) == [(1.0, 2.0, "hold")]


def test_paused_a_cursor_off_every_sample_snaps_to_what_is_near(document, desk):
    document.view.contacts = np.array([1.0])
    desk.tap(GRAB, 1.0043)  # a thousand pixels show 10 s: within 8 pixels of the contact
    desk.tap(GRAB, 2.0043)  # nothing near but samples
    assert stored_rows(document) == [(1.0, 2.0, "grab")]


def test_a_cursor_on_a_sample_or_frame_is_taken_as_it_is(document, desk):
    document.view.contacts = np.array([1.0])
    document.view.set_frame_times(np.arange(0, 10, 1 / 30))
    desk.tap(GRAB, 1.01)
    desk.tap(GRAB, 61 / 30)
    assert stored_rows(document) == [(1.01, round(61 / 30, 6), "grab")]


def test_without_snapping_the_cursor_is_taken_as_it_is(document, desk):
    document.view.set_snapping(False)
    desk.tap(GRAB, 1.0043)
    desk.tap(GRAB, 2.0043)
    assert stored_rows(document) == [(1.0043, 2.0043, "grab")]


def test_keys_typed_as_text_paint_nothing(document, desk):
    for field in (desk.line, desk.spin):
        desk.go(field)
        desk.tap(GRAB, 1.0)
        assert document.stroke is None
    assert desk.line.text() == "1"


def test_a_list_does_not_keep_the_keys_of_actions(document, desk):
    desk.go(desk.list)
    desk.tap(GRAB, 1.0)
    assert document.stroke is not None
    assert desk.list.currentRow() in (-1, 0)


def test_keys_with_ctrl_or_without_an_action_are_left_to_others_and_the_keypad_counts(
    document, desk
):
    QTest.keyClick(desk.panel, GRAB, Qt.KeyboardModifier.ControlModifier)
    QTest.keyClick(desk.panel, Qt.Key.Key_Q)
    assert document.stroke is None
    QTest.keyClick(desk.panel, GRAB, Qt.KeyboardModifier.KeypadModifier)
    assert document.stroke is not None


def test_no_key_is_stuck_when_the_focus_goes(document, desk):
    document.view.seek(1.0)
    desk.press(GRAB)
    QApplication.sendEvent(desk.window, QEvent(QEvent.Type.WindowDeactivate))
    document.view.seek(2.0)
    desk.now += 1.0
    desk.release(GRAB)
    assert stored_rows(document) == []  # the stroke goes on until it is ended
    desk.tap(GRAB, 3.0)
    assert stored_rows(document) == [(1.0, 3.0, "grab")]


def test_a_key_let_go_in_a_text_field_is_heard(document, desk):
    document.view.seek(1.0)
    desk.press(GRAB)
    desk.go(desk.line)
    document.view.seek(2.0)
    desk.now += 1.0
    desk.release(GRAB)
    assert stored_rows(document) == [(1.0, 2.0, "grab")]


def test_a_key_is_let_go_after_the_project_was_closed(document, desk):
    document.view.seek(1.0)
    desk.press(GRAB)
    path = document.project.path
    document.close()
    desk.now += 1.0
    desk.release(GRAB)
    desk.tap(HOLD)
    assert document.stroke is None
    document.open_project(path)


def test_a_held_arrow_is_left_to_lists_though_an_action_has_no_key(document, desk):
    document.set_vocabulary(document.vocabulary.rebound(document.vocabulary.names[0], ""))
    desk.go(desk.list)
    desk.list.setCurrentRow(0)
    desk.repeat(Qt.Key.Key_Down, QEvent.Type.KeyPress)
    assert desk.list.currentRow() == 1


def test_a_key_that_is_held_on_x11_paints_one_segment(document, monkeypatch, until):
    monkeypatch.setattr("forcelab.gui.key_events.QGuiApplication.platformName", lambda: "xcb")
    desk = Desk(document)

    def send(kind, at):
        event = QKeyEvent(kind, GRAB, NONE, "")
        event.setTimestamp(at)
        QApplication.sendEvent(desk.panel, event)

    document.view.seek(1.0)
    send(QEvent.Type.KeyPress, 1000)
    for at in range(1660, 1900, 40):  # repetition that Qt has not known as such
        desk.now = at / 1000
        document.view.seek(1.0 + (at - 1000) / 1000)
        send(QEvent.Type.KeyRelease, at)
        send(QEvent.Type.KeyPress, at)
    assert stored_rows(document) == []
    desk.now = 2.0
    document.view.seek(2.0)
    send(QEvent.Type.KeyRelease, 2000)
    document.view.seek(2.3)  # what is waited for does not move the end
    until(lambda: bool(stored_rows(document)))
    assert [(start, end) for start, end, *_ in stored_rows(document)] == [(1.0, 2.0)]
    desk.window.close()
    desk.window.deleteLater()


def test_a_key_says_what_to_do_where_there_is_no_action(document, desk, messages):
    desk.press(Qt.Key.Key_Space)
    assert messages == []
    desk.press(Qt.Key.Key_9)
    sentence = "No action has the key 9; the list of actions shows their keys."
    assert messages == [(sentence, True)]
    for segment in reversed(document.editor.segments):
        document.editor.delete(document.editor.index_of(segment))
    document.set_vocabulary(Vocabulary())
    for key in (Qt.Key.Key_Space, Qt.Key.Key_Down, Qt.Key.Key_F2):  # which none could paint with
        desk.press(key)
    assert "add one under Actions" not in messages[-1][0]
    desk.press(GRAB)
    assert document.stroke is None
    assert messages[-1][1]
    assert "add one under Actions" in messages[-1][0]
    assert messages[-1][0] == document.local_message  # which is not said of the next demonstration
