"""A video's frames for the window: decoded in a thread of their own, the newest request first."""

from __future__ import annotations

import threading
import time
from collections.abc import Generator
from functools import partial
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
#: A requested frame is still decoded when a later one is requested while the decoder is this many
#: frames before it, so that playback faster than the decoder shows some frames rather than none.
NEAR_FRAMES = 12
#: Seconds without a request after which sketches are made.
IDLE_SECONDS = 0.3


class FrameThread:
    """A thread that reads one video.

    `size` is that in which pictures are to be ready, too; empty for none. Set by the GUI's thread.
    The memory for pictures is shared among `sharing` videos.
    """

    def __init__(self, path: Path, signal: SignalInstance, sharing: int = 1) -> None:
        self.path = path
        self._sharing = sharing
        self.thread = threading.Thread(target=self._run, name=f"video {path.name}", daemon=True)
        self._sent = signal
        self._changed = threading.Condition()
        self._ended = False
        self._request: tuple[int, int] | None = None
        self.size = QSize()
        self._pixels = 1  # of a frame
        self._immediate = -1  # the frame that was given at once
        # Of the frame that was asked for last and of its neighbours, by their number.
        self._images: dict[int, QImage] = {}
        self._fitted: dict[int, QImage] = {}
        self._served = (0, 0)
        self._served_at = time.monotonic()
        self._sketches: Thumbnails | None = None
        self._sketching: Generator[None, None, None] | None = None

    def request_frame(self, number: int, direction: int) -> QImage | None:
        """Replace the pending request; gives the picture if it is ready."""
        with self._changed:
            image = self._images.get(number)
            self._immediate = -1 if image is None else number
            self._request = (number, direction)
            self._changed.notify()
        return image

    def fitted(self, number: int) -> QImage | None:
        """The picture of a frame in the requested size, if it is ready."""
        with self._changed:
            image = self._fitted.get(number)
        return image if image is not None and image.size() == self.size else None

    def end(self) -> None:
        """Stop at the next frame."""
        with self._changed:
            self._ended = True
            self._changed.notify()

    def _send(self, signal: str, *values: object) -> None:
        """Emit a signal of :class:`VideoFrames` in the GUI's thread."""
        try:
            self._sent.emit(self, signal, values)
        except RuntimeError:  # what PySide raises when the C++ object was deleted
            self._ended = True

    def _run(self) -> None:
        """Read the video until :meth:`end`; afterwards this holds no pictures."""
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
        """Serve requests; in between decode neighbours of the last frame and make sketches."""
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
            elif not self._decode_neighbour(reader) and not self._sketch():
                with self._changed:
                    if self._request is None and not self._ended:
                        self._changed.wait(IDLE_SECONDS if self._sketching else None)

    def _open(self) -> VideoReader | None:
        """Open the video; the first frame is shown while a long index is read."""
        from forcelab.video.index import indexing, open_video
        from forcelab.video.reader import CACHE, VideoReader, as_rgb

        job, shown = indexing(self.path), False
        while not self._ended:
            try:
                progress = next(job)
            except StopIteration as stop:
                return VideoReader(self.path, stop.value, CACHE // self._sharing)
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
        """Decode the requested frame, unless another one is requested meanwhile."""
        with self._changed:
            assert self._request is not None
            (number, direction), self._request = self._request, None
            immediate = number == self._immediate
        number = min(max(number, 0), len(reader) - 1)
        self._served, self._served_at = (number, direction), time.monotonic()
        if immediate:
            return
        if (
            reader.cached_frame(number) is None
            and not number - NEAR_FRAMES <= reader.position < number
        ):
            sketch = self._sketches.get(number) if self._sketches is not None else None
            if sketch is not None:
                self._send("sketch_ready", number, _image(sketch))
        try:
            frame = self._decode_to(reader, number, None, patient=True)
        except InputError as error:
            self._send("missed", number, str(error))
            return
        if frame is not None:
            image = _image(frame)
            self._store(number, image, self._neighbours(reader)[0])
            self._send("frame_ready", number, image)

    @property
    def prepared(self) -> bool:
        """Whether every frame that is slow to reach has a sketch, as far as there is room."""
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

    def _neighbours(self, reader: VideoReader) -> tuple[list[int], int]:
        """The neighbours of the last frame, the nearest first, and the most on a side."""
        number, direction = self._served
        last = len(reader) - 1
        # The frame, both sides and what is passed fit together; a picture is a third larger.
        pixels = self._pixels + max(self.size.width() * self.size.height(), 0)
        room = min(reader.capacity // 4, max(1, CACHE_BYTES // (2 * 4 * pixels * self._sharing)))
        forward = min(AHEAD if direction > 0 else AROUND, room)
        backward = min(AHEAD if direction < 0 else AROUND, room)
        neighbours = [*range(number + 1, min(number + forward, last) + 1)]
        neighbours += range(number - 1, max(number - backward, 0) - 1, -1)
        return neighbours, room

    def _decode_neighbour(self, reader: VideoReader) -> bool:
        """Decode one neighbour of the last frame; False if all of them are there."""
        number, direction = self._served
        neighbours, room = self._neighbours(reader)
        for neighbour in neighbours:
            if neighbour not in self._images:
                try:
                    frame = self._decode_to(
                        reader, neighbour, room if neighbour < number else 0, patient=False
                    )
                    if frame is not None:
                        self._store(neighbour, _image(frame), neighbours)
                except InputError:
                    self._served = (number, 0) if direction else (number, direction)
                    return False  # reported once it is requested
                return True
        return False

    def _store(self, number: int, image: QImage, neighbours: list[int]) -> None:
        """Keep a picture, and drop those that are no neighbours of the last frame any more."""
        size = self.size
        fitted = None if size.isEmpty() else scaled(image, size)
        near = {self._served[0], *neighbours}
        with self._changed:
            self._images = {at: old for at, old in self._images.items() if at in near}
            self._fitted = {at: old for at, old in self._fitted.items() if at in near}
            self._images[number] = image
            if fitted is not None:
                self._fitted[number] = fitted

    def _decode_to(
        self, reader: VideoReader, number: int, passed: int | None, *, patient: bool
    ) -> Frame | None:
        """Decode up to a frame; None if another request makes it useless."""
        reaching = reader.reaching(number, passed)
        while not self._ended:
            request = self._request
            near = number - NEAR_FRAMES <= reader.position < number
            if request is not None and not (patient and near and request[0] >= number):
                return None
            try:
                next(reaching)
            except StopIteration as stop:
                frame: Frame = stop.value
                return frame
        return None


def _image(frame: Frame) -> QImage:
    """A picture with memory of its own, in the form that Qt paints fastest."""
    height, width = frame.shape[:2]
    frame = np.ascontiguousarray(frame)
    image = QImage(frame.data, width, height, 3 * width, QImage.Format.Format_RGB888)
    return image.convertToFormat(QImage.Format.Format_RGB32)


def _sentence(error: Exception, path: Path) -> str:
    """Why a video cannot be opened."""
    if isinstance(error, ImportError):
        return f"'{path.name}' cannot be shown: OpenCV is not there ({error}); run forcelab doctor."
    if isinstance(error, OSError):
        return f"'{path}' cannot be read: {error.strerror or error}; check its rights and its disk."
    return str(error)


def _end_threads(decoders: list[FrameThread]) -> None:
    for decoder in decoders:
        decoder.end()


#: Seconds that closing waits for decoders to come to the end of a frame.
STOP_TIMEOUT = 5.0


class VideoFrames(QObject):
    """The frames of one video at a time, numbered from 0, decoded in a thread."""

    opened = Signal(object)
    failed = Signal(str)
    remarked = Signal(str)
    indexed = Signal(int, int)
    frame_ready = Signal(int, QImage)
    sketch_ready = Signal(int, QImage)
    missed = Signal(int, str)
    _sent = Signal(object, object, object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._decoder: FrameThread | None = None
        self._threads: list[FrameThread] = []  # that may still read
        self._size = QSize()
        self._sent.connect(self._relay, Qt.ConnectionType.QueuedConnection)
        self.destroyed.connect(partial(_end_threads, self._threads))

    def open(self, path: Path, sharing: int = 1) -> None:
        """Show another video from now on, one of `sharing`; work for the last one is dropped."""
        self.abandon()
        self._decoder = FrameThread(path, self._sent, sharing)
        self._decoder.size = self._size
        self._decoder.thread.start()
        self._threads.append(self._decoder)

    def request_frame(self, number: int, direction: int = 0) -> QImage | None:
        """Request a frame in place of earlier requests; gives it if it is ready, without a signal.

        `direction` is 1 or -1 for where the next request is likely to go; 0 if that is not known.
        """
        return None if self._decoder is None else self._decoder.request_frame(number, direction)

    def fit(self, size: QSize) -> None:
        """Have pictures ready in another size (pixels of the screen), too; an empty one for none.

        To scale them costs the GUI's thread more than all else that a step makes it paint.
        """
        self._size = size
        if self._decoder is not None:
            self._decoder.size = size

    def fitted(self, number: int) -> QImage | None:
        """The picture of a frame in the requested size, if it is ready."""
        return None if self._decoder is None else self._decoder.fitted(number)

    def close(self, patience: float = STOP_TIMEOUT) -> bool:
        """Close the video; gives whether no thread is left after at most `patience` seconds."""
        self.abandon()
        deadline = time.monotonic() + patience
        for decoder in self._threads:
            decoder.thread.join(max(0.0, deadline - time.monotonic()))
        return not any(decoder.thread.is_alive() for decoder in self._threads)

    def abandon(self) -> None:
        """Close the video without waiting for the decoder to end."""
        if self._decoder is not None:
            self._decoder.end()
            self._decoder = None
        self._threads[:] = [decoder for decoder in self._threads if decoder.thread.is_alive()]

    @Slot(object, object, object)
    def _relay(self, decoder: FrameThread, signal: str, values: tuple[Any, ...]) -> None:
        """Emit what the present decoder sends; a former one's signals are dropped."""
        if decoder is self._decoder:
            getattr(self, signal).emit(*values)
