"""Cameras: every frame is stamped and written, dropped ones are counted, silence is a gap."""

import shutil
import threading
import time

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.capture.camera import (
    CameraReader,
    DropCounter,
    OpenCvCamera,
    open_camera,
    open_cameras,
    persistent_link,
)
from forcelab.capture.journal import JournalWriter
from forcelab.capture.recorder import Recorder
from forcelab.capture.save import recover
from forcelab.errors import InputError
from forcelab.project import Project
from forcelab.video.jpeg_writer import JpegVideoWriter
from forcelab.video.reader import VideoReader
from tests.capture.helpers import FakeDevice, FullDisk, eventually


class FakeCamera:
    """A camera whose picture's grey is its number; its own stamps move if told."""

    def __init__(self, rate=50.0, own=True, skip=()):
        self.rate, self.own, self.skip = rate, own, set(skip)
        self.number, self.there, self.released = -1, threading.Event(), False
        self.there.set()
        self.looked_for, self.size = 0, (48, 64)
        self.began = time.monotonic()

    def read(self):
        if not self.there.is_set():
            time.sleep(0.01)
            return False, None
        self.number += 1
        while self.number in self.skip:
            self.number += 1
        wait = self.began + self.number / self.rate - time.monotonic()
        # After a thread was kept from running too, each picture takes its time to come over.
        time.sleep(max(wait, 0.002))
        return True, np.full((*self.size, 3), 20 + self.number % 200, dtype=np.uint8)

    def get(self, what):
        return 1000.0 * (1 + self.number / self.rate) if what == 0 and self.own else 0.0

    def release(self):
        self.released = True

    def reopen(self):
        self.looked_for += 1
        # What it saw meanwhile is gone: no camera hands that over all at once.
        self.number = max(self.number, int((time.monotonic() - self.began) * self.rate))
        return self.there.is_set()


@pytest.mark.parametrize("own", [True, False])
def test_a_recording_has_its_video_on_the_force_clock(project, own):
    camera = FakeCamera(own=own)
    with Recorder(project, [FakeDevice()], [("camera 0", camera)]) as recorder:
        eventually(lambda: recorder.state().cameras[0].frames > 3)
        recorder.start("LEGO")
        eventually(lambda: recorder.state().cameras[0].frames > 20)
        assert recorder.cameras[0].latest()[1].shape == (48, 64, 3)
        recorder.stop()
    assert camera.released
    with Project.open(project) as opened:
        d = opened.demonstrations.load("LEGO 01")
        stamps = opened.media.stamps(d.id)
    frames = stamps["frames_0"]
    assert np.isfinite(frames[:, 1]).all() == own
    with VideoReader(d.video.path) as video:
        assert len(video) == len(frames) >= 20
        at = d.video.clock.to_force(video.times)
        # A frame stands where it arrived, to a tenth of a millisecond.
        np.testing.assert_allclose(at, frames[:, 0] - stamps["start"], atol=2e-4)
        greys = [int(np.median(video.frame(i))) for i in (0, 5, 12, len(video) - 1)]
    assert np.diff(greys).tolist() == [5, 7, len(frames) - 13]
    assert not list((project / "captures").iterdir())


def test_dropped_frames_are_counted_by_the_cameras_own_stamps():
    camera = CameraReader(0, FakeCamera(rate=100, skip=[20, 21, 40]), "camera 0")
    try:
        eventually(lambda: camera.state().frames > 50)
        assert camera.state().dropped == 3
        assert camera.state().rate == pytest.approx(100, rel=1e-3)
    finally:
        camera.close()


def test_a_camera_that_falls_silent_is_said_once(monkeypatch):
    monkeypatch.setattr("forcelab.capture.camera.SILENT_SECONDS", 0.05)
    fake = FakeCamera()
    camera = CameraReader(0, fake, "camera 0")
    try:
        eventually(lambda: camera.state().frames > 1)
        fake.there.clear()
        eventually(lambda: "no picture" in camera.state().alarms)
        time.sleep(0.1)
        assert len(camera.remarks()) == 1
        fake.there.set()
        eventually(lambda: camera.state().alarms == ())
    finally:
        camera.close()


