"""Excel workbooks: sheets are read as the text that they would be."""

import random
import re
import zipfile
from datetime import datetime, time, timedelta

import numpy as np
import pytest
from factories import read_single

pytest.importorskip("openpyxl")

from forcelab.errors import InputError
from forcelab.formats import excel, identify, preview, read
from forcelab.formats.label_files import read_label_file
from forcelab.formats.recording import ReadOptions
from tests.formats.column_files import forces, whole_workbooks, write_workbook

#: The library writes no more than 16 digits.
ROWS = [[i / 100, *row] for i, row in enumerate(forces(80, 2).round(9).tolist())]
TABLE = [["t", "fx", "fy"], *ROWS]
LABELS = [["start", "end", "action"], [0, 0.5, "grab"]]
EVENTS = [
    ["Observation id", "Subject", "Behavior", "Behavior type", "Time", "FPS"],
    *(["pull", "left", "grab", kind, i / 10, 25] for i in range(20) for kind in ("START", "STOP")),
]


def names(recordings):
    return [recording.demonstration.name for recording in recordings]


def test_numbers_come_out_as_they_went_in(tmp_path):
    path = write_workbook(tmp_path / "a.xlsx", {"Sheet1": TABLE})
    assert identify(path).name == "excel"
    demonstration = read_single(path).demonstration
    np.testing.assert_array_equal(demonstration.times, [row[0] for row in ROWS])
    np.testing.assert_array_equal(demonstration.signals, [row[1:] for row in ROWS])
    assert demonstration.name == "a"


