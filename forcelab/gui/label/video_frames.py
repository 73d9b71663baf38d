"""A video's frames for the window: decoded in a thread of their own, the newest request first."""

from __future__ import annotations

import threading
import time
from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PySide6.QtCore import QObject, QSize, Qt, Signal, SignalInstance, Slot
from PySide6.QtGui import QImage

from forcelab.errors import InputError
from forcelab.gui.label.picture_view import scaled

if TYPE_CHECKING:
    from forcelab.video.reader import Frame, Thumbnails, VideoReader


#: Frames decoded ahead in the direction of travel while nothing is asked for, and around a frame
#: at which the cursor rests.
AHEAD, AROUND = 12, 3
#: Bytes that pictures of the neighbours may take.
CACHE_BYTES = 96 * 2**20
#: A frame that is asked for is still decoded when a later one is asked for while the decoder is
#: this near, so that playback faster than the decoder shows some frames rather than none.
NEAR_FRAMES = 12
#: Seconds without a request after which sketches are made.
IDLE_SECONDS = 0.3


class FrameThread:
    """A thread that reads one video.

    Attributes
    ----------
    size : QSize
        In which pictures are to be ready, too; empty for none. Set by the GUI's thread.
    """

    def __init__(self, path: Path, told: SignalInstance) -> None:
        self.path = path
        self.thread = threading.Thread(target=self._run, name=f"video {path.name}", daemon=True)
        self._told = told
        self._changed = threading.Condition()
        self._ended = False
        self._request: tuple[int, int] | None = None
        self.size = QSize()
        self._pixels = 1  # of a frame
        self._given = -1  # the frame that was given at once
        # Of the frame that was asked for last and of its neighbours, by their number.
        self._images: dict[int, QImage] = {}
        self._fitted: dict[int, QImage] = {}
        self._served = (0, 0)
        self._served_at = time.monotonic()
        self._sketches: Thumbnails | None = None
        self._sketching: Generator[None, None, None] | None = None

    def want(self, number: int, direction: int) -> QImage | None:
        """Take a request in place of the one before; gives the picture if it is there."""
        with self._changed:
            image = self._images.get(number)
            self._given = -1 if image is None else number
            self._request = (number, direction)
            self._changed.notify()
        return image

    def fitted(self, number: int) -> QImage | None:
        """The picture of a frame in the size that is wanted; None where it is not there."""
        with self._changed:
            image = self._fitted.get(number)
        return image if image is not None and image.size() == self.size else None

    def end(self) -> None:
        """Stop at the next frame."""
        with self._changed:
            self._ended = True
            self._changed.notify()

    def _send(self, what: str, *values: object) -> None:
        """Send to the GUI's thread."""
        try:
            self._told.emit(self, what, values)
        except RuntimeError:  # what PySide raises when the C++ object was deleted
            self._ended = True

    def _run(self) -> None:
        """Read the video until the end is asked for; whoever holds this later holds no pictures."""
        try:
            reader = self._open()
            if reader is not None:
                with reader:
                    self._read(reader)
        except (InputError, ImportError, OSError) as error:
            self._send("failed", _sentence(error, self.path))
        finally:
            if self._sketching is not None:
                self._sketching.close()
            self._sketches = self._sketching = None
            self._images, self._fitted = {}, {}

    def _read(self, reader: VideoReader) -> None:
        """Serve requests, in between look at the neighbours of the last one and make sketches."""
        from forcelab.video.reader import Thumbnails

        self._sketches = Thumbnails(self.path, reader.index)
        if self._sketches.worthwhile:
            self._sketching = self._sketches.making()
        width, height = reader.size  # asked for once, as it takes a look at the first frame
        self._pixels = width * height
        self._send("opened", reader.times)
        if reader.remark:
            self._send("remarked", reader.remark)
        while not self._ended:
            if self._request is not None:
                self._serve(reader)
            elif not self._look_around(reader) and not self._sketch():
                with self._changed:
                    if self._request is None and not self._ended:
                        self._changed.wait(IDLE_SECONDS if self._sketching else None)

    def _open(self) -> VideoReader | None:
        """Open the video; the first frame is shown while a long index is read."""
        from forcelab.video.index import indexing, open_video
        from forcelab.video.reader import VideoReader, as_rgb

        job, shown = indexing(self.path), False
        while not self._ended:
            try:
                progress = next(job)
            except StopIteration as stop:
                return VideoReader(self.path, stop.value)
            if not shown:
                shown = True
                capture = open_video(self.path)
                read, picture = capture.read()
                capture.release()
                if read:
                    self._send("frame_ready", 0, _image(as_rgb(picture)))
            self._send("indexed", progress.done, progress.total)
        return None

    def _serve(self, reader: VideoReader) -> None:
        """Decode the frame that is asked for, unless another one is asked for meanwhile."""
        with self._changed:
            assert self._request is not None
            (number, direction), self._request = self._request, None
            given = number == self._given
        number = min(max(number, 0), len(reader) - 1)
        self._served, self._served_at = (number, direction), time.monotonic()
        if given:
            return
        if (
            reader.cached_frame(number) is None
            and not number - NEAR_FRAMES <= reader.position < number
        ):
            sketch = self._sketches.get(number) if self._sketches is not None else None
            if sketch is not None:
                self._send("sketch_ready", number, _image(sketch))
        try:
            frame = self._reach(reader, number, None, patient=True)
        except InputError as error:
            self._send("missed", number, str(error))
            return
        if frame is not None:
            image = _image(frame)
            self._keep(number, image, self._around(reader)[0])
            self._send("frame_ready", number, image)

    @property
    def prepared(self) -> bool:
        """Whether all sketches are made that will be."""
        return self._sketches is not None and self._sketching is None

    def _sketch(self) -> bool:
        """Make one sketch; False if there is none to make, or not yet."""
        if self._sketching is None or time.monotonic() - self._served_at < IDLE_SECONDS:
            return False
        try:
            next(self._sketching)
        except (StopIteration, InputError):
            self._sketching = None
        return True

    def _around(self, reader: VideoReader) -> tuple[list[int], int]:
        """The neighbours of the last frame, the nearest first, and how many on a side there are."""
        number, direction = self._served
        last = len(reader) - 1
        # The frame, both sides and what is passed fit together; a picture is a third larger.
        pixels = self._pixels + max(self.size.width() * self.size.height(), 0)
        room = min(reader.capacity // 4, max(1, CACHE_BYTES // (2 * 4 * pixels)))
        ahead = min(AHEAD if direction > 0 else AROUND, room)
        behind = min(AHEAD if direction < 0 else AROUND, room)
        around = [*range(number + 1, min(number + ahead, last) + 1)]
        around += range(number - 1, max(number - behind, 0) - 1, -1)
        return around, room

    def _look_around(self, reader: VideoReader) -> bool:
        """Decode one neighbour of the last frame; False if all of them are there."""
        number, direction = self._served
        around, room = self._around(reader)
        for other in around:
            if other not in self._images:
                try:
                    frame = self._reach(reader, other, room if other < number else 0, patient=False)
                    if frame is not None:
                        self._keep(other, _image(frame), around)
                except InputError:
                    self._served = (number, 0) if direction else (number, direction)
                    return False  # it is told when it is asked for
                return True
        return False

    def _keep(self, number: int, image: QImage, around: list[int]) -> None:
        """Keep a picture, and let go of those that are no neighbours of the last frame any more."""
        size = self.size
        fitted = None if size.isEmpty() else scaled(image, size)
        near = {self._served[0], *around}
        with self._changed:
            self._images = {at: kept for at, kept in self._images.items() if at in near}
            self._fitted = {at: kept for at, kept in self._fitted.items() if at in near}
            self._images[number] = image
            if fitted is not None:
                self._fitted[number] = fitted

    def _reach(
        self, reader: VideoReader, number: int, passed: int | None, *, patient: bool
    ) -> Frame | None:
        """Decode up to a frame; None if it is not wanted any more."""
        reaching = reader.reaching(number, passed)
        while not self._ended:
            wanted = self._request
            near = number - NEAR_FRAMES <= reader.position < number
            if wanted is not None and not (patient and near and wanted[0] >= number):
                return None
            try:
                next(reaching)
            except StopIteration as stop:
                frame: Frame = stop.value
                return frame
        return None


def _image(frame: Frame) -> QImage:
    """A picture of its own in the form that Qt paints fastest."""
    height, width = frame.shape[:2]
    frame = np.ascontiguousarray(frame)
    image = QImage(frame.data, width, height, 3 * width, QImage.Format.Format_RGB888)
    return image.convertToFormat(QImage.Format.Format_RGB32)


def _sentence(error: Exception, path: Path) -> str:
    """What is said of a video that cannot be opened."""
    if isinstance(error, ImportError):
        return f"'{path.name}' cannot be shown: OpenCV is not there ({error}); run forcelab doctor."
    if isinstance(error, OSError):
        return f"'{path}' cannot be read: {error.strerror or error}; check its rights and its disk."
    return str(error)


#: Seconds that closing waits for decoders to come to the end of a frame.
STOP_TIMEOUT = 5.0


class VideoFrames(QObject):
    """The frames of one video at a time.

    Attributes
    ----------
    opened : Signal(ndarray)
        The video can be shown: timestamps of its frames in seconds, shape (n,), on its own clock.
    failed : Signal(str)
        It cannot be shown at all, and why.
    remarked : Signal(str)
        What is to be said about it though it can be shown.
    indexed : Signal(int, int)
        How many frames' times are read, of how many.
    frame_ready : Signal(int, QImage)
        A frame's number from 0, and its picture. Before :attr:`opened` it is the first frame of a
        video whose index takes long.
    sketch_ready : Signal(int, QImage)
        The same, smaller and coarser, while the frame itself takes long.
    missed : Signal(int, str)
        A frame that cannot be decoded, and why.
    """

    opened = Signal(object)
    failed = Signal(str)
    remarked = Signal(str)
    indexed = Signal(int, int)
    frame_ready = Signal(int, QImage)
    sketch_ready = Signal(int, QImage)
    missed = Signal(int, str)
    _told = Signal(object, object, object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._decoder: FrameThread | None = None
        self._ending: list[FrameThread] = []
        self._size = QSize()
        self._told.connect(self._relay, Qt.ConnectionType.QueuedConnection)

    def open(self, path: Path) -> None:
        """Show another video from now on; what is under way for the one before is dropped."""
        self.leave()
        self._decoder = FrameThread(path, self._told)
        self._decoder.size = self._size
        self._decoder.thread.start()

    def want(self, number: int, direction: int = 0) -> QImage | None:
        """Ask for a frame; earlier requests that are not served yet are dropped.

        A neighbour of the frame before is there already: it is given at once, and not told again.

        Parameters
        ----------
        number : int
            From 0.
        direction : int
            1 or -1 for where the next request is likely to go; 0 if that is not known.

        Returns
        -------
        QImage or None
        """
        return None if self._decoder is None else self._decoder.want(number, direction)

    def fit(self, size: QSize) -> None:
        """Have pictures ready in another size, too, from now on; an empty one for none.

        To scale them costs the GUI's thread more than all else that a step makes it paint.

        Parameters
        ----------
        size : QSize
            In pixels of the screen.
        """
        self._size = size
        if self._decoder is not None:
            self._decoder.size = size

    def fitted(self, number: int) -> QImage | None:
        """The picture of a frame in the size that was asked for last, if it is ready."""
        return None if self._decoder is None else self._decoder.fitted(number)

    @property
    def prepared(self) -> bool:
        """Whether every frame that is slow to reach has a sketch, as far as there is room."""
        return self._decoder is not None and self._decoder.prepared

    def close(self, patience: float = STOP_TIMEOUT) -> bool:
        """Let go of the video; gives whether no thread is left after so many seconds."""
        self.leave()
        deadline = time.monotonic() + patience
        for decoder in self._ending:
            decoder.thread.join(max(0.0, deadline - time.monotonic()))
        self._ending = [decoder for decoder in self._ending if decoder.thread.is_alive()]
        return not self._ending

    def leave(self) -> None:
        """Let go of the video without waiting for the decoder to end."""
        if self._decoder is not None:
            self._decoder.end()
            self._ending.append(self._decoder)
            self._decoder = None
        self._ending = [decoder for decoder in self._ending if decoder.thread.is_alive()]

    @Slot(object, object, object)
    def _relay(self, decoder: FrameThread, what: str, values: tuple[Any, ...]) -> None:
        """Pass on what the present decoder tells; a former one is not heard any more."""
        if decoder is self._decoder:
            getattr(self, what).emit(*values)
