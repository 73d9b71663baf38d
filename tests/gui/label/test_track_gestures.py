"""Snapping of times, and what lies under the pointer."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.gui.label.track_gestures import (
    Hit,
    SnapTargets,
    hit,
    is_on_target,
    round_to_sample,
    snap,
)
from forcelab.gui.view_state import Snap
from forcelab.labels import Segment

SAMPLES = np.arange(1000) / 100


def targets(**more):
    return SnapTargets(samples=SAMPLES, period=0.01, **more)


def test_the_nearer_of_edge_and_contact_event_wins():
    available = targets(contacts=np.array([2.0]), tracks=((Segment(1.0, 2.07, "grab"),),))
    assert snap(2.06, 100, available) == Snap(2.07, "edge")
    assert snap(2.02, 100, available) == Snap(2.0, "contact")


def test_a_frame_wins_over_a_nearer_sample():
    available = targets(frames=np.array([2.035]))
    assert snap(2.041, 1000, available) == Snap(2.035, "frame")


@pytest.mark.parametrize(("scale", "kind"), [(399.0, None), (400.0, "sample")])
def test_samples_are_offered_from_four_pixels_apart_on(scale, kind):
    target = snap(2.001, scale, targets())
    assert (target.kind if target else None) == kind


def test_the_start_and_end_of_the_demonstration_are_edges():
    assert snap(9.97, 100, targets(marks=(0.0, 10.0))) == Snap(10.0, "edge")


def test_an_empty_document_offers_nothing():
    assert snap(0.5, 1e6, SnapTargets(samples=np.empty(0))) is None
    assert round_to_sample(0.5, SnapTargets(samples=np.empty(0))) == 0.5


def test_a_time_that_snaps_to_nothing_is_rounded_to_its_sample():
    assert round_to_sample(2.0049, targets()) == 2.0
    assert round_to_sample(2.0051, targets()) == 2.01
    assert round_to_sample(9.996, targets(marks=(0.0, 10.0))) == 10.0


def test_a_time_of_an_event_an_edge_a_frame_or_a_sample_is_on_target():
    track = (Segment(1.0, 2.0712, "grab"),)
    events, frames = np.array([2.0044]), np.array([2.0351])
    available = targets(contacts=events, frames=frames, tracks=(track,), marks=(9.9999,))
    for time in (2.0044, 2.0351, 2.0712, 9.9999, 3.0, 3.0 + 1e-12):
        assert is_on_target(time, available), time
    for time in (2.0045, 2.0352, 2.0711, 9.9998, 3.0 + 1e-6):
        assert not is_on_target(time, available), time
    assert not is_on_target(0.5, SnapTargets(samples=np.empty(0)))


def test_in_a_gap_of_the_recording_a_time_stays():
    gap = SnapTargets(samples=np.array([0.0, 0.01, 0.02, 5.0, 5.01]), period=0.01)
    assert round_to_sample(3.0, gap) == 3.0


times = st.floats(0.0, 10.0)
sorted_times = st.lists(times, max_size=30, unique=True).map(lambda xs: np.array(sorted(xs)))


@given(times, st.floats(10.0, 1e4), sorted_times, sorted_times, sorted_times, st.integers(0, 2))
def test_it_is_the_nearest_of_the_best_kind_in_reach(time, scale, contacts, frames, cuts, left):
    pairs = cuts[: len(cuts) // 2 * 2].reshape(-1, 2).tolist()
    track = tuple(Segment(a, b, "grab") for a, b in pairs)
    exclude = set(cuts[:left].tolist())
    available = targets(contacts=contacts, frames=frames, tracks=(track,))
    target = snap(time, scale, available, exclude=exclude)

    def near(values):
        return [v for v in values if abs(v - time) <= 8 / scale and v not in exclude]

    kinds = {
        "contact": [*contacts, *(t for pair in pairs for t in pair)],
        "frame": frames,
        "sample": SAMPLES if 0.01 * scale >= 4 else [],
    }
    reached = [(kind, near(values)) for kind, values in kinds.items() if near(values)]
    if not reached:
        assert target is None
    else:
        kind, expected = reached[0]
        assert target.kind.replace("edge", "contact") == kind
        assert abs(target.time - time) == min(abs(v - time) for v in expected)
        assert target.time in expected


@given(times)
def test_rounding_moves_by_half_a_sample_at_most_and_is_done_once(time):
    available = targets(marks=(0.0, 10.0))
    once = round_to_sample(time, available)
    assert abs(once - time) <= 0.005 + 1e-12
    assert round_to_sample(once, available) == once


TRACK = (Segment(1.0, 2.0, "grab"), Segment(2.0, 3.0, "hold"), Segment(5.0, 6.0, "release"))
PIXEL = 0.01


@pytest.mark.parametrize(
    ("time", "target"),
    [
        (0.5, Hit()),
        (0.96, Hit()),
        (1.04, Hit(0, "start")),
        (1.5, Hit(0, None)),
        (1.96, Hit(0, "end")),
        (2.04, Hit(1, "start")),
        (2.96, Hit(1, "end")),
        (3.04, Hit()),
        (4.0, Hit()),
        (4.96, Hit()),
        (5.94, Hit(2, None)),
        (5.96, Hit(2, "end")),
        (6.04, Hit()),
    ],
)
def test_edges_are_grabbed_from_five_pixels_within_their_segments(time, target):
    assert hit(TRACK, time, PIXEL) == target


def test_the_middle_third_of_a_narrow_segment_is_its_body():
    narrow = (Segment(1.0, 1.06, "grab"),)  # six pixels
    assert hit(narrow, 1.015, PIXEL).edge == "start"
    assert hit(narrow, 1.03, PIXEL) == Hit(0, None)
    assert hit(narrow, 1.045, PIXEL).edge == "end"


def test_a_segment_below_a_pixel_is_hit_between_wide_neighbours():
    track = (Segment(1.0, 2.0, "a"), Segment(2.0, 2.001, "b"), Segment(2.001, 3.0, "a"))
    assert hit(track, 1.995, PIXEL) == Hit(1, None)
    assert hit(track, 2.01, PIXEL) == Hit(1, None)
    assert hit(track, 1.98, PIXEL) == Hit(0, "end")


@given(
    st.lists(st.floats(0.0, 10.0), min_size=2, max_size=40, unique=True),
    st.floats(-1.0, 11.0),
    st.floats(1e-4, 0.5),
)
def test_a_hit_is_always_near_what_it_names(cuts, time, pixel):
    cuts = sorted(cuts)
    pairs = [(a, b) for a, b in zip(cuts[::2], cuts[1::2], strict=False) if b > a]
    track = tuple(Segment(a, b, "x") for a, b in pairs)
    target = hit(track, time, pixel)
    covered = [i for i, (a, b) in enumerate(pairs) if a <= time < b]
    if target.index is None:
        assert not covered
        return
    segment = track[target.index]
    if target.edge is not None:
        assert abs(getattr(segment, target.edge) - time) <= 5 * pixel + 1e-9
    elif covered:
        close = abs((segment.start + segment.end) / 2 - time) <= pixel + 1e-9
        assert target.index == covered[0] or close
