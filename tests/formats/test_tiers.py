"""ELAN files and TextGrids are read tier by tier, whoever wrote them."""

from __future__ import annotations

import random
import re

import praatio.textgrid
import pympi
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.clock import ClockMap
from forcelab.demonstration import VideoReference
from forcelab.errors import InputError
from forcelab.formats.elan import to_elan
from forcelab.formats.label_files import LabelOptions, read_label_file
from forcelab.formats.textgrid import to_textgrid
from forcelab.labels import Segment, Track, means_unlabelled

ANN = Track("Ann", (Segment(0.5, 1.25, "grab"), Segment(1.25, 2.0, 'hold, "firmly"')))
BEN = Track("Ben", (Segment(0.75, 1.5, "grab"),))
ACTIONS = LabelOptions(author="Ida", tiers="actions")

#: As ELAN 4 writes: a controlled vocabulary of format 2.7, a symbolic child, slots without times.
OLD = """<?xml version="1.0" encoding="UTF-8"?>
<ANNOTATION_DOCUMENT AUTHOR="" DATE="2012-02-03T10:00:00+01:00" FORMAT="2.7" VERSION="2.7">
<HEADER MEDIA_FILE="" TIME_UNITS="milliseconds">
<MEDIA_DESCRIPTOR MEDIA_URL="file:///C:/Videos/pen%2001.mpg" MIME_TYPE="video/mpeg"/>
<MEDIA_DESCRIPTOR MEDIA_URL="file:///C:/b.mpg" MIME_TYPE="video/mpeg" TIME_ORIGIN="1500"/>
</HEADER>
<TIME_ORDER>
<TIME_SLOT TIME_SLOT_ID="t1" TIME_VALUE="500"/><TIME_SLOT TIME_SLOT_ID="t2" TIME_VALUE="1250"/>
<TIME_SLOT TIME_SLOT_ID="t3"/><TIME_SLOT TIME_SLOT_ID="t4" TIME_VALUE="2000"/>
</TIME_ORDER>
<TIER LINGUISTIC_TYPE_REF="d" TIER_ID="default">
<ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID="a1" TIME_SLOT_REF1="t1" TIME_SLOT_REF2="t2">
<ANNOTATION_VALUE> grab </ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION>
<ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID="a2" TIME_SLOT_REF1="t2" TIME_SLOT_REF2="t4">
<ANNOTATION_VALUE></ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION>
</TIER>
<TIER ANNOTATOR="Zoe" LINGUISTIC_TYPE_REF="d" PARENT_REF="default" TIER_ID="parts">
<ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID="a3" TIME_SLOT_REF1="t1" TIME_SLOT_REF2="t3">
<ANNOTATION_VALUE>x</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION>
<ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID="a4" TIME_SLOT_REF1="t1" TIME_SLOT_REF2="t4">
<ANNOTATION_VALUE>hold</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION>
</TIER>
<TIER LINGUISTIC_TYPE_REF="s" PARENT_REF="default" TIER_ID="note">
<ANNOTATION><REF_ANNOTATION ANNOTATION_ID="a5" ANNOTATION_REF="a1">
<ANNOTATION_VALUE>gently</ANNOTATION_VALUE></REF_ANNOTATION></ANNOTATION>
</TIER>
<LINGUISTIC_TYPE LINGUISTIC_TYPE_ID="d" TIME_ALIGNABLE="true" CONTROLLED_VOCABULARY_REF="v"/>
<CONTROLLED_VOCABULARY CV_ID="v" DESCRIPTION=""><CV_ENTRY DESCRIPTION="">grab</CV_ENTRY>
</CONTROLLED_VOCABULARY>
</ANNOTATION_DOCUMENT>"""


def read(path, options=None):
    (labels,) = read_label_file(path, options)
    return labels


def as_set(tracks):
    return {track.author: track.segments for track in tracks}


