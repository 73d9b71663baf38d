"""The recorder: what came is in the project, whatever happened meanwhile."""

import re
import threading
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.capture.reader import RingBuffer
from forcelab.capture.recorder import Recorder
from forcelab.capture.save import CAPTURES, PartialSaveError, discard, recover, unfinished_journals
from forcelab.errors import InputError
from forcelab.project import Project
from forcelab.project.demonstrations import DemonstrationStore
from forcelab.project.media import MediaStore
from tests.capture.helpers import FakeDevice, FakeEncoder, eventually


@pytest.fixture(autouse=True)
def _no_thread_is_left():
    before = set(threading.enumerate())
    yield
    assert set(threading.enumerate()) <= before


def loaded(project, key):
    with Project.open(project) as opened:
        d = opened.demonstrations.load(key)
        stamps, tracks = opened.media.stamps(d.id), opened.tracks.of(d.id)
        return d, np.array(d.times), np.array(d.signals), stamps, tracks


def wait_for_samples(recorder, samples, device=0):
    eventually(lambda: recorder.state().devices[device].samples >= samples)


def wait_for_seconds(recorder, seconds, device=0):
    """Wait for a sample taken so long after now: on a busy machine many come late, at once."""
    until = time.monotonic() + seconds
    eventually(lambda: recorder.latest(0.0)[device][1].max(initial=0.0) >= until)


def test_a_recording_is_in_the_project_with_all_its_samples_and_stamps(project):
    with Recorder(project, [FakeDevice()]) as recorder:
        assert recorder.start("LEGO") == "LEGO 01"
        wait_for_samples(recorder, 200)
        assert recorder.state().recording
        saved = recorder.stop()
    d, times, signals, stamps, tracks = loaded(project, "LEGO 01")
    assert d.task == "LEGO"
    assert tracks == ()
    assert saved.samples == len(times) >= 200
    assert [channel.name for channel in d.channels] == ["fx1", "fy1", "fz1"]
    assert (np.diff(signals[:, 0]) == 1).all()
    np.testing.assert_array_equal(stamps["ticks_0"], signals[:, 0])
    assert (stamps["arrived_0"] >= stamps["start"] + times - 2e-3).all()
    assert stamps["clock_0"][1] * 1000 == pytest.approx(1, abs=0.05)
    assert d.gaps == ()
    assert not list((project / CAPTURES).iterdir())


def test_several_in_a_row_are_numbered_and_a_discarded_one_leaves_nothing(project):
    with Recorder(project, [FakeDevice()]) as recorder:
        for _ in range(2):
            recorder.start("LEGO")
            wait_for_samples(recorder, 30)
            recorder.stop()
        assert recorder.start("LEGO") == "LEGO 03"
        wait_for_samples(recorder, 30)
        recorder.discard()
        assert recorder.start("LEGO") == "LEGO 03"
        wait_for_samples(recorder, 30)
        recorder.stop()
        assert recorder.start("foam", name="by hand") == "by hand"
        wait_for_samples(recorder, 30)
        recorder.stop()
        assert not recorder.state().recording
    with Project.open(project) as opened:
        names = [demonstration.name for demonstration in opened.demonstrations.infos()]
    assert names == ["by hand", "LEGO 01", "LEGO 02", "LEGO 03"]
    assert not list((project / CAPTURES).iterdir())


def test_two_daqs_and_an_encoder_are_one_demonstration_on_one_clock(project):
    encoder = FakeEncoder()
    encoder.changes = [5]
    devices = [FakeDevice("fake:0"), FakeDevice("fake:1", ppm=200), encoder]
    with Recorder(project, devices) as recorder:
        wait_for_samples(recorder, 1, 2)  # what it gave before the recording holds
        recorder.start("LEGO")
        wait_for_samples(recorder, 100)
        encoder.changes = [7]
        wait_for_samples(recorder, 1, 2)
        wait_for_samples(recorder, 300)
        recorder.stop()
    d, _, signals, stamps, _ = loaded(project, "LEGO 01")
    names = [channel.name for channel in d.channels]
    assert names == ["fx1", "fy1", "fz1", "fx2", "fy2", "fz2", "opening"]
    assert np.isfinite(signals).all()
    # Both began to count at the same time, within the time of opening; values are ticks.
    offset = signals[:, 3] - signals[:, 0]
    assert np.ptp(offset) < 5 + 1000 * max(device.unread for device in devices[:2])
    assert set(signals[:, 6]) == {5.0, 7.0}
    assert {"arrived_2", "ticks_1", "clock_1"} <= set(stamps)
    assert "ticks_2" not in stamps


