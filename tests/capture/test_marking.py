"""Keys that are held down make a track."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.capture.assemble import AUTOREPEAT_SECONDS, LiveMarks


def told(marks, now, since=0.0):
    return [(s.action, s.start, s.end) for s in marks.track(now, since)]


def test_of_several_keys_the_last_one_counts_and_the_one_below_it_goes_on():
    marks = LiveMarks()
    marks.press("grab", True, 1.0)
    marks.press("pull", True, 2.0)
    marks.press("pull", False, 3.0)
    assert told(marks, 4.0) == [("grab", 1.0, 2.0), ("pull", 2.0, 3.0), ("grab", 3.0, 4.0)]
    marks.end(4.0)
    assert len(told(marks, 9.0)) == 3
    assert len(told(marks, 9.0, since=2.5)) == 2


@pytest.mark.parametrize("below", [(), ("grab",)])
def test_a_key_that_repeats_while_it_is_held_is_one_segment(below):
    marks = LiveMarks()
    for action in below:
        marks.press(action, True, 0.5)
    marks.press("hold", True, 1.0)
    for at in (1.6, 1.7):
        marks.press("hold", False, at)
        # However late the repeated press is heard, and however often it is looked meanwhile.
        seen = told(marks, at + 0.5)
        assert ("hold", 1.0, at) in seen
        assert seen[-1] == (("grab", at, at + 0.5) if below else ("hold", 1.0, at))
        marks.press("hold", True, at + 0.008)
    assert told(marks, 2.0)[-1] == ("hold", 1.0, 2.0)
    marks.end(2.0)
    assert [s for s in told(marks, 3.0) if s[0] == "hold"] == [("hold", 1.0, 2.0)]
    assert len(told(marks, 3.0)) == 1 + len(below)


def test_a_key_that_is_pressed_again_makes_another_segment():
    marks = LiveMarks()
    for start in (1.0, 1.5 + 2 * AUTOREPEAT_SECONDS):
        marks.press("hold", True, start)
        marks.press("hold", False, start + 0.5)
    marks.end(3.0)
    assert len(told(marks, 3.0)) == 2


@given(
    st.lists(st.tuples(st.sampled_from("abc"), st.booleans(), st.floats(0.0, 0.2)), max_size=30),
    st.floats(0.0, 0.2),
)
def test_the_track_is_in_order_and_does_not_depend_on_being_looked_at(keys, rest):
    looked, blind, now = LiveMarks(), LiveMarks(), 0.0
    for action, down, wait in keys:
        now += wait
        looked.track(now)
        for marks in (looked, blind):
            marks.press(action, down, now)
        looked.track(now)
    for marks in (looked, blind):
        marks.end(now + rest)
    assert looked.segments == blind.segments
    ends = [0.0, *(s.end for s in looked.segments)]
    assert all(s.start >= end for s, end in zip(looked.segments, ends, strict=False))
    assert all(
        (a.end, a.action) != (b.start, b.action)
        for a, b in zip(looked.segments, looked.segments[1:], strict=False)
    )
