"""Tracks as files: what is written is what was there, and other programs can read it."""

import csv
import io
import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.formats.recording import ReadOptions
from forcelab.formats.table.labels import read_labels, sniff_labels
from forcelab.formats.table.roles import UNLABELLED_WORDS
from forcelab.formats.tracks import to_audacity, to_csv, write_audacity, write_csv
from forcelab.labels import Segment, Track

printable = st.text(st.characters(exclude_categories=["Cs", "Cc", "Zl", "Zp"]), min_size=1)
#: Names as people give them: words of any script, with punctuation inside.
words = st.from_regex(r"[a-zäçж力][a-zäçж力0-9_, \"';.-]{0,8}[a-z0-9]", fullmatch=True).filter(
    lambda word: word not in UNLABELLED_WORDS
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
        "0.1,0.30000000000000004,grab,Ada\r\n"
        '0.5,2.0,"slip, then",Ada\r\n'
        '0.25,0.25001,"the ""slip""",mlp 3\r\n'
    )


writable = st.characters(exclude_categories=["Cs"], exclude_characters="\0")


@given(st.lists(tracks(st.text(writable, min_size=1)), max_size=3))
def test_csv_tells_every_time_and_name_exactly(written):
    rows = list(csv.DictReader(io.StringIO(to_csv(written), newline="")))
    expected = [(s.start, s.end, s.action, t.author) for t in written for s in t.segments]
    assert [
        (float(row["start"]), float(row["end"]), row["action"], row["author"]) for row in rows
    ] == expected


def test_audacity_has_six_decimals_or_more_and_no_exponent():
    track = Track("Ada", (Segment(1e-7, 0.5, "grab"), Segment(1.0, 2.0000001234, "slip, then")))
    assert to_audacity(track) == ("0.0000001\t0.500000\tgrab\n1.000000\t2.0000001234\tslip, then\n")


@given(tracks())
def test_audacity_tells_every_time_and_action_exactly(track):
    rows = [line.split("\t") for line in to_audacity(track).split("\n")[:-1]]
    read = tuple(Segment(float(start), float(end), action) for start, end, action in rows)
    assert read == track.segments
    assert all("e" not in start + end for start, end, _ in rows)


@pytest.mark.parametrize("action", ["a\tb", "a\nb", "grab\n", "a\rb", "a\u2028b"])
def test_audacity_refuses_an_action_that_would_break_its_line(tmp_path, action):
    path = tmp_path / "labels.txt"
    path.write_text("before")
    with pytest.raises(InputError) as refusal:
        write_audacity(path, Track("Ada", (Segment(0, 1, "fine"), Segment(1, 2, action))))
    assert "a tab or a line break" in str(refusal.value)
    assert str(refusal.value).isprintable()
    assert path.read_text() == "before"


def test_files_are_utf_8_and_an_empty_track_is_a_file_too(tmp_path):
    write_csv(tmp_path / "a.csv", [Track("Åsa", (Segment(0, 1, "gräb"),))])
    assert (tmp_path / "a.csv").read_bytes() == (
        "start,end,action,author\r\n0.0,1.0,gräb,Åsa\r\n".encode()
    )
    write_audacity(tmp_path / "a.txt", Track("Åsa", (Segment(0, 1, "gräb"),)))
    assert (tmp_path / "a.txt").read_bytes() == "0.000000\t1.000000\tgräb\n".encode()
    write_audacity(tmp_path / "b.txt", Track("Åsa"))
    assert (tmp_path / "b.txt").read_bytes() == b""


@given(st.lists(tracks(words), min_size=1, max_size=3, unique_by=lambda track: track.author))
def test_csv_is_read_back_exactly(written):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.labels.csv"
        write_csv(path, written)
        assert sniff_labels(path.read_bytes())
        assert read_labels(path, ReadOptions()) == tuple(written)


@given(tracks(words))
def test_audacity_is_read_back_exactly(track):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.txt"
        write_audacity(path, track)
        assert sniff_labels(path.read_bytes())
        assert read_labels(path, ReadOptions(author=track.author)) == (track,)
