"""Streams of the Lab Streaming Layer as devices: real outlets on this machine, recorded."""

import time

import numpy as np
import pytest

pytest.importorskip("pylsl")

import pylsl

from forcelab.capture import lsl
from forcelab.capture.device_names import name_stream, parse_device, parse_devices
from forcelab.capture.recorder import Recorder
from forcelab.cli import main
from forcelab.demonstration import Channel
from forcelab.errors import InputError
from forcelab.project import Project
from tests.capture.helpers import eventually
from tests.capture.lsl_streams import clock_ahead, host_clock, sending, sine

#: Seconds that a stamp may be off what the outlet gave: what liblsl says of its clock correction.
STATED = 1e-3


@pytest.fixture(autouse=True)
def short_search(monkeypatch):
    """On one machine all streams answer at once."""
    monkeypatch.setattr(lsl, "SEARCH_SECONDS", 0.2)


def record(project, device, until):
    """Record until something is true of the recorder; gives what was kept, and its stamps' zero."""
    with Recorder(project, [device]) as recorder:
        recorder.start("hold")
        eventually(lambda: until(recorder))
        saved = recorder.stop()
        remarks = recorder.remarks()
    with Project.open(project) as opened:
        demonstration = opened.demonstrations.load(saved.added.id)
        start = float(opened.media.stamps(demonstration.id)["start"])
    return demonstration, start, [*saved.remarks, *remarks]


def alarms_after(recorder, samples):
    """The alarms of the only device once it has given so many samples."""
    [device] = recorder.state().devices
    return device.alarms if device.samples > samples else ()


def test_values_are_those_sent_and_times_those_of_the_outlet(project):
    with sending("forces") as sender:
        demonstration, start, remarks = record(
            project, parse_device("lsl:forces"), lambda r: r.state().devices[0].samples > 100
        )
    assert demonstration.channels == (Channel("fz1", "N"), Channel("wave", "mm"))
    numbers = demonstration.signals[:, 0].astype(int)
    assert np.array_equal(np.diff(numbers), np.ones(len(numbers) - 1))
    assert np.array_equal(demonstration.signals, [sine(k, 500.0) for k in numbers])
    sent = host_clock(sender.stamp(numbers))
    assert np.abs(demonstration.times + start - sent).max() < STATED
    assert remarks == []


def test_a_clock_that_is_ahead_is_corrected(project, monkeypatch):
    with sending("forces", offset=1000.0) as sender:
        [info] = pylsl.resolve_byprop("name", "forces", timeout=5.0)
        with clock_ahead(1000.0, info) as changed:
            monkeypatch.setattr(lsl, "_search", lambda _: [[changed]])
            demonstration, start, remarks = record(
                project, parse_device("lsl:"), lambda r: r.state().devices[0].samples > 100
            )
    sent = host_clock(sender.stamp(demonstration.signals[:, 0]))
    # The relay is no faster than a busy machine lets it be.
    assert np.abs(demonstration.times + start - sent).max() < 5 * STATED
    assert remarks == []


