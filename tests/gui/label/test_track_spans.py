import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from forcelab.gui.label.track_spans import track_spans
from forcelab.labels import Segment


def track(count, shift=0.0):
    return tuple(
        Segment(i + shift, i + shift + 0.5, ("grab", "hold", "pull")[i % 3]) for i in range(count)
    )


def agree(segments):
    spans = track_spans(segments)
    assert spans.starts.tolist() == [segment.start for segment in segments]
    assert spans.ends.tolist() == [segment.end for segment in segments]
    assert [spans.names[code] for code in spans.codes] == [s.action for s in segments]
    assert np.isclose(spans.seconds, sum(s.duration for s in segments))
    for name, (count, seconds) in spans.totals().items():
        alike = [s.duration for s in segments if s.action == name]
        assert count == len(alike)
        assert np.isclose(seconds, sum(alike))
    assert set(spans.totals()) == {s.action for s in segments}


@given(st.lists(st.tuples(st.integers(0, 150), st.integers(0, 5), st.booleans()), max_size=12))
def test_arrays_follow_a_track_through_strokes(strokes):
    segments = track(150)
    agree(segments)
    for place, removed, painted in strokes:
        at = min(place, len(segments))
        new = (Segment(place + 0.6, place + 0.7, "new"),) if painted else ()
        segments = segments[:at] + new + segments[at + removed :]
        agree(segments)


def test_other_tracks_and_none_are_read_by_themselves():
    for segments in (track(5), (), track(5, 100.0), track(2000), track(5)):
        agree(segments)


def test_a_track_that_is_known_is_not_read_again():
    segments = track(50)
    assert track_spans(segments) is track_spans(segments)
