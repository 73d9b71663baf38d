"""Windows within their screens, and texts within their boxes."""

from functools import partial
from types import SimpleNamespace

import pytest
from PySide6.QtCore import QRect, QSize, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialog, QLabel, QVBoxLayout, QWidget

from forcelab.gui.layout import (
    FRAME,
    copyable,
    muted_label,
    placeholder,
    push_button,
    resize_on_screen,
    toned_label,
)

SMALL = QRect(0, 0, 960, 540)


class OnSmallScreen(QWidget):
    def screen(self):
        return SimpleNamespace(availableGeometry=lambda: SMALL)


@pytest.mark.parametrize(
    ("expected", "size"),
    [
        (QSize(600, 400), QSize(600, 400)),
        (QSize(680, 560), QSize(680, 540 - FRAME.height())),
        (QSize(1280, 800), SMALL.size() - FRAME),
    ],
)
def test_a_window_is_no_larger_than_its_screen_with_its_frame(app, expected, size):
    window = OnSmallScreen()
    resize_on_screen(window, expected)
    assert window.size() == size
    window.deleteLater()


@pytest.mark.parametrize(
    "make", [copyable, muted_label, placeholder, partial(toned_label, "warning")]
)
def test_a_name_that_looks_like_markup_is_shown_as_it_is(app, make):
    messages = "Nobody labelled <b>this</b> here."
    room = QLabel(messages, textFormat=Qt.TextFormat.PlainText).sizeHint().width()
    label = make(messages)
    label.setWordWrap(False)
    assert label.sizeHint().width() >= room


@pytest.mark.parametrize(("room", "pressed"), [(QWidget, False), (QDialog, True)])
def test_enter_presses_a_button_in_dialogs_alone(app, room, pressed):
    window, presses = room(), []
    button = push_button("Record", lambda: presses.append(True))
    QVBoxLayout(window).addWidget(button)
    window.show()
    button.setFocus()
    QTest.keyClick(button, Qt.Key.Key_Return)
    assert bool(presses) is pressed
    window.close()
    window.deleteLater()
