from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PySide6.QtGui import QColor

from forcelab.demonstration import Channel
from forcelab.gui.label.force_axes import number_of
from forcelab.gui.label.force_curves import fill_columns
from forcelab.gui.label.force_lanes import axis_of, group_of, lanes, spanning


@pytest.mark.parametrize(
    ("name", "group"),
    [
        ("fx1", "1"),
        ("Fz 2", "2"),
        ("Fx_left", "left"),
        ("force z 12", "12"),
        ("x_acc", "acc"),
        ("tangential 1", "1"),
        ("temperature", ""),
        ("fz", ""),
    ],
)
def test_the_name_tells_the_sensor(name, group):
    assert group_of(name) == group


def test_channels_of_a_sensor_stand_together_and_hidden_ones_take_no_room():
    channels = [Channel(name, "N") for name in ("fx1", "fx2", "fy1", "fy2", "t")]
    found = lanes(channels, ["fx1", "fx2", "fy1", "t"], 200.0, overlaid=False)
    assert [channels[lane.channels[0]].name for lane in found] == ["fx1", "fy1", "fx2", "t"]
    assert found[0].top == 0.0
    assert found[-1].bottom == pytest.approx(200.0)
    assert len({round(lane.height, 6) for lane in found}) == 1
    for above, below in pairwise(found):
        assert (below.top > above.bottom) == (below.group != above.group)
    assert lanes(channels, [], 200.0, overlaid=False) == ()


@given(low=st.floats(allow_nan=False, allow_infinity=False), size=st.floats(0, 1e300))
@settings(max_examples=100, deadline=None)
def test_every_range_has_an_axis(low, size):
    (lane,) = lanes([Channel("f")], ["f"], 60.0, overlaid=False)
    axis = axis_of(lane, (low, min(low + size, 1.7e308)))
    assert axis.start < axis.end
    assert np.isfinite(axis.end - axis.start)
    assert lane.top < axis.finish < axis.begin < lane.bottom
    axis.marks(10.0, upright=True)


def test_the_span_of_nothing_is_none():
    assert spanning([None, None]) is None
    assert spanning([None, (1.0, 2.0), (-1.0, 0.0)]) == (-1.0, 2.0)


@pytest.mark.parametrize(
    ("value", "span", "shown"),
    [
        (None, 1.0, "\N{EN DASH}"),
        (-1.23456, 5.0, "\N{MINUS SIGN}1.235"),
        (-0.0001, 50.0, "0.00"),
        (0.00123, 0.002, "0.00123"),
        (5.00123, 0.02, "5.0012"),
        (12345.6, 20_000.0, "12346"),
        (-1.5e-7, 1e-6, "\N{MINUS SIGN}1.50e\N{MINUS SIGN}07"),
    ],
)
def test_values_have_the_decimals_that_their_axis_can_tell_apart(value, span, shown):
    assert number_of(value, span) == shown


@given(data=st.data())
@settings(max_examples=100, deadline=None)
def test_columns_are_covered_from_top_to_bottom(data):
    edge = st.floats(-30, 60) | st.just(float("nan")) | st.sampled_from([-1e300, 1e300])
    one, other = (np.array(data.draw(st.lists(edge, min_size=8, max_size=8))) for _ in range(2))
    top, bottom = np.minimum(one, other), np.maximum(one, other)
    image = np.zeros((20, 8), dtype=np.uint32)
    fill_columns(image, top, bottom, QColor(10, 200, 255))
    rows = np.arange(20)[:, np.newaxis]
    with np.errstate(invalid="ignore"):
        covered = np.minimum(bottom, rows + 1) - np.maximum(top, rows)
    covered = np.nan_to_num(np.clip(covered, 0, 1))
    assert np.abs((image >> 24) / 255 - covered).max() <= 1.01 / 255
    np.testing.assert_allclose((image & 255), image >> 24, atol=1)
