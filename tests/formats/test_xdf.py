"""XDF files: streams on their clocks, markers as labels."""

import numpy as np
import pytest
from factories import channel_names, read_single, rounded_segments

pytest.importorskip("pyxdf")

from forcelab.errors import InputError
from forcelab.formats import identify, preview
from forcelab.formats.recording import ReadOptions
from tests.formats.column_files import forces, whole_xdf, write_xdf, xdf_content, xdf_stream


def even(count, rate, start=5000.0):
    return start + np.arange(count) / rate


def markers(name, *pairs, kind="string", samples=None):
    words = [word for _, word in pairs] if samples is None else samples
    return xdf_stream(name, words, stamps=[t for t, _ in pairs], kind=kind, type="Markers")


@pytest.mark.parametrize("kind", ["double64", "float32", "int16"])
def test_samples_channels_and_units_come_out_as_they_went_in(tmp_path, kind):
    values = (forces(100) * 1000).round().astype(np.float32) / (1 if kind == "int16" else 8)
    stream = xdf_stream(
        "Wrist", values, rate=200, stamps=even(100, 200), kind=kind,
        labels=("fx", "fy", "fz"), units=("N", "N", "N"),
    )  # fmt: skip
    path = write_xdf(tmp_path / "pull.xdf", stream)
    assert identify(path).name == "xdf"
    demonstration = read_single(path).demonstration
    assert demonstration.name == "pull"
    assert [(c.name, c.unit) for c in demonstration.channels] == [
        ("fx", "N"), ("fy", "N"), ("fz", "N"),
    ]  # fmt: skip
    np.testing.assert_array_equal(demonstration.signals, values)
    np.testing.assert_allclose(demonstration.times, np.arange(100) / 200, atol=1e-9)


def test_irregular_stamps_are_kept(tmp_path):
    stamps = 5000 + np.cumsum(np.random.default_rng(3).uniform(0.001, 0.02, 150))
    path = write_xdf(tmp_path / "a.xdf", xdf_stream("Force", forces(150), stamps=stamps))
    recording = read_single(path)
    np.testing.assert_allclose(recording.demonstration.times, stamps - stamps[0], atol=1e-9)
    assert recording.remarks == ()


def test_stamps_that_are_left_out_go_on_by_the_rate(tmp_path):
    stamps = [5000.0 if i == 0 else None for i in range(80)]
    stream = xdf_stream("Force", forces(80), rate=100, stamps=stamps)
    times = read_single(write_xdf(tmp_path / "a.xdf", stream)).demonstration.times
    np.testing.assert_allclose(times, np.arange(80) / 100, atol=1e-8)


def test_stamps_of_a_regular_stream_are_evened_out_and_it_is_told(tmp_path):
    truth = even(4000, 1000.3)
    stamps = truth + np.random.default_rng(0).exponential(0.001, 4000)
    stream = xdf_stream("Force", forces(4000, 1), rate=1000, stamps=stamps)
    recording = read_single(write_xdf(tmp_path / "a.xdf", stream))
    errors = recording.demonstration.times - (truth - truth[0])
    assert np.std(stamps - truth) > 0.0009
    assert np.std(errors) < 0.0001
    assert recording.remarks[0].startswith("Force: its samples come at an even rate")


@pytest.mark.parametrize("lost", [5, 300])
def test_where_samples_were_lost_stamps_are_kept(tmp_path, lost):
    truth = np.delete(even(4000, 1000), slice(1500, 1500 + lost))
    stamps = truth + np.random.default_rng(0).exponential(0.0001, truth.size)
    stamps = np.maximum.accumulate(stamps) + np.arange(truth.size) * 1e-9
    stream = xdf_stream("Force", forces(truth.size, 1), rate=1000, stamps=stamps)
    recording = read_single(write_xdf(tmp_path / "a.xdf", stream))
    np.testing.assert_allclose(recording.demonstration.times, stamps - stamps[0], atol=2e-9)
    assert "Force: samples are missing between its stamps" in recording.remarks[0]


