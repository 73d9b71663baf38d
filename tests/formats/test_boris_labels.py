"""Labels of BORIS: projects, and tables as its versions 7, 8 and 10 export them.

The headers and the spelling of cells are those that BORIS 7.13.9, 8.27.4 and 10.0.2 wrote.
"""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import pytest
from fuzz.text_mutations import mutated_bytes, mutated_json

from forcelab.clock import ClockMap
from forcelab.demonstration import VideoReference
from forcelab.errors import InputError
from forcelab.formats import boris, identify, json_values
from forcelab.formats.boris import RESOLUTION, Observation, to_boris
from forcelab.formats.label_files import LabelOptions, LabelSet, read_label_file
from forcelab.labels import Segment, Track
from forcelab.vocabulary import Vocabulary

ANN = Track("Ann", (Segment(0.1, 0.3, "grab"), Segment(0.3, 0.45, "hold, firmly")))
BEN = Track("Ben", (Segment(0.0, 0.2, "grab"),))


def project(**changes):
    """A project as BORIS writes it: two subjects, a point event, a modifier, two players."""
    observation = {
        "type": "MEDIA",
        "file": {"1": ["C:\\films\\a.mp4", "/films/b.mp4"], "2": ["/films/side.mp4"], "3": []},
        "media_info": {
            "length": {"C:\\films\\a.mp4": 4.5, "/films/b.mp4": 3.0, "/films/side.mp4": 9.0},
            "fps": {},
            "offset": {"1": 0.0, "2": 0.25},
        },
        "time offset": 100.0,
        "independent_variables": {},
        "events": [
            [100.5, "left", "grab", "", "", 15],
            [101.0, "right", "hold", "", "", "NA"],
            [101.25, "left", "tap", "", "loud", "NA"],
            [101.5, "left", "grab", "", "", "NA"],
            [102.0, "left", "grab", "strong|two fingers", "", "NA"],
            [103.0, "right", "hold", "", "", "NA"],
            [103.5, "left", "grab", "strong|two fingers", "", "NA"],
        ],
        **changes,
    }
    behaviors = [("grab", "State event"), ("hold", "State event"), ("tap", "Point event")]
    return {
        "project_format_version": "7.0",
        "behaviors_conf": {
            str(i): {"code": code, "type": kind} for i, (code, kind) in enumerate(behaviors)
        },
        "observations": {"pull 7": observation},
    }


def write(path: Path, content) -> Path:
    path.write_text(content if isinstance(content, str) else json.dumps(content), "utf-8")
    return path


@pytest.fixture
def path(tmp_path):
    return tmp_path / "study.boris"


def test_what_we_write_comes_back_to_a_microsecond(path, monkeypatch):
    monkeypatch.setattr(boris, "stated_rate_and_length", lambda _: (30.0, 12.5))
    clock = ClockMap(-0.4, 1.25)
    video = VideoReference(Path("/films/pull.mp4"), clock)
    observations = [
        Observation("a", "foam", ANN),
        Observation("a", "foam", BEN),
        Observation("b - c", "foam", ANN, (video,)),
    ]
    path.write_bytes(to_boris("p", observations, Vocabulary()))
    live, filmed = read_label_file(path)
    assert live == LabelSet("a", (ANN, BEN), resolution=RESOLUTION)
    assert (filmed.name, filmed.duration, filmed.media) == ("b - c", 12.5, {"pull.mp4": 0.0})
    (track,) = filmed.tracks
    assert (track.author, track.actions) == ("Ann", ANN.actions)
    for read, written in zip(track.segments, ANN.segments, strict=True):
        # Of the video, whose clock carries them back.
        assert read.start == pytest.approx(float(clock.to_device(written.start)), abs=1e-6)
        assert read.end == pytest.approx(float(clock.to_device(written.end)), abs=1e-6)


def test_subjects_are_authors_and_times_those_of_the_media(path):
    (labels,) = read_label_file(write(path, project()))
    assert labels.name == "pull 7"
    assert labels.tracks == (
        Track("left", (Segment(0.5, 1.5, "grab"), Segment(2.0, 3.5, "grab (strong, two fingers)"))),
        Track("right", (Segment(1.0, 3.0, "hold"),)),
    )
    assert labels.media == {"a.mp4": 0.0, "b.mp4": -4.5, "side.mp4": -0.25}
    assert labels.duration == 7.5
    assert labels.remarks == (
        "Modifiers stand in brackets behind their behavior.",
        "1 comment was left out.",
        "1 point event was left out.",
    )


def test_a_compressed_project_is_the_same(path, monkeypatch):
    plain = read_label_file(write(path, project()))
    packed = path.with_name("study.boris.gz")
    packed.write_bytes(gzip.compress(path.read_bytes()))
    assert read_label_file(packed) == plain
    whole = packed.read_bytes()
    packed.write_bytes(whole[:-20])
    with pytest.raises(InputError, match="is not whole"):
        read_label_file(packed)
    monkeypatch.setattr(json_values, "LARGEST", 1 << 20)
    packed.write_bytes(gzip.compress(b" " * (1 << 21)))
    with pytest.raises(InputError, match="longer than 1 MB"):
        read_label_file(packed)


