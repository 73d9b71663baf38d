"""Parquet and Arrow files: the columns of a table, by the same rules as text."""

import random
import re

import numpy as np
import pytest
from factories import channel_names, read_single, rounded_segments

pytest.importorskip("pyarrow")

import pyarrow as pa

from forcelab.cli import main
from forcelab.errors import InputError
from forcelab.formats import identify, parquet, preview, read
from forcelab.formats.recording import ReadOptions
from tests.formats.column_files import NOON, forces, whole_arrow, wobbling_stamps, write_arrow

SUFFIXES = ["parquet", "feather", "arrow"]


def labels(recording):
    (segments,) = rounded_segments(recording).values()
    return segments


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_stamps_forces_and_labels_come_out_as_they_went_in(tmp_path, suffix):
    stamps, values = wobbling_stamps(500), forces(500)
    columns = {
        "stamp": pa.array(stamps, pa.timestamp("ns", "Europe/Berlin")),
        "fx [N]": values[:, 0],
        "fy": values[:, 1].astype(np.float32),
        "label": pa.array(["grab" if 100 <= i < 250 else None for i in range(500)]),
    }
    path = write_arrow(tmp_path / f"a.{suffix}", columns)
    assert identify(path).name == "parquet"
    recording = read_single(path)
    demonstration = recording.demonstration
    np.testing.assert_array_equal(np.rint(demonstration.times * 1e9), stamps - stamps[0])
    np.testing.assert_array_equal(demonstration.signals[:, 0], values[:, 0])
    np.testing.assert_array_equal(demonstration.signals[:, 1], values[:, 1].astype(np.float32))
    assert [(c.name, c.unit) for c in demonstration.channels] == [("fx", "N"), ("fy", "")]
    edges = (stamps[[100, 250]] - stamps[0]) / 1e9
    assert labels(recording) == [(round(edges[0], 6), round(edges[1], 6), "grab")]


def test_recordings_below_each_other_are_told_apart(tmp_path):
    columns = {"fx": forces(100)[:, 0], "trial": ["a"] * 40 + ["b"] * 60}
    columns["time"] = np.r_[np.arange(40), np.arange(60)] / 100
    recordings = read(write_arrow(tmp_path / "a.parquet", columns))
    assert [r.demonstration.name for r in recordings] == ["a a", "a b"]
    np.testing.assert_array_equal(recordings[1].demonstration.signals[:, 0], columns["fx"][40:])


def test_columns_of_several_levels_have_the_names_of_all(tmp_path):
    levels = ["('time', '')", "('left', 'fx')", "('left', 'fy [N]')", "(2, 'fz')", "(a, b)"]
    columns = dict(zip(levels, [np.arange(50) / 100, *forces(50, 4).T], strict=True))
    recording = read_single(write_arrow(tmp_path / "a.parquet", columns))
    assert channel_names(recording) == ["left fx", "left fy", "2 fz", "(a, b)"]
    assert recording.demonstration.channels[1].unit == "N"


