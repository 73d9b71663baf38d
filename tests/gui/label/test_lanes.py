from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor, QImage, QPainter

from forcelab.demonstration import Channel
from forcelab.gui.figures.axes import Axis
from forcelab.gui.label import lanes as lanes_module
from forcelab.gui.label.lanes import (
    Curve,
    CurveCanvas,
    axis_of,
    fill_columns,
    group_of,
    lanes,
    spanning,
)
from forcelab.gui.label.traces import number_format
from forcelab.gui.theme import LIGHT
from forcelab.signals.minmax import Extremes


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
    fill_columns(image, top[np.newaxis], bottom[np.newaxis], [QColor(10, 200, 255)], [(0, 20)])
    rows = np.arange(20)[:, np.newaxis]
    with np.errstate(invalid="ignore"):
        covered = np.minimum(bottom, rows + 1) - np.maximum(top, rows)
    covered = np.nan_to_num(np.clip(covered, 0, 1))
    assert np.abs((image >> 24) / 255 - covered).max() <= 1.01 / 255
    np.testing.assert_allclose((image & 255), image >> 24, atol=1)


def test_curves_drawn_at_once_are_those_drawn_one_by_one(app):
    random = np.random.default_rng(3)
    plot, boxes = QRectF(10, 0, 120, 90), [(0.0, 30.3), (30.3, 60.6), (60.6, 90.0)]
    curves = []
    for i, thick in enumerate((0.0, 0.4, 5.0, 0.1, 2.0)):  # of some lanes there are two
        low = np.cumsum(random.normal(size=120)) * 0.3
        low[random.random(120) < 0.1] = np.nan
        box = boxes[i % 3]
        axis = Axis(-3.0, 3.0, box[1] - 2, box[0] + 2)
        colour = QColor(("#0072b2", "#e69f00", "#009e73")[i % 3])
        curves.append(Curve(Extremes(low, low + thick), axis, colour, box))
    for ratio in (1.0, 2.0):
        at_once, one_by_one = CurveCanvas(plot, ratio), CurveCanvas(plot, ratio)
        if ratio == 2.0:
            curves = [
                c._replace(
                    extremes=Extremes(np.repeat(c.extremes.low, 2), np.repeat(c.extremes.high, 2))
                )
                for c in curves
            ]
        at_once.draw(curves)
        for curve in curves:
            one_by_one.draw([curve])
        assert np.array_equal(at_once.pixels, one_by_one.pixels)
        assert at_once.pixels.any()


def test_a_canvas_that_is_used_again_is_empty(app):
    plot = QRectF(10, 0, 50, 30)
    canvas = CurveCanvas(plot, 1.0)
    low = np.zeros(50)
    axis = Axis(-1.0, 1.0, 28.0, 2.0)
    canvas.draw([Curve(Extremes(low, low + 0.5), axis, QColor("red"), (0.0, 30.0))])
    assert canvas.cleared(plot, 1.0) is canvas
    assert not canvas.pixels.any()
    assert canvas.cleared(QRectF(10, 0, 51, 30), 1.0) is not canvas


def test_numbers_of_neighbouring_axes_do_not_run_into_each_other(app, monkeypatch):
    written = []
    monkeypatch.setattr(lanes_module.text, "draw_text", lambda *args, **_: written.append(args[2:]))
    above, below = lanes(
        [Channel("fy1", "N"), Channel("fz1", "N")], ["fy1", "fz1"], 40.0, overlaid=False
    )
    picture = QImage(100, 40, QImage.Format.Format_RGB32)
    painter = QPainter(picture)
    for lane, low, high in ((above, -2.0, 12.0), (below, -12.0, 2.0)):
        lanes_module.paint_axis(
            painter, lane, Axis(low, high, lane.bottom, lane.top), 80.0, (), LIGHT
        )
    painter.end()
    zeros = sorted(y for y, label in written if label == "0")
    assert len(zeros) == 2
    assert zeros[1] - zeros[0] >= lanes_module.NUMBER
