"""Arrays of NumPy: which become times, signals and labels, and what is said about them."""

import zipfile

import numpy as np
import pytest
from factories import channel_names, read_single, refusal, rounded_segments

from forcelab.errors import InputError, UnclearRateError
from forcelab.formats import arrays, identify, preview, read
from forcelab.formats.recording import ReadOptions
from tests.formats.array_files import (
    CODES,
    FORCES,
    SAMPLES,
    TIMES,
    WORDS,
    write_npz,
)


def labels(recording):
    (segments,) = rounded_segments(recording).values()
    return segments


GRAB_AND_HOLD = [(0.0, 0.12, "grab"), (0.24, 0.4, "hold")]


class TestWhatIsRead:
    def test_forces_times_and_words_are_found_by_their_names(self, tmp_path):
        pose = np.ones((SAMPLES, 7))
        path = write_npz(tmp_path / "pull 3.npz", t=TIMES, force=FORCES, pose=pose, label=WORDS)
        recording = read_single(path, task="pull", author="Ann")
        demonstration = recording.demonstration
        assert (demonstration.name, demonstration.task) == ("pull 3", "pull")
        assert channel_names(recording) == ["fx", "fy", "fz"]
        assert np.array_equal(demonstration.signals, FORCES)
        assert np.array_equal(demonstration.times, TIMES)
        assert recording.tracks[0].author == "Ann"
        assert labels(recording) == GRAB_AND_HOLD
        assert recording.remarks == (
            "Read from t (times), force, label (labels).",
            "Other arrays can be read as signals (--signal): pose.",
        )

    def test_columns_of_one_table_are_all_signals(self, tmp_path):
        columns = {"fx": FORCES[:, 0], "fz": FORCES[:, 2], "angle": FORCES[:, 1]}
        path = write_npz(tmp_path / "a.npz", time_ms=TIMES * 1000, **columns)
        recording = read_single(path)
        assert channel_names(recording) == ["fx", "fz", "angle"]
        assert recording.demonstration.rate == pytest.approx(500)

    def test_six_columns_of_forces_are_one_sensor_unless_a_list_names_them(self, tmp_path):
        both = np.hstack([FORCES, FORCES])
        recording = read_single(write_npz(tmp_path / "a.npz", t=TIMES, forces=both))
        assert channel_names(recording) == ["fx", "fy", "fz", "tx", "ty", "tz"]
        assert recording.remarks == (
            "Read from t (times), forces.",
            "The six columns of 'forces' were read as the force and the torque of one sensor, fx "
            "to tz; if they are something else, keep a list of their names beside them in the "
            "file.",
        )
        axes = ["fx1", "fy1", "fz1", "fx2", "fy2", "fz2"]
        listed = read_single(write_npz(tmp_path / "b.npz", t=TIMES, forces=both, axes=axes))
        assert channel_names(listed) == axes
        assert listed.remarks == ("Read from t (times), forces.",)
        wrench = read_single(write_npz(tmp_path / "c.npz", t=TIMES, wrench=both))
        assert wrench.remarks == ("Read from t (times), wrench.",)

    @pytest.mark.parametrize("kind", ["<f2", ">f4", "<f8", "<i2", ">i4", "u1", "?"])
    def test_numbers_of_any_type_are_kept(self, tmp_path, kind):
        force = (FORCES * 50 + 100).astype(kind)
        demonstration = read_single(
            write_npz(tmp_path / "a.npz", t=TIMES, force=force)
        ).demonstration
        assert np.array_equal(demonstration.signals, force.astype(float))

    @pytest.mark.parametrize("force", [FORCES, FORCES.T, np.asfortranarray(FORCES)])
    @pytest.mark.parametrize("times", [TIMES, TIMES[:, None], TIMES[None, :]])
    def test_rows_and_columns_are_alike(self, tmp_path, force, times):
        demonstration = read_single(
            write_npz(tmp_path / "a.npz", t=times, force=force)
        ).demonstration
        assert np.array_equal(demonstration.signals, FORCES)
        assert np.array_equal(demonstration.times, TIMES)

    def test_uneven_nanoseconds_since_1970_keep_every_digit(self, tmp_path):
        stamps = 1_717_156_800_000_000_123 + np.cumsum(np.arange(1, SAMPLES + 1) * 1009)
        for kind in (np.int64, np.uint64, "M8[ns]"):
            path = write_npz(tmp_path / "a.npz", stamp=stamps.astype(kind), force=FORCES)
            times = read_single(path).demonstration.times
            assert np.allclose(times, (stamps - stamps[0]) / 1e9, atol=1e-11)

    def test_a_rate_in_the_file_stands_in_for_times(self, tmp_path):
        path = write_npz(tmp_path / "a.npz", Fs=250, data=FORCES, names=np.array(["a", "b", "c"]))
        recording = read_single(path)
        assert recording.demonstration.rate == pytest.approx(250)
        assert channel_names(recording) == ["a", "b", "c"]

    @pytest.mark.parametrize("codes", [CODES, CODES + 1], ids=["from 0", "from 1"])
    def test_codes_are_called_by_the_list_beside_them(self, tmp_path, codes):
        words = np.array(["grab", "hold"])
        path = write_npz(tmp_path / "a.npz", t=TIMES, force=FORCES, phase=codes, phases=words)
        assert labels(read_single(path)) == GRAB_AND_HOLD

    def test_words_name_no_dates(self, tmp_path):
        dates = np.datetime64("2026-11-27", "ns") + (TIMES * 1e9).astype("m8[ns]")
        arrays = {"time": TIMES, "host_time": dates, "force": FORCES, "label": CODES + 1}
        path = write_npz(tmp_path / "a.npz", labels=np.array(["grab", "hold"]), **arrays)
        recording = read_single(path)
        assert labels(recording) == GRAB_AND_HOLD
        assert "Column host_time was left out: times were read from 'time'." in recording.remarks

    def test_an_array_alone_is_a_table_without_a_header(self, tmp_path):
        np.save(tmp_path / "a.npy", np.column_stack([TIMES, FORCES]))
        recording = read_single(tmp_path / "a.npy", leave_out=("3",))
        assert channel_names(recording) == ["column 2", "column 4"]
        assert np.array_equal(recording.demonstration.times, TIMES)
        np.save(tmp_path / "b.npy", FORCES)
        assert "no column of times" in refusal(tmp_path / "b.npy", UnclearRateError)
        assert read_single(tmp_path / "b.npy", rate=40.0).demonstration.rate == pytest.approx(40)

    def test_records_are_columns(self, tmp_path):
        records = np.zeros(SAMPLES, [("t", "f8"), ("fx", ">f4"), ("spin", "f4"), ("label", "U4")])
        records["t"], records["fx"], records["label"] = TIMES, FORCES[:, 0], WORDS
        np.save(tmp_path / "a.npy", records)
        recording = read_single(tmp_path / "a.npy")
        assert channel_names(recording) == ["fx", "spin"]
        assert labels(recording) == GRAB_AND_HOLD

    def test_sensors_are_told_apart_by_their_groups(self, tmp_path):
        arrays = {"left/force": FORCES, "right/force": -FORCES, "t": TIMES}
        recording = read_single(write_npz(tmp_path / "a.npz", **arrays))
        assert channel_names(recording)[2:4] == ["fz left", "fx right"]

    def test_numbered_groups_are_demonstrations_in_the_order_of_their_numbers(self, tmp_path):
        arrays = {f"data/demo_{i}/force": FORCES + i for i in (0, 1, 2, 10)}
        path = write_npz(tmp_path / "set.npz", clock=np.arange(3.0), t=TIMES, **arrays)
        recordings = read(path)
        found = [recording.demonstration for recording in recordings]
        assert [d.name for d in found] == ["set demo_0", "set demo_1", "set demo_2", "set demo_10"]
        assert np.array_equal(found[-1].signals, FORCES + 10)
        assert np.array_equal(found[-1].times, TIMES)


