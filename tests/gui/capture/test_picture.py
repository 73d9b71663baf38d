"""The camera's picture: a frame that has grown old is not shown as if it were now."""

from types import SimpleNamespace

import numpy as np
import pytest
from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QVBoxLayout, QWidget

from forcelab.gui.capture.workspace import CameraView


class Filming(QObject):
    """What a picture asks of a controller."""

    ticked, changed = Signal(), Signal()
    alarms = ()

    recorder = SimpleNamespace(
        cameras=[SimpleNamespace(latest=lambda: (1.0, np.full((48, 64, 3), 200, np.uint8)))]
    )

    @property
    def state(self):
        return SimpleNamespace(cameras=(SimpleNamespace(alarms=self.alarms),))


@pytest.fixture
def filming(app):
    controller, room = Filming(), QWidget()
    picture = CameraView(controller)
    QVBoxLayout(room).addWidget(picture)
    room.resize(200, 160)
    room.show()
    controller.ticked.emit()
    yield controller, picture
    room.close()


def middle(picture):
    image = picture.grab().toImage()
    return image.pixelColor(image.width() // 2, image.height() // 5)


def test_a_picture_that_comes_no_more_is_veiled_until_it_comes_again(filming):
    controller, picture = filming
    live = middle(picture)
    controller.alarms = ("no picture",)
    controller.ticked.emit()
    assert middle(picture) != live
    controller.alarms = ("not written",)  # it is seen all the same
    controller.ticked.emit()
    assert middle(picture) == live