@pytest.mark.parametrize("lost", [0, 400])
def test_packets_that_are_stamped_on_arrival_are_spread(tmp_path, lost):
    """As by Bluetooth: packets of 8 samples, one 1.5 s late and those behind it with it."""
    truth = even(6400, 128)
    arrival = np.repeat(truth[7::8] + np.random.default_rng(0).exponential(0.01, 800), 8)
    late = (truth > truth[3200]) & (truth < truth[3200] + 1.5)
    arrival[late] = truth[3200] + 1.5
    stamps = np.maximum.accumulate(arrival) + np.arange(6400) * 1e-6
    there = np.ones(6400, bool)
    there[1600 : 1600 + lost] = False
    stream = xdf_stream("Force", forces(6400, 1)[there], rate=128, stamps=stamps[there])
    recording = read_single(write_xdf(tmp_path / "a.xdf", stream))
    errors = recording.demonstration.times - truth[there]
    assert np.ptp(errors) < 0.1
    assert "Force: its stamps come in bursts, which were spread at" in recording.remarks[0]
    assert recording.demonstration.rate == pytest.approx(128, rel=0.01)
    assert len(recording.demonstration.gaps) == (lost > 0)


def test_a_break_is_a_gap_and_both_sides_are_even(tmp_path):
    stamps = np.concatenate([even(500, 100), even(500, 100, start=5025.0)])
    stream = xdf_stream("Force", forces(1000, 1), rate=100, stamps=stamps)
    recording = read_single(write_xdf(tmp_path / "a.xdf", stream))
    np.testing.assert_allclose(recording.demonstration.times, stamps - 5000, atol=1e-8)
    assert recording.remarks == ("Force: 1 gap in the stamps, 20 s in all, is kept as a gap.",)


def test_each_clock_is_corrected_and_the_fastest_stream_gives_the_times(tmp_path):
    """Both streams measured the same ramp, on clocks 40 s apart that drift."""
    fast, slow = even(500, 100), even(100, 20)
    drift = 1e-4
    own = (slow - 40) / (1 + drift)  # what has to be added is 40 + drift * own
    offsets = [(t, 40 + drift * t) for t in own[::10]]
    path = write_xdf(
        tmp_path / "a.xdf",
        xdf_stream("Fast", (fast - 5000)[:, None], rate=100, stamps=fast, offsets=[(5000, 0)]),
        xdf_stream("Slow", (slow - 5000)[:, None], rate=20, stamps=own, offsets=offsets),
    )
    recording = read_single(path)
    assert channel_names(recording) == ["Fast", "Slow"]
    signals = recording.demonstration.signals
    np.testing.assert_allclose(recording.demonstration.times, fast - 5000, atol=1e-8)
    np.testing.assert_allclose(signals[:490, 1], signals[:490, 0], atol=1e-4)
    assert "Slow (20 Hz, 100 samples) was interpolated at the times of Fast." in recording.remarks


def test_markers_last_until_the_next_one(tmp_path):
    stream = xdf_stream("Force", forces(300), rate=100, stamps=even(300, 100))
    told = markers("Task", (5000.5, "grab"), (5001.0, "hold"), (5002.0, "none"))
    recording = read_single(write_xdf(tmp_path / "a.xdf", stream, told))
    assert rounded_segments(recording) == {"coder": [(0.5, 1.0, "grab"), (1.0, 2.0, "hold")]}
    assert "Labels were read from Task: each lasts until the next one." in recording.remarks


@pytest.mark.parametrize(
    ("words", "segments"),
    [
        (["grab start", "grab end", "hold start", "hold end"],
         [(0.5, 1.0, "grab"), (1.5, 2.0, "hold")]),
        (["grab_on", "grab_off", "GRAB_ON", "GRAB_OFF"], [(0.5, 1.0, "grab"), (1.5, 2.0, "GRAB")]),
        (["start", "stop", "start", "stop"], [(0.5, 1.0, "start"), (1.5, 2.0, "start")]),
        (["Foot Strike", "Foot Off", "none", "x"],
         [(0.5, 1.0, "Foot Strike"), (1.0, 1.5, "Foot Off"), (2.0, 3.0, "x")]),
        (["grab", "grab", "hold", ""], [(0.5, 1.5, "grab"), (1.5, 2.0, "hold")]),
    ],
)  # fmt: skip
def test_a_start_lasts_until_its_end(tmp_path, words, segments):
    stream = xdf_stream("Force", forces(300), rate=100, stamps=even(300, 100))
    told = markers("Task", *zip((5000.5, 5001.0, 5001.5, 5002.0), words, strict=True))
    assert (
        rounded_segments(read_single(write_xdf(tmp_path / "a.xdf", stream, told)))["coder"]
        == segments
    )


