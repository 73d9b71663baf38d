"""Tracks as files: what is written is what was there, and other programs can read it."""

import csv
import io
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.formats import read
from forcelab.formats.label_tables import is_label_table, read_tracks
from forcelab.formats.recording import ReadOptions
from forcelab.formats.table_columns import is_unlabelled
from forcelab.formats.track_text import (
    AnnotatedTrack,
    on_samples,
    plain_text,
    plain_times,
    to_audacity,
    to_csv,
    to_statistics_table,
)
from forcelab.labels import Segment, Track, from_codes, to_codes

ACTIONS = ("grab", "hold", "slip")

printable = st.text(st.characters(exclude_categories=["Cs", "Cc", "Zl", "Zp"]), min_size=1)
#: Names as people give them: words of any script, with punctuation inside.
words = st.from_regex(r"[a-zäçж力][a-zäçж力0-9_, \"';.-]{0,8}[a-z0-9]", fullmatch=True).filter(
    lambda word: not is_unlabelled(word)
)


@st.composite
def tracks(draw, actions=printable, authors=words):
    times = draw(st.lists(st.floats(0, 1e5), min_size=2, max_size=12, unique=True))
    edges = sorted(times)[: len(times) // 2 * 2]
    segments = [
        Segment(start, end, draw(actions))
        for start, end in zip(edges[::2], edges[1::2], strict=True)
    ]
    return Track(draw(authors), tuple(segments))


def test_a_name_that_no_text_table_can_hold_is_refused():
    with pytest.raises(InputError, match="NUL"):
        to_csv([Track("Ada", (Segment(0.0, 1.0, "gr\0ab"),))])


def test_csv_has_a_header_and_a_line_for_each_segment():
    ada = Track("Ada", (Segment(0.1, 0.30000000000000004, "grab"), Segment(0.5, 2.0, "slip, then")))
    model = Track("mlp 3", (Segment(0.25, 1e-5 + 0.25, 'the "slip"'),))
    assert to_csv([ada, model]) == (
        "start,end,action,author\r\n"
        "0.1,0.3,grab,Ada\r\n"
        '0.5,2.0,"slip, then",Ada\r\n'
        '0.25,0.25001,"the ""slip""",mlp 3\r\n'
    )


writable = st.characters(exclude_categories=["Cs"], exclude_characters="\0")


@given(st.lists(tracks(st.text(writable, min_size=1)), max_size=3))
def test_csv_tells_every_name_and_every_time_to_a_nanosecond(written):
    rows = list(csv.DictReader(io.StringIO(to_csv(written), newline="")))
    expected = [(s.start, s.end, s.action, t.author) for t in written for s in t.segments]
    for row, (start, end, action, author) in zip(rows, expected, strict=True):
        assert abs(float(row["start"]) - start) <= 1e-9
        assert abs(float(row["end"]) - end) <= 1e-9
        assert (plain_text(row["action"]), plain_text(row["author"])) == (action, author)
        assert not row["action"].startswith(("=", "@"))


FORMULAS = ["=1+1", "@SUM(A1)", "-cmd|' /C calc'!A0", "+x", "'=1", "''-x", "'quoted'"]
QUOTED = ["'=1+1", "'@SUM(A1)", "'-cmd|' /C calc'!A0", "'+x", "''=1", "'''-x", "'quoted'"]


def test_no_spreadsheet_takes_a_name_for_a_formula_and_it_is_read_back(tmp_path):
    segments = tuple(Segment(i, i + 0.5, name) for i, name in enumerate(FORMULAS, -1))
    text = to_csv([Track("=Ada", segments)])
    rows = list(csv.DictReader(io.StringIO(text, newline="")))
    assert [row["action"] for row in rows] == QUOTED
    assert rows[0]["start"] == "-1.0"  # a number stays one
    path = tmp_path / "a.labels.csv"
    path.write_bytes(text.encode())
    (track,) = read_tracks(path, ReadOptions())
    assert (track.author, track.segments) == ("=Ada", segments)


@settings(max_examples=25)
@given(st.sampled_from((50, 100, 128, 200, 999, 1000, 4000)), st.floats(0, 100), st.data())
def test_what_is_written_is_read_back_onto_the_same_samples(rate, offset, data):
    times = offset + np.cumsum(np.full(200, 1 / rate)) - 1 / rate
    codes = np.array(data.draw(st.lists(st.integers(-1, 2), min_size=200, max_size=200)))
    track = Track("Ada", from_codes(codes, times, ACTIONS))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.labels.csv"
        for text in (to_csv([track]), to_statistics_table([AnnotatedTrack("a", "", 9, "", track)])):
            path.write_bytes(text.encode())
            (read,) = on_samples(read_tracks(path, ReadOptions()) or (Track("Ada"),), times)
            assert to_codes(read.segments, times, ACTIONS).tolist() == codes.tolist()


NAMES = ("grab", "hold it", 'a "b", c', "3", "none", "12:30", "ä;ß")


@pytest.mark.parametrize("names", [NAMES, *((name,) for name in NAMES)])
def test_names_that_look_like_something_else_are_read_back_to_the_bit(tmp_path, names):
    whole = Track("Ann", tuple(Segment(i / 7e6, (i + 1) / 7e6, n) for i, n in enumerate(names, 3)))
    ben = Track("Ben", (Segment(0.25, 1000000.000001, "grab"),))
    (tmp_path / "a.csv").write_bytes(to_csv([whole, ben]).encode())
    assert read_tracks(tmp_path / "a.csv", ReadOptions()) == (whole, ben)
    (tmp_path / "a.txt").write_bytes(to_audacity(whole).encode())
    assert read_tracks(tmp_path / "a.txt", ReadOptions(author="Ann")) == (whole,)


def test_a_label_file_beside_a_recording_comes_onto_its_samples(tmp_path):
    """0.1 + 0.2 is not 0.3: without that, the sample at 0.30000000000000004 would be unlabelled."""
    times = np.cumsum(np.full(60, 0.1))
    table = "\n".join(f"{time!r},{i % 7}" for i, time in enumerate(times.tolist()))
    (tmp_path / "a.csv").write_text(f"time [s],fz1 [N]\n{table}\n")
    whole = Track("Ada", (Segment(times[2] - times[0], times[59] - times[0], "grab"),))
    (tmp_path / "a.labels.csv").write_bytes(to_csv([whole]).encode())
    (recording,) = read(tmp_path / "a.csv")
    (track,) = recording.tracks
    stamps = recording.demonstration.times
    assert (track.segments[0].start, track.segments[0].end) == (stamps[2], stamps[59])


def test_a_segment_shorter_than_what_is_rounded_away_stays():
    track = Track("Ada", (Segment(0.0, 4e-10, "grab"), Segment(4e-10, 1.0, "hold")))
    assert "0.0,4e-10,grab,Ada\r\n4e-10,1.0,hold" in to_csv([track])


def test_audacity_has_six_decimals_or_more_and_no_exponent():
    track = Track("Ada", (Segment(1e-7, 0.5, "grab"), Segment(1.0, 2.0000001234, "slip, then")))
    assert to_audacity(track) == ("0.0000001\t0.500000\tgrab\n1.000000\t2.0000001234\tslip, then\n")


@given(tracks())
def test_audacity_tells_every_action_and_every_time_to_a_nanosecond(track):
    rows = [line.split("\t") for line in to_audacity(track).split("\n")[:-1]]
    for (start, end, action), segment in zip(rows, track.segments, strict=True):
        assert abs(float(start) - segment.start) <= 1e-9
        assert abs(float(end) - segment.end) <= 1e-9
        assert action == segment.action
    assert all("e" not in start + end for start, end, _ in rows)


@pytest.mark.parametrize("action", ["a\tb", "a\nb", "grab\n", "a\rb", "a\u2028b"])
def test_audacity_refuses_an_action_that_would_break_its_line(action):
    with pytest.raises(InputError) as refusal:
        to_audacity(Track("Ada", (Segment(0, 1, "fine"), Segment(1, 2, action))))
    assert "a tab or a line break" in str(refusal.value)
    assert str(refusal.value).isprintable()


def as_written(tracks):
    """The tracks with their times as files tell them."""
    return tuple(
        Track(track.author, tuple(Segment(*times, s.action) for s, times in plain_times(track)))
        for track in tracks
    )


@settings(max_examples=25)
@given(st.lists(tracks(words), min_size=1, max_size=3, unique_by=lambda track: track.author))
def test_csv_is_read_back_as_it_is_written(written):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.labels.csv"
        path.write_bytes(to_csv(written).encode())
        assert is_label_table(path.read_bytes())
        assert read_tracks(path, ReadOptions()) == as_written(written)


@settings(max_examples=25)
@given(tracks(words))
def test_audacity_is_read_back_as_it_is_written(track):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.txt"
        path.write_bytes(to_audacity(track).encode())
        assert is_label_table(path.read_bytes())
        assert read_tracks(path, ReadOptions(author=track.author)) == as_written([track])