def test_what_elan_4_wrote_is_read_and_what_has_no_times_is_told(tmp_path):
    path = tmp_path / "lab.eaf"
    path.write_text(OLD, encoding="utf-8")
    labels = read(path, LabelOptions(author="Ann"))
    assert labels.name == "pen 01"
    assert labels.media == {"pen 01.mpg": 0.0, "b.mpg": 1.5}
    assert as_set(labels.tracks) == {
        "Ann": (Segment(0.5, 1.25, "grab"),),
        "Zoe": (Segment(0.5, 2.0, "hold"),),
    }
    assert labels.remarks == (
        "1 annotation of tier 'parts' has no time of its own and was left out.",
        "1 annotation of tier 'note' has no time of its own and was left out.",
    )


def test_a_value_may_stand_in_the_controlled_vocabulary_alone(tmp_path):
    path = tmp_path / "lab.eaf"
    content = to_elan([ANN], (), tmp_path).decode()
    path.write_text(content.replace("<ANNOTATION_VALUE>grab</", "<ANNOTATION_VALUE></"))
    assert read(path).tracks == (ANN,)


def test_our_elan_files_are_on_the_clock_of_the_forces_whatever_the_video(tmp_path):
    path = tmp_path / "lab.labels.eaf"
    video = VideoReference(tmp_path / "a.mp4", ClockMap(-0.4))
    path.write_bytes(to_elan([ANN, BEN], [video], tmp_path))
    labels = read(path)
    assert (labels.name, labels.media, labels.tracks) == ("lab", {}, (ANN, BEN))


def test_edges_that_overlap_by_a_rounding_are_one(tmp_path):
    """As where a program adds up durations. Old short text says so in its first line."""
    edges = [(1358.8925, 1372.6225001, "sil"), (1372.6225, 1373.5, "hold")]
    words = "\n".join(f'{start}\n{end}\n"{text}"' for start, end, text in edges)
    text = 'File type = "ooTextFile short"\n"TextGrid"\n\n0\n1400\n<exists>\n1\n'
    text += '"IntervalTier"\n"Ann"\n'
    path = tmp_path / "a.TextGrid"
    path.write_text(f"{text}0\n1400\n2\n{words}\n")
    (track,) = read(path).tracks
    hold = Segment(1372.6225, 1373.5, "hold")
    assert track.segments == (Segment(1358.8925, 1372.6225, "sil"), hold)
    path.write_text(f"{text}0\n1400\n2\n{words}\n".replace("1372.6225001", "1372.6226"))
    with pytest.raises(
        InputError, match=r"'sil' ends at 1372\.6226 s and 'hold' starts at 1372\.6225 s"
    ):
        read(path)


@pytest.mark.parametrize("code", ["utf-8-sig", "utf-16", "utf-16-be"])
def test_elan_is_xml_of_any_encoding(tmp_path, code):
    path = tmp_path / "lab.eaf"
    content = to_elan([ANN], (), tmp_path).decode()
    mark = "\ufeff" if code == "utf-16-be" else ""
    content = content.replace("'UTF-8'", f"'{code[:6].removesuffix('-')}'")
    path.write_bytes((mark + content).encode(code))
    assert read(path).tracks == (ANN,)


def test_what_pympi_writes_is_read_as_it_was_meant(tmp_path):
    path = tmp_path / "pen-01.eaf"
    eaf = pympi.Elan.Eaf(author="someone")
    eaf.remove_tier("default")
    for name in ("Ann", "Ben"):
        eaf.add_tier(name)
    for track in (ANN, BEN):
        for segment in track.segments:
            times = (round(1000 * segment.start), round(1000 * segment.end))
            eaf.add_annotation(track.author, *times, segment.action)
    eaf.to_file(str(path))
    labels = read(path)
    assert labels.name == "pen-01"
    assert as_set(labels.tracks) == as_set([ANN, BEN])


def test_tiers_that_share_an_annotator_are_called_as_they_are(tmp_path):
    path = tmp_path / "lab.eaf"
    content = to_elan([ANN, BEN], (), tmp_path).decode()
    path.write_text(re.sub('ANNOTATOR="[^"]*"', 'ANNOTATOR="Zoe"', content))
    assert as_set(read(path).tracks) == as_set([ANN, BEN])


