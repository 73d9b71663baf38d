"""Steps and jumps in a video, from the verb to the painted frame, and whether that was right."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QImage

from forcelab.demonstration import VideoReference
from forcelab.gui.measuring import recordings
from forcelab.gui.measuring.films import Film, number_of
from forcelab.gui.measuring.stage import Painted, settle, shown, until
from forcelab.gui.window import Window
from forcelab.jobs import Progress
from forcelab.measure.latency import Bound, Latency, refused
from forcelab.project import Project
from forcelab.video.opencv import opencv

__all__ = ["measuring_video"]

STEP, SEEK = Bound("p95", 0.010), Bound("p95", 0.200)
FORWARD, BACKWARD, JUMP = "video: step forward", "video: step back", "video: seek"
#: From a jump to the picture of the right frame, be it the small one that is made in idle time.
PREPARED = "video: seek, to its picture in small"
#: What the times are compared with, and what other programs do.
PLAIN = "cv2 by frame count: "


def measuring_video(
    folder: Path, film: Film, *, frames: int, times: int, size: tuple[int, int]
) -> Generator[Progress, None, tuple[Latency, ...]]:
    """Step and seek in one video; see :mod:`forcelab.gui.measuring`.

    Parameters
    ----------
    folder : Path
        Where it is made.
    film : Film
    frames : int
        Its length.
    times : int
        Steps forward, steps back, and jumps: so many of each.
    size : tuple of int
        Of the window, in pixels.
    """
    if film.refusal:
        return refused([FORWARD, BACKWARD, JUMP], film.name, film.refusal)
    yield Progress(0, 6, f"{film.name}: making the video")
    path = folder / f"{film.codec} {film.even}.mp4"
    film.make(path, frames)
    stamps = film.times(frames)
    length = int(stamps[-1] * recordings.RATE) + 1000
    project = folder / f"{path.stem}.forcelab"
    with Project.create(project) as made:
        made.add(recordings.recording(length, video=VideoReference(path)))
    random = np.random.default_rng(4)
    jumps = random.integers(0, frames, times).tolist()
    rows = []
    with shown(project, size) as window, Painted([window.label.video]) as painted:
        watch = _Watch(window, painted, stamps)
        for i, (name, bound, numbers) in enumerate(
            [
                (JUMP, SEEK, jumps),
                (PREPARED, SEEK, jumps),
                (FORWARD, STEP, _steps(frames, times, 1)),
                (BACKWARD, None, _steps(frames, times, -1)),
            ]
        ):
            yield Progress(1 + i, 6, f"{film.name}: {name}")
            act = watch.step if name in (FORWARD, BACKWARD) else watch.jump
            if name == PREPARED:
                if not film.sketched:
                    continue
                until(lambda: window.label.video.prepared)
            taken, wrong = watch.measured(numbers, act, sharp=name != PREPARED)
            plain = PLAIN + (JUMP if name == PREPARED else name)
            rows.append(Latency(name, film.name, taken, bound, wrong, alternative=plain))
    yield Progress(5, 6, f"{film.name}: {PLAIN}")
    for name, numbers in (
        (JUMP, jumps),
        (FORWARD, _steps(frames, times, 1)),
        (BACKWARD, _steps(frames, times, -1)),
    ):
        taken, wrong = _plainly(path, numbers[: max(times // 5, 10)])
        rows.append(Latency(PLAIN + name, film.name, taken, wrong=wrong))
    return tuple(rows)


def _steps(frames: int, times: int, direction: int) -> list[int]:
    """Numbers of frames next to each other, from the middle of the video's free room."""
    times = min(times, frames - 2)
    first = (frames - times) // 2
    numbers = list(range(first, first + times + 1))
    return numbers[::direction]


@dataclass
class _Watch:
    """Moves the cursor and looks at what the video shows then."""

    window: Window
    painted: Painted
    stamps: NDArray[np.float64]

    def jump(self, number: int) -> None:
        """Seek into a frame, somewhere after its beginning."""
        after = self.stamps[min(number + 1, len(self.stamps) - 1)]
        at = self.stamps[number] + 0.4 * max(after - self.stamps[number], 1e-3)
        self.window.document.seek(float(at))

    def step(self, number: int) -> None:
        """Go one frame on or back."""
        self.window.document.step(1 if number > self.window.label.video.shown_index else -1)

    def measured(
        self, numbers: Iterable[int], act: Callable[[int], None], *, sharp: bool = True
    ) -> tuple[tuple[float, ...], int]:
        """Show frames one after the other.

        Parameters
        ----------
        numbers : iterable of int
            The first one is where it begins, and is not counted.
        act : callable
            Goes to a frame.
        sharp : bool
            Whether to wait for the frame itself, or for any picture of it.

        Returns
        -------
        tuple of float
            Seconds of each.
        int
            How many were not the right one.
        """
        video, taken, wrong = self.window.label.video, [], 0
        first, *others = numbers
        # Onto the frame itself: from within it, a step back leads to its beginning.
        self.window.document.seek(float(self.stamps[first]))
        settle(self.window)
        for number in others:
            if number == video.shown_index:
                continue
            there = (lambda: video.settled) if sharp else partial(self._pictured, number)
            taken.append(self.painted.seconds(partial(act, number), there))
            image = video.image
            wrong += image is None or number_of(_pixels(image)) != number
            settle(self.window, 0.0)
        return tuple(taken), wrong

    def _pictured(self, number: int) -> bool:
        """Whether a picture of this frame is shown."""
        return self.window.label.video.shown_index == number


def _plainly(path: Path, numbers: Iterable[int]) -> tuple[tuple[float, ...], int]:
    """Time and wrong frames of OpenCV, told to go to frames by their numbers."""
    cv2: Any = opencv()
    capture = cv2.VideoCapture(str(path))
    taken, wrong = [], 0
    for number in numbers:
        begin = time.perf_counter()
        capture.set(cv2.CAP_PROP_POS_FRAMES, number)
        read, picture = capture.read()
        taken.append(time.perf_counter() - begin)
        wrong += not read or number_of(picture) != number
    capture.release()
    return tuple(taken), wrong


def _pixels(image: QImage) -> NDArray[np.uint8]:
    """A picture as an array of shape (height, width, 3), with memory of its own."""
    plain = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(plain.constBits(), np.uint8).reshape(plain.height(), plain.bytesPerLine())
    # The converted picture is gone after this, and its memory with it.
    return rows[:, : 3 * plain.width()].reshape(plain.height(), plain.width(), 3).copy()
