"""Windows within their screens, and texts within their boxes."""

from types import SimpleNamespace

import pytest
from PySide6.QtCore import QRect, QSize
from PySide6.QtWidgets import QWidget

from forcelab.gui.arranging import FRAME, resize_on_screen

SMALL = QRect(0, 0, 960, 540)


class OnSmallScreen(QWidget):
    def screen(self):
        return SimpleNamespace(availableGeometry=lambda: SMALL)


@pytest.mark.parametrize(
    ("wanted", "got"),
    [
        (QSize(600, 400), QSize(600, 400)),
        (QSize(680, 560), QSize(680, 540 - FRAME.height())),
        (QSize(1280, 800), SMALL.size() - FRAME),
    ],
)
def test_a_window_is_no_larger_than_its_screen_with_its_frame(app, wanted, got):
    window = OnSmallScreen()
    resize_on_screen(window, wanted)
    assert window.size() == got
    window.deleteLater()
