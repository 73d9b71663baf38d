from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.formats.calibration import read_calibrations
from forcelab.label_map import MergeMap
from forcelab.labels import Segment

names = st.text(min_size=1, max_size=6).filter(str.strip)
SPELLINGS = MergeMap({"grap_pen": "grab", "grab_soft": "grab", "slip_pen": "slip"})


def meant(merges, action):
    (segment,) = merges.apply_segments([Segment(0, 1, action)])
    return segment.action


def test_merging_brings_spellings_together_and_leaves_the_rest():
    assert meant(SPELLINGS, "grap_pen") == meant(SPELLINGS, "grab_soft") == "grab"
    assert meant(SPELLINGS, "hold") == "hold"
    assert meant(MergeMap(), "grap_pen") == "grap_pen"
    assert meant(MergeMap({"grap": "grab", "grab": "grab"}), "grap") == "grab"


def test_spellings_that_do_not_occur_are_told():
    assert SPELLINGS.unused(["grap_pen", "slip", "slip_pen"]) == ("grab_soft",)
    assert SPELLINGS.unused([]) == ("grab_soft", "grap_pen", "slip_pen")
    assert SPELLINGS.unused(iter(["grap_pen", "slip_pen", "grab_soft"])) == ()
    assert MergeMap().unused(["grab"]) == ()


def test_merging_relabels_segments_and_moves_no_edge():
    segments = (Segment(0, 1, "grap_pen"), Segment(1, 2, "grab_soft"), Segment(3, 4, "hold"))
    merged = (Segment(0, 1, "grab"), Segment(1, 2, "grab"), Segment(3, 4, "hold"))
    assert SPELLINGS.apply_segments(segments) == merged
    assert MergeMap().apply_segments(segments) == segments


@given(st.dictionaries(names, names, max_size=6), names)
def test_a_map_that_is_accepted_does_the_same_when_applied_twice(targets, action):
    try:
        merges = MergeMap(targets)
    except InputError:
        assert any(targets.get(end, end) != end for end in targets.values())
        return
    for name in (*targets, action):
        assert meant(merges, meant(merges, name)) == meant(merges, name) == targets.get(name, name)
    assert MergeMap.from_json(json.loads(json.dumps(merges.to_json()))) == merges
    assert dict(merges.items()) == targets


def test_maps_are_equal_whatever_order_they_were_written_in():
    backwards = MergeMap(dict(reversed(SPELLINGS.items())))
    assert backwards == SPELLINGS
    assert hash(backwards) == hash(SPELLINGS)
    assert list(backwards.to_json()) == sorted(backwards.to_json())


@pytest.mark.parametrize(
    ("targets", "sentence"),
    [
        ({"a": "b", "b": "c"}, "'a' is merged into 'b', but 'b' itself into 'c'"),
        ({"a": "b", "b": "a"}, "merge each action straight into its last name"),
        ({"a": " "}, "needs two names"),
        ({"": "a"}, "needs two names"),
        ({"a": 1}, "merge of 'a' must name an action"),
        ({"a": None}, "merge of 'a' must name an action"),
        (["a", "b"], "must be an object of strings"),
    ],
)
def test_what_is_no_merge_map_is_refused_with_a_sentence(targets, sentence):
    with pytest.raises(InputError, match=sentence):
        MergeMap.from_json(targets)


@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_a_map_is_read_from_a_file_with_or_without_a_byte_order_mark(tmp_path, mark):
    path = tmp_path / "merge.json"
    text = mark + '{"grap_pen": "grab",\n "löslassen": "release"}'
    path.write_text(text, encoding="utf-8")
    assert MergeMap.read(path) == MergeMap({"grap_pen": "grab", "löslassen": "release"})


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "is not JSON: .* in line 1"),
        (b'{"a": "b",\n"c"}', "is not JSON: .* in line 2"),
        (b'{"a": "b", "a": "c"}', "'a' is merged twice"),
        (b'["a"]', "must be an object of strings"),
        (b'{"a": {"b": "c"}}', "must name an action"),
        (b'{"a": "b", "b": "c"}', "itself into 'c'"),
        (b"\xff\xfe\x00{", "is not a text of JSON"),
        (b"[" * 100_000, "is not a text of JSON"),
        (b"9" * 5_000, "is not a text of JSON|must be an object of strings"),
    ],
)
def test_a_broken_file_is_refused_with_a_sentence_that_names_it(tmp_path, content, sentence):
    path = tmp_path / "merge.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match=sentence) as caught:
        MergeMap.read(path)
    assert str(path) in str(caught.value)
    assert str(caught.value).endswith(".")


def test_a_file_that_is_not_there_is_refused_with_a_sentence(tmp_path):
    with pytest.raises(InputError, match=r"absent\.json cannot be read: No such file"):
        MergeMap.read(tmp_path / "absent.json")


def test_no_action_is_merged_into_none(tmp_path):
    path = tmp_path / "map.json"
    path.write_text('{"grab": "unlabelled"}')
    with pytest.raises(InputError, match="map.json: An action cannot be called 'unlabelled'"):
        MergeMap.read(path)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there is no device that never ends")
def test_what_never_ends_is_refused():
    with pytest.raises(InputError, match="'/dev/zero' is longer than 16 MB"):
        MergeMap.read(Path("/dev/zero"))
    with pytest.raises(InputError, match="'/dev/zero' is longer than 16 MB"):
        read_calibrations(Path("/dev/zero"))
