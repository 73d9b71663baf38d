"""From the sensors' channels to the channels that are recognised.

Two 3-axis sensors give six signals. The direction of the tangential force depends on how the
tongs are held, so that each sensor gives two: the tangential magnitude ``hypot(fx, fy)`` and the
signed normal force ``fz``. Channels of any other kind are taken as they are.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel
from forcelab.errors import InputError

_AXIS = re.compile(
    r"(?:(?P<before>.*\w)[ _.\-])?(?:f|force|(?P<german>kraft))(?P<number>\d*)[ _.\-]?"
    r"(?P<axis>[xyz])(?:[ _.\-]?(?P<behind>\w+))?",
    re.I,
)


@dataclass(frozen=True, slots=True)
class ChannelMap:
    """Which recorded columns make up each recognition channel."""

    #: Length q, recognition channels, tangential magnitudes first, then signed normals, then the
    #: rest.
    names: tuple[str, ...]
    #: Length u, the recorded columns that any of them needs, rising; the others need not be looked
    #: at.
    recorded: tuple[int, ...]
    #: Length q, what each is made of, as places in `recorded`: two for a tangential magnitude, one
    #: for any other.
    columns: tuple[tuple[int, ...], ...]

    def apply(self, signals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Compute recognition channels, shape (q, n), from the needed columns, shape (n, u)."""
        out = np.empty((len(self.names), len(signals)))
        for row, columns in zip(out, self.columns, strict=True):
            if len(columns) == 2:
                np.hypot(signals[:, columns[0]], signals[:, columns[1]], out=row)
            else:
                row[:] = signals[:, columns[0]]
        return out


def _sensors(names: Sequence[str], requested: Collection[str]) -> dict[str, dict[str, int]]:
    """Columns of each complete 3-axis force sensor, by sensor and axis, in order of appearance."""
    sensors: dict[str, dict[str, int]] = {}
    for column, name in enumerate(names):
        match = _AXIS.fullmatch(name.strip())
        # Recognisers were trained on columns such as left_fx, F1X or Kraft X before these were
        # known for axes.
        known_later = match and (match["before"] or match["german"] or match["number"])
        if match and not (known_later and name in requested):
            words = match.group("before", "number", "behind")
            sensor = sensors.setdefault(" ".join(filter(None, words)).lower(), {})
            sensor.setdefault(match["axis"].lower(), column)
    return {key: axes for key, axes in sensors.items() if set(axes) == {"x", "y", "z"}}


def find_force_axes(names: Sequence[str]) -> frozenset[str]:
    """The columns that are axes of complete 3-axis force sensors."""
    sensors = _sensors(names, ()).values()
    return frozenset(names[column] for axes in sensors for column in axes.values())


def channel_map(channels: Sequence[Channel], requested: Sequence[str] | None = None) -> ChannelMap:
    """Find the recognition channels of a recording.

    A 3-axis force sensor is known by names such as ``fx1 fy1 fz1``, ``F1X`` (as of force plates in
    C3D files), ``Fx_left``, ``left fx`` or ``force z 2``.

    `channels` length c: the recorded channels; `requested`: names of recognition channels to keep,
    in this order; all by default. What is not wanted is not computed.
    """
    names = [channel.name for channel in channels]
    sensors = _sensors(names, requested or ())
    columns_by_name: dict[str, tuple[int, ...]] = {}
    for sensor, axes in sensors.items():
        columns_by_name[f"tangential {sensor}".strip()] = (axes["x"], axes["y"])
    for sensor, axes in sensors.items():
        columns_by_name[f"normal {sensor}".strip()] = (axes["z"],)
    used = {column for columns in columns_by_name.values() for column in columns}
    for column, name in enumerate(names):
        if column not in used:
            columns_by_name[
                name if name not in columns_by_name else f"{name} (column {column + 1})"
            ] = (column,)
    chosen = list(columns_by_name) if requested is None else list(requested)
    if len(set(chosen)) < len(chosen):
        raise InputError(f"A recognition channel is named twice in {', '.join(chosen)}.")
    missing = [name for name in chosen if name not in columns_by_name]
    if missing:
        raise InputError(
            f"There is no recognition channel '{missing[0]}'; there are "
            f"{', '.join(columns_by_name)}; "
            f"choose of these, or a recogniser that was trained on them."
        )
    recorded = sorted({column for name in chosen for column in columns_by_name[name]})
    places = {column: place for place, column in enumerate(recorded)}
    made_of = tuple(tuple(places[column] for column in columns_by_name[name]) for name in chosen)
    return ChannelMap(tuple(chosen), tuple(recorded), made_of)
