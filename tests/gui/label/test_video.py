import re
import threading
import time

import numpy as np
import pytest
import shiboken6
from factories import (
    GOP_250,
    NUMBER_BITS,
    even_frame_times,
    frame_number,
    uneven_frame_times,
    write_opencv_video,
    write_video,
)
from PySide6.QtCore import QCoreApplication, QObject, QPointF, Qt, Signal
from PySide6.QtGui import QGuiApplication, QImage
from PySide6.QtTest import QTest
from window_helpers import PATIENCE

import forcelab.gui.label.picture_view
import forcelab.gui.label.video_frames
from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.gui.label.picture_view import scaled
from forcelab.gui.label.video import VideoPanel, VideoSelection
from forcelab.gui.label.video_frames import VideoFrames
from forcelab.gui.label.video_sync import VideoPreview
from forcelab.gui.view_state import ViewState

COUNT = 200
ODD = uneven_frame_times(COUNT)
CLOCK = ClockMap(offset=1.2345, rate=1.00003)


class Paper(QObject):
    """What the panel needs of a document."""

    demonstration_changed = Signal()

    def __init__(self):
        super().__init__()
        self.view, self.id, self.project = ViewState(self), "", None
        self.messages = []

    @property
    def demonstration(self):
        return self.view.demonstration

    def show(self, video, clock=CLOCK, id_="a"):
        videos = () if video is None else (VideoReference(video, clock),)
        times = np.linspace(0, 30, 100)
        demonstration = Demonstration(
            "a", "", times, times[:, None], (Channel("fz"),), videos=videos
        )
        if self.demonstration is None:
            self.view.reset(demonstration)
        self.view.demonstration = demonstration
        self.id = id_
        self.demonstration_changed.emit()

    def show_message(self, text, error=False):
        self.messages.append((text, error))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("films")


@pytest.fixture(scope="module")
def video(folder):
    return write_video(folder / "h264-vfr.mp4", "libx264", ODD, GOP_250)


@pytest.fixture
def document(app):
    return Paper()


@pytest.fixture
def panel(document):
    panel = VideoPanel(document, VideoSelection(document))
    panel.resize(400, 200)
    panel.show()
    yield panel
    panel.close_video()
    panel.close()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("video ")]


def wait(true):
    until = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < until, "waited in vain"
        breathe()


def breathe():
    """Let the window and the decoder work; QTest.qWait would keep Python's lock all the while."""
    QCoreApplication.processEvents()
    time.sleep(0.001)


def number_of(image: QImage):
    image = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    return frame_number(rows[:, : 3 * image.width()].reshape(image.height(), -1, 3))


def on_screen(panel):
    """The number that the pixels say that are painted."""
    shot = panel.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(shot.constBits(), np.uint8).reshape(shot.height(), -1)
    pixels = rows[:, : 3 * shot.width()].reshape(shot.height(), -1, 3)
    ratio = shot.width() / panel.width()
    box = panel.picture_box()
    row = pixels[round(box.center().y() * ratio), :, 0]
    middles = box.left() + (np.arange(NUMBER_BITS) + 0.5) * box.width() / NUMBER_BITS
    return int(
        sum(1 << bit for bit in range(NUMBER_BITS) if row[round(middles[bit] * ratio)] > 128)
    )


def expected_frame(times, cursor):
    return int(np.flatnonzero(CLOCK.to_force(times - times[0]) <= cursor + 1e-6)[-1])


def test_after_any_seek_the_frame_at_the_cursor_is_on_the_screen(panel, document, video):
    document.show(video)
    wait(lambda: panel.settled and document.view.frame_times is not None)
    np.testing.assert_allclose(document.view.frame_times, CLOCK.to_force(ODD - ODD[0]), atol=1e-6)
    random = np.random.default_rng(1)
    for cursor in random.uniform(1.3, 1.2 + ODD[-1], 10):
        document.view.seek(cursor)
        wait(lambda: panel.settled)
        assert panel.shown_index == expected_frame(ODD, cursor)
        assert on_screen(panel) == panel.shown_index


def test_steps_onto_the_frames_own_times_show_these_frames(panel, document, video):
    document.show(video)
    wait(lambda: document.view.frame_times is not None)
    for number in [*range(100, 112), *range(112, 100, -1)]:
        document.view.seek(float(document.view.frame_times[number]))
        wait(lambda: panel.settled)
        assert panel.shown_index == number == number_of(panel.image)


