"""What the sensors of one demonstration felt: forces on a grid, readings at rest taken off.

The reading at rest is the median over the samples labelled ``still`` or, where there is none, over
the first tenth of a second.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.labels import Segments
from forcelab.recognition.examples import Labelled
from forcelab.signals.channels import channel_map
from forcelab.signals.grid import on_grid

__all__ = ["REST", "Felt", "felt", "within"]

Array = NDArray[np.float64]

#: The action during which nothing is touched.
REST = "still"
#: Edges of actions are coded to within some hundredths of a second; rest begins and ends by this
#: much later and earlier, s.
MARGIN = 0.05
#: Stretches shorter than this say nothing about a spectrum, s.
SHORTEST = 0.25


@dataclass(frozen=True)
class Felt:
    """One demonstration's forces on a uniform grid, with the readings at rest taken off.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Seconds.
    rate : float
        Hz.
    axes : ndarray, shape (n, s, 3)
        fx, fy and fz of each sensor, N.
    recorded : ndarray, shape (m, s, 3)
        The same as they are stored.
    segments : tuple of Segment
    """

    times: Array
    rate: float
    axes: Array
    recorded: Array
    segments: Segments

    @cached_property
    def normal(self) -> Array:
        """Magnitudes of the normal forces, shape (n, s), N."""
        return np.abs(self.axes[:, :, 2])

    @cached_property
    def tangential(self) -> Array:
        """Magnitudes of the tangential forces, shape (n, s), N."""
        return np.hypot(self.axes[:, :, 0], self.axes[:, :, 1])

    def during(self, action: str | None) -> NDArray[np.bool_]:
        """Which samples are labelled with an action, or with any but rest if None; shape (n,)."""
        return within(
            self.times,
            [
                (segment.start, segment.end)
                for segment in self.segments
                if (segment.action != REST if action is None else segment.action == action)
            ],
        )

    @cached_property
    def at_rest(self) -> list[Array]:
        """Forces of each stretch at rest, margins left out; shape (k, 3 s) each."""
        return self._stretches(
            [(s.start + MARGIN, s.end - MARGIN) for s in self.segments if s.action == REST]
        )

    @cached_property
    def in_action(self) -> list[Array]:
        """Forces of each stretch from leaving rest to coming back to it; shape (k, 3 s) each."""
        spans: list[tuple[float, float]] = []
        fresh = True
        for segment in self.segments:
            if segment.action != REST and fresh:
                spans.append((segment.start, segment.end))
            elif segment.action != REST:
                spans[-1] = (spans[-1][0], segment.end)
            fresh = segment.action == REST
        return self._stretches(spans)

    def _stretches(self, spans: Iterable[tuple[float, float]]) -> list[Array]:
        """The forces of those spans that are long enough for a spectrum."""
        flat = self.axes.reshape(len(self.times), -1)
        parts = [flat[within(self.times, [span])] for span in spans]
        return [part for part in parts if len(part) >= SHORTEST * self.rate]


def felt(item: Labelled) -> Felt:
    """Find the sensors, bring them onto a grid and take off what they read at rest.

    Parameters
    ----------
    item : Labelled
        With at least one segment.

    Raises
    ------
    InputError
        If there is no 3-axis force sensor or no segment.
    """
    title = item.demonstration.name
    channels = channel_map(item.demonstration.channels)
    sensors = [
        (*columns, *channels.columns[channels.names.index(name.replace("tangential", "normal", 1))])
        for name, columns in zip(channels.names, channels.columns, strict=True)
        if len(columns) == 2
    ]
    if not sensors:
        raise InputError(
            f"'{title}' has no 3-axis force sensor, such as channels fx1, fy1 and fz1."
        )
    if not item.segments:
        raise InputError(f"'{title}' has no labels; label it first.")
    wanted = [channels.recorded[column] for sensor in sensors for column in sensor]
    grid = on_grid(item.demonstration, columns=wanted)
    resting = within(grid.times, [(s.start, s.end) for s in item.segments if s.action == REST])
    if not resting.any():
        resting = grid.times < grid.times[0] + 0.1
    signals = grid.signals - np.median(grid.signals[resting], axis=0)
    shape = (-1, len(sensors), 3)
    recorded = item.demonstration.signals[:, wanted].reshape(shape)
    return Felt(grid.times, grid.rate, signals.reshape(shape), recorded, item.segments)


def within(times: Array, spans: Iterable[tuple[float, float]]) -> NDArray[np.bool_]:
    """Tell which times lie in any of the spans, their ends not included; shape (n,)."""
    inside = np.zeros(len(times), dtype=np.bool_)
    for start, end in spans:
        inside |= (times >= start) & (times < end)
    return inside