def test_marks_made_live_become_a_track(project):
    with Recorder(project, [FakeDevice()]) as recorder:
        recorder.mark("too early", True)
        recorder.start("LEGO", author="Ann")
        wait_for_seconds(recorder, 0.1)
        recorder.mark("grab", True)
        wait_for_seconds(recorder, 0.1)
        recorder.mark("hold", True)  # while grab is still down: the last one pressed counts
        wait_for_seconds(recorder, 0.1)
        recorder.mark("hold", False)
        recorder.mark("grab", False)
        wait_for_seconds(recorder, 0.05)
        recorder.mark("pull", True)
        wait_for_seconds(recorder, 0.05)
        recorder.stop()
    d, _, _, _, (track,) = loaded(project, "LEGO 01")
    assert track.author == "Ann"
    assert [s.action for s in track.segments if s.duration > 1e-3] == ["grab", "hold", "pull"]
    assert track.segments[0].start >= 0.05
    assert track.segments[0].end == track.segments[1].start
    assert track.segments[-1].end == d.end
    with Project.open(project) as opened:
        assert "grab" in [action.name for action in opened.actions.vocabulary("LEGO").actions]


@pytest.mark.parametrize("continues", [True, False])
def test_what_a_device_lost_while_it_was_away_is_told_live_as_it_is_kept(project, continues):
    device = FakeDevice()

    def go_on():
        """Its cable alone was out: its counter went on, and nobody heard it."""
        if device.gone.is_set():
            raise InputError("It is not there.")
        device.next = int((time.monotonic() - device.began) * device.rate)

    if continues:
        device.reopen = go_on
    with Recorder(project, [device]) as recorder:
        recorder.start("LEGO")
        wait_for_seconds(recorder, 0.1)
        device.gone.set()
        eventually(lambda: "unplugged" in recorder.state().devices[0].alarms)
        time.sleep(0.1)
        device.gone.clear()
        eventually(lambda: recorder.state().devices[0].plugged)
        wait_for_seconds(recorder, 0.1)
        lost = recorder.state().devices[0].lost
        saved = recorder.stop()
    (remark,) = saved.remarks
    if continues:
        assert lost >= 100
        loss = "samples of fake:0 were lost and the device was unplugged once for 0"
        assert remark.startswith(f"{lost} {loss}")
    else:
        assert lost == 0
        assert re.fullmatch(r"fake:0 was unplugged once for \d+\.\d s; that is a gap\.", remark)


def test_a_device_that_stays_away_until_the_end_makes_the_recording_shorter(project):
    devices = [FakeDevice(), FakeDevice("fake:1")]
    said = []
    for gone in devices:
        with Recorder(project, devices) as recorder:
            recorder.start("LEGO")
            wait_for_seconds(recorder, 0.1)
            gone.gone.set()
            eventually(lambda: any(not device.plugged for device in recorder.state().devices))
            time.sleep(0.15)
            said.append((recorder.state().seconds, recorder.stop()))
        gone.gone.clear()
    away = r"fake:%d was unplugged until the end, for the last (\d\.\d) s; "
    [short], [missing] = (saved.remarks for _, saved in said)
    match = re.fullmatch(away % 0 + r"the recording is shorter by that\.", short)
    seconds, saved = said[0]
    assert float(match[1]) == pytest.approx(seconds - saved.seconds, abs=0.2)
    assert float(match[1]) >= 0.1
    assert re.fullmatch(away % 1 + r"its channels are empty from then on\.", missing)


def test_a_second_device_that_is_away_is_missing_and_the_first_goes_on(project):
    second = FakeDevice("fake:1")
    with Recorder(project, [FakeDevice(), second]) as recorder:
        recorder.start("LEGO")
        wait_for_seconds(recorder, 0.05, 1)
        second.gone.set()
        wait_for_seconds(recorder, 0.1)
        second.gone.clear()
        eventually(lambda: recorder.state().devices[1].plugged)
        wait_for_seconds(recorder, 0.05, 1)
        wait_for_seconds(recorder, 0.05)
        recorder.stop()
    _, times, signals, _, _ = loaded(project, "LEGO 01")
    missing = np.isnan(signals[:, 3])
    assert np.isfinite(signals[:, :3]).all()
    assert missing.sum() > 75
    assert np.count_nonzero(np.diff(missing.astype(int))) == 2  # one stretch
    assert (np.diff(times) < 0.02).all()