def test_tiers_may_be_the_actions_of_one_author(tmp_path):
    path = tmp_path / "lab.eaf"
    eaf = pympi.Elan.Eaf(author="someone")
    for name, start, end, text in [
        ("grab", 500, 1250, ""),
        ("hold", 1250, 2000, "left"),
        ("grab", 2500, 3000, "grab"),
    ]:
        if name not in eaf.get_tier_names():
            eaf.add_tier(name)
        eaf.add_annotation(name, start, end, text)
    eaf.to_file(str(path))
    labels = read(path, ACTIONS)
    actions = (Segment(0.5, 1.25, "grab"), Segment(1.25, 2, "hold"), Segment(2.5, 3, "grab"))
    assert as_set(labels.tracks) == {"Ida": actions}
    assert labels.remarks == ("1 text was left out, as the tiers are the actions.",)
    eaf.add_annotation("hold", 2900, 3100, "")
    eaf.to_file(str(path))
    with pytest.raises(InputError, match="In tiers 'grab' and 'hold' of Ida, 'grab' ends at 3 s"):
        read(path, ACTIONS)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("<ANNOTATION_DOC", '<!DOCTYPE a []>\n<ANNOTATION_DOC', "2: it declares a document type"),
        ("<ANNOTATION_DOC", "<a><ANNOTATION_DOC", "line 2: it is XML of another kind ('a')"),
        ("grab </", "grab </b></", "not well-formed XML (mismatched tag)"),
        ("UTF-8", "UTF-77", "line 1: it is not in the encoding that it states"),
        ("milliseconds", "PAL-frames", "its times are PAL-frames, not milliseconds"),
        ('"500"', '"0.5"', "'0.5' is no whole number of milliseconds"),
        ('"500"', f'"{"9" * 5000}"', "is no whole number of milliseconds"),
        ('"500"', '"1300"', "goes from 1.3 back to 1.25 s"),
        ('REF1="t1"', 'REF1="t9"', "the time slot 't9', which does not exist"),
        (' TIME_VALUE="1250"', "", "holds no label"),
    ],
)  # fmt: skip
def test_a_broken_elan_file_is_one_sentence(tmp_path, old, new, sentence):
    path = tmp_path / "lab.eaf"
    content = OLD.replace("hold", "") if "holds" in sentence else OLD
    path.write_text(content.replace(old, new, 1 if old != '"500"' else -1), encoding="utf-8")
    with pytest.raises(InputError) as error:
        read(path)
    assert sentence in str(error.value)
    assert "lab.eaf" in str(error.value)
    assert "\n" not in str(error.value)


def test_entities_that_grow_without_end_are_not_expanded(tmp_path):
    levels = "".join(f'<!ENTITY a{n + 1} "{f"&a{n};" * 10}">' for n in range(30))
    path = tmp_path / "lab.eaf"
    path.write_text(
        f'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a0 "laugh">{levels}]>'
        "<ANNOTATION_DOCUMENT>&a30;</ANNOTATION_DOCUMENT>"
    )
    with pytest.raises(InputError, match="declares a document type"):
        read(path)


names = st.text(st.characters(codec="utf-8", exclude_categories=["Cc"]), max_size=9).map(str.strip)
names = names.filter(lambda name: name and not means_unlabelled(name))
tracks = st.lists(st.tuples(st.integers(0, 50), st.integers(1, 50), names), min_size=1, max_size=6)


def track_from(steps, unit):
    end, segments = 0, []
    for gap, length, action in steps:
        segments.append(Segment((end + gap) * unit, (end + gap + length) * unit, action))
        end += gap + length
    return Track("Ann", tuple(segments))


@settings(max_examples=15)
@given(tracks)
def test_any_labels_come_back_from_elan_and_praat(tmp_path_factory, steps):
    folder = tmp_path_factory.getbasetemp()
    track = track_from(steps, 0.001)
    (folder / "a.eaf").write_bytes(to_elan([track], (), folder))
    (folder / "a.TextGrid").write_bytes(to_textgrid([track], 10.0))
    for name in ("a.eaf", "a.TextGrid"):
        (back,) = read(folder / name).tracks
        assert [s.action for s in back.segments] == [s.action for s in track.segments]
        for old, new in zip(track.segments, back.segments, strict=True):
            assert new.start == pytest.approx(old.start, abs=1e-9)
            assert new.end == pytest.approx(old.end, abs=1e-9)