class TestWhatIsChosen:
    @pytest.fixture
    def path(self, tmp_path):
        arrays = {"obs/pos": FORCES, "obs/vel": FORCES[:100], "aux/when": TIMES, "kind": CODES + 1}
        return write_npz(tmp_path / "a.npz", image=np.zeros((9, 4, 4, 3), np.uint8), **arrays)

    def test_what_is_not_plain_is_asked_for_with_what_there_is(self, path):
        assert refusal(path) == (
            f"'{path}' holds no array that is called a force, and it is not plain which are the "
            f"signals among obs/pos (200 × 3), obs/vel (100 × 3), aux/when (200), kind (200); "
            f"name what is to be read as a signal, an array or a group of them (--signal), and "
            f"the times (--time) or their rate (--rate)."
        )

    def test_options_name_arrays_groups_and_columns(self, path):
        recording = read_single(path, time="aux/when", label="kind", signals=("obs/pos",))
        assert channel_names(recording) == ["pos 1", "pos 2", "pos 3"]
        assert np.array_equal(recording.demonstration.times, TIMES)
        assert [action for *_, action in labels(recording)] == ["1", "0", "2"]
        assert channel_names(read_single(path, rate=10.0, signals=("/obs/pos 3", "aux"))) == [
            "pos 3",
            "when",
        ]
        group = read_single(path, rate=10.0, signals=("obs",), leave_out=("obs/vel",))
        assert channel_names(group) == ["pos 1", "pos 2", "pos 3"]

    def test_a_column_of_an_array_may_hold_the_times(self, tmp_path):
        table = np.column_stack([FORCES, TIMES])
        path = write_npz(tmp_path / "a.npz", data=table, label=WORDS)
        recording = read_single(path, time="data 4")
        assert channel_names(recording) == ["data 1", "data 2", "data 3"]
        assert np.array_equal(recording.demonstration.times, TIMES)
        assert "'data' has 4 columns; name one of them, such as 'data 1'" in refusal(
            path, time="data"
        )

    def test_a_name_that_is_not_there_is_answered_with_those_that_are(self, path):
        assert f"'{path}' has no array 'pose'; it holds image (9 × 4 × 4 × 3), obs/pos" in refusal(
            path, signals=("pose",)
        )

    def test_arrays_of_other_lengths_are_not_joined(self, path):
        assert "obs/vel (100 × 3) has not the 200 samples of obs/pos; leave it out" in refusal(
            path, signals=("obs",), rate=10.0
        )
        assert "kind (200) has not a row for each of the 100 samples of obs/vel" in refusal(
            path, signals=("obs/vel",), label="kind", rate=10.0
        )

    def test_the_dialog_is_told_what_each_array_can_be(self, path):
        uses = preview(path, ReadOptions())
        assert [(use.name, use.size, use.use) for use in uses] == [
            ("image", "9 × 4 × 4 × 3", "left out"),
            ("obs/pos", "200 × 3", "left out"),
            ("obs/vel", "100 × 3", "left out"),
            ("aux/when", "200", "left out"),
            ("kind", "200", "left out"),
        ]
        assert [use.choices for use in uses[:2]] == [("left out",), ("signal", "left out")]
        assert uses[1].cells == tuple(f"{value:.4g}" for value in FORCES[0])
        with pytest.raises(InputError, match="it is not plain which are the signals"):
            preview(path, ReadOptions(counter="kind"))
        uses = preview(path, ReadOptions(signals=("obs/pos",), time="aux/when", label="kind"))
        assert [use.use for use in uses[1:]] == ["signal", "left out", "times", "labels"]

    def test_the_dialog_lists_columns_that_are_read_as_different_things(self, tmp_path):
        path = write_npz(tmp_path / "a.npz", data=np.column_stack([TIMES, FORCES]), label=WORDS)
        uses = {use.name: use.use for use in preview(path, ReadOptions())}
        assert uses == {"data 1": "times"} | {f"data {i}": "signal" for i in (2, 3, 4)} | {
            "label": "labels"
        }


