"""How the channels share the height of the panel: lanes, what they belong to, their scales."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from forcelab.demonstration import Channel
from forcelab.gui.figures.axes import Axis
from forcelab.signals.minmax import Extremes

__all__ = ["Lane", "axis_of", "group_of", "lanes", "span_of", "spanning"]

#: Names such as fx1, Fx_left, force z 2; and such as x_acc.
_AXIS_LAST = re.compile(r"^(?P<kind>[a-z]+?)[ _.\-]?[xyz](?:[ _.\-]?(?P<sensor>\w+))?$", re.I)
_AXIS_FIRST = re.compile(r"^[xyz][ _.\-](?P<sensor>\w+)$", re.I)
_NUMBERED = re.compile(r"^.*\D[ _.\-]?(?P<sensor>\d+)$")

#: Free pixels above and below a curve in its lane, and between two groups of lanes.
MARGIN = 4.0
BETWEEN = 5.0
#: Values beyond this are drawn at the edge: their span would be no number any more.
LARGEST = 1e300


@dataclass(frozen=True, slots=True)
class Lane:
    """A strip of the panel with one y axis.

    Parameters
    ----------
    channels : tuple of int
        The channels in it, by their place in the recording.
    group : str
        The sensor they belong to; empty where that is not known.
    unit : str
        Of its axis.
    top, bottom : float
        In pixels.
    """

    channels: tuple[int, ...]
    group: str
    unit: str
    top: float
    bottom: float

    @property
    def height(self) -> float:
        """In pixels."""
        return self.bottom - self.top

    @property
    def middle(self) -> float:
        """In pixels."""
        return (self.top + self.bottom) / 2


def group_of(name: str) -> str:
    """The sensor that a channel belongs to, by its name: ``"1"`` of ``fx1``, ``"left"`` of
    ``Fx_left``; empty where the name does not say.
    """  # noqa: D205
    name = name.strip()
    for pattern in (_AXIS_LAST, _AXIS_FIRST, _NUMBERED):
        if match := pattern.match(name):
            return str(match["sensor"] or "").lower()
    return ""


def lanes(
    channels: Sequence[Channel], shown: Iterable[str], height: float, *, overlaid: bool
) -> tuple[Lane, ...]:
    """Share out the height of the panel among the channels that are shown.

    Parameters
    ----------
    channels : sequence of Channel
        All channels of the recording.
    shown : iterable of str
        The names of those that are shown.
    height : float
        In pixels.
    overlaid : bool
        One lane for each unit; otherwise one for each channel, sensor after sensor.
    """
    wanted = set(shown)
    keyed: dict[str, list[int]] = {}
    for i, channel in enumerate(channels):
        if channel.name in wanted:
            keyed.setdefault(channel.unit if overlaid else group_of(channel.name), []).append(i)
    if overlaid:
        strips = [(tuple(members), "") for members in keyed.values()]
    else:
        strips = [((i,), group) for group, members in keyed.items() for i in members]
    breaks = len(keyed) - 1
    each = (height - breaks * BETWEEN) / max(len(strips), 1)
    found: list[Lane] = []
    top = 0.0
    for members, group in strips:
        if found and (overlaid or found[-1].group != group):
            top += BETWEEN
        found.append(Lane(members, group, channels[members[0]].unit, top, top + each))
        top += each
    return tuple(found)


def span_of(found: Extremes) -> tuple[float, float] | None:
    """The least and the greatest value of a curve; None where it has none."""
    known = ~np.isnan(found.low)
    if not known.any():
        return None
    return float(found.low[known].min()), float(found.high[known].max())


def spanning(ranges: Iterable[tuple[float, float] | None]) -> tuple[float, float] | None:
    """The least range that holds all of some ranges; None for none."""
    known = [found for found in ranges if found is not None]
    return (min(low for low, _ in known), max(high for _, high in known)) if known else None


def axis_of(lane: Lane, span: tuple[float, float] | None) -> Axis:
    """The vertical axis of a lane for values from the least to the greatest.

    Parameters
    ----------
    lane : Lane
        Where it is.
    span : tuple of float or None
        Least and greatest value; None where there is nothing to draw.
    """
    low, high = span if span is not None else (0.0, 1.0)
    low, high = (min(max(value, -LARGEST), LARGEST) for value in (low, high))
    size = max(abs(low), abs(high))
    if high - low <= 1e-9 * size or size == 0.0:  # a constant lies in the middle of its lane
        low, high = low - (0.1 * size or 1.0), high + (0.1 * size or 1.0)
    margin = min(MARGIN, lane.height / 6)
    return Axis(low, high, lane.bottom - margin, lane.top + margin)
