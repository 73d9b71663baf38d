from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor, QPainter, QPicture

from forcelab.demonstration import Channel
from forcelab.gui.figures import text
from forcelab.gui.kit.plot import PlotView
from forcelab.gui.kit.traces import fill_columns
from forcelab.gui.label.lanes import (
    LaneAxis,
    axis_of,
    group_of,
    lanes,
    number_format,
    paint_groups,
    spanning,
)


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
    heights = [lane.height for lane in found]
    assert max(heights) - min(heights) <= 1  # of whole pixels
    for above, below in pairwise(found):
        assert (below.top > above.bottom) == (below.group != above.group)
    assert lanes(channels, [], 200.0, overlaid=False) == ()


@pytest.mark.parametrize(
    ("channels", "name"), [("lr", "sensor l"), ("12", "sensor 1"), (("left", "right"), "left")]
)
def test_a_letter_alone_is_named_as_a_sensor(app, monkeypatch, channels, name):
    drawn = []
    monkeypatch.setattr(text, "draw_text_upwards", lambda *args, **_: drawn.append(args[3]))
    found = [Channel(f"F{axis}_{sensor}") for sensor in channels for axis in "xyz"]
    shown = lanes(found, [channel.name for channel in found], 600.0, overlaid=False)
    picture = QPicture()
    with QPainter(picture) as painter:
        paint_groups(painter, shown)
    assert drawn[0] == name


@given(low=st.floats(allow_nan=False, allow_infinity=False), size=st.floats(0, 1e300))
@settings(max_examples=100, deadline=None)
def test_every_range_has_an_axis(low, size):
    (lane,) = lanes([Channel("f")], ["f"], 60.0, overlaid=False)
    axis = axis_of(lane, (low, min(low + size, 1.7e308)))
    assert axis.start < axis.end
    assert np.isfinite(axis.end - axis.start)
    assert lane.top < axis.finish < axis.begin < lane.bottom


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
        (1e16, 20.0, "1.00e+16"),  # a glitch
    ],
)
def test_values_have_the_decimals_that_their_axis_can_tell_apart(value, span, shown):
    assert number_format(value, span) == shown


@given(data=st.data())
@settings(max_examples=100, deadline=None)
def test_columns_are_covered_from_top_to_bottom(data):
    edge = st.floats(-30, 60) | st.just(float("nan")) | st.sampled_from([-1e300, 1e300])
    first, second = (np.array(data.draw(st.lists(edge, min_size=8, max_size=8))) for _ in range(2))
    top, bottom = np.minimum(first, second), np.maximum(first, second)
    image = np.zeros((20, 8), dtype=np.uint32)
    fill_columns(image, top, bottom, QColor(10, 200, 255))
    rows = np.arange(20)[:, np.newaxis]
    with np.errstate(invalid="ignore"):
        covered = np.minimum(bottom, rows + 1) - np.maximum(top, rows)
    covered = np.nan_to_num(np.clip(covered, 0, 1))
    assert np.abs((image >> 24) / 255 - covered).max() <= 1.01 / 255
    np.testing.assert_allclose((image & 255), image >> 24, atol=1)


@pytest.mark.parametrize("height", [30, 40, 60, 200])
def test_numbers_of_a_lane_stand_inside_of_it_and_on_no_name(app, height):
    channels = [Channel("fy1", "N"), Channel("fz1", "N")]
    for lane, low, high in zip(
        lanes(channels, ["fy1", "fz1"], height, overlaid=False), (-2, -12), (12, 2), strict=True
    ):
        view, axis = PlotView(), LaneAxis(88.0, dict)
        view.addItem(axis)
        axis.show_lane(lane, channels)
        axis.setRange(low, high)
        picture = QPicture()
        painter = QPainter(picture)
        _, _, numbers = axis.generateDrawSpecs(painter)
        painter.end()
        inside = QRectF(0, 0, 88, lane.height)
        assert all(inside.contains(box) for box, *_ in numbers)
        names = [box for *_, box in axis.texts({})]
        assert not any(box.intersects(name) for box, *_ in numbers for name in names)
        assert len(numbers) >= 1 or height < 60
