"""A key that is held, as X11 tells of it, and a command that is to happen once."""

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QAction, QKeyEvent, QKeySequence, QShortcutEvent
from PySide6.QtWidgets import QApplication, QLineEdit, QWidget

from forcelab.gui.key_events import HeldShortcuts

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
    held = HeldShortcuts(app, apart=True)
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
    held = HeldShortcuts(app, apart=True)
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
