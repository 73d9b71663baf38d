"""Labels in files of their own are found, read, and carried onto the recording's clock."""

from __future__ import annotations

from pathlib import Path

import pytest

from forcelab.errors import InputError
from forcelab.formats import read
from forcelab.formats.label_tables import is_label_table, labels_file_beside, read_tracks
from forcelab.formats.recording import ReadOptions
from forcelab.labels import Segment, Track

ANN = Track("Ann", (Segment(0.5, 1.25, "grab"), Segment(1.25, 2.0, "hold, firmly")))
BEN = Track("Ben", (Segment(0.75, 1.5, "grab"),))


@pytest.fixture
def write(tmp_path):
    def to(name: str, text: str) -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return to


@pytest.mark.parametrize(
    "text",
    [
        'start,end,action\n0.5,1.25,grab\n1.25,2.0,"hold, firmly"\n',
        'start [s];end [s];Label\n0,5;1,25;grab\n1,25;2,0;"hold, firmly"\n',
        "onset (ms)\toffset (ms)\taction\n500\t1250\tgrab\n1250\t2000\thold, firmly\n",
        'start_time,end_time,label\n1.25,2.0,"hold, firmly"\n0.5,1.25,grab\n',
        '0.5,1.25,grab\n1.25,2.0,"hold, firmly"\n',
        "0.500000\t1.250000\tgrab\n\\\t100.0\t200.0\n1.250000\t2.000000\thold, firmly\n",
        "0.5\t1.25\tgrab\n1.25\t2.0\thold, firmly\n2.5\t3.0\t\n",
        'action,end,start\ngrab,1.25,0.5\n"hold, firmly",2,1.25\n,3,2\n',
        'start,end,action\n0,0.5,Unlabelled\n0.5,1.25,grab\n1.25,2,"hold, firmly"\n2,3,no_label\n',
    ],
)
def test_start_end_action_is_read_in_many_hands(write, text):
    path = write("a.txt", text)
    assert is_label_table(path.read_bytes())
    assert read_tracks(path, ReadOptions(author="Ann")) == (ANN,)


def test_each_author_has_a_track(write):
    text = "start,end,action,author\n0.5,1.25,grab,Ann\n0.75,1.5,grab,Ben\n"
    text += '1.25,2.0,"hold, firmly",Ann\n'
    assert read_tracks(write("a.csv", text), ReadOptions()) == (ANN, BEN)
    without = text.partition("\n")[2]
    assert read_tracks(write("b.csv", without), ReadOptions()) == (ANN, BEN)


def test_a_header_with_no_segment_is_no_track(write):
    assert read_tracks(write("a.csv", "start,end,action,author\r\n"), ReadOptions()) == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("start,end,action\n0,1,a\n1,2,b\n1.5,3,c\n", "line 4: 'c' starts at 1.5 s, before 'b'"),
        ("start,end,action\n0,1,a\n3,2,b\n", "line 3"),
        ("start,end,action\n0,1,a\n# why\n2,2,b\n", "line 4"),
        ("start,end,action\n0,1,a\n2,x,b\n", "line 3: 'x' in column 'end'"),
        ("start,end,action\n0,1,a\n2,,b\n", "line 3 has no time in column 'end'"),
        ("start,end,action\n0,1,a\n2,3,b,c,d\n", "line 3 has 5 cells where 3"),
        ("O,1,a\n1,2,b\n2,3,c\n", "line 1: 'O'"),
        ("time,fx\n0,1\n1,2\n", "is not a labels file"),
        ("", "empty"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(write, text, words):
    with pytest.raises(InputError) as caught:
        read_tracks(write("a.csv", text), ReadOptions())
    assert words in str(caught.value)
    assert "a.csv" in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "time,fx,fy\n0,1,2\n1,2,3\n",
        "time,fx,label\n0,1,a\n0.5,2,b\n",
        "0,10,a\n1,11,a\n2,12,b\n",
        "start,fx,end\n1,2,3\n2,3,4\n",
        "",
    ],
)
def test_recordings_are_no_labels_files(text):
    assert not is_label_table(text.encode())


def recording(start: float, factor: int = 1) -> str:
    rows = "".join(f"{(start + i / 10) * factor:.10g},{i % 5}\n" for i in range(30))
    return "time,fx\n" + rows


@pytest.mark.parametrize(
    "name", ["r.labels.csv", "r.labels.tsv", "r.labels.txt", "r_labels.csv", "r.txt"]
)
def test_a_labels_file_beside_a_recording_is_read_with_it(write, name):
    path = write("r.csv", recording(0))
    beside = write(name, "0.5\t1.25\tgrab\n1.25\t2.0\thold, firmly\n")
    assert labels_file_beside(path) == beside
    (result,) = read(path, ReadOptions(author="Ann"))
    assert result.tracks == (ANN,)
    assert result.remarks == (f"The labels were read from {name}.",)


def test_a_text_beside_a_recording_that_is_no_label_track_is_left_alone(write):
    path = write("r.csv", recording(0))
    write("r.txt", "Notes of Monday: 2 demonstrations went wrong\n")
    assert labels_file_beside(path) is None
    assert read(path, ReadOptions())[0].tracks == ()


def test_labels_in_the_table_win_over_a_file_beside_it(write):
    path = write("r.csv", "time,fx,label\n0,1,a\n.1,1,a\n.2,1,b\n")
    write("r.labels.csv", "start,end,action\n0,0.1,other\n")
    (result,) = read(path, ReadOptions())
    assert result.tracks[0].actions == ("a", "b")
    assert result.remarks == ("r.labels.csv was not read, as the recording has labels of its own.",)


