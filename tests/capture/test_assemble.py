"""From a journal to a demonstration: gaps stay gaps, devices on one clock, marks a track."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.capture.align import DeviceStream, align
from forcelab.capture.assemble import assemble, away_remarks, loss_remark
from forcelab.capture.device import Block
from forcelab.capture.journal import RecordKind, encode_block, encode_header, encode_record
from forcelab.capture.live_marks import AUTOREPEAT_SECONDS, LiveMarks
from forcelab.errors import InputError
from tests.capture.helpers import journal_of

START = 5000.0
AXES = [["fx", "N"], ["fy", "N"], ["fz", "N"]]


def device(name="a", channels=AXES, holds=False):
    return {"name": name, "channels": channels, "rate": 1000.0, "holds": holds}


def contents(devices, records, tail=b"", cameras=(), **more):
    header = {"name": "LEGO 01", "task": "LEGO", "author": "Ann", "devices": devices}
    data = encode_header(header | {"cameras": list(cameras)} | more) + b"".join(records) + tail
    return journal_of(data)


def samples(times, values, number=0, ticks=True, late=0.0002):
    """A device's samples in blocks of ten."""
    out = []
    count = np.round((times - START) * 1000).astype(np.int64)
    for first in range(0, len(times), 10):
        part = slice(first, first + 10)
        arrived = np.full(len(times[part]), times[part][-1] + late)
        block = Block(arrived, count[part] if ticks else None, values[part])
        out.append(encode_record(RecordKind.BLOCK, encode_block(block), number))
    return out


def note(kind, number=0, **what):
    import json

    return encode_record(kind, json.dumps(what).encode(), number)


def three(signal):
    return np.stack([signal, signal + 1, signal + 2], axis=1)


def test_lost_samples_are_absent_stamps_and_the_clock_goes_on(tmp_path):
    times = START + np.arange(2000) / 1000
    received = np.ones(2000, dtype=bool)
    received[700:800] = received[1500] = False
    assembled = assemble(
        contents([device()], samples(times[received], three(times[received]))), tmp_path
    )
    d = assembled.demonstration
    np.testing.assert_allclose(d.times, times[received] - START, atol=5e-4)
    ((begin, end),) = d.gaps
    assert (begin, end) == (pytest.approx(0.7, abs=1e-3), pytest.approx(0.8, abs=1e-3))
    assert assembled.remarks == ("101 samples of a were lost; these are gaps.",)
    assert d.video is None
    assert assembled.tracks == ()


