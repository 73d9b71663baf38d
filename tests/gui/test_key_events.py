"""Keys that are held, as X11 reports them: commands that happen once, releases that are none."""

import pytest
from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QAction, QKeyEvent, QKeySequence, QShortcutEvent
from PySide6.QtWidgets import QApplication, QLineEdit, QWidget

from forcelab.gui.key_events import AutoRepeatFilter, HeldShortcuts

SPACE = Qt.Key.Key_Space


@pytest.fixture
def field(app):
    widget = QWidget()
    widget.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
    yield widget
    widget.close()


@pytest.fixture
def press(app, field):
    """Press or release a key at a time in ms; the action's shortcut is Space."""
    held = HeldShortcuts(app, unmarked=True)
    held._follow(None, field)
    action = QAction("Play", field)
    done = []
    action.triggered.connect(lambda: done.append(True))
    held.watch(action)

    def press(kind, at, key=SPACE):
        event = QKeyEvent(kind, key, Qt.KeyboardModifier.NoModifier)
        event.setTimestamp(at)
        QApplication.sendEvent(field, event)
        if kind == QEvent.Type.ShortcutOverride and key == SPACE:
            QApplication.sendEvent(action, QShortcutEvent(QKeySequence(SPACE), 0, False))
        return len(done)

    press.click = lambda: (action.trigger(), len(done))[1]
    yield press
    held.deleteLater()


DOWN, UP = QEvent.Type.ShortcutOverride, QEvent.Type.KeyRelease


def test_a_held_key_acts_once_and_again_when_it_is_pressed_again(press):
    assert press(DOWN, 1000) == 1
    for at in range(1660, 2000, 40):
        press(UP, at)
        assert press(DOWN, at) == 1, "its repetition"
    press(UP, 2015)
    assert press(DOWN, 2060) == 2


def test_while_a_key_is_held_a_menu_still_works(press):
    press(DOWN, 1000)
    press(UP, 1660)
    assert press(DOWN, 1660) == 1
    assert press.click() == 2


def test_two_keys_after_one_another_both_count(press):
    press(UP, 1500, Qt.Key.Key_N)
    assert press(DOWN, 1500) == 1


def test_a_key_that_is_held_while_nothing_has_the_keyboard_acts_once(app, until):
    window = QWidget()
    field = QLineEdit(window)
    action = QAction("Play", window)
    held = HeldShortcuts(app, unmarked=True)
    done = []
    action.triggered.connect(lambda: done.append(True))
    held.watch(action)
    window.show()
    window.activateWindow()
    field.setFocus()
    until(field.hasFocus)
    field.clearFocus()  # as Esc does
    assert QApplication.focusWidget() is None
    for at in (1000, 1040, 1080):
        for kind in (UP, DOWN):
            event = QKeyEvent(kind, SPACE, Qt.KeyboardModifier.NoModifier)
            event.setTimestamp(at)
            QApplication.sendEvent(window, event)
        QApplication.sendEvent(action, QShortcutEvent(QKeySequence(SPACE), 0, False))
    assert done == []
    window.close()
    held.deleteLater()


NONE = Qt.KeyboardModifier.NoModifier


def key(kind, at, code=Qt.Key.Key_1, *, marked=False):
    event = QKeyEvent(kind, code, NONE, "", marked)
    event.setTimestamp(at)
    return event


@pytest.fixture
def owner(app):
    owner = QObject()
    yield owner
    owner.deleteLater()


def test_a_key_that_is_held_is_not_let_go_by_its_repetition(owner, until):
    repeats, ups = AutoRepeatFilter(owner, unmarked=True), []
    assert not repeats.repeats(key(QEvent.Type.KeyPress, 1000))
    for at in range(1660, 2000, 40):
        repeats.released(key(QEvent.Type.KeyRelease, at), lambda at=at: ups.append(at))
        assert repeats.repeats(key(QEvent.Type.KeyPress, at))
    assert ups == []
    repeats.released(key(QEvent.Type.KeyRelease, 2015), lambda: ups.append(2015))
    until(lambda: ups == [2015])


def test_what_was_put_off_is_done_before_the_next_key(owner):
    repeats, ups = AutoRepeatFilter(owner, unmarked=True), []
    repeats.released(key(QEvent.Type.KeyRelease, 1500), lambda: ups.append("1"))
    assert not repeats.repeats(key(QEvent.Type.KeyPress, 1500, Qt.Key.Key_2))
    assert ups == ["1"]
    repeats.released(key(QEvent.Type.KeyRelease, 1600), lambda: ups.append("2"))
    assert not repeats.repeats(key(QEvent.Type.KeyPress, 1650)), "pressed again by a finger"
    assert ups == ["1", "2"]


def test_where_repetition_is_marked_a_release_counts_at_once(owner):
    repeats, ups = AutoRepeatFilter(owner, unmarked=False), []
    repeats.released(key(QEvent.Type.KeyRelease, 1500), lambda: ups.append("1"))
    assert ups == ["1"]
    assert repeats.repeats(key(QEvent.Type.KeyPress, 1500, marked=True))