def test_lost_samples_are_counted_said_and_absent(project):
    device = FakeDevice()
    with Recorder(project, [device]) as recorder:
        recorder.start("LEGO")
        first = device.next + 50  # what comes before a recording is not of it
        device.lose = np.r_[first : first + 20, first + 100]
        wait_for_samples(recorder, 200)
        state = recorder.state().devices[0]
        saved = recorder.stop()
    assert state.lost == 21
    assert any("21 samples" in remark for remark in saved.remarks)
    _, _, signals, _, _ = loaded(project, "LEGO 01")
    assert not np.isin(device.lose, signals[:, 0]).any()


def test_saturation_stalling_and_drift_are_alarms(project, monkeypatch):
    monkeypatch.setattr("forcelab.capture.reader._STALLED", 0.15)
    monkeypatch.setattr("forcelab.capture.clock._SETTLED", 0.3)
    device = FakeDevice(ppm=5_000)
    device.status = 1 << 7
    with Recorder(project, [device]) as recorder:
        eventually(lambda: "saturation" in recorder.state().devices[0].alarms)
        eventually(lambda: "drift" in recorder.state().devices[0].alarms)
        assert recorder.state().devices[0].saturated > 0
        device.rate = 0.0
        device.next = 10**9
        eventually(lambda: "stalled" in recorder.state().devices[0].alarms)


def test_a_device_that_gives_other_than_it_was_told_is_said_once(project, monkeypatch):
    for module in ("reader", "clock"):
        monkeypatch.setattr(f"forcelab.capture.{module}._SETTLED", 0.5)
    wrong, right = FakeDevice("wrong:0", ppm=-100_000), FakeDevice("right:0", ppm=500)
    remarks = []
    with Recorder(project, [wrong, right]) as recorder:
        eventually(lambda: remarks.extend(recorder.remarks()) or remarks)
        wait_for_samples(recorder, recorder.state().devices[0].samples + 50)
        remarks += recorder.remarks()
    (sentence,) = remarks
    assert re.search(r"^wrong:0 gives 11\d\d samples a second, not 1000: .*\?rate=11\d\d", sentence)


def test_a_zero_that_wanders_is_an_alarm_until_it_is_zeroed(project):
    device = FakeDevice()
    with Recorder(project, [device]) as recorder:
        reader = recorder._readers[0]
        times = np.arange(0, 30, 0.01)
        noise = np.random.default_rng(0).normal(scale=0.01, size=(len(times), 3))
        values = noise + np.stack([0.05 * times, 0 * times, 0 * times], axis=1)
        with reader._lock:
            reader._zero_drift.restart()
            for first in range(0, len(times), 10):
                reader._zero_drift.update(times[first : first + 10], values[first : first + 10])
            [(channel, by)] = reader._drifted()
        assert channel.name == "fx"
        assert by == pytest.approx(1.3, abs=0.2)
        assert "zero" in recorder.state().devices[0].alarms
        recorder.zero()
        eventually(lambda: "zero" not in recorder.state().devices[0].alarms)


def test_zero_is_handed_to_every_device_in_its_own_thread(project):
    devices = [FakeDevice("fake:0"), FakeDevice("fake:1")]
    with Recorder(project, devices) as recorder:
        recorder.zero()
        eventually(lambda: all(device.zeroed == 1 for device in devices))


def test_samples_that_were_dropped_to_zero_a_device_are_not_lost(project):
    class Zeroing(FakeDevice):
        def zero(self):
            super().zero()
            self.next += 200

    device = Zeroing()
    with Recorder(project, [device]) as recorder:
        wait_for_samples(recorder, 50)
        recorder.zero()
        eventually(lambda: device.zeroed == 1)
        wait_for_samples(recorder, 150)
        state = recorder.state().devices[0]
        assert (state.lost, state.alarms) == (0, ())
        device.lose = np.arange(device.next + 30, device.next + 40)
        eventually(lambda: "lost samples" in recorder.state().devices[0].alarms)


