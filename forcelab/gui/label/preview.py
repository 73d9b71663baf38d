"""A video that is stepped through on its own clock, whatever the cursor does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QSignalBlocker, QSize, Qt
from PySide6.QtGui import QImage
from PySide6.QtWidgets import (
    QDoubleSpinBox,
    QHBoxLayout,
    QLabel,
    QSlider,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.label.frames import Frames
from forcelab.gui.label.picture_view import PictureView
from forcelab.project.loading import said_of_film
from forcelab.video.index import SAME

__all__ = ["VideoPreview"]


class VideoPreview(QWidget):
    """A frame, and a slider, a number and buttons that choose it.

    Attributes
    ----------
    times : ndarray, shape (n,)
        The frames' own timestamps in s; empty until the video is open.
    number : int
        Of the frame that is chosen, from 0.
    """

    def __init__(self) -> None:
        super().__init__()
        self.times: NDArray[np.float64] = np.empty(0)
        self.number = 0
        self._wanted = 0.0
        self._film, self._name = Path(), ""
        self.frames = Frames(self)
        self.picture = _Picture("Opening the video…")
        self.picture.setAccessibleName("Frame of the video")
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setAccessibleName("Frame")
        self.spin = QDoubleSpinBox()
        self.spin.setDecimals(3)
        self.spin.setSuffix(" s")
        self.spin.setKeyboardTracking(False)
        self.spin.setAccessibleName("Time on the video's own clock")
        self.back, self.on = QToolButton(), QToolButton()
        for button, arrow, name, step in (
            (self.back, Qt.ArrowType.LeftArrow, "Frame before", -1),
            (self.on, Qt.ArrowType.RightArrow, "Next frame", 1),
        ):
            button.setArrowType(arrow)
            button.setAutoRepeat(True)
            button.setToolTip(name)
            button.setAccessibleName(name)
            button.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
            button.clicked.connect(lambda _=False, step=step: self.show_frame(self.number + step))
        label = QLabel("&Video time")
        label.setBuddy(self.spin)
        row = QHBoxLayout()
        row.addWidget(label)
        row.addWidget(self.spin)
        row.addWidget(self.back)
        row.addWidget(self.on)
        row.addStretch(1)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.picture, 1)
        column.addWidget(self.slider)
        column.addLayout(row)
        for control in self._controls:
            control.setEnabled(False)
        self.frames.opened.connect(self._opened)
        self.frames.frame_ready.connect(self._shown)
        self.frames.failed.connect(self._say)
        self.frames.missed.connect(lambda _, sentence: self._say(sentence))
        self.slider.valueChanged.connect(self.show_frame)
        self.spin.valueChanged.connect(self.show_time)

    @property
    def time(self) -> float:
        """The chosen frame's own time, s."""
        return float(self.times[self.number]) if self.times.size else 0.0

    def open(self, path: Path, demonstration: str) -> None:
        """Show a video, that of the demonstration of a name."""
        self._film, self._name = path, demonstration
        self.frames.open(path)

    def show_time(self, time: float) -> None:
        """Choose the last frame at or before a time (s) on the video's clock."""
        self._wanted = time
        # The number on screen has three decimals: half a millisecond is the same frame.
        self.show_frame(int(np.searchsorted(self.times, time + 5e-4 + SAME, side="right")) - 1)

    def show_frame(self, number: int) -> None:
        """Choose a frame by its number; the nearest one that there is."""
        if self.times.size == 0:
            return
        number = min(max(number, 0), self.times.size - 1)
        direction = int(np.sign(number - self.number))
        self.number = number
        image = self.frames.want(number, direction)
        if image is not None:
            self._shown(number, image)
        self._tell()

    def close_video(self) -> None:
        """Let go of the file; no thread is left."""
        self.frames.close()

    @property
    def _controls(self) -> tuple[QWidget, ...]:
        return (self.slider, self.spin, self.back, self.on)

    def _opened(self, times: NDArray[np.float64]) -> None:
        """The video can be shown: begin at the frame that was asked for."""
        self.times = times
        for widget in self._controls:
            widget.setEnabled(True)
        with QSignalBlocker(self.slider), QSignalBlocker(self.spin):
            self.slider.setRange(0, times.size - 1)
            self.slider.setPageStep(max(times.size // 20, 1))
            self.spin.setRange(float(times[0]), float(np.ceil(1000 * times[-1]) / 1000))
            self.spin.setSingleStep(float(np.median(np.diff(times))) if times.size > 1 else 1.0)
        self.show_time(self._wanted)

    def _shown(self, number: int, image: QImage) -> None:
        """A frame is there."""
        if number == self.number:
            told = f"frame {number + 1} of {max(self.times.size, 1)}"
            self.picture.show_image(image, told)

    def _say(self, sentence: str) -> None:
        """Tell what stands in the way of a frame."""
        self.picture.say(said_of_film(sentence, self._film, self._name))

    def _tell(self) -> None:
        """Put slider and number where the frame is."""
        with QSignalBlocker(self.slider), QSignalBlocker(self.spin):
            self.slider.setValue(self.number)
            self.spin.setValue(self.time)


class _Picture(PictureView):
    """The frame with its number, or a sentence in its place."""

    def __init__(self, sentence: str) -> None:
        super().__init__()
        self._sentence, self._words = sentence, ""
        self.setMinimumSize(320, 200)

    @property
    def caption(self) -> str:
        """Which frame it is."""
        return self._words

    @property
    def message(self) -> str:
        """What stands in the way of a frame."""
        return self._sentence

    def sizeHint(self) -> QSize:
        """A small frame."""
        return QSize(480, 300)

    def show_image(self, image: QImage, words: str) -> None:
        """Show a frame."""
        self._sentence, self._words = "", words
        self.set_image(image)

    def say(self, sentence: str) -> None:
        """Show a sentence in its place."""
        self._sentence, self._words = sentence, ""
        self.set_image(None)