def test_each_camera_that_gave_pictures_is_a_video_even_if_two_have_one_name(tmp_path):
    times = START + np.arange(100) / 1000
    names = ("webcam", "webcam", "side", "gone")
    cameras = [{"name": name, "file": f"{i}.mkv"} for i, name in enumerate(names)]
    for camera in cameras[:-1]:
        (tmp_path / camera["file"]).touch()
    frames = [
        note(RecordKind.FRAME, i, frames=[[START + 0.01 * i + at, None, at] for at in (0.0, 0.04)])
        for i in range(4)
    ]
    recorded = [*samples(times, three(times)), *frames]
    d = assemble(contents([device()], recorded, cameras=cameras), tmp_path).demonstration
    assert d.name == "LEGO 01"
    videos = [(v.name, v.path.name) for v in d.videos]
    assert videos == [("webcam", "0.mkv"), ("video 2", "1.mkv"), ("side", "2.mkv")]
    offsets = np.array([video.clock.offset for video in d.videos])
    np.testing.assert_allclose(np.diff(offsets), 0.01, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(
    shift=st.floats(-0.01, 0.01),
    gap=st.tuples(st.integers(300, 900), st.integers(1, 400)),
    rate=st.sampled_from([100, 333, 1000]),
)
def test_a_second_device_is_interpolated_but_never_across_a_gap(shift, gap, rate):
    own = START + np.arange(2000) / 1000
    other = START + shift + np.arange(2 * rate) / rate
    first, long = gap[0] * rate // 1000, gap[1]
    received = np.ones(len(other), dtype=bool)
    received[first : first + long] = False
    curve = lambda t: 3 * (t - START)  # noqa: E731 - linear, so that interpolation is exact
    streams = [
        DeviceStream(own, curve(own)[:, None]),
        DeviceStream(other[received], curve(other[received])[:, None]),
    ]
    both = align(streams, ["a", "b"])
    times, signals, start = both.times, both.signals, both.start
    host = times + start
    known = np.isfinite(signals[:, 1])
    np.testing.assert_allclose(signals[known, 1], curve(host[known]), atol=1e-6)
    left, right = other[received][first - 1], other[received][first : first + 1]
    end = right[0] if len(right) else np.inf
    inside = (host > left + 1e-9) & (host < end - 1e-9)
    assert not known[inside].any()
    assert known[(host >= other[0]) & (host <= left)].all()


def test_what_starts_and_ends_a_moment_apart_is_cut_to_what_is_shared():
    own, other = START + np.arange(1000) / 1000, START + 0.0105 + np.arange(970) / 1000
    both = align([DeviceStream(own, own[:, None]), DeviceStream(other, other[:, None])], ["a", "b"])
    times, signals, start = both.times, both.signals, both.start
    assert (both.lead, both.within) == (0, slice(11, 980))
    assert start == pytest.approx(START + 0.011)
    assert np.isfinite(signals).all()
    assert times[0] == 0.0
    np.testing.assert_allclose(signals[:, 0], times + start, atol=1e-9)


def test_what_holds_keeps_its_value_except_while_it_was_unplugged(tmp_path):
    times = START + np.arange(3000) / 1000
    changes = START + np.array([-2.0, 0.5, 2.5])
    block = Block(changes, None, np.array([[1.0], [2.0], [3.0]]))
    records = [
        *samples(times, three(times)),
        encode_record(RecordKind.BLOCK, encode_block(block), 1),
        note(RecordKind.EVENT, 1, at=START + 1.0, what="unplugged"),
        note(RecordKind.EVENT, 1, at=START + 2.0, what="plugged in again"),
    ]
    opening = device("q", [["opening", "mm"]], holds=True)
    d = assemble(contents([device(), opening], records), tmp_path).demonstration
    held = d.signals[:, 3]
    at = lambda t: held[np.searchsorted(d.times, t)]  # noqa: E731
    assert (at(0.2), at(0.8), at(2.8)) == (1, 2, 3)
    # After plugging in nothing is known until it has something to say.
    assert np.isnan([at(1.1), at(1.9), at(2.4)]).all()


@pytest.mark.parametrize(("begun", "missing"), [(0.008, 0), (0.002, 5)])
def test_what_was_held_before_the_recording_holds_for_samples_that_were_on_their_way(
    tmp_path, begun, missing
):
    times = START + np.arange(1000) / 1000
    block = Block(np.array([START + 0.0045]), None, np.array([[1.0]]))
    records = [
        encode_record(RecordKind.BLOCK, encode_block(block), 1),
        *samples(times, three(times), late=0),
    ]
    opening = device("q", [["opening", "mm"]], holds=True)
    journal = contents([device(), opening], records, monotonic=START + begun)
    held = assemble(journal, tmp_path).demonstration.signals[:, 3]
    assert np.isnan(held[:missing]).all()
    assert (held[missing:] == 1.0).all()


@pytest.mark.parametrize(
    ("devices", "expected"),
    [
        ([["fx", "fy", "fz"]], ["fx1", "fy1", "fz1"]),
        ([["fx", "fy", "fz"], ["fx", "fy", "fz"]], ["fx1", "fy1", "fz1", "fx2", "fy2", "fz2"]),
        (
            [["fx1", "fz1"], ["fx1", "fz1", "fx2", "fz2"]],
            ["fx1", "fz1", "fx2", "fz2", "fx3", "fz3"],
        ),
        ([["fx2", "fz2"]], ["fx2", "fz2"]),
        ([["fx1", "fz1"], ["fx2", "fz2"]], ["fx1", "fz1", "fx2", "fz2"]),
        ([["fx", "tx"], ["weight"], ["weight"]], ["fx1", "tx1", "weight", "weight 2"]),
    ],
)
def test_channels_are_called_as_everywhere(tmp_path, devices, expected):
    times = START + np.arange(100) / 1000
    records, stated = [], []
    for number, names in enumerate(devices):
        records += samples(times, np.tile(times[:, None], (1, len(names))), number)
        stated.append(device(str(number), [[name, "N"] for name in names]))
    d = assemble(contents(stated, records), tmp_path).demonstration
    assert [channel.name for channel in d.channels] == expected


def test_lines_without_a_counter_count_themselves_where_they_come_evenly(tmp_path):
    times = START + np.arange(800) / 80
    even = assemble(contents([device()], samples(times, three(times), ticks=False)), tmp_path)
    np.testing.assert_allclose(np.diff(even.demonstration.times), 1 / 80, rtol=0.02)
    assert "ticks_0" not in even.stamps
    rng = np.random.default_rng(0)
    odd = START + np.cumsum(rng.choice([0.001, 0.5], 300))
    records = [
        encode_record(
            RecordKind.BLOCK, encode_block(Block(odd[i : i + 1], None, three(odd)[i : i + 1]))
        )
        for i in range(300)
    ]
    uneven = assemble(contents([device()], records), tmp_path)
    np.testing.assert_allclose(uneven.demonstration.times, odd - odd[0], atol=1e-9)


@pytest.mark.parametrize(("seconds", "begin"), [(8.5, 3.0), (12.0, 1.5)])
@pytest.mark.parametrize(("ticks", "rate"), [(True, 400.0), (False, 398.0), (False, 403.0)])
def test_a_stall_over_half_of_a_short_recording_is_no_gap(tmp_path, seconds, begin, rate, ticks):
    times = START + np.arange(round(400 * seconds)) / 400
    late = 0.001 + (np.arange(len(times)) % 5) * 2e-4
    # What waited is read twenty times as fast as it was taken.
    read = START + begin + 5.0 + np.arange(len(times)) / 8000
    waited = times > START + begin
    arrived = times.copy()
    arrived[waited] = np.maximum(times[waited], read[: waited.sum()])
    count = np.arange(len(times)) if ticks else None
    block = Block(np.maximum.accumulate(arrived + late), count, three(times))
    board = device() | {"rate": rate}
    assembled = assemble(
        contents([board], [encode_record(RecordKind.BLOCK, encode_block(block), 0)]), tmp_path
    )
    assert assembled.remarks == ()
    assert assembled.demonstration.gaps == ()
    np.testing.assert_allclose(assembled.demonstration.times, times - START, atol=0.01)


def test_marks_of_keys_held_down_become_segments(tmp_path):
    times = START + np.arange(1000) / 1000
    marks = [
        (0.1, "grab", True), (0.2, "hold", True), (0.3, "grab", False), (0.4, "hold", False),
        (-0.5, "still", True), (0.05, "still", False), (0.6, "pull", False), (0.9, "pull", True),
    ]  # fmt: skip
    records = samples(times, three(times)) + [
        note(RecordKind.MARK, at=START + at, action=action, down=down) for at, action, down in marks
    ]
    assembled = assemble(contents([device()], records), tmp_path)
    (track,) = assembled.tracks
    found = [(round(s.start, 3), round(s.end, 3), s.action) for s in track.segments]
    pressed = [(0, 0.05, "still"), (0.1, 0.2, "grab"), (0.2, 0.4, "hold"), (0.9, 1.0, "pull")]
    assert (track.author, found) == ("Ann", pressed)


def test_a_torn_end_is_said(tmp_path):
    times = START + np.arange(100) / 1000
    assembled = assemble(contents([device()], samples(times, three(times)), tail=b"abc"), tmp_path)
    assert assembled.remarks == ("The last 3 bytes of the journal were torn and are left out.",)


def test_the_first_force_device_leads_whatever_comes_first(tmp_path):
    times = START + np.arange(100) / 1000
    records = samples(times, three(times), 1)
    records.append(
        encode_record(RecordKind.BLOCK, encode_block(Block(times[:1], None, np.ones((1, 1)))), 0)
    )
    opening = device("q", [["opening", "mm"]], holds=True)
    d = assemble(contents([opening, device()], records), tmp_path).demonstration
    assert len(d.times) == 100
    assert d.channels[0].name == "opening"


@pytest.mark.parametrize("silent", [0, 1])
def test_a_device_that_was_silent_takes_nothing_away_from_the_others(tmp_path, silent):
    times = START + np.arange(100) / 1000
    records = samples(times, three(times), 1 - silent)
    assembled = assemble(contents([device("a"), device("b")], records), tmp_path)
    signals = assembled.demonstration.signals
    columns = slice(3 * silent, 3 * silent + 3)
    assert np.isnan(signals[:, columns]).all()
    assert np.isfinite(np.delete(signals, columns, axis=1)).all()
    assert f"{'ab'[silent]} gave nothing while it was recorded" in assembled.remarks[0]


@pytest.mark.parametrize("number", [0, 1])
def test_too_few_samples_are_one_sentence(tmp_path, number):
    times = START + np.arange(number) / 1000
    with pytest.raises(InputError, match="Fewer than two samples of a "):
        assemble(contents([device()], samples(times, three(times))), tmp_path)


def test_a_header_that_says_nothing_is_one_sentence(tmp_path):
    with pytest.raises(InputError, match="does not say what was recorded"):
        assemble(journal_of(encode_header({"name": "x"})), tmp_path)


def test_samples_that_do_not_fit_the_channels_are_one_sentence(tmp_path):
    times = START + np.arange(100) / 1000
    with pytest.raises(InputError, match="do not fit"):
        assemble(contents([device(channels=AXES[:2])], samples(times, three(times))), tmp_path)


@pytest.mark.parametrize(
    ("away", "lost", "remark"),
    [
        (1, False, "a was unplugged once for 0.1 s; that is a gap."),
        (2, False, "a was unplugged 2 times, in all for 0.2 s; these are gaps."),
        (0, True, "1 sample of a was lost; that is a gap."),
        (
            1,
            True,
            "1 sample of a was lost and the device was unplugged once for 0.1 s; these are gaps.",
        ),
    ],
)
def test_gaps_are_counted_in_their_sentence(away, lost, remark):
    ticks = np.delete(np.arange(100), [50] if lost else [])
    times = (ticks + 200) / 1000
    stream = DeviceStream(times, np.zeros((len(ticks), 1)), False, True, ((0.1, 0.2),) * away)
    assert loss_remark("a", stream, ticks) == remark


def test_a_camera_was_away_as_often_as_its_frames_have_long_holes():
    frames = np.arange(300) / 30
    assert away_remarks("camera 0", frames) == []
    frames[100:] += 3.0
    (remark,) = away_remarks("camera 0", frames)
    assert remark == "camera 0 was away once, 3.0 s in all; its video has no frames then."
    frames[200:] += 2.0
    (remark,) = away_remarks("camera 0", frames)
    assert "away 2 times, 5.1 s in all" in remark


def segments_of(marks, now, since=0.0):
    return [(s.action, s.start, s.end) for s in marks.track(now, since)]


def test_of_several_keys_the_last_one_counts_and_the_one_below_it_goes_on():
    marks = LiveMarks()
    marks.press("grab", True, 1.0)
    marks.press("pull", True, 2.0)
    marks.press("pull", False, 3.0)
    assert segments_of(marks, 4.0) == [("grab", 1.0, 2.0), ("pull", 2.0, 3.0), ("grab", 3.0, 4.0)]
    marks.end(4.0)
    assert len(segments_of(marks, 9.0)) == 3
    assert len(segments_of(marks, 9.0, since=2.5)) == 2


@pytest.mark.parametrize("below", [(), ("grab",)])
def test_a_key_that_repeats_while_it_is_held_is_one_segment(below):
    marks = LiveMarks()
    for action in below:
        marks.press(action, True, 0.5)
    marks.press("hold", True, 1.0)
    for at in (1.6, 1.7):
        marks.press("hold", False, at)
        # However late the repeated press is heard, and however often it is looked meanwhile.
        segments = segments_of(marks, at + 0.5)
        assert ("hold", 1.0, at) in segments
        assert segments[-1] == (("grab", at, at + 0.5) if below else ("hold", 1.0, at))
        marks.press("hold", True, at + 0.008)
    assert segments_of(marks, 2.0)[-1] == ("hold", 1.0, 2.0)
    marks.end(2.0)
    assert [s for s in segments_of(marks, 3.0) if s[0] == "hold"] == [("hold", 1.0, 2.0)]
    assert len(segments_of(marks, 3.0)) == 1 + len(below)


def test_a_key_that_is_pressed_again_makes_another_segment():
    marks = LiveMarks()
    for start in (1.0, 1.5 + 2 * AUTOREPEAT_SECONDS):
        marks.press("hold", True, start)
        marks.press("hold", False, start + 0.5)
    marks.end(3.0)
    assert len(segments_of(marks, 3.0)) == 2


@given(
    st.lists(st.tuples(st.sampled_from("abc"), st.booleans(), st.floats(0.0, 0.2)), max_size=30),
    st.floats(0.0, 0.2),
)
def test_the_track_is_in_order_and_does_not_depend_on_being_looked_at(keys, rest):
    looked, blind, now = LiveMarks(), LiveMarks(), 0.0
    for action, down, wait in keys:
        now += wait
        looked.track(now)
        for marks in (looked, blind):
            marks.press(action, down, now)
        looked.track(now)
    for marks in (looked, blind):
        marks.end(now + rest)
    assert looked.segments == blind.segments
    ends = [0.0, *(s.end for s in looked.segments)]
    assert all(s.start >= end for s, end in zip(looked.segments, ends, strict=False))
    assert all(
        (a.end, a.action) != (b.start, b.action)
        for a, b in zip(looked.segments, looked.segments[1:], strict=False)
    )
