"""A video's frames for the window: decoded in a thread of their own, the newest request first."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, QSize, Qt, Signal, Slot
from PySide6.QtGui import QImage

from forcelab.gui.label.frame_thread import FrameThread

__all__ = ["PATIENCE", "Frames"]

#: Seconds that closing waits for decoders to come to the end of a frame.
PATIENCE = 5.0


class Frames(QObject):
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

    def close(self, patience: float = PATIENCE) -> bool:
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