def test_markers_may_be_numbers_and_streams_of_them_are_authors(tmp_path):
    stream = xdf_stream("Force", forces(300), rate=100, stamps=even(300, 100))
    numbers = markers("Trigger", (5000.0, 0), (5001.0, 0), kind="int32", samples=[[7], [8]])
    words = markers("Task", (4990.0, "rest"), (5002.0, "grab"))
    path = write_xdf(tmp_path / "a.xdf", stream, numbers, words)
    assert rounded_segments(read_single(path)) == {
        "coder (Trigger)": [(0.0, 1.0, "7"), (1.0, 3.0, "8")],
        "coder (Task)": [(0.0, 2.0, "rest"), (2.0, 3.0, "grab")],
    }
    assert list(rounded_segments(read_single(path, label="Task"))) == ["coder"]
    with pytest.raises(InputError, match="has no events called 'Tusk'; name one of Trigger, Task"):
        read_single(path, label="Tusk")


def test_streams_and_channels_are_chosen_by_name(tmp_path):
    first, second = whole_xdf(tmp_path)[:1] * 2
    assert channel_names(read_single(first)) == ["fx", "fy", "fz", "Pose 1", "Pose 2", "Pose 3"]
    chosen = read_single(second, leave_out=("Pose", "Force.fy"))
    assert channel_names(chosen) == ["fx", "fz"]
    rows = {row.name: row.use for row in preview(first, ReadOptions(leave_out=("Pose",)))}
    assert rows["Force: times"] == "times"
    assert rows["Force.fx"] == "signal"
    assert rows["Pose.Pose 1"] == "left out"
    assert rows["Markers"] == "labels"
    with pytest.raises(InputError, match="has no values called 'EEG'; name one of Force, Pose, M"):
        read_single(first, leave_out=("EEG",))


def test_a_single_sample_is_told(tmp_path):
    streams = [
        xdf_stream("Force", forces(50), rate=100, stamps=even(50, 100)),
        xdf_stream("Weight", [[71.5]], stamps=[5000.0]),
    ]
    recording = read_single(write_xdf(tmp_path / "a.xdf", *streams))
    assert recording.remarks == ("A single sample is no signal: Weight.",)


def test_streams_of_one_name_are_told_apart(tmp_path):
    streams = [
        xdf_stream("Force", forces(50), rate=100, stamps=even(50, 100), labels=("x", "y", "z"),
                   units=("N",) * 3)
        for _ in range(2)
    ]  # fmt: skip
    recording = read_single(write_xdf(tmp_path / "a.xdf", *streams))
    assert channel_names(recording)[::3] == ["x Force", "x Force_2"]


def test_what_stands_behind_damage_is_left_out_or_refused(tmp_path):
    stream = xdf_stream("Force", forces(300), rate=100, stamps=even(300, 100))
    content = xdf_content(stream)
    path = tmp_path / "a.xdf"
    path.write_bytes(content[: content.index(b"<sample_count>") - 700])
    recording = read_single(path)
    assert recording.demonstration.times.size == 250
    assert recording.remarks[0].startswith("The file is damaged at byte ")
    with pytest.raises(InputError, match="the file is damaged at byte"):
        read_single(path, strict=True)


def test_numbers_that_no_file_can_hold_are_refused(tmp_path):
    stream = xdf_stream("Force", forces(60), rate=100, stamps=even(60, 100))
    content = xdf_content(stream, block=60)
    count = content.index(b"\x01\x3c\x08")
    path = tmp_path / "a.xdf"
    for changed in (
        content[:count] + b"\x04\xff\xff\xff\x7f" + content[count + 5 :],
        content.replace(b"<channel_count>3<", b"<channel_count>999999999<"),
        content[:400],
        b"XDF:",
    ):
        path.write_bytes(changed)
        with pytest.raises(InputError, match=r"^.*a\.xdf.*\.$"):
            read_single(path)
