"""The keys of actions while something is recorded: held, or tapped to begin and to end."""

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication, QWidget

from forcelab.capture.marking import LiveMarks
from forcelab.gui.capture.marks import HeldKeys
from forcelab.vocabulary import Vocabulary

GRAB, PULL = Qt.Key.Key_1, Qt.Key.Key_2
DOWN, UP = QEvent.Type.KeyPress, QEvent.Type.KeyRelease


class Page(QWidget):
    """A page whose keys mark, by stamps in ms."""

    def __init__(self):
        super().__init__()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.marks, self.recording = LiveMarks(), True
        self.held = HeldKeys(self, lambda: Vocabulary().with_actions("grab", "pull"), self.mark)
        self.held._follow(None, self)

    def mark(self, action, down, at):
        if self.recording:
            self.marks.press(action, down, at)
        return self.recording

    def key(self, kind, key, at):
        event = QKeyEvent(kind, key, Qt.KeyboardModifier.NoModifier)
        event.setTimestamp(at)
        QApplication.sendEvent(self, event)

    def tap(self, key, at):
        self.key(DOWN, key, at)
        self.key(UP, key, at + 7)


@pytest.fixture
def page(app, monkeypatch):
    monkeypatch.setattr("forcelab.gui.capture.marks.time.monotonic", lambda: 0.0)
    stamped = "forcelab.gui.capture.marks.EventTimes.at"
    monkeypatch.setattr(stamped, lambda _, stamp, __: stamp / 1000)
    made = Page()
    made.show()
    yield made
    made.close()


def told(page, end):
    page.marks.end(end / 1000)
    return [(s.action, round(1000 * s.start), round(1000 * s.end)) for s in page.marks.segments]


def test_a_tap_begins_and_the_next_one_of_the_same_key_ends(page):
    page.tap(GRAB, 1000)
    page.tap(GRAB, 3000)
    assert page.held.begun is None
    assert told(page, 9000) == [("grab", 1000, 3000)]


def test_a_tap_of_another_key_ends_it_and_begins_its_own_which_ends_with_the_recording(page):
    page.tap(GRAB, 1000)
    page.tap(PULL, 3000)
    assert page.held.begun == "pull"
    assert told(page, 9000) == [("grab", 1000, 3000), ("pull", 3000, 9000)]


def test_a_held_key_marks_until_it_is_let_go_also_after_a_tap(page):
    page.tap(GRAB, 1000)
    page.key(DOWN, PULL, 3000)
    page.key(UP, PULL, 4000)
    assert told(page, 9000) == [("grab", 1000, 3000), ("pull", 3000, 4000)]


def test_what_a_tap_began_is_forgotten_with_the_recording(page):
    page.tap(GRAB, 1000)
    page.recording = False
    page.tap(GRAB, 2000)
    page.held.forget_begun()
    page.recording, page.marks = True, LiveMarks()
    page.tap(GRAB, 3000)
    assert told(page, 4000) == [("grab", 3000, 4000)]


def test_a_repetition_that_is_read_as_a_release_and_a_press_is_no_tap(page):
    page.key(DOWN, GRAB, 1000)
    for at in range(1100, 1800, 40):
        page.key(UP, GRAB, at)
        page.key(DOWN, GRAB, at + 2)
    page.key(UP, GRAB, 1900)
    assert told(page, 9000) == [("grab", 1000, 1900)]


def test_what_a_tap_began_goes_on_while_the_keyboard_is_elsewhere(page):
    page.tap(GRAB, 1000)
    page.held.release_all()
    page.tap(GRAB, 3000)
    assert told(page, 9000) == [("grab", 1000, 3000)]