def test_the_latest_seconds_are_there_for_views(project):
    device = FakeDevice()
    with Recorder(project, [device], seconds=0.2) as recorder:
        wait_for_samples(recorder, 250)
        first, times, values = recorder.latest(0.1)[0]
        assert values.shape == (len(times), 3)
        assert 50 <= len(times) <= 200
        np.testing.assert_array_equal(values[:, 0], first + np.arange(len(times)))
        again, _, more = recorder.since(0, first)
        assert again >= first
        assert len(more) >= 1
        device.say("It is warm.")
        eventually(lambda: "It is warm." in recorder.remarks())


def test_a_device_that_cannot_be_opened_leaves_none_open(project):
    good, bad = FakeDevice("fake:0"), FakeDevice("fake:1")
    bad.gone.set()
    with pytest.raises(InputError, match="fake:1"):
        Recorder(project, [good, bad]).open()
    assert good.closed == 1


def test_what_cannot_be_recorded_is_one_sentence(project, tmp_path):
    with Recorder(tmp_path / "none.forcelab", [FakeDevice()]) as recorder:
        with pytest.raises(InputError, match="none.forcelab"):
            recorder.start("LEGO")
        with pytest.raises(InputError, match="start a recording"):
            recorder.stop()
    silent = FakeDevice()
    silent.rate = 0.0
    with Recorder(project, [silent]) as recorder:
        with pytest.raises(InputError, match="task"):
            recorder.start(" ")
        recorder.start("LEGO")
        with pytest.raises(InputError, match="still being recorded"):
            recorder.start("LEGO")
        with pytest.raises(InputError, match="Fewer than two samples"):
            recorder.stop()
        recorder.discard()


def test_a_project_that_is_away_when_it_stops_gets_the_recording_later(project, tmp_path):
    with Recorder(project, [FakeDevice()]) as recorder:
        recorder.start("LEGO")
        wait_for_samples(recorder, 100)
        project.rename(tmp_path / "away")
        wait_for_samples(recorder, 200)
        with pytest.raises(InputError):
            recorder.stop()
        (tmp_path / "away").rename(project)
        assert recorder.stop().samples >= 200


def refuse(*_):
    raise InputError("The disk is full.")


def test_what_could_not_be_kept_whole_is_not_kept_in_part(project, monkeypatch):
    with Recorder(project, [FakeDevice()]) as recorder:
        recorder.start("LEGO")
        recorder.mark("grab", True)
        wait_for_samples(recorder, 200)
        with monkeypatch.context() as patch:
            patch.setattr(MediaStore, "attach_stamps", refuse)
            with pytest.raises(InputError, match="disk is full"):
                recorder.stop()
        with Project.open(project) as opened:
            assert opened.demonstrations.infos() == ()
        assert recorder.stop().added.status == "new"


def test_a_recordings_first_sample_can_be_had_after_it_began(project):
    encoder = FakeEncoder()
    with Recorder(project, [FakeDevice(), encoder]) as recorder:
        encoder.changes += [7.0, 8.0]
        eventually(lambda: len(recorder.since(0, 0)[1]) > 50 and len(recorder.since(1, 0)[1]) > 1)
        recorder.start("LEGO")
        wait_for_samples(recorder, 200)
        _, _, values = recorder.since(0, recorder.firsts[0])
        _, _, held = recorder.since(1, recorder.firsts[1])
        recorder.stop()
    _, _, signals, _, _ = loaded(project, "LEGO 01")
    assert signals[0, 0] == values[0, 0] > 0
    assert held.tolist() == [[8.0]]  # since before the recording, and not what was before that


@pytest.fixture
def partial_recorder(project, monkeypatch):
    """A recorder of whose recording a part is in the project, as that could not be taken back."""

    with Recorder(project, [FakeDevice()]) as recorder:
        recorder.start("LEGO")
        wait_for_samples(recorder, 200)
        with monkeypatch.context() as patch:
            patch.setattr(MediaStore, "attach_stamps", refuse)
            patch.setattr(DemonstrationStore, "discard", refuse)
            with pytest.raises(
                InputError, match="disk is full. 'LEGO 01' is in the project without"
            ):
                recorder.stop()
            with pytest.raises(InputError, match="disk is full"):
                recorder.discard()
        assert recorder.has_recording
        assert [info.name for info in stored_infos(project)] == ["LEGO 01"]
        yield recorder
        assert not recorder.has_recording
    assert stored_infos(project) == ()
    assert not list((project / CAPTURES).iterdir())