class TestWhatIsRefused:
    def test_python_objects_are_left_out_and_nothing_is_run(self, tmp_path):
        words = np.array(list(WORDS), dtype=object)
        recording = read_single(write_npz(tmp_path / "a.npz", t=TIMES, force=FORCES, label=words))
        assert recording.tracks == ()
        assert (
            "Python objects, which only running code of the file could read, were left out "
            "(label); save them as numbers or texts, as in numpy.array(labels, dtype=str)."
        ) in recording.remarks
        np.save(tmp_path / "b.npy", words, allow_pickle=True)
        assert "dtype=str)); there is nothing to import" in refusal(tmp_path / "b.npy")

    def test_what_unpacks_to_more_than_can_be_believed_is_not_read(self, tmp_path):
        path = write_npz(tmp_path / "a.npz", packed=True, force=np.zeros((4 * 10**6, 3), "i1"))
        assert "force is said to hold 12,000,000 values, of which 11," in refusal(path, rate=1e3)

    def test_values_of_many_bytes_are_counted_as_one_each(self, tmp_path, monkeypatch):
        monkeypatch.setattr(arrays, "ROOM", 2**16)
        path = write_npz(tmp_path / "a.npz", packed=True, label=np.zeros(10**4, "U16"))
        assert "label is said to hold 10,000 values, of which" in refusal(path)

    def test_sizes_are_compared_with_what_is_there_before_it_is_read(self, tmp_path):
        path = tmp_path / "a.npy"
        np.save(path, FORCES)
        path.write_bytes(path.read_bytes().replace(b"(200, 3), }", b"(2000000, 3), }"))
        assert "is cut off: its array is said to hold 6,000,000 values" in refusal(path)
        assert "; copy it again, or write it again with numpy.save" in refusal(path)

    def test_a_broken_member_is_one_sentence(self, tmp_path):
        path = write_npz(tmp_path / "a.npz", t=TIMES, force=FORCES)
        with zipfile.ZipFile(path) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        for old, new in ((b"descr", b"descz"), (b"(200, 3)", b"(-20, 3)"), (b"<f8", b"|O8")):
            with zipfile.ZipFile(path, "w") as archive:
                for name, content in members.items():
                    changed = content.replace(old, new) if name == "force.npy" else content
                    archive.writestr(name, changed)
            refusal(path, rate=10.0)

    def test_other_zip_files_are_none(self, tmp_path):
        with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
            archive.writestr("a.npy", b"\x93NUMPY")
            archive.writestr("readme.txt", "text")
        with pytest.raises(InputError, match="looks like a NumPy archive"):
            identify(tmp_path / "a.npz")