def test_a_recording_cut_off_has_its_video_when_it_is_recovered(project, tmp_path):
    with Recorder(project, [FakeDevice()], [("camera 0", FakeCamera(200.0))]) as recorder:
        recorder.start("LEGO")
        # The journal is behind the video by what it brings to the disk at a time.
        eventually(lambda: recorder.state().cameras[0].frames > 100)
        killed = shutil.copytree(project, tmp_path / "killed")  # what a kill leaves now
    (recovered,) = recover(killed)
    assert recovered.recording is not None
    with (
        Project.open(killed) as opened,
        VideoReader(opened.demonstrations.load("LEGO 01").video.path) as video,
    ):
        assert len(video) >= 20


def jpeg(number):
    picture = np.full((48, 64, 3), 20 + number, dtype=np.uint8)
    return cv2.imencode(".jpg", picture)[1].tobytes()


def test_a_full_disk_costs_only_the_frames_it_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("forcelab.video.jpeg_writer.FileIO", FullDisk)
    writer = JpegVideoWriter(tmp_path / "a.mkv", 64, 48)
    for i in range(60):
        if i == 20:
            monkeypatch.setattr(FullDisk, "room", 100)
        if i == 40:
            monkeypatch.setattr(FullDisk, "room", 10**9)
        try:
            writer.write(jpeg(i), i / 30)
        except OSError:
            assert 20 <= i < 40
    writer.close()
    with VideoReader(tmp_path / "a.mkv") as video:
        assert len(video) == 40
        np.testing.assert_allclose(video.times, np.r_[0:20, 40:60] / 30, atol=1e-4)
        assert int(np.median(video.frame(25))) == pytest.approx(65, abs=2)


def test_a_disk_that_is_full_as_recording_begins_costs_only_the_frames_it_refused(
    tmp_path, monkeypatch
):
    camera = CameraReader(0, FakeCamera(rate=50), "camera 0")
    journal = JournalWriter(tmp_path / "a.journal", {})
    monkeypatch.setattr("forcelab.video.jpeg_writer.FileIO", FullDisk)
    monkeypatch.setattr(FullDisk, "room", 100)
    try:
        camera.record_to(journal, tmp_path / "a.mkv")
        eventually(lambda: "not written" in camera.state().alarms)
        monkeypatch.setattr(FullDisk, "room", 10**9)
        eventually(lambda: not camera.state().alarms)
        begun = camera.state().frames
        eventually(lambda: camera.state().frames >= begun + 5)
    finally:
        camera.close()
        journal.close()
    with VideoReader(tmp_path / "a.mkv") as video:
        assert len(video) >= 5


@settings(max_examples=25, deadline=None)
@given(cut=st.floats(0.02, 1), steps=st.lists(st.floats(0.001, 3.0), min_size=2, max_size=20))
def test_a_video_cut_anywhere_gives_all_whole_pictures(tmp_path_factory, cut, steps):
    path = tmp_path_factory.mktemp("cut") / "a.mkv"
    writer = JpegVideoWriter(path, 64, 48)
    times, ends = [], []
    for i, time_ in enumerate(np.cumsum([0.0, *steps])):
        times.append(writer.write(jpeg(i), time_))
        ends.append(path.stat().st_size)
    head = 400
    size = int(head + cut * (ends[-1] - head))
    cut_off = path.read_bytes()[:size]
    writer.close()
    if cut < 1:
        path.write_bytes(cut_off)
    complete = sum(end <= size for end in ends)
    if complete < 2:
        return
    with VideoReader(path) as video:
        # The last picture may be one that was cut; players show what there is of it.
        assert complete - 1 <= len(video) <= complete + 1
        np.testing.assert_allclose(video.times, times[: len(video)], atol=1e-6)