def test_uneven_stamps_of_what_was_sampled_evenly_are_evened_out(project):
    delays = np.random.default_rng(0).uniform(0.0, 0.004, 1000)  # of deliveries of ten samples
    with sending("forces", late=lambda k: delays[k // 10]) as sender:
        demonstration, start, remarks = record(
            project, parse_device("lsl:forces"), lambda r: r.state().devices[0].samples > 300
        )
    assert remarks == []
    sent = host_clock(sender.stamp(demonstration.signals[:, 0]))
    assert np.abs(demonstration.times + start - sent).max() < 0.5 * 0.004  # in less than a second
    assert np.ptp(np.diff(demonstration.times)) < 1e-4


def test_samples_that_the_sender_left_out_are_a_gap_and_move_no_other(project):
    left_out = {k for k in range(10_000) if k % 100 in (50, 51) or k % 1000 > 900}
    with sending("forces", leave_out=left_out) as sender:
        demonstration, start, remarks = record(
            project, parse_device("lsl:forces"), lambda r: "lost samples" in alarms_after(r, 200)
        )
    numbers = demonstration.signals[:, 0]
    lost = int((np.diff(numbers) - 1).sum())
    assert remarks == [f"{lost} samples of lsl:forces were lost; these are gaps."]
    assert not left_out & set(numbers.astype(int).tolist())
    assert np.diff(numbers).max() >= 3
    sent = host_clock(sender.stamp(numbers))
    assert np.abs(demonstration.times + start - sent).max() < STATED


def test_a_long_hole_is_one_gap_and_no_lower_rate(project):
    with sending("gappy") as sender, Recorder(project, [parse_device("lsl:gappy")]) as recorder:
        recorder.start("hold")
        eventually(lambda: recorder.state().devices[0].samples > 50)
        first = sender.sent + 200
        sender.leave_out = range(first, first + 150)
        # Evened out on either side of it: that is no reason not to count.
        eventually(lambda: recorder.latest(0.0)[0][2][0, 0] > first + 250)
        [device] = recorder.state().devices
        saved = recorder.stop()
    assert (device.lost, device.rate) == (150, pytest.approx(500.0, rel=0.02))
    assert saved.remarks == ("150 samples of lsl:gappy were lost; that is a gap.",)


def test_a_sender_that_ends_and_comes_back_goes_on_in_the_same_recording(project):
    device = parse_device("lsl:forces")
    with pytest.raises(InputError, match="No stream 'forces' answers in this network"):
        device.open()
    with sending("forces") as sender, Recorder(project, [device]) as recorder:
        recorder.start("hold")
        eventually(lambda: recorder.state().devices[0].samples > 50)
        sender.stop()
        eventually(lambda: not recorder.state().devices[0].plugged)
        with sending("forces", first=10_000):
            eventually(lambda: recorder.latest(0.0)[0][2][0, 0] > 10_000)
            saved = recorder.stop()
        remarks = [*saved.remarks, *recorder.remarks()]
    with Project.open(project) as opened:
        numbers = opened.demonstrations.load(saved.added.id).signals[:, 0]
    first, second = numbers[numbers < 10_000], numbers[numbers >= 10_000]
    assert set(np.diff(first)) == {1.0}
    assert set(np.diff(second)) <= {1.0}
    assert any("was unplugged once" in remark for remark in remarks)
    assert "lsl:forces is gone; start the program that sends it again." in remarks


def test_a_stream_without_a_rate_holds_its_values():
    outlet = pylsl.StreamOutlet(pylsl.StreamInfo("events", "Force", 3, 0.0, pylsl.cf_int16, ""))
    device = parse_device("lsl:events")
    device.open()
    assert device.holds
    assert [c.name for c in device.channels] == ["events 1", "events 2", "events 3"]
    stamp = pylsl.local_clock()
    outlet.push_sample([1, -2, 32_767], stamp)
    block = device.read(5.0)
    assert block.values.tolist() == [[1.0, -2.0, 32_767.0]]
    assert block.arrived == pytest.approx(host_clock(stamp), abs=STATED)
    device.zero()
    outlet.push_sample([11, 8, 0], stamp + 0.5)
    assert device.read(5.0).values.tolist() == [[10.0, 10.0, -32_767.0]]
    device.zero()  # of what it reads, not of what is left of that
    outlet.push_sample([12, 8, 0], stamp + 0.75)
    assert device.read(5.0).values.tolist() == [[1.0, 0.0, 0.0]]
    device.close()
    device.close()
    device.open()
    outlet.push_sample([1, 2, 3], time.time())
    assert device.read(5.0).arrived == pytest.approx(time.monotonic(), abs=1.0)
    assert "its program does not stamp by the clock of LSL" in device.remarks()[0]
    device.close()


def test_markers_are_labels_of_their_stream_until_the_next_one(project):
    outlet = pylsl.StreamOutlet(pylsl.StreamInfo("cues", "Markers", 1, 0.0, pylsl.cf_string, ""))
    devices = [parse_device("lsl:cues"), parse_device("lsl:forces")]
    with sending("forces") as sender, Recorder(project, devices) as recorder:
        outlet.push_sample(["rest"])  # holds when recording begins
        eventually(lambda: recorder.state().devices[0].samples == 1)
        recorder.start("hold")
        times = []
        for text in ("lift\n", "", "push"):
            eventually(lambda: recorder.state().devices[1].samples > 40 * (1 + len(times)))
            times.append(sender.stamp(sender.sent))
            outlet.push_sample([text], times[-1])
        eventually(lambda: recorder.state().devices[0].samples == 3)
        eventually(lambda: recorder.state().devices[1].samples > 200)
        saved = recorder.stop()
    with Project.open(project) as opened:
        start = float(opened.media.stamps(saved.added.id)["start"])
        demonstration = opened.demonstrations.load(saved.added.id)
        [track] = opened.tracks.of(saved.added.id)
    assert [channel.name for channel in demonstration.channels] == ["fz1", "wave"]
    assert track.author == "lsl:cues"
    assert [segment.action for segment in track.segments] == ["rest", "lift", "push"]
    edges = host_clock(np.array(times)) - start
    assert [s.start for s in track.segments[1:]] == pytest.approx(edges[[0, 2]], abs=STATED)
    assert [s.end for s in track.segments[:2]] == pytest.approx(edges[:2], abs=STATED)
    assert track.segments[-1].end == pytest.approx(demonstration.duration, abs=1e-6)
    assert "Labels were read from lsl:cues: each lasts until the next one." in saved.remarks


def test_stamps_of_another_clock_are_told_and_the_arrivals_taken(project):
    with sending("forces", offset=time.time()):
        demonstration, _, remarks = record(
            project, parse_device("lsl:forces"), lambda r: r.state().devices[0].samples > 150
        )
    count = len(demonstration.times)
    assert any("its program does not stamp by the clock of LSL" in remark for remark in remarks)
    assert demonstration.duration == pytest.approx((count - 1) / 500.0, rel=0.3)
    assert set(np.diff(demonstration.signals[:, 0])) == {1.0}


def test_what_may_be_meant_by_a_name_is_said():
    markers = pylsl.StreamOutlet(pylsl.StreamInfo("markers", "Markers", 1, 0.0, pylsl.cf_string))
    with sending("a & b?", source="left"), sending("a & b?", source="right"):
        eventually(lambda: len(lsl.find_streams()) >= 3)
        *found, texts = lsl.find_streams()
        assert (name_stream(texts), texts.texts) == ("lsl:markers", True)
        assert texts.description.startswith("Markers, texts as labels, ")
        names = [name_stream(stream) for stream in found]
        assert names == [f"lsl:a %26 b%3F?source={side}" for side in ("left", "right")]
        assert found[0].description.startswith("Force, 2 channels, 500 Hz, ")
        assert [device.name for device in parse_devices(names)] == [
            "lsl:a & b? (left)",
            "lsl:a & b? (right)",
        ]
        with pytest.raises(InputError, match="2 streams may be meant by 'lsl:a & b[?]'; say which"):
            parse_device("lsl:a %26 b%3F").open()
    del markers
    info = pylsl.StreamInfo("greedy", "Noise", 300, 1000.0, pylsl.cf_int8)
    greedy = pylsl.StreamOutlet(info, 0, 1)
    with pytest.raises(
        InputError, match="greedy states 300 channels at 1000 Hz; no more than 250,0"
    ):
        parse_device("lsl:greedy").open()
    del greedy
    with pytest.raises(InputError, match="dejitter"):
        parse_device("lsl:x?dejitter=maybe")


def test_the_command_lists_and_records_streams(project, capsys):
    with sending("forces"):
        assert main(["capture", "--list"]) == 0
        assert "--device lsl:forces" in capsys.readouterr().out
        command = ["capture", str(project), "--task", "hold", "--seconds", "0.3", "--device"]
        assert main([*command, "lsl:forces?dejitter=yes"]) == 0
    assert "'hold 01': 0." in capsys.readouterr().out


def test_texts_alone_are_refused_before_anything_is_recorded(project, capsys):
    outlet = pylsl.StreamOutlet(pylsl.StreamInfo("cues", "Markers", 1, 0.0, pylsl.cf_string, ""))
    command = ["capture", str(project), "--task", "hold", "--device"]
    assert main([*command, "lsl:cues"]) == 1
    said = capsys.readouterr().err
    assert "lsl:cues gives texts only; add a stream of numbers." in said
    assert "Recording" not in said
    del outlet


def test_a_wrong_device_is_told_before_a_missing_task(project, capsys):
    assert main(["capture", str(project), "--device", "foo:x"]) != 0
    assert "'foo:x' is no device" in capsys.readouterr().err