def test_of_many_requests_the_newest_wins(panel, document, video):
    document.show(video)
    wait(lambda: document.view.frame_times is not None)
    shown = []
    panel.frame_shown.connect(shown.append)
    for cursor in np.random.default_rng(2).uniform(1.3, 1.2 + ODD[-1], 200):
        document.view.seek(cursor)
    wait(lambda: panel.settled)
    assert panel.shown_index == expected_frame(ODD, document.view.cursor) == on_screen(panel)
    assert len(shown) < 20


def test_while_playing_no_frame_is_later_than_the_cursor_and_none_goes_back(panel, document, video):
    document.show(video)
    wait(lambda: document.view.frame_times is not None)
    document.view.seek(2.0)
    wait(lambda: panel.settled)
    shown = []
    panel.frame_shown.connect(lambda number: shown.append((number, document.view.cursor)))
    document.view.playing = True
    began = time.monotonic()
    while len(shown) < 8:
        played = time.monotonic() - began
        assert played < 10
        document.view.seek(2.0 + played)
        breathe()
    document.view.playing = False
    wait(lambda: panel.settled)
    numbers = [number for number, _ in shown]
    assert numbers == sorted(numbers)
    assert all(document.view.frame_times[number] <= cursor + 1e-6 for number, cursor in shown)
    assert panel.shown_index == expected_frame(ODD, document.view.cursor)


def test_a_video_that_begins_a_little_late_is_opened_at_its_first_frame(panel, document, video):
    document.show(video, ClockMap(offset=0.3, rate=1.0), id_="late")
    wait(lambda: document.view.frame_times is not None and panel.settled)
    assert document.view.cursor == document.view.frame_times[0] > 0
    assert panel.message == ""


def test_before_the_first_frame_is_said_when_the_video_begins(panel, document, video):
    document.show(video)
    wait(lambda: document.view.frame_times is not None)
    document.view.seek(0.5)
    wait(lambda: panel.settled)
    assert panel.message == "The video begins at 1.234 s"
    assert panel.shown_index == -1
    document.view.seek(1e3)
    wait(lambda: panel.settled and panel.shown_index == COUNT - 1)
    assert panel.message == ""
    assert re.fullmatch(rf"\d+\.\d{{3}} s · frame {COUNT} of {COUNT} · ended", panel.caption)
    # All of it is read in the panel as the window first shows it, of a longer video, too.
    caption = panel.caption.replace(str(COUNT), "5400")
    assert panel.fontMetrics().horizontalAdvance(caption) < 250
    assert panel.accessibleDescription() == panel.caption


def test_without_a_video_there_is_no_thread_and_no_panel(panel, document):
    document.show(None)
    assert not panel.has_video
    assert panel.isHidden()
    assert panel.settled
    assert panel._frames is None


def test_another_demonstration_gets_its_own_video_and_one_without_gets_none(
    panel, document, video, folder
):
    other = write_opencv_video(folder / "mp4v.mp4", "mp4v", 90)
    document.show(video)
    document.show(other, ClockMap(), "b")
    document.view.seek(2.0)
    wait(lambda: document.view.frame_times is not None and panel.settled)
    np.testing.assert_allclose(document.view.frame_times, np.arange(90) / 30, atol=1e-6)
    assert panel.shown_index == 60 == on_screen(panel)
    document.show(None, id_="c")
    assert panel.shown_index == -1
    assert panel.isHidden()


def test_a_new_clock_is_followed_without_reading_the_video_again(panel, document, video):
    document.show(video)
    wait(lambda: document.view.frame_times is not None)
    document.view.seek(5.0)
    wait(lambda: panel.settled)
    before = panel.shown_index
    decoder = panel._frames._decoder
    document.show(video, ClockMap(offset=3.0))
    wait(lambda: panel.settled)
    assert panel._frames._decoder is decoder
    np.testing.assert_allclose(document.view.frame_times, ODD - ODD[0] + 3.0, atol=1e-6)
    assert panel.shown_index == int(np.flatnonzero(ODD - ODD[0] <= 2.0 + 1e-6)[-1]) != before


@pytest.mark.parametrize("kind", ["missing", "damaged", "truncated", "opencv"])
def test_what_cannot_be_shown_is_said_in_the_panel(
    panel, document, video, tmp_path, kind, monkeypatch
):
    path = tmp_path / "film.mp4"
    if kind == "damaged":
        path.write_bytes(b"no video" * 100)
    elif kind == "truncated":
        path.write_bytes(video.read_bytes()[:3000])
    elif kind == "opencv":
        import sys

        path = video
        monkeypatch.setitem(sys.modules, "cv2", None)
    document.show(path)
    wait(lambda: panel.message)
    assert panel.settled
    assert panel.failed
    assert path.name in panel.message
    assert panel.message.count(". ") == 0
    assert panel.grab().toImage().height() > 0
    # The rest works: the next one is shown.
    monkeypatch.undo()
    document.show(video, id_="b")
    document.view.seek(4.0)
    wait(lambda: panel.shown_index >= 0)
    assert not panel.failed


