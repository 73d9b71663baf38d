"""A lane tells how much its height is, and noise does not fill it."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import QRectF
from PySide6.QtGui import QImage, QPainter

from forcelab.demonstration import Channel
from forcelab.gui.capture.columns import Scale, least_span
from forcelab.gui.capture.live_scale import lane_marks, paint_scale
from forcelab.gui.figures.axes import Axis


@pytest.mark.parametrize(
    ("channel", "noise"),
    [(Channel("fz1", ""), 4.0), (Channel("fz1", "N"), 0.01), (Channel("fz", "mN"), 10.0)],
)
def test_noise_looks_like_noise_and_a_tap_fills_its_lane(channel, noise):
    scale = Scale(least_span(channel))
    scale.fit(-noise, noise, 0.0)
    assert 2 * noise < 0.15 * (scale.high - scale.low)
    tap = 200 * noise
    scale.fit(-tap, noise, 1.0)
    assert tap > 0.5 * (scale.high - scale.low)


@given(
    st.floats(-1e5, 1e5), st.floats(1e-3, 1e5), st.sampled_from([20.0, 50.0, 200.0]),
    st.sampled_from([8.0, 9.0]),
)  # fmt: skip
def test_at_least_two_values_stand_at_a_lane_inside_of_it(low, span, height, size):
    axis = Axis(low, low + span, height, 0.0)
    marks = lane_marks(axis, size)
    assert len(marks) >= 2
    assert len({said for _, said in marks}) == len(marks)
    spots = [axis.at(value) for value, _ in marks]
    assert all(-1e-3 <= y <= height + 1e-3 for y in spots)
    assert len(marks) == 2 or min(a - b for a, b in pairwise(spots)) >= size


def test_what_is_drawn_beside_the_values_keeps_its_font(app):
    image = QImage(200, 60, QImage.Format.Format_RGB32)
    painter = QPainter(image)
    before = painter.font()
    paint_scale(painter, QRectF(80, 0, 120, 60), Axis(-1.0, 1.0, 57.0, 3.0))
    assert painter.font() == before
    painter.end()
