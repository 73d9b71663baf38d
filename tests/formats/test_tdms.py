"""TDMS files: channels at the times of their waveforms or of a time channel."""

import numpy as np
import pytest
from factories import channel_names, read_single

pytest.importorskip("nptdms")

from forcelab.errors import InputError
from forcelab.formats import identify, preview
from forcelab.formats.recording import ReadOptions
from tests.formats.column_files import (
    NOON,
    forces,
    waveform,
    whole_tdms,
    wobbling_stamps,
    write_tdms,
)

VALUES = forces(200)


def group(name, values, told, channels="xyz"):
    return [(name, f"F{axis}", values[:, i], told) for i, axis in enumerate(channels)]


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int16])
def test_waveforms_come_out_as_they_went_in(tmp_path, kind):
    values = (VALUES * 1000).astype(kind)
    path = write_tdms(tmp_path / "pull.tdms", group("Force", values, waveform(1000)))
    assert identify(path).name == "tdms"
    recording = read_single(path)
    demonstration = recording.demonstration
    np.testing.assert_array_equal(demonstration.signals, values)
    np.testing.assert_allclose(demonstration.times, np.arange(200) / 1000, atol=1e-9)
    assert [(c.name, c.unit) for c in demonstration.channels] == [
        ("Fx", "N"), ("Fy", "N"), ("Fz", "N"),
    ]  # fmt: skip
    assert recording.remarks == ()


def test_segments_go_on(tmp_path):
    parts = [group("Force", part, waveform(1000)) for part in np.split(VALUES, 4)]
    demonstration = read_single(write_tdms(tmp_path / "a.tdms", *parts)).demonstration
    np.testing.assert_array_equal(demonstration.signals, VALUES)


def test_waveforms_that_start_apart_come_onto_the_times_of_the_fastest(tmp_path):
    """Both measured the same ramp."""
    fast = np.arange(200)[:, None] / 1000
    slow = 0.05 + np.arange(10)[:, None] / 100
    path = write_tdms(
        tmp_path / "a.tdms",
        group("Fast", fast, waveform(1000), "x"),
        group("Slow", slow, waveform(100, start="2024-05-31T12:00:00.28", offset=0.02), "y"),
    )
    recording = read_single(path)
    signals = recording.demonstration.signals
    np.testing.assert_allclose(signals[50:140, 1], signals[50:140, 0], atol=1e-9)
    assert np.isnan(signals[:40, 1]).all()
    assert "Slow (100 Hz, 10 samples) was interpolated at the times of Fast." in recording.remarks


@pytest.mark.parametrize("seconds", [0, NOON // 10**9])
def test_a_channel_of_times_tells_them_as_a_column_would(tmp_path, seconds):
    stamps = wobbling_stamps(200, 0) // 1000 * 1000
    if seconds:
        moments = np.datetime64(seconds, "s") + (stamps // 1000).astype("timedelta64[us]")
        times = ("Log", "Moment", moments, {})
    else:
        times = ("Log", "Time", stamps / 1e6, {"unit_string": "ms"})
    path = write_tdms(tmp_path / "a.tdms", [times, *group("Log", VALUES, {})])
    found = read_single(path).demonstration.times
    np.testing.assert_allclose(found, (stamps - stamps[0]) / 1e9, atol=1e-9)


def test_without_times_the_rate_or_the_channel_is_asked_for(tmp_path):
    clock = ("Log", "c", np.arange(200) / 50, {})
    path = write_tdms(tmp_path / "a.tdms", [clock, *group("Log", VALUES, {})])
    with pytest.raises(InputError, match=r"tells no times of Log\.c, Log\.Fx, Log\.Fy"):
        read_single(path)
    by_rate = read_single(path, rate=200.0)
    assert channel_names(by_rate) == ["c", "Fx", "Fy", "Fz"]
    assert by_rate.demonstration.duration == pytest.approx(1.0)
    by_name = read_single(path, time="Log.c")
    assert channel_names(by_name) == ["Fx", "Fy", "Fz"]
    assert by_name.demonstration.duration == pytest.approx(4.0)


def test_words_are_labels_and_channels_are_chosen_by_name(tmp_path):
    path = whole_tdms(tmp_path)[1]
    (track,) = read_single(path).tracks
    assert [(round(s.start, 6), round(s.end, 6), s.action) for s in track.segments] == [
        (0.2, 0.4, "grab"), (0.6, 0.8, "grab"),
    ]  # fmt: skip
    assert read_single(path, leave_out=("Log.what",)).tracks == ()
    rows = {row.name: row.use for row in preview(path, ReadOptions())}
    assert rows == {"Log: times": "times", "Log.fx": "signal", "Log.what": "labels"}
    both = read_single(whole_tdms(tmp_path)[0], leave_out=("Room", "Force.Fy"))
    assert channel_names(both) == ["Fx", "Fz"]


def test_channels_of_other_lengths_are_told(tmp_path):
    odd = ("Log", "odd", VALUES[:7, 0], {})
    clock = ("Log", "Time", np.arange(200) / 50, {})
    path = write_tdms(tmp_path / "a.tdms", [clock, *group("Log", VALUES, {}), odd])
    assert read_single(path).remarks == ("Nothing was read from Log.odd.",)


def test_an_index_beside_the_file_is_not_looked_at(tmp_path):
    path = write_tdms(tmp_path / "a.tdms", group("Force", VALUES, waveform(1000)))
    (tmp_path / "a.tdms_index").write_bytes(b"TDSh of another file")
    np.testing.assert_array_equal(read_single(path).demonstration.signals, VALUES)


@pytest.mark.parametrize("at", [0.02, 0.2, 0.6, 0.99])
def test_a_file_that_is_cut_off_is_told_or_refused(tmp_path, at):
    for path in whole_tdms(tmp_path):
        path.write_bytes(path.read_bytes()[: int(at * path.stat().st_size)])
        try:
            remarks = read_single(path).remarks
        except InputError as error:
            assert path.name in str(error)
        else:
            assert "The file ends in the middle of a segment; what is there was read." in remarks
            with pytest.raises(InputError, match="in the middle of a segment"):
                read_single(path, strict=True)