def test_a_video_that_is_cut_short_is_shown_as_far_as_it_goes(panel, document, tmp_path):
    whole = write_video(tmp_path / "w.mkv", "libx264", even_frame_times(150), {"g": "20"})
    content = whole.read_bytes()
    (tmp_path / "cut.mkv").write_bytes(content[: len(content) * 6 // 10])
    document.show(tmp_path / "cut.mkv")
    wait(lambda: document.messages)
    assert "cut short" in document.messages[0][0]
    document.view.seek(2.5)
    wait(lambda: panel.settled)
    assert on_screen(panel) == panel.shown_index > 20


def test_a_film_in_the_store_is_told_of_by_the_name_of_its_demonstration(panel, document, tmp_path):
    whole = write_video(tmp_path / "w.mkv", "libx264", even_frame_times(150), {"g": "20"})
    content = whole.read_bytes()
    stored = tmp_path / "video-0123456789abcdef.mkv"
    stored.write_bytes(content[: len(content) * 6 // 10])
    document.show(stored)
    wait(lambda: document.messages)
    assert document.messages[0][0].startswith("The video of 'a' is cut short: it ends at ")
    assert panel.toolTip() == document.messages[0][0]
    stored = tmp_path / "video-fedcba9876543210.mkv"
    document.show(stored)
    wait(lambda: panel.message)
    assert f"The video of 'a' ('{stored}') is not there; put it back" in panel.message


def test_hidden_it_asks_for_nothing_and_shown_again_it_is_right(panel, document, video):
    document.show(video)
    wait(lambda: document.view.frame_times is not None and panel.settled)
    panel.hide()
    before = panel.shown_index
    document.view.seek(6.0)
    QTest.qWait(50)
    assert panel.shown_index == before
    assert panel.settled
    panel.show()
    wait(lambda: panel.settled)
    assert panel.shown_index == expected_frame(ODD, 6.0)


def test_zoom_keeps_the_point_under_the_pointer_and_double_click_fits(panel, document, video):
    document.show(video)
    document.view.seek(3.0)
    wait(lambda: panel.shown_index >= 0)
    whole = panel.picture_box()
    about = QPointF(90, 80)
    panel.zoom_by(4.0, about)
    box = panel.picture_box()
    assert box.width() == pytest.approx(4 * whole.width())
    assert (about.x() - box.left()) / 4 == pytest.approx(about.x() - whole.left())
    QTest.mousePress(panel, Qt.MouseButton.LeftButton, pos=QPointF(200, 80).toPoint())
    QTest.mouseMove(panel, QPointF(150, 80).toPoint())
    QTest.mouseRelease(panel, Qt.MouseButton.LeftButton, pos=QPointF(150, 80).toPoint())
    assert panel.picture_box().left() == pytest.approx(box.left() - 50)
    QTest.mouseDClick(panel, Qt.MouseButton.LeftButton, pos=QPointF(150, 80).toPoint())
    assert panel.picture_box() == whole


def test_the_frame_can_be_copied(panel, document, video):
    document.show(video)
    document.view.seek(7.0)
    wait(lambda: panel.settled and panel.shown_index >= 0)
    copy = next(action for action in panel.menu().actions() if action.text() == "Copy frame")
    copy.trigger()
    assert number_of(QGuiApplication.clipboard().image()) == panel.shown_index


def test_a_long_index_tells_how_far_it_is_and_shows_the_first_frame_at_once(app, folder):
    path = write_opencv_video(folder / "long.mp4", "mp4v", 1200)
    frames, signals = VideoFrames(), []
    frames.indexed.connect(lambda done, total: signals.append(("indexed", done, total)))
    frames.frame_ready.connect(lambda number, _: signals.append(("frame", number)))
    frames.opened.connect(lambda times: signals.append(("opened", len(times))))
    frames.open(path)
    wait(lambda: signals and signals[-1][0] == "opened")
    frames.close()
    assert signals[0] == ("frame", 0)
    assert ("indexed", 1000, 1200) in signals
    assert signals[-1] == ("opened", 1200)


def test_neighbours_are_decoded_while_nothing_is_asked_for(app, video, monkeypatch):
    from forcelab.video.reader import VideoReader

    readers, ready = [], []
    start = VideoReader.__init__
    monkeypatch.setattr(
        VideoReader, "__init__", lambda self, *args: readers.append(self) or start(self, *args)
    )
    frames = VideoFrames()
    frames.frame_ready.connect(lambda number, _: ready.append(number))
    frames.open(video)
    frames.request_frame(150)
    wait(lambda: ready == [150])
    wait(lambda: frames.request_frame(151, 1) is not None)
    wait(lambda: all(readers[0].cached_frame(number) is not None for number in range(148, 164)))
    wait(lambda: frames.request_frame(152, 1) is not None)
    breathe()
    # What was given at once is not told again; of the first neighbour it depends on who was first.
    assert ready in ([150], [150, 151])
    frames.close()


def test_a_step_to_a_neighbour_scales_nothing_in_the_gui_s_thread(
    panel, document, video, monkeypatch
):
    scaling = []
    for module in (forcelab.gui.label.video_frames, forcelab.gui.label.picture_view):
        monkeypatch.setattr(
            module,
            "scaled",
            lambda *args: scaling.append(threading.current_thread()) or scaled(*args),
        )
    document.show(video)
    wait(lambda: document.view.frame_times is not None)

    def seek(number):
        document.view.seek(float(document.view.frame_times[number]))

    for number in (20, 100):  # at the first the decoder is told in which size
        seek(number)
        wait(lambda n=number: panel.settled and on_screen(panel) == n)
    frames = panel._frames
    wait(lambda: all(frames.fitted(number) is not None for number in range(98, 103)))
    scaling.clear()
    for number in (101, 102, 101, 100, 99):
        seek(number)
        assert on_screen(panel) == number
    assert threading.main_thread() not in scaling
    panel.resize(520, 300)  # no frame is there in this size
    assert on_screen(panel) == 99
    assert threading.main_thread() in scaling
    assert frames.fitted(99) is None
    panel.zoom_by(2.0)
    panel.grab()
    assert frames._decoder.size.isEmpty()


def test_the_preview_shows_the_frame_that_is_stepped_to_when_it_is_given_at_once(app, video):
    preview = VideoPreview()
    preview.frames.open(video)
    wait(lambda: preview.picture.image is not None and preview.times.size)
    for number in (100, 101, 102, 101):
        wait(lambda n=number: n == 100 or n in preview.frames._decoder._images)
        preview.show_frame(number)
        wait(lambda n=number: preview.picture.caption.startswith(f"frame {n + 1} "))
        assert number_of(preview.picture.image) == number
    preview.close_video()


def test_a_video_that_was_left_keeps_no_pictures_and_one_that_was_deleted_ends(app, video):
    frames = VideoFrames()
    frames.open(video)
    decoder = frames._decoder
    wait(lambda: decoder._sketches is not None and len(decoder._sketches) > 0)
    frames.abandon()
    wait(lambda: not decoder.thread.is_alive())
    assert decoder._sketches is None
    frames.open(video)
    decoder = frames._decoder
    wait(lambda: decoder.prepared)  # from then on it waits for a request
    shiboken6.delete(frames)
    wait(lambda: not decoder.thread.is_alive())


def test_after_a_rest_a_jump_shows_a_coarse_picture_of_the_right_frame_first(
    panel, document, video
):
    document.show(video)
    wait(lambda: document.view.frame_times is not None)
    wait(lambda: len(panel._frames._decoder._sketches) == COUNT)
    coarse = []
    panel._frames.sketch_ready.connect(lambda number, image: coarse.append((number, image.copy())))
    for cursor in (9.0, 2.0, 8.0, 4.0):
        document.view.seek(cursor)
        wait(lambda: panel.settled)
        assert panel.shown_index == expected_frame(ODD, cursor) == number_of(panel.image)
    assert all(number_of(image) == number for number, image in coarse)
    assert panel._sharp


def test_it_shows_the_frame_of_an_edge_while_that_is_dragged(document, panel, video):
    document.show(video)
    wait(lambda: document.view.frame_times is not None)
    document.view.seek(document.view.frame_times[20])
    document.view.set_peek(document.view.frame_times[60])
    wait(lambda: panel.settled)
    assert panel.shown_index == on_screen(panel) == 60
    document.view.set_peek(None)
    wait(lambda: panel.settled)
    assert panel.shown_index == on_screen(panel) == 20
