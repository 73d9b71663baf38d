"""Which time a pointer means."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.gui.document import Snap
from forcelab.gui.label.track_gestures import SnapTargets, is_on_target, round_to_sample, snap
from forcelab.labels import Segment

SAMPLES = np.arange(1000) / 100


def targets(**more):
    return SnapTargets(samples=SAMPLES, period=0.01, **more)


def test_a_contact_event_wins_over_a_nearer_frame():
    there = targets(contacts=np.array([2.0]), frames=np.array([2.05]))
    # 100 px/s: the pointer at 2.06 s is 1 px from the frame and 6 px from the event.
    assert snap(2.06, 100, there) == Snap(2.0, "contact")


def test_the_nearer_of_edge_and_contact_event_wins():
    there = targets(contacts=np.array([2.0]), tracks=((Segment(1.0, 2.07, "grab"),),))
    assert snap(2.06, 100, there) == Snap(2.07, "edge")
    assert snap(2.02, 100, there) == Snap(2.0, "contact")


def test_a_frame_wins_over_a_nearer_sample():
    there = targets(frames=np.array([2.035]))
    assert snap(2.041, 1000, there) == Snap(2.035, "frame")


@pytest.mark.parametrize(("scale", "kind"), [(399.0, None), (400.0, "sample")])
def test_samples_are_offered_from_four_pixels_apart_on(scale, kind):
    found = snap(2.001, scale, targets())
    assert (found.kind if found else None) == kind


def test_reach_is_eight_pixels():
    there = targets(contacts=np.array([2.0]))
    assert snap(2.0799, 100, there) == Snap(2.0, "contact")
    assert snap(2.081, 100, there) is None


def test_what_is_being_moved_does_not_attract_itself():
    track = (Segment(1.0, 2.0, "grab"), Segment(2.0, 3.0, "hold"))
    assert snap(2.01, 100, targets(tracks=(track,)), exclude=(2.0,)) is None


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
    there = targets(contacts=events, frames=frames, tracks=(track,), marks=(9.9999,))
    for time in (2.0044, 2.0351, 2.0712, 9.9999, 3.0, 3.0 + 1e-12):
        assert is_on_target(time, there), time
    for time in (2.0045, 2.0352, 2.0711, 9.9998, 3.0 + 1e-6):
        assert not is_on_target(time, there), time
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
    there = targets(contacts=contacts, frames=frames, tracks=(track,))
    found = snap(time, scale, there, exclude=exclude)

    def near(values):
        return [v for v in values if abs(v - time) <= 8 / scale and v not in exclude]

    events = near([*contacts, *(t for pair in pairs for t in pair)])
    wanted = events or near(frames) or (near(SAMPLES) if 0.01 * scale >= 4 else [])
    if not wanted:
        assert found is None
    else:
        assert abs(found.time - time) == min(abs(v - time) for v in wanted)
        assert found.time in wanted


@given(times)
def test_rounding_moves_by_half_a_sample_at_most_and_is_done_once(time):
    there = targets(marks=(0.0, 10.0))
    once = round_to_sample(time, there)
    assert abs(once - time) <= 0.005 + 1e-12
    assert round_to_sample(once, there) == once