def test_labels_of_further_coders_are_read_beside_those_in_the_table(write):
    """What was labelled here comes back with a recording that had its maker's labels already."""
    path = write("r.csv", "time,fx,label\n0,1,a\n.1,1,a\n.2,1,b\n.3,1,b\n")
    write("r.labels.csv", "start,end,action,author\n0,0.1,other,maker\n0.1,0.2,grab,Ann\n")
    (result,) = read(path, ReadOptions(author="maker"))
    assert [(track.author, track.actions) for track in result.tracks] == [
        ("maker", ("a", "b")),
        ("Ann", ("grab",)),
    ]
    assert result.remarks == (
        "The labels were read from r.labels.csv.",
        "The labels of maker in r.labels.csv were not read, as the recording has labels of its "
        "own.",
    )


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("a;b;c\n1;2;3\n", "is not a labels file; write one row a segment"),
        ("start,end,action,author\n0,500,grab,Ann\n", "the labels go from 0 s to 500 s"),
    ],
)
def test_a_recording_with_labels_is_read_whatever_lies_beside_it(write, content, sentence):
    path = write("r.csv", "time,fx,label\n0,1,a\n.1,1,a\n.2,1,b\n.3,1,b\n")
    write("r.labels.csv", content)
    (result,) = read(path, ReadOptions())
    assert [track.actions for track in result.tracks] == [("a", "b")]
    (remark,) = result.remarks
    assert remark.startswith("The labels beside the recording were not read: ")
    assert sentence in remark


def test_labels_on_the_clock_of_the_stamps_are_carried_to_the_start(write):
    path = write("r.csv", recording(100))
    write("r.labels.csv", "start,end,action\n100.5,101.25,grab\n")
    (result,) = read(path, ReadOptions())
    assert result.tracks[0].segments == (Segment(0.5, 1.25, "grab"),)
    assert "taken as stamps of the recording, which start at 100 s" in result.remarks[1]


@pytest.mark.parametrize(
    "text",
    [
        "start,end,action\n1700000000500,1700000001250,grab\n",
        "start,end,action\n1700000000.5,1700000001.25,grab\n",
        "start,end,action\n2023-11-14T22:13:20.5Z,2023-11-14T22:13:21.25Z,grab\n",
    ],
)
def test_labels_with_dates_are_carried_by_the_dates_of_the_recording(write, text):
    path = write("r.csv", recording(1_700_000_000, 1000).replace("time", "timestamp"))
    write("r.labels.csv", text)
    (result,) = read(path, ReadOptions())
    (segment,) = result.tracks[0].segments
    assert (segment.start, segment.end) == pytest.approx((0.5, 1.25), abs=1e-6)


def test_labels_of_another_recording_are_refused(write):
    path = write("r.csv", recording(0))
    write("r.labels.csv", "start,end,action\n50,60,grab\n")
    with pytest.raises(InputError, match=r"r\.labels\.csv.*do not fit"):
        read(path, ReadOptions())


#: As BORIS 9.15 exports aggregated events; BORIS 8 has the same columns.
BORIS = (
    "Observation id,Observation date,Description,Observation type,Source,Time offset (s),"
    "Coding duration,Media duration (s),FPS (frame/s),Subject,"
    "Observation duration by subject by observation,Behavior,Behavioral category,Behavior type,"
    "Start (s),Stop (s),Duration (s),Media file name,Image index start,Image index stop,"
    "Image file path start,Image file path stop,Comment start,Comment stop\n"
    "a - Ann,2026-11-23 21:38:49.052,foam,Media file,player #1:a.avi,-0.4,1.500,6.500,30.000,"
    "No focal subject,1.5,grab,Not defined,STATE,0.500,1.250,0.750,a.avi,NA,NA,,,,\n"
    "a - Ann,2026-11-23 21:38:49.052,foam,Media file,player #1:a.avi,-0.4,1.500,6.500,30.000,"
    'No focal subject,1.5,"hold, firmly",Not defined,STATE,1.250,2.000,0.750,a.avi,NA,NA,,,,\n'
)


def test_the_aggregated_events_of_boris_are_labels(write):
    path = write("a.labels.csv", BORIS)
    assert is_label_table(path.read_bytes())
    assert read_tracks(path, ReadOptions()) == (ANN,)
    other = write("b.labels.csv", BORIS)  # whose observations are called otherwise
    assert [track.author for track in read_tracks(other, ReadOptions(author="Zoe"))] == ["Zoe"]


def test_the_observations_of_several_coders_in_boris_are_their_tracks(write):
    header, grab, _ = BORIS.splitlines()
    ben = grab.replace("a - Ann", "a - Ben").replace("0.500,1.250", "0.750,1.500")
    path = write("a.labels.csv", BORIS + ben + "\n")
    assert read_tracks(path, ReadOptions()) == (ANN, BEN)
    path = write("a.labels.csv", "\n".join([header, grab, ben.replace("a - Ben", "c - Ben"), ""]))
    with pytest.raises(InputError, match=r"line 3: the observation 'c - Ben' is not called 'a - C"):
        read_tracks(path, ReadOptions())


def test_an_offset_is_an_end_where_nothing_else_is(write):
    path = write("a.labels.csv", "onset,time offset,action\n0.75,1.5,grab\n")
    assert read_tracks(path, ReadOptions(author="Ben")) == (BEN,)