def test_a_camera_that_was_away_is_a_gap_in_its_one_video(project, monkeypatch):
    # Shorter than in earnest.
    monkeypatch.setattr("forcelab.capture.camera.SILENT_SECONDS", 0.3)
    monkeypatch.setattr("forcelab.capture.camera._RETRY", 0.01)
    monkeypatch.setattr("forcelab.capture.assemble.SILENT_SECONDS", 0.3)
    camera = FakeCamera(rate=200)
    with Recorder(project, [FakeDevice()], [("camera 0", camera)]) as recorder:
        recorder.start("LEGO")
        eventually(lambda: recorder.state().cameras[0].frames > 20)
        camera.there.clear()
        eventually(lambda: camera.looked_for > 3)
        assert recorder.state().cameras[0].alarms == ("no picture",)
        before = recorder.state().cameras[0].frames
        camera.size = (24, 32)  # another mode, as a camera may come back with
        camera.there.set()
        eventually(lambda: recorder.state().cameras[0].frames > before + 20)
        assert recorder.state().cameras[0].alarms == ()
        remarks = recorder.remarks()
        saved = recorder.stop()
    assert any("camera 0 is back after" in sentence for sentence in remarks)
    # More than once, where the machine kept its thread from running as long.
    assert any("camera 0 was away " in remark for remark in saved.remarks)
    with Project.open(project) as opened:
        d = opened.demonstrations.load("LEGO 01")
        stamps = opened.media.stamps(d.id)
    with VideoReader(d.video.path) as video:
        assert len(video) == len(stamps["frames_0"]) > 40
        at = d.video.clock.to_force(video.times)
        np.testing.assert_allclose(at, stamps["frames_0"][:, 0] - stamps["start"], atol=2e-4)
        assert np.diff(at).max() > 0.1
        assert video.frame(len(video) - 1).shape[:2] == (48, 64)


def filmed_by_two(project):
    """A recording with two cameras."""
    cameras = [("camera 0", FakeCamera()), ("camera 1", FakeCamera(rate=100))]
    with Recorder(project, [FakeDevice()], cameras) as recorder:
        recorder.start("LEGO")
        eventually(lambda: all(camera.frames > 12 for camera in recorder.state().cameras))
        return recorder.stop()


def test_of_two_cameras_both_films_become_videos_on_clocks_of_their_own(project):
    assert filmed_by_two(project).remarks == ()
    with Project.open(project) as opened:
        d = opened.demonstrations.load("LEGO 01")
        stamps = opened.media.stamps(d.id)
    assert [video.name for video in d.videos] == ["camera 0", "camera 1"]
    for number, video in enumerate(d.videos):
        with VideoReader(video.path) as film:
            arrived = stamps[f"frames_{number}"][:, 0] - stamps["start"]
            assert len(film) == len(arrived) > 12
            np.testing.assert_allclose(np.diff(film.times), np.diff(arrived), atol=2e-4)
            np.testing.assert_allclose(video.clock.to_force(film.times), arrived, atol=2e-4)


@pytest.mark.parametrize("which", ["", "abc", "-1", " 0", "video0", "0?x=1", "\N{SUPERSCRIPT TWO}"])
def test_words_that_mean_no_camera_are_refused_before_one_is_looked_for(which):
    with pytest.raises(InputError, match="is no camera; .* such as 0"):
        open_camera(which)


def test_a_camera_that_is_named_twice_is_refused_and_the_first_let_go_of(monkeypatch):
    opened = []
    monkeypatch.setattr(
        "forcelab.capture.camera.open_camera", lambda _: opened.append(FakeCamera()) or opened[-1]
    )
    with pytest.raises(InputError, match="camera 0 is named twice"):
        open_cameras(["0", "1", "0"])
    assert [camera.released for camera in opened] == [True, True]


def test_a_camera_keeps_its_name_whatever_number_it_gets(tmp_path):
    device, link = tmp_path / "video3", tmp_path / "links" / "usb-Lab_Camera-index0"
    device.touch()
    link.parent.mkdir()
    link.symlink_to(device)
    assert persistent_link(str(device), link.parent) == link
    assert persistent_link(str(tmp_path / "video4"), link.parent) is None
    assert persistent_link("0", tmp_path / "none") is None


