import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis, LogAxis, labels, ticks


def test_ticks_are_the_multiples_in_the_range():
    assert ticks(-0.4, 1.0, 0.5) == (0.0, 0.5, 1.0)
    assert ticks(0.0, 0.3, 0.1) == pytest.approx((0.0, 0.1, 0.2, 0.3))


def test_labels_have_the_decimals_that_the_step_needs():
    assert labels((-0.25, 0.0, 0.25), 0.05) == ("\N{MINUS SIGN}0.25", "0.00", "0.25")
    assert labels((0.0, 20.0), 20.0) == ("0", "20")
    assert labels((-0.0, 0.001), 0.001) == ("0.000", "0.001")


@given(
    start=st.floats(-1e6, 1e6),
    span=st.floats(1e-3, 1e7),
    room=st.floats(60, 2000),
    upright=st.booleans(),
)
@settings(max_examples=100, deadline=None)
def test_numbers_at_an_axis_never_overlap_and_tell_the_truth(start, span, room, upright):
    axis = Axis(start, start + span, 10.0, 10.0 + room)
    marks = axis.marks(upright=upright)
    face = text.font(10.0)
    needs = [10.0 if upright else text.width(label, face) for _, label in marks]
    spots = [axis.at(value) for value, _ in marks]
    for i in range(len(marks) - 1):
        assert spots[i] + needs[i] / 2 < spots[i + 1] - needs[i + 1] / 2
    for value, label in marks:
        assert float(label.replace("\N{MINUS SIGN}", "-")) == pytest.approx(value, abs=1e-6 * span)
        assert 10.0 - 0.01 <= axis.at(value) <= 10.01 + room
    if room > 400:
        assert len(marks) >= 2


@pytest.mark.parametrize("span", [(0.0, 0.9), (-3.3, 0.1), (-0.05, 0.78)])
def test_on_an_axis_as_low_as_a_force_among_six_two_numbers_tell_the_scale(span):
    assert len(Axis(*span, 40.0, 2.0).marks(upright=True)) == 2


@given(low=st.floats(1e-3, 1e3), octaves=st.floats(0.5, 40), room=st.floats(60, 800))
@settings(max_examples=60, deadline=None)
def test_numbers_at_a_logarithmic_axis_never_overlap(low, octaves, room):
    axis = LogAxis(low, low * 2**octaves, 500.0, 500.0 - room)
    spots = [axis.at(value) for value, _ in axis.marks(upright=True)]
    assert all(a - b >= 10.0 for a, b in pairwise(spots))


def test_octaves_are_equally_far_apart_on_a_logarithmic_axis():
    axis = LogAxis(1.0, 16.0, 100.0, 20.0)
    assert [axis.at(2.0**i) for i in range(5)] == pytest.approx([100, 80, 60, 40, 20])
    assert math.isclose(Axis(0, 4, 100.0, 20.0).at(1.0), 80.0)
