"""Keys that are held, as X11 tells of them."""

import pytest
from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent

from forcelab.gui.key_events import AutoRepeatFilter

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
    repeats, ups = AutoRepeatFilter(owner, apart=True), []
    assert not repeats.repeats(key(QEvent.Type.KeyPress, 1000))
    for at in range(1660, 2000, 40):
        repeats.released(key(QEvent.Type.KeyRelease, at), lambda at=at: ups.append(at))
        assert repeats.repeats(key(QEvent.Type.KeyPress, at))
    assert ups == []
    repeats.released(key(QEvent.Type.KeyRelease, 2015), lambda: ups.append(2015))
    until(lambda: ups == [2015])


def test_what_was_put_off_is_done_before_the_next_key(owner):
    repeats, ups = AutoRepeatFilter(owner, apart=True), []
    repeats.released(key(QEvent.Type.KeyRelease, 1500), lambda: ups.append("1"))
    assert not repeats.repeats(key(QEvent.Type.KeyPress, 1500, Qt.Key.Key_2))
    assert ups == ["1"]
    repeats.released(key(QEvent.Type.KeyRelease, 1600), lambda: ups.append("2"))
    assert not repeats.repeats(key(QEvent.Type.KeyPress, 1650)), "pressed again by a finger"
    assert ups == ["1", "2"]


def test_where_repetition_is_marked_a_release_counts_at_once(owner):
    repeats, ups = AutoRepeatFilter(owner, apart=False), []
    repeats.released(key(QEvent.Type.KeyRelease, 1500), lambda: ups.append("1"))
    assert ups == ["1"]
    assert repeats.repeats(key(QEvent.Type.KeyPress, 1500, marked=True))