@pytest.mark.parametrize("seed", range(4))
def test_a_sheet_is_read_as_the_same_table_in_text(tmp_path, seed):
    dice = random.Random(seed)
    header = ["time", "Fx", "Fy", "packet_no", "what", "note"]
    words = dice.choice([("grab", None), ('say "no"', "hold"), (1, 2)])
    rows = [
        [*row, i % 256, words[i // 20 % 2], dice.choice([None, None, "x", "y; z"])]
        for i, row in enumerate(ROWS)
    ]
    rows[7][1] = None
    before = dice.choice([[], [["Rig 7"], ["Date", "2024-05-31"]]])
    below = dice.choice([[], [["s", "N", "N"]]])
    table = [*before, header, *below, *rows]

    def cell(value):
        text = "" if value is None else str(value).removesuffix(".0")
        return '"' + text.replace('"', '""') + '"' if '"' in text else text

    padded = [[*row, *[None] * (len(header) - len(row))] for row in table]
    text = "\n".join("\t".join(map(cell, row)) for row in padded)
    (tmp_path / "a.tsv").write_text(text, "utf-8")
    write_workbook(tmp_path / "a.xlsx", {"Sheet": table})
    plain, typed = (read_single(tmp_path / name) for name in ("a.tsv", "a.xlsx"))
    assert typed.demonstration == plain.demonstration
    assert (typed.tracks, typed.remarks) == (plain.tracks, plain.remarks)
    assert preview(tmp_path / "a.xlsx", ReadOptions()) == preview(tmp_path / "a.tsv", ReadOptions())


def test_each_sheet_with_a_table_is_a_demonstration(tmp_path):
    settings = [["mass", 3.2], ["length", 4.0], ["rate", 5.0]]
    sheets = {"one": TABLE, "Settings": settings, "labels": LABELS, "empty": [], "two": TABLE[:50]}
    recordings = read(write_workbook(tmp_path / "a.xlsx", sheets))
    assert names(recordings) == ["a one", "a two"]
    assert [r.demonstration.times.size for r in recordings] == [80, 49]
    assert recordings[0].remarks == (
        "Sheet 'labels' holds labels (start, end, action) and was left out.",
        "Sheet 'Settings' lacks the columns of a recording and was left out.",
    )


@pytest.mark.parametrize(
    ("rows", "kind"), [(EVENTS, "events of BORIS"), (LABELS, r"labels \(start, end, action\)")]
)
def test_labels_are_no_recording_and_the_cure_is_told(tmp_path, rows, kind):
    path = write_workbook(tmp_path / "a.xlsx", {"pull": rows})
    for call in (read, lambda path: preview(path, ReadOptions())):
        with pytest.raises(InputError, match=f"'pull' of .* holds {kind}, .*; save it as CSV"):
            call(path)
    with pytest.raises(InputError, match="no file of labels, but looks like an Excel workbook, wh"):
        read_label_file(path)


def test_the_dialog_is_told_of_the_first_sheet_that_is_read(tmp_path):
    settings = [["mass", 3.2], ["length", 4.0], ["rate", 5.0]]
    path = write_workbook(tmp_path / "a.xlsx", {"Settings": settings, "one": TABLE})
    assert [use.name for use in preview(path, ReadOptions())] == ["t", "fx", "fy"]


def test_a_sheet_with_a_mistake_is_left_out_or_refused(tmp_path):
    broken = [*TABLE[:60], [0.7, "oops", 1.0], *TABLE[61:]]
    path = write_workbook(tmp_path / "a.xlsx", {"one": TABLE, "two": broken})
    (recording,) = read(path)
    assert names([recording]) == ["a one"]
    assert "a.xlsx/two, row 61: 'oops' in column 'fx' is not a number" in recording.remarks[0]
    with pytest.raises(InputError, match="row 61: 'oops'"):
        read(path, ReadOptions(strict=True))


def test_columns_are_chosen_in_the_sheets_that_have_them(tmp_path):
    nameless = [["a", "b", "c"], *ROWS]
    path = write_workbook(tmp_path / "a.xlsx", {"one": nameless, "two": [["x"], [1.0], [2.0]]})
    with pytest.raises(InputError, match="has no column of times among a, b, c"):
        read(path)
    recording = read_single(path, time="a", leave_out=("c",))
    assert [channel.name for channel in recording.demonstration.channels] == ["b"]


@pytest.mark.parametrize(
    "stamps",
    [
        [datetime(2024, 5, 31, 12) + timedelta(milliseconds=10 * i) for i in range(80)],
        [time(12, 0, i // 100, i % 100 * 10_000) for i in range(80)],
        [timedelta(milliseconds=10 * i) for i in range(80)],
    ],
)
def test_dates_and_times_of_the_day_are_stamps(tmp_path, stamps):
    rows = [["time", "fx"], *zip(stamps, forces(80, 1)[:, 0].tolist(), strict=True)]
    times = read_single(write_workbook(tmp_path / "a.xlsx", {"Sheet": rows})).demonstration.times
    np.testing.assert_allclose(times, np.arange(80) / 100, atol=1e-9)


def test_a_labels_file_beside_a_workbook_is_read(tmp_path):
    path = write_workbook(tmp_path / "a.xlsx", {"Sheet": TABLE})
    (tmp_path / "a.labels.csv").write_text("start,end,action\n0.1,0.3,grab\n", "utf-8")
    assert [s.action for s in read_single(path).tracks[0].segments] == ["grab"]


def sheet_xml(rows):
    return (
        '<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main">'
        f'<dimension ref="A1:XFD1048576"/><sheetData>{rows}</sheetData></worksheet>'
    )


def with_member(path, name, content):
    """Replace a part of a workbook."""
    with zipfile.ZipFile(path) as archive:
        members = {member: archive.read(member) for member in archive.namelist()}
    members[name] = content
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for member, data in members.items():
            archive.writestr(member, data)
    return path


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        (
            "xl/worksheets/sheet1.xml",
            sheet_xml('<row r="1"><c r="A1"><v>1</v></c></row><row r="999999999"/>'),
            "more than 1,000 rows in a sheet",
        ),
        ("xl/worksheets/sheet1.xml", sheet_xml('<row r="x"/>'), "is not a whole workbook"),
        ("xl/worksheets/sheet1.xml", sheet_xml(""), "holds no sheet with rows of numbers"),
        ("xl/workbook.xml", "<workbook", "is not a whole workbook"),
        ("xl/styles.xml", b" " * 100_000, "which no sheet does"),
    ],
)
def test_what_no_program_writes_is_one_sentence(tmp_path, monkeypatch, name, content, sentence):
    monkeypatch.setattr(excel, "_MOST_ROWS", 1000)
    monkeypatch.setattr(excel, "_ROOM", 50_000)
    path = with_member(write_workbook(tmp_path / "a.xlsx", {"Sheet": TABLE}), name, content)
    with pytest.raises(InputError, match=sentence) as refusal:
        read(path)
    assert re.fullmatch(r".*a\.xlsx.*", str(refusal.value))


@pytest.mark.parametrize("at", [0.1, 0.5, 0.99])
def test_a_workbook_that_is_cut_off_is_one_sentence(tmp_path, at):
    for path in whole_workbooks(tmp_path):
        path.write_bytes(path.read_bytes()[: int(at * path.stat().st_size)])
        with pytest.raises(InputError, match=r".*xlsx"):
            read(path)