def test_a_camera_is_opened_again_from_its_file(tmp_path):
    writer = JpegVideoWriter(tmp_path / "a.mkv", 64, 48)
    for i in range(5):
        writer.write(jpeg(i), i / 30)
    writer.close()
    camera = OpenCvCamera(str(tmp_path / "a.mkv"))
    assert camera.read()[0]
    camera.release()
    assert camera.read() == (False, None)
    assert camera.get(0) == 0.0
    assert camera.reopen()
    assert camera.read()[1].shape == (48, 64, 3)
    camera.release()
    (tmp_path / "a.mkv").unlink()
    assert not camera.reopen()


def test_a_camera_that_is_not_there_is_one_sentence():
    with pytest.raises(InputError, match="camera 93 cannot be opened"):
        open_camera("93")


RATE = 30.0


def delivered(seed, seconds=300.0, dropped=0.0, starved=0):
    """When frames arrive at a reader that is busy now and then; how many are missing between."""
    rng = np.random.default_rng(seed)
    true = np.arange(int(seconds * RATE)) / RATE
    received = rng.random(len(true)) >= dropped
    ready = true + rng.exponential(0.003, len(true))
    for begin in rng.uniform(0, seconds, 20):  # nobody reads for up to 0.4 s
        end = begin + rng.uniform(0.02, 0.4)
        ready[(ready > begin) & (ready < end)] = end
    for begin in rng.uniform(0, seconds, starved):  # all is late for two seconds
        late = (ready > begin) & (ready < begin + 2)
        ready[late] += rng.uniform(0, 0.02, late.sum())
    arrived = np.maximum.accumulate(ready)[received] + 1e-3 * np.arange(received.sum()) / RATE
    for i in range(1, len(arrived)):
        arrived[i] = max(arrived[i], arrived[i - 1] + 0.001)
    inside = received[np.flatnonzero(received)[0] : np.flatnonzero(received)[-1]]
    return arrived, int((~inside).sum())


def counted(arrived, own=None):
    count = DropCounter()
    for i, at in enumerate(arrived):
        count.count(at, 0.0 if own is None else own[i])
    assert count.frames == len(arrived)
    return count


@pytest.mark.parametrize("seed", range(4))
def test_frames_that_are_late_are_not_missing(seed):
    count = counted(delivered(seed)[0])
    assert count.dropped <= 1  # of 9000
    assert counted(delivered(seed, starved=5)[0]).dropped <= 2
    assert count.rate == pytest.approx(RATE, rel=0.05)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("share", [0.002, 0.02])
def test_frames_that_are_missing_are_counted_among_late_ones(seed, share):
    arrived, missing = delivered(seed, dropped=share)
    assert counted(arrived).dropped == pytest.approx(missing, abs=max(2, 0.06 * missing))


def test_a_gap_is_counted_at_once_and_taken_back_when_it_was_a_delay():
    count = counted(np.arange(20) / RATE)
    count.count(23 / RATE)
    assert count.dropped == 3
    for late in (23.1, 23.2, 23.3, 24.0, 25.0):
        count.count(late / RATE)
    assert count.dropped == 0


def test_what_a_driver_kept_before_anybody_read_tells_no_period():
    count = counted(np.r_[np.arange(4) * 1e-5, 0.01 + np.arange(100) / RATE])
    assert count.dropped == 0
    assert count.rate == pytest.approx(RATE)


def test_by_its_own_stamps_every_frame_is_known_whenever_it_arrived():
    rng = np.random.default_rng(0)
    own = 1 + np.delete(np.arange(400), [20, 21, 90, 200]) / RATE
    arrived = np.maximum.accumulate(own + rng.exponential(0.1, len(own)))
    assert counted(arrived, own).dropped == 4


def test_what_it_did_not_see_while_it_was_away_it_did_not_drop():
    count = counted(np.arange(30) / RATE)
    count.interrupt()
    for i in range(30):
        count.count(20 + i / RATE)
    assert count.dropped == 0
    assert count.frames == 60
    count.restart()
    assert (count.frames, count.dropped) == (0, 0)
    assert count.rate == pytest.approx(RATE)


def test_another_rate_is_learnt():
    count = counted(np.concatenate([np.arange(90) / RATE, 3 + np.arange(1, 200) / 15]))
    before = count.dropped
    for i in range(200, 300):
        count.count(3 + i / 15)
    assert count.rate == pytest.approx(15, rel=1e-3)
    assert count.dropped == before
