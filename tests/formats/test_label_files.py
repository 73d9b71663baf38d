"""Label files of other programs are told by content, and read as labels of a demonstration each."""

from __future__ import annotations

from importlib import import_module

import pytest

from forcelab.errors import InputError
from forcelab.formats.label_files import (
    LABEL_FORMATS,
    LabelOptions,
    LabelSet,
    own_stem,
    read_label_file,
)
from forcelab.formats.track_text import AnnotatedTrack, to_audacity, to_csv, to_statistics_table
from forcelab.labels import Segment, Track

ANN = Track("Ann", (Segment(0.5, 1.25, "grab"), Segment(1.25, 2.0, "hold, firmly")))
BEN = Track("Ben", (Segment(0.75, 1.5, "grab"),))


def test_names_are_unique_and_every_module_can_tell_and_read_its_format(tmp_path):
    names = [known.name for known in LABEL_FORMATS]
    assert len(set(names)) == len(names)
    for known in LABEL_FORMATS:
        module = import_module(known.module)
        assert module.sniff_labels(tmp_path / "a", b"\x00") is False
        assert callable(module.read_labels)


def test_our_csv_is_the_labels_of_the_demonstration_that_its_name_says(tmp_path):
    path = tmp_path / "pen-01.labels.csv"
    path.write_text(to_csv([ANN, BEN]))
    assert read_label_file(path) == [LabelSet("pen-01", (ANN, BEN))]


def test_a_label_track_of_audacity_is_by_the_author_of_the_options(tmp_path):
    path = tmp_path / "pen-01.txt"
    path.write_text(to_audacity(ANN))
    assert read_label_file(path, LabelOptions(author="Ann")) == [LabelSet("pen-01", (ANN,))]


def test_the_table_of_all_segments_is_a_set_for_each_demonstration_without_predictions(tmp_path):
    path = tmp_path / "lab.segments.csv"
    model = Track("model paper", (Segment(0.0, 1.0, "grab"),))
    rows = [
        AnnotatedTrack("01", "pen", 3.5, "coder", ANN, {ANN.segments[0]: "model paper 1"}),
        AnnotatedTrack("01", "pen", 3.5, "model", model),
        AnnotatedTrack("02", "", 4.0, "coder", BEN),
    ]
    path.write_text(to_statistics_table(rows))
    left_out = "1 segment that models predicted was left out."
    assert read_label_file(path) == [
        LabelSet("pen - 01", (ANN,), 3.5, (left_out,)),
        LabelSet("02", (BEN,), 4.0),
    ]


@pytest.mark.parametrize(
    ("name", "stem"),
    [
        ("a.labels.csv", "a"),
        ("a_labels.csv", "a"),
        ("a.segments.csv", "a"),
        ("a.b.txt", "a.b"),
        (".labels.csv", ".labels"),
    ],
)
def test_the_stem_of_a_label_file_is_that_of_its_recording(name, stem):
    assert own_stem(name) == stem


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "Dear all,\nno labels here\n",
            "is no file of labels, but looks like text; what can be read: ",
        ),
        ("start,end,action,author\n", "holds no label; there is nothing to import"),
        ("0.0\t2.0\tgrab\n1.0\t3.0\thold\n", "line 2: 'hold' starts at 1 s, before 'grab'"),
        (f"start,end,action\n0,1,{'a' * 1001}\n", "is no name for an action"),
        ("\x89PNG\r\n\x1a\n", "looks like "),
    ],
)
def test_what_is_no_label_file_is_one_sentence_that_names_it(tmp_path, text, sentence):
    path = tmp_path / "pen-01.txt"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError) as error:
        read_label_file(path)
    assert sentence in str(error.value)
    assert "pen-01.txt" in str(error.value)
    assert "\n" not in str(error.value)
