"""What lies under the pointer."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.gui.label.track_gestures import Hit, gap_at, hit, index_at
from forcelab.labels import Segment

TRACK = (Segment(1.0, 2.0, "grab"), Segment(2.0, 3.0, "hold"), Segment(5.0, 6.0, "release"))
PIXEL = 0.01


@pytest.mark.parametrize(
    ("time", "found"),
    [
        (0.5, Hit()),
        (0.96, Hit(0, "start")),
        (1.04, Hit(0, "start", inside=True)),
        (1.5, Hit(0, None, inside=True)),
        (1.96, Hit(0, "end", inside=True)),
        (2.04, Hit(1, "start", inside=True)),
        (3.04, Hit(1, "end")),
        (4.0, Hit()),
        (4.96, Hit(2, "start")),
        (6.04, Hit(2, "end")),
        (6.06, Hit()),
    ],
)
def test_edges_are_grabbed_from_five_pixels_on_either_side(time, found):
    assert hit(TRACK, time, PIXEL) == found


def test_the_middle_third_of_a_narrow_segment_is_its_body():
    narrow = (Segment(1.0, 1.06, "grab"),)  # six pixels
    assert hit(narrow, 1.015, PIXEL).edge == "start"
    assert hit(narrow, 1.03, PIXEL) == Hit(0, None, inside=True)
    assert hit(narrow, 1.045, PIXEL).edge == "end"


def test_a_segment_below_a_pixel_is_hit_between_wide_neighbours():
    track = (Segment(1.0, 2.0, "a"), Segment(2.0, 2.001, "b"), Segment(2.001, 3.0, "a"))
    assert hit(track, 1.995, PIXEL) == Hit(1, None, inside=True)
    assert hit(track, 2.01, PIXEL) == Hit(1, None, inside=True)
    assert hit(track, 1.98, PIXEL) == Hit(0, "end", inside=True)


def test_a_narrow_gap_can_be_hit_in_its_middle():
    track = (Segment(1.0, 2.0, "a"), Segment(2.03, 3.0, "b"))
    assert hit(track, 2.015, PIXEL) == Hit()


def test_index_and_gap():
    assert [index_at(TRACK, t) for t in (0.9, 1.0, 2.0, 2.999, 3.0)] == [None, 0, 1, 1, None]
    assert gap_at(TRACK, 4.0) == (3.0, 5.0)
    assert gap_at(TRACK, 0.5) is None
    assert gap_at(TRACK, 7.0) is None
    assert gap_at((), 1.0) is None


@given(
    st.lists(st.floats(0.0, 10.0), min_size=2, max_size=40, unique=True),
    st.floats(-1.0, 11.0),
    st.floats(1e-4, 0.5),
)
def test_a_hit_is_always_near_what_it_names(cuts, time, pixel):
    cuts = sorted(cuts)
    pairs = [(a, b) for a, b in zip(cuts[::2], cuts[1::2], strict=False) if b > a]
    track = tuple(Segment(a, b, "x") for a, b in pairs)
    found = hit(track, time, pixel)
    covered = [i for i, (a, b) in enumerate(pairs) if a <= time < b]
    if found.index is None:
        assert not covered
        return
    segment = track[found.index]
    if found.edge is not None:
        assert abs(getattr(segment, found.edge) - time) <= 5 * pixel + 1e-9
    elif covered:
        close = abs((segment.start + segment.end) / 2 - time) <= pixel + 1e-9
        assert found.index == covered[0] or close
