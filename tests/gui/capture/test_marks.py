"""The keys of actions while something is recorded: held, or tapped to begin and to end."""

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication, QWidget

from forcelab.capture.live_marks import LiveMarks, marks_track
from forcelab.gui.capture.marks import EventTimes, HeldKeys
from forcelab.vocabulary import Vocabulary

GRAB, PULL = Qt.Key.Key_1, Qt.Key.Key_2
DOWN, UP = QEvent.Type.KeyPress, QEvent.Type.KeyRelease


class Page(QWidget):
    """A page whose keys mark, by stamps in ms."""

    def __init__(self):
        super().__init__()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.marks, self.recording = LiveMarks(), True
        self.held_keys = HeldKeys(
            self, lambda: Vocabulary().with_actions("grab", "pull"), self.mark
        )
        self.held_keys._follow(None, self)

    def mark(self, action, down, at):
        if self.recording:
            self.marks.press(action, down, at)
        return self.recording

    def forget(self):
        """As the Capture workspace does it."""
        action, since = self.marks.current()
        self.mark(action, False, since)
        self.held_keys.forget(action)

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
    created = Page()
    created.show()
    yield created
    created.close()


def segments_of(page, end):
    page.marks.end(end / 1000)
    return [(s.action, round(1000 * s.start), round(1000 * s.end)) for s in page.marks.segments]


def test_a_tap_begins_and_the_next_one_of_the_same_key_ends(page):
    page.tap(GRAB, 1000)
    page.tap(GRAB, 3000)
    assert page.held_keys.tapped_action is None
    assert segments_of(page, 9000) == [("grab", 1000, 3000)]


def test_a_tap_of_another_key_ends_it_and_begins_its_own_which_ends_with_the_recording(page):
    page.tap(GRAB, 1000)
    page.tap(PULL, 3000)
    assert page.held_keys.tapped_action == "pull"
    assert segments_of(page, 9000) == [("grab", 1000, 3000), ("pull", 3000, 9000)]


def test_a_held_key_marks_until_it_is_let_go_also_after_a_tap(page):
    page.tap(GRAB, 1000)
    page.key(DOWN, PULL, 3000)
    page.key(UP, PULL, 4000)
    assert segments_of(page, 9000) == [("grab", 1000, 3000), ("pull", 3000, 4000)]


def test_what_a_tap_began_is_forgotten_with_the_recording(page):
    page.tap(GRAB, 1000)
    page.recording = False
    page.tap(GRAB, 2000)
    page.held_keys.forget_tap()
    page.recording, page.marks = True, LiveMarks()
    page.tap(GRAB, 3000)
    assert segments_of(page, 4000) == [("grab", 3000, 4000)]


def test_a_repetition_that_is_read_as_a_release_and_a_press_is_no_tap(page):
    page.key(DOWN, GRAB, 1000)
    for at in range(1100, 1800, 40):
        page.key(UP, GRAB, at)
        page.key(DOWN, GRAB, at + 2)
    page.key(UP, GRAB, 1900)
    assert segments_of(page, 9000) == [("grab", 1000, 1900)]


def test_what_a_tap_began_goes_on_while_the_keyboard_is_elsewhere(page):
    page.tap(GRAB, 1000)
    page.held_keys.release_all()
    page.tap(GRAB, 3000)
    assert segments_of(page, 9000) == [("grab", 1000, 3000)]


def test_what_a_tap_began_can_be_forgotten_and_the_next_tap_begins_anew(page):
    page.tap(GRAB, 1000)
    page.forget()
    assert page.held_keys.tapped_action is None
    assert page.marks.track(9.0) == []
    page.tap(GRAB, 3000)
    page.tap(GRAB, 4000)
    assert segments_of(page, 9000) == [("grab", 3000, 4000)]


def test_of_a_held_key_that_is_forgotten_the_release_marks_nothing(page):
    page.key(DOWN, GRAB, 1000)
    page.forget()
    page.key(UP, GRAB, 1100)
    assert page.held_keys.tapped_action is None, "it was no tap either"
    page.tap(GRAB, 3000)
    page.tap(GRAB, 4000)
    assert segments_of(page, 9000) == [("grab", 3000, 4000)]


@pytest.mark.parametrize("forgotten", ["above", "below"])
def test_of_two_held_keys_the_one_that_counts_is_forgotten(page, forgotten):
    page.key(DOWN, GRAB, 1000)
    page.key(DOWN, PULL, 2000)
    if forgotten == "above":
        page.forget()
        expected = [("grab", 1000, 5000)]
        page.key(UP, PULL, 3000)
    else:
        page.key(UP, PULL, 3000)
        page.forget()
        expected = [("grab", 1000, 2000), ("pull", 2000, 3000)]
    page.key(UP, GRAB, 5000)
    assert segments_of(page, 9000) == expected


def test_what_is_kept_of_forgotten_marks_is_what_was_seen(page):
    """A recording is kept from its journal, where marks stand by their times."""
    noted = []
    mark_page = page.mark
    page.held_keys._mark = lambda *mark: noted.append(mark) or mark_page(*mark)
    page.mark = page.held_keys._mark
    page.tap(PULL, 500)
    page.forget()
    page.key(DOWN, GRAB, 1000)
    page.key(DOWN, PULL, 2000)
    page.key(UP, PULL, 3000)
    page.forget()
    page.key(UP, GRAB, 5000)
    page.tap(PULL, 6000)
    page.tap(PULL, 7000)
    marks = [dict(zip(("action", "down", "at"), mark, strict=True)) for mark in noted]
    saved = marks_track(marks, 0.0, 9.0, "Ann").segments
    assert [(s.action, s.start, s.end) for s in saved] == [
        ("grab", 1.0, 2.0), ("pull", 2.0, 3.0), ("pull", 6.0, 7.0),
    ]  # fmt: skip
    assert [(a, s / 1000, e / 1000) for a, s, e in segments_of(page, 9000)] == [
        (s.action, s.start, s.end) for s in saved
    ]


def test_keys_are_stamped_by_the_window_system_however_late_the_window_hears_of_them():
    times = EventTimes()
    assert times.at(0, 12.5) == 12.5  # no stamp
    assert times.at(5000, 100.02) == pytest.approx(100.02)
    assert times.at(5500, 100.5) == pytest.approx(100.5)  # sooner: better known now
    assert times.at(6000, 101.2) == pytest.approx(101.0)
    assert times.at(6500, 101.502) == pytest.approx(101.5)
    assert times.at(100, 150.0) == pytest.approx(150.0)  # the clock began anew
    assert times.at(200, 150.3) == pytest.approx(150.1)