def test_an_observer_is_the_author_and_several_subjects_stay_apart(path):
    (labels,) = read_label_file(write(path, project(independent_variables={"Coder": "Zoe"})))
    assert [track.author for track in labels.tracks] == ["Zoe - left", "Zoe - right"]
    content = project(independent_variables={"observer": "Zoe"})
    content["observations"]["pull 7"]["events"][1:2] = []
    content["observations"]["pull 7"]["events"][4:5] = []
    (labels,) = read_label_file(write(path, content))
    assert [track.author for track in labels.tracks] == ["Zoe"]


@pytest.mark.parametrize("file", [{}, []])
def test_without_observer_and_subject_the_author_is_the_options(path, file):
    events = [[100.5, "", "grab", "", ""], [101.5, "", "grab", "", ""]]
    write(path, project(events=events, type="LIVE", file=file))
    (labels,) = read_label_file(path, LabelOptions(author="Kim"))
    assert labels == LabelSet(
        "pull 7", (Track("Kim", (Segment(0.5, 1.5, "grab"),)),), resolution=RESOLUTION
    )


EIGHT = (
    "Observation id\tObservation date\tDescription\tObservation type\tSource\tTime offset (s)\t"
    "Coding duration\tMedia duration (s)\tFPS (frame/s)\tobserver\tSubject\t"
    "Observation duration by subject by observation\tBehavior\tBehavioral category\tModifier #1\t"
    "Behavior type\tStart (s)\tStop (s)\tDuration (s)\tMedia file name\tImage index start\t"
    "Image index stop\tImage file path start\tImage file path stop\tComment start\tComment stop\n"
)
EIGHT_START = (
    "pull 7 - Ann\t2026-11-27 10:00:00\tfoam\tMedia file\tplayer #1:/films/a.mp4;/films/b.mp4|"
    "player #2:/films/c.mp4\t-0.4\t9.5\t4.500;3.000|9.000\t30.000;30.000|25.000\tAnn\t"
    "No focal subject\t9.500\t"
)
SEVEN = (
    "Observation id,Observation date,Description,Media file,Total length,FPS,Subject,Behavior,"
    "Behavioral category,Modifiers,Behavior type,Start (s),Stop (s),Duration (s),Comment start,"
    "Comment stop\r\n"
)


def test_aggregated_events_of_later_versions(tmp_path):
    rows = (
        "grab\t\tstrong\tSTATE\t-0.300\t0.100\t0.400\t/films/a.mp4\t1\t2\tNA\tNA\t\t\n",
        "tap\t\t\tPOINT\t0.200\t0.200\tNA\t/films/a.mp4\t1\t2\tNA\tNA\t\t\n",
        "hold\t\t\tSTATE\t0.100\t0.100\t0.000\t/films/a.mp4\t1\t2\tNA\tNA\t\t\n",
    )
    text = EIGHT + "".join(EIGHT_START + row for row in rows)
    (labels,) = read_label_file(write(tmp_path / "all.tsv", text))
    assert (labels.name, labels.duration) == ("pull 7", 7.5)
    assert labels.media == {"a.mp4": 0.0, "b.mp4": -4.5}
    (track,) = labels.tracks
    assert track.author == "Ann"
    (segment,) = track.segments
    assert (segment.start, segment.end) == pytest.approx((0.1, 0.5))
    assert segment.action == "grab (strong)"
    assert labels.remarks[1:] == (
        "1 point event was left out.",
        "1 state without length was left out.",
    )


def test_aggregated_events_of_version_7_tell_no_offset(tmp_path):
    rows = (
        'pull 7,2026-11-27 10:00:00,,"/films/a, b.mp4",4.500,25.0,left,grab,,None,STATE,1.000,'
        "2.500,1.500,,\r\n",
        "push,2026-11-27 10:00:00,,LIVE,4.500,NA,No focal subject,grab,,None,STATE,1.000,2.0,1.0,"
        ",\r\n",
    )
    pull, push = read_label_file(write(tmp_path / "all.csv", SEVEN + "".join(rows)))
    assert pull.tracks == (Track("left", (Segment(1.0, 2.5, "grab"),)),)
    assert pull.media == {"a, b.mp4": 0.0}
    assert pull.remarks == ("No time offset stands in the file; none was assumed.",)
    assert push.tracks == (Track("coder", (Segment(1.0, 2.0, "grab"),)),)
    assert push.media == {}


SEVEN_TABULAR = (
    "Observation id\tpull 7 - Ann\n\nMedia file(s)\n\nPlayer #1\t/films/a.mp4\n\n"
    "Observation date\t2026-11-27 10:00:00\n\nDescription\tfoam\n\nTime offset (s)\t-0.4\n\n"
    "independent variables\nvariable\tvalue\nobserver\tAnn\n\n"
    "Time\tMedia file path\tTotal length\tFPS\tSubject\tBehavior\tBehavioral category\tComment\t"
    "Status\n"
)


