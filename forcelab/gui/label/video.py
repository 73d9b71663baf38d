"""The video panels, and the choice of what they show."""

from __future__ import annotations

import math

import numpy as np
from PySide6.QtCore import QObject, QRect, QSize, Qt, Signal
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QComboBox, QWidget

from forcelab.arrays import Real
from forcelab.demonstration import VideoReference
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES, signed
from forcelab.gui.label.picture_view import PictureView
from forcelab.gui.label.video_frames import STOP_TIMEOUT, VideoFrames
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import ElidedComboBox
from forcelab.project.media import name_video
from forcelab.video.index import last_at


class VideoSelection(QObject):
    """Which of the open demonstration's videos is shown, or all of them side by side.

    `all` is empty unless there are several. `shown` is the place in it of the one by whose frames
    the cursor steps: side by side it is the first one.
    """

    changed = Signal()

    def __init__(self, document: Document, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._document = document
        self._name = ""  # of the one that was chosen last; other demonstrations may have it too
        self.all: tuple[VideoReference, ...] = ()
        self.shown = 0
        self.side_by_side = False
        document.demonstration_changed.connect(self._refresh)
        self._refresh()

    @property
    def video(self) -> VideoReference | None:
        """The shown video, side by side the first one."""
        demonstration = self._document.demonstration
        if demonstration is None:
            return None
        return self.all[self.shown] if self.all else demonstration.video

    @property
    def beside(self) -> tuple[VideoReference, ...]:
        """The videos that are shown beside that one."""
        return self.all[1:] if self.side_by_side else ()

    def show(self, place: int) -> None:
        """Show one video alone."""
        if 0 <= place < len(self.all) and (place != self.shown or self.side_by_side):
            self.shown, self.side_by_side, self._name = place, False, self.all[place].name
            self.changed.emit()

    def show_all(self) -> None:
        if not self.side_by_side:
            self.shown, self.side_by_side = 0, True
            self.changed.emit()

    def show_next(self) -> None:
        """Show the next video alone, after the last one the first."""
        if self.all:
            self.show((self.shown + 1) % len(self.all))
            self._document.show_message(f"Video: {self.all[self.shown].name}")

    def switch_side_by_side(self) -> None:
        """Show all videos side by side, or the one again that was shown before."""
        if self.side_by_side:
            self.show(self._place_chosen())
        elif self.all:
            self.show_all()

    def obstacle(self) -> str:
        """Why there is no next video; empty where there is one."""
        return "" if self.all else "This demonstration has no other video."

    def _place_chosen(self) -> int:
        """The place of the video that was chosen last; the first one where that is not there."""
        names = [video.name for video in self.all]
        return names.index(self._name) if self._name in names else 0

    def _refresh(self) -> None:
        """Read the videos; what was chosen stays, also for other demonstrations that have it."""
        demonstration = self._document.demonstration
        videos = () if demonstration is None else demonstration.videos
        before = self.all, self.shown
        self.all = videos if len(videos) > 1 else ()
        self.shown = 0 if self.side_by_side else self._place_chosen()
        if (self.all, self.shown) != before:
            self.changed.emit()


class VideoChoice(ElidedComboBox):
    """Chooses the video, or all side by side; hidden unless there are several."""

    elide_mode = NAMES

    def __init__(self, selection: VideoSelection, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._selection = selection
        self.setAccessibleName("Video")
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # a click leaves the keyboard where it is
        self.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
        self.setMinimumContentsLength(0)
        self.activated.connect(self._choose)
        selection.changed.connect(self._fill)
        self._fill()

    def fit(self, room: int) -> None:
        """Be as wide as the names need, at most `room` pixels."""
        # Not its size alone: a while after a change it takes the one that its names need.
        self.setMaximumWidth(max(room, 1))
        self.resize(self.sizeHint())

    def showPopup(self) -> None:
        """Elide the names in the list to the field's width; their tooltips have all of them."""
        super().showPopup()
        popup = self.view().window()
        popup.setFixedWidth(self.width())
        popup.move(self.mapToGlobal(self.rect().topLeft()).x(), popup.y())

    def _choose(self, place: int) -> None:
        if place == len(self._selection.all):
            self._selection.show_all()
        else:
            self._selection.show(place)

    def _fill(self) -> None:
        self.clear()
        selection = self._selection
        for place, video in enumerate(selection.all):
            self.addItem(video.name)
            self.setItemData(place, video.name, Qt.ItemDataRole.ToolTipRole)
        if selection.all:
            self.addItem(ALL)
            self.setCurrentIndex(len(selection.all) if selection.side_by_side else selection.shown)
        self.setToolTip(self.currentText())
        self.setVisible(bool(selection.all))


#: Steps of at most so many frames predict the direction of the next one.
LONGEST_STEP = 8
#: Periods after the last frame's time at which the video counts as over.
ENDED_PERIODS = 1.5
#: How late a video may begin, in seconds, for the cursor to be sent to its first frame at once.
LATEST_START = 0.5
#: Width to height of most videos.
USUAL_SHAPE = 4 / 3
#: Space around the choice of the video and between videos, in pixels.
CHOICE_MARGIN = 3
#: The entry below the names.
ALL = "All side by side"


class VideoPanel(PictureView):
    """The frame of a video at the cursor, and its number and time below.

    That is the selected video, or the one in a `place` of those beside it, of which none has a say
    in where the cursor is. `shown_index` is the number (from 0) of the frame that is on the screen
    now, -1 for none, and `frame_shown` tells it. After a jump that may come twice: for a coarse
    picture of the frame, and for the frame itself.
    """

    frame_shown = Signal(int)

    def __init__(
        self,
        document: Document,
        selection: VideoSelection,
        place: int | None = None,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.document = document
        self._selection = selection
        self._place = place
        self.setAccessibleName("Video")
        self._frames: VideoFrames | None = None
        self._open: tuple[str, str] | None = None
        self._reset()
        selection.changed.connect(self._demonstration_changed)
        document.demonstration_changed.connect(self._demonstration_changed)
        document.view.cursor_moved.connect(self._request_frame)
        document.view.peek_changed.connect(self._request_frame)
        self._demonstration_changed()

    def _reset(self) -> None:
        """Reset all that is known of a video."""
        self._times: Real | None = None
        self._period = 0.0
        self.shown_index = self._requested = -1
        self._sharp = True
        self._trouble = self._progress = ""
        self._missing = (-1, "")
        self.setToolTip("")
        self.set_image(None)

    # State

    @property
    def has_video(self) -> bool:
        """Whether the open demonstration has a video."""
        return self._reference is not None

    @property
    def settled(self) -> bool:
        """Whether the panel shows the frame at the cursor, or that there is none."""
        if self._open is None or self._trouble or not self.isVisible():
            return True
        has_index = self._times is not None
        right = self.shown_index == self._requested and self._sharp
        return has_index and (right or self._missing[0] == self._requested)

    @property
    def caption(self) -> str:
        times, reference = self._times, self._reference
        name = [reference.name] if reference is not None and self._selection.beside else []
        if times is None or reference is None or self.shown_index < 0:
            return " · ".join([*name, *filter(None, [self._progress])])
        # The time first: a narrow panel cuts the end.
        time = signed(f"{float(reference.clock.to_force(times[self.shown_index])):.3f}")
        parts = [*name, f"{time} s", f"frame {self.shown_index + 1} of {len(times)}"]
        if self._period:
            over = self._video_time > times[-1] + ENDED_PERIODS * self._period
            rate = f"{1 / self._period:.4g}/s"
            parts.append("ended" if over else rate)  # short: the panel is narrow
        return " · ".join(parts)

    @property
    def message(self) -> str:
        reference = self._reference
        if self.failed:
            return self._trouble or self._missing[1]
        if self._times is not None and reference is not None and self._requested < 0:
            start = float(reference.clock.to_force(self._times[0]))
            return f"The video begins at {start:.3f} s"
        return ""

    @property
    def failed(self) -> bool:
        """Whether the video, or the frame at the cursor, cannot be shown."""
        return bool(self._trouble) or 0 <= self._requested == self._missing[0]

    def close_video(self, patience: float = STOP_TIMEOUT) -> bool:
        """Close the video; gives whether no thread is left after at most `patience` seconds."""
        self._close()
        return self._frames is None or self._frames.close(patience)

    # The document

    def _close(self) -> None:
        """Show no video any more, without waiting for the decoder."""
        if self._open is not None and self._frames is not None:
            self._frames.abandon()
        self._open = None
        self._reset()

    @property
    def _reference(self) -> VideoReference | None:
        """The video that is shown here."""
        if self._place is None:
            return self._selection.video
        beside = self._selection.beside
        return beside[self._place] if self._place < len(beside) else None

    @property
    def _video_time(self) -> float:
        """The cursor, or the dragged time, on the video's own clock (s)."""
        reference = self._reference
        if reference is None:
            return 0.0
        return float(reference.clock.to_device(self.document.view.displayed_time))

    def _demonstration_changed(self) -> None:
        """Open the video of the demonstration, or follow a new clock of the one that is open."""
        reference = self._reference
        if reference is None:
            self._close()
            self.hide()
            return
        if self.parentWidget() is not None:
            self.show()
        if self._place is not None and not self.isVisible():  # it waits until it is seen
            self._close()
            return
        video = (self.document.id, str(reference.path))
        if video != self._open:
            self._reset()
            # Of another video: nothing steps by them.
            if self._place is None and self.document.view.frame_times is not None:
                self.document.view.set_frame_times(None)
            self._open = video
            self.fit()
            self._ensure_frames().open(reference.path, 1 + len(self._selection.beside))
        elif self._times is not None:
            if self._place is None:
                self._publish_times()
            self._request_frame()
        self.update()

    def _ensure_frames(self) -> VideoFrames:
        """The decoder, created when the first video is shown."""
        if self._frames is None:
            self._frames = VideoFrames(self)
            self.fits.connect(self._frames.fit)
            self._frames.opened.connect(self._opened)
            self._frames.failed.connect(self._failed)
            self._frames.remarked.connect(self._remarked)
            self._frames.indexed.connect(self._indexed)
            self._frames.frame_ready.connect(self._ready)
            self._frames.sketch_ready.connect(self._sketched)
            self._frames.missed.connect(self._missed)
        return self._frames

    def _publish_times(self) -> None:
        """Give the document the times of the frames on the force clock."""
        if self._times is not None and self._reference is not None:
            self.document.view.set_frame_times(self._reference.clock.to_force(self._times))

    def _to_first_frame(self) -> None:
        """Go to the first frame of a video that begins a little late, unless the cursor moved."""
        document, frames = self.document, self.document.view.frame_times
        demonstration = document.demonstration
        if demonstration is None or frames is None or not len(frames):
            return
        first, start = float(frames[0]), demonstration.start
        if (
            document.view.cursor == start
            and not document.view.playing
            and 0 < first - start <= LATEST_START
        ):
            document.view.seek(first)

    def _request_frame(self, _: float = 0.0, *, again: bool = False) -> None:
        if self._times is None:
            return
        number = last_at(self._times, self._video_time)
        step, self._requested = number - self._requested, number
        if number < 0:
            self._show(None, -1)
        elif (
            self.isVisible()
            and (step or again)
            and not (number == self.shown_index and self._sharp)
        ):
            travelling = self.document.view.playing or 0 < step <= LONGEST_STEP
            direction = 1 if travelling else -1 if -LONGEST_STEP <= step < 0 else 0
            image = self._ensure_frames().request_frame(number, direction)
            if image is not None:
                self._show(image, number)
        if step or self._video_time > self._times[-1]:
            self.update()

    # The decoder

    def _opened(self, times: Real) -> None:
        self._times = times
        self._period = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
        self.shown_index = self._requested = -1
        if self._place is None:
            self._publish_times()
            self._to_first_frame()
        self._request_frame(again=True)
        self.update()

    def _with_video_name(self, sentence: str) -> str:
        """A sentence with the video called as coders know it."""
        reference, demonstration = self._reference, self.document.demonstration
        if reference is None or demonstration is None:
            return sentence
        return name_video(sentence, reference, demonstration)

    def _failed(self, sentence: str) -> None:
        self._trouble = self._with_video_name(sentence)
        self._show(None, -1)

    def _remarked(self, sentence: str) -> None:
        sentence = self._with_video_name(sentence)
        self.setToolTip(sentence)
        self.document.show_message(sentence, True)
        self.update()

    def _indexed(self, done: int, total: int) -> None:
        self._progress = f"reading the times of frame {done} of {total}"
        self.update()

    def _missed(self, number: int, sentence: str) -> None:
        self._missing = (number, self._with_video_name(sentence))
        if number == self._requested:
            self._show(None, -1)

    def _ready(self, number: int, image: QImage) -> None:
        """Show a frame if it is the one at the cursor, or nearer to it than the one shown."""
        if self._times is None:  # the first frame, while the index is read
            self._show(image, -1)
        elif number == self._requested or (
            self.document.view.playing and self.shown_index < number < self._requested
        ):
            self._show(image, number)

    def _sketched(self, number: int, image: QImage) -> None:
        """Show a coarse picture of the frame at the cursor until it is decoded."""
        if number == self._requested != self.shown_index:
            self._show(image, number, sharp=False)

    def _show(self, image: QImage | None, number: int, *, sharp: bool = True) -> None:
        self._sharp = sharp
        if image is None and self.image is None and self.shown_index == number:
            self.update()
            return
        self.shown_index = number
        fitted = None
        if image is not None and sharp and self._frames is not None:
            fitted = self._frames.fitted(number)
        self.set_image(image, fitted)
        self.frame_shown.emit(number)

    def showEvent(self, event: QShowEvent) -> None:
        """Request the frame at the cursor, which was not followed while hidden."""
        super().showEvent(event)
        if self._place is not None:
            self._demonstration_changed()
        self._request_frame(again=True)


class VideoPanels(QWidget):
    """The panels of the videos that are shown, side by side, and the choice among them above."""

    def __init__(self, document: Document, selection: VideoSelection) -> None:
        super().__init__()
        self._document = document
        self._selection = selection
        self._choice = VideoChoice(selection, self)
        self._choice.move(CHOICE_MARGIN, CHOICE_MARGIN)
        #: That of the selected video, then those beside it, as many as there ever were.
        self.panels = [VideoPanel(document, selection, parent=self)]
        self.setMinimumSize(self.panels[0].minimumSize())
        themes().changed.connect(self.update)
        selection.changed.connect(self._arrange)
        self._arrange()

    @property
    def has_video(self) -> bool:
        """Whether the open demonstration has a video."""
        return self.panels[0].has_video

    @property
    def shown_index(self) -> int:
        """The number of the shown frame of the selected video, from 0; -1 for none."""
        return self.panels[0].shown_index

    @property
    def settled(self) -> bool:
        """Whether all panels show the frame at the cursor, or that there is none."""
        return all(panel.settled for panel in self.panels)

    def close_video(self, patience: float = STOP_TIMEOUT) -> bool:
        """Close all videos; gives whether no thread is left after `patience` seconds for each."""
        # All of them, not only up to the first that is at work.
        closed = [panel.close_video(patience) for panel in self.panels]
        return all(closed)

    def sizeHint(self) -> QSize:
        return self.panels[0].sizeHint()

    def paintEvent(self, event: QPaintEvent) -> None:
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(colours().panel))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._arrange()

    def _arrange(self) -> None:
        """Give each panel that shows a video a cell of the grid in which pictures are largest."""
        count = 1 + len(self._selection.beside)
        for place in range(len(self.panels) - 1, count - 1):
            self.panels.append(VideoPanel(self._document, self._selection, place, self))
        self._choice.fit(self.width() - 2 * CHOICE_MARGIN)
        top = 0 if self._choice.isHidden() else self._choice.height() + 2 * CHOICE_MARGIN
        room = self.rect().adjusted(0, top, 0, 0)
        below = self.fontMetrics().height()

        def picture_width(columns: int) -> float:
            height = room.height() / math.ceil(count / columns) - below
            return min(room.width() / columns, height * USUAL_SHAPE)

        columns = max(range(1, count + 1), key=picture_width)
        rows = math.ceil(count / columns)
        gap = CHOICE_MARGIN
        width = (room.width() - gap * (columns - 1)) // columns
        height = (room.height() - gap * (rows - 1)) // rows
        for number, panel in enumerate(self.panels[:count]):
            row, column = divmod(number, columns)
            left, upper = column * (width + gap), top + row * (height + gap)
            panel.setMinimumSize(1, 1)
            panel.setGeometry(QRect(left, upper, width, height))
