"""A lane tells how much its height is, noise does not fill it, and no extreme is lost in it."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.demonstration import Channel
from forcelab.gui.capture.live_plot import (
    LaneScale,
    lane_ticks,
    pixel_columns,
    smallest_span,
)
from forcelab.gui.figures.axes import NUMBER, Axis, labels
from forcelab.gui.kit.plot import PlotView
from forcelab.gui.label.lanes import span_of
from forcelab.signals.minmax import Extremes


@pytest.mark.parametrize(
    ("channel", "noise"),
    [(Channel("fz1", ""), 4.0), (Channel("fz1", "N"), 0.01), (Channel("fz", "mN"), 10.0)],
)
def test_noise_looks_like_noise_and_a_tap_fills_its_lane(channel, noise):
    scale = LaneScale(smallest_span(channel))
    scale.fit(-noise, noise, 0.0)
    assert 2 * noise < 0.15 * (scale.high - scale.low)
    tap = 200 * noise
    scale.fit(-tap, noise, 1.0)
    assert tap > 0.5 * (scale.high - scale.low)


@given(
    st.floats(-1e5, 1e5), st.floats(1e-3, 1e5), st.sampled_from([20.0, 24.0, 50.0, 200.0])
)  # fmt: skip
def test_at_least_two_values_stand_at_a_lane_inside_of_it(low, span, height):
    step, values = lane_ticks(low, low + span, height)
    assert len(values) >= 2
    assert len(set(labels(values, step))) == len(values)
    axis = Axis(low, low + span, height, 0.0)
    spots = [axis.at(value) for value in values]
    assert all(-1e-3 <= y <= height + 1e-3 for y in spots)
    assert min(a - b for a, b in pairwise(spots)) >= min(NUMBER, 0.75 * height)


def test_columns_have_every_extreme_and_leave_gaps_open():
    times = np.r_[0:1:0.001, 2:3:0.001]
    values = np.random.default_rng(0).normal(size=(len(times), 2))
    edges = np.linspace(-0.5, 3.5, 81)
    extremes = pixel_columns(times, values, edges)
    low, high = extremes.low, extremes.high
    for column in range(80):
        inside = (times >= edges[column]) & (times < edges[column + 1])
        if not inside.any():
            assert np.isnan(low[column]).all()
            continue
        assert (low[column] <= values[inside].min(axis=0)).all()
        assert (high[column] >= values[inside].max(axis=0)).all()
    np.testing.assert_array_equal(np.nanmin(low, axis=0), values.min(axis=0))
    held = pixel_columns(np.array([0.22]), np.array([[7.0]]), edges, holds=True).low
    assert np.isnan(held[:14]).all()
    assert (held[14:] == 7.0).all()


def test_a_lane_grows_at_once_and_shrinks_late():
    scale = LaneScale()
    scale.fit(0.0, 10.0, 0.0)
    assert scale.low < 0.0
    assert scale.high > 10.0
    scale.fit(-5.0, 20.0, 0.1)
    assert scale.high > 20.0
    scale.fit(0.0, 1.0, 0.2)
    assert scale.high > 20.0
    scale.fit(0.0, 1.0, 5.0)
    assert scale.high < 2.0


@pytest.mark.parametrize("values", [(0.5, np.inf, 1.0), (-np.inf, 0.5, 1.0), (0.5, 1e308, -1e308)])
def test_a_value_that_no_axis_can_reach_leaves_the_lane_an_axis(app, values):
    times, view, scale = np.array([0.1, 1.1, 2.1]), PlotView(), LaneScale()
    found = pixel_columns(times, np.array([values]).T, np.linspace(0.0, 3.0, 7))
    scale.fit(*span_of(Extremes(found.low[:, 0], found.high[:, 0])), 3.0)
    view.add_box().setYRange(scale.low, scale.high, padding=0)
    assert -np.inf < scale.low < 0.5 < scale.high < np.inf
    view.deleteLater()