@pytest.mark.parametrize("seed", range(5))
def test_a_table_is_read_as_the_same_table_in_text(tmp_path, seed):
    """Whatever the columns are: same roles, same numbers, same labels, same remarks."""
    dice = random.Random(seed)
    rows = 300
    values = forces(rows, 4)
    stamps = wobbling_stamps(rows)
    times = dice.choice(
        [
            ("time [s]", (stamps - stamps[0]) / 1e9),
            ("t", (stamps - stamps[0]) // 1000),
            ("epoch_ns", stamps),
            ("timestamp", 86_400 + (stamps - stamps[0]) / 1e9),
            ("", np.arange(rows) / 500),
        ]
    )
    columns = {times[0] or "__index_level_0__": times[1]}
    columns["packet_no"] = np.arange(rows) % 256
    for axis in "xyz":
        columns[f"f{axis} [N]"] = values[:, "xyz".index(axis)]
    columns["label"] = dice.choice(
        [
            ["grab" if i // 50 % 2 else "" for i in range(rows)],
            [i // 100 for i in range(rows)],
            [None if i < 20 else float(i // 100) for i in range(rows)],
        ]
    )
    columns["note"] = ["rig 7"] * rows
    columns["sparse"] = [None if i % 7 else i * 0.5 for i in range(rows)]
    order = list(columns)
    dice.shuffle(order)
    columns = {name: columns[name] for name in order}

    def cell(value):
        return "" if value is None else str(value).removesuffix(".0")

    cells = zip(*columns.values(), strict=True)
    header = [name.replace("__index_level_0__", "") for name in columns]
    text = "\n".join(",".join(map(cell, row)) for row in [header, *cells])
    (tmp_path / "a.csv").write_text(text, "utf-8")
    plain = read_single(tmp_path / "a.csv")
    typed = read_single(write_arrow(tmp_path / "a.parquet", columns, row_group_size=77))
    assert typed.demonstration == plain.demonstration
    assert (typed.tracks, typed.remarks) == (plain.tracks, plain.remarks)
    before = [(c.name, c.use, c.cells) for c in preview(tmp_path / "a.csv", ReadOptions())]
    after = [(c.name, c.use, c.cells) for c in preview(tmp_path / "a.parquet", ReadOptions())]
    assert after == before


@pytest.mark.parametrize("encoding", ["DELTA_BYTE_ARRAY", "DELTA_LENGTH_BYTE_ARRAY", "PLAIN"])
def test_words_are_read_however_they_are_encoded(tmp_path, encoding):
    columns = {"t": np.arange(50) / 10, "fx": forces(50)[:, 0], "label": ["a"] * 25 + ["b"] * 25}
    how = {"use_dictionary": False, "column_encoding": {"label": encoding}}
    recording = read_single(write_arrow(tmp_path / "a.parquet", columns, **how))
    assert labels(recording) == [(0, 2.5, "a"), (2.5, 5.0, "b")]


def test_columns_are_chosen_as_those_of_text_by_name_or_number(tmp_path):
    values = forces(50)
    columns = {
        "a": np.arange(50) / 100,
        "b": values[:, 0],
        "c": values[:, 1],
        "what": pa.array(["x"] * 50).dictionary_encode(),
    }
    path = write_arrow(tmp_path / "a.feather", columns)
    with pytest.raises(InputError, match="has no column of times among a, b, c, what"):
        read_single(path)
    chosen = read_single(path, time="1", leave_out=("b",), label="WHAT")
    assert channel_names(chosen) == ["c"]
    assert labels(chosen) == [(0, 0.5, "x")]
    with pytest.raises(InputError, match="has no column 'd' of values; name one of a, b, c, what"):
        read_single(path, time="a", leave_out=("d",))


def test_vectors_and_structures_are_split_and_pictures_left_out(tmp_path):
    values = forces(60, 3)
    vectors = values.astype(np.float32).tolist()
    columns = {
        "timestamp": np.arange(60) / 30,
        "observation.state": pa.array([None if i == 7 else v for i, v in enumerate(vectors)]),
        "fixed": pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), 3),
        "pose": pa.array(
            [{"x": float(v), "deep": {"y": 1.5}} for v in values[:, 0]],
            pa.struct({"x": pa.float64(), "deep": pa.struct({"y": pa.float64()})}),
        ),
        "picture": pa.array([{"bytes": b"\x89PNG", "path": None}] * 60),
        "many": pa.array([[0.0] * 65] * 60),
    }
    path = write_arrow(tmp_path / "a.parquet", columns, row_group_size=25)
    recording = read_single(path, leave_out=("fixed",))
    assert channel_names(recording) == [
        *(f"observation.state {i}" for i in (1, 2, 3)), "pose.x", "pose.deep.y",
    ]  # fmt: skip
    expected = values.astype(np.float32).astype(np.float64)
    expected[7] = np.nan
    np.testing.assert_array_equal(recording.demonstration.signals[:, :3], expected)
    remarks = "\n".join(recording.remarks)
    assert "picture.bytes (binary), many (list" in remarks
    assert "3 samples are missing" in remarks


def test_columns_behind_one_that_is_left_out_are_told_by_their_own_rows(tmp_path):
    """Times without a name are found by their steps."""
    times, values = np.arange(60) / 30, forces(60)[:, 0]
    columns = {"many": [[0.0] * 65] * 60, "__index_level_0__": times, "fx": values}
    path = write_arrow(tmp_path / "a.parquet", columns)
    np.testing.assert_array_equal(read_single(path).demonstration.times, times)
    uses = [(use.use, use.cells[1]) for use in preview(path, ReadOptions())]
    assert uses == [("times", str(times[1])), ("signal", str(values[1]))]


def test_further_stamps_of_a_long_table_in_bursts_are_left_out(tmp_path):
    rows = 70_000
    columns = {
        "time": np.repeat(np.arange(rows // 10) / 100, 10),
        "host time": pa.array(NOON + np.arange(rows) * 10**6, pa.timestamp("ns")),
        "fx": forces(rows, 1)[:, 0],
    }
    recording = read_single(write_arrow(tmp_path / "a.parquet", columns))
    np.testing.assert_allclose(recording.demonstration.times, np.arange(rows) / 1000, atol=1e-9)
    assert "Column host time was left out: times were read from 'time'." in recording.remarks


def test_a_vector_that_changes_its_length_is_refused_with_its_row(tmp_path):
    vectors = [[1.0, 2.0]] * 30 + [[1.0]] + [[1.0, 2.0]] * 9
    path = write_arrow(tmp_path / "a.parquet", {"t": np.arange(40) / 10, "f": vectors})
    with pytest.raises(InputError, match=r"row 31: 'f' holds 1 numbers.*--leave-out 'f'"):
        read_single(path)


@pytest.mark.parametrize(
    "times",
    [
        pa.array(range(100), pa.time32("ms")),
        pa.array([i * 1000 for i in range(100)], pa.duration("us")),
        pa.array([NOON // 10**6 + i for i in range(100)], pa.timestamp("ms")),
        pa.array([NOON + i * 10**6 for i in range(100)], pa.int64()),
    ],
)
def test_times_of_any_type_are_times(tmp_path, times):
    path = write_arrow(tmp_path / "a.parquet", {"time": times, "fx": forces(100)[:, 0]})
    found = read_single(path).demonstration.times
    np.testing.assert_allclose(found, np.arange(100) / 1000, atol=1e-9)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_rows_that_a_small_file_cannot_hold_are_refused(tmp_path, monkeypatch, suffix):
    monkeypatch.setattr(parquet, "_ROOM", 1_000_000)
    columns = {"t": pa.array(range(1_000_000)), "nothing": pa.nulls(1_000_000)}
    path = write_arrow(tmp_path / f"a.{suffix}", columns)
    monkeypatch.setattr(parquet, "_MOST_TIMES", 1_000_000 / path.stat().st_size)
    with pytest.raises(InputError, match=r"said to hold [\d,]+ rows of 2 columns, which cannot"):
        read_single(path)


@pytest.mark.parametrize("at", [0.2, 0.5, 0.9, 0.999])
def test_a_file_that_is_cut_off_is_one_sentence(tmp_path, at):
    for path in whole_arrow(tmp_path):
        content = path.read_bytes()
        path.write_bytes(content[: int(at * len(content))])
        try:
            read_single(path)
        except InputError as error:
            assert re.fullmatch(rf".*{path.name}.*", str(error))
        else:
            assert path.suffix == ".arrow"  # a stream may end anywhere between its blocks


def test_labels_beside_are_read_with_their_recording(tmp_path, capsys):
    columns = {"t": np.arange(50) / 100, "fx": forces(50)[:, 0], "blob": [b"x"] * 50}
    files = [write_arrow(tmp_path / "pull.parquet", columns), tmp_path / "pull.labels.csv"]
    files[1].write_text("start,end,action\n0.1,0.3,grab\n", "utf-8")
    assert main(["import", str(tmp_path / "p.forcelab"), *map(str, files), "--task", "pull"]) == 0
    printed = capsys.readouterr().out
    assert "The labels were read from pull.labels.csv." in printed
    assert "No numbers or words were read from blob (binary)." in printed
    assert "1 recording: 1 new" in printed
