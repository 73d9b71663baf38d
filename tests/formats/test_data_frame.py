"""Data frames and dictionaries of arrays are read as files are."""

import numpy as np
import pytest

from forcelab import Demonstration, InputError, ReadOptions, Segment, read_frame

STEPS = np.array([0.0, 0.01, 0.021, 0.03, 0.04, 0.052])  # irregular, as stamps are
FORCE = np.array([0.5, -1.0, np.nan, 2.0, 1.0, 0.0])


def test_a_dictionary_of_arrays_is_a_demonstration_at_its_own_times():
    columns = {"time_ms": 1000 * STEPS, "fx (N)": FORCE, "torque": FORCE * 2}
    with pytest.warns(UserWarning, match="pull: 2 samples are missing"):
        made = Demonstration.from_frame(columns, "pull", task="foam")
    np.testing.assert_allclose(made.times, STEPS, atol=1e-12)
    assert [(c.name, c.unit) for c in made.channels] == [("fx", "N"), ("torque", "")]
    assert (made.name, made.task) == ("pull", "foam")
    assert np.isnan(made.signals[2, 0])


def test_an_array_of_several_columns_is_that_many_channels():
    made = Demonstration.from_frame({"force": np.ones((6, 3))}, "pull", rate=100.0)
    assert [channel.name for channel in made.channels] == ["force 1", "force 2", "force 3"]
    np.testing.assert_allclose(made.times, np.arange(6) / 100)


def test_an_array_of_two_columns_of_words_is_two_columns():
    words = np.array([["grab", "a"], ["grab", "b"], ["hold", ""]]).repeat(2, axis=0)
    read = read_frame({"t": STEPS, "fx": FORCE, "w": words}, "pull", ReadOptions(label="w 1"))
    assert read.tracks[0].actions == ("grab", "hold")


def test_a_column_of_labels_becomes_a_track():
    words = ["", "grab", "grab", "grab", None, "hold"]
    read = read_frame({"t": STEPS, "fx": FORCE, "label": words}, "pull", ReadOptions(author="Ada"))
    segments = (Segment(0.01, 0.04, "grab"), Segment(0.052, 0.0625, "hold"))
    assert read.tracks[0].author == "Ada"
    for found, expected in zip(read.tracks[0].segments, segments, strict=True):
        assert found.action == expected.action
        assert (found.start, found.end) == pytest.approx((expected.start, expected.end), abs=1e-3)


def test_pandas_columns_of_every_kind_are_understood():
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(
        {
            "fx": FORCE,
            "count": pandas.array([1, 2, None, 4, 5, 6], "Int64"),
            "pressed": [True, False] * 3,
            "action": pandas.Categorical(["grab", "grab", None, "hold", "hold", "hold"]),
        },
        index=pandas.Timestamp("2026-11-27 10:00") + pandas.to_timedelta(STEPS, "s"),
    )
    read = read_frame(frame, "pull", ReadOptions(signals=("count", "pressed")))
    assert [channel.name for channel in read.demonstration.channels] == ["fx", "count", "pressed"]
    np.testing.assert_allclose(read.demonstration.times, STEPS, atol=1e-6)
    np.testing.assert_array_equal(read.demonstration.signals[:, 1], [1, 2, np.nan, 4, 5, 6])
    assert read.tracks[0].actions == ("grab", "hold")


def test_an_index_is_a_column_unless_it_only_tells_where_rows_stood():
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"time": STEPS, "fx": STEPS**2})
    part = Demonstration.from_frame(frame[frame.time > 0.005].drop(index=3), "pull")
    assert [channel.name for channel in part.channels] == ["fx"]
    assert len(part.times) == 4
    indexed = Demonstration.from_frame(frame.set_index("time"), "pull")
    assert indexed == Demonstration.from_frame(frame, "pull")


@pytest.mark.parametrize(
    ("frame", "sentence"),
    [
        ({}, "has no rows"),
        ({"t": STEPS, "fx": FORCE[:5]}, "has columns of different lengths"),
        ({"fx": FORCE, "fy": [2.0, 1, 3, 2, 5, 4]}, "has no column of times among fx, fy"),
        ({"t": STEPS, "who": ["Ada"] * 6}, "has no column of numbers besides its times"),
        ({"t": STEPS, "picture": np.ones((6, 2, 2))}, "is an array of 3 dimensions"),
        ({"t": [0.0, 1, 1, 2, 3, 4], "fx": FORCE}, "row 3: 1 row repeats the stamp before"),
    ],
)
def test_what_is_no_recording_is_refused_with_a_sentence(frame, sentence):
    with pytest.raises(InputError, match=f"Frame pull.*{sentence}"):
        Demonstration.from_frame(frame, "pull")


def test_what_is_repaired_is_told(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "Frame pull.labels.csv").write_text("start,end,action\n0,1,grab\n")
    read = read_frame({"t": [0.0, 1, 1, 2, 3, 4], "fx": FORCE}, "pull")
    assert len(read.demonstration.times) == 5
    assert any("repeats the stamp" in remark for remark in read.remarks)
    assert read.tracks == ()  # a frame has no files beside it