def test_tabular_events_of_version_7_have_the_observation_above_them(tmp_path):
    rows = (
        "-0.3\t/films/a.mp4\t4.5\t25.0\t\tgrab\t\t\tSTART\n",
        "0\t/films/a.mp4\t4.5\t25.0\t\ttap\t\t\tPOINT\n",
        "0.1\t/films/a.mp4\t4.5\t25.0\t\tgrab\t\t\tSTOP\n",
    )
    (labels,) = read_label_file(write(tmp_path / "a.tsv", SEVEN_TABULAR + "".join(rows)))
    assert (labels.name, labels.media) == ("pull 7", {"a.mp4": 0.0})
    (segment,) = labels.tracks[0].segments
    assert (segment.start, segment.end) == pytest.approx((0.1, 0.5))
    assert labels.remarks == ("1 point event was left out.",)


EIGHT_TABULAR = (
    "Observation id,Observation date,Description,Observation duration,Observation type,Source,"
    "Time offset (s),Media duration (s),FPS,Subject,Behavior,Behavioral category,Behavior type,"
    "Time,Media file name,Image index,Image file path,Comment\r\n"
)
EIGHT_TABULAR_START = (
    "pull 7,2026-11-27 10:00:00,,4.5,Media file(s),player #1:/films/a.mp4,0.0,4.500,25.000,left,"
)


def tabular(path, *rows):
    text = "".join(f"{EIGHT_TABULAR_START}{row},/films/a.mp4,NA,NA,\r\n" for row in rows)
    return write(path, EIGHT_TABULAR + text)


def test_tabular_events_are_no_recording(tmp_path):
    path = tabular(tmp_path / "a.csv", "grab,,START,1.0", "grab,,STOP,1.5")
    with pytest.raises(InputError, match="holds labels, which belong to a demonstration"):
        identify(path)


def test_tabular_events_of_later_versions(tmp_path):
    rows = ("grab,,START,1.0", "hold,,START,1.5", "grab,,STOP,1.5", "hold,,STOP,2.25")
    (labels,) = read_label_file(tabular(tmp_path / "a.csv", *rows))
    segments = (Segment(1.0, 1.5, "grab"), Segment(1.5, 2.25, "hold"))
    assert labels == LabelSet(
        "pull 7", (Track("left", segments),), 4.5, (), {"a.mp4": 0.0}, resolution=RESOLUTION
    )


@pytest.mark.parametrize(
    ("rows", "complaint"),
    [
        (["grab,,START,1.0"], "line 2: 'grab' at 1 s never stops; pair the state events in BORIS"),
        (["grab,,STOP,1.0"], "line 2: 'grab' at 1 s never starts"),
        (["grab,,START,1.0", "grab,,START,2.0"], "line 3: 'grab' at 2 s never stops"),
        (["grab,,START,1.0", "grab,,BEGIN,2.0"], "line 3: 'BEGIN' is neither START"),
        (["grab,,START,00:01"], "line 2: '00:01' in column 'time' is no time in seconds"),
        (["grab,,START,2", "grab,,STOP,1"], "line 3: 'grab' ends before it starts"),
    ],
)
def test_a_table_that_is_not_whole_is_refused_with_its_line(tmp_path, rows, complaint):
    with pytest.raises(InputError, match=complaint):
        read_label_file(tabular(tmp_path / "a.csv", *rows))


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"events": [[1, "", "grab", ""]]}, "'pull 7', 'events', 1: 'grab' at 1 s never stops"),
        ({"events": [["x", "", "grab", ""]]}, r"'events', 1, 1 is 'x' where a number is expected"),
        ({"events": [[1, "", "grab"], [3, "", "grab"], [2, "", "hold"], [4, "", "hold"]]},
         "observation 'pull 7': Segments of one author overlap: .* Make the behaviors exclude"),
        ({"events": 5}, "'events' is 5 where a list is expected"),
        ({"time offset": "0"}, "'time offset' is '0' where a number is expected"),
        ({"events": [[1]]}, "where a time, a subject and a behavior is expected"),
        ({"type": "IMAGES"}, "holds no label"),
    ],
)  # fmt: skip
def test_a_project_that_is_not_whole_is_refused_with_the_place(path, changes, complaint):
    with pytest.raises(InputError, match=complaint):
        read_label_file(write(path, project(**changes)))


def test_broken_files_are_refused_in_a_sentence(path, tmp_path):
    whole = json.dumps(project()).encode()
    table = tabular(tmp_path / "a.csv", "grab,,START,1.0", "grab,,STOP,1.5").read_bytes()
    for name, texts in (
        ("a.boris", [*mutated_bytes(whole, 50), *mutated_json(whole, 60)]),
        ("b.csv", mutated_bytes(table, 60)),
    ):
        for text in texts:
            (tmp_path / name).write_bytes(text)
            try:
                read_label_file(tmp_path / name)
            except InputError as error:
                assert "\n" not in str(error)