def stored_infos(project):
    with Project.open(project) as opened:
        return opened.demonstrations.infos()


def test_what_is_in_the_project_in_part_is_removed_when_it_is_discarded(partial_recorder):
    partial_recorder.discard()


def test_it_may_be_discarded_after_somebody_removed_that_part(partial_recorder, project):
    with Project.open(project) as opened:
        opened.demonstrations.remove_all(
            {demonstration.id: {} for demonstration in opened.demonstrations.infos()}
        )
    partial_recorder.discard()


def test_stopped_again_it_is_new_and_may_be_discarded(partial_recorder, project):
    saved = partial_recorder.stop()
    assert saved.added.status == "new"
    with Project.open(project) as opened:
        assert opened.media.stamps(saved.added.id) is not None
    discard(project, saved)


def test_a_recorder_that_is_closed_without_stopping_leaves_what_can_be_recovered(project):
    with Recorder(project, [FakeDevice()]) as recorder:
        recorder.start("LEGO")
        assert unfinished_journals(project) == ()  # it is being written
        wait_for_samples(recorder, 200)
    assert len(unfinished_journals(project)) == 1
    (project / CAPTURES / "no.journal").write_bytes(b"junk")
    bad, good = sorted(recover(project), key=lambda recovered: recovered.recording is not None)
    assert good.recording.samples >= 200
    assert "no journal" in bad.problem
    assert bad.path.exists()
    assert [path.name for path in (project / CAPTURES).iterdir()] == ["no.journal"]
    assert loaded(project, "LEGO 01")[1].size == good.recording.samples


@given(
    length=st.integers(1, 20),
    blocks=st.lists(st.integers(0, 30), max_size=12),
    position=st.integers(0, 200),
)
def test_a_ring_gives_the_last_samples_in_their_order(length, blocks, position):
    ring, every = RingBuffer(length, 2), np.empty(0)
    for n in blocks:
        more = np.arange(len(every), len(every) + n, dtype=float)
        ring.extend(more / 10, np.stack([more, -more], axis=1))
        every = np.concatenate([every, more])
    first, times, values = ring.since(position)
    expected = every[max(position, len(every) - length) :]
    np.testing.assert_array_equal(values[:, 0], expected)
    np.testing.assert_array_equal(times, expected / 10)
    if len(expected):
        assert first == expected[0]
    _, times, _ = ring.latest(0.55)
    assert len(times) == min(len(every), length, 6)


def test_nothing_is_begun_with_every_device_unplugged(project):
    device = FakeDevice()
    with Recorder(project, [device]) as recorder:
        wait_for_samples(recorder, 10)
        device.gone.set()
        eventually(lambda: not recorder.state().devices[0].plugged)
        with pytest.raises(InputError, match="No device is plugged in"):
            recorder.start("LEGO")
        assert not recorder.has_recording


@pytest.mark.parametrize(
    ("first", "sentence"),
    [
        (OSError("torn"), "It ended early (OSError('torn')). 'LEGO 01' is in the project without"),
        (KeyboardInterrupt(), "It ended early (KeyboardInterrupt()). 'LEGO 01' is in the project"),
    ],
)
def test_what_is_neither_whole_nor_taken_back_is_told_and_can_be_mended(
    project, monkeypatch, first, sentence
):
    def fail(error):
        def failing(*_):
            raise error

        return failing

    with Recorder(project, [FakeDevice()]) as recorder:
        recorder.start("LEGO")
        eventually(lambda: recorder.state().devices[0].samples >= 100)
        with monkeypatch.context() as patch:
            patch.setattr(MediaStore, "attach_stamps", fail(first))
            patch.setattr(DemonstrationStore, "discard", fail(InputError("It is kept busy.")))
            with pytest.raises(PartialSaveError) as caught:
                recorder.stop()
        assert sentence in str(caught.value)
        assert str(caught.value).endswith("taken back either: It is kept busy.")
        assert caught.value.__cause__ is first
        recorder.discard()  # as it knows that a part is in the project
    with Project.open(project) as opened:
        assert opened.demonstrations.infos() == ()