@pytest.mark.parametrize("form", ["short_textgrid", "long_textgrid"])
def test_praatio_reads_and_writes_the_same_textgrids(tmp_path, form):
    path = tmp_path / "pen-01.TextGrid"
    path.write_bytes(to_textgrid([ANN, BEN], 3.5))
    grid = praatio.textgrid.openTextgrid(str(path), includeEmptyIntervals=False)
    for track in (ANN, BEN):
        entries = [(e.start, e.end, e.label) for e in grid.getTier(track.author).entries]
        assert entries == [(s.start, s.end, s.action) for s in track.segments]
    grid.addTier(praatio.textgrid.PointTier("taps", [(1.0, "tap")], 0, 3.5))
    grid.save(str(path), form, includeBlankSpaces=True)
    labels = read(path)
    assert (labels.name, labels.duration) == ("pen-01", 3.5)
    assert labels.tracks == (ANN, BEN)
    assert labels.remarks == (
        "The point tier 'taps' (1 point) was left out: points have no duration.",
    )


@pytest.mark.parametrize("code", ["utf-8-sig", "utf-16", "utf-16-be", "latin-1"])
def test_a_textgrid_is_text_of_any_encoding(tmp_path, code):
    path = tmp_path / "pen-01.TextGrid"
    track = Track("Zoé", (Segment(0.5, 1.0, "übergeben"),))
    mark = "\ufeff" if code == "utf-16-be" else ""
    path.write_bytes((mark + to_textgrid([track], 3.5).decode()).encode(code))
    assert read(path).tracks == (track,)


def test_in_a_textgrid_only_numbers_that_stand_alone_and_texts_count(tmp_path):
    path = tmp_path / "pen-01.TextGrid"
    path.write_text(
        'File type = "ooTextFile"\n"TextGrid"\n0 2 <exists> 1 tier, number [7] ! 9 "no"\n'
        '"IntervalTier" "Ann" 0 2\n2 intervals of it: from 0 to 0.5 is ""\n0.5 2e0 "a ""b"" !c"\n'
    )
    assert read(path).tracks == (Track("Ann", (Segment(0.5, 2.0, 'a "b" !c'),)),)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('"TextGrid"', '"TextGrid" "PitchTier"', "line 2: there is '\"PitchTier\"' where a number"),
        ('"IntervalTier"', '"Tier"', "a tier is an IntervalTier or a TextTier, not 'Tier'"),
        ("size = 1", "size = 9999999", "the file ends where a text in quotes is expected"),
        ("intervals: size = 4", "intervals: size = -1", "-1 is no number of tiers or intervals"),
        ("xmax = 3.5", "xmax = 1e999", "a time is not finite"),
        ("xmin = 1.25", "xmin = 2.25", "an interval goes from 2.25 back to 2 s"),
        ("xmin = 1.25", "xmin = 1.125", "'grab' ends at 1.25 s and"),
        ('text = "grab"', 'text = "grab', "where a number is expected"),
        ("File type", "ooBinaryFile\x08TextGrid", "is a binary TextGrid; open it in Praat"),
    ],
)
def test_a_broken_textgrid_is_one_sentence(tmp_path, old, new, sentence):
    path = tmp_path / "pen-01.TextGrid"
    content = to_textgrid([ANN], 3.5).decode()
    assert old in content
    path.write_text(content.replace(old, new, 1))
    with pytest.raises(InputError) as error:
        read(path)
    assert sentence in str(error.value)
    assert "pen-01.TextGrid" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["a.eaf", "a.TextGrid"])
def test_mutated_files_are_read_or_refused_in_a_sentence(tmp_path, name):
    path = tmp_path / name
    whole = to_elan([ANN, BEN], (), tmp_path) if "eaf" in name else to_textgrid([ANN, BEN], 3.5)
    pieces = (b"1e999", b"-1", b"9" * 5000, b"\0", b"\xff", b'"', b"<", b"&x;", b"", b"<exists>")
    dice = random.Random(6)
    for _ in range(150):
        content = bytearray(whole)
        for _ in range(dice.choice((1, 1, 3))):
            at = dice.randrange(len(content))
            content[at : at + dice.choice((0, 1, 5, 50))] = dice.choice(pieces)
        path.write_bytes(content)
        try:
            read(path)
        except InputError as error:
            assert str(error).count("\n") == 0
            assert name in str(error)
